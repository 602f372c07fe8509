"""Compliant flanks: the gap's own force in place of the impact law, in steps much shorter than a contact."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.effects.rows import Code, Row
from gears3d.engine.closing import GAUSS, HALVINGS, Arc, Plant, angle_after, gap_along, speed_after, through
from gears3d.engine.mesh import side_gap
from gears3d.engine.motion import drive_at
from gears3d.engine.torques import resisting
from gears3d.kernels import njit

PRESSES, TURNS, HALTS, PARTS_NOW = 0, 1, 2, 3
"""How a step of compliant contact ends: pressed on, push begun or ended, loose gear at rest, flanks parted."""
AT_REST = 2.0
"""Stands for the direction of motion of a loose gear that dry torque holds."""
STEPS_PER_RADIAN = 10.0
"""Steps while the undamped contact oscillation turns through one radian."""


def springs_of(rows: Sequence[Row]) -> np.ndarray:
    """Return stiffness [N/m] and damping [N s/m] of all compliant rows together, (1, 2), or (0, 2) without any."""
    found = [row.p[:2] for row in rows if row.code == Code.GAP_SPRING]
    return np.sum(found, axis=0, dtype=float, keepdims=True) if found else np.zeros((0, 2))


def pressed_step(springs: np.ndarray, mass: float) -> float:
    """Return the step [s] that resolves a contact.

    Args:
        springs: of :func:`springs_of`.
        mass: of the loose gear as the flank feels it [kg].
    """
    stiffness, damping = springs.sum(axis=0)
    return 1.0 / (STEPS_PER_RADIAN * (math.sqrt(stiffness / mass) + damping / mass))


def lasting(springs: np.ndarray, mass: float) -> float:
    """Return how long a contact must last to count as permanent: five periods of its oscillation [s].

    Args:
        springs: of :func:`springs_of`.
        mass: of the loose gear as the flank feels it [kg].
    """
    return 10.0 * math.pi * math.sqrt(mass / springs[:, 0].sum())


@njit(cache=True)
def gap_force(springs: np.ndarray, gap: float, rate: float) -> float:
    """Return the force of spring and damper [N]; where it is negative the flanks push no more.

    Args:
        springs: stiffness and damping (1, 2).
        gap: m.
        rate: of the gap [m/s].
    """
    return -springs[0, 0] * gap - springs[0, 1] * rate


@njit(cache=True)
def _force_along(
    plant: Plant, teeth: np.ndarray, side: int, springs: np.ndarray, arc: Arc, after: float
) -> tuple[float, float]:
    """Return the force of spring and damper [N] and its lever on the loose gear [m] along a path."""
    angle, speed, _ = drive_at(plant.motion, arc.time + after)
    gap, by_drive, by_loose, _ = side_gap(plant.surfaces, teeth, side, angle, angle_after(arc, after))
    return gap_force(springs, gap, by_drive * speed + by_loose * speed_after(arc, after)), by_loose


class Push(NamedTuple):
    """What is fixed during one step of a compliant contact.

    Args:
        side: 0 active, 1 reverse.
        pushing: whether the flanks push; a damper can end that while the gap is still closed.
        direction: sign of the loose gear's motion, which dry torques act against; AT_REST where they hold it.
    """

    side: int
    pushing: bool
    direction: float


@njit(cache=True)
def _acceleration_along(
    plant: Plant, teeth: np.ndarray, springs: np.ndarray, push: Push, arc: Arc, after: float
) -> tuple[float, float]:
    """Return the acceleration [rad/s²] and the flank force [N] along a path."""
    force, lever = 0.0, 0.0
    if push.pushing:
        force, lever = _force_along(plant, teeth, push.side, springs, arc, after)
    if push.direction == AT_REST:
        return 0.0, force
    omega, place = speed_after(arc, after), 1 + push.side
    plain, dry = resisting(plant.torques, place, arc.time + after, angle_after(arc, after), omega)
    dry += plant.friction * max(force, 0.0)
    return (force * lever - plain - push.direction * dry) / plant.inertia, force


@njit(cache=True)
def _direction(plant: Plant, teeth: np.ndarray, side: int, springs: np.ndarray, start: Arc, pushing: bool) -> float:
    """Return the sign of motion, at rest that which begins, or AT_REST where dry torque holds."""
    if start.omega != 0.0:
        return np.sign(start.omega)
    force, lever = 0.0, 0.0
    if pushing:
        force, lever = _force_along(plant, teeth, side, springs, start, 0.0)
    plain, dry = resisting(plant.torques, 1 + side, start.time, start.theta, 0.0)
    dry += plant.friction * max(force, 0.0)
    net = force * lever - plain
    return AT_REST if abs(net) <= dry else np.sign(net)


@njit(cache=True)
def _pressed_arc(
    plant: Plant, teeth: np.ndarray, springs: np.ndarray, push: Push, start: Arc, duration: float
) -> tuple[Arc, float]:
    """Return the path of a step under the flank's force, and the mean of that force [N]."""
    here = Arc(start.time, start.theta, start.omega, 0.0, 0.0)
    first, force = _acceleration_along(plant, teeth, springs, push, here, 0.0)
    arc = Arc(start.time, start.theta, start.omega, first, 0.0)
    if duration <= 0.0:
        return arc, force
    for _ in range(6):
        one, force_one = _acceleration_along(plant, teeth, springs, push, arc, GAUSS[0] * duration)
        two, force_two = _acceleration_along(plant, teeth, springs, push, arc, GAUSS[1] * duration)
        arc, force = through(start, duration, one, two), 0.5 * (force_one + force_two)
    return arc, force


@njit(cache=True)
def _ends(plant: Plant, teeth: np.ndarray, springs: np.ndarray, push: Push, arc: Arc, after: float) -> int:
    """Return what has happened ``after`` seconds on a path: nothing, or how it ends."""
    gap, rate = gap_along(plant, teeth, push.side, arc, after)
    if gap >= 0.0 and rate > 0.0:
        return PARTS_NOW
    if push.direction != AT_REST and push.direction * speed_after(arc, after) < 0.0:
        return HALTS
    force = gap_force(springs, gap, rate)
    return TURNS if (force < 0.0) == push.pushing and force != 0.0 else PRESSES


@njit(cache=True)
def plan_pressed(
    plant: Plant, teeth: np.ndarray, side: int, springs: np.ndarray, start: Arc, longest: float, pushing: bool
) -> tuple[float, Arc, float, int]:
    """Return the next step of a compliant contact.

    Args:
        plant: surfaces, motion, torques, inertia.
        teeth: candidate tooth pairs (n, 3).
        side: 0 active, 1 reverse.
        springs: stiffness and damping (1, 2).
        start: where the loose gear is now; acceleration and jerk are not used.
        longest: step wanted [s].
        pushing: whether the flanks push; a damper can end that while the gap is still closed.

    Returns:
        Duration [s], path, mean flank force [N], and PRESSES, TURNS (the push begins or ends), HALTS (the loose gear
        comes to rest) or PARTS_NOW.
    """
    push = Push(side, pushing, _direction(plant, teeth, side, springs, start, pushing))
    arc, force = _pressed_arc(plant, teeth, springs, push, start, longest)
    end = _ends(plant, teeth, springs, push, arc, longest)
    if end == PRESSES:
        return longest, arc, force, PRESSES
    duration = longest
    for _ in range(8):
        low, high = 0.0, longest
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            found = _ends(plant, teeth, springs, push, arc, middle)
            if found == PRESSES:
                low = middle
            else:
                high, end = middle, found
        settled = abs(high - duration) <= 1e-15
        duration = high
        arc, force = _pressed_arc(plant, teeth, springs, push, start, duration)
        if settled:
            break
    return duration, arc, force, end
