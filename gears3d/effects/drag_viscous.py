"""Drag torque that grows in proportion to the loose gear's speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Row, torque_linear


@register
@dataclass(frozen=True)
class DragViscous:
    """Viscous drag of bearings and encoder, C = coefficient·ω. Source: Kadmiri et al. 2012, eq. (5).

    Args:
        coefficient: N·m·s/rad.

    >>> DragViscous(coefficient=1e-3).rows(None)[0].p
    (0.001, 0.0)
    """

    coefficient: float

    kind: ClassVar[str] = "drag_viscous"
    place: ClassVar[Place] = "torque"
    params: ClassVar[dict[str, Param]] = {"coefficient": Param("rotational_damping", 0.0, 1e3)}

    def rows(self, rig: Rig) -> list[Row]:
        """One linear torque."""
        return [torque_linear(self.coefficient)]

    def unit_size(self, rig: Rig) -> float:
        """The coefficient that doubles the drag at the mean speed."""
        return rig.drag_torque / max(rig.mean_speed_loose, 1e-9)
