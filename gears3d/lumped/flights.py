"""Free flights in closed form, :mod:`gears3d.lumped.closed_form`, from between the flanks to the next contact.

The relative acceleration changes its sign at two phases of the drive's period. Between two such phases the gap's rate
is monotonic: it has one zero at most, and the gap is monotonic before and after it. So every root of the gap to either
flank is bracketed, and the first one is found.

Source: Rigaud & Perret-Liaudet 2020, eqs (12)-(14), (17)-(19).
"""

from __future__ import annotations

from math import acos, cos, inf, pi, sin

from gears3d.lumped import layout as at
from gears3d.lumped.closed_form import fly, place, sample
from gears3d.lumped.compile import inner
from gears3d.lumped.flank_events import impact, let_go, set_on_flank
from gears3d.lumped.law import TOUCH

BESIDE = 1e-9  # phases that differ by less are equal [rad]


@inner
def _when(v, pull, size, omega, c0, s0, goal, order, low, high, tau):
    """Return when the gap is ``goal``, or its rate where ``order`` is 1, between two times: Newton, bracketed."""
    gap, rate, bend = fly(v, pull, size, omega, c0, s0, high)
    rises = (rate if order == 1.0 else gap) > goal
    exact = 1e-12 if order == 1.0 else 1e-15
    for _ in range(80):
        gap, rate, bend = fly(v, pull, size, omega, c0, s0, tau)
        off, slope = gap - goal, rate
        if order == 1.0:
            off, slope = rate - goal, bend
        if (off > 0.0) == rises:
            high = tau
        else:
            low = tau
        step = -off / slope if slope != 0.0 else inf
        if not low <= tau + step <= high:
            step = 0.5 * (low + high) - tau
        tau += step
        if abs(step) <= exact * tau:
            break
    return tau


@inner
def follow_flight(m, state, count, impacts, samples, spacing, end):
    """Follow the free flight to the next contact, the loose gear's standstill, or the end."""
    flank, t, sign, speed = int(state[at.DEPARTED]), state[at.TIME], state[at.SIGN], state[at.SPEED]
    side, omega, start, v = 1.0 - 2.0 * flank, m[at.HARMONICS + 1], state[at.GAPS + flank], state[at.RATES + flank]
    size, brake = side * m[at.RADIUS_DRIVE] * m[at.HARMONICS], m[at.BASE] * sign / m[at.INERTIA]
    pull, push, psi = side * m[at.RADIUS_LOOSE] * brake, size * omega, omega * t + m[at.HARMONICS + 2]
    c0, s0 = cos(psi), sin(psi)
    low, high, height = -start, m[at.BACKLASH] - start, max(state[at.HEIGHT], start)
    until, stops, meets, crosses = end - t, False, False, high <= 0.0 and v > 0.0
    if brake * sign > 0.0 and speed / brake < until:
        until, stops = speed / brake, True
    parts = v
    if v == 0.0:  # just after separation the acceleration is rounding
        parts = -(pull + push * c0)
        if state[at.LIFT] >= 0.0 and 0.5 * abs(parts) < m[at.UNFELT] * (1.0 + 1e-3 * m[at.RATE] * t):
            parts = push * s0
    meets = start <= 0.0 and parts < 0.0
    turn = acos(-pull / push) if abs(pull) < abs(push) else pi
    tau, begun, gap, rate = 0.0, 0.0, 0.0, v
    while not meets and not crosses and begun < until:
        # up to the next of the phases where the acceleration changes its sign
        behind = (psi + omega * begun + BESIDE) % (2.0 * pi)
        ahead = turn if behind < turn else 2.0 * pi - turn if behind < 2.0 * pi - turn else 2.0 * pi + turn
        finish = min(begun + (ahead - behind + BESIDE) / omega, until)
        for part in range(2):  # up to where the rate changes sign, and after it
            before, tau = gap, finish
            gap, after, _ = fly(v, pull, size, omega, c0, s0, finish)
            if part == 0 and rate * after < 0.0:
                tau = _when(v, pull, size, omega, c0, s0, 0.0, 1.0, begun, finish, 0.5 * (begun + finish))
                gap, after, _ = fly(v, pull, size, omega, c0, s0, tau)
            meets, crosses = gap < low, gap > high
            if meets or crosses:
                goal = low if meets else high
                guess = begun + (tau - begun) * (goal - before) / (gap - before)
                tau = _when(v, pull, size, omega, c0, s0, goal, 0.0, begun, tau, guess)
                break
            height, begun, rate = max(height, start + gap), tau, after
            if tau == finish:
                break
    now = t + tau if stops or meets or crosses else end
    gap, rate, _ = fly(v, pull, size, omega, c0, s0, tau)
    sample(m, state, count, samples, spacing, now)
    gap, speed = start + gap, speed - brake * tau
    if crosses:
        flank, rate, height = 1 - flank, -rate, m[at.BACKLASH]
    if meets or crosses:
        place(m, state, now, flank, 0.0, rate, speed, height)
        if tau == 0.0 and rate > -TOUCH:
            count[at.GRAZING] += 1
            set_on_flank(m, state, flank, 0.0, 1e-6 / m[at.RATE])
        else:
            impact(m, state, count, impacts, flank)
    else:
        place(m, state, now, flank, gap, rate, 0.0 if stops else speed, height)
        if stops:
            let_go(m, state)
