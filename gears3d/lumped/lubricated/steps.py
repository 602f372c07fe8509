"""The steps: Dormand & Prince of order 5, cut where a law changes, with accounts of energy and of impacts.

The films are smooth between these places, and explicit steps suffice: the squeeze slows a gap of 1 µm of gear oil with
some 10³/s, far below the 10⁴/s of the teeth. Nothing here is stiff before hmin and viscosity change by decades.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from gears3d.kernels import njit
from gears3d.lumped.compile import borrowed, inner
from gears3d.lumped.lubricated import layout as at
from gears3d.lumped.lubricated.forces import act, drive, gaps, parts
from gears3d.lumped.lubricated.passages import note

whole: Any = njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[call-overload]
LEAST_STEP = 1e-14
"""Of time [s]; below it the motion stands still."""
LOBATTO = 0.2763932022500210
"""First inner point of the quadrature with four points, (1 − 1/√5)/2."""


@inner
def _between(state, end_place, end_rate, end_change, h, u):
    """Return place and rate at the share u of a step, by the quintic through both ends."""
    s0, v0, a0 = state[at.PLACE], state[at.RATE] * h, state[at.CHANGE] * h * h
    v1, a1 = end_rate * h, end_change * h * h
    rest = end_place - s0 - v0 - 0.5 * a0
    slope = v1 - v0 - a0
    bend = a1 - a0
    c3 = 10.0 * rest - 4.0 * slope + 0.5 * bend
    c4 = -15.0 * rest + 7.0 * slope - bend
    c5 = 6.0 * rest - 3.0 * slope + 0.5 * bend
    place = s0 + u * (v0 + u * (0.5 * a0 + u * (c3 + u * (c4 + u * c5))))
    rate = v0 + u * (a0 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))
    return place, rate / h


@inner
def _event(p, sines, waves, t, s, v, which):
    """Return the function whose sign is the flag ``which``, positive where the flag is 0."""
    gap0, rate0, gap1, rate1 = s, v, p[at.BACKLASH] - s, -v
    if len(waves) > 0:
        angle, speed, _ = drive(p, sines, t)
        gap0, rate0, gap1, rate1 = gaps(p, waves, angle, speed, s, v)
    gap, rate = (gap0, rate0) if which % 2 == 0 else (gap1, rate1)
    if which < at.INSIDE:
        return rate
    return gap - (p[at.THRESHOLD] if which < at.NEAR else p[at.FELT])


@inner
def set_flags(p, sines, waves, flags, t, s, v):
    """Set all flags to what a state has."""
    for which in range(at.FLAGS):
        flags[which] = 1 if _event(p, sines, waves, t, s, v, which) < 0.0 else 0
    if len(waves) == 0:
        flags[at.APPROACHING + 1] = 1 - flags[at.APPROACHING]


@inner
def _first_event(p, sines, waves, flags, held, state, end, h):
    """Return the share of a step at which the first flag changes, and which; beyond 1 if none does.

    Flags that have changed at this very instant are held: a gear at rest would change them for ever.
    """
    first, found = 2.0, -1
    for which in range(at.FLAGS):
        if which == 1 and len(waves) == 0:  # one gap grows as the other one falls
            continue
        sign = -1.0 if flags[which] == 1 else 1.0
        last = sign * _event(p, sines, waves, state[at.TIME] + h, end[0], end[1], which)
        high = 1.0
        if last >= 0.0:
            if which >= at.INSIDE:  # between two turns of the rate a gap passes a height once
                continue
            high = 0.0
            for k in range(1, 4):
                s, v = _between(state, end[0], end[1], end[2], h, 0.25 * k)
                if sign * _event(p, sines, waves, state[at.TIME] + 0.25 * k * h, s, v, which) < 0.0:
                    high = 0.25 * k
                    break
            if high == 0.0:
                continue
        low, begin = 0.0, sign * _event(p, sines, waves, state[at.TIME], state[at.PLACE], state[at.RATE], which)
        if begin <= 0.0:  # the other flank's flag of the same turn
            if held[which] == 1:
                continue
            return 0.0, which
        s, v = _between(state, end[0], end[1], end[2], h, high)
        last = sign * _event(p, sines, waves, state[at.TIME] + high * h, s, v, which)
        side = 0
        for _ in range(60):
            if high - low < 1e-12:
                break
            u = 0.5 * (low + high)
            if begin > 0.0 and begin != last:
                u = (begin * high - last * low) / (begin - last)
            s, v = _between(state, end[0], end[1], end[2], h, u)
            value = sign * _event(p, sines, waves, state[at.TIME] + u * h, s, v, which)
            if value < 0.0:
                high, last = u, value
                if side == -1:
                    begin *= 0.5
                side = -1
            else:
                low, begin = u, value
                if side == 1:
                    last *= 0.5
                side = 1
        if high < first:
            first, found = high, which
    return first, found


@inner
def _account(p, sines, waves, powers, table, flags, state, end, h, share, out):
    """Add the works of the first ``share`` of a step, and the square of the rate of the mesh force over it."""
    weights = (1.0 / 12.0, 5.0 / 12.0, 5.0 / 12.0, 1.0 / 12.0)
    points = (0.0, LOBATTO, 1.0 - LOBATTO, 1.0)
    span = share * h
    for k in range(4):
        u = share * points[k]
        s, v = _between(state, end[0], end[1], end[2], h, u)
        act(p, sines, waves, powers, table, flags, state[at.TIME] + u * h, s, v, out)
        for j in range(8):
            state[at.BOOKS + j] += weights[k] * span * out[at.POWER + j]
        force = out[at.ACTIVE_FORCE] - out[at.REVERSE_FORCE]
        if k > 0 and span > 0.0:
            passed = (points[k] - points[k - 1]) * span
            state[at.JERK] += (force - state[at.FORCE]) ** 2 / passed
            state[at.RISING] += passed
        state[at.FORCE] = force


@inner
def _step(p, sines, waves, powers, table, flags, state, h, end):
    """Try one step and return its two errors; ``end`` becomes place, rate, acceleration and the lesser gap there."""
    t, s, v, a1 = state[at.TIME], state[at.PLACE], state[at.RATE], state[at.CHANGE]
    d2, d3 = drive(p, sines, t + 0.2 * h), drive(p, sines, t + 0.3 * h)
    d4, d5, d6 = drive(p, sines, t + 0.8 * h), drive(p, sines, t + 8 / 9 * h), drive(p, sines, t + h)
    v1 = v
    v2 = v + h * 0.2 * a1
    a2 = parts(p, waves, powers, table, flags, d2, s + h * 0.2 * v1, v2)[0]
    v3 = v + h * (3 / 40 * a1 + 9 / 40 * a2)
    a3 = parts(p, waves, powers, table, flags, d3, s + h * (3 / 40 * v1 + 9 / 40 * v2), v3)[0]
    v4 = v + h * (44 / 45 * a1 - 56 / 15 * a2 + 32 / 9 * a3)
    s4 = s + h * (44 / 45 * v1 - 56 / 15 * v2 + 32 / 9 * v3)
    a4 = parts(p, waves, powers, table, flags, d4, s4, v4)[0]
    v5 = v + h * (19372 / 6561 * a1 - 25360 / 2187 * a2 + 64448 / 6561 * a3 - 212 / 729 * a4)
    s5 = s + h * (19372 / 6561 * v1 - 25360 / 2187 * v2 + 64448 / 6561 * v3 - 212 / 729 * v4)
    a5 = parts(p, waves, powers, table, flags, d5, s5, v5)[0]
    v6 = v + h * (9017 / 3168 * a1 - 355 / 33 * a2 + 46732 / 5247 * a3 + 49 / 176 * a4 - 5103 / 18656 * a5)
    s6 = s + h * (9017 / 3168 * v1 - 355 / 33 * v2 + 46732 / 5247 * v3 + 49 / 176 * v4 - 5103 / 18656 * v5)
    a6 = parts(p, waves, powers, table, flags, d6, s6, v6)[0]
    v7 = v + h * (35 / 384 * a1 + 500 / 1113 * a3 + 125 / 192 * a4 - 2187 / 6784 * a5 + 11 / 84 * a6)
    s7 = s + h * (35 / 384 * v1 + 500 / 1113 * v3 + 125 / 192 * v4 - 2187 / 6784 * v5 + 11 / 84 * v6)
    last = parts(p, waves, powers, table, flags, d6, s7, v7)
    a7 = last[0]
    end[0], end[1], end[2], end[3] = s7, v7, a7, min(last[3], last[5])
    e1, e3, e4 = 71 / 57600, -71 / 16695, 71 / 1920
    e5, e6, e7 = -17253 / 339200, 22 / 525, -1 / 40
    off_place = h * (e1 * v1 + e3 * v3 + e4 * v4 + e5 * v5 + e6 * v6 + e7 * v7)
    off_rate = h * (e1 * a1 + e3 * a3 + e4 * a4 + e5 * a5 + e6 * a6 + e7 * a7)
    return off_place, off_rate


@inner
def _sample(p, sines, waves, powers, table, flags, state, end, h, share, spacing, samples, count, out):
    """Write the samples that fall into the first ``share`` of a step."""
    while count[at.SAMPLES] < len(samples):
        t = count[at.SAMPLES] * spacing
        if t > state[at.TIME] + share * h:
            return
        s, v = _between(state, end[0], end[1], end[2], h, max((t - state[at.TIME]) / h, 0.0))
        act(p, sines, waves, powers, table, flags, t, s, v, out)
        row = samples[count[at.SAMPLES]]
        row[0], row[1], row[2], row[3], row[4] = t, s, v, out[at.ACTIVE_FORCE], out[at.REVERSE_FORCE]
        count[at.SAMPLES] += 1


@inner
def _happen(p, sines, waves, powers, table, flags, count, held, state, end, h, share, which, out, impacts, contacts):
    """Put the state to the event within a step, and note what happens there."""
    place, rate = _between(state, end[0], end[1], end[2], h, share)
    before = state[at.TIME]
    state[at.TIME] += share * h
    if state[at.TIME] > before:
        held[:] = 0
    held[which] = 1
    state[at.PLACE], state[at.RATE] = place, rate
    flags[which] = 1 - flags[which]
    both = which == 0 and len(waves) == 0
    if both:
        flags[1] = 1 - flags[0]
    count[at.EVENTS] += 1
    state[at.CHANGE] = act(p, sines, waves, powers, table, flags, state[at.TIME], place, rate, out)
    note(p, state, flags, count, which, out, impacts, contacts)
    if both:
        note(p, state, flags, count, 1, out, impacts, contacts)
    if which >= at.INSIDE and which < at.NEAR and flags[which] == 1:
        state[at.STEP] = min(h, sqrt(p[at.MASS] / table[0, at.STIFFNESS]) * 0.1)


@whole
def advance(p, sines, waves, powers, table, state, flags, count, until, control, samples, impacts, contacts):
    """Move a state on to a time.

    Args:
        p: numbers of the model.
        sines: of the drive, (n, 4).
        waves: of the flanks, (n, 5).
        powers: drag torques as powers of the speed, (n, 2).
        table: over one pitch, (n, 6).
        state: moved on.
        flags: moved on.
        count: moved on.
        until: time [s].
        control: relative tolerance, largest step [s], distance of samples [s], whether books are kept.
        samples: time, displacement, velocity and both forces, filled from ``count`` on.
        impacts: filled, as :func:`gears3d.lumped.lubricated.passages.note` does.
        contacts: filled.

    Returns:
        DONE, FULL (a table), BROKEN (not finite) or STANDSTILL.
    """
    parts, ends, once = np.zeros(at.PARTS), np.zeros(4), np.zeros(at.FLAGS, dtype=np.int64)
    out, end, held = borrowed(parts), borrowed(ends), borrowed(once)
    p, sines, waves, powers = borrowed(p), borrowed(sines), borrowed(waves), borrowed(powers)
    table, state, flags, count = borrowed(table), borrowed(state), borrowed(flags), borrowed(count)
    samples, impacts, contacts = borrowed(samples), borrowed(impacts), borrowed(contacts)
    rtol, longest, spacing, books = control[0], control[1], control[2], control[3] != 0.0
    if state[at.STEP] <= 0.0:
        set_flags(p, sines, waves, flags, state[at.TIME], state[at.PLACE], state[at.RATE])
        state[at.STEP] = min(1e-6, longest)
    state[at.CHANGE] = act(p, sines, waves, powers, table, flags, state[at.TIME], state[at.PLACE], state[at.RATE], out)
    while state[at.TIME] < until:
        if count[at.IMPACTS] >= len(impacts) or count[at.CONTACTS] >= len(contacts):
            return at.FULL
        h = min(state[at.STEP], longest)
        last = state[at.TIME] + h >= until
        if last:
            h = until - state[at.TIME]
        off_place, off_rate = _step(p, sines, waves, powers, table, flags, state, h, end)
        narrow = max(end[3], p[at.FLOOR])
        speed = abs(end[1]) + 1e-3
        error = max(abs(off_place) / (rtol * narrow), abs(off_rate) / (rtol * speed))
        if not error <= 1e30:
            if h < LEAST_STEP:
                return at.BROKEN
            state[at.STEP] = 0.1 * h
            count[at.REJECTED] += 1
            continue
        factor = 0.9 * error ** (-0.2) if error > 1e-10 else 5.0
        if error > 1.0:
            state[at.STEP] = h * max(factor, 0.2)
            count[at.REJECTED] += 1
            if state[at.STEP] < LEAST_STEP:
                return at.STANDSTILL
            continue
        count[at.STEPS] += 1
        share, which = _first_event(p, sines, waves, flags, held, state, end, h)
        passed = min(share, 1.0)
        if books:
            _account(p, sines, waves, powers, table, flags, state, end, h, passed, out)
        if spacing > 0.0:
            _sample(p, sines, waves, powers, table, flags, state, end, h, passed, spacing, samples, count, out)
        if which >= 0:
            _happen(
                p, sines, waves, powers, table, flags, count, held, state, end, h, share, which, out, impacts, contacts
            )
        else:
            held[:] = 0
            state[at.TIME] = until if last else state[at.TIME] + h
            state[at.PLACE], state[at.RATE], state[at.CHANGE] = end[0], end[1], end[2]
            if not last:
                state[at.STEP] = h * min(factor, 5.0)
    parts[0] = ends[0] = once[0] = 0  # kept alive to here
    return at.DONE
