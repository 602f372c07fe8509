"""Pitch deviations: which pair of teeth carries when, with tips that meet flanks outside the path of contact."""

from __future__ import annotations

from math import acos, pi, sqrt, tan
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicSpline

from gears3d.verification.challenge.physics import EDGE_POINTS

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

POINTS = EDGE_POINTS // 2  # Points of the gap outside either end of the path


def _beside(rb1: float, rb2: float, tip2: float, centre: float, reach: float, of_tip: bool) -> np.ndarray:
    """Gap where the tip of gear 2 meets the flank of gear 1 before the path of contact begins.

    The tip corner at its radius, the flank's point at radius r and both axes make a triangle; gear 1 has then turned to
    one angle and gear 2 to another, and what gear 2 lacks to the law of gearing, times Rb2, is the gap.
    """
    path, lead = sqrt(centre**2 - (rb1 + rb2) ** 2), sqrt(tip2**2 - rb2**2)
    first = sqrt((path - lead) ** 2 + rb1**2)
    r = first + (min(first * (1.0 + 2.0 * reach), centre) - first) * np.linspace(0.0, 1.0, 40 * POINTS) ** 2
    at1 = np.arccos(np.clip((centre**2 + r**2 - tip2**2) / (2.0 * centre * r), -1.0, 1.0))
    at2 = np.arccos(np.clip((centre**2 + tip2**2 - r**2) / (2.0 * centre * tip2), -1.0, 1.0))
    roll = np.sqrt(r**2 - rb1**2) / rb1
    turned1, turned2 = roll - np.arctan(roll) - at1, -at2
    turned1, turned2 = turned1 - turned1[0], turned2 - turned2[0]
    angle, gap = (turned2 if of_tip else turned1), rb1 * turned1 - rb2 * turned2
    falling = np.concatenate(([True], np.diff(np.minimum.accumulate(angle)) < 0.0))
    spline = CubicSpline(angle[falling][::-1], gap[falling][::-1])
    grid = max(-reach, angle.min()) * np.linspace(1.0, 0.0, POINTS) ** 2
    table = np.stack([grid, spline(grid), spline(grid, 1)], axis=1)
    table[-1] = 0.0
    return table


def edge_gap(scenario: Scenario) -> np.ndarray:
    """Return the gap of a pair of teeth over the drive's angle past the pitch point: none on the path of contact."""
    pair = scenario.pair()
    rb1, rb2, centre = pair.drive.base_radius, pair.loose.base_radius, pair.centre_distance
    alpha = acos((rb1 + rb2) / centre)
    before = (sqrt(pair.loose.tip_radius**2 - rb2**2) - rb2 * tan(alpha)) / rb1
    after = (sqrt(pair.drive.tip_radius**2 - rb1**2) - rb1 * tan(alpha)) / rb1
    wide = 0.5 * min(pair.drive.face_width, pair.loose.face_width) * tan(abs(pair.drive.base_helix_angle)) / rb1
    reach = 2.0 * pi / scenario.gears.drive.teeth
    head = _beside(rb1, rb2, pair.loose.tip_radius, centre, reach, of_tip=False)
    head[:, 0] -= before + wide
    tail = _beside(rb2, rb1, pair.drive.tip_radius, centre, reach, of_tip=True)
    tail = (tail * (-1.0, 1.0, -1.0))[::-1]
    tail[:, 0] += after + wide
    return np.vstack([head, tail])


def reverse_pitch_point(scenario: Scenario) -> float:
    """Return the drive's angle at which the reverse flank of its tooth 1 passes the pitch point [rad]."""
    pair = scenario.pair()
    alpha = acos((pair.drive.base_radius + pair.loose.base_radius) / pair.centre_distance)
    return 2.0 * (pair.half_angle("drive") - (tan(alpha) - alpha))
