"""Events at a flank: the impact law, sticking, separation, and passages over compliant teeth or through oil."""

from __future__ import annotations

from math import inf

from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner
from gears3d.lumped.cursors import horizon, turn_page
from gears3d.lumped.forces import acting, material
from gears3d.lumped.law import LEAST, TOUCH, restitution, thrust

SMOOTH = 1e-6  # change of a flank's slope between pieces of polynomials that does not end contact [m/rad]


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
    d1, p1, _, o1, q1, _ = material(m, state, 0, theta)
    d2, p2, _, o2, q2, _ = material(m, state, 1, state[at.ANGLE])
    if flank == 1:
        d1, p1, o1, q1, d2, p2, o2, q2 = o1, q1, d1, p1, o2, q2, d2, p2
    omega = state[at.DRIVE_SPEED]
    state[at.SPEED] = (side * rebound + (m[at.RADIUS_DRIVE] + side * p1) * omega) / (m[at.RADIUS_LOOSE] - side * p2)
    state[at.DISPLACEMENT] = d1 + d2 if flank == 0 else m[at.BACKLASH] - d1 - d2
    state[at.GAPS + flank], state[at.RATES + flank] = 0.0, rebound
    state[at.GAPS + 1 - flank] = m[at.BACKLASH] - d1 - d2 - o1 - o2
    state[at.RATES + 1 - flank] = -rebound - (p1 + q1) * omega - (p2 + q2) * state[at.SPEED]
    horizon(m, state, inf)


@inner
def impact(m, state, count, flank):
    """Newton's law on the flanks' relative velocity, v⁺ = −e·v⁻; Kadmiri et al. 2012, eqs (19), (20), (27)."""
    speed = max(-state[at.RATES + flank], 0.0)
    before, height = state[at.SPEED], state[at.HEIGHT]
    e = restitution(m, flank, speed, count[at.TOTAL] + count[at.TOUCHES])
    rebound = e * speed
    count[at.STALL] = count[at.STALL] + 1 if state[at.TIME] - state[at.LAST_IMPACT] <= 0.0 else 0
    state[at.LAST_IMPACT] = state[at.TIME]
    if rebound < max(m[at.STICK_VELOCITY], LEAST) or count[at.STALL] > 100:
        place_on_flank(m, state, flank, 0.0)
        if holds(m, state, flank):
            if rebound > m[at.STICK_VELOCITY]:
                count[at.ZENO] += 1
            rebound = 0.0
            count[at.CONTACTS] += 1
            stick(m, state, flank)
        else:
            bounce(m, state, count, flank, rebound)
    else:
        bounce(m, state, count, flank, rebound)
    if speed > TOUCH:
        side, way = 1.0 if flank == 0 else -1.0, before if before != 0.0 else state[at.SPEED]
        sign = 0.0 if way == 0.0 else 1.0 if way > 0.0 else -1.0
        impulse = m[at.INERTIA] * abs((state[at.SPEED] - before) * thrust(m, side, sign))
        log_impact(state, count, flank, state[at.TIME], state[at.DISPLACEMENT], speed, rebound, impulse, height)
    else:
        count[at.GRAZING] += 1


@inner
def bounce(m, state, count, flank, rebound):
    """Continue in free flight with the rebound."""
    place_on_flank(m, state, flank, rebound)
    count[at.BOUNCES] += 1
    guess = state[at.GUESS] * rebound if rebound > 0.0 else inf
    take_off(m, state, flank)
    state[at.GUESS] = guess
    state[at.LIFT] = -1.0


@inner
def holds(m, state, flank):
    """Whether the flank's reaction presses the gear on it, with the torques of contact or those of flight."""
    if reaction(m, state, flank, 0.0) > 0.0:
        return True
    return m[at.GATED + flank] != 0.0 and reaction(m, state, flank, 1.0) > 0.0


@inner
def reaction(m, state, flank, slides):
    """Return the force of a flank on the gear in contact, under torques of contact or, where 1, of flight [N]."""
    mode, slide, sign = state[at.MODE], state[at.SLIDE], state[at.SIGN]
    state[at.MODE], state[at.SLIDE], state[at.SIGN] = at.STUCK + flank, slides, sense(m, state[at.SPEED])
    now = acting(m, state, state[at.TIME], motion_of(m, state))
    if state[at.SIGN] == 0.0 and now.gained != 0.0:
        state[at.SIGN] = 1.0 if now.gained > 0.0 else -1.0
        now = acting(m, state, state[at.TIME], motion_of(m, state))
    state[at.MODE], state[at.SLIDE], state[at.SIGN] = mode, slide, sign
    return now.reaction


@inner
def motion_of(m, state):
    """Return displacement [m], its rate [m/s], twist of the carried body [rad] and its rate [rad/s]."""
    rate = m[at.RADIUS_LOOSE] * state[at.SPEED] - m[at.RADIUS_DRIVE] * state[at.DRIVE_SPEED]
    return state[at.DISPLACEMENT], rate, state[at.TWIST], state[at.TWIST_RATE]


@inner
def sense(m, speed):
    """Return the sign of a loose gear's speed, 0 at rest."""
    return 0.0 if abs(speed) <= m[at.REST] else 1.0 if speed > 0.0 else -1.0


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
def take_off(m, state, flank):
    """Begin a flight from a flank."""
    state[at.MODE] = at.FREE
    state[at.DEPARTED] = flank
    state[at.HEIGHT] = 0.0
    state[at.SLIDE] = 0.0
    state[at.GUESS] = inf
    state[at.LIFT] = flank
    let_go(m, state)


@inner
def let_go(m, state):
    """Find the direction that dry friction resists: that of the speed, or 0 where it keeps the gear at rest."""
    state[at.SIGN] = sense(m, state[at.SPEED])
    if state[at.SIGN] == 0.0:
        state[at.SPEED] = 0.0
        horizon(m, state, inf)
        now = acting(m, state, state[at.TIME], motion_of(m, state))
        if abs(now.pull) > now.dry:
            state[at.SIGN] = -1.0 if now.pull > 0.0 else 1.0


@inner
def cross(m, state, count, table, side):
    """Pass a knot of a table; a slope discontinuity of a flank ends contact, or causes an impact."""
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
        take_off(m, state, flank)
        state[at.LIFT] = -1.0
    elif rate < -TOUCH:
        since = state[at.CONTACT_SINCE]
        impact(m, state, count, flank)
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
def end_contact(m, state, count, flank):
    """End contact, unless the torques of flight press the gear back on the flank at once."""
    state[at.GAPS + flank] = state[at.RATES + flank] = 0.0
    if m[at.GATED + flank] != 0.0:
        push = reaction(m, state, flank, 1.0 - state[at.SLIDE])
        if push > m[at.UNFELT] * m[at.INERTIA] / m[at.RADIUS_LOOSE] ** 2:
            state[at.SLIDE] = 1.0 - state[at.SLIDE]
            return
    close_contact(state, count, flank)
    take_off(m, state, flank)


@inner
def enter(state, flank):
    """Begin a passage: over compliant teeth, or through the film of a flank."""
    state[at.WITHIN], state[at.TURNED], state[at.PASSED], state[at.IMPULSE] = flank, 0.0, 0.0, 0.0
    state[at.ENTRY], state[at.ENTRY_VELOCITY] = state[at.TIME], -state[at.RATES + flank]
    state[at.ENTRY_HEIGHT], state[at.ENTRY_PLACE] = state[at.HEIGHT], state[at.DISPLACEMENT]


@inner
def stay(m, state, count, flank):
    """Log a passage that has become permanent contact; its rebound is 0."""
    if state[at.PASSED] == 0.0:
        state[at.PASSED], state[at.CONTACT_SINCE] = 1.0, state[at.ENTRY]
        count[at.CONTACTS] += 1
        speed, side = state[at.ENTRY_VELOCITY], 1.0 if flank == 0 else -1.0
        push = m[at.INERTIA] / m[at.RADIUS_LOOSE] * abs(thrust(m, side, state[at.SIGN]))
        log_impact(
            state, count, flank, state[at.ENTRY], state[at.ENTRY_PLACE], speed, 0.0, push * speed,
            state[at.ENTRY_HEIGHT],
        )  # fmt: skip


@inner
def leave(state, count, flank):
    """Log a passage at its end: as permanent contact, or as one impact."""
    if state[at.PASSED] == 1.0:
        state[at.CONTACT_SINCE] = state[at.ENTRY]  # also where the bare flanks touched later
        close_contact(state, count, flank)
    else:
        count[at.BOUNCES] += 1
        log_impact(
            state, count, flank, state[at.ENTRY], state[at.ENTRY_PLACE], state[at.ENTRY_VELOCITY],
            state[at.RATES + flank], state[at.IMPULSE], state[at.ENTRY_HEIGHT],
        )  # fmt: skip
    state[at.HEIGHT], state[at.DEPARTED], state[at.WITHIN] = 0.0, flank, -1.0
