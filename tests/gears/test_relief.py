"""Reliefs against their own definition, and what every parameter takes off the solid."""

from math import acos, atan2, cos, hypot, pi, radians, sin

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.spatial import ConvexHull

from gears3d.errors import InputError
from gears3d.gears import (
    ACTIVE,
    REVERSE,
    Gear,
    HarmonicDeviation,
    Pair,
    Relief,
    edged,
    edged_gap,
    flank_gap,
    flank_point,
    flank_points,
    gap_at,
    inv,
    piece_budget,
    pieces,
    profile,
    roll_at_radius,
)
from gears3d.gears.flank import support
from gears3d.gears.outline import outline

TIP = {"linear": Relief(20e-6, length=6e-3), "parabolic": Relief(20e-6, length=6e-3, shape="parabolic")}
ROOT = {"linear": Relief(15e-6, length=5e-3), "parabolic": Relief(15e-6, length=5e-3, shape="parabolic")}
RIG = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
PLAIN = Pair.from_backlash(RIG, RIG, 250e-6)


def relieved(tip="linear", root="linear", **more):
    return Gear(3.5e-3, 90, face_width=7.5e-3, tip_relief=TIP.get(tip), root_relief=ROOT.get(root), **more)


def pair_of(tip="linear", root="linear"):
    gear = relieved(tip, root)
    return Pair.from_backlash(gear, gear, 250e-6)


def law(relief, start, end, roll):
    """What a relief takes off, by its definition."""
    x = max((roll - start) / (end - start), 0.0)
    return relief.amount * x ** (1 if relief.shape == "linear" else 2)


def ends(gear):
    """Roll angles at the root form circle and the tip, from the textbook: rack form point and Pythagoras."""
    alpha = gear.pressure_angle
    depth = (gear.dedendum - gear.profile_shift - gear.fillet_radius * (1 - sin(alpha))) * gear.module
    low = np.tan(alpha) - depth / (gear.base_radius * sin(alpha))
    return low, ((gear.tip_radius / gear.base_radius) ** 2 - 1) ** 0.5


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
@pytest.mark.parametrize("flank", [ACTIVE, REVERSE])
@pytest.mark.parametrize("number", [0, 1])
def test_points_lie_off_the_involute_by_the_law(shape, flank, number):
    """Along the involute's normal, that is along the tangent of the base circle."""
    flanks, gear = pair_of(shape, shape).compiled(), RIG
    low, high = ends(gear)
    for roll in np.linspace(low, high, 41):
        perfect = flank_point(PLAIN.compiled(), number, flank, 3, roll)
        x, y, *_ = flank_point(flanks, number, flank, 3, roll)
        off = law(TIP[shape], high - 6e-3 / gear.base_radius, high, roll)
        off += law(ROOT[shape], low + 5e-3 / gear.base_radius, low, roll)
        assert (perfect[0] - x, perfect[1] - y) == pytest.approx((off * perfect[2], off * perfect[3]), abs=1e-15)
    assert hypot(perfect[0] - x, perfect[1] - y) == pytest.approx(20e-6, rel=1e-12)


@pytest.mark.parametrize("tip", ["linear", "parabolic"])
@pytest.mark.parametrize("root", ["linear", "parabolic"])
@pytest.mark.parametrize("flank", [ACTIVE, REVERSE])
@pytest.mark.parametrize("wave", [False, True])
def test_support_function_is_that_of_the_points(tip, root, flank, wave):
    """h(u) is the largest projection of the points; h' and h'' are its derivatives, edges included."""
    pair = pair_of(tip, root)
    if wave:
        side = ("active", "reverse")[flank]
        pair = pair.with_deviations(HarmonicDeviation("drive", side, 90, 2e-6, 0.4))
    flanks = pair.compiled()
    low, high = ends(RIG)
    rolls = np.sort(np.r_[np.linspace(low, high, 8001), high - 6e-3 / RIG.base_radius, low + 5e-3 / RIG.base_radius])
    points, normals = flank_points(flanks, 0, flank, 2, rolls)
    angles = np.unwrap(np.arctan2(normals[:, 1], normals[:, 0]))
    first, last = sorted((angles[80], angles[-80]))
    step = 1e-6
    for u in np.linspace(first, last, 97):
        h, slope, bend = support(flanks, 0, flank, 2, u)
        along = points @ [cos(u), sin(u)]
        assert h == pytest.approx(along.max(), abs=5e-12)
        assert h >= along.max() - (3e-12 if wave else 1e-15)
        before, after = (support(flanks, 0, flank, 2, u + d) for d in (-step, step))
        assert slope == pytest.approx((after[0] - before[0]) / (2 * step), abs=2e-7)
        if abs(before[2] - after[2]) < 1e-3 and not wave:
            assert bend == pytest.approx((after[1] - before[1]) / (2 * step), rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
def test_derivative_and_normal_of_a_relieved_flank(shape):
    flanks, step = pair_of(shape, shape).compiled(), 1e-6
    low, high = ends(RIG)
    for roll in np.linspace(low + 1e-3, high, 30):
        here = flank_point(flanks, 1, REVERSE, 4, roll)
        before, after = (flank_point(flanks, 1, REVERSE, 4, roll + d) for d in (-step, step))
        numeric = (np.array(after[:2]) - before[:2]) / (2 * step)
        assert numeric == pytest.approx(np.array(here[4:]), rel=1e-6, abs=1e-7)
        assert np.array(here[4:]) @ here[2:4] == pytest.approx(0.0, abs=1e-16)


def brute_gap(flanks, pose, teeth, flank):
    """Smallest distance of two flanks, searched point against point on ever finer grids; pose: centre and rotations."""
    centre, turns = pose

    def curve(number, rolls):
        points = flank_points(flanks, number, flank, teeth[number], rolls)[0]
        c, s = cos(turns[number]), sin(turns[number])
        return points @ np.array([[c, s], [-s, c]]) + np.array(centre if number else (0.0, 0.0))

    low, high = ends(RIG)
    middle, width, least = np.array([0.5 * (low + high)] * 2), 0.5 * (high - low), np.inf
    for _ in range(14):
        rolls = [np.clip(np.linspace(m - width, m + width, 201), low, high) for m in middle]
        a, b = curve(0, rolls[0]), curve(1, rolls[1])
        distances = np.hypot(*(a[:, None] - b[None]).T).T
        i, j = np.unravel_index(np.argmin(distances), distances.shape)
        middle, width, least = np.array([rolls[0][i], rolls[1][j]]), width / 4, distances[i, j]
    return least


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
@pytest.mark.parametrize("theta", [-0.042, -0.033, -0.02, 0.0, 0.02, 0.033, 0.042])
def test_gap_of_relieved_flanks_is_the_distance_of_the_curves(shape, theta):
    """Over the whole path of contact: tip on root, plain on plain, root on tip."""
    pair = pair_of(shape, shape)
    flanks = pair.compiled()
    theta_loose = theta + 900e-6 / RIG.base_radius
    gap, by_drive, by_loose, *_ = flank_gap(flanks, theta, theta_loose, 1, 1, ACTIVE)
    pose = ((pair.centre_distance, 0.0), (theta, pi - theta_loose))
    assert gap == pytest.approx(brute_gap(flanks, pose, (1, 1), ACTIVE), abs=2e-11)
    assert edged_gap(edged(pair), theta, theta_loose, 1, 1, ACTIVE)[0] == pytest.approx(gap, abs=1e-13)
    perfect = flank_gap(PLAIN.compiled(), theta, theta_loose, 1, 1, ACTIVE)[0]
    assert gap >= perfect - 1e-13
    step = 1e-7
    for angle, slope in (((step, 0.0), by_drive), ((0.0, step), by_loose)):
        moved = flank_gap(flanks, theta + angle[0], theta_loose + angle[1], 1, 1, ACTIVE)[0]
        assert (moved - gap) / step == pytest.approx(slope, rel=1e-5)


def test_mid_mesh_is_untouched_and_the_tip_stands_back():
    pair = pair_of()
    assert flank_gap(pair.compiled(), 0.0, 0.0, 1, 1, ACTIVE)[0] == pytest.approx(0.0, abs=1e-16)
    # near the end of the path the drive's tip meets the mate's root: both stand back, by nearly their amounts
    high = ends(RIG)[1]
    theta = 0.98 * high - np.tan(pair.working_pressure_angle)
    gap = flank_gap(pair.compiled(), theta, theta, 1, 1, ACTIVE)[0]
    assert 15e-6 < gap < 35e-6


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
@pytest.mark.parametrize("where", ["tip", "root"])
def test_relief_takes_its_area_off_the_section(shape, where):
    """Amount × roll length / 2 or / 3 on each flank, to second order in the amount; and twice as much for twice it."""
    low, high = ends(RIG)
    areas = []
    for factor in (0.0, 1.0, 2.0):
        old = (TIP if where == "tip" else ROOT)[shape]
        relief = Relief(factor * old.amount, length=old.length, shape=shape)
        gear = Gear(3.5e-3, 90, face_width=7.5e-3, **{f"{where}_relief": relief})
        areas.append(outline(Pair.from_backlash(gear, gear, 250e-6), "drive", 0.01e-6, 0.01e-6).area)
    relief, power = (
        (TIP[shape], 1 if shape == "linear" else 2) if where == "tip" else (ROOT[shape], 1 if shape == "linear" else 2)
    )
    reach = relief.length / RIG.base_radius
    end, start = (high, high - reach) if where == "tip" else (low, low + reach)
    expected = quad(
        lambda r: relief.amount * abs((r - start) / reach) ** power * RIG.base_radius * r,
        min(start, end),
        max(start, end),
    )[0]
    taken = areas[0] - areas[1]
    assert taken > 0.99 * 2 * 90 * expected
    if where == "tip":
        assert taken == pytest.approx(2 * 90 * expected, rel=0.01)
    else:
        # below the form circle the fillet is drawn up to the relieved flank
        section = outline(PLAIN, "drive")
        fillet = section.points[0, section.root : section.root + section.fillet + 1]
        length = np.hypot(*np.diff(fillet, axis=0).T).sum()
        beyond = (taken - 2 * 90 * expected) / (2 * 90 * relief.amount * length)
        assert 0.3 < beyond < 0.7
    assert areas[0] - areas[2] == pytest.approx(2 * taken, rel=0.01)


def test_the_three_ways_of_a_start_say_the_same():
    low, high = ends(RIG)
    roll = high - 6e-3 / RIG.base_radius
    ways = [
        Relief(20e-6, length=6e-3),
        Relief(20e-6, start_roll=roll),
        Relief(20e-6, start_diameter=2 * RIG.base_radius * (1 + roll**2) ** 0.5),
    ]
    seen = [Pair.from_backlash(g, g, 1e-4).compiled().gears for g in (Gear(3.5e-3, 90, tip_relief=w) for w in ways)]
    assert seen[1] == pytest.approx(seen[0], rel=1e-12)
    assert seen[2] == pytest.approx(seen[0], rel=1e-9)
    del low


def test_relief_reaches_the_tip_circle_with_its_amount():
    flanks = pair_of("linear", None).compiled()
    roll = roll_at_radius(flanks, 0, ACTIVE, 1, RIG.tip_radius)
    x, y, *_ = flank_point(flanks, 0, ACTIVE, 1, roll)
    assert hypot(x, y) == pytest.approx(RIG.tip_radius, abs=1e-15)
    half = PLAIN.half_angle("drive")
    middle = inv(PLAIN.working_pressure_angle) - half
    corner = half - inv(acos(RIG.base_radius / RIG.tip_radius))
    narrower = RIG.tip_radius * (corner - (atan2(y, x) - middle))
    assert narrower == pytest.approx(20e-6 / (RIG.base_radius / RIG.tip_radius), rel=5e-3)


def distance(points, chain):
    """Distance of each point from a chain of chords."""
    start, step = chain[:-1], np.diff(chain, axis=0)
    across = points[:, None] - start
    along = np.clip(np.sum(across * step, axis=2) / np.sum(step**2, axis=1), 0, 1)
    return np.hypot(*(across - along[..., None] * step).T).T.min(axis=1)


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
def test_pieces_stay_convex_within_their_budget(shape):
    pair = pair_of(shape, shape)
    for piece in pieces(pair, "drive", points=24)[:3]:
        assert piece.shape == (96, 3)
        assert len(ConvexHull(piece[:48, :2]).vertices) == 48
    chain = pieces(pair, "drive", points=24)[0][:24, :2]
    rolls = np.linspace(ends(RIG)[0] + 0.06, RIG.tip_roll - 1e-3, 3000)
    off = distance(flank_points(pair.compiled(), 0, ACTIVE, 1, rolls)[0], chain)
    assert 0.5 < off.max() / piece_budget(pair)["chord_error_m"] < 1.02
    flanks = pair.compiled()
    for theta in np.linspace(-0.04, 0.04, 9):
        theta_loose = theta + 90e-6 / RIG.base_radius
        gap = gap_at(flanks, pair.centre_distance, 0.0, theta, pi - theta_loose, 1, 1, ACTIVE)[0]
        assert gap >= 90e-6 - 1e-12


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
def test_chords_of_the_section_keep_the_stated_distance(shape):
    """Against a section drawn a hundred times finer."""
    pair = pair_of(shape, shape)
    chord = 0.5e-6
    coarse, fine = (profile(pair, "drive", c) for c in (chord, chord / 100))
    low = RIG.base_radius * hypot(1, ends(RIG)[0]) + 0.1e-3
    radius = np.hypot(*fine.T)
    off = distance(fine[(radius > low) & (radius < RIG.tip_radius - 1e-9)], coarse)
    assert 0.4 * chord < off.max() <= 1.02 * chord


@settings(max_examples=60, deadline=None)
@example(98, 0.0, 6.771631778594364e-05, 0.1015625, "parabolic")  # so steep that its normal is far from an involute's
@given(
    st.integers(14, 120),
    st.floats(-0.2, 0.6),
    st.floats(1e-6, 80e-6),
    st.floats(0.1, 0.9),
    st.sampled_from(sorted(TIP)),
)
def test_any_relief_that_is_taken_gives_a_regular_flank(teeth, shift, amount, part, shape):
    try:
        plain = Gear(2e-3, teeth, profile_shift=shift)
        low, high = plain.base_radius * np.array([ends(plain)[0], plain.tip_roll])
        assume(low > 0)
        gear = Gear(
            2e-3, teeth, profile_shift=shift, tip_relief=Relief(amount, length=part * (high - low), shape=shape)
        )
        pair = Pair.from_backlash(gear, Gear(2e-3, 40), 1e-4)
    except InputError:
        assume(False)
    flanks = pair.compiled()
    _, normals = flank_points(flanks, 0, ACTIVE, 1, np.linspace(low / plain.base_radius, plain.tip_roll, 300))
    assert (np.diff(np.unwrap(np.arctan2(normals[:, 1], normals[:, 0]))) < 0).all()
    tip = roll_at_radius(flanks, 0, ACTIVE, 1, gear.tip_radius)
    x, y, nx, ny, _, _ = flank_point(flanks, 0, ACTIVE, 1, tip)
    h, s, _ = support(flanks, 0, ACTIVE, 1, atan2(ny, nx))
    assert (h, s) == pytest.approx((x * nx + y * ny, y * nx - x * ny), abs=1e-13)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Relief(1e-6), r"length: has no start \(give one of start_roll, start_diameter, length\)"),
        (lambda: Relief(1e-6, start_roll=0.3, length=1e-3), r"length: has start_roll and length"),
        (lambda: Relief(-1e-6, length=1e-3), r"amount: is -1 um"),
        (lambda: Relief(1e-6, length=1e-3, shape="cubic"), r"shape: is 'cubic'"),
        (lambda: Gear(2e-3, 30, tip_relief=Relief(1e-6, length=0.1)), r"tip_relief.length: puts .*less than 11.23 mm"),
        (
            lambda: Gear(2e-3, 30, tip_relief=Relief(1e-6, start_diameter=0.07)),
            r"tip_relief.start_diameter: .*more than 56.9\d+ and less than 64 mm",
        ),
        (
            lambda: Gear(2e-3, 30, root_relief=Relief(1e-6, start_roll=radians(2))),
            r"root_relief.start_roll: .*more than 7.953 and less than 30.78 deg",
        ),
        (lambda: Gear(2e-3, 12, tip_relief=Relief(800e-6, length=1e-3)), r"tip_relief.amount: is 800 um"),
        (
            lambda: Gear(2e-3, 30, tip_relief=Relief(1e-5, length=7e-3), root_relief=Relief(1e-5, length=7e-3)),
            r"root_relief: starts above the start of the tip relief",
        ),
    ],
)
def test_impossible_reliefs(make, message):
    with pytest.raises(InputError, match=message):
        make()
