"""Static transmission error of one order: flanks ahead of and behind the perfect ones."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Flank, Gear, Row, flank_harmonic


@register
@dataclass(frozen=True)
class TransmissionError:
    """Transmission error φ = amplitude·cos(order·θ + phase), φ > 0 when the loose gear is ahead.

    With ``flank = "both"`` the teeth are displaced, so the backlash keeps its width; with ``"active"`` only the
    active flank moves. Source: Rigaud & Perret-Liaudet 2020, eqs (3) and (21).

    Args:
        amplitude: m, along the transverse line of action.
        order: cycles per revolution of ``gear``.
        phase: rad.
        gear: the gear whose flanks carry it.
        flank: ``"both"`` or ``"active"``.

    >>> [row.p for row in TransmissionError(amplitude=5e-6, order=1).rows(None)]
    [(0.0, 0.0, 1.0, 5e-06, 0.0), (0.0, 1.0, 1.0, -5e-06, 0.0)]
    """

    amplitude: float
    order: int = 1
    phase: float = 0.0
    gear: str = "drive"
    flank: str = "both"

    kind: ClassVar[str] = "transmission_error"
    place: ClassVar[Place] = "geometry"
    params: ClassVar[dict[str, Param]] = {
        "amplitude": Param("length", -1e-3, 1e-3),
        "order": Param("count", 1, 1000, default=1, linear=False),
        "phase": Param("angle", -2 * pi, 2 * pi, default=0.0, linear=False, of="gear"),
        "gear": Param("choice", default="drive", choices=("drive", "loose")),
        "flank": Param("choice", default="both", choices=("both", "active")),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """Material on the active flank, and as much removed from the reverse one."""
        gear = Gear[self.gear.upper()]
        rows = [flank_harmonic(gear, Flank.ACTIVE, self.order, self.amplitude, self.phase)]
        if self.flank == "both":
            rows.append(flank_harmonic(gear, Flank.REVERSE, self.order, -self.amplitude, self.phase))
        return rows

    def unit_size(self, rig: Rig) -> float:
        """The backlash: a transmission error as large as the gap."""
        return rig.backlash
