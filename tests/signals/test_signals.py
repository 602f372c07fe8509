import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gears3d.signals import (
    count_of,
    describe,
    durations,
    impacts_per_period,
    periodicity,
    quantum,
    regime,
    section,
    states,
    window,
)

PERIOD = 1 / 3


def orbit(pattern, periods, period=PERIOD, n=1):
    """Impacts [(phase in cycles of n periods, flank, velocity)] repeated every n periods."""
    times, flanks, speeds = [], [], []
    for k in range(0, periods, n):
        for phase, flank, speed in pattern:
            times.append((k + phase * n) * period)
            flanks.append(flank)
            speeds.append(speed)
    order = np.argsort(times)
    return np.array(times)[order], np.array(flanks)[order], np.array(speeds)[order]


TWO = [(0.34, 1, 0.0309), (0.81, 0, -0.0312)]


@pytest.mark.parametrize(
    ("pattern", "expected"),
    [([], "contact"), (TWO[1:], "single_sided"), (TWO[:1], "single_sided"), (TWO, "double_sided")],
)
def test_regime_is_named_by_the_flanks_struck(pattern, expected):
    times, flanks, _ = orbit(pattern, 13)
    assert regime(times, flanks, PERIOD, 0.0, 13 * PERIOD) == expected


def test_a_single_stray_impact_in_many_periods_does_not_name_the_regime():
    times, flanks, _ = orbit(TWO[1:], 13)
    flanks[5] = 1
    assert regime(times, flanks, PERIOD, 0.0, 13 * PERIOD) == "single_sided"
    flanks[8] = 1
    assert regime(times, flanks, PERIOD, 0.0, 13 * PERIOD) == "double_sided"
    assert regime(times[5:6], flanks[5:6], PERIOD, 0.0, 13 * PERIOD) == "contact"


@given(st.integers(1, 6), st.integers(3, 20), st.floats(0.0, 0.99))
def test_impacts_per_period_counts_whole_periods_wherever_they_begin(count, periods, offset):
    times, _, _ = orbit([((i + 0.5) / count, 0, -0.01) for i in range(count)], periods + 3)
    end = (periods + 1 + offset) * PERIOD
    assert impacts_per_period(times, PERIOD, PERIOD, end) == pytest.approx(count, abs=1 / periods + 1e-9)
    assert impacts_per_period(times, PERIOD, end - 0.9 * PERIOD, end) is None


@given(st.integers(1, 6), st.floats(0.0, 0.9), st.integers(0, 2**31))
def test_periodicity_finds_the_number_of_periods(n, start, seed):
    rng = np.random.default_rng(seed)
    pattern = [((k + phase) / n, flank, v * (1 + 0.3 * k)) for k in range(n) for phase, flank, v in TWO]
    times, flanks, speeds = orbit(pattern, 8 * n, n=n)
    times = times + rng.uniform(-0.002, 0.002, len(times)) * PERIOD
    speeds = speeds * (1 + rng.uniform(-0.005, 0.005, len(speeds)))
    assert periodicity(times, flanks, speeds, PERIOD, start * PERIOD, 8 * n * PERIOD) == n


def test_a_missing_impact_every_other_period_doubles_the_period():
    times, flanks, speeds = orbit([(0.17, 1, 0.03), (0.4, 0, -0.03), (0.67, 1, 0.03)], 16, n=2)
    assert periodicity(times, flanks, speeds, PERIOD, 0.0, 16 * PERIOD) == 2


def test_irregular_impacts_and_too_short_records_have_no_period():
    rng = np.random.default_rng(1)
    times = np.sort(rng.uniform(0, 40 * PERIOD, 80))
    assert periodicity(times, np.zeros(80), rng.normal(0, 0.02, 80), PERIOD, 0, 40 * PERIOD) is None
    times, flanks, speeds = orbit(TWO, 2)
    assert periodicity(times, flanks, speeds, PERIOD, 0, 2 * PERIOD) is None
    assert periodicity(times[:0], flanks[:0], speeds[:0], PERIOD, 0, 9 * PERIOD) is None


def test_section_of_an_orbit_is_a_handful_of_points():
    times, _, speeds = orbit(TWO, 9)
    points = section(times, speeds, PERIOD)
    assert points.shape == (18, 2)
    np.testing.assert_allclose(points[::2], [[0.34, 0.0309]] * 9, atol=1e-12)
    np.testing.assert_allclose(points[1::2], [[0.81, -0.0312]] * 9, atol=1e-12)


def test_states_and_durations_of_a_known_path():
    time = np.linspace(0.0, 1.0, 10001)
    corners = np.array([0.0, 0.2, 0.3, 0.5, 0.6, 0.9, 0.95, 1.0])
    path = np.interp(time, corners, np.array([0, 0, 1, 1, 0, 0, 0.4, 0.4]) * 250e-6)
    shift = 40e-6 * np.sin(9 * time)
    state = states(path + shift, shift, shift + 250e-6, tolerance=1e-9)
    lasted = durations(time, state)
    np.testing.assert_allclose(lasted[2], [0.1, 0.1], atol=3e-4)
    np.testing.assert_allclose(lasted[1], [0.2], atol=3e-4)
    np.testing.assert_allclose(lasted[0], [0.3], atol=3e-4)
    assert all(not d.size for d in durations(time, np.zeros(len(time))).values())


def record(pattern, periods=15):
    times, flanks, speeds = orbit(pattern, periods)
    heights = np.full(len(times), 250e-6)
    hits = {"time_s": times, "flank": flanks, "velocity_m_s": speeds, "flight_height_m": heights}
    return {"time_s": np.linspace(0, periods * PERIOD, 100)}, hits


def test_describe_leaves_out_settling_and_trembling():
    signals, hits = record([*TWO, (0.9, 0, -1e-4)])
    hits["flight_height_m"][hits["velocity_m_s"] == -1e-4] = 0.05e-6
    hits["velocity_m_s"][:6] *= 5
    found = describe(signals, hits, {"period_s": PERIOD, "settle_s": 2 * PERIOD})
    known = {key: value for key, value in found.items() if value is not None and not key.endswith(("std_m_s", "_s2"))}
    assert known == {
        "regime": "double_sided",
        "motion": "1T",
        "impacts": 26,
        "impacts_per_period": 2.0,
        "active_impacts": 13,
        "active_velocity_mean_m_s": pytest.approx(-0.0312),
        "reverse_impacts": 13,
        "reverse_velocity_mean_m_s": pytest.approx(0.0309),
    }
    assert found["active_velocity_mean_square_m2_s2"] == pytest.approx(0.0312**2)
    assert found["active_velocity_std_m_s"] == pytest.approx(0.0, abs=1e-15)


def test_describe_counts_impacts_of_unknown_height():
    signals, hits = record(TWO)
    hits["flight_height_m"][:] = np.nan
    assert describe(signals, hits, {"period_s": PERIOD})["impacts"] == 30


def test_describe_says_chaotic_only_by_the_exponent():
    signals, hits = record(TWO)
    assert describe(signals, hits, {"period_s": PERIOD, "lyapunov_1_s": 2.0})["motion"] == "chaotic"
    assert describe(signals, hits, {"period_s": PERIOD, "lyapunov_1_s": float("-inf")})["motion"] == "1T"


def test_describe_of_nothing():
    signals, hits = record([])
    found = describe(signals, hits, {"period_s": PERIOD})
    assert (found["regime"], found["motion"], found["impacts_per_period"]) == ("contact", None, 0.0)
    empty = {name: np.zeros(0) for name in ("time_s", "flank", "velocity_m_s")}
    assert describe({"time_s": np.zeros(0)}, empty, {"period_s": 1.0})["regime"] == "contact"
    assert describe(signals, hits, {})["impacts_per_period"] is None


def test_window_never_runs_backwards():
    signals = {"time_s": np.array([0.0, 0.4])}
    assert window(signals, {"settle_s": 1.0}) == (0.4, 0.4)
    assert window(signals, {"settle_s": None}) == (0.0, 0.4)


def test_import_is_light():
    code = "import sys, gears3d.signals; print(*(m for m in ('scipy', 'pyarrow', 'matplotlib') if m in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_an_impact_from_contact_counts_for_the_energy():
    """A step of the flanks throws a gear off at 0.1 m/s without a flight before; trembling adds next to nothing."""
    impacts = {
        "time_s": np.array([0.2, 0.4, 0.6]),
        "flank": np.array([0, 1, 0]),
        "velocity_m_s": np.array([-0.1, 0.08, -1e-5]),
        "rebound_m_s": np.array([0.03, -0.02, np.nan]),
        "flight_height_m": np.array([0.0, 4e-5, 1e-11]),
    }
    found = describe({"time_s": np.array([0.0, 2.0])}, impacts, {"inertia_kg_m2": 0.02, "base_radius_loose_m": 0.1})
    assert found["impacts"] == 1
    assert found["active_energy_J_s"] == pytest.approx(0.5 * 2.0 * (0.1**2 - 0.03**2) / 2.0)
    assert found["energy_J_s"] == pytest.approx(found["active_energy_J_s"] + 0.5 * 2.0 * (0.08**2 - 0.02**2) / 2.0)


@pytest.mark.parametrize("turned", [0.0, 0.37])
@pytest.mark.parametrize("samples", [2_000, 40_000])
@pytest.mark.parametrize("decimals", [3, 4, 5, 6, 9])
def test_counts_show_in_angles_that_a_file_rounds(decimals, samples, turned):
    time = np.linspace(0.0, 1.0, samples)
    degrees = 1500.0 * time + 20.0 * np.sin(60.0 * time)
    shown = np.round(np.floor(degrees / 360.0 * 4096) * 360.0 / 4096 + turned, decimals)
    assert 360.0 / quantum(shown) == pytest.approx(4096.0, rel=1e-5)
    assert quantum(np.radians(shown)) == pytest.approx(2.0 * np.pi / 4096.0, rel=1e-5)


@pytest.mark.parametrize("decimals", [2, 4, 6])
def test_smooth_angles_have_no_counts_beyond_the_decimals_of_a_file(decimals):
    time = np.linspace(0.0, 1.0, 20_000)
    noise = np.random.default_rng(4).normal(0.0, 0.02, len(time))
    found = quantum(np.round(1500.0 * time + 20.0 * np.sin(60.0 * time) + noise, decimals))
    assert found is None or found == pytest.approx(10.0**-decimals, rel=1e-6)


def test_even_steps_of_many_counts_are_no_counts():
    rows = np.arange(12_000)
    steps = np.floor(0.3 + 444.444 * np.where(rows < 6_000, rows, 12_000 - rows))
    assert quantum(steps) is None


def test_held_readings_are_not_counts():
    # an ordinary encoder that turns by 114 counts a row, with readings that repeat the one before
    random, rows, count = np.random.default_rng(3), np.arange(60_000), 2.0 * np.pi / 49_305
    angle = 0.0145 * rows + 9e-6 / 0.0145 * np.sin(0.0145 * rows)
    seen = np.floor(angle / count) * count
    fresh = random.uniform(size=len(rows)) > 0.1
    fresh[1:] |= ~fresh[:-1]
    seen = seen[np.maximum.accumulate(np.where(fresh, rows, 0))]
    found = quantum(seen - seen[0])
    assert found is None or found < 1.5 * count


@given(
    turn=st.integers(10_000, 4_000_000), passed=st.floats(100.0, 5000.0), swing=st.floats(1.0, 500.0),
    held=st.sampled_from([1, 2]), first=st.floats(-1000.0, 1000.0),
)  # fmt: skip
def test_counts_show_where_thousands_pass_in_every_sample(turn, passed, swing, held, first):
    rows = np.arange(20_000)
    counts = np.floor(passed * rows + swing * np.sin(0.07 * rows))[rows // held * held]  # readings may repeat
    angle = (round(first * turn / (2.0 * np.pi)) + counts) * 2.0 * np.pi / turn
    assert 2.0 * np.pi / count_of(angle) == pytest.approx(turn, rel=1e-6)


@given(passed=st.floats(100.0, 5000.0), noise=st.floats(0.01, 10.0))
def test_smooth_angles_have_no_counts_however_fast(passed, noise):
    rows = np.arange(20_000)
    angle = 2e-6 * (passed * rows + np.random.default_rng(3).normal(0.0, noise, len(rows)))
    assert count_of(angle) is None
