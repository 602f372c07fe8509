"""Gears cut out of a blank by a rack, polygon by polygon: a second opinion that shares no formula with gears3d.

Lengths are in normal modules. The rack stands in its normal section, is rounded by an offset inwards and out again, is
stretched along the pitch line for helical gears, rolls on the reference circle in small steps, and what it sweeps is
taken off the blank. Between two steps a scallop of under 1e-5 modules stays on the flank.
"""

from math import atan, ceil, cos, pi, sqrt, tan
from typing import NamedTuple

import numpy as np
import shapely
from shapely import affinity
from shapely.geometry import Polygon, box

SEEN = 3
"""Teeth to either side of the one on +x."""
STEPS = 500


class Shape(NamedTuple):
    """A gear by its tooth count, rack and helix; lengths in normal modules, angles in rad."""

    teeth: int
    pressure_angle: float
    helix: float
    shift: float
    addendum: float
    dedendum: float
    fillet: float

    @property
    def reference(self):
        return 0.5 * self.teeth / cos(self.helix)

    @property
    def transverse(self):
        return atan(tan(self.pressure_angle) / cos(self.helix))

    @property
    def base(self):
        return self.reference * cos(self.transverse)

    @property
    def tip(self):
        return self.reference + self.addendum + self.shift


def rack_tooth(shape):
    """The rack's tooth that cuts the space on +x, pointing down; the datum line is y = 0."""
    slope, high = tan(shape.pressure_angle), shape.addendum + 2.0

    def half(y):
        return 0.25 * pi + y * slope

    corners = [(-half(-shape.dedendum), -shape.dedendum), (half(-shape.dedendum), -shape.dedendum)]
    tooth = Polygon([*corners, (half(high), high), (-half(high), high)])
    if shape.fillet:
        tooth = tooth.buffer(-shape.fillet, quad_segs=64).buffer(shape.fillet, quad_segs=64)
    tooth = tooth.intersection(box(-9.0, -9.0, 9.0, high - 0.5))  # the upper corners are rounded too
    return np.array(tooth.exterior.coords)[:-1] / [cos(shape.helix), 1.0]


def space(shape):
    """What the rack sweeps out of the blank around +x, the middle of the space."""
    tooth = rack_tooth(shape)
    travel = sqrt(shape.tip**2 - (0.9 * shape.base) ** 2) + 3.0
    roll = np.linspace(-travel, travel, STEPS) / shape.reference
    # the rack's pitch line is x = reference; its tooth points to −x
    x = shape.reference + shape.shift + tooth[:, 1]
    x, y = np.broadcast_to(x, (STEPS, len(x))), tooth[:, 0] + shape.reference * roll[:, None]
    c, s = np.cos(roll)[:, None], np.sin(roll)[:, None]
    swept = shapely.polygons(np.stack([c * x + s * y, c * y - s * x], axis=2))
    return shapely.union_all(swept)


def section(shape):
    """The gear around +x, where a tooth stands, and ``SEEN`` teeth to either side."""
    pitch = 2 * pi / shape.teeth
    reach = min((SEEN + 0.5) * pitch, pi)
    angles = np.linspace(-reach, reach, ceil(2 * reach / 2e-3))
    low = max(shape.reference + shape.shift - shape.dedendum - 1.0, 0.2)
    arc = np.c_[np.cos(angles), np.sin(angles)]
    blank = Polygon(np.vstack([shape.tip * arc, low * arc[::-1]]))
    cut = space(shape)
    spaces = [affinity.rotate(cut, (k + 0.5) * pitch, (0, 0), use_radians=True) for k in range(-SEEN - 1, SEEN + 1)]
    return blank.difference(shapely.union_all(spaces))


def inv(angle):
    return tan(angle) - angle


def working_angle(drive, loose, backlash):
    """Working pressure angle for a dead band along the transverse line of action, by bisection."""
    base_sum = drive.base + loose.base
    shifts = 2 * drive.base / drive.teeth * (drive.shift + loose.shift) * tan(drive.pressure_angle)
    wanted = inv(drive.transverse) + (0.5 * backlash + shifts) / base_sum
    low, high = 0.0, 1.4
    for _ in range(80):
        low, high = (0.5 * (low + high), high) if inv(0.5 * (low + high)) < wanted else (low, 0.5 * (low + high))
    return low


def half_angle(shape):
    """Half the angle of a full tooth at the base circle."""
    return (0.5 * pi + 2 * shape.shift * tan(shape.pressure_angle)) / shape.teeth + inv(shape.transverse)


def posed(polygon, shape, angle, drive, theta, centre_distance=0.0):
    """The section turned so that its active flank passes the pitch point at theta = 0."""
    middle = half_angle(shape) - inv(angle)  # from the flank on the pitch circle to the middle of the tooth
    turn = theta - middle if drive else pi - theta - middle
    return affinity.translate(affinity.rotate(polygon, turn, (0, 0), use_radians=True), centre_distance, 0.0)
