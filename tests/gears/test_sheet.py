"""The data sheet against printed values, the flanks themselves and the solids."""

from dataclasses import replace
from math import cos, hypot, pi, radians, tan
from pathlib import Path

import numpy as np
import pytest

from gears3d.gears import (
    ACTIVE,
    Eccentricity,
    Gear,
    HelixSlope,
    Misalignment,
    Pair,
    ProfileSlope,
    ProfileWave,
    Relief,
    Wobble,
    compile_pair,
    data_sheet,
    flank_gap,
    flank_point,
    path_points,
    quasi_static,
    radial_backlash,
    solid,
)
from gears3d.units import FAMILIES

RIG = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
SPUR = Pair.from_backlash(Gear(2e-3, 23, profile_shift=0.3), Gear(2e-3, 41, profile_shift=-0.1), 80e-6)
HELICAL = Pair.from_backlash(
    *(Gear(2.75e-3, z, helix_angle=radians(28), face_width=16e-3) for z in (17, 43)), backlash=0.0
)
PAIRS = pytest.mark.parametrize(
    "pair", [SPUR, HELICAL, Pair.from_backlash(RIG, RIG, 250e-6)], ids=["spur", "hel", "rig"]
)


def of(pair, symbol, **more):
    (line,) = [line for line in data_sheet(pair, **more) if line.symbol == symbol]
    return line.values if len(line.values) == 2 else line.values[0]


def test_representative_helical_pair():
    """mn 2.75 mm, 28 deg, 17/43, no backlash: sizes worked out elsewhere to the digits given."""
    printed = {
        "α_t": (radians(22.403), radians(5e-4)),
        "β_b": (radians(26.178), radians(5e-4)),
        "a": (93.437e-3, 5e-7),
        "ε_α": (1.372, 5e-4),
        "ε_β": (0.869, 5e-4),
        "ρ_red,C": (8.057e-3, 5e-7),
        "l_m": (24.5e-3, 5e-5),
    }
    for symbol, (value, half_digit) in printed.items():
        assert of(HELICAL, symbol) == pytest.approx(value, abs=half_digit), symbol
    assert np.array(of(HELICAL, "d_b")) / 2 == pytest.approx([24.476e-3, 61.909e-3], abs=5e-7)
    assert of(HELICAL, "β") == (radians(28), -radians(28))


def test_rig_of_rigaud_2020():
    """Table 1: contact ratio 1.84 without backlash; 20 rpm are 310 mm/s on the base circle."""
    closed = Pair.from_backlash(RIG, RIG, 0.0)
    assert of(closed, "ε_γ") == pytest.approx(1.84, abs=5e-3)
    assert np.array(of(closed, "d_b")) * pi * 20 / 60 == pytest.approx(0.310, abs=5e-4)
    assert of(closed, "f_z", speed=pi) == pytest.approx(45.0, rel=1e-12)


@PAIRS
def test_backlashes_hang_together(pair):
    assert of(pair, "j_wt") * cos(pair.working_pressure_angle) == pytest.approx(pair.backlash, rel=1e-12)
    assert of(pair, "j_bn") == pytest.approx(pair.backlash * cos(pair.drive.base_helix_angle), rel=1e-12)
    for angle, which in zip(of(pair, "j_φ"), ("drive", "loose"), strict=True):
        assert angle * pair.gear(which).base_radius == pytest.approx(pair.backlash, rel=1e-12)
    if pair.backlash > 1e-9:
        closed = Pair.from_centre_distance(pair.drive, pair.loose, pair.centre_distance - of(pair, "j_r"))
        assert closed.backlash == pytest.approx(0.0, abs=1e-15)
        # the linear estimate j_wt/(2 tan alpha_wt) is a little too small
        assert 1.0 < of(pair, "j_r") / (of(pair, "j_wt") / (2 * tan(pair.working_pressure_angle))) < 1.02


def test_radial_backlash_of_thin_teeth_never_closes():
    assert radial_backlash(replace(SPUR, thinning=1.5e-3)) is None


@pytest.mark.parametrize("pair", [SPUR, Pair.from_backlash(RIG, RIG, 250e-6)], ids=["spur", "rig"])
def test_ends_of_the_path_are_where_contact_leaves_the_flanks(pair):
    """The gap's own test for points between form and tip circle flips at A and E, and nowhere between."""
    flanks, points = compile_pair(pair), path_points(pair)
    assert points["E"] - points["A"] == pytest.approx(pair.contact_ratio * pair.drive.base_pitch, rel=1e-12)
    for end, inwards in (("A", 1.0), ("E", -1.0)):
        for aside, valid in ((1e-9, True), (-1e-9, False)):
            travel = points[end] + inwards * aside
            theta, theta_loose = (travel / gear.base_radius for gear in (pair.drive, pair.loose))
            gap = flank_gap(flanks, theta, theta_loose, 1, 1, ACTIVE)
            assert gap[0] == pytest.approx(0.0, abs=1e-12)
            assert gap[7] is valid


@PAIRS
def test_sliding_speed_is_the_difference_of_the_flanks_velocities(pair):
    speed = 12.0
    spin = np.array([speed, -speed * pair.drive.teeth / pair.loose.teeth])
    angle, points = pair.working_pressure_angle, path_points(pair)
    pitch_point = np.array([pair.drive.base_radius / cos(angle), 0.0])
    for end, symbol in (("A", "v_gf"), ("E", "v_ga")):
        spot = pitch_point + points[end] * np.array([np.sin(angle), np.cos(angle)])
        arms = spot, spot - [pair.centre_distance, 0.0]
        one, two = (w * np.array([-arm[1], arm[0]]) for w, arm in zip(spin, arms, strict=True))
        assert hypot(*(one - two)) == pytest.approx(of(pair, symbol, speed=speed), rel=1e-12)
        assert (one - two) @ [np.sin(angle), np.cos(angle)] == pytest.approx(0.0, abs=1e-12)


@PAIRS
def test_start_of_active_profile_is_the_flank_point_that_the_mates_tip_touches(pair):
    flanks = compile_pair(pair)
    for number, which in enumerate(("drive", "loose")):
        x, y, *_ = flank_point(flanks, number, ACTIVE, 1, pair.start_roll(which))
        assert 2 * hypot(x, y) == pytest.approx(of(pair, "d_Nf")[number], rel=1e-12)
        assert of(pair, "d_Ff")[number] <= of(pair, "d_Nf")[number] < of(pair, "d_Na")[number]


@PAIRS
def test_tooth_thickness_and_tip_land_are_those_of_the_solid(pair):
    """Arc between both flanks at the reference circle and at the tip, on the vertices of a fine solid."""
    for number, which in enumerate(("drive", "loose")):
        gear = pair.gear(which)
        ring = solid(pair, which, chord=0.02e-6).vertices
        ring = ring[np.abs(ring[:, 2] - ring[:, 2].min()) < 1e-12][:, :2]
        ring = ring[np.hypot(*ring.T) > 0.5 * gear.root_radius]
        radius, polar = np.hypot(*ring.T), np.arctan2(*ring.T[::-1])
        order = np.argsort(polar)
        radius, polar = radius[order], polar[order]
        outside = radius > gear.reference_radius
        crossings = np.nonzero(np.diff(outside.astype(int)))[0]
        share = (gear.reference_radius - radius[crossings]) / (radius[crossings + 1] - radius[crossings])
        angles = polar[crossings] + share * (polar[crossings + 1] - polar[crossings])
        steps, first = np.diff(angles) * gear.reference_radius, int(outside[0])
        assert steps[first::2] == pytest.approx(of(pair, "s_t")[number], abs=0.1e-6)
        assert steps[1 - first :: 2] == pytest.approx(pi * gear.transverse_module - of(pair, "s_t")[number], abs=0.1e-6)
        tips = polar[np.abs(radius - gear.tip_radius) < 1e-12]
        lands = np.diff(tips[np.r_[True, np.diff(tips) > pi / gear.teeth]])
        assert lands == pytest.approx(2 * pi / gear.teeth, rel=1e-9)
        widths = [np.ptp(tip) for tip in np.split(tips, np.nonzero(np.diff(tips) > 0.5 * pi / gear.teeth)[0] + 1)[1:-1]]
        assert np.array(widths) * gear.tip_radius == pytest.approx(of(pair, "s_at")[number], rel=1e-9)


def test_contact_lines_cover_their_mean_length():
    """Averaged over a mesh, the lines in the plane of action have the length l_m."""
    drive = HELICAL.drive
    points, pitch, slope = path_points(HELICAL), drive.base_pitch, tan(drive.base_helix_angle)
    z = (np.arange(4000) + 0.5) / 4000 * drive.face_width - 0.5 * drive.face_width
    length = []
    for shift in (np.arange(200) + 0.5) / 200 * pitch:
        places = shift + np.arange(-5, 6)[:, None] * pitch + z * slope
        inside = (places > points["A"]) & (places < points["E"])
        length.append(inside.sum() * drive.face_width / 4000 / cos(drive.base_helix_angle))
    assert np.mean(length) == pytest.approx(of(HELICAL, "l_m"), rel=1e-4)


def test_contact_moves_towards_the_end_with_z_on_a_right_handed_drive():
    """At the upper end face of a right-handed drive its active flank lies on the line of action b/2·tan β_b past C."""
    drive = HELICAL.drive
    ring = solid(HELICAL, "drive", chord=0.2e-6).vertices
    ring = ring[np.abs(ring[:, 2] - drive.face_width / 2) < 1e-12][:, :2]
    angle = HELICAL.working_pressure_angle
    travel = 0.5 * drive.face_width * tan(drive.base_helix_angle)
    spot = np.array([drive.base_radius / cos(angle), 0.0]) + travel * np.array([np.sin(angle), np.cos(angle)])
    start, step = ring, np.roll(ring, -1, axis=0) - ring
    along = np.clip(np.einsum("ij,ij->i", spot - start, step) / np.maximum(np.sum(step**2, axis=1), 1e-30), 0, 1)
    assert np.hypot(*(start + along[:, None] * step - spot).T).min() < 0.25e-6


def test_masses_are_those_of_the_solids_and_every_line_has_a_unit():
    sheet = data_sheet(SPUR, 3.0, (7850.0, 2700.0))
    assert all(line.family in FAMILIES for line in sheet)
    assert len({line.symbol for line in sheet}) == len(sheet)
    mass = of(SPUR, "m", densities=(7850.0, 2700.0))
    for value, which, density in zip(mass, ("drive", "loose"), (7850.0, 2700.0), strict=True):
        assert value == pytest.approx(density * solid(SPUR, which, 2e-6).volume, rel=1e-12)
    without = {line.symbol for line in data_sheet(SPUR)}
    assert "m" not in without
    assert {line.symbol for line in sheet} - without == {"ρ", "m", "J"}


def everything():
    gears = [
        Gear(
            3.5e-3,
            z,
            face_width=20e-3,
            tip_relief=Relief(20e-6, length=4e-3),
            root_relief=root,
            lead_crowning=8e-6,
            helix_slope=5e-6,
        )
        for z, root in ((40, Relief(9e-6, start_roll=0.28)), (51, None))
    ]
    return (
        Pair.from_backlash(*gears, 200e-6)
        .with_deviations(
            ProfileSlope("drive", "active", 3e-6),
            ProfileSlope("drive", "active", -7e-6, tooth=4),
            ProfileWave("loose", "reverse", 0.4e-6, 2.0),
            HelixSlope("loose", "active", 6e-6),
        )
        .with_mounting(Eccentricity("drive", 20e-6), Wobble("loose", 1e-4), Misalignment(2e-4, -1e-4))
    )


def test_reliefs_deviations_and_mounting_have_their_lines():
    pair = everything()
    assert of(pair, "C_αa") == (20e-6, 20e-6)
    assert of(pair, "C_αf") == (9e-6, None)
    drive = pair.drive
    end = (of(pair, "d_Ca")[0] / drive.base_radius / 2) ** 2 - 1
    assert drive.base_radius * (drive.tip_roll - end**0.5) == pytest.approx(4e-3, rel=1e-12)
    assert of(pair, "d_Cf")[0] == pytest.approx(2 * drive.base_radius * hypot(1, 0.28), rel=1e-12)
    assert of(pair, "C_β") == (8e-6, 8e-6)
    assert of(pair, "f_Hα,active") == pytest.approx((-4e-6, 0.0))  # of tooth 4, the worst
    assert of(pair, "f_fα,reverse") == pytest.approx((0.0, 0.8e-6))
    assert of(pair, "f_Hβ,active") == pytest.approx((5e-6, 11e-6))
    assert of(pair, "f_Hβ,reverse") == pytest.approx((-5e-6, -5e-6))
    assert (of(pair, "e"), of(pair, "γ")) == ((20e-6, 0.0), (0.0, 1e-4))
    assert (of(pair, "f_Σδ"), of(pair, "f_Σβ")) == pytest.approx((4e-6, -2e-6))
    perfect = {line.symbol for line in data_sheet(SPUR)}
    assert not perfect & {"C_αa", "f_Hα,active", "e", "j_bt,min", "ε_α,1"}
    symbols = [line.symbol for line in data_sheet(pair, 1.0, (7850.0, 7850.0))]
    assert len(set(symbols)) == len(symbols)
    assert all(line.family in FAMILIES for line in data_sheet(pair))


def test_least_backlash_is_no_more_than_rolling_leaves_and_close_to_it():
    pair = everything()
    found = quasi_static(pair, np.linspace(0, 2 * pi, 400)).backlash.min()
    assert 0.0 < of(pair, "j_bt,min") <= found + 0.2e-6
    eccentric = SPUR.with_mounting(Eccentricity("loose", 15e-6))
    found = quasi_static(eccentric, np.linspace(0, 4 * pi, 400)).backlash.min()
    # the loose gear turns by b / r while it crosses the dead band, and its offset with it
    turned = 15e-6 * SPUR.backlash / SPUR.loose.base_radius
    assert of(eccentric, "j_bt,min") == pytest.approx(found, abs=turned)


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
def test_contact_ratio_within_a_micrometre_is_where_relief_has_taken_that(shape):
    """The stretch ends where 1 um is gone: amount·(roll / length)^n = 1 um, at the tip of either gear."""
    gear = Gear(3.5e-3, 90, tip_relief=Relief(20e-6, length=4e-3, shape=shape))
    pair = Pair.from_backlash(gear, gear, 250e-6)
    gone = 4e-3 * (1 - (1 / 20) ** (1.0 if shape == "linear" else 0.5))
    expected = pair.contact_ratio - 2 * gone / gear.base_pitch
    assert of(pair, "ε_α,1") == pytest.approx(expected, abs=3e-4)


def test_documentation_explains_every_symbol():
    text = (Path(__file__).resolve().parents[2] / "docs/theory/geometry.md").read_text()
    explained = {
        symbol.strip()
        for line in text.splitlines()
        if line.startswith("| ")
        for symbol in line.split("|")[1].split(",")
    }
    for line in data_sheet(HELICAL, 1.0, (7850.0, 7850.0)):
        assert line.symbol in explained or line.symbol == "ρ_red" + ",C", line.symbol
        if line.source.startswith("("):
            equation = line.source.partition(")")[0] + ")"
            assert equation in text, (line.symbol, equation)
