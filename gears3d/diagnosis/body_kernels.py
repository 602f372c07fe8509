"""Kernels of windows in which the loose gear carries a body on a torsional spring, and small changes along their runs.

Impacts act on the gear alone; the body keeps its speed, and its twist against the gear changes. In contact the body
hangs on a gear that moves with its flank. Source of changes at impacts: Leine and Nijmeijer 2004, Dynamics and
Bifurcations of Non-Smooth Mechanical Systems, ch. 7.
"""

from __future__ import annotations

import numpy as np

from gears3d.diagnosis.shooting_kernels import BOUNCES, LEAVES, SETTLES, _at, _bent, _slowed
from gears3d.kernels import njit
from gears3d.lumped.compile import tight

Array = np.ndarray
# Radians of the fastest oscillation in a step at most: a phase error of 4e-4 rad a period.
PHASE = 0.3


@tight
def _pull(body: Array, d: float, w: float) -> float:
    """Return the torque of the spring on the loose gear [N m]."""
    if body[3] == 0.0:
        return body[1] * d + body[2] * w
    size = abs(d) - body[3]
    if size <= 0.0:
        return 0.0
    sign = 1.0 if d > 0.0 else -1.0
    return sign * max(body[1] * size + body[2] * sign * w, 0.0)


@tight
def _finest(body: Array, per: float) -> float:
    """Return the longest step [s]; the inverse of the inertia that oscillates is given."""
    return PHASE / max(np.sqrt(body[1] * per), body[2] * per, 1e-12)


@tight
def _swung(
    h: float, s: float, v: float, d: float, w: float, p: float, jerk: float, q: float, slip: float, lever: float,
    per: float, body: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return place, rate, twist and its rate after a Runge-Kutta step.

    The gear is accelerated by p, which changes at a rate, besides its spring; q is that of the twist, backwards.
    """
    pull, m = _pull(body, d, w), 0.5 * h
    a1, b1 = p + lever * pull, -q - per * pull
    v2, w2 = v + m * a1, w + m * b1
    pull = _pull(body, d + m * w, w2)
    a2, b2 = p + m * jerk + lever * pull, -q - m * slip - per * pull
    v3, w3 = v + m * a2, w + m * b2
    pull = _pull(body, d + m * w2, w3)
    a3, b3 = p + m * jerk + lever * pull, -q - m * slip - per * pull
    v4, w4 = v + h * a3, w + h * b3
    pull = _pull(body, d + h * w3, w4)
    a4, b4 = p + h * jerk + lever * pull, -q - h * slip - per * pull
    return (
        s + h * (v + 2.0 * v2 + 2.0 * v3 + v4) / 6.0,
        v + h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0,
        d + h * (w + 2.0 * w2 + 2.0 * w3 + w4) / 6.0,
        w + h * (b1 + 2.0 * b2 + 2.0 * b3 + b4) / 6.0,
    )


@tight
def _falls(
    t: float, f: float, rest: float, i: int, angle: Array, speed: Array, rate: Array, about: Array, ahead: float,
    torques: Array, pulled: float, s: float, v: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return, for the rest of a step in flight, acceleration without the spring and its rate, of path and of twist."""
    r1, r2, lever = about[0], about[1], about[2]
    q = _slowed(
        t, ahead + (s + r1 * (angle[i] + f * (angle[i + 1] - angle[i]))) / r2,
        (v + r1 * (speed[i] + f * (speed[i + 1] - speed[i]))) / r2, 0, torques, lever,
    )  # fmt: skip
    p = q - r1 * (rate[i] + f * (rate[i + 1] - rate[i]))
    a = p + pulled
    s1, v1 = s + v * rest + 0.5 * a * rest**2, v + a * rest
    end = _slowed(t + rest, ahead + (s1 + r1 * angle[i + 1]) / r2, (v1 + r1 * speed[i + 1]) / r2, 0, torques, lever)
    return p, (end - r1 * rate[i + 1] - p) / rest, q / r2, (end - q) / rest / r2


@tight
def _rests(
    t: float, last: float, step: float, i: int, angle: Array, speed: Array, rate: Array, own: Array, sign: float,
    mode: int, about: Array, ahead: float, torques: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return, for a step in contact, what would part the gear from its flank, the flank's turn, and their changes."""
    r1, r2, lever = about[0], about[1], about[2]
    bend, bent = _bent(own, i, step), _bent(own, i + 1, step)
    lean, (place, leans) = _at(own, i, 0.0, step)[1], _at(own, i, 1.0, step)
    p = _slowed(t, ahead + (own[i] + r1 * angle[i]) / r2, (lean + r1 * speed[i]) / r2, mode, torques, lever)
    p = sign * (p - r1 * rate[i] - bend)
    jerk = _slowed(
        last, ahead + (place + r1 * angle[i + 1]) / r2, (leans + r1 * speed[i + 1]) / r2, mode, torques, lever
    )
    jerk = sign * (jerk - r1 * rate[i + 1] - bent) - p
    q = (bend + r1 * rate[i]) / r2
    return p, jerk, q, (bent + r1 * rate[i + 1]) / r2 - q


@tight
def _meets(
    own: Array, sign: float, i: int, f: float, step: float, h: float, s: float, v: float, d: float, w: float,
    now: float, jerk: float, back: float, slip: float, lever: float, free: float, body: Array,
) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
    """Return when the gear meets a flank, the flank's place and rate there, and the state."""
    before, after, m = 0.0, h, h
    for _ in range(50):  # Newton steps, bisection where they leave the bracket
        here, lean = _at(own, i, f + m / step, step)
        s1, v1, _, _ = _swung(m, s, v, d, w, now, jerk, back, slip, lever, free, body)
        off, slope = sign * (s1 - here), sign * (v1 - lean)
        before, after = (m, after) if off >= 0.0 else (before, m)
        way = off / slope if slope != 0.0 else h
        if after - before < 1e-13 * h or abs(way) < 1e-14 * h:
            break
        m = m - way if before < m - way < after else 0.5 * (before + after)
    here, lean = _at(own, i, f + m / step, step)
    s1, v1, d1, w1 = _swung(m, s, v, d, w, now, jerk, back, slip, lever, free, body)
    return m, here, lean, s1, v1, d1, w1


@tight
def _window(
    begin: float, step: float, angle: Array, speed: Array, rate: Array, active: Array, reverse: Array, about: Array,
    ahead: float, torques: Array, laws: Array, body: Array, kicks: Array, s: float, v: float, d: float, w: float,
    mode: int, path: Array, pace: Array, twist: Array, events: Array,
) -> int:  # fmt: skip
    """Integrate one window, interrupted at impacts and contact losses; events as without a body."""
    r2, lever = about[1], about[2]
    free = lever / r2 + 1.0 / body[0]
    finest, hung = _finest(body, free), _finest(body, 1.0 / body[0])
    nodes, count, struck = len(angle), 0, 0
    for i in range(nodes):
        path[i], pace[i], twist[i] = s, v, d
        if i == nodes - 1:
            break
        rest, known, since = step, -1, 0.0
        p, jerk, q, slip = 0.0, 0.0, 0.0, 0.0
        for _ in range(2000):
            f = 1.0 - rest / step
            if mode == 0:
                if known != 0:
                    known, since = 0, 0.0
                    p, jerk, q, slip = _falls(
                        begin + (i + f) * step, f, rest, i, angle, speed, rate, about, ahead, torques,
                        lever * _pull(body, d, w), s, v,
                    )  # fmt: skip
                h = min(rest, finest)
                h = rest if rest - h < 0.1 * h else h
                now, back = p + since * jerk, q + since * slip
                s1, v1, d1, w1 = _swung(h, s, v, d, w, now, jerk, back, slip, lever, free, body)
                g = f + h / step
                if h == rest:
                    low, high = active[i + 1], reverse[i + 1]
                else:
                    low, high = _at(active, i, g, step)[0], _at(reverse, i, g, step)[0]
                if low <= s1 <= high:
                    s, v, d, w = s1, v1, d1, w1
                    rest -= h
                    since += h
                    if rest <= 1e-12 * step:
                        break
                    continue
                own, sign, mode = (active, 1.0, 1) if s1 < low else (reverse, -1.0, 2)
                known = -1
                m, here, lean, s1, v1, d1, w1 = _meets(
                    own, sign, i, f, step, h, s, v, d, w, now, jerk, back, slip, lever, free, body
                )
                hits = v1 - lean
                e = laws[0] + laws[1] * abs(hits) + 0.5 * sign * laws[2]
                if struck < len(kicks):
                    e += kicks[struck]
                struck += 1
                e = min(max(e, 0.0), 1.0)
                bend = 0.5 * (_bent(own, i, step) + _bent(own, i + 1, step))
                a = now + m * jerk + lever * _pull(body, d1, w1) - bend
                w2 = w1 + (1.0 + e) * hits / r2
                closing = -sign * (now + m * jerk + lever * _pull(body, d1, w2) - bend)
                rise, what = e * abs(hits), SETTLES
                if rise > 0.0 and (closing <= 0.0 or 2.0 * rise / (closing * (1.0 - min(e, 0.98))) > 0.5 * step):
                    mode, what = 0, BOUNCES  # otherwise all its bounces end within half a step
                else:
                    e = 0.0
                s, v, d, w, rest = here, lean - e * hits, d1, w1 + (1.0 + e) * hits / r2, rest - m
                if count < len(events):
                    events[count, 0], events[count, 1], events[count, 2] = i, 1.0 - rest / step, what
                    events[count, 3], events[count, 4], events[count, 5], events[count, 6] = sign, hits, e, a
                    count += 1
            else:
                own, sign = (active, 1.0) if mode == 1 else (reverse, -1.0)
                if known != mode:
                    known = mode
                    p, jerk, q, slip = _rests(
                        begin + (i + f) * step, begin + (i + 1) * step, step, i, angle, speed, rate, own, sign, mode,
                        about, ahead, torques,
                    )  # fmt: skip
                h = min(rest, hung)
                h = rest if rest - h < 0.1 * h else h
                first = p + f * jerk + sign * lever * _pull(body, d, w)
                m = 0.0
                if first <= 0.0:
                    back = q + f * slip
                    _, _, d1, w1 = _swung(h, 0.0, 0.0, d, w, 0.0, 0.0, back, slip / step, 0.0, 1.0 / body[0], body)
                    last = p + (f + h / step) * jerk + sign * lever * _pull(body, d1, w1)
                    if last <= 0.0:
                        d, w = d1, w1
                        rest -= h
                        if rest <= 1e-12 * step:
                            s, v = _at(own, i, 1.0, step)
                            break
                        continue
                    m = h * first / (first - last)
                    _, _, d, w = _swung(m, 0.0, 0.0, d, w, 0.0, 0.0, back, slip / step, 0.0, 1.0 / body[0], body)
                (s, v), mode = _at(own, i, f + m / step, step), 0
                rest -= m
                if count < len(events):
                    events[count, 0], events[count, 1] = i, 1.0 - rest / step
                    events[count, 2], events[count, 3] = LEAVES, sign
                    count += 1
            if rest <= 1e-12 * step:
                break
    return count


@njit(cache=True, error_model="numpy")
def swing(
    begin: Array, step: Array, angle: Array, speed: Array, rate: Array, active: Array, reverse: Array, about: Array,
    ahead: Array, torques: Array, laws: Array, body: Array, place: Array, pace_0: Array, mode: Array, twist_0: Array,
    kicks: Array, path: Array, pace: Array, twist: Array, events: Array, counts: Array,
) -> None:  # fmt: skip
    """Integrate all windows: displacement, its rate and twist at nodes, and events.

    The body has inertia, stiffness, damping and half of its play.
    """
    for k in range(len(begin)):
        s, v = min(max(place[k], active[k, 0]), reverse[k, 0]), pace_0[k]
        if mode[k] > 0:
            own = active[k] if mode[k] == 1 else reverse[k]
            s, v = _at(own, 0, 0.0, step[k])
        counts[k] = _window(
            begin[k], step[k], angle[k], speed[k], rate[k], active[k], reverse[k], about, ahead[k], torques, laws,
            body, kicks[k], s, v, twist_0[k, 0], twist_0[k, 1], mode[k], path[k], pace[k], twist[k], events[k],
        )  # fmt: skip


@njit(cache=True, error_model="numpy")
def swayed(
    step: Array, mode: Array, events: Array, counts: Array, twist: Array, about: Array, body: Array, pushed: Array,
    driven: Array, active: Array, reverse: Array, rebound: Array, place: Array, pace: Array, twist_0: Array,
    made: Array,
) -> None:  # fmt: skip
    """Compute the first-order change of the displacement at the nodes by small changes, along the events of a run.

    Of the change of the acceleration, the part that is the drive's does not turn the loose gear. Spring and damper act
    where the twist of the run is beyond the play.
    """
    r2, lever = about[1], about[2]
    free = lever / r2 + 1.0 / body[0]
    own, none = body.copy(), body.copy()
    own[3], none[1:] = 0.0, 0.0
    for k in range(len(step)):
        h, now, event = step[k], mode[k], 0
        s, v, d, w = place[k], pace[k], twist_0[k, 0], twist_0[k, 1]
        if now > 0:
            s, v = _at(active[k] if now == 1 else reverse[k], 0, 0.0, h)
        nodes = made.shape[1]
        for i in range(nodes):
            made[k, i] = s
            if i == nodes - 1:
                break
            f, law = 0.0, own if body[3] == 0.0 or abs(twist[k, i] + twist[k, i + 1]) > 2.0 * body[3] else none
            while True:
                last = not (event < counts[k] and int(events[k, event, 0]) == i)
                at = 1.0 if last else events[k, event, 1]
                per = free if now == 0 else 1.0 / body[0]
                many = int(np.ceil((at - f) * h / _finest(body, per)))
                m = (at - f) * h / max(many, 1)
                if now == 0:
                    jerk = (pushed[k, i + 1] - pushed[k, i]) / h
                    slip = jerk - (driven[k, i + 1] - driven[k, i]) / h
                    for _ in range(many):
                        a = pushed[k, i] + f * h * jerk
                        b = pushed[k, i] - driven[k, i] + f * h * slip
                        s, v, d, w = _swung(m, s, v, d, w, a, jerk, b / r2, slip / r2, lever, free, law)
                        f += m / h
                else:
                    side = active[k] if now == 1 else reverse[k]
                    b = _bent(side, i, h) - driven[k, i]
                    slip = (_bent(side, i + 1, h) - driven[k, i + 1] - b) / h
                    for _ in range(many):
                        back = (b + f * h * slip) / r2
                        _, _, d, w = _swung(m, 0.0, 0.0, d, w, 0.0, 0.0, back, slip / r2, 0.0, per, law)
                        f += m / h
                    s, v = _at(side, i, at, h)
                f = at
                if last:
                    break
                what, sign = events[k, event, 2], events[k, event, 3]
                here, lean = _at(active[k] if sign > 0.0 else reverse[k], i, at, h)
                if what != LEAVES:
                    hits, e, a = events[k, event, 4], events[k, event, 5], events[k, event, 6]
                    off, before = s - here, v
                    late = off / hits if hits != 0.0 else 0.0  # a grazing impact changes nothing
                    turn = (1.0 + e) * hits / r2
                    more = lever * law[2] * turn  # by which the damper pulls more after the impact
                    v = lean - e * (v - lean) + ((1.0 + e) * a + more) * late - rebound[k, event] * hits
                    s = here - e * off
                    if what == SETTLES:
                        s, v = here, lean
                    d += (1.0 + e) * off / r2
                    w += (before - v) / r2 - law[2] * turn / body[0] * late
                    now = (1 if sign > 0.0 else 2) if what == SETTLES else 0
                else:
                    s, v, now = here, lean, 0
                event += 1
