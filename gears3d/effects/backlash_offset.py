"""A backlash other than the one the scenario states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Flank, Gear, Row, flank_harmonic


@register
@dataclass(frozen=True)
class BacklashOffset:
    """The dead band is wider by ``offset``; the active flanks stay, the drive's reverse flanks lose material.

    Source: b in s = φ + b of the reverse flank, Rigaud & Perret-Liaudet 2020, eq. (18).

    Args:
        offset: m, along the transverse line of action.

    >>> BacklashOffset(offset=2e-5).rows(None)[0].p
    (0.0, 1.0, 0.0, -2e-05, 0.0)
    """

    offset: float

    kind: ClassVar[str] = "backlash_offset"
    place: ClassVar[Place] = "geometry"
    params: ClassVar[dict[str, Param]] = {"offset": Param("length", -5e-3, 5e-3)}

    def rows(self, rig: Rig) -> list[Row]:
        """A deviation of order 0, the same at every angle."""
        return [flank_harmonic(Gear.DRIVE, Flank.REVERSE, 0, -self.offset, 0.0)]

    def unit_size(self, rig: Rig) -> float:
        """The backlash itself."""
        return rig.backlash
