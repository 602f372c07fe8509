"""Kernels of multiple shooting: a rigid pair, without or with a second body on a spring, integrated between nodes.

Input: arrays of windows and nodes, torques, laws and flanks. Trajectories are integrated from event to event (impacts,
contact losses); sensitivities are propagated by saltation matrices at events, or by transition matrices with contact
forces. A second body keeps its speed at impacts, which act on the gear alone. Source: Leine and Nijmeijer 2004,
Dynamics and Bifurcations of Non-Smooth Mechanical Systems, ch. 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gears3d.effects import Code
from gears3d.kernels import njit
from gears3d.lumped.compile import tight

if TYPE_CHECKING:
    from gears3d.effects import Row

Array = np.ndarray
# Types of events of a window: impact, impact whose bounces end within half a step, contact loss.
BOUNCES, SETTLES, LEAVES = 1.0, 2.0, 3.0
# Work of a trajectory itself, and factor of its steps with a law of contact or a second body.
OVERHEAD, LAWFUL = 600, 4


class Exhausted(Exception):
    """Trajectories need more work than is allowed."""


def spend(work: Array, nodes: int, *, contacts: bool) -> None:
    """Reduce the work that is allowed, in steps of rigid dry flanks, about 0.1 µs each; raise :class:`Exhausted`.

    contacts: whether a law of contact, or a second body, is integrated.
    """
    work -= OVERHEAD + nodes * (LAWFUL if contacts else 1)
    if work[0] < 0.0:
        raise Exhausted


def impacts_of(events: Array) -> tuple[Array, Array, Array]:
    """Return window, place among the window's events, and number among its impacts of each impact, (n,).

    events: of trajectories, (w, k, 7).
    """
    struck = (events[:, :, 2] == BOUNCES) | (events[:, :, 2] == SETTLES)
    window, place = np.nonzero(struck)
    return window, place, (np.cumsum(struck, axis=1) - 1)[struck]


@tight
def slowed(t: float, angle: float, speed: float, mode: int, torques: Array, lever: float) -> float:
    """Return the acceleration of the loose gear by its torques along the line of action [m/s²]."""
    sign = 1.0 if speed > 0.0 else (-1.0 if speed < 0.0 else 0.0)
    total = 0.0
    for k in range(len(torques)):
        code, gate = int(torques[k, 0]), int(torques[k, 1])  # a view of the numbers would take longer than the rest
        if gate == 1 and mode != 0:
            continue
        if (gate == 2 and mode == 0) or (gate > 2 and mode != gate - 2):
            continue
        if code == 101:
            total += torques[k, 2] * sign
        elif code == 102:
            total += torques[k, 2] * (speed - torques[k, 3])
        elif code == 103:
            total += torques[k, 2] * abs(speed) ** torques[k, 3] * sign
        elif code == 104:
            total += torques[k, 3] * np.cos(torques[k, 2] * angle + torques[k, 4])
        elif code == 105:
            total += torques[k, 2] * (1.0 - np.exp(-t / torques[k, 3])) * sign
    return -lever * total


@tight
def _bent(place: Array, i: int, step: float) -> float:
    """Return the second derivative of nodal values at one node."""
    k = min(max(i, 1), len(place) - 2)
    return (place[k + 1] - 2.0 * place[k] + place[k - 1]) / step**2


@tight
def flank_at(place: Array, i: int, f: float, step: float) -> tuple[float, float]:
    """Return nodal values and their rate at a fraction of the step after a node, by parabolas."""
    bend = 0.5 * step**2 * (_bent(place, i, step) + _bent(place, i + 1, step))
    way = place[i + 1] - place[i]
    return place[i] + f * way + 0.5 * bend * (f * f - f), (way + bend * (f - 0.5)) / step


@tight
def _window(
    begin: float, step: float, angle: Array, speed: Array, rate: Array, active: Array, reverse: Array, about: Array,
    ahead: float, torques: Array, laws: Array, kicks: Array, s: float, v: float, mode: int, path: Array, pace: Array,
    events: Array,
) -> int:  # fmt: skip
    """Integrate one window: cubic steps from node to node, interrupted at impacts and contact losses.

    The first impacts have restitutions of their own, higher by the given kicks. Events get node, fraction of the step,
    type, flank, speed, restitution and acceleration, all relative to the flank.
    """
    r1, r2, lever = about[0], about[1], about[2]
    nodes, count, struck = len(angle), 0, 0
    for i in range(nodes):
        path[i], pace[i] = s, v
        if i == nodes - 1:
            break
        rest = step
        for _ in range(60):
            f = 1.0 - rest / step
            t = begin + (i + f) * step
            if mode == 0:
                a = slowed(
                    t, ahead + (s + r1 * (angle[i] + f * (angle[i + 1] - angle[i]))) / r2,
                    (v + r1 * (speed[i] + f * (speed[i + 1] - speed[i]))) / r2, 0, torques, lever,
                ) - r1 * (rate[i] + f * (rate[i + 1] - rate[i]))  # fmt: skip
                s1, v1 = s + v * rest + 0.5 * a * rest**2, v + a * rest
                end = slowed(
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
                bend = 0.5 * (_bent(own, i, step) + _bent(own, i + 1, step))
                here, lean = flank_at(own, i, f, step)
                low, high, m = 0.0, rest, rest
                for _ in range(50):  # Newton steps, bisection where they leave the bracket
                    off = sign * (s - here + m * (v - lean + m * (0.5 * (a - bend) + m * jerk / 6.0)))
                    low, high = (m, high) if off >= 0.0 else (low, m)
                    slope = sign * (v - lean + m * (a - bend + 0.5 * m * jerk))
                    way = off / slope if slope != 0.0 else rest
                    if high - low < 1e-13 * rest or abs(way) < 1e-14 * rest:
                        break
                    m = m - way if low < m - way < high else 0.5 * (low + high)
                low = m
                here, lean = here + low * (lean + 0.5 * low * bend), lean + low * bend
                hits = v + low * (a + 0.5 * low * jerk) - lean
                e = laws[0] + laws[1] * abs(hits) + 0.5 * sign * laws[2]
                if struck < len(kicks):
                    e += kicks[struck]
                struck += 1
                e = min(max(e, 0.0), 1.0)
                s, v = here, lean - e * hits
                rest -= low
                closing = -sign * (a + low * jerk - bend)
                back = e * abs(hits)
                what = SETTLES
                if back > 0.0 and (closing <= 0.0 or 2.0 * back / (closing * (1.0 - min(e, 0.98))) > 0.5 * step):
                    mode, what = 0, BOUNCES  # otherwise all its bounces end within half a step
                if count < len(events):
                    events[count, 0], events[count, 1], events[count, 2] = i, 1.0 - rest / step, what
                    events[count, 3], events[count, 4], events[count, 5] = sign, hits, e
                    events[count, 6] = a + low * jerk - _bent(own, i, step)
                    count += 1
            else:
                own, sign = (active, 1.0) if mode == 1 else (reverse, -1.0)
                first, jerk, _, _ = _rests(
                    t, begin + (i + 1) * step, step, i, angle, speed, rate, own, sign, mode, about, ahead, torques
                )
                now, last = first + f * jerk, first + jerk
                if now <= 0.0 and last <= 0.0:
                    s, v = flank_at(own, i, 1.0, step)
                    break
                m = 0.0 if now > 0.0 else rest * now / (now - last)
                (s, v), mode = flank_at(own, i, f + m / step, step), 0
                rest -= m
                if count < len(events):
                    events[count, 0], events[count, 1], events[count, 2] = i, 1.0 - rest / step, LEAVES
                    events[count, 3] = sign
                    count += 1
            if rest <= 1e-12 * step:
                break
    return count


@tight
def _films(gap: float, rate: float, film: Array, draws: float, rub: float) -> tuple[float, float, float]:
    """Return the force of one flank [N], and its derivatives to gap and rate of the gap, less its share of friction.

    Its film has wedge, squeeze, rolling radii of drive and loose gear, and the thickness at which flanks touch; oil is
    drawn in at a speed. Compliant teeth have stiffness and damping and never pull.
    """
    push, by_gap, by_rate = 0.0, 0.0, 0.0
    if film[0] > 0.0 or film[1] > 0.0:
        wedge, squeeze, h = film[0] * draws, film[1], max(gap, film[4])
        push, by_gap = wedge / h, -wedge / h**2
        if rate < 0.0:
            by_rate = -squeeze / (h * np.sqrt(h))
            push, by_gap = push + by_rate * rate, by_gap - 1.5 * by_rate * rate / h
    if film[6] > 0.0 and gap < film[4]:
        force = film[6] * (film[4] - gap) - film[7] * rate
        if force > 0.0:
            push, by_gap, by_rate = push + rub * force, by_gap - rub * film[6], by_rate - rub * film[7]
    return push, by_gap, by_rate


@tight
def _pushed(
    f: float, i: int, s: float, v: float, begin: float, step: float, angle: Array, speed: Array, rate: Array,
    active: Array, reverse: Array, about: Array, ahead: float, torques: Array, film: Array,
) -> tuple[float, float, float]:  # fmt: skip
    """Return the acceleration of the loose gear between two films [m/s²], and its derivatives to place and rate."""
    r1, r2, lever = about[0], about[1], about[2]
    turns = speed[i] + f * (speed[i + 1] - speed[i])
    loose = (v + r1 * turns) / r2
    place, lean = flank_at(active, i, f, step)
    beyond, leans = flank_at(reverse, i, f, step)
    mode = 1 if s - place < film[5] else (2 if beyond - s < film[5] else 0)
    turn = ahead + (s + r1 * (angle[i] + f * (angle[i + 1] - angle[i]))) / r2
    free = slowed(begin + (i + f) * step, turn, loose, mode, torques, lever)
    free -= r1 * (rate[i] + f * (rate[i + 1] - rate[i]))
    draws = abs(film[2] * turns + film[3] * loose)
    rub = film[8] if loose >= 0.0 else -film[8]
    near, near_s, near_v = _films(s - place, v - lean, film, draws, 1.0 - rub)
    far, far_s, far_v = _films(beyond - s, leans - v, film, draws, 1.0 + rub)
    return free + r2 * lever * (near - far), r2 * lever * (near_s + far_s), r2 * lever * (near_v + far_v)


@tight
def _part(first: float, rate: float, last: float, last_rate: float, step: float) -> float:
    """Return the part of a step after which a gap, cubic by its values and rates at both ends, is 0."""
    low, high, way, end = 0.0, 1.0, step * rate, step * last_rate
    bend, twist = 3.0 * (last - first) - 2.0 * way - end, 2.0 * (first - last) + way + end
    for _ in range(50):
        x = 0.5 * (low + high)
        low, high = (x, high) if first + x * (way + x * (bend + x * twist)) > 0.0 else (low, x)
    return high


@tight
def _oiled(
    begin: float, step: float, angle: Array, speed: Array, rate: Array, active: Array, reverse: Array, about: Array,
    ahead: float, torques: Array, laws: Array, film: Array, s: float, v: float, path: Array, pace: Array, flow: Array,
) -> None:  # fmt: skip
    """Integrate one window between lubricated or compliant flanks, by a Runge-Kutta pair of orders 3 and 2.

    Flanks that are not compliant rebound where they touch: a step ends there. The gear rests on them as long as it is
    pushed. The flow from node to node is the derivative of place and rate, row by row. Source: Bogacki and Shampine
    1989, Appl. Math. Lett. 2(4).
    """
    rig = (begin, step, angle, speed, rate, active, reverse, about, ahead, torques, film)
    thin, rigid = film[4], film[6] == 0.0
    place = 3e-7 * (reverse[0] - active[0])  # 1e-5 was taken for a drag of the mesh; slopes converge from here on
    fast, lasts, lands, rests = place / step, 1.0, False, 0.0  # steps may end at a flank; sign of one with rest
    for i in range(len(angle)):
        path[i], pace[i] = s, v
        if i == len(angle) - 1:
            break
        f, p, q, r, t = 0.0, 1.0, 0.0, 0.0, 1.0
        one, k0, c0 = _pushed(f, i, s, v, *rig)
        for _ in range(400):
            if f > 1.0 - 1e-12:
                break
            if rests != 0.0:
                own = active if rests > 0.0 else reverse
                last, lean = flank_at(own, i, 1.0, step)
                now = rests * (one - _bent(own, i, step))
                then = rests * (_pushed(1.0, i, last + rests * thin, lean, *rig)[0] - _bent(own, i + 1, step))
                until = 1.0 if now <= 0.0 and then <= 0.0 else (f if now > 0.0 else f + (1.0 - f) * now / (now - then))
                if until > f:
                    s, v = flank_at(own, i, until, step)
                    f, s, p, q, r, t = until, s + rests * thin, 0.0, 0.0, 0.0, 0.0
                    one, k0, c0 = _pushed(f, i, s, v, *rig)
                rests = rests if until == 1.0 else 0.0
                continue
            lasts = min(lasts, 1.0 - f)
            h = lasts * step
            s2, v2 = s + 0.5 * h * v, v + 0.5 * h * one
            two = _pushed(f + 0.5 * lasts, i, s2, v2, *rig)[0]
            s3, v3 = s + 0.75 * h * v2, v + 0.75 * h * two
            three = _pushed(f + 0.75 * lasts, i, s3, v3, *rig)[0]
            s4, v4 = s + h * (2.0 * v + 3.0 * v2 + 4.0 * v3) / 9.0, v + h * (2.0 * one + 3.0 * two + 4.0 * three) / 9.0
            four, k1, c1 = _pushed(f + lasts, i, s4, v4, *rig)
            off = abs(h * (-5.0 * v / 72.0 + v2 / 12.0 + v3 / 9.0 - v4 / 8.0)) / place
            off = max(off, abs(h * (-5.0 * one / 72.0 + two / 12.0 + three / 9.0 - four / 8.0)) / fast)
            if off > 1.0 and lasts > 1e-4:
                lasts, lands = lasts * max(0.2, 0.8 * off ** (-1.0 / 3.0)), False
                continue
            (low, lean), (high, leans) = flank_at(active, i, f + lasts, step), flank_at(reverse, i, f + lasts, step)
            low, high = low + thin, high - thin
            sign = 1.0 if s4 < low else (-1.0 if s4 > high else 0.0)
            if rigid and sign != 0.0 and not lands:
                at, slope = flank_at(active if sign > 0.0 else reverse, i, f, step)
                gap, by, to = sign * (s - at) - thin, sign * (v - slope), sign * (v4 - (lean if sign > 0.0 else leans))
                if max(gap, by) > 0.0:
                    lasts, lands = lasts * _part(gap, by, min(s4 - low, high - s4), to, h), True
                    continue
            f, s, v, one = f + lasts, s4, v4, four
            if len(flow):  # trapezoidal rule, place and rate of both columns
                size = 1.0 - 0.5 * h * c1 - 0.25 * h * h * k1
                r1 = (r + 0.5 * h * (k0 * p + c0 * r + k1 * (p + 0.5 * h * r))) / size
                t1 = (t + 0.5 * h * (k0 * q + c0 * t + k1 * (q + 0.5 * h * t))) / size
                p, q, r, t = p + 0.5 * h * (r + r1), q + 0.5 * h * (t + t1), r1, t1
            k0, c0 = k1, c1
            if rigid and (lands or s < low or s > high):
                lands, sign = False, 1.0 if s - low < high - s else -1.0
                hits = v - (lean if sign > 0.0 else leans)
                s = min(max(s, low), high)
                e, hit, closing = 0.0, sign * hits < 0.0, -sign * one
                if hit:
                    e = min(max(laws[0] + laws[1] * abs(hits) + 0.5 * sign * laws[2], 0.0), 1.0)
                    if closing > 0.0 and 2.0 * e * abs(hits) < 0.5 * step * closing * (1.0 - min(e, 0.98)):
                        rests, e, p, q, r, t = sign, 0.0, 0.0, 0.0, 0.0, 0.0  # all its bounces end within half a step
                    v -= (1.0 + e) * hits
                one, k0, c0 = _pushed(f, i, s, v, *rig)
                if hit:
                    back = (e * four + one) / hits if abs(hits) > fast else 0.0  # one that grazes: none
                    p, q, r, t = -e * p, -e * q, back * p - e * r, back * q - e * t
            lasts *= min(5.0, max(0.2, 0.8 * max(off, 1e-6) ** (-1.0 / 3.0)))
        if len(flow):
            flow[i, 0], flow[i, 1], flow[i, 2], flow[i, 3] = p, q, r, t


@tight
def _floats(
    step: float, angle: Array, speed: Array, rate: Array, active: Array, reverse: Array, about: Array, torques: Array,
    film: Array, mode: int,
) -> tuple[float, float]:  # fmt: skip
    """Return the initial place and rate of a gear that its drag holds on a flank, or on its film."""
    own, sign = (active, 1.0) if mode == 1 else (reverse, -1.0)
    lean = flank_at(own, 0, 0.0, step)[1]
    loose = (lean + about[0] * speed[0]) / about[1]
    load = -sign * (slowed(0.0, 0.0, loose, 0, torques, about[2]) - about[0] * rate[0]) / (about[1] * about[2])
    draws = abs(film[2] * speed[0] + film[3] * loose)
    high = 0.25 * (reverse[0] - active[0])
    gap = min(max(film[0] * draws / load if load > 0.0 else high, film[4]), high)
    if film[6] > 0.0 and load > 0.0 and gap <= film[4]:
        rub = film[8] if loose >= 0.0 else -film[8]
        gap = film[4] - load / (film[6] * (1.0 - sign * rub))
    return own[0] + sign * gap, lean


@njit(cache=True, error_model="numpy")
def carried(
    step: Array, flow: Array, path: Array, flanks: tuple[Array, Array], pushed: Array, active: Array, reverse: Array,
    place: Array, pace: Array, made: Array,
) -> None:  # fmt: skip
    """Compute first-order changes of displacements, and of rates per step, by the transition matrices of a trajectory.

    A film and compliant teeth move with their flank: changes are propagated relative to the nearer one.
    """
    for w in range(len(step)):
        h, s, v = step[w], place[w], pace[w]
        for i in range(made.shape[1]):
            made[w, i, 0], made[w, i, 1] = s, h * v
            if i == made.shape[1] - 1:
                break
            near = path[w, i] < 0.5 * (flanks[0][w, i] + flanks[1][w, i])
            own = active[w] if near else reverse[w]
            lean = (own[i + 1] - own[i]) / h
            y, u = s - own[i], v - lean + 0.5 * h * pushed[w, i]
            s = own[i + 1] + flow[w, i, 0] * y + flow[w, i, 1] * u
            v = lean + flow[w, i, 2] * y + flow[w, i, 3] * u + 0.5 * h * pushed[w, i + 1]


@njit(cache=True, error_model="numpy")
def shoot(
    begin: Array, step: Array, angle: Array, speed: Array, rate: Array, active: Array, reverse: Array, about: Array,
    ahead: Array, torques: Array, laws: Array, film: Array, place: Array, pace_0: Array, mode: Array, kicks: Array,
    path: Array, pace: Array, events: Array, counts: Array, flow: Array,
) -> None:  # fmt: skip
    """Integrate all windows: displacement and rate at nodes; events of rigid dry flanks, transition matrices else."""
    for w in range(len(begin)):
        if len(film):
            s, v = place[w], pace_0[w]
            if film[6] == 0.0:
                s = min(max(s, active[w, 0]), reverse[w, 0])
            if mode[w] > 0:
                own = (step[w], angle[w], speed[w], rate[w], active[w], reverse[w])
                s, v = _floats(*own, about, torques, film, mode[w])
            _oiled(begin[w], step[w], angle[w], speed[w], rate[w], active[w], reverse[w], about, ahead[w], torques,
                   laws, film, s, v, path[w], pace[w], flow[w])  # fmt: skip
            continue
        s, v = min(max(place[w], active[w, 0]), reverse[w, 0]), pace_0[w]
        if mode[w] > 0:
            own = active[w] if mode[w] == 1 else reverse[w]
            s, v = flank_at(own, 0, 0.0, step[w])
        counts[w] = _window(
            begin[w], step[w], angle[w], speed[w], rate[w], active[w], reverse[w], about, ahead[w], torques, laws,
            kicks[w], s, v, mode[w], path[w], pace[w], events[w],
        )  # fmt: skip


@njit(cache=True, error_model="numpy")
def slowing(
    begin: Array, step: Array, angle: Array, speed: Array, about: Array, ahead: Array, torques: Array, path: Array,
    pace: Array, made: Array,
) -> None:  # fmt: skip
    """Compute the acceleration in flight by torques alone at the nodes of trajectories [m/s²]."""
    r1, r2, lever = about[0], about[1], about[2]
    for w in range(len(begin)):
        for i in range(angle.shape[1]):
            made[w, i] = slowed(
                begin[w] + i * step[w], ahead[w] + (path[w, i] + r1 * angle[w, i]) / r2,
                (pace[w, i] + r1 * speed[w, i]) / r2, 0, torques, lever,
            )  # fmt: skip


@njit(cache=True, error_model="numpy")
def follow(
    step: Array, mode: Array, events: Array, counts: Array, pushed: Array, active: Array, reverse: Array,
    rebound: Array, place: Array, pace: Array, made: Array,
) -> None:  # fmt: skip
    """Compute first-order changes of displacements, and of rates per step, by saltation matrices at events.

    Between events the change is a free flight under the change of the acceleration, in contact that of the flank; at an
    impact, which itself moves, place and speed relative to the flank change by its saltation matrix. Source: Leine and
    Nijmeijer 2004, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, ch. 7.

    All is at nodes, (w, n), or one per window or event; the mode is that of the starts.
    """
    for w in range(len(step)):
        h, now, k = step[w], mode[w], 0
        s, v = place[w], pace[w]
        if now > 0:
            s, v = flank_at(active[w] if now == 1 else reverse[w], 0, 0.0, h)
        nodes = made.shape[1]
        for i in range(nodes):
            made[w, i, 0], made[w, i, 1] = s, h * v
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
                here, lean = flank_at(own, i, at, h)
                if what == BOUNCES:
                    hits, e, a = events[w, k, 4], events[w, k, 5], events[w, k, 6]
                    off, apace = s - here, v - lean
                    late = off / hits if hits != 0.0 else 0.0  # a grazing impact changes nothing
                    s = here - e * off
                    v = lean - e * apace + (1.0 + e) * a * late - rebound[w, k] * hits
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
                s, v = flank_at(active[w] if now == 1 else reverse[w], i, 1.0, h)


def film_of(rows: Sequence[Row]) -> Array:
    """Return oil, compliance and friction of flanks from normal forms, (9,); empty without."""
    films, springs = ([row.p for row in rows if row.code == code] for code in (Code.GAP_FILM, Code.GAP_SPRING))
    if not films and not springs:
        return np.zeros(0)
    made = np.zeros(9)
    if films:
        made[:6] = films[0][:6]
    made[6:8] = np.sum([one[:2] for one in springs], axis=0) if springs else 0.0
    made[8] = sum(row.p[0] for row in rows if row.code == Code.TORQUE_FRICTION)
    return made


def body_of(rows: Sequence[Row]) -> Array:
    """Return inertia, stiffness, damping and half of the play of a second body, (4,); empty without."""
    own = [row.p for row in rows if row.code == Code.TORQUE_CARRIED]
    return np.array([*own[0][:3], 0.5 * own[0][3]]) if own else np.zeros(0)


def torques_of(rows: Sequence[Row], drag: float = 0.0) -> Array:
    """Return torques as input of the kernels: code, gate, three numbers."""
    made = [[float(Code.TORQUE_CONSTANT), 0.0, drag, 0.0, 0.0]] if drag else []
    for row in rows:
        if 100 < row.code < 200 and row.code not in (Code.TORQUE_FRICTION, Code.TORQUE_CARRIED):
            made.append([float(row.code), float(row.gate), *[*row.p, 0.0, 0.0, 0.0][:3]])
    return np.array(made, dtype=float).reshape(-1, 5)


# Largest phase of the fastest oscillation in a step [rad]: a phase error of 4e-4 rad per period.
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
    """Return the longest step [s]; per: inverse of the oscillating inertia."""
    return PHASE / max(np.sqrt(body[1] * per), body[2] * per, 1e-12)


@tight
def _swung(
    h: float, s: float, v: float, d: float, w: float, p: float, jerk: float, q: float, slip: float, lever: float,
    per: float, body: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return place, rate, twist and its rate after a Runge-Kutta step of order 4.

    The gear has the acceleration p, with a constant rate, in addition to its spring; −q is that of the twist.
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
    """Return, for the rest of a step in flight, accelerations of path and twist without the spring, and their rates."""
    r1, r2, lever = about[0], about[1], about[2]
    q = slowed(
        t, ahead + (s + r1 * (angle[i] + f * (angle[i + 1] - angle[i]))) / r2,
        (v + r1 * (speed[i] + f * (speed[i + 1] - speed[i]))) / r2, 0, torques, lever,
    )  # fmt: skip
    p = q - r1 * (rate[i] + f * (rate[i + 1] - rate[i]))
    a = p + pulled
    s1, v1 = s + v * rest + 0.5 * a * rest**2, v + a * rest
    end = slowed(t + rest, ahead + (s1 + r1 * angle[i + 1]) / r2, (v1 + r1 * speed[i + 1]) / r2, 0, torques, lever)
    return p, (end - r1 * rate[i + 1] - p) / rest, q / r2, (end - q) / rest / r2


@tight
def _parting(t: float, angle: float, speed: float, sign: float, mode: int, torques: Array, lever: float) -> float:
    """Return the acceleration away from a flank; a torque that acts in contact alone does not end it."""
    held = sign * slowed(t, angle, speed, mode, torques, lever)
    return min(held, sign * slowed(t, angle, speed, 0, torques, lever))


@tight
def _rests(
    t: float, last: float, step: float, i: int, angle: Array, speed: Array, rate: Array, own: Array, sign: float,
    mode: int, about: Array, ahead: float, torques: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return, for a step in contact, the separating and the angular acceleration of the flank, and their changes."""
    r1, r2, lever = about[0], about[1], about[2]
    bend, bent = _bent(own, i, step), _bent(own, i + 1, step)
    lean, (place, leans) = flank_at(own, i, 0.0, step)[1], flank_at(own, i, 1.0, step)
    turn, after = ahead + (own[i] + r1 * angle[i]) / r2, ahead + (place + r1 * angle[i + 1]) / r2
    p = _parting(t, turn, (lean + r1 * speed[i]) / r2, sign, mode, torques, lever)
    p -= sign * (r1 * rate[i] + bend)
    jerk = _parting(last, after, (leans + r1 * speed[i + 1]) / r2, sign, mode, torques, lever)
    jerk -= sign * (r1 * rate[i + 1] + bent) + p
    q = (bend + r1 * rate[i]) / r2
    return p, jerk, q, (bent + r1 * rate[i + 1]) / r2 - q


@tight
def _meets(
    own: Array, sign: float, i: int, f: float, step: float, h: float, s: float, v: float, d: float, w: float,
    now: float, jerk: float, back: float, slip: float, lever: float, free: float, body: Array,
) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
    """Return the time of an impact in a step, place and rate of the flank there, and the state."""
    before, after, m = 0.0, h, h
    for _ in range(50):  # Newton steps, bisection where they leave the bracket
        here, lean = flank_at(own, i, f + m / step, step)
        s1, v1, _, _ = _swung(m, s, v, d, w, now, jerk, back, slip, lever, free, body)
        off, slope = sign * (s1 - here), sign * (v1 - lean)
        before, after = (m, after) if off >= 0.0 else (before, m)
        way = off / slope if slope != 0.0 else h
        if after - before < 1e-13 * h or abs(way) < 1e-14 * h:
            break
        m = m - way if before < m - way < after else 0.5 * (before + after)
    here, lean = flank_at(own, i, f + m / step, step)
    s1, v1, d1, w1 = _swung(m, s, v, d, w, now, jerk, back, slip, lever, free, body)
    return m, here, lean, s1, v1, d1, w1


@tight
def _body_window(
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
                    low, high = flank_at(active, i, g, step)[0], flank_at(reverse, i, g, step)[0]
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
                            s, v = flank_at(own, i, 1.0, step)
                            break
                        continue
                    m = h * first / (first - last)
                    _, _, d, w = _swung(m, 0.0, 0.0, d, w, 0.0, 0.0, back, slip / step, 0.0, 1.0 / body[0], body)
                (s, v), mode = flank_at(own, i, f + m / step, step), 0
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
            s, v = flank_at(own, 0, 0.0, step[k])
        counts[k] = _body_window(
            begin[k], step[k], angle[k], speed[k], rate[k], active[k], reverse[k], about, ahead[k], torques, laws,
            body, kicks[k], s, v, twist_0[k, 0], twist_0[k, 1], mode[k], path[k], pace[k], twist[k], events[k],
        )  # fmt: skip


@njit(cache=True, error_model="numpy")
def swayed(
    step: Array, mode: Array, events: Array, counts: Array, twist: Array, about: Array, body: Array, pushed: Array,
    driven: Array, active: Array, reverse: Array, rebound: Array, place: Array, pace: Array, twist_0: Array,
    made: Array,
) -> None:  # fmt: skip
    """Compute first-order changes of displacements, and of rates per step, with a second body, along a trajectory.

    The change of the drive's acceleration does not turn the loose gear. Spring and damper act where the twist of the
    trajectory exceeds the play.
    """
    r2, lever = about[1], about[2]
    free = lever / r2 + 1.0 / body[0]
    own, none = body.copy(), body.copy()
    own[3], none[1:] = 0.0, 0.0
    for k in range(len(step)):
        h, now, event = step[k], mode[k], 0
        s, v, d, w = place[k], pace[k], twist_0[k, 0], twist_0[k, 1]
        if now > 0:
            s, v = flank_at(active[k] if now == 1 else reverse[k], 0, 0.0, h)
        nodes = made.shape[1]
        for i in range(nodes):
            made[k, i, 0], made[k, i, 1] = s, h * v
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
                    s, v = flank_at(side, i, at, h)
                f = at
                if last:
                    break
                what, sign = events[k, event, 2], events[k, event, 3]
                here, lean = flank_at(active[k] if sign > 0.0 else reverse[k], i, at, h)
                if what != LEAVES:
                    hits, e, a = events[k, event, 4], events[k, event, 5], events[k, event, 6]
                    off, before = s - here, v
                    late = off / hits if hits != 0.0 else 0.0  # a grazing impact changes nothing
                    turn = (1.0 + e) * hits / r2
                    more = lever * law[2] * turn  # change of the damper's force by the impact
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
