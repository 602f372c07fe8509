"""Drag that grows as a power of the loose gear's speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Refined, Rig, register
from gears3d.effects.rows import Row, torque_power


@register
@dataclass(frozen=True)
class DragPower:
    """Churning and windage, C = coefficient·|ω/(1 rad/s)|^exponent against the direction of motion.

    The coefficient is the torque at 1 rad/s, so its unit is N·m for every exponent.
    Source: Kadmiri et al. 2012, eq. (7); exponents 1.5 of eq. (9), 0.59 of eqs (10) to (12), 2 for windage.

    Args:
        coefficient: torque at 1 rad/s, N·m.
        exponent: of the speed.

    >>> DragPower(coefficient=1e-3, exponent=1.5).rows(None)[0].p
    (0.001, 1.5)
    """

    coefficient: float
    exponent: float

    kind: ClassVar[str] = "drag_power"
    place: ClassVar[Place] = "torque"
    params: ClassVar[dict[str, Param]] = {
        "coefficient": Param("torque", 0.0, 1e4),
        "exponent": Param("ratio", 0.1, 4.0, linear=False, tried=(0.5, 1.5, 2.0, 2.5, 3.0), refined=Refined(0.2, 4.0)),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """One power of the speed."""
        return [torque_power(self.coefficient, self.exponent)]

    def unit_size(self, rig: Rig) -> float:
        """The coefficient that doubles the drag at the mean speed."""
        return rig.drag_torque / max(rig.mean_speed_loose, 1e-9) ** self.exponent
