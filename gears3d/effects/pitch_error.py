"""One tooth with a single pitch deviation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Flank, Gear, Row, flank_tooth
from gears3d.errors import Fault, InputError


@register
@dataclass(frozen=True)
class PitchError:
    """One tooth displaced by ``offset`` along the transverse line of action; > 0 as a positive transmission error.

    The active flank of the tooth gains material of that thickness and the reverse flank loses as much; with one flank
    alone only that one moves. A tooth that is 20 µm thick is +10 µm on its active and -10 µm on its reverse flank.
    Source: single pitch deviation f_p of ISO 1328-1, measured along the line of action.

    Args:
        offset: m.
        tooth: number in order of meshing, 1 = at the pitch point when the gear's angle is 0.
        gear: the tooth's gear.
        flank: ``"active"``, ``"reverse"`` or ``"both"``.

    >>> [row.p for row in PitchError(offset=1e-5, tooth=7, gear="loose").rows(None)]
    [(1.0, 0.0, 7.0, 1e-05), (1.0, 1.0, 7.0, -1e-05)]
    """

    offset: float
    tooth: int
    gear: str = "drive"
    flank: str = "both"

    kind: ClassVar[str] = "pitch_error"
    place: ClassVar[Place] = "geometry"
    params: ClassVar[dict[str, Param]] = {
        "offset": Param("length", -1e-3, 1e-3),
        "tooth": Param("count", 1, 1000, linear=False, of="gear"),
        "gear": Param("choice", default="drive", choices=("drive", "loose")),
        "flank": Param(
            "choice", default="both", choices=("active", "reverse", "both"), tried=("both", "active", "reverse")
        ),
    }

    def rows(self, rig: Rig | None) -> list[Row]:
        """Material on the active flank, and as much removed from the reverse one; an unknown tooth is an InputError."""
        teeth = None if rig is None else rig.teeth_drive if self.gear == "drive" else rig.teeth_loose
        if teeth is not None and self.tooth > teeth:
            message = f"is {self.tooth}, but the {self.gear} gear has {teeth} teeth"
            raise InputError(Fault("tooth", message, f"give 1 to {teeth}"))
        gear = Gear[self.gear.upper()]
        sides = ((Flank.ACTIVE, self.offset), (Flank.REVERSE, -self.offset))
        return [
            flank_tooth(gear, side, self.tooth, size)
            for side, size in sides
            if self.flank in ("both", side.name.lower())
        ]

    def unit_size(self, rig: Rig) -> float:
        """The backlash: a deviation that fills the gap."""
        return rig.backlash
