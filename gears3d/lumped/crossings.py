"""Flights that begin as contact is lost, in closed form: perfect flanks, constant torque, one harmonic.

The relative acceleration drives the gears apart up to the phase at which the other flank would be lost, and together
from there to the phase of the next loss on this one. Between these two phases the gap's rate is monotonic, so that its
turning point and the first touch, of either flank, have bounds: nothing is missed. All else goes the general way.

Source: Rigaud & Perret-Liaudet 2020, eqs (12)-(14), (17)-(19).
"""

from __future__ import annotations

from math import acos, cos, floor, inf, pi, sin

from gears3d.lumped import layout as at
from gears3d.lumped.bounces import land, swing
from gears3d.lumped.compile import inner
from gears3d.lumped.impacts import impact

GRAZE = 1e-9
"""A highest point so near the other flank, of the backlash, is left to the general way."""


@inner
def _fly(v, pull, size, omega, c0, s0, tau):
    """Return gap, rate and acceleration of any flight; ``pull`` and ``size`` = ±Rb1·A carry the flank's sign."""
    x = omega * tau
    if x < 0.7:
        c, s = swing(x)
        versine, lag = c * x * x, s * x * x * x
        sine = x - lag
    else:
        half, sine = sin(0.5 * x), sin(x)
        versine, lag = 2.0 * half * half, x - sine
    gap = v * tau - (0.5 * pull * tau * tau + size / omega * (c0 * versine - s0 * lag))
    rate = v - (pull * tau + size * (c0 * sine - s0 * versine))
    return gap, rate, -(pull + size * omega * (c0 * (1.0 - versine) - s0 * sine))


@inner
def _meets(v, pull, size, omega, c0, s0, goal, low, high, tau):
    """Return when the gap is ``goal`` between two times where it is monotonic, and its rate then: Newton, bracketed."""
    rising = _fly(v, pull, size, omega, c0, s0, high)[0] > goal
    for _ in range(80):
        gap, rate, _ = _fly(v, pull, size, omega, c0, s0, tau)
        if (gap > goal) == rising:
            high = tau
        else:
            low = tau
        step = (goal - gap) / rate if rate != 0.0 else inf
        if not low <= tau + step <= high:
            step = 0.5 * (low + high) - tau
        tau += step
        if abs(step) <= 1e-15 * tau:
            break
    return tau, _fly(v, pull, size, omega, c0, s0, tau)[1]


@inner
def _turns(v, pull, size, omega, c0, s0, low, high):
    """Return when the gap's rate, which falls from above to below zero between two times, is zero."""
    tau = 0.5 * (low + high)
    for _ in range(80):
        _, rate, bend = _fly(v, pull, size, omega, c0, s0, tau)
        if rate > 0.0:
            low = tau
        else:
            high = tau
        step = -rate / bend if bend != 0.0 else inf
        if not low <= tau + step <= high:
            step = 0.5 * (low + high) - tau
        tau += step
        if abs(step) <= 1e-12 * tau:
            break
    return tau


@inner
def cross_over(m, state, count, spacing, n_samples, end, w):
    """Fly from a flank that has just been lost to the next touch of either; False where it must go the general way."""
    flank = int(state[at.DEPARTED])
    v = state[at.RATES + flank]
    if m[at.SIMPLE] == 0.0 or state[at.SIGN] == 0.0 or state[at.GAPS + flank] != 0.0 or v < 0.0:
        return False
    side = 1.0 if flank == 0 else -1.0
    omega, t = m[at.HARMONICS + 1], state[at.TIME]
    size = side * m[at.RADIUS_DRIVE] * m[at.HARMONICS]
    brake = (m[at.BASE] * state[at.SIGN] - m[at.BASE + 2]) / m[at.INERTIA]
    pull, push = side * m[at.RADIUS_LOOSE] * brake, size * omega
    if abs(pull) >= abs(push):
        return False
    psi = omega * t + m[at.HARMONICS + 2]
    c0, s0 = cos(psi), sin(psi)
    if pull + push * c0 > GRAZE * abs(push):
        return False
    turn = acos(-pull / push)
    ahead = (2.0 * pi - turn if flank == 0 else turn) - psi
    ahead -= 2.0 * pi * floor(ahead / (2.0 * pi))
    apart, back = ahead / omega, (ahead + (2.0 * turn if flank == 0 else 2.0 * pi - 2.0 * turn)) / omega
    backlash = m[at.BACKLASH]
    height, other = backlash, 1 - flank
    if _fly(v, pull, size, omega, c0, s0, apart)[0] >= backlash:
        tau, rate = _meets(v, pull, size, omega, c0, s0, backlash, 0.0, apart, apart)
    else:
        last, falls, _ = _fly(v, pull, size, omega, c0, s0, back)
        top = back
        if falls < 0.0:
            top = _turns(v, pull, size, omega, c0, s0, apart, back)
        highest = _fly(v, pull, size, omega, c0, s0, top)[0]
        if highest > backlash * (1.0 + GRAZE):
            tau, rate = _meets(v, pull, size, omega, c0, s0, backlash, apart, top, apart)
        elif highest > backlash * (1.0 - GRAZE) or last > 0.0:
            return False
        else:
            tau, rate = _meets(v, pull, size, omega, c0, s0, 0.0, top, back, back)
            height, other = highest, flank
    stop = min(end, count[at.N_SAMPLES] * spacing) if count[at.N_SAMPLES] < n_samples else end
    speed = state[at.SPEED] - brake * tau
    if not (tau > 0.0 and t + tau < stop) or speed * state[at.SIGN] <= 1e-3 * abs(state[at.SPEED]):
        return False
    away = 1.0 if other == flank else -1.0
    place = 0.0 if other == 0 else backlash
    land(m, state, t + tau, other, place, speed, away * rate, height, away * pull, away * size)
    impact(m, state, count, other, w)
    return True
