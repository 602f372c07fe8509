"""What happens at a flank: the impact law, sticking, taking off, and passages over a yielding flank."""

from __future__ import annotations

from math import cos, inf, log, pi, sqrt

import numpy as np

from gears3d.lumped.compile import inner
from gears3d.lumped.layout import (
    ANGLE,
    BOUNCES,
    CONTACT_SINCE,
    CONTACTS,
    DEPARTED,
    DISPLACEMENT,
    DRIVE_SPEED,
    ENTRY,
    ENTRY_HEIGHT,
    ENTRY_PLACE,
    ENTRY_VELOCITY,
    FREE,
    GAPS,
    GRAZING,
    GUESS,
    HEIGHT,
    HOLD,
    IMPULSE,
    LAST_IMPACT,
    LIFT,
    MODE,
    N_CONTACTS,
    N_IMPACTS,
    OMEGA2,
    PASSED,
    PRESSED,
    RATES,
    REACTION,
    SIGN,
    SLIDE,
    SPEED,
    STALL,
    STUCK,
    THETA2,
    TIME,
    TOTAL,
    ZENO,
)  # fmt: skip
from gears3d.lumped.series import contact, deviation, torque

LEAST = 1e-13
"""Rebound speed that no clock resolves [m/s]."""
UNFELT = 1e-12
"""Approach speed of a touch that is no impact [m/s]."""


@inner
def normal(seed, index):
    """Return a standard normal number that depends on seed and index alone (splitmix64, Box-Muller)."""
    uniform = np.zeros(2)
    for i in range(2):
        z = np.uint64(seed) * np.uint64(0xD1342543DE82EF95)
        z += np.uint64(2 * index + i + 1) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
        uniform[i] = (float(z >> np.uint64(11)) + 0.5) / 9007199254740992.0
    return sqrt(-2.0 * log(uniform[0])) * cos(2.0 * pi * uniform[1])


@inner
def restitution(m, flank, speed, index):
    """Return e = clip(e0 + slope·|v| ± asymmetry/2 + scatter·z, 0, 1)."""
    e = m.restitution[0] + m.restitution[1] * speed
    e += 0.5 * m.restitution[2] if flank == 0 else -0.5 * m.restitution[2]
    if m.restitution[3] > 0.0:
        e += m.restitution[3] * normal(m.seed, index)
    return min(max(e, 0.0), 1.0)


@inner
def log_impact(m, state, count, out, flank, time, place, speed, rebound, impulse, height):
    """Write a row of the impact table; ``speed`` and ``rebound`` away from and towards the gap are positive."""
    side = 1.0 if flank == 0 else -1.0
    row = out.impacts[count[N_IMPACTS]]
    row[0], row[1], row[2], row[3] = time, flank, -side * speed, side * rebound
    row[4], row[5], row[6] = side * impulse, place, height
    count[N_IMPACTS] += 1
    count[TOTAL] += 1


@inner
def place_on_flank(m, state, flank, rebound):
    """Put the loose gear exactly on a flank, leaving it with a speed along the line of action."""
    side = 1.0 if flank == 0 else -1.0
    theta = (m.radius_loose * state[ANGLE] - state[DISPLACEMENT]) / m.radius_drive
    d1, p1 = deviation(m, 0, flank, theta)
    d2, p2 = deviation(m, 1, flank, state[ANGLE])
    omega = state[DRIVE_SPEED]
    state[SPEED] = (side * rebound + (m.radius_drive + side * p1) * omega) / (m.radius_loose - side * p2)
    state[DISPLACEMENT] = d1 + d2 if flank == 0 else m.backlash - d1 - d2
    state[GAPS + flank], state[RATES + flank] = 0.0, rebound
    o1, q1 = deviation(m, 0, 1 - flank, theta)
    o2, q2 = deviation(m, 1, 1 - flank, state[ANGLE])
    state[GAPS + 1 - flank] = m.backlash - d1 - d2 - o1 - o2
    state[RATES + 1 - flank] = -rebound - (p1 + q1) * omega - (p2 + q2) * state[SPEED]


@inner
def impact(m, state, count, flank, out):
    """Newton's law on the flanks' relative velocity, v⁺ = −e·v⁻; Kadmiri et al. 2012, eqs (19), (20), (27)."""
    speed = max(-state[RATES + flank], 0.0)
    before, height = state[SPEED], state[HEIGHT]
    e = restitution(m, flank, speed, count[TOTAL])
    rebound = e * speed
    count[STALL] = count[STALL] + 1 if state[TIME] - state[LAST_IMPACT] <= 0.0 else 0
    state[LAST_IMPACT] = state[TIME]
    if rebound < max(m.stick_velocity, LEAST) or count[STALL] > 100:
        place_on_flank(m, state, flank, 0.0)
        if holds(m, state, flank, out):
            if rebound > m.stick_velocity:
                count[ZENO] += 1
            rebound = 0.0
            count[CONTACTS] += 1
            stick(m, state, flank)
        else:
            bounce(m, state, count, flank, rebound, out)
    else:
        bounce(m, state, count, flank, rebound, out)
    if speed > UNFELT:
        impulse = m.inertia / m.radius_loose * abs(state[SPEED] - before)
        log_impact(m, state, count, out, flank, state[TIME], state[DISPLACEMENT], speed, rebound, impulse, height)
    else:
        count[GRAZING] += 1


@inner
def bounce(m, state, count, flank, rebound, out):
    """Fly on with the rebound."""
    place_on_flank(m, state, flank, rebound)
    count[BOUNCES] += 1
    guess = state[GUESS] * rebound if rebound > 0.0 else inf
    take_off(m, state, flank, out.work)
    state[GUESS] = guess
    state[LIFT] = -1.0


@inner
def holds(m, state, flank, out):
    """Whether the flank's reaction presses the gear on it, with the torques of contact or those of flight."""
    contact(m, state, flank, 1 + flank, 5, out.work)
    if out.work[REACTION, 0] > 0.0:
        return True
    if not m.gated[flank]:
        return False
    contact(m, state, flank, 0, 5, out.work)
    return out.work[REACTION, 0] > 0.0


@inner
def stick(m, state, flank):
    """Begin permanent contact."""
    state[MODE] = STUCK + flank
    state[SLIDE] = 0.0
    state[HOLD] = 0.0
    state[LIFT] = -1.0
    state[GUESS] = inf
    state[CONTACT_SINCE] = state[TIME]


@inner
def touch_down(m, state, count, flank):
    """Begin contact where the gear cannot lift off."""
    place_on_flank(m, state, flank, 0.0)
    stick(m, state, flank)
    state[HOLD] = 1e-6 / m.rate[0]


@inner
def take_off(m, state, flank, w):
    """Begin a flight from a flank."""
    state[MODE] = FREE
    state[DEPARTED] = flank
    state[HEIGHT] = 0.0
    state[SLIDE] = 0.0
    state[GUESS] = inf
    state[LIFT] = flank
    let_go(m, state, w)


@inner
def let_go(m, state, w):
    """Find the direction that dry friction resists: that of the speed, or none where it holds the gear at rest."""
    if abs(state[SPEED]) > m.rest:
        state[SIGN] = 1.0 if state[SPEED] > 0.0 else -1.0
        return
    mode = int(state[MODE])
    phase = 1 + mode - PRESSED if mode >= PRESSED else 0
    w[OMEGA2, 0], w[THETA2, 0] = 0.0, state[ANGLE]
    pull = torque(m, phase, state[TIME], 0.0, 0, w)
    dry = torque(m, phase, state[TIME], 1.0, 0, w) - pull
    if mode >= PRESSED:
        flank = mode - PRESSED
        force = -m.stiffness * state[GAPS + flank] - m.damping * state[RATES + flank]
        pull -= m.radius_loose * force if flank == 0 else -m.radius_loose * force
    state[SPEED] = 0.0
    state[SIGN] = 0.0
    if abs(pull) > dry:
        state[SIGN] = -1.0 if pull > 0.0 else 1.0


@inner
def close_contact(state, count, flank, out):
    """Write a row of the contact table."""
    row = out.contacts[count[N_CONTACTS]]
    row[0], row[1], row[2] = flank, state[CONTACT_SINCE], state[TIME]
    count[N_CONTACTS] += 1


@inner
def press(m, state, flank):
    """Begin a passage over a yielding flank."""
    state[GAPS + flank] = 0.0
    state[MODE] = PRESSED + flank
    state[ENTRY] = state[TIME]
    state[ENTRY_VELOCITY] = -state[RATES + flank]
    state[ENTRY_HEIGHT] = state[HEIGHT]
    state[ENTRY_PLACE] = state[DISPLACEMENT]
    state[IMPULSE] = 0.0
    state[PASSED] = 0.0


@inner
def settle(m, state, count, flank, out):
    """Log a passage that has become permanent contact; its rebound is 0."""
    mass = m.inertia / m.radius_loose**2
    if state[PASSED] == 0.0 and state[TIME] - state[ENTRY] > 10.0 * pi * sqrt(mass / m.stiffness):
        state[PASSED] = 1.0
        state[CONTACT_SINCE] = state[ENTRY]
        count[CONTACTS] += 1
        speed = state[ENTRY_VELOCITY]
        log_impact(
            m, state, count, out, flank, state[ENTRY], state[ENTRY_PLACE], speed, 0.0, mass * speed,
            state[ENTRY_HEIGHT],
        )  # fmt: skip


@inner
def leave_spring(m, state, count, flank, out):
    """End a passage where the gap opens again, and log it as one impact unless it was permanent contact."""
    state[GAPS + flank] = 0.0
    if state[PASSED] == 1.0:
        close_contact(state, count, flank, out)
    else:
        count[BOUNCES] += 1
        log_impact(
            m, state, count, out, flank, state[ENTRY], state[ENTRY_PLACE], state[ENTRY_VELOCITY],
            state[RATES + flank], state[IMPULSE], state[ENTRY_HEIGHT],
        )  # fmt: skip
    state[HEIGHT] = 0.0
    state[DEPARTED] = flank
