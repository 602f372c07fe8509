"""Flanks as surfaces over the face width, spur and helical, and the gap of two of them on real axes.

Across the axis every section of a flank is the same curve, turned by an angle that grows with the height z: by the
helix with its slope deviation, and by lead crowning. A turn by dφ moves an involute by base radius × dφ along the
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
from gears3d.gears.flank import DISTANCE, Flanks, compile_pair, flank_point
from gears3d.kernels import inner, njit
from gears3d.records import Floats2, Floats3, Record

if TYPE_CHECKING:
    from gears3d.gears.gear import Gear
    from gears3d.gears.pair import Pair

_TURN, _LEAN, _HALF, _OFF_X, _OFF_Y, _TILT_X, _TILT_Y, _AXIS = 0, 1, 2, 3, 4, 5, 6, 7
_SECTIONS = 16  # Intervals of the face in each of which the gap has at most one minimum
_LEVEL = 1e-13  # Gaps of neighbouring sections that differ by less need no search between them [m]
_STEP = 1e-6  # Over which a deviating section's change with the height is differenced [m]
_GOLDEN = 0.6180339887498949
_WITHIN = 1e-12  # How near the height of the smallest gap is found [m]


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
    """

    shape: Edged
    axial: Floats2
    leads: Floats3
    section: Edged


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
    return Surfaces(shape, axial, flank_leads(pair), section)


@inner
def _section(surfaces, flank, tooth_drive, tooth_loose, z):
    """Return flanks and edges of two teeth at a height; deviations that depend on the angle differ along a helix."""
    shape, axial = surfaces.shape, surfaces.axial
    turned = axial[0, _TURN] != 0.0 or axial[1, _TURN] != 0.0
    if shape.flanks.harmonics.shape[2] == 0 or not turned or z == 0.0:
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
    axial, side = surfaces.axial, 1.0 - 2.0 * flank
    turned, turned_loose = theta_drive, pi - theta_loose
    c1, s1, c2, s2 = cos(turned), sin(turned), cos(turned_loose), sin(turned_loose)
    off1x, off1y = axial[0, _OFF_X] + axial[0, _TILT_X] * z, axial[0, _OFF_Y] + axial[0, _TILT_Y] * z
    off2x, off2y = axial[1, _OFF_X] + axial[1, _TILT_X] * z, axial[1, _OFF_Y] + axial[1, _TILT_Y] * z
    x1, y1 = c1 * off1x - s1 * off1y, s1 * off1x + c1 * off1y
    x2, y2 = c2 * off2x - s2 * off2y, s2 * off2x + c2 * off2y
    x = surfaces.shape.flanks.mount[DISTANCE] + axial[0, _AXIS] * z + x2 - x1
    y = axial[1, _AXIS] * z + y2 - y1
    turned += _lead(surfaces, 0, flank, tooth_drive) * z - side * axial[0, _LEAN] * z * z
    turned_loose += _lead(surfaces, 1, flank, tooth_loose) * z - side * axial[1, _LEAN] * z * z
    shape = _section(surfaces, flank, tooth_drive, tooth_loose, z)
    gap, drive, loose, px, py, nx, ny, valid = edged_gap_at(
        shape, (x, y), turned, turned_loose, tooth_drive, tooth_loose, flank
    )
    drive += y1 * nx - x1 * ny
    loose += x2 * ny - y2 * nx
    return gap, drive, -loose, px + x1, py + y1, nx, ny, valid


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
    if flat:
        best = section_gap(surfaces, theta_drive, theta_loose, tooth_drive, tooth_loose, flank, 0.0)
        return (*best, 0.0)
    step = 2.0 * half / _SECTIONS
    gaps = np.full(_SECTIONS + 3, inf)
    for i in range(_SECTIONS + 1):
        z = -half + i * step
        gaps[i + 1] = section_gap(surfaces, theta_drive, theta_loose, tooth_drive, tooth_loose, flank, z)[0]
    least, height = inf, 0.0
    for i in range(_SECTIONS + 1):
        here, before, after = gaps[i + 1], gaps[i], gaps[i + 2]
        if here < least:
            least, height = here, -half + i * step
        level = abs(before - here) < _LEVEL and abs(after - here) < _LEVEL
        if here < inf and here <= before and here <= after and not level:
            low, high = -half + max(i - 1, 0) * step, -half + min(i + 1, _SECTIONS) * step
            thetas, teeth = (theta_drive, theta_loose), (tooth_drive, tooth_loose)
            z, gap = lowest(surfaces, thetas, teeth, flank, (low, high), _WITHIN)
            if gap < least:
                least, height = gap, z
    best = section_gap(surfaces, theta_drive, theta_loose, tooth_drive, tooth_loose, flank, height)
    return (*best, height)


@njit(cache=True)
def lowest(surfaces, thetas, teeth, flank, span, within):
    """Find the smallest gap between two heights by golden sections.

    Returns:
        Height and gap [m].
    """
    low, high = span
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_a = section_gap(surfaces, thetas[0], thetas[1], teeth[0], teeth[1], flank, a)[0]
    at_b = section_gap(surfaces, thetas[0], thetas[1], teeth[0], teeth[1], flank, b)[0]
    while high - low > within:
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - _GOLDEN * (high - low)
            at_a = section_gap(surfaces, thetas[0], thetas[1], teeth[0], teeth[1], flank, a)[0]
        else:
            low, a, at_a = a, b, at_b
            b = low + _GOLDEN * (high - low)
            at_b = section_gap(surfaces, thetas[0], thetas[1], teeth[0], teeth[1], flank, b)[0]
    return (a, at_a) if at_a < at_b else (b, at_b)


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
