"""Torques on the loose gear, evaluated row by row."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gears3d.effects.rows import WIDTH, Code, Gate, Row, Variable
from gears3d.engine.compile import entry, inner
from gears3d.errors import Fault, InputError

_SOON = 1e-6  # points of a tabulated torque nearer than this are passed over [s]
# Where the loose gear is: between the flanks, on the active flank, on the reverse flank.
FREE, ON_ACTIVE, ON_REVERSE = 0, 1, 2

_CONSTANT = int(Code.TORQUE_CONSTANT)
_LINEAR = int(Code.TORQUE_LINEAR)
_POWER = int(Code.TORQUE_POWER)
_HARMONIC = int(Code.TORQUE_HARMONIC)
_RELAX = int(Code.TORQUE_RELAX)
_TABLE = int(Code.TORQUE_TABLE)
_CARRIED = int(Code.TORQUE_CARRIED)
_BEHIND = 5  # numbers of a carried body after those of its row, see :mod:`gears3d.engine.carried`
_SPEED = int(Variable.SPEED)
_ANGLE = int(Variable.ANGLE)
_ALWAYS = int(Gate.ALWAYS)
_FLIGHT = int(Gate.FLIGHT)
_CONTACT = int(Gate.CONTACT)
_ACTIVE = int(Gate.ACTIVE)
_REVERSE = int(Gate.REVERSE)


def torque_table(rows: Sequence[Row]) -> np.ndarray:
    """Return the torque rows as a table: code, gate, numbers; (n, 2 + WIDTH + 2·most points of a tabulated torque).

    A tabulated torque has its number of points after its variable, and after the numbers its abscissae and values.
    Friction of the flanks is excluded, see :func:`friction`. A carried body comes last, with its spring's torque after
    its numbers, see :mod:`gears3d.engine.carried`; more than one is an InputError.

    >>> from gears3d.effects.rows import torque_constant
    >>> torque_table([torque_constant(0.22)])[0, :3].tolist()
    [101.0, 0.0, 0.22]
    """
    chosen = [row for row in rows if row.code // 100 == 1 and row.code != Code.TORQUE_FRICTION]
    chosen.sort(key=lambda row: row.code == Code.TORQUE_CARRIED)
    longest = max((len(row.table) for row in chosen), default=0)
    bodies = sum(row.code == Code.TORQUE_CARRIED for row in chosen)
    if bodies > 1:
        raise InputError(Fault("effect", f"there are {bodies} carried bodies", "give one carried_inertia"))
    table = np.zeros((len(chosen), 2 + WIDTH + max(2 * longest, _BEHIND * bodies)))
    for line, row in zip(table, chosen, strict=True):
        line[0], line[1] = row.code, row.gate
        line[2 : 2 + len(row.p)] = row.p
        if row.code == Code.TORQUE_TABLE:
            count = line[3] = len(row.table)
            line[2 + WIDTH : 2 + WIDTH + 2 * int(count)] = np.ravel(row.table, order="F")
    return table


def friction(rows: Sequence[Row]) -> float:
    """Return the coefficients of friction between the flanks together.

    >>> from gears3d.effects.rows import torque_friction
    >>> friction([torque_friction(0.03), torque_friction(0.02)])
    0.05
    """
    return float(sum(row.p[0] for row in rows if row.code == Code.TORQUE_FRICTION))


@inner
def _points_before(line: np.ndarray, at: float, touched: bool) -> int:
    """Return how many points of a tabulated torque lie before a place, with one that lies there if ``touched``."""
    low, high = 0, int(line[3])
    while low < high:
        middle = (low + high) // 2
        point = line[2 + WIDTH + middle]
        if point < at or (touched and point == at):
            low = middle + 1
        else:
            high = middle
    return low


@inner
def _between(line: np.ndarray, at: float) -> float:
    """Return a tabulated torque [N m]: straight between its points, constant beyond its ends."""
    count = int(line[3])
    first = 2 + WIDTH
    if at <= line[first]:
        return line[first + count]
    if at >= line[first + count - 1]:
        return line[first + 2 * count - 1]
    high = first + _points_before(line, at, True)
    low = high - 1
    share = (at - line[low]) / (line[high] - line[low])
    return float(line[low + count] + share * (line[high + count] - line[low + count]))


@inner
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


def gated(table: np.ndarray) -> bool:
    """Return whether some torque acts in flight or in contact only; ``table`` of :func:`torque_table`."""
    return bool(np.any(table[:, 1] != _ALWAYS))


@entry
def resisting(table: np.ndarray, place: int, time: float, theta: float, omega: float) -> tuple[float, float]:
    """Return the resisting torques as two sums [N m]: what acts in any direction, and what acts against the motion.

    At rest the second holds against any smaller torque. ``place`` is FREE, ON_ACTIVE or ON_REVERSE; time in s, angle
    ``theta`` in rad and speed ``omega`` in rad/s are those of the loose gear.
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
        elif code == _TABLE:
            at = omega if first == _SPEED else theta if first == _ANGLE else time
            plain += _between(table[i], at)
        elif code == _CARRIED:
            x = time - table[i, 2 + WIDTH]
            c = 3 + WIDTH
            plain -= table[i, c] + x * (table[i, c + 1] + x * (table[i, c + 2] + x * table[i, c + 3]))
    return plain, dry


@entry
def acceleration(
    table: np.ndarray, inertia: float, place: int, time: float, theta: float, omega: float, direction: float
) -> float:
    """Return the loose gear's acceleration [rad/s²] under the torques alone.

    ``inertia`` is in kg m², time in s, ``theta`` in rad, ``omega`` in rad/s; ``place`` is FREE, ON_ACTIVE or
    ON_REVERSE; ``direction`` is the sign of motion that dry torques act against, 0 at rest.
    """
    plain, dry = resisting(table, place, time, theta, omega)
    if direction == 0.0:
        if abs(plain) <= dry:
            return 0.0
        return -(plain - math.copysign(dry, plain)) / inertia
    return -(plain + direction * dry) / inertia


@inner
def until_kink(table: np.ndarray, inertia: float, place: int, time: float, theta: float, omega: float) -> float:
    """Return the approximate time until a tabulated torque reaches its next point, infinite without one [s].

    ``inertia`` is in kg m², time in s, ``theta`` in rad, ``omega`` in rad/s; ``place`` is FREE, ON_ACTIVE or
    ON_REVERSE.
    """
    soonest = math.inf
    for i in range(table.shape[0]):
        if int(table[i, 0]) != _TABLE:
            continue
        at, rate = time, 1.0
        if table[i, 2] == _ANGLE:
            at, rate = theta, omega
        elif table[i, 2] == _SPEED:
            at, rate = omega, acceleration(table, inertia, place, time, theta, omega, np.sign(omega))
        if rate == 0.0:
            continue
        ahead = at + rate * _SOON
        k = _points_before(table[i], ahead, True) if rate > 0.0 else _points_before(table[i], ahead, False) - 1
        if 0 <= k < int(table[i, 3]):
            soonest = min(soonest, (table[i, 2 + WIDTH + k] - at) / rate)
    return soonest
