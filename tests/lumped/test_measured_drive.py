"""Measured drive motion: a record of sines drives like the sines; noise is smoothed; bad records are refused."""

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.scenario import load
from gears3d.scenario.drive_record import drive_record
from gears3d.simulation import simulate

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
MEAN, SIZE, OMEGA = np.pi, 2 * np.pi / 3, 6 * np.pi


def angle(t):
    return MEAN * t - SIZE / OMEGA * (np.cos(OMEGA * t) - 1)


def written(folder, time, theta):
    path = folder / "drive.csv"
    np.savetxt(path, np.c_[time, theta], delimiter=",", header="time_s,theta_drive_rad", comments="", fmt="%.17g")
    return path


def following(path, *more):
    return load(FIG5, ["run.duration=1.5 s", f'motion.record="{path}"', *more])


def test_a_record_of_sines_drives_like_the_sines(tmp_path):
    time = np.linspace(0.0, 1.6, 1601)
    found = simulate(following(written(tmp_path, time + 5.0, angle(time) + 1.0)), "rigid")
    sines = simulate(load(FIG5, ["run.duration=1.5 s"]), "rigid")
    assert len(found.impacts["time_s"]) == len(sines.impacts["time_s"]) > 20
    assert np.abs(found.impacts["time_s"] - sines.impacts["time_s"]).max() < 1e-7
    assert np.allclose(found.impacts["velocity_m_s"], sines.impacts["velocity_m_s"], rtol=1e-4, atol=1e-7)
    for name in ("phase_rad", "tooth_drive", "tooth_loose"):
        assert np.allclose(found.impacts[name], sines.impacts[name], atol=1e-5)
    for name in ("theta_drive_rad", "omega_drive_rad_s", "theta_loose_rad"):
        assert np.abs(found.signals[name] - sines.signals[name]).max() < 1e-6


def test_noise_is_smoothed_without_a_shift(tmp_path):
    time = np.linspace(0.0, 1.6, 16001)
    noisy = angle(time) + 2e-5 * np.random.default_rng(1).standard_normal(len(time))
    scenario = following(written(tmp_path, time, noisy), "motion.bandwidth=40 Hz")
    record = drive_record(scenario)
    inside = (record.time > 0.1) & (record.time < 1.5)
    off = (record.theta - angle(record.time))[inside]
    assert np.abs(off - off.mean()).max() < 5 * 2e-5 * np.sqrt(40 / 5000)
    found = simulate(scenario, "rigid")
    sines = simulate(load(FIG5, ["run.duration=1.5 s"]), "rigid")
    first = [r.impacts["velocity_m_s"][r.impacts["flight_height_m"] > 2e-4] for r in (found, sines)]
    assert len(first[0]) == len(first[1]) > 6
    assert np.abs(first[0][1:-1] / first[1][1:-1] - 1).max() < 0.03


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda t, a: (t[:900], a[:900]), "lasts 0.899 s, the run 1.5 s"),
        (lambda t, a: (np.where(t == t[7], t[3], t), a), "does not rise after row 7"),
        (lambda t, a: (t, np.where(t == t[7], np.nan, a)), "not finite in row 8"),
        (lambda t, a: (t[:5], a[:5]), "has 5 samples"),
    ],
)
def test_bad_records_are_refused(tmp_path, spoil, said):
    time = np.linspace(0.0, 1.6, 1601)
    scenario = following(written(tmp_path, *spoil(time, angle(time))))
    with pytest.raises(InputError, match=said):
        simulate(scenario, "rigid")


def test_a_bandwidth_beyond_the_record_is_refused(tmp_path):
    time = np.linspace(0.0, 1.6, 1601)
    with pytest.raises(InputError, match="half the record's sample rate"):
        drive_record(following(written(tmp_path, time, angle(time)), "motion.bandwidth=500 Hz"))


@pytest.mark.parametrize("noise", [2e-7, 2e-5])
def test_noise_is_smoothed_where_nobody_says_how(tmp_path, noise):
    time = np.linspace(0.0, 4.0, 80_001)
    noisy = angle(time) + noise * np.random.default_rng(2).standard_normal(len(time))
    record = drive_record(following(written(tmp_path, time, noisy)))
    assert 9.0 < record.bandwidth < 100.0  # 3 Hz, and as far as half a second tells them apart
    inside = (record.time > 0.2) & (record.time < 3.8)
    off = np.diff(record.theta - angle(record.time), 2)[inside[1:-1]] / record.time[1] ** 2
    assert np.abs(off).max() < 0.02 * SIZE * OMEGA


def test_what_has_no_noise_stays_as_it_is(tmp_path):
    time = np.linspace(0.0, 1.6, 16_001)
    record = drive_record(following(written(tmp_path, time, angle(time))))
    assert record.bandwidth is None
    assert np.array_equal(record.theta, angle(time) - angle(time)[0])


def test_an_encoders_record_drives_like_its_bench(tmp_path):
    from gears3d.simulation import record

    bench = load(FIG5, ["run.duration=6 s"])
    path = tmp_path / "rattle.parquet"
    record(bench).write(path)
    found = simulate(bench.with_({"motion": {"record": str(path)}}), "rigid")
    true = simulate(bench, "rigid")
    high = [one.impacts["velocity_m_s"][one.impacts["flight_height_m"] > 2e-4] for one in (found, true)]
    assert len(high[0]) == len(high[1]) > 30
    assert np.abs(high[0][1:-1] / high[1][1:-1] - 1.0).max() < 0.01
