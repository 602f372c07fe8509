"""What torques in flight do to the rate at which a flight, followed back, leaves its flank.

A torque that changes along a flight bends its path into no parabola. The parabola through the readings of the flight
then is off where the flank was left, before the first of them: by a speed that passes for a loss that comes late.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.falling import fallen
from gears3d.diagnosis.torque import torque
from gears3d.effects import Row
from gears3d.measurement.parabolas import bend

Array = np.ndarray


def followed_back(one: Evidence, rows: Iterable[Row] | None) -> Array:
    """Return what torques in flight add to the rate of the gap where the parabola has it open slowest [m/s], (l,).

    Parabolas with a deceleration that follows the speed fit no constant torque: then the drag of the rig counts, too.

    Args:
        one: the record.
        rows: normal forms of effects; ``None`` for the drag of the rig.
    """
    seen, after = one.channels.losses, one.channels.losses.after
    step = (after[:, -1:] - after[:, :1]) / (after.shape[1] - 1)
    angle = seen.loose[:, None] + seen.ahead
    speed = np.gradient(seen.ahead, axis=1) / step
    drag = one.rig.drag_torque * np.sign(speed)
    resists = drag if rows is None else torque(rows, speed, angle, seen.time[:, None] + after)
    gained = -resists / one.rig.inertia
    path = fallen(gained, step)
    middle = 0.5 * (seen.begun + after[:, -1])[:, None]
    half = after[:, -1:] - middle
    x, change = (after - middle) / half, seen.curved[:, None] * half
    bent, rate = bend(x, change)
    basis = np.stack([np.ones_like(x), x, bent], axis=-1) * (after >= seen.begun[:, None])[..., None]
    normal = np.einsum("lga,lgb->lab", basis, basis)
    numbers = np.linalg.solve(normal, np.einsum("lga,lg->la", basis, path)[..., None])[..., 0]
    off = (numbers[:, 1] + numbers[:, 2] * rate[:, 0]) / half[:, 0]
    return one.rig.base_radius_loose * np.where(seen.flank == 0, off, -off)
