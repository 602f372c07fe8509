"""Flanks as surfaces, and the gap between two of them, compiled.

A flank is its support function: h(u) is the distance of the tangent with outward normal direction u from the gear's
axis, in the gear's own frame, so the point is p = h·n + h'·t with n = (cos u, sin u) and t = (−sin u, cos u), and
h + h'' is the radius of curvature. For an involute h = base radius × roll angle, linear in u. For two flanks whose
axes stand apart by the vector d the distance of parallel tangents with normal n is d·n − h_drive − h_loose; the gap
is its maximum over the direction of n, which is where the contact points lie opposite each other.

A flank that is to touch a perfect mate displaced by φ(θ) is the envelope of that mate in its own frame, which adds
δ(u) = max over θ of K(u + σθ) + φ(θ) to h. K ≤ 0 is the distance of the perfect flanks off the line of action and
σ = ±1 the gear's sense of rotation; δ = φ only where φ is constant.

Gears are numbered 0 drive, 1 loose; flanks 0 active, 1 reverse; teeth from 1 in order of meshing.
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gears3d.gears.deviation import FLANKS, GEARS, HarmonicDeviation
from gears3d.gears.rack import form

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair

DRIVE, LOOSE = 0, 1
ACTIVE, REVERSE = 0, 1
_PATH, _BASE_SUM, _DISTANCE, _DIRECTION = 0, 1, 2, 3
_BASE, _PITCH, _ACTIVE_START, _REVERSE_START, _FORM_ROLL, _TIP_ROLL = 0, 1, 2, 3, 4, 5
_TURN = 2.0 * pi


class Flanks(NamedTuple):
    """The flanks of a pair as arrays that compiled functions take.

    Args:
        mount: working length between the base circles, sum of the base radii, centre distance [m] and direction of
            the line of action's normal [rad] that the flanks are made for, (4,).
        gears: for each gear base radius [m], angle between teeth with the sign of its rotation [rad], normal direction
            at the start of tooth 1's active and reverse involute [rad], roll angles of form circle and tip [rad],
            (2, 6).
        harmonics: order, amplitude [m], phase [rad] for each gear and flank, (2, 2, n, 3).
        offsets: constant material of each tooth [m], (2, 2, teeth).
    """

    mount: NDArray[np.float64]
    gears: NDArray[np.float64]
    harmonics: NDArray[np.float64]
    offsets: NDArray[np.float64]


def compile_pair(pair: Pair) -> Flanks:
    """Return the flanks of a pair as arrays.

    Args:
        pair: the pair, deviations included.

    Returns:
        The arrays.
    """
    direction = 0.5 * pi - pair.working_pressure_angle
    mount = [pair.path_length, pair.drive.base_radius + pair.loose.base_radius, pair.centre_distance, direction]
    gears = np.zeros((2, 6))
    for row, which, sense in ((DRIVE, "drive", 1.0), (LOOSE, "loose", -1.0)):
        gear, half = pair.gear(which), pair.half_angle(which)
        start = direction + mount[_PATH] / mount[_BASE_SUM]
        gears[row] = (
            gear.base_radius,
            sense * _TURN / gear.teeth,
            start,
            start - 2.0 * half - pi,
            form(gear, half)[0],
            gear.tip_roll,
        )
    return Flanks(np.array(mount), gears, *_deviations(pair))


def _deviations(pair: Pair) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sort the deviations by gear and flank; an absent harmonic has amplitude 0."""
    lists: list[list[list[list[float]]]] = [[[], []], [[], []]]
    offsets = np.zeros((2, 2, max(pair.drive.teeth, pair.loose.teeth)))
    for deviation in pair.deviations:
        gear, flank = GEARS.index(deviation.gear), FLANKS.index(deviation.flank)
        if isinstance(deviation, HarmonicDeviation):
            lists[gear][flank].append([float(deviation.order), deviation.amplitude, deviation.phase])
        else:
            offsets[gear, flank, deviation.tooth - 1] += deviation.offset
    longest = max(len(entries) for gear in lists for entries in gear)
    harmonics = np.zeros((2, 2, longest, 3))
    for gear in (0, 1):
        for flank in (0, 1):
            for place, entry in enumerate(lists[gear][flank]):
                harmonics[gear, flank, place] = entry
    return harmonics, offsets


@njit(cache=True)
def deviation(flanks, gear, flank, tooth, u):
    """Return the support function's deviation δ(u) and its first two derivatives.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        tooth: number of the tooth.
        u: direction of the outward normal in the gear's own frame [rad].

    Returns:
        δ [m], δ' [m/rad], δ'' [m/rad²].
    """
    offset = flanks.offsets[gear, flank, tooth - 1]
    terms = flanks.harmonics[gear, flank]
    if terms.shape[0] == 0:
        return offset, 0.0, 0.0
    sense = 1.0 - 2.0 * gear
    side = 1.0 - 2.0 * flank
    distance, base_sum, direction = flanks.mount[_DISTANCE], flanks.mount[_BASE_SUM], flanks.mount[_DIRECTION]
    theta = sense * (side * direction - u)
    x, value, fall, curvature, bend = 0.0, 0.0, 0.0, -1.0, 0.0
    for _ in range(30):
        value, slope, bend = 0.0, 0.0, 0.0
        for i in range(terms.shape[0]):
            order, amplitude = terms[i, 0], terms[i, 1]
            argument = order * theta + terms[i, 2]
            value += amplitude * cos(argument)
            slope -= amplitude * order * sin(argument)
            bend -= amplitude * order * order * cos(argument)
        x = side * (u + sense * theta) - direction
        # K(x) = distance·(cos(direction + x) − cos direction) + base_sum·x, written without cancellation
        fall = base_sum - distance * sin(direction + x)
        curvature = -distance * cos(direction + x)
        step = (sense * side * fall + slope) / (curvature + bend)
        theta -= step
        if abs(step) < 1e-12:
            break
    half = sin(0.5 * x)
    height = base_sum * (x - sin(x)) - 2.0 * distance * cos(direction) * half * half
    second = curvature * bend / (curvature + bend)
    return offset + height + value, side * fall, second


@njit(cache=True)
def roll_of(flanks, gear, flank, tooth, u):
    """Return the roll angle [rad] of a perfect flank whose outward normal has direction u in the gear's own frame."""
    sense_pitch = flanks.gears[gear, _PITCH]
    start = flanks.gears[gear, _ACTIVE_START + flank] - sense_pitch * (tooth - 1)
    roll = (1.0 - 2.0 * flank) * (start - u)
    return roll - _TURN * np.floor(roll / _TURN + 0.5)


@njit(cache=True)
def support(flanks, gear, flank, tooth, u):
    """Return the support function of a flank and its first two derivatives.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        tooth: number of the tooth.
        u: direction of the outward normal in the gear's own frame [rad].

    Returns:
        h [m], h' [m/rad], h'' [m/rad²]; the point is h·n + h'·t, the radius of curvature h + h''.
    """
    base = flanks.gears[gear, _BASE]
    delta, slope, bend = deviation(flanks, gear, flank, tooth, u)
    return base * roll_of(flanks, gear, flank, tooth, u) + delta, slope - (1.0 - 2.0 * flank) * base, bend


@njit(cache=True)
def flank_point(flanks, gear, flank, tooth, roll):
    """Return a point of a flank in the gear's own frame.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        tooth: number of the tooth.
        roll: roll angle [rad]; the normal turns by as much from the start of the involute.

    Returns:
        Position x, y [m], outward normal nx, ny, and derivative of the position by the roll angle [m/rad].
    """
    side = 1.0 - 2.0 * flank
    u = flanks.gears[gear, _ACTIVE_START + flank] - flanks.gears[gear, _PITCH] * (tooth - 1) - side * roll
    height, slope, bend = support(flanks, gear, flank, tooth, u)
    nx, ny = cos(u), sin(u)
    speed = -side * (height + bend)
    return height * nx - slope * ny, height * ny + slope * nx, nx, ny, -speed * ny, speed * nx


@njit(cache=True)
def gap_at(flanks, x, y, rotation_drive, rotation_loose, tooth_drive, tooth_loose, flank):
    """Return the gap of two flanks for any pose of both gears in the plane.

    Args:
        flanks: the arrays of a pair.
        x: position of the loose gear's axis relative to the drive gear's [m].
        y: the same, across the line of centres [m].
        rotation_drive: angle about +z of the drive gear's own frame [rad].
        rotation_loose: angle about +z of the loose gear's own frame [rad].
        tooth_drive: number of the drive gear's tooth.
        tooth_loose: number of the loose gear's tooth.
        flank: 0 active, 1 reverse.

    Returns:
        gap [m], > 0 open; its derivatives by the rotations of drive and loose gear [m/rad]; the point midway between
        the flanks x, y [m]; the common normal from drive to loose nx, ny; valid, whether both contact points lie on
        the flanks between form and tip circle.
    """
    psi = (1.0 - 2.0 * flank) * flanks.mount[_DIRECTION]
    h1, s1, h2, s2, nx, ny = 0.0, 0.0, 0.0, 0.0, 1.0, 0.0
    for _ in range(30):
        nx, ny = cos(psi), sin(psi)
        h1, s1, c1 = support(flanks, 0, flank, tooth_drive, psi - rotation_drive)
        h2, s2, c2 = support(flanks, 1, flank, tooth_loose, psi + pi - rotation_loose)
        step = (y * nx - x * ny - s1 - s2) / (x * nx + y * ny + c1 + c2)
        psi += step
        if abs(step) < 1e-12:
            break
    gap = x * nx + y * ny - h1 - h2
    along = 0.5 * (h1 + x * nx + y * ny - h2)
    across = 0.5 * (s1 + y * nx - x * ny - s2)
    valid = _on_flank(flanks, 0, h1, s1) and _on_flank(flanks, 1, h2, s2)
    return gap, s1, s2, along * nx - across * ny, along * ny + across * nx, nx, ny, valid


@njit(cache=True)
def _on_flank(flanks, gear, height, slope):
    base, low, high = flanks.gears[gear, _BASE], flanks.gears[gear, _FORM_ROLL], flanks.gears[gear, _TIP_ROLL]
    square = (height * height + slope * slope) / (base * base) - 1.0
    return height > 0.0 and low * low - 1e-9 <= square <= high * high + 1e-9


@njit(cache=True)
def flank_gap(flanks, theta_drive, theta_loose, tooth_drive, tooth_loose, flank):
    """Return the gap of two flanks along their common normal, from the flanks themselves.

    Args:
        flanks: the arrays of a pair.
        theta_drive: angle of the drive gear [rad].
        theta_loose: angle of the loose gear [rad].
        tooth_drive: number of the drive gear's tooth.
        tooth_loose: number of the loose gear's tooth.
        flank: 0 active, 1 reverse.

    Returns:
        gap [m], > 0 open; d gap/d theta_drive; d gap/d theta_loose [m/rad]; contact point x, y [m]; common normal from
        drive to loose nx, ny; valid, whether both contact points lie between form and tip circle.
    """
    distance = flanks.mount[_DISTANCE]
    gap, drive, loose, x, y, nx, ny, valid = gap_at(
        flanks, distance, 0.0, theta_drive, pi - theta_loose, tooth_drive, tooth_loose, flank
    )
    return gap, drive, -loose, x, y, nx, ny, valid


@njit(cache=True)
def candidates(flanks, theta_drive, theta_loose, flank):
    """Return the pairs of teeth whose contact lies between the tips, by the angles of both gears.

    Args:
        flanks: the arrays of a pair.
        theta_drive: angle of the drive gear [rad].
        theta_loose: angle of the loose gear [rad].
        flank: 0 active, 1 reverse.

    Returns:
        Numbers of drive and loose teeth, (n, 2), n ≥ 1, in order of meshing.
    """
    g1, g2 = flanks.gears[0], flanks.gears[1]
    path, direction = flanks.mount[_PATH], flanks.mount[_DIRECTION]
    side = 1.0 - 2.0 * flank
    pitch1, pitch2 = g1[_PITCH], -g2[_PITCH]
    teeth1, teeth2 = int(_TURN / pitch1 + 0.5), int(_TURN / pitch2 + 0.5)
    # roll angles of tooth 1 on the line of action; u there is side·direction − sense·theta
    roll1 = side * (g1[_ACTIVE_START + flank] - side * direction + theta_drive)
    roll2 = side * (g2[_ACTIVE_START + flank] - side * direction - theta_loose)
    pairs = np.zeros((8, 2), np.int64)
    count = 0
    nearest = int(np.floor(theta_drive / pitch1 + 0.5))
    for k in range(nearest - 3, nearest + 5):
        j = k + flank
        h1 = g1[_BASE] * (roll1 - side * pitch1 * k)
        h2 = g2[_BASE] * _near(roll2 + side * pitch2 * j)
        place = 0.5 * (h1 + path - h2)
        if path - g2[_BASE] * g2[_TIP_ROLL] - 1e-12 <= place <= g1[_BASE] * g1[_TIP_ROLL] + 1e-12:
            pairs[count, 0] = k % teeth1 + 1
            pairs[count, 1] = j % teeth2 + 1
            count += 1
    return pairs[:count]


@njit(cache=True)
def _near(angle):
    """Return the angle within half a turn of 0."""
    return angle - _TURN * np.floor(angle / _TURN + 0.5)


@njit(cache=True)
def nearest_gap(flanks, theta_drive, theta_loose, flank):
    """Return the smallest gap among the pairs of teeth in the path of contact.

    Args:
        flanks: the arrays of a pair.
        theta_drive: angle of the drive gear [rad].
        theta_loose: angle of the loose gear [rad].
        flank: 0 active, 1 reverse.

    Returns:
        Tooth numbers of drive and loose gear, then the eight values of :func:`flank_gap`.
    """
    pairs = candidates(flanks, theta_drive, theta_loose, flank)
    tooth_drive, tooth_loose = pairs[0, 0], pairs[0, 1]
    best = flank_gap(flanks, theta_drive, theta_loose, tooth_drive, tooth_loose, flank)
    for i in range(1, pairs.shape[0]):
        other = flank_gap(flanks, theta_drive, theta_loose, pairs[i, 0], pairs[i, 1], flank)
        if other[0] < best[0]:
            best, tooth_drive, tooth_loose = other, pairs[i, 0], pairs[i, 1]
    return (tooth_drive, tooth_loose, *best)


@njit(cache=True)
def flank_points(flanks, gear, flank, tooth, rolls):
    """Return points and outward normals of a flank at many roll angles, in the gear's own frame.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        tooth: number of the tooth.
        rolls: roll angles [rad], (n,).

    Returns:
        Positions [m] and normals, each (n, 2).
    """
    points, normals = np.zeros((rolls.size, 2)), np.zeros((rolls.size, 2))
    for i in range(rolls.size):
        x, y, nx, ny, _, _ = flank_point(flanks, gear, flank, tooth, rolls[i])
        points[i, 0], points[i, 1], normals[i, 0], normals[i, 1] = x, y, nx, ny
    return points, normals


@njit(cache=True)
def roll_at_radius(flanks, gear, flank, tooth, radius):
    """Return the roll angle at which a flank, deviations included, reaches a radius [rad].

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        tooth: number of the tooth.
        radius: distance from the axis [m], not less than the base radius.

    Returns:
        Roll angle [rad].
    """
    base = flanks.gears[gear, _BASE]
    roll = sqrt(max((radius / base) ** 2 - 1.0, 0.0))
    for _ in range(30):
        x, y, _, _, dx, dy = flank_point(flanks, gear, flank, tooth, roll)
        step = (x * x + y * y - radius * radius) / (2.0 * (x * dx + y * dy))
        roll -= step
        if abs(step) < 1e-14:
            break
    return roll
