"""Oil that teeth squeeze out of the tooth spaces of the mate."""

from __future__ import annotations

from itertools import pairwise
from math import cos, pi, sin
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gears3d.gears import profile
from gears3d.gears.outline import outline

if TYPE_CHECKING:
    from gears3d.gears import Pair

Array = NDArray[np.float64]
POSITIONS = 240  # positions of a tooth on its way through the space of its mate
CHORD = 1e-5  # chord error of the outlines [m]


def space_area(pair: Pair, which: str, angle: Array) -> Array:
    """Return the free area of a gear's tooth space within its tip circle, (n,) [m²], with the mate's tooth in it.

    ``angle`` [rad], (n,), is that of the *mate* from where its tooth stands on the line of centres; helical teeth count
    by their transverse section.

    Source: the lubricated dual-clutch transmission, fig. 7; the areas there came from Boolean operations on drawings.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30)
    >>> middle, out = space_area(Pair.from_backlash(gear, gear, 1e-4), "drive", np.array([0.0, 0.3]))
    >>> bool(0.0 < middle < 0.5 * out)
    True
    """
    gear, mate = pair.gear(which), "loose" if which == "drive" else "drive"
    free = (pi * gear.tip_radius**2 - outline(pair, which, CHORD).area) / gear.teeth
    tooth = profile(pair, mate, CHORD)
    tip = tooth[np.hypot(*tooth.T) > pair.gear(mate).tip_radius * (1.0 - 1e-9)]
    middle = 0.5 * float(np.arctan2(tip[0, 1], tip[0, 0]) + np.arctan2(tip[-1, 1], tip[-1, 0]))
    standing = _turned(tooth, pi - middle)  # its middle points from the mate's axis at (centre distance, 0) to the gear
    areas = np.zeros(len(angle))
    for i, turn in enumerate(angle):
        points = _turned(standing, turn) + np.array([pair.centre_distance, 0.0])
        inside = np.append(points, [[pair.centre_distance, 0.0]], axis=0)
        areas[i] = abs(area_in_circle(inside, gear.tip_radius))
    return free - areas


def squeezing_torque(pair: Pair, density: float, speed: float) -> float:
    """Return the mean torque [N·m] on the loose gear of oil squeezed out of the tooth spaces of both gears.

    It has the sign of the loose gear's ``speed`` [rad/s]; ``density`` is in kg/m³; helical teeth count as spur teeth of
    the same transverse section. The oil that leaves a space flows out of both ends with v = B·|dS/dt|/(2S); by
    Bernoulli's law it takes the pressure ½·ρ·v², and the power is pressure times volume a second, while the space gets
    smaller. Mean over the way of a tooth.

    Source: the lubricated dual-clutch transmission, eqs (17) to (22).

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30, face_width=0.01)
    >>> bool(squeezing_torque(Pair.from_backlash(gear, gear, 1e-4), 850.0, 100.0) > 0.0)
    True
    """
    width = min(pair.drive.face_width, pair.loose.face_width)
    power = 0.0
    for which, mate in (("drive", "loose"), ("loose", "drive")):
        teeth = pair.gear(mate).teeth
        turning = speed * pair.loose.teeth / teeth  # of the mate
        angle = np.linspace(-2.5, 2.5, POSITIONS) * 2.0 * pi / teeth
        area = space_area(pair, which, angle)
        loss = np.maximum(-np.gradient(area, angle), 0.0) * abs(turning)
        velocity = width * loss / (2.0 * area)
        work = np.trapezoid(0.5 * density * velocity**2 * width * loss, angle)
        power += work * teeth / (2.0 * pi)
    return float(power / speed) if speed else 0.0


def area_in_circle(points: Array, radius: float) -> float:
    """Return the area of a polygon (n, 2) [m] inside a circle about the origin, positive counter-clockwise [m²].

    >>> round(area_in_circle(np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]), 1.0), 9)
    3.141592654
    """
    total = 0.0
    for (x1, y1), (x2, y2) in zip(points, np.roll(points, -1, axis=0), strict=True):
        dx, dy = x2 - x1, y2 - y1
        a, b, c = dx * dx + dy * dy, x1 * dx + y1 * dy, x1 * x1 + y1 * y1 - radius**2
        root = b * b - a * c
        cuts = [0.0, 1.0]
        if a > 0.0 and root > 0.0:
            cuts += [t for t in ((-b - root**0.5) / a, (-b + root**0.5) / a) if 0.0 < t < 1.0]
        cuts.sort()
        for begin, end in pairwise(cuts):
            p, q = (x1 + begin * dx, y1 + begin * dy), (x1 + end * dx, y1 + end * dy)
            middle = 0.5 * (begin + end)
            cross = p[0] * q[1] - p[1] * q[0]
            if (x1 + middle * dx) ** 2 + (y1 + middle * dy) ** 2 <= radius**2:
                total += 0.5 * cross
            else:
                total += 0.5 * radius**2 * float(np.arctan2(cross, p[0] * q[0] + p[1] * q[1]))
    return total


def _turned(points: Array, angle: float) -> Array:
    c, s = cos(angle), sin(angle)
    return points @ np.array([[c, s], [-s, c]])
