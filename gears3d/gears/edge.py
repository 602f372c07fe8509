"""The gap of two flanks that end at their tips: before and after the path of contact a tip's edge meets the flank.

A flank's support function continues past its tip as that of the edge, n·p with the edge's position p, so the gap has no
jump where a pair of teeth enters or leaves the path of contact. Below its base circle a flank continues as an edge.

The gap is the greatest distance of parallel tangents over all directions of their normal. Both support functions are
convex, so while it is open there is one maximum, and the slope tells on which side it lies. Where flanks overlap,
corners that lie over each other, of tips or at the start of linear relief, make a minimum between two maxima; there
every part between corners is searched. The greatest maximum is continuous, and grows with the displacement as the
distance in each direction does.
"""

from __future__ import annotations

from math import atan2, cos, inf, pi, sin
from typing import TYPE_CHECKING

import numpy as np

from gears3d.gears.flank import (
    BASE,
    FLOOR,
    ROOT_RELIEF,
    START,
    TIP_RELIEF,
    TIP_ROLL,
    Flanks,
    flank_point,
    perfect_points,
    roll_of,
    solve_roll,
    support,
)
from gears3d.kernels import inner, njit
from gears3d.records import Floats1, Floats4, Record

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair

_DISTANCE, _DIRECTION = 2, 3
_SEARCH = 0.7  # How far from the line of action's normal a common normal is looked for [rad]
_OVERLAP = -1e-8  # Gaps below it may have several maxima that matter [m]
_DEEP = 1e3  # Radii of curvature of two flanks that are more overlaps leave one maximum, or several of the same size
_CLOSE = 1e-12  # Directions that differ by less are the same [rad]
_NEWTON = 8  # So many steps a search may take before it halves its bracket every other time
_BESIDE = 1e-12  # Roll angle by which a place next to a corner differs from it [rad]


class Edged(Record):
    """The flanks of a pair with the edges they end in."""

    flanks: Flanks  # the arrays of the pair
    # roll angle of the normal at each flank's end [rad], the edge's position in the gear's own frame [m], and roll
    # angles of the normals next to corners, root relief's start before and after, tip relief's, and the lowest regular
    # point of a profile that deviates, 0 for those that do not [rad], for each gear, flank and tooth (2, 2, teeth, 8)
    tips: Floats4
    cuts: Floats1  # where the search for several maxima puts the ends of its parts, (16,)


def edged(pair: Pair) -> Edged:
    """Return the flanks of a pair with their edges at the tip circle.

    Args:
        pair: the pair, deviations included.

    Raises:
        InputError: gears whose contact needs more than one transverse section.
    """
    return edges_of(pair, pair.compiled())


def edges_of(pair: Pair, flanks: Flanks) -> Edged:
    """Return transverse sections of flanks with their edges at the tip circle."""
    gears = (pair.drive, pair.loose)
    shape = Edged(flanks, np.zeros((2, 2, max(gear.teeth for gear in gears), 8)), np.zeros(16))
    for number, gear in enumerate(gears):
        teeth = np.arange(1, gear.teeth + 1)
        for flank in (0, 1):
            if flanks.shaped:
                for tooth in teeth.tolist():
                    trace_edge(shape, number, flank, tooth)
            else:
                rolls = gear.tip_roll - flanks.offsets[number, flank, : gear.teeth] / gear.base_radius
                shape.tips[number, flank, : gear.teeth, 0] = rolls
                shape.tips[number, flank, : gear.teeth, 1:3] = perfect_points(flanks, number, flank, teeth, rolls)[0]
    return shape


@njit(cache=True)
def trace_edge(shape, gear, flank, tooth):
    """Find the edge and the corners of one flank: a row of :class:`Edged`'s tips."""
    flanks = shape.flanks
    found, profiled = shape.tips[gear, flank, tooth - 1], flanks.slopes.shape[2] > 0
    radius = flanks.gears[gear, BASE] * np.sqrt(1.0 + flanks.gears[gear, TIP_ROLL] ** 2)
    roll = solve_roll(flanks, gear, flank, tooth, radius)
    found[1], found[2], _, _, _, _ = flank_point(flanks, gear, flank, tooth, roll)
    found[0] = roll
    if flanks.gears[gear, TIP_RELIEF + START] < inf or profiled:
        found[0] = _normal_roll(flanks, gear, flank, tooth, roll)
    for i, end in enumerate((ROOT_RELIEF, TIP_RELIEF)):
        start = flanks.gears[gear, end + START]
        if -inf < start < inf:
            found[3 + 2 * i] = _normal_roll(flanks, gear, flank, tooth, start - _BESIDE)
            found[4 + 2 * i] = _normal_roll(flanks, gear, flank, tooth, start + _BESIDE)
    if profiled:
        found[7] = _normal_roll(flanks, gear, flank, tooth, flanks.gears[gear, FLOOR + flank])


@inner
def _normal_roll(flanks, gear, flank, tooth, roll):
    """Roll angle of the normal at a point of a flank given by its roll angle before relief."""
    _, _, nx, ny, _, _ = flank_point(flanks, gear, flank, tooth, roll)
    return roll_of(flanks, gear, flank, tooth, atan2(ny, nx))


@inner
def edged_support(shape, gear, flank, tooth, u):
    """Return the support function of a flank that ends in an edge at its tip, and its first two derivatives."""
    roll = roll_of(shape.flanks, gear, flank, tooth, u)
    if roll > shape.tips[gear, flank, tooth - 1, 0]:
        x, y = shape.tips[gear, flank, tooth - 1, 1], shape.tips[gear, flank, tooth - 1, 2]
        height = x * cos(u) + y * sin(u)
        return height, y * cos(u) - x * sin(u), -height, 1
    if roll < 0.0:  # as if the flank ended in an edge at the base circle too, so that the gap has one maximum only
        start = u + (1.0 - 2.0 * flank) * roll
        height, slope, _ = support(shape.flanks, gear, flank, tooth, start)
        turn = u - start
        along, across = height * cos(turn) + slope * sin(turn), slope * cos(turn) - height * sin(turn)
        return along, across, -along, -1
    height, slope, bend = support(shape.flanks, gear, flank, tooth, u)
    return height, slope, bend, 0


@njit(cache=True)
def edged_gap(shape, theta_drive, theta_loose, tooth_drive, tooth_loose, flank):
    """Return the gap of two flanks with their tip edges.

    Args:
        shape: flanks and edges of a pair.
        theta_drive: angle of the drive gear [rad].
        theta_loose: angle of the loose gear [rad].
        tooth_drive: number of the drive gear's tooth.
        tooth_loose: number of the loose gear's tooth.
        flank: 0 active, 1 reverse.

    Returns:
        gap [m], > 0 open, infinite where tips have no common normal near the line of action; d gap/d theta_drive; d
        gap/d theta_loose [m/rad]; whether the contact lies on both flanks, off the edges.
    """
    centre, rotations = (shape.flanks.mount[_DISTANCE], 0.0), (theta_drive, -theta_loose)
    gap, by_drive, by_loose, _, _, _, _, inside = _gap(shape, centre, rotations, 0.0, (tooth_drive, tooth_loose), flank)
    return gap, by_drive, -by_loose, inside


@njit(cache=True)
def edged_gap_at(shape, centre, rotation_drive, rotation_loose, tooth_drive, tooth_loose, flank):
    """Return the gap of two flanks with their tip edges for any pose of both gears in the plane.

    ``centre`` is the position x, y of the loose gear's axis relative to the drive gear's [m], the rotations are angles
    about +z of the gears' own frames [rad]. Returned are the gap [m], its derivatives by both rotations [m/rad], the
    point midway between the flanks x, y [m], the common normal from drive to loose, and whether the contact lies on
    both flanks, off the edges.
    """
    return _gap(shape, centre, (rotation_drive, rotation_loose), pi, (tooth_drive, tooth_loose), flank)


@inner
def _gap(shape, centre, rotations, half, teeth, flank):
    """Return what :func:`edged_gap_at` does.

    Normals of the loose gear point to the drive: they differ from the common normal by ``half`` of a revolution, π, or
    by 0 where the rotation of the loose gear has it already.
    """
    psi = (1.0 - 2.0 * flank) * shape.flanks.mount[_DIRECTION]
    bottom, top = psi - _SEARCH, psi + _SEARCH
    span = (bottom, psi, top)
    psi, nx, ny, h1, s1, h2, s2, bend, at1, at2 = _crest(shape, centre, rotations, half, teeth, flank, span)
    x, y = centre
    gap = x * nx + y * ny - h1 - h2
    if gap < _OVERLAP and (at1 != 0 or at2 != 0 or bend < -_DEEP * gap):
        psi = _greatest(shape, centre, rotations, half, teeth, flank, psi)
        h1, s1, _, at1 = edged_support(shape, 0, flank, teeth[0], psi - rotations[0])
        h2, s2, _, at2 = edged_support(shape, 1, flank, teeth[1], psi + half - rotations[1])
        nx, ny = cos(psi), sin(psi)
        gap = x * nx + y * ny - h1 - h2
    along = 0.5 * (h1 + x * nx + y * ny - h2)
    across = 0.5 * (s1 + y * nx - x * ny - s2)
    px, py = along * nx - across * ny, along * ny + across * nx
    if at1 + at2 == 2 and not bottom < psi < top:
        return inf, 0.0, 0.0, px, py, nx, ny, False
    return gap, s1, s2, px, py, nx, ny, at1 == 0 and at2 == 0


@inner
def _apart(shape, centre, rotations, half, teeth, flank, psi):
    """Distance of the tangents with normal ``psi`` [m] and its derivative [m/rad]."""
    x, y, nx, ny = centre[0], centre[1], cos(psi), sin(psi)
    h1, s1, _, _ = edged_support(shape, 0, flank, teeth[0], psi - rotations[0])
    h2, s2, _, _ = edged_support(shape, 1, flank, teeth[1], psi + half - rotations[1])
    return x * nx + y * ny - h1 - h2, y * nx - x * ny - s1 - s2


@inner
def _crest(shape, centre, rotations, half, teeth, flank, span):
    """Find the direction at which the distance of tangents has a maximum, from the middle of (bottom, start, top).

    Returned are the direction [rad], its unit vector, support and its slope of drive and loose gear there, the second
    derivative of the distance with its sign changed [m/rad²], and where both points lie.
    """
    bottom, psi, top = span
    low, high = bottom, top
    x, y = centre
    nx, ny, h1, s1, h2, s2, bend, at1, at2 = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0
    for turn in range(100):
        nx, ny = cos(psi), sin(psi)
        h1, s1, c1, at1 = edged_support(shape, 0, flank, teeth[0], psi - rotations[0])
        h2, s2, c2, at2 = edged_support(shape, 1, flank, teeth[1], psi + half - rotations[1])
        rise, bend = y * nx - x * ny - s1 - s2, x * nx + y * ny + c1 + c2
        if (rise > 0.0 and psi >= top) or (rise < 0.0 and psi <= bottom):
            break
        low, high = (psi, high) if rise > 0.0 else (low, psi)
        new = psi + rise / bend if bend > 0.0 else 0.5 * (low + high)
        if abs(new - psi) < _CLOSE or high - low < _CLOSE:
            break
        if not low < new < high or (turn > _NEWTON and turn % 2):
            new = 0.5 * (low + high) if turn > 2 or bend <= 0.0 else min(max(new, low), high)
        psi = new
    return psi, nx, ny, h1, s1, h2, s2, bend, at1, at2


@inner
def _greatest(shape, centre, rotations, half, teeth, flank, found):
    """Find the direction of the greatest of all maxima, one of which is found.

    Between corners the slope rises or falls throughout, so its signs there show where there are others.
    """
    middle = (1.0 - 2.0 * flank) * shape.flanks.mount[_DIRECTION]
    bottom, top = middle - _SEARCH, middle + _SEARCH
    cuts = shape.cuts
    cuts[0], cuts[1] = bottom, top
    count = 2
    for gear in range(2):
        u = middle - rotations[0] if gear == 0 else middle + half - rotations[1]
        roll = roll_of(shape.flanks, gear, flank, teeth[gear], u)
        for i in (-1, 0, 3, 4, 5, 6, 7):
            corner = shape.tips[gear, flank, teeth[gear] - 1, i] if i >= 0 else 0.0
            here = middle + (1.0 - 2.0 * flank) * (roll - corner)
            if bottom < here < top and (i <= 0 or corner != 0.0):
                cuts[count] = here
                count += 1
    for i in range(1, count):
        here, k = cuts[i], i
        while k > 0 and cuts[k - 1] > here:
            cuts[k] = cuts[k - 1]
            k -= 1
        cuts[k] = here
    best, most, before = found, _apart(shape, centre, rotations, half, teeth, flank, found)[0], 0.0
    for i in range(count):
        gap, rise = _apart(shape, centre, rotations, half, teeth, flank, cuts[i])
        if gap > most:
            best, most = cuts[i], gap
        if before > 0.0 and rise < 0.0 and not cuts[i - 1] <= found <= cuts[i]:
            span = (cuts[i - 1], 0.5 * (cuts[i - 1] + cuts[i]), cuts[i])
            psi = _crest(shape, centre, rotations, half, teeth, flank, span)[0]
            gap = _apart(shape, centre, rotations, half, teeth, flank, psi)[0]
            if gap > most:
                best, most = psi, gap
        before = rise
    return best
