"""Where two helical teeth come nearest: along the line in which they would touch, measured on their surfaces.

A section at a height is the flank of the middle, turned. At fixed centres the common normal of two involutes keeps its
direction, so the angles of both gears give the heights between which two teeth face each other, flank on flank. There
the gap of perfect helical teeth is the same all along; beyond, an edge of a tip comes in and the gap grows. Where
flanks are modified, leads deviate or axes are not parallel, the gap varies along the line, and its minimum is searched
over the face: an end of it, where teeth lean on each other, or a place on a crowned flank.

Waves of the profile have crests that pass along the line. Each is a contact of its own, a part of the line between two
troughs, as one crest may take the load over from another of the same teeth with an impact.
"""

from __future__ import annotations

from functools import lru_cache
from math import ceil, cos, inf, pi, sqrt
from typing import TYPE_CHECKING

import numpy as np

from gears3d.gears import HarmonicDeviation, ToothDeviation, piece_budget
from gears3d.gears.flank import ACTIVE_PROFILE, PROFILE_REACH
from gears3d.gears.surface import Surfaces, compile_surfaces, facing, lowest, rolls_at_ends, section_gap
from gears3d.kernels import inner, njit
from gears3d.records import Floats2, Floats3, Record

if TYPE_CHECKING:
    from gears3d.gears import Pair

_TURN, _LEAN, _HALF = 0, 1, 2
_STAND_OFF = 2e-6  # largest distance of Bullet's slices from a helical flank between their ends [m]
_SLICES = 8  # At most: a query of Bullet takes 1 to 2 ms with 8 to 16 slices


class Along(Record):
    """Properties of a pair's contact that do not follow from one transverse section.

    Args:
        surfaces: the flanks over their face width.
        axial: turn of the sections and the rest of :class:`gears3d.gears.Surfaces`, (2, 8).
        leads: of single flanks, as there.
        looks: into how many pieces the face is divided for a search: 0 one transverse section is enough, 1 the gap is
            constant along the line.
        margin: by how much the rolls at which teeth face each other may differ from those of perfect flanks [rad].
        tilt: cosine of the base helix angle.
        crests: of the strongest wave on the flanks of a side and gear: circular waves by roll angle [rad/rad], phase at
            roll angle 0 [rad], number of its first crest and how many there are, 1 without a wave; (2, 2, 4).
    """

    surfaces: Surfaces
    axial: Floats2
    leads: Floats3
    looks: int
    margin: float
    tilt: float
    crests: Floats3


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
        looks = (
            surfaces.sections
            if modified or lead > 1e-12 or axial[:, _LEAN].any() or axial[:, 5:].any() or leads.size
            else 1
        )
    slopes = sum(abs(d.amplitude) * d.order for d in pair.deviations if isinstance(d, HarmonicDeviation))
    wandering = float(np.abs(axial[:, 3:5]).sum())
    margin = 1e-6 + 2.0 * slopes / min(g.base_radius for g in gears) + 4.0 * wandering / pair.path_length
    return Along(surfaces, axial, leads, looks, margin, cos(pair.drive.base_helix_angle), _crests(surfaces, looks))


def _crests(surfaces: Surfaces, looks: int) -> np.ndarray:
    """Return the crests of the strongest waves of profiles, see :class:`Along`."""
    flanks, crests = surfaces.shape.flanks, np.zeros((2, 2, 4))
    crests[:, :, 3] = 1.0
    for side in range(2):
        for gear in range(2):
            waves = flanks.waves[gear, side]
            if looks < 2 or not waves.any():
                continue
            size, number, phase, _ = waves[int(np.argmax(np.abs(waves[:, 0]) * waves[:, 1] ** 2))]
            phase += pi if size < 0.0 else 0.0
            start, reach = flanks.gears[gear, ACTIVE_PROFILE], flanks.gears[gear, PROFILE_REACH]
            first, last = (round((number * past + phase) / (2.0 * pi)) for past in (0.0, reach))
            crests[side, gear] = number, phase - number * start, first, last - first + 1
    return crests


def parts_of(along: Along, side: int) -> int:
    """Return how many parts the lines of contact of a side have, 1 for undivided ones."""
    return int(along.crests[side, :, 3].prod())


@inner
def _part_of_face(along, angles, teeth, side, part):
    """Return between which heights [m] a part of the line lies, numbered from 1; the upper is below for none."""
    surfaces, crests = along.surfaces, along.crests[side]
    half = min(along.axial[0, _HALF], along.axial[1, _HALF])
    low, high, rest = -half, half, part - 1
    for gear in range(2):
        number, phase, first, count = crests[gear, 0], crests[gear, 1], crests[gear, 2], crests[gear, 3]
        place = rest % int(count)
        rest //= int(count)
        below, above = rolls_at_ends(surfaces, angles, teeth, side, gear)
        middle = number * 0.5 * (below + above) + phase - 2.0 * pi * (first + place)
        rate = number * (above - below) / (2.0 * half)
        if count == 1.0 or rate == 0.0:
            continue
        before, after = (-pi - middle) / rate, (pi - middle) / rate
        if place == 0:  # continues to the root
            before = -inf if rate > 0.0 else inf
        if place == count - 1.0:  # and to the tip
            after = inf if rate > 0.0 else -inf
        low, high = max(low, min(before, after)), min(high, max(before, after))
    return low, high


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
def line_gap(
    along: Along, theta_drive: float, theta_loose: float, tooth_drive: int, tooth_loose: int, side: int, part: int = 0
) -> tuple[float, float, float, float, bool]:
    """Return the smallest gap of two teeth over the face, or over a ``part`` of the line of contact, from 1.

    That is the gap in the transverse section [m], infinite where the teeth do not face each other, its derivatives by
    the angles of drive and loose gear [m/rad], the height of that section [m], and whether the teeth face each other
    flank on flank. Angles are in rad; ``side`` is 0 active, 1 reverse.
    """
    surfaces, angles, teeth = along.surfaces, (theta_drive, theta_loose), (tooth_drive, tooth_loose)
    low, high, end = facing(surfaces, angles, teeth, side, -along.margin)
    inside = low <= high
    if along.looks > 1:
        half = min(along.axial[0, _HALF], along.axial[1, _HALF])
        low, high, looks = -half, half, along.looks
        if part > 0:
            low, high = _part_of_face(along, angles, teeth, side, part)
            if low >= high:
                return inf, 0.0, 0.0, 0.0, False
            looks = max(int(np.ceil(looks * (high - low) / (2.0 * half))), 2)
        z = lowest(surfaces, angles, teeth, side, (low, high), looks)
    elif inside:
        z = 0.5 * (low + high)
    else:
        low, high, end = facing(surfaces, angles, teeth, side, along.margin)
        z = end if low > high else lowest(surfaces, angles, teeth, side, (low, high), 1)
    found = section_gap(surfaces, theta_drive, theta_loose, tooth_drive, tooth_loose, side, z)
    return found[0], found[1], found[2], z, inside


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
