"""The drive's motion as its encoder measured it, on angles whose motion is known in closed form."""

from math import pi

import numpy as np
import pytest

from gears3d.measured.checks import admit
from gears3d.measured.drive_motion import Smoothing, drive_motion, motion_of, steady
from gears3d.measured.encoder import model_noise, read_encoder
from gears3d.recording import Recording
from gears3d.scenario import load

BENCH = "scenarios/rigaud-2020/fig5-20rpm.toml"


def angle_of(time, mean, waves, slope=0.0):
    angle = mean * time + 0.5 * slope * time**2
    for amplitude, frequency, phase in waves:
        angle = angle - amplitude / (2 * pi * frequency) * np.cos(2 * pi * frequency * time + phase)
    return angle


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(3)
    held, time = [], np.arange(0.0, 6.0, 2e-4)
    for _ in range(60):
        mean, frequency = rng.uniform(5.0, 60.0), rng.uniform(2.0, 30.0)
        amplitude, phase = rng.uniform(0.02, 0.5) * mean, rng.uniform(0.0, 2 * pi)
        angle = angle_of(time, mean, [(amplitude, frequency, phase)]) + rng.normal(0.0, 1e-3, len(time))
        found = drive_motion(time, angle)
        (one,) = found.harmonics
        limits = found.to_dict()
        rows = [(limits["mean_rad_s"], mean), (limits["harmonics"][0]["frequency_Hz"], frequency),
                (limits["harmonics"][0]["amplitude_rad_s"], amplitude)]  # fmt: skip
        held.append([low <= true <= high for (low, high), true in ((row["ci95"], true) for row, true in rows)])
        assert np.cos(one.phase - phase) > 0.99
        assert one.order == pytest.approx(2 * pi * frequency / mean, rel=1e-3)
    assert np.all(np.mean(held, axis=0) >= 0.9)


@pytest.mark.slow
def test_integrated_noise_makes_no_harmonic():
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 6.0, 1e-3)
    found = [drive_motion(time, 10.0 * time + np.cumsum(rng.normal(0.0, 1e-4, len(time)))) for _ in range(60)]
    assert sum(bool(one.harmonics) for one in found) <= 1


def test_harmonics_of_the_drive_and_a_period_that_the_slowest_sets():
    time = np.arange(0.0, 10.0, 1e-3)
    waves = [(1.0, 4.0, 0.3), (2.0, 8.0, 1.0), (0.1, 9.7, 2.0)]
    found = drive_motion(time, angle_of(time, 30.0, waves))
    assert [one.frequency for one in found.harmonics] == pytest.approx([4.0, 8.0, 9.7], rel=1e-6)
    assert found.period == pytest.approx(0.25)


def test_errors_of_a_drive_are_those_of_its_harmonics():
    time, rng = np.arange(0.0, 10.0, 1e-3), np.random.default_rng(11)
    angle = angle_of(time, 30.0, [(1.0, 4.0, 0.3), (0.2, 8.0, 1.0)]) + rng.normal(0.0, 1e-4, len(time))
    reading = read_encoder(time, angle)
    curve = steady(reading, motion_of(reading)).curve
    some, step = np.linspace(2.0, 8.0, 500), 1e-4
    found = [curve.errors(some, order) for order in range(3)]
    for order in (0, 1):
        slope = (curve.errors(some + step, order) - curve.errors(some - step, order)) / (2.0 * step)
        assert slope == pytest.approx(found[order + 1], abs=0.01 * np.abs(found[order + 1]).max())
    waves = curve.waves
    turned = waves.turns * (1.0 + 1e-9)
    middle = 0.5 * (time[0] + time[-1])
    other = waves._replace(turns=turned, phases=waves.phases - (turned - waves.turns) * middle)
    by = (other.at(some) - waves.at(some)) * waves.turn_sigma / (1e-9 * waves.turns[0])
    assert found[0][-1] == pytest.approx(by, abs=1e-3 * np.abs(by).max())
    missed = curve(time) - angle_of(time, 30.0, [(1.0, 4.0, 0.3), (0.2, 8.0, 1.0)])
    inner = slice(len(time) // 10, -len(time) // 10)
    own = curve.errors(time[inner])
    sizes = np.linalg.lstsq(np.vstack([own, time[None, inner], np.ones((1, len(time[inner])))]).T, missed[inner])[0]
    assert np.sum(sizes[: len(own)] ** 2) < 3.0 * len(own)


def test_missing_readings_make_no_harmonic():
    """Means of readings of which every 18th is missing cover uneven times: 4 µrad at 573 Hz came of it."""
    rng, time = np.random.default_rng(13), np.arange(200_000) / 19_902.0
    time = time[np.arange(len(time)) % 18 != 17]
    waves = [(16.37, 30.4, 0.3), (0.8185, 60.8, 1.0), (0.8185, 91.2, 2.0)]
    found = drive_motion(time, angle_of(time, 382.0, waves) + rng.normal(0.0, 1.3e-6, len(time)))
    assert [one.frequency for one in found.harmonics] == pytest.approx([30.4, 91.2, 60.8], rel=1e-6)
    assert [one.amplitude for one in found.harmonics] == pytest.approx([16.37, 0.8185, 0.8185], rel=1e-3)


def test_a_run_up_is_reported_with_its_speeds():
    time = np.arange(0.0, 12.0, 1e-3)
    found = drive_motion(time, angle_of(time, 10.0, [(3.0, 5.0, 0.0)], slope=2.0))
    assert found.runs_up
    assert found.speeds == pytest.approx((10.0, 34.0), rel=1e-3)
    assert found.harmonics[0].amplitude == pytest.approx(3.0, rel=1e-3)
    assert not drive_motion(time, angle_of(time, 10.0, [(3.0, 5.0, 0.0)])).runs_up


def test_what_a_map_states_of_the_motion_and_no_more_is_taken_from_the_rig(tmp_path):
    time = np.arange(0.0, 4.0, 1e-3)
    drive = angle_of(time, 3.0, [(0.8, 5.0, 0.0)])
    signals = {"time_s": time, "theta_drive_rad": drive, "theta_loose_rad": drive}
    Recording(signals, {}, {}).write(tmp_path / "r.parquet")
    bench = load(BENCH)

    def motion_of(text, **options):
        chart = tmp_path / "record.toml"
        roles = {"time": "time_s", "drive": "theta_drive_rad", "loose": "theta_loose_rad"}
        names = "".join(f'[{role}]\nchannel = "{name}"\n' for role, name in roles.items())
        chart.write_text(f'format = 1\nfile = "r.parquet"\n{names}[condition]\n{text}\n')
        return admit(tmp_path / "r.parquet", bench, chart, **options)

    free = motion_of("")
    assert not free.stated
    assert free.rig.motion.mean == pytest.approx(3.0, rel=1e-4)
    assert free.rig.motion.harmonics[0].frequency == pytest.approx(5.0, rel=1e-6)
    partly = motion_of('motion.mean = "29 rpm"')
    assert partly.rig.motion.mean == pytest.approx(29.0 * pi / 30.0)
    assert partly.rig.motion.harmonics[0].frequency == pytest.approx(5.0, rel=1e-6)
    stated = motion_of("", stated_motion=True)
    assert stated.rig.motion == bench.motion
    assert stated.motion.mean == pytest.approx(3.0, rel=1e-4)


def swinging(noise, held=1):
    """Times and counted angles of a drive whose second harmonic is a fifth of a count."""
    count, time = 1e-4, np.arange(0.0, 4.0, 1e-4)
    angle = 31.7 * time - 2e-4 * np.cos(2.0 * np.pi * 40.0 * time) - 2e-5 * np.cos(2.0 * np.pi * 80.0 * time + 0.7)
    angle = np.floor((angle + noise * np.random.default_rng(3).standard_normal(len(time))) / count) * count
    return time, np.repeat(angle[::held], held)[: len(time)]


@pytest.mark.parametrize("noise", [0.0, 2e-4])
def test_a_multiple_of_the_fluctuation_is_found_below_a_count(noise):
    found = drive_motion(*swinging(noise)).harmonics
    small = next(one for one in found if abs(one.frequency - 80.0) < 0.5)
    assert small.amplitude == pytest.approx(2e-5 * 2.0 * np.pi * 80.0, rel=0.2)


def test_counts_of_which_thousands_pass_in_a_sample_make_no_harmonics():
    # steps of 2033 to 2035 counts: lines of rounding, 0.04 counts each, were harmonics of 2 % of the drive's speed
    count, time = 2.0 * pi / 2_403_497, np.arange(0.0, 2.0, 1.0 / 87_360.8)
    angle = 64.9 + angle_of(time, 464.43, [(0.1152, 443.497, 0.0)])
    (one,) = motion_of(read_encoder(time, np.floor(angle / count) * count)).harmonics
    assert one.frequency == pytest.approx(443.497, rel=1e-6)
    assert one.amplitude == pytest.approx(0.1152, rel=1e-3)


def test_held_readings_make_no_lines_of_their_own():
    found = drive_motion(*swinging(2e-4, held=7)).harmonics
    assert found[0].frequency == pytest.approx(40.0, abs=0.01)
    assert all(one.frequency < 200.0 for one in found)


@pytest.mark.parametrize("every", [10, 11])
def test_readings_that_repeat_regularly_make_no_lines_where_noise_hides_them(every):
    """Two counts pass in a sample, and noise of 0.6 counts makes many steps of one: repeats seemed to be chance."""
    time, count = np.arange(179_000) / 55_137.0, 2.0 * np.pi / 29_357
    angle = angle_of(time, 25.04, [(0.39, 49.106, 0.0)])
    noise = 0.61 * count * np.random.default_rng(5).standard_normal(len(time))
    shown = np.floor((angle + noise) / count) * count
    late = np.arange(every, len(time), every)
    shown[late] = shown[late - 1]
    found = drive_motion(time, shown).harmonics
    assert [round(one.frequency, 1) for one in found] == [49.1]
    assert found[0].amplitude == pytest.approx(0.39, abs=3.0 * found[0].amplitude_sigma)


@pytest.mark.parametrize("lines", [1424, 5300])
def test_interpolation_errors_are_no_harmonics_even_where_lines_pass_faster_than_samples(lines):
    """Once and twice per line, at up to four a sample, which the fluctuation spreads over many frequencies."""
    rng, time = np.random.default_rng(6), np.arange(0.0, 2.0, 1.15e-4)
    waves = [(0.47, 43.2, 0.0), (0.0235, 86.4, 1.0), (0.0235, 129.6, -2.0)]
    true = angle_of(time, 22.2, waves)
    wrong = 2.0 * pi / lines * 7e-3 * (np.cos(lines * true + 0.3) + 0.5 * np.cos(2 * lines * true + 1.0))
    count = 2.0 * pi / (24 * lines)
    angle = np.floor((true + wrong + rng.normal(0.0, 2e-5, len(time))) / count) * count
    reading, model = model_noise(read_encoder(time, angle))
    assert [one.order for one in model.periodic] == [lines, 2 * lines]
    found = motion_of(reading).harmonics
    assert sorted(one.frequency for one in found) == pytest.approx([43.2, 86.4, 129.6], rel=1e-4)
    sizes = {round(one.frequency / 43.2): one for one in found}
    assert all(abs(sizes[k].amplitude - 0.0235) < 4.0 * sizes[k].amplitude_sigma for k in (2, 3))


@pytest.mark.slow
def test_a_slight_multiple_of_the_fluctuation_is_found():
    """Five and a half standard deviations: a line of any frequency would need more."""
    rng, time, found = np.random.default_rng(8), np.arange(0.0, 2.0, 5e-5), 0
    sigma = 3e-4 * np.sqrt(2.0 / len(time))  # of an amplitude
    for _ in range(20):
        small = 5.5 * sigma * 2.0 * pi * 120.0
        angle = angle_of(time, 20.0, [(0.3, 40.0, 0.0), (small, 120.0, rng.uniform(0.0, 2.0 * pi))])
        motion = drive_motion(time, angle + rng.normal(0.0, 3e-4, len(time)))
        found += any(one.frequency == pytest.approx(120.0, rel=1e-4) for one in motion.harmonics)
    assert found >= 15


@pytest.mark.parametrize(("counts", "rate", "seed"), [(125_030, 6733.2, 0), (65_538, 4000.0, 1)])
def test_a_fluctuation_locked_to_the_rotation_is_no_error_of_coarsely_sampled_counts(counts, rate, seed):
    # on whole counts, waves of nearly as many orders as counts look like those of the rotation's second order
    rng, time = np.random.default_rng(seed), np.arange(0.0, 2.0, 1.0 / rate)
    mean = 526.0
    angle = angle_of(time, mean, [(0.59, mean / pi, 0.3)]) + rng.normal(0.0, 2e-6, len(time))
    count = 2.0 * pi / counts
    reading = read_encoder(time, np.floor(angle / count) * count)
    assert reading.quantum == pytest.approx(count)
    assert not model_noise(reading)[1].periodic
    first = motion_of(reading).harmonics[0]
    assert first.order == pytest.approx(2.0, rel=1e-3)
    assert first.amplitude == pytest.approx(0.59, rel=0.01)


def test_a_harmonic_beneath_the_lines_of_counts_may_be_as_large_as_it_fits():
    mean, frequency, time = 175.8118, 367.12374, np.arange(0.0, 2.0, 3.4755e-5)
    small = [(0.0088, 2 * frequency, 0.7), (0.0088, 3 * frequency, -1.8)]
    angle, count = angle_of(time, mean, [(0.176, frequency, 0.0), *small]), 2.02e-4
    found = motion_of(read_encoder(time, np.floor(angle / count) * count))
    assert found.harmonics[0].frequency == pytest.approx(frequency, rel=1e-5)
    known = {round(one.frequency / frequency): one.amplitude for one in (*found.harmonics[1:], *found.hidden)}
    for (amplitude, _, _), times in zip(small, (2, 3), strict=True):
        assert known[times] == pytest.approx(amplitude, rel=0.5)


def test_smoothing_has_the_ends_of_a_record_whose_last_mean_is_complete():
    """Fewer readings in each mean end later than the knots of the curve."""
    time = np.arange(19 * 3000) * 2e-5
    noise = 1e-4 * np.random.default_rng(1).standard_normal(len(time))
    reading = read_encoder(time, 30.0 * time + 0.01 * np.sin(50.0 * time) + noise)
    smoothing = Smoothing(reading, steady(reading))
    through = smoothing(np.sin(50.0 * smoothing.time))
    inner = time[2000:-2000]
    assert np.max(np.abs(through(inner, 0) - np.sin(50.0 * inner))) < 1e-3
