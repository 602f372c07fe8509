"""From Bullet's closest points to teeth, and from teeth to the gap on the true flanks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import float64, int64, types

from gears3d.engine.compile import entry, inner
from gears3d.engine.lines import Along, along_of, line_gap
from gears3d.gears import Eccentricity, Misalignment, Wobble
from gears3d.gears.edge import Edged, edged_gap, edged_gap_at
from gears3d.gears.flank import Flanks, roll_of
from gears3d.records import Floats1, Record, address_of, caller

if TYPE_CHECKING:
    from gears3d.gears import Pair

ACTIVE, REVERSE = 0, 1
NOBODY = -1  # stands for a tooth where a point is on no flank that could touch the mate's
TOGETHER = 1e-10  # tooth pairs whose gaps differ by less touch together [m]
SAME_RATE = 1e-4  # tooth pairs whose approach speeds differ by less have their impact together [m/s]
_PITCH, _ACTIVE_START, _REVERSE_START = 1, 2, 3


class Mesh(Record):
    """The flanks of a pair with their edges, on axes that may deviate from the axes of rotation.

    Args:
        edged: flanks and edges on ideal axes.
        along: how flanks change with the height.
        offsets: of the teeth's axis from the axis of rotation in each gear's own frame, x and y of the drive, then of
            the loose gear [m], (4,).
        planar: whether one transverse section is enough.
        layer: distance of flanks that touch [m], the smallest thickness of the oil between them.
        law: address of the gap of two teeth, 0 for one section on ideal axes.
        seen: address of the gap as Bullet measures it, 0 where that is the same.
        side: address of :func:`side_gap`.
    """

    edged: Edged
    along: Along
    offsets: Floats1
    planar: bool
    layer: float
    law: int
    seen: int
    side: int


_GAP = types.UniTuple(float64, 3)(Mesh.compiled, float64, float64, int64, int64, int64, int64)
_call_gap = caller(_GAP)
TEETH = types.Array(int64, 2, "C")
_SIDE_GAP = types.Tuple((float64, float64, float64, int64))(Mesh.compiled, TEETH, int64, float64, float64)
# ``call_side(mesh.side, (mesh, teeth, side, theta_drive, theta_loose))``: :func:`side_gap`, compiled by itself.
call_side = caller(_SIDE_GAP)


def meshed(pair: Pair, layer: float = 0.0) -> Mesh:
    """Return the flanks of a pair for compiled functions, with a layer of oil [m] between flanks that touch."""
    along = along_of(pair)
    offsets = np.concatenate([offset_of(pair, which) for which in ("drive", "loose")])
    planar, law, seen = along.looks == 0, 0, 0
    if not planar:
        law, seen = address_of(_lined_gap, _GAP), address_of(_seen_gap, _GAP)
    elif offsets.any():
        law = address_of(_eccentric_gap, _GAP)
    return Mesh(along.surfaces.shape, along, offsets, planar, layer, law, seen, address_of(side_gap, _SIDE_GAP))


def offset_of(pair: Pair, which: str) -> np.ndarray:
    """Return how far the teeth's axis is from the axis of rotation, in the gear's own frame (2,) [m]."""
    sense = 1.0 if which == "drive" else -1.0
    offset = np.zeros(2)
    for item in pair.mounting:
        if isinstance(item, Eccentricity) and item.gear == which:
            offset += item.offset * np.array([math.cos(item.phase), sense * math.sin(item.phase)])
    return offset


def lean_of(pair: Pair) -> np.ndarray:
    """Return by how much the loose gear's axis leans with the height, x away from the drive and y (2,) [m/m]."""
    leans = [(item.in_plane, item.out_of_plane) for item in pair.mounting if isinstance(item, Misalignment)]
    return np.tan(np.array(leans).reshape(-1, 2)).sum(axis=0)


def tilt_of(pair: Pair, which: str) -> np.ndarray:
    """Return the slope of the teeth's axis to the axis of rotation, in the gear's own frame (2,) [m/m]."""
    sense = 1.0 if which == "drive" else -1.0
    tilt = np.zeros(2)
    for item in pair.mounting:
        if isinstance(item, Wobble) and item.gear == which:
            tilt += math.tan(item.angle) * np.array([math.cos(item.phase), sense * math.sin(item.phase)])
    return tilt


@inner
def off_axis(mesh: Mesh, gear: int, rotation: float) -> tuple[float, float]:
    """Return where a gear's teeth have their axis, from the axis of rotation, in the world [m].

    ``gear`` is 0 drive, 1 loose; ``rotation`` [rad] is the angle about +z of the gear's own frame.
    """
    x, y = mesh.offsets[2 * gear], mesh.offsets[2 * gear + 1]
    c, s = math.cos(rotation), math.sin(rotation)
    return c * x - s * y, s * x + c * y


@entry
def _lined_gap(mesh, theta_drive, theta_loose, tooth_drive, tooth_loose, side, part):
    """As :func:`tooth_gap`, of teeth whose gap varies over the face."""
    gap, by_drive, by_loose, _, _ = line_gap(mesh.along, theta_drive, theta_loose, tooth_drive, tooth_loose, side, part)
    return gap, by_drive, by_loose


@entry
def _seen_gap(mesh, theta_drive, theta_loose, tooth_drive, tooth_loose, side, part):
    """The gap as Bullet measures it: along the normal, also of teeth that touch only at edges."""
    gap, _, _, _, inside = line_gap(mesh.along, theta_drive, theta_loose, tooth_drive, tooth_loose, side, part)
    return gap * mesh.along.tilt if inside else math.inf, 0.0, 0.0


@entry
def _eccentric_gap(mesh, theta_drive, theta_loose, tooth_drive, tooth_loose, side, part):
    """As :func:`tooth_gap`, of one section on axes that deviate from the axes of rotation."""
    turned = math.pi - theta_loose
    x1, y1 = off_axis(mesh, 0, theta_drive)
    x2, y2 = off_axis(mesh, 1, turned)
    centre = (mesh.edged.flanks.mount[2] + x2 - x1, y2 - y1)
    gap, by_drive, by_loose, _, _, nx, ny, _ = edged_gap_at(
        mesh.edged, centre, theta_drive, turned, tooth_drive, tooth_loose, side
    )
    if gap == math.inf:
        return gap, 0.0, 0.0
    return gap, by_drive + y1 * nx - x1 * ny, y2 * nx - x2 * ny - by_loose


@inner
def tooth_gap(mesh: Mesh, theta_drive: float, theta_loose: float, teeth: np.ndarray) -> tuple[float, float, float]:
    """Return the gap of two teeth on one side [m] and its derivatives by the angles of drive and loose gear [m/rad].

    Angles are in rad; ``teeth`` (3,) is tooth of the drive gear, tooth of the loose gear and side, 0 active, 1 reverse,
    or (4,) with the part of their line of contact.
    """
    tooth_drive, tooth_loose, side = teeth[0], teeth[1], teeth[2]
    if mesh.law != 0:
        part = teeth[3] if teeth.shape[0] > 3 else 0
        return _call_gap(mesh.law, (mesh, theta_drive, theta_loose, tooth_drive, tooth_loose, side, part))
    gap, by_drive, by_loose, _ = edged_gap(mesh.edged, theta_drive, theta_loose, tooth_drive, tooth_loose, side)
    return gap, by_drive, by_loose


@entry
def side_gap(
    shape: Mesh, teeth: np.ndarray, side: int, theta_drive: float, theta_loose: float
) -> tuple[float, float, float, int]:
    """Return the smallest gap of one side among the candidate teeth, measured on the true flanks.

    That is the gap over the layer of oil [m], its derivatives by the angles of drive and loose gear [m/rad], and its
    row of ``teeth``; without candidates the gap is infinite. ``teeth`` (n, 3) is tooth of the drive gear, tooth of the
    loose gear, side, and in a fourth column the part of their line of contact; angles are in rad; ``side`` is 0 active,
    1 reverse.
    """
    best, by_drive, by_loose, row = math.inf, 0.0, 0.0, NOBODY
    for i in range(teeth.shape[0]):
        if teeth[i, 2] == side:
            gap, drive, loose = tooth_gap(shape, theta_drive, theta_loose, teeth[i])
            if gap < best:
                best, by_drive, by_loose, row = gap, drive, loose, i
    return best - shape.layer, by_drive, by_loose, row


@inner
def tooth_at(flanks: Flanks, gear: int, count: int, angle: float) -> tuple[int, int]:
    """Return the number of the tooth (1 to ``count``) and its side at a polar angle [rad] in the gear's own frame.

    ``gear`` is 0 drive, 1 loose.
    """
    pitch = flanks.gears[gear, _PITCH]
    middle = 0.5 * (flanks.gears[gear, _ACTIVE_START] + flanks.gears[gear, _REVERSE_START])
    place = (middle - angle) / pitch
    tooth = int(np.rint(place))
    beside = (tooth - place) * pitch
    return tooth % count + 1, ACTIVE if beside > 0.0 else REVERSE


def teeth_of_points(
    shape: Mesh,
    counts: tuple[int, int],
    on_drive: np.ndarray,
    on_loose: np.ndarray,
    theta_drive: float,
    theta_loose: float,
) -> np.ndarray:
    """Return the teeth and sides that Bullet's closest points lie on, (n, 3): drive tooth, loose tooth, side.

    NOBODY is the side where the two do not match. ``counts`` are the numbers of teeth of drive and loose gear; points
    are in the world (n, 3) [m], angles in rad.
    """
    found = np.zeros((on_drive.shape[0], 3), np.int64)
    _name_teeth(shape, counts, on_drive, on_loose, (theta_drive, theta_loose), found)
    return found


@entry
def _name_teeth(shape, counts, on_drive, on_loose, thetas, found):
    """Fill in the result of :func:`teeth_of_points`."""
    flanks, distance = shape.edged.flanks, shape.edged.flanks.mount[2]
    x1, y1 = off_axis(shape, 0, thetas[0])
    x2, y2 = off_axis(shape, 1, math.pi - thetas[1])
    for i in range(on_drive.shape[0]):
        turn1, turn2 = shape.along.axial[0, 0] * on_drive[i, 2], shape.along.axial[1, 0] * on_loose[i, 2]
        angle = math.atan2(on_drive[i, 1] - y1, on_drive[i, 0] - x1) - thetas[0] - turn1
        found[i, 0], side = tooth_at(flanks, 0, counts[0], angle)
        angle = math.atan2(on_loose[i, 1] - y2, on_loose[i, 0] - distance - x2) - math.pi + thetas[1] - turn2
        found[i, 1], mate = tooth_at(flanks, 1, counts[1], angle)
        found[i, 2] = side if side == mate else NOBODY


def both_sides(found: np.ndarray) -> bool:
    """Return whether there are teeth on the active and on the reverse side; ``found`` (n, 3)."""
    sides = found[:, 2].tolist()
    return ACTIVE in sides and REVERSE in sides


@entry
def touching_teeth(
    shape: Mesh, teeth: np.ndarray, side: int, angles: tuple[float, float], speeds: tuple[float, float]
) -> tuple[int, int]:
    """Return the numbers of the teeth in an impact; of several pairs as fast, those next to the pitch point.

    ``teeth`` (n, 3) are candidates, ``side`` is 0 active, 1 reverse; ``angles`` [rad] and ``speeds`` [rad/s] just
    before are those of drive and loose gear.
    """
    least = side_gap(shape, teeth, side, angles[0], angles[1])[0] + shape.layer
    mount = shape.edged.flanks.mount
    drive, loose, nearest, fastest = 0, 0, math.inf, math.inf
    for i in range(teeth.shape[0]):
        if teeth[i, 2] != side:
            continue
        gap, by_drive, by_loose = tooth_gap(shape, angles[0], angles[1], teeth[i])
        if gap > least + TOGETHER:
            continue
        rate = by_drive * speeds[0] + by_loose * speeds[1]
        # at the pitch point the roll angle is the tangent of the working pressure angle
        u = (1.0 - 2.0 * side) * mount[3] - angles[0]
        away = abs(roll_of(shape.edged.flanks, 0, side, teeth[i, 0], u) - mount[0] / mount[1])
        if rate < fastest - SAME_RATE or (rate < fastest + SAME_RATE and away < nearest):
            drive, loose, nearest = teeth[i, 0], teeth[i, 1], away
            fastest = min(rate, fastest)
    return drive, loose


@entry
def compare_raw(
    shape: Mesh,
    teeth: np.ndarray,
    raw: np.ndarray,
    thetas: tuple[float, float],
    limits: tuple[float, float, float],
    sums: np.ndarray,
    seen: np.ndarray,
) -> tuple[int, float, float]:
    """Compare Bullet's gaps with the refined ones, of the tooth pairs that touch first, or nearly so.

    The result is the row of ``teeth`` (n, 3) that differs most, its excess and its refined gap [m]. ``raw`` (n,) [m]
    has the margins subtracted; ``thetas`` [rad] are the angles of drive and loose gear; ``limits`` [m] are by how much
    more open than the nearest a gap may be to count, and the deepest and the widest gap compared; ``sums`` (4,) takes
    count, sum, sum of squares and largest size of the differences, ``seen`` (2, 2, teeth) the compared flanks of drive
    and loose gear.
    """
    slack, deepest, widest = limits
    gaps = np.full(teeth.shape[0], math.inf)
    least = np.full(2, math.inf)
    for i in range(teeth.shape[0]):
        side = teeth[i, 2]
        if side == NOBODY:
            continue
        if shape.seen != 0:
            gaps[i] = _call_gap(shape.seen, (shape, thetas[0], thetas[1], teeth[i, 0], teeth[i, 1], side, 0))[0]
        else:
            gaps[i] = tooth_gap(shape, thetas[0], thetas[1], teeth[i])[0]
        least[side] = min(least[side], gaps[i])
    row, worst, refined = NOBODY, 0.0, 0.0
    for i in range(teeth.shape[0]):
        if deepest <= gaps[i] <= widest and gaps[i] <= least[teeth[i, 2]] + slack:
            excess = raw[i] - gaps[i]
            for gear in range(2):
                seen[gear, teeth[i, 2], teeth[i, gear] - 1] = 1
            sums[0] += 1.0
            sums[1] += excess
            sums[2] += excess * excess
            sums[3] = max(sums[3], abs(excess))
            if abs(excess) > abs(worst):
                row, worst, refined = i, excess, gaps[i]
    return row, worst, refined
