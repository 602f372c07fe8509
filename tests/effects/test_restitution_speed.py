"""Restitution falls in a straight line with the impact speed and never below nothing."""

import numpy as np
import pytest

from tests.effects.bench import MODELS, run


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("slope", [-4.0, -20.0, 2.0])
def test_every_rebound(model, slope):
    hits = run(model, {"kind": "restitution_speed", "slope": f"{slope} s/m"}, run__duration="0.3 s").impacts
    speed = np.abs(hits["velocity_m_s"])
    expected = np.clip(0.3 + slope * speed, 0.0, 1.0) * speed
    sticks = expected < 1e-4
    assert np.abs(hits["rebound_m_s"])[~sticks] == pytest.approx(expected[~sticks])
    assert (hits["rebound_m_s"][sticks] == 0.0).all()
