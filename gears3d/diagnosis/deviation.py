"""Deviations of flanks from their nominal place at measured angles, from the rows of effects."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from math import cos, pi, sin
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gears3d.effects import Code, Row
from gears3d.gears import ToothDeviation, quasi_static

if TYPE_CHECKING:
    from gears3d.gears import Pair

Array = np.ndarray
# Thickness, relative to the backlash, at which the gap of a tooth next to loaded teeth is computed, and the negative
# thickness of a tooth that can no longer touch [m].
THICK, THIN = 0.95, 1e-3
# Gap of a tooth that never comes near [m].
NEVER = 1.0
# Thickness of a tooth with a negligible deviation [m].
BENT = 1e-6
# Range of a tooth's influence to either side, in pitches, and number of points over it.
REACH, POINTS = 2.25, 289
Gear = Literal["drive", "loose"]
Side = Literal["active", "reverse"]


def deviation(
    rows: Iterable[Row],
    pair: Pair,
    drive: Array,
    loose: Array,
    flank: Array,
    known: dict[Any, Any] | None = None,
) -> Array:
    """Return the displacement by effects of the loose gear on a flank [m].

    An eccentric gear counts to first order in its offset, a single tooth by the contact of rolling gears
    (:func:`influence`). The cache ``known`` holds the shapes at exactly these points.

    drive: (n,) [rad]; loose: (n,) [rad]; flank: (n,).

    >>> from gears3d.effects.rows import flank_harmonic
    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(3.5e-3, 30)
    >>> row = flank_harmonic(0, 1, 0, -2e-5, 0.0)
    >>> deviation([row], Pair.from_backlash(gear, gear, 1e-4), np.zeros(2), np.zeros(2), np.array([0, 1])).tolist()
    [0.0, 2e-05]
    """
    total = np.zeros_like(drive)
    for row in rows:
        p = row.p
        if not 200 < row.code < 300:
            continue
        own = drive if p[0] == 0 else loose
        if row.code == Code.FLANK_HARMONIC:
            total = total + (p[3] if p[1] == 0 else -p[3]) * (flank == p[1]) * wave(p[0], p[2], p[4], own, known)
        elif row.code == Code.FLANK_ECCENTRIC:
            lean = np.where(flank == 0, 1.0, -1.0) * pair.working_pressure_angle
            total = total + p[1] * (np.sin(own + p[2] + lean) if p[0] == 0 else -np.sin(own + p[2] - lean))
        elif row.code == Code.FLANK_TOOTH:
            total = total + _tooth(row, pair, own, flank, known)
    return total


def wave(gear: float, order: float, phase: float, angle: Array, known: dict[Any, Any] | None = None) -> Array:
    """Return the cosine of an order of a gear's angle; the cache ``known`` is for exactly these points.

    gear: 0 drive, 1 loose; phase: [rad]; angle: [rad], (n,).

    >>> wave(0, 2, np.pi / 2.0, np.array([np.pi / 4.0]), {}).round(9).tolist()
    [-1.0]
    """
    if known is None:
        return np.cos(order * angle + phase)
    if (key := ("wave", gear, order)) not in known:
        known[key] = np.cos(order * angle), np.sin(order * angle)
    cosine, sine = known[key]
    return cos(phase) * cosine - sin(phase) * sine if phase else cosine


def _tooth(row: Row, pair: Pair, own: Array, flank: Array, known: dict[Any, Any] | None) -> Array:
    """Return the effect of a tooth on its flank, 0 on the other [m]."""
    key = ("tooth", *row.p[:4])
    if known is not None and key in known:
        return known[key]
    gear: Gear = "drive" if row.p[0] == 0 else "loose"
    side: Side = "active" if row.p[1] == 0 else "reverse"
    mine, shape = np.flatnonzero(flank == row.p[1]), np.zeros_like(own)
    shape[mine] = over_tooth(pair, gear, row.p[2], side, row.p[3], own[mine])
    if known is not None:
        known[key] = shape
    return shape


def over_tooth(pair: Pair, gear: Gear, tooth: float, side: Side, thickness: float, own: Array) -> Array:
    """Return the effect of a tooth on the displacement [m].

    thickness: deviation [m]; own: angle of its gear [rad], (n,).
    """
    angle, moved = influence(pair, gear, side, thickness)
    return np.interp(2.0 * pi * pitches_from(pair, gear, tooth, own), angle, moved, left=0.0, right=0.0)


def pitches_from(pair: Pair, gear: Gear, tooth: float, own: Array) -> Array:
    """Return the pitches from a tooth's place in mesh to the gear's angle, up to half a revolution to either side.

    own: (n,) [rad].

    >>> from gears3d.gears import Gear, Pair
    >>> pair = Pair.from_backlash(Gear(3.5e-3, 30), Gear(3.5e-3, 30), 1e-4)
    >>> pitches_from(pair, "drive", 2, np.array([0.0, 2.0 * pi / 30])).round(9).tolist()
    [-1.0, 0.0]
    """
    teeth = pair.gear(gear).teeth
    return (np.mod(own - (tooth - 1.0) * 2.0 * pi / teeth + pi, 2.0 * pi) - pi) * teeth / (2.0 * pi)


def influence(pair: Pair, gear: Gear, side: Side, thickness: float) -> tuple[Array, Array]:
    """Return the effect of a tooth on the displacement [m], over its gear's angle times its teeth.

    Rigid gears touch at the pair of teeth with the largest centre distance. A tooth with a positive thickness deviation
    is that pair wherever its nominal gap is less than the deviation, before and behind its place in mesh, too; with a
    negative deviation the gears approach by the deviation, or to contact with the edges of the neighbouring teeth,
    whichever is less.

    thickness: deviation [m].
    """
    at, here, gap, depth = _beside(pair, gear, side)
    sign = 1.0 if side == "active" else -1.0
    if thickness > 0.0:
        moved = sign * np.maximum(thickness - np.interp(at + _ahead(pair, gear, sign * thickness), here, gap), 0.0)
    else:
        moved = -sign * np.minimum(-thickness, depth)
    if gear == "drive":
        return at, moved
    behind = (pair.backlash if side == "reverse" else 0.0) + moved
    return at + behind / pair.loose.base_radius * pair.loose.teeth, moved


def _ahead(pair: Pair, gear: Gear, thickness: float) -> float:
    """Return the advance of a flank with a positive deviation on the drive, times its teeth [rad]."""
    return thickness / pair.drive.base_radius * pair.drive.teeth if gear == "drive" else 0.0


@lru_cache(maxsize=64)
def _beside(pair: Pair, gear: Gear, side: Side) -> tuple[Array, Array, Array, Array]:
    """Return the gap of one tooth next to loaded teeth over its own angle, and the approach without that tooth [m].

    Angles are of the drive, times its teeth: first those of the approach, then those of the gap.
    """
    at = 2.0 * pi * np.linspace(-REACH, REACH, POINTS)
    size, column = THICK * pair.backlash, 0 if side == "active" else 1
    true = _rolled(pair)[column]
    out = np.abs(_rolled(pair.with_deviations(ToothDeviation(gear, side, 1, size)))[column] - true)
    thin = (ToothDeviation(gear, flank, 1, -THIN) for flank in ("active", "reverse"))
    back = np.abs(_rolled(pair.with_deviations(*thin))[column] - true)
    here = at + _ahead(pair, gear, size if side == "active" else -size)
    return at, here, np.where(out > 1e-3 * size, size - out, NEVER), np.where(back > 1e-12, back, 0.0)


@lru_cache(maxsize=32)
def _rolled(pair: Pair) -> tuple[Array, Array]:
    """Return the displacement imposed by the active and the reverse flank about tooth 1 [m]."""
    found = quasi_static(pair, 2.0 * pi * np.linspace(-REACH, REACH, POINTS) / pair.drive.teeth)
    return found.phi_active, found.phi_reverse
