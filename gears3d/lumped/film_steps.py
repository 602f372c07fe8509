"""One step under oil films, and the passages that stand for impacts there.

A film turns most approaches back before the flanks touch. So an impact is here a *passage*: the gap falls below the
height FELT from which on the film carries the drag, and rises above it again; speed and rebound are those at that
height, the impulse is that of film and flank together. A gear that turns towards the flank a second time within a
passage is in contact over oil. With ever thinner oil FELT goes to zero, and with it all that sets a passage apart from
an impact of rigid flanks.
"""

from __future__ import annotations

from math import inf

from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner
from gears3d.lumped.cursors import crossing
from gears3d.lumped.film import balance, film_impulse, prepare, radius
from gears3d.lumped.impacts import cross, end_passage, impact, log_impact, take_off, touch_down
from gears3d.lumped.law import thrust
from gears3d.lumped.roots import first_root, highest
from gears3d.lumped.series import yielding
from gears3d.lumped.steps import (
    BREAKS_LOOSE,
    CLEARS,
    FLIGHT_ENDS,
    PUSHES,
    SPEED_TURNS,
    carry,
    impulse,
    loose_at,
    plan,
    sample,
    speed_event,
    spring_event,
    trusted,
)

ROLLS, SQUEEZES, ENTERS, LEAVES, LETS_GO = range(10, 15)


@inner
def film_step(m, state, count, w, samples, spacing, span):
    """Fly, or press on a yielding flank, until any of the events that change the forces or the tables."""
    n, pressed = at.ORDER, int(state[at.MODE]) - at.PRESSED
    if pressed < 0:
        pressed = -1
    prepare(m, state, pressed, w)
    reach, _ = plan(m, state, m[at.RATE if pressed < 0 else at.RATE + 1], span, 1)
    yielding(m, state, n, pressed, w)
    if pressed >= 0 and state[at.HOLD] > 0.0:  # pressed on again: the force begins at zero
        w[at.REACTION, 0] = state[at.HOLD] = 0.0
    if state[at.LIFT] >= 0.0:
        gap = w[at.GAP + int(state[at.LIFT])]
        if abs(gap[2]) < m[at.UNFELT] * (1.0 + 1e-3 * m[at.RATE] * state[at.TIME]):
            gap[2] = 0.0
    way = 0.0
    for flank in range(2):
        if w[at.FILM_NOTE, 3 + flank] == 0.0:
            reach = min(reach, 0.5 * radius(m, w, flank))
    for flank in range(2):
        reach, far = trusted(w[at.GAP + flank], 1, n, reach)
        way = max(way, far)
    event, flank, x = _event(m, state, w, n, reach, way, pressed)
    x, table, side = crossing(m, state, w, n, x)
    state[at.HEIGHT] = max(state[at.HEIGHT], highest(w[at.GAP + int(state[at.DEPARTED])], n, x))
    within = int(state[at.WITHIN])
    if within >= 0:
        state[at.IMPULSE] += film_impulse(w, within, n - 1, x)
        if within == pressed:
            state[at.IMPULSE] += impulse(m, w[at.GAP + pressed], n, x)
    sample(m, state, count, w, samples, spacing, x, n)
    carry(m, state, x, n, w)
    if table >= 0:
        cross(m, state, count, table, side, w)
    elif event >= 0:
        _apply(m, state, count, event, flank, x, w)


@inner
def _event(m, state, w, n, reach, way, pressed):
    """Return what happens first, on which flank, and when."""
    event, where, x = -1, 0, reach
    for flank in range(2):
        gap = w[at.GAP + flank]
        if flank == pressed:
            root = first_root(w[at.REACTION], 1.0, n, x)
            if root < x:
                event, where, x = LETS_GO, flank, root
        elif m[at.STIFFNESS] > 0.0 and gap[0] < 0.0:
            found, root = spring_event(m, state, flank, n, x, w)
            if found >= 0:
                event, where, x = found, flank, root
        elif gap[0] <= way:
            root = first_root(gap, 1.0, n, x)
            if root < x:
                event, where, x = FLIGHT_ENDS, flank, root
        for k in range(n):
            w[at.SCRATCH, k] = (k + 1) * gap[k + 1]
        root = first_root(w[at.SCRATCH], -1.0 if w[at.FILM_NOTE, 1 + flank] > 0.0 else 1.0, n - 1, x)
        if root < x:
            event, where, x = SQUEEZES, flank, root
        root = _border(m, state, gap, flank, n, x, way, w)
        if root < x:
            event, where, x = LEAVES if state[at.WITHIN] >= 0.0 else ENTERS, flank, root
    root = first_root(w[at.ROLLING], 1.0, n, x)
    if root < x:
        event, x = ROLLS, root
    if state[at.SIGN] != 0.0:
        root = first_root(w[at.OMEGA2], state[at.SIGN], n, x)
        if root < x:
            event, x = SPEED_TURNS, root
    else:
        root = loose_at(w, n, x)
        if root < x:
            event, x = BREAKS_LOOSE, root
    return event, where, x


@inner
def _border(m, state, gap, flank, n, reach, way, w):
    """When the gap crosses the height at which a passage begins, or ends on the flank that it belongs to."""
    within = int(state[at.WITHIN])
    if within >= 0 and within != flank:
        return inf
    side = 1.0 if within < 0 else -1.0
    start = gap[0] - m[at.FELT]
    if side * start > way:
        return inf
    for k in range(n + 1):
        w[at.SCRATCH, k] = gap[k]
    w[at.SCRATCH, 0] = 0.0 if abs(start) <= 1e-12 * m[at.FELT] else start
    return first_root(w[at.SCRATCH], side, n, reach)


@inner
def _apply(m, state, count, event, flank, x, w):
    """Change what the event changes."""
    if event == SQUEEZES:
        _turn(m, state, count, flank)
    elif event == ROLLS:
        state[at.SENSE] = -state[at.SENSE]
    elif event == ENTERS:
        _enter(state, flank)
    elif event == LEAVES:
        _leave(state, count, flank)
    elif event == FLIGHT_ENDS:
        _touch(m, state, count, flank, x, w)
    elif event == LETS_GO:
        take_off(m, state, flank, w)
        if m[at.DAMPING] == 0.0:
            state[at.GAPS + flank] = 0.0
    elif event == PUSHES:
        state[at.MODE], state[at.HOLD] = at.PRESSED + flank, 1.0
    elif event == CLEARS:
        state[at.GAPS + flank] = 0.0
    else:
        speed_event(m, state, event, w)


@inner
def _turn(m, state, count, flank):
    """Begin or end the squeeze of a film; a second approach within a passage is contact over oil."""
    state[at.SQUEEZED + flank] = 1.0 - state[at.SQUEEZED + flank]
    state[at.RATES + flank] = 0.0
    if abs(state[at.RATES + 1 - flank]) <= m[at.REST] * m[at.RADIUS_LOOSE]:
        state[at.RATES + 1 - flank] = 0.0
    if state[at.WITHIN] == flank:
        if state[at.SQUEEZED + flank] == 0.0:
            state[at.TURNED] = 1.0
        elif state[at.TURNED] == 1.0:
            _capture(m, state, count, flank)


@inner
def _touch(m, state, count, flank, x, w):
    """Meet the flank itself: its spring, or the restitution law; the tables do not show it apart."""
    state[at.TURNED] = 1.0
    count[at.TOUCHES] += 1
    if m[at.STIFFNESS] > 0.0:
        state[at.GAPS + flank] = 0.0
        state[at.MODE] = at.PRESSED + flank
        return
    bounces, contacts, total = count[at.BOUNCES], count[at.CONTACTS], count[at.TOTAL]
    if x == 0.0 and state[at.RATES + flank] > -1e-12:
        count[at.GRAZING] += 1
        touch_down(m, state, count, flank)
    else:
        impact(m, state, count, flank, w)
    if count[at.HAS_IMPACT]:
        state[at.IMPULSE] += abs(state[at.IMPACT_ROW + 4])
    count[at.BOUNCES], count[at.CONTACTS], count[at.TOTAL] = bounces, contacts, total
    count[at.HAS_IMPACT] = 0
    if state[at.MODE] == at.STUCK + flank:
        _capture(m, state, count, flank)


@inner
def _enter(state, flank):
    state[at.WITHIN], state[at.TURNED], state[at.PASSED], state[at.IMPULSE] = flank, 0.0, 0.0, 0.0
    state[at.ENTRY], state[at.ENTRY_VELOCITY] = state[at.TIME], -state[at.RATES + flank]
    state[at.ENTRY_HEIGHT], state[at.ENTRY_PLACE] = state[at.HEIGHT], state[at.DISPLACEMENT]


@inner
def _capture(m, state, count, flank):
    """Log a passage that has become contact; its rebound is 0."""
    if state[at.PASSED] == 0.0:
        state[at.PASSED] = 1.0
        count[at.CONTACTS] += 1
        speed, side = state[at.ENTRY_VELOCITY], 1.0 if flank == 0 else -1.0
        push = m[at.INERTIA] / m[at.RADIUS_LOOSE] * abs(thrust(m, side, state[at.SIGN]))
        log_impact(
            state, count, flank, state[at.ENTRY], state[at.ENTRY_PLACE], speed, 0.0, push * speed,
            state[at.ENTRY_HEIGHT],
        )  # fmt: skip
    state[at.CONTACT_SINCE] = state[at.ENTRY]


@inner
def _leave(state, count, flank):
    """End a passage, as an impact or as contact over oil."""
    if state[at.PASSED] == 1.0:
        state[at.CONTACT_SINCE] = state[at.ENTRY]
    end_passage(state, count, flank)
    state[at.WITHIN] = -1.0


@inner
def hush(count):
    """Keep what happens in contact of the bare flanks out of the tables: it lies within a passage."""
    if count[at.HAS_IMPACT]:
        count[at.TOTAL] -= 1
        count[at.TOUCHES] += 1
    count[at.HAS_IMPACT] = count[at.HAS_CONTACT] = 0


@inner
def settle_on_film(m, state, flank, w):
    """Begin a run at rest on the film that bears the gear, or at the height FELT where nothing presses it down.

    To be called with the reaction of the bare flank in ``w``, which would have to pull.
    """
    side, speed = 1.0 if flank == 0 else -1.0, state[at.SPEED]
    sign = 0.0 if speed == 0.0 else 1.0 if speed > 0.0 else -1.0
    pull = w[at.REACTION, 0] / thrust(m, side, sign) + m[at.RADIUS_LOOSE] * (w[at.PUSH, 0] - w[at.PUSH + 1, 0])
    gap = balance(m, state, flank, pull) if side * pull > 0.0 else m[at.FELT]
    state[at.GAPS + flank] += gap
    state[at.GAPS + 1 - flank] -= gap
    state[at.DISPLACEMENT] += side * gap
    state[at.ANGLE] += side * gap / m[at.RADIUS_LOOSE]
    take_off(m, state, flank, w)
    state[at.LIFT] = -1.0
    if gap < m[at.FELT]:
        state[at.PASSED], state[at.WITHIN] = 1.0, flank
