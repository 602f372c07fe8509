"""Flanks as support functions, compiled.

A flank is its support function: h(u) is the distance of the tangent with outward normal direction u from the gear's
axis, in the gear's own frame, so the point is p = h·n + h'·t with n = (cos u, sin u) and t = (−sin u, cos u), and
h + h'' is the radius of curvature. For an involute h = base radius × roll angle, linear in u.

A flank that is to touch a perfect mate displaced by φ(θ) is the envelope of that mate in its own frame, which adds
δ(u) = max over θ of K(u + σθ) + φ(θ) to h. K ≤ 0 is the distance of the perfect flanks off the line of action and
σ = ±1 the gear's sense of rotation; δ = φ only where φ is constant.

Relief takes f(roll) off along the normal of the flank so made, p − f·n, and deviations of the profile put material on
the same way. That tilts the normal by τ = atan(f'/R), R the radius of curvature less f, so at a linear relief's start
the flank has an edge, at which the point stays and the normal turns.

Gears are numbered 0 drive, 1 loose; flanks 0 active, 1 reverse; teeth from 1 in order of meshing.
"""

from __future__ import annotations

from math import atan2, cos, inf, sin, sqrt

import numpy as np
from numba import float64, int64, types

from gears3d.gears.arrays import (
    ACTIVE_PROFILE,
    ACTIVE_START,
    AMOUNT,
    BASE,
    BASE_SUM,
    DIRECTION,
    DISTANCE,
    FLOOR,
    PITCH,
    POWER,
    PROFILE_REACH,
    REACH,
    ROOT_RELIEF,
    START,
    TIP_RELIEF,
    TURN,
    Flanks,
)
from gears3d.kernels import inner, njit
from gears3d.records import address_of, caller

_SHAPED = types.UniTuple(float64, 3)(Flanks.compiled, int64, int64, int64, float64, float64)
_call_shaped = caller(_SHAPED)


def shaped_address() -> int:
    """Return the address of the support function of flanks that are no perfect involutes."""
    return address_of(_shaped_support, _SHAPED)


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
    roll = roll_of(flanks, gear, flank, tooth, u)
    if flanks.shaped != 0:
        return _call_shaped(flanks.shaped, (flanks, gear, flank, tooth, u, roll))
    base = flanks.gears[gear, BASE]
    return base * roll + flanks.offsets[gear, flank, tooth - 1], -(1.0 - 2.0 * flank) * base, 0.0


@njit(cache=True)
def relieved(flanks, gear, roll):
    """Return what relief takes off a flank along its normal, and its first two derivatives by the roll angle.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
        roll: roll angle [rad].

    Returns:
        f [m], f' [m/rad], f'' [m/rad²].
    """
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
    """Return what relief takes off a flank along its normal, less what deviations of the profile put on.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        tooth: number of the tooth.
        roll: roll angle [rad].

    Returns:
        f [m], f' [m/rad], f'' [m/rad²].
    """
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
    """As :func:`_relieved_support`, with deviations of the profile: between the edges of reliefs, down to the floor."""
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
