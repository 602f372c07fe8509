"""What happens at a flank: the impact law, sticking, taking off, and passages over a yielding flank."""

from __future__ import annotations

from math import inf, pi, sqrt

from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner
from gears3d.lumped.cursors import horizon, turn_page
from gears3d.lumped.film import film_torque, prepare
from gears3d.lumped.law import LEAST, TOUCH, restitution, thrust
from gears3d.lumped.series import contact, deviation
from gears3d.lumped.torques import torque

SMOOTH = 1e-6
"""Change of a flank's slope that contact rides over, as it comes with polynomials in pieces [m/rad]."""


@inner
def log_impact(state, count, flank, time, place, speed, rebound, impulse, height):
    """Write a row of the impact table; ``speed`` and ``rebound`` away from and towards the gap are positive."""
    side = 1.0 if flank == 0 else -1.0
    row = at.IMPACT_ROW
    state[row], state[row + 1], state[row + 2], state[row + 3] = time, flank, -side * speed, side * rebound
    state[row + 4], state[row + 5], state[row + 6] = side * impulse, place, height
    count[at.HAS_IMPACT] = 1
    count[at.TOTAL] += 1


@inner
def place_on_flank(m, state, flank, rebound):
    """Put the loose gear exactly on a flank, leaving it with a speed along the line of action."""
    side = 1.0 if flank == 0 else -1.0
    theta = (m[at.RADIUS_LOOSE] * state[at.ANGLE] - state[at.DISPLACEMENT]) / m[at.RADIUS_DRIVE]
    d1, p1 = deviation(m, state, 0, flank, theta)
    d2, p2 = deviation(m, state, 1, flank, state[at.ANGLE])
    omega = state[at.DRIVE_SPEED]
    state[at.SPEED] = (side * rebound + (m[at.RADIUS_DRIVE] + side * p1) * omega) / (m[at.RADIUS_LOOSE] - side * p2)
    state[at.DISPLACEMENT] = d1 + d2 if flank == 0 else m[at.BACKLASH] - d1 - d2
    state[at.GAPS + flank], state[at.RATES + flank] = 0.0, rebound
    o1, q1 = deviation(m, state, 0, 1 - flank, theta)
    o2, q2 = deviation(m, state, 1, 1 - flank, state[at.ANGLE])
    state[at.GAPS + 1 - flank] = m[at.BACKLASH] - d1 - d2 - o1 - o2
    state[at.RATES + 1 - flank] = -rebound - (p1 + q1) * omega - (p2 + q2) * state[at.SPEED]
    horizon(m, state, inf)


@inner
def impact(m, state, count, flank, w):
    """Newton's law on the flanks' relative velocity, v⁺ = −e·v⁻; Kadmiri et al. 2012, eqs (19), (20), (27)."""
    speed = max(-state[at.RATES + flank], 0.0)
    before, height = state[at.SPEED], state[at.HEIGHT]
    e = restitution(m, flank, speed, count[at.TOTAL] + count[at.TOUCHES])
    rebound = e * speed
    count[at.STALL] = count[at.STALL] + 1 if state[at.TIME] - state[at.LAST_IMPACT] <= 0.0 else 0
    state[at.LAST_IMPACT] = state[at.TIME]
    if rebound < max(m[at.STICK_VELOCITY], LEAST) or count[at.STALL] > 100:
        place_on_flank(m, state, flank, 0.0)
        if holds(m, state, flank, w):
            if rebound > m[at.STICK_VELOCITY]:
                count[at.ZENO] += 1
            rebound = 0.0
            count[at.CONTACTS] += 1
            stick(m, state, flank)
        else:
            bounce(m, state, count, flank, rebound, w)
    else:
        bounce(m, state, count, flank, rebound, w)
    if speed > TOUCH:
        side, way = 1.0 if flank == 0 else -1.0, before if before != 0.0 else state[at.SPEED]
        sign = 0.0 if way == 0.0 else 1.0 if way > 0.0 else -1.0
        impulse = m[at.INERTIA] * abs((state[at.SPEED] - before) * thrust(m, side, sign))
        log_impact(state, count, flank, state[at.TIME], state[at.DISPLACEMENT], speed, rebound, impulse, height)
    else:
        count[at.GRAZING] += 1


@inner
def bounce(m, state, count, flank, rebound, w):
    """Fly on with the rebound."""
    place_on_flank(m, state, flank, rebound)
    count[at.BOUNCES] += 1
    guess = state[at.GUESS] * rebound if rebound > 0.0 else inf
    take_off(m, state, flank, w)
    state[at.GUESS] = guess
    state[at.LIFT] = -1.0


@inner
def holds(m, state, flank, w):
    """Whether the flank's reaction presses the gear on it, with the torques of contact or those of flight."""
    contact(m, state, flank, 1 + flank, 5, w)
    if w[at.REACTION, 0] > 0.0:
        return True
    if m[at.GATED + flank] == 0.0:
        return False
    contact(m, state, flank, 0, 5, w)
    return w[at.REACTION, 0] > 0.0


@inner
def stick(m, state, flank):
    """Begin permanent contact."""
    state[at.MODE] = at.STUCK + flank
    state[at.SLIDE] = 0.0
    state[at.HOLD] = 0.0
    state[at.LIFT] = -1.0
    state[at.GUESS] = inf
    state[at.CONTACT_SINCE] = state[at.TIME]


@inner
def touch_down(m, state, count, flank):
    """Begin contact where the gear cannot lift off."""
    place_on_flank(m, state, flank, 0.0)
    stick(m, state, flank)
    state[at.HOLD] = 1e-6 / m[at.RATE]


@inner
def take_off(m, state, flank, w):
    """Begin a flight from a flank."""
    state[at.MODE] = at.FREE
    state[at.DEPARTED] = flank
    state[at.HEIGHT] = 0.0
    state[at.SLIDE] = 0.0
    state[at.GUESS] = inf
    state[at.LIFT] = flank
    let_go(m, state, w)


@inner
def let_go(m, state, w):
    """Find the direction that dry friction resists: that of the speed, or none where it holds the gear at rest."""
    if abs(state[at.SPEED]) > m[at.REST]:
        state[at.SIGN] = 1.0 if state[at.SPEED] > 0.0 else -1.0
        return
    mode = int(state[at.MODE])
    phase = 1 + mode - at.PRESSED if mode >= at.PRESSED else 0
    w[at.OMEGA2, 0], w[at.THETA2, 0] = 0.0, state[at.ANGLE]
    state[at.SPEED] = 0.0
    horizon(m, state, inf)
    pull = torque(m, state, phase, 0.0, 0, w)
    dry = torque(m, state, phase, 1.0, 0, w) - pull
    if m[at.FLOOR] > 0.0:
        prepare(m, state, mode - at.PRESSED if mode >= at.PRESSED else -1, w)
        pull += film_torque(m, 0, w)
    if mode >= at.PRESSED:
        flank = mode - at.PRESSED
        force = -m[at.STIFFNESS] * state[at.GAPS + flank] - m[at.DAMPING] * state[at.RATES + flank]
        pull -= m[at.RADIUS_LOOSE] * force if flank == 0 else -m[at.RADIUS_LOOSE] * force
        dry += m[at.FRICTION] * m[at.RADIUS_LOOSE] * force
    state[at.SPEED] = 0.0
    state[at.SIGN] = 0.0
    if abs(pull) > dry:
        state[at.SIGN] = -1.0 if pull > 0.0 else 1.0


@inner
def cross(m, state, count, table, side, w):
    """Go over a knot of a table; a corner of a flank throws the gear off, or hits it when it rests on it."""
    jump = turn_page(m, state, table, side)
    flank = table - int(m[at.FLANK_TABLE])
    if m[at.FLANK_TABLE] < 0.0 or not 0 <= flank <= 1:
        return
    rate = -jump * state[at.DRIVE_SPEED]
    mode = int(state[at.MODE])
    if mode != at.STUCK + flank:
        state[at.RATES + flank] += rate
        return
    if abs(jump) <= SMOOTH:
        return
    state[at.RATES + flank], state[at.HEIGHT] = rate, 0.0
    if rate > TOUCH:
        close_contact(state, count, flank)
        take_off(m, state, flank, w)
        state[at.LIFT] = -1.0
    elif rate < -TOUCH:
        since = state[at.CONTACT_SINCE]
        impact(m, state, count, flank, w)
        stays = state[at.MODE] == mode
        state[at.CONTACT_SINCE] = since
        if stays:
            count[at.CONTACTS] -= 1
        else:
            close_contact(state, count, flank)


@inner
def close_contact(state, count, flank):
    """Write a row of the contact table."""
    row = at.CONTACT_ROW
    state[row], state[row + 1], state[row + 2] = flank, state[at.CONTACT_SINCE], state[at.TIME]
    count[at.HAS_CONTACT] = 1


@inner
def press(m, state, flank):
    """Begin a passage over a yielding flank."""
    state[at.GAPS + flank] = 0.0
    state[at.MODE] = at.PRESSED + flank
    state[at.ENTRY] = state[at.TIME]
    state[at.ENTRY_VELOCITY] = -state[at.RATES + flank]
    state[at.ENTRY_HEIGHT] = state[at.HEIGHT]
    state[at.ENTRY_PLACE] = state[at.DISPLACEMENT]
    state[at.IMPULSE] = 0.0
    state[at.PASSED] = 0.0


@inner
def settle(m, state, count, flank):
    """Log a passage that has become permanent contact; its rebound is 0."""
    mass = m[at.INERTIA] / m[at.RADIUS_LOOSE] ** 2
    if state[at.PASSED] == 0.0 and state[at.TIME] - state[at.ENTRY] > 10.0 * pi * sqrt(mass / m[at.STIFFNESS]):
        state[at.PASSED] = 1.0
        state[at.CONTACT_SINCE] = state[at.ENTRY]
        count[at.CONTACTS] += 1
        speed = state[at.ENTRY_VELOCITY]
        side = 1.0 if flank == 0 else -1.0
        push = m[at.INERTIA] / m[at.RADIUS_LOOSE] * abs(thrust(m, side, state[at.SIGN]))
        log_impact(
            state, count, flank, state[at.ENTRY], state[at.ENTRY_PLACE], speed, 0.0, push * speed,
            state[at.ENTRY_HEIGHT],
        )  # fmt: skip


@inner
def end_passage(state, count, flank):
    """Write a passage down as it ends: as permanent contact, or as one impact."""
    if state[at.PASSED] == 1.0:
        close_contact(state, count, flank)
    else:
        count[at.BOUNCES] += 1
        log_impact(
            state, count, flank, state[at.ENTRY], state[at.ENTRY_PLACE], state[at.ENTRY_VELOCITY],
            state[at.RATES + flank], state[at.IMPULSE], state[at.ENTRY_HEIGHT],
        )  # fmt: skip
    state[at.HEIGHT] = 0.0
    state[at.DEPARTED] = flank


@inner
def leave_spring(state, count, flank):
    """End a passage where the gap opens again, and log it as one impact unless it was permanent contact."""
    state[at.GAPS + flank] = 0.0
    end_passage(state, count, flank)
