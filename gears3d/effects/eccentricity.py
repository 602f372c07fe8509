"""A gear whose teeth are eccentric to its axis of rotation."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Gear, Row, flank_eccentric


@register
@dataclass(frozen=True)
class Eccentricity:
    """The teeth's axis is ``offset`` away from the axis of rotation; transmission error *and* backlash vary with it.

    To first order in the offset, αw the working pressure angle and x = θ + phase of the drive, the active flank moves
    by offset·sin(x + αw) along the line of action and the reverse flank by offset·sin(x - αw); of the loose gear by
    -offset·sin(x - αw) and -offset·sin(x + αw). The backlash changes by -2·offset·sin αw·cos x with either.
    Source: geometry; order 1 of the transmission error in Rigaud & Perret-Liaudet 2020, eq. (21).

    Args:
        offset: m.
        gear: whose teeth are eccentric.
        phase: direction of the offset when the gear's angle is 0, from the mate's axis in the gear's own sense of
            rotation, rad.

    >>> Eccentricity(offset=2e-5, gear="loose").rows(None)[0].p
    (1.0, 2e-05, 0.0)
    """

    offset: float
    gear: str = "drive"
    phase: float = 0.0

    kind: ClassVar[str] = "eccentricity"
    place: ClassVar[Place] = "geometry"
    params: ClassVar[dict[str, Param]] = {
        "offset": Param("length", -1e-3, 1e-3),
        "gear": Param("choice", default="drive", choices=("drive", "loose")),
        "phase": Param("angle", -2 * pi, 2 * pi, default=0.0, linear=False, of="gear"),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """One shifted axis."""
        return [flank_eccentric(Gear[self.gear.upper()], self.offset, self.phase)]

    def unit_size(self, rig: Rig) -> float:
        """The backlash: flanks with a run-out as large as the gap."""
        return rig.backlash
