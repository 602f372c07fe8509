"""Where flanks stand off their nominal place, at measured angles, from the normal forms of effects."""

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
THICK, THIN = 0.95, 1e-3
"""Thickness, as a part of the backlash, with which the gap of a tooth is worked out where others carry, and by which
one stands back that might as well be missing [m]."""
NEVER = 1.0
"""Gap of a tooth that does not come near, in any case [m]."""
BENT = 1e-6
"""Thickness of a tooth that is off by next to nothing [m]."""
REACH, POINTS = 2.25, 289
"""Pitches to either side that a tooth's influence is looked for, and points there."""
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
    """Return by how much effects move the loose gear that lies on a flank [m].

    An eccentric gear counts to first order in its offset, a single tooth as gears roll on it (:func:`influence`).

    Args:
        rows: normal forms; those that are no flanks are passed over.
        pair: nominal gears.
        drive: angle [rad], (n,).
        loose: angle [rad], (n,).
        flank: 0 active, 1 reverse, (n,).
        known: gets, and has, the shapes at these very points; without it none is kept.

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
    """Return the cosine of an order of a gear's angle.

    Args:
        gear: 0 drive, 1 loose.
        order: any.
        phase: [rad].
        angle: of the gear [rad], (n,).
        known: gets, and has, cosine and sine of each gear and order at these very points.

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
    """Return what a tooth does to its flank, nothing to the other [m]."""
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
    """Return what a tooth does to the displacement [m].

    Args:
        pair: nominal gears.
        gear: whose tooth it is.
        tooth: its number.
        side: which flank.
        thickness: by which it stands out; back where it is negative [m].
        own: angle of its gear [rad], (n,).
    """
    angle, moved = influence(pair, gear, side, thickness)
    return np.interp(2.0 * pi * pitches_from(pair, gear, tooth, own), angle, moved, left=0.0, right=0.0)


def pitches_from(pair: Pair, gear: Gear, tooth: float, own: Array) -> Array:
    """Return by how many pitches a gear has turned beyond a tooth's place in mesh, half a turn to either side.

    Args:
        pair: nominal gears.
        gear: whose tooth it is.
        tooth: its number.
        own: angle of its gear [rad], (n,).

    >>> from gears3d.gears import Gear, Pair
    >>> pair = Pair.from_backlash(Gear(3.5e-3, 30), Gear(3.5e-3, 30), 1e-4)
    >>> pitches_from(pair, "drive", 2, np.array([0.0, 2.0 * pi / 30])).round(9).tolist()
    [-1.0, 0.0]
    """
    teeth = pair.gear(gear).teeth
    return (np.mod(own - (tooth - 1.0) * 2.0 * pi / teeth + pi, 2.0 * pi) - pi) * teeth / (2.0 * pi)


def influence(pair: Pair, gear: Gear, side: Side, thickness: float) -> tuple[Array, Array]:
    """Return what a tooth does to the displacement [m], over its gear's angle times its teeth.

    Rigid gears lie on the pair of teeth that holds them furthest apart. A tooth that stands out does so wherever the
    gap that it would have without is less than its thickness, before and behind its place in mesh, too; one that stands
    back lets them as near as it is thin, or as the edges of its neighbours let them, whichever is less.

    Args:
        pair: nominal gears.
        gear: whose tooth it is.
        side: which flank.
        thickness: by which it stands out; back where it is negative [m].
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
    """Return by how much earlier a flank comes by that stands out of the drive, times its teeth [rad]."""
    return thickness / pair.drive.base_radius * pair.drive.teeth if gear == "drive" else 0.0


@lru_cache(maxsize=64)
def _beside(pair: Pair, gear: Gear, side: Side) -> tuple[Array, Array, Array, Array]:
    """Return the gap of one tooth where others carry, over its own angle, and how deep the gear falls without it [m].

    Angles are of the drive, times its teeth: first those of the depth, then those of the gap.
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
    """Return the displacement that the active and the reverse flank impose about tooth 1 [m]."""
    found = quasi_static(pair, 2.0 * pi * np.linspace(-REACH, REACH, POINTS) / pair.drive.teeth)
    return found.phi_active, found.phi_reverse
