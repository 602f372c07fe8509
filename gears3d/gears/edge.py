"""The gap of two flanks that end at their tips: before and after the path of contact a tip's edge meets the flank.

A flank's support function goes on past its tip as that of the edge, n·p with the edge's position p, so the gap has no
jump where a pair of teeth enters or leaves the path of contact.
"""

from __future__ import annotations

from math import atan2, cos, inf, pi, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gears3d.gears.flank import Flanks, flank_point, roll_at_radius, roll_of, support
from gears3d.kernels import njit

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair

_DISTANCE, _DIRECTION = 2, 3
_SEARCH = 0.7
"""How far from the line of action's normal a common normal is looked for [rad]."""


class Edged(NamedTuple):
    """The flanks of a pair with the edges they end in.

    Args:
        flanks: the arrays of the pair.
        tips: roll angle of the normal at each flank's end [rad] and the edge's position in the gear's own frame [m],
            for each gear, flank and tooth (2, 2, teeth, 3).
    """

    flanks: Flanks
    tips: NDArray[np.float64]


def edged(pair: Pair) -> Edged:
    """Return the flanks of a pair with their edges at the tip circle.

    Args:
        pair: the pair, deviations included.

    Raises:
        InputError: gears whose contact needs more than one transverse section.
    """
    return edges_of(pair, pair.compiled())


def edges_of(pair: Pair, flanks: Flanks) -> Edged:
    """Return transverse sections of flanks with their edges at the tip circle.

    Args:
        pair: the pair, deviations included.
        flanks: its flanks.
    """
    gears = (pair.drive, pair.loose)
    tips = np.zeros((2, 2, max(gear.teeth for gear in gears), 3))
    for number, gear in enumerate(gears):
        for flank in (0, 1):
            for tooth in range(1, gear.teeth + 1):
                roll = roll_at_radius(flanks, number, flank, tooth, gear.tip_radius)
                x, y, nx, ny, _, _ = flank_point(flanks, number, flank, tooth, roll)
                if gear.tip_relief is not None or flanks.slopes.size:
                    roll = roll_of(flanks, number, flank, tooth, atan2(ny, nx))
                tips[number, flank, tooth - 1] = (roll, x, y)
    return Edged(flanks, tips)


@njit(cache=True)
def edged_support(shape, gear, flank, tooth, u):
    """Return the support function of a flank that ends in an edge at its tip, and its first two derivatives.

    Args:
        shape: flanks and edges of a pair.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        tooth: number of the tooth.
        u: direction of the outward normal in the gear's own frame [rad].

    Returns:
        h [m], h' [m/rad], h'' [m/rad²], and where the point lies: -1 inside the base circle, 0 on the flank, 1 on the
        edge.
    """
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
        gap [m], > 0 open, infinite where edge would meet edge or a tip the root; d gap/d theta_drive; d gap/d
        theta_loose [m/rad]; whether the contact lies on both flanks, off the edges.
    """
    distance = shape.flanks.mount[_DISTANCE]
    psi = (1.0 - 2.0 * flank) * shape.flanks.mount[_DIRECTION]
    low, high = psi - _SEARCH, psi + _SEARCH
    h1, s1, h2, s2, at1, at2 = 0.0, 0.0, 0.0, 0.0, 0, 0
    for _ in range(60):
        h1, s1, c1, at1 = edged_support(shape, 0, flank, tooth_drive, psi - theta_drive)
        h2, s2, c2, at2 = edged_support(shape, 1, flank, tooth_loose, psi + theta_loose)
        rise = -distance * sin(psi) - s1 - s2
        bend = distance * cos(psi) + c1 + c2
        if rise > 0.0:
            low = psi
        else:
            high = psi
        new = psi + rise / bend if bend > 0.0 else 0.5 * (low + high)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - psi) < 1e-12:
            break
        psi = new
    if at1 < 0 or at2 < 0 or at1 + at2 == 2:
        return inf, 0.0, 0.0, False
    return distance * cos(psi) - h1 - h2, s1, -s2, at1 == 0 and at2 == 0


@njit(cache=True)
def edged_gap_at(shape, centre, rotation_drive, rotation_loose, tooth_drive, tooth_loose, flank):
    """Return the gap of two flanks with their tip edges for any pose of both gears in the plane.

    Args:
        shape: flanks and edges of a pair.
        centre: position x, y of the loose gear's axis relative to the drive gear's [m].
        rotation_drive: angle about +z of the drive gear's own frame [rad].
        rotation_loose: angle about +z of the loose gear's own frame [rad].
        tooth_drive: number of the drive gear's tooth.
        tooth_loose: number of the loose gear's tooth.
        flank: 0 active, 1 reverse.

    Returns:
        gap [m], > 0 open, infinite where edge would meet edge or a tip the root; its derivatives by the rotations of
        drive and loose gear [m/rad]; the point midway between the flanks x, y [m]; the common normal from drive to
        loose nx, ny; whether the contact lies on both flanks, off the edges.
    """
    x, y = centre
    psi = (1.0 - 2.0 * flank) * shape.flanks.mount[_DIRECTION]
    low, high = psi - _SEARCH, psi + _SEARCH
    h1, s1, h2, s2, nx, ny, at1, at2 = 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0, 0
    for _ in range(60):
        nx, ny = cos(psi), sin(psi)
        h1, s1, c1, at1 = edged_support(shape, 0, flank, tooth_drive, psi - rotation_drive)
        h2, s2, c2, at2 = edged_support(shape, 1, flank, tooth_loose, psi + pi - rotation_loose)
        rise = y * nx - x * ny - s1 - s2
        bend = x * nx + y * ny + c1 + c2
        if rise > 0.0:
            low = psi
        else:
            high = psi
        new = psi + rise / bend if bend > 0.0 else high
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - psi) < 1e-12:
            break
        psi = new
    along = 0.5 * (h1 + x * nx + y * ny - h2)
    across = 0.5 * (s1 + y * nx - x * ny - s2)
    px, py = along * nx - across * ny, along * ny + across * nx
    if at1 < 0 or at2 < 0 or at1 + at2 == 2:
        return inf, 0.0, 0.0, px, py, nx, ny, False
    return x * nx + y * ny - h1 - h2, s1, s2, px, py, nx, ny, at1 == 0 and at2 == 0
