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
BENT = 1e-6
"""Thickness with which the influence of one tooth is worked out [m]."""
REACH, POINTS = 3.0, 385
"""Pitches to either side that a tooth's influence is looked for, and points there."""


def deviation(
    rows: Iterable[Row],
    pair: Pair,
    drive: Array,
    loose: Array,
    flank: Array,
    known: dict[Any, Any] | None = None,
) -> Array:
    """Return by how much effects move the loose gear that lies on a flank [m].

    An eccentric gear counts to first order in its offset; a tooth that stands out carries alone as long as it is in
    mesh, one that stands back only where no other is.

    Args:
        rows: normal forms; those that are no flanks are passed over.
        pair: nominal gears.
        drive: angle [rad], (n,).
        loose: angle [rad], (n,).
        flank: 0 active, 1 reverse, (n,).
        known: gets, and has, the shapes of unit size at these very points; without it none is kept.

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
            total = total + abs(p[3]) * _tooth(row, pair, own, flank, known)
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
    """Return what a tooth of unit size does to its flank, nothing to the other."""
    key = ("tooth", *row.p[:3], row.p[3] > 0.0)
    if known is not None and key in known:
        return known[key]
    gear: Literal["drive", "loose"] = "drive" if row.p[0] == 0 else "loose"
    side: Literal["active", "reverse"] = "active" if row.p[1] == 0 else "reverse"
    mine, shape = np.flatnonzero(flank == row.p[1]), np.zeros_like(own)
    shape[mine] = over_tooth(pair, gear, row.p[2], side, row.p[3] > 0.0, own[mine])
    if known is not None:
        known[key] = shape
    return shape


def over_tooth(
    pair: Pair, gear: Literal["drive", "loose"], tooth: float, side: Literal["active", "reverse"], out: bool, own: Array
) -> Array:
    """Return what a tooth of unit thickness does to the displacement [m/m].

    Args:
        pair: nominal gears.
        gear: whose tooth it is.
        tooth: its number.
        side: which flank.
        out: whether it stands out; back otherwise.
        own: angle of its gear [rad], (n,).
    """
    teeth = pair.gear(gear).teeth
    since = np.mod(own - (tooth - 1.0) * 2.0 * pi / teeth + pi, 2.0 * pi) - pi
    angle, moved = influence(pair, gear, side, out)
    return np.interp(since * teeth, angle, moved, left=0.0, right=0.0)


@lru_cache(maxsize=64)
def influence(
    pair: Pair, gear: Literal["drive", "loose"], side: Literal["active", "reverse"], out: bool
) -> tuple[Array, Array]:
    """Return what a tooth of unit thickness does to the displacement, over its gear's angle times its teeth.

    Args:
        pair: nominal gears.
        gear: whose tooth it is.
        side: which flank.
        out: whether it stands out; back otherwise.
    """
    pitches = np.linspace(-REACH, REACH, POINTS)
    theta = 2.0 * pi * pitches / pair.drive.teeth
    size = BENT if out else -BENT
    bent = quasi_static(pair.with_deviations(ToothDeviation(gear, side, 1, size)), theta)
    true = quasi_static(pair, theta)
    name = "phi_active" if side == "active" else "phi_reverse"
    return 2.0 * pi * pitches, (getattr(bent, name) - getattr(true, name)) / BENT
