"""The body that the loose gear carries: its spring's torque is predicted for a step, then the body follows.

Within a step the torque is a cubic in time, from both bodies' motion under all other torques; every path and every
reaction of the loose gear takes it as that. Then the body is moved under the actual path of the loose gear. Its
state and the cubic follow the numbers of its row in the table of torques.
"""

from __future__ import annotations

import math

import numpy as np

from gears3d.effects.rows import WIDTH, Code
from gears3d.engine.closing import Plant
from gears3d.engine.compile import inner
from gears3d.engine.mesh import call_side
from gears3d.engine.motion import drive_at
from gears3d.engine.torques import acceleration

INERTIA, STIFFNESS, DAMPING, PLAY = 2, 3, 4, 5
# Time at which the cubic begins, its four coefficients, angle and speed of the body.
SINCE, CUBIC, ANGLE, SPEED = 2 + WIDTH, 3 + WIDTH, 7 + WIDTH, 8 + WIDTH
PART = 0.05  # largest step in radians of the spring's oscillation
PARTS = 3


@inner
def body_among(torques):
    """Return the row of the carried body in a table of torques, or -1."""
    for i in range(torques.shape[0]):
        if int(torques[i, 0]) == Code.TORQUE_CARRIED:
            return i
    return -1


@inner
def _pull(row, twist, rate):
    """Return the spring's torque on the loose gear for a twist of the body ahead of it [N m]."""
    if row[PLAY] == 0.0:
        return row[STIFFNESS] * twist + row[DAMPING] * rate
    side = 1.0 if twist > 0.0 else -1.0
    past = abs(twist) - 0.5 * row[PLAY]
    if past <= 0.0:
        return 0.0
    return side * max(row[STIFFNESS] * past + row[DAMPING] * side * rate, 0.0)


@inner
def reach_of(row, inertia):
    """Return the longest step that resolves the spring's oscillation [s]."""
    light = 1.0 / inertia + 1.0 / row[INERTIA]
    return PART / (math.sqrt(row[STIFFNESS] * light) + row[DAMPING] * light)


@inner
def foresee(plant: Plant, teeth: np.ndarray, row: np.ndarray, held: bool, s, duration: float) -> float:
    """Write the spring's torque over the next step, and return the loose gear's acceleration at its start [rad/s²].

    ``row`` is that of the body in the table of torques, ``teeth`` (n, 3) are candidate tooth pairs, ``held`` states
    whether the loose gear follows a rigid flank, ``duration`` is that of the step [s].
    """
    row[SINCE] = s.time
    row[CUBIC : CUBIC + 4] = 0.0
    light = 1.0 / row[INERTIA] + (0.0 if held else 1.0 / plant.inertia)
    if held:
        angle, _, alpha = drive_at(plant.motion, s.time)
        _, by_drive, by_loose, _ = call_side(plant.surfaces.side, (plant.surfaces, teeth, s.place - 1, angle, s.theta))
        other = -by_drive * alpha / by_loose
    else:
        other = acceleration(plant.torques, plant.inertia, s.place, s.time, s.theta, s.omega, np.sign(s.omega))
    twist, rate = row[ANGLE] - s.theta, row[SPEED] - s.omega
    start = _pull(row, twist, rate)
    first, second, third, h = start, start, start, duration / PARTS
    for _ in range(PARTS):
        k1 = -light * _pull(row, twist, rate) - other
        k2 = -light * _pull(row, twist + 0.5 * h * rate, rate + 0.5 * h * k1) - other
        k3 = -light * _pull(row, twist + 0.5 * h * (rate + 0.5 * h * k1), rate + 0.5 * h * k2) - other
        k4 = -light * _pull(row, twist + h * (rate + 0.5 * h * k2), rate + h * k3) - other
        twist += h * (rate + h * (k1 + k2 + k3) / 6.0)
        rate += h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
        first, second, third = second, third, _pull(row, twist, rate)
    if duration > 0.0:  # Newton's form through four points
        d1, d2, d3 = first - start, second - 2.0 * first + start, third - 3.0 * second + 3.0 * first - start
        row[CUBIC], row[CUBIC + 1] = start, (d1 - 0.5 * d2 + d3 / 3.0) / h
        row[CUBIC + 2], row[CUBIC + 3] = (0.5 * d2 - 0.5 * d3) / h**2, d3 / 6.0 / h**3
    return other + (0.0 if held else start / plant.inertia)


@inner
def pursue(row: np.ndarray, begin: tuple[float, float, float], jerk: float, duration: float) -> None:
    """Move the body through a step of ``duration`` [s] under a path of the loose gear with constant ``jerk`` [rad/s³].

    ``begin`` is angle [rad], speed [rad/s] and acceleration [rad/s²] of the loose gear; ``row`` that of the body in the
    table of torques.
    """
    theta, omega, accel = begin
    h, angle, speed = duration / PARTS, row[ANGLE], row[SPEED]
    for part in range(PARTS):
        k1 = k2 = k3 = k4 = 0.0
        for stage in range(4):
            x = h * (part + (0.0 if stage == 0 else 1.0 if stage == 3 else 0.5))
            there = theta + x * (omega + x * (0.5 * accel + x * jerk / 6.0))
            turns = omega + x * (accel + 0.5 * x * jerk)
            if stage == 0:
                k1 = -_pull(row, angle - there, speed - turns) / row[INERTIA]
            elif stage == 1:
                k2 = -_pull(row, angle + 0.5 * h * speed - there, speed + 0.5 * h * k1 - turns) / row[INERTIA]
            elif stage == 2:
                ahead = angle + 0.5 * h * (speed + 0.5 * h * k1)
                k3 = -_pull(row, ahead - there, speed + 0.5 * h * k2 - turns) / row[INERTIA]
            else:
                k4 = -_pull(row, angle + h * (speed + 0.5 * h * k2) - there, speed + h * k3 - turns) / row[INERTIA]
        angle += h * (speed + h * (k1 + k2 + k3) / 6.0)
        speed += h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
    row[ANGLE], row[SPEED] = angle, speed


@inner
def follow(row, free, begin, s, smooth):
    """Move the body under the path that the loose gear took in the last step, from ``begin`` to the state ``s``.

    ``begin`` is time [s], angle [rad], speed [rad/s] and acceleration [rad/s²]; ``free`` states whether only torques
    acted on the loose gear, so that its acceleration at the start is known; ``smooth`` whether its speed had no jump at
    the end.
    """
    since, theta, omega, accel = begin
    h = s.time - since
    if h <= 0.0:
        return
    missing = s.theta - theta - omega * h
    if free:
        pursue(row, (theta, omega, accel), 6.0 * (missing - 0.5 * accel * h**2) / h**3, h)
    elif smooth:
        gained = s.omega - omega
        accel, jerk = (6.0 * missing / h - 2.0 * gained) / h, (6.0 * gained - 12.0 * missing / h) / h**2
        pursue(row, (theta, omega, accel), jerk, h)
    else:
        pursue(row, (theta, omega, 2.0 * missing / h**2), 0.0, h)
