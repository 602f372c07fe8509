"""Kernels of multiple shooting: a rigid pair through windows, node by node, and small changes along what it did."""

from __future__ import annotations

import numpy as np

from gears3d.kernels import njit

Array = np.ndarray
BOUNCES, SETTLES, LEAVES = 1.0, 2.0, 3.0
"""What an event of a window is: an impact, one whose bounces all end within half a step, and parting from a flank."""


@njit(cache=True)
def _slowed(t: float, angle: float, speed: float, mode: int, torques: Array, lever: float) -> float:
    """Return the acceleration of the loose gear by its torques along the line of action [m/s²]."""
    sign = 1.0 if speed > 0.0 else (-1.0 if speed < 0.0 else 0.0)
    total = 0.0
    for k in range(len(torques)):
        code, gate, p = int(torques[k, 0]), int(torques[k, 1]), torques[k, 2:]
        if gate == 1 and mode != 0:
            continue
        if (gate == 2 and mode == 0) or (gate > 2 and mode != gate - 2):
            continue
        if code == 101:
            total += p[0] * sign
        elif code == 102:
            total += p[0] * (speed - p[1])
        elif code == 103:
            total += p[0] * abs(speed) ** p[1] * sign
        elif code == 104:
            total += p[1] * np.cos(p[0] * angle + p[2])
        elif code == 105:
            total += p[0] * (1.0 - np.exp(-t / p[1])) * sign
    return -lever * total


@njit(cache=True)
def _bent(place: Array, i: int, step: float) -> float:
    """Return the second derivative of what is given at nodes, at one of them."""
    k = min(max(i, 1), len(place) - 2)
    return (place[k + 1] - 2.0 * place[k] + place[k - 1]) / step**2


@njit(cache=True)
def _window(
    begin: float, step: float, angle: Array, speed: Array, rate: Array, active: Array, reverse: Array, about: Array,
    ahead: float, torques: Array, laws: Array, s: float, v: float, mode: int, path: Array, pace: Array, events: Array,
) -> int:  # fmt: skip
    """Work out one window: cubic steps from node to node, halted at impacts and where a flank is left.

    Events get node, part of the step, kind, flank, speed, restitution and acceleration, all relative to the flank.
    """
    r1, r2, lever = about[0], about[1], about[2]
    nodes, count = len(angle), 0
    for i in range(nodes):
        path[i], pace[i] = s, v
        if i == nodes - 1:
            break
        rest = step
        for _ in range(60):
            f = 1.0 - rest / step
            t = begin + (i + f) * step
            own = active if mode == 1 else reverse
            if mode == 0:
                a = _slowed(
                    t, ahead + (s + r1 * (angle[i] + f * (angle[i + 1] - angle[i]))) / r2,
                    (v + r1 * (speed[i] + f * (speed[i + 1] - speed[i]))) / r2, 0, torques, lever,
                ) - r1 * (rate[i] + f * (rate[i + 1] - rate[i]))  # fmt: skip
                s1, v1 = s + v * rest + 0.5 * a * rest**2, v + a * rest
                end = _slowed(
                    t + rest, ahead + (s1 + r1 * angle[i + 1]) / r2, (v1 + r1 * speed[i + 1]) / r2, 0, torques, lever
                ) - r1 * rate[i + 1]  # fmt: skip
                jerk = (end - a) / rest
                s1 = s + rest * (v + rest * (0.5 * a + rest * jerk / 6.0))
                below, above = s1 < active[i + 1], s1 > reverse[i + 1]
                if not below and not above:
                    s, v = s1, v + rest * (a + 0.5 * rest * jerk)
                    break
                mode = 1 if below else 2
                own, sign = (active, 1.0) if below else (reverse, -1.0)
                lean = (own[i + 1] - own[i]) / step
                here = own[i] + f * (own[i + 1] - own[i])
                low, high = 0.0, rest
                for _ in range(50):
                    m = 0.5 * (low + high)
                    if sign * (s + m * (v + m * (0.5 * a + m * jerk / 6.0)) - here - lean * m) < 0.0:
                        high = m
                    else:
                        low = m
                hits = v + low * (a + 0.5 * low * jerk) - lean
                e = laws[0] + laws[1] * abs(hits) + 0.5 * sign * laws[2]
                e = min(max(e, 0.0), 1.0)
                s, v = here + lean * low, lean - e * hits
                rest -= low
                closing = -sign * (a + low * jerk)
                back = e * abs(hits)
                what = SETTLES
                if back > 0.0 and (closing <= 0.0 or 2.0 * back / (closing * (1.0 - min(e, 0.98))) > 0.5 * step):
                    mode, what = 0, BOUNCES  # else all its bounces end within half a step
                if count < len(events):
                    events[count, 0], events[count, 1], events[count, 2] = i, 1.0 - rest / step, what
                    events[count, 3], events[count, 4], events[count, 5] = sign, hits, e
                    events[count, 6] = a + low * jerk - _bent(own, i, step)
                    count += 1
            else:
                sign = 1.0 if mode == 1 else -1.0
                lean = (own[i + 1] - own[i]) / step
                place = own[i + 1]
                first = _slowed(
                    t, ahead + (own[i] + r1 * angle[i]) / r2, (lean + r1 * speed[i]) / r2, mode, torques, lever
                )
                first = sign * (first - r1 * rate[i] - _bent(own, i, step))
                last = _slowed(
                    begin + (i + 1) * step, ahead + (place + r1 * angle[i + 1]) / r2, (lean + r1 * speed[i + 1]) / r2,
                    mode, torques, lever,
                )  # fmt: skip
                last = sign * (last - r1 * rate[i + 1] - _bent(own, i + 1, step))
                now = first + f * (last - first)
                v = lean
                if now <= 0.0 and last <= 0.0:
                    s = place
                    break
                m = 0.0 if now > 0.0 else rest * now / (now - last)
                s, mode = own[i] + lean * (f * step + m), 0
                rest -= m
                if count < len(events):
                    events[count, 0], events[count, 1], events[count, 2] = i, 1.0 - rest / step, LEAVES
                    events[count, 3] = sign
                    count += 1
            if rest <= 1e-12 * step:
                break
    return count


@njit(cache=True)
def shoot(
    begin: Array, step: Array, angle: Array, speed: Array, rate: Array, active: Array, reverse: Array, about: Array,
    ahead: Array, torques: Array, laws: Array, place: Array, pace_0: Array, mode: Array, path: Array, pace: Array,
    events: Array, counts: Array,
) -> None:  # fmt: skip
    """Work out all windows: displacement and rate at their nodes, and their events."""
    for w in range(len(begin)):
        s, v = min(max(place[w], active[w, 0]), reverse[w, 0]), pace_0[w]
        if mode[w] > 0:
            own = active[w] if mode[w] == 1 else reverse[w]
            s, v = own[0], (own[1] - own[0]) / step[w]
        counts[w] = _window(
            begin[w], step[w], angle[w], speed[w], rate[w], active[w], reverse[w], about, ahead[w], torques, laws, s, v,
            mode[w], path[w], pace[w], events[w],
        )  # fmt: skip


@njit(cache=True)
def slowing(
    begin: Array, step: Array, angle: Array, speed: Array, about: Array, ahead: Array, torques: Array, path: Array,
    pace: Array, made: Array,
) -> None:  # fmt: skip
    """Work out the acceleration in flight by torques alone at the nodes of paths [m/s²]."""
    r1, r2, lever = about[0], about[1], about[2]
    for w in range(len(begin)):
        for i in range(angle.shape[1]):
            made[w, i] = _slowed(
                begin[w] + i * step[w], ahead[w] + (path[w, i] + r1 * angle[w, i]) / r2,
                (pace[w, i] + r1 * speed[w, i]) / r2, 0, torques, lever,
            )  # fmt: skip


@njit(cache=True)
def follow(
    step: Array, mode: Array, events: Array, counts: Array, pushed: Array, active: Array, reverse: Array,
    rebound: Array, place: Array, pace: Array, made: Array,
) -> None:  # fmt: skip
    """Work out what small changes do to the displacement at the nodes, to first order, along the events of a run.

    Between events the change is a free flight under the change of the acceleration, in contact that of the flank; at an
    impact, which itself moves, place and speed relative to the flank change by its saltation matrix. Source: Leine and
    Nijmeijer 2004, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, ch. 7.
    All is at nodes, (w, n), or one per window or event; the mode is that of the starts.
    """
    for w in range(len(step)):
        h, now, k = step[w], mode[w], 0
        s, v = place[w], pace[w]
        if now > 0:
            own = active[w] if now == 1 else reverse[w]
            s, v = own[0], (own[1] - own[0]) / h
        nodes = made.shape[1]
        for i in range(nodes):
            made[w, i] = s
            if i == nodes - 1:
                break
            f = 0.0
            while k < counts[w] and int(events[w, k, 0]) == i:
                at, what, sign = events[w, k, 1], events[w, k, 2], events[w, k, 3]
                if now == 0:
                    lasts = (at - f) * h
                    a = pushed[w, i] + f * (pushed[w, i + 1] - pushed[w, i])
                    b = pushed[w, i] + at * (pushed[w, i + 1] - pushed[w, i])
                    s += lasts * (v + lasts * (2.0 * a + b) / 6.0)
                    v += 0.5 * lasts * (a + b)
                own = active[w] if sign > 0.0 else reverse[w]
                here, lean = own[i] + at * (own[i + 1] - own[i]), (own[i + 1] - own[i]) / h
                if what == BOUNCES:
                    hits, e, a = events[w, k, 4], events[w, k, 5], events[w, k, 6]
                    off, apace = s - here, v - lean
                    s = here - e * off
                    v = lean - e * apace + (1.0 + e) * a / hits * off - rebound[w, k] * hits
                else:
                    s, v = here, lean
                now = (1 if sign > 0.0 else 2) if what == SETTLES else 0
                f = at
                k += 1
            if now == 0:
                lasts = (1.0 - f) * h
                a = pushed[w, i] + f * (pushed[w, i + 1] - pushed[w, i])
                b = pushed[w, i + 1]
                s += lasts * (v + lasts * (2.0 * a + b) / 6.0)
                v += 0.5 * lasts * (a + b)
            else:
                own = active[w] if now == 1 else reverse[w]
                s, v = own[i + 1], (own[i + 1] - own[i]) / h
