"""Closed-form flights: published numbers, and the equations of motion integrated step by step."""

from math import cos, inf, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from gears3d.laws import SineDrive, drift, landing

PULL = 0.22 * 0.148 / 0.0695


def swing(rpm, hertz):
    return SineDrive(0.148 * rpm * pi / 30, 2 * pi * hertz, PULL)


@pytest.mark.parametrize(
    ("rpm", "hertz", "backlash", "phases", "speeds"),
    [  # roots found to 30 digits (Rb = 0.148 m, J = 0.0695 kg m², Td = 0.22 N m)
        (4, 10, 200e-6, (1.691362, 2.796124, 4.591824, 5.670984), (32.3132, -33.9644)),
        (20, 3, 250e-6, (1.651065, 2.104635, 4.632121, 5.082921), (30.8581, -31.2425)),
        (5, 3, 250e-6, (1.897295, 2.648203, 4.385890, 5.105371), (18.0340, -19.6954)),
    ],
)
def test_crossings_to_every_digit(rpm, hertz, backlash, phases, speeds):
    drive = swing(rpm, hertz)
    assert drive.loss == pytest.approx((phases[0], phases[2]), abs=6e-7)
    for flank, begin in enumerate(drive.loss):
        hit = landing(drive, begin, backlash * flank, backlash * (1 - flank))
        assert hit.flank == 1 - flank
        assert begin + drive.omega * hit.time == pytest.approx(phases[2 * flank + 1], abs=6e-7)
        assert hit.velocity * 1e3 == pytest.approx(speeds[flank], abs=6e-5)


def test_a_flight_that_falls_back():
    drive = swing(5, 1)
    hit = landing(drive, drive.loss[0], 0.0, 250e-6)
    assert drive.excitation == pytest.approx(1.039299, abs=6e-7)
    assert drive.loss[0] == pytest.approx(2.865716, abs=6e-7)
    assert drive.loss[0] + drive.omega * hit.time == pytest.approx(3.974947, abs=6e-7)
    assert (hit.flank, hit.lowest) == (0, 0.0)
    assert hit.velocity * 1e3 == pytest.approx(-4.23930, abs=6e-6)
    assert hit.highest * 1e6 == pytest.approx(79.96, abs=6e-3)


@given(
    excitation=st.floats(0.05, 60), phase=st.floats(0, 2 * pi), reach=st.floats(0.01, 30), share=st.floats(0.05, 0.95),
    launch=st.floats(-1, 1),
)  # fmt: skip
@settings(max_examples=25, deadline=None)
def test_the_first_touch_is_the_one_that_a_fine_integration_finds(excitation, phase, reach, share, launch):
    """No touch is passed over: up to it no sample of an independent integration lies beyond a flank."""
    drive = SineDrive(1.0, 1.0, 1.0 / excitation)
    active, reverse = share * reach, (1 - share) * reach
    hit = landing(drive, phase, active, reverse, launch, longest=100.0)
    end = hit.time if hit else 100.0

    def right(t, y):
        return [y[1], -drive.pull - cos(phase + t)]

    theirs = solve_ivp(right, (0, end), [0.0, launch], "DOP853", rtol=1e-12, atol=1e-13, dense_output=True)
    inside = theirs.sol(np.linspace(0, end, 4000))[0]
    assert inside.max() < reverse + 1e-8
    assert inside.min() > -active - 1e-8
    if hit:
        assert theirs.y[0, -1] == pytest.approx((-active, reverse)[hit.flank], abs=1e-8)
        assert theirs.y[1, -1] == pytest.approx(hit.velocity, abs=1e-8)
        assert hit.highest == pytest.approx(max(inside.max(), 0.0), abs=1e-3 * reach)
        assert hit.lowest == pytest.approx(min(inside.min(), 0.0), abs=1e-3 * reach)


def test_drift_keeps_its_digits_where_the_flight_is_short():
    """Loss phase: the first three powers of time cancel; the fourth is left."""
    drive, time = SineDrive(1.0, 1.0, 0.0), 1e-4
    displacement, velocity = drift(drive, pi / 2, time)
    assert displacement == pytest.approx(time**3 / 6, rel=1e-9)
    assert velocity == pytest.approx(1 - sin(pi / 2 + time), rel=1e-8)


def test_the_limits():
    assert SineDrive(1.0, 1.0, 0.0).excitation == inf
    assert SineDrive(1.0, 1.0, 0.0).loss == pytest.approx((pi / 2, 3 * pi / 2))
    assert SineDrive(0.5, 1.0, 1.0).loss == (pi, pi)
    assert landing(SineDrive(0.0, 1.0, 0.0), 0.0, 1.0, 1.0) is None
    fall = landing(SineDrive(0.0, 1.0, 2.0), 0.0, 1.0, 1.0)
    assert (fall.time, fall.flank, fall.velocity) == (pytest.approx(1.0), 0, pytest.approx(-2.0))
    assert landing(SineDrive(0.0, 1.0, 2.0), 0.0, 1.0, 1.0, longest=0.9) is None


@given(excitation=st.floats(1.001, 1e4), backlash=st.floats(1e-4, 100))
@settings(max_examples=60, deadline=None)
def test_what_leaves_the_reverse_flank_always_reaches_the_active_one(excitation, backlash):
    """The sine lies above its tangent at the loss for ever, so the relative speed never turns round."""
    drive = SineDrive(1.0, 1.0, 1.0 / excitation)
    assert landing(drive, drive.loss[1], backlash, 0.0).flank == 0
