"""``gears3d run`` from the outside: the run folder of the contract, the table, exit codes, and Ctrl-C."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyarrow.parquet
import pytest

from gears3d import cli, simulation
from gears3d.errors import EngineError
from gears3d.recording import Recording, read
from gears3d.runs import read_run

FILE = "scenarios/rigaud-2020/fig5-20rpm.toml"
SIGNALS = "time_s theta_drive_rad theta_loose_rad omega_drive_rad_s omega_loose_rad_s displacement_m velocity_m_s"
IMPACTS = "time_s flank velocity_m_s rebound_m_s impulse_N_s phase_rad tooth_drive tooth_loose flight_height_m"
COMPARISON = {
    *["impacts_compared", "impacts_matched", "impacts_missed", "impacts_invented", "velocity_error_median"],
    *[
        "velocity_error_p95",
        "velocity_bias",
        "phase_error_median_cycles",
        "flight_height_min_m",
        "regime_equal",
        "mode",
    ],
}


def gears3d(*words, **more):
    command = [sys.executable, "-m", "gears3d", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120, **more)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / "fig5"
    done = gears3d("run", FILE, "--set", "run.duration=1.2 s", "--out", out)
    assert done.returncode == 0, done.stderr
    return out, done


def test_the_folder_holds_what_the_contract_says(run):
    out, _ = run
    names = {str(p.relative_to(out)) for p in out.rglob("*") if p.is_file()}
    assert names == {
        *["scenario.toml", "signals.parquet", "impacts.parquet", "summary.json", "replay.rrd", "report.html"],
        *["twin/signals.parquet", "twin/impacts.parquet"],
    }
    for folder in (out, out / "twin"):
        signals = pyarrow.parquet.read_schema(folder / "signals.parquet")
        assert signals.names == SIGNALS.split()
        assert signals.field("displacement_m").metadata[b"unit"] == b"m"
        assert pyarrow.parquet.read_schema(folder / "impacts.parquet").names == IMPACTS.split()
    summary = json.loads((out / "summary.json").read_text())
    assert set(summary["comparison"]) == COMPARISON
    assert summary["status"] == "complete"
    assert summary["error_budget"]["total"] > 0
    report = (out / "report.html").read_text()
    assert len(report) < 2_000_000
    assert 'alt="9 pictures of the teeth in mesh over 333.3 ms: active flanks touch' in report
    assert (out / "replay.rrd").stat().st_size < 3_000_000 * 1.2


def test_the_table_says_what_came_out_and_stays_quiet_otherwise(run):
    out, done = run
    assert done.stderr == ""
    assert "double sided" in done.stdout
    assert "matched, 0 missed, 0 invented" in " ".join(done.stdout.split())
    assert "expected regime = double_sided: met" in done.stdout
    assert str(out) in done.stdout.replace("\n", "")


def test_the_folder_can_be_read_and_run_again(run, tmp_path):
    out, _ = run
    again = tmp_path / "again"
    done = gears3d("run", out / "scenario.toml", "--out", again, "--no-views", "--json", "--error-estimate")
    assert done.returncode == 0, done.stderr
    first, second = read_run(out), read_run(again)
    assert json.loads(done.stdout) == second.summary
    assert first.summary["error_estimate"] is None
    assert second.summary["error_estimate"]["impacts"] > 10
    assert second.summary["error_estimate"]["displacement_m"] < 1e-13  # constant torques: flights are parabolas
    assert first.recording.signals.keys() == second.recording.signals.keys()
    for name, column in first.recording.impacts.items():
        assert column.tolist() == second.recording.impacts[name].tolist(), name
    assert second.twin is not None


def test_the_twin_alone(tmp_path):
    done = gears3d("run", FILE, "--model", "rigid", "--no-views", "--out", tmp_path / "rigid", "--json")
    summary = json.loads(done.stdout)
    assert (done.returncode, summary["model"], summary["comparison"]) == (0, "rigid", None)
    impacts = read(tmp_path / "rigid").impacts
    settled = (impacts["time_s"] > 2 / 3) & (impacts["flight_height_m"] > 5e-8)
    assert settled.sum() == summary["impacts"] == summary["active_impacts"] + summary["reverse_impacts"]


def test_a_missed_expectation_is_exit_code_1(tmp_path):
    words = ("--set", "expect.regime=contact", "--set", "run.duration=1 s", "--no-views", "--model", "rigid")
    done = gears3d("run", FILE, *words, "--out", tmp_path / "x")
    assert done.returncode == 1
    assert "expected regime = contact: missed (found double_sided)" in done.stdout
    assert (tmp_path / "x" / "summary.json").exists()


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["nowhere.toml"], 3, "nowhere.toml"),
        ([FILE, "--set", "motion.harmonics[0].frequency=180 rpm"], 3, "motion.harmonics[0].frequency"),
        ([FILE, "--set", "gears.loose.inertia=-0.1 kg m^2"], 3, "gears.loose.inertia"),
        ([FILE, "--set", "gears.drive.teeth=2"], 3, "gears.drive.teeth"),
        ([FILE, "--set", "run.duration=0 s"], 3, "run.duration"),
        ([FILE, "--set", "run.output_rate=1e12 Hz"], 3, "run.output_rate: asks for 5e+12 samples"),
        ([FILE, "--set", "mount.bakclash=1 mm"], 3, "did you mean"),
        ([FILE, "--model", "bulet"], 2, "did you mean 'bullet'"),
        ([FILE, "--twin", "bulet"], 2, "did you mean"),
        ([FILE, "--contact", "nativ"], 2, "did you mean 'native'"),
        ([FILE, "--model", "rigid", "--contact", "native"], 2, "model 'rigid' has no choice of contact"),
        ([FILE, "--model", "plastic", "--set", "impact.restitution=0.3"], 3, "impact.restitution: is 0.3"),
    ],
)
def test_bad_input_is_one_clear_error(words, code, text, tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["run", *words, "--out", str(tmp_path / "x")])
    said = capsys.readouterr().err
    assert stop.value.code == code, said
    assert text in " ".join(said.split())
    assert "Traceback" not in said
    assert not list(tmp_path.iterdir())


def test_an_unwritable_output_is_said_before_anything_is_simulated(tmp_path):
    (tmp_path / "file").write_text("")
    begin = time.perf_counter()
    done = gears3d("run", FILE, "--set", "run.duration=1000 s", "--out", tmp_path / "file" / "run")
    assert time.perf_counter() - begin < 10
    assert done.returncode == 3
    assert "cannot be written" in " ".join(done.stderr.split())


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_an_interrupt_leaves_a_valid_partial_run_that_says_so(tmp_path, number):
    out = tmp_path / "run"
    command = [sys.executable, "-m", "gears3d", "run", FILE, "--set", "run.duration=600 s", "--out", str(out)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 30
    while not list(tmp_path.glob(".gears3d-*")) and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(1)  # in which the engine simulates most of a minute, all of which is written
    os.kill(process.pid, number)
    stdout, stderr = process.communicate(timeout=120)
    assert process.returncode == 128 + number, stderr
    assert "Traceback" not in stderr
    assert "partial" in stdout
    partial = read_run(out)
    assert partial.summary["status"] == "partial"
    assert 0 < partial.summary["reached_s"] < 600
    time_s = partial.recording.signals["time_s"]
    assert time_s[-1] == pytest.approx(partial.summary["reached_s"], abs=1e-3)
    assert (Path(out) / "report.html").exists()
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


@pytest.mark.slow
def test_a_run_that_breaks_off_keeps_what_happened_until_then(tmp_path):
    soft = "effect=[{kind = 'tooth_compliance', stiffness = '7e4 N/m', damping = '0 N s/m'}]"
    words = ["run", FILE, "--set", soft, "--set", "run.duration=2 s", "--out", tmp_path / "run"]
    done = gears3d(*words)
    assert done.returncode == 4
    assert "Traceback" not in done.stderr
    said = " ".join(done.stderr.split())
    assert "deep in each other at t = " in said
    assert f"the run until then is in {tmp_path / 'run'}" in said
    assert "partial: ended at" in done.stdout.partition("regime")[0]
    kept = read_run(tmp_path / "run")
    assert kept.summary["status"] == "partial"
    assert kept.summary["stopped_by"] in said
    assert 0 < kept.summary["reached_s"] < 2
    assert kept.recording.meta["stopped_by"] == kept.summary["stopped_by"]
    assert kept.recording.time[-1] == pytest.approx(kept.summary["reached_s"], abs=1e-4)
    assert (tmp_path / "run" / "replay.rrd").exists()
    assert (tmp_path / "run" / "report.html").exists()
    told = json.loads(gears3d(*words, "--json", "--no-views").stdout)
    assert told["error"]["exit_code"] == 4


def test_a_run_that_ends_within_its_first_period_has_no_regime(monkeypatch, tmp_path, capsys):
    honest = simulation.simulate

    def brief(scenario, model, **how):
        made = honest(scenario.with_({"run.duration": "0.2 s", "run.settle": "0 s"}), model, **how)
        cut = Recording(made.signals, made.impacts, {**made.meta, "interrupted": True, "reached_s": 0.2})
        raise EngineError("the gears stopped", cut)

    monkeypatch.setattr(simulation, "simulate", brief)
    with pytest.raises(SystemExit) as stop:
        cli.main(["run", FILE, "--set", "run.duration=4 s", "--twin", "none", "--out", str(tmp_path / "run")])
    assert stop.value.code == 4
    shown = " ".join(capsys.readouterr().out.split())
    assert "status partial: ended at 0.2 s regime not determined: less than one period" in shown
    summary = read_run(tmp_path / "run").summary
    assert (summary["regime"], summary["motion"], summary["comparison"]) == (None, None, None)


def test_an_interrupt_of_the_twin_keeps_the_run(monkeypatch, tmp_path, capsys):
    honest = simulation.simulate

    def impatient(scenario, model, **how):
        if model == "rigid":
            assert how["progress"] is not None
            raise KeyboardInterrupt
        return honest(scenario, model, **how)

    monkeypatch.setattr(simulation, "simulate", impatient)
    with pytest.raises(SystemExit) as stop:
        cli.main(["run", FILE, "--set", "run.duration=1.2 s", "--no-views", "--out", str(tmp_path / "run")])
    assert not stop.value.code
    assert "the twin was interrupted: no comparison" in capsys.readouterr().err
    kept = read_run(tmp_path / "run")
    assert kept.summary["status"] == "complete"
    assert kept.summary["comparison"] is None
    assert kept.twin is None


def test_a_streamed_run_has_the_tables_and_the_numbers_of_a_usual_one(run, tmp_path):
    words = ["run", FILE, "--set", "run.duration=1.2 s", "--stream", "--json", "--out", tmp_path / "long"]
    done = gears3d(*words)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    usual, long = read_run(run[0]), read_run(tmp_path / "long")
    assert told == long.summary
    for name in ("regime", "impacts", "active_velocity_mean_m_s", "energy_J_s", "flight_share", "reached_s", "status"):
        assert told[name] == pytest.approx(usual.summary[name]), name
    assert told["excitation"] == pytest.approx(usual.summary["excitation"], rel=1e-3)
    for name, column in usual.recording.signals.items():
        assert column.tolist() == long.recording.signals[name].tolist(), name
    assert {path.name for path in (tmp_path / "long").iterdir()} == {
        *["scenario.toml", "signals.parquet", "impacts.parquet", "contacts.parquet", "summary.json"]
    }
    done = gears3d(*words, "--twin", "rigid")
    assert done.returncode == 2
    assert "needs the whole recording" in done.stderr
