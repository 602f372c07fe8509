"""Spectra of signals whose amplitudes are known: at constant speed, at changing speed, between bins, in noise."""

from math import pi

import numpy as np
import pytest
import scipy.interpolate
import scipy.signal  # noqa: F401  (here, so that no single example has to wait for it)
from hypothesis import given
from hypothesis import strategies as st

from gears3d.errors import UsageError
from gears3d.signals import frequency_spectrum, lines, order_spectrum, synchronous_average

TIME = np.arange(8000) / 4000.0


@given(st.floats(1e-9, 1e3), st.floats(20.0, 1900.0), st.floats(-3.1, 3.1), st.floats(-5.0, 5.0))
def test_a_sine_of_amplitude_a_reads_a_wherever_its_frequency_lies(size, frequency, phase, mean):
    found = frequency_spectrum(TIME, size * (mean + np.cos(2 * pi * frequency * TIME + phase)), "flattop")
    near = np.abs(found.at - frequency) < 2.0
    assert found.amplitude[near].max() == pytest.approx(size, rel=2e-3)
    assert found.amplitude[0] == pytest.approx(abs(size * mean), abs=0.01 * size)
    assert found.at[-1] == pytest.approx(2000.0)


@pytest.mark.parametrize(("window", "low"), [("hann", 0.8488), ("boxcar", 0.6366), ("flattop", 0.9990)])
def test_a_line_amid_two_bins_reads_as_low_as_stated(window, low):
    """Scalloping loss: 1.42 dB, 3.92 dB, 0.01 dB (Harris 1978, table I, for the first two)."""
    on, off = (frequency_spectrum(TIME, np.cos(2 * pi * f * TIME), window).amplitude.max() for f in (500.0, 500.25))
    assert on == pytest.approx(1.0, abs=1e-4)
    assert off == pytest.approx(low, abs=1e-3)


def test_parseval_with_a_boxcar():
    values = np.random.default_rng(3).normal(size=8000)
    found = frequency_spectrum(TIME, values, "boxcar").amplitude
    power = found[0] ** 2 + 0.5 * np.sum(found[1:-1] ** 2) + found[-1] ** 2
    assert power == pytest.approx(np.mean(values**2), rel=1e-12)


def test_uneven_samples_are_made_even():
    time = TIME + 5e-5 * np.sin(20 * TIME)
    found = frequency_spectrum(time, 0.7 * np.cos(2 * pi * 12 * time))
    assert lines(found, 1)[0] == pytest.approx((12.0, 0.7), rel=2e-3)


def swinging(orders, depth=0.3):
    """A gear that swings around its mean speed, and a signal of known orders of it."""
    angle = 2 * pi * (12.0 * TIME + depth * np.sin(2 * pi * 1.7 * TIME))
    return angle, sum(a * np.cos(k * angle + p) for k, a, p in orders)


def test_orders_read_true_at_changing_speed_where_frequencies_smear():
    angle, values = swinging([(1, 0.5, 0.3), (19, 0.2, -1.0), (40, 0.05, 2.0)])
    found = order_spectrum(angle, values)
    for order, size in ((1, 0.5), (19, 0.2), (40, 0.05)):
        assert found.amplitude[np.argmin(np.abs(found.at - order))] == pytest.approx(size, rel=2e-3)
    rest = np.min(np.abs(found.at[:, None] - np.array([0, 1, 19, 40])), axis=1) > 0.4
    assert found.amplitude[rest].max() < 1e-3
    assert frequency_spectrum(TIME, values).amplitude[100:].max() < 0.4 * 0.2


def test_orders_of_either_gear_are_told_apart_over_a_hunting_cycle():
    """A 19/37 pair comes back to itself after 37 revolutions of the drive gear, 19 of the loose gear."""
    turn = np.linspace(0.0, 1.0, 9001)
    drive = 2 * pi * 37 * (turn + 0.02 * np.sin(2 * pi * 3 * turn))
    loose = drive * 19 / 37
    values = 0.3 * np.cos(drive) + 0.2 * np.cos(loose + 1.0)
    found = order_spectrum(loose, values)
    assert lines(found, 2) == [pytest.approx((37 / 19, 0.3), rel=1e-3), pytest.approx((1.0, 0.2), rel=1e-3)]
    for angle, size, phase, count in ((drive, 0.3, 0.0, 37), (loose, 0.2, 1.0, 19)):
        mean = synchronous_average(angle, values, 64)
        np.testing.assert_allclose(mean.mean, size * np.cos(mean.angle + phase), atol=1e-3)
        assert mean.revolutions == count


def test_the_average_over_revolutions_sheds_noise_by_the_root_of_their_number():
    rng = np.random.default_rng(5)
    angle = np.linspace(0.0, 2 * pi * 400, 400 * 64 + 1)
    found = synchronous_average(angle, np.sin(3 * angle) + rng.normal(0.0, 1.0, len(angle)), 64)
    error = found.mean - np.sin(3 * found.angle)
    assert error.std() == pytest.approx(1 / np.sqrt(400), rel=0.3)
    assert found.deviation.mean() == pytest.approx(1.0, rel=0.05)


def test_the_average_starts_where_the_angle_is_a_whole_turn():
    angle = np.linspace(-1.0, 30.0, 4001)
    found = synchronous_average(angle, np.cos(angle - 0.4), 90)
    np.testing.assert_allclose(found.mean, np.cos(found.angle - 0.4), atol=1e-6)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: frequency_spectrum(TIME[:9], TIME[:9]), "16 samples"),
        (lambda: frequency_spectrum(TIME, TIME, "hamburger"), "no window 'hamburger'"),
        (lambda: order_spectrum(np.sin(TIME), TIME), "turns back"),
        (lambda: order_spectrum(TIME, TIME), "whole revolution"),
        (lambda: order_spectrum(1e4 * TIME, TIME), "samples a revolution"),
    ],
)
def test_what_cannot_be_analysed_is_refused_with_a_remedy(call, says):
    with pytest.raises(UsageError, match=says):
        call()


def test_lines_are_local_maxima_and_none_where_there_is_nothing():
    assert lines(frequency_spectrum(TIME, np.zeros(8000))) == []
    values = np.cos(2 * pi * 100 * TIME) + 0.1 * np.cos(2 * pi * 300 * TIME)
    assert [round(at) for at, _ in lines(frequency_spectrum(TIME, values))] == [100, 300]
