"""Torques on the loose gear, evaluated row by row."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gears3d.effects.rows import WIDTH, Code, Gate, Row
from gears3d.kernels import njit

FREE, ON_ACTIVE, ON_REVERSE = 0, 1, 2
"""Where the loose gear is: between the flanks, on the active one, on the reverse one."""

_CONSTANT = int(Code.TORQUE_CONSTANT)
_LINEAR = int(Code.TORQUE_LINEAR)
_POWER = int(Code.TORQUE_POWER)
_HARMONIC = int(Code.TORQUE_HARMONIC)
_RELAX = int(Code.TORQUE_RELAX)
_FLIGHT = int(Gate.FLIGHT)
_CONTACT = int(Gate.CONTACT)
_ACTIVE = int(Gate.ACTIVE)
_REVERSE = int(Gate.REVERSE)


def torque_table(rows: Sequence[Row]) -> np.ndarray:
    """Return the torque rows as a table: code, gate, numbers; (n, 2 + WIDTH).

    >>> from gears3d.effects.rows import torque_constant
    >>> torque_table([torque_constant(0.22)])[0, :3].tolist()
    [101.0, 0.0, 0.22]
    """
    chosen = [row for row in rows if row.code // 100 == 1]
    table = np.zeros((len(chosen), 2 + WIDTH))
    for line, row in zip(table, chosen, strict=True):
        line[0], line[1] = row.code, row.gate
        line[2 : 2 + len(row.p)] = row.p
    return table


@njit(cache=True)
def _acts(gate: int, place: int) -> bool:
    """Return whether a row with this gate acts at this place."""
    if gate == _FLIGHT:
        return place == FREE
    if gate == _CONTACT:
        return place != FREE
    if gate == _ACTIVE:
        return place == ON_ACTIVE
    if gate == _REVERSE:
        return place == ON_REVERSE
    return True


@njit(cache=True)
def resisting(table: np.ndarray, place: int, time: float, theta: float, omega: float) -> tuple[float, float]:
    """Return the resisting torques in two heaps.

    Args:
        table: of :func:`torque_table`.
        place: FREE, ON_ACTIVE or ON_REVERSE.
        time: s.
        theta: angle of the loose gear [rad].
        omega: its speed [rad/s].

    Returns:
        What acts whatever the direction, and the size of what turns against the direction of motion (which at rest
        holds against anything smaller) [N m].
    """
    plain = 0.0
    dry = 0.0
    for i in range(table.shape[0]):
        if not _acts(int(table[i, 1]), place):
            continue
        code = int(table[i, 0])
        first, second, third = table[i, 2], table[i, 3], table[i, 4]
        if code == _CONSTANT:
            dry += first
        elif code == _LINEAR:
            plain += first * (omega - second)
        elif code == _POWER:
            dry += first * abs(omega) ** second
        elif code == _HARMONIC:
            plain += second * math.cos(first * theta + third)
        elif code == _RELAX:
            dry += first * (1.0 - math.exp(-time / second))
    return plain, dry


@njit(cache=True)
def acceleration(
    table: np.ndarray, inertia: float, place: int, time: float, theta: float, omega: float, direction: float
) -> float:
    """Return the loose gear's acceleration [rad/s²] under the torques alone.

    Args:
        table: of :func:`torque_table`.
        inertia: kg m².
        place: FREE, ON_ACTIVE or ON_REVERSE.
        time: s.
        theta: rad.
        omega: rad/s.
        direction: the sign of motion that dry torques act against, 0 at rest.
    """
    plain, dry = resisting(table, place, time, theta, omega)
    if direction == 0.0:
        if abs(plain) <= dry:
            return 0.0
        return -(plain - math.copysign(dry, plain)) / inertia
    return -(plain + direction * dry) / inertia
