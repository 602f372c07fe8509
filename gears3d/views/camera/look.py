"""How the camera looks: what is in the picture, how wide the gap is drawn, colours or the light from behind."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import atan, cos, pi
from typing import TYPE_CHECKING

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.gears.deviation import GEARS
from gears3d.gears.outline import Outline, outline
from gears3d.views.mesh.teeth import Section, widening

if TYPE_CHECKING:
    from gears3d.gears import Pair

ZOOMS = {"mesh": 3.0, "tooth": 1.5, "gears": 0.0}
"""Height of the picture in pitches; 0 for both gears whole."""
SHAPE = 1.25
"""Width over height of a picture, as of 800 by 640 pixels."""


@dataclass(frozen=True)
class Look:
    """What the camera is set to.

    Args:
        pair: the gears.
        exaggerate: drawn gap over gap; ``None`` for a round number with which it is seen.
        zoom: ``"mesh"``, ``"tooth"`` or ``"gears"``.
        backlit: dark gears before a light, as the camera of Rigaud & Perret-Liaudet 2020 has them, without colours.
        drive_right: the drive gear on the right, as there.
        teeth: numbers of the gears' own teeth in place of those of the pairs.

    Raises:
        InputError: no zoom of that name, or teeth too thin for that gap.
    """

    pair: Pair
    exaggerate: float | None = None
    zoom: str = "mesh"
    backlit: bool = False
    drive_right: bool = False
    teeth: bool = False

    def __post_init__(self) -> None:
        if self.zoom not in ZOOMS:
            raise InputError(Fault("zoom", f"is {self.zoom!r}", did_you_mean(self.zoom, list(ZOOMS))))
        if self.exaggerate is not None and not self.exaggerate >= 1.0:
            raise InputError(Fault("exaggerate", f"is {self.exaggerate:g}", "give 1 (true scale) or more, or auto"))
        if self.factor > 1.0 and any(_tip(self.wide, which) < _SHARPEST * _tip(self.pair, which) for which in GEARS):
            what = f"is {self.factor:g}: nothing would be left of the teeth"
            raise InputError(Fault("exaggerate", what, f"give less; auto takes {widening(self.pair):g}"))

    @property
    def factor(self) -> float:
        """Drawn gap over gap."""
        return widening(self.pair) if self.exaggerate is None else self.exaggerate

    @cached_property
    def wide(self) -> Pair:
        """The pair with its backlash as wide as drawn, by thinner teeth whose active flanks stay where they are."""
        return replace(self.pair, thinning=self.pair.thinning + 0.5 * (self.factor - 1.0) * self.pair.backlash)

    @cached_property
    def section(self) -> Section:
        """The same for contacts and gaps."""
        return Section(self.pair, self.factor)

    @property
    def half(self) -> tuple[float, float]:
        """Half width and half height of a picture [m]."""
        if not ZOOMS[self.zoom]:
            tips = self.pair.drive.tip_radius, self.pair.loose.tip_radius
            return 0.515 * (self.pair.centre_distance + sum(tips)), 1.03 * max(tips)
        pitch = self.pair.drive.base_pitch / cos(self.pair.working_pressure_angle)
        high = 0.5 * ZOOMS[self.zoom] * pitch
        return SHAPE * high, high

    @property
    def centre(self) -> tuple[float, float]:
        """Middle of the picture [m], in the frame of the section: the pitch point, or the middle of both gears."""
        if ZOOMS[self.zoom]:
            return self.section.pitch_point[0] * 1e-3, 0.0
        drive, loose = self.pair.drive.tip_radius, self.pair.loose.tip_radius
        return 0.5 * (self.pair.centre_distance + loose - drive), 0.0

    @property
    def turn(self) -> float:
        """Angle by which all is turned, so that the drive gear stands where it is wanted [rad]."""
        return pi if self.drive_right else 0.0

    @cached_property
    def outlines(self) -> tuple[Outline, Outline]:
        """Sections of both gears as drawn, each in its own frame."""
        fine = CHORD * 2.0 * self.half[1]
        return outline(self.wide, "drive", fine), outline(self.wide, "loose", fine)


CHORD = 1e-4
"""Largest distance of a drawn flank from the flank, in heights of the picture."""
_SHARPEST = 0.05
"""Part of its width that a tip keeps."""


def _tip(pair: Pair, which: str) -> float:
    """Angle that a tooth spans at its tip [rad]."""
    roll = pair.gear(which).tip_roll
    return 2.0 * (pair.half_angle(which) - (roll - atan(roll)))
