"""Power series of the oil films' forces, and the rest that a gear finds on its film.

Each flank pushes with f = wedge·|u|/h − squeeze·min(ḣ, 0)/h^1.5 where h is the gap and u the speed that draws oil in;
the lubricated dual-clutch transmission, eqs (11)-(14). The kernel's gaps are counted from where the flanks touch, at
h = FLOOR. With y = h^(−1/2) the wedge is wedge·|u|·y² and the squeeze 2·squeeze·ẏ, so one recurrence serves both.
"""

from __future__ import annotations

from math import sqrt

from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner


@inner
def prepare(m, state, pressed, w):
    """Note which way the oil is drawn in, which films are squeezed and which are as thin as they get.

    ``pressed`` is the flank that yields under the other, or -1. A rate of exactly zero leaves it as it was: the step
    then begins with the turn, if there is one.
    """
    note = w[at.FILM_NOTE]
    w[at.OMEGA1, 0], w[at.OMEGA2, 0] = state[at.DRIVE_SPEED], state[at.SPEED]
    u = m[at.ROLL_DRIVE] * state[at.DRIVE_SPEED] + m[at.ROLL_LOOSE] * state[at.SPEED]
    if abs(u) > m[at.REST] * (m[at.ROLL_DRIVE] + m[at.ROLL_LOOSE]):
        state[at.SENSE] = 1.0 if u > 0.0 else -1.0
    note[0] = state[at.SENSE]
    for flank in range(2):
        gap, rate = state[at.GAPS + flank], state[at.RATES + flank]
        w[at.GAP + flank, 0], w[at.GAP + flank, 1] = gap, rate
        if rate != 0.0:
            state[at.SQUEEZED + flank] = 1.0 if rate < 0.0 else 0.0
        note[1 + flank] = state[at.SQUEEZED + flank]
        note[3 + flank] = 1.0 if gap < 0.0 or flank == pressed else 0.0


@inner
def film_torque(m, k, w):
    """Return the torque with which both films resist, order k, from gaps up to k + 1 and speeds up to k."""
    u = m[at.ROLL_DRIVE] * w[at.OMEGA1, k] + m[at.ROLL_LOOSE] * w[at.OMEGA2, k]
    if k == 0 and abs(u) <= m[at.REST] * (m[at.ROLL_DRIVE] + m[at.ROLL_LOOSE]):
        u = 0.0
    w[at.ROLLING, k] = w[at.FILM_NOTE, 0] * u
    return m[at.RADIUS_LOOSE] * (_push(m, 1, k, w) - _push(m, 0, k, w))


@inner
def _push(m, flank, k, w):
    """Write and return the force of one flank's film, order k."""
    gap, push, squeezed = w[at.GAP + flank], w[at.PUSH + flank], w[at.FILM_NOTE, 1 + flank] > 0.0
    if w[at.FILM_NOTE, 3 + flank] > 0.0:
        total = m[at.WEDGE] / m[at.FLOOR] * w[at.ROLLING, k]
        if squeezed:
            total -= m[at.SQUEEZE] / (m[at.FLOOR] * sqrt(m[at.FLOOR])) * (k + 1) * gap[k + 1]
        push[k] = total
        return total
    root, thin = w[at.ROOT + flank], w[at.THIN + flank]
    inverse = 1.0 / (gap[0] + m[at.FLOOR])
    if k == 0:
        root[0], thin[0] = sqrt(inverse), inverse
    else:
        total = 0.0
        for j in range(k + 1):
            total += root[j] * root[k - j]
        thin[k] = total
    total = 0.0
    for j in range(1, k + 2):
        total -= (k + 1 - 0.5 * j) * gap[j] * root[k + 1 - j]
    root[k + 1] = total * inverse * at.INVERSE[k + 1]
    total = 0.0
    for j in range(k + 1):
        total += w[at.ROLLING, j] * thin[k - j]
    total *= m[at.WEDGE]
    if squeezed:
        total += 2.0 * m[at.SQUEEZE] * (k + 1) * root[k + 1]
    push[k] = total
    return total


@inner
def film_impulse(w, flank, n, x):
    """Return the integral of a flank's film force over [0, x]."""
    total = 0.0
    for k in range(n, -1, -1):
        total = (total + w[at.PUSH + flank, k] * at.INVERSE[k + 1]) * x
    return total


@inner
def radius(m, w, flank):
    """Return a lower bound on how far the series of a film converges: where |h| may vanish in the complex plane [s]."""
    gap = w[at.GAP + flank]
    h, c1, c2 = gap[0] + m[at.FLOOR], abs(gap[1]), abs(gap[2])
    return 2.0 * h / (c1 + sqrt(c1 * c1 + 4.0 * h * c2) + 1e-300)


@inner
def balance(m, state, flank, torque):
    """Return the gap at which the wedges bear a torque at rest, the middle of the backlash if no smaller one does."""
    u = abs(m[at.ROLL_DRIVE] * state[at.DRIVE_SPEED] + m[at.ROLL_LOOSE] * state[at.SPEED])
    whole = state[at.GAPS] + state[at.GAPS + 1]
    load = torque / m[at.RADIUS_LOOSE] if flank == 0 else -torque / m[at.RADIUS_LOOSE]
    low, high = 0.0, 0.5 * whole
    for _ in range(200):
        gap = 0.5 * (low + high)
        push = m[at.WEDGE] * u * (1.0 / (gap + m[at.FLOOR]) - 1.0 / (whole - gap + m[at.FLOOR]))
        if push > load:
            low = gap
        else:
            high = gap
    return 0.5 * (low + high)
