"""Flanks as support functions, their points, and the gap between two of them, compiled.

A flank is its support function: h(u) is the distance of the tangent with outward normal direction u from the gear's
axis, in the gear's own frame, so the point is p = h·n + h'·t with n = (cos u, sin u) and t = (−sin u, cos u), and
h + h'' is the radius of curvature. For an involute h = base radius × roll angle, linear in u.

A flank that is to touch a perfect mate displaced by φ(θ) is the envelope of that mate in its own frame, which adds
δ(u) = max over θ of K(u + σθ) + φ(θ) to h. K ≤ 0 is the distance of the perfect flanks off the line of action and
σ = ±1 the gear's sense of rotation; δ = φ only where φ is constant.

Relief takes f(roll) off along the normal of the flank so made, p − f·n, and deviations of the profile put material on
the same way. That tilts the normal by τ = atan(f'/R), R the radius of curvature less f, so at a linear relief's start
the flank has an edge, at which the point stays and the normal turns.

For two flanks whose axes stand apart by the vector d the distance of parallel tangents with normal n is
d·n − h_drive − h_loose; the gap is its maximum over the direction of n, which is where the contact points lie opposite
each other.

Gears are numbered 0 drive, 1 loose; flanks 0 active, 1 reverse; teeth from 1 in order of meshing.
"""

from __future__ import annotations

from math import atan2, cos, inf, pi, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numba import float64, int64, types
from numpy.typing import NDArray

from gears3d.gears.deviation import FLANKS, GEARS, HarmonicDeviation, ProfileSlope, ProfileWave, ToothDeviation
from gears3d.gears.gear import form, relief_rows
from gears3d.kernels import inner, njit
from gears3d.records import Floats1, Floats2, Floats3, Floats4, Record, address_of, caller

if TYPE_CHECKING:
    from gears3d.gears.meshing import Meshing


DRIVE, LOOSE = 0, 1
ACTIVE, REVERSE = 0, 1
PATH, BASE_SUM, DISTANCE, DIRECTION = 0, 1, 2, 3
BASE, PITCH, ACTIVE_START, REVERSE_START, FORM_ROLL, TIP_ROLL = 0, 1, 2, 3, 4, 5
TURN = 2.0 * pi
ROOT_RELIEF, TIP_RELIEF = 6, 10
START, REACH, AMOUNT, POWER = 0, 1, 2, 3
ACTIVE_PROFILE, PROFILE_REACH, FLOOR = 14, 15, 16
# How much the normal of a flank that is not perfect turns at least for one unit of roll: 1 on the involute
LEAST_TURN = 0.2
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
_SEARCH = 0.7  # How far from the line of action's normal a common normal is looked for [rad]


class Flanks(Record):
    """The flanks of a pair as arrays that compiled functions take.

    Args:
        mount: working length between the base circles, sum of the base radii, centre distance [m] and direction of
            the line of action's normal [rad] that the flanks are made for, (4,).
        gears: for each gear base radius [m], angle between teeth with the sign of its rotation [rad], normal direction
            at the start of tooth 1's active and reverse involute [rad], roll angles of form circle and tip [rad]; of
            root and tip relief start and length in roll angle [rad], amount at the end [m] and power; roll angle at the
            start of the active profile and from there to the tip, and from where on the active and reverse flanks are
            regular with their profile deviations [rad], (2, 18).
        harmonics: order, amplitude [m], phase [rad] for each gear and flank, (2, 2, n, 3).
        offsets: constant material of each tooth [m], (2, 2, teeth).
        slopes: profile slope of each tooth [m]; nothing where no profile deviates, (2, 2, teeth or 0).
        waves: amplitude [m], circular waves by roll angle [rad/rad], phase [rad] and tooth, 0 for all, of the waves of
            profiles, for each gear and flank (2, 2, n, 4).
        turned: by how much the sections are turned on about +z in their gears [rad], (2,): a harmonic deviation is a
            function of the gear's angle at the moment of touching, and a section that stands ahead of its gear by some
            angle meets what it shall impose at an angle that much larger.
        shaped: address of the support function of flanks that are no perfect involutes; 0 where all are.
    """

    mount: Floats1
    gears: Floats2
    harmonics: Floats4
    offsets: Floats3
    slopes: Floats3
    waves: Floats4
    turned: Floats1
    shaped: int


def steepness(slopes: NDArray[np.float64], waves: NDArray[np.float64], reach: float) -> tuple[float, float, float]:
    """Return bounds on slope and bend by roll angle and on the size of a flank's profile deviations, over all teeth."""
    slope = float(np.max(np.abs(slopes), initial=0.0))
    size, number = np.abs(waves[:, 0]), waves[:, 1]
    return slope / reach + float(size @ number), float(size @ number**2), 0.5 * slope + float(size.sum())


def profiles(pair: Meshing, gears: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sort the deviations of profiles by gear, flank and tooth."""
    found = [d for d in pair.deviations if isinstance(d, ProfileSlope | ProfileWave)]
    slopes = np.zeros((2, 2, max(pair.drive.teeth, pair.loose.teeth) if found else 0))
    lists: list[list[list[list[float]]]] = [[[], []], [[], []]]
    for each in found:
        gear, flank = GEARS.index(each.gear), FLANKS.index(each.flank)
        if isinstance(each, ProfileSlope):
            slopes[gear, flank, slice(None) if each.tooth is None else each.tooth - 1] += each.amount
        else:
            number = TURN * each.waves / gears[gear, PROFILE_REACH]
            lists[gear][flank].append([each.amplitude, number, each.phase, float(each.tooth or 0)])
    return slopes, _table(lists, 4)


def _table(lists: list[list[list[list[float]]]], width: int) -> NDArray[np.float64]:
    """Return lists of rows for each gear and flank as one array, filled up with zeros."""
    table = np.zeros((2, 2, max(len(rows) for gear in lists for rows in gear), width))
    for gear in (0, 1):
        for flank in (0, 1):
            for place, entry in enumerate(lists[gear][flank]):
                table[gear, flank, place] = entry
    return table


def deviations(pair: Meshing) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sort the deviations by gear and flank; an absent harmonic has amplitude 0."""
    lists: list[list[list[list[float]]]] = [[[], []], [[], []]]
    offsets = np.zeros((2, 2, max(pair.drive.teeth, pair.loose.teeth)))
    for deviation in pair.deviations:
        gear, flank = GEARS.index(deviation.gear), FLANKS.index(deviation.flank)
        if isinstance(deviation, HarmonicDeviation):
            lists[gear][flank].append([float(deviation.order), deviation.amplitude, deviation.phase])
        elif isinstance(deviation, ToothDeviation):
            offsets[gear, flank, deviation.tooth - 1] += deviation.offset
    return _table(lists, 3), offsets


def relief_starts(flanks: Flanks, gear: int) -> NDArray[np.float64]:
    """Return the roll angles at which the reliefs of a gear start [rad], ascending, those that there are."""
    starts = flanks.gears[gear, [ROOT_RELIEF + START, TIP_RELIEF + START]]
    return starts[np.isfinite(starts)]


_SHAPED = types.UniTuple(float64, 3)(Flanks.compiled, int64, int64, int64, float64, float64)
_call_shaped = caller(_SHAPED)


def shaped_address() -> int:
    """Return the address of the support function of flanks that are no perfect involutes."""
    return address_of(_shaped_support, _SHAPED)


@njit(cache=True)
def deviation(flanks, gear, flank, tooth, u):
    """Return the support function's deviation δ(u) and its first two derivatives."""
    offset = flanks.offsets[gear, flank, tooth - 1]
    terms = flanks.harmonics[gear, flank]
    if terms.shape[0] == 0:
        return offset, 0.0, 0.0
    sense = 1.0 - 2.0 * gear
    side = 1.0 - 2.0 * flank
    distance, base_sum, direction = flanks.mount[DISTANCE], flanks.mount[BASE_SUM], flanks.mount[DIRECTION]
    theta = sense * (side * direction - u)
    ahead = sense * flanks.turned[gear]
    x, value, fall, curvature, bend = 0.0, 0.0, 0.0, -1.0, 0.0
    for _ in range(30):
        value, slope, bend = 0.0, 0.0, 0.0
        for i in range(terms.shape[0]):
            order, amplitude = terms[i, 0], terms[i, 1]
            argument = order * (theta - ahead) + terms[i, 2]
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


@inner
def roll_of(flanks, gear, flank, tooth, u):
    """Return the roll angle [rad] of a perfect flank whose outward normal has direction u in the gear's own frame."""
    sense_pitch = flanks.gears[gear, PITCH]
    start = flanks.gears[gear, ACTIVE_START + flank] - sense_pitch * (tooth - 1)
    roll = (1.0 - 2.0 * flank) * (start - u)
    return roll - TURN * np.floor(roll / TURN + 0.5)


@njit(cache=True)
def full_support(flanks, gear, flank, tooth, u):
    """Return the support function of a flank without relief and its first two derivatives."""
    base = flanks.gears[gear, BASE]
    delta, slope, bend = deviation(flanks, gear, flank, tooth, u)
    return base * roll_of(flanks, gear, flank, tooth, u) + delta, slope - (1.0 - 2.0 * flank) * base, bend


@njit(cache=True)
def support(flanks, gear, flank, tooth, u):
    """Return the support function of a flank and its first two derivatives."""
    roll = roll_of(flanks, gear, flank, tooth, u)
    if flanks.shaped != 0:
        return _call_shaped(flanks.shaped, (flanks, gear, flank, tooth, u, roll))
    base = flanks.gears[gear, BASE]
    return base * roll + flanks.offsets[gear, flank, tooth - 1], -(1.0 - 2.0 * flank) * base, 0.0


@njit(cache=True)
def relieved(flanks, gear, roll):
    """Return what relief takes off a flank along its normal, and its first two derivatives by the roll angle."""
    for end in (ROOT_RELIEF, TIP_RELIEF):
        reach, amount = flanks.gears[gear, end + REACH], flanks.gears[gear, end + AMOUNT]
        x = (roll - flanks.gears[gear, end + START]) / reach
        if amount != 0.0 and x > 0.0:
            if flanks.gears[gear, end + POWER] == 1.0:
                return amount * x, amount / reach, 0.0
            return amount * x * x, 2.0 * amount * x / reach, 2.0 * amount / (reach * reach)
    return 0.0, 0.0, 0.0


@inner
def taken_off(flanks, gear, flank, tooth, roll):
    """Return what relief takes off a flank along its normal, less what deviations of the profile put on."""
    taken, fall, bend = relieved(flanks, gear, roll)
    if flanks.slopes.shape[2] == 0:
        return taken, fall, bend
    reach, past = flanks.gears[gear, PROFILE_REACH], roll - flanks.gears[gear, ACTIVE_PROFILE]
    amount = flanks.slopes[gear, flank, tooth - 1]
    taken -= amount * (past / reach - 0.5)
    fall -= amount / reach
    waves = flanks.waves[gear, flank]
    for i in range(waves.shape[0]):
        size, number, only = waves[i, 0], waves[i, 1], waves[i, 3]
        if only != 0.0 and only != tooth:
            continue
        turn = number * max(past, 0.0) + waves[i, 2]
        taken -= size * (cos(turn) - number * sin(turn) * min(past, 0.0))
        fall += size * number * sin(turn)
        if past > 0.0:
            bend += size * number * number * cos(turn)
    return taken, fall, bend


@inner
def _relieved_support(flanks, gear, flank, tooth, at):
    """Find the roll angle whose tilted normal has the direction ``at`` (u, roll of the normal), and the support there.

    Newton on roll + τ(roll) = roll of the normal, which rises, within brackets.
    """
    u, wanted = at
    side = 1.0 - 2.0 * flank
    end = TIP_RELIEF if wanted > flanks.gears[gear, TIP_RELIEF + START] else ROOT_RELIEF
    start = flanks.gears[gear, end + START]
    roll, tilt, taken, slope = start, wanted - start, 0.0, 0.0
    h, s, c = full_support(flanks, gear, flank, tooth, u + side * tilt)
    edge = 0.0
    if flanks.gears[gear, end + POWER] == 1.0:
        slope = flanks.gears[gear, end + AMOUNT] / flanks.gears[gear, end + REACH]
        edge = atan2(slope, h + c)
    if abs(tilt) <= abs(edge):
        height = h * cos(tilt) - side * s * sin(tilt)
        return height, side * h * sin(tilt) + s * cos(tilt), -height
    low, high = min(start, wanted), max(start, wanted)  # relief tilts the normal towards its own end
    turn, radius = 1.0, 1.0
    roll = min(max(wanted - edge, low), high)
    for _ in range(40):
        h, s, c = full_support(flanks, gear, flank, tooth, u + side * (wanted - roll))
        taken, slope, bend = relieved(flanks, gear, roll)
        radius = h + c - taken
        tilt = atan2(slope, radius)
        turn = 1.0 + (bend * radius - slope * (flanks.gears[gear, BASE] - slope)) / (radius * radius + slope * slope)
        miss = roll + tilt - wanted
        if abs(miss) < 1e-14:
            break
        if miss > 0.0:
            high = roll
        else:
            low = roll
        new = roll - miss / turn
        roll = new if low < new < high else 0.5 * (low + high)
    height = (h - taken) * cos(tilt) - side * s * sin(tilt)
    around = side * (h - taken) * sin(tilt) + s * cos(tilt)
    return height, around, sqrt(radius * radius + slope * slope) / turn - height


@inner
def _profiled_support(flanks, gear, flank, tooth, at):
    """As :func:`_relieved_support`, with deviations of the profile: between edges of reliefs, above FLOOR."""
    u, wanted = at
    side, base = 1.0 - 2.0 * flank, flanks.gears[gear, BASE]
    low, high = flanks.gears[gear, FLOOR + flank], inf
    for end in (0, ROOT_RELIEF, TIP_RELIEF):
        roll = low if end == 0 else flanks.gears[gear, end + START]
        if not -inf < roll < inf:
            continue
        h, s, c = full_support(flanks, gear, flank, tooth, u + side * (wanted - roll))
        taken, slope, _ = taken_off(flanks, gear, flank, tooth, roll)  # at a start that of the unrelieved side
        jump = 0.0
        if end != 0 and flanks.gears[gear, end + POWER] == 1.0:
            jump = flanks.gears[gear, end + AMOUNT] / flanks.gears[gear, end + REACH]
        before, after = (
            roll + atan2(slope + min(jump, 0.0), h + c - taken),
            roll + atan2(slope + max(jump, 0.0), h + c - taken),
        )
        if (before <= wanted or end == 0) and wanted <= after:
            tilt = wanted - roll
            height = (h - taken) * cos(tilt) - side * s * sin(tilt)
            return height, side * (h - taken) * sin(tilt) + s * cos(tilt), -height
        if wanted < before:
            high = min(high, roll)
        else:
            low = max(low, roll)
    high = min(high, max(low, wanted) + 1.0)
    roll = min(max(wanted, low), high)
    h, s, taken, slope, tilt, turn, radius = 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0
    for _ in range(60):
        h, s, c = full_support(flanks, gear, flank, tooth, u + side * (wanted - roll))
        taken, slope, bend = taken_off(flanks, gear, flank, tooth, roll)
        radius = h + c - taken
        tilt = atan2(slope, radius)
        turn = 1.0 + (bend * radius - slope * (base - slope)) / (radius * radius + slope * slope)
        miss = roll + tilt - wanted
        if abs(miss) < 1e-14:
            break
        if miss > 0.0:
            high = roll
        else:
            low = roll
        new = roll - miss / turn
        roll = new if low < new < high else 0.5 * (low + high)
    height = (h - taken) * cos(tilt) - side * s * sin(tilt)
    around = side * (h - taken) * sin(tilt) + s * cos(tilt)
    return height, around, sqrt(radius * radius + slope * slope) / turn - height


@njit(cache=True)
def _shaped_support(flanks, gear, flank, tooth, u, roll):
    """As :func:`support`, of flanks with waves, relief or deviations of the profile."""
    if flanks.slopes.shape[2] > 0:
        return _profiled_support(flanks, gear, flank, tooth, (u, roll))
    if flanks.gears[gear, ROOT_RELIEF + START] <= roll <= flanks.gears[gear, TIP_RELIEF + START]:
        delta, slope, bend = deviation(flanks, gear, flank, tooth, u)
        return flanks.gears[gear, BASE] * roll + delta, slope - (1.0 - 2.0 * flank) * flanks.gears[gear, BASE], bend
    return _relieved_support(flanks, gear, flank, tooth, (u, roll))


def compile_pair(pair: Meshing) -> Flanks:
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
    """Return points and outward normals of perfect flanks, in closed form."""
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
    """Return the angle within half a revolution of 0."""
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
