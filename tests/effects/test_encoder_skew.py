"""A late encoder: the same reading, later; at constant speed an angle of speed times delay."""

import numpy as np
import pytest

from tests.effects.bench import MODELS, run


def test_a_delay_of_whole_samples_moves_the_column():
    plain, late = run("rigid"), run("rigid", {"kind": "encoder_skew", "delay": "150 us"})
    theta = [done.signals["theta_loose_rad"] for done in (plain, late)]
    assert np.abs(theta[1][3:] - theta[0][:-3]).max() < 1e-13
    assert np.array_equal(late.signals["theta_drive_rad"], plain.signals["theta_drive_rad"])
    assert all(np.array_equal(late.impacts[key], plain.impacts[key]) for key in plain.impacts)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("delay", [12e-6, -33e-6])
@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_an_angle_at_constant_speed(model, delay, gear):
    effect = {"kind": "encoder_skew", "delay": f"{delay} s", "gear": gear}
    done = run(model, effect, motion__harmonics=[], run__duration="20 ms")
    sign = -1.0 if gear == "loose" else 1.0
    radius = {"drive": "base_radius_drive_m", "loose": "base_radius_loose_m"}[gear]
    assert done.signals["displacement_m"] == pytest.approx(sign * done.meta[radius] * np.pi * delay, abs=1e-12)
    assert done.signals["velocity_m_s"] == pytest.approx(0.0, abs=1e-8)
