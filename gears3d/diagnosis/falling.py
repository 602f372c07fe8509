"""What torques in flight come to at the points of flights: accelerations integrated twice along their fine paths."""

from __future__ import annotations

import numpy as np

from gears3d.diagnosis.evidence import Evidence

Array = np.ndarray


def fallen(values: Array, step: Array) -> Array:
    """Return what an acceleration comes to when it is integrated twice from rest, (f, n).

    Args:
        values: at points of equal distance, straight lines between, (f, n).
        step: their distance, (f, 1).

    >>> fallen(np.full((1, 3), 2.0), np.ones((1, 1))).tolist()
    [[0.0, 1.0, 4.0]]
    """
    rate, total = np.zeros_like(values), np.zeros_like(values)
    rate[:, 1:] = np.cumsum(0.5 * (values[:, 1:] + values[:, :-1]) * step, axis=1)
    total[:, 1:] = np.cumsum(rate[:, :-1] * step + step**2 * (values[:, :-1] / 3.0 + values[:, 1:] / 6.0), axis=1)
    return total


def held_back(one: Evidence, slowing: Array) -> Array:
    """Return the angle by which decelerations hold flights back at their points [rad], (f, BINS).

    Args:
        one: the record.
        slowing: on the fine grid of its flights, real or complex [rad/s²], (f, n).
    """
    if not len(one.at):
        return np.zeros_like(one.at)
    total = fallen(slowing, step_of(one))
    below, part, each = between(one)
    return (1.0 - part) * total[each, below] + part * total[each, below + 1]


def step_of(one: Evidence) -> Array:
    """Return the step of each flight's fine grid [s], (f, 1).

    Args:
        one: the record.
    """
    time = one.fine[0]
    return (time[:, -1:] - time[:, :1]) / (time.shape[1] - 1)


def between(one: Evidence) -> tuple[Array, Array, Array]:
    """Return the fine points before those of the flights, the part of the way to the next, and whose they are.

    Args:
        one: the record.
    """
    below = np.clip(one.at.astype(int), 0, one.fine[0].shape[1] - 2)
    return below, one.at - below, np.arange(len(below))[:, None]
