"""The noise of an encoder is recovered from records whose noise is known; spectra are shaped here."""

import json

import numpy as np
import pytest

from gears3d.measured.noise import combined, estimate_noise, held_readings, without_repeats
from gears3d.measured.segmentation import path_of
from gears3d.verification.challenge.space import draw
from gears3d.verification.challenge.taking import take

STEP, COUNT = 2e-5, 250_000
TIME = np.arange(COUNT) * STEP
MOTION = 2.0 * TIME + 0.11 * np.sin(2 * np.pi * 3.0 * TIME)


def coloured(rng, density):
    """Noise of a one-sided power spectral density, ``density`` of frequency [Hz]."""
    frequency = np.fft.rfftfreq(COUNT, STEP)
    power = np.zeros(len(frequency))
    power[1:] = density(frequency[1:])
    waves = rng.normal(size=len(power)) + 1j * rng.normal(size=len(power))
    return np.fft.irfft(waves * np.sqrt(power * COUNT / (4.0 * STEP)), COUNT)


def close(value, truth, sigma):
    """Whether a value is within four of its standard deviations, and these are no tenth of it."""
    return abs(value - truth) < 4.0 * sigma and sigma < 0.1 * truth


@pytest.mark.parametrize("size", [1e-7, 1e-5])
def test_white_noise_is_recovered_and_no_other_is_seen(size):
    found = estimate_noise(TIME, MOTION + np.random.default_rng(3).normal(0.0, size, COUNT))
    assert close(found.white, size, found.sigmas["white"])
    assert found.flicker < 0.05 * size
    assert not found.periodic
    assert found.jitter < 1e-7
    assert found.held.samples == 1
    mean = 1e-3  # a mean over 50 readings
    assert found.sigma(mean) == pytest.approx(size / np.sqrt(50), rel=0.1)


@pytest.mark.parametrize("flicker", [3e-7, 1e-6, 3e-6])
@pytest.mark.parametrize("seed", [1, 2])
def test_flicker_of_shaped_spectrum_is_recovered_beneath_white_noise(flicker, seed):
    rng = np.random.default_rng(seed)
    noise = rng.normal(0.0, 1e-6, COUNT) + coloured(rng, lambda f: flicker**2 / f)
    found = estimate_noise(TIME, MOTION + noise)
    assert close(found.flicker, flicker, found.sigmas["flicker"])
    assert abs(found.white - 1e-6) < 4.0 * found.sigmas["white"]
    for size in (500, 5000):  # means over 10 ms and 100 ms
        means = noise[: COUNT // size * size].reshape(-1, size).mean(axis=1)
        assert np.std(means) == pytest.approx(found.sigma(size * STEP), rel=0.35)
        assert np.std(noise[size:] - noise[:-size]) == pytest.approx(found.deviation(size * STEP), rel=0.15)


@pytest.mark.parametrize(("rate", "hidden"), [(30.0, False), (300.0, True)])
def test_motion_that_hides_flicker_leaves_an_upper_bound(rate, hidden):
    """Lines of the slower motion were removed as errors of the encoder: it hid flicker as well."""
    rng = np.random.default_rng(3)
    bounces = 1e-3 * np.abs(np.sin(2.0 * np.pi * rate * TIME))
    noise = rng.normal(0.0, 1e-6, COUNT) + coloured(rng, lambda f: 1e-6**2 / f)
    found = estimate_noise(TIME, MOTION + bounces + noise)
    assert found.periodic == ()
    if hidden:
        assert found.flicker == 0.0
        assert 1e-6 < 2.0 * found.sigmas["flicker"] < 1e-4
    else:
        assert close(found.flicker, 1e-6, found.sigmas["flicker"])
    assert estimate_noise(TIME, MOTION + bounces + rng.normal(0.0, 1e-6, COUNT)).flicker == 0.0


def test_a_random_walk_is_recovered():
    rng = np.random.default_rng(4)
    walk = 5e-5
    noise = rng.normal(0.0, 1e-6, COUNT) + np.cumsum(rng.normal(0.0, walk * np.sqrt(STEP), COUNT))
    found = estimate_noise(TIME, MOTION + noise)
    assert abs(found.walk - walk) < 4.0 * found.sigmas["walk"] < walk


@pytest.mark.parametrize(("order", "size"), [(5000, 1e-6), (18000, 4e-7), (1024, 2e-6)])
def test_interpolation_errors_are_found_with_their_phase_and_removed(order, size):
    rng = np.random.default_rng(5)
    error = size * np.cos(order * MOTION + 1.0) + 0.5 * size * np.cos(2 * order * MOTION - 2.0)
    noise = rng.normal(0.0, 1e-6, COUNT)
    found = estimate_noise(TIME, MOTION + error + noise)
    seen = {one.order: one for one in found.periodic}
    assert set(seen) == {order, 2 * order}
    for one, amplitude, phase in ((seen[order], size, 1.0), (seen[2 * order], 0.5 * size, -2.0)):
        assert abs(one.amplitude - amplitude) < 4.0 * one.sigma < 0.3 * amplitude
        assert np.angle(np.exp(1j * (one.phase - phase))) == pytest.approx(0.0, abs=0.15)
    left = found.corrected(MOTION + error + noise) - MOTION - noise
    assert np.std(left) < 0.1 * np.std(error)


def test_repeats_are_left_out_also_where_a_counter_hardly_moves():
    """A gear that slows down to a count per sample repeats readings, too: every 11th of a record was kept for that."""
    rng, time, count = np.random.default_rng(17), np.arange(60_000) * 1.6e-4, 2.5e-4
    true = 11.1 * time - 8.9 / 66.5 * np.cos(66.5 * time)
    counted = np.floor((true + rng.normal(0.0, 1e-4, len(time))) / count) * count
    late = np.arange(11, len(time), 11)
    shown = counted.copy()
    shown[late] = shown[late - 1]
    kept, angle = without_repeats(time, shown, count)
    assert not np.any(np.isin(time[late], kept) & (true[late] - true[late - 1] > 1.5 * count))
    assert len(kept) > 0.87 * len(time)
    assert np.abs(angle + 0.5 * count - np.interp(kept, time, true)).max() < 3.0 * count
    assert len(without_repeats(time, counted, count)[0]) == len(time)


@pytest.mark.parametrize("every", [2, 3, 5])
def test_readings_of_a_slow_gear_on_a_counter_stay(every):
    """Its counts keep step with the samples: one count in each so many, less the last."""
    steps = np.tile(np.append(np.ones(every - 1), 0.0), 4000)
    angle = 1e-3 * np.cumsum(steps)
    assert len(without_repeats(np.arange(len(angle)) * 1e-4, angle, 1e-3)[0]) == len(angle)
    kept = without_repeats(np.arange(len(angle)) * 1e-4, 5.0 * angle, 1e-3)[0]  # five counts: the last is repeated
    assert len(kept) == len(angle) * (every - 1) // every


@pytest.mark.parametrize("every", [3, 4, 19])
def test_missed_updates_are_left_out_where_the_gear_passes_a_count_in_a_sample(every):
    """They were kept as those of a slow gear, and the drive had lines of their frequency as motion."""
    time, count = np.arange(60_000) * 1e-4, 2.5e-4
    shown = np.floor((2.3 * time - 0.004 * np.cos(136.0 * time)) / count) * count
    late = np.arange(every, len(time), every)
    shown[late] = shown[late - 1]
    kept = without_repeats(time, shown, count)[0]
    assert len(kept) == len(time) - len(late)
    assert not np.any(np.isin(time[late], kept))


@pytest.mark.parametrize("jitter", [3e-7, 1e-6])
def test_jitter_is_told_from_white_noise_by_the_speed(jitter):
    rng = np.random.default_rng(6)
    late = TIME + rng.normal(0.0, jitter, COUNT)
    angle = 2.0 * late + 0.11 * np.sin(2 * np.pi * 3.0 * late) + rng.normal(0.0, 1e-6, COUNT)
    found = estimate_noise(TIME, angle)
    assert close(found.jitter, jitter, found.sigmas["jitter"])


@pytest.mark.parametrize("samples", [2, 5])
def test_held_readings_show_their_update_rate(samples):
    rng = np.random.default_rng(7)
    angle = np.repeat((MOTION + rng.normal(0.0, 1e-6, COUNT))[::samples], samples)[:COUNT]
    found = held_readings(TIME, angle)
    assert found.samples == samples
    assert found.rate == pytest.approx(1.0 / (samples * STEP), rel=1e-3)
    assert found.share == pytest.approx(1.0 - 1.0 / samples, abs=1e-3)


def test_a_slow_counter_holds_nothing():
    assert held_readings(TIME, np.floor(MOTION / 1e-4) * 1e-4).samples == 1


def test_a_record_without_noise_has_none_but_its_rounding():
    found = estimate_noise(TIME, MOTION)
    assert 0.0 < found.white < 1e-11
    assert found.flicker == found.jitter == 0.0
    assert not found.periodic


def test_the_displacement_has_the_noise_of_both_and_json_holds_it():
    rng = np.random.default_rng(8)
    one, other = (estimate_noise(TIME, MOTION + rng.normal(0.0, size, COUNT)) for size in (3e-6, 4e-6))
    both = combined(one, other, (0.1, 0.1))
    assert both.white == pytest.approx(5e-7, rel=0.02)
    told = json.loads(json.dumps(both.describe()))
    low, high = told["white_rad"]["ci95"]
    assert low < 5e-7 < high


def test_an_interpolation_error_among_the_lines_of_a_motion_is_found():
    angle = 12.0 * TIME  # a motion of 31 periods in a revolution has lines at all multiples of 31
    turned = angle + 2e-4 * np.abs(np.sin(15.5 * angle)) + 1e-4 * np.abs(np.sin(15.5 * angle + 0.8))
    shown = turned + 2e-5 * np.cos(806.0 * turned) + np.random.default_rng(9).normal(0.0, 1e-6, COUNT)  # 806 = 26·31
    found = estimate_noise(TIME, shown, fluctuation=31.0).periodic
    assert [one.order for one in found] == [806]
    assert found[0].amplitude == pytest.approx(2e-5, rel=0.05)


@pytest.mark.parametrize("orders", [(), (810,)])
def test_lines_of_a_motion_that_repeats_after_two_periods_are_no_interpolation_errors(orders):
    """A rattle after four periods had a line at 107 in a revolution, which was removed as an error of the encoder."""
    angle = 12.0 * TIME  # of 30 periods in a revolution, with lines at all multiples of 15
    turned = angle + 2e-4 * np.abs(np.sin(7.5 * angle)) + 1e-4 * np.abs(np.sin(15.0 * angle + 0.8))
    error = sum(2e-5 * np.cos(order * turned) for order in orders)
    shown = turned + error + np.random.default_rng(9).normal(0.0, 1e-6, COUNT)
    assert [one.order for one in estimate_noise(TIME, shown, fluctuation=30.0).periodic] == [*orders]


def test_lines_of_a_free_motion_that_meet_whole_orders_are_no_interpolation_errors():
    """A rattle of 17.714 periods in a revolution of the loose gear has its lines 14, 21 and 28 at 248, 372 and 496."""
    taken = take(draw(14, 1)[13], dirt=False, samples=200_000)
    assert path_of(taken.record, taken.scenario).models[1].periodic == ()


@pytest.mark.parametrize("number", [1389, 1398, 1404, 1448])
def test_lines_of_a_motion_that_samples_show_as_whole_orders_are_no_interpolation_errors(number):
    """With 141 samples in a revolution, the sixth line of a rattle is the order 9036: 4 % of the backlash were removed.

    Encoders of these rigs have no such error.
    """
    rig = draw(number + 1, 1020)[number]
    for record in range(len(rig.conditions)):
        taken = take(rig, record, dirt=False, samples=100_000)
        assert [one.periodic for one in path_of(taken.record, taken.scenario).models] == [(), ()]


def test_a_shaft_too_fast_for_its_samples_shows_no_order_of_interpolation():
    """At 2000 samples a second and 3000 rpm every order looks like others: there was an IndexError."""
    time = np.arange(0.0, 2.0, 5e-4)
    angle = 100.0 * np.pi * time + 0.025 * np.sin(200.0 * np.pi * time)
    noise = np.random.default_rng(0).normal(0.0, 1e-5, len(time))
    found = estimate_noise(time, angle + noise)
    assert found.periodic == ()
    assert np.isfinite(found.white)


def test_waves_of_many_readings_are_found_among_impacts():
    """Sampled at 333 kHz, a line of a slow gear takes 400 readings: such errors were left, as large as a flight."""
    rng, time = np.random.default_rng(21), np.arange(500_000) * 3e-6
    motion = 3.6 * time + 5e-4 * np.abs(np.sin(2.0 * np.pi * 17.7 * time))
    error = 5e-6 * np.cos(1458 * motion + 0.3) + 2.5e-6 * np.cos(2916 * motion - 1.0)
    count = 9.64e-6
    shown = np.floor((motion + error + rng.normal(0.0, 3e-6, len(time))) / count) * count
    found = estimate_noise(time, shown, count / np.sqrt(12.0), fluctuation=31.2, count=count).periodic
    seen = {one.order: one.amplitude for one in found}
    assert set(seen) == {1458, 2916}
    assert seen[1458] == pytest.approx(5e-6, rel=0.1)
    none = np.floor((motion + rng.normal(0.0, 3e-6, len(time))) / count) * count
    assert estimate_noise(time, none, count / np.sqrt(12.0), fluctuation=31.2, count=count).periodic == ()
