"""Steps under forces of the gap: compliant flanks and films of oil.

Films act all the time, so flight, passage and rest on the film are one motion. A step is short against the time in
which a film's thickness or force changes, and ends where a law changes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from gears3d.engine.closing import GAUSS, Arc, Plant, angle_after, gap_along, speed_after, through
from gears3d.engine.compile import inner
from gears3d.engine.films import film_push
from gears3d.engine.mesh import call_side
from gears3d.engine.motion import drive_at
from gears3d.engine.pressing import gap_force
from gears3d.engine.torques import FREE, resisting

AT_REST = 2.0  # direction of motion of a loose gear that dry torque keeps at rest
NOBODY = -1  # stands for no flank
# How a step ends: no event, the loose gear at rest; then, one more on the reverse flank: a gap begins or ceases to
# close, flanks touch, compliant flanks begin or cease to push, they separate, a passage begins, or ends.
ON, HALTS, TURNS, TOUCHES, FLIPS, CLEARS, ENTERS, LEAVES = 0, 1, 2, 4, 6, 8, 10, 12
STILL = 1e-13  # rate below which a gap is at a turning point, within rounding [m/s]
THINNER = 0.05  # largest change of a film in a step, as a part of its thickness
# Steps in the time constants of a film: of the decay of a rate under the squeeze, of a radian on the wedge.
DAMPED, SWINGS = 0.3, 0.2
BISECTIONS = 40
SAME = 1e-13  # accuracy to which the duration of a step is that of its event [s]


class Forces(NamedTuple):
    """The constants of one step.

    Args:
        direction: sign of the loose gear's motion, which dry torques act against; AT_REST where they keep it at rest.
        squeezed: whether the film of the active and of the reverse flank is being squeezed.
        touching: compliant flank in contact with the loose gear, or NOBODY.
        pushing: whether it pushes; a damper can end that while the gap is still closed.
        within: flank whose passage is under way, or NOBODY.
    """

    direction: float
    squeezed: tuple[bool, bool]
    touching: int
    pushing: bool
    within: int


@inner
def pushed(
    plant: Plant, teeth: np.ndarray, springs: np.ndarray, forces: Forces, arc: Arc, after: float
) -> tuple[float, float, float]:
    """Return the effect of films and compliant flank ``after`` seconds on a path: a torque [N m] and two forces [N].

    The torque is theirs on the loose gear; the forces are that on the flank whose passage is under way and that of the
    compliant flank. ``teeth`` (n, 3) are candidate pairs, ``springs`` stiffness and damping (1, 2), or (0, 2).
    """
    angle, speed, _ = drive_at(plant.motion, arc.time + after)
    theta, omega = angle_after(arc, after), speed_after(arc, after)
    torque, passing, spring = 0.0, 0.0, 0.0
    dry = plant.film.minimum == 0.0
    for side in range(2):
        if dry and side != forces.touching:
            continue
        gap, by_drive, by_loose, _ = call_side(plant.surfaces.side, (plant.surfaces, teeth, side, angle, theta))
        rate = by_drive * speed + by_loose * omega
        force = 0.0 if dry else film_push(plant.film, gap, rate, forces.squeezed[side], (speed, omega))
        if side == forces.touching and forces.pushing:
            spring = gap_force(springs, gap, rate)
            force += spring
        torque += force * by_loose
        if side == forces.within:
            passing = force
    return torque, passing, spring


@inner
def _acceleration(
    plant: Plant, teeth: np.ndarray, springs: np.ndarray, forces: Forces, arc: Arc, after: float
) -> tuple[float, float]:
    """Return the acceleration [rad/s²], and the force on the flank whose passage is under way [N], along a path."""
    torque, passing, spring = pushed(plant, teeth, springs, forces, arc, after)
    if forces.direction == AT_REST:
        return 0.0, passing
    place = FREE if forces.touching == NOBODY else 1 + forces.touching
    plain, dry = resisting(plant.torques, place, arc.time + after, angle_after(arc, after), speed_after(arc, after))
    dry += plant.friction * max(spring, 0.0)
    return (torque - plain - forces.direction * dry) / plant.inertia, passing


@inner
def direction_of(plant: Plant, teeth: np.ndarray, springs: np.ndarray, forces: Forces, start: Arc) -> float:
    """Return the sign of motion, at rest that which begins, or AT_REST where dry torque keeps the gear at rest."""
    if start.omega != 0.0:
        return np.sign(start.omega)
    torque, _, spring = pushed(plant, teeth, springs, forces, start, 0.0)
    place = FREE if forces.touching == NOBODY else 1 + forces.touching
    plain, dry = resisting(plant.torques, place, start.time, start.theta, 0.0)
    dry += plant.friction * max(spring, 0.0)
    net = torque - plain
    return AT_REST if abs(net) <= dry else np.sign(net)


@inner
def stride(plant: Plant, teeth: np.ndarray, start: Arc, acceleration: float) -> float:
    """Return the longest step that both films allow [s], infinite without oil.

    ``teeth`` (n, 3) are candidate pairs, ``start`` and ``acceleration`` [rad/s²] those of the loose gear now.
    """
    angle, speed, alpha = drive_at(plant.motion, start.time)
    film, longest = plant.film, math.inf
    if film.minimum == 0.0:
        return longest
    for side in range(2):
        gap, by_drive, by_loose, _ = call_side(plant.surfaces.side, (plant.surfaces, teeth, side, angle, start.theta))
        rate = by_drive * speed + by_loose * start.omega
        bend = abs(by_drive * alpha + by_loose * acceleration)
        mass = plant.inertia / by_loose**2
        thickness = max(gap, 0.0) + film.minimum
        change = THINNER * thickness
        longest = min(longest, 2.0 * change / (abs(rate) + math.sqrt(rate * rate + 2.0 * bend * change) + 1e-300))
        decay = film.squeeze / (mass * thickness**1.5)
        stiff = film_push(film, gap, -abs(rate), True, (speed, start.omega)) / (mass * thickness)
        longest = min(longest, DAMPED / (decay + 1e-300), SWINGS / math.sqrt(1.5 * abs(stiff) + 1e-300))
    return longest


@inner
def _path(
    plant: Plant, teeth: np.ndarray, springs: np.ndarray, forces: Forces, start: Arc, duration: float
) -> tuple[Arc, float]:
    """Return the path of a step, and the mean force on the flank whose passage is under way [N]."""
    here = Arc(start.time, start.theta, start.omega, 0.0, 0.0)
    first, force = _acceleration(plant, teeth, springs, forces, here, 0.0)
    arc = Arc(start.time, start.theta, start.omega, first, 0.0)
    if duration <= 0.0:
        return arc, force
    for _ in range(8):
        one, force_one = _acceleration(plant, teeth, springs, forces, arc, GAUSS[0] * duration)
        two, force_two = _acceleration(plant, teeth, springs, forces, arc, GAUSS[1] * duration)
        new, force = through(start, duration, one, two), 0.5 * (force_one + force_two)
        moved = abs(new.accel - arc.accel) + abs(new.jerk - arc.jerk) * duration
        arc = new
        if moved <= 1e-12 * (abs(one) + abs(two)):
            break
    return arc, force


@inner
def _ends(plant: Plant, teeth: np.ndarray, springs: np.ndarray, forces: Forces, arc: Arc, after: float) -> int:
    """Return the event ``after`` seconds on a path, ON for none."""
    if forces.direction != AT_REST and forces.direction * speed_after(arc, after) < 0.0:
        return HALTS
    dry = plant.film.minimum == 0.0
    for side in range(2):
        if dry and side != forces.touching:
            continue
        gap, rate = gap_along(plant, teeth, side, arc, after)
        if not dry and rate * (-1.0 if forces.squeezed[side] else 1.0) < -STILL:
            return TURNS + side
        if side == forces.touching:
            if gap >= 0.0 and rate > 0.0:
                return CLEARS + side
            force = gap_force(springs, gap, rate)
            if (force < 0.0) == forces.pushing and force != 0.0:
                return FLIPS + side
        elif gap < 0.0 and rate < -STILL:
            return TOUCHES + side
        if forces.within == NOBODY and gap < plant.film.felt and rate < 0.0:
            return ENTERS + side
        if forces.within == side and gap > plant.film.felt and rate > 0.0:
            return LEAVES + side
    return ON


@inner
def plan_forced(
    plant: Plant, teeth: np.ndarray, springs: np.ndarray, state: Forces, start: Arc, steps: tuple[float, float]
) -> tuple[float, Arc, float, int]:
    """Return the next step under forces of the gap: duration [s], path, impulse [N s] on the flank in passage, its end.

    ``teeth`` (n, 3) are candidate pairs, ``springs`` stiffness and damping (1, 2), or (0, 2). ``state`` gives the
    flanks that matter, not the direction; acceleration and jerk of ``start`` are not used. ``steps`` is the longest
    step [s], and the part used of the step that the films allow.
    """
    direction = direction_of(plant, teeth, springs, state, start)
    forces = Forces(direction, state.squeezed, state.touching, state.pushing, state.within)
    first, _ = _acceleration(plant, teeth, springs, forces, Arc(start.time, start.theta, start.omega, 0.0, 0.0), 0.0)
    longest = min(steps[0], steps[1] * stride(plant, teeth, start, first))
    arc, force = _path(plant, teeth, springs, forces, start, longest)
    end = _ends(plant, teeth, springs, forces, arc, longest)
    if end == ON:
        return longest, arc, force * longest, ON
    duration = longest
    for _ in range(8):
        low, high = 0.0, longest
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            found = _ends(plant, teeth, springs, forces, arc, middle)
            if found == ON:
                low = middle
            else:
                high, end = middle, found
        settled = abs(high - duration) <= SAME
        duration = high
        arc, force = _path(plant, teeth, springs, forces, start, duration)
        if settled:
            break
    return duration, arc, force * duration, end
