"""Convex pieces of helical and crowned teeth against the surfaces."""

from itertools import pairwise
from math import radians

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from gears3d.errors import InputError
from gears3d.gears import (
    ACTIVE,
    REVERSE,
    Gear,
    HarmonicDeviation,
    Pair,
    Relief,
    compile_surfaces,
    piece_budget,
    pieces,
    surface_point,
)

GEARS = [Gear(2.75e-3, z, helix_angle=radians(28), face_width=16e-3) for z in (17, 43)]
PAIR = Pair.from_backlash(*GEARS, 120e-6)


def outside(pair, which, slices, points=24):
    """How far points of both flanks, all along the face, lie outside the hulls of tooth 2: least and largest."""
    surfaces, number, gear = compile_surfaces(pair), ["drive", "loose"].index(which), pair.gear(which)
    made = pieces(pair, which, points, slices)
    per_tooth = len(made) // gear.teeth
    hulls = [ConvexHull(piece) for piece in made[per_tooth : 2 * per_tooth]]
    low = max(pair.start_roll(which), 0.1)
    found = []
    for height in np.linspace(-0.5, 0.5, 4 * per_tooth + 1) * gear.face_width * (1 - 1e-9):
        hull = hulls[min(int((height / gear.face_width + 0.5) * per_tooth), per_tooth - 1)]
        for flank in (ACTIVE, REVERSE):
            for roll in np.linspace(low, gear.tip_roll - 1e-6, 60):
                point, normal, _, _ = surface_point(surfaces, number, flank, 2, roll, height)
                upright = np.abs(hull.equations[:, 2]) < 0.9
                off = hull.equations[upright, :3] @ point + hull.equations[upright, 3]
                facing = hull.equations[upright, :3] @ normal > 0.95
                found.append(off[facing].max())
    return min(found), max(found)


@pytest.mark.parametrize("which", ["drive", "loose"])
@pytest.mark.parametrize("slices", [4, 8, 16])
def test_helical_hulls_stand_back_within_their_budget(which, slices):
    least, most = outside(PAIR, which, slices)
    budget = piece_budget(PAIR, 24, slices)
    assert least > -1e-10
    assert most <= budget["chord_error_m"] + budget["slice_error_m"]
    if which == "drive":
        assert most > 0.5 * budget["slice_error_m"]


def test_helical_hulls_carry_deviations():
    """The vertices at each end of a slice are those of the deviating surface there."""
    pair = PAIR.with_deviations(HarmonicDeviation("drive", "active", 3, 15e-6, 0.4))
    surfaces, budget = compile_surfaces(pair), piece_budget(pair)
    made = pieces(pair, "drive")[8:16]
    for piece, height in ((made[0][:24], -8e-3), (made[3][48:72], 0.0), (made[7][48:72], 8e-3)):
        dense = [surface_point(surfaces, 0, ACTIVE, 2, r, height)[0] for r in np.linspace(0.1, 0.75, 4000)]
        near = np.linalg.norm(np.array(dense)[None] - piece[:, None], axis=2).min(axis=1)
        assert near.max() < 3e-6
    least, most = outside(pair, "drive", 8)
    assert least > -0.1e-6
    assert most < 1.05 * (budget["chord_error_m"] + budget["slice_error_m"])


def test_slice_error_falls_with_the_square_of_the_slices():
    errors = [piece_budget(PAIR, 24, slices)["slice_error_m"] for slices in (4, 8, 16, 32)]
    assert np.array(errors[:-1]) / errors[1:] == pytest.approx([4.0] * 3, rel=1e-12)
    assert errors[2] < 2e-6
    assert piece_budget(Pair.from_backlash(*[Gear(2e-3, 30)] * 2, 1e-4))["slice_error_m"] == 0.0


def test_pieces_of_a_tooth_share_their_ends():
    made = pieces(PAIR, "loose", 12)
    assert len(made) == 43 * 8
    assert all(piece.shape == (48, 3) for piece in made)
    for lower, upper in pairwise(made[:8]):
        assert np.array_equal(lower[24:], upper[:24])
    assert made[0][0, 2] == -8e-3
    assert made[7][-1, 2] == 8e-3


@pytest.mark.parametrize("relief", [None, Relief(15e-6, length=2e-3)])
def test_crowned_straight_teeth_are_exact_in_the_middle(relief):
    gear = Gear(3.5e-3, 40, face_width=20e-3, lead_crowning=12e-6, tip_relief=relief)
    pair = Pair.from_backlash(gear, gear, 100e-6)
    flat = Pair.from_backlash(*[Gear(3.5e-3, 40, face_width=20e-3, tip_relief=relief)] * 2, 100e-6)
    made = pieces(pair, "drive")
    assert len(made) == 80
    middle = pieces(flat, "drive")[0][:48, :2]
    assert made[0][48:, :2] == pytest.approx(middle, abs=1e-16)
    least, most = outside(pair, "drive", 6)
    budget = piece_budget(pair, 24, 6)
    assert least > -1e-10
    assert budget["slice_error_m"] == pytest.approx(12e-6 / 36, rel=1e-3)
    assert most <= budget["chord_error_m"] + budget["slice_error_m"]


def test_no_slices_are_refused():
    with pytest.raises(InputError, match=r"slices: is 0 \(give a whole number from 1\)"):
        pieces(PAIR, "drive", slices=0)
