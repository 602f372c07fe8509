"""First roots of polynomials, found from the left by lower bounds, without missed or spurious roots."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from gears3d.lumped.compile import inner, owner


@inner
def value(c, n, x):
    """Return Σ c[k]·x^k up to order n."""
    total = c[n]
    for k in range(n - 1, -1, -1):
        total = total * x + c[k]
    return total


@inner
def slope(c, n, x):
    """Return the derivative of Σ c[k]·x^k."""
    total = n * c[n]
    for k in range(n - 1, 0, -1):
        total = total * x + k * c[k]
    return total


@inner
def curvature(c, n, x):
    """Return the second derivative of Σ c[k]·x^k."""
    total = n * (n - 1) * c[n]
    for k in range(n - 1, 1, -1):
        total = total * x + k * (k - 1) * c[k]
    return total


@inner
def first_root(c, sign, n, reach):
    """Return the first x in (0, reach) where sign·Σ c[k]·x^k falls below zero, infinity if it does not.

    Leading zeros are divided out, so a start on the axis is not a root. If the quotient falls all the way, its root is
    the only one. Else, from each point the polynomial stays above the parabola with its value and slope and the most
    negative second derivative within reach; the next point is that parabola's root. It never passes a root and
    converges quadratically. 0 means that it falls at once.
    """
    lead = 0
    while lead < n and c[lead] == 0.0:
        lead += 1
    d = n - lead
    q0 = sign * c[lead]
    if q0 <= 0.0:
        return 0.0 if q0 < 0.0 else inf
    if d == 0:
        return inf
    q1 = sign * c[lead + 1]
    bend, rise, power = 0.0, 0.0, 1.0
    for k in range(2, d + 1):
        term = sign * c[lead + k] * k * power
        power *= reach
        if term < 0.0:
            bend -= term * (k - 1)
        else:
            rise += term * reach
    if q1 + rise < 0.0:
        return _only_root(c, sign, lead, d, reach)
    x = 0.0
    for _ in range(12):
        root = sqrt(q1 * q1 + 2.0 * bend * q0)
        if q1 < 0.0:
            step = 2.0 * q0 / (root - q1)
        elif bend > 0.0:
            step = (q1 + root) / bend
        else:
            return inf
        x += step
        if x >= reach:
            return inf
        if step <= 1e-15 * x:
            return x
        q0, q1 = _ahead(c, sign, lead, d, x)
        if q0 <= 0.0:
            return x
    return _creep(c, sign, lead, n, x, reach)


@inner
def _ahead(c, sign, lead, d, x):
    """Return value and slope of the series without its leading zeros."""
    q0, q1 = c[lead + d], 0.0
    for k in range(d - 1, -1, -1):
        q1 = q1 * x + q0
        q0 = q0 * x + c[lead + k]
    return sign * q0, sign * q1


@inner
def _only_root(c, sign, lead, d, reach):
    """The root of a series that falls all the way to ``reach``: Halley's method from the parabola of a bounce."""
    q0, q1 = sign * c[lead], sign * c[lead + 1]
    q2 = sign * c[lead + 2] if d > 1 else 0.0
    spread = q1 * q1 - 4.0 * q2 * q0
    x = 2.0 * q0 / (sqrt(spread) - q1) if spread > 0.0 else -q0 / q1
    for _ in range(50):
        x = min(x, reach)
        q0, q1, q2 = c[lead + d], 0.0, 0.0
        for k in range(d - 1, -1, -1):
            q2 = q2 * x + q1
            q1 = q1 * x + q0
            q0 = q0 * x + c[lead + k]
        if x == reach and sign * q0 >= 0.0:
            return inf
        step = -q0 / (q1 - q0 * q2 / q1)
        x = max(x + step, 0.0)
        if abs(step) <= 3e-6 * x:
            return x
    return x


@owner
def _creep(c, sign, lead, n, start, reach):
    """Continue like :func:`first_root` where roots are close: the shifted series has tighter bounds."""
    d = n - lead
    q = np.zeros(d + 1)
    for k in range(d + 1):
        q[k] = sign * c[lead + k]
    x, step = 0.0, start
    for _ in range(300):
        for i in range(d):
            for k in range(d - 1, i - 1, -1):
                q[k] += step * q[k + 1]
        x += step
        if q[0] <= 0.0:
            return x
        window, step = 2.0 * (reach - x), 0.0
        for _ in range(60):
            if step >= 0.3 * window:
                break
            window *= 0.5
            bend, power = 0.0, 1.0
            for k in range(2, d + 1):
                bend += max(0.0, -q[k]) * k * (k - 1) * power
                power *= window
            root = sqrt(q[1] * q[1] + 2.0 * bend * q[0])
            step = 2.0 * q[0] / (root - q[1]) if root > q[1] else inf
        step = min(step, window)
        if x + step >= reach * (1.0 - 1e-15):
            return inf
        if step <= 1e-15 * x:
            return x
    return x


@inner
def highest(c, n, reach):
    """Return the largest value of Σ c[k]·x^k over [0, reach], for one that has at most one hump there."""
    parabolic = c[1] > 0.0 and c[2] < 0.0
    x = min(-0.5 * c[1] / c[2] if parabolic else 0.7 * reach, reach)
    for _ in range(20):
        d0, d1, d2 = c[n], 0.0, 0.0
        for k in range(n - 1, -1, -1):
            d2 = d2 * x + d1
            d1 = d1 * x + d0
            d0 = d0 * x + c[k]
        if x == reach and d1 >= 0.0:
            return max(c[0], d0)
        if d2 >= 0.0:
            break
        step = -0.5 * d1 / d2
        if abs(step) <= 1e-3 * x:
            return d0 + 0.5 * d1 * step
        x = min(max(x + step, 0.0), reach)
        if x == 0.0:
            return c[0]
    return max(c[0], value(c, n, reach))
