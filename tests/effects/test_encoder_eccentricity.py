"""An encoder off its centre: shown as if the loose gear wandered, in flight as in contact."""

import numpy as np
import pytest

from tests.effects.bench import run


@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_only_its_own_reading_wanders(gear):
    plain = run("rigid")
    effect = {"kind": "encoder_eccentricity", "amplitude": "2e-4 rad", "order": 2, "phase": "0.7 rad", "gear": gear}
    read = run("rigid", effect)
    for which in ("drive", "loose"):
        theta = plain.signals[f"theta_{which}_rad"]
        error = 2e-4 * np.cos(2 * theta + 0.7) if which == gear else 0.0
        assert np.abs(read.signals[f"theta_{which}_rad"] - theta - error).max() < 1e-15
