"""All teeth in contact: how a place of the path of contact gives way, slices of helical teeth, the sum over pairs."""

from __future__ import annotations

from math import cos, pi, tan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.gears.deviation import FLANKS, index_of
from gears3d.stiffness.material import STEEL, Material
from gears3d.stiffness.tooth import tooth_compliance

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair

Array = NDArray[np.float64]
POINTS = 1001
"""Of the path of contact, where it is summed up."""


def contact_path(pair: Pair) -> tuple[float, float]:
    """Return where the path of contact begins and ends, from the pitch point in the sense of its motion [m].

    Args:
        pair: the pair.

    Source: ISO 21771:2007, path of contact between the tip circles.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30)
    >>> begin, end = contact_path(Pair.from_backlash(gear, gear, 1e-4))
    >>> bool(abs(begin + end) < 1e-12)
    True
    """
    tangent = tan(pair.working_pressure_angle)
    begin, end = (gear.base_radius * (gear.tip_roll - tangent) for gear in (pair.loose, pair.drive))
    return -begin, end


def pair_stiffness(pair: Pair, place: ArrayLike, material: Material = STEEL) -> Array:
    """Return the stiffness of two teeth, normal to their flanks, for a unit of length of their line of contact.

    Args:
        pair: the pair.
        place: of the contact, from the pitch point along the path of contact in the sense of its motion [m].
        material: of both gears.

    Returns:
        Stiffness [N/m²], 0 where these teeth do not touch.

    Source: the lubricated dual-clutch transmission, eq. (9).

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30)
    >>> [round(float(k) / 1e9, 1) for k in pair_stiffness(Pair.from_backlash(gear, gear, 1e-4), [0.0, 0.1])]
    [15.3, 0.0]
    """
    at = np.asarray(place, float)
    begin, end = contact_path(pair)
    inside = np.clip(at, begin, end)
    tangent = tan(pair.working_pressure_angle)
    drive = tooth_compliance(pair, "drive", tangent + inside / pair.drive.base_radius, material)
    loose = tooth_compliance(pair, "loose", tangent - inside / pair.loose.base_radius, material)
    stiffness = 1.0 / (drive.total + loose.total + material.hertz)
    return np.where((at >= begin) & (at <= end), stiffness, 0.0)


def mesh_stiffness(
    pair: Pair, theta: ArrayLike, flank: str = "active", slices: int | None = None, material: Material = STEEL
) -> Array:
    """Return the stiffness of all pairs of teeth in contact, along the transverse line of action.

    Slices across the face give way by themselves; without a number there are infinitely many. Along the normal of a
    helical tooth the stiffness is that over cos² of the base helix angle.

    Args:
        pair: the pair.
        theta: angle of the drive gear [rad], (n,).
        flank: ``"active"`` or ``"reverse"``, the side on which the gears rest.
        slices: how many, each at its middle; ``None``: the limit of ever more.
        material: of both gears.

    Returns:
        Stiffness [N/m], (n,).

    Raises:
        InputError: unknown flank.

    Source: the lubricated dual-clutch transmission, section 2.2: slices, summed over the pairs in contact.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30, face_width=0.01)
    >>> single, double = mesh_stiffness(Pair.from_backlash(gear, gear, 1e-4), [0.0, 0.1])
    >>> bool(1.5 * single < double < 2.0 * single)
    True
    """
    side = 1.0 - 2.0 * index_of(flank, FLANKS, "flank")
    angles = np.asarray(theta, float)
    first = pair.drive.base_radius * side * angles + (0.0 if side > 0.0 else reverse_lead(pair))
    width = min(pair.drive.face_width, pair.loose.face_width)
    slope, pitch = tan(pair.drive.base_helix_angle), pair.drive.base_pitch
    reach = 0.5 * abs(slope) * width
    begin, end = contact_path(pair)
    # whole pitches that bring any part of any line between begin and end
    low, high = np.floor((np.min(first) - reach - end) / pitch), np.ceil((np.max(first) + reach - begin) / pitch)
    places = first[..., None] - pitch * np.arange(low, high + 1)
    if slices is None and reach > 0.0:
        total = _swept(pair, places, reach, material) * width / (2.0 * reach)
    else:
        count = slices or 1
        heights = ((np.arange(count) + 0.5) / count - 0.5) * width
        total = pair_stiffness(pair, places[..., None] + slope * heights, material).sum(axis=-1) * width / count
    return total.sum(axis=-1) * cos(pair.drive.base_helix_angle)  # /cos: longer line, cos²: transverse


def reverse_lead(pair: Pair) -> float:
    """Return where the reverse flank of tooth 1 is touched at drive angle 0, along its own path of contact [m].

    Args:
        pair: the pair.
    """
    angle = pair.working_pressure_angle
    return 2.0 * pair.drive.base_radius * (pair.half_angle("drive") - (tan(angle) - angle))


def _swept(pair: Pair, places: Array, reach: float, material: Material) -> Array:
    """Integral of the pair stiffness over the path that each line of contact covers [N/m]."""
    begin, end = contact_path(pair)
    path = begin + (end - begin) * 0.5 * (1.0 - np.cos(pi * np.linspace(0.0, 1.0, POINTS)))
    stiffness = pair_stiffness(pair, np.clip(path, begin, end), material)
    slopes = np.diff(stiffness) / np.diff(path)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (stiffness[1:] + stiffness[:-1]) * np.diff(path))])

    def up_to(place: Array) -> Array:
        at = np.clip(place, begin, end)
        i = np.clip(np.searchsorted(path, at) - 1, 0, POINTS - 2)
        along = at - path[i]
        return total[i] + along * (stiffness[i] + 0.5 * along * slopes[i])

    return up_to(places + reach) - up_to(places - reach)
