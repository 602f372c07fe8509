"""Transmission error: contact rides on it, both flanks move together, and a steep one throws the gear off."""

from math import pi, sqrt

import numpy as np
import pytest

from tests.effects.bench import BACKLASH, DRAG, MODELS, J, bench, run


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("gear", ["drive", "loose"])
@pytest.mark.parametrize("start", ["active", "reverse"])
def test_contact_rides_on_it(model, gear, start):
    effect = {"kind": "transmission_error", "order": 3, "amplitude": "20 um", "phase": "40 deg", "gear": gear}
    mean = "60 rpm" if start == "active" else "-60 rpm"
    changes = {"motion__harmonics": [], "motion__mean": mean, "start__state": start, "drag__torque": "5 N m"}
    done = run(model, effect, run__output_rate="1 kHz", **changes)
    theta, s = done.signals[f"theta_{gear}_rad"], done.signals["displacement_m"]
    rest = 0.0 if start == "active" else BACKLASH
    assert np.abs(s - rest - 20e-6 * np.cos(3 * theta + np.radians(40))).max() < 1e-10


@pytest.mark.parametrize("model", MODELS)
def test_it_throws_the_gear_off_above_a_critical_speed(model):
    """Contact is lost where amplitude·(order·Ω)² = Rb·Td/J, with no fluctuation of the drive at all."""
    effect = {"kind": "transmission_error", "order": 90, "amplitude": "5 um"}
    critical = sqrt(DRAG / J * bench().rig().base_radius_loose / 5e-6) / 90 * 30 / pi
    for factor, impacts in ((0.995, False), (1.005, True)):
        mean = f"{factor * critical} rpm"
        done = run(model, effect, motion__harmonics=[], motion__mean=mean, run__output_rate="1 kHz")
        assert bool(len(done.impacts["time_s"])) == impacts
