"""Points of flanks, and the gap between two of them, compiled.

For two flanks whose axes stand apart by the vector d the distance of parallel tangents with normal n is
d·n − h_drive − h_loose, h their support functions (:mod:`gears3d.gears.support`); the gap is its maximum over the
direction of n, which is where the contact points lie opposite each other.

Gears are numbered 0 drive, 1 loose; flanks 0 active, 1 reverse; teeth from 1 in order of meshing.
"""

from __future__ import annotations

from math import atan2, cos, pi, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gears3d.gears.arrays import (
    ACTIVE,
    ACTIVE_START,
    BASE,
    BASE_SUM,
    DIRECTION,
    DISTANCE,
    DRIVE,
    FLOOR,
    FORM_ROLL,
    LEAST_TURN,
    LOOSE,
    PATH,
    PITCH,
    PROFILE_REACH,
    REVERSE,
    ROOT_RELIEF,
    START,
    TIP_RELIEF,
    TIP_ROLL,
    TURN,
    Flanks,
    deviations,
    profiles,
    relief_starts,
    steepness,
)
from gears3d.gears.rack import form
from gears3d.gears.relief import relief_rows
from gears3d.gears.support import deviation, full_support, roll_of, shaped_address, support, taken_off
from gears3d.kernels import inner, njit

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair

__all__ = [
    "ACTIVE",
    "DRIVE",
    "LOOSE",
    "REVERSE",
    "Flanks",
    "candidates",
    "compile_pair",
    "deviation",
    "flank_gap",
    "flank_point",
    "flank_points",
    "gap_at",
    "nearest_gap",
    "relief_starts",
    "roll_at_radius",
    "roll_of",
    "support",
]

_SEARCH = 0.7
"""How far from the line of action's normal a common normal is looked for [rad]."""


def compile_pair(pair: Pair) -> Flanks:
    """Return the flanks of a pair as arrays.

    Args:
        pair: the pair, deviations included.

    Returns:
        The arrays.
    """
    direction = 0.5 * pi - pair.working_pressure_angle
    mount = [pair.path_length, pair.drive.base_radius + pair.loose.base_radius, pair.centre_distance, direction]
    gears = np.zeros((2, 18))
    for row, which, sense in ((DRIVE, "drive", 1.0), (LOOSE, "loose", -1.0)):
        gear, half = pair.gear(which), pair.half_angle(which)
        start, lowest = direction + mount[PATH] / mount[BASE_SUM], form(gear, half)[0]
        begin = max(pair.start_roll(which), lowest)
        gears[row, :FLOOR] = (
            gear.base_radius,
            sense * TURN / gear.teeth,
            start,
            start - 2.0 * half - pi,
            lowest,
            gear.tip_roll,
            *relief_rows(gear, lowest),
            begin,
            gear.tip_roll - begin,
        )
    slopes, waves = profiles(pair, gears)
    for row in (DRIVE, LOOSE):
        for flank in (0, 1):
            rise, _, most = steepness(slopes[row, flank], waves[row, flank], gears[row, PROFILE_REACH])
            base = gears[row, BASE]
            gears[row, FLOOR + flank] = max(
                gears[row, FORM_ROLL], (sqrt(rise * base / (1.0 - LEAST_TURN)) + most) / base if rise else -1.0
            )
    harmonics, offsets = deviations(pair)
    reliefs = gears[:, [ROOT_RELIEF + START, TIP_RELIEF + START]]
    perfect = not (harmonics.size or slopes.size or np.isfinite(reliefs).any())
    shaped = 0 if perfect else shaped_address()
    return Flanks(np.array(mount), gears, harmonics, offsets, slopes, waves, np.zeros(2), shaped)


def perfect_points(
    flanks: Flanks, gear: int, flank: int, teeth: NDArray[np.int64] | int, rolls: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points and outward normals of perfect flanks, in closed form.

    Args:
        flanks: the arrays of a pair, without waves, reliefs and deviations of profiles.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        teeth: numbers of the teeth, one or one for each roll angle.
        rolls: roll angles [rad], (n,).

    Returns:
        Positions [m] and normals, each (n, 2), in the gear's own frame.
    """
    side, base = 1.0 - 2.0 * flank, flanks.gears[gear, BASE]
    u = flanks.gears[gear, ACTIVE_START + flank] - flanks.gears[gear, PITCH] * (np.asarray(teeth) - 1) - side * rolls
    height = base * rolls + flanks.offsets[gear, flank, np.asarray(teeth) - 1]
    normals = np.stack([np.cos(u), np.sin(u)], axis=-1)
    return height[:, None] * normals - side * base * np.stack([-normals[:, 1], normals[:, 0]], axis=-1), normals


@njit(cache=True)
def flank_point(flanks, gear, flank, tooth, roll):
    """Return a point of a flank in the gear's own frame.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        tooth: number of the tooth.
        roll: roll angle of the flank before relief [rad]; its normal turns by as much from the start of the involute.

    Returns:
        Position x, y [m], outward normal nx, ny, and derivative of the position by the roll angle [m/rad].
    """
    side = 1.0 - 2.0 * flank
    u = flanks.gears[gear, ACTIVE_START + flank] - flanks.gears[gear, PITCH] * (tooth - 1) - side * roll
    height, slope, bend = full_support(flanks, gear, flank, tooth, u)
    taken, fall, _ = taken_off(flanks, gear, flank, tooth, roll)
    nx, ny = cos(u), sin(u)
    speed = -side * (height + bend - taken)
    height -= taken
    x, y = height * nx - slope * ny, height * ny + slope * nx
    if fall == 0.0:
        return x, y, nx, ny, -speed * ny, speed * nx
    dx, dy = -speed * ny - fall * nx, speed * nx - fall * ny
    tilted = u - side * atan2(fall, -side * speed)
    return x, y, cos(tilted), sin(tilted), dx, dy


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
    psi = (1.0 - 2.0 * flank) * flanks.mount[DIRECTION]
    low, high = psi - _SEARCH, psi + _SEARCH
    h1, s1, h2, s2, nx, ny = 0.0, 0.0, 0.0, 0.0, 1.0, 0.0
    for _ in range(60):
        nx, ny = cos(psi), sin(psi)
        h1, s1, c1 = support(flanks, 0, flank, tooth_drive, psi - rotation_drive)
        h2, s2, c2 = support(flanks, 1, flank, tooth_loose, psi + pi - rotation_loose)
        rise = y * nx - x * ny - s1 - s2
        if rise > 0.0:
            low = psi
        else:
            high = psi
        step = rise / (x * nx + y * ny + c1 + c2)
        new = psi + step
        if abs(step) < 1e-12:
            psi = new
            break
        psi = new if low < new < high else 0.5 * (low + high)
    gap = x * nx + y * ny - h1 - h2
    along = 0.5 * (h1 + x * nx + y * ny - h2)
    across = 0.5 * (s1 + y * nx - x * ny - s2)
    valid = _on_flank(flanks, 0, h1, s1) and _on_flank(flanks, 1, h2, s2)
    return gap, s1, s2, along * nx - across * ny, along * ny + across * nx, nx, ny, valid


@inner
def _on_flank(flanks, gear, height, slope):
    base, low, high = flanks.gears[gear, BASE], flanks.gears[gear, FORM_ROLL], flanks.gears[gear, TIP_ROLL]
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
    distance = flanks.mount[DISTANCE]
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
    path, direction = flanks.mount[PATH], flanks.mount[DIRECTION]
    side = 1.0 - 2.0 * flank
    pitch1, pitch2 = g1[PITCH], -g2[PITCH]
    teeth1, teeth2 = int(TURN / pitch1 + 0.5), int(TURN / pitch2 + 0.5)
    # roll angles of tooth 1 on the line of action; u there is side·direction − sense·theta
    roll1 = side * (g1[ACTIVE_START + flank] - side * direction + theta_drive)
    roll2 = side * (g2[ACTIVE_START + flank] - side * direction - theta_loose)
    pairs = np.zeros((8, 2), np.int64)
    count = 0
    nearest = int(np.floor(theta_drive / pitch1 + 0.5))
    for k in range(nearest - 3, nearest + 5):
        j = k + flank
        h1 = g1[BASE] * (roll1 - side * pitch1 * k)
        h2 = g2[BASE] * _near(roll2 + side * pitch2 * j)
        place = 0.5 * (h1 + path - h2)
        if path - g2[BASE] * g2[TIP_ROLL] - 1e-12 <= place <= g1[BASE] * g1[TIP_ROLL] + 1e-12:
            pairs[count, 0] = k % teeth1 + 1
            pairs[count, 1] = j % teeth2 + 1
            count += 1
    return pairs[:count]


@inner
def _near(angle):
    """Return the angle within half a turn of 0."""
    return angle - TURN * np.floor(angle / TURN + 0.5)


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


def flank_points(
    flanks: Flanks, gear: int, flank: int, tooth: int, rolls: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
    if not flanks.shaped:
        return perfect_points(flanks, gear, flank, tooth, rolls)
    found = _many_points(flanks, gear, flank, tooth, np.ascontiguousarray(rolls))
    return found[:, :2], found[:, 2:]


@njit(cache=True)
def _many_points(flanks, gear, flank, tooth, rolls):
    """Points and normals of a flank, (n, 4)."""
    found = np.zeros((rolls.size, 4))
    for i in range(rolls.size):
        found[i, 0], found[i, 1], found[i, 2], found[i, 3], _, _ = flank_point(flanks, gear, flank, tooth, rolls[i])
    return found


def roll_at_radius(flanks: Flanks, gear: int, flank: int, tooth: int, radius: float) -> float:
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
    if flanks.shaped:
        return solve_roll(flanks, gear, flank, tooth, radius)
    base = flanks.gears[gear, BASE]
    return sqrt(max((radius / base) ** 2 - 1.0, 0.0)) - flanks.offsets[gear, flank, tooth - 1] / base


@njit(cache=True)
def solve_roll(flanks, gear, flank, tooth, radius):
    """As :func:`roll_at_radius`, of any flank."""
    base = flanks.gears[gear, BASE]
    roll = sqrt(max((radius / base) ** 2 - 1.0, 0.0))
    low, high = -np.inf, np.inf  # steep waves make Newton's steps cycle: those that leave the bracket are halved
    for _ in range(60):
        x, y, _, _, dx, dy = flank_point(flanks, gear, flank, tooth, roll)
        beyond = x * x + y * y - radius * radius
        if beyond > 0.0:
            high = roll
        else:
            low = roll
        step = beyond / (2.0 * (x * dx + y * dy))
        if abs(step) < 1e-14:
            return roll - step
        roll -= step
        if high - low < np.inf and not low < roll < high:
            roll = 0.5 * (low + high)
    return roll
