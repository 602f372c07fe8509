"""Flanks as surfaces over the face width, spur and helical, and the gap of two of them on real axes.

Across the axis every section of a flank is the same curve, turned by an angle that grows with the height z: by the
helix with its slope deviation, and by lead crowning. A rotation by dφ moves an involute by base radius × dφ along the
transverse line of action, so deviations of the lead are what ISO 1328-1 measures. On eccentric, wobbling or misaligned
axes the sections are shifted as well; their tilt out of the transverse plane is left out, which is wrong by half its
square times the tooth's distance from the middle: 0.1 µm for 1 mrad at 200 mm.

The gap of two teeth is the smallest over the face, in transverse sections, tip edges included.
"""

from __future__ import annotations

from math import cos, inf, pi, sin, tan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gears3d.gears.deviation import FLANKS, GEARS, Eccentricity, HelixSlope, Misalignment, Wobble
from gears3d.gears.edge import Edged, edged_gap_at, edges_of, trace_edge
from gears3d.gears.flank import (
    DIRECTION,
    DISTANCE,
    ROOT_RELIEF,
    START,
    TIP_RELIEF,
    TIP_ROLL,
    Flanks,
    compile_pair,
    flank_point,
    roll_of,
)
from gears3d.kernels import inner, njit
from gears3d.records import Floats2, Floats3, Record

if TYPE_CHECKING:
    from gears3d.gears.gear import Gear
    from gears3d.gears.pair import Pair

_TURN, _LEAN, _HALF, _OFF_X, _OFF_Y, _TILT_X, _TILT_Y, _AXIS = 0, 1, 2, 3, 4, 5, 6, 7
_SECTIONS = 8  # Least parts of the face in each of which the gap has at most one minimum
_PER_WAVE = 8  # Such parts in a wave of the profiles: in 1/4 of a wave about its crest the gap is convex
_STEEPER = 2.0  # How much steeper than at the ends of such a part the gap may be inside
_LEVEL = 1e-14  # Smallest gaps that may be lower by less need no search [m]
_STEP = 1e-6  # Over which a deviating section's change with the height is differenced [m]
_SEARCHES = 90  # At most: golden sections and halvings, more than a float resolves
_WITHIN = 1e-12  # How near the height of the smallest gap is found [m]
_LEVEL_SLOPE = 1e-13  # Slope of the gap at its minimum, by rounding [m/m]


class Surfaces(Record):
    """The flanks of a pair over their face width, on their axes.

    Args:
        shape: flanks and edges in the transverse section.
        axial: for each gear the turn of its sections [rad/m], their turn by crowning [rad/m²], half the face width [m],
            offset of the teeth's axis in the gear's own frame x, y [m] and its change with z x, y; last for the drive
            the lean of the loose axis in the plane of the axes, for the loose gear that across it, (2, 8).
        leads: turn by helix slope of each tooth's flanks beyond that [rad/m]; nothing where none deviates,
            (2, 2, teeth or 0).
        section: flanks and edges of the section that is looked at, where it differs from that in the middle.
        sections: parts of the face in each of which the gap has at most one minimum.
    """

    shape: Edged
    axial: Floats2
    leads: Floats3
    section: Edged
    sections: int


def lead_turn(gear: Gear, sense: float) -> float:
    """Return by how much a gear's sections turn about +z with the height z, its helix slope included [rad/m].

    Args:
        gear: the gear.
        sense: 1 for the drive, -1 for the loose gear, whose helix has the opposite hand.
    """
    return sense * tan(gear.helix_angle) / gear.reference_radius + gear.helix_slope / (
        gear.face_width * gear.base_radius
    )


def flank_leads(pair: Pair) -> NDArray[np.float64]:
    """Return by how much sections of single flanks turn about +z with the height by their helix slope [rad/m]."""
    found = [each for each in pair.deviations if isinstance(each, HelixSlope)]
    leads = np.zeros((2, 2, max(pair.drive.teeth, pair.loose.teeth) if found else 0))
    for each in found:
        gear, side = pair.gear(each.gear), 1.0 - 2.0 * FLANKS.index(each.flank)
        teeth = slice(None) if each.tooth is None else each.tooth - 1
        turn = side * each.amount / (gear.face_width * gear.base_radius)
        leads[GEARS.index(each.gear), FLANKS.index(each.flank), teeth] += turn
    return leads


def flanks_at(pair: Pair, height: float) -> Flanks:
    """Return the flanks of the section at a height, each in the frame of its section.

    Args:
        pair: the pair, deviations included.
        height: above the middle of the face [m].
    """
    flanks = compile_pair(pair)
    flanks.turned[:] = lead_turn(pair.drive, 1.0) * height, lead_turn(pair.loose, -1.0) * height
    return flanks


def compile_surfaces(pair: Pair) -> Surfaces:
    """Return the flank surfaces of a pair as arrays.

    Args:
        pair: the pair, spur or helical, with its deviations and mounting.
    """
    axial = np.zeros((2, 8))
    for row, (which, sense) in enumerate((("drive", 1.0), ("loose", -1.0))):
        gear = pair.gear(which)
        half = 0.5 * gear.face_width
        lean = gear.lead_crowning / (gear.base_radius * half**2)
        axial[row, :3] = lead_turn(gear, sense), lean, half
    for item in pair.mounting:
        if isinstance(item, Misalignment):
            axial[:, _AXIS] += tan(item.in_plane), tan(item.out_of_plane)
            continue
        row = GEARS.index(item.gear)
        sense = 1.0 - 2.0 * row
        direction = np.array([cos(item.phase), sense * sin(item.phase)])
        if isinstance(item, Eccentricity):
            axial[row, [_OFF_X, _OFF_Y]] += item.offset * direction
        elif isinstance(item, Wobble):
            axial[row, [_TILT_X, _TILT_Y]] += tan(item.angle) * direction
    shape = edges_of(pair, compile_pair(pair))
    section = Edged(compile_pair(pair), shape.tips.copy(), np.zeros_like(shape.cuts))
    return Surfaces(shape, axial, flank_leads(pair), section, _parts_of_face(shape.flanks, axial))


def _parts_of_face(flanks: Flanks, axial: NDArray[np.float64]) -> int:
    """Return into how many parts the face is divided so that the gap has at most one minimum in each."""
    rolls = 2.0 * float(axial[:, _HALF].min()) * np.abs(axial[:, _TURN])  # turns of the sections along the face
    numbers = np.max(np.abs(flanks.waves[..., 1]), axis=(1, 2), initial=0.0)
    numbers = np.maximum(numbers, np.max(flanks.harmonics[..., 0], axis=(1, 2), initial=0.0))
    return max(_SECTIONS, int(np.ceil(_PER_WAVE * float((rolls * numbers).max()) / (2.0 * pi))))


@inner
def _twisted(surfaces):
    """Whether sections differ along the helix, as they do where deviations depend on the angle."""
    turned = surfaces.axial[0, _TURN] != 0.0 or surfaces.axial[1, _TURN] != 0.0
    return turned and surfaces.shape.flanks.harmonics.shape[2] > 0


@inner
def _section(surfaces, flank, tooth_drive, tooth_loose, z):
    """Return flanks and edges of two teeth at a height."""
    shape, axial = surfaces.shape, surfaces.axial
    if not _twisted(surfaces) or z == 0.0:
        return shape
    section = surfaces.section
    for gear in range(2):
        tooth = tooth_loose if gear else tooth_drive
        section.flanks.turned[gear] = axial[gear, _TURN] * z
        trace_edge(section, gear, flank, tooth)
    return section


@inner
def _lead(surfaces, gear, flank, tooth):
    """Turn of one flank with the height, helix, gear and flank together [rad/m]."""
    turn = surfaces.axial[gear, _TURN]
    return turn + surfaces.leads[gear, flank, tooth - 1] if surfaces.leads.shape[2] > 0 else turn


@njit(cache=True)
def surface_point(surfaces, gear, flank, tooth, roll, z):
    """Return a point of a flank surface in the gear's own frame.

    Args:
        surfaces: the arrays of a pair.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        tooth: number of the tooth.
        roll: roll angle of the flank before relief [rad].
        z: height above the middle of the face [m].

    Returns:
        Position [m], outward unit normal, and derivatives of the position by roll [m/rad] and z [m/m], (4, 3).
    """
    found = _turned_point(surfaces, gear, flank, tooth, roll, z)
    if surfaces.shape.flanks.harmonics.shape[2] > 0 and surfaces.axial[gear, _TURN] != 0.0:
        before = _turned_point(surfaces, gear, flank, tooth, roll, z - _STEP)
        after = _turned_point(surfaces, gear, flank, tooth, roll, z + _STEP)
        found[3] = (after[0] - before[0]) / (2.0 * _STEP)
        normal = np.cross(found[2], found[3])
        found[1] = normal * (np.sign(np.dot(normal, found[1])) / np.sqrt(np.dot(normal, normal)))
    return found


@inner
def _turned_point(surfaces, gear, flank, tooth, roll, z):
    """As :func:`surface_point`, but for how the section itself changes with the height."""
    axial, side = surfaces.axial, 1.0 - 2.0 * flank
    flanks = surfaces.section.flanks
    flanks.turned[gear] = axial[gear, _TURN] * z
    x, y, nx, ny, dx, dy = flank_point(flanks, gear, flank, tooth, roll)
    lead = _lead(surfaces, gear, flank, tooth)
    turn = lead * z - side * axial[gear, _LEAN] * z * z
    rate = lead - 2.0 * side * axial[gear, _LEAN] * z
    c, s = cos(turn), sin(turn)
    found = np.zeros((4, 3))
    found[0] = c * x - s * y, s * x + c * y, z
    found[1] = c * nx - s * ny, s * nx + c * ny, -rate * (x * ny - y * nx)
    found[1] /= np.sqrt(1.0 + found[1, 2] ** 2)
    found[2] = c * dx - s * dy, s * dx + c * dy, 0.0
    found[3] = -rate * found[0, 1], rate * found[0, 0], 1.0
    return found


@njit(cache=True)
def section_gap(surfaces, theta_drive, theta_loose, tooth_drive, tooth_loose, flank, z):
    """Return the gap of two flanks in one transverse section.

    Args:
        surfaces: the arrays of a pair.
        theta_drive: angle of the drive gear [rad].
        theta_loose: angle of the loose gear [rad].
        tooth_drive: number of the drive gear's tooth.
        tooth_loose: number of the loose gear's tooth.
        flank: 0 active, 1 reverse.
        z: height above the middle of the face [m].

    Returns:
        As :func:`surface_gap`, without the height.
    """
    return _sloped(surfaces, (theta_drive, theta_loose), (tooth_drive, tooth_loose), flank, z)[0]


@inner
def _sloped(surfaces, thetas, teeth, flank, z):
    """What :func:`section_gap` returns, and the derivative of the gap by the height at a constant section [m/m]."""
    axial, side = surfaces.axial, 1.0 - 2.0 * flank
    turned, turned_loose = thetas[0], pi - thetas[1]
    c1, s1, c2, s2 = cos(turned), sin(turned), cos(turned_loose), sin(turned_loose)
    off1x, off1y = axial[0, _OFF_X] + axial[0, _TILT_X] * z, axial[0, _OFF_Y] + axial[0, _TILT_Y] * z
    off2x, off2y = axial[1, _OFF_X] + axial[1, _TILT_X] * z, axial[1, _OFF_Y] + axial[1, _TILT_Y] * z
    x1, y1 = c1 * off1x - s1 * off1y, s1 * off1x + c1 * off1y
    x2, y2 = c2 * off2x - s2 * off2y, s2 * off2x + c2 * off2y
    x = surfaces.shape.flanks.mount[DISTANCE] + axial[0, _AXIS] * z + x2 - x1
    y = axial[1, _AXIS] * z + y2 - y1
    lead, lead_loose = _lead(surfaces, 0, flank, teeth[0]), _lead(surfaces, 1, flank, teeth[1])
    turned += lead * z - side * axial[0, _LEAN] * z * z
    turned_loose += lead_loose * z - side * axial[1, _LEAN] * z * z
    shape = _section(surfaces, flank, teeth[0], teeth[1], z)
    gap, drive, loose, px, py, nx, ny, valid = edged_gap_at(
        shape, (x, y), turned, turned_loose, teeth[0], teeth[1], flank
    )
    tilt1x, tilt1y, tilt2x, tilt2y = axial[0, _TILT_X], axial[0, _TILT_Y], axial[1, _TILT_X], axial[1, _TILT_Y]
    slope = nx * (axial[0, _AXIS] + c2 * tilt2x - s2 * tilt2y - c1 * tilt1x + s1 * tilt1y)
    slope += ny * (axial[1, _AXIS] + s2 * tilt2x + c2 * tilt2y - s1 * tilt1x - c1 * tilt1y)
    slope += drive * (lead - 2.0 * side * axial[0, _LEAN] * z)
    slope += loose * (lead_loose - 2.0 * side * axial[1, _LEAN] * z)
    drive += y1 * nx - x1 * ny
    loose += x2 * ny - y2 * nx
    return (gap, drive, -loose, px + x1, py + y1, nx, ny, valid), slope


@inner
def _rise(surfaces, thetas, teeth, flank, z):
    """Gap in a section [m] and its derivative by the height [m/m]."""
    found, slope = _sloped(surfaces, thetas, teeth, flank, z)
    if _twisted(surfaces) and found[0] < inf:  # the section itself changes with the height
        after = _sloped(surfaces, thetas, teeth, flank, z + _STEP)[0][0]
        before = _sloped(surfaces, thetas, teeth, flank, z - _STEP)[0][0]
        slope = (after - before) / (2.0 * _STEP)
    return found[0], slope


@njit(cache=True)
def surface_gap(surfaces, theta_drive, theta_loose, tooth_drive, tooth_loose, flank):
    """Return the smallest gap of two flanks over the face width both gears share.

    Args:
        surfaces: the arrays of a pair.
        theta_drive: angle of the drive gear [rad].
        theta_loose: angle of the loose gear [rad].
        tooth_drive: number of the drive gear's tooth.
        tooth_loose: number of the loose gear's tooth.
        flank: 0 active, 1 reverse.

    Returns:
        gap [m] in the transverse section, > 0 open, infinite where the teeth do not face each other; d gap/d
        theta_drive; d gap/d theta_loose [m/rad]; point midway between the flanks x, y [m]; common normal in the section
        from drive to loose nx, ny; valid, whether the contact lies on both flanks, off their edges; height z of the
        section [m].
    """
    half = min(surfaces.axial[0, _HALF], surfaces.axial[1, _HALF])
    axial = surfaces.axial
    flat = axial[0, _AXIS] == 0.0 and axial[1, _AXIS] == 0.0
    for gear in range(2):
        lead = _lead(surfaces, gear, flank, tooth_loose if gear else tooth_drive)
        flat = flat and lead == 0.0 and axial[gear, _LEAN] == 0.0
        flat = flat and axial[gear, _TILT_X] == 0.0 and axial[gear, _TILT_Y] == 0.0
    height = 0.0
    if not flat:
        thetas, teeth = (theta_drive, theta_loose), (tooth_drive, tooth_loose)
        height = lowest(surfaces, thetas, teeth, flank, (-half, half), surfaces.sections)
    best = section_gap(surfaces, theta_drive, theta_loose, tooth_drive, tooth_loose, flank, height)
    return (*best, height)


@inner
def rolls_at_ends(surfaces, angles, teeth, flank, gear):
    """Return the roll angles at the lower and the upper end of the face where a flank would touch a perfect mate [rad].

    They change in proportion to the height in between.
    """
    axial, flanks = surfaces.axial, surfaces.shape.flanks
    turn = axial[gear, _TURN] * min(axial[0, _HALF], axial[1, _HALF])
    psi = (1.0 - 2.0 * flank) * flanks.mount[DIRECTION]
    u = psi - angles[0] if gear == 0 else psi + angles[1]
    below = roll_of(flanks, gear, flank, teeth[gear], u + turn)
    return below, roll_of(flanks, gear, flank, teeth[gear], u - turn)


@njit(cache=True)
def facing(surfaces, angles, teeth, flank, margin):
    """Return between which heights [m] two teeth face each other flank on flank, and the face's nearest height [m].

    The upper height is below the lower where they do not face each other; the last is then nearest to doing so.
    ``angles`` [rad] and ``teeth`` are those of drive and loose gear, ``flank`` is 0 active, 1 reverse; ``margin`` [rad]
    is the roll angle by which they may face each other beyond their tips, negative for what they must stay within.
    """
    axial, flanks = surfaces.axial, surfaces.shape.flanks
    half = min(axial[0, _HALF], axial[1, _HALF])
    low, high = -half, half
    worst = np.zeros(2)
    for gear in range(2):
        tip = flanks.gears[gear, TIP_ROLL] + margin
        below, above = rolls_at_ends(surfaces, angles, teeth, flank, gear)
        for limit, sign in ((tip, 1.0), (-margin, -1.0)):
            first, last = sign * (below - limit), sign * (above - limit)
            worst[0], worst[1] = max(worst[0], first), max(worst[1], last)
            if first <= 0.0 and last <= 0.0:
                continue
            if first > 0.0 and last > 0.0:
                low, high = half, -half
                continue
            place = half * (first + last) / (first - last)
            if first > 0.0:
                low = max(low, place)
            else:
                high = min(high, place)
    return low, high, -half if worst[0] < worst[1] else half


@njit(cache=True)
def lowest(surfaces, thetas, teeth, flank, span, sections):
    """Return the height of the smallest gap [m] between two heights; each of ``sections`` parts has one minimum.

    Parts end where reliefs start, too. Looked at are those in which the teeth face each other flank on flank, and those
    beyond, where an edge of a tip comes in and the gap grows, while it still falls. A minimum lies where the gap falls
    at the begin of a part and rises at its end; it is searched where it may be the least.
    """
    nodes = _nodes(surfaces, thetas, teeth, flank, span, sections)
    most = nodes.size - 1
    begin, end, nearest = facing(surfaces, thetas, teeth, flank, 0.0)
    if begin > end:
        begin = end = nearest
    first = max(int(np.searchsorted(nodes, begin, side="right")) - 1, 0)
    last = min(max(int(np.searchsorted(nodes, end)), first), most)
    gaps, slopes = np.full(most + 1, inf), np.zeros(most + 1)
    for i in range(first, last + 1):
        gaps[i], slopes[i] = _rise(surfaces, thetas, teeth, flank, nodes[i])
    while last < most and slopes[last] < 0.0:
        last += 1
        gaps[last], slopes[last] = _rise(surfaces, thetas, teeth, flank, nodes[last])
    while first > 0 and slopes[first] > 0.0:
        first -= 1
        gaps[first], slopes[first] = _rise(surfaces, thetas, teeth, flank, nodes[first])
    i = int(np.argmin(gaps))
    height, least = nodes[i], gaps[i]
    for i in range(first, last):
        one, other, fall, rise = gaps[i], gaps[i + 1], slopes[i], slopes[i + 1]
        if (one == inf and other == inf) or (one < inf and fall >= 0.0) or (other < inf and rise <= 0.0):
            continue
        deepest = _STEEPER * max(-fall, rise) * (nodes[i + 1] - nodes[i])
        if one == inf or other == inf or min(one, other) - deepest < least - _LEVEL:
            ends = (nodes[i], one, fall), (nodes[i + 1], other, rise)
            there, gap = _turning(surfaces, thetas, teeth, flank, *ends)
            if gap < least:
                height, least = there, gap
    return height


@inner
def _nodes(surfaces, thetas, teeth, flank, span, sections):
    """Return the heights at which parts of the face begin and end [m], (n,)."""
    low, high = span
    flanks = surfaces.shape.flanks
    half = min(surfaces.axial[0, _HALF], surfaces.axial[1, _HALF])
    nodes = np.zeros(sections + 5)
    count = sections + 1
    for i in range(count):
        nodes[i] = low + i * (high - low) / sections
    for gear in range(2):
        below, above = rolls_at_ends(surfaces, thetas, teeth, flank, gear)
        for relief in (ROOT_RELIEF, TIP_RELIEF):
            start = flanks.gears[gear, relief + START]
            if min(below, above) < start < max(below, above):
                z = half * (2.0 * start - below - above) / (above - below)
                if low < z < high:
                    nodes[count] = z
                    count += 1
    return np.sort(nodes[:count])


@inner
def _turning(surfaces, thetas, teeth, flank, left, right):
    """Find where the slope of the gap changes its sign, between two (height, gap, slope); returns height and gap [m].

    False position, halved where it does not shrink the bracket, and where an end does not face its mate.
    """
    low, gap_low, fall = left
    high, gap_high, rise = right
    best, least = (low, gap_low) if gap_low < gap_high else (high, gap_high)
    kept, wide, halve = 0, high - low, False
    for turn in range(_SEARCHES):
        middle = 0.5 * (low + high)
        if gap_low < inf and gap_high < inf and not halve:
            middle = low + (high - low) * fall / (fall - rise)
        if not low < middle < high:
            break
        gap, slope = _rise(surfaces, thetas, teeth, flank, middle)
        if gap < least:
            best, least = middle, gap
        if gap < inf and abs(slope) < _LEVEL_SLOPE:
            break
        onwards = slope < 0.0 if gap < inf else gap_low == inf
        if onwards:
            rise *= 0.5 if kept > 0 else 1.0
            low, gap_low, fall, kept = middle, gap, slope, 1
        else:
            fall *= 0.5 if kept < 0 else 1.0
            high, gap_high, rise, kept = middle, gap, slope, -1
        if high - low < _WITHIN:
            break
        if turn % 4 == 3:
            halve, wide = high - low > 0.1 * wide, high - low
        else:
            halve = False
    return best, least


@njit(cache=True)
def mates(surfaces, theta_drive, theta_loose, flank):
    """Return the pairs of teeth that may face each other anywhere on the face, by the angles of both gears.

    Args:
        surfaces: the arrays of a pair.
        theta_drive: angle of the drive gear [rad].
        theta_loose: angle of the loose gear [rad].
        flank: 0 active, 1 reverse.

    Returns:
        Numbers of drive and loose teeth, (n, 2), those in the middle of the face first counted.
    """
    flanks = surfaces.shape.flanks
    pitch1, pitch2 = abs(flanks.gears[0, 1]), abs(flanks.gears[1, 1])
    teeth1, teeth2 = int(2.0 * pi / pitch1 + 0.5), int(2.0 * pi / pitch2 + 0.5)
    half = min(surfaces.axial[0, _HALF], surfaces.axial[1, _HALF])
    reach = 2 + int(np.ceil(abs(surfaces.axial[0, _TURN]) * half / pitch1))
    nearest1 = int(np.floor(theta_drive / pitch1 + 0.5))
    # in the pitch point tooth 1 meets tooth 1: the mate of tooth k + 1 is as far on, wherever the loose gear stands
    nearest2 = int(np.floor((theta_loose - (theta_drive - nearest1 * pitch1) * pitch2 / pitch1) / pitch2 + 0.5))
    pairs = np.zeros((2 * reach + 1, 2), np.int64)
    for i in range(2 * reach + 1):
        pairs[i, 0] = (nearest1 + i - reach) % teeth1 + 1
        pairs[i, 1] = (nearest2 + i - reach + flank) % teeth2 + 1
    return pairs
