"""The largest Lyapunov exponent, estimated from a series of states alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

BLOCKS = 8
"""Stretches of the series whose exponents are compared."""
NOTHING = -27.6
"""Logarithm of a distance, relative to the spread, that is rounding."""
REFERENCES = 2500
"""States that are followed at most."""
FEWEST = 60
"""States below which nothing is estimated."""


class Exponent(NamedTuple):
    """An estimate.

    Args:
        value: per step; minus infinity when neighbours fall together.
        deviation: its standard deviation, per step.
        steps: of the series over which the growth was read.
    """

    value: float
    deviation: float
    steps: int


def exponent(states: np.ndarray, per: int = 1, apart: int = 10, longest: int = 25) -> Exponent | None:
    """Return the largest Lyapunov exponent per step of a series of states.

    Each state's nearest neighbour is followed, and the mean logarithm of the distance is fitted by a line over the
    steps until it has risen by six tenths towards that of states taken at random. The first step, in which a small
    distance turns into the growing direction, is left out where there are enough others. The deviation is that between
    stretches of the series, with the change that a fit over fewer steps would bring. With few steps to fit the estimate
    reads low by up to a fifth, and noise looks like chaos to it.

    Args:
        states: equally long steps apart, (n, d); each column is scaled by its own spread.
        per: steps in a period of the excitation; neighbours are looked for at the same phase of it.
        apart: periods that neighbours must be apart in time.
        longest: periods over which neighbours are followed at most.

    Returns:
        The estimate; ``None`` with fewer than 60 states or where no line is seen.

    Source: Rosenstein, Collins & De Luca 1993, Physica D 65, 117-134.

    >>> x = [0.3]
    >>> for _ in range(800):
    ...     x.append(4.0 * x[-1] * (1.0 - x[-1]))
    >>> found = exponent(np.array(x)[:, None])
    >>> bool(abs(found.value - np.log(2.0)) < 0.1)
    True
    """
    scale = states.std(axis=0)
    points = (states / np.where(scale > 0.0, scale, 1.0)).reshape(len(states), -1)
    if len(points) < FEWEST:
        return None
    if not scale.any():
        return Exponent(-np.inf, 0.0, 0)
    phase = 1e6 * (np.arange(len(points)) % per)
    if len(points) < 2 * (apart + 1) * per:
        return None
    near, gap = neighbours(np.column_stack([points, phase]), apart * per, 2 * apart + 2)
    rng = np.random.default_rng(0)
    one, shift = rng.integers(0, len(points), 4000), per * rng.integers(1, max(len(points) // per, 2), 4000)
    far = np.linalg.norm(points[one] - points[(one + shift) % (len(points) - len(points) % per)], axis=1)
    gaps = gap[(near >= 0) & (gap > 0.0)]
    if not gaps.size or not far.any():
        return Exponent(-np.inf, 0.0, 0) if np.any(near >= 0) else None
    far = float(np.mean(np.log(far[far > 0.0])))
    floor = float(np.mean(np.log(gaps)))
    ceiling = floor + 0.6 * (far - floor)
    reach = min(24, longest * per)
    while True:
        logs = _logs(points, near, gap, reach)
        if logs is None:
            return None
        mean = logs.mean(axis=0)
        if np.any(mean > ceiling) or reach >= longest * per:
            break
        reach = min(2 * reach, longest * per)
    if np.mean(logs[:, : reach // 2 + 1] <= NOTHING) > 0.5:
        return Exponent(-np.inf, 0.0, 0)
    below = int(np.argmax(mean > ceiling)) if np.any(mean > ceiling) else reach + 1
    first = 1 if below >= 4 else 0
    if below - first < 2:
        return None
    span = slice(first, below)
    value = _slope(mean[span])
    parts = np.array([_slope(one.mean(axis=0)[span]) for one in np.array_split(logs, BLOCKS)])
    shorter = _slope(mean[first : max(first + 2, below - max((below - first) // 3, 1))])
    deviation = float(np.hypot(parts.std(ddof=1) / np.sqrt(BLOCKS), value - shorter))
    return Exponent(value, deviation, below - first)


def _logs(points: np.ndarray, near: np.ndarray, gap: np.ndarray, reach: int) -> np.ndarray | None:
    """Return the logarithms of the distance between neighbours over the steps that follow, (rows, reach + 1)."""
    own = np.arange(len(points))
    rows = np.flatnonzero((near >= 0) & (np.maximum(near, own) + reach < len(points)) & (gap > 0.0))
    if len(rows) < FEWEST // 2:
        return None
    rows = rows[:: max(len(rows) // REFERENCES, 1)]
    follow = np.arange(reach + 1)
    distance = np.linalg.norm(points[rows[:, None] + follow] - points[near[rows][:, None] + follow], axis=2)
    return np.maximum(np.log(np.maximum(distance, 1e-300)), NOTHING)


def neighbours(points: np.ndarray, apart: int, looked_at: int) -> tuple[np.ndarray, np.ndarray]:
    """Return for each point its nearest neighbour that is far enough away in time.

    Args:
        points: in order of time, (n, d).
        apart: steps in time that it must at least be away.
        looked_at: number of nearest points among which it is looked for, itself included.

    Returns:
        Index of the neighbour, -1 where all near points are too close in time, (n,); distance, (n,).

    >>> neighbours(np.array([[0.0], [0.1], [5.0], [0.3]]), 2, 4)[0].tolist()
    [3, 3, 0, 1]
    """
    from scipy.spatial import KDTree

    most = min(looked_at, len(points))
    gaps, found = (np.asarray(one) for one in KDTree(points).query(points, k=most))
    allowed = np.abs(found - np.arange(len(points))[:, None]) >= apart
    pick = np.argmax(allowed, axis=1)
    row = np.arange(len(points))
    any_ = allowed[row, pick]
    return np.where(any_, found[row, pick], -1), gaps[row, pick]


def _slope(line: np.ndarray) -> float:
    return float(np.polyfit(np.arange(len(line)), line, 1)[0])
