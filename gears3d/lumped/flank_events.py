"""Events at a perfect flank under dry friction: the test for sustained contact, impact, separation."""

from __future__ import annotations

from math import cos, inf, sin

from gears3d.lumped import layout as at
from gears3d.lumped.closed_form import place
from gears3d.lumped.compile import inner
from gears3d.lumped.law import LEAST, TOUCH, restitution, thrust


@inner
def sense(x):
    """Return the sign of a number, 0 of zero."""
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0


@inner
def pressing(m, t, flank, slides):
    """Return a flank's torque on the gear in contact with it, and the direction that dry friction resists.

    Rigaud & Perret-Liaudet 2020, eqs (17), (18). The direction is that of the motion just after t, 0 at lasting rest.
    The torques are those of contact, or of flight where ``slides`` is 1.
    """
    ratio, amplitude = m[at.RADIUS_DRIVE] / m[at.RADIUS_LOOSE], m[at.HARMONICS]
    psi = m[at.HARMONICS + 1] * t + m[at.HARMONICS + 2]
    rise, swing = amplitude * m[at.HARMONICS + 1] * cos(psi), amplitude * sin(psi)
    way = m[at.MEAN] + swing
    if abs(ratio * way) <= m[at.REST] * (1.0 + 1e-2 * m[at.RATE] * t):
        way = rise if rise != 0.0 else -swing
    sign = sense(way)
    dry = m[at.BASE] if slides == 1.0 else m[at.BASE + 3 * (1 + flank)]
    return (1.0 - 2.0 * flank) * (m[at.INERTIA] * ratio * rise + dry * sign), sign


@inner
def let_go(m, state):
    """Find the direction that dry friction resists: that of the speed, or 0 where it keeps the gear at rest."""
    if abs(state[at.SPEED]) <= m[at.REST]:
        state[at.SPEED] = 0.0
    state[at.SIGN] = sense(state[at.SPEED])
    if m[at.BASE] < 0.0 and state[at.SIGN] == 0.0:
        state[at.SIGN] = 1.0


@inner
def separate(m, state, flank, lift):
    """Begin a free flight from a flank; ``lift`` is that flank where contact is lost without an impact, else -1."""
    state[at.MODE], state[at.DEPARTED], state[at.LIFT] = at.FREE, flank, lift
    state[at.HEIGHT] = state[at.SLIDE] = 0.0
    let_go(m, state)


@inner
def set_on_flank(m, state, flank, rebound, hold):
    """Put the gear on a flank: with a rebound, or in permanent contact for a time ``hold`` >= 0 at least."""
    pace = (1.0 - 2.0 * flank) * rebound + m[at.RADIUS_DRIVE] * state[at.DRIVE_SPEED]
    state[at.SPEED] = pace / m[at.RADIUS_LOOSE]
    state[at.RATES + flank], state[at.RATES + 1 - flank] = rebound, -rebound
    if hold < 0.0:
        separate(m, state, flank, -1.0)
    else:
        state[at.MODE], state[at.SLIDE], state[at.HOLD] = at.STUCK + flank, 0.0, hold
        state[at.CONTACT_SINCE] = state[at.TIME]


@inner
def impact(m, state, count, impacts, flank):
    """Newton's law on the flanks' relative velocity, v⁺ = −e·v⁻; Kadmiri et al. 2012, eqs (19), (20), (27)."""
    side, hold = 1.0 - 2.0 * flank, -1.0
    speed, before, t, height = max(-state[at.RATES + flank], 0.0), state[at.SPEED], state[at.TIME], state[at.HEIGHT]
    rebound = restitution(m, flank, speed, count[at.TOTAL]) * speed
    count[at.STALL] = count[at.STALL] + 1 if t <= state[at.LAST_IMPACT] else 0
    state[at.LAST_IMPACT] = t
    if rebound < max(m[at.STICK_VELOCITY], LEAST) or count[at.STALL] > 100:
        gated = m[at.GATED + flank]
        for slides in range(2):
            if slides <= gated and pressing(m, t, flank, float(slides))[0] > 0.0:
                hold = 0.0
    if hold == 0.0:
        count[at.ZENO] += rebound > m[at.STICK_VELOCITY]
        count[at.CONTACTS] += 1
        rebound = 0.0
    else:
        count[at.BOUNCES] += 1
    set_on_flank(m, state, flank, rebound, hold)
    if speed <= TOUCH:
        count[at.GRAZING] += 1
        return
    push = thrust(m, side, sense(before if before != 0.0 else state[at.SPEED]))
    row = impacts[count[at.N_IMPACTS]]
    row[0], row[1] = t, flank
    row[2], row[3] = -side * speed, side * rebound
    row[4] = side * m[at.INERTIA] * abs((state[at.SPEED] - before) * push)
    row[5], row[6] = state[at.DISPLACEMENT], height
    count[at.N_IMPACTS] += 1
    count[at.TOTAL] += 1


@inner
def begin(m, state):
    """Put the state on its flank, or into the middle of the backlash, at time 0."""
    start = state[at.DEPARTED]
    flank = 1 if start == 1.0 else 0
    place(m, state, 0.0, flank, 0.5 * m[at.BACKLASH] if start == 2.0 else 0.0, 0.0, 0.0, 0.0)
    state[at.LAST_IMPACT], state[at.GUESS] = -inf, inf
    held = start < 2.0 and pressing(m, 0.0, flank, 0.0)[0] > 0.0
    held = held or (start < 2.0 and m[at.GATED + flank] > 0.0 and pressing(m, 0.0, flank, 1.0)[0] > 0.0)
    set_on_flank(m, state, flank, 0.0, 0.0 if held else -1.0)
    if start < 2.0:
        state[at.LIFT] = -1.0 if held else float(flank)
