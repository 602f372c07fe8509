"""The dimensionless form: forcing against numerical derivatives, thresholds to every digit, synthesis of the error."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gears3d.laws import Orders, averaged, ottewill, strongest_orders

ERROR = Orders(np.array([1, 2, 18]), np.array([3e-4, 5e-5, 2e-5]), np.array([0.4, -1.0, 2.0]))


@given(st.floats(0.0, 0.6), st.floats(0.0, 6.28), st.floats(0.0, 6.0))
def test_forcing_is_what_the_motion_asks_for(amplitude, phase, damping):
    step = 1e-3
    tau = np.linspace(0.0, 1.0, 40, endpoint=False)

    def carried(at):
        angle = ottewill.drive(at, amplitude, phase)
        return angle - ERROR.at(angle)

    weights = {-2: (-1, 1), -1: (16, -8), 0: (-30, 0), 1: (16, 8), 2: (-1, -1)}
    second = sum(w[0] * carried(tau + k * step) for k, w in weights.items()) / (12 * step**2)
    first = sum(w[1] * carried(tau + k * step) for k, w in weights.items()) / (12 * step)
    found = ottewill.forcing(tau, amplitude, phase, damping, ERROR)
    assert found == pytest.approx(second + damping * first, abs=2e-3)


def test_thresholds_to_six_digits():
    assert ottewill.loss_amplitude([2.3, 3.7, 4.2]) == pytest.approx([0.343749, 0.507429, 0.555727], abs=5e-7)


@given(st.floats(0.1, 8.0), st.floats(0.0, 6.28))
def test_at_the_threshold_the_push_just_reaches_zero(damping, phase):
    tau = np.linspace(0.0, 1.0, 20_000)
    push = ottewill.forcing(tau, float(ottewill.loss_amplitude(damping)), phase, damping)
    assert abs(push.min()) < 1e-6 * damping


@given(st.floats(0.1, 8.0), st.floats(0.01, 2.0))
def test_damping_keeps_the_gears_together(damping, more):
    assert ottewill.loss_amplitude(damping) < ottewill.loss_amplitude(damping + more) < 1.0


def test_rig_in_si_by_hand():
    rig = ottewill.dimensional(2.3, 4.2, 1.63e-2, 0.02, 2.0, 0.05)
    assert tuple(rig) == pytest.approx((0.02, 0.092, 0.076, 1.63e-3), rel=1e-12)
    assert ottewill.displacement(0.0163 - 0.01, 0.0163, 0.05) == pytest.approx(5e-4, rel=1e-12)


def test_run_down_gives_its_damping_back():
    tau = np.linspace(0.0, 1.5, 400)
    angle = ottewill.rundown_angle(7.0, 4.2, tau)
    assert ottewill.rundown_damping(tau, angle, 7.0) == pytest.approx(np.full(400, 4.2), rel=1e-9)
    # at tau = 1: 7*(1 - exp(-4.2)) = 7*(1 - 0.0149956)
    assert ottewill.rundown_angle(7.0, 4.2, 1.0) == pytest.approx(6.895031, rel=1e-6)


def test_error_function_and_its_derivatives_by_hand():
    one = Orders(np.array([2]), np.array([3.0]), np.array([0.5]))
    assert one.at(0.25) == pytest.approx(3 * np.cos(1.0), rel=1e-12)
    assert one.at(0.25, 1) == pytest.approx(-6 * np.sin(1.0), rel=1e-12)
    assert one.at(0.25, 2) == pytest.approx(-12 * np.cos(1.0), rel=1e-12)
    assert one.at(np.zeros((2, 3))).shape == (2, 3)


def test_averaging_25_revolutions_sees_beneath_the_encoder_step():
    step, angle = 1.57e-4, 2 * np.pi * np.arange(1000) / 1000
    truth = ERROR.at(angle)
    noise = np.random.default_rng(3).normal(0.0, step / 2, (25, 1000))
    read = np.round((truth + noise) / step) * step
    single, mean = read[0], averaged(read.ravel(), 25)
    assert np.std(single - truth) > 0.4 * step
    assert np.std(mean - truth) < 0.15 * step
    found = strongest_orders(mean, 21)
    assert found.order[0] == 1
    assert len(found.order) == 21
    assert np.std(found.at(angle) - (truth - truth.mean())) < 0.06 * step
    assert found.amplitude[0] == pytest.approx(3e-4, rel=0.03)


def test_all_orders_of_a_clean_error_come_back():
    found = strongest_orders(ERROR.at(2 * np.pi * np.arange(1000) / 1000), 3)
    assert found.order.tolist() == [1, 2, 18]
    assert found.amplitude == pytest.approx(ERROR.amplitude, rel=1e-9)
    assert found.phase == pytest.approx(ERROR.phase, rel=1e-9)


def test_samples_that_fill_no_whole_revolutions_are_refused():
    with pytest.raises(ValueError, match="no whole number"):
        averaged(np.zeros(10), 3)
