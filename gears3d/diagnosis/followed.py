"""What torques in flight and wrong readings do to the rate at which a flight, followed back, leaves its flank.

A torque that changes along a flight bends its path into no parabola, and an encoder's wave so bends what is read of
it. The parabola through the readings of the flight then is off where the flank was left, before the first of them: by a
speed that passes for a loss that comes late.
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
    """Return what torques in flight add to the rate of the gap where the parabola has it open slowest [m/s], (l,).

    Parabolas with a deceleration that follows the speed fit no constant torque: then the drag of the rig counts, too.

    Args:
        one: the record.
        rows: normal forms of effects; ``None`` for the drag of the rig.
    """
    seen, after = one.channels.losses, one.channels.losses.after
    step, (angle, speed) = _step(one), flown(one)
    drag = one.rig.drag_torque * np.sign(speed)
    resists = drag if rows is None else torque(rows, speed, angle, seen.time[:, None] + after)
    return _told_by_parabolas(one, fallen(-resists / one.rig.inertia, step))


def misread(one: Evidence, wrong: Array) -> Array:
    """Return what wrong readings along flights add to the rate of the gap where it opens slowest [m/s], (l,).

    Flanks are drawn as they are read, and so have the error that readings have when the flank is left.

    Args:
        one: the record.
        wrong: what is added to the loose gear's readings at the times of its flights [rad], (l, n).
    """
    step = _step(one)
    rate = np.gradient(wrong, axis=1, edge_order=2)[:, 0] / step[:, 0]
    seen = one.channels.losses
    drawn = one.rig.base_radius_loose * np.where(seen.flank == 0, rate, -rate)
    return _told_by_parabolas(one, wrong) - drawn


def flown(one: Evidence) -> tuple[Array, Array]:
    """Return angle [rad] and speed [rad/s] of the loose gear along the flights that follow losses, each (l, n).

    Args:
        one: the record.
    """
    if "flown" not in one.kept:
        seen = one.channels.losses
        one.kept["flown"] = seen.loose[:, None] + seen.ahead, np.gradient(seen.ahead, axis=1) / _step(one)
    return one.kept["flown"]


def _step(one: Evidence) -> Array:
    """Return the step of the times along flights [s], (l, 1)."""
    after = one.channels.losses.after
    return (after[:, -1:] - after[:, :1]) / (after.shape[1] - 1)


def _told_by_parabolas(one: Evidence, path: Array) -> Array:
    """Return the rate of the gap at the loss by the parabola through a path from the first reading on [m/s], (l,).

    Args:
        one: the record.
        path: of the loose gear, from the loss on [rad], (l, n).
    """
    if "parabola" not in one.kept:
        one.kept["parabola"] = _weights(one)
    off = np.einsum("lg,lg->l", one.kept["parabola"], path)
    return one.rig.base_radius_loose * np.where(one.channels.losses.flank == 0, off, -off)


def _weights(one: Evidence) -> Array:
    """Return by what points of a path count for its rate at the loss, by the parabola through them [1/s], (l, n)."""
    seen, after = one.channels.losses, one.channels.losses.after
    middle = 0.5 * (seen.begun + after[:, -1])[:, None]
    half = after[:, -1:] - middle
    x, change = (after - middle) / half, seen.curved[:, None] * half
    bent, rate = bend(x, change)
    basis = np.stack([np.ones_like(x), x, bent], axis=-1) * (after >= seen.begun[:, None])[..., None]
    wanted = np.stack([np.zeros_like(rate[:, 0]), np.ones_like(rate[:, 0]), rate[:, 0]], axis=-1) / half
    numbers = np.linalg.solve(np.einsum("lga,lgb->lab", basis, basis), wanted[..., None])
    return (basis @ numbers)[..., 0]
