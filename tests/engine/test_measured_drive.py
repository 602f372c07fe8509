"""Measured drive motion in the engine: its spline, the record of sines beside the sines, the twin, bad records."""

import numpy as np
import pytest

from gears3d.comparison import compare
from gears3d.engine import simulate
from gears3d.engine.motion import drive_at, fastest, motion_table
from gears3d.engine.run import longest_step
from gears3d.errors import InputError
from gears3d.lumped import rigid
from gears3d.scenario import load

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
MEAN, SIZE, OMEGA = np.pi, 2 * np.pi / 3, 6 * np.pi
WAVE = 'effect=[{kind="drive_motion", frequency="7 Hz", amplitude="5e-4 rad", phase="30 deg"}]'


def angle(t):
    return MEAN * t - SIZE / OMEGA * (np.cos(OMEGA * t) - 1)


def following(folder, time, theta, *more):
    path = folder / "drive.csv"
    np.savetxt(path, np.c_[time, theta], delimiter=",", header="time_s,theta_drive_rad", comments="", fmt="%.17g")
    return load(FIG5, ["run.duration=1 s", f'motion.record="{path}"', *more])


def noisy(folder, *more):
    """Return figure 5 from a noisy record that is smoothed to 40 Hz, over 1.2 s."""
    time = np.linspace(0.0, 1.2, 12001)
    theta = angle(time) + 2e-5 * np.random.default_rng(1).standard_normal(len(time))
    return following(folder, time, theta, "motion.bandwidth=40 Hz", *more)


def course(motion, times):
    return np.array([drive_at(motion, t) for t in times]).T


def test_a_quintic_between_uneven_samples_is_followed_exactly(tmp_path):
    time = np.sort(np.r_[0.0, np.random.default_rng(2).uniform(0.02, 1.1, 40), 1.2])
    true = np.polynomial.Polynomial([0.0, 3.0, -2.0, 1.5, -0.7, 0.3])
    motion = motion_table(following(tmp_path, time, true(time)))
    at = np.linspace(0.0, 1.2, 500)
    for degree, found in enumerate(course(motion, at)):
        assert np.abs(found - true.deriv(degree)(at)).max() < 1e-9


def test_angle_speed_and_acceleration_go_on_across_the_knots(tmp_path):
    motion = motion_table(noisy(tmp_path))
    starts = motion[1::3, 0]
    assert len(starts) > 700
    before, after = (course(motion, starts[1:] + sign * 1e-10) for sign in (-1, 1))
    for one, two, size in zip(before, after, (1e-8, 1e-7, 1e-5), strict=True):
        assert np.abs(two - one).max() < size
    at = np.linspace(0.01, 1.19, 3001)
    here, early, late = (course(motion, at + shift) for shift in (0.0, -1e-6, 1e-6))
    steep = (late - early) / 2e-6
    assert np.abs(steep[0] - here[1]).max() < 1e-6
    assert np.abs(steep[1] - here[2]).max() < 1e-4


def test_speed_and_waves_of_a_record_set_the_step(tmp_path):
    scenario = noisy(tmp_path)
    motion = motion_table(scenario, scenario.rows())
    speed, frequency = fastest(motion)
    assert frequency == pytest.approx(2 * np.pi * 40)
    there = np.abs(course(motion, np.linspace(0.0, 1.2, 5001))[1]).max()
    assert there <= speed < 1.02 * there
    assert longest_step(motion, (), scenario.pair()) == pytest.approx(1 / 40 / 40)


def test_a_record_of_sines_drives_like_the_sines(tmp_path):
    """Off by the error of a quintic spline: samples twice as dense lessen it by about 2^6."""
    sines = simulate(load(FIG5, ["run.duration=1 s"])).impacts
    off = []
    for count in (61, 121):
        time = np.linspace(0.0, 1.2, count)
        found = simulate(following(tmp_path, time + 5.0, angle(time) + 1.0)).impacts
        assert len(found["time_s"]) == len(sines["time_s"]) > 14
        assert np.array_equal(found["tooth_loose"], sines["tooth_loose"])
        off.append(np.abs(found["velocity_m_s"] - sines["velocity_m_s"])[:8].max())
    assert off[1] < 2e-6
    assert off[0] / off[1] > 30


@pytest.mark.parametrize("more", [(), (WAVE,)])
def test_the_engine_follows_a_record_as_the_twin_does(tmp_path, more):
    scenario = noisy(tmp_path, *more)
    found = compare(simulate(scenario), rigid.simulate(scenario), flight_height_min=0.05e-6).to_dict()
    assert found["impacts_missed"] + found["impacts_invented"] == 0
    assert found["impacts_compared"] >= 15
    assert found["velocity_error_median"] < 5e-6
    assert found["velocity_error_p95"] < 3e-5
    assert found["phase_error_median_cycles"] < 1e-7


def test_an_effect_moves_a_measured_drive_too(tmp_path):
    plain, moved = (motion_table(scenario, scenario.rows()) for scenario in (noisy(tmp_path), noisy(tmp_path, WAVE)))
    times = np.linspace(0.0, 1.0, 50)
    wave = 5e-4 * (np.cos(np.pi / 6) - np.cos(14 * np.pi * times + np.pi / 6))
    assert np.ptp(course(moved, times)[0] - course(plain, times)[0]) == pytest.approx(np.ptp(wave), rel=1e-9)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda t, a: (t[:900], a[:900]), "lasts 0.899 s, the run 1 s"),
        (lambda t, a: (np.where(t == t[7], t[3], t), a), "does not rise after row 7"),
        (lambda t, a: (t, np.where(t == t[7], np.nan, a)), "not finite in row 8"),
        (lambda t, a: (t[:5], a[:5]), "has 5 samples"),
    ],
)
def test_bad_records_are_refused_as_in_the_twin(tmp_path, spoil, said):
    time = np.linspace(0.0, 1.2, 1201)
    scenario = following(tmp_path, *spoil(time, angle(time)))
    for model in (simulate, rigid.simulate):
        with pytest.raises(InputError, match=said):
            model(scenario)
