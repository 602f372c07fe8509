"""Drag that acts only while flanks touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Gate, Row, torque_linear


@register
@dataclass(frozen=True)
class MeshDrag:
    """Viscous drag in contact, C = coefficient·ω on either flank and 0 in flight.

    Source: Ottewill et al. 2010, eq. (12): coefficient = (δcontact - δ)·I·Ω, Ω in rev/s.

    Args:
        coefficient: N·m·s/rad.

    >>> MeshDrag(coefficient=1e-3).rows(None)[0].gate.name
    'CONTACT'
    """

    coefficient: float

    kind: ClassVar[str] = "mesh_drag"
    place: ClassVar[Place] = "torque"
    params: ClassVar[dict[str, Param]] = {"coefficient": Param("rotational_damping", 0.0, 1e3, linear=False)}

    def rows(self, rig: Rig) -> list[Row]:
        """One linear torque in contact."""
        return [torque_linear(self.coefficient, gate=Gate.CONTACT)]

    def unit_size(self, rig: Rig) -> float:
        """The coefficient that doubles the drag at the mean speed, in contact."""
        return rig.drag_torque / max(rig.mean_speed_loose, 1e-9)
