"""The run in closed form is the run over power series, which an effect of no size brings about."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gears3d.effects import Gate, Rig, torque_constant, torque_friction, torque_power
from tests.lumped.rig import model, run

RPM = pi / 30
NOTHING = torque_power(0.0, 1.0)
EFFECTS = (
    [],
    [torque_friction(0.1)],
    [torque_constant(0.1, Gate.CONTACT)],
    [torque_constant(0.1, Gate.ACTIVE)],
    [torque_constant(0.1, Gate.FLIGHT), torque_friction(0.05)],
)


def both(harmonics, duration, spacing, start="active", e=0.0, backlash=250e-6, mean=60.0, drag=0.22, rows=()):
    """Return the outcomes of both ways."""
    rig = Rig(0.148, 0.148, 0.0695, drag, backlash, e, mean * RPM, 90, 90)
    closed, general = (model(rig, harmonics, [*rows, *more]) for more in ([], [NOTHING]))
    assert closed.has_closed_form()
    assert not general.has_closed_form()
    return run(closed, duration, spacing, start), run(general, duration, spacing, start)


@pytest.mark.parametrize("excitation", [1.0001, 1.02, 1.2, 1.35, 1.5, 2.0, 4.0, 12.0, 60.0])
@pytest.mark.parametrize("frequency", [1.0, 5.0])
def test_both_ways_give_the_same_impacts(excitation, frequency):
    swing = excitation * 0.22 / (0.0695 * 2 * pi * frequency)
    for e, start, backlash, phase in (
        (0.0, "active", 250e-6, 0.0),
        (0.0, "reverse", 60e-6, 2.0),
        (0.3, "active", 1e-3, 4.0),
    ):
        sine = [(swing, frequency, phase)]
        closed, general = both(sine, 12.0 / frequency, 0.01 / frequency, start, e, backlash, 90.0)
        assert closed.counters["impacts"] == general.counters["impacts"]
        one, other = closed.impacts, general.impacts
        np.testing.assert_allclose(one[:, 0], other[:, 0], rtol=1e-9, atol=1e-9 / frequency)
        np.testing.assert_array_equal(one[:, 1], other[:, 1])
        speed = np.abs(other[:, 2]).max(initial=1e-9)
        np.testing.assert_allclose(one[:, 2:4], other[:, 2:4], atol=1e-7 * speed)
        np.testing.assert_allclose(one[:, 6], other[:, 6], rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(closed.contacts, general.contacts, rtol=1e-9, atol=1e-9 / frequency)
        np.testing.assert_allclose(closed.samples, general.samples, rtol=1e-8, atol=1e-7 * speed)


@settings(max_examples=100, deadline=None)
@given(
    e=st.sampled_from([0.0, 0.3, 0.7, 0.95]),
    drag=st.sampled_from([0.0, 0.05, 0.22, 1.0]),
    rpm=st.sampled_from([0.0, 0.01, 3.0, 20.0, 40.0]),
    mean=st.sampled_from([-60.0, -5.0, 0.0, 5.0, 60.0]),
    backlash=st.sampled_from([1e-5, 250e-6, 1e-3]),
    frequency=st.sampled_from([1.0, 20.0]),
    phase=st.floats(0.0, 6.0),
    start=st.sampled_from(["active", "reverse", "free"]),
    rows=st.sampled_from(EFFECTS),
)
def test_both_ways_give_the_same_motion(e, drag, rpm, mean, backlash, frequency, phase, start, rows):
    """Drives that turn round, loose gears at rest, flanks that torques of flight press on; over two periods."""
    sine = [(rpm * RPM, frequency, phase)] if rpm else []
    closed, general = both(sine, 2.0 / frequency, 0.004 / frequency, start, e, backlash, mean, drag, rows)
    np.testing.assert_allclose(closed.samples[:, 5], general.samples[:, 5], atol=1e-6 * backlash)
    np.testing.assert_allclose(closed.samples[:, [0, 1, 3]], general.samples[:, [0, 1, 3]], rtol=1e-12, atol=1e-12)


def test_samples_do_not_change_the_motion():
    rig = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, 0.7, 30 * RPM, 90, 90)
    m = model(rig, [(20 * RPM, 3.0, 0.0)])
    plain, sampled = run(m, 5.0), run(m, 5.0, 1e-4)
    np.testing.assert_array_equal(plain.impacts, sampled.impacts)
    np.testing.assert_array_equal(plain.contacts, sampled.contacts)
    assert plain.counters == sampled.counters


def test_a_period_of_two_crossings_takes_few_steps():
    swing = 12.0 * 0.22 / (0.0695 * 2 * pi * 3.0)
    closed, general = both([(swing, 3.0, 0.0)], 4.0, 1e-3)
    assert closed.counters["steps"] <= 5 * 12 + 2 < general.counters["steps"]
