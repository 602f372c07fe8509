"""What lies in the way of a mating tooth's tip: the root circle, the root fillet, or an undercut."""

from __future__ import annotations

from math import acos, degrees, pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.errors import Fault
from gears3d.gears.involute import inv
from gears3d.gears.rack import fillet_points, form

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gears3d.gears.pair import Pair

_ROUNDING = 1e-9
"""Slack of roll angles that should agree [rad], and of lengths in modules."""
_GRAZE = 1e-5
"""Depth from which on a tip digs into a fillet, in modules."""
_POINTS = 129
"""On a fillet."""


def interference_faults(pair: Pair) -> Iterator[Fault]:
    """Yield what keeps the teeth of a pair from rolling on each other down to the mate's tips.

    Args:
        pair: the pair.

    Yields:
        Faults: a tip that reaches below the mate's root circle, one that digs into its fillet, or one that needs flank
        where there is none, because it begins higher or is undercut.

    Source: ISO 21771:2007, equations (60), (64) to (67), (128) and (135).
    """
    for which, other in (("drive", "loose"), ("loose", "drive")):
        gear, mate = pair.gear(which), pair.gear(other)
        where = f"at a centre distance of {pair.centre_distance * 1e3:.6g} mm"
        clearance = pair.centre_distance - mate.tip_radius - gear.root_radius
        if clearance < -_ROUNDING * gear.module:
            yield Fault(
                f"{other}.addendum",
                f"is {mate.addendum:g} modules: {where} its tip reaches {-clearance * 1e6:.4g} um below the root "
                f"circle of the {which} gear",
                f"shorten the tip by at least {-clearance / gear.module:.3g} modules, or give the {which} gear more "
                "dedendum",
            )
            continue
        lowest, fillet_angle = form(gear, pair.half_angle(which))
        start, depth = pair.start_roll(which), digging(pair, which)
        rolls = f"involute from roll angle {degrees(lowest):.4g} deg, needed from {degrees(start):.4g} deg"
        if depth > _GRAZE * gear.module:
            why = f"the tip of the mate digs {depth * 1e6:.4g} um into its root"
        elif start >= lowest - _ROUNDING:
            continue
        elif fillet_angle > gear.pressure_angle + _ROUNDING:
            why = f"the rack undercuts its teeth up into the flank that the mate needs ({rolls})"
        else:
            why = f"its root begins on the flank that the mate needs ({rolls})"
        yield Fault(
            f"{which}.teeth",
            f"is {gear.teeth}: {where} {why}",
            "give more teeth, more profile shift or less addendum of the mate",
        )


def digging(pair: Pair, which: str) -> float:
    """Return how deep the mate's tip goes into the root fillet of a gear, flanks in contact [m]; negative: it clears.

    Args:
        pair: the pair.
        which: the gear whose fillet it is.

    Returns:
        Largest depth along the rack's normal over the points of the fillet that the tip passes, an estimate of first
        order; minus infinity where the tip stays above the fillet.
    """
    gear, mate = pair.gear(which), pair.gear("loose" if which == "drive" else "drive")
    half, ratio = pair.half_angle(which), mate.teeth / gear.teeth
    working = inv(pair.working_pressure_angle)
    lead = inv(acos(mate.base_radius / mate.tip_radius)) - working
    distance, tip = pair.centre_distance, mate.tip_radius
    angles = np.linspace(form(gear, half)[1], 0.5 * pi, _POINTS)
    radius, polar = fillet_points(gear, half, angles).T
    cosine = (distance**2 + tip**2 - radius**2) / (2.0 * distance * tip)
    before = np.arccos(np.minimum(cosine, 1.0))  # angle of the tip's edge before the line of centres
    across, along = tip * np.sin(before), distance - tip * np.cos(before)
    edge = half - working + (before + lead) * ratio - np.arctan2(across, along)
    depth = (polar - edge) * radius * np.cos(angles)
    return float(np.max(depth, initial=-np.inf, where=cosine <= 1.0))
