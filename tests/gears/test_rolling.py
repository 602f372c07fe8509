"""Rolling without load: what the surfaces impose, against what was asked of them and against closed forms."""

from math import acos, atan2, cos, hypot, pi, radians, sin

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.gears import (
    Eccentricity,
    Gear,
    HarmonicDeviation,
    Misalignment,
    Pair,
    Relief,
    ToothDeviation,
    Wobble,
    candidates,
    hunting_period,
    inv,
    quasi_static,
)

RIG = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
PAIR = Pair.from_backlash(RIG, RIG, 250e-6)
UNEQUAL = Pair.from_backlash(Gear(2e-3, 23, profile_shift=0.3), Gear(2e-3, 40), 120e-6)


def helical(**more):
    gears = [Gear(2.75e-3, z, helix_angle=radians(28), face_width=16e-3, **more) for z in (17, 43)]
    return Pair.from_backlash(*gears, 120e-6)


@pytest.mark.parametrize("pair", [PAIR, UNEQUAL, helical(), helical(profile_shift=0.15)])
def test_perfect_gears_impose_nothing(pair):
    found = quasi_static(pair, np.linspace(-3, 3, 301))
    assert np.abs(found.phi_active).max() < 1e-15
    assert np.abs(found.phi_reverse).max() < 1e-15
    assert np.abs(found.backlash - pair.backlash).max() < 1e-15


@pytest.mark.parametrize("pair", [PAIR, UNEQUAL])
@pytest.mark.parametrize("which", ["drive", "loose"])
def test_imposed_orders_come_back(pair, which):
    """Any sum of orders, of either gear and on each flank by itself, over the hunting period."""
    teeth = pair.gear(which).teeth
    active, reverse = [(1, 30e-6, 0.7), (2, -9e-6, 0.1), (teeth, 1.5e-6, 2.0)], [(3, 12e-6, 1.0)]
    deviations = [HarmonicDeviation(which, "active", *term) for term in active]
    deviations += [HarmonicDeviation(which, "reverse", *term) for term in reverse]
    found = quasi_static(pair.with_deviations(*deviations), samples=7)
    assert found.theta[-1] == pytest.approx(hunting_period(pair) - 2 * pi / 7 / pair.drive.teeth)
    for terms, place, sign in ((active, found.phi_active, 1), (reverse, found.phi_reverse, -1)):
        s = place + (0.0 if sign > 0 else pair.backlash)
        own = found.theta if which == "drive" else (s + pair.drive.base_radius * found.theta) / pair.loose.base_radius
        expected = sign * sum(a * np.cos(n * own + p) for n, a, p in terms)
        assert np.abs(place - expected).max() < 1e-12
    assert np.abs(found.backlash - (pair.backlash + found.phi_reverse - found.phi_active)).max() < 1e-15


@pytest.mark.parametrize("which", ["drive", "loose"])
@pytest.mark.parametrize("turn", [28, -12])
def test_imposed_orders_come_back_from_helical_gears(which, turn):
    """Every point of the face gets the offset of the moment at which it touches."""
    gears = [Gear(2.75e-3, z, helix_angle=radians(turn), face_width=16e-3) for z in (17, 43)]
    pair = Pair.from_backlash(*gears, 120e-6)
    terms, other = [(1, 20e-6, 0.3), (17, 0.4e-6, 1.3)], (2, 8e-6, 1.0)
    deviations = [HarmonicDeviation(which, "active", *term) for term in terms]
    found = quasi_static(
        pair.with_deviations(*deviations, HarmonicDeviation(which, "reverse", *other)), np.linspace(-9, 40, 60)
    )
    for place, imposed, sign in ((found.phi_active, terms, 1), (found.phi_reverse, [other], -1)):
        s = place + (0.0 if sign > 0 else pair.backlash)
        own = found.theta if which == "drive" else (s + pair.drive.base_radius * found.theta) / pair.loose.base_radius
        assert np.abs(place - sign * sum(a * np.cos(n * own + p) for n, a, p in imposed)).max() < 1e-13


def test_a_thick_tooth_leads_while_it_touches():
    pair = UNEQUAL.with_deviations(ToothDeviation("loose", "active", 7, 10e-6))
    found = quasi_static(pair, samples=9)
    touching = 0
    for theta, phi, teeth in zip(found.theta, found.phi_active, found.teeth, strict=True):
        theta_loose = (phi + pair.drive.base_radius * theta) / pair.loose.base_radius
        in_path = candidates(pair.compiled(), theta, theta_loose, 0)
        if (in_path[:, 1] == 7).any():
            touching += 1
            assert (phi, teeth[1]) == (pytest.approx(10e-6, abs=1e-13), 7)
        else:
            assert -1e-14 < phi < 10e-6
            assert teeth[1] == 7 or phi < 1e-13
    assert touching == pytest.approx(23 * 9 * pair.contact_ratio, abs=23)
    assert np.abs(found.phi_reverse).max() < 1e-14


def test_a_thick_helical_tooth_leads_longer_than_a_straight_one():
    pair = helical().with_deviations(ToothDeviation("drive", "active", 4, 10e-6))
    found = quasi_static(pair, np.linspace(0, 2 * pi, 17 * 40, endpoint=False))
    leading = np.abs(found.phi_active - 10e-6) < 1e-13
    assert leading.sum() == pytest.approx(40 * (pair.contact_ratio + pair.overlap_ratio), abs=1.5)
    assert (found.teeth[leading, 0] == 4).all()


def shifted_axes(pair, items, theta, flank):
    """Closed form for displaced axes: s from distance and direction of the teeth's own axes, by involute functions."""
    total = pair.drive.base_radius + pair.loose.base_radius
    s = flank * pair.backlash
    for _ in range(30):
        loose = (s + pair.drive.base_radius * theta) / pair.loose.base_radius
        x, y = pair.centre_distance, 0.0
        for item in items:
            if item.gear == "drive":
                x, y = x - item.offset * cos(theta + item.phase), y - item.offset * sin(theta + item.phase)
            else:
                x, y = x - item.offset * cos(loose + item.phase), y + item.offset * sin(loose + item.phase)
        change = inv(acos(total / hypot(x, y))) - inv(pair.working_pressure_angle)
        s = -total * atan2(y, x) + ((pair.backlash + total * change) if flank else -total * change)
    return s


@pytest.mark.parametrize("pair", [PAIR, UNEQUAL, helical()])
@pytest.mark.parametrize(
    "items",
    [
        [Eccentricity("drive", 30e-6, 0.3)],
        [Eccentricity("loose", 45e-6, -1.0)],
        [Eccentricity("drive", 20e-6), Eccentricity("loose", 20e-6, 2.0)],
    ],
)
def test_eccentric_gears_move_flanks_and_backlash_by_the_closed_form(pair, items):
    theta = np.linspace(0.0, 13.0, 60)
    found = quasi_static(pair.with_mounting(*items), theta)
    active, reverse = ([shifted_axes(pair, items, t, flank) for t in theta] for flank in (0, 1))
    assert np.abs(found.phi_active - active).max() < 1e-14
    assert np.abs(found.phi_reverse + pair.backlash - reverse).max() < 1e-14
    if len(items) == 1 and items[0].gear == "drive":
        e, alpha, turn = items[0].offset, pair.working_pressure_angle, theta + items[0].phase
        assert found.phi_active == pytest.approx(e * np.sin(turn + alpha), abs=4 * e**2 / pair.path_length)
        narrower = 2 * e * sin(alpha) * np.cos(turn)
        assert found.backlash == pytest.approx(pair.backlash - narrower, abs=4 * e**2 / pair.path_length)


@pytest.mark.parametrize("in_plane", [-3e-4, 0.0, 2e-4])
@pytest.mark.parametrize("out_of_plane", [-1e-4, 0.0, 4e-4])
def test_misaligned_spur_gears_touch_at_the_end_of_the_face(in_plane, out_of_plane):
    """Active normal (sin α, cos α), reverse (sin α, −cos α): the end at which the loose axis is nearer touches."""
    found = quasi_static(PAIR.with_mounting(Misalignment(in_plane, out_of_plane)), np.linspace(0, 0.2, 21))
    alpha, half = PAIR.working_pressure_angle, 0.5 * RIG.face_width
    for flank, (place, sign) in enumerate(((found.phi_active, 1.0), (found.phi_reverse, -1.0))):
        slope = in_plane * sin(alpha) + sign * out_of_plane * cos(alpha)
        assert place == pytest.approx(sign * half * abs(slope), abs=3e-11)
        if slope:
            assert found.heights[:, flank] == pytest.approx(-half * np.sign(slope), abs=1e-9)


def test_a_wobbling_gear_touches_at_alternate_ends():
    theta = np.linspace(0, 2 * pi, 73)
    found = quasi_static(PAIR.with_mounting(Wobble("drive", 3e-4, 0.2)), theta)
    reach = 3e-4 * np.sin(theta + 0.2 + PAIR.working_pressure_angle)
    half = 0.5 * RIG.face_width
    assert found.phi_active == pytest.approx(half * np.abs(reach), abs=3e-11)
    clear = np.abs(reach) > 1e-6
    assert found.heights[clear, 0] == pytest.approx(half * np.sign(reach[clear]), abs=1e-9)


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
def test_relief_shows_only_where_no_unrelieved_teeth_touch(shape):
    """Free of error with an unrelieved contact ratio above 1, else the loose gear falls back at the change of teeth."""
    rest = PAIR.contact_ratio - 1.0
    pitch = RIG.base_pitch
    for length, lost in ((0.4 * rest * pitch, False), (0.8 * rest * pitch, True)):
        gear = Gear(3.5e-3, 90, face_width=7.5e-3, tip_relief=Relief(20e-6, length=length, shape=shape))
        found = quasi_static(Pair.from_backlash(gear, gear, 250e-6), np.linspace(0, 4 * pi / 90, 401))
        if lost:
            assert -20e-6 < found.phi_active.min() < -1e-7
            assert (np.abs(found.phi_active) < 1e-14).mean() > 0.3
            first, second = found.phi_active[:200], found.phi_active[200:400]
            assert first == pytest.approx(second, abs=1e-13)
            assert found.phi_reverse.max() == pytest.approx(-found.phi_active.min(), rel=0.05)
        else:
            assert np.abs(found.phi_active).max() < 1e-14


def test_bad_angles():
    with pytest.raises(InputError, match=r"theta: holds angles that are not numbers"):
        quasi_static(PAIR, [0.0, float("nan")])
