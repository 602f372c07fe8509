"""Restitution that changes with the speed of the impact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Row, impact_slope


@register
@dataclass(frozen=True)
class RestitutionSpeed:
    """Linear law e = e0 + slope·|v|, clipped to [0, 1]. Source: Kadmiri et al. 2012, fig. 7.

    Args:
        slope: s/m, negative when hard impacts lose more.

    >>> RestitutionSpeed(slope=-4.0).rows(None)[0].p
    (-4.0,)
    """

    slope: float

    kind: ClassVar[str] = "restitution_speed"
    place: ClassVar[Place] = "impact"
    params: ClassVar[dict[str, Param]] = {"slope": Param("slowness", -1e3, 1e3)}

    def rows(self, rig: Rig) -> list[Row]:
        """One slope."""
        return [impact_slope(self.slope)]

    def unit_size(self, rig: Rig) -> float:
        """The slope that changes e by its own size at a typical impact, √(2·F/m·b): a fall across the backlash."""
        acceleration = rig.drag_torque * rig.base_radius_loose / rig.inertia
        return max(rig.restitution, 0.1) / max((2 * acceleration * rig.backlash) ** 0.5, 1e-9)
