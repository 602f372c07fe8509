"""The impact law in compiled code: restitution with its scatter, and the force of a flank from its torque."""

from __future__ import annotations

from math import cos, log, pi, sqrt

import numpy as np

from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner

LEAST = 1e-13  # rebound speed below any resolution in time [m/s]
TOUCH = 1e-12  # approach speed up to which a contact does not count as an impact [m/s]


@inner
def uniform(seed, index):
    """Return a number between 0 and 1 that depends on seed and index alone (splitmix64)."""
    z = np.uint64(seed) * np.uint64(0xD1342543DE82EF95) + np.uint64(index) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return (float(z >> np.uint64(11)) + 0.5) / 9007199254740992.0


@inner
def restitution(m, flank, speed, index):
    """Return e = clip(e0 + slope·|v| ± asymmetry/2 + scatter·z, 0, 1); z is normal (Box-Muller)."""
    e = m[at.RESTITUTION] + m[at.RESTITUTION + 1] * speed
    e += 0.5 * m[at.RESTITUTION + 2] if flank == 0 else -0.5 * m[at.RESTITUTION + 2]
    if m[at.RESTITUTION + 3] > 0.0:
        first, second = uniform(m[at.SEED], 2 * index + 1), uniform(m[at.SEED], 2 * index + 2)
        e += m[at.RESTITUTION + 3] * (sqrt(-2.0 * log(first)) * cos(2.0 * pi * second))
    return min(max(e, 0.0), 1.0)


@inner
def thrust(m, side, sign):
    """Return the flank's force from its torque, friction in the mesh included."""
    return 1.0 / (m[at.RADIUS_LOOSE] * (side - m[at.FRICTION] * sign))
