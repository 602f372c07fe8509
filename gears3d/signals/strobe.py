"""Whether the motion repeats: stroboscopic comparison of the impacts, and the section through them."""

from __future__ import annotations

import numpy as np

TIME_TOLERANCE = 0.01
"""In periods."""
VELOCITY_TOLERANCE = 0.05
"""Relative to the root mean square of the impact speeds."""
RECURRING = 0.95
"""Part of the impacts that must come back."""


def periodicity(
    times: np.ndarray,
    flanks: np.ndarray,
    velocities: np.ndarray,
    period: float,
    start: float,
    end: float,
    longest: int = 8,
) -> int | None:
    """Return the smallest n for which the impacts repeat every n periods of the excitation.

    Args:
        times: of the impacts that count [s], (k,).
        flanks: 0 active, 1 reverse, (k,).
        velocities: of the impacts [m/s], (k,).
        period: of the excitation [s].
        start: of what is looked at [s].
        end: of what is looked at [s].
        longest: largest n that is tried.

    Returns:
        n, or ``None`` when nothing repeats, there are no impacts, or fewer than three repetitions to judge by.

    >>> times = np.arange(12) + np.where(np.arange(12) % 2, 0.1, 0.3)
    >>> periodicity(times, np.zeros(12), np.full(12, -0.02), 1.0, 0.0, 12.0)
    2
    """
    inside = (times >= start) & (times <= end)
    times, flanks, velocities = times[inside], flanks[inside], velocities[inside]
    if not times.size:
        return None
    slack = VELOCITY_TOLERANCE * float(np.sqrt(np.mean(velocities**2)))
    most = min(longest, int((end - start) / period / 3.0 + 1e-9))
    for n in range(1, most + 1):
        shift = n * period
        later = times <= end - shift - TIME_TOLERANCE * period
        earlier = times >= start + shift + TIME_TOLERANCE * period
        found = [
            _recurring(times, flanks, velocities, which, step, TIME_TOLERANCE * period, slack)
            for which, step in ((later, shift), (earlier, -shift))
        ]
        hits = np.concatenate(found)
        if hits.size and hits.mean() >= RECURRING:
            return n
    return None


def _recurring(
    times: np.ndarray,
    flanks: np.ndarray,
    velocities: np.ndarray,
    which: np.ndarray,
    shift: float,
    time_slack: float,
    velocity_slack: float,
) -> np.ndarray:
    """Return for each of the impacts ``which`` whether an equal one lies ``shift`` away."""
    found = []
    for flank in (0, 1):
        mine = np.flatnonzero(flanks == flank)
        asked = mine[which[mine]]
        if not asked.size:
            continue
        wanted = times[asked] + shift
        right = np.clip(np.searchsorted(times[mine], wanted), 0, len(mine) - 1)
        near = np.zeros(len(asked), dtype=bool)
        for candidate in (right, np.maximum(right - 1, 0)):
            there = mine[candidate]
            close = np.abs(times[there] - wanted) <= time_slack
            near |= close & (np.abs(velocities[there] - velocities[asked]) <= velocity_slack)
        found.append(near)
    return np.concatenate(found) if found else np.zeros(0, dtype=bool)


def section(times: np.ndarray, velocities: np.ndarray, period: float) -> np.ndarray:
    """Return the Poincaré section through the impacts.

    Args:
        times: of the impacts [s], (k,).
        velocities: of the impacts [m/s], (k,).
        period: of the excitation [s].

    Returns:
        Phase in cycles, 0 to 1, and velocity [m/s], (k, 2).

    >>> section(np.array([0.25, 1.25]), np.array([-0.02, -0.03]), 1.0).tolist()
    [[0.25, -0.02], [0.25, -0.03]]
    """
    return np.column_stack([np.mod(times / period, 1.0), velocities])
