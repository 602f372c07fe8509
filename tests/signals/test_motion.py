"""The name of the motion, held against maps of known exponents, rotations, and the twin's own exponent."""

from math import inf, log, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gears3d import load, simulate
from gears3d.signals import (
    describe,
    exponent,
    on_closed_curve,
    periodicity,
    return_map,
    stroboscope,
    widest_phase,
)

SCENARIO = "scenarios/rigaud-2020/fig5-20rpm.toml"


def logistic(rate, count):
    x, out = 0.3123, []
    for _ in range(500 + count):
        x = rate * x * (1 - x)
        out.append(x)
    return np.array(out[500:])[:, None]


def henon(count):
    x, y, out = 0.1, 0.1, []
    for _ in range(200 + count):
        x, y = 1 - 1.4 * x * x + y, 0.3 * x
        out.append((x, y))
    return np.array(out[200:])


def on_torus(*angles):
    return np.column_stack([f(one) for one in angles for f in (np.cos, np.sin)])


def standard_map(kick, count, momentum, angle):
    out = []
    for _ in range(count):
        momentum += kick * np.sin(angle)
        angle += momentum
        out.append((momentum, angle))
    return on_torus(*np.array(out).T)


def circle_map(kick, shift, count):
    turn, out = 0.1, []
    for _ in range(count):
        turn += shift - kick / (2 * pi) * np.sin(2 * pi * turn)
        out.append(2 * pi * turn)
    return on_torus(np.array(out))


@pytest.mark.parametrize(
    ("series", "known", "slack"),
    [
        (logistic(4.0, 2000), log(2.0), 0.02),  # exact
        (logistic(3.8, 2000), 0.4317, 0.03),
        (henon(2000), 0.4192, 0.03),
        (standard_map(7.0, 2000, 0.5, 1.0), log(3.5), 0.2),  # ln(K/2) for a large kick; few steps to fit
        (logistic(4.0, 200), log(2.0), 0.1),
        (henon(200), 0.4192, 0.1),
    ],
)
def test_the_exponent_of_a_known_map(series, known, slack):
    found = exponent(series)
    assert found.value == pytest.approx(known, abs=slack)
    assert found.value - 3 * found.deviation > 0.1


@pytest.mark.parametrize("count", [150, 500])
@pytest.mark.parametrize(("kick", "shift"), [(0.0, 0.381966), (0.5, 0.381966), (0.9, 0.606661)])
def test_a_rotation_neither_parts_nor_comes_together_and_is_a_closed_curve(kick, shift, count):
    series = circle_map(kick, shift, count)
    found = exponent(series)
    assert abs(found.value) < 0.02
    assert on_closed_curve(series) is True
    noisy = series + np.random.default_rng(1).normal(0.0, 1e-3, series.shape)
    assert on_closed_curve(noisy) is True


@pytest.mark.parametrize(
    "series",
    [logistic(4.0, 300), logistic(3.8, 300), henon(300), standard_map(7.0, 300, 0.5, 1.0), logistic(3.5, 300)],
)
def test_chaos_noise_and_periods_are_no_closed_curve(series):
    assert on_closed_curve(np.hstack([series[:-1], series[1:]])) is False


@given(st.integers(0, 2**31))
def test_noise_is_never_taken_for_a_closed_curve(seed):
    assert on_closed_curve(np.random.default_rng(seed).normal(size=(150, 2))) is False


def test_what_is_too_little_is_not_judged():
    assert on_closed_curve(np.zeros((50, 2))) is None
    assert exponent(np.zeros((50, 2))) is None
    assert exponent(np.ones((500, 2))).value == -inf


def test_a_closed_curve_in_two_loops_is_one():
    """The section of a motion that goes around two loops in turn: a period-doubled torus."""
    angle = 2 * pi * 0.1618034 * np.arange(400)
    side = np.where(np.arange(400) % 2, 4.0, -4.0)
    assert on_closed_curve(np.column_stack([np.cos(angle) + side, np.sin(angle)])) is True


def rattle(*changes, periods=202, settle=2):
    settings = ["run.output_rate='2 kHz'", f"run.duration='{periods} periods'", f"run.settle='{settle} periods'"]
    return simulate(load(SCENARIO, overrides=[*changes, *settings]), "rigid")


def told(recording, *without):
    meta = {key: value for key, value in recording.meta.items() if key not in without}
    return describe(recording.signals, recording.impacts, meta)


@pytest.mark.parametrize(("e", "name", "source"), [(0.0, "1T", "wiped"), (0.8, "1T", "wiped"), (0.9, "2T", "model")])
def test_periodic_motions_of_the_twin(e, name, source):
    """Where every period has permanent contact, it wipes out all disturbances: the exponent is minus infinity."""
    recording = rattle(f"impact.restitution={e}", settle=40)
    found = told(recording)
    assert (found["motion"], found["lyapunov_from"]) == (name, source)
    assert source == "wiped" or found["lyapunov_1_s"] < -5.0
    assert told(recording, "lyapunov_1_s")["motion"] == name


@pytest.mark.parametrize("changes", [["drag.torque='0.05 N m'", "impact.restitution=0.9"], ["impact.restitution=0.95"]])
def test_chaos_is_known_from_the_recording_alone(changes):
    recording = rattle(*changes)
    by_model, by_itself = told(recording), told(recording, "lyapunov_1_s")
    assert (by_model["motion"], by_model["lyapunov_from"]) == ("chaotic", "model")
    assert (by_itself["motion"], by_itself["lyapunov_from"]) == ("chaotic", "recording")
    slack = 3 * by_itself["lyapunov_std_1_s"]
    assert by_itself["lyapunov_1_s"] == pytest.approx(by_model["lyapunov_1_s"], abs=slack)
    assert slack < by_model["lyapunov_1_s"]


def test_a_transmission_error_of_unrelated_frequency_makes_a_closed_curve():
    error = "effect=[{kind='transmission_error', order=90, amplitude='5 um', phase='0 deg'}]"
    assert told(rattle(error, "motion.mean='31.4159265 rpm'"))["motion"] == "quasi_periodic"
    assert told(rattle(error, "motion.mean='30 rpm'"))["motion"] == "1T"
    assert told(rattle(error, "motion.mean='31.7 rpm'"))["motion"] == "20T"  # 90·31.7/60 Hz = 317/20 · 3 Hz


def test_few_periods_are_too_short_to_tell():
    recording = rattle("impact.restitution=0.95", periods=14)
    assert told(recording, "lyapunov_1_s")["motion"] == "too_short"


def test_a_slow_beat_is_not_called_periodic():
    """Speeds that swing by a fifth within 60 periods come near themselves after one, and far from it after thirty."""
    times = np.arange(240) + 0.3
    speeds = -0.02 * (1 + 0.2 * np.sin(2 * pi * times / 60.0))
    assert periodicity(times, np.zeros(240), speeds, 1.0, 0.0, 240.0) is None
    assert periodicity(times, np.zeros(240), speeds, 1.0, 0.0, 240.0, longest=64) == 60


@given(st.floats(0.0, 1.0), st.floats(0.0, 0.99))
def test_the_section_follows_the_path_up_to_an_impact_and_not_over_it(phase, at):
    """A flight between two impacts in one sampling interval: each side's own parabola is what is read."""
    time = np.arange(41) * 0.1
    hit = 2.0 + 0.1 * at
    place = np.where(time <= hit, -0.3 * (time - hit), 0.9 * (time - hit) - 0.2 * (time - hit) ** 2)
    speed = np.where(time <= hit, -0.3, 0.9 - 0.4 * (time - hit))
    signals = {"time_s": time, "displacement_m": place, "velocity_m_s": speed}
    found = stroboscope(signals, {"time_s": np.array([hit])}, 1.0, phase, 0.0, 3.999)
    when = phase + np.arange(len(found))
    truth = np.where(when <= hit, -0.3 * (when - hit), 0.9 * (when - hit) - 0.2 * (when - hit) ** 2)
    np.testing.assert_allclose(found[:, 0], truth, atol=0.003)
    assert len(found) in (3, 4)
    speeds = found[:, 1]  # never between the two: not averaged over the impact
    assert (np.isclose(speeds, -0.3) | (speeds > 0.05)).all()


def test_the_widest_phase_is_not_where_contact_holds():
    time = np.arange(0.0, 40.0, 0.01)
    loud = (np.mod(time, 1.0) > 0.6) * np.sin(time**2)
    signals = {"time_s": time, "displacement_m": loud, "velocity_m_s": loud}
    assert widest_phase(signals, {"time_s": np.zeros(0)}, 1.0, 0.0, 40.0) > 0.6


def test_the_return_map_of_the_logistic_map_is_its_parabola():
    pairs = return_map(logistic(4.0, 100)[:, 0])
    np.testing.assert_allclose(pairs[:, 1], 4 * pairs[:, 0] * (1 - pairs[:, 0]), atol=1e-14)
    assert return_map(np.arange(3.0), 5).shape == (0, 2)
