"""Bounces and contact in closed form: perfect flanks, constant torque, one harmonic; all in registers.

The gap between the loose gear and the flank it left is, x = ω·τ being the phase since then,

    g(τ) = v·τ ∓ [a·τ²/2 + (Rb1·A/ω)·(cos ψ·(1 − cos x) − sin ψ·(x − sin x))]

with a = Rb2·T/J; Rigaud & Perret-Liaudet 2020, eqs (12)-(14). It is taken only where it is proved to be concave up to
its root, which is then the only one, and where the other flank is out of reach. Contact is lost where
J·ω·A·(Rb1/Rb2)·cos ψ = −T; ibid., eqs (17), (18). All else, and every step that holds samples, goes the general way.
"""

from __future__ import annotations

from math import acos, cos, floor, inf, pi, sin

from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner
from gears3d.lumped.impacts import LEAST, close_contact, impact, let_go, restitution, take_off
from gears3d.lumped.series import thrust

WIDEST = 0.7
"""Largest phase of a bounce [rad]: up to here nine terms are exact to rounding."""


@inner
def eligible(m, state):
    """Whether the motion is a bounce that has just begun, of a kind that has the closed form."""
    if m[at.SIMPLE] == 0.0 or state[at.SIGN] == 0.0:
        return False
    flank = int(state[at.DEPARTED])
    return state[at.GAPS + flank] == 0.0 and state[at.RATES + flank] > 0.0


@inner
def swing(x):
    """Return (1 − cos x)/x² and (x − sin x)/x³ without cancellation."""
    z = x * x
    c = 1 / 2 - z * (1 / 24 - z * (1 / 720 - z * (1 / 40320 - z * (1 / 3628800 - z * (1 / 479001600)))))
    s = 1 / 6 - z * (1 / 120 - z * (1 / 5040 - z * (1 / 362880 - z * (1 / 39916800 - z * (1 / 6227020800)))))
    return c, s


@inner
def fall(v, pull, size, omega, c0, s0, tau):
    """Return gap, rate and acceleration; ``pull`` and ``size`` = ±Rb1·A carry the flank's sign."""
    x = omega * tau
    c, s = swing(x)
    versine, lag = c * x * x, s * x * x * x
    sine = x - lag
    gap = v * tau - (0.5 * pull * tau * tau + size / omega * (c0 * versine - s0 * lag))
    rate = v - (pull * tau + size * (c0 * sine - s0 * versine))
    return gap, rate, -(pull + size * omega * (c0 * (1.0 - versine) - s0 * sine))


@inner
def bounce_on(m, state, count, impacts, spacing, n_samples, end, w):
    """Follow bounces on one flank until one needs the general way; True when at least one was done."""
    flank = int(state[at.DEPARTED])
    side = 1.0 if flank == 0 else -1.0
    amplitude, omega, phase = m[at.HARMONICS], m[at.HARMONICS + 1], m[at.HARMONICS + 2]
    size = side * m[at.RADIUS_DRIVE] * amplitude
    brake = (m[at.BASE] * state[at.SIGN] - m[at.BASE + 2]) / m[at.INERTIA]
    pull = side * m[at.RADIUS_LOOSE] * brake
    jerk = abs(size) * omega * omega
    limit = max(m[at.STICK_VELOCITY], LEAST)
    push = thrust(m, side, state[at.SIGN])
    place = 0.0 if flank == 0 else m[at.BACKLASH]
    t, v = state[at.TIME], state[at.RATES + flank]
    done, row, room = 0, count[at.N_IMPACTS], impacts.shape[0]
    next_sample = count[at.N_SAMPLES] * spacing if count[at.N_SAMPLES] < n_samples else end
    stop = min(end, next_sample)
    speed = state[at.SPEED]
    while row < room:
        psi = omega * t + phase
        c0, s0 = cos(psi), sin(psi)
        start = pull + size * omega * c0
        if start <= 0.0:
            break
        longest = 2.5 * v / start
        if omega * longest > WIDEST or jerk * longest > 0.2 * start or t + longest >= stop:
            break
        if v * v >= 1.6 * start * m[at.BACKLASH] or abs(brake) * longest >= 0.5 * speed * state[at.SIGN]:
            break
        tau, rate = _landing(v, pull, size, omega, c0, s0, start)
        height = _height(v, pull, size, omega, c0, s0, start)
        t += tau
        speed -= brake * tau
        e = restitution(m, flank, -rate, count[at.TOTAL])
        rebound = -e * rate
        if rebound < limit:
            count[at.N_IMPACTS] = row
            count[at.BOUNCES] += done
            count[at.STEPS] += done + 1
            land(m, state, t, flank, place, speed, rate, height, pull, size)
            impact(m, state, count, flank, w)
            return True
        change = rebound - rate
        impacts[row, 0], impacts[row, 1], impacts[row, 2], impacts[row, 3] = t, flank, side * rate, side * rebound
        impacts[row, 4] = change * m[at.INERTIA] / m[at.RADIUS_LOOSE] * push
        impacts[row, 5], impacts[row, 6] = place, height
        speed += side * change / m[at.RADIUS_LOOSE]
        v = rebound
        row += 1
        done += 1
        count[at.TOTAL] += 1
    if done == 0:
        return False
    count[at.N_IMPACTS] = row
    count[at.BOUNCES] += done
    count[at.STEPS] += done
    land(m, state, t, flank, place, speed, v, 0.0, pull, size)
    state[at.LAST_IMPACT] = t
    let_go(m, state, w)
    return True


@inner
def _landing(v, pull, size, omega, c0, s0, start):
    """When the gap closes again, and its rate then: Halley's method on gap/τ from the cubic's root."""
    tau = 2.0 * v / (start - size * omega * omega * s0 * 2.0 * v / (3.0 * start))
    rate = step = 0.0
    for _ in range(20):
        gap, rate, bend = fall(v, pull, size, omega, c0, s0, tau)
        inverse = 1.0 / tau
        q = gap * inverse
        q1 = (rate - q) * inverse
        q2 = (bend - 2.0 * q1) * inverse
        step = -2.0 * q * q1 / (2.0 * q1 * q1 - q * q2)
        rate += bend * step
        tau += step
        if abs(step) <= 1e-6 * tau:
            break
    return tau, rate


@inner
def _height(v, pull, size, omega, c0, s0, start):
    """The bounce's highest point, from where a cubic has its own."""
    tau = v / (start - 0.5 * size * omega * omega * s0 * v / start)
    for _ in range(20):
        gap, rate, bend = fall(v, pull, size, omega, c0, s0, tau)
        step = -rate / bend
        if abs(step) <= 1e-2 * tau:
            return gap + 0.5 * rate * step
        tau += step
    return gap


@inner
def land(m, state, t, flank, place, speed, rate, height, pull, size):
    """Put the state on the flank at time t."""
    theta = m[at.MEAN] * t
    amplitude, omega = m[at.HARMONICS], m[at.HARMONICS + 1]
    psi = omega * t + m[at.HARMONICS + 2]
    theta -= amplitude / omega * (cos(psi) - m[at.HARMONICS + 3])
    state[at.TIME], state[at.DISPLACEMENT] = t, place
    state[at.ANGLE] = (place + m[at.RADIUS_DRIVE] * theta) / m[at.RADIUS_LOOSE]
    state[at.SPEED], state[at.DRIVE_SPEED] = speed, m[at.MEAN] + amplitude * sin(psi)
    state[at.GAPS + flank], state[at.RATES + flank] = 0.0, rate
    state[at.GAPS + 1 - flank], state[at.RATES + 1 - flank] = m[at.BACKLASH], -rate
    state[at.HEIGHT], state[at.LIFT] = height, -1.0
    start = pull + size * omega * cos(psi)
    state[at.GUESS] = 2.5 * (rate if rate > 0.0 else 1.0) / start if start > 0.0 else inf


@inner
def ride(m, state, count, spacing, n_samples, end, w):
    """Stay in contact until it is lost or the end, in closed form; False when the general way has to be taken."""
    amplitude, omega = m[at.HARMONICS], m[at.HARMONICS + 1]
    flank = int(state[at.MODE]) - at.STUCK
    if state[at.SLIDE] != 0.0 or state[at.HOLD] > 0.0 or m[at.GATED + flank] != 0.0 or abs(m[at.MEAN]) <= amplitude:
        return False
    base, sign = at.BASE + 3 * (1 + flank), 1.0 if m[at.MEAN] > 0.0 else -1.0
    ratio = m[at.RADIUS_DRIVE] / m[at.RADIUS_LOOSE]
    loss = -(m[base] * sign - m[base + 2]) / (m[at.INERTIA] * ratio * amplitude * omega)
    side = 1.0 if flank == 0 else -1.0
    t = state[at.TIME]
    psi = omega * t + m[at.HARMONICS + 2]
    if side * (cos(psi) - loss) <= 0.0:
        return False
    until = end
    if abs(loss) < 1.0:
        ahead = side * acos(loss) - psi
        until = t + (ahead - 2.0 * pi * floor(ahead / (2.0 * pi))) / omega
    if count[at.N_SAMPLES] < n_samples and count[at.N_SAMPLES] * spacing <= min(until, end):
        return False
    place = 0.0 if flank == 0 else m[at.BACKLASH]
    land(m, state, min(until, end), flank, place, 0.0, 0.0, state[at.HEIGHT], 1.0, 0.0)
    state[at.SPEED] = ratio * state[at.DRIVE_SPEED]
    if until < end:
        close_contact(state, count, flank)
        take_off(m, state, flank, w)
    return True
