"""Compliant teeth: the flank force grows with the overlap instead of being an impulse."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Refined, Rig, register
from gears3d.effects.rows import Row, gap_spring


@register
@dataclass(frozen=True)
class ToothCompliance:
    """Spring and damper between the flanks, along the transverse line of action; the force never pulls.

    It replaces the restitution law. Source: the penalty model of Rigaud & Perret-Liaudet 2020, section 6.3.

    Args:
        stiffness: N/m.
        damping: N·s/m.

    >>> ToothCompliance(stiffness=2.6e6, damping=100.0).rows(None)[0].p
    (2600000.0, 100.0)
    """

    stiffness: float
    damping: float = 0.0

    kind: ClassVar[str] = "tooth_compliance"
    place: ClassVar[Place] = "gap_force"
    params: ClassVar[dict[str, Param]] = {
        "stiffness": Param("stiffness", 1e2, 1e12, linear=False),
        "damping": Param("damping", 0.0, 1e9, default=0.0, refined=Refined(1e-9, 1e9)),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """One spring with its damper."""
        return [gap_spring(self.stiffness, self.damping)]

    def unit_size(self, rig: Rig) -> float:
        """The stiffness whose deflection under the drag is the whole backlash."""
        return rig.drag_torque / rig.base_radius_loose / rig.backlash
