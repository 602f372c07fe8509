"""The pair's transverse section for drawing: outlines with a widened backlash, and where the teeth touch.

Lengths are in mm, the drive gear's axis is at the origin, the loose gear's at (centre_distance, 0) and teeth meet at
the pitch point moving along +y.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import cos, sin, tan
from typing import TYPE_CHECKING

import numpy as np

from gears3d.gears.gear import inv

if TYPE_CHECKING:
    from gears3d.gears import Pair

MM = 1e3
_FACTORS = np.array([1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 25, 30, 40, 50, 80, 100, 150, 200, 300, 500, 1000])


@dataclass(frozen=True)
class Section:
    """Transverse section of a pair, its backlash drawn ``factor`` times as wide.

    The reverse flanks are moved into the teeth, each gear's by half, so the pair drawn is an exact pair of the wider
    backlash; its active flanks stay where they are.

    Args:
        pair: the gears.
        factor: drawn backlash / backlash.
    """

    pair: Pair
    factor: float = 1.0

    @cached_property
    def base_radii(self) -> tuple[float, float]:
        """Base radii of drive and loose gear [mm]."""
        return self.pair.drive.base_radius * MM, self.pair.loose.base_radius * MM

    @cached_property
    def base_pitch(self) -> float:
        """Distance of neighbouring flanks along the line of action [mm]."""
        return self.pair.drive.base_pitch * MM

    @cached_property
    def backlash(self) -> float:
        """Width of the dead band as drawn [mm]."""
        return self.pair.backlash * MM * self.factor

    @cached_property
    def pitch_point(self) -> tuple[float, float]:
        """Pitch point (x, y) [mm]."""
        return self.base_radii[0] / cos(self.pair.working_pressure_angle), 0.0

    @cached_property
    def thickness(self) -> tuple[float, float]:
        """Tooth thickness angle of drive and loose gear at the working pitch circle, as drawn [rad].

        Source: ISO 21771:2007, the thicknesses and the backlash fill the working pitch.
        """
        alpha = self.pair.working_pressure_angle
        full = [2.0 * (gear.base_half_angle - inv(alpha)) for gear in (self.pair.drive, self.pair.loose)]
        surplus = sum(a * rb for a, rb in zip(full, self.base_radii, strict=True)) + self.backlash - self.base_pitch
        drive, loose = (a - 0.5 * surplus / rb for a, rb in zip(full, self.base_radii, strict=True))
        return drive, loose

    @cached_property
    def path(self) -> tuple[float, float]:
        """Ends of the path of contact along the line of action, from the pitch point [mm], in order of travel."""
        alpha = self.pair.working_pressure_angle
        ends = [gear.base_radius * MM * (gear.tip_roll - tan(alpha)) for gear in (self.pair.drive, self.pair.loose)]
        return -ends[1], ends[0]

    def normal(self, flank: np.ndarray | int) -> np.ndarray:
        """Return the unit normal of the drive's flank where it touches, (n, 2)."""
        alpha = self.pair.working_pressure_angle
        return np.array([[sin(alpha), cos(alpha)], [sin(alpha), -cos(alpha)]])[flank]

    def travel(self, angle: np.ndarray, flank: np.ndarray | int) -> np.ndarray:
        """Return how far tooth 1 of the drive has come along the line of action, 0 at the pitch point [mm]."""
        return self.base_radii[0] * (angle - np.asarray(flank) * self.thickness[0])

    def point(self, travel: np.ndarray, flank: np.ndarray | int) -> np.ndarray:
        """Return the point of the line of action where a flank has come to, (n, 2) [mm]."""
        sign = np.where(np.asarray(flank) == 0, 1.0, -1.0)
        return np.asarray(self.pitch_point) + (sign * travel)[..., None] * self.normal(flank)

    def touching(self, angle: np.ndarray, flank: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the teeth that meet on the path of contact."""
        safe = np.maximum(flank, 0)
        start, end = self._ends(safe)
        come = self.travel(angle, safe)
        first = np.ceil((come - end) / self.base_pitch).astype(int)
        most = int(np.ceil((self.path[1] - self.path[0]) / self.base_pitch))
        tooth = first[:, None] + np.arange(most)
        travel = come[:, None] - tooth * self.base_pitch
        row, column = np.nonzero((travel >= start[:, None]) & (flank >= 0)[:, None])
        return row, tooth[row, column], travel[row, column]

    def meeting(self, angle: np.ndarray, flank: np.ndarray, tooth: np.ndarray) -> np.ndarray:
        """Return the travel of a given tooth of the drive, in the turn in which it is nearest to the pitch point."""
        teeth = self.pair.drive.teeth
        come = self.travel(angle, flank) / self.base_pitch
        nearest = np.round(come)
        off = np.mod(tooth - 1 - nearest + teeth // 2, teeth) - teeth // 2
        return (come - nearest - np.where((tooth > 0) & (np.abs(off) <= 2), off, 0.0)) * self.base_pitch

    def _ends(self, flank: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ends of the path in order of travel: the reverse flanks run it from tip to root."""
        start, end = self.path
        return np.where(flank == 0, start, -end), np.where(flank == 0, end, -start)


def widened(pair: Pair, factor: float) -> Pair:
    """Return a pair with ``factor`` times the backlash, by thinner teeth whose active flanks stay where they are."""
    return replace(pair, thinning=pair.thinning + 0.5 * (factor - 1.0) * pair.backlash)


def widening(pair: Pair) -> float:
    """Return by which factor to draw the backlash so that the eye sees it: about 20 % of the base pitch."""
    tips = []
    for gear in (pair.drive, pair.loose):
        roll = gear.tip_roll
        tips.append(2.0 * (gear.base_half_angle - (roll - np.arctan(roll))) * gear.base_radius)
    room = pair.backlash + 2.0 * 0.6 * min(tips)
    wanted = min(0.2 * pair.drive.base_pitch, room) / max(pair.backlash, 1e-12)
    return float(_FACTORS[max(int(np.searchsorted(_FACTORS, wanted, "right")) - 1, 0)])
