"""Restitution from impacts: the law is found, its numbers are unbiased, and what is not seen does not bend it."""

import json
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

from gears3d import cli, files
from gears3d.errors import InputError
from gears3d.identify import identify_restitution, restitution_picture
from gears3d.identify.impact_pairs import pairs_of
from gears3d.identify.restitution import within_sight
from gears3d.identify.restitution_fit import Terms, fit
from gears3d.scenario import load
from tests.identify.blows import RIG, bounces

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
LAWS = {
    "constant": {"restitution": 0.5},
    "linear": {"restitution": 0.7, "slope": -8.0, "deviation": 0.03},
    "constant+asymmetry": {"restitution": 0.5, "asymmetry": 0.1, "deviation": 0.03},
    "linear+asymmetry": {"restitution": 0.7, "slope": -8.0, "asymmetry": 0.1, "deviation": 0.03},
}


def found_in(seed, **law):
    return identify_restitution([bounces(seed, **law)], RIG)


@pytest.mark.parametrize("name", LAWS)
def test_the_law_is_found_and_its_numbers_are_right(name):
    found = found_in(3, count=250, **LAWS[name])
    assert found.law == name
    for key, value in LAWS[name].items():
        parameter = found.parameters[{"deviation": "standard_deviation"}.get(key, key)]
        error = (parameter.high - parameter.low) / 3.92
        assert abs(parameter.value - value) < 3.5 * error
        assert error < max(0.1 * abs(value), 0.005)


def test_a_constant_law_has_no_scatter_and_no_sliding():
    found = found_in(5, restitution=0.4)
    assert found.parameters["standard_deviation"].low == 0.0
    assert "restitution_scatter" not in found.snippet
    assert found.goodness["sliding"]["p_value"] > 0.01
    assert found.goodness["sliding"]["change_bound"] < 0.02


def test_rebounds_too_low_to_be_seen_do_not_raise_the_law():
    """With a good part of a wide scatter below the threshold the naive mean is too high every time."""
    off, naive = [], []
    for seed in range(20):
        record = bounces(100 + seed, count=300, restitution=0.35, deviation=0.12)
        chosen = within_sight(pairs_of([record], RIG))
        found = fit(chosen.only(chosen.seen), Terms())
        off.append((found.numbers[0] - 0.35) / np.sqrt(found.covariance[0, 0]))
        hits = record.recording.impacts
        naive.append(np.nanmean(np.abs(hits["rebound_m_s"] / hits["velocity_m_s"])))
    assert min(naive) > 0.36
    assert abs(np.mean(off)) < 2.5 / np.sqrt(len(off))


def test_a_dependence_on_sliding_is_seen():
    found = found_in(8, restitution=0.3, per_sliding=12.0, deviation=0.02, count=250)
    told = found.goodness["sliding"]
    assert told["p_value"] < 1e-4
    low, high = told["slope"]["ci95"]
    assert low < 12.0 < high
    assert any("sliding" in note for note in found.warnings)


def test_records_join_and_order_does_not_matter():
    records = [bounces(seed, count=60, restitution=0.5, deviation=0.05) for seed in (1, 2, 3)]
    one, other = (identify_restitution(some, RIG) for some in (records, records[::-1]))
    for name, parameter in one.parameters.items():
        assert parameter.value == pytest.approx(other.parameters[name].value, abs=1e-3)


def test_too_few_rebounds_are_refused_by_name():
    with pytest.raises(InputError, match=r"12 are needed.*or `gears3d diagnose`"):
        found_in(1, count=8)


def test_impacts_too_slow_for_the_noise_are_said_with_their_speeds():
    record = bounces(1, count=60, restitution=0.5)
    record.summary["quality"]["flight_height_min_m"] = 60.0
    with pytest.raises(InputError, match=r"no impact is fast enough .* approach with .* to 3\d\.?\d* mm/s, and only"):
        identify_restitution([record], RIG)


def test_impacts_without_rebound_bound_it():
    found = found_in(4, count=40, restitution=0.01)
    parameter = found.parameters["restitution"]
    assert (found.law, parameter.value, parameter.low) == ("constant", 0.0, 0.0)
    assert 0.01 < parameter.high < 0.3
    assert "no rebound was seen" in found.warnings[0]


def test_a_flank_that_its_own_blows_contradict_is_left_out():
    record = bounces(6, count=120, restitution=0.5, deviation=0.02)
    hits, deep = record.recording.impacts, 20e-6
    before = np.flatnonzero(np.isfinite(hits["rebound_m_s"][:-1]))
    v, w = (np.abs(hits[name]) for name in ("velocity_m_s", "rebound_m_s"))
    apart = np.zeros(len(v))
    reverse = before[hits["flank"][before] == 1]
    apart[reverse + 1] = deep * (1.0 / v[reverse] + 1.0 / w[reverse])
    blow, departure = np.zeros(len(v)), np.zeros(len(v))
    blow[before + 1], departure[before + 1] = 1.0, w[before]
    sigma = np.full(len(v), 1e-4)
    record.segments.flights = {
        "struck": hits["flank"],
        "blow": blow,
        "end_s": hits["time_s"],
        "start_s": np.append(0.0, hits["time_s"][:-1]) + apart,
        "start_sigma_s": sigma,
        "end_sigma_s": sigma,
        "velocity_m_s": hits["velocity_m_s"],
        "departure_m_s": departure,
        "deceleration_rad_s2": np.full(len(v), 3.2),
        "deceleration_sigma_rad_s2": np.zeros(len(v)),
    }
    still = SimpleNamespace(curve=lambda time, order: np.zeros(len(time)))
    record.segments.track = SimpleNamespace(steady=still, radii=(RIG.base_radius_drive, RIG.base_radius_loose))
    record.segments.flank_speed_errors = lambda time, flank: np.zeros((len(time), 1))
    hits["duration_s"] = np.full(len(v), np.nan)
    found = identify_restitution([record], RIG)
    assert list(found.goodness["flanks"]) == ["active"]
    assert "reverse flank is misplaced by 20 um" in found.warnings[0]


@pytest.mark.parametrize("suffix", [".png", pytest.param(".svg", marks=pytest.mark.slow)])
def test_picture_is_drawn(tmp_path, suffix):
    found = found_in(3, **LAWS["linear+asymmetry"])
    picture = files.write_picture(tmp_path / f"e{suffix}", lambda: restitution_picture(found))
    assert picture.stat().st_size > 10_000


def test_snippet_goes_into_a_scenario():
    found = found_in(3, count=250, **LAWS["linear+asymmetry"])
    scenario = load(FIG5).with_(tomllib.loads(found.snippet))
    kinds = {effect.kind for effect in scenario.effects}
    assert kinds == {"restitution_speed", "restitution_asymmetry", "restitution_scatter"}
    assert scenario.rig().restitution == pytest.approx(found.parameters["restitution"].value, rel=1e-5)


@pytest.mark.slow
def test_command_line(tmp_path, capsys):
    file, picture = tmp_path / "rattle.parquet", tmp_path / "e.png"
    changes = ["--set", "impact.restitution=0.5", "--set", "run.duration=3 s"]
    for gear in ("drive", "loose"):  # without noise every period repeats the same counting errors
        changes += ["--set", f"sensors.{gear}.noise=2e-6 rad"]
    cli_exit(["synthesize", FIG5, "--out", str(file), "--seed", "7", *changes])
    capsys.readouterr()
    cli_exit(["identify", "restitution", str(file), "--rig", FIG5, "--json", "--out", str(picture)])
    told = json.loads(capsys.readouterr().out)
    assert told["law"] == "constant"
    low, high = told["parameters"]["restitution"]["ci95"]
    assert 0.495 < low < high < 0.505
    assert picture.exists()
    with pytest.raises(SystemExit) as stop:
        cli.main(["identify", "restitution", str(file)])
    assert stop.value.code == 2
    assert "--rig" in capsys.readouterr().err


def cli_exit(arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main(arguments)
    assert stop.value.code == 0
