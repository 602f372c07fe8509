"""Where two helical teeth come nearest: along the line in which they would touch, measured on their surfaces.

A section at a height is the flank of the middle, turned. At fixed centres the common normal of two involutes keeps its
direction, so the angles of both gears give the heights between which two teeth face each other, flank on flank. There
the gap of perfect helical teeth is the same all along; beyond, an edge of a tip comes in and the gap grows. Where
flanks are modified, leads deviate or axes are not parallel, the gap varies along the line, and its minimum is searched
over the face: an end of it, where teeth lean on each other, or a place on a crowned flank.
"""

from __future__ import annotations

from functools import lru_cache
from math import ceil, cos, inf, sqrt
from typing import TYPE_CHECKING

import numpy as np

from gears3d.gears import HarmonicDeviation, ToothDeviation, piece_budget
from gears3d.gears.edge import Edged
from gears3d.gears.flank import TIP_ROLL, roll_of
from gears3d.gears.surface import Surfaces, compile_surfaces, lowest, section_gap
from gears3d.kernels import inner, njit
from gears3d.records import Floats2, Floats3, Record

if TYPE_CHECKING:
    from gears3d.gears import Pair

_TURN, _LEAN, _HALF = 0, 1, 2
LOOKS = 13  # sections in which a gap that varies along the line is evaluated
_LEVEL = 1e-13  # if gaps of neighbouring sections differ by less, no search between them is needed [m]
# Distance from the end of the face at which the sign of the gap's slope there is tested, in face widths.
_BESIDE = 1e-4
_WITHIN = 1e-9  # accuracy of the height of the smallest gap [m]
_STAND_OFF = 2e-6  # largest distance of Bullet's slices from a helical flank between their ends [m]
_SLICES = 8


class Along(Record):
    """Properties of a pair's contact that do not follow from one transverse section.

    Args:
        surfaces: the flanks over their face width.
        axial: turn of the sections and the rest of :class:`gears3d.gears.Surfaces`, (2, 8).
        leads: of single flanks, as there.
        looks: sections that are evaluated: 0 one transverse section is enough, 1 the gap is constant along the line.
        margin: by how much the rolls at which teeth face each other may differ from those of perfect flanks [rad].
        tilt: cosine of the base helix angle.
    """

    surfaces: Surfaces
    axial: Floats2
    leads: Floats3
    looks: int
    margin: float
    tilt: float


def along_of(pair: Pair) -> Along:
    """Return the properties of a pair's contact that do not follow from one transverse section."""
    surfaces = compile_surfaces(pair)
    axial, leads = surfaces.axial, surfaces.leads
    gears = (pair.drive, pair.loose)
    if not (axial[:, _TURN].any() or axial[:, 5:].any() or leads.size):  # crowned spur teeth touch in mid-face
        looks = 0
    else:
        modified = any(gear.tip_relief is not None or gear.root_relief is not None for gear in gears)
        modified |= any(not isinstance(each, HarmonicDeviation | ToothDeviation) for each in pair.deviations)
        lead = abs(axial[0, _TURN] * gears[0].base_radius + axial[1, _TURN] * gears[1].base_radius)
        looks = LOOKS if modified or lead > 1e-12 or axial[:, _LEAN].any() or axial[:, 5:].any() or leads.size else 1
    slopes = sum(abs(d.amplitude) * d.order for d in pair.deviations if isinstance(d, HarmonicDeviation))
    wandering = float(np.abs(axial[:, 3:5]).sum())
    margin = 1e-6 + 2.0 * slopes / min(g.base_radius for g in gears) + 4.0 * wandering / pair.path_length
    return Along(surfaces, axial, leads, looks, margin, cos(pair.drive.base_helix_angle))


@lru_cache(maxsize=8)  # of one run, which asks three times
def slices_of(pair: Pair) -> int | None:
    """Return the number of slices along the face into which Bullet's teeth are divided, ``None`` for straight teeth."""
    if pair.drive.helix_angle == 0.0:
        return None
    whole = piece_budget(pair, slices=1)["slice_error_m"]
    return min(max(ceil(sqrt(whole / _STAND_OFF)), 1), _SLICES)


def turn_of(along: Along, gear: int, side: int, tooth: int) -> float:
    """Return by how much a flank's sections turn about +z with the height, lead included [rad/m].

    ``gear`` is 0 drive, 1 loose; ``side`` 0 active, 1 reverse.
    """
    own = along.leads[gear, side, tooth - 1] if along.leads.size else 0.0
    return float(along.axial[gear, _TURN] + own)


@njit(cache=True)
def facing(
    shape: Edged, along: Along, angles: tuple[float, float], teeth: tuple[int, int], side: int, margin: float
) -> tuple[float, float, float]:
    """Return between which heights [m] two teeth face each other flank on flank, and the face's nearest height [m].

    The upper height is below the lower where they do not face each other; the last is then nearest to doing so.
    ``angles`` [rad] and ``teeth`` are those of drive and loose gear, ``side`` is 0 active, 1 reverse; ``margin`` [rad]
    is the roll angle by which they may face each other beyond their tips, negative for what they must stay within.
    """
    half = min(along.axial[0, _HALF], along.axial[1, _HALF])
    psi = (1.0 - 2.0 * side) * shape.flanks.mount[3]
    low, high = -half, half
    worst = np.zeros(2)
    for gear in range(2):
        tip = shape.flanks.gears[gear, TIP_ROLL] + margin
        turn = along.axial[gear, _TURN] * half
        u = psi - angles[0] if gear == 0 else psi + angles[1]
        below = roll_of(shape.flanks, gear, side, teeth[gear], u + turn)
        above = roll_of(shape.flanks, gear, side, teeth[gear], u - turn)
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
def line_gap(
    shape: Edged, along: Along, theta_drive: float, theta_loose: float, tooth_drive: int, tooth_loose: int, side: int
) -> tuple[float, float, float, float, bool]:
    """Return the smallest gap of two teeth over the face.

    That is the gap in the transverse section [m], infinite where the teeth do not face each other, its derivatives by
    the angles of drive and loose gear [m/rad], the height of that section [m], and whether the teeth face each other
    flank on flank. Angles are in rad; ``side`` is 0 active, 1 reverse.
    """
    surfaces, angles, teeth = along.surfaces, (theta_drive, theta_loose), (tooth_drive, tooth_loose)
    low, high, end = facing(shape, along, angles, teeth, side, -along.margin)
    inside = low <= high
    if along.looks > 1:
        half = min(along.axial[0, _HALF], along.axial[1, _HALF])
        z = _searched(surfaces, angles, teeth, side, (-half, half))
    elif inside:
        z = 0.5 * (low + high)
    else:
        low, high, end = facing(shape, along, angles, teeth, side, along.margin)
        z = end if low > high else lowest(surfaces, angles, teeth, side, (low, high), _WITHIN)[0]
    found = section_gap(surfaces, theta_drive, theta_loose, tooth_drive, tooth_loose, side, z)
    return found[0], found[1], found[2], z, inside


@inner
def _searched(
    surfaces: Surfaces, angles: tuple[float, float], teeth: tuple[int, int], side: int, span: tuple[float, float]
) -> float:
    """Return the height of the minimum of a gap that may vary along the line [m]."""
    low, high = span
    step = (high - low) / (LOOKS - 1)
    gaps = np.full(LOOKS + 2, inf)
    for i in range(LOOKS):
        gaps[i + 1] = section_gap(surfaces, angles[0], angles[1], teeth[0], teeth[1], side, low + i * step)[0]
    i = int(np.argmin(gaps)) - 1
    if gaps[i + 1] == inf:
        return 0.5 * (low + high)
    if abs(gaps[i] - gaps[i + 1]) < _LEVEL and abs(gaps[i + 2] - gaps[i + 1]) < _LEVEL:
        return low + i * step
    if i in (0, LOOKS - 1):  # a gap that falls to an end of the face has its minimum at the edge
        beside = low + (_BESIDE if i == 0 else 1.0 - _BESIDE) * (high - low)
        if section_gap(surfaces, angles[0], angles[1], teeth[0], teeth[1], side, beside)[0] >= gaps[i + 1]:
            return low + i * step
    around = (low + max(i - 1, 0) * step, low + min(i + 1, LOOKS - 1) * step)
    z, gap = lowest(surfaces, angles, teeth, side, around, _WITHIN)
    return z if gap < gaps[i + 1] else low + i * step


def merged(found: np.ndarray, raw: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return each pair of teeth once, with the smallest of Bullet's gaps of its slices.

    ``found`` (n, 3) is drive tooth, loose tooth, side; ``raw`` (n,) are Bullet's gaps [m].
    """
    rows: dict[tuple[int, ...], int] = {}
    least = raw.copy()
    for i, teeth in enumerate(map(tuple, found.tolist())):
        first = rows.setdefault(teeth, i)
        least[first] = min(least[first], raw[i])
    keep = list(rows.values())
    return found[keep], least[keep]
