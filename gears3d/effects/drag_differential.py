"""Shear between the loose gear and the shaft it runs on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Refined, Rig, register
from gears3d.effects.rows import Row, torque_linear


@register
@dataclass(frozen=True)
class DragDifferential:
    """Couette drag on the speed against the shaft, C = coefficient·(ω - shaft_speed); it drives where that is negative.

    Source: Kadmiri et al. 2012, eq. (8): coefficient = 2π·µ·L·Rs³/js; the shaft turns when another ratio is engaged.

    Args:
        coefficient: N·m·s/rad.
        shaft_speed: in the loose gear's sense of rotation, rad/s.

    >>> DragDifferential(coefficient=1e-3, shaft_speed=20.0).rows(None)[0].p
    (0.001, 20.0)
    """

    coefficient: float
    shaft_speed: float

    kind: ClassVar[str] = "drag_differential"
    place: ClassVar[Place] = "torque"
    params: ClassVar[dict[str, Param]] = {
        "coefficient": Param("rotational_damping", 0.0, 1e3),
        "shaft_speed": Param(
            "speed", -1e5, 1e5, linear=False, tried=(-1.0, 0.5, 2.0), refined=Refined(-1e5, 1e5, False)
        ),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """One linear torque about the shaft's speed."""
        return [torque_linear(self.coefficient, self.shaft_speed)]

    def unit_size(self, rig: Rig) -> float:
        """The coefficient that doubles the drag at the mean speed."""
        return rig.drag_torque / max(abs(rig.mean_speed_loose - self.shaft_speed), 1e-9)
