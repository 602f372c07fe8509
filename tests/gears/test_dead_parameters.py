"""No parameter without effect: every field of every geometric record changes the solid or its mounted surfaces.

Each field names a change and the measure that must follow, with the amount in closed form where there is one; a field
without an entry fails.
"""

from dataclasses import fields, replace
from math import acos, cos, hypot, pi, radians, sin

import numpy as np
import pytest

from gears3d.gears import (
    ACTIVE,
    REVERSE,
    Eccentricity,
    Gear,
    HarmonicDeviation,
    HelixSlope,
    Misalignment,
    Pair,
    ProfileSlope,
    ProfileWave,
    Relief,
    ToothDeviation,
    Wobble,
    compile_surfaces,
    flank_point,
    quasi_static,
    roll_at_radius,
    solid,
    surface_point,
)
from gears3d.gears.gear import form
from tests.gears.test_solids import exact_volume

BASE = Gear(2e-3, 24, face_width=6e-3, bore=0.012)
MATE = Gear(2e-3, 31, face_width=6e-3)
PAIR = Pair.from_backlash(BASE, MATE, 80e-6)
RELIEF = Relief(15e-6, length=1.5e-3)


def volume(gear):
    return solid(Pair.from_backlash(gear, gear, 0.0), "drive", 0.05e-6, 0.05e-6).volume


def by_volume(change, base=BASE):
    """The solid's volume follows the exact section's."""

    def check():
        changed = replace(base, **change)
        assert volume(changed) == pytest.approx(exact_volume(changed), rel=3e-5)
        assert abs(exact_volume(changed) / exact_volume(base) - 1) > 2e-4

    return check


def relief_area(relief, end):
    """Amount × length of roll / (power + 1) off both flanks of all teeth, its centre on the involute at that roll."""
    gear, power = BASE, 2 if relief.shape == "parabolic" else 1
    last = gear.tip_roll if end > 0 else form(gear, gear.base_half_angle)[0]
    start = relief.start(gear, last, end)
    rolls = np.linspace(start, last, 4001)
    grown = relief.amount * ((rolls - start) / (last - start)) ** power * gear.base_radius * rolls
    return 2 * gear.teeth * abs(np.sum(0.5 * (grown[1:] + grown[:-1]) * np.diff(rolls)))


def by_tip_relief(relief):
    def check():
        taken = volume(BASE) - volume(replace(BASE, tip_relief=relief))
        # in first order; what is left is as small as the relief's slope
        assert taken == pytest.approx(relief_area(relief, 1.0) * BASE.face_width, rel=0.01 + relief.amount / 1.5e-3)

    return check


def root_relief():
    """All of it at the form circle of the solid's surface, along the involute's normal; the fillet goes with it."""
    relieved = replace(BASE, root_relief=replace(RELIEF, length=0.8e-3))
    lowest = form(BASE, BASE.base_half_angle)[0]
    plain, there = (
        surface_point(compile_surfaces(Pair.from_backlash(g, MATE, 80e-6)), 0, ACTIVE, 2, lowest, 1e-3)
        for g in (BASE, relieved)
    )
    assert (there[0] - plain[0]) @ plain[1] == pytest.approx(-15e-6, abs=1e-15)
    assert volume(BASE) - volume(relieved) > relief_area(relieved.root_relief, -1.0) * BASE.face_width


def lead(change, at):
    """Turn of the flank's section at +z from that in the middle, on both flanks, times the base radius."""

    def check():
        surfaces = compile_surfaces(Pair.from_backlash(replace(BASE, **change), MATE, 80e-6))
        for flank in (ACTIVE, REVERSE):
            middle, end = (surface_point(surfaces, 0, flank, 2, 0.4, z)[0] for z in (0.0, 3e-3))
            turn = np.arctan2(end[1], end[0]) - np.arctan2(middle[1], middle[0])
            assert turn * BASE.base_radius == pytest.approx(at[flank], abs=1e-15)

    return check


GEAR = {
    "module": by_volume({"module": 2.2e-3}),
    "teeth": by_volume({"teeth": 31}),
    "pressure_angle": by_volume({"pressure_angle": radians(22)}),
    "helix_angle": by_volume({"helix_angle": radians(15)}),
    "face_width": by_volume({"face_width": 7e-3}),
    "profile_shift": by_volume({"profile_shift": 0.2}),
    "addendum": by_volume({"addendum": 0.9}),
    "dedendum": by_volume({"dedendum": 1.3}),
    "fillet_radius": by_volume({"fillet_radius": 0.1}),
    "bore": by_volume({"bore": 0.02}),
    "tip_shortening": by_volume({"tip_shortening": 0.1}),
    "tip_diameter": by_volume({"tip_diameter": 0.0515}),
    "tip_relief": by_tip_relief(RELIEF),
    "root_relief": root_relief,
    "rim": by_volume({"rim": 5e-3}, replace(BASE, rim=4e-3, web=2e-3)),
    "web": by_volume({"web": 3e-3}, replace(BASE, rim=4e-3, web=2e-3)),
    "hub": by_volume({"hub": 0.016}, replace(BASE, rim=4e-3, web=2e-3)),
    "lead_crowning": lead({"lead_crowning": 9e-6}, (-9e-6, 9e-6)),
    "helix_slope": lead({"helix_slope": 8e-6}, (4e-6, 4e-6)),
    "thickness_allowance": by_volume({"thickness_allowance": -60e-6}),
}


def off_involute(deviation, which="drive", flank=ACTIVE, tooth=3, share=1.0, z=0.0):
    """Material on the surface at a share of the active profile, along the involute's normal."""
    pair = PAIR.with_deviations(*([deviation] if deviation else []))
    number = ("drive", "loose").index(which)
    start = PAIR.start_roll(which)
    roll = start + share * (PAIR.gear(which).tip_roll - start)
    plain = surface_point(compile_surfaces(PAIR), number, flank, tooth, roll, z)
    return (surface_point(compile_surfaces(pair), number, flank, tooth, roll, z)[0] - plain[0]) @ plain[1]


def material(change, at, expected, base):
    """The changed record puts the expected material there."""

    def check():
        changed = replace(base, **change)
        rest = expected**2 / BASE.base_radius if "z" in at else 1e-12  # a turned flank moves on an arc
        assert off_involute(changed, **at) == pytest.approx(expected, abs=rest)
        assert abs(off_involute(base, **at) - expected) > 1e-7

    return check


SLOPE = ProfileSlope("drive", "active", 4e-6, 3)
WAVE = ProfileWave("drive", "active", 0.3e-6, 2.0, 0.0, 3)
HELIX = HelixSlope("drive", "active", 4e-6, 3)
THICK = ToothDeviation("drive", "active", 3, 5e-6)
HARMONIC = HarmonicDeviation("drive", "active", 2, 5e-6, 0.3)
LOOSE, OTHER, END = {"which": "loose"}, {"flank": REVERSE}, {"z": 3e-3}


def rolled(change, expected, base=HARMONIC):
    """What rolling imposes on the active or reverse flank."""

    def check():
        theta = np.linspace(0, 2 * pi, 37)
        found = quasi_static(PAIR.with_deviations(replace(base, **change)), theta)
        assert np.abs(found.phi_active - expected(found)[0]).max() < 1e-12
        assert np.abs(found.phi_reverse - expected(found)[1]).max() < 1e-12

    return check


def loose_angle(found):
    return (found.phi_active + BASE.base_radius * found.theta) / MATE.base_radius


def shifted(item, change, expected):
    """First order of the displaced axis: what the active flanks of a rolling pair show, of the expected size."""

    def check():
        theta = np.linspace(0, 2 * pi, 73)
        found = quasi_static(PAIR.with_mounting(replace(item, **change)), theta)
        size = np.abs(expected(theta, found)).max()
        assert size > 1e-7
        assert np.abs(found.phi_active - expected(theta, found)).max() < 0.01 * size
        still = quasi_static(PAIR.with_mounting(item), theta)
        assert np.abs(still.phi_active - found.phi_active).max() > 0.1 * size

    return check


ALPHA, HALF = PAIR.working_pressure_angle, 3e-3
OFF, WOBBLE, AXES = Eccentricity("drive", 10e-6), Wobble("drive", 1e-3), Misalignment(1e-3, 0.0)


def start_of(**start):
    return by_tip_relief(Relief(15e-6, **start))


TABLES = {
    Gear: GEAR,
    Relief: {
        "amount": by_tip_relief(replace(RELIEF, amount=30e-6)),
        "start_roll": start_of(start_roll=0.42),
        "start_diameter": start_of(start_diameter=49e-3),
        "length": start_of(length=1e-3),
        "shape": by_tip_relief(replace(RELIEF, shape="parabolic")),
    },
    ProfileSlope: {
        "gear": material({"gear": "loose"}, LOOSE, 2e-6, SLOPE),
        "flank": material({"flank": "reverse"}, OTHER, 2e-6, SLOPE),
        "amount": material({"amount": 8e-6}, {"share": 0.75}, 2e-6, SLOPE),
        "tooth": material({"tooth": None}, {"tooth": 9}, 2e-6, SLOPE),
    },
    ProfileWave: {
        "gear": material({"gear": "loose"}, LOOSE, 0.3e-6, WAVE),
        "flank": material({"flank": "reverse"}, OTHER, 0.3e-6, WAVE),
        "amplitude": material({"amplitude": 0.6e-6}, {}, 0.6e-6, WAVE),
        "waves": material({"waves": 1.0}, {"share": 0.5}, -0.3e-6, WAVE),
        "phase": material({"phase": pi}, {}, -0.3e-6, WAVE),
        "tooth": material({"tooth": None}, {"tooth": 9}, 0.3e-6, WAVE),
    },
    HelixSlope: {
        "gear": material({"gear": "loose"}, {**LOOSE, **END}, 2e-6, HELIX),
        "flank": material({"flank": "reverse"}, {**OTHER, **END}, 2e-6, HELIX),
        "amount": material({"amount": 8e-6}, {"z": 1.5e-3}, 2e-6, HELIX),
        "tooth": material({"tooth": None}, {"tooth": 9, **END}, 2e-6, HELIX),
    },
    ToothDeviation: {
        "gear": material({"gear": "loose"}, LOOSE, 5e-6, THICK),
        "flank": material({"flank": "reverse"}, OTHER, 5e-6, THICK),
        "tooth": material({"tooth": 9}, {"tooth": 9}, 5e-6, THICK),
        "offset": material({"offset": -7e-6}, {}, -7e-6, THICK),
    },
    HarmonicDeviation: {
        "gear": rolled({"gear": "loose"}, lambda f: (5e-6 * np.cos(2 * loose_angle(f) + 0.3), 0.0)),
        "flank": rolled({"flank": "reverse"}, lambda f: (0.0, -5e-6 * np.cos(2 * f.theta + 0.3))),
        "order": rolled({"order": 3}, lambda f: (5e-6 * np.cos(3 * f.theta + 0.3), 0.0)),
        "amplitude": rolled({"amplitude": 9e-6}, lambda f: (9e-6 * np.cos(2 * f.theta + 0.3), 0.0)),
        "phase": rolled({"phase": 1.0}, lambda f: (5e-6 * np.cos(2 * f.theta + 1.0), 0.0)),
    },
    Eccentricity: {
        "gear": shifted(OFF, {"gear": "loose"}, lambda _, f: 10e-6 * np.sin(ALPHA - loose_angle(f))),
        "offset": shifted(OFF, {"offset": 15e-6}, lambda t, _: 15e-6 * np.sin(t + ALPHA)),
        "phase": shifted(OFF, {"phase": 1.0}, lambda t, _: 10e-6 * np.sin(t + 1.0 + ALPHA)),
    },
    Wobble: {
        "gear": shifted(WOBBLE, {"gear": "loose"}, lambda _, f: 1e-3 * HALF * np.abs(np.sin(ALPHA - loose_angle(f)))),
        "angle": shifted(WOBBLE, {"angle": 2e-3}, lambda t, _: 2e-3 * HALF * np.abs(np.sin(t + ALPHA))),
        "phase": shifted(WOBBLE, {"phase": 1.0}, lambda t, _: 1e-3 * HALF * np.abs(np.sin(t + 1.0 + ALPHA))),
    },
    Misalignment: {
        "in_plane": shifted(AXES, {"in_plane": 2e-3}, lambda t, _: np.full_like(t, 2e-3 * HALF * sin(ALPHA))),
        "out_of_plane": shifted(
            AXES, {"out_of_plane": 1e-3}, lambda t, _: np.full_like(t, 1e-3 * HALF * (sin(ALPHA) + cos(ALPHA)))
        ),
    },
}
CASES = [(kind, part.name) for kind in TABLES for part in fields(kind)]


@pytest.mark.parametrize(("kind", "name"), CASES, ids=[f"{kind.__name__}.{name}" for kind, name in CASES])
def test_every_field_changes_what_it_should(kind, name):
    assert name in TABLES[kind], f"{kind.__name__}.{name} has no check that it does anything"
    TABLES[kind][name]()


def distance_change(pair):
    """Thickness of the drive's tooth on the working pitch circle."""
    flanks, number = pair.compiled(), 0
    angles = []
    for flank in (ACTIVE, REVERSE):
        radius = pair.drive.base_radius / cos(PAIR.working_pressure_angle)
        x, y, *_ = flank_point(flanks, number, flank, 1, roll_at_radius(flanks, number, flank, 1, radius))
        assert hypot(x, y) == pytest.approx(radius, rel=1e-12)
        angles.append(np.arctan2(y, x))
    return (angles[0] - angles[1]) * radius


PAIR_FIELDS = {
    "drive": lambda: volume_of_pair(replace(PAIR, drive=replace(BASE, face_width=7e-3)), "drive", 7 / 6),
    "loose": lambda: volume_of_pair(replace(PAIR, loose=replace(MATE, face_width=9e-3)), "loose", 9 / 6),
    "centre_distance": lambda: backlash_by(replace(PAIR, centre_distance=PAIR.centre_distance + 30e-6)),
    "thinning": lambda: thinner(replace(PAIR, thinning=20e-6)),
    "deviations": lambda: material({"offset": 9e-6}, {}, 9e-6, THICK)(),
    "mounting": lambda: shifted(OFF, {"offset": 15e-6}, lambda t, _: 15e-6 * np.sin(t + ALPHA))(),
}


def volume_of_pair(pair, which, factor):
    assert solid(pair, which).volume == pytest.approx(factor * solid(PAIR, which).volume, rel=1e-12)


def backlash_by(pair):
    """From the surfaces, not from the pair: both involutes by inv of the working pressure angle."""
    total = BASE.base_radius + MATE.base_radius
    angle = [acos(total / p.centre_distance) for p in (PAIR, pair)]
    inv = [np.tan(a) - a for a in angle]
    found = quasi_static(pair, [0.3]).backlash[0]
    assert found == pytest.approx(80e-6 + 2 * total * (inv[1] - inv[0]), abs=1e-14)


def thinner(pair):
    ratio = cos(PAIR.working_pressure_angle)
    assert distance_change(PAIR) - distance_change(pair) == pytest.approx(20e-6 / ratio, rel=1e-9)
    assert quasi_static(pair, [0.3]).backlash[0] == pytest.approx(120e-6, abs=1e-14)


@pytest.mark.parametrize("name", [part.name for part in fields(Pair)])
def test_every_field_of_a_pair_changes_what_it_should(name):
    assert name in PAIR_FIELDS, f"Pair.{name} has no check that it does anything"
    PAIR_FIELDS[name]()
