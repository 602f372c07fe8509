"""``gears3d inspect`` examines sensors alone; records come from files or standard input, rigs with changed values."""

import io
import json
import sys

import pytest

from gears3d import cli
from gears3d.recording import read
from gears3d.scenario import load
from gears3d.simulation import synthesize

RIG = "scenarios/rigaud-2020/fig5-20rpm.toml"


@pytest.fixture
def gears3d(capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main([str(each) for each in arguments])
        captured = capsys.readouterr()
        return stop.value.code or 0, captured.out, captured.err

    return run


# The scenario states another rate than the record has.
RATE = "sensors.sample_rate"
AS_RECORDED = ("--set", f"{RATE}=10 kHz")


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    file = tmp_path_factory.mktemp("inspected") / "rattle.csv"
    synthesize(load(RIG, {"run.duration": "1 s", RATE: "10 kHz"})).write(file)
    return file


def test_findings_of_each_record_are_printed(gears3d, record):
    code, out, err = gears3d("inspect", record, "--rig", RIG, *AS_RECORDED)
    assert code == 0
    assert f"{record}: 10001 samples, 0 to 1 s: theta_drive_rad, theta_loose_rad" in out
    assert "sensors: no findings" in err
    (found,) = json.loads(gears3d("inspect", record, "--rig", RIG, *AS_RECORDED, "--json")[1])
    assert (found["file"], found["samples"], found["findings"]) == (str(record), 10001, [])
    assert gears3d("inspect")[0] == 2
    assert gears3d("inspect", record, "--out", "map.toml")[0] == 2


def test_a_time_of_another_rate_than_the_rig_states_is_reported_with_one_override(gears3d, record):
    code, _, err = gears3d("segment", record, "--rig", RIG)
    assert code == 0
    assert "its steps of 0.0001 s make 10000 Hz, the rig declares a sampling rate of 50000 Hz; the times of the" in err
    assert "--set 'sensors.sample_rate=10000 Hz'" in err
    assert "sampling rate" not in gears3d("segment", record, "--rig", RIG, "--set", "sensors.sample_rate=10000 Hz")[2]


def test_a_record_is_read_from_stdin_as_from_its_file(gears3d, record, monkeypatch):
    named = json.loads(gears3d("inspect", record, "--json")[1])
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(record.read_bytes())))
    piped = json.loads(gears3d("inspect", "-", "--json")[1])
    assert [{**one, "file": ""} for one in piped] == [{**one, "file": ""} for one in named]


def test_set_changes_the_rig_of_records(gears3d, record, tmp_path):
    changed = ("--set", "title=changed", *AS_RECORDED)
    code, _, _ = gears3d("segment", record, "--rig", RIG, *changed, "--out", tmp_path / "made")
    assert code == 0
    assert read(tmp_path / "made").meta["title"] == "changed"
    code, _, err = gears3d("segment", record, "--rig", RIG, "--set", "drag.torque=0.1 N")
    assert code == 3
    assert "drag.torque" in err
    for verb in (("inspect",), ("segment",), ("identify", "restitution"), ("camera",), ("replay",)):
        code, _, err = gears3d(*verb, record, "--set", "drag.torque=0.1 N m")
        assert code == 2
        assert "give --rig as well" in err


def test_old_and_new_place_of_guess(gears3d, record, tmp_path):
    foreign = tmp_path / "foreign.csv"
    head, _, rows = record.read_text().partition("\n")
    foreign.write_text(
        head.replace("time_s", "t").replace("theta_drive_rad", "Enc1").replace("theta_loose_rad", "Enc2") + "\n" + rows
    )
    code, proposed, err = gears3d("inspect", foreign, "--guess", "--rig", RIG)
    assert code == 0, err
    code, again, err = gears3d("measure", foreign, "--guess", "--rig", RIG)
    assert (code, again) == (0, proposed)
    assert err.count("is called") == 2


def test_the_map_of_one_gear_leads_to_its_coast_down(gears3d, tmp_path):
    rows = "\n".join(f"{0.1 * k:.1f},{600 - k}" for k in range(400))
    (tmp_path / "run.csv").write_text(f"time [s],speed [rpm]\n{rows}\n")
    code, printed, err = gears3d("inspect", tmp_path / "run.csv", "--guess", "--out", tmp_path / "record.toml")
    assert code == 0, err
    assert "identify coastdown" in printed
    assert "segment" not in printed
