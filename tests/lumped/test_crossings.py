"""Flights in closed form are those of the general way, which every step takes that holds samples."""

from math import pi

import numpy as np
import pytest

from gears3d.effects import Rig
from gears3d.lumped.model import model
from gears3d.lumped.run import run

RPM = pi / 30


def case(excitation, frequency, e=0.0, backlash=250e-6, start="active", mean=60.0, phase=0.0):
    rig = Rig(0.148, 0.148, 0.0695, 0.22, backlash, e, mean * RPM, 90, 90)
    swing = excitation * 0.22 / (0.0695 * 2 * pi * frequency)
    return model(rig, [(swing, frequency, phase)]), 12.0 / frequency, start


@pytest.mark.parametrize("excitation", [1.0001, 1.02, 1.2, 1.35, 1.5, 2.0, 4.0, 12.0, 60.0])
@pytest.mark.parametrize("frequency", [1.0, 5.0])
def test_both_ways_give_the_same_impacts(excitation, frequency):
    for e, start, backlash, phase in (
        (0.0, "active", 250e-6, 0.0),
        (0.0, "reverse", 60e-6, 2.0),
        (0.3, "active", 1e-3, 4.0),
    ):
        m, duration, begin = case(excitation, frequency, e, backlash, start, 90.0, phase)
        closed = run(m, duration, start=begin)
        general = run(m, duration, spacing=1e-4 / frequency, start=begin)
        assert closed.counters["impacts"] == general.counters["impacts"]
        one, other = closed.impacts, general.impacts
        np.testing.assert_allclose(one[:, 0], other[:, 0], rtol=1e-9, atol=1e-9 / frequency)
        np.testing.assert_array_equal(one[:, 1], other[:, 1])
        speed = np.abs(other[:, 2]).max(initial=1e-9)
        np.testing.assert_allclose(one[:, 2:4], other[:, 2:4], atol=1e-7 * speed)
        np.testing.assert_allclose(one[:, 6], other[:, 6], rtol=1e-6, atol=1e-12)


def test_a_period_of_two_crossings_takes_few_steps():
    m, duration, start = case(12.0, 3.0)
    closed, general = run(m, duration, start=start), run(m, duration, spacing=1e-3, start=start)
    assert closed.counters["steps"] <= 5 * 12 + 2 < general.counters["steps"]


def test_a_gear_that_would_stop_in_flight_goes_the_general_way():
    m, duration, start = case(12.0, 1.0, mean=3.0)
    closed, general = run(m, duration, start=start), run(m, duration, spacing=1e-3, start=start)
    np.testing.assert_allclose(closed.impacts[:, :4], general.impacts[:, :4], rtol=1e-7, atol=1e-10)
