"""Effect of torques in flight and reading errors on the back-extrapolated gap rate at contact loss.

A torque that changes along a flight makes its path deviate from a parabola, and an error of the encoder does so to its
readings. The parabola through the readings of the flight is then wrong at contact loss, which precedes the first of
them: by a speed that looks like a late loss.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.falling import fallen
from gears3d.diagnosis.torque import torque
from gears3d.effects import Row
from gears3d.measured.segmentation.parabolas import bend

Array = np.ndarray


def followed_back(one: Evidence, rows: Iterable[Row] | None) -> Array:
    """Return the effect of torques in flight on the minimum gap rate of the parabola [m/s], (l,).

    Parabolas with a deceleration that follows the speed fit no constant torque: then the drag of the rig counts, too;
    ``None`` as rows stands for it.
    """
    seen, after = one.channels.losses, one.channels.losses.after
    step, (angle, speed) = _step(one), flown(one)
    drag = one.rig.drag_torque * np.sign(speed)
    resists = drag if rows is None else torque(rows, speed, angle, seen.time[:, None] + after)
    return _told_by_parabolas(one, fallen(-resists / one.rig.inertia, step))


def misread(one: Evidence, wrong: Array) -> Array:
    """Return the effect of reading errors along flights on the minimum gap rate [m/s], (l,).

    Flanks are estimated from the same readings, and so have the reading error at contact loss.

    wrong: added to the loose gear's readings at the times of its flights [rad], (l, n).
    """
    step = _step(one)
    rate = np.gradient(wrong, axis=1, edge_order=2)[:, 0] / step[:, 0]
    seen = one.channels.losses
    drawn = one.rig.base_radius_loose * np.where(seen.flank == 0, rate, -rate)
    return _told_by_parabolas(one, wrong) - drawn


def flown(one: Evidence) -> tuple[Array, Array]:
    """Return angle [rad] and speed [rad/s] of the loose gear along the flights that follow losses, each (l, n)."""
    if "flown" not in one.kept:
        seen = one.channels.losses
        one.kept["flown"] = seen.loose[:, None] + seen.ahead, np.gradient(seen.ahead, axis=1) / _step(one)
    return one.kept["flown"]


def _step(one: Evidence) -> Array:
    """Return the step of the times along flights [s], (l, 1)."""
    after = one.channels.losses.after
    return (after[:, -1:] - after[:, :1]) / (after.shape[1] - 1)


def _told_by_parabolas(one: Evidence, path: Array) -> Array:
    """Return the gap rate at the loss by the parabola through a path from the first reading on [m/s], (l,).

    path: (l, n) [rad].
    """
    if "parabola" not in one.kept:
        one.kept["parabola"] = _weights(one)
    off = np.einsum("lg,lg->l", one.kept["parabola"], path)
    return one.rig.base_radius_loose * np.where(one.channels.losses.flank == 0, off, -off)


def _weights(one: Evidence) -> Array:
    """Return the weights of points of a path in its rate at the loss by the fitted parabola [1/s], (l, n)."""
    seen, after = one.channels.losses, one.channels.losses.after
    middle = 0.5 * (seen.begun + after[:, -1])[:, None]
    half = after[:, -1:] - middle
    x, change = (after - middle) / half, seen.curved[:, None] * half
    bent, rate = bend(x, change)
    basis = np.stack([np.ones_like(x), x, bent], axis=-1) * (after >= seen.begun[:, None])[..., None]
    wanted = np.stack([np.zeros_like(rate[:, 0]), np.ones_like(rate[:, 0]), rate[:, 0]], axis=-1) / half
    numbers = np.linalg.solve(np.einsum("lga,lgb->lab", basis, basis), wanted[..., None])
    return (basis @ numbers)[..., 0]
