"""Tests that have to touch the flanks say so where oil is between them."""

import pytest

from gears3d.bench import drops, static_error, thresholds
from gears3d.errors import InputError
from gears3d.scenario import load


@pytest.mark.parametrize("test", [static_error, thresholds, lambda scenario: drops(scenario, [0.01])])
def test_oil_is_refused_with_its_reason(test):
    with pytest.raises(InputError, match=r"oil.*leave the oil out"):
        test(load("scenarios/dct-helical-lubricated/fig13.toml"))
