"""The involute function and its inverse."""

from __future__ import annotations

from math import atan, cbrt, tan

from gears3d.errors import InputError


def inv(angle: float) -> float:
    """Return the involute function, tan(angle) − angle.

    Args:
        angle: pressure angle [rad].

    Returns:
        Polar angle between the start of the involute and the point [rad].

    Source: ISO 21771:2007, involute function.

    >>> round(inv(0.3490658503988659), 9)
    0.014904384
    """
    return tan(angle) - angle


def inverse_inv(value: float) -> float:
    """Return the pressure angle whose involute function is ``value``.

    Newton on the tangent t of the angle, t − atan(t) = value, which is convex and rises: it cannot miss.

    Args:
        value: inv(angle) [rad], not negative.

    Returns:
        The pressure angle [rad].

    Raises:
        InputError: the value is negative, no involute has such a point.

    >>> round(inverse_inv(inv(0.4)), 14)
    0.4
    """
    if value < 0.0:
        raise InputError(f"inv(angle) = {value:.6g} has no solution: the gears cannot mesh (give a value ≥ 0)")
    tangent = max(cbrt(3.0 * value), 2.0 * value)
    for _ in range(60):
        if tangent == 0.0:
            return 0.0
        step = (tangent - atan(tangent) - value) * (1.0 + tangent * tangent) / (tangent * tangent)
        tangent -= step
        if abs(step) <= 2e-16 * abs(tangent):
            break
    return atan(tangent)
