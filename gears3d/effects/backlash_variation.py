"""A backlash that changes with the drive's angle."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Flank, Gear, Row, flank_harmonic


@register
@dataclass(frozen=True)
class BacklashVariation:
    """Backlash b(θ) = b + amplitude·cos(order·θ + phase), θ the drive's angle; the active flanks stay.

    Source: b(θ1) of the reverse flank, as measured in Rigaud & Perret-Liaudet 2020, fig. 2.

    Args:
        amplitude: m, along the transverse line of action.
        order: cycles per revolution of the drive.
        phase: rad.

    >>> BacklashVariation(amplitude=2e-5, order=3).rows(None)[0].p
    (0.0, 1.0, 3.0, -2e-05, 0.0)
    """

    amplitude: float
    order: int = 1
    phase: float = 0.0

    kind: ClassVar[str] = "backlash_variation"
    place: ClassVar[Place] = "geometry"
    params: ClassVar[dict[str, Param]] = {
        "amplitude": Param("length", -1e-3, 1e-3),
        "order": Param("count", 1, 1000, default=1, linear=False),
        "phase": Param("angle", -2 * pi, 2 * pi, default=0.0, linear=False, of="drive"),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """Material on the drive's reverse flanks where the gap is narrow."""
        return [flank_harmonic(Gear.DRIVE, Flank.REVERSE, self.order, -self.amplitude, self.phase)]

    def unit_size(self, rig: Rig) -> float:
        """The backlash: a variation that closes the gap."""
        return rig.backlash
