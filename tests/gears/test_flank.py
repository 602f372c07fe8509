"""The flanks themselves: involutes, gaps over the mesh, imposed deviations."""

from math import acos, atan2, cos, hypot, pi, radians, sin

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gears3d.errors import InputError
from gears3d.gears import (
    ACTIVE,
    REVERSE,
    Gear,
    HarmonicDeviation,
    Pair,
    ToothDeviation,
    candidates,
    flank_gap,
    flank_point,
    flank_points,
    gap_at,
    inv,
    nearest_gap,
    steepest,
)

RIG = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
PAIR = Pair.from_backlash(RIG, RIG, 250e-6)
UNEQUAL = Pair.from_backlash(Gear(2e-3, 23, profile_shift=0.3), Gear(2e-3, 40), 120e-6)


def angles(pair, theta_drive, s):
    """Angle of the loose gear at displacement s."""
    return (s + pair.drive.base_radius * theta_drive) / pair.loose.base_radius


@st.composite
def pairs(draw):
    module = draw(st.floats(0.5e-3, 8e-3))
    teeth = draw(st.tuples(st.integers(12, 130), st.integers(12, 130)))
    shift = draw(st.tuples(st.floats(-0.3, 0.7), st.floats(-0.3, 0.7)))
    alpha, addendum = radians(draw(st.floats(17, 25))), draw(st.floats(0.7, 1.25))
    rest = {"addendum": addendum, "dedendum": addendum + 0.25}
    try:
        gears = [Gear(module, z, alpha, profile_shift=x, **rest) for z, x in zip(teeth, shift, strict=True)]
        return Pair.from_backlash(*gears, draw(st.floats(0.0, 0.05)) * module)
    except InputError:
        assume(False)


@settings(max_examples=200, deadline=None)
@given(pairs(), st.floats(-40, 40), st.floats(0, 1), st.sampled_from([ACTIVE, REVERSE]))
def test_gap_is_the_rest_of_the_dead_band_for_any_pair_at_any_angle(pair, theta, part, flank):
    """Constant ratio and the backlash that was asked for, from surfaces and centre distance alone."""
    s = part * pair.backlash
    theta_loose = angles(pair, theta, s)
    expected = s if flank == ACTIVE else pair.backlash - s
    sign = 1.0 if flank == ACTIVE else -1.0
    touching = candidates(pair.compiled(), theta, theta_loose, flank)
    assert int(pair.contact_ratio) <= len(touching) <= int(pair.contact_ratio) + 1
    for drive, loose in touching:
        gap, by_drive, by_loose, _, _, nx, ny, valid = flank_gap(
            pair.compiled(), theta, theta_loose, drive, loose, flank
        )
        assert gap == pytest.approx(expected, abs=1e-12)
        assert by_drive == pytest.approx(-sign * pair.drive.base_radius, rel=1e-12)
        assert by_loose == pytest.approx(sign * pair.loose.base_radius, rel=1e-12)
        assert (nx, ny) == pytest.approx(
            (sin(pair.working_pressure_angle), sign * cos(pair.working_pressure_angle)), abs=1e-12
        )
        assert valid


def test_tooth_numbers_count_in_order_of_meshing():
    flanks = UNEQUAL.compiled()
    z1, z2 = 23, 40
    for turn in range(60):
        theta = 2 * pi * turn / z1
        numbers = candidates(flanks, theta, angles(UNEQUAL, theta, 1e-6), ACTIVE).tolist()
        assert [turn % z1 + 1, turn % z2 + 1] in numbers
        numbers = candidates(flanks, theta, angles(UNEQUAL, theta, 1e-6), REVERSE).tolist()
        assert [turn % z1 + 1, (turn + 1) % z2 + 1] in numbers


def test_start_is_the_pitch_point_with_the_loose_gear_ahead_for_positive_s():
    gap, _, _, x, y, _, _, _ = flank_gap(UNEQUAL.compiled(), 0.0, 0.0, 1, 1, ACTIVE)
    pitch_radius = UNEQUAL.drive.base_radius / cos(UNEQUAL.working_pressure_angle)
    assert (gap, x, y) == pytest.approx((0.0, pitch_radius, 0.0), abs=1e-15)
    assert flank_gap(UNEQUAL.compiled(), 0.0, 1e-4, 1, 1, ACTIVE)[0] > 0
    assert flank_gap(UNEQUAL.compiled(), 1e-4, 0.0, 1, 1, ACTIVE)[0] < 0


@pytest.mark.parametrize("flank", [ACTIVE, REVERSE])
@pytest.mark.parametrize("which", ["drive", "loose"])
@pytest.mark.parametrize("tooth", [1, 7])
def test_flank_points_lie_on_the_involute(which, flank, tooth):
    """Polar angle of an involute is inv(acos(rb/r)) from its start; textbook form, not the support function."""
    gear, number = UNEQUAL.gear(which), ["drive", "loose"].index(which)
    sense = 1 if which == "drive" else -1
    half = UNEQUAL.half_angle(which)
    middle = inv(UNEQUAL.working_pressure_angle) - half - sense * 2 * pi * (tooth - 1) / gear.teeth
    rolls = np.linspace(0.05, gear.tip_roll, 50)
    points, normals = flank_points(UNEQUAL.compiled(), number, flank, tooth, rolls)
    for (x, y), normal in zip(points, normals, strict=True):
        radius = hypot(x, y)
        side = 1 if flank == ACTIVE else -1
        polar = middle + side * (half - inv(acos(gear.base_radius / radius)))
        assert radius * ((atan2(y, x) - polar + pi) % (2 * pi) - pi) == pytest.approx(0.0, abs=1e-12)
        tangent_to_base = abs(x * normal[1] - y * normal[0])
        assert tangent_to_base == pytest.approx((radius**2 - gear.base_radius**2) ** 0.5, abs=1e-12) or (
            abs(x * normal[0] + y * normal[1]) == pytest.approx((radius**2 - gear.base_radius**2) ** 0.5, abs=1e-12)
        )
    assert hypot(*points[-1]) == pytest.approx(gear.tip_radius, abs=1e-15)


def test_derivative_by_roll_and_normal_are_those_of_the_deviated_flank():
    flanks = PAIR.with_deviations(HarmonicDeviation("drive", "reverse", 90, 5e-6, 0.3)).compiled()
    step = 1e-6
    for roll in np.linspace(0.3, 0.43, 9):
        here = flank_point(flanks, 0, REVERSE, 4, roll)
        before, after = (flank_point(flanks, 0, REVERSE, 4, roll + d) for d in (-step, step))
        numeric = (np.array(after[:2]) - before[:2]) / (2 * step)
        assert numeric == pytest.approx(np.array(here[4:]), rel=1e-6, abs=1e-9)
        assert numeric @ here[2:4] == pytest.approx(0.0, abs=1e-9)


def brute_gap(pair, theta_drive, theta_loose, teeth, flank, centre):
    """Smallest distance of two flanks, searched point against point on ever finer grids."""
    flanks = pair.compiled()

    def curve(number, theta, rolls):
        points = flank_points(flanks, number, flank, teeth[number], rolls)[0]
        turn = pair.rotation(("drive", "loose")[number], theta)
        rotation = np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
        return points @ rotation.T + np.array(centre if number else (0.0, 0.0))

    middle, width, least = np.array([0.35, 0.35]), 0.1, np.inf
    for _ in range(8):
        rolls = [np.linspace(m - width, m + width, 401) for m in middle]
        a, b = curve(0, theta_drive, rolls[0]), curve(1, theta_loose, rolls[1])
        distances = np.hypot(*(a[:, None] - b[None]).T).T
        i, j = np.unravel_index(np.argmin(distances), distances.shape)
        middle, width, least = np.array([rolls[0][i], rolls[1][j]]), width / 10, distances[i, j]
    return least


@pytest.mark.parametrize("deviation", [None, HarmonicDeviation("drive", "active", 90, 5e-6, 1.0)])
@pytest.mark.parametrize("centre", [None, (0.31548, 0.0), (0.31536, 3e-4)])
def test_gap_is_the_distance_of_the_curves(deviation, centre):
    """Whatever the pose, wrong centre distance and displaced axis included."""
    pair = PAIR.with_deviations(deviation) if deviation else PAIR
    centre = centre or (pair.centre_distance, 0.0)
    theta, theta_loose = 0.004, 0.004 + 900e-6 / RIG.base_radius
    gap = gap_at(pair.compiled(), *centre, theta, pi - theta_loose, 1, 1, ACTIVE)[0]
    assert gap == pytest.approx(brute_gap(pair, theta, theta_loose, (1, 1), ACTIVE, centre), abs=1e-13)


def test_wrong_centre_distance_shows_in_the_gap():
    """Opening the axes by d opens the flanks by the change of the involute relation, not by nothing."""
    wider = PAIR.centre_distance + 50e-6
    total = sum(
        gap_at(PAIR.compiled(), wider, 0.0, 0.0, pi, *teeth, flank)[0]
        for teeth, flank in (((1, 1), ACTIVE), ((1, 2), REVERSE))
    )
    assert total == pytest.approx(Pair.from_centre_distance(RIG, RIG, wider).backlash, abs=1e-12)


def imposed(terms, theta):
    return sum(a * cos(n * theta + p) for n, a, p in terms)


@pytest.mark.parametrize(
    "terms", [[(1, 50e-6, 0.7)], [(90, 5e-6, 0.2)], [(1, 50e-6, 0.7), (3, -9e-6, 0), (90, 5e-6, 2)]]
)
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("flank", ["active", "reverse"])
@pytest.mark.parametrize("which", ["drive", "loose"])
def test_flanks_touch_at_the_imposed_deviation_exactly(which, flank, sign, terms):
    """At s = φ(own angle) the gap of every pair of teeth in contact vanishes; well below the 1 nm that is promised."""
    terms = [(order, sign * amplitude, phase) for order, amplitude, phase in terms]
    pair = PAIR.with_deviations(*[HarmonicDeviation(which, flank, *term) for term in terms])
    flanks, number = pair.compiled(), ["active", "reverse"].index(flank)
    for theta in np.linspace(-7, 7, 151):
        s = imposed(terms, theta) if flank == "active" else pair.backlash - imposed(terms, theta)
        theta_loose = angles(pair, theta, s) if which == "drive" else theta
        theta_drive = theta if which == "drive" else theta - s / RIG.base_radius
        for drive, loose in candidates(flanks, theta_drive, theta_loose, number):
            assert flank_gap(flanks, theta_drive, theta_loose, drive, loose, number)[0] == pytest.approx(0, abs=1e-13)
        other = nearest_gap(flanks, theta_drive, theta_loose, 1 - number)[2]
        assert other == pytest.approx(pair.backlash - s if flank == "active" else s, abs=1e-13)


@settings(max_examples=80, deadline=None)
@given(pairs(), st.data())
def test_any_regular_deviation_is_imposed_exactly(pair, data):
    """Up to 95 % of the steepest admissible flank, on either gear and side of any pair."""
    which = data.draw(st.sampled_from(["drive", "loose"]))
    flank = data.draw(st.sampled_from([ACTIVE, REVERSE]))
    order = data.draw(st.integers(0, 2 * pair.gear(which).teeth))
    most = min(0.95 * steepest(pair, which) / max(order, 1) ** 2, 1e-3)
    amplitude, phase = data.draw(st.floats(-1, 1)) * most, data.draw(st.floats(0, 6))
    side = ("active", "reverse")[flank]
    try:
        flanks = pair.with_deviations(HarmonicDeviation(which, side, order, amplitude, phase)).compiled()
    except InputError as error:
        assert "jam" in str(error)  # noqa: PT017
        assume(False)
    for theta in np.linspace(-3, 3, 13):
        phi = amplitude * cos(order * theta + phase)
        s = phi if flank == ACTIVE else pair.backlash - phi
        theta_loose = angles(pair, theta, s) if which == "drive" else theta
        theta_drive = theta if which == "drive" else (pair.loose.base_radius * theta - s) / pair.drive.base_radius
        for drive, loose in candidates(flanks, theta_drive, theta_loose, flank):
            assert flank_gap(flanks, theta_drive, theta_loose, drive, loose, flank)[0] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("which", ["drive", "loose"])
@pytest.mark.parametrize("flank", [ACTIVE, REVERSE])
def test_orders_of_many_phases_are_imposed_exactly_though_they_would_be_too_steep_in_phase(which, flank):
    pinion = Gear(6e-3, 18, profile_shift=0.3)
    pair = Pair.from_backlash(pinion, pinion, 1.6e-3)
    orders, side = (18, 36, 54, 72, 90), ("active", "reverse")[flank]
    sizes = [0.25 * steepest(pair, which) / order**2 for order in orders]
    phases = (0.0, 0.7, 2.1, 3.9, 5.0)

    def waves(times):
        each = zip(orders, [times * size for size in sizes], phases, strict=True)
        return [HarmonicDeviation(which, side, *wave) for wave in each]

    with pytest.raises(InputError, match=r"no regular flank"):
        pair.with_deviations(*waves(4.0))
    flanks = pair.with_deviations(*waves(1.0)).compiled()
    for theta in np.linspace(-0.4, 0.4, 41):
        phi = sum(a * cos(n * theta + p) for n, a, p in zip(orders, sizes, phases, strict=True))
        s = phi if flank == ACTIVE else pair.backlash - phi
        theta_loose = angles(pair, theta, s) if which == "drive" else theta
        theta_drive = theta if which == "drive" else (pair.loose.base_radius * theta - s) / pair.drive.base_radius
        meet = candidates(flanks, theta_drive, theta_loose, flank)
        gaps = [flank_gap(flanks, theta_drive, theta_loose, *teeth, flank)[0] for teeth in meet]
        assert gaps == pytest.approx([0.0] * len(gaps), abs=1e-12)


def test_added_material_at_fixed_normal_would_miss_the_imposed_deviation():
    """δ differs from φ by φ'²/(2·centre distance·sin(working pressure angle)): about 0.9 µm at order 90, 5 µm."""
    flanks = PAIR.with_deviations(HarmonicDeviation("drive", "active", 90, 5e-6, -pi / 2)).compiled()
    from gears3d.gears.flank import deviation

    added = deviation(flanks, 0, ACTIVE, 1, pi / 2 - PAIR.working_pressure_angle)[0]
    assert added == pytest.approx((90 * 5e-6) ** 2 / (2 * PAIR.path_length), rel=0.05)


def test_deviations_of_both_gears_add_up_to_a_known_rest():
    """Each flank is made for a perfect mate; together they touch off φ1 + φ2 by −φ1'·φ2'/(a·sin α_w)."""
    terms = HarmonicDeviation("drive", "active", 1, 50e-6, 0.3), HarmonicDeviation("loose", "active", 1, 40e-6, 1.3)
    flanks, rests = PAIR.with_deviations(*terms).compiled(), []
    for theta in np.linspace(0, 6, 40):
        theta_loose = theta
        for _ in range(5):
            s = 50e-6 * cos(theta + 0.3) + 40e-6 * cos(theta_loose + 1.3)
            theta_loose = theta + s / RIG.base_radius
        gap = nearest_gap(flanks, theta, theta_loose, ACTIVE)[2]
        rests.append((gap, -50e-6 * sin(theta + 0.3) * 40e-6 * sin(theta_loose + 1.3) / PAIR.path_length))
    rests = np.array(rests)
    assert np.abs(rests[:, 0]).max() < 20e-9
    assert rests[:, 0] == pytest.approx(rests[:, 1], abs=5e-11)


def test_derivatives_of_the_gap_on_deviated_flanks():
    flanks = PAIR.with_deviations(HarmonicDeviation("drive", "active", 90, 5e-6, 0.1)).compiled()
    step = 1e-7
    for theta in np.linspace(0, 0.07, 6):
        drive, loose = candidates(flanks, theta, theta, ACTIVE)[0]
        here = flank_gap(flanks, theta, theta, drive, loose, ACTIVE)
        by_drive = flank_gap(flanks, theta + step, theta, drive, loose, ACTIVE)[0] - here[0]
        by_loose = flank_gap(flanks, theta, theta + step, drive, loose, ACTIVE)[0] - here[0]
        assert (by_drive / step, by_loose / step) == pytest.approx(here[1:3], rel=2e-5)


@pytest.mark.parametrize(("which", "flank", "tooth"), [("drive", "active", 12), ("loose", "reverse", 12)])
def test_a_thick_tooth_shows_exactly_where_it_touches(which, flank, tooth):
    pair = PAIR.with_deviations(ToothDeviation(which, flank, tooth, 20e-6))
    number, seen = ["active", "reverse"].index(flank), set()
    for theta in np.linspace(0, 2 * pi, 500):
        theta_loose = angles(pair, theta, 100e-6)
        for drive, loose in candidates(pair.compiled(), theta, theta_loose, number):
            perfect = flank_gap(PAIR.compiled(), theta, theta_loose, drive, loose, number)[0]
            change = perfect - flank_gap(pair.compiled(), theta, theta_loose, drive, loose, number)[0]
            thick = (drive if which == "drive" else loose) == tooth
            seen.add(thick)
            assert change == pytest.approx(20e-6 if thick else 0.0, abs=1e-15)
    assert seen == {True, False}


def test_beyond_the_tip_is_flagged():
    flanks = PAIR.compiled()
    theta = 1.2 * 2 * pi / 90
    assert not flank_gap(flanks, theta, theta, 1, 1, ACTIVE)[-1]
    assert flank_gap(flanks, 0.0, 0.0, 1, 1, ACTIVE)[-1]


def test_helical_contact_is_refused():
    gear = Gear(2e-3, 40, helix_angle=0.3)
    with pytest.raises(InputError, match=r"helix_angle: is 17.1887 deg: contact is located on spur teeth only"):
        Pair.from_backlash(gear, gear, 1e-4).compiled()
