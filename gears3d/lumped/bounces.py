"""Series of bounces on one flank in closed form, :mod:`gears3d.lumped.closed_form`, all in registers.

A bounce is taken only where it is proved to be concave up to its root, which is then the only one, and where the other
flank is out of reach; the rest is done by :mod:`gears3d.lumped.flights`.
"""

from __future__ import annotations

from math import cos, sin

from gears3d.lumped import layout as at
from gears3d.lumped.closed_form import fly, place, sample
from gears3d.lumped.compile import inner
from gears3d.lumped.flank_events import impact, let_go
from gears3d.lumped.law import LEAST, restitution, thrust

WIDEST = 0.7  # largest phase of a bounce [rad]


@inner
def follow_bounces(m, state, count, impacts, samples, spacing, end):
    """Follow bounces on one flank until one is not proved; True when at least one was done."""
    flank = int(state[at.DEPARTED])
    if state[at.SIGN] == 0.0 or state[at.GAPS + flank] != 0.0 or not state[at.RATES + flank] > 0.0:
        return False
    side, omega = 1.0 - 2.0 * flank, m[at.HARMONICS + 1]
    size, brake = side * m[at.RADIUS_DRIVE] * m[at.HARMONICS], m[at.BASE] * state[at.SIGN] / m[at.INERTIA]
    pull, jerk = side * m[at.RADIUS_LOOSE] * brake, abs(size) * omega * omega
    push = m[at.INERTIA] / m[at.RADIUS_LOOSE] * thrust(m, side, state[at.SIGN])
    place_of, stick = flank * m[at.BACKLASH], max(m[at.STICK_VELOCITY], LEAST)
    t, v, speed = state[at.TIME], state[at.RATES + flank], state[at.SPEED]
    done, first, sticks = 0, count[at.N_IMPACTS], False
    while first + done < impacts.shape[0]:
        psi = omega * t + m[at.HARMONICS + 2]
        c0, s0 = cos(psi), sin(psi)
        start = pull + size * omega * c0
        if start <= 0.0:
            break
        longest = 2.5 * v / start
        if omega * longest > WIDEST or jerk * longest > 0.2 * start or t + longest >= end:
            break
        if v * v >= 1.6 * start * m[at.BACKLASH] or abs(brake) * longest >= 0.5 * speed * state[at.SIGN]:
            break
        # the landing: Halley's method on gap/τ from the cubic's root
        tau = 2.0 * v / (start - size * omega * omega * s0 * 2.0 * v / (3.0 * start))
        rate = 0.0
        for _ in range(20):
            gap, rate, bend = fly(v, pull, size, omega, c0, s0, tau)
            inverse = 1.0 / tau
            q = gap * inverse
            q1 = (rate - q) * inverse
            q2 = (bend - 2.0 * q1) * inverse
            step = -2.0 * q * q1 / (2.0 * q1 * q1 - q * q2)
            rate += bend * step
            tau += step
            if abs(step) <= 1e-6 * tau:
                break
        # the highest point, from where a cubic has its own
        top, height = v / (start - 0.5 * size * omega * omega * s0 * v / start), 0.0
        for _ in range(20):
            gap, climb, bend = fly(v, pull, size, omega, c0, s0, top)
            step = -climb / bend
            height = gap + 0.5 * climb * step
            if abs(step) <= 1e-2 * top:
                break
            top += step
        state[at.TIME], state[at.RATES + flank], state[at.SPEED] = t, v, speed
        sample(m, state, count, samples, spacing, t + tau)
        t += tau
        speed -= brake * tau
        rebound = -restitution(m, flank, -rate, count[at.TOTAL]) * rate
        if rebound < stick:
            place(m, state, t, flank, 0.0, rate, speed, height)
            sticks = True
            break
        change = rebound - rate
        row = impacts[first + done]
        row[0], row[1] = t, flank
        row[2], row[3] = side * rate, side * rebound
        row[4], row[5], row[6] = change * push, place_of, height
        speed += side * change / m[at.RADIUS_LOOSE]
        v = rebound
        done += 1
        count[at.TOTAL] += 1
    count[at.N_IMPACTS] += done
    count[at.BOUNCES] += done
    count[at.STEPS] += done
    if sticks:
        impact(m, state, count, impacts, flank)
    elif done:
        place(m, state, t, flank, 0.0, v, speed, 0.0)
        state[at.LAST_IMPACT] = t
        let_go(m, state)
    return sticks or done > 0
