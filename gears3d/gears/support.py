"""Flanks as support functions, compiled.

A flank is its support function: h(u) is the distance of the tangent with outward normal direction u from the gear's
axis, in the gear's own frame, so the point is p = h·n + h'·t with n = (cos u, sin u) and t = (−sin u, cos u), and
h + h'' is the radius of curvature. For an involute h = base radius × roll angle, linear in u.

A flank that is to touch a perfect mate displaced by φ(θ) is the envelope of that mate in its own frame, which adds
δ(u) = max over θ of K(u + σθ) + φ(θ) to h. K ≤ 0 is the distance of the perfect flanks off the line of action and
σ = ±1 the gear's sense of rotation; δ = φ only where φ is constant.

Relief takes f(roll) off along the normal of the flank so made, p − f·n. That tilts the normal by τ = atan(f'/R), R the
radius of curvature less f, so at a linear relief's start the flank has an edge, at which the point stays and the
normal turns.

Gears are numbered 0 drive, 1 loose; flanks 0 active, 1 reverse; teeth from 1 in order of meshing.
"""

from __future__ import annotations

from math import atan2, cos, pi, sin, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gears3d.gears.deviation import FLANKS, GEARS, HarmonicDeviation
from gears3d.gears.rack import form
from gears3d.gears.relief import relief_rows
from gears3d.kernels import njit

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair

DRIVE, LOOSE = 0, 1
ACTIVE, REVERSE = 0, 1
PATH, BASE_SUM, DISTANCE, DIRECTION = 0, 1, 2, 3
BASE, PITCH, ACTIVE_START, REVERSE_START, FORM_ROLL, TIP_ROLL = 0, 1, 2, 3, 4, 5
TURN = 2.0 * pi
_ROOT, _TIP = 6, 10
_START, _REACH, _AMOUNT, _POWER = 0, 1, 2, 3


class Flanks(NamedTuple):
    """The flanks of a pair as arrays that compiled functions take.

    Args:
        mount: working length between the base circles, sum of the base radii, centre distance [m] and direction of
            the line of action's normal [rad] that the flanks are made for, (4,).
        gears: for each gear base radius [m], angle between teeth with the sign of its rotation [rad], normal direction
            at the start of tooth 1's active and reverse involute [rad], roll angles of form circle and tip [rad]; of
            root and tip relief start and length in roll angle [rad], amount at the end [m] and power, (2, 14).
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
    gears = np.zeros((2, 14))
    for row, which, sense in ((DRIVE, "drive", 1.0), (LOOSE, "loose", -1.0)):
        gear, half = pair.gear(which), pair.half_angle(which)
        start, lowest = direction + mount[PATH] / mount[BASE_SUM], form(gear, half)[0]
        gears[row] = (
            gear.base_radius,
            sense * TURN / gear.teeth,
            start,
            start - 2.0 * half - pi,
            lowest,
            gear.tip_roll,
            *relief_rows(gear, lowest),
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


def relief_starts(flanks: Flanks, gear: int) -> NDArray[np.float64]:
    """Return the roll angles at which the reliefs of a gear start [rad], ascending, those that there are.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
    """
    starts = flanks.gears[gear, [_ROOT + _START, _TIP + _START]]
    return starts[np.isfinite(starts)]


@njit(cache=True)
def turned_on(flanks, turn_drive, turn_loose):
    """Return the flanks of sections that are turned on in their gears, so that deviations come when they should.

    A harmonic deviation is a function of the gear's angle at the moment of touching. A section that stands ahead of the
    gear by some angle meets what it shall impose at an angle that much larger.

    Args:
        flanks: the arrays of a pair.
        turn_drive: by how much the drive gear's section is turned about +z [rad].
        turn_loose: the same of the loose gear [rad].

    Returns:
        The arrays; the same ones where nothing depends on the angle.
    """
    if flanks.harmonics.shape[2] == 0 or (turn_drive == 0.0 and turn_loose == 0.0):
        return flanks
    harmonics = flanks.harmonics.copy()
    for flank in range(2):
        for i in range(harmonics.shape[2]):
            harmonics[0, flank, i, 2] -= harmonics[0, flank, i, 0] * turn_drive
            harmonics[1, flank, i, 2] += harmonics[1, flank, i, 0] * turn_loose
    return Flanks(flanks.mount, flanks.gears, harmonics, flanks.offsets)


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
    distance, base_sum, direction = flanks.mount[DISTANCE], flanks.mount[BASE_SUM], flanks.mount[DIRECTION]
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
    sense_pitch = flanks.gears[gear, PITCH]
    start = flanks.gears[gear, ACTIVE_START + flank] - sense_pitch * (tooth - 1)
    roll = (1.0 - 2.0 * flank) * (start - u)
    return roll - TURN * np.floor(roll / TURN + 0.5)


@njit(cache=True)
def full_support(flanks, gear, flank, tooth, u):
    """Return the support function of a flank without relief and its first two derivatives.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        tooth: number of the tooth.
        u: direction of the outward normal in the gear's own frame [rad].

    Returns:
        h [m], h' [m/rad], h'' [m/rad²].
    """
    base = flanks.gears[gear, BASE]
    delta, slope, bend = deviation(flanks, gear, flank, tooth, u)
    return base * roll_of(flanks, gear, flank, tooth, u) + delta, slope - (1.0 - 2.0 * flank) * base, bend


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
        h [m], h' [m/rad], h'' [m/rad²]; the point is h·n + h'·t, the radius of curvature h + h''. On a relief h''
        leaves out how the deviation's own curvature changes there.
    """
    base = flanks.gears[gear, BASE]
    roll = roll_of(flanks, gear, flank, tooth, u)
    if flanks.gears[gear, _ROOT + _START] <= roll <= flanks.gears[gear, _TIP + _START]:
        delta, slope, bend = deviation(flanks, gear, flank, tooth, u)
        return base * roll + delta, slope - (1.0 - 2.0 * flank) * base, bend
    return _relieved_support(flanks, gear, flank, tooth, (u, roll))


@njit(cache=True)
def taken_off(flanks, gear, roll):
    """Return what relief takes off a flank along its normal, and its first two derivatives by the roll angle.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
        roll: roll angle [rad].

    Returns:
        f [m], f' [m/rad], f'' [m/rad²].
    """
    for end in (_ROOT, _TIP):
        reach, amount = flanks.gears[gear, end + _REACH], flanks.gears[gear, end + _AMOUNT]
        x = (roll - flanks.gears[gear, end + _START]) / reach
        if amount != 0.0 and x > 0.0:
            if flanks.gears[gear, end + _POWER] == 1.0:
                return amount * x, amount / reach, 0.0
            return amount * x * x, 2.0 * amount * x / reach, 2.0 * amount / (reach * reach)
    return 0.0, 0.0, 0.0


@njit(cache=True)
def _relieved_support(flanks, gear, flank, tooth, at):
    """Find the roll angle whose tilted normal has the direction ``at`` (u, roll of the normal), and the support there.

    Newton on roll + τ(roll) = roll of the normal, which rises, within brackets.
    """
    u, wanted = at
    side = 1.0 - 2.0 * flank
    end = _TIP if wanted > flanks.gears[gear, _TIP + _START] else _ROOT
    start = flanks.gears[gear, end + _START]
    roll, tilt, taken, slope = start, wanted - start, 0.0, 0.0
    h, s, c = full_support(flanks, gear, flank, tooth, u + side * tilt)
    edge = 0.0
    if flanks.gears[gear, end + _POWER] == 1.0:
        slope = flanks.gears[gear, end + _AMOUNT] / flanks.gears[gear, end + _REACH]
        edge = atan2(slope, h + c)
    if abs(tilt) <= abs(edge):
        height = h * cos(tilt) - side * s * sin(tilt)
        return height, side * h * sin(tilt) + s * cos(tilt), -height
    low, high = min(start, wanted - 1.0), max(start, wanted)
    turn, radius = 1.0, 1.0
    roll = min(max(wanted - edge, low), high)
    for _ in range(40):
        h, s, c = full_support(flanks, gear, flank, tooth, u + side * (wanted - roll))
        taken, slope, bend = taken_off(flanks, gear, roll)
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
