"""Synthetic records: what encoders make of a motion, and the run-down of a loose gear."""

import json
from math import log, pi

import numpy as np
import pytest

from gears3d import cli
from gears3d.errors import InputError, UsageError
from gears3d.lumped.rig_tests import rundown
from gears3d.recording import read
from gears3d.scenario import load
from gears3d.simulation import record, simulate

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
RIG = {"run.duration": "0.5 s", "run.settle": "0.1 s", "sensors.sample_rate": "20 kHz"}


def test_a_count_is_the_largest_error():
    scenario = load(FIG5, {**RIG, "sensors.drive": {"counts_per_revolution": 8192}})
    true = simulate(scenario, "rigid").signals
    seen = record(scenario, seed=3).signals
    error = seen["theta_drive_rad"] - true["theta_drive_rad"]
    count = 2 * pi / 8192
    assert np.ptp(error) <= count
    assert np.ptp(error) > 0.99 * count
    assert np.ptp(seen["theta_loose_rad"] - true["theta_loose_rad"]) <= 2 * pi / 1_600_000
    assert list(seen) == ["time_s", "theta_drive_rad", "theta_loose_rad"]


def test_noise_has_the_deviation_asked_for_and_its_own_stream_for_each_gear():
    quiet = load(FIG5, RIG)
    noisy = quiet.with_({"sensors.drive": {"noise": "0.01 deg"}, "sensors.loose": {"noise": "0.01 deg"}})
    true, seen = simulate(quiet, "rigid").signals, record(noisy, seed=5).signals
    drive, loose = (seen[name] - true[name] for name in ("theta_drive_rad", "theta_loose_rad"))
    for error in (drive, loose):
        assert np.std(error) == pytest.approx(np.radians(0.01), rel=0.03)  # 10 001 samples: 0.7 %
        assert abs(np.corrcoef(error[1:], error[:-1])[0, 1]) < 0.04
    assert abs(np.corrcoef(drive, loose)[0, 1]) < 0.04


def test_a_seed_gives_the_same_record_and_another_seed_another():
    scenario = load(FIG5, {**RIG, "sensors.drive.noise": "0.01 deg"})
    assert record(scenario, seed=1) == record(scenario, seed=1)
    assert record(scenario, seed=1) != record(scenario, seed=2)


def test_a_record_does_not_tell_what_was_simulated():
    hidden = load(FIG5, {**RIG, "effect": [{"kind": "drag_viscous", "coefficient": "0.01 N m s/rad"}]})
    meta = record(hidden, seed=1).meta
    assert set(meta) == {"encoders"}
    assert "drag" not in json.dumps(meta)


def test_coulomb_and_viscous_drag_run_down_by_the_closed_form():
    friction, viscous, inertia, start = 0.22, 0.03, 0.0695, 30.0
    effect = [{"kind": "drag_viscous", "coefficient": f"{viscous} N m s/rad"}]
    scenario = load(FIG5, {"effect": effect, "sensors.sample_rate": "10 kHz"})
    exact = rundown(scenario, start).signals
    seen = record(scenario, "coastdown", speed=start).signals
    rate = viscous / inertia
    stop = log(1 + viscous * start / friction) / rate
    time = np.minimum(seen["time_s"], stop)
    rest = friction / viscous
    angle = (start + rest) * (1 - np.exp(-rate * time)) / rate - rest * time  # Kadmiri et al. 2012, eq. (4)
    assert exact["theta_loose_rad"] == pytest.approx(angle, abs=1e-9)
    assert np.ptp(seen["theta_loose_rad"] - angle) <= 2 * pi / 1_600_000 + 1e-9
    assert not seen["theta_drive_rad"].any()
    assert stop < seen["time_s"][-1] < 1.03 * stop


def test_what_never_stops_or_never_turns_is_refused():
    free = load(FIG5, {"drag.torque": "0 N m"})
    with pytest.raises(InputError, match=r"drag: does not stop the loose gear.*give drag\.torque"):
        record(free, "coastdown", speed=1.0)
    with pytest.raises(InputError, match="nothing runs down"):
        record(load(FIG5), "coastdown", speed=0.0)
    with pytest.raises(UsageError, match="did you mean 'coastdown'"):
        record(free, "coastdwn")


def test_the_command_writes_a_file_that_reads_back(tmp_path, capsys):
    out = tmp_path / "r.csv"
    with pytest.raises(SystemExit) as stop:
        cli.main(["synthesize", FIG5, "--out", str(out), "--set", "run.duration=1 s", "--seed", "4", "--json"])
    assert not stop.value.code
    told = json.loads(capsys.readouterr().out)
    scenario = load(FIG5, {"run.duration": "1 s"})
    assert told["samples"] == len(read(out).time) == 50001
    assert read(out).signals["theta_loose_rad"] == pytest.approx(
        record(scenario, seed=4).signals["theta_loose_rad"], abs=1e-15
    )
    with pytest.raises(SystemExit) as stop:
        cli.main(["synthesize", FIG5, "--out", str(tmp_path / "r.xls")])
    assert stop.value.code == 2
    assert ".parquet, .csv" in capsys.readouterr().err


def test_rates_and_speeds_that_cannot_be_are_named(tmp_path, capsys):
    with pytest.raises(InputError, match=r"sensors.sample_rate: is 4 Hz, less than twice the drive's 3 Hz"):
        record(load(FIG5, {"sensors.sample_rate": "4 Hz"}))
    for speed, told in (("300", "--speed: '300' has no unit"), ("0 rpm", "--speed: is 0")):
        with pytest.raises(SystemExit) as stop:
            cli.main(["synthesize", FIG5, "--out", str(tmp_path / "r.csv"), "--test", "coastdown", "--speed", speed])
        assert stop.value.code == 3
        assert told in capsys.readouterr().err
