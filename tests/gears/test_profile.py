"""Profile and helix deviations of flanks: points, supports, gaps, rolling and solids against closed forms."""

from dataclasses import replace
from math import atan2, cos, hypot, pi, radians, sin

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from gears3d.errors import InputError
from gears3d.gears import (
    ACTIVE,
    REVERSE,
    Gear,
    HarmonicDeviation,
    HelixSlope,
    Pair,
    ProfileSlope,
    ProfileWave,
    Relief,
    candidates,
    compile_surfaces,
    flank_gap,
    flank_point,
    flank_points,
    gap_at,
    piece_budget,
    pieces,
    quasi_static,
    roll_at_radius,
    solid,
    solid_arrays,
    surface_gap,
    surface_point,
)
from gears3d.gears.flank import support
from gears3d.gears.outline import outline

RIG = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
PAIR = Pair.from_backlash(RIG, RIG, 250e-6)
UNEQUAL = Pair.from_backlash(Gear(2e-3, 23, profile_shift=0.3), Gear(2e-3, 40), 120e-6)
HELICAL = Pair.from_backlash(*[Gear(2.75e-3, z, helix_angle=radians(28), face_width=16e-3) for z in (17, 43)], 120e-6)
NAMES, SIDES = ("drive", "loose"), ("active", "reverse")


def both(gear, flank, scale=1.0, tooth=None):
    """A slope and two waves on one flank of one gear."""
    return (
        ProfileSlope(gear, flank, 8e-6 * scale, tooth),
        ProfileWave(gear, flank, 0.6e-6 * scale, 2.5, 0.4, tooth),
        ProfileWave(gear, flank, -0.3e-6 * scale, 1.0, 1.0, tooth),
    )


def material(pair, deviations, roll):
    """By definition: over the roll angle from the start of the active profile (0) to the tip (1)."""
    which = deviations[0].gear
    start = pair.start_roll(which)
    x = (roll - start) / (pair.gear(which).tip_roll - start)
    total = np.zeros_like(x)
    for each in deviations:
        if isinstance(each, ProfileSlope):
            total = total + each.amount * (x - 0.5)
        else:
            total = total + each.amplitude * np.cos(2 * pi * each.waves * x + each.phase)
    return total


@pytest.mark.parametrize("flank", [ACTIVE, REVERSE])
@pytest.mark.parametrize("number", [0, 1])
def test_points_stand_off_the_involute_by_the_material(number, flank):
    which, side = NAMES[number], SIDES[flank]
    deviations = both(which, side)
    there, here = (pair.compiled() for pair in (UNEQUAL, UNEQUAL.with_deviations(*deviations)))
    for roll in np.linspace(UNEQUAL.start_roll(which), UNEQUAL.gear(which).tip_roll, 41):
        x, y, nx, ny, _, _ = flank_point(there, number, flank, 5, roll)
        point = flank_point(here, number, flank, 5, roll)
        off = np.array(point[:2]) - (x, y)
        assert off @ (nx, ny) == pytest.approx(material(UNEQUAL, deviations, roll), abs=1e-17)
        assert off @ (-ny, nx) == pytest.approx(0.0, abs=1e-17)
        untouched = flank_point(here, number, 1 - flank, 5, roll)
        assert untouched == flank_point(there, number, 1 - flank, 5, roll)


SHAPES = [
    (UNEQUAL, ()),
    (UNEQUAL, (HarmonicDeviation("drive", "active", 23, 1e-6, 0.3), HarmonicDeviation("loose", "reverse", 2, 9e-6))),
    (
        Pair.from_backlash(
            *[
                Gear(3.5e-3, z, tip_relief=Relief(12e-6, length=2e-3), root_relief=Relief(8e-6, length=1.5e-3))
                for z in (40, 51)
            ],
            120e-6,
        ),
        (),
    ),
    (
        Pair.from_backlash(
            *[Gear(3.5e-3, z, tip_relief=Relief(12e-6, length=3e-3, shape="parabolic")) for z in (40, 51)], 120e-6
        ),
        (),
    ),
]


@pytest.mark.parametrize(("pair", "more"), SHAPES)
@pytest.mark.parametrize("flank", [ACTIVE, REVERSE])
@pytest.mark.parametrize("number", [0, 1])
def test_derivatives_normals_and_supports_are_those_of_the_points(pair, more, number, flank):
    """Points by differences; h(u) is the largest projection of the points, h' and h'' are its derivatives."""
    which = NAMES[number]
    flanks = pair.with_deviations(*both(which, SIDES[flank]), *more).compiled()
    first, last = pair.start_roll(which), pair.gear(which).tip_roll
    step, side = 1e-6, 1 - 2 * flank
    dense = flank_points(flanks, number, flank, 3, np.linspace(first - 0.02, last + 0.02, 40001))[0]
    for roll in np.linspace(first + 0.011, last - 0.011, 23):
        here = flank_point(flanks, number, flank, 3, roll)
        ends = [np.array(flank_point(flanks, number, flank, 3, roll + d)[:2]) for d in (-step, step)]
        numeric = (ends[1] - ends[0]) / (2 * step)
        assert numeric == pytest.approx(np.array(here[4:]), rel=1e-6, abs=1e-8)
        assert numeric @ here[2:4] == pytest.approx(0.0, abs=1e-8)
        u = atan2(here[3], here[2])
        h, s, c = support(flanks, number, flank, 3, u)
        assert h == pytest.approx(here[0] * cos(u) + here[1] * sin(u), abs=1e-15)
        assert s == pytest.approx(here[1] * cos(u) - here[0] * sin(u), abs=1e-13)
        assert h == pytest.approx((dense @ [cos(u), sin(u)]).max(), abs=2e-11)
        turn = 1e-6
        after, before = (support(flanks, number, flank, 3, u + d) for d in (turn, -turn))
        assert (after[0] - before[0]) / (2 * turn) == pytest.approx(s, abs=1e-8)
        if not more:
            assert (after[1] - before[1]) / (2 * turn) == pytest.approx(c, rel=2e-3, abs=1e-6)
        assert side * (after[1] - before[1]) / (2 * turn) * side + h > 0.0  # convex


def test_a_positive_slope_is_a_larger_base_circle_and_a_smaller_pressure_angle():
    """The normal of the flank passes the axis at the base radius: it grows by the slope, f_Hα over the roll angle."""
    for number, which in enumerate(NAMES):
        gear = UNEQUAL.gear(which)
        flanks = UNEQUAL.with_deviations(ProfileSlope(which, "active", 10e-6)).compiled()
        expected = 10e-6 / (gear.tip_roll - UNEQUAL.start_roll(which))
        for roll in (0.3, 0.4, 0.5):
            _, _, nx, ny, _, _ = flank_point(flanks, number, ACTIVE, 1, roll)
            base = abs(support(flanks, number, ACTIVE, 1, atan2(ny, nx))[1])
            assert base - gear.base_radius == pytest.approx(expected, rel=0.02)


def brute_gap(pair, theta_drive, theta_loose, teeth, flank):
    """Smallest distance of two flanks, searched point against point on ever finer grids."""
    flanks = pair.compiled()

    def curve(number, theta, rolls):
        points = flank_points(flanks, number, flank, teeth[number], rolls)[0]
        turn = pair.rotation(NAMES[number], theta)
        rotation = np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
        return points @ rotation.T + np.array(pair.centre(NAMES[number])[:2])

    ends = [(pair.start_roll(which), pair.gear(which).tip_roll) for which in NAMES]
    middle, width = np.array([0.5 * sum(e) for e in ends]), np.array([0.5 * (e[1] - e[0]) for e in ends])
    for _ in range(9):
        rolls = [np.linspace(m - w, m + w, 401) for m, w in zip(middle, width, strict=True)]
        a, b = curve(0, theta_drive, rolls[0]), curve(1, theta_loose, rolls[1])
        distances = np.hypot(*(a[:, None] - b[None]).T).T
        i, j = np.unravel_index(np.argmin(distances), distances.shape)
        middle, width, least = np.array([rolls[0][i], rolls[1][j]]), width / 8, distances[i, j]
    return least


@pytest.mark.parametrize("flank", [ACTIVE, REVERSE])
def test_gap_of_deviating_profiles_is_the_distance_of_the_curves(flank):
    """On both gears at once, both contacts of the path, to a picometre."""
    pair = UNEQUAL.with_deviations(*both("drive", SIDES[flank]), *both("loose", SIDES[flank], -0.7))
    for theta in np.linspace(-0.08, 0.1, 6):
        theta_loose = (60e-6 + pair.drive.base_radius * theta) / pair.loose.base_radius
        for teeth in candidates(pair.compiled(), theta, theta_loose, flank).tolist():
            found = flank_gap(pair.compiled(), theta, theta_loose, *teeth, flank)
            if found[-1]:
                assert found[0] == pytest.approx(brute_gap(pair, theta, theta_loose, teeth, flank), abs=1e-12)
            step = 1e-7
            by_drive, by_loose = (
                flank_gap(pair.compiled(), theta + a, theta_loose + b, *teeth, flank)[0] - found[0]
                for a, b in ((step, 0.0), (0.0, step))
            )
            assert (by_drive / step, by_loose / step) == pytest.approx(found[1:3], rel=1e-4)


@pytest.mark.parametrize("pair", [PAIR, UNEQUAL])
@pytest.mark.parametrize("which", NAMES)
def test_rolling_shows_the_thickest_profile_in_contact(pair, which):
    """φ is the material at the contact's roll angle, of the pair of teeth with most; the rest is of second order."""
    rests = []
    for scale in (1.0, 0.5):
        deviations = both(which, "active", scale)
        found = quasi_static(pair.with_deviations(*deviations), np.linspace(0.0, 6 * pi / pair.drive.teeth, 121))
        gear, number = pair.gear(which), NAMES.index(which)
        worst = 0.0
        for theta, phi in zip(found.theta, found.phi_active, strict=True):
            loose = (phi + pair.drive.base_radius * theta) / pair.loose.base_radius
            own = theta if which == "drive" else -loose
            pitch = 2 * pi / gear.teeth * (1 - 2 * number)
            rolls = np.tan(pair.working_pressure_angle) + own - pitch * np.arange(-9, 10)
            inside = (rolls > pair.start_roll(which)) & (rolls < gear.tip_roll)
            edge = min(np.abs(rolls - pair.start_roll(which)).min(), np.abs(rolls - gear.tip_roll).min())
            if edge > 0.02:
                worst = max(worst, abs(phi - material(pair, deviations, rolls[inside]).max()))
        rests.append(worst)
        assert found.phi_reverse == pytest.approx(np.zeros(121), abs=1e-14)
    rise = (8e-6 + 2 * pi * (2.5 * 0.6e-6 + 0.3e-6)) / (gear.tip_roll - pair.start_roll(which))
    assert 0 < rests[0] < rise**2 / pair.path_length
    assert rests[0] / rests[1] == pytest.approx(4.0, rel=0.1)


def test_a_sloped_profile_shifts_the_ratio_of_one_mesh():
    """On a flank of base radius r1 + σ, σ = f_Hα / roll, one pair of teeth turns at (r1 + σ) / r2: dφ/dθ = σ."""
    sigma = 6e-6 / (PAIR.drive.tip_roll - PAIR.start_roll("drive"))
    pair = PAIR.with_deviations(ProfileSlope("drive", "active", 6e-6))
    theta = np.linspace(0.0, 0.08 * 2 * pi / 90, 9)  # tooth 1 near the pitch point; tooth 90 in front of it carries
    found = quasi_static(pair, theta)
    assert len(np.unique(found.teeth[:, 0])) == 1
    rate = np.gradient(found.phi_active, theta)
    assert rate == pytest.approx(np.full(9, sigma), rel=2e-3)


def test_nothing_deviating_changes_nothing():
    zero = (
        ProfileSlope("drive", "active", 0.0),
        ProfileWave("loose", "reverse", 0.0, 3.0),
        HelixSlope("loose", "active", 0.0),
    )
    for pair in (UNEQUAL, HELICAL):
        still = pair.with_deviations(*zero)
        a, b = compile_surfaces(pair), compile_surfaces(still)
        for theta in np.linspace(-0.3, 0.3, 9):
            theta_loose = (60e-6 + pair.drive.base_radius * theta) / pair.loose.base_radius
            for flank in (ACTIVE, REVERSE):
                here, there = (surface_gap(s, theta, theta_loose, 1, 1 + flank, flank) for s in (a, b))
                if np.isfinite(here[0]):
                    assert there[0] == pytest.approx(here[0], abs=1e-16)
        for which in NAMES:
            assert np.abs(solid(still, which).vertices - solid(pair, which).vertices).max() < 1e-16


@pytest.mark.parametrize("which", NAMES)
@pytest.mark.parametrize("flank", SIDES)
def test_a_single_tooth_has_its_own_profile(which, flank):
    """Section area grows by ∫ material × radius of curvature d(roll) of that tooth, in first order; no other moves."""
    deviations = both(which, flank, 0.1, tooth=4)
    before, after = (outline(p, which, 0.02e-6).points for p in (UNEQUAL, UNEQUAL.with_deviations(*deviations)))
    sense = 1 if which == "drive" else -1
    place = -sense * 3 % UNEQUAL.gear(which).teeth
    pair, gear = UNEQUAL.with_deviations(*deviations), UNEQUAL.gear(which)
    flanks, number, side = pair.compiled(), NAMES.index(which), SIDES.index(flank)
    last = roll_at_radius(flanks, number, side, 4, gear.tip_radius)
    rolls = np.linspace(UNEQUAL.start_roll(which), last, 2001)
    a, b = flank_points(UNEQUAL.compiled(), number, side, 4, rolls)[0], flank_points(flanks, number, side, 4, rolls)[0]
    ring = np.vstack([b, a[::-1]])
    x, y = ring.T
    gained = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    grown = material(UNEQUAL, deviations, rolls) * gear.base_radius * rolls
    middle = 0.5 * (grown[1:] + grown[:-1])
    assert abs(gained) == pytest.approx(abs(np.sum(middle * np.diff(rolls))), rel=2e-3)
    ring = after.shape[1]
    others = [k for k in range(gear.teeth) if k != place]
    assert ring >= before.shape[1]
    same = outline(UNEQUAL.with_deviations(*both(which, flank, 0.1, tooth=5)), which, 0.02e-6).points
    unmoved = [k for k in others if k != -sense * 4 % gear.teeth]
    assert np.abs(after[unmoved] - same[unmoved]).max() < 1e-16
    assert np.abs(after[place] - same[place]).max() > 0.2e-6


@pytest.mark.parametrize("which", NAMES)
@pytest.mark.parametrize("pair", [UNEQUAL, HELICAL])
def test_solids_are_closed_and_their_flanks_are_the_surfaces(which, pair):
    """Every vertex of the tip corners at both ends and the middle is a point of the surface; so are the drawn ones."""
    deviations = [*both(which, "active", 1.0, 3), ProfileSlope(which, "reverse", -5e-6)]
    deviations += [HelixSlope(which, "active", 14e-6), HelixSlope(which, "reverse", 9e-6, tooth=3)]
    pair = pair.with_deviations(*deviations)
    surfaces, number, gear = compile_surfaces(pair), NAMES.index(which), pair.gear(which)
    body, drawn = solid(pair, which, 1e-6), solid_arrays(pair, which, 1e-6)[0]
    assert body.is_volume
    assert body.body_count == 1
    for vertices in (np.asarray(body.vertices), drawn):
        for z in (-0.5 * gear.face_width, 0.5 * gear.face_width):
            ring = vertices[np.abs(vertices[:, 2] - z) < 1e-12]
            for tooth in (2, 3, 4):
                for flank in (ACTIVE, REVERSE):
                    roll = roll_at_radius(surfaces.shape.flanks, number, flank, tooth, gear.tip_radius)
                    corner = surface_point(surfaces, number, flank, tooth, roll, z)[0]
                    assert np.linalg.norm(ring - corner, axis=1).min() < 1e-12
                    inner = surface_point(surfaces, number, flank, tooth, 0.7 * roll, z)[0]
                    chain = ring[np.linalg.norm(ring - inner, axis=1) < 0.6e-3]
                    normal = surface_point(surfaces, number, flank, tooth, 0.7 * roll, z)[1]
                    assert np.abs((chain - inner) @ normal).min() < 1e-6


@pytest.mark.parametrize("pair", [PAIR, HELICAL])
def test_helix_slopes_of_both_flanks_are_that_of_the_gear(pair):
    """As much on the active as off the reverse flank turns whole teeth: the same gaps and the same solid."""
    amount = 12e-6
    one = pair.with_deviations(HelixSlope("drive", "active", amount), HelixSlope("drive", "reverse", -amount))
    other = replace(pair, drive=replace(pair.drive, helix_slope=amount))
    a, b = compile_surfaces(one), compile_surfaces(other)
    for theta in np.linspace(-0.02, 0.02, 7):
        theta_loose = (60e-6 + pair.drive.base_radius * theta) / pair.loose.base_radius
        for flank in (ACTIVE, REVERSE):
            here, there = (surface_gap(s, theta, theta_loose, 1, 1 + flank, flank) for s in (a, b))
            assert here[0] == pytest.approx(there[0], abs=1e-15)
            assert here[-1] == pytest.approx(there[-1], abs=1e-9)
    first, second = (np.asarray(solid(p, "drive", 1e-6).vertices) for p in (one, other))
    if first.shape == second.shape:
        moved = np.linalg.norm(first - second, axis=1)
        on_teeth = np.hypot(*first[:, :2].T) > pair.drive.base_radius * hypot(1.0, 0.3)
        assert moved[on_teeth].max() < 1e-12


def test_a_sloped_helix_touches_at_its_thick_end():
    """Half the slope at the end of the face; of one tooth while that touches, on the reverse flank alone."""
    found = quasi_static(PAIR.with_deviations(HelixSlope("drive", "active", 10e-6)), np.linspace(0, 0.2, 9))
    assert found.phi_active == pytest.approx(np.full(9, 5e-6), abs=1e-15)
    assert found.heights[:, 0] == pytest.approx(np.full(9, 3.75e-3), abs=1e-9)
    assert found.phi_reverse == pytest.approx(np.zeros(9), abs=1e-15)
    single = PAIR.with_deviations(HelixSlope("loose", "reverse", -10e-6, tooth=7))
    found = quasi_static(single, np.linspace(0, 2 * pi, 90 * 8, endpoint=False))
    assert found.phi_active == pytest.approx(np.zeros(720), abs=1e-15)
    pushed = np.abs(found.phi_reverse + 5e-6) < 1e-13
    assert pushed.sum() == pytest.approx(8 * PAIR.contact_ratio, abs=1)
    assert (found.teeth[pushed, 3] == 7).all()
    assert found.heights[pushed, 1] == pytest.approx(np.full(pushed.sum(), -3.75e-3), abs=1e-9)


def test_hulls_of_deviating_profiles_stay_convex_within_their_budget():
    pair = PAIR.with_deviations(*both("drive", "active"), HelixSlope("drive", "reverse", 6e-6))
    made = pieces(pair, "drive")
    for piece in made[:3]:
        assert len(ConvexHull(piece[:48, :2]).vertices) == 48
    assert piece_budget(pair)["chord_error_m"] < 2.5 * piece_budget(PAIR)["chord_error_m"]
    ends = made[1].reshape(2, 48, 3)
    angle = np.arctan2(ends[1, :, 1], ends[1, :, 0]) - np.arctan2(ends[0, :, 1], ends[0, :, 0])
    assert angle[:24] * RIG.base_radius == pytest.approx(np.zeros(24), abs=1e-15)
    assert angle[24:] * RIG.base_radius == pytest.approx(np.full(24, -6e-6), abs=1e-12)


def test_gap_in_any_pose_keeps_to_the_deviating_curve():
    pair = PAIR.with_deviations(*both("drive", "active"))
    flanks = pair.compiled()
    perfect = gap_at(PAIR.compiled(), PAIR.centre_distance + 3e-4, 2e-4, 0.004, pi - 0.006, 1, 1, ACTIVE)
    found = gap_at(flanks, PAIR.centre_distance + 3e-4, 2e-4, 0.004, pi - 0.006, 1, 1, ACTIVE)
    turn = np.array([[cos(0.004), sin(0.004)], [-sin(0.004), cos(0.004)]])
    curve = flank_points(flanks, 0, ACTIVE, 1, np.linspace(0.29, 0.43, 20001))[0] @ turn
    reach = curve @ np.array(found[5:7])
    assert found[0] < perfect[0] + 5e-6
    assert reach.max() == pytest.approx(np.array(found[3:5]) @ found[5:7] - 0.5 * found[0], abs=1e-11)
    assert hypot(*found[5:7]) == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ProfileSlope("drive", "activ", 1e-6), r"flank: is 'activ' \(did you mean 'active'\?\)"),
        (lambda: HelixSlope("driv", "active", 1e-6), r"gear: is 'driv'"),
        (lambda: ProfileWave("drive", "active", 1e-6, 0.0), r"waves: is 0 \(give more than 0 and at most 100\)"),
        (
            lambda: PAIR.with_deviations(ProfileSlope("loose", "active", 1e-6, tooth=91)),
            r"tooth: is 91 \(the loose gear has 1 to 90\)",
        ),
        (
            lambda: PAIR.with_deviations(ProfileWave("drive", "active", 5e-6, 12.0)),
            r"drive.profile_wave: makes the active flanks hollow.*give at most 0\.\d+ of these",
        ),
        (
            lambda: PAIR.with_deviations(HelixSlope("drive", "active", 300e-6), HelixSlope("drive", "reverse", 300e-6)),
            r"backlash: is 250 um and the deviations take 300 um where they are thickest",
        ),
        (
            lambda: PAIR.with_deviations(HelixSlope("drive", "reverse", 3e-6)).compiled(),
            r"drive.helix_slope: is 3 um: contact is located on spur teeth only",
        ),
    ],
)
def test_impossible_deviations(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_the_share_that_is_named_is_regular():
    with pytest.raises(InputError) as told:
        PAIR.with_deviations(ProfileWave("drive", "active", 5e-6, 12.0))
    share = float(told.value.faults[0].remedy.split()[3])
    PAIR.with_deviations(ProfileWave("drive", "active", 0.98 * share * 5e-6, 12.0))
    with pytest.raises(InputError):
        PAIR.with_deviations(ProfileWave("drive", "active", 1.05 * share * 5e-6, 12.0))
