"""The body that the loose gear carries on a torsional spring.

Where the loose gear is free its body is part of the integrator's state. Where the gear follows a rigid flank its motion
is imposed: the spring's torque is predicted for a step as a cubic in time, which every reaction takes, and then the
body is moved under the actual path of the gear. The cubic follows the numbers of the body's row, the last one in the
table of torques.
"""

from __future__ import annotations

import math

import numpy as np

from gears3d.effects.rows import WIDTH, Code, Row
from gears3d.engine.closing import ContactSystem
from gears3d.engine.compile import inner
from gears3d.engine.mesh import call_side
from gears3d.engine.motion import drive_at

INERTIA, STIFFNESS, DAMPING, PLAY = 2, 3, 4, 5
SINCE, CUBIC = 2 + WIDTH, 3 + WIDTH  # time at which the cubic begins, its four coefficients
PART = 0.05  # largest step in radians of the spring's oscillation where the gear's motion is imposed
PARTS = 3  # Of a stretch, for the torque of the spring: a cubic has four numbers, one of them known at its start


def contact_step(body: Row) -> float:
    """Return the longest step [s] of a loose gear that carries a body on a rigid flank."""
    inertia, stiffness, damping, _ = body.p
    return PART / (math.sqrt(stiffness / inertia) + damping / inertia)


@inner
def body_among(torques):
    """Return the row of the carried body in a table of torques, or -1."""
    last = torques.shape[0] - 1
    return last if last >= 0 and int(torques[last, 0]) == Code.TORQUE_CARRIED else -1


@inner
def pull_of(row, twist, rate):
    """Return the spring's torque on the loose gear for a twist of the body ahead of it [N m]."""
    if row[PLAY] == 0.0:
        return row[STIFFNESS] * twist + row[DAMPING] * rate
    side = 1.0 if twist > 0.0 else -1.0
    past = abs(twist) - 0.5 * row[PLAY]
    if past <= 0.0:
        return 0.0
    return side * max(row[STIFFNESS] * past + row[DAMPING] * side * rate, 0.0)


@inner
def hand_over(row, s):
    """Write the spring's torque now for all that acts at this instant alone."""
    row[SINCE] = s.time
    row[CUBIC : CUBIC + 4] = 0.0
    row[CUBIC] = pull_of(row, s.body[0] - s.theta, s.body[1] - s.omega)


@inner
def resolved(row, light, twist, rate):
    """Return the longest step that resolves the spring's oscillation, and a way through its play [s].

    ``light`` is the sum of the reciprocal inertias that oscillate [1/(kg m²)].
    """
    longest = 1.0 / (math.sqrt(row[STIFFNESS] * light) + row[DAMPING] * light)
    if abs(twist) < 0.5 * row[PLAY]:
        longest = min(longest, 0.5 * row[PLAY] / (abs(rate) + 1e-300))
    return longest


@inner
def foresee(system: ContactSystem, teeth: np.ndarray, row: np.ndarray, s, duration: float) -> None:
    """Write the spring's torque over the next step, in which the loose gear follows a rigid flank.

    ``row`` is that of the body in the table of torques, ``teeth`` (n, 3) are candidate tooth pairs, ``duration`` is
    that of the step [s].
    """
    hand_over(row, s)
    if duration <= 0.0:
        return
    angle, _, alpha = drive_at(system.motion, s.time)
    _, by_drive, by_loose, _ = call_side(system.surfaces.side, (system.surfaces, teeth, s.place - 1, angle, s.theta))
    accel = -by_drive * alpha / by_loose
    start, h = row[CUBIC], duration / PARTS
    torques, state = (start, start, start), (s.body[0], s.body[1])
    for part in range(PARTS):
        state = _moved(row, state, (s.theta, s.omega, accel), 0.0, (h, part))
        x = h * (part + 1)
        twist, rate = state[0] - s.theta - x * (s.omega + 0.5 * x * accel), state[1] - s.omega - x * accel
        torques = (torques[1], torques[2], pull_of(row, twist, rate))
    first, second, third = torques
    # Newton's form through four points
    d1, d2, d3 = first - start, second - 2.0 * first + start, third - 3.0 * second + 3.0 * first - start
    row[CUBIC + 1] = (d1 - 0.5 * d2 + d3 / 3.0) / h
    row[CUBIC + 2], row[CUBIC + 3] = (0.5 * d2 - 0.5 * d3) / h**2, d3 / 6.0 / h**3


@inner
def _moved(row, state, begin, jerk, step):
    """Return angle [rad] and speed [rad/s] of the body after one part of a step under a path of the loose gear.

    ``state`` is angle and speed before; ``begin`` is angle, speed and acceleration [rad/s²] of the loose gear at the
    begin of the step, ``jerk`` [rad/s³] is constant; ``step`` is the duration of a part [s] and its number.
    """
    theta, omega, accel = begin
    h, part = step
    speed = gained = turned = rise = 0.0
    for node, weight in ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):  # the classical Runge-Kutta method
        x, angle = h * (part + node), state[0] + node * h * speed
        speed = state[1] + node * h * rise
        twist = angle - theta - x * (omega + x * (0.5 * accel + x * jerk / 6.0))
        rise = -pull_of(row, twist, speed - omega - x * (accel + 0.5 * x * jerk)) / row[INERTIA]
        turned, gained = turned + weight * speed, gained + weight * rise
    return state[0] + h * turned / 6.0, state[1] + h * gained / 6.0


@inner
def follow(row, begin, s):
    """Move the body under the path that the loose gear took on a flank, from ``begin`` to the state ``s``.

    ``begin`` is time [s], angle [rad] and speed [rad/s] of the gear.
    """
    since, theta, omega = begin
    h = s.time - since
    missing, gained = s.theta - theta - omega * h, s.omega - omega
    accel, jerk = (6.0 * missing / h - 2.0 * gained) / h, (6.0 * gained - 12.0 * missing / h) / h**2
    state = (s.body[0], s.body[1])
    for part in range(PARTS):
        state = _moved(row, state, (theta, omega, accel), jerk, (h / PARTS, part))
    s.body[0], s.body[1] = state
    hand_over(row, s)
