"""A file that repeats the readings of another: refused by every verb, and excluded by ``--correct duplicated-file``."""

import json

import numpy as np
import pytest

from gears3d import cli
from gears3d.measured.checks import admit
from gears3d.recording import Recording
from gears3d.scenario import load
from gears3d.simulation import record
from tests.diagnosis import asked

BENCH = "scenarios/rigaud-2020/fig5-20rpm.toml"
CHANGES = {"run.duration": "2 s", "run.settle": "0 s", "sensors.sample_rate": "20 kHz", "drag.torque": "0.3 N m"}


def run(arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main([str(each) for each in arguments])
    return stop.value.code or 0


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A rattling record and a coast-down, each with a copy that begins at another time and another angle."""
    folder = tmp_path_factory.mktemp("repeated")
    bench = load(BENCH, CHANGES)
    (folder / "rig.toml").write_text(bench.document)
    time = np.arange(9000) / 1e4
    coasting = np.round((3.0 * time - 1.5 * time**2) * 4e4 / (2.0 * np.pi)) * 2.0 * np.pi / 4e4
    made = {
        "rattle": record(bench).signals,
        "coast": {"time_s": time, "theta_drive_rad": 0.0 * time, "theta_loose_rad": coasting},
    }
    for name, signals in made.items():
        Recording(signals).write(folder / f"{name}.parquet")
        moved = {**signals, "time_s": signals["time_s"] + 3.25, "theta_loose_rad": signals["theta_loose_rad"] + 0.5}
        Recording(moved).write(folder / f"{name}-copy.parquet")
    (folder / "campaign.toml").write_text(
        'format = 1\n[[run]]\nfiles = ["coast.parquet", "coast-copy.parquet"]\nparts = ["bearing"]\n'
        'inertia = "0.0695 kg m^2"\n'
    )
    return folder


@pytest.mark.parametrize(
    ("verb", "name", "options"),
    [
        (("measure",), "rattle", ()),
        (("diagnose",), "rattle", ("--no-3d", "--no-experiments")),
        (("identify", "restitution"), "rattle", ()),
        (("identify", "coastdown"), "coast", ("--inertia", "0.0695 kg m^2")),
    ],
)
def test_a_copy_is_refused_or_excluded_by_every_verb(files, verb, name, options, capsys, monkeypatch):
    few = ("drag_coulomb", "restitution_offset", "backlash_offset")
    asked.only(monkeypatch, lambda one: one.kind in few)
    words = [*verb, *([] if verb[-1] == "coastdown" else ["--rig", files / "rig.toml"]), *options, "--json"]
    one, copy = files / f"{name}.parquet", files / f"{name}-copy.parquet"
    assert run([*words, one, copy]) == 3
    assert "--correct duplicated-file" in capsys.readouterr().out
    assert run([*words, one, copy, "--correct", "duplicated-file"]) == 0
    both = capsys.readouterr()
    assert f"excluded: {copy}: all of its rows are identical to those of {one}, 3.25 s later" in both.err
    assert run([*words, one]) == 0
    alone = json.loads(capsys.readouterr().out)
    assert json.loads(both.out) == ([alone] if verb == ("measure",) else alone)


def test_a_copy_in_a_campaign_is_refused_or_excluded(files, capsys):
    words = ["identify", "coastdown", files / "campaign.toml", "--json"]
    assert run(words) == 3
    assert "duplicated-file" in capsys.readouterr().out
    assert run([*words, "--correct", "duplicated-file"]) == 0
    assert "excluded: " in capsys.readouterr().err


def test_records_admitted_one_by_one_count_once(files, monkeypatch):
    """Those that the gate found to repeat others are excluded wherever admitted records are taken."""
    from gears3d.diagnosis import diagnose

    asked.only(monkeypatch, lambda one: one.kind == "drag_coulomb")
    bench = load(files / "rig.toml")
    first = admit(files / "rattle.parquet", bench)
    again = admit(files / "rattle-copy.parquet", bench, correct=["duplicated-file"], others=[first.channels])
    assert (first.repeats, again.repeats) == (False, True)
    found = diagnose([first, again], bench)
    assert list(found.findings) == [first.file]
    assert len(found.records) == 1
