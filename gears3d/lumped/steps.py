"""One step of the motion over power series, up to its first event: in flight and in contact.

Recurrences for the power series of composed functions are those of automatic differentiation (Griewank & Walther 2008,
chapter 13). All functions are compiled; ``w`` is the work array of :mod:`gears3d.lumped.layout`.
"""

from __future__ import annotations

from math import cos, inf, sin

from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner
from gears3d.lumped.cursors import crossing, horizon, motion, tabled
from gears3d.lumped.forces import material
from gears3d.lumped.impacts import cross, end_contact, impact, let_go, touch_down
from gears3d.lumped.law import thrust
from gears3d.lumped.roots import curvature, first_root, highest, slope, value
from gears3d.lumped.torques import torque, turn

FLIGHT_ENDS, SPEED_TURNS, BREAKS_LOOSE, CROSSES = range(4)


@inner
def drive(m, state, n, w):
    """Write drive speed and angle up to order n; Rigaud & Perret-Liaudet 2020, eq. (1)."""
    speed, angle, t = w[at.OMEGA1], w[at.THETA1], state[at.TIME]
    speed[0] = m[at.MEAN]
    for k in range(1, n + 1):
        speed[k] = 0.0
    start = m[at.MEAN] * t
    for i in range(int(m[at.N_HARMONICS])):
        row = at.HARMONICS + at.PER_HARMONIC * i
        amplitude, omega, phase = m[row], m[row + 1], m[row + 2]
        a = amplitude * sin(omega * t + phase)
        b = amplitude * cos(omega * t + phase)
        start -= (b - amplitude * m[row + 3]) / omega
        speed[0] += a
        for k in range(1, n + 1):
            a, b = b * omega * at.INVERSE[k], -a * omega * at.INVERSE[k]
            speed[k] += a
    angle[0] = start
    for k in range(1, n + 1):
        angle[k] = speed[k - 1] * at.INVERSE[k]
    if m[at.DRIVE_TABLE] >= 0.0:
        motion(m, state, n, w)


@inner
def deviate(m, gear, k, w):
    """Write both flanks' deviations of one gear, order k, from its speed up to k - 1."""
    active = reverse = 0.0
    speed, angle = (at.OMEGA2, at.THETA2) if gear else (at.OMEGA1, at.THETA1)
    for i in range(int(m[at.N_FLANKS])):
        row = int(m[at.AT_FLANKS]) + at.PER_FLANK * i
        if int(m[row]) == gear:
            wave = at.ROWS + 2 * (int(m[at.N_TORQUES]) + i)
            turn(m[row + 1], m[row + 2], w, angle, speed, k, wave)
            active += m[row + 3] * w[wave, k]
            reverse += m[row + 4] * w[wave, k]
    if gear == 0 and m[at.FLANK_TABLE] >= 0.0:
        active += w[at.TABLED, k]
        reverse += w[at.TABLED + 1, k]
    w[at.DEVIATION + 2 * gear, k] = active
    w[at.DEVIATION + 2 * gear + 1, k] = reverse


@inner
def _gaps(loose, drive, k, w):
    """Write displacement and both gaps, order k > 0."""
    w[at.S, k] = loose * w[at.THETA2, k] - drive * w[at.THETA1, k]
    w[at.GAP, k] = w[at.S, k] - w[at.DEVIATION, k] - w[at.DEVIATION + 2, k]
    w[at.GAP + 1, k] = -w[at.S, k] - w[at.DEVIATION + 1, k] - w[at.DEVIATION + 3, k]


@inner
def flight(m, state, n, w):
    """Write the loose gear's motion in flight up to order n: J·θ̈2 = −T; Kadmiri et al. 2012, eqs (13)-(16).

    With constant torque and perfect flanks this is the parabola of Rigaud & Perret-Liaudet 2020, eq. (14), in closed
    form. The starts of the gaps and their rates are taken from the state, where they are known without cancellation.
    """
    sign = state[at.SIGN]
    if sign == 0.0 or m[at.DEVIATES] > 0.0 or m[at.N_TORQUES] > 0.0:
        _general(m, state, n, w)
    else:
        drive(m, state, n, w)
        _exponential(m, sign, state[at.SPEED], state[at.ANGLE], n, w)
        for k in range(1, n + 1):
            gap = m[at.RADIUS_LOOSE] * w[at.THETA2, k] - m[at.RADIUS_DRIVE] * w[at.THETA1, k]
            w[at.S, k], w[at.GAP, k], w[at.GAP + 1, k] = gap, gap, -gap
        _anchor(state, w)
    if state[at.LIFT] >= 0.0:
        gap = w[at.GAP + int(state[at.LIFT])]
        if abs(gap[2]) < m[at.UNFELT] * (1.0 + 1e-3 * m[at.RATE] * state[0]):
            gap[2] = 0.0


@inner
def _exponential(m, sign, speed, angle, n, w):
    """Flight under constant and linear torque: the series of a parabola or an exponential."""
    linear = -m[at.BASE + 1] / m[at.INERTIA]
    w[at.OMEGA2, 0], w[at.THETA2, 0], w[at.THETA2, 1] = speed, angle, speed
    w[at.OMEGA2, 1] = linear * speed - (m[at.BASE] * sign - m[at.BASE + 2]) / m[at.INERTIA]
    if speed == 0.0 and abs(w[at.OMEGA2, 1]) * m[at.RADIUS_LOOSE] < m[at.UNFELT]:
        w[at.OMEGA2, 1] = 0.0
    for k in range(2, n + 1):
        w[at.OMEGA2, k] = linear * w[at.OMEGA2, k - 1] * at.INVERSE[k]
        w[at.THETA2, k] = w[at.OMEGA2, k - 1] * at.INVERSE[k]


@inner
def _general(m, state, n, w):
    """Write the flight under any torques up to order n; at rest TORQUE acts and DRY is the friction limit."""
    sign, own = state[at.SIGN], m[at.ON_LOOSE] > 0.0
    drive(m, state, n + 1, w)
    w[at.OMEGA2, 0] = state[at.SPEED] if sign != 0.0 else 0.0
    w[at.THETA2, 0] = state[at.ANGLE]
    if m[at.DEVIATES] > 0.0:
        tabled(m, state, n + 1, w)
        for k in range(n + 2):
            deviate(m, 0, k, w)
    if own:
        deviate(m, 1, 0, w)
    for k in range(n + 1):
        w[at.THETA2, k + 1] = w[at.OMEGA2, k] * at.INVERSE[k + 1]
        if own:
            deviate(m, 1, k + 1, w)
        _gaps(m[at.RADIUS_LOOSE], m[at.RADIUS_DRIVE], k + 1, w)
        if k == 0:
            _anchor(state, w)
        total = torque(m, state, 0, sign, k, w)
        if sign == 0.0:
            w[at.DRY, k] = torque(m, state, 0, 1.0, k, w) - torque(m, state, 0, 0.0, k, w)
            w[at.TORQUE, k] = total
            w[at.OMEGA2, k + 1] = 0.0
        else:
            w[at.OMEGA2, k + 1] = -total / m[at.INERTIA] * at.INVERSE[k + 1]
            if k == 0 and w[at.OMEGA2, 0] == 0.0 and abs(w[at.OMEGA2, 1]) * m[at.RADIUS_LOOSE] < m[at.UNFELT]:
                w[at.OMEGA2, 1] = 0.0


@inner
def _anchor(state, w):
    """Replace the starts computed from large angles by those in the state."""
    w[at.S, 0] = state[at.DISPLACEMENT]
    for flank in range(2):
        w[at.GAP + flank, 0] = state[at.GAPS + flank]
        w[at.GAP + flank, 1] = state[at.RATES + flank]
    w[at.S, 1] = w[at.GAP, 1] + w[at.DEVIATION, 1] + w[at.DEVIATION + 2, 1]


@inner
def contact(m, state, flank, phase, n, w):
    """Write the loose gear's motion on a flank up to order n, and the flank's reaction up to n - 2.

    The reaction is positive while the flank pushes, R = (J·θ̈2 + T)/Rb2 on the active flank; Kadmiri et al. 2012,
    eqs (21), (22), with the flanks' own accelerations; friction in the mesh only scales it.
    Returns the direction that dry friction resists.
    """
    deviates, on_loose = m[at.DEVIATES] > 0.0, m[at.ON_LOOSE] > 0.0
    drive(m, state, n, w)
    side = 1.0 if flank == 0 else -1.0
    if not deviates and m[at.N_TORQUES] == 0.0:
        return _smooth_contact(m, state, flank, side, phase, n, w)
    own, other, slope = at.DEVIATION + flank, at.DEVIATION + 2 + flank, 0.0
    w[at.THETA2, 0] = state[at.ANGLE]
    if deviates:
        tabled(m, state, n, w)
        for k in range(n + 1):
            deviate(m, 0, k, w)
    if on_loose:
        deviate(m, 1, 0, w)
        around = material(m, state, 1, state[at.ANGLE])
        slope = around[1] if flank == 0 else around[4]
    for k in range(1, n + 1):
        w[at.OMEGA2, k - 1] = 0.0
        if on_loose:
            deviate(m, 1, k, w)
        free = m[at.RADIUS_DRIVE] * w[at.THETA1, k] + side * (w[own, k] + w[other, k])
        w[at.THETA2, k] = free / (m[at.RADIUS_LOOSE] - side * slope)
        w[at.OMEGA2, k - 1] = k * w[at.THETA2, k]
        if on_loose:
            deviate(m, 1, k, w)
        _gaps(m[at.RADIUS_LOOSE], m[at.RADIUS_DRIVE], k, w)
        w[at.S, k] = side * (w[own, k] + w[other, k])
        w[at.GAP + flank, k] = 0.0
    _anchor_contact(m, flank, side, w)
    sign = _direction(m, n, w)
    for k in range(n - 1):
        pull = torque(m, state, phase, sign, k, w)
        w[at.REACTION, k] = (m[at.INERTIA] * (k + 1) * w[at.OMEGA2, k + 1] + pull) * thrust(m, side, sign)
    return sign


@inner
def _smooth_contact(m, state, flank, side, phase, n, w):
    """Contact of perfect flanks under constant and linear torque: the loose gear follows the drive."""
    ratio = m[at.RADIUS_DRIVE] / m[at.RADIUS_LOOSE]
    w[at.THETA2, 0] = state[at.ANGLE]
    for k in range(n):
        w[at.OMEGA2, k] = ratio * w[at.OMEGA1, k]
        w[at.THETA2, k + 1] = ratio * w[at.THETA1, k + 1]
        w[at.S, k + 1] = w[at.GAP, k + 1] = w[at.GAP + 1, k + 1] = 0.0
    _anchor_contact(m, flank, side, w)
    sign = _direction(m, n, w)
    base, push = at.BASE + 3 * phase, thrust(m, side, sign)
    for k in range(n - 1):
        w[at.REACTION, k] = push * (m[at.INERTIA] * (k + 1) * w[at.OMEGA2, k + 1] + m[base + 1] * w[at.OMEGA2, k])
    w[at.REACTION, 0] += push * (m[base] * sign - m[base + 2])
    return sign


@inner
def _anchor_contact(m, flank, side, w):
    held = w[at.DEVIATION + flank, 0] + w[at.DEVIATION + 2 + flank, 0]
    away = w[at.DEVIATION + 1 - flank, 0] + w[at.DEVIATION + 3 - flank, 0]
    w[at.S, 0] = held if flank == 0 else m[at.BACKLASH] - held
    w[at.GAP + flank, 0] = 0.0
    w[at.GAP + 1 - flank, 0] = m[at.BACKLASH] - held - away


@inner
def _direction(m, n, w):
    """Sign of the loose gear's speed just after the start of the step, 0 at lasting rest; clears a start at rest."""
    if abs(w[at.OMEGA2, 0]) <= m[at.REST]:
        w[at.OMEGA2, 0] = 0.0
    for k in range(n):
        if w[at.OMEGA2, k] != 0.0:
            return 1.0 if w[at.OMEGA2, k] > 0.0 else -1.0
    return 0.0


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
