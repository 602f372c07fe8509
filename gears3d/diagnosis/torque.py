"""Torques on the loose gear at measured states, from the rows of effects."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gears3d.effects import Code, Gate, Row

Array = np.ndarray


def torque(rows: Iterable[Row], speed: Array, angle: Array, time: Array, flank: Array | None = None) -> Array:
    """Return the resisting torque of effects on a rotating loose gear [N·m].

    speed: [rad/s]; angle: [rad]; time: [s]; flank: 0 active, 1 reverse, ``None`` in flight.

    >>> from gears3d.effects.rows import torque_linear
    >>> torque([torque_linear(2.0, 1.0)], np.array([3.0]), np.zeros(1), np.zeros(1)).tolist()
    [4.0]
    """
    total = np.zeros_like(speed)
    for row in rows:
        if 100 < row.code < 200 and row.code != Code.TORQUE_FRICTION:
            total = total + _acts(row.gate, flank) * _value(row, speed, angle, time)
    return total


def _acts(gate: int, flank: Array | None) -> Array | float:
    if gate == Gate.ALWAYS:
        return 1.0
    if flank is None:
        return float(gate == Gate.FLIGHT)
    if gate == Gate.FLIGHT:
        return 0.0
    return 1.0 if gate == Gate.CONTACT else np.where(flank == gate - Gate.ACTIVE, 1.0, 0.0)


def _value(row: Row, speed: Array, angle: Array, time: Array) -> Array:
    p, dry = row.p, np.sign(speed)
    if row.code == Code.TORQUE_CONSTANT:
        return p[0] * dry
    if row.code == Code.TORQUE_LINEAR:
        return p[0] * (speed - p[1])
    if row.code == Code.TORQUE_POWER:
        return p[0] * np.abs(speed) ** p[1] * dry
    if row.code == Code.TORQUE_HARMONIC:
        return p[1] * np.cos(p[0] * angle + p[2])
    if row.code == Code.TORQUE_RELAX:
        return p[0] * -np.expm1(-time / p[1]) * dry
    if row.code == Code.TORQUE_CARRIED:  # its spring has no torque of its own
        return 0.0 * speed
    points = np.array(row.table)
    return np.interp((speed, angle, time)[int(p[0])], points[:, 0], points[:, 1])
