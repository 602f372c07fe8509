"""The torques that resist the loose gear, one by one, at any speed: for estimates before anything is simulated."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from gears3d.effects import Row


def resisting(row: Row, speed: Any, angle: Any = 0.0, time: Any = np.inf) -> np.ndarray:
    """Return the torque that a row puts against the loose gear's motion, friction in the mesh excepted.

    Args:
        row: any row; those of other places give 0.
        speed: of the loose gear [rad/s], (n,).
        angle: of the loose gear [rad], (n,).
        time: [s], (n,); infinite for what comes in the end.

    Returns:
        Torque [N·m], (n,), positive where it decelerates a gear that turns forwards.

    >>> from gears3d.effects.rows import torque_linear
    >>> float(resisting(torque_linear(0.1, shaft_speed=2.0), 5.0).round(9))
    0.3
    """
    from gears3d.effects import Code
    from gears3d.effects.rows import Variable

    speed, p = np.asarray(speed, dtype=float), row.p
    if row.code == Code.TORQUE_CONSTANT:
        return p[0] * np.sign(speed)
    if row.code == Code.TORQUE_LINEAR:
        return p[0] * (speed - p[1])
    if row.code == Code.TORQUE_POWER:
        return p[0] * np.abs(speed) ** p[1] * np.sign(speed)
    if row.code == Code.TORQUE_HARMONIC:
        return p[1] * np.cos(p[0] * np.asarray(angle) + p[2]) + 0.0 * speed
    if row.code == Code.TORQUE_RELAX:
        return p[0] * -np.expm1(-np.asarray(time) / p[1]) * np.sign(speed)
    if row.code == Code.TORQUE_TABLE:
        at = {Variable.SPEED: speed, Variable.ANGLE: angle, Variable.TIME: time}[Variable(int(p[0]))]
        points = np.array(row.table)
        return np.interp(at, points[:, 0], points[:, 1]) + 0.0 * speed
    return np.zeros_like(speed)


def mean_resisting(row: Row, speed: float) -> float:
    """Return a row's torque at a steady speed, its mean over a turn of the loose gear, in the end [N·m].

    Args:
        row: any row.
        speed: of the loose gear [rad/s].
    """
    turn = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    return float(np.mean(resisting(row, np.full_like(turn, speed), turn)))
