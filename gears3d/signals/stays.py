"""How long flights and contacts last, from samples alone: where impacts and contacts were not written down."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

ACTIVE, REVERSE, FLIGHT = 0, 1, 2
"""States of the loose gear; the first two are the codes of the flanks."""
NEAR = 0.1e-6
"""Closer to a flank than this counts as touching it [m]."""


def states(
    displacement: np.ndarray,
    active: np.ndarray | float,
    reverse: np.ndarray | float,
    tolerance: float = NEAR,
) -> np.ndarray:
    """Return for each sample whether the gear rests on a flank or flies.

    Args:
        displacement: of the loose gear [m], (n,).
        active: position of the active flank [m], one number or (n,).
        reverse: position of the reverse flank [m], one number or (n,).
        tolerance: distance from a flank that still counts as touching [m].

    Returns:
        0 on the active flank, 1 on the reverse flank, 2 in flight, int8 (n,).

    >>> states(np.array([0.0, 1e-4, 2e-4]), 0.0, 2e-4).tolist()
    [0, 2, 1]
    """
    state = np.full(np.shape(displacement), FLIGHT, dtype=np.int8)
    state[displacement >= reverse - tolerance] = REVERSE
    state[displacement <= active + tolerance] = ACTIVE
    return state


def durations(time: np.ndarray, state: np.ndarray) -> dict[int, np.ndarray]:
    """Return how long each stay in a state lasts; the first and the last, which are cut off, are left out.

    The gear leaves a flank slowly: a stay that ends in a flight looks longer than it was, by the time that it took to
    get out of the tolerance (:func:`contacts` mends that).

    Args:
        time: of the samples, rising [s], (n,).
        state: of the samples, as :func:`states` gives them, (n,).

    Returns:
        For each state of :func:`states` the durations [s] in order of time, to within one sampling interval.

    >>> durations(np.arange(6.0), np.array([0, 2, 2, 1, 1, 1]))[2].tolist()
    [2.0]
    """
    change = np.flatnonzero(np.diff(state)) + 1
    length = np.diff(time[change])
    kind = state[change[:-1]]
    return {code: length[kind == code] for code in (ACTIVE, REVERSE, FLIGHT)}


def contacts(
    time: np.ndarray,
    displacement: np.ndarray,
    active: np.ndarray | float,
    reverse: np.ndarray | float,
    impacts: Mapping[str, np.ndarray],
    tolerance: float = NEAR,
) -> np.ndarray:
    """Return the permanent contacts that samples and impacts show.

    Contact is lost where the force on the flank passes zero, so the gap grows with the third power of time (with the
    second where the force jumps); that root of it, or another that is straighter, is carried back to zero. A stay near
    a flank that its last impact's rebound explains is a bounce, no contact.

    Args:
        time: of the samples, rising [s], (n,).
        displacement: of the loose gear [m], (n,).
        active: position of the active flank [m], one number or (n,).
        reverse: position of the reverse flank [m], one number or (n,).
        impacts: ``time_s``, ``flank`` and, where known, ``rebound_m_s``, (k,).
        tolerance: distance from a flank that still counts as touching [m].

    Returns:
        Flank, start [s] and end [s], (c, 3).

    >>> time = np.linspace(0.0, 1.0, 1001)
    >>> path = 1e-3 * np.maximum(time - 0.5, 0.0) ** 3
    >>> none = {"time_s": np.zeros(0), "flank": np.zeros(0)}
    >>> contacts(time, path, 0.0, 1.0, none).round(4).tolist()
    [[0.0, 0.0, 0.5]]
    """
    state = states(displacement, active, reverse, tolerance)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(state)) + 1, [len(state)]])
    gaps = (displacement - active, reverse - displacement)
    hits, struck = impacts["time_s"], impacts["flank"]
    rebounds = np.abs(impacts.get("rebound_m_s", np.full(len(hits), np.nan)))
    found = []
    for first, stop in pairwise(edges):
        flank = int(state[first]) if len(state) else FLIGHT
        if flank == FLIGHT:
            continue
        begin = time[first]
        before = time[first - 1] if first else -np.inf
        last = time[stop] if stop < len(time) else np.inf
        mine = np.flatnonzero((struck == flank) & (hits > before) & (hits < last))
        if mine.size:
            begin = hits[mine[-1]]
            if time[stop - 1] - begin < 3.0 * tolerance / (rebounds[mine[-1]] or np.inf):
                continue
        end = _departure(time, gaps[flank], stop, tolerance) if stop < len(time) else time[-1]
        if end > begin:
            found.append((float(flank), float(begin), float(end)))
    return np.array(found).reshape(-1, 3)


def _departure(time: np.ndarray, gap: np.ndarray, stop: int, tolerance: float) -> float:
    """Return when the gap that is open at sample ``stop`` began to open [s]."""
    some = slice(stop, min(stop + 64, len(time)))
    low = (gap[some] < 30.0 * tolerance) | (np.arange(len(gap[some])) < 4)
    rising = low & np.logical_and.accumulate(np.diff(gap[some], prepend=-np.inf) > 0)
    since, high = time[some][rising] - time[stop], gap[some][rising]
    if len(high) < 2:
        return float(time[stop])
    best, end = np.inf, 0.0
    for power in (3, 2, 1):
        slope, root = np.polyfit(since, high ** (1.0 / power), 1)
        error = float(np.abs((slope * since + root) ** power - high).max())
        if error < best and (len(high) > 2 or power == 3):
            best, end = error, -root / slope
    return float(time[stop] + min(end, 0.0))
