"""Solids against the exact profile: volume and inertia."""

from math import acos, pi, radians

import numpy as np
import pytest
from scipy.integrate import quad

from gears3d.gears import Gear, Pair, mass_properties, solid
from gears3d.gears.involute import inv
from gears3d.gears.rack import fillet, form
from gears3d.scenario.meshing import solid_inertia
from tests.gears.test_solids import exact_area

SPUR = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
HELICAL = [Gear(2.75e-3, z, helix_angle=radians(21.7548), face_width=16e-3) for z in (37, 19)]
STEEP = [Gear(2.75e-3, z, helix_angle=radians(28), face_width=16e-3, profile_shift=0.2) for z in (17, 43)]
PAIRS = [
    Pair.from_backlash(SPUR, SPUR, 250e-6),
    Pair.from_backlash(*HELICAL, 100e-6),
    Pair.from_backlash(*STEEP, 120e-6),
]
NAMES = ["spur", "helical", "steep"]
CASES = [(PAIRS[0], None), *(pytest.param(pair, 0.02e-6, marks=pytest.mark.slow) for pair in PAIRS[1:])]


def exact_moment(gear, half):
    """Polar second moment of the section by ¼∮r⁴dφ: root arc, trochoid and involute by quadrature, tip arc."""
    roll, angle = form(gear, half)
    step = 1e-6

    def sweep(t):
        return (fillet(gear, half, t + step)[1] - fillet(gear, half, t - step)[1]) / (2 * step)

    root = gear.root_radius**4 * (pi / gear.teeth - fillet(gear, half, pi / 2)[1])
    trochoid = quad(lambda t: fillet(gear, half, t)[0] ** 4 * sweep(t), angle, pi / 2, epsabs=1e-18)[0]
    # an involute turns by ξ²/(1 + ξ²)·dξ and comes towards the middle of the tooth
    involute = gear.base_radius**4 * quad(lambda x: (1 + x * x) * x * x, roll, gear.tip_roll)[0]
    tip = gear.tip_radius**4 * (half - inv(acos(gear.base_radius / gear.tip_radius)))
    return 2 * gear.teeth * (root + trochoid + involute + tip) / 4


@pytest.mark.parametrize(
    ("pair", "chord"),
    [(PAIRS[0], None), *(pytest.param(pair, 0.02e-6, marks=pytest.mark.slow) for pair in PAIRS[1:])],
    ids=NAMES,
)
def test_volume_and_inertia_to_1e_5(pair, chord):
    """Of the exact section carried along the face: a helix turns slices, which changes neither.

    The gears of the bench at the default chord; smaller ones have more surface to their volume and need a finer one.
    """
    gear, half = pair.drive, pair.half_angle("drive")
    body = solid(pair, "drive") if chord is None else solid(pair, "drive", chord, chord)
    found = mass_properties(body, 1000.0)
    assert found.volume == pytest.approx(exact_area(gear, half) * gear.face_width, rel=1e-5)
    assert found.inertia[2, 2] == pytest.approx(1000.0 * exact_moment(gear, half) * gear.face_width, rel=1e-5)


@pytest.mark.parametrize("pair", PAIRS, ids=NAMES)
def test_volume_and_inertia_converge_at_second_order(pair):
    """In the length of the chords, which is the root of their distance from the flank: errors fall as that."""
    gear, half = pair.drive, pair.half_angle("drive")
    exact = exact_area(gear, half) * gear.face_width, 1000.0 * exact_moment(gear, half) * gear.face_width
    chords, errors = [16e-6, 4e-6, 1e-6, 0.25e-6], []
    for chord in chords:
        found = mass_properties(solid(pair, "drive", chord, chord), 1000.0)
        errors.append([abs(found.volume / exact[0] - 1), abs(found.inertia[2, 2] / exact[1] - 1)])
    halvings = np.log2(np.array(chords) / chords[-1]) / 2
    for row in np.array(errors).T:
        order = np.polyfit(halvings, np.log2(row), 1)[0]
        assert 1.7 < order < 2.3


@pytest.mark.parametrize("pair", PAIRS, ids=NAMES)
def test_simulated_inertia_is_that_of_the_exact_section(pair):
    expected = 7850.0 * exact_moment(pair.drive, pair.half_angle("drive")) * pair.drive.face_width
    assert solid_inertia(pair, "drive", 7850.0) == pytest.approx(expected, rel=1e-5)
