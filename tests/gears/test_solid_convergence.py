"""Solids against the exact profile: volume and inertia."""

from math import acos, pi, radians
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial import cKDTree

from gears3d.gears import Gear, Pair, inv, lead_turn, mass_properties, solid
from gears3d.gears.gear import fillet, form
from gears3d.gears.outline import outline
from gears3d.scenario import load, solid_inertia
from tests.gears.test_solids import exact_area

ROOT = Path(__file__).resolve().parents[2]
SPUR = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
HELICAL = [Gear(2.75e-3, z, helix_angle=radians(21.7548), face_width=16e-3) for z in (37, 19)]
STEEP = [Gear(2.75e-3, z, helix_angle=radians(28), face_width=16e-3, profile_shift=0.2) for z in (17, 43)]
PAIRS = [
    Pair.from_backlash(SPUR, SPUR, 250e-6),
    Pair.from_backlash(*HELICAL, 100e-6),
    Pair.from_backlash(*STEEP, 120e-6),
]
NAMES = ["spur", "helical", "steep"]
PAPERS = ("rigaud-2020", "kadmiri-2012", "helical-17-43", "ottewill-2010")


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


PAPERS = {name: load(ROOT / f"scenarios/base/{name}.toml").pair() for name in PAPERS}
LIGHT = Gear(2e-3, 24, helix_angle=radians(25), face_width=12e-3, bore=12e-3, rim=4e-3, web=3e-3, hub=18e-3)
RING = Gear(1e-3, 114, face_width=3e-3, profile_shift=0.2, bore=0.085)
DEFAULTS = {
    **{f"{name}, {which}": (pair, which) for name, pair in PAPERS.items() for which in ("drive", "loose")},
    "steep": (PAIRS[2], "drive"),
    "light": (Pair.from_backlash(LIGHT, LIGHT, 50e-6), "loose"),
    "ring": (Pair.from_backlash(RING, RING, 50e-6), "drive"),
    "few teeth": (Pair.from_backlash(Gear(2e-3, 9, profile_shift=0.5), Gear(2e-3, 40), 50e-6), "drive"),
    "many teeth": (Pair.from_backlash(Gear(0.5e-3, 200), Gear(0.5e-3, 200), 50e-6), "drive"),
}


def exact_properties(gear, half):
    """Volume [m³] and polar inertia at 1 kg/m³: the section carried along the face, less bore and pockets."""
    bore, width = 0.5 * (gear.bore or 0.0), gear.face_width
    volume = (exact_area(gear, half) - pi * bore**2) * width
    inertia = (exact_moment(gear, half) - pi / 2 * bore**4) * width
    if gear.rim is not None:
        inner, outer = gear.pocket
        volume -= pi * (outer**2 - inner**2) * (width - gear.web)
        inertia -= pi / 2 * (outer**4 - inner**4) * (width - gear.web)
    return volume, inertia


TWINS = ("helical-17-43, drive", "kadmiri-2012, drive")
"""Gears whose mates are asked by default: they differ by their number of teeth."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in TWINS else ()) for name in DEFAULTS]
)
def test_volume_and_inertia_to_1e_5_at_the_default_chord(name):
    """Of the exact section carried along the face: a helix turns slices, which changes neither."""
    pair, which = DEFAULTS[name]
    found = mass_properties(solid(pair, which), 1.0)
    volume, inertia = exact_properties(pair.gear(which), pair.half_angle(which))
    assert found.volume == pytest.approx(volume, rel=1e-5)
    assert found.inertia[2, 2] == pytest.approx(inertia, rel=1e-5)


def off_the_section(points, section):
    """Distance of plane points from a closed polygon, by the segments beside its nearest vertex."""
    nearest = cKDTree(section).query(points)[1]
    found = np.full(len(points), np.inf)
    for before in (0, 1):
        start = section[nearest - before]
        step = section[(nearest - before + 1) % len(section)] - start
        along = np.clip(np.sum((points - start) * step, axis=1) / np.sum(step**2, axis=1), 0.0, 1.0)
        found = np.minimum(found, np.hypot(*(points - start - along[:, None] * step).T))
    return found


@pytest.mark.parametrize("which", ["drive", "loose"])
@pytest.mark.parametrize("chord", [8e-6, 0.5e-6])
@pytest.mark.parametrize("name", ["helical-17-43", "kadmiri-2012", "ottewill-2010", "light"])
def test_facets_stay_within_the_chord_everywhere(name, chord, which):
    """Middles of all edges and facets of a few teeth, turned back by the helix, against the section drawn to 1 nm."""
    pair = DEFAULTS[name][0] if name in DEFAULTS else PAPERS[name]
    gear, body = pair.gear(which), solid(pair, which, chord)
    corners = body.triangles[np.abs(body.face_normals[:, 2]) < 0.9]
    inside = 0.9 * gear.root_radius
    corners = corners[(np.hypot(corners[:, 0, 0], corners[:, 0, 1]) > inside)]
    corners = corners[np.abs(np.arctan2(corners[:, 0, 1], corners[:, 0, 0])) < 3 * pi / gear.teeth]
    mixes = np.array([[1, 1, 0], [0, 1, 1], [1, 0, 1], [2 / 3] * 3, [1.5, 0.25, 0.25], [0.25, 1.5, 0.25]]) / 2
    points = (mixes @ corners).reshape(-1, 3)
    turn = lead_turn(gear, 1.0 if which == "drive" else -1.0) * points[:, 2]
    c, s = np.cos(turn), np.sin(turn)
    flat = np.c_[c * points[:, 0] + s * points[:, 1], c * points[:, 1] - s * points[:, 0]]
    section = outline(pair, which, 1e-9).points
    off = off_the_section(flat, section.reshape(-1, 2))
    assert 0.6 * chord < off.max() <= chord + 2e-9


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
