"""The gap of one pair of teeth, edges included: against sampled curves, and as a function of the displacement."""

from math import cos, inf, pi, sin

import numpy as np
import pytest

from gears3d.errors import EngineError
from gears3d.gears import (
    Eccentricity,
    Gear,
    HarmonicDeviation,
    Pair,
    ProfileSlope,
    ProfileWave,
    Relief,
    ToothDeviation,
    compile_surfaces,
    edged_gap,
    flank_points,
    mates,
    quasi_static,
    rolled,
    surface_gap,
)
from gears3d.gears.edge import edged_gap_at

BACKLASH = 250e-6
FAR = 1.5e-3
"""Teeth farther apart may be said not to face each other [m]."""
LINEAR = {"tip_relief": Relief(20e-6, length=7e-3)}
BOTH = {"tip_relief": Relief(15e-6, length=3e-3), "root_relief": Relief(10e-6, length=2e-3)}
CURVED = {"tip_relief": Relief(20e-6, length=4e-3, shape="parabolic")}


def made(teeth, module=3.5e-3, drive=None, loose=None, deviations=(), mounting=()):
    gears = Gear(module, teeth[0], **(drive or {})), Gear(module, teeth[1], **(loose or {}))
    pair = Pair.from_backlash(*gears, BACKLASH)
    return pair.with_deviations(*deviations).with_mounting(*mounting)


THICK = ToothDeviation("loose", "active", 5, 20e-6)
FOUND = made((19, 37), drive=LINEAR, deviations=[THICK], mounting=[Eccentricity("drive", 20e-6, 0.0)])
PAIRS = {
    "perfect": made((19, 37)),
    "many teeth": made((90, 90)),
    "few teeth": made((12, 60), 2e-3, drive={"profile_shift": 0.5}),
    "relief of one, eccentric, one thick tooth": FOUND,
    "relief of both ends of both": made((19, 37), drive=BOTH, loose=BOTH),
    "parabolic relief, both eccentric": made(
        (23, 23),
        drive=CURVED,
        loose=LINEAR,
        mounting=[Eccentricity("drive", 40e-6, 1.0), Eccentricity("loose", 60e-6, 2.5)],
    ),
    "waves of the profile": made(
        (19, 37),
        drive=LINEAR,
        deviations=[ProfileSlope("drive", "active", 8e-6), ProfileWave("loose", "reverse", 2e-6, 2.0, 0.4)],
    ),
    "orders": made((19, 37), loose=BOTH, deviations=[HarmonicDeviation("drive", "active", 3, 15e-6, 0.3), THICK]),
}


def loose_angle(surfaces, theta, s):
    gears = surfaces.shape.flanks.gears
    return (s + gears[0, 0] * theta) / gears[1, 0]


def curve(surfaces, gear, flank, tooth, rotation, axis):
    """A flank from its base circle to its tip in the world: 6001 points, the edge last."""
    shape = surfaces.shape
    x, y = shape.tips[gear, flank, tooth - 1, 1:3]
    most = np.sqrt(max((x**2 + y**2) / shape.flanks.gears[gear, 0] ** 2 - 1.0, 0.0)) + 0.01
    points = flank_points(shape.flanks, gear, flank, tooth, np.linspace(0.0, most, 6001))[0]
    points = np.r_[points[np.hypot(*points.T) < np.hypot(x, y)], [[x, y]]]
    points = points + surfaces.axial[gear, 3:5]
    c, s = cos(rotation), sin(rotation)
    return points @ np.array([[c, s], [-s, c]]) + axis


def parted(surfaces, theta, theta_loose, teeth, flank):
    """Largest distance between parallel lines that part two sampled curves, or least depth of their overlap."""
    mount = surfaces.shape.flanks.mount
    one = curve(surfaces, 0, flank, teeth[0], theta, [0.0, 0.0])
    two = curve(surfaces, 1, flank, teeth[1], pi - theta_loose, [mount[2], 0.0])
    start = middle = (1.0 - 2.0 * flank) * mount[3]
    width, every = 0.7, 20
    gap = -inf
    for count in (701, 41, 41, 41):
        psi = np.clip(np.linspace(middle - width, middle + width, count), start - 0.7, start + 0.7)
        normals = np.array([np.cos(psi), np.sin(psi)])
        some = [np.r_[points[:-1:every], points[-1:]] @ normals for points in (one, two)]
        apart = some[1].min(axis=0) - some[0].max(axis=0)
        gap = apart.max()
        middle, width, every = psi[apart.argmax()], 4.0 * width / count, 1
    return gap


@pytest.mark.parametrize("name", PAIRS)
def test_gaps_are_those_of_sampled_curves(name):
    """Open or overlapping, on flanks and edges, wherever the common normal lies."""
    pair, rng, met = PAIRS[name], np.random.default_rng(7), 0
    surfaces = compile_surfaces(pair)
    for _ in range(12):
        theta, flank, s = rng.uniform(0.0, 100.0), int(rng.integers(2)), rng.uniform(-2.0, 3.0) * BACKLASH
        other = loose_angle(surfaces, theta, s)
        for teeth in mates(surfaces, theta, other, flank)[1:4]:
            gap = surface_gap(surfaces, theta, other, *teeth, flank)[0]
            expected = parted(surfaces, theta, other, teeth, flank)
            if abs(expected) < FAR:
                met += 1
                assert gap == pytest.approx(expected, abs=2e-9), (theta, flank, s, teeth)
    assert met > 25


@pytest.mark.parametrize("name", PAIRS)
def test_the_gap_of_a_pair_rises_with_the_displacement_without_jumps(name):
    """On both flanks, over three times the backlash, for all neighbours: no step exceeds its lever."""
    surfaces, rng = compile_surfaces(PAIRS[name]), np.random.default_rng(3)
    places = np.linspace(-BACKLASH, 2.0 * BACKLASH, 151)
    for theta in rng.uniform(0.0, 160.0, 40):
        for flank in (0, 1):
            for teeth in mates(surfaces, theta, loose_angle(surfaces, theta, 0.0), flank)[1:4]:
                found = [surface_gap(surfaces, theta, loose_angle(surfaces, theta, s), *teeth, flank) for s in places]
                if np.isinf([one[0] for one in found]).any():
                    assert min(one[0] for one in found) > FAR
                    continue
                rates = np.diff([one[0] for one in found]) / np.diff(places) * (1 - 2 * flank)
                assert 0.1 < rates.min() <= rates.max() < 1.2, (theta, flank, teeth)
                slopes = np.array([one[2] for one in found]) / surfaces.shape.flanks.gears[1, 0] * (1 - 2 * flank)
                assert slopes.min() - 1e-6 <= rates.min() <= rates.max() <= slopes.max() + 1e-6


@pytest.mark.parametrize("name", [name for name in PAIRS if not PAIRS[name].mounting])
def test_the_short_way_on_true_axes_is_the_same(name):
    """The engine's function against the one for any pose, overlaps included."""
    shape, rng = compile_surfaces(PAIRS[name]).shape, np.random.default_rng(5)
    surfaces = compile_surfaces(PAIRS[name])
    for _ in range(400):
        theta, flank, s = rng.uniform(0.0, 100.0), int(rng.integers(2)), rng.uniform(-2.0, 3.0) * BACKLASH
        other = loose_angle(surfaces, theta, s)
        for teeth in mates(surfaces, theta, other, flank):
            short = edged_gap(shape, theta, other, *teeth, flank)
            long = edged_gap_at(shape, (shape.flanks.mount[2], 0.0), theta, pi - other, *teeth, flank)
            assert short[0] == pytest.approx(long[0], abs=1e-14)
            assert (short[1], short[2]) == pytest.approx((long[1], -long[2]), abs=1e-9)


def least(surfaces, theta, s, flank):
    other = loose_angle(surfaces, theta, s)
    return min(surface_gap(surfaces, theta, other, *teeth, flank)[0] for teeth in mates(surfaces, theta, other, flank))


@pytest.mark.parametrize("name", PAIRS)
def test_rolling_comes_to_rest_where_the_gap_changes_its_sign(name):
    pair, rng = PAIRS[name], np.random.default_rng(11)
    surfaces = compile_surfaces(pair)
    theta = np.sort(rng.uniform(0.0, 160.0, 300))
    found = quasi_static(pair, theta)
    for flank, places in enumerate((found.phi_active, found.phi_reverse + pair.backlash)):
        for angle, place in zip(theta, places, strict=True):
            below, above = (least(surfaces, angle, place + off, flank) * (1 - 2 * flank) for off in (-2e-13, 2e-13))
            assert below < 0.0 < above


def test_teeth_that_entered_at_the_start_of_a_relief():
    """A pair 77 µm open whose tip edge lies before the flank's relief, where Newton once stopped with 55 µm overlap."""
    surfaces, theta = compile_surfaces(FOUND), 151.48382794
    gaps = [surface_gap(surfaces, theta, loose_angle(surfaces, theta, s), 4, 16, 0)[0] for s in (10e-6, 20e-6, 30e-6)]
    assert gaps == pytest.approx([68.293e-6, 77.230e-6, 86.174e-6], abs=1e-9)


def test_a_place_that_does_not_settle_is_no_result():
    """With tip edges that stand off their flanks the gap jumps: the angle is named."""
    surfaces = compile_surfaces(FOUND)
    surfaces.shape.tips[:, :, :, 1:3] *= 1.002
    with pytest.raises(EngineError, match=r"active flanks do not come to rest at theta = \d"):
        rolled(FOUND, surfaces, np.linspace(0.0, 2.0, 200), 0)
