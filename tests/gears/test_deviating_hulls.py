"""Hulls, budgets and solids of gears whose deviations move the start of the flank: made, or refused in one sentence."""

from math import hypot, isfinite, pi, radians

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, event, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from gears3d.effects import catalogue
from gears3d.errors import InputError
from gears3d.gears import (
    Gear,
    HarmonicDeviation,
    Pair,
    ProfileSlope,
    ProfileWave,
    ToothDeviation,
    flank_point,
    flanks_at,
    piece_budget,
    pieces,
    roll_at_radius,
    solid,
)

KINDS = catalogue()
TRANSMISSION = KINDS["transmission_error"].params["amplitude"].high
PITCH = KINDS["pitch_error"].params["offset"].high
FLANKS = ("active", "reverse")


def amounts(most):
    """Amounts of either sign over all decades from 1 um up to what the loader admits."""
    return st.builds(
        lambda exponent, sign: sign * 10.0**exponent, st.floats(-6.0, np.log10(most)), st.sampled_from([-1, 1])
    )


@st.composite
def pairs(draw):
    """Spur and helical pairs of 15 to 120 teeth and ratios of 0.6 to 4, with backlash of 10 um to 1 mm."""
    teeth = draw(st.integers(15, 120))
    mate = draw(st.integers(max(15, round(0.6 * teeth)), min(120, 4 * teeth)))
    module, helix = draw(st.sampled_from([1e-3, 2e-3, 3.5e-3])), radians(draw(st.sampled_from([0.0, 0.0, 15.0, 28.0])))
    gears = [Gear(module, z, helix_angle=helix, face_width=6.0 * module) for z in (teeth, mate)]
    try:
        return Pair.from_backlash(*gears, 10.0 ** draw(st.floats(-5.0, -3.0)))
    except InputError:
        assume(False)


@st.composite
def deviations(draw, pair):
    """One or two deviations of a gear, of the sizes that effects and gear tables admit."""
    which, phase = draw(st.sampled_from(["drive", "loose"])), draw(st.floats(0.0, 2.0 * pi))
    teeth, flank = pair.gear(which).teeth, draw(st.sampled_from(FLANKS))
    kind = draw(st.sampled_from(["transmission_error", "backlash_variation", "pitch_error", "slope", "wave"]))
    tooth = draw(st.one_of(st.none(), st.integers(1, teeth)))
    if kind == "transmission_error":
        order, size = draw(st.sampled_from([1, 2, 3, 8, teeth])), draw(amounts(TRANSMISSION))
        return [
            HarmonicDeviation(which, each, order, sign * size, phase)
            for each, sign in zip(FLANKS, (1, -1), strict=True)
        ]
    if kind == "backlash_variation":
        return [
            HarmonicDeviation(
                which, flank, draw(st.sampled_from([0, 1, 2, 5, teeth])), draw(amounts(TRANSMISSION)), phase
            )
        ]
    if kind == "pitch_error":
        return [ToothDeviation(which, flank, tooth or 1, draw(amounts(PITCH)))]
    if kind == "slope":
        return [ProfileSlope(which, flank, draw(amounts(1e-3)), tooth)]
    return [ProfileWave(which, flank, draw(amounts(1e-3)), draw(st.floats(0.5, 5.0)), phase, tooth)]


def outside(pair, which, tooth, made):
    """Distances by which points of a tooth's working flanks lie outside its hull [m]."""
    flanks, index = pair.compiled(), ("drive", "loose").index(which)
    corners = made[tooth - 1][:48, :2]
    hull = ConvexHull(corners)
    found, least = [], pair.gear(which).base_radius * hypot(1.0, pair.start_roll(which))
    for flank in (0, 1):
        for roll in np.linspace(max(pair.start_roll(which), 0.02), pair.gear(which).tip_roll, 60):
            x, y, nx, ny, _, _ = flank_point(flanks, index, flank, tooth, roll)
            if least < hypot(x, y) < pair.gear(which).tip_radius:
                facing = hull.equations[:, :2] @ (nx, ny) > 0.95
                found.append((hull.equations[facing, :2] @ (x, y) + hull.equations[facing, 2]).max())
    return found


def check(pair, which):
    budget = piece_budget(pair)
    assert all(isfinite(value) and value >= 0.0 for value in budget.values()), budget
    for each in ("drive", "loose"):
        assert all(np.isfinite(piece).all() for piece in pieces(pair, each))
    if pair.drive.helix_angle == 0.0:
        made = pieces(pair, which)
        for tooth in range(1, pair.gear(which).teeth + 1, 7):
            off = outside(pair, which, tooth, made)
            assert not off or max(off) <= 1.02 * budget["chord_error_m"] + 1e-9, (tooth, max(off), budget)
    made = solid(pair, which, 10e-6)
    tip = pair.gear(which).tip_radius
    assert made.is_watertight
    assert 0.0 < made.volume < pi * tip**2 * pair.gear(which).face_width


@pytest.mark.parametrize(
    ("teeth", "which", "order", "amplitude", "phase"),
    [
        ((19, 37), "drive", 1, 200e-6, 0.0),
        ((19, 37), "drive", 3, 60e-6, 0.0),
        ((19, 37), "drive", 19, 7.8e-6, 1.0),
        ((19, 37), "loose", 8, 250e-6, 0.0),
        ((112, 120), "drive", 8, 694e-6, 6.04),
    ],
)
def test_flanks_that_lean_above_their_start_radius_have_hulls(teeth, which, order, amplitude, phase):
    """From amplitude·order of about half of base radius·start roll² on, no point of some flanks has that radius."""
    pair = Pair.from_backlash(*[Gear(2.5e-3, z, face_width=12e-3) for z in teeth], 200e-6)
    start, base = pair.start_roll(which), pair.gear(which).base_radius
    assert amplitude * order > 0.4 * base * start**2
    pair = pair.with_deviations(
        HarmonicDeviation(which, "active", order, amplitude, phase),
        HarmonicDeviation(which, "reverse", order, -amplitude, phase),
    )
    check(pair, which)


def test_steep_waves_of_helical_teeth_end_at_the_tip():
    """Newton's steps towards the tip's roll cycle on such flanks, and a layer of the solid was three gears wide."""
    gears = [Gear(3.5e-3, z, helix_angle=radians(28.0), face_width=21e-3) for z in (104, 81)]
    pair = Pair(*gears, centre_distance=0.36796811502465476)
    waves = [
        HarmonicDeviation("drive", flank, 104, sign * 10e-6, 0.0) for flank, sign in (("active", -1), ("reverse", 1))
    ]
    wavy = pair.with_deviations(*waves)
    check(wavy, "drive")
    assert solid(wavy, "drive", 10e-6).volume == pytest.approx(solid(pair, "drive", 10e-6).volume, rel=1e-5)
    for height in np.linspace(-10.5e-3, 10.5e-3, 41):
        flanks = flanks_at(wavy, height)
        for side in (0, 1):
            roll = roll_at_radius(flanks, 0, side, 1, gears[0].tip_radius)
            assert hypot(*flank_point(flanks, 0, side, 1, roll)[:2]) == pytest.approx(gears[0].tip_radius, rel=1e-12)


@pytest.mark.slow
@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_hulls_budgets_and_outlines_are_made_of_every_pair_that_is_not_refused(data):
    perfect = data.draw(pairs())
    off = data.draw(deviations(perfect))
    which = data.draw(st.sampled_from(["drive", "loose"]))
    try:
        pair = perfect.with_deviations(*off)
        pieces(pair, which)
    except InputError as refusal:
        event(f"refused: {refusal.faults[0].key}")
        return
    event("made")
    check(pair, which)


@pytest.mark.parametrize("amount", [-0.3e-3, -1e-3])
def test_teeth_without_a_tip_are_refused(amount):
    gear = Gear(1e-3, 30, face_width=8e-3)
    perfect = Pair.from_backlash(gear, gear, 100e-6)
    both = [ToothDeviation("loose", flank, 7, amount) for flank in FLANKS]
    if amount > -0.5e-3:
        check(perfect.with_deviations(*both), "loose")
        return
    with pytest.raises(InputError, match=r"loose\.deviations: take more off tooth 7 than it has: .* 737\.4 um thick"):
        pieces(perfect.with_deviations(*both), "drive")
    with pytest.raises(InputError, match=r"backlash: .*thinned until their flanks cross below the tip"):
        solid(Pair.from_both(gear, gear, perfect.centre_distance, 2e-3), "drive")
