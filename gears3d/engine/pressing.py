"""Compliant flanks: a force of the gap in place of the impact law, and the steps that resolve a contact."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gears3d.effects.rows import Code, Row
from gears3d.engine.compile import inner

STEPS_PER_RADIAN = 10.0  # steps in one radian of the undamped contact oscillation


def springs_of(rows: Sequence[Row]) -> np.ndarray:
    """Return stiffness [N/m] and damping [N s/m] of all compliant rows together, (1, 2), or (0, 2) without any."""
    found = [row.p[:2] for row in rows if row.code == Code.GAP_SPRING]
    return np.sum(found, axis=0, dtype=float, keepdims=True) if found else np.zeros((0, 2))


@inner
def pressed_step(springs: np.ndarray, mass: float) -> float:
    """Return the step [s] that resolves a contact of the loose gear, ``mass`` [kg] on the line of action."""
    stiffness, damping = springs[0, 0], springs[0, 1]
    return 1.0 / (STEPS_PER_RADIAN * (math.sqrt(stiffness / mass) + damping / mass))


@inner
def lasting(springs: np.ndarray, mass: float) -> float:
    """Return how long a contact must last to count as permanent [s]: five periods of its oscillation."""
    return 10.0 * math.pi * math.sqrt(mass / springs[0, 0])


@inner
def gap_force(springs: np.ndarray, gap: float, rate: float) -> float:
    """Return the force of spring and damper [N], negative where the flanks no longer push.

    ``springs`` is stiffness and damping (1, 2), ``gap`` in m, ``rate`` in m/s.
    """
    return -springs[0, 0] * gap - springs[0, 1] * rate
