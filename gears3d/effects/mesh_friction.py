"""Friction of the flanks, in proportion to the force between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Row, torque_friction


@register
@dataclass(frozen=True)
class MeshFriction:
    """Resisting torque coefficient·Rb2·N against the loose gear's motion, N the force along the line of action.

    In an impact it acts in proportion to the impulse P: J·Δω = Rb2·P·(1 ∓ coefficient), - on the active and + on the
    reverse flank of a gear that turns forwards. Rigid flanks on an imposed drive follow the same path and rebound
    with the same restitution for any friction: it then alters forces and impulses, not the motion. It alters the
    motion of compliant flanks (``tooth_compliance``).
    Source: Ottewill et al. 2010, discussion of case iv (friction that varies with load).

    Args:
        coefficient: torque over Rb2·N, less than 1.

    >>> MeshFriction(coefficient=0.05).rows(None)[0].p
    (0.05,)
    """

    coefficient: float

    kind: ClassVar[str] = "mesh_friction"
    place: ClassVar[Place] = "torque"
    params: ClassVar[dict[str, Param]] = {"coefficient": Param("ratio", 0.0, 0.9)}

    def rows(self, rig: Rig) -> list[Row]:
        """One torque in proportion to the flank force."""
        return [torque_friction(self.coefficient)]

    def unit_size(self, rig: Rig) -> float:
        """Friction as strong as the flank force itself."""
        return 1.0
