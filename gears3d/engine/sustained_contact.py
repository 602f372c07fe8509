"""Permanent contact: the loose gear stays on a flank until the flank would have to pull.

Source: Kadmiri et al. 2012, eqs (21) and (22), with the reaction taken from the contact Jacobian.
"""

from __future__ import annotations

import math

import numpy as np

from gears3d.engine.brackets import below, first_bracket, narrowed, proposed, wider
from gears3d.engine.carried import body_among
from gears3d.engine.closing import Arc, ContactSystem, flight_arc, gap_along
from gears3d.engine.compile import entry, inner
from gears3d.engine.films import film_push
from gears3d.engine.mesh import call_side
from gears3d.engine.motion import drive_at
from gears3d.engine.torques import FREE, resisting

# How a step of permanent contact ends: still in contact, contact lost, or an impact of another tooth pair.
HELD, LOST, MEETS = 0, 1, 2
LOOKS = 2  # evaluations of the reaction within a step
DIFFERENCE = 2e-6  # half-width of the finite differences of the flank's speed along the imposed motion [s]
AHEAD = 0.5 * DIFFERENCE  # time after which a flight must have opened the gap, if contact is lost [s]


@entry
def on_flank(system: ContactSystem, teeth: np.ndarray, side: int, time: float, guess: float) -> tuple[float, float]:
    """Return the loose gear's angle [rad] and speed [rad/s] that keep the gap of one side closed at a time [s].

    ``teeth`` (n, 3) are candidate pairs, ``side`` is 0 active, 1 reverse, ``guess`` the angle to start from [rad].
    """
    angle, speed, _ = drive_at(system.motion, time)
    theta, by_drive, by_loose = guess, 0.0, 1.0
    for _ in range(8):
        gap, by_drive, by_loose, _ = call_side(system.surfaces.side, (system.surfaces, teeth, side, angle, theta))
        theta -= gap / by_loose
        if abs(gap) < 1e-11:  # the error after the last step is less than its square
            break
    return theta, -by_drive / by_loose * speed


@inner
def reaction(system: ContactSystem, held: np.ndarray, teeth: np.ndarray, side: int, time: float, guess: float) -> float:
    """Return the normal force [N] for permanent contact of the held teeth; negative where it would have to pull.

    Where torques of contact would separate the flanks and those of flight would close them again, contact lasts: the
    force is the larger of the two.
    """
    theta, omega = on_flank(system, held, side, time, guess)
    step = omega * DIFFERENCE
    _, before = on_flank(system, held, side, time - DIFFERENCE, theta - step)
    _, after = on_flank(system, held, side, time + DIFFERENCE, theta + step)
    alpha = (after - before) / (2.0 * DIFFERENCE)
    angle, _, _ = drive_at(system.motion, time)
    _, _, by_loose, _ = call_side(system.surfaces.side, (system.surfaces, held, side, angle, theta))
    # at rest dry torque acts first: the flank must push only beyond its limit
    against = np.sign(omega) if omega != 0.0 else np.sign(by_loose)
    plain, dry = resisting(system.torques, 1 + side, time, theta, omega)
    lever = by_loose - against * system.friction
    needed = system.inertia * alpha - _oil_torque(system, teeth, side, time, theta, omega)
    force = (needed + plain + against * dry) / lever
    if system.gated:
        plain, dry = resisting(system.torques, FREE, time, theta, omega)
        force = max(force, (needed + plain + against * dry) / lever)
    return force


@inner
def _oil_torque(system: ContactSystem, teeth: np.ndarray, side: int, time: float, theta: float, omega: float) -> float:
    """Return the torque of both films on a loose gear that touches one flank [N m]."""
    if system.film.minimum == 0.0:
        return 0.0
    angle, speed, _ = drive_at(system.motion, time)
    torque = 0.0
    for flank in range(2):
        gap, by_drive, by_loose, _ = call_side(system.surfaces.side, (system.surfaces, teeth, flank, angle, theta))
        rate = by_drive * speed + by_loose * omega if flank != side else 0.0
        torque += by_loose * film_push(system.film, gap, rate, rate < 0.0, (speed, omega))
    return torque


@inner
def resolution(theta: float) -> float:
    """Return the smallest difference of two gaps above rounding at an angle [rad], in m."""
    return 1e-13 + 2e-16 * abs(theta)


@inner
def softly(system: ContactSystem, time: float, stick_velocity: float) -> float:
    """Return the approach speed below which the next tooth pair takes over without an impact [m/s].

    It is the stick velocity or, at high speeds, the speed that an edge gains while its gap is below rounding.
    """
    angle, speed, _ = drive_at(system.motion, time)
    radius = system.surfaces.edged.flanks.gears[0, 0]
    return max(stick_velocity, 2.0 * abs(speed) * math.sqrt(2.0 * radius * resolution(angle)))


@entry
def supporting(
    system: ContactSystem, teeth: np.ndarray, side: int, time: float, theta: float, soft: float
) -> tuple[int, float]:
    """Return which of the touching tooth pairs carries the loose gear, and its reaction [N].

    Of several pairs that touch, the one counts whose flank moves fastest towards the loose gear's, and of those as
    fast (to within ``soft`` [m/s]) the one with the largest reaction: on any other the loose gear would overlap
    with it.
    """
    angle, speed, _ = drive_at(system.motion, time)
    least = call_side(system.surfaces.side, (system.surfaces, teeth, side, angle, theta))[0]
    best, force, fastest = -1, 0.0, 0.0
    for i in range(teeth.shape[0]):
        if teeth[i, 2] != side:
            continue
        gap, by_drive, by_loose, _ = call_side(
            system.surfaces.side, (system.surfaces, teeth[i : i + 1], side, angle, theta)
        )
        if gap > least + resolution(theta):
            continue
        push = -by_drive / abs(by_loose) * speed
        same = soft / abs(by_loose)
        own = reaction(system, teeth[i : i + 1], teeth, side, time, theta)
        if best < 0 or push > fastest + same or (push > fastest - same and own > force):
            best, force, fastest = i, own, push
    return best, force


@inner
def plan_contact(
    system: ContactSystem, teeth: np.ndarray, side: int, start: Arc, longest: float, soft: float
) -> tuple[float, int, int]:
    """Return how the next step of permanent contact ends: duration [s], HELD, LOST or MEETS, and the row of ``teeth``.

    LOST: the flank would have to pull; MEETS: an impact of another pair; the row's teeth are in contact until then.
    ``teeth`` (n, 3) are candidate pairs, ``side`` is 0 active, 1 reverse; the acceleration of ``start`` is not used;
    ``longest`` [s] limits the step. A next pair takes over without an impact up to the approach speed ``soft`` [m/s].
    """
    weak = -1e-7 * system.inertia
    row, force = supporting(system, teeth, side, start.time, start.theta, soft)
    if not force >= weak:
        return 0.0, LOST, row
    low, part = 0.0, 1
    for _ in range(LOOKS + 8):
        high = longest * part / LOOKS
        held = teeth[row : row + 1]
        lost = _lost_between(system, held, teeth, side, start, low, high, weak)
        end = high if lost < 0.0 else lost
        meets = _meets_between(system, teeth, held, side, start, low, end)
        if meets < 0.0 and lost < 0.0:
            low = high
            part += 1
            if part > LOOKS:
                break
            continue
        end = lost if meets < 0.0 else meets
        theta, omega = _held_at(system, held, side, start, end)
        new, force = supporting(system, teeth, side, start.time + end, theta, soft)
        if meets >= 0.0:
            angle, speed, _ = drive_at(system.motion, start.time + end)
            _, by_drive, by_loose, other = call_side(system.surfaces.side, (system.surfaces, teeth, side, angle, theta))
            if by_drive * speed + by_loose * omega < -soft:
                return end, MEETS, row
            new = other if new == row else new
        if force < weak or new == row:
            return end, LOST, row
        if end > 0.0:
            return end, HELD, row
        row = new
    return low, HELD, row


@inner
def _held_at(system: ContactSystem, held: np.ndarray, side: int, start: Arc, after: float) -> tuple[float, float]:
    """Return angle and speed of the loose gear on the held teeth, ``after`` seconds into the step."""
    return on_flank(system, held, side, start.time + after, start.theta + start.omega * after)


@inner
def _lost_between(
    system: ContactSystem,
    held: np.ndarray,
    teeth: np.ndarray,
    side: int,
    start: Arc,
    low: float,
    high: float,
    weak: float,
) -> float:
    """Return when the reaction of the held teeth falls below ``weak``, or -1 if it does not at ``high``."""
    at_high = _strength(system, held, teeth, side, start, high) - weak
    if at_high >= 0.0:
        return -1.0
    at_low = _strength(system, held, teeth, side, start, low) - weak
    if at_low < 0.0:
        return low
    bracket = first_bracket(low, at_low, high, at_high)
    while wider(bracket, start.time):
        at = proposed(bracket, start.time)
        bracket = narrowed(bracket, at, _strength(system, held, teeth, side, start, at) - weak)
    return below(bracket)


@inner
def _strength(system: ContactSystem, held: np.ndarray, teeth: np.ndarray, side: int, start: Arc, after: float) -> float:
    """Return the reaction of the held teeth ``after`` seconds into the step [N].

    Its differences reach beyond a slope discontinuity that is yet to come. There the teeth are still in contact if a
    flight, under torques alone, would at once close their gap again.
    """
    time, guess = start.time + after, start.theta + start.omega * after
    force = reaction(system, held, teeth, side, time, guess)
    if force >= 0.0 or system.film.minimum > 0.0 or body_among(system.torques) >= 0:
        return force
    theta, omega = on_flank(system, held, side, time, guess)
    flight = flight_arc(system, FREE, Arc(time, theta, omega, 0.0, 0.0), AHEAD)
    return 0.0 if gap_along(system, held, side, flight, AHEAD)[0] < -resolution(theta) else force


@inner
def _meets_between(
    system: ContactSystem, teeth: np.ndarray, held: np.ndarray, side: int, start: Arc, low: float, high: float
) -> float:
    """Return when another pair than the held one first overlaps, or -1 if none does at ``high``."""
    at_high = _room(system, teeth, held, side, start, high)
    if at_high >= 0.0:
        return -1.0
    at_low = _room(system, teeth, held, side, start, low)
    if at_low < 0.0:
        return low
    bracket = first_bracket(low, at_low, high, at_high)
    while wider(bracket, start.time):
        at = proposed(bracket, start.time)
        bracket = narrowed(bracket, at, _room(system, teeth, held, side, start, at))
    return below(bracket)


@inner
def _room(system: ContactSystem, teeth: np.ndarray, held: np.ndarray, side: int, start: Arc, after: float) -> float:
    """Return the smallest gap while the held pair touches, negative where some pair of teeth overlaps [m]."""
    theta, _ = _held_at(system, held, side, start, after)
    angle, _, _ = drive_at(system.motion, start.time + after)
    return call_side(system.surfaces.side, (system.surfaces, teeth, side, angle, theta))[0] + resolution(theta)
