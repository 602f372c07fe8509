"""Errors that impacts of one kind share: a motion that comes again is read with the same errors each time."""

from __future__ import annotations

import numpy as np

from gears3d.identify.restitution.pairs import Pairs

EXPECTED, BETWEEN = 0.2, 0.7
"""Share of the errors that repeats: its typical size, and the standard deviation of its logarithm between records."""
SHARES = np.geomspace(0.02, 6.0, 60)
"""Shares that are weighed."""
STRAY = 3.0
"""Deviations at which what is left of a pair is cut."""


def groups(pairs: Pairs) -> np.ndarray:
    """Return the group of each pair: record, flank, where the approach came from and where the rebound goes, (n,).

    Args:
        pairs: impacts.

    >>> ones = np.ones(4)
    >>> four = Pairs(np.array([0, 0, 1, 1]), ones, np.zeros(4, int), *[ones] * 6, np.array([3, 2, 2, 2]))
    >>> groups(four).tolist()
    [1, 0, 2, 2]
    """
    code = (pairs.record.astype(int) * 2 + pairs.flank.astype(int)) * 4 + pairs.kind.astype(int)
    return np.unique(code, return_inverse=True)[1]


def repeated(
    pairs: Pairs, columns: np.ndarray, off: np.ndarray, scatter: float, noise: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return what errors that repeat add to the covariance of a law's numbers, (p, p), and their share of all errors.

    Every group of impacts has one error in common: the drive's motion, the flank and the rounding to counts are off by
    the same at the same phase of the motion, however often it comes. Its share of the errors is weighed by restricted
    likelihood, from how the groups differ beyond the law, and from what records usually have.

    Args:
        pairs: impacts.
        columns: of the law, (n, p).
        off: rebound over approach less the law, (n,).
        scatter: of the coefficient, which does not repeat.
        noise: of rebound over approach, (n,).

    Source: Patterson & Thompson 1971 for the restricted likelihood; Laird & Ware 1982 for effects of groups.
    """
    weight = 1.0 / (scatter**2 + noise**2)
    own = groups(pairs)
    count = int(own.max()) + 1
    off = np.clip(off, -STRAY / np.sqrt(weight), STRAY / np.sqrt(weight))
    lean = np.array([np.bincount(own, weight * noise * column, count) for column in columns.T])
    pull, size = np.bincount(own, weight * noise * off, count), np.bincount(own, weight * noise**2, count)
    inside, right = (columns.T * weight) @ columns, columns.T @ (weight * off)
    told = np.zeros(len(SHARES))
    for k, share in enumerate(SHARES):
        grip = share**2 / (1.0 + share**2 * size)
        normal, rest = inside - (lean * grip) @ lean.T, right - lean @ (grip * pull)
        misfit = -float(grip @ pull**2) - float(rest @ np.linalg.solve(normal, rest))
        spread = float(np.log1p(share**2 * size).sum()) + float(np.linalg.slogdet(normal)[1])
        told[k] = -0.5 * (misfit + spread + (np.log(share / EXPECTED) / BETWEEN) ** 2)
    chance = np.exp(told - told.max())
    square = float(chance @ SHARES**2 / chance.sum())
    moved = np.linalg.solve(inside, lean)  # of the numbers by an error of each group
    return square * moved @ moved.T, float(np.sqrt(square))
