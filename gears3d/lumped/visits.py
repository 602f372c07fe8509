"""A contact episode of the loose gear: approach, impact and rebound under given forces, without periodicity.

Slowly varying quantities are given on a grid; only the motion between the flanks is computed. It compares
measured paths with laws of contact, a few hundred short ones at a time.
"""

from __future__ import annotations

import numpy as np

from gears3d.kernels import njit

NEAR = 0.1  # largest change of the gap in a step with oil in it, as a part of the gap
SLOWEST = 1e-7  # shortest step [s]
# A flank is not reached in a step if it is this many times as far as the gear moves towards it at its speed.
AMID = 3.0
EDGE = 1e-8  # overshoot of a step beyond the moment at which teeth touch [s]
ACTIVE, REVERSE, FREE = 0, 1, 2
# Numbers of a law: of the oil [N·s, N·s·m^0.5, m], of the teeth [N/m, N·s/m], of the flanks [1], of impacts [1, s/m,
# 1], rebound speed below which the gear stays in contact [m/s], mass along the line of action [kg].
WEDGE, SQUEEZE, LAYER, STIFFNESS, DAMPING, FRICTION, RESTITUTION, SLOPE, ASYMMETRY, STICK, MASS = range(11)
NUMBERS = 11
# Columns on the grid: acceleration without the flanks [m/s²], place of both flanks [m], rolling speed [m/s], speed of
# both flanks [m/s].
FORCED, LOW, HIGH, ROLLING, LOW_RATE, HIGH_RATE = range(6)
COLUMNS = 6


@njit(cache=True, error_model="numpy")
def _push(law, gap, rate, rolling):
    """Acceleration away from one flank, by its teeth and by its oil [m/s²]."""
    teeth, oil = 0.0, 0.0
    if law[STIFFNESS] > 0.0 and gap < law[LAYER]:
        teeth = max(0.0, law[STIFFNESS] * (law[LAYER] - gap) - law[DAMPING] * rate)
    if law[WEDGE] > 0.0 or law[SQUEEZE] > 0.0:
        h = max(gap, law[LAYER])
        oil = law[WEDGE] * abs(rolling) / h
        if rate < 0.0:
            oil -= law[SQUEEZE] * rate / (h * np.sqrt(h))
    return teeth / law[MASS], oil / law[MASS]


@njit(cache=True, error_model="numpy")
def _flank(at, slope, x, side):
    """Place and speed of a flank at a part ``x`` of a step of the grid."""
    rate, bend = at[LOW_RATE + side], slope[LOW_RATE + side]
    return at[LOW + side] + x * (rate + 0.5 * bend * x), rate + bend * x


@njit(cache=True, error_model="numpy")
def _accelerated(law, y, v, at, slope, x):
    """Acceleration at a part ``x`` of a step of the grid, with values and slopes of the grid there."""
    forced = at[FORCED] + x * slope[FORCED]
    oiled = law[WEDGE] > 0.0 or law[SQUEEZE] > 0.0
    if not oiled and law[STIFFNESS] == 0.0:
        return forced
    low, low_rate = _flank(at, slope, x, ACTIVE)
    high, high_rate = _flank(at, slope, x, REVERSE)
    if not oiled and y - low >= law[LAYER] and high - y >= law[LAYER]:
        return forced
    rolling = at[ROLLING] + x * slope[ROLLING]
    teeth, oil = _push(law, y - low, v - low_rate, rolling)
    other, film = _push(law, high - y, high_rate - v, rolling)
    return forced + teeth * (1.0 - law[FRICTION]) - other * (1.0 + law[FRICTION]) + oil - film


@njit(cache=True, error_model="numpy")
def _step(law, y, v, at, slope, x, h):
    """One step of Runge and Kutta, fourth order."""
    a1 = _accelerated(law, y, v, at, slope, x)
    k = 0.5 * h
    v2 = v + k * a1
    a2 = _accelerated(law, y + k * v, v2, at, slope, x + k)
    v3 = v + k * a2
    a3 = _accelerated(law, y + k * v2, v3, at, slope, x + k)
    v4 = v + h * a3
    a4 = _accelerated(law, y + h * v3, v4, at, slope, x + h)
    return y + h * (v + 2.0 * v2 + 2.0 * v3 + v4) / 6.0, v + h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0


@njit(cache=True, error_model="numpy")
def _over(law, y, at, slope, x):
    """Overlap with a rigid flank, and which flank."""
    low, high = _flank(at, slope, x, ACTIVE)[0] + law[LAYER], _flank(at, slope, x, REVERSE)[0] - law[LAYER]
    return (low - y, ACTIVE) if low - y > y - high else (y - high, REVERSE)


@njit(cache=True, error_model="numpy")
def _finest(law, y, v, at, slope, x, left):
    """Longest step that the oil allows, and that ends where compliant teeth touch."""
    h = left
    if law[STIFFNESS] > 0.0:
        for side in (ACTIVE, REVERSE):
            place, rate = _flank(at, slope, x, side)
            sign = 1.0 if side == ACTIVE else -1.0
            gap, opens = sign * (y - place) - law[LAYER], sign * (v - rate)
            if opens != 0.0 and 0.0 < -gap / opens < h:
                h = -gap / opens + EDGE
    if law[WEDGE] > 0.0 or law[SQUEEZE] > 0.0:
        low, low_rate = _flank(at, slope, x, ACTIVE)
        high, high_rate = _flank(at, slope, x, REVERSE)
        near = min(y - low, high - y)
        rate = max(abs(v - low_rate), abs(v - high_rate))
        thick = max(near, law[LAYER])
        h = min(h, NEAR * thick / max(rate, 1e-5))
        h = min(h, law[MASS] * (thick * np.sqrt(thick)) / max(law[SQUEEZE], 1e-300))
    return max(h, min(left, SLOWEST))


@njit(cache=True, error_model="numpy")
def _bounced(law, v, flank, side):
    """Speed after an impact on a flank of speed ``flank``, and whether the gear stays there."""
    sign = 1.0 if side == ACTIVE else -1.0
    speed = max(-sign * (v - flank), 0.0)
    e = law[RESTITUTION] + law[SLOPE] * speed + 0.5 * sign * law[ASYMMETRY]
    back = min(max(e, 0.0), 1.0) * speed
    return (flank, side) if back < law[STICK] else (flank + sign * back, FREE)


@njit(cache=True, error_model="numpy")
def _ridden(law, at, slope, side, x):
    """State on a rigid flank, and whether contact ends."""
    sign = 1.0 if side == ACTIVE else -1.0
    y, v = _flank(at, slope, x, side)
    y += sign * law[LAYER]
    leaves = sign * (_accelerated(law, y, v, at, slope, x) - slope[LOW_RATE + side]) > 0.0
    return y, v, leaves


@njit(cache=True, error_model="numpy")
def _far(law, y, v, at, nearer, step):
    """Whether no force between the flanks acts within a step of the grid: both are out of reach."""
    if law[WEDGE] > 0.0 or law[SQUEEZE] > 0.0:
        return False
    for side in (ACTIVE, REVERSE):
        rate = at[LOW_RATE + side]
        moves = AMID * abs(v - rate) + abs(nearer[LOW_RATE + side] - rate) + step * abs(at[FORCED])
        if abs(y - at[LOW + side]) - law[LAYER] < moves * step:
            return False
    return at[LOW] < y < at[HIGH]


@njit(cache=True, error_model="numpy")
def follow(law, start, given, step, out):
    """Integrate one path over its grid, ``step`` [s] apart, and write the place at every point into ``out`` [m], (n,).

    ``law`` is (NUMBERS,), ``start`` place [m] and speed [m/s], ``given`` (n, COLUMNS).
    """
    y, v, mode = start[0], start[1], FREE
    slope = np.zeros(COLUMNS)
    rigid = law[STIFFNESS] == 0.0
    for i in range(len(given) - 1):
        out[i] = y
        at = given[i]
        if mode == FREE and _far(law, y, v, at, given[i + 1], step):
            y += step * (v + step * (at[FORCED] / 3.0 + given[i + 1, FORCED] / 6.0))
            v += 0.5 * step * (at[FORCED] + given[i + 1, FORCED])
            continue
        for c in range(COLUMNS):
            slope[c] = (given[i + 1, c] - at[c]) / step
        x = 0.0
        for _ in range(4000):
            left = step - x
            if left <= 1e-12:
                break
            if mode != FREE:
                y, v, leaves = _ridden(law, at, slope, mode, x)
                if not leaves:
                    y = given[i + 1, LOW + mode] + (law[LAYER] if mode == ACTIVE else -law[LAYER])
                    break
                mode = FREE
            h = _finest(law, y, v, at, slope, x, left)
            y2, v2 = _step(law, y, v, at, slope, x, h)
            if rigid:
                over, side = _over(law, y2, at, slope, x + h)
                if over > 0.0:
                    h, y2, v2, mode = _struck(law, y, v, at, slope, x, h, side)
            y, v, x = y2, v2, x + h
    out[len(given) - 1] = y


@njit(cache=True, error_model="numpy")
def _struck(law, y, v, at, slope, x, h, side):
    """Length of the step to an impact on a rigid flank, the state after it, and the place of the gear then."""
    low, high = 0.0, h
    for _ in range(40):
        middle = 0.5 * (low + high)
        if _over(law, _step(law, y, v, at, slope, x, middle)[0], at, slope, x + middle)[0] > 0.0:
            high = middle
        else:
            low = middle
        if high - low < 1e-10:
            break
    y2, v2 = _step(law, y, v, at, slope, x, high)
    y2, rate = _flank(at, slope, x + high, side)
    v2, mode = _bounced(law, v2, rate, side)
    y2 += law[LAYER] if side == ACTIVE else -law[LAYER]
    return max(high, SLOWEST), y2, v2, mode


@njit(cache=True, error_model="numpy")
def follow_all(law, starts, zero, given, sizes, step, per, out):
    """Integrate many paths, each with its own start and grid, and return means over ``per`` steps each.

    ``law`` is (NUMBERS,), ``starts`` (w, 2) place [m] and speed [m/s], ``given`` (w, n, COLUMNS) with ``sizes`` (w,)
    points that count, ``step`` [s] apart. Both flanks lie higher than given by ``zero`` [m]. ``out`` (w, (n - 1)//per)
    gets the means [m].
    """
    path, start = np.zeros(given.shape[1]), np.zeros(2)
    for w in range(len(starts)):
        start[0], start[1] = starts[w, 0] - zero, starts[w, 1]
        follow(law, start, given[w, : sizes[w]], step, path)
        for k in range((sizes[w] - 1) // per):
            total = 0.5 * (path[k * per] + path[(k + 1) * per])
            for j in range(1, per):
                total += path[k * per + j]
            out[w, k] = total / per + zero
