"""The machine in motion: Runge-Kutta steps of fixed size, ended where a flank is reached or left, or the gear halts."""

from __future__ import annotations

import numpy as np

from gears3d.kernels import njit
from gears3d.verification.challenge.physics import (
    ACTIVE,
    FREE,
    REVERSE,
    accelerate,
    coupled,
    drive,
    dry_torque,
    flank,
    gap,
    push,
    restitution,
    smooth_torque,
)

TOUCH = 1e-13  # Overlap that rounding makes [m]
ROUNDING = 1e-15  # What rounding leaves of an angle, as a share of it
FAR = 4.0  # Gaps further than so many times what the gear moves within a step are not closed in it
# What the state holds; the second body's angle and speed are there whether or not there is one
TIME, THETA, OMEGA, MODE, THETA2, OMEGA2, COUNT = range(7)


@njit(cache=True)
def _advance(m, y, h, direction, pressed):
    """One step of Runge and Kutta, fourth order, of angles and speeds; ``y`` stays."""
    t, a, va, b, vb = y[TIME], y[THETA], y[OMEGA], y[THETA2], y[OMEGA2]
    p1, q1 = accelerate(m, t, a, va, b, vb, direction, pressed)
    k = 0.5 * h
    va2, vb2 = va + k * p1, vb + k * q1
    p2, q2 = accelerate(m, t + k, a + k * va, va2, b + k * vb, vb2, direction, pressed)
    va3, vb3 = va + k * p2, vb + k * q2
    p3, q3 = accelerate(m, t + k, a + k * va2, va3, b + k * vb2, vb3, direction, pressed)
    va4, vb4 = va + h * p3, vb + h * q3
    p4, q4 = accelerate(m, t + h, a + h * va3, va4, b + h * vb3, vb4, direction, pressed)
    end = y.copy()
    end[TIME] = t + h
    end[THETA] = a + h * (va + 2.0 * va2 + 2.0 * va3 + va4) / 6.0
    end[OMEGA] = va + h * (p1 + 2.0 * p2 + 2.0 * p3 + p4) / 6.0
    end[THETA2] = b + h * (vb + 2.0 * vb2 + 2.0 * vb3 + vb4) / 6.0
    end[OMEGA2] = vb + h * (q1 + 2.0 * q2 + 2.0 * q3 + q4) / 6.0
    return end


@njit(cache=True)
def _measure(m, y, what):
    """What must not change sign within a step: both gaps, their rates, the gear's speed."""
    if what == 4:
        return y[OMEGA]
    apart, rate, _, _ = gap(m, what % 2, y[TIME], y[THETA], y[OMEGA])
    return apart if what < 2 else rate


@njit(cache=True)
def _first(m, y, direction, pressed, what, low, high):
    """When ``what`` passes zero between ``low`` and ``high``: bisection sharpened by secants."""
    f_low, f_high = (
        _measure(m, _advance(m, y, low, direction, pressed), what),
        _measure(m, _advance(m, y, high, direction, pressed), what),
    )
    for i in range(80):
        if high - low < 1e-16 or f_high == f_low:
            break
        middle = 0.5 * (low + high) if i % 3 == 2 else low - f_low * (high - low) / (f_high - f_low)
        middle = min(max(middle, low), high)
        f = _measure(m, _advance(m, y, middle, direction, pressed), what)
        if (f > 0.0) == (f_high > 0.0):
            high, f_high = middle, f
        else:
            low, f_low = middle, f
    return high


@njit(cache=True)
def _hit(m, y, end, direction, pressed, h, side):
    """When a flank is reached within a step of flight: from 0 to h, or -1 when it is not."""
    if side == pressed:
        return -1.0
    apart1, rate1, _, _ = gap(m, side, end[TIME], end[THETA], end[OMEGA])
    if apart1 >= -TOUCH and (rate1 <= 0.0 or apart1 > FAR * rate1 * h):
        return -1.0  # it is still closing, or was never near
    apart0, rate0, _, _ = gap(m, side, y[TIME], y[THETA], y[OMEGA])
    dip = apart1 >= -TOUCH and rate0 < 0.0 < rate1 and apart0 < -rate0 * h
    if apart1 >= -TOUCH and not dip:
        return -1.0
    low, high = 0.0, h
    if dip:
        high = _first(m, y, direction, pressed, 2 + side, 0.0, h)
        if _measure(m, _advance(m, y, high, direction, pressed), side) >= -TOUCH:
            return -1.0
    elif rate0 > 0.0 and rate1 < 0.0:
        low = _first(m, y, direction, pressed, 2 + side, 0.0, h)
    if _measure(m, _advance(m, y, low, direction, pressed), side) <= 0.0:
        return low
    return _first(m, y, direction, pressed, side, low, high)


@njit(cache=True)
def _follow(m, y, side, t):
    """The state of a gear that rides on a flank at time ``t``, its acceleration and the pair of teeth."""
    th1, w1, a1 = drive(m, t)
    sign = 1.0 if side == ACTIVE else -1.0
    th2 = y[THETA] + (t - y[TIME]) * y[OMEGA]
    for _ in range(50):
        s, d1, d2, d11, d22, which = flank(m, side, t, th1, th2)
        step = (m.rb2 * th2 - m.rb1 * th1 - s - sign * m.film[5]) / (m.rb2 - d2)
        th2 -= step
        if abs(step) <= ROUNDING * (1.0 + abs(th2)):
            break
    end = y.copy()
    end[TIME], end[THETA] = t, th2
    end[OMEGA] = (m.rb1 + d1) * w1 / (m.rb2 - d2)
    a2 = ((m.rb1 + d1) * a1 + d11 * w1 * w1 + d22 * end[OMEGA] ** 2) / (m.rb2 - d2)
    if m.second[0] > 0.0:
        _drag_along(m, y, end)
    return end, a2, which


@njit(cache=True)
def _drag_along(m, y, end):
    """Put the second body into ``end``, carried from ``y`` by a gear whose motion is known at both ends."""
    h = end[TIME] - y[TIME]
    half = 0.5 * (y[THETA] + end[THETA]) + 0.125 * h * (y[OMEGA] - end[OMEGA])
    middle = 1.5 * (end[THETA] - y[THETA]) / h - 0.25 * (y[OMEGA] + end[OMEGA]) if h > 0.0 else y[OMEGA]
    b, v = y[THETA2], y[OMEGA2]
    q1 = -coupled(m, y[THETA], y[OMEGA], b, v) / m.second[0]
    q2 = -coupled(m, half, middle, b + 0.5 * h * v, v + 0.5 * h * q1) / m.second[0]
    q3 = -coupled(m, half, middle, b + 0.5 * h * (v + 0.5 * h * q1), v + 0.5 * h * q2) / m.second[0]
    q4 = -coupled(m, end[THETA], end[OMEGA], b + h * (v + 0.5 * h * q2), v + h * q3) / m.second[0]
    end[THETA2] = b + h * v + h * h * (q1 + q2 + q3) / 6.0
    end[OMEGA2] = v + h * (q1 + 2.0 * q2 + 2.0 * q3 + q4) / 6.0


@njit(cache=True)
def _holds(m, y, side, a2):
    """How hard the flank presses, as a torque > 0; where only torques of contact part them, how it closes."""
    t, th2, w2 = y[TIME], y[THETA], y[OMEGA]
    sign = 1.0 if side == ACTIVE else -1.0
    dry = dry_torque(m, t, w2)
    others = m.inertia * a2 - coupled(m, th2, w2, y[THETA2], y[OMEGA2])
    if m.film[0] > 0.0 or m.film[1] > 0.0:
        for other in (ACTIVE, REVERSE):
            _, film, lever = push(m, other, t, th2, w2, False)
            others -= lever * film
    if w2 == 0.0:
        free = others + smooth_torque(m, t, th2, w2, True)
        return max(sign * free + dry, 0.0) if abs(free) <= dry else sign * free - dry
    dry = dry if w2 > 0.0 else -dry
    pressing = sign * (others + smooth_torque(m, t, th2, w2, True) + dry)
    return max(pressing, sign * (others + smooth_torque(m, t, th2, w2, False) + dry))


@njit(cache=True)
def _note(line, time, side, v, back, impulse):
    line[0], line[1], line[2], line[3], line[4] = time, side, v, back, impulse


@njit(cache=True)
def _strike(m, y, side, normals, hits):
    """An impact: Newton's law on the relative speed, one line of ``hits``; then in flight, or at rest on the flank."""
    _, v, lever, _ = gap(m, side, y[TIME], y[THETA], y[OMEGA])
    v = min(v, 0.0)
    count = int(y[COUNT])
    back = -v * restitution(m, side, y[THETA], v, normals[count % len(normals)])
    stays = back < m.impact[4]
    back = 0.0 if stays else back
    jump = (back - v) / lever
    y[OMEGA] += jump
    y[MODE] = side if stays else FREE
    if v < -1e-9:
        if count < len(hits):
            sign = 1.0 if side == ACTIVE else -1.0
            share = 1.0 - sign * m.friction * np.sign(y[OMEGA])
            _note(hits[count], y[TIME], side, sign * v, sign * back, m.inertia * jump / (m.rb2 * share))
        y[COUNT] += 1


@njit(cache=True)
def _fly(m, y, h, normals, hits):
    """Flight for ``h`` at most; returns the remainder."""
    direction, pressed = np.sign(y[OMEGA]), FREE
    if m.spring[0] > 0.0:
        for side in (ACTIVE, REVERSE):
            if gap(m, side, y[TIME], y[THETA], y[OMEGA])[0] <= 0.0:
                pressed = side
    if direction == 0.0:
        a = accelerate(m, y[TIME], y[THETA], 0.0, y[THETA2], y[OMEGA2], 0.0, pressed)[0]
        direction = np.sign(a)
    step = h
    if m.film[0] > 0.0 or m.film[1] > 0.0:
        for side in (ACTIVE, REVERSE):
            apart, rate, _, _ = gap(m, side, y[TIME], y[THETA], y[OMEGA])
            step = min(step, 0.05 * (max(apart, 0.0) + m.film[5]) / max(abs(rate), 1e-6))
    end = _advance(m, y, step, direction, pressed)
    if direction != 0.0 and end[OMEGA] * direction < 0.0 and y[OMEGA] != 0.0:
        step = _first(m, y, direction, pressed, 4, 0.0, step)
        end = _advance(m, y, step, direction, pressed)
        end[OMEGA] = 0.0
    rigid = m.spring[0] == 0.0
    struck, when = -1, step
    for side in (ACTIVE, REVERSE):
        hit = _hit(m, y, end, direction, pressed, step, side)
        if 0.0 <= hit <= when and (rigid or hit > 0.0):
            struck, when = side, hit
    if struck >= 0:
        end = _advance(m, y, when, direction, pressed)
    y[:] = end
    if struck >= 0 and rigid:
        _strike(m, y, struck, normals, hits)
    elif struck >= 0:
        _touch(m, y, struck, hits)
    return h - when if struck >= 0 else h - step


@njit(cache=True)
def _touch(m, y, side, hits):
    """Note where a compliant flank is touched, and step over the edge of the gap."""
    _, v, lever, _ = gap(m, side, y[TIME], y[THETA], y[OMEGA])
    count = int(y[COUNT])
    if count < len(hits):
        _note(hits[count], y[TIME], side, v if side == ACTIVE else -v, np.nan, np.nan)
    y[COUNT] += 1
    y[THETA] -= 2.0 * TOUCH / lever


@njit(cache=True)
def _ride(m, y, h, normals, hits):
    """Contact for ``h`` at most; returns the remainder."""
    side = int(y[MODE])
    start, a2, pair = _follow(m, y, side, y[TIME])
    if _holds(m, start, side, a2) <= 0.0:
        y[:] = start
        y[MODE] = FREE
        left = _fly(m, y, h, normals, hits)
        if left < h:
            return left
        y[:] = _follow(m, start, side, start[TIME] + h)[0]
        y[MODE] = side
        return 0.0
    low, high = 0.0, h
    end, a2, which = _follow(m, start, side, y[TIME] + h)
    if which == pair and _holds(m, end, side, a2) > 0.0:
        y[:] = end
        return 0.0
    begin = y[TIME]
    while high - low > 1e-14:
        middle = 0.5 * (low + high)
        end, a2, which = _follow(m, start, side, begin + middle)
        if which == pair and _holds(m, end, side, a2) > 0.0:
            low = middle
        else:
            high = middle
    last, a2, _ = _follow(m, start, side, begin + low)
    end, a2, which = _follow(m, start, side, begin + high)
    y[:] = end
    if which != pair:
        y[OMEGA] = last[OMEGA]
        _strike(m, y, side, normals, hits)
    else:
        y[MODE] = FREE
    return h - high


@njit(cache=True)
def run(m, y, start, step, times, substeps, normals, angle, speed, hits):
    """Carry the state over ``len(angle)`` samples from ``start`` on.

    Shapes: ``angle`` (n,); ``speed`` (n,).
    """
    for i in range(len(angle)):
        angle[i], speed[i] = y[THETA], y[OMEGA]
        for j in range(substeps):
            until = times + (start + i + (j + 1.0) / substeps) * step
            left, turns = until - y[TIME], 0
            while left > 1e-15 and turns < 100000:
                left = _fly(m, y, left, normals, hits) if y[MODE] == FREE else _ride(m, y, left, normals, hits)
                turns += 1
            y[TIME] = until
