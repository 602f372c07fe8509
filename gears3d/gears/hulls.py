"""Teeth as convex pieces for a collision engine, and how far those stand off the true flanks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gears3d.gears.deviation import GEARS, index_of
from gears3d.gears.flank import ACTIVE, REVERSE, Flanks, flank_points, relief_starts, roll_at_radius
from gears3d.gears.pair import Pair

_HULL_STEPS = 10216
"""Steps into which Bullet quantises the extent of a convex hull's vertices."""

_LEAST_ROLL = 0.02
"""Roll angle below which an involute that starts at the base circle has no useful length."""


def pieces(pair: Pair, which: str, points: int = 24) -> list[NDArray[np.float64]]:
    """Return one convex piece a tooth, in the gear's own frame.

    A piece is the hull of both flanks from the start of their working part to the tip, at both ends of the face; the
    chords cut into the flanks, so a hull stands back by at most the chord error of :func:`piece_budget`.

    Args:
        pair: the pair, deviations included.
        which: ``"drive"`` or ``"loose"``.
        points: points along each flank.

    Returns:
        Vertices [m], (4·points, 3), for teeth 1, 2, … in order of meshing: at −z the active flank upwards, then the
        reverse flank downwards, then the same at +z.

    Raises:
        InputError: helical gears, or an unknown gear.
    """
    flanks, gear = pair.compiled(), index_of(which, GEARS, "which")
    deep = 0.5 * pair.gear(which).face_width
    result = []
    for tooth in range(1, pair.gear(which).teeth + 1):
        active = flank_points(flanks, gear, ACTIVE, tooth, _rolls(pair, flanks, which, ACTIVE, tooth, points))[0]
        reverse = flank_points(flanks, gear, REVERSE, tooth, _rolls(pair, flanks, which, REVERSE, tooth, points))[0]
        outline = np.vstack([active, reverse[::-1]])
        result.append(np.vstack([np.c_[outline, np.full(len(outline), z)] for z in (-deep, deep)]))
    return result


def piece_budget(pair: Pair, points: int = 24) -> dict[str, float]:
    """Return what the convex pieces of a pair owe to the true flanks.

    Args:
        pair: the pair.
        points: points along each flank, as given to :func:`pieces`.

    Returns:
        ``chord_error_m`` the largest distance of a chord from its flank, over both gears and all deviating teeth;
        ``extent_m`` the longest edge of a piece's box in the gear's own frame; ``quantum_m`` the step in which Bullet
        stores its vertices; ``gap_error_m`` how far a gap between two pieces may differ from that of the flanks: a
        chord on each side and a step of each vertex.
    """
    chord, extent = 0.0, 0.0
    for which in GEARS:
        deviating = any(deviation.gear == which for deviation in pair.deviations)
        for tooth in range(1, pair.gear(which).teeth + 1 if deviating else 2):
            chord = max(chord, *(_chord_error(pair, which, flank, tooth, points) for flank in (ACTIVE, REVERSE)))
        extent = max(extent, *(float(np.max(np.ptp(piece, axis=0))) for piece in pieces(pair, which, points)))
    quantum = extent / _HULL_STEPS
    return {
        "chord_error_m": chord,
        "extent_m": extent,
        "quantum_m": quantum,
        "gap_error_m": 2.0 * (chord + quantum),
    }


def _chord_error(pair: Pair, which: str, flank: int, tooth: int, points: int) -> float:
    """Return the largest distance of a chord's middle from the flank, along the flank's normal there [m]."""
    flanks, gear = pair.compiled(), GEARS.index(which)
    rolls = _rolls(pair, flanks, which, flank, tooth, points)
    ends = flank_points(flanks, gear, flank, tooth, rolls)[0]
    middles, normals = flank_points(flanks, gear, flank, tooth, 0.5 * (rolls[1:] + rolls[:-1]))
    return float(np.max(np.sum((middles - 0.5 * (ends[1:] + ends[:-1])) * normals, axis=1)))


def _rolls(pair: Pair, flanks: Flanks, which: str, flank: int, tooth: int, points: int) -> NDArray[np.float64]:
    """Roll angles from the start of the working flank to the tip, with equal chord errors along a perfect involute.

    Where a relief starts there is a point in any case: a chord across that edge would cut off more than others.
    """
    gear = GEARS.index(which)
    lowest, start = flanks.gears[gear, 4], pair.start_roll(which)
    start = max(lowest, start - 0.03 * (pair.gear(which).tip_roll - start), _LEAST_ROLL)
    base = pair.gear(which).base_radius
    first = roll_at_radius(flanks, gear, flank, tooth, base * (1.0 + start**2) ** 0.5)
    last = roll_at_radius(flanks, gear, flank, tooth, pair.gear(which).tip_radius)
    edges = relief_starts(flanks, gear)
    edges = edges[(edges > first) & (edges < last)]
    rolls = np.linspace(first**1.5, last**1.5, points - len(edges)) ** (2.0 / 3.0)
    return np.sort(np.append(rolls, edges))
