"""Whether a series of states runs around a closed curve: the criterion of the three return times."""

from __future__ import annotations

import numpy as np

FEWEST = 100
"""States below which nothing is said."""
BALLS = (0.08, 0.04, 0.02)
"""Part of the states that a neighbourhood holds; a smaller one is an arc of a curve that is folded more closely."""
RETURNS = 9
"""Returns that a neighbourhood has at least."""
AGREED = 0.8
"""Part of the neighbourhoods that must return as a rotation does."""


def on_closed_curve(states: np.ndarray) -> bool | None:
    """Return whether the states follow each other as points of a rotation do.

    A rotation comes back to any arc after one of at most three numbers of steps, the largest of them the sum of the
    other two. A neighbourhood of a state on a closed curve is such an arc, whatever the curve's shape and however many
    loops it has; in chaos and noise the numbers of steps are of all sizes, in a periodic motion there is one.

    Args:
        states: equally long steps apart, (n, d); each column is scaled by its own spread.

    Returns:
        The verdict over all neighbourhoods; ``None`` with fewer than 100 states or without any spread.

    Source: Slater 1967, Proc. Camb. Phil. Soc. 63, 1115; as a test for invariant curves: Altmann, Cristadoro & Pazó
    2006, Phys. Rev. E 73, 056201.

    >>> angle = 2 * np.pi * 0.381966 * np.arange(300)
    >>> on_closed_curve(np.stack([np.cos(angle), np.sin(angle)], axis=1))
    True
    >>> on_closed_curve(np.random.default_rng(0).normal(size=(300, 2)))
    False
    """
    scale = states.std(axis=0)
    if len(states) < FEWEST or not scale.any():
        return None
    points = states / np.where(scale > 0.0, scale, 1.0)
    centres = points[:: max(len(points) // 60, 1)]
    counts = {max(int(part * len(points)), RETURNS) for part in BALLS}
    return any(_agreed(points, centres, count) >= AGREED for count in sorted(counts, reverse=True))


def _agreed(points: np.ndarray, centres: np.ndarray, count: int) -> float:
    """Return the part of the centres to whose ``count`` nearest points the series returns as a rotation does."""
    verdicts = []
    for centre in centres:
        distance = np.linalg.norm(points - centre, axis=1)
        inside = np.flatnonzero(distance <= np.partition(distance, count)[count])
        verdicts.append(_as_rotation(np.diff(inside)))
    return float(np.mean(verdicts))


def _as_rotation(returns: np.ndarray) -> bool:
    """Return whether numbers of steps between returns are those of a rotation, but for one in twenty at the rim."""
    sizes, counts = np.unique(returns, return_counts=True)
    order = np.argsort(-counts)[:3]
    if counts[order].sum() < 0.95 * len(returns) or len(sizes) < 2:
        return False
    three = np.sort(sizes[order])
    return len(three) < 3 or three[2] == three[0] + three[1]
