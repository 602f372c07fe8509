"""Levels against numbers worked out by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gears3d.laws import (
    WHINE_30_RPM,
    impacts_per_second,
    power_level,
    pressure_level,
    rattle_drive,
    rattle_level,
    total_level,
)


def test_a_pressure_of_0_16_pascal_is_the_whine_of_the_bench():
    assert pressure_level(2e-5 * 10 ** (78 / 20)) == pytest.approx(WHINE_30_RPM)
    assert pytest.approx(0.15887, rel=1e-4) == 2e-5 * 10 ** (78 / 20)
    assert power_level(1e-12) == pytest.approx(0.0)


def test_the_bench_at_20_rpm_and_3_hz():
    """(6π)²·(2π/3) = 355.306·2.094395 = 744.151 rad³/s³."""
    assert rattle_drive(6 * np.pi, 20 * np.pi / 30) == pytest.approx(744.1507, rel=1e-6)
    assert impacts_per_second(6 * np.pi) == pytest.approx(6.0)


@given(st.floats(0.1, 100.0), st.floats(0.01, 10.0), st.floats(1.0, 1e8))
def test_rattle_rises_20_db_a_decade_of_frequency_and_10_db_a_decade_of_swing(omega, swing, constant):
    base = rattle_level(omega, swing, constant)
    assert rattle_level(10 * omega, swing, constant) - base == pytest.approx(20.0)
    assert rattle_level(omega, 10 * swing, constant) - base == pytest.approx(10.0)
    assert rattle_level(omega, swing, 10 * constant) - base == pytest.approx(10.0)


@given(st.floats(-50.0, 150.0), st.floats(-50.0, 150.0))
def test_two_levels_add_as_powers(whine, rattle):
    found = total_level(whine, rattle)
    assert 10 ** (found / 10) == pytest.approx(10 ** (whine / 10) + 10 ** (rattle / 10))
    assert max(whine, rattle) - 1e-9 <= found <= max(whine, rattle) + 3.0103


def test_arrays_go_through():
    np.testing.assert_allclose(total_level([78.0, 0.0], [78.0, -400.0]), [81.0103, 0.0], atol=1e-4)
