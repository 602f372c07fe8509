"""Flank surfaces over the face: helical gears against stacks of spur slices, lead deviations, displaced axes."""

from itertools import product
from math import atan, cos, hypot, pi, radians, sin, tan

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.gears import (
    ACTIVE,
    REVERSE,
    Eccentricity,
    Gear,
    HarmonicDeviation,
    Misalignment,
    Pair,
    ProfileSlope,
    ProfileWave,
    Relief,
    Wobble,
    compile_surfaces,
    edged,
    edged_gap,
    flank_gap,
    flanks_at,
    mates,
    roll_at_radius,
    section_gap,
    solid,
    surface_gap,
    surface_point,
)

BETA, WIDTH = radians(28), 16e-3


def helical(teeth=(17, 43), shift=(0.0, 0.0), relief=None, drive=(), **more):
    gears = [
        Gear(
            2.75e-3,
            z,
            helix_angle=BETA,
            face_width=WIDTH,
            profile_shift=x,
            tip_relief=relief,
            **{**more, **(dict(drive) if i == 0 else {})},
        )
        for i, (z, x) in enumerate(zip(teeth, shift, strict=True))
    ]
    return Pair.from_backlash(*gears, 120e-6)


def spur_like(pair):
    """The pair of spur gears whose transverse section is that of a helical pair."""
    gears = []
    for gear in (pair.drive, pair.loose):
        c = cos(gear.helix_angle)
        gears.append(
            Gear(
                gear.module / c,
                gear.teeth,
                atan(tan(gear.pressure_angle) / c),
                profile_shift=gear.profile_shift * c,
                addendum=gear.addendum * c,
                dedendum=gear.dedendum * c,
                fillet_radius=0.1,
                tip_relief=gear.tip_relief,
            )
        )
    return Pair.from_centre_distance(*gears, pair.centre_distance)


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.3, -0.1)])
def test_transverse_section_of_a_helical_pair_is_a_spur_pair(shift):
    """Profile shift counts in normal modules: tooth thickness, backlash and centre distance follow."""
    pair = helical(shift=shift)
    spur = spur_like(pair)
    assert spur.backlash == pytest.approx(120e-6, abs=1e-14)
    assert spur.contact_ratio == pytest.approx(pair.contact_ratio, rel=1e-12)
    flanks, like = compile_surfaces(pair), edged(spur)
    for theta in np.linspace(-0.1, 0.2, 7):
        theta_loose = (50e-6 + pair.drive.base_radius * theta) / pair.loose.base_radius
        for flank in (ACTIVE, REVERSE):
            here = section_gap(flanks, theta, theta_loose, 1, 1 + flank, flank, 0.0)
            there = edged_gap(like, theta, theta_loose, 1, 1 + flank, flank)
            assert here[0] == pytest.approx(there[0], abs=1e-14)
            assert here[1:3] == pytest.approx(there[1:3], abs=1e-13)


def stack_gap(pair, theta, theta_loose, teeth, flank, slices=401):
    """Smallest gap of a stack of spur slices, each turned on by the helix and thinned by the crowning, then refined."""
    like, half = edged(spur_like(pair)), 0.5 * WIDTH
    drive, loose = pair.drive, pair.loose

    def gap(z):
        turned = theta + z * tan(BETA) / drive.reference_radius + drive.helix_slope * z / WIDTH / drive.base_radius
        turned_loose = theta_loose + z * tan(BETA) / loose.reference_radius
        turned_loose -= loose.helix_slope * z / WIDTH / loose.base_radius
        # an involute that stands back is one turned back
        side = 1 - 2 * flank
        turned -= side * drive.lead_crowning * (z / half) ** 2 / drive.base_radius
        turned_loose += side * loose.lead_crowning * (z / half) ** 2 / loose.base_radius
        return edged_gap(like, turned, turned_loose, *teeth, flank)[0]

    low, high = -half, half
    for _ in range(6):
        heights = np.linspace(low, high, slices)
        gaps = [gap(z) for z in heights]
        best = int(np.argmin(gaps))
        low, high = heights[max(best - 1, 0)], heights[min(best + 1, slices - 1)]
    return gaps[best], heights[best]


RELIEF = Relief(15e-6, length=2e-3, shape="parabolic")
SHAPES = [(0.0, 0.0, None), (0.0, 0.0, RELIEF), (0.0, 8e-6, None), (12e-6, 0.0, None), (-12e-6, 8e-6, RELIEF)]
"""Slope of the helix [m], crowning [m] and relief: none, each alone, and all."""


@pytest.mark.parametrize(
    ("slope", "crowning", "relief"),
    SHAPES
    + [
        pytest.param(*shape, marks=pytest.mark.slow)
        for shape in product((0.0, 12e-6, -12e-6), (0.0, 8e-6), (None, RELIEF))
        if shape not in SHAPES
    ],
)
def test_gap_of_helical_teeth_is_that_of_a_fine_stack_of_spur_slices(slope, crowning, relief):
    """To a picometre, for every pair of teeth near the path of contact, on both flanks."""
    pair = helical(relief=relief, drive={"helix_slope": slope}, lead_crowning=crowning)
    surfaces, half, seen = compile_surfaces(pair), 0.5 * WIDTH, 0
    for theta in (0.03, 0.1):
        theta_loose = (45e-6 + pair.drive.base_radius * theta) / pair.loose.base_radius
        for flank in (ACTIVE, REVERSE):
            for teeth in mates(surfaces, theta, theta_loose, flank).tolist():
                found = surface_gap(surfaces, theta, theta_loose, *teeth, flank)
                gap, height = stack_gap(pair, theta, theta_loose, teeth, flank)
                if not (np.isfinite(gap) and gap < 200e-6):
                    assert found[0] > 200e-6
                    continue
                seen += 1
                assert found[0] == pytest.approx(gap, abs=1e-12)
                if crowning and slope:
                    assert found[-1] == pytest.approx(height, abs=1e-4)
                assert abs(found[-1]) <= half
    assert seen >= 8


def test_ideal_helical_teeth_have_the_dead_bands_rest_as_gap_wherever_they_touch():
    pair = helical(shift=(0.2, 0.1))
    surfaces = compile_surfaces(pair)
    for theta in np.linspace(-2, 2, 41):
        for part in (0.0, 0.3, 1.0):
            s = part * pair.backlash
            theta_loose = (s + pair.drive.base_radius * theta) / pair.loose.base_radius
            for flank, expected in ((ACTIVE, s), (REVERSE, pair.backlash - s)):
                gaps = [
                    surface_gap(surfaces, theta, theta_loose, *teeth, flank)[0]
                    for teeth in mates(surfaces, theta, theta_loose, flank).tolist()
                ]
                touching = np.abs(np.array(gaps) - expected) < 1e-14
                assert min(gaps) == pytest.approx(expected, abs=1e-15)
                assert touching.sum() in (2, 3)


def test_crowned_spur_teeth_touch_in_the_middle_and_sloped_ones_at_the_end():
    gear = Gear(3.5e-3, 90, face_width=20e-3, lead_crowning=10e-6)
    pair = Pair.from_backlash(gear, gear, 250e-6)
    gap, *_, z = surface_gap(compile_surfaces(pair), 0.01, 0.01 + 1e-3, 1, 1, ACTIVE)
    assert gap == pytest.approx(flank_gap(pair.compiled(), 0.01, 0.01 + 1e-3, 1, 1, ACTIVE)[0], abs=1e-15)
    assert abs(z) < 1e-5
    sloped = Gear(3.5e-3, 90, face_width=20e-3, helix_slope=10e-6)
    pair = Pair.from_backlash(sloped, Gear(3.5e-3, 90, face_width=20e-3), 250e-6)
    for flank, end in ((ACTIVE, 1.0), (REVERSE, -1.0)):
        gap, *_, z = surface_gap(compile_surfaces(pair), 0.0, 0.0, 1, 1 + flank, flank)
        assert gap == pytest.approx((-5e-6, 245e-6)[flank], abs=1e-15)
        assert z == pytest.approx(end * 10e-3, abs=1e-10)
    both = Gear(3.5e-3, 90, face_width=20e-3, helix_slope=10e-6, lead_crowning=10e-6)
    pair = Pair.from_backlash(both, Gear(3.5e-3, 90, face_width=20e-3), 250e-6)
    gap, *_, z = surface_gap(compile_surfaces(pair), 0.0, 0.0, 1, 1, ACTIVE)
    # material 10·z/20 − 10·(z/10)² in µm and mm is largest at z = 2.5 mm: 0.625 µm
    assert (gap, z) == (pytest.approx(-0.625e-6, abs=1e-15), pytest.approx(2.5e-3, abs=1e-7))


@pytest.mark.parametrize(
    "mounting",
    [
        (),
        (Eccentricity("drive", 40e-6, 0.4), Eccentricity("loose", 30e-6, 1.4)),
        (Wobble("loose", 3e-4, 0.9), Misalignment(2e-4, -1e-4)),
    ],
)
@pytest.mark.parametrize("make", [helical, lambda: helical(lead_crowning=7e-6)])
def test_derivatives_of_the_gap_by_the_angles(make, mounting):
    pair = make().with_mounting(*mounting)
    surfaces, step = compile_surfaces(pair), 1e-6
    for theta in np.linspace(0, 5, 9):
        theta_loose = (60e-6 + pair.drive.base_radius * theta) / pair.loose.base_radius
        for flank in (ACTIVE, REVERSE):
            pairs = mates(surfaces, theta, theta_loose, flank).tolist()
            teeth = min(pairs, key=lambda t: surface_gap(surfaces, theta, theta_loose, *t, flank)[0])
            here = surface_gap(surfaces, theta, theta_loose, *teeth, flank)
            by_drive = surface_gap(surfaces, theta + step, theta_loose, *teeth, flank)[0] - here[0]
            by_loose = surface_gap(surfaces, theta, theta_loose + step, *teeth, flank)[0] - here[0]
            assert (by_drive / step, by_loose / step) == pytest.approx(here[1:3], rel=1e-4)


@pytest.mark.parametrize("flank", [ACTIVE, REVERSE])
@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("wave", [False, True])
def test_surface_points_have_their_normals_and_derivatives(number, flank, wave):
    pair = helical(relief=Relief(15e-6, length=2e-3), lead_crowning=9e-6, helix_slope=5e-6)
    if wave:
        which, side = ("drive", "loose")[number], ("active", "reverse")[flank]
        pair = pair.with_deviations(HarmonicDeviation(which, side, 5, 10e-6, 0.4))
    surfaces, step = compile_surfaces(pair), 1e-7
    gear = (pair.drive, pair.loose)[number]
    for roll in np.linspace(0.25, gear.tip_roll, 5):
        for z in np.linspace(-8e-3, 8e-3, 5):
            _, normal, by_roll, by_z = surface_point(surfaces, number, flank, 3, roll, z)
            for derivative, (d_roll, d_z) in ((by_roll, (step, 0.0)), (by_z, (0.0, step))):
                ends = [
                    surface_point(surfaces, number, flank, 3, roll + k * d_roll, z + k * d_z)[0] for k in (-0.5, 0.5)
                ]
                assert (ends[1] - ends[0]) / step == pytest.approx(derivative, rel=1e-5, abs=5e-8)
                assert normal @ derivative == pytest.approx(0.0, abs=1e-9 if wave else 1e-14)
            assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-15)
    # the axial share of an involute helicoid's normal is the sine of the base helix angle, its hand that of the gear
    ideal = compile_surfaces(helical())
    normal = surface_point(ideal, number, flank, 1, 0.4, 3e-3)[1]
    hand, side = (1.0, -1.0)[number], (1.0, -1.0)[flank]
    assert normal[2] == pytest.approx(-hand * side * sin(gear.base_helix_angle), abs=1e-14)


@pytest.mark.parametrize("which", ["drive", "loose"])
@pytest.mark.parametrize("wave", [(), (HarmonicDeviation("drive", "active", 5, 10e-6, 0.4),)])
def test_solids_carry_crowning_helix_slope_and_deviations(which, wave):
    """Every tip corner of both end faces and the middle is where the surfaces put it."""
    gears = [
        Gear(2.75e-3, z, helix_angle=BETA, face_width=WIDTH, lead_crowning=20e-6, helix_slope=30e-6) for z in (17, 43)
    ]
    pair = Pair.from_backlash(*gears, 120e-6).with_deviations(*wave)
    surfaces, number = compile_surfaces(pair), ["drive", "loose"].index(which)
    body = solid(pair, which, chord=1e-6)
    assert body.is_volume
    for z in (-0.5 * WIDTH, 0.0, 0.5 * WIDTH):
        ring = body.vertices[np.abs(body.vertices[:, 2] - z) < 1e-12]
        for flank in (ACTIVE, REVERSE):
            roll = roll_at_radius(flanks_at(pair, z), number, flank, 5, pair.gear(which).tip_radius)
            for at in (roll, 0.7 * roll):
                point = surface_point(surfaces, number, flank, 5, at, z)[0]
                near = np.linalg.norm(ring - point, axis=1).min()
                assert near < (1e-12 if at == roll else 0.3e-3)


def test_crowning_and_slope_change_the_volume_by_what_they_should():
    """A third of the crowning off both flanks of every tooth in the mean; a slope changes shape but no volume."""
    bodies = []
    for crowning, slope in ((0.0, 0.0), (20e-6, 0.0), (0.0, 40e-6)):
        gear = Gear(3.5e-3, 40, face_width=20e-3, lead_crowning=crowning, helix_slope=slope)
        bodies.append(solid(Pair.from_backlash(gear, gear, 0.1e-3), "drive", chord=0.05e-6))
    gear = Gear(3.5e-3, 40, face_width=20e-3)
    turn = 20e-6 / 3 / gear.base_radius
    low, high = gear.root_radius, gear.tip_radius
    taken = 40 * turn * (high**2 - low**2) * 20e-3
    # fillets turn only in part, from the form circle down to nothing at the root
    assert 0.8 * taken < bodies[0].volume - bodies[1].volume < taken
    assert bodies[2].volume == pytest.approx(bodies[0].volume, rel=1e-6)
    top, bottom = bodies[2].vertices[:, 2] > 9.99e-3, bodies[2].vertices[:, 2] < -9.99e-3
    a, b = (bodies[2].vertices[end][:, :2] for end in (top, bottom))
    a, b = (x[np.abs(np.hypot(*x.T) - high) < 1e-9] for x in (a, b))
    turned = np.angle((a[:, 0] + 1j * a[:, 1]) / (b[:, 0] + 1j * b[:, 1]))
    assert turned * gear.base_radius == pytest.approx(np.full(len(a), 40e-6), abs=1e-12)


def test_section_gap_is_that_of_the_posed_curves():
    """On displaced axes: the contact point lies on both flanks' tangents at half the gap, in world coordinates."""
    pair = helical().with_mounting(Eccentricity("drive", 40e-6, 0.4), Wobble("loose", 2e-4, 0.9))
    surfaces, theta, z = compile_surfaces(pair), 0.02, 3e-3
    theta_loose = (60e-6 + pair.drive.base_radius * theta) / pair.loose.base_radius
    gap, _, _, x, y, nx, ny, valid = section_gap(surfaces, theta, theta_loose, 1, 1, ACTIVE, z)
    assert valid
    off = 40e-6 * np.array([cos(theta + 0.4), sin(theta + 0.4)])
    lean = 2e-4 * z * np.array([-cos(theta_loose + 0.9), sin(theta_loose + 0.9)])
    axes = [(theta, off), (pi - theta_loose, np.array([pair.centre_distance, 0.0]) + lean)]
    for number, (turn, centre) in enumerate(axes):
        c, s = cos(turn), sin(turn)
        rolls = np.linspace(0.2, 0.6, 40001)
        curve = np.array([surface_point(surfaces, number, ACTIVE, 1, roll, z)[0][:2] for roll in rolls[::20]])
        world = curve @ np.array([[c, s], [-s, c]]) + centre
        reach = (world - (x, y)) @ (nx, ny)
        extreme = reach.max() if number == 0 else reach.min()
        assert extreme == pytest.approx((-0.5, 0.5)[number] * gap, abs=2e-9)
        assert hypot(nx, ny) == pytest.approx(1.0)


def test_what_needs_the_whole_face_is_refused_in_one_section():
    pair = Pair.from_backlash(*[Gear(3.5e-3, 90, face_width=20e-3)] * 2, 1e-4)
    with pytest.raises(InputError, match=r"mounting: has Wobble: contact is located on ideal axes only"):
        pair.with_mounting(Wobble("drive", 1e-4)).compiled()
    sloped = Gear(3.5e-3, 90, face_width=20e-3, helix_slope=5e-6)
    with pytest.raises(InputError, match=r"drive.helix_slope: is 5 um: contact is located on spur teeth only"):
        Pair.from_backlash(sloped, pair.loose, 1e-4).compiled()
    with pytest.raises(InputError, match=r"out_of_plane: is 2.865 deg \(give -1.15 to 1.15 deg\)"):
        Misalignment(out_of_plane=0.05)


WAVES = [
    ProfileWave("loose", "active", 2e-6, 2.0),
    ProfileWave("loose", "reverse", 2e-6, 2.0, 1.0),
    ProfileWave("drive", "active", 1.5e-6, 1.5, 0.7),
    ProfileSlope("drive", "active", -4e-6),
]
SHARP = Relief(15e-6, length=2e-3, shape="linear")


@pytest.mark.slow
@pytest.mark.parametrize("deviations", [WAVES[:2], WAVES, [*WAVES, HarmonicDeviation("drive", "active", 19, 2e-6)]])
@pytest.mark.parametrize(("relief", "crowning"), [(None, 0.0), (SHARP, 5e-6)])
def test_the_least_of_several_minima_is_found(deviations, relief, crowning):
    """Crests of waves compete along the face, with each other and with corners of reliefs."""
    pair = helical(relief=relief, drive={"helix_slope": 6e-6}, lead_crowning=crowning).with_deviations(*deviations)
    surfaces, seen = compile_surfaces(pair), 0
    heights = np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, 1501)
    for theta in np.linspace(0.0, 2.0 * np.pi / pair.drive.teeth, 9):
        theta_loose = (20e-6 + pair.drive.base_radius * theta) / pair.loose.base_radius
        for flank in (ACTIVE, REVERSE):
            for teeth in mates(surfaces, theta, theta_loose, flank).tolist():
                gaps = [section_gap(surfaces, theta, theta_loose, *teeth, flank, z)[0] for z in heights]
                if min(gaps) < 60e-6:
                    seen += 1
                    found = surface_gap(surfaces, theta, theta_loose, *teeth, flank)[0]
                    assert min(gaps) - 5e-9 < found < min(gaps) + 1e-15
    assert seen >= 20
