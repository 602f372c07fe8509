"""One step of the motion in each mode, up to its first event: in flight, in contact, pressed on a yielding flank."""

from __future__ import annotations

from math import inf

from gears3d.lumped.compile import inner
from gears3d.lumped.impacts import (
    close_contact,
    impact,
    leave_spring,
    let_go,
    press,
    settle,
    take_off,
    touch_down,
)  # fmt: skip
from gears3d.lumped.layout import (
    ANGLE,
    DEPARTED,
    DISPLACEMENT,
    DRIVE_SPEED,
    DRY,
    GAP,
    GAPS,
    GRAZING,
    GUESS,
    HEIGHT,
    HOLD,
    IMPULSE,
    INVERSE,
    LIFT,
    MODE,
    N_SAMPLES,
    OMEGA1,
    OMEGA2,
    ORDER,
    PRESSED,
    RATES,
    REACH,
    REACTION,
    SCRATCH,
    SIGN,
    SLIDE,
    SPEED,
    STUCK,
    THETA1,
    TIME,
    TORQUE,
    S,
)  # fmt: skip
from gears3d.lumped.roots import curvature, first_root, highest, slope, value
from gears3d.lumped.series import contact, flight

FLIGHT_ENDS, SPEED_TURNS, BREAKS_LOOSE, PUSHES, CLEARS = range(5)


@inner
def plan(rate, span):
    """Return the length of a step and the order that covers it to rounding, second derivatives included."""
    reach = min(span, REACH[ORDER - 3] / rate)
    n = 5
    while n < ORDER and REACH[n - 3] < rate * reach:
        n += 1
    return reach, n


@inner
def trusted(c, first, n, reach):
    """Shorten ``reach`` until the last terms of the series no longer count beside the others."""
    for _ in range(200):
        power, size = 1.0, 0.0
        for k in range(n):
            if k >= first:
                size += abs(c[k]) * power
            power *= reach
        if abs(c[n]) * power <= 1e-13 * size and abs(c[n - 1]) * power <= 1e-12 * size * reach:
            return reach
        if size == 0.0:
            return reach
        reach *= 0.7
    return reach


@inner
def sample(m, state, count, out, x, n):
    """Take the samples that fall into the step [0, x]."""
    w, t = out.work, state[TIME]
    i = count[N_SAMPLES]
    end = (t + x) * (1.0 + 1e-15)  # the last sample's time may be rounded up
    while i < out.samples.shape[0] and i * out.spacing <= end:
        at = min(max(i * out.spacing - t, 0.0), x)
        row = out.samples[i]
        row[0] = i * out.spacing
        row[1] = value(w[THETA1], n, at)
        row[3] = value(w[OMEGA1], n, at)
        row[4] = value(w[OMEGA2], n - 1, at)
        row[5] = value(w[S], n, at)
        row[6] = slope(w[S], n, at)
        row[2] = (row[5] + m.radius_drive * row[1]) / m.radius_loose
        i += 1
    count[N_SAMPLES] = i


@inner
def carry(m, state, x, n, w):
    """Move the state to the end of the step."""
    theta = value(w[THETA1], n, x)
    state[TIME] += x
    state[DISPLACEMENT] = value(w[S], n, x)
    state[ANGLE] = (state[DISPLACEMENT] + m.radius_drive * theta) / m.radius_loose
    state[SPEED] = value(w[OMEGA2], n - 1, x)
    state[DRIVE_SPEED] = value(w[OMEGA1], n, x)
    for flank in range(2):
        state[GAPS + flank] = value(w[GAP + flank], n, x)
        state[RATES + flank] = slope(w[GAP + flank], n, x)
    state[LIFT] = -1.0


@inner
def free_step(m, state, count, out, span):
    """Fly until a flank is met, the loose gear stops or breaks loose, or the step's end."""
    w = out.work
    guess = state[GUESS]
    state[GUESS] = inf
    reach, n = plan(m.rate[0], min(span, guess))
    flight(m, state, n, -1, w)
    reach = trusted(w[GAP], 1, n, reach)
    reach = trusted(w[GAP + 1], 1, n, reach)
    event, flank, x = _free_event(m, state, w, n, reach)
    departed = int(state[DEPARTED])
    state[HEIGHT] = max(state[HEIGHT], highest(w[GAP + departed], n, x))
    sample(m, state, count, out, x, n)
    carry(m, state, x, n, w)
    if event == FLIGHT_ENDS:
        state[GUESS] = -2.5 / min(curvature(w[GAP + flank], n, x), -1e-12)
        if m.stiffness > 0.0:
            press(m, state, flank)
        elif x == 0.0 and state[RATES + flank] > -1e-12:
            count[GRAZING] += 1
            touch_down(m, state, count, flank)
        else:
            impact(m, state, count, flank, out)
    elif event == PUSHES:
        state[MODE], state[HOLD] = PRESSED + flank, 1.0
    elif event == CLEARS:
        leave_spring(m, state, count, flank, out)
    else:
        _turn(m, state, event, w)


@inner
def _turn(m, state, event, w):
    if event == SPEED_TURNS:
        state[SPEED] = 0.0
        let_go(m, state, w)
    elif event == BREAKS_LOOSE:
        state[SPEED], state[SIGN] = 0.0, -1.0 if w[TORQUE, 0] > 0.0 else 1.0


@inner
def _free_event(m, state, w, n, reach):
    event, where, x = -1, 0, reach
    for flank in range(2):
        gap = w[GAP + flank]
        if m.stiffness > 0.0 and (gap[0] < 0.0 or (gap[0] == 0.0 and state[DEPARTED] == flank and gap[1] <= 0.0)):
            root = first_root(gap, -1.0, n, x)
            if root < x:
                event, where, x = CLEARS, flank, root
            for k in range(n):
                w[SCRATCH, k] = m.stiffness * gap[k] + m.damping * (k + 1) * gap[k + 1]
            if state[LIFT] == flank:
                w[SCRATCH, 0] = 0.0
            root = first_root(w[SCRATCH], 1.0, n - 1, x)
            if root < x:
                event, where, x = PUSHES, flank, root
        else:
            root = first_root(gap, 1.0, n, x)
            if root < x:
                event, where, x = FLIGHT_ENDS, flank, root
    if state[SIGN] != 0.0:
        root = first_root(w[OMEGA2], state[SIGN], n, x)
        if root < x:
            event, x = SPEED_TURNS, root
    else:
        root = _loose(w, n, x)
        if root < x:
            event, x = BREAKS_LOOSE, root
    return event, where, x


@inner
def _loose(w, n, reach):
    """When a gear at rest begins to move: where the pull first exceeds what dry friction bears."""
    first = inf
    for side in (-1.0, 1.0):
        for k in range(n + 1):
            w[SCRATCH, k] = w[DRY, k] + side * w[TORQUE, k]
        first = min(first, first_root(w[SCRATCH], 1.0, n, reach))
    return first


@inner
def contact_step(m, state, count, out, span):
    """Ride on a flank until its reaction changes sign, the loose gear's speed turns, or the step's end."""
    w = out.work
    flank = int(state[MODE]) - STUCK
    phase = 0 if state[SLIDE] == 1.0 else 1 + flank
    reach, n = plan(m.rate[0], span)
    sign = contact(m, state, flank, phase, n, w)
    reach = trusted(w[REACTION], 0, n - 2, reach)
    x, ends = reach, False
    if sign != 0.0:
        root = first_root(w[REACTION], 1.0, n - 2, x)
        if root < state[HOLD]:
            x = min(x, state[HOLD])
            root = inf
        elif root < x:
            x, ends = root, True
        root = first_root(w[OMEGA2], sign, n - 1, x)
        if root < x:
            x, ends = root, False
    state[HOLD] = 0.0
    state[SIGN] = sign
    sample(m, state, count, out, x, n)
    carry(m, state, x, n, w)
    if ends:
        _end_contact(m, state, count, out, flank)


@inner
def _end_contact(m, state, count, out, flank):
    """Leave the flank, unless the torques of flight press the gear back on it at once."""
    state[GAPS + flank] = 0.0
    state[RATES + flank] = 0.0
    if m.gated[flank]:
        phase = 1 + flank if state[SLIDE] == 1.0 else 0
        contact(m, state, flank, phase, 5, out.work)
        if out.work[REACTION, 0] > m.unfelt * m.inertia / m.radius_loose**2:
            state[SLIDE] = 1.0 - state[SLIDE]
            return
    close_contact(state, count, flank, out)
    take_off(m, state, flank, out.work)


@inner
def spring_step(m, state, count, out, span):
    """Press on a yielding flank until its force vanishes, the loose gear stops or breaks loose, or the step's end."""
    w = out.work
    flank = int(state[MODE]) - PRESSED
    reach, n = plan(m.rate[1], span)
    flight(m, state, n, flank, w)
    if state[HOLD] > 0.0:  # pressed on again: the force begins at zero
        w[REACTION, 0] = state[HOLD] = 0.0
    reach = trusted(w[GAP + flank], 1, n, reach)
    event, x = -1, reach
    root = first_root(w[REACTION], 1.0, n, x)
    if root < x:
        event, x = FLIGHT_ENDS, root
    root = first_root(w[OMEGA2], state[SIGN], n, x) if state[SIGN] != 0.0 else _loose(w, n, x)
    if root < x:
        event, x = (SPEED_TURNS if state[SIGN] != 0.0 else BREAKS_LOOSE), root
    state[IMPULSE] += impulse(m, w[GAP + flank], n, x)
    sample(m, state, count, out, x, n)
    carry(m, state, x, n, w)
    if event == FLIGHT_ENDS:
        passed = state[HEIGHT]
        take_off(m, state, flank, w)
        state[HEIGHT] = passed
        if m.damping == 0.0:
            leave_spring(m, state, count, flank, out)
    else:
        _turn(m, state, event, w)
        settle(m, state, count, flank, out)


@inner
def impulse(m, gap, n, x):
    """Return the integral of the flank's force over [0, x]."""
    total = 0.0
    for k in range(n, -1, -1):
        total = (total + gap[k] * INVERSE[k + 1]) * x
    return -m.stiffness * total - m.damping * (value(gap, n, x) - gap[0])
