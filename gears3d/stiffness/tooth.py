"""One tooth of a gear on its own involute, fillet and body."""

from __future__ import annotations

from math import cos, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.gears.rack import fillet_points, form
from gears3d.stiffness.beam import Beam, bend
from gears3d.stiffness.foundation import BODY_RATIO, foundation
from gears3d.stiffness.material import STEEL, Material

if TYPE_CHECKING:
    from gears3d.gears.gear import Gear
    from gears3d.gears.pair import Pair

Array = NDArray[np.float64]
STATIONS = 300
"""Of a fillet, and of a flank."""


class Compliance(NamedTuple):
    """By how much one tooth gives way in the direction of a force, for a unit of length along the tooth [m²/N].

    Args:
        bending: of the tooth as a cantilever.
        shear: of the tooth.
        axial: of the tooth, pressed towards its root.
        foundation: of the body under it.
    """

    bending: Array
    shear: Array
    axial: Array
    foundation: Array

    @property
    def total(self) -> Array:
        """The sum [m²/N]."""
        return self.bending + self.shear + self.axial + self.foundation


def tooth_compliance(pair: Pair, which: str, roll: ArrayLike, material: Material = STEEL) -> Compliance:
    """Return how a tooth gives way normal to its flank.

    A helical tooth bends across its own direction: its section is the transverse one with all that lies across the
    middle of the tooth, thickness and tangent of the force's angle, times cos β. Deviations and reliefs do not enter.

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.
        roll: roll angle of the flank where the force acts [rad], (m,).
        material: of the gear.

    Returns:
        The compliances for a unit of length along the tooth.

    Source: the lubricated dual-clutch transmission, eq. (9): potential energy method.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30)
    >>> low, high = tooth_compliance(Pair.from_backlash(gear, gear, 1e-4), "drive", [0.3, 0.5]).total
    >>> bool(high > low)
    True
    """
    gear, half = pair.gear(which), pair.half_angle(which)
    across = cos(gear.helix_angle)
    beam = _section(gear, half, across)
    rolls = np.asarray(roll, float)
    slant = np.arctan(np.tan(rolls - half) * across)
    radius, polar = _flank(gear, half, rolls)
    place, offset = radius * np.cos(polar), radius * np.sin(polar) * across
    bending, shear, axial = bend(beam, place, offset, slant, material)
    arm = np.maximum(place - offset * np.tan(slant) - gear.root_radius, 0.0)
    narrow = float(beam.half[0] / gear.root_radius) * cos(gear.helix_angle) ** 2  # on the wider virtual root circle
    ratio = BODY_RATIO[0] if gear.bore is None else 2.0 * gear.root_radius / gear.bore
    body = foundation(arm, slant, 2.0 * float(beam.half[0]), narrow, ratio, material)
    return Compliance(bending, shear, axial, body)


def _flank(gear: Gear, half: float, roll: Array) -> tuple[Array, Array]:
    """Distance from the axis [m] and angle from the middle of the tooth [rad] of points of the involute."""
    return gear.base_radius * np.hypot(1.0, roll), half - (roll - np.arctan(roll))


def _section(gear: Gear, half: float, across: float) -> Beam:
    """The tooth from root circle to tip; what lies across its middle is scaled."""
    lowest, first = form(gear, half)
    angles = 0.5 * pi - (0.5 * pi - first) * np.linspace(0.0, 1.0, STATIONS)
    curve = fillet_points(gear, half, angles)
    rolls = np.linspace(lowest, gear.tip_roll, STATIONS + 1)[1:]
    radius, polar = _flank(gear, half, rolls)
    radius, polar = np.append(curve[:, 0], radius), np.append(curve[:, 1], polar)
    height, side = radius * np.cos(polar), radius * np.sin(polar)
    rising = np.append(True, np.diff(np.maximum.accumulate(height)) > 0.0)
    return Beam(height[rising], across * side[rising])
