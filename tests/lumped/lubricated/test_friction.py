"""Friction: the printed law, its mean over the lines of contact, and its sign."""

import numpy as np
import pytest

from gears3d.gears import contact_lines
from gears3d.laws import contact_length
from gears3d.lumped.lubricated.model import arm, coefficient, levers, shearing
from gears3d.scenario import load

PAIR = load("scenarios/base/helical-17-43.toml").pair()
THETA = np.linspace(0.0, 2 * np.pi / 17, 200, endpoint=False)


def test_the_coefficient_turns_at_the_pitch_point_and_goes_to_its_average():
    place = np.linspace(-1e-3, 1e-3, 2001)
    found = coefficient(place, 0.05, 50e3)
    assert found == pytest.approx(-found[::-1], abs=1e-15)
    assert found[1000] == 0.0
    assert np.abs(found).max() < 0.05
    assert found[-1] == pytest.approx(0.05, rel=1e-3)
    assert np.diff(found[1000:1020]).min() > 0.0


def test_the_mean_over_the_lines_loses_on_the_whole_and_is_smaller_than_at_one_place():
    published, lines = (levers(PAIR, THETA, 0, 0.05, 50e3, each) for each in (True, False))
    reach = 0.05 * arm(PAIR) / PAIR.loose.base_radius / np.cos(PAIR.drive.base_helix_angle)
    assert np.abs(published).max() == pytest.approx(reach, rel=0.02)
    assert np.abs(lines).max() < np.abs(published).max()
    assert abs(published.mean()) < 0.1 * reach
    assert lines.mean() < 0.0  # the arm is longer before the pitch point, where it holds back


def test_sheared_oil_is_the_sum_over_the_lines_of_contact():
    found = shearing(PAIR, THETA[::20], 0, False, 0.0)
    base, tangent = PAIR.loose.base_radius, np.tan(PAIR.working_pressure_angle)
    for theta, value in zip(THETA[::20], found, strict=True):
        total = 0.0
        for ends, length in zip(*(getattr(contact_lines(PAIR, theta), n) for n in ("rolls", "lengths")), strict=True):
            place = np.linspace(*(ends[:, 0] - tangent), 2001) * PAIR.drive.base_radius
            total += np.mean(place * (tangent - place / base)) * length
        assert value == pytest.approx(total, abs=2e-2 * 1.5e-3 * contact_length(16e-3, 1.32, 0.457))


def test_friction_of_the_reverse_flank_is_that_of_the_active_one_turned_back():
    lead = 2.0 * PAIR.half_angle("drive") - 2.0 * (np.tan(PAIR.working_pressure_angle) - PAIR.working_pressure_angle)
    for published in (False, True):
        one, other = (levers(PAIR, angle, k, 0.05, 50e3, published) for k, angle in ((0, THETA), (1, lead - THETA)))
        assert other == pytest.approx(one, abs=1e-6)
