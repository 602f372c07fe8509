"""One function for all models, and sensors that only look."""

import numpy as np
import pytest

import gears3d as g3
from gears3d.errors import UsageError

FILE = "scenarios/rigaud-2020/fig5-20rpm.toml"
SHORT = ["run.duration=1 s"]


def test_what_is_not_known_is_refused_with_a_hint():
    with pytest.raises(UsageError, match="did you mean 'bullet'"):
        g3.simulate(FILE, model="bulet")
    with pytest.raises(UsageError, match="did you mean 'native'"):
        g3.simulate(FILE, contact="nativ")
    with pytest.raises(UsageError, match="pair="):
        g3.simulate(FILE, model="rigid", pair=g3.load(FILE).pair())


@pytest.mark.parametrize("model", ["rigid", "bullet"])
def test_an_encoder_error_changes_the_reading_and_nothing_else(model):
    amplitude, phase = 2e-4, 0.7
    base = g3.load(FILE, overrides=SHORT)
    effect = {"kind": "encoder_eccentricity", "amplitude": f"{amplitude} rad", "phase": f"{phase} rad"}
    plain = g3.simulate(base, model=model)
    read = g3.simulate(base.with_({"effect": [effect]}), model=model)
    theta = plain.signals["theta_loose_rad"]
    np.testing.assert_array_equal(read.signals["theta_drive_rad"], plain.signals["theta_drive_rad"])
    error = read.signals["theta_loose_rad"] - theta
    np.testing.assert_allclose(error, amplitude * np.cos(theta + phase), atol=1e-12)
    shift = read.signals["displacement_m"] - plain.signals["displacement_m"]
    np.testing.assert_allclose(shift, base.rig().base_radius_loose * error, atol=1e-12)
    for name, column in plain.impacts.items():
        np.testing.assert_array_equal(read.impacts[name], column)
    omega, time = plain.signals["omega_loose_rad_s"], plain.signals["time_s"]
    away = np.abs(time[:, None] - plain.impacts["time_s"]).min(axis=1) > 1e-4  # a sampled jump has no derivative
    away[[0, -1]] = False
    slip = read.signals["omega_loose_rad_s"] - omega
    expected = -amplitude * np.sin(theta + phase) * omega
    np.testing.assert_allclose(slip[away], expected[away], atol=2e-6)


def test_a_recording_says_where_it_comes_from():
    recording = g3.simulate(FILE, model="rigid")
    meta = recording.meta
    assert meta["version"] == g3.__version__
    assert meta["model"] == "rigid"
    assert meta["settle_s"] == pytest.approx(2 / 3)
    assert meta["period_s"] == pytest.approx(1 / 3)
