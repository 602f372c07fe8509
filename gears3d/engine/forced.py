"""Motion under forces of the gap, and with a carried body: steps of the integrator, up to the first event.

Films of oil act all the time, so flight, passage and rest on the film are one motion. The state of the integrator:
angle and speed of the loose gear; with a carried body those of it; the impulse on the flank whose passage is under way;
the integrals of both gap rates, whose rates show where within a step a gap turns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.effects.rows import Code, Row
from gears3d.engine.carried import INERTIA, body_among, hand_over, pull_of, resolved
from gears3d.engine.closing import GLIDING
from gears3d.engine.compile import inner
from gears3d.engine.films import film_push
from gears3d.engine.mesh import call_side
from gears3d.engine.motion import drive_at
from gears3d.engine.moving import GO_ON, NO_NUMBER, NOBODY, gap_of
from gears3d.engine.sustained_contact import resolution
from gears3d.engine.torques import FREE, resisting
from gears3d.integrator import DENSE, END, NEVER, STAGES, inside, integrator, judge, locator, off

# How a step ends: no event, the loose gear at rest or set in motion; then, one more on the reverse flank: a gap begins
# or ceases to close, flanks touch or separate, compliant flanks begin or cease to push, a passage begins or ends.
ON, STOPS, TURNS, TOUCHES, FLIPS, BORDERS, EVENTS = -1, 0, 1, 3, 5, 7, 9
STILL = 1e-13  # rate below which a gap is at a turning point, within rounding [m/s]
TOLERANCE = 1e-8  # of a step, relative to the narrower gap and its rate
SLOWEST = 1e-3  # smallest rate of a gap, and of a twist at the base circle, to which errors are related [m/s]
NARROWEST = 1e-3  # smallest gap, in backlashes, to which errors are related without oil
ROUNDING = 2e-16  # relative resolution of angles, beyond which no tolerance goes
FIRST_STEP = 1e-6  # s


def springs_of(rows: Sequence[Row]) -> np.ndarray:
    """Return stiffness [N/m] and damping [N s/m] of all compliant rows together, (1, 2), or (0, 2) without any."""
    found = [row.p[:2] for row in rows if row.code == Code.GAP_SPRING]
    return np.sum(found, axis=0, dtype=float, keepdims=True) if found else np.zeros((0, 2))


def workspace(torques: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the arrays of the integrator for a table of torques; they keep the rates from step to step."""
    n = 5 if body_among(torques) < 0 else 7
    vectors, functions = np.zeros((3, n)), np.zeros((4, EVENTS))
    return (*vectors, np.zeros((STAGES, n)), np.zeros((DENSE + 1, n)), *functions, np.zeros(EVENTS, np.int64))


class Now(NamedTuple):
    """All that acts at one instant.

    Args:
        active: gap [m] and its rate [m/s] of the active flank.
        reverse: the same of the reverse flank.
        spring: force of the compliant flank in contact [N].
        passing: force on the flank whose passage is under way [N].
        pull: torque on the loose gear without dry torques [N m].
        dry: torque against its motion [N m].
        twisting: of it the torque of a carried body [N m].
    """

    active: tuple[float, float]
    reverse: tuple[float, float]
    spring: float
    passing: float
    pull: float
    dry: float
    twisting: float


@inner
def _push(system, springs, teeth, s, side, drive, loose):
    """Return gap [m], its rate [m/s], lever [m], force of film and of compliant flank [N] of one side."""
    gap, by_drive, by_loose, _ = call_side(system.surfaces.side, (system.surfaces, teeth, side, drive[0], loose[0]))
    rate = by_drive * drive[1] + by_loose * loose[1]
    film = spring = 0.0
    if system.film.minimum > 0.0:
        film = film_push(system.film, gap, rate, s.squeezed[side] != 0, (drive[1], loose[1]))
    if side == s.place - 1 and s.pushing != 0:
        spring = -springs[0, 0] * gap - springs[0, 1] * rate
    return gap, rate, by_loose, film, spring


@inner
def _acting(given, t, y):
    """Return all that acts at one instant."""
    system, springs, teeth, s, body = given
    angle, speed, _ = drive_at(system.motion, t)
    drive, loose = (angle, speed), (y[0], y[1])
    gap0, rate0, lever0, film0, spring0 = _push(system, springs, teeth, s, 0, drive, loose)
    gap1, rate1, lever1, film1, spring1 = _push(system, springs, teeth, s, 1, drive, loose)
    pull = (film0 + spring0) * lever0 + (film1 + spring1) * lever1
    passing = 0.0 if s.flank == NOBODY else film0 + spring0 if s.flank == 0 else film1 + spring1
    rows, twisting = system.torques, 0.0
    if body >= 0:
        twisting = pull_of(rows[body], y[2] - y[0], y[3] - y[1])
        rows = rows[:body]
    plain, dry = resisting(rows, s.place, t, y[0], y[1])
    spring = spring0 + spring1
    dry += system.friction * max(spring, 0.0)
    return Now((gap0, rate0), (gap1, rate1), spring, passing, pull + twisting - plain, dry, twisting)


@inner
def _write(given, y, now, k):
    """Write the rates of the state."""
    system, _, _, s, body = given
    k[0] = k[1] = 0.0
    if s.sense != 0.0:
        k[0], k[1] = y[1], (now.pull - s.sense * now.dry) / system.inertia
    i = 2
    if body >= 0:
        k[2], k[3], i = y[3], -now.twisting / system.torques[body, INERTIA], 4
    k[i], k[i + 1], k[i + 2] = now.passing, now.active[1], now.reverse[1]


@inner
def _rates(given, t, y, k):
    """Write the rates of the state."""
    _write(given, y, _acting(given, t, y), k)


@inner
def _outlook(given, t, y, g, k):
    """Write functions of which one falls below zero at an event, and rates; return both gaps [m]."""
    now = _acting(given, t, y)
    _write(given, y, now, k)
    system, springs, _, s, _ = given
    finest = resolution(y[0])
    g[STOPS] = s.sense * y[1] if s.sense != 0.0 else now.dry - abs(now.pull)
    for side in range(2):
        gap, rate = now.active if side == 0 else now.reverse
        closes = s.squeezed[side] != 0
        g[TURNS + side] = (-rate if closes else rate) + STILL
        # a gap that has just opened by less than can be resolved does not close again
        within = side == s.left and s.height <= finest
        g[TOUCHES + side] = NEVER if not closes else gap + finest if within else gap
        g[FLIPS + side] = g[BORDERS + side] = NEVER
        if side == s.place - 1:
            g[TOUCHES + side] = -gap
            if springs[0, 1] > 0.0:
                g[FLIPS + side] = now.spring if s.pushing != 0 else springs[0, 0] * gap + springs[0, 1] * rate
        if system.film.minimum > 0.0:
            if closes and s.flank == NOBODY:
                g[BORDERS + side] = gap - system.film.felt
            elif not closes and s.flank == side:
                g[BORDERS + side] = system.film.felt - gap
    return now.active[0], now.reverse[0]


_attempt, _open_up = integrator(_rates)
_first = locator(_outlook)


@inner
def _wake(given, y, g, k):
    """Write the state of the integrator, its rates and the functions of its events at the begin of a step."""
    system, _, _, s, body = given
    y[:] = 0.0
    y[0], y[1] = s.theta, s.omega
    if body >= 0:
        y[2], y[3] = s.body[0], s.body[1]
    y[y.shape[0] - 3] = s.impulse
    now = _acting(given, s.time, y)
    s.sense = np.sign(s.omega)
    if s.omega == 0.0:
        s.sense = 0.0 if abs(now.pull) <= now.dry else np.sign(now.pull)
    for side in range(2):
        rate = now.active[1] if side == 0 else now.reverse[1]
        if abs(rate) > GLIDING and (side != s.flank or system.film.minimum == 0.0):
            s.squeezed[side] = 1 if rate < 0.0 else 0
    _outlook(given, s.time, y, g, k[0])


@inner
def _error(given, y, k, h, gaps):
    """Return the error of a step in parts of the tolerance of a narrower gap and its rate, see the constants."""
    system, _, _, _, body = given
    radius, layer = system.surfaces.edged.flanks.gears[1, 0], system.film.minimum
    slack = NARROWEST * (gaps[0] + gaps[1])
    narrow = max(abs(min(gaps[0], gaps[1]) + layer), layer if layer > 0.0 else slack)
    rate = abs(k[END, k.shape[1] - 2])
    error = radius * max(abs(off(k, h, 0)) / narrow, abs(off(k, h, 1)) / (rate + SLOWEST))
    if body >= 0:
        twist, twisting = radius * abs(y[2] - y[0]), radius * abs(y[3] - y[1])
        error = max(
            error, radius * abs(off(k, h, 2)) / (twist + slack), radius * abs(off(k, h, 3)) / (twisting + SLOWEST)
        )
    return error, ROUNDING * radius * abs(y[0]) / narrow


@inner
def _wavers(s, k):
    """Return whether a gap turns at a stage of the step, so that an event may come and go within it."""
    for side in range(2):
        c, sign = k.shape[1] - 2 + side, 1.0 if s.squeezed[side] != 0 else -1.0
        for j in range(3, END):
            if sign * k[j, c] > STILL:
                return True
    return False


@inner
def _longest(given, y):
    """Return the longest step [s] that resolves oscillations on compliant flanks and of a carried body."""
    system, springs, _, s, body = given
    longest = math.inf
    if s.place != FREE:
        mass = system.inertia / system.surfaces.edged.flanks.gears[1, 0] ** 2
        longest = 1.0 / (math.sqrt(springs[0, 0] / mass) + springs[0, 1] / mass)
    if body >= 0:
        row = system.torques[body]
        light = 1.0 / system.inertia + 1.0 / row[INERTIA]
        longest = min(longest, resolved(row, light, y[2] - y[0], y[3] - y[1]))
    return longest


@inner
def forced_step(system, rules, teeth, s, blocks, work, longest):
    """Do one step under forces of the gap; return the fault, or GO_ON, and the event at its end, or ON.

    ``teeth`` (n, 3) are candidate pairs, ``work`` the arrays of :func:`workspace`, ``longest`` [s] limits the step.
    """
    y, end, between, k, dense, g, ahead, values, seen, held = work
    body = body_among(system.torques)
    given, motions, t = (system, rules.springs, teeth, s, body), 2 if body < 0 else 4, s.time
    if s.fresh == 0:
        _wake(given, y, g, k)
    accepted, h = False, 0.0
    while not accepted:
        h = min(s.step, _longest(given, y))
        last = h >= longest
        h = longest if last else 0.5 * longest if 2.0 * h > longest else h
        _attempt(given, t, y, h, k, end, motions)
        gaps = _outlook(given, t + h, end, ahead, k[END])
        error, finest = _error(given, end, k, h, gaps)
        accepted, after, root = judge(h, error / max(rules.tolerance, finest), s.tried, s.error)
        s.step = max(after, s.step) if accepted and last else after
        s.tried, s.error = (h, root) if accepted else (s.tried, s.error)
    event, x, opened = ON, 1.0, _wavers(s, k) or ahead.min() < 0.0
    if opened:
        _open_up(given, t, y, h, k, end, dense, between, motions)
        values[:] = ahead
        event, x = _first(given, t, y, h, _wavers(s, k), dense, between, g, values, seen, held)
    while s.samples < blocks.times.size and blocks.times[s.samples] < t + x * h:
        if not opened:
            _open_up(given, t, y, h, k, end, dense, between, motions)
            opened = True
        part = (blocks.times[s.samples] - t) / h
        blocks.loose[s.samples, 0], blocks.loose[s.samples, 1] = inside(y, dense, part, 0), inside(y, dense, part, 1)
        s.samples += 1
    if x > 0.0:
        for c in range(y.shape[0]):
            between[c] = inside(y, dense, x, c) if event != ON else end[c]
        y[:] = between
        held[:] = 0
        s.time = max(t + x * h, np.nextafter(t, math.inf))
        s.steps += 1
    s.theta, s.omega, s.impulse = y[0], y[1], y[motions]
    if not (math.isfinite(s.theta) and math.isfinite(s.omega)):
        return NO_NUMBER, event
    if body >= 0:
        s.body[0], s.body[1] = y[2], y[3]
    s.fresh = 1
    if event == ON:
        k[0] = k[END]
        g[:] = ahead
        s.height = max(s.height, gaps[s.left])
        return GO_ON, ON
    held[event], s.fresh = 1, 0
    if event == STOPS:
        s.omega = 0.0
    elif event < TOUCHES:
        s.squeezed[event - TURNS] = 1 - s.squeezed[event - TURNS]
    if body >= 0:
        hand_over(system.torques[body], s)
    s.height = max(s.height, gap_of(system, teeth, s, s.left)[0])
    return GO_ON, event
