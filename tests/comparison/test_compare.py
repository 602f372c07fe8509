import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gears3d.comparison import KEYS, compare
from gears3d.errors import InputError, UsageError
from gears3d.recording import Recording

PERIOD = 1 / 3
SETTLED = {"period_s": PERIOD, "settle_s": 0.0}


def record(times, flanks, speeds, heights=None, phases=None, end=5.0, **meta):
    axis = np.linspace(0.0, end, 1001)
    hits = {
        "time_s": np.array(times, float),
        "flank": np.array(flanks, int),
        "velocity_m_s": np.array(speeds, float),
        "flight_height_m": np.full(len(times), 250e-6) if heights is None else np.array(heights, float),
    }
    if phases is not None:
        hits["phase_rad"] = np.array(phases, float)
    return Recording({"time_s": axis, "theta_drive_rad": axis, "theta_loose_rad": axis}, hits, {**SETTLED, **meta})


def rattle(periods=15, **changes):
    times = np.ravel([[(k + 0.37) * PERIOD, (k + 0.87) * PERIOD] for k in range(periods)])
    return record(times, [1, 0] * periods, [0.03, -0.03] * periods, end=periods * PERIOD, **changes)


def altered(base, **columns):
    return Recording(base.signals, {**base.impacts, **columns}, base.meta)


def without(base, *rows):
    return Recording(base.signals, {n: np.delete(v, rows) for n, v in base.impacts.items()}, base.meta)


def test_a_recording_equals_itself():
    found = compare(rattle(), rattle())
    assert found.to_dict() == {
        "impacts_compared": 30,
        "impacts_matched": 30,
        "impacts_missed": 0,
        "impacts_invented": 0,
        "velocity_error_median": 0.0,
        "velocity_error_p95": 0.0,
        "velocity_bias": 0.0,
        "phase_error_median_cycles": 0.0,
        "flight_height_min_m": 0.05e-6,
        "regime_equal": True,
        "mode": "trajectory",
    }
    assert tuple(found.to_dict()) == KEYS


def test_errors_worked_out_by_hand():
    base = record([0.1, 0.2, 0.3, 0.4, 0.5], [0, 1, 0, 1, 0], [-0.02, 0.04, -0.01, 0.05, -0.02])
    tested = altered(
        base,
        velocity_m_s=np.array([-0.0202, 0.0392, -0.01, 0.0515, -0.0192]),
        time_s=base.impacts["time_s"] + np.array([1, -2, 0, 3, 4]) * 1e-3 * PERIOD,
    )
    found = compare(tested, base)
    errors = [0.01, -0.02, 0.0, 0.03, -0.04]
    assert found.velocity_error_median == pytest.approx(0.02)
    assert found.velocity_error_p95 == pytest.approx(np.quantile(np.abs(errors), 0.95))
    assert found.velocity_bias == pytest.approx(-0.004)
    assert found.phase_error_median_cycles == pytest.approx(2e-3)
    assert found.pairs.tolist() == [[i, i] for i in range(5)]


def test_errors_are_relative_to_the_second():
    base = rattle()
    harder = altered(base, velocity_m_s=1.25 * base.impacts["velocity_m_s"])
    assert compare(harder, base).velocity_bias == pytest.approx(0.25)
    assert compare(base, harder).velocity_bias == pytest.approx(-0.2)


def test_phases_are_told_by_the_records_where_they_know_them_and_wrap():
    base = record([0.1, 0.5], [0, 1], [-0.02, 0.02], phases=[0.01, 6.28])
    tested = altered(base, phase_rad=np.array([2 * np.pi - 0.01, 2 * np.pi - 6.28 + 0.02]))
    wrapped = [0.02 / (2 * np.pi), (4 * np.pi - 2 * 6.28 + 0.02) / (2 * np.pi)]
    assert compare(tested, base).phase_error_median_cycles == pytest.approx(np.mean(wrapped))


def test_missed_and_invented_change_places_with_the_records():
    base, tested = without(rattle(), 3, 11), without(rattle(), 20)
    one, other = compare(tested, base), compare(base, tested)
    assert (one.impacts_matched, one.impacts_missed, one.impacts_invented) == (27, 1, 2)
    assert (other.impacts_matched, other.impacts_missed, other.impacts_invented) == (27, 2, 1)
    assert one.impacts_compared == 28
    np.testing.assert_allclose(base.impacts["time_s"][one.missed], (10 + 0.37) * PERIOD)


@settings(max_examples=60, deadline=None)
@given(st.sets(st.integers(0, 29)), st.sets(st.integers(0, 29)))
def test_drops_on_either_side_are_counted_exactly(lost, gained):
    found = compare(without(rattle(), *lost), without(rattle(), *gained))
    assert found.impacts_missed == len(lost - gained)
    assert found.impacts_invented == len(gained - lost)
    assert found.impacts_matched == 30 - len(lost | gained)


@pytest.mark.parametrize(("mine", "theirs"), [(0.049e-6, 0.051e-6), (0.051e-6, 0.049e-6)])
def test_an_impact_near_the_height_limit_is_neither_missed_nor_invented(mine, theirs):
    base = rattle()
    heights = base.impacts["flight_height_m"].copy()
    heights[7] = theirs
    other = heights.copy()
    other[7] = mine
    found = compare(altered(base, flight_height_m=other), altered(base, flight_height_m=heights))
    assert (found.impacts_matched, found.impacts_missed, found.impacts_invented) == (30, 0, 0)


def test_low_impacts_do_not_count_unless_asked():
    base = rattle()
    heights = base.impacts["flight_height_m"].copy()
    heights[7] = 0.04e-6
    base = altered(base, flight_height_m=heights)
    assert compare(without(base, 7), base).impacts_missed == 0
    assert compare(base, without(base, 7)).impacts_invented == 0
    assert compare(base, base).impacts_matched == 29
    strict = compare(without(base, 7), base, flight_height_min=0.03e-6)
    assert (strict.impacts_missed, strict.flight_height_min_m) == (1, 0.03e-6)


def test_impacts_of_unknown_height_count():
    base = altered(rattle(), flight_height_m=np.full(30, np.nan))
    assert compare(without(base, 4), base).impacts_missed == 1


def test_settling_is_left_out():
    base = rattle(settle_s=2 * PERIOD)
    found = compare(without(base, 0, 3, 10), base)
    assert (found.impacts_compared, found.impacts_missed) == (26, 1)
    late = compare(rattle(), rattle(settle_s=2 * PERIOD))
    assert late.impacts_compared == 26


def test_an_interrupted_record_is_compared_as_far_as_it_goes():
    base = rattle()
    cut = base.between(0.0, 7.5 * PERIOD)
    for a, b in ((cut, base), (base, cut)):
        found = compare(a, b)
        assert (found.impacts_compared, found.impacts_missed, found.impacts_invented) == (15, 0, 0)


def test_an_impact_at_the_very_end_may_lie_beyond_the_other_record():
    base = rattle()
    end = 4.5
    late = base.impacts["time_s"] + (end - 1e-6 - base.impacts["time_s"][26])
    base, late = altered(base, time_s=late), altered(base, time_s=late + 2e-6)
    for a, b in ((base.between(0, end), late.between(0, end)), (late.between(0, end), base.between(0, end))):
        found = compare(a, b)
        assert (found.impacts_matched, found.impacts_missed, found.impacts_invented) == (26, 0, 0)


def test_regimes_are_compared():
    base = rattle()
    single = without(base, *range(0, 30, 2))
    found = compare(single, base)
    assert not found.regime_equal
    assert found.regimes == ("single_sided", "double_sided")


@pytest.mark.parametrize(
    ("exponent", "mode"),
    [(None, "trajectory"), (-math.inf, "trajectory"), (0.0, "trajectory"), (1.7, "distribution")],
)
def test_the_reference_alone_chooses_the_mode(exponent, mode):
    reference = rattle(lyapunov_1_s=exponent)
    assert compare(rattle(lyapunov_1_s=5.0), reference).mode == mode
    assert compare(rattle(), reference).mode == mode
    assert compare(rattle(), reference, mode="trajectory").mode == "trajectory"


def test_an_unknown_mode_is_refused():
    with pytest.raises(UsageError, match="did you mean 'trajectory'"):
        compare(rattle(), rattle(), mode="trajectories")


def test_records_without_common_time_are_refused():
    with pytest.raises(InputError, match=r"no time in common: 0..1 s and 2..5 s"):
        compare(record([], [], [], end=1.0), record([], [], [], end=5.0, settle_s=2.0))


def test_no_impacts_at_all_have_no_errors():
    found = compare(record([], [], []), record([], [], []))
    assert (found.impacts_compared, found.velocity_error_median, found.regimes) == (0, None, ("contact", "contact"))


def test_without_a_period_the_blows_give_one():
    base = Recording(rattle().signals, rattle().impacts)
    found = compare(without(base, 4), base)
    assert (found.impacts_matched, found.impacts_missed) == (29, 1)


def test_different_scenarios_are_noted_and_rounding_is_not():
    base = rattle(backlash_m=250e-6, title="one")
    assert compare(rattle(backlash_m=250e-6 * (1 + 1e-12), title="one"), base).notes == ()
    notes = compare(rattle(backlash_m=200e-6, title="one"), base).notes
    assert notes == ("different scenarios: backlash_m is 0.0002 and 0.00025",)


def test_paths_are_read(tmp_path):
    rattle().write(tmp_path / "a")
    without(rattle(), 4).write(tmp_path / "b")
    found = compare(tmp_path / "a", str(tmp_path / "b"))
    assert found.impacts_invented == 1


def test_five_seconds_take_less_than_twenty_milliseconds():
    count = 400
    times = np.sort(np.random.default_rng(0).uniform(0, 5, count))
    base = record(times, np.arange(count) % 2, np.where(np.arange(count) % 2, 0.02, -0.02))
    tested = altered(base, time_s=times + 1e-6)
    walls = []
    for _ in range(5):
        begin = time.perf_counter()
        compare(tested, base)
        walls.append(time.perf_counter() - begin)
    assert min(walls) <= 0.020
