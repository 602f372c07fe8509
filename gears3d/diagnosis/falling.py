"""Angle deficits of flights by torques: accelerations integrated twice along their fine paths."""

from __future__ import annotations

import numpy as np

from gears3d.diagnosis.evidence import Evidence

Array = np.ndarray


def fallen(values: Array, step: Array) -> Array:
    """Return the double integral of an acceleration from rest, with linear interpolation, (f, n).

    values: (f, n); step: (f, 1).

    >>> fallen(np.full((1, 3), 2.0), np.ones((1, 1))).tolist()
    [[0.0, 1.0, 4.0]]
    """
    rate, total = np.zeros_like(values), np.zeros_like(values)
    rate[:, 1:] = np.cumsum(0.5 * (values[:, 1:] + values[:, :-1]) * step, axis=1)
    total[:, 1:] = np.cumsum(rate[:, :-1] * step + step**2 * (values[:, :-1] / 3.0 + values[:, 1:] / 6.0), axis=1)
    return total


def held_back(one: Evidence, slowing: Array) -> Array:
    """Return the angle deficit of flights at their points by decelerations [rad], (f, BINS).

    slowing: on the fine grid of flights, real or complex [rad/s²], (f, n).
    """
    if not len(one.at):
        return np.zeros_like(one.at)
    total = fallen(slowing, step_of(one))
    below, part, each = between(one)
    return (1.0 - part) * total[each, below] + part * total[each, below + 1]


def step_of(one: Evidence) -> Array:
    """Return the step of each flight's fine grid [s], (f, 1)."""
    time = one.fine[0]
    return (time[:, -1:] - time[:, :1]) / (time.shape[1] - 1)


def between(one: Evidence) -> tuple[Array, Array, Array]:
    """Return the fine points before those of the flights, the fraction to the next one, and the flight of each."""
    below = np.clip(one.at.astype(int), 0, one.fine[0].shape[1] - 2)
    return below, one.at - below, np.arange(len(below))[:, None]
