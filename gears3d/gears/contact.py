"""Where ideal flanks touch, how they are curved there and how fast they slide."""

from __future__ import annotations

from math import cos, pi, sin, tan
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.gears.deviation import FLANKS, index_of

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair

Array = NDArray[np.float64]


class ContactLines(NamedTuple):
    """The straight lines in which the teeth of an ideal pair touch.

    Args:
        teeth: numbers of drive and loose tooth, (n, 2).
        points: both ends in the world [m], (n, 2, 3); those of a spur pair lie on the two end faces.
        rolls: roll angles of drive and loose flank at both ends [rad], (n, 2, 2): end, gear.
        lengths: [m], (n,).
    """

    teeth: NDArray[np.int64]
    points: Array
    rolls: Array
    lengths: Array


def contact_lines(pair: Pair, theta: float, flank: str = "active") -> ContactLines:
    """Return the contact lines of the perfect flanks at an angle of the drive gear, resting on one side.

    Args:
        pair: the pair, spur or helical; deviations, relief and mounting do not enter.
        theta: angle of the drive gear [rad].
        flank: ``"active"`` or ``"reverse"``, the side on which the gears rest.

    Returns:
        The lines, in order of meshing.

    Raises:
        InputError: unknown flank.

    Source: ISO 21771:2007, section 5.4, contact lines in the plane of action at the base helix angle.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30, helix_angle=0.3, face_width=0.02)
    >>> contact_lines(Pair.from_backlash(gear, gear, 1e-4), 0.0).teeth[:, 0].tolist()
    [30, 1, 2]
    """
    side = 1.0 - 2.0 * index_of(flank, FLANKS, "flank")
    drive, loose, path = pair.drive, pair.loose, pair.path_length
    base, pitch = drive.base_radius, 2.0 * pi / drive.teeth
    half = 0.5 * min(drive.face_width, loose.face_width)
    slope = side * tan(drive.base_helix_angle)
    # distance from the drive's base tangent point along the line of action, of tooth 1 in the middle of the face
    tangent = tan(pair.working_pressure_angle)
    first = base * (tangent + theta) if side > 0 else base * (tangent - theta) + _reverse_lead(pair)
    low, high = path - loose.base_radius * loose.tip_roll, base * drive.tip_roll
    reach = abs(slope) * half
    ahead = side * (np.array([low - reach, high + reach]) - first) / (-base * pitch)
    counts = np.arange(np.ceil(ahead.min() - 1e-12), np.floor(ahead.max() + 1e-12) + 1).astype(int)
    teeth, points, rolls = [], [], []
    for count in counts:
        middle = first - side * base * pitch * count
        ends = _clipped(middle, slope, half, (low, high))
        if ends is None:
            continue
        teeth.append((count % drive.teeth + 1, (count + (side < 0)) % loose.teeth + 1))
        along = middle + slope * ends
        points.append(_on_line(pair, side, along, ends))
        rolls.append(np.c_[along / base, (path - along) / loose.base_radius])
    lines = np.array(points).reshape(-1, 2, 3)
    lengths = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)
    return ContactLines(np.array(teeth, int).reshape(-1, 2), lines, np.array(rolls).reshape(-1, 2, 2), lengths)


def curvature_radii(pair: Pair, place: ArrayLike) -> tuple[Array, Array, Array]:
    """Return the radii of curvature of both flanks and the equivalent one, in the section normal to the teeth.

    Args:
        pair: the pair.
        place: distance from the pitch point along the path of contact, in the sense of the contact's motion [m].

    Returns:
        Radius of the drive's flank, of the loose gear's flank, and of a cylinder against a plane that is pressed as
        they are [m].

    Source: ISO 21771:2007, radii of curvature; 1/ρ = 1/ρ1 + 1/ρ2, base helix angle as in ISO 6336-2.
    """
    at, tangent = np.asarray(place, float), tan(pair.working_pressure_angle)
    tilt = cos(pair.drive.base_helix_angle)
    drive = (pair.drive.base_radius * tangent + at) / tilt
    loose = (pair.loose.base_radius * tangent - at) / tilt
    return drive, loose, drive * loose / (drive + loose)


def sliding_speed(pair: Pair, place: ArrayLike, speed: float) -> Array:
    """Return how fast the drive's flank slides over its mate's, outwards positive.

    Args:
        pair: the pair.
        place: distance from the pitch point along the path of contact, in the sense of the contact's motion [m].
        speed: of the drive gear [rad/s].

    Returns:
        Sliding speed [m/s]: negative in approach, 0 in the pitch point, positive in recess.

    Source: ISO 21771:2007, sliding speed: distance from the pitch point times the sum of both speeds.
    """
    return np.asarray(place, float) * speed * (1.0 + pair.drive.teeth / pair.loose.teeth)


def specific_sliding(pair: Pair, place: ArrayLike) -> tuple[Array, Array]:
    """Return the sliding speed over each flank's own rolling speed.

    Args:
        pair: the pair.
        place: distance from the pitch point along the path of contact, in the sense of the contact's motion [m].

    Returns:
        Specific sliding of the drive's and of the loose gear's flank.

    Source: ISO 21771:2007, specific sliding.
    """
    drive, loose, _ = curvature_radii(pair, place)
    ratio = pair.loose.teeth / pair.drive.teeth
    return 1.0 - loose / drive / ratio, 1.0 - drive / loose * ratio


def _reverse_lead(pair: Pair) -> float:
    """How much further from the base tangent point the reverse flank of tooth 1 stands than the active one [m]."""
    angle = pair.working_pressure_angle
    return 2.0 * pair.drive.base_radius * (pair.half_angle("drive") - (tan(angle) - angle))


def _clipped(middle: float, slope: float, half: float, limits: tuple[float, float]) -> Array | None:
    """Heights between which a line lies in the plane of action, or ``None``."""
    low, high = limits
    if slope == 0.0:
        return np.array([-half, half]) if low <= middle <= high else None
    ends = np.clip(np.sort((np.array(limits) - middle) / slope), -half, half)
    return ends if ends[1] > ends[0] else None


def _on_line(pair: Pair, side: float, along: Array, heights: Array) -> Array:
    """Points of the plane of action in the world: distances from the drive's base tangent point, and heights."""
    psi = side * (0.5 * pi - pair.working_pressure_angle)
    base = pair.drive.base_radius
    x = along * cos(psi) + side * base * sin(psi)
    y = along * sin(psi) - side * base * cos(psi)
    return np.c_[x, y, heights]
