"""How long flights and contacts last."""

from __future__ import annotations

import numpy as np

ACTIVE, REVERSE, FLIGHT = 0, 1, 2
"""States of the loose gear; the first two are the codes of the flanks."""


def states(
    displacement: np.ndarray,
    active: np.ndarray | float,
    reverse: np.ndarray | float,
    tolerance: float = 0.1e-6,
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
