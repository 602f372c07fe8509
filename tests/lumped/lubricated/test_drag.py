"""Drag of a loose gear: closed forms of the plates, areas of tooth spaces, scales, the sum."""

import numpy as np
import pytest
from shapely.geometry import Point, Polygon

from gears3d.gears import profile
from gears3d.laws import end_faces, periphery, rolling_bearing
from gears3d.lumped.lubricated import Bath, Bearing, Synchroniser, drag_parts
from gears3d.lumped.lubricated.drag import area_in_circle, space_area, squeezing_torque
from gears3d.scenario import load

PAIR = load("scenarios/base/helical-17-43.toml").pair()
OIL = (816.0, 12e-6)


def test_a_half_immersed_face_has_its_closed_form():
    r, w = 0.065, 62.1
    expected = 2 * 0.036 * OIL[1] ** 0.2 * OIL[0] * w**1.8 * np.pi**0.8 * r**4.6 / 4.6
    assert end_faces(r, 0.0, *OIL, w) == pytest.approx(expected, rel=1e-9)


def test_the_face_is_the_sum_of_its_rings_and_the_rim_the_last_one():
    r, h, w = 0.065, 0.045, 62.1
    rings = np.linspace(h, r, 200001)
    drag = 0.036 * OIL[1] ** 0.2 * OIL[0] * (w * rings) ** 1.8 * (2 * np.arccos(h / rings) * rings) ** 0.8 * rings
    assert end_faces(r, h, *OIL, w) == pytest.approx(2 * np.trapezoid(drag, rings), rel=1e-5)
    assert periphery(r, 0.016, h, *OIL, w) == pytest.approx(0.016 * drag[-1], rel=1e-12)


def test_drag_of_the_bath_grows_with_the_depth_and_with_speed_to_the_nine_fifths():
    for law in (lambda h, w: end_faces(0.065, h, *OIL, w), lambda h, w: periphery(0.065, 0.016, h, *OIL, w)):
        assert np.all(np.diff([law(h, 60.0) for h in (0.06, 0.03, 0.0, -0.03)]) > 0.0)
        assert law(0.03, 120.0) == pytest.approx(2**1.8 * law(0.03, 60.0))
        assert law(0.03, -60.0) == -law(0.03, 60.0)
    with pytest.raises(ValueError, match="dip"):
        end_faces(0.065, 0.07, *OIL, 60.0)


def test_the_bearing_is_the_iso_formula_in_its_own_units_and_nearly_continuous():
    rpm, v, d = 593.0, 12.0, 45.0
    iso = 1e-10 * 12 * (v * rpm) ** (2 / 3) * d**3
    assert rolling_bearing(12, d * 1e-3, v * 1e-6, rpm * np.pi / 30) == pytest.approx(iso, rel=1e-9)
    edge = 0.002 / 12e-6 * np.pi / 30
    low, high = (float(rolling_bearing(12, 0.045, 12e-6, edge * share)) for share in (0.9999, 1.0001))
    assert high == pytest.approx(low, rel=0.01)


@pytest.mark.parametrize("seed", range(4))
def test_area_within_a_circle_is_that_of_another_library(seed):
    draw = np.random.default_rng(seed)
    angles = np.sort(draw.uniform(0, 2 * np.pi, 9))
    points = np.c_[np.cos(angles), np.sin(angles)] * draw.uniform(0.3, 2.0, (9, 1)) + draw.uniform(-0.5, 0.5, 2)
    circle = Point(0, 0).buffer(1.0, quad_segs=4000)
    assert area_in_circle(points, 1.0) == pytest.approx(Polygon(points).intersection(circle).area, abs=2e-6)


@pytest.mark.parametrize("which", ["drive", "loose"])
def test_a_space_loses_what_the_tooth_of_the_mate_fills(which):
    mate = "loose" if which == "drive" else "drive"
    pitch = 2 * np.pi / PAIR.gear(mate).teeth
    areas = space_area(PAIR, which, np.linspace(-1.5, 1.5, 61) * pitch)
    assert areas[0] == pytest.approx(areas.max(), rel=1e-9)
    assert areas.argmin() == 30
    assert areas == pytest.approx(areas[::-1], rel=1e-4)
    gear = PAIR.gear(which)
    depth = gear.tip_radius + PAIR.gear(mate).tip_radius - PAIR.centre_distance
    tooth = profile(PAIR, mate, 2e-6)
    radii = np.hypot(*tooth.T)
    crown = tooth[radii > PAIR.gear(mate).tip_radius - depth]
    x, y = crown.T
    above = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    assert 0.5 * above < areas.max() - areas.min() < 1.2 * above


def test_squeezing_goes_with_density_and_the_square_of_the_speed():
    base = squeezing_torque(PAIR, 816.0, 62.1)
    assert base > 0.0
    assert squeezing_torque(PAIR, 408.0, 124.2) == pytest.approx(2 * base, rel=1e-9)


def test_the_parts_of_the_representative_gear_add_up():
    parts = drag_parts(PAIR, 62.1, Bath(816.0, 0.0098, 0.02), Bearing(12, 45e-3), Synchroniser(8e-3, 37.5e-3, 2e-4))
    total = parts.pop("total")
    assert total == pytest.approx(sum(parts.values()))
    assert all(0.0 < torque < 0.1 for torque in parts.values())
    assert 0.04 < total < 0.12
