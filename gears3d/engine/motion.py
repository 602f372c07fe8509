"""The imposed motion of the drive gear: mean speed and harmonics, as this room's own code.

Source: Rigaud & Perret-Liaudet 2020, eqs (1) and (5).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gears3d.effects.rows import Code, Row
from gears3d.kernels import njit

if TYPE_CHECKING:
    from gears3d.scenario import Scenario


def motion_table(scenario: Scenario, effects: Sequence[Row] = ()) -> np.ndarray:
    """Return the motion as a table: mean speed first, then amplitude, circular frequency, phase of each harmonic.

    Args:
        scenario: its ``motion``; an ``order`` counts per mean revolution.
        effects: rows of all effects; those of the motion are added.

    Returns:
        (1 + harmonics, 3): ``(mean, 0, 0)`` [rad/s], then ``(amplitude [rad/s], frequency [rad/s], phase [rad])``.
    """
    motion = scenario.motion
    rows = [(motion.mean, 0.0, 0.0)]
    for harmonic in motion.harmonics:
        rows.append((harmonic.amplitude, 2.0 * math.pi * harmonic.frequency, harmonic.phase))
    for row in effects:
        if row.code == Code.MOTION_HARMONIC:
            amplitude, frequency, phase = row.p
            rows.append((amplitude, 2.0 * math.pi * frequency, phase))
    return np.array(rows, dtype=float)


@njit(cache=True)
def drive_at(motion: np.ndarray, time: float) -> tuple[float, float, float]:
    """Return the drive gear's angle [rad], speed [rad/s] and acceleration [rad/s²] at a time [s]."""
    theta = motion[0, 0] * time
    omega = motion[0, 0]
    alpha = 0.0
    for i in range(1, motion.shape[0]):
        amplitude, frequency, phase = motion[i, 0], motion[i, 1], motion[i, 2]
        argument = frequency * time + phase
        omega += amplitude * math.sin(argument)
        alpha += amplitude * frequency * math.cos(argument)
        if frequency != 0.0:
            theta += amplitude / frequency * (math.cos(phase) - math.cos(argument))
        else:
            theta += amplitude * math.sin(phase) * time
    return theta, omega, alpha


def fastest(motion: np.ndarray) -> tuple[float, float]:
    """Return the largest speed [rad/s] that can occur and the highest circular frequency [rad/s]."""
    speed = abs(motion[0, 0]) + float(np.abs(motion[1:, 0]).sum())
    return speed, float(np.abs(motion[1:, 1]).max(initial=0.0))
