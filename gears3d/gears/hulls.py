"""Teeth as convex pieces for a collision engine, and how far those stand off the true flanks."""

from __future__ import annotations

from itertools import pairwise
from math import hypot

import numpy as np
from numpy.typing import NDArray

from gears3d.errors import Fault, InputError
from gears3d.gears.deviation import GEARS, index_of
from gears3d.gears.flank import (
    ACTIVE,
    REVERSE,
    Flanks,
    compile_pair,
    flank_points,
    perfect_points,
    relief_starts,
    roll_at_radius,
)
from gears3d.gears.limits import refuse_crossed
from gears3d.gears.pair import Pair
from gears3d.gears.solids import lift
from gears3d.gears.surface import flank_leads, flanks_at, lead_turn

_HULL_STEPS = 10216  # Steps into which Bullet quantises the extent of a convex hull's vertices

_LEAST_ROLL = 0.02  # Roll angle below which an involute that starts at the base circle has no useful length
# Points at which the radius of a flank is compared with that of its start; a 200th of a flank is below the 3 % by
# which hulls begin early
_LOOKED_AT = 200


def pieces(pair: Pair, which: str, points: int = 24, slices: int | None = None) -> list[NDArray[np.float64]]:
    """Return convex pieces of a gear's teeth, in the gear's own frame.

    A piece is the hull of both flanks from the start of their working part to the tip, at both ends of the face or of
    a slice of it. Chords cut into the flanks, and between the ends of a slice helical tips run straight, so a hull
    lies within the perfect one by at most the errors of :func:`piece_budget`.

    Args:
        pair: the pair, deviations included.
        which: ``"drive"`` or ``"loose"``.
        points: points along each flank.
        slices: pieces a tooth along the face; when not given 1 for straight teeth, 2 for crowned ones and
            8 for helical ones.

    Returns:
        Vertices [m], (4·points, 3), for teeth 1, 2, … in order of meshing, of each from -z to +z: at the lower end the
        active flank upwards, then the reverse flank downwards, then the same at the upper end.

    Raises:
        InputError: no slice, an unknown gear, or teeth without a tip.
    """
    refuse_crossed(pair)
    gear, teeth = index_of(which, GEARS, "which"), np.arange(1, pair.gear(which).teeth + 1)
    levels, leads = _levels(pair, which, slices), flank_leads(pair)[gear]
    turns = np.tile(np.repeat([-1.0, 1.0], points), (len(teeth), 1))
    sections = [flanks_at(pair, height) for height in levels[:, 0]]
    if levels[0, 1] == 0.0 or sections[0].harmonics.shape[2] == 0:
        sections = sections[:1]
    layers = [_sections(pair, flanks, which, teeth, points) for flanks in sections]
    lifted = []
    for i, (height, _, crowning) in enumerate(levels):
        turn = crowning * turns + (height * np.repeat(leads.T, points, axis=1) if leads.size else 0.0)
        layer = layers[min(i, len(layers) - 1)]
        lifted.append(lift(layer.reshape(-1, 2), levels[i : i + 1], turn.reshape(1, -1)).reshape(*layer.shape[:2], 3))
    slabs = np.stack([np.concatenate(ends, axis=1) for ends in pairwise(lifted)], axis=1)
    return list(slabs.reshape(-1, *slabs.shape[2:]))


def _sections(pair: Pair, flanks: Flanks, which: str, teeth: NDArray[np.int64], points: int) -> NDArray[np.float64]:
    """Points of both flanks of all teeth in one section: active upwards, reverse downwards, (teeth, 2·points, 2)."""
    gear, sides = GEARS.index(which), []
    for flank in (ACTIVE, REVERSE):
        if flanks.shaped:
            each = [(tooth, _rolls(pair, flanks, which, flank, tooth, points)) for tooth in teeth.tolist()]
            sides.append(np.stack([flank_points(flanks, gear, flank, tooth, rolls)[0] for tooth, rolls in each]))
            continue
        _, first, alike = np.unique(  # perfect teeth differ in no more
            flanks.offsets[gear, flank, : len(teeth)], return_index=True, return_inverse=True
        )
        kinds = [_rolls(pair, flanks, which, flank, int(teeth[i]), points) for i in first]
        rolls = np.stack(kinds)[alike].ravel()
        found = perfect_points(flanks, gear, flank, np.repeat(teeth, points), rolls)[0]
        sides.append(found.reshape(len(teeth), points, 2))
    return np.concatenate([sides[0], sides[1][:, ::-1]], axis=1)


def _levels(pair: Pair, which: str, slices: int | None) -> NDArray[np.float64]:
    """Heights between the slices, their turn and their turn by crowning, (slices + 1, 3)."""
    gear = pair.gear(which)
    turn = lead_turn(gear, 1.0 - 2.0 * GEARS.index(which))
    if slices is None:
        slices = 8 if turn != 0.0 else 2 if gear.lead_crowning != 0.0 else 1
    if slices != int(slices) or slices < 1:
        raise InputError(Fault("slices", f"is {slices:g}", "give a whole number from 1"))
    share = np.linspace(-1.0, 1.0, int(slices) + 1)
    heights = 0.5 * gear.face_width * share
    return np.c_[heights, turn * heights, gear.lead_crowning / gear.base_radius * share**2]


def piece_budget(pair: Pair, points: int = 24, slices: int | None = None) -> dict[str, float]:
    """Return what the convex pieces of a pair owe to the true flanks.

    Args:
        pair: the pair.
        points: points along each flank, as given to :func:`pieces`.
        slices: pieces a tooth along the face, as given to :func:`pieces`.

    Returns:
        ``chord_error_m`` the largest distance of a chord from its flank, over both gears and all deviating teeth;
        ``slice_error_m`` how far the straight edges of slices stand off helical and crowned teeth, 0 for straight ones;
        ``extent_m`` the longest edge of a piece's box in the gear's own frame; ``quantum_m`` the step in which Bullet
        stores its vertices; ``gap_error_m`` how far a gap between two pieces may differ from that of the flanks: a
        chord and a slice's edge on each side and a step of each vertex.
    """
    chord, along, extent = 0.0, 0.0, 0.0
    for which in GEARS:
        deviating = any(deviation.gear == which for deviation in pair.deviations)
        for tooth in range(1, pair.gear(which).teeth + 1 if deviating else 2):
            chord = max(chord, *(_chord_error(pair, which, flank, tooth, points) for flank in (ACTIVE, REVERSE)))
        along = max(along, _slice_error(pair, which, slices))
        extent = max(extent, float(np.ptp(np.stack(pieces(pair, which, points, slices)), axis=1).max()))
    quantum = extent / _HULL_STEPS
    return {
        "chord_error_m": chord,
        "slice_error_m": along,
        "extent_m": extent,
        "quantum_m": quantum,
        "gap_error_m": 2.0 * (chord + along + quantum),
    }


def _slice_error(pair: Pair, which: str, slices: int | None) -> float:
    """Return how far a slice's hull stands off the surface midway between its ends [m].

    There a hull's support function is the mean of those of its ends. Along an involute, whose support function is
    linear, that of a turned section is the same; next to the tip it falls short by up to that of the edge, the
    distance of the tip's tangent from the axis, times the square of the turn over 8. Crowning falls short by 25 %
    of the change of its slope over the slice.
    """
    gear, levels = pair.gear(which), _levels(pair, which, slices)
    turn = float(np.max(np.abs(np.diff(levels[:, 1])))) + float(np.max(np.abs(np.diff(levels[:, 2]))))
    turn += float(np.max(np.abs(flank_leads(pair)[GEARS.index(which)]), initial=0.0)) * float(np.diff(levels[:2, 0])[0])
    crowned = abs(gear.lead_crowning) / (len(levels) - 1) ** 2
    return gear.base_radius * gear.tip_roll * turn * turn / 8.0 + crowned


def _chord_error(pair: Pair, which: str, flank: int, tooth: int, points: int) -> float:
    """Return the largest distance of a chord's middle from the flank, along the flank's normal there [m]."""
    flanks, gear = compile_pair(pair), GEARS.index(which)
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
    last = roll_at_radius(flanks, gear, flank, tooth, pair.gear(which).tip_radius)
    first = _first_roll(flanks, gear, flank, tooth, (max(lowest, _LEAST_ROLL), start, last))
    edges = relief_starts(flanks, gear)
    edges = edges[(edges > first) & (edges < last)]
    rolls = np.linspace(first**1.5, last**1.5, points - len(edges)) ** (2.0 / 3.0)
    return np.sort(np.append(rolls, edges))


def _first_roll(flanks: Flanks, gear: int, flank: int, tooth: int, extent: tuple[float, float, float]) -> float:
    """Return the roll angle at which the deviating flank reaches the radius of a perfect one's start.

    A deviation that changes with the angle turns the normals by its slope, as another base circle would. Where that
    circle is larger than the radius of the start, no point of the flank has this radius: the flank then begins at the
    lowest roll angle above which its radius grows all the way to the tip.
    """
    lowest, start, last = extent
    radius = flanks.gears[gear, 0] * (1.0 + start**2) ** 0.5
    first = roll_at_radius(flanks, gear, flank, tooth, radius)
    if lowest <= first < last:
        (point,), (normal,) = flank_points(flanks, gear, flank, tooth, np.array([first]))
        if abs(hypot(*point) - radius) < 1e-9 * radius and point @ normal > 0.0:
            return first
    rolls = np.linspace(min(lowest, 0.5 * last), last, _LOOKED_AT)
    radii = np.hypot(*flank_points(flanks, gear, flank, tooth, rolls)[0].T)
    falling = np.flatnonzero(np.diff(radii) <= 0.0)
    above = np.flatnonzero(radii >= radius)
    return float(rolls[max(int(falling[-1]) + 1 if len(falling) else 0, int(above[0]) if len(above) else 0)])
