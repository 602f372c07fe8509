"""The root of a tooth as a rack with rounded tips cuts it, and where the involute begins."""

from __future__ import annotations

from math import acos, atan2, cos, hypot, pi, sin, sqrt, tan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gears3d.gears.involute import inv

if TYPE_CHECKING:
    from gears3d.gears.gear import Gear


def _tip_circle(gear: Gear, half_angle: float) -> tuple[float, float]:
    """Centre of the rack's tip rounding: distance from the middle of its tooth and depth below the pitch line [m]."""
    half_thickness = (half_angle - inv(gear.transverse_pressure_angle)) * gear.reference_radius
    half_tooth = 0.5 * pi * gear.transverse_module - half_thickness
    radius = gear.fillet_radius * gear.module
    depth = (gear.dedendum - gear.profile_shift) * gear.module - radius
    slope = tan(gear.transverse_pressure_angle)
    offset = half_tooth - depth * slope - radius / (cos(gear.pressure_angle) * cos(gear.helix_angle))
    return max(offset, 0.0), depth


def fillet(gear: Gear, half_angle: float, angle: float) -> tuple[float, float]:
    """Return a point of the root fillet that the rounded tip of the rack leaves, by the law of gearing.

    Args:
        gear: the gear.
        half_angle: half the angle that a tooth spans at the base circle [rad].
        angle: direction of the rack's normal there, from the pressure angle (end of the involute, unless undercut)
            to π/2 (root circle) [rad].

    Returns:
        Distance from the axis [m] and angle from the middle of the tooth [rad].

    Source: Litvin & Fuentes 2004, Gear Geometry and Applied Theory, section 6.
    """
    across, up, shift = _cut(gear, half_angle, cos(angle), sin(angle))
    return hypot(across, up), pi / gear.teeth - (atan2(across, up) - shift / gear.reference_radius)


def _cut(gear: Gear, half_angle: float, cosine: Any, sine: Any) -> tuple[Any, Any, Any]:
    """Place of the fillet across and along the middle of its space, and how far the rack has moved there [m]."""
    offset, depth = _tip_circle(gear, half_angle)
    radius = gear.fillet_radius * gear.module
    along = offset + radius * cosine / cos(gear.helix_angle)
    deep = depth + radius * sine
    shift = deep * cosine * cos(gear.helix_angle) / sine - along
    return along + shift, gear.reference_radius - deep, shift


def form(gear: Gear, half_angle: float) -> tuple[float, float]:
    """Return where the involute begins above the root fillet.

    Args:
        gear: the gear.
        half_angle: half the angle that a tooth spans at the base circle [rad].

    Returns:
        Roll angle of the perfect involute and the ``angle`` of :func:`fillet` there [rad]; where the rack undercuts
        the tooth, those of the point where the fillet crosses the involute.

    >>> from gears3d.gears import Gear
    >>> gear = Gear(3.5e-3, 90)
    >>> round(form(gear, gear.base_half_angle)[0], 4)
    0.2889
    """
    depth = (gear.dedendum - gear.profile_shift - gear.fillet_radius * (1.0 - sin(gear.pressure_angle))) * gear.module
    alpha = gear.transverse_pressure_angle
    roll = tan(alpha) - depth / (gear.base_radius * sin(alpha))
    return (roll, gear.pressure_angle) if roll >= 0.0 else _crossing(gear, half_angle)


def _crossing(gear: Gear, half_angle: float) -> tuple[float, float]:
    """Find where the fillet of an undercut tooth cuts into the involute, or passes the base circle if it does not."""

    def outside(angle: float) -> bool:
        radius, polar = fillet(gear, half_angle, angle)
        return radius > gear.base_radius and polar > half_angle - inv(acos(gear.base_radius / radius))

    low, high = gear.pressure_angle, 0.5 * pi
    for angle in np.linspace(low, high, 400):
        if not outside(float(angle)):
            high = float(angle)
            break
        low = float(angle)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if outside(middle) else (low, middle)
    radius = max(fillet(gear, half_angle, low)[0], gear.base_radius)
    return sqrt((radius / gear.base_radius) ** 2 - 1.0), low


def fillet_points(gear: Gear, half_angle: float, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return fillet points as (distance from the axis [m], angle from the middle of the tooth [rad]), (n, 2)."""
    across, up, shift = _cut(gear, half_angle, np.cos(angles), np.sin(angles))
    polar = pi / gear.teeth - (np.arctan2(across, up) - shift / gear.reference_radius)
    return np.column_stack((np.hypot(across, up), polar))
