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

STEPS_PER_RADIAN = 10.0
"""Steps while the undamped contact oscillation turns through one radian."""


def springs_of(rows: Sequence[Row]) -> np.ndarray:
    """Return stiffness [N/m] and damping [N s/m] of every compliant row, (n, 2)."""
    return np.array([row.p[:2] for row in rows if row.code == Code.GAP_SPRING], dtype=float).reshape(-1, 2)


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
    """Return the force of the flank [N]: never negative, none while the gap is open.

    Args:
        springs: stiffness and damping of each row (n, 2).
        gap: m.
        rate: of the gap [m/s].
    """
    total = 0.0
    if gap < 0.0:
        for i in range(springs.shape[0]):
            total += max(0.0, -springs[i, 0] * gap - springs[i, 1] * rate)
    return total


@njit(cache=True)
def _pressed_acceleration(
    plant: Plant, teeth: np.ndarray, side: int, springs: np.ndarray, time: float, theta: float, omega: float
) -> tuple[float, float]:
    """Return the acceleration [rad/s²] and the flank force [N] at one state."""
    angle, speed, _ = drive_at(plant.motion, time)
    gap, by_drive, by_loose, _ = side_gap(plant.surfaces, teeth, side, angle, theta)
    force = gap_force(springs, gap, by_drive * speed + by_loose * omega)
    torque = acceleration(plant.torques, plant.inertia, 1 + side, time, theta, omega, np.sign(omega))
    return torque + force * by_loose / plant.inertia, force


@njit(cache=True)
def _pressed_arc(
    plant: Plant, teeth: np.ndarray, side: int, springs: np.ndarray, start: Arc, duration: float
) -> tuple[Arc, float]:
    """Return the path of a step under the flank's force, and the mean of that force [N]."""
    first, force = _pressed_acceleration(plant, teeth, side, springs, start.time, start.theta, start.omega)
    arc = Arc(start.time, start.theta, start.omega, first, 0.0)
    for _ in range(6):
        early, late = GAUSS[0] * duration, GAUSS[1] * duration
        one, force_one = _pressed_acceleration(
            plant, teeth, side, springs, start.time + early, angle_after(arc, early), speed_after(arc, early)
        )
        two, force_two = _pressed_acceleration(
            plant, teeth, side, springs, start.time + late, angle_after(arc, late), speed_after(arc, late)
        )
        arc, force = through(start, duration, one, two), 0.5 * (force_one + force_two)
    return arc, force


@njit(cache=True)
def plan_pressed(
    plant: Plant, teeth: np.ndarray, side: int, springs: np.ndarray, start: Arc, longest: float
) -> tuple[float, Arc, float, bool]:
    """Return the next step of a compliant contact.

    Args:
        plant: surfaces, motion, torques, inertia.
        teeth: candidate tooth pairs (n, 3).
        side: 0 active, 1 reverse.
        springs: stiffness and damping of each row (n, 2).
        start: where the loose gear is now; acceleration and jerk are not used.
        longest: step wanted [s].

    Returns:
        Duration [s], path, mean flank force [N], and whether the flanks part at its end.
    """
    duration = longest
    for _ in range(8):
        arc, force = _pressed_arc(plant, teeth, side, springs, start, duration)
        gap, rate = gap_along(plant, teeth, side, arc, longest)
        if gap < 0.0 or rate <= 0.0:
            if duration < longest:
                arc, force = _pressed_arc(plant, teeth, side, springs, start, longest)
            return longest, arc, force, False
        low, high = 0.0, longest
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if gap_along(plant, teeth, side, arc, middle)[0] < 0.0:
                low = middle
            else:
                high = middle
        settled = abs(high - duration) <= 1e-15
        duration = high
        if settled:
            break
    arc, force = _pressed_arc(plant, teeth, side, springs, start, duration)
    return duration, arc, force, True
