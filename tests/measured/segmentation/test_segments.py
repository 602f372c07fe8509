"""Records with known impacts, cut from the angles alone. The seeds are others than those that were tuned on."""

import json
from math import pi

import numpy as np
import pytest

import gears3d
from gears3d import cli
from gears3d.errors import InputError
from gears3d.measured.segmentation import alike, doubtful, measure, path_of, segments_of
from gears3d.recording import Recording, read
from gears3d.scenario import load
from gears3d.simulation import record as bench
from gears3d.simulation import simulate
from gears3d.verification.challenge import observe, plan
from tests.measured.segmentation.truth import FIG5, cut, happened, judged, seen

HEIGHT = 30
"""Flights that must be found in time are higher than so many times the noise in contact."""
CASES = [(0.0, 0.0), (0.3, 125e-6), (0.5, 60e-6), (0.7, 60e-6)]  # half the backlash of 250 um is 125 um


@pytest.mark.parametrize(("restitution", "wander"), CASES)
@pytest.mark.parametrize("noise", [pytest.param(0.001, marks=pytest.mark.slow), 0.015])
def test_impacts_and_flanks_are_those_that_happened(restitution, wander, noise):
    scenario, truth = happened(restitution, wander)
    found = cut(scenario, seen(scenario, truth, noise, seed=21))
    told = judged(truth, found, HEIGHT * found.flanks.rough)
    assert told["high"] >= 30
    assert told["found"] >= 0.98 * told["high"]
    assert told["flank"] == told["found"]
    assert told["in_time"] >= 0.98 * told["high"]
    assert told["flanks_right"] >= 0.995
    assert told["invented"] <= 0.01 * len(found.impacts["time_s"])
    assert abs(np.median(told["speeds"])) < 0.01
    assert np.median(np.abs(told["speeds"])) < 0.01


@pytest.mark.parametrize(
    ("restitution", "wander"), [CASES[1], *(pytest.param(*one, marks=pytest.mark.slow) for one in (CASES[0], CASES[2]))]
)
def test_noise_of_five_percent_of_the_gap_leaves_the_high_flights(restitution, wander):
    scenario, truth = happened(restitution, wander)
    found = cut(scenario, seen(scenario, truth, 0.05, seed=22))
    told = judged(truth, found, HEIGHT * found.flanks.rough)
    assert told["found"] >= 0.97 * told["high"] > 25
    assert told["flank"] == told["found"]
    assert told["flanks_right"] >= 0.995
    assert told["in_time"] >= 0.9 * told["high"]


@pytest.mark.parametrize("counts", [40_000, 8192])
def test_slow_counts_are_read_at_their_edges(counts):
    scenario, truth = happened(0.0)
    record = seen(scenario, truth, 0.001, seed=23, counts=counts)
    found = cut(scenario, record)
    assert found.track.readings[1].kind == "edges"
    count = 2 * pi / counts * scenario.rig().base_radius_loose
    assert found.flanks.rough < 0.1 * count  # 23 um and 114 um, in a gap of 250 um
    told = judged(truth, found, HEIGHT * found.flanks.rough)
    assert told["found"] == told["flank"] == told["in_time"] == told["high"] >= 25


@pytest.mark.parametrize(("restitution", "wander", "counts"), [(0.0, 0.0, 8192), (0.7, 60e-6, 40_000)])
@pytest.mark.parametrize(
    "seed", [11, pytest.param(12, marks=pytest.mark.slow), pytest.param(14, marks=pytest.mark.slow)]
)
def test_coarse_counts_and_noise_invent_nothing(restitution, wander, counts, seed):
    scenario, truth = happened(restitution, wander)
    found = measure(seen(scenario, truth, 0.015, seed, counts), scenario)
    told = judged(truth, found.segments, HEIGHT * found.segments.flanks.rough)
    assert told["found"] == told["flank"] == told["in_time"] == told["high"] >= 30
    assert told["invented"] == 0
    assert found.summary["cut"]["unexplained"] < 0.01
    assert not found.summary["warnings"]


@pytest.mark.slow
def test_a_cut_that_leaves_much_unexplained_warns():
    scenario, truth = happened(0.3, 0.0)
    record = seen(scenario, truth, 0.001, 12)
    time, loose = record.time, record.signals["theta_loose_rad"]
    late = time > time[-1] - 0.1 * (time[-1] - time[0])  # a coupling comes loose: 60 um at 40 Hz
    shaken = 60e-6 / scenario.rig().base_radius_loose * np.sin(2.0 * pi * 40.0 * (time - time[late][0])) * late
    summary = measure(
        Recording({**record.signals, "theta_loose_rad": loose + shaken}, {}, record.meta), scenario
    ).summary
    assert 0.05 < summary["cut"]["unexplained"] < 0.2
    assert len(summary["warnings"]) == 1


@pytest.mark.parametrize(("duration", "rate", "counts"), [("2 s", "50 kHz", 1_600_000), ("0.8 s", "500 kHz", 40_000)])
def test_counts_without_any_noise_are_cut_well(duration, rate, counts):
    scenario = load(FIG5, {"run.duration": duration, "run.output_rate": rate, "sensors.sample_rate": rate})
    truth = simulate(scenario, "rigid")
    cut = measure(seen(scenario, truth, 0.0, 3, counts), scenario).segments
    told = judged(truth, cut, max(HEIGHT * cut.flanks.rough, 1e-6))
    assert told["found"] == told["flank"] == told["in_time"] == told["high"] >= 6
    assert told["invented"] == 0
    assert cut.flanks.backlash[0] == pytest.approx(250e-6, abs=0.5e-6)


@pytest.mark.parametrize("swing", ["0 rpm", "1.4 rpm"])
@pytest.mark.parametrize(("noise", "counts"), [(0.001, 1_600_000), (0.05, 1_600_000), (0.015, 40_000), (0.001, 8192)])
@pytest.mark.parametrize("seed", [24, pytest.param(25, marks=pytest.mark.slow)])
def test_nothing_is_invented_where_nothing_rattles(swing, noise, counts, seed):
    scenario, truth = happened(swing=swing)
    assert not len(truth.impacts["time_s"])  # 1.4 rpm: excitation 0.87
    found = cut(scenario, seen(scenario, truth, noise, seed, counts))
    assert not len(found.impacts["time_s"])
    assert found.contacts["flank"].tolist() == [0]
    assert found.flanks.backlash is None


def test_sigmas_and_chi_square_are_honest():
    scenario, truth = happened(0.3, 125e-6)
    pulls, slowing, chi2, sane = [], [], [], []
    for seed in range(26, 29):
        found = cut(scenario, seen(scenario, truth, 0.015, seed))
        pulls += judged(truth, found, HEIGHT * found.flanks.rough)["pulls"]
        flights = found.flights
        slowing += list((flights["deceleration_rad_s2"] - 0.22 / 0.0695) / flights["deceleration_sigma_rad_s2"])
        chi2 += list(flights["chi2"])
        sane += list(flights["testifies"])
    assert 0.6 < 1.4826 * np.median(np.abs(pulls)) < 1.5
    assert 0.7 < 1.4826 * np.median(np.abs(slowing)) < 1.4
    assert np.median(chi2) == pytest.approx(1.0, abs=0.1)
    assert np.mean(sane) > 0.97


def test_backlash_and_its_orders_come_from_the_record_alone():
    scenario, truth = happened(0.3, 125e-6)
    summary = measure(seen(scenario, truth, 0.015, seed=30), scenario).summary
    assert summary["flanks"]["backlash_m"]["value"] == pytest.approx(250e-6, abs=0.5e-6)
    (active,), (gap,) = (
        [one for one in summary["flanks"]["orders"][name] if one["order"] == 1] for name in ("active", "backlash")
    )
    assert active["amplitude_m"] == pytest.approx(125e-6, abs=1e-6)
    assert gap["amplitude_m"] == pytest.approx(62.5e-6, abs=1e-6)


def test_zeros_of_the_encoders_do_not_matter():
    scenario, truth = happened(duration="2 s")
    record = seen(scenario, truth, 0.001, seed=31)
    moved = dict(record.signals)
    moved["theta_drive_rad"] = moved["theta_drive_rad"] - 2.0
    moved["theta_loose_rad"] = moved["theta_loose_rad"] + 11.0
    one, other = (measure(record, scenario).recording for record in (record, Recording(moved)))
    assert other.impacts["time_s"] == pytest.approx(one.impacts["time_s"], abs=1e-7)
    assert other.signals["displacement_m"] == pytest.approx(one.signals["displacement_m"], abs=1e-9)


def test_a_measured_folder_is_a_recording_like_any_other(tmp_path, capsys):
    scenario, truth = happened()
    seen(scenario, truth, 0.001, seed=32).write(tmp_path / "r.parquet")
    out = tmp_path / "measured"
    with pytest.raises(SystemExit) as stop:
        cli.main(["segment", str(tmp_path / "r.parquet"), "--rig", FIG5, "--out", str(out), "--json"])
    assert not stop.value.code
    told = json.loads(capsys.readouterr().out)
    assert told["regime"] == "double_sided"
    assert json.loads((out / "summary.json").read_text()) == told
    assert {path.name for path in out.iterdir()} == {
        "signals.parquet", "impacts.parquet", "summary.json", "measured.png", "report.html"
    }  # fmt: skip
    high = {name: values[truth.impacts["flight_height_m"] > 3e-6] for name, values in truth.impacts.items()}
    reference = Recording(truth.signals, high, truth.meta)
    comparison = gears3d.compare(read(out), reference, mode="trajectory")
    assert comparison.impacts_matched >= 0.95 * comparison.impacts_compared
    assert abs(comparison.velocity_bias) < 0.01
    phase = read(out).impacts["phase_rad"]
    assert np.all(np.isfinite(phase))


def test_what_cannot_be_measured_says_why(tmp_path):
    scenario, truth = happened()
    record = seen(scenario, truth, 0.001, seed=33)
    with pytest.raises(InputError, match="--rig: is missing"):
        measure(record)
    with pytest.raises(InputError, match=r"theta_drive_rad|theta_loose_rad"):
        measure(record.between(0.0, 0.002), scenario)
    with pytest.raises(InputError, match="theta_drive_rad: stands still while the other gear turns"):
        measure(bench(scenario, "coastdown"), scenario)
    noisy = seen(scenario, truth, 5.0, seed=34)
    found = None
    with pytest.raises(InputError, match="theta_loose_rad"):
        found = measure(noisy, load(FIG5)).summary["regime"]
    assert found is None


@pytest.mark.slow
def test_a_thousand_samples_a_second_and_viscous_drag_will_do():
    file = "scenarios/ottewill-2010/fig6-lag.toml"
    scenario, truth = happened(0.3, 0.0, "6 rad/s", "20 s", file, "1 kHz", "1 Hz")
    found = cut(scenario, seen(scenario, truth, 0.015, seed=35, counts=40_000))
    told = judged(truth, found, HEIGHT * found.flanks.rough)
    assert told["found"] == told["flank"] == told["in_time"] == told["high"] >= 35
    assert told["flanks_right"] >= 0.995
    assert told["invented"] == 0


@pytest.mark.slow
def test_counts_too_coarse_for_the_gap_are_refused_and_finer_ones_taken():
    file = "scenarios/base/kadmiri-2012.toml"
    scenario, truth = happened(0.3, 0.0, "200 rpm", "2 s", file, "50 kHz", "25 Hz")
    blind = seen(scenario, truth, 0.001, seed=36, counts=1024)  # 314 um a count, in 100 um
    with pytest.raises(InputError, match="theta_loose_rad"):
        segments_of(path_of(blind, scenario), scenario)
    coarse = measure(seen(scenario, truth, 0.001, seed=36, counts=8192), scenario)  # 39 um a count, 2 a sample
    told = judged(truth, coarse.segments, HEIGHT * coarse.segments.flanks.rough)
    assert told["found"] == told["flank"] >= 90
    low, high = coarse.summary["flanks"]["backlash_m"]["ci95"]
    assert low < 100e-6 < high
    assert high - low < 2.0 * 1.96 * 0.5 * 0.05 * 100e-6  # less than a runout of usual gears would make of it
    found = cut(scenario, seen(scenario, truth, 0.015, seed=36, counts=1_000_000))
    told = judged(truth, found, HEIGHT * found.flanks.rough)
    assert told["found"] == told["flank"] == told["high"] >= 90
    assert told["in_time"] >= 0.98 * told["high"]


def test_bounces_that_die_out_on_a_flank_seldom_touched_make_no_orders_of_it():
    hidden = plan(3, ("restitution_asymmetry",), duration=5.0)
    weakest = min(range(5), key=lambda k: load_amplitude(hidden.conditions[k]))
    found = measure(observe(hidden, weakest), hidden.rig).segments
    assert found.flanks.terms.grown == 0
    table, half = found.impacts, 0.5 * hidden.told()["effects"][0]["asymmetry"]
    e = hidden.rig.impact.restitution + np.where(table["flank"] == 0, half, -half)
    off = np.abs(table["rebound_m_s"]) - e * np.abs(table["velocity_m_s"])
    sigma = np.hypot(table["rebound_sigma_m_s"], e * table["velocity_sigma_m_s"])
    seen = np.isfinite(off) & (table["testifies"] == 1)
    assert np.count_nonzero(seen & (table["flank"] == 1)) > 10
    assert np.mean(np.abs(off[seen]) < 8.0 * sigma[seen]) > 0.95


def load_amplitude(condition):
    """Return the claimed amplitude of a record's swing."""
    return float(condition["motion.harmonics"][0]["amplitude"].split()[0])


@pytest.mark.slow
def test_what_a_gear_that_never_rests_bounces_off_are_the_flanks_that_another_record_shows():
    hidden = plan(62, ("transmission_error",), noise=0.003)  # order 4, 102 um: more than a third of the backlash
    rig = hidden.rig
    calm, wild = (path_of(observe(hidden, k), rig) for k in (0, 3))
    shown = segments_of(calm, rig)
    assert abs(shown.flanks.gap[0] - rig.rig().backlash) < 0.1e-6
    found = alike(wild, shown.flanks)
    assert doubtful(found) < 0.02
    assert abs(found.flanks.gap[0] - rig.rig().backlash) < 1e-6
    assert np.mean(found.flights["testifies"]) > 0.99
    assert len(found.impacts["time_s"]) > 800
