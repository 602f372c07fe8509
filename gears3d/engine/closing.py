"""When a flight ends: the first instant at which a flank gap, measured on the surfaces, closes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.engine.brackets import above, first_bracket, narrowed, proposed, wider
from gears3d.engine.compile import inner
from gears3d.engine.films import NO_FILM, Film
from gears3d.engine.mesh import Mesh, call_side
from gears3d.engine.motion import drive_at
from gears3d.engine.torques import FREE, acceleration
from gears3d.records import Floats2, Record

# How a step ends: no event, a gap closes on the active or reverse flank, the loose gear comes to rest.
NOTHING, CLOSES_ACTIVE, CLOSES_REVERSE, STOPS = 0, 1, 2, 3

TOUCH = 1e-11  # A smaller gap counts as closed [m]
PARTS = 4  # evaluations of both gaps within a step
GLIDING = 1e-9  # rounding of the rate of a gap just after separation [m/s]: the gap may still open
UNSEEN = 1e-13  # smallest gap above rounding [m]
LEAST_RATE = 1e-15  # stands for the rate of a gap just after separation, of which rounding leaves nothing [m/s]
HALVINGS = 60  # Of an interval: 2**-60, below the rounding of its ends
# Both points of Gauss-Legendre quadrature, in parts of a step.
GAUSS = (0.5 - 0.5 / 3.0**0.5, 0.5 + 0.5 / 3.0**0.5)


class ContactSystem(Record):
    """The constants of a run.

    Args:
        surfaces: flanks and edges.
        motion: table of the drive gear's motion.
        torques: table of the loose gear's torques.
        gated: whether some of them act in flight or in contact only.
        inertia: of the loose gear [kg m²].
        friction: torque against the loose gear's motion over the flank force [m].
        film: of oil, between the flanks.
    """

    surfaces: Mesh
    motion: Floats2
    torques: Floats2
    gated: bool
    inertia: float
    friction: float = 0.0
    film: Film = NO_FILM


class Arc(NamedTuple):
    """A stretch of flight: a parabola, or a cubic where the torque changes.

    Args:
        time: at which it starts [s].
        theta: angle of the loose gear there [rad].
        omega: speed there [rad/s].
        accel: acceleration there [rad/s²].
        jerk: its rate of change throughout [rad/s³].
    """

    time: float
    theta: float
    omega: float
    accel: float
    jerk: float


@inner
def angle_after(arc, after):
    """Return the loose gear's angle ``after`` seconds [rad]."""
    return arc.theta + (arc.omega + (0.5 * arc.accel + arc.jerk * after / 6.0) * after) * after


@inner
def speed_after(arc, after):
    """Return the loose gear's speed ``after`` seconds [rad/s]."""
    return arc.omega + (arc.accel + 0.5 * arc.jerk * after) * after


@inner
def through(start: Arc, duration: float, first: float, second: float) -> Arc:
    """Return the arc whose acceleration has these values at the two Gauss points of a step [rad/s²]."""
    jerk = (second - first) / (GAUSS[1] - GAUSS[0]) / duration
    return Arc(start.time, start.theta, start.omega, first - GAUSS[0] * duration * jerk, jerk)


@inner
def flight_arc(system: ContactSystem, place: int, start: Arc, duration: float) -> Arc:
    """Return the flight under the torques for ``duration`` [s]: exact for constant ones, else of fourth order.

    ``place`` is FREE, ON_ACTIVE or ON_REVERSE; acceleration and jerk of ``start`` are not used.
    """
    torques, inertia = system.torques, system.inertia
    direction = np.sign(start.omega)
    first = acceleration(torques, inertia, place, start.time, start.theta, start.omega, direction)
    if direction == 0.0:
        direction = np.sign(first)
    arc = Arc(start.time, start.theta, start.omega, first, 0.0)
    if duration <= 0.0:
        return arc
    for _ in range(3):
        early, late = GAUSS[0] * duration, GAUSS[1] * duration
        values = (
            acceleration(
                torques, inertia, place, start.time + early, angle_after(arc, early), speed_after(arc, early), direction
            ),
            acceleration(
                torques, inertia, place, start.time + late, angle_after(arc, late), speed_after(arc, late), direction
            ),
        )
        if values[0] == first and values[1] == first:
            break
        arc = through(start, duration, values[0], values[1])
    return arc


@inner
def gap_along(system: ContactSystem, teeth: np.ndarray, side: int, arc: Arc, after: float) -> tuple[float, float]:
    """Return gap [m] and gap rate [m/s] of one side, ``after`` seconds into a flight."""
    angle, speed, _ = drive_at(system.motion, arc.time + after)
    gap, by_drive, by_loose, _ = call_side(
        system.surfaces.side, (system.surfaces, teeth, side, angle, angle_after(arc, after))
    )
    return gap, by_drive * speed + by_loose * speed_after(arc, after)


@inner
def closing_within(system: ContactSystem, teeth: np.ndarray, side: int, arc: Arc, longest: float) -> float:
    """Return when the gap of one side first closes, or -1 if it stays open for ``longest`` seconds.

    A gap that starts closed and is opening must first open; a minimum between two evaluations is found, too.
    """
    low = 0.0
    gap_low, rate_low = gap_along(system, teeth, side, arc, 0.0)
    if gap_low < -TOUCH and rate_low <= 0.0:
        return 0.0
    for part in range(1, PARTS + 1):
        high = longest * part / PARTS
        gap_high, rate_high = gap_along(system, teeth, side, arc, high)
        if gap_high <= (-TOUCH if gap_low <= TOUCH else 0.0):
            start = low
            closed = 0.0
            if gap_low <= TOUCH:
                start = _turn(system, teeth, side, arc, low, high, 1.0)
                if gap_along(system, teeth, side, arc, start)[0] <= UNSEEN:  # it does not open by more than rounding
                    closed = -TOUCH
            return _root(system, teeth, side, arc, start, high, closed)
        if rate_low < 0.0 < rate_high and gap_low > TOUCH:
            dip = _turn(system, teeth, side, arc, low, high, -1.0)
            gap_dip, _ = gap_along(system, teeth, side, arc, dip)
            if gap_dip < -TOUCH:
                return _root(system, teeth, side, arc, low, dip, 0.0)
        low, gap_low, rate_low = high, gap_high, rate_high
    return -1.0


@inner
def _turn(system: ContactSystem, teeth: np.ndarray, side: int, arc: Arc, low: float, high: float, sign: float) -> float:
    """Return where the gap rate, of this sign at ``low``, changes it: the top (+1) or bottom (-1) of the gap."""
    first = sign * gap_along(system, teeth, side, arc, low)[1]
    last = sign * gap_along(system, teeth, side, arc, high)[1]
    if first <= -GLIDING:
        return low
    bracket = first_bracket(low, max(first, LEAST_RATE), high, last)
    while wider(bracket, arc.time):
        at = proposed(bracket, arc.time)
        bracket = narrowed(bracket, at, sign * gap_along(system, teeth, side, arc, at)[1])
    return above(bracket)


@inner
def _root(
    system: ContactSystem, teeth: np.ndarray, side: int, arc: Arc, low: float, high: float, closed: float
) -> float:
    """Return where the gap, above ``closed`` at ``low``, falls to that: Newton's method in a shrinking bracket."""
    at = high
    for _ in range(2 * HALVINGS):
        gap, rate = gap_along(system, teeth, side, arc, at)
        gap -= closed
        if gap > 0.0:
            low = at
        else:
            high = at
        new = at - gap / rate if rate < 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - at) <= 1e-16 + 1e-16 * abs(arc.time):
            return new
        at = new
    return high


@inner
def _stop_within(arc: Arc, longest: float) -> float:
    """Return when the loose gear comes to rest, or -1 if its speed keeps its sign."""
    if arc.omega * speed_after(arc, longest) >= 0.0:
        return -1.0
    low, high = 0.0, longest
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if arc.omega * speed_after(arc, middle) > 0.0:
            low = middle
        else:
            high = middle
    return high


@inner
def plan_flight(
    system: ContactSystem, teeth: np.ndarray, start: Arc, longest: float, left: int
) -> tuple[float, Arc, int, float]:
    """Return how long the next step of a flight is [s], its path, how it ends, and how far it gets from a flank [m].

    ``teeth`` (n, 3) are candidate pairs: drive, loose, side. Acceleration and jerk of ``start`` are not used;
    ``longest`` [s] limits the step. The end is NOTHING, CLOSES_ACTIVE, CLOSES_REVERSE or STOPS; the last number is the
    largest gap of the flank ``left``.
    """
    duration, event = longest, NOTHING
    arc = flight_arc(system, FREE, start, duration)
    for _ in range(6):
        reach, found = longest, NOTHING
        stop = _stop_within(arc, longest)
        if stop >= 0.0:
            reach, found = stop, STOPS
        for side in range(2):
            root = closing_within(system, teeth, side, arc, reach)
            if root >= 0.0:
                reach, found = root, CLOSES_ACTIVE + side
        settled = abs(reach - duration) <= 1e-15
        duration, event = reach, found
        if settled:
            break
        new = flight_arc(system, FREE, start, duration)
        if new.accel == arc.accel and new.jerk == arc.jerk:
            break
        arc = new
    return duration, arc, event, highest(system, teeth, left, arc, duration)


@inner
def highest(system: ContactSystem, teeth: np.ndarray, side: int, arc: Arc, duration: float) -> float:
    """Return the largest gap of one side during a step of flight [m]."""
    _, rate_low = gap_along(system, teeth, side, arc, 0.0)
    gap_high, rate_high = gap_along(system, teeth, side, arc, duration)
    if rate_low > -GLIDING and rate_high < 0.0:
        top, _ = gap_along(system, teeth, side, arc, _turn(system, teeth, side, arc, 0.0, duration, 1.0))
        return max(top, gap_high)
    return gap_high
