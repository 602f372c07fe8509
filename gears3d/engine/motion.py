"""The imposed motion of the drive gear: mean speed and harmonics, or a measured one, in the engine's own code.

Source: Rigaud & Perret-Liaudet 2020, eqs (1) and (5).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gears3d.effects.rows import Code, Row
from gears3d.engine.compile import entry, inner
from gears3d.scenario.drive_record import LEAST, drive_record

if TYPE_CHECKING:
    from gears3d.scenario import Scenario


KNOTS = 16.0  # knots of a smoothed record in one period of its bandwidth
RESOLVED = 8.0  # samples in the shortest period that a record without a bandwidth is taken to resolve
PIECE = 3  # lines of the motion table for one piece of a record


def motion_table(scenario: Scenario, effects: Sequence[Row] = ()) -> np.ndarray:
    """Return the motion as a table: mean speed, harmonics, and the pieces of a measured motion.

    The rows (1 + harmonics + 3·pieces, 3) are ``(mean [rad/s], pieces, 0)``; for each harmonic ``(amplitude [rad/s],
    frequency [rad/s], phase [rad])``; for each piece its start [s] and the six coefficients of its angle, rising
    [rad/s^k], then the largest speed [rad/s] and highest circular frequency [rad/s] of the record. An ``order`` counts
    per mean revolution; a record replaces mean and harmonics; rows of effects on the motion are added. A record that
    cannot be used is an InputError.
    """
    motion = scenario.motion
    waves = [] if motion.record is not None else [(h.amplitude, h.frequency, h.phase) for h in motion.harmonics]
    waves += [(row.p[0], row.p[1], row.p[2]) for row in effects if row.code == Code.MOTION_HARMONIC]
    sines = np.array([(size, 2.0 * math.pi * frequency, phase) for size, frequency, phase in waves]).reshape(-1, 3)
    if motion.record is None:
        return np.vstack([(motion.mean, 0.0, 0.0), sines])
    pieces = _pieces(scenario)
    return np.vstack([(0.0, pieces.shape[0] / PIECE, 0.0), sines, pieces])


def standing_at(motion: np.ndarray, angle: float) -> np.ndarray:
    """Return a motion table, without a record, whose drive angle is ``angle`` [rad] at time 0.

    >>> drive_at(standing_at(np.array([[2.0, 0.0, 0.0]]), 0.5), 1.0)
    (2.5, 2.0, 0.0)
    """
    piece = [(0.0, angle, motion[0, 0]), (0.0, 0.0, 0.0), (0.0, abs(motion[0, 0]), 0.0)]
    return np.vstack([(0.0, 1.0, 0.0), motion[1:], piece])


def there_and_back(speed: float, way: float, turning: float) -> np.ndarray:
    """Return a motion table: at constant ``speed`` [rad/s], a smooth change of direction, and back.

    The change of direction comes at the angle ``way`` [rad] and takes ``turning`` [s].

    >>> path = there_and_back(2.0, 10.0, 1.0)
    >>> [round(drive_at(path, time)[0], 12) for time in (0.0, 5.0, 5.5, 6.0, 11.0)]
    [0.0, 10.0, 10.625, 10.0, 0.0]
    """
    forth = way / speed
    pieces = [
        (0.0, 0.0, speed, 0.0, 0.0, 0.0, 0.0),
        (forth, way, speed, 0.0, -2.0 * speed / turning**2, speed / turning**3, 0.0),
        (forth + turning, way, -speed, 0.0, 0.0, 0.0, 0.0),
    ]
    ends = (speed, math.pi / turning)
    lines = np.array([(*piece, *ends) for piece in pieces]).reshape(-1, 3)
    return np.vstack([(0.0, len(pieces), 0.0), lines])


def _pieces(scenario: Scenario) -> np.ndarray:
    """Return a record as a quintic spline, in lines of the motion table (3·pieces, 3)."""
    from scipy.interpolate import PPoly, make_interp_spline

    time, theta, bandwidth = drive_record(scenario)
    count = len(time)
    if bandwidth is None:
        bandwidth = 1.0 / (RESOLVED * float(np.median(np.diff(time))))
    else:
        count = min(count, max(LEAST, math.ceil(KNOTS * bandwidth * time[-1]) + 1))
    knots = np.rint(np.linspace(0, len(time) - 1, count)).astype(int)
    spline = make_interp_spline(time[knots], theta[knots], k=5)
    speed = float(np.abs(spline.derivative().c).max())  # its control points bound a spline
    pieces = PPoly.from_spline(spline)
    some = np.diff(pieces.x) > 0.0
    ends = np.tile((speed, 2.0 * math.pi * bandwidth), (int(some.sum()), 1))
    return np.column_stack([pieces.x[:-1][some], pieces.c[::-1, some].T, ends]).reshape(-1, 3)


@inner
def _recorded(motion: np.ndarray, time: float) -> tuple[float, float, float]:
    """Return angle [rad], speed [rad/s] and acceleration [rad/s²] of a measured motion."""
    pieces = int(motion[0, 1])
    first = motion.shape[0] - PIECE * pieces
    low, high = 0, pieces
    while high - low > 1:
        middle = (low + high) // 2
        if motion[first + PIECE * middle, 0] <= time:
            low = middle
        else:
            high = middle
    at = first + PIECE * low
    x = time - motion[at, 0]
    c0, c1 = motion[at, 1], motion[at, 2]
    c2, c3, c4, c5 = motion[at + 1, 0], motion[at + 1, 1], motion[at + 1, 2], motion[at + 2, 0]
    theta = c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5))))
    omega = c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))
    alpha = 2.0 * c2 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))
    return theta, omega, alpha


@entry
def drive_at(motion: np.ndarray, time: float) -> tuple[float, float, float]:
    """Return the drive gear's angle [rad], speed [rad/s] and acceleration [rad/s²] at a time [s]."""
    theta = motion[0, 0] * time
    omega = motion[0, 0]
    alpha = 0.0
    end = motion.shape[0]
    if motion[0, 1] > 0.0:
        end -= PIECE * int(motion[0, 1])
        theta, omega, alpha = _recorded(motion, time)
    for i in range(1, end):
        amplitude, frequency, phase = motion[i, 0], motion[i, 1], motion[i, 2]
        argument = frequency * time + phase
        omega += amplitude * math.sin(argument)
        alpha += amplitude * frequency * math.cos(argument)
        if frequency != 0.0:
            theta += amplitude / frequency * (math.cos(phase) - math.cos(argument))
        else:
            theta += amplitude * math.sin(phase) * time
    return theta, omega, alpha


def drive_samples(motion: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return angle [rad] and speed [rad/s] of the drive gear at times (n,) [s], (n, 2)."""
    out = np.zeros((times.size, 2))
    _fill_samples(motion, times, out)
    return out


@entry
def _fill_samples(motion, times, out):
    """Fill in the result of :func:`drive_samples`."""
    for i in range(times.size):
        out[i, 0], out[i, 1], _ = drive_at(motion, times[i])


def fastest(motion: np.ndarray) -> tuple[float, float]:
    """Return the largest speed [rad/s] that can occur and the highest circular frequency [rad/s]."""
    sines = motion[1 : len(motion) - PIECE * int(motion[0, 1])]
    speed = abs(motion[0, 0]) + float(np.abs(sines[:, 0]).sum())
    frequency = float(np.abs(sines[:, 1]).max(initial=0.0))
    if motion[0, 1] > 0.0:
        speed, frequency = speed + motion[-1, 1], max(frequency, motion[-1, 2])
    return float(speed), float(frequency)
