"""Scatter is Gaussian about the base coefficient, repeats with its seed, and is nobody's copy of the twin's."""

import numpy as np
import pytest

from tests.effects.bench import run

SCATTER = {"kind": "restitution_scatter", "standard_deviation": 0.05}


def ratios(model, seed, duration):
    changes = {"run__duration": duration, "impact__restitution": 0.5, "run__seed": seed, "run__output_rate": "1 kHz"}
    hits = run(model, SCATTER, **changes).impacts
    free = hits["rebound_m_s"] != 0.0
    return (-hits["rebound_m_s"] / hits["velocity_m_s"])[free]


def test_mean_and_spread():
    found = ratios("rigid", 1, "400 s")
    assert len(found) > 5000
    assert found.mean() == pytest.approx(0.5, abs=4 * 0.05 / len(found) ** 0.5)
    assert found.std() == pytest.approx(0.05, abs=4 * 0.05 / (2 * len(found)) ** 0.5)


@pytest.mark.parametrize("model", ["rigid", "bullet"])
def test_seed(model):
    one, again, other = (ratios(model, seed, "0.3 s") for seed in (1, 1, 2))
    assert np.array_equal(one, again)
    assert not np.array_equal(one[:3], other[:3])
    assert np.abs(one - 0.5).max() < 0.25
