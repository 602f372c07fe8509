"""What happens in a machine with hidden effects: its motion from the start, sample by sample, and every impact.

Runge-Kutta steps of fixed size are ended where a flank is reached or left, or the gear halts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import EngineError
from gears3d.kernels import njit
from gears3d.recording import Recording
from gears3d.verification.challenge.machine import machine
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

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

STEP = 2e-5  # Largest step of integration [s]
BLOCK = 25_000  # Samples between two reports of progress


def happen(
    scenario: Scenario,
    foreign: Sequence[Sequence[float]] = (),
    second: Sequence[float] = (),
    *,
    rate: float | None = None,
    step: float = STEP,
    seed: int | None = None,
    late: float = 0.0,
    late_drive: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Return the true motion of a scenario with its effects, sensors left aside.

    Args:
        scenario: the rig and its effects.
        foreign: causes outside the catalogue, rows of ``foreign`` in ``MACHINE``.
        second: a body behind a coupling with play.
        rate: of the samples, Hz; ``run.output_rate`` unless given.
        step: of integration at most, s.
        seed: of restitution that scatters; ``run.seed`` unless given.
        late: the loose gear's angle is that of so many seconds before, s.
        late_drive: so is the drive's.
        progress: called now and then with the time done [s].

    Returns:
        Angles, speeds and displacement; the impacts with time, flank, velocity, rebound and impulse.

    Raises:
        InputError: the rig has what no equation here covers.
        EngineError: the motion ran away.
    """
    m = machine(scenario, foreign, second)
    rate = rate or scenario.run.output_rate
    count, back = round(scenario.run.duration * rate) + 1, ceil(late * rate)
    offset = back / rate - late
    total = count - back
    y = _start(m, scenario.start.state, offset)
    random = np.random.default_rng(np.random.SeedSequence([7, scenario.run.seed if seed is None else seed]))
    normals, hits = random.standard_normal(4096), np.zeros((1000 + 2 * total, 5))
    angle, speed = np.zeros(total), np.zeros(total)
    substeps = max(1, ceil(1.0 / rate / _finest(m, step) - 1e-9))
    for begin in range(0, total, BLOCK):
        part = slice(begin, min(begin + BLOCK, total))
        run(m, y, begin, 1.0 / rate, offset, substeps, normals, angle[part], speed[part], hits)
        if progress:
            progress(min(part.stop / rate, scenario.run.duration))
    if not np.isfinite(angle).all():
        raise EngineError("the hidden motion ran away; choose a smaller effect")
    if back < 0:
        angle, speed = angle[-back:], speed[-back:]
    elif back > 0:
        before = np.arange(-back, 0) / rate
        angle, speed = np.r_[angle[0] + before * speed[0], angle], np.r_[np.full(back, speed[0]), speed]
    return _recording(m, scenario, rate, late_drive, angle[:count], speed[:count], hits[: int(y[COUNT])])


def _finest(m: Any, step: float) -> float:
    """The step that resolves the stiffest spring [s]."""
    mass = m["inertia"] / m["rb2"] ** 2
    stiffest = max(m["spring"][0] / mass, (m["spring"][1] / mass) ** 2)
    if m["second"][0] > 0.0:
        stiffest = max(stiffest, m["second"][1] / m["second"][0], (m["second"][2] / m["second"][0]) ** 2)
    return min(step, 0.05 / sqrt(stiffest)) if stiffest > 0.0 else step


def _start(m: Any, state: str, time: float) -> np.ndarray:
    """The state at the beginning: on a flank, or in the middle of the gap as fast as the drive."""
    y = np.zeros(7)
    y[TIME], y[3] = time, FREE
    th1, w1, a1 = drive(m, time)
    share = {"active": 0.0, "reverse": 1.0, "free": 0.5}[state]
    th2 = th1 * m["rb1"] / m["rb2"]
    for _ in range(50):
        low, high = flank(m, ACTIVE, time, th1, th2), flank(m, REVERSE, time, th1, th2)
        s = (1.0 - share) * (low[0] + m["film"][5]) + share * (high[0] - m["film"][5])
        th2 = (m["rb1"] * th1 + s) / m["rb2"]
    on = low if state == "active" else high
    rigid = m["spring"][0] == 0.0
    y[THETA], y[OMEGA] = th2, w1 * m["rb1"] / m["rb2"]
    if state != "free":
        lever = m["rb2"] - on[2]
        y[OMEGA] = (m["rb1"] + on[1]) * w1 / lever
        side = ACTIVE if state == "active" else REVERSE
        y[3] = side if rigid else FREE
        if not rigid:  # compliant teeth are pressed in already
            a2 = ((m["rb1"] + on[1]) * a1 + on[3] * w1**2 + on[4] * y[OMEGA] ** 2) / lever
            for _ in range(60):
                a, _ = accelerate(m, time, y[THETA], y[OMEGA], y[THETA], y[OMEGA], np.sign(y[OMEGA]), side)
                y[THETA] += (a - a2) * m["inertia"] / (m["spring"][0] * lever**2)
                y[THETA] = min(y[THETA], th2) if side == ACTIVE else max(y[THETA], th2)
        elif m["film"][0] > 0.0:  # oil carries: the gear floats where its wedge does
            y[THETA], y[3] = _float(m, time, side, th2, y[OMEGA]), FREE
    y[THETA2], y[5] = y[THETA], y[OMEGA]
    return y


def _float(m: Any, time: float, side: int, low: float, w2: float) -> float:
    """The loose gear's angle at which the oil on a flank carries what presses, if the layer does not [rad]."""
    sign = 1.0 if side == ACTIVE else -1.0
    th1, w1, a1 = drive(m, time)
    high = low + sign * 0.45 * (m["backlash"] - 2.0 * m["film"][5]) / m["rb2"]
    for i in range(60):
        middle = low if i == 0 else 0.5 * (low + high)
        _, d1, d2, d11, d22, _ = flank(m, side, time, th1, middle)
        a2 = ((m["rb1"] + d1) * a1 + d11 * w1**2 + d22 * w2**2) / (m["rb2"] - d2)
        away = sign * (accelerate(m, time, middle, w2, middle, w2, np.sign(w2), FREE)[0] - a2)
        if i == 0 and away <= 0.0:
            return low
        low, high = (middle, high) if away > 0.0 else (low, middle)
    return low


def _recording(
    m: Any, scenario: Scenario, rate: float, late: float, angle: Any, speed: Any, hits: np.ndarray
) -> Recording:
    time = np.arange(len(angle)) / rate
    then = time - late
    th1 = np.array(m["speed"] * then)
    w1 = np.full(len(time), m["speed"])
    for size, w, phase in m["sines"][: m["n_sines"]]:
        th1 += size / w * (np.cos(phase) - np.cos(w * then + phase))
        w1 += size * np.sin(w * then + phase)
    signals = {"time_s": time, "theta_drive_rad": th1, "theta_loose_rad": angle}
    signals |= {"omega_drive_rad_s": w1, "omega_loose_rad_s": speed}
    signals |= {"displacement_m": m["rb2"] * angle - m["rb1"] * th1, "velocity_m_s": m["rb2"] * speed - m["rb1"] * w1}
    names = ("time_s", "flank", "velocity_m_s", "rebound_m_s", "impulse_N_s")
    impacts = {name: hits[:, i] for i, name in enumerate(names)}
    period = scenario.period
    meta = {"model": "challenge", "title": scenario.title, "period_s": period, "settle_s": scenario.run.settle}
    return Recording(signals, impacts, meta)


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
