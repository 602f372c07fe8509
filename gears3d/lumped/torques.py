"""Power series of the torques on the loose gear."""

from __future__ import annotations

from math import cos, exp, sin

from gears3d.effects.rows import Code
from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner
from gears3d.lumped.cursors import linear

POWER, HARMONIC, RELAX = float(Code.TORQUE_POWER), float(Code.TORQUE_HARMONIC), float(Code.TORQUE_RELAX)
TABLE = float(Code.TORQUE_TABLE)
SLOW = 1e-6  # loose speed below which a power law is replaced by a straight line through the origin [rad/s]


@inner
def torque(m, state, phase, sign, k, w):
    """Return the resisting torque's coefficient of order k; ``sign`` is the direction that dry friction resists."""
    base = at.BASE + 3 * phase
    total = m[base + 1] * w[at.OMEGA2, k]
    if k == 0:  # Coulomb drag, base and rows TORQUE_CONSTANT
        total += m[base] * sign - m[base + 2]
    for i in range(int(m[at.N_TORQUES])):
        row, own = int(m[at.AT_TORQUES]) + at.PER_TORQUE * i, at.ROWS + 2 * i
        if int(m[row + 1]) >> phase & 1:
            code = m[row]
            if code == POWER:
                total += _power(m[row + 2], m[row + 3], sign, k, w, own)
            elif code == HARMONIC:
                turn(m[row + 2], m[row + 4], w, at.THETA2, at.OMEGA2, k, own)
                total += m[row + 3] * w[own, k]
            elif code == RELAX:
                if k == 0:
                    w[own, 0] = exp(-state[at.TIME] / m[row + 3])
                    total += m[row + 2] * sign
                else:
                    w[own, k] = -w[own, k - 1] * at.INVERSE[k] / m[row + 3]
                total -= m[row + 2] * sign * w[own, k]
            elif code == TABLE:
                total += linear(m, state, int(m[row + 2]), k, w)
    return total


@inner
def _power(coefficient, exponent, sign, k, w, own):
    """Coefficient·|ω|^exponent·sign, order k."""
    start = sign * w[at.OMEGA2, 0]
    if start < SLOW:
        return coefficient * SLOW ** (exponent - 1.0) * w[at.OMEGA2, k] if sign != 0.0 else 0.0
    if k == 0:
        w[own, 0] = start**exponent
    else:
        total = 0.0
        for j in range(1, k + 1):
            total += (exponent * j - (k - j)) * w[at.OMEGA2, j] * w[own, k - j]
        w[own, k] = sign * total * at.INVERSE[k] / start
    return coefficient * sign * w[own, k]


@inner
def turn(order, phase, w, angle, speed, k, own):
    """Cosine (row ``own``) and sine (the next) of order·θ + phase, order k, from the speed's series up to k - 1."""
    if k == 0:
        w[own, 0], w[own + 1, 0] = cos(order * w[angle, 0] + phase), sin(order * w[angle, 0] + phase)
        return
    a = b = 0.0
    for j in range(1, k + 1):
        a += w[speed, j - 1] * w[own + 1, k - j]
        b += w[speed, j - 1] * w[own, k - j]
    w[own, k], w[own + 1, k] = -order * a * at.INVERSE[k], order * b * at.INVERSE[k]
