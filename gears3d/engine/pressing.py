"""Compliant flanks: the gap's own force in place of the impact law, in steps much shorter than a contact."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit

from gears3d.effects.rows import Code, Row
from gears3d.engine.closing import HALVINGS, Arc, Plant, gap_along
from gears3d.engine.mesh import side_gap
from gears3d.engine.motion import drive_at
from gears3d.engine.torques import acceleration

STEPS_PER_RADIAN = 25.0
"""Steps while the undamped contact oscillation turns through one radian."""


def springs_of(rows: Sequence[Row]) -> np.ndarray:
    """Return stiffness [N/m] and damping [N s/m] of every compliant row, (n, 2)."""
    return np.array([row.p[:2] for row in rows if row.code == Code.GAP_SPRING], dtype=float).reshape(-1, 2)


def pressed_step(springs: np.ndarray, inertia: float, lever: float) -> float:
    """Return the step [s] that resolves a contact.

    Args:
        springs: of :func:`springs_of`.
        inertia: of the loose gear [kg m²].
        lever: of the flank force on it [m].
    """
    stiffness, damping = springs.sum(axis=0)
    rate = math.sqrt(stiffness / inertia) * lever + damping * lever**2 / inertia
    return 1.0 / (STEPS_PER_RADIAN * rate)


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
def plan_pressed(
    plant: Plant, teeth: np.ndarray, side: int, springs: np.ndarray, start: Arc, longest: float
) -> tuple[float, float, float, bool]:
    """Return the next step of a compliant contact.

    Args:
        plant: surfaces, motion, torques, inertia.
        teeth: candidate tooth pairs (n, 3).
        side: 0 active, 1 reverse.
        springs: stiffness and damping of each row (n, 2).
        start: where the loose gear is now; its acceleration is not used.
        longest: step wanted [s].

    Returns:
        Duration [s], acceleration [rad/s²], flank force [N] in its middle, and whether the flanks part at its end.
    """
    first, _ = _pressed_acceleration(plant, teeth, side, springs, start.time, start.theta, start.omega)
    half = 0.5 * longest
    theta = start.theta + (start.omega + 0.5 * first * half) * half
    accel, force = _pressed_acceleration(
        plant, teeth, side, springs, start.time + half, theta, start.omega + first * half
    )
    arc = Arc(start.time, start.theta, start.omega, accel)
    gap, rate = gap_along(plant, teeth, side, arc, longest)
    if gap < 0.0 or rate <= 0.0:
        return longest, accel, force, False
    low, high = 0.0, longest
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        gap, _ = gap_along(plant, teeth, side, arc, middle)
        if gap < 0.0:
            low = middle
        else:
            high = middle
    return high, accel, force, True
