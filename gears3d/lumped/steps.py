"""One step of the motion over power series, up to its first event: in flight and in contact."""

from __future__ import annotations

from math import inf

from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner
from gears3d.lumped.cursors import crossing, horizon
from gears3d.lumped.impacts import cross, end_contact, impact, let_go, touch_down
from gears3d.lumped.roots import curvature, first_root, highest, slope, value
from gears3d.lumped.series import contact, flight

FLIGHT_ENDS, SPEED_TURNS, BREAKS_LOOSE, CROSSES = range(4)


@inner
def plan(m, state, rate, span, spare):
    """Return the length of a step and the order that covers it to rounding, with ``spare`` orders to differentiate."""
    reach = min(span, at.REACH[at.ORDER - 1 - spare] / rate)
    if m[at.N_TABLES] > 0.0:
        reach = horizon(m, state, reach)
    n = int(m[at.LEAST_ORDER])
    while n < at.ORDER and at.REACH[n - 1 - spare] < rate * reach:
        n += 1
    return reach, n


@inner
def trusted(c, first, n, reach):
    """Shorten ``reach`` until the last terms of the series are negligible.

    Returns the reach, and a bound on how far the series gets from its start within it.
    """
    size = 0.0
    for _ in range(200):
        power, size = 1.0, 0.0
        for k in range(n):
            if k >= first:
                size += abs(c[k]) * power
            power *= reach
        last, before = abs(c[n]) * power, abs(c[n - 1]) * power / reach
        if (last <= 1e-11 * size and before <= 1e-9 * size) or size == 0.0:
            return reach, size + last
        reach *= 0.7
    return reach, size


@inner
def sample(m, state, count, w, samples, spacing, x, n):
    """Take the samples that fall into the step [0, x]."""
    t = state[at.TIME]
    i = count[at.N_SAMPLES]
    end = (t + x) * (1.0 + 1e-15)  # the last sample's time may be rounded up
    while i < samples.shape[0] and i * spacing <= end:
        since = min(max(i * spacing - t, 0.0), x)
        row = samples[i]
        row[0] = i * spacing
        row[1] = value(w[at.THETA1], n, since)
        row[3] = value(w[at.OMEGA1], n, since)
        row[4] = value(w[at.OMEGA2], n - 1, since)
        row[5] = value(w[at.S], n, since)
        row[6] = slope(w[at.S], n, since)
        row[2] = (row[5] + m[at.RADIUS_DRIVE] * row[1]) / m[at.RADIUS_LOOSE]
        i += 1
    count[at.N_SAMPLES] = i


@inner
def carry(m, state, x, n, w):
    """Move the state to the end of the step."""
    theta = speed = s = omega = gap0 = gap1 = rate0 = rate1 = 0.0
    for k in range(n, -1, -1):
        rate0 = rate0 * x + gap0
        rate1 = rate1 * x + gap1
        gap0 = gap0 * x + w[at.GAP, k]
        gap1 = gap1 * x + w[at.GAP + 1, k]
        s = s * x + w[at.S, k]
        theta = theta * x + w[at.THETA1, k]
        omega = omega * x + w[at.OMEGA1, k]
        if k < n:
            speed = speed * x + w[at.OMEGA2, k]
    state[at.TIME] += x
    state[at.DISPLACEMENT] = s
    state[at.ANGLE] = (s + m[at.RADIUS_DRIVE] * theta) / m[at.RADIUS_LOOSE]
    state[at.SPEED], state[at.DRIVE_SPEED] = speed, omega
    state[at.GAPS], state[at.GAPS + 1] = gap0, gap1
    state[at.RATES], state[at.RATES + 1] = rate0, rate1
    state[at.LIFT] = -1.0


@inner
def free_step(m, state, count, w, samples, spacing, span):
    """Fly until contact, until the loose gear stops or begins to move, or to the step's end."""
    guess = state[at.GUESS]
    state[at.GUESS] = inf
    reach, n = plan(m, state, m[at.RATE], min(span, guess), 1)
    flight(m, state, n, w)
    reach, way = trusted(w[at.GAP], 1, n, reach)
    if m[at.DEVIATES] > 0.0:
        reach, other = trusted(w[at.GAP + 1], 1, n, reach)
        way = max(way, other)
    event, flank, x = _free_event(m, state, w, n, reach, way)
    x, table, side = crossing(m, state, w, n, x)
    event = event if table < 0 else CROSSES
    departed = int(state[at.DEPARTED])
    state[at.HEIGHT] = max(state[at.HEIGHT], highest(w[at.GAP + departed], n, x))
    sample(m, state, count, w, samples, spacing, x, n)
    carry(m, state, x, n, w)
    if event == FLIGHT_ENDS:
        state[at.GUESS] = -2.5 / min(curvature(w[at.GAP + flank], n, x), -1e-12)
        if x == 0.0 and state[at.RATES + flank] > -1e-12:
            count[at.GRAZING] += 1
            touch_down(m, state, count, flank)
        else:
            impact(m, state, count, flank)
    elif event == CROSSES:
        cross(m, state, count, table, side)
    else:
        speed_event(m, state, event, w)


@inner
def speed_event(m, state, event, w):
    """Let the loose gear's speed pass through zero, or begin to move."""
    if event == SPEED_TURNS:
        state[at.SPEED] = 0.0
        let_go(m, state)
    elif event == BREAKS_LOOSE:
        state[at.SPEED], state[at.SIGN] = 0.0, -1.0 if w[at.TORQUE, 0] > 0.0 else 1.0


@inner
def _free_event(m, state, w, n, reach, way):
    event, where, x = -1, 0, reach
    for flank in range(2):
        gap = w[at.GAP + flank]
        if gap[0] <= way:
            root = first_root(gap, 1.0, n, x)
            if root < x:
                event, where, x = FLIGHT_ENDS, flank, root
    if state[at.SIGN] != 0.0:
        straight = m[at.N_TORQUES] == 0.0 and m[at.BASE + 1] == 0.0
        root = first_root(w[at.OMEGA2], state[at.SIGN], 1 if straight else n, x)
        if root < x:
            event, x = SPEED_TURNS, root
    else:
        root = loose_at(w, n, x)
        if root < x:
            event, x = BREAKS_LOOSE, root
    return event, where, x


@inner
def loose_at(w, n, reach):
    """When a gear at rest begins to move: where the torque first exceeds dry friction."""
    first = inf
    for side in (-1.0, 1.0):
        for k in range(n + 1):
            w[at.SCRATCH, k] = w[at.DRY, k] + side * w[at.TORQUE, k]
        first = min(first, first_root(w[at.SCRATCH], 1.0, n, reach))
    return first


@inner
def contact_step(m, state, count, w, samples, spacing, span):
    """Stay in contact until the reaction or the loose gear's speed changes sign, or to the step's end."""
    flank = int(state[at.MODE]) - at.STUCK
    phase = 0 if state[at.SLIDE] == 1.0 else 1 + flank
    reach, n = plan(m, state, m[at.RATE], span, 2)
    sign = contact(m, state, flank, phase, n, w)
    reach = trusted(w[at.REACTION], 0, n - 2, reach)[0]
    x, ends = reach, False
    if sign != 0.0:
        root = first_root(w[at.REACTION], 1.0, n - 2, x)
        if root < state[at.HOLD]:
            x = min(x, state[at.HOLD])
            root = inf
        elif root < x:
            x, ends = root, True
        root = first_root(w[at.OMEGA2], sign, n - 1, x)
        if root < x:
            x, ends = root, False
    x, table, side = crossing(m, state, w, n, x)
    state[at.HOLD] = 0.0
    state[at.SIGN] = sign
    sample(m, state, count, w, samples, spacing, x, n)
    carry(m, state, x, n, w)
    if table >= 0:
        cross(m, state, count, table, side)
    elif ends:
        end_contact(m, state, count, flank)
