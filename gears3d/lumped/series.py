"""Power series of the motion over one step: drive, torques, flank deviations, flight, contact.

Recurrences for the series of composed functions are those of automatic differentiation (Griewank & Walther 2008,
chapter 13). All functions are compiled; ``w`` is the work array of :mod:`gears3d.lumped.layout`.
"""

from __future__ import annotations

from math import cos, exp, sin

from gears3d.effects.rows import Code
from gears3d.lumped.compile import inner
from gears3d.lumped.layout import (
    ANGLE,
    DEVIATION,
    DISPLACEMENT,
    DRY,
    GAP,
    GAPS,
    INVERSE,
    LIFT,
    OMEGA1,
    OMEGA2,
    RATES,
    REACTION,
    ROWS,
    SIGN,
    SPEED,
    THETA1,
    THETA2,
    TORQUE,
    S,
)  # fmt: skip

POWER, HARMONIC, RELAX = float(Code.TORQUE_POWER), float(Code.TORQUE_HARMONIC), float(Code.TORQUE_RELAX)
SLOW = 1e-6
"""Loose speed below which a power law goes on as a straight line through the origin [rad/s]."""


@inner
def drive(m, t, n, w):
    """Write drive speed and angle up to order n; Rigaud & Perret-Liaudet 2020, eq. (1)."""
    speed, angle = w[OMEGA1], w[THETA1]
    speed[0] = m.mean
    for k in range(1, n + 1):
        speed[k] = 0.0
    start = m.mean * t
    for i in range(m.harmonics.shape[0]):
        amplitude, omega, phase = m.harmonics[i, 0], m.harmonics[i, 1], m.harmonics[i, 2]
        a = amplitude * sin(omega * t + phase)
        b = amplitude * cos(omega * t + phase)
        start -= (b - amplitude * m.harmonics[i, 3]) / omega
        speed[0] += a
        for k in range(1, n + 1):
            a, b = b * omega * INVERSE[k], -a * omega * INVERSE[k]
            speed[k] += a
    angle[0] = start
    for k in range(1, n + 1):
        angle[k] = speed[k - 1] * INVERSE[k]


@inner
def torque(m, phase, t, sign, k, w):
    """Return the resisting torque's coefficient of order k; ``sign`` is the direction that dry friction resists."""
    speed = w[OMEGA2]
    total = m.base[phase, 1] * speed[k]
    if k == 0:
        total += m.base[phase, 0] * sign - m.base[phase, 2]
    for i in range(m.torques.shape[0]):
        if int(m.torques[i, 1]) >> phase & 1:
            code = m.torques[i, 0]
            if code == POWER:
                total += _power(m.torques[i, 2], m.torques[i, 3], sign, k, speed, w[ROWS + 2 * i])
            elif code == HARMONIC:
                _turn(m.torques[i, 2], m.torques[i, 4], w[THETA2, 0], speed, k, w[ROWS + 2 * i], w[ROWS + 2 * i + 1])
                total += m.torques[i, 3] * w[ROWS + 2 * i, k]
            elif code == RELAX:
                decay = w[ROWS + 2 * i]
                if k == 0:
                    decay[0] = exp(-t / m.torques[i, 3])
                    total += m.torques[i, 2] * sign
                else:
                    decay[k] = -decay[k - 1] * INVERSE[k] / m.torques[i, 3]
                total -= m.torques[i, 2] * sign * decay[k]
    return total


@inner
def _power(coefficient, exponent, sign, k, speed, p):
    """Coefficient·|ω|^exponent·sign, order k."""
    start = sign * speed[0]
    if start < SLOW:
        return coefficient * SLOW ** (exponent - 1.0) * speed[k] if sign != 0.0 else 0.0
    if k == 0:
        p[0] = start**exponent
    else:
        total = 0.0
        for j in range(1, k + 1):
            total += (exponent * j - (k - j)) * sign * speed[j] * p[k - j]
        p[k] = total * INVERSE[k] / start
    return coefficient * sign * p[k]


@inner
def _turn(order, phase, angle, speed, k, c, s):
    """Cosine and sine of order·θ + phase, order k, from the series of the speed up to k - 1."""
    if k == 0:
        c[0], s[0] = cos(order * angle + phase), sin(order * angle + phase)
        return
    a = b = 0.0
    for j in range(1, k + 1):
        a += speed[j - 1] * s[k - j]
        b += speed[j - 1] * c[k - j]
    c[k], s[k] = -order * a * INVERSE[k], order * b * INVERSE[k]


@inner
def deviate(m, gear, k, w):
    """Write both flanks' deviations of one gear, order k, from its speed up to k - 1."""
    active = reverse = 0.0
    first = ROWS + 2 * m.torques.shape[0]
    speed, angle = (w[OMEGA2], w[THETA2, 0]) if gear else (w[OMEGA1], w[THETA1, 0])
    for i in range(m.flanks.shape[0]):
        if int(m.flanks[i, 0]) == gear:
            c = w[first + 2 * i]
            _turn(m.flanks[i, 2], m.flanks[i, 4], angle, speed, k, c, w[first + 2 * i + 1])
            if m.flanks[i, 1] == 0.0:
                active += m.flanks[i, 3] * c[k]
            else:
                reverse += m.flanks[i, 3] * c[k]
    w[DEVIATION + 2 * gear, k] = active
    w[DEVIATION + 2 * gear + 1, k] = reverse


@inner
def deviation(m, gear, flank, angle):
    """Return a gear's deviation on a flank and its slope over the gear's angle [m, m/rad]."""
    value = slope = 0.0
    for i in range(m.flanks.shape[0]):
        if int(m.flanks[i, 0]) == gear and int(m.flanks[i, 1]) == flank:
            at = m.flanks[i, 2] * angle + m.flanks[i, 4]
            value += m.flanks[i, 3] * cos(at)
            slope -= m.flanks[i, 3] * m.flanks[i, 2] * sin(at)
    return value, slope


@inner
def _gaps(m, k, w):
    """Write displacement and both gaps, order k > 0."""
    w[S, k] = m.radius_loose * w[THETA2, k] - m.radius_drive * w[THETA1, k]
    w[GAP, k] = w[S, k] - w[DEVIATION, k] - w[DEVIATION + 2, k]
    w[GAP + 1, k] = -w[S, k] - w[DEVIATION + 1, k] - w[DEVIATION + 3, k]


@inner
def flight(m, state, n, pressed, w):
    """Write the loose gear's motion up to order n: J·θ̈2 = −T, plus the flank's force when ``pressed`` is 0 or 1.

    Kadmiri et al. 2012, eqs (13)-(16). The starts of the gaps and their rates are taken from the state, where they are
    known without cancellation. At rest (sign 0) REACTION holds the torque that pulls and DRY what dry friction bears.
    """
    t, sign = state[0], state[SIGN]
    drive(m, t, n, w)
    for k in range(n + 1):
        deviate(m, 0, k, w)
    w[OMEGA2, 0] = state[SPEED] if sign != 0.0 else 0.0
    w[THETA2, 0] = state[ANGLE]
    deviate(m, 1, 0, w)
    phase = 0 if pressed < 0 else 1 + pressed
    side = m.radius_loose if pressed == 0 else -m.radius_loose
    for k in range(n + 1):
        w[THETA2, k + 1] = w[OMEGA2, k] * INVERSE[k + 1]
        deviate(m, 1, k + 1, w)
        _gaps(m, k + 1, w)
        if k == 0:
            _anchor(state, w)
        force = 0.0
        if pressed >= 0:
            gap = w[GAP + pressed]
            force = -m.stiffness * gap[k] - m.damping * (k + 1) * gap[k + 1]
            w[REACTION, k] = force
        total = torque(m, phase, t, sign, k, w) - side * force
        if sign == 0.0:
            w[DRY, k] = torque(m, phase, t, 1.0, k, w) - torque(m, phase, t, 0.0, k, w)
            w[TORQUE, k] = total
            w[OMEGA2, k + 1] = 0.0
        else:
            w[OMEGA2, k + 1] = -total / m.inertia * INVERSE[k + 1]
            if k == 0 and w[OMEGA2, 0] == 0.0 and abs(w[OMEGA2, 1]) * m.radius_loose < m.unfelt:
                w[OMEGA2, 1] = 0.0
    if state[LIFT] >= 0.0:
        gap = w[GAP + int(state[LIFT])]
        if abs(gap[2]) < m.unfelt:
            gap[2] = 0.0


@inner
def _anchor(state, w):
    """Put the starts that the state knows in place of those worked out from large angles."""
    w[S, 0] = state[DISPLACEMENT]
    for flank in range(2):
        w[GAP + flank, 0] = state[GAPS + flank]
        w[GAP + flank, 1] = state[RATES + flank]
    w[S, 1] = w[GAP, 1] + w[DEVIATION, 1] + w[DEVIATION + 2, 1]


@inner
def contact(m, state, flank, phase, n, w):
    """Write the loose gear's motion on a flank up to order n, and the flank's reaction up to n - 2.

    The reaction is positive while the flank pushes, R = (J·θ̈2 + T)/Rb2 on the active flank; Kadmiri et al. 2012,
    eqs (21), (22), with the flanks' own accelerations. Returns the direction that dry friction resists.
    """
    t = state[0]
    drive(m, t, n, w)
    for k in range(n + 1):
        deviate(m, 0, k, w)
    side = 1.0 if flank == 0 else -1.0
    own, other = DEVIATION + flank, DEVIATION + 2 + flank
    w[THETA2, 0] = state[ANGLE]
    deviate(m, 1, 0, w)
    slope = deviation(m, 1, flank, state[ANGLE])[1]
    for k in range(1, n + 1):
        w[OMEGA2, k - 1] = 0.0
        deviate(m, 1, k, w)
        free = m.radius_drive * w[THETA1, k] + side * (w[own, k] + w[other, k])
        w[THETA2, k] = free / (m.radius_loose - side * slope)
        w[OMEGA2, k - 1] = k * w[THETA2, k]
        if m.flanks.shape[0]:
            deviate(m, 1, k, w)
        _gaps(m, k, w)
        w[S, k] = side * (w[own, k] + w[other, k])
        w[GAP + flank, k] = 0.0
    _anchor_contact(m, flank, side, w)
    sign = _direction(m, n, w)
    for k in range(n - 1):
        pull = torque(m, phase, t, sign, k, w)
        w[REACTION, k] = side * (m.inertia * (k + 1) * w[OMEGA2, k + 1] + pull) / m.radius_loose
    return sign


@inner
def _anchor_contact(m, flank, side, w):
    held = w[DEVIATION + flank, 0] + w[DEVIATION + 2 + flank, 0]
    away = w[DEVIATION + 1 - flank, 0] + w[DEVIATION + 3 - flank, 0]
    w[S, 0] = held if flank == 0 else m.backlash - held
    w[GAP + flank, 0] = 0.0
    w[GAP + 1 - flank, 0] = m.backlash - held - away


@inner
def _direction(m, n, w):
    """Sign of the loose gear's speed just after the start of the step, 0 at lasting rest; clears a start at rest."""
    if abs(w[OMEGA2, 0]) <= m.rest:
        w[OMEGA2, 0] = 0.0
    for k in range(n):
        if w[OMEGA2, k] != 0.0:
            return 1.0 if w[OMEGA2, k] > 0.0 else -1.0
    return 0.0
