"""Steps of the integrator through oil, over compliant teeth and with a carried body, up to the first event.

A film turns most approaches back before the flanks touch. So an impact is here a *passage*: the gap falls below the
height FELT at which the film carries the drag, and rises above it again; speed and rebound are those at that height,
the impulse is that of film and flank together. A gear that turns towards the flank a second time within a passage is in
contact over oil. As the oil becomes thinner, FELT goes to zero, and with it every difference of a passage to an impact
of rigid flanks. Without oil a passage begins where compliant teeth touch and ends where they are clear again.

The state of the integrator: displacement, its rate; with a carried body its twist and the rate of that; impulse of the
passage; the works on request, as in the state.
"""

from __future__ import annotations

from math import pi, sqrt

from gears3d.integrator import END, NEVER, inside, integrator, judge, locator, off
from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner, tight
from gears3d.lumped.cursors import horizon
from gears3d.lumped.forces import acting, imposed
from gears3d.lumped.impacts import (
    cross,
    end_contact,
    enter,
    impact,
    leave,
    let_go,
    motion_of,
    place_on_flank,
    sense,
    stay,
    touch_down,
)
from gears3d.lumped.law import TOUCH

# Events, the first four of both flanks, the last of both ends of every table.
TURNS, TOUCHES, BORDERS, LETS_GO, STOPS, ROLLS, LIFTS, ENGAGES, RELEASES, KNOTS = 0, 2, 4, 6, 8, 9, 10, 11, 12, 13
STILL = 1e-13  # rate that counts as zero, of a gap [m/s] or of a twist [rad/s]
# Relative overshoot at the end of half the play, so that a body that has just reached the end is in contact.
SLACK = 1e-9
# Smallest rate of a gap, and of the twist times the base radius, to which errors are related [m/s].
SLOWEST = 1e-3
NARROWEST = 1e-3  # smallest gap, in backlashes, to which errors are related without oil
SECANTS = 8  # secants of the mesh force in a step
# Phase of the oscillation on compliant teeth after which contact counts as permanent [rad].
LASTING = 10.0 * pi


@inner
def rates(given, t, y, k):
    """Write the rates of the integrator's state."""
    m, state = given
    _write_rates(m, state, y, acting(m, state, t, y), k)


@tight
def _write_rates(m, state, y, now, k):
    k[0], k[1], i = y[1], now.rate, motions_of(m)
    if i > 2:
        k[2], k[3] = y[3], now.twisting
    within = state[at.WITHIN]
    k[i] = 0.0 if within < 0.0 else now.push_active if within == 0.0 else now.push_reverse
    if k.shape[0] > i + 1:
        k[i + 1], k[i + 2], k[i + 3], k[i + 4] = now.by_mesh, now.by_drag, now.by_friction, now.by_springs
        k[i + 5], k[i + 6], k[i + 7], k[i + 8] = now.by_dampers, now.by_squeeze, now.by_wedge, now.by_drive


@tight
def motions_of(m):
    """Return how many numbers of the integrator's state are places and their rates."""
    return 4 if m[at.CARRIED] > 0.0 else 2


@inner
def size_of(m):
    """Return how many numbers the integrator's state has."""
    return motions_of(m) + (1 + at.N_WORKS if m[at.SUMMED] > 0.0 else 1)


_attempt, _open_up = integrator(rates)


@inner
def outlook(given, t, y, g, k):
    """Write functions of which one falls below zero at an event, and rates; return the narrower gap."""
    m, state = given
    now = acting(m, state, t, y)
    _write_rates(m, state, y, now, k)
    riding = at.STUCK <= state[at.MODE] < at.PRESSED
    within, oil = int(state[at.WITHIN]), m[at.FLOOR] > 0.0
    gaps, speeds = (now.gap_active, now.gap_reverse), (now.rate_active, now.rate_reverse)
    teeth = (now.teeth_active, now.teeth_reverse)
    for flank in range(2):
        gap, rate, pressed = gaps[flank], speeds[flank], state[at.INSIDE + flank]
        closes, rides = state[at.SQUEEZED + flank] > 0.0, riding and state[at.MODE] == at.STUCK + flank
        turns, touches, borders, lets_go = (-rate if closes else rate) + STILL, NEVER, NEVER, NEVER
        if pressed != at.CLEAR:
            touches = -gap
            if (m[at.DAMPING] > 0.0 or m[at.CRITICAL] > 0.0) and m[at.PUBLISHED] == 0.0:
                lets_go = teeth[flank] if pressed == at.PUSHES else -teeth[flank]
        elif closes:
            touches = gap
        if oil and (within == flank or within < 0):
            if closes and within < 0:
                borders = gap - m[at.FELT]
            elif not closes and within == flank:
                borders = m[at.FELT] - gap
        if rides:
            turns = touches = borders = lets_go = NEVER
        g[TURNS + flank], g[TOUCHES + flank], g[BORDERS + flank], g[LETS_GO + flank] = turns, touches, borders, lets_go
    if m[at.DEVIATES] == 0.0:
        g[TURNS + 1] = NEVER  # one gap opens as the other closes
    sign = state[at.SIGN]
    g[STOPS] = sign * now.omega if sign != 0.0 else NEVER if riding else now.dry - abs(now.pull)
    g[ROLLS] = now.rolling if oil else NEVER
    g[LIFTS] = now.reaction if riding and state[at.HOLD] == 0.0 else NEVER
    g[ENGAGES] = g[RELEASES] = NEVER
    if m[at.PLAY] > 0.0:
        side, half = state[at.TWISTED], 0.5 * m[at.PLAY]
        g[ENGAGES] = (side * y[2] - half if side != 0.0 else half - abs(y[2])) + SLACK * half
        if side != 0.0 and m[at.TORSION_DAMPING] > 0.0:
            g[RELEASES] = side * now.twist if state[at.TWISTING] > 0.0 else -side * now.twist
    for i in range(int(m[at.N_TABLES])):
        row, cursor = int(m[at.AT_TABLES]) + at.PER_TABLE * i, at.STATE + 2 * i
        variable, first = int(m[row]), int(m[row + at.AT_KNOTS]) + int(state[cursor])
        low = high = NEVER
        if variable != at.TIME_TABLE:
            angle, _, _ = imposed(m, state, t)
            x = now.omega
            if variable == at.THETA1:
                x = angle
            elif variable == at.THETA2:
                x = (y[0] + m[at.RADIUS_DRIVE] * angle) / m[at.RADIUS_LOOSE]
            low, high = x - m[first] - state[cursor + 1], m[first + 1] + state[cursor + 1] - x
        g[KNOTS + 2 * i], g[KNOTS + 2 * i + 1] = low, high
    return min(now.gap_active, now.gap_reverse)


_first = locator(outlook)


@inner
def go(m, state, y, t):
    """Write time and motion of the integrator into the state."""
    angle, speed, _ = imposed(m, state, t)
    state[at.TIME], state[at.DRIVE_SPEED], state[at.DISPLACEMENT] = t, speed, y[0]
    state[at.SPEED] = (y[1] + m[at.RADIUS_DRIVE] * speed) / m[at.RADIUS_LOOSE]
    state[at.ANGLE] = (y[0] + m[at.RADIUS_DRIVE] * angle) / m[at.RADIUS_LOOSE]
    i = motions_of(m)
    state[at.IMPULSE], state[at.LIFT] = y[i], -1.0
    if i > 2:
        state[at.TWIST], state[at.TWIST_RATE] = y[2], y[3]
    for c in range(y.shape[0] - i - 1):
        state[at.WORKS + c] = y[i + 1 + c]
    now = acting(m, state, t, y)
    state[at.GAPS], state[at.GAPS + 1] = now.gap_active, now.gap_reverse
    state[at.RATES], state[at.RATES + 1] = now.rate_active, now.rate_reverse


@inner
def come(m, state, y):
    """Write the state's motion into that of the integrator."""
    place, rate, twist, twisting = motion_of(m, state)
    i = motions_of(m)
    y[0], y[1], y[i] = place, rate, state[at.IMPULSE]
    if i > 2:
        y[2], y[3] = twist, twisting
    for c in range(y.shape[0] - i - 1):
        y[i + 1 + c] = state[at.WORKS + c]


@inner
def wake(m, state, y, k, g):
    """Write the integrator's state, its rates and the functions of its events at the begin of a step."""
    come(m, state, y)
    outlook((m, state), state[at.TIME], y, g, k[0])


@inner
def compliant_step(m, state, count, samples, spacing, until, work):
    """Do one step of the integrator, up to an event; the arrays of ``work`` hold its start."""
    y, end, between, k, dense, g, ahead, values, seen, held = work
    t, left = state[at.TIME], horizon(m, state, until - state[at.TIME])
    h = min(state[at.STEP], 1.0 / m[at.RATE + 1 if state[at.MODE] >= at.PRESSED else at.RATE])
    if m[at.PLAY] > 0.0 and state[at.TWISTED] == 0.0:  # so that no step goes through the play and beyond
        h = min(h, 0.5 * m[at.PLAY] / (abs(y[3]) + STILL))
    if state[at.HOLD] > 0.0:
        left = min(left, state[at.HOLD])
    last = h >= left
    if last:
        h = left
    elif 2.0 * h > left:
        h = 0.5 * left
    _attempt((m, state), t, y, h, k, end, motions_of(m))
    narrow = max(abs(outlook((m, state), t + h, end, ahead, k[END])), m[at.FLOOR])
    if m[at.FLOOR] == 0.0:
        narrow = max(narrow, NARROWEST * m[at.BACKLASH])
    error = max(abs(off(k, h, 0)) / narrow, abs(off(k, h, 1)) / (abs(end[1]) + SLOWEST))
    if motions_of(m) > 2:
        radius = m[at.RADIUS_LOOSE]
        error = max(error, radius * abs(off(k, h, 2)) / (radius * abs(end[2]) + NARROWEST * m[at.BACKLASH]))
        error = max(error, radius * abs(off(k, h, 3)) / (radius * abs(end[3]) + SLOWEST))
    error /= m[at.TOLERANCE]
    accepted, after, root = judge(h, error, state[at.TRIED], state[at.ERROR])
    state[at.STEP] = max(after, state[at.STEP]) if accepted and last else after
    if not accepted:
        return
    state[at.TRIED], state[at.ERROR] = h, root
    opened, event, x = False, -1, 1.0
    if _stirs(m, state, k, ahead):
        _open_up((m, state), t, y, h, k, end, dense, between, motions_of(m))
        opened = True
        for i in range(g.shape[0]):
            values[i] = ahead[i]
        event, x = _first((m, state), t, y, h, _wavers(m, state, k), dense, between, g, values, seen, held)
    if m[at.SETTLE] >= 0.0 and t + x * h > m[at.SETTLE]:
        if not opened:
            _open_up((m, state), t, y, h, k, end, dense, between, motions_of(m))
            opened = True
        _shake(m, state, t, y, h, x, dense, between)
    if count[at.N_SAMPLES] < samples.shape[0]:
        if not opened and count[at.N_SAMPLES] * spacing <= (t + x * h) * (1.0 + 1e-15):
            _open_up((m, state), t, y, h, k, end, dense, between, motions_of(m))
        _sample(m, state, count, samples, spacing, t, y, h, x, dense, between)
    if event < 0:
        for c in range(y.shape[0]):
            y[c] = end[c]
            k[0, c] = k[END, c]
        for i in range(g.shape[0]):
            g[i], held[i] = ahead[i], 0
        state[at.TIME], state[at.HOLD] = t + h, 0.0
        if last or m[at.DEVIATES] > 0.0 or at.STUCK <= state[at.MODE] < at.PRESSED:
            go(m, state, y, until if last and left == until - t else t + h)
            _ride(m, state)
            _rise(state)
            wake(m, state, y, k, g)
        else:
            gap = y[0] - m[at.LAYER] if state[at.DEPARTED] == 0.0 else m[at.BACKLASH] - y[0]
            state[at.HEIGHT] = max(state[at.HEIGHT], gap)
        _last(m, state, count)
        return
    if x > 0.0:
        for i in range(g.shape[0]):
            held[i] = 0
        for c in range(y.shape[0]):
            between[c] = inside(y, dense, x, c)
        for c in range(y.shape[0]):
            y[c] = between[c]
    held[event] = 1
    go(m, state, y, t + x * h)
    state[at.HOLD] = 0.0
    _rise(state)
    before = state[at.SPEED]
    _happen(m, state, count, event)
    state[at.TWIST_RATE] -= state[at.SPEED] - before
    wake(m, state, y, k, g)


@inner
def _ride(m, state):
    """Keep a gear in contact with a bare flank exactly on it."""
    if at.STUCK <= state[at.MODE] < at.PRESSED:
        before = state[at.SPEED]
        place_on_flank(m, state, int(state[at.MODE]) - at.STUCK, 0.0)
        state[at.TWIST_RATE] -= state[at.SPEED] - before
        state[at.SIGN] = sense(m, state[at.SPEED])


@inner
def _last(m, state, count):
    """Count contact on compliant teeth without oil as permanent after five periods of its oscillation."""
    if m[at.FLOOR] == 0.0 and state[at.MODE] >= at.PRESSED and state[at.PASSED] == 0.0:
        mass = m[at.INERTIA] / m[at.RADIUS_LOOSE] ** 2
        if state[at.TIME] - state[at.ENTRY] > LASTING * sqrt(mass / m[at.STIFFNESS]):
            stay(m, state, count, int(state[at.WITHIN]))


@inner
def _rise(state):
    """Record the largest distance of the gear from the flank that it left."""
    state[at.HEIGHT] = max(state[at.HEIGHT], state[at.GAPS + int(state[at.DEPARTED])])


@inner
def _stirs(m, state, k, ahead):
    """Whether an event may lie within a step: one has changed its sign, or a rate may have changed sign twice."""
    for i in range(ahead.shape[0]):
        if ahead[i] < 0.0:
            return True
    return _wavers(m, state, k)


@inner
def _wavers(m, state, k):
    """Whether a function with the same sign at both ends of a step may have another one in between."""
    if m[at.DEVIATES] > 0.0 or at.STUCK <= state[at.MODE] < at.PRESSED:
        return True
    closes = state[at.SQUEEZED] > 0.0
    turned = False
    for j in range(3, END):
        turned |= (k[j, 0] if closes else -k[j, 0]) > STILL
    return turned


@inner
def _shake(m, state, t, y, h, x, dense, point):
    """Add the square of the rate of the mesh force over the part of a step after the settling time."""
    begin = max(t, m[at.SETTLE])
    apart = (t + x * h - begin) / SECANTS
    for j in range(SECANTS + 1):
        here = begin + j * apart
        for c in range(motions_of(m)):
            point[c] = inside(y, dense, (here - t) / h, c)
        now = acting(m, state, here, point)
        force = now.push_active - now.push_reverse
        if j > 0 and apart > 0.0:
            state[at.JERK] += (force - state[at.MESH_FORCE]) ** 2 / apart
            state[at.RISING] += apart
        state[at.MESH_FORCE] = force


@inner
def _sample(m, state, count, samples, spacing, t, y, h, x, dense, point):
    """Take the samples that fall into the first part of a step."""
    i, until = count[at.N_SAMPLES], (t + x * h) * (1.0 + 1e-15)
    while i < samples.shape[0] and i * spacing <= until:
        part = min(max((i * spacing - t) / h, 0.0), x)
        angle, speed, _ = imposed(m, state, i * spacing)
        for c in range(motions_of(m)):
            point[c] = inside(y, dense, part, c)
        now, row = acting(m, state, i * spacing, point), samples[i]
        row[0], row[1], row[3] = i * spacing, angle, speed
        row[5], row[6], row[7], row[8] = point[0], point[1], now.push_active, now.push_reverse
        row[2] = (row[5] + m[at.RADIUS_DRIVE] * angle) / m[at.RADIUS_LOOSE]
        row[4] = (row[6] + m[at.RADIUS_DRIVE] * speed) / m[at.RADIUS_LOOSE]
        i += 1
    count[at.N_SAMPLES] = i


@inner
def _happen(m, state, count, event):
    """Apply the changes of an event."""
    flank = event % 2
    if event < TOUCHES:
        _turn(m, state, count, flank)
        if m[at.DEVIATES] == 0.0:
            _turn(m, state, count, 1 - flank)
    elif event < BORDERS:
        _touch(m, state, count, flank)
    elif event < LETS_GO:
        if state[at.WITHIN] < 0.0:
            enter(state, flank)
        else:
            leave(state, count, flank)
    elif event < STOPS:
        pushed = state[at.INSIDE + flank] == at.PUSHES
        state[at.INSIDE + flank] = at.SUNK if pushed else at.PUSHES
        state[at.MODE] = at.FREE if pushed else at.PRESSED + flank
        let_go(m, state)
    elif event == STOPS:
        _stop(m, state)
    elif event == ROLLS:
        state[at.SENSE] = -state[at.SENSE]
    elif event == ENGAGES:
        state[at.TWISTING] = 1.0 if state[at.TWISTED] == 0.0 else 0.0
        state[at.TWISTED] = 0.0 if state[at.TWISTED] != 0.0 else 1.0 if state[at.TWIST] > 0.0 else -1.0
    elif event == RELEASES:
        state[at.TWISTING] = 1.0 - state[at.TWISTING]
    else:
        if event == LIFTS:
            end_contact(m, state, count, int(state[at.MODE]) - at.STUCK)
        else:
            cross(m, state, count, (event - KNOTS) // 2, (event - KNOTS) % 2)
        _suppress_event(m, count)


@inner
def _turn(m, state, count, flank):
    """Begin or end the approach to a flank; under oil a second approach within a passage is contact."""
    state[at.SQUEEZED + flank] = 1.0 - state[at.SQUEEZED + flank]
    if m[at.FLOOR] > 0.0 and state[at.WITHIN] == flank:
        if state[at.SQUEEZED + flank] == 0.0:
            state[at.TURNED] = 1.0
        elif state[at.TURNED] == 1.0:
            stay(m, state, count, flank)


@inner
def _touch(m, state, count, flank):
    """Begin contact with a flank, or leave compliant teeth; under oil the tables do not list it separately."""
    oil = m[at.FLOOR] > 0.0
    if state[at.INSIDE + flank] != at.CLEAR:
        state[at.INSIDE + flank], state[at.MODE] = at.CLEAR, at.FREE
        let_go(m, state)
        if not oil:
            leave(state, count, flank)
        return
    if oil:
        count[at.TOUCHES] += 1
        state[at.TURNED] = 1.0
    if m[at.STIFFNESS] > 0.0:
        if not oil:
            enter(state, flank)
        state[at.INSIDE + flank], state[at.MODE] = at.PUSHES, at.PRESSED + flank
        state[at.STEP] = min(state[at.STEP], 1.0 / m[at.RATE + 1])
        return
    bounces, contacts = count[at.BOUNCES], count[at.CONTACTS]
    if state[at.RATES + flank] > -TOUCH:
        count[at.GRAZING] += 1
        touch_down(m, state, count, flank)
    else:
        impact(m, state, count, flank)
    if count[at.HAS_IMPACT] and oil:
        state[at.IMPULSE] += abs(state[at.IMPACT_ROW + 4])
        count[at.BOUNCES], count[at.CONTACTS], count[at.TOTAL] = bounces, contacts, count[at.TOTAL] - 1
        count[at.HAS_IMPACT] = 0
    state[at.SQUEEZED + flank] = 0.0
    state[at.SQUEEZED + 1 - flank] = 1.0 if m[at.DEVIATES] == 0.0 or state[at.RATES + 1 - flank] < 0.0 else 0.0
    if oil and state[at.MODE] == at.STUCK + flank:
        stay(m, state, count, flank)


@inner
def _suppress_event(m, count):
    """Exclude events in contact of the bare flanks under oil from the tables: they lie within a passage."""
    if m[at.FLOOR] > 0.0:
        if count[at.HAS_IMPACT]:
            count[at.TOTAL] -= 1
            count[at.TOUCHES] += 1
        count[at.HAS_IMPACT] = count[at.HAS_CONTACT] = 0


@inner
def _stop(m, state):
    """Let the loose gear's speed pass through zero, or begin to move."""
    if state[at.SIGN] == 0.0:
        now = acting(m, state, state[at.TIME], motion_of(m, state))
        state[at.SPEED], state[at.SIGN] = 0.0, -1.0 if now.pull > 0.0 else 1.0
    elif at.STUCK <= state[at.MODE] < at.PRESSED:
        state[at.SIGN] = -state[at.SIGN]
    else:
        state[at.SPEED] = 0.0
        let_go(m, state)
