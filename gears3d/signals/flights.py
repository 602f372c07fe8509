"""Flights and contacts between the events that bound them: impacts and the ends of permanent contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from gears3d.signals.pattern import FLANKS, FLIGHT_HEIGHT_MIN

LANDED = -1
"""Index of the impact of a flight that ended without one."""


class Flights(NamedTuple):
    """Flights, one row each, in order of time.

    Args:
        start: when the flank was left [s], (n,).
        end: when the next one was touched [s], (n,).
        left: flank that was left, 0 active, 1 reverse, (n,).
        struck: flank that was touched, (n,).
        impact: index of the impact that ended it, -1 when it landed without one, (n,).
    """

    start: np.ndarray
    end: np.ndarray
    left: np.ndarray
    struck: np.ndarray
    impact: np.ndarray


def flights(
    times: np.ndarray, flanks: np.ndarray, contacts: Sequence[Sequence[float]] | np.ndarray, slack: float = 1e-9
) -> Flights:
    """Return the flights between touches: from an impact or the end of a contact to the next impact or contact.

    What lies before the first touch and after the last one is not known in full and left out.

    Args:
        times: of all impacts, the trembling ones too [s], (k,).
        flanks: 0 active, 1 reverse, (k,).
        contacts: permanent contacts as [flank, start s, end s], (c, 3).
        slack: what is no longer than this is no flight [s].

    Returns:
        The flights, as exact as times and contacts are.

    >>> found = flights(np.array([0.3, 0.9]), np.array([1, 0]), [[0, 0.0, 0.1], [1, 0.3, 0.8]])
    >>> (found.end - found.start).round(9).tolist(), found.left.tolist(), found.struck.tolist()
    ([0.2, 0.1], [0, 1], [1, 0])
    """
    table = np.asarray(contacts, dtype=float).reshape(-1, 3)
    begins = np.concatenate([times, table[:, 1]])
    ends = np.concatenate([times, table[:, 2]])
    kinds = np.concatenate([flanks, table[:, 0]]).astype(np.int64)
    hit = np.concatenate([np.arange(len(times)), np.full(len(table), LANDED)])
    order = np.lexsort((ends, begins))
    begins, ends, kinds, hit = begins[order], ends[order], kinds[order], hit[order]
    if not begins.size:
        nothing = np.zeros(0)
        return Flights(nothing, nothing, *(nothing.astype(np.int64) for _ in range(3)))
    latest = np.maximum.accumulate(ends)
    rising = np.diff(latest, prepend=-np.inf) > 0.0
    holder = np.maximum.accumulate(np.where(rising, np.arange(len(ends)), 0))
    gap = np.flatnonzero(begins[1:] - latest[:-1] > slack)
    return Flights(latest[gap], begins[gap + 1], kinds[holder[gap]], kinds[gap + 1], hit[gap + 1])


def shares(contacts: Sequence[Sequence[float]] | np.ndarray, start: float, end: float) -> dict[str, float] | None:
    """Return which part of the time the gear rests on either flank and flies.

    Args:
        contacts: permanent contacts as [flank, start s, end s], (c, 3).
        start: of what is looked at [s].
        end: of what is looked at [s].

    Returns:
        ``active_share``, ``reverse_share``, ``flight_share``, together 1; ``None`` when no time is looked at.

    >>> shares([[0, 0.0, 0.5], [1, 0.75, 2.0]], 0.25, 1.25)
    {'active_share': 0.25, 'reverse_share': 0.5, 'flight_share': 0.25}
    """
    if not end > start:
        return None
    table = np.asarray(contacts, dtype=float).reshape(-1, 3)
    inside = np.maximum(np.minimum(table[:, 2], end) - np.maximum(table[:, 1], start), 0.0)
    part = [float(inside[table[:, 0] == code].sum()) / (end - start) for code in (0, 1)]
    return {"active_share": part[0], "reverse_share": part[1], "flight_share": max(1.0 - part[0] - part[1], 0.0)}


def times_of(
    impacts: Mapping[str, np.ndarray], contacts: Sequence[Sequence[float]] | np.ndarray, start: float, end: float
) -> dict[str, Any]:
    """Return how long flights, crossings and permanent contacts last, in a few numbers.

    Flights no higher than 0.05 µm are left out, as their impacts are; what began before ``start`` is, too.

    Args:
        impacts: ``time_s``, ``flank`` and, where known, ``flight_height_m`` and ``velocity_m_s``, all impacts, (k,).
        contacts: permanent contacts as [flank, start s, end s], (c, 3).
        start: of what is looked at [s].
        end: of what is looked at [s].

    Returns:
        ``flights``, ``flight_mean_s``, ``flight_longest_s``, ``flight_height_max_m``; for each flank
        ``active_crossings`` (flights from the other flank that end on it), ``active_crossing_mean_s``,
        ``active_crossing_velocity_mean_m_s`` (of the blows that end them, bounces left out),
        ``active_contacts`` (permanent ones that ended), ``active_contact_mean_s``; and the shares of :func:`shares`.
        ``None`` where there is nothing to count.

    >>> hits = {"time_s": np.array([0.3, 0.9]), "flank": np.array([1, 0])}
    >>> found = times_of(hits, [[0, 0.0, 0.1], [1, 0.3, 0.8]], 0.0, 1.0)
    >>> found["flights"], round(found["reverse_crossing_mean_s"], 9), round(found["reverse_contact_mean_s"], 9)
    (2, 0.2, 0.5)
    """
    every = flights(impacts["time_s"], impacts["flank"], contacts)
    unknown = np.full(len(impacts["time_s"]), np.nan)
    heights = np.append(impacts.get("flight_height_m", unknown), np.nan)[every.impact]
    counts = (every.start >= start) & (every.end <= end) & ~(heights <= FLIGHT_HEIGHT_MIN)
    some = Flights(*(column[counts] for column in every))
    heights, lasted = heights[counts], some.end - some.start
    known = heights[np.isfinite(heights)]
    found: dict[str, Any] = {
        "flights": len(lasted),
        "flight_mean_s": _mean(lasted),
        "flight_longest_s": float(lasted.max()) if lasted.size else None,
        "flight_height_max_m": float(known.max()) if known.size else None,
    }
    hard = np.append(impacts.get("velocity_m_s", unknown), np.nan)[some.impact]
    table = np.asarray(contacts, dtype=float).reshape(-1, 3)
    whole = table[(table[:, 1] >= start) & (table[:, 2] < end)]
    for code, name in enumerate(FLANKS):
        across = lasted[(some.struck == code) & (some.left != code)]
        stays = (whole[:, 2] - whole[:, 1])[whole[:, 0] == code]
        found[f"{name}_crossings"], found[f"{name}_crossing_mean_s"] = len(across), _mean(across)
        blows = hard[(some.struck == code) & (some.left != code)]
        found[f"{name}_crossing_velocity_mean_m_s"] = _mean(blows[np.isfinite(blows)])
        found[f"{name}_contacts"], found[f"{name}_contact_mean_s"] = len(stays), _mean(stays)
    part = shares(contacts, start, end)
    return found | (part or dict.fromkeys(("active_share", "reverse_share", "flight_share")))


def _mean(values: np.ndarray) -> float | None:
    return float(values.mean()) if values.size else None
