"""Compliant flanks: the gap's own force in place of the impact law, in steps much shorter than a contact."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit

from gears3d.effects.rows import Code, Row
from gears3d.engine.closing import GAUSS, HALVINGS, Arc, Plant, angle_after, gap_along, speed_after, through
from gears3d.engine.mesh import side_gap
from gears3d.engine.motion import drive_at
from gears3d.engine.torques import acceleration

PRESSES, TURNS, PARTS_NOW = 0, 1, 2
"""How a step of compliant contact ends: pressed on, push begun or ended, flanks parted."""
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


@njit(cache=True)
def _acceleration_along(
    plant: Plant, teeth: np.ndarray, side: int, springs: np.ndarray, arc: Arc, after: float, pushing: bool
) -> tuple[float, float]:
    """Return the acceleration [rad/s²] and the flank force [N] along a path."""
    force, lever = 0.0, 0.0
    if pushing:
        force, lever = _force_along(plant, teeth, side, springs, arc, after)
    omega = speed_after(arc, after)
    torque = acceleration(
        plant.torques, plant.inertia, 1 + side, arc.time + after, angle_after(arc, after), omega, np.sign(omega)
    )
    return torque + force * lever / plant.inertia, force


@njit(cache=True)
def _pressed_arc(
    plant: Plant, teeth: np.ndarray, side: int, springs: np.ndarray, start: Arc, duration: float, pushing: bool
) -> tuple[Arc, float]:
    """Return the path of a step under the flank's force, and the mean of that force [N]."""
    here = Arc(start.time, start.theta, start.omega, 0.0, 0.0)
    first, force = _acceleration_along(plant, teeth, side, springs, here, 0.0, pushing)
    arc = Arc(start.time, start.theta, start.omega, first, 0.0)
    if duration <= 0.0:
        return arc, force
    for _ in range(6):
        one, force_one = _acceleration_along(plant, teeth, side, springs, arc, GAUSS[0] * duration, pushing)
        two, force_two = _acceleration_along(plant, teeth, side, springs, arc, GAUSS[1] * duration, pushing)
        arc, force = through(start, duration, one, two), 0.5 * (force_one + force_two)
    return arc, force


@njit(cache=True)
def _ends(
    plant: Plant, teeth: np.ndarray, side: int, springs: np.ndarray, arc: Arc, after: float, pushing: bool
) -> int:
    """Return what has happened ``after`` seconds on a path: nothing, force turned, or flanks parted."""
    gap, rate = gap_along(plant, teeth, side, arc, after)
    if gap >= 0.0 and rate > 0.0:
        return PARTS_NOW
    force = gap_force(springs, gap, rate)
    return TURNS if (force < 0.0) == pushing and force != 0.0 else PRESSES


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
        Duration [s], path, mean flank force [N], and PRESSES, TURNS (the push begins or ends) or PARTS_NOW.
    """
    arc, force = _pressed_arc(plant, teeth, side, springs, start, longest, pushing)
    end = _ends(plant, teeth, side, springs, arc, longest, pushing)
    if end == PRESSES:
        return longest, arc, force, PRESSES
    duration = longest
    for _ in range(8):
        low, high = 0.0, longest
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            found = _ends(plant, teeth, side, springs, arc, middle, pushing)
            if found == PRESSES:
                low = middle
            else:
                high, end = middle, found
        settled = abs(high - duration) <= 1e-15
        duration = high
        arc, force = _pressed_arc(plant, teeth, side, springs, start, duration, pushing)
        if settled:
            break
    return duration, arc, force, end
