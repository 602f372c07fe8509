"""What impacts and flights carry besides moment and speed: durations, teeth, and a drag that changes with speed."""

import numpy as np
import pytest

from gears3d.measured.segmentation import Parabolas, common_law, measure
from gears3d.recording import Recording
from gears3d.simulation import simulate
from tests.measured.segmentation.truth import cut, happened, judged, seen


def test_rigid_teeth_have_no_duration():
    scenario, truth = happened(0.5, 60e-6)
    found = cut(scenario, seen(scenario, truth, 0.005, seed=51))
    told = found.impacts["duration_s"]
    rebounds = np.isfinite(found.impacts["rebound_m_s"])
    assert rebounds.sum() > 60
    assert np.mean(np.isfinite(told[rebounds])) < 0.02
    assert np.isfinite(found.impacts["duration_max_s"][rebounds]).all()
    assert np.median(found.impacts["duration_max_s"][rebounds]) < 2e-4


@pytest.mark.parametrize("swing", ["9 rpm", "20 rpm"])
def test_speeds_are_right_where_the_next_flight_begins_at_once(swing):
    """A flight is compared with its flank up to the next flight only, and may meet it at the last of these times."""
    scenario, truth = happened(0.65, 0.0, swing, "3 s")
    found = cut(scenario, seen(scenario, truth, 2e-5, seed=51, counts=40_000_000))
    one = judged(truth, found, 5.0 * found.flanks.rough)
    assert one["found"] > 150
    assert np.quantile(np.abs(one["vpulls"]), 0.9) < 2.0


@pytest.mark.slow
def test_encoders_read_a_sample_apart_make_no_durations():
    scenario, truth = happened(0.5)
    late = np.interp(truth.time + 30e-6, truth.time, truth.signals["theta_loose_rad"])
    shifted = Recording({**truth.signals, "theta_loose_rad": late}, truth.impacts, truth.meta)
    found = cut(scenario, seen(scenario, shifted, 0.001, seed=51))
    rebounds = np.isfinite(found.impacts["rebound_m_s"])
    assert rebounds.sum() > 60
    assert not np.isfinite(found.impacts["duration_s"][rebounds]).any()
    assert np.isfinite(found.impacts["duration_max_s"][rebounds]).all()


def test_yielding_teeth_are_held_for_half_a_period():
    scenario, _ = happened(0.5)
    mass = scenario.rig().inertia / scenario.rig().base_radius_loose ** 2
    stiffness = mass * (np.pi / 0.5e-3) ** 2  # 0.5 ms without damping
    spring = {"kind": "tooth_compliance", "stiffness": f"{stiffness} N/m"}
    spring["damping"] = f"{0.4 * np.sqrt(stiffness * mass)} N s/m"
    yielding = scenario.with_({"effect": [spring]})
    truth = simulate(yielding, "rigid")
    found = cut(yielding, seen(yielding, truth, 0.001, seed=52))
    told, sigma = found.impacts["duration_s"], found.impacts["duration_sigma_s"]
    hard = np.isfinite(told) & (np.abs(found.impacts["velocity_m_s"]) > 0.02)
    assert hard.sum() >= 25
    begin, end = beyond(truth, scenario.rig().backlash)
    at = [int(np.argmin(np.abs(begin - t))) for t in found.impacts["time_s"][hard]]
    off = told[hard] - (end - begin)[at]
    # the flank of the record is where loaded teeth lie: m·a/k inside that of bare ones, 0.16 um at 6 m/s^2
    assert np.median(np.abs(off)) < 2.0 * (0.5e-3 / np.pi) ** 2 * 6.0 / 0.02
    assert np.median(sigma[hard]) < 2e-5
    assert np.median(told[hard]) == pytest.approx(0.5e-3 / np.sqrt(1.0 - 0.2**2), rel=0.05)


def beyond(truth, backlash):
    """When the displacement goes beyond a flank and comes back [s]."""
    place = truth.signals["displacement_m"]
    off = np.minimum(place, backlash - place)
    change = np.flatnonzero(np.diff(np.signbit(off)))
    moment = truth.time[change] + (truth.time[1] - truth.time[0]) * off[change] / (off[change] - off[change + 1])
    into = np.signbit(off[change + 1])
    first = int(np.argmax(into))
    begin, end = moment[first:][::2], moment[first + 1 :][::2]
    return begin[: len(end)], end


def test_teeth_count_as_in_the_truth():
    scenario, truth = happened(0.3)
    found = measure(seen(scenario, truth, 0.001, seed=53), scenario).recording
    hits = truth.impacts
    sharp = [int(np.argmin(np.abs(hits["time_s"] - t))) for t in found.impacts["time_s"]]
    for gear in ("tooth_drive", "tooth_loose"):
        assert np.mean(found.impacts[gear] == hits[gear][sharp]) > 0.97
    assert found.meta["teeth_from"] == "record"


@pytest.mark.slow
def test_flights_under_viscous_drag_testify_and_tell_its_slope():
    file = "scenarios/ottewill-2010/fig6-lag.toml"
    scenario, truth = happened(0.3, 0.0, "6 rad/s", "20 s", file, "1 kHz", "1 Hz")
    found = cut(scenario, seen(scenario, truth, 0.001, seed=54, counts=40_000))
    viscous = [effect.coefficient for effect in scenario.effects if effect.kind == "drag_viscous"]
    slope, sigma = found.slope
    assert slope == pytest.approx(sum(viscous) / scenario.rig().inertia, abs=4.0 * sigma)
    assert slope > 10.0 * sigma
    assert np.mean(found.flights["testifies"]) > 0.95
    told = judged(truth, found, 30 * found.flanks.rough)
    assert told["found"] == told["flank"] == told["in_time"] == told["high"] >= 50
    others = [cut(scenario, seen(scenario, truth, 0.001, seed=seed, counts=40_000)) for seed in (51, 52, 55, 56)]
    chi2 = [np.median(each.flights["chi2"]) for each in (found, *others)]  # one record's varies by 0.06
    assert np.mean(chi2) == pytest.approx(1.0, abs=0.1)


def test_a_law_of_the_drag_is_not_extrapolated_beyond_the_speeds_that_told_it():
    rng = np.random.default_rng(55)
    speed = np.concatenate([5.2 + 2e-3 * rng.standard_normal(30), 1.0 + 2e-3 * rng.standard_normal(30)])
    slowing = 3.2 + np.append(500.0 * (speed[:30] - 5.2), np.zeros(30)) + 0.1 * rng.standard_normal(60)
    covariance = np.zeros((60, 3, 3))
    covariance[:, 2, 2] = np.append(np.full(30, 1e-2), np.full(30, 1.0)) ** 2
    numbers = np.stack([np.zeros(60), speed, -0.5 * slowing], axis=1)
    one = np.ones(60)
    law = common_law(Parabolas(one, one, numbers, covariance, one, 20.0 * one, 0.0 * one, one, one, one, one, one))
    assert law.slope > 100.0  # told by the fast half alone, whose speeds hardly differ
    assert abs(law.at(1.0) - 3.2) < 5.0


def test_a_drag_that_many_flights_show_is_known_better_than_one_shows_it():
    rng, count = np.random.default_rng(8), 400
    covariance = np.zeros((count, 3, 3))
    covariance[:, 2, 2] = 1.0  # of -deceleration/2: a flight knows its own to 2
    numbers = np.stack([np.zeros(count), 5.0 + 1e-3 * rng.standard_normal(count)] * 2, axis=1)[:, :3]
    numbers[:, 2] = -0.5 * (3.0 + 2.0 * rng.standard_normal(count))
    one = np.ones(count)
    law = common_law(Parabolas(one, one, numbers, covariance, one, 20.0 * one, 0.0 * one, one, one, one, one, one))
    assert abs(law.at(np.array([5.0]))[0] - 3.0) < law.varies < 2.0
