"""The drag of a loose gear from its parts, oil squeezed out of tooth spaces among them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import cos, pi, sin
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gears3d.gears import profile
from gears3d.gears.outline import outline
from gears3d.laws.drag import couette, end_faces, periphery, rolling_bearing

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


@dataclass(frozen=True)
class Bath:
    """The oil that the loose gear dips into.

    Args:
        density: [kg/m³].
        viscosity: dynamic [Pa·s].
        depth: how deep the reference circle dips [m].
    """

    density: float
    viscosity: float
    depth: float


@dataclass(frozen=True)
class Bearing:
    """The bearing of the loose gear on its shaft: ``factor`` f0 and mean ``diameter`` dm [m]."""

    factor: float
    diameter: float


@dataclass(frozen=True)
class Synchroniser:
    """The open cone of a synchroniser: ``length`` L, mean ``radius`` R and ``clearance`` jc [m]."""

    length: float
    radius: float
    clearance: float


def drag_parts(
    pair: Pair,
    speed: float,
    bath: Bath,
    bearing: Bearing | None = None,
    synchroniser: Synchroniser | None = None,
    shaft_speed: float = 0.0,
) -> dict[str, float]:
    """Return the resisting torques on a loose gear, part by part, and the sum.

    Args:
        pair: the pair.
        speed: of the loose gear [rad/s].
        bath: the oil.
        bearing: ``None`` for none.
        synchroniser: ``None`` for none.
        shaft_speed: of the shaft under bearing and synchroniser [rad/s].

    Returns:
        ``end_faces``, ``periphery``, ``squeezing``, ``bearing``, ``synchroniser`` and ``total`` [N·m].

    Raises:
        ValueError: the gear does not dip into the oil.

    Source: the lubricated dual-clutch transmission, eqs (15) to (26); in (25) as restored, half of what is printed.

    >>> from gears3d.scenario import load
    >>> pair = load("scenarios/base/helical-17-43.toml").pair()
    >>> parts = drag_parts(pair, 62.1, Bath(816.0, 0.0098, 0.02), Bearing(12, 45e-3), Synchroniser(8e-3, 37.5e-3, 2e-4))
    >>> [round(parts[name], 4) for name in ("bearing", "synchroniser")]
    [0.0405, 0.0081]
    """
    radius, kinematic = pair.loose.reference_radius, bath.viscosity / bath.density
    height, against = radius - bath.depth, speed - shaft_speed
    oil = (bath.density, kinematic, speed)
    parts = {
        "end_faces": float(end_faces(radius, height, *oil)),
        "periphery": float(periphery(radius, pair.loose.face_width, height, *oil)),
        "squeezing": squeezing_torque(pair, bath.density, speed),
        "bearing": float(rolling_bearing(bearing.factor, bearing.diameter, kinematic, against)) if bearing else 0.0,
        "synchroniser": 0.0,
    }
    if synchroniser is not None:
        cone = (synchroniser.length, synchroniser.radius, synchroniser.clearance)
        parts["synchroniser"] = float(couette(bath.viscosity, *cone, against))
    return parts | {"total": sum(parts.values())}
