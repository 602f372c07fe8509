"""Permanent contact: the loose gear held on a flank until the flank would have to pull.

Source: Kadmiri et al. 2012, eqs (21) and (22), with the reaction taken from the contact Jacobian.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gears3d.engine.closing import HALVINGS, PARTS, Plant
from gears3d.engine.mesh import side_gap
from gears3d.engine.motion import drive_at
from gears3d.engine.torques import resisting

DIFFERENCE = 2e-6
"""Half-width of the differences of the flank's speed along the imposed motion [s]."""


@njit(cache=True)
def on_flank(plant: Plant, teeth: np.ndarray, side: int, time: float, guess: float) -> tuple[float, float]:
    """Return the loose gear's angle [rad] and speed [rad/s] that keep the gap of one side closed.

    Args:
        plant: surfaces, motion, torques, inertia.
        teeth: candidate tooth pairs (n, 3).
        side: 0 active, 1 reverse.
        time: s.
        guess: angle to start from [rad].
    """
    angle, speed, _ = drive_at(plant.motion, time)
    theta, by_drive, by_loose = guess, 0.0, 1.0
    for _ in range(8):
        gap, by_drive, by_loose, _ = side_gap(plant.surfaces, teeth, side, angle, theta)
        theta -= gap / by_loose
        if abs(gap) < 1e-13:
            break
    return theta, -by_drive / by_loose * speed


@njit(cache=True)
def reaction(plant: Plant, teeth: np.ndarray, side: int, time: float, guess: float) -> float:
    """Return the flank's normal force [N] that permanent contact needs; negative when it would have to pull."""
    theta, omega = on_flank(plant, teeth, side, time, guess)
    step = omega * DIFFERENCE
    _, before = on_flank(plant, teeth, side, time - DIFFERENCE, theta - step)
    _, after = on_flank(plant, teeth, side, time + DIFFERENCE, theta + step)
    alpha = (after - before) / (2.0 * DIFFERENCE)
    angle, _, _ = drive_at(plant.motion, time)
    _, _, by_loose, _ = side_gap(plant.surfaces, teeth, side, angle, theta)
    plain, dry = resisting(plant.torques, 1 + side, time, theta, omega)
    needed = plant.inertia * alpha + plain
    if omega != 0.0:
        return (needed + np.sign(omega) * dry) / by_loose
    # at rest dry torque takes whatever part it can: the flank must push only if it cannot
    return (needed + np.sign(by_loose) * dry) / by_loose


@njit(cache=True)
def plan_contact(
    plant: Plant, teeth: np.ndarray, side: int, time: float, theta: float, longest: float
) -> tuple[float, bool]:
    """Return how long contact lasts, at most ``longest`` seconds, and whether it is lost then."""
    weak = -1e-7 * plant.inertia
    if reaction(plant, teeth, side, time, theta) < weak:
        return 0.0, True
    _, omega = on_flank(plant, teeth, side, time, theta)
    low = 0.0
    for part in range(1, PARTS + 1):
        high = longest * part / PARTS
        if reaction(plant, teeth, side, time + high, theta + omega * high) < weak:
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                if reaction(plant, teeth, side, time + middle, theta + omega * middle) < weak:
                    high = middle
                else:
                    low = middle
            return high, True
        low = high
    return longest, False
