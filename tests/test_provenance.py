"""Provenance of results: hashes of what was read, in JSON and as comments that TOML takes."""

import json
import subprocess
import tomllib

import pytest

from gears3d import cli
from gears3d.provenance import comment, provenance
from gears3d.scenario import load
from gears3d.simulation import record


def hash_of(path):
    return subprocess.run(["sha256sum", path], capture_output=True, text=True, check=True).stdout.split()[0]


def test_each_file_is_hashed_once_and_the_comment_is_toml(tmp_path):
    path = tmp_path / "r.csv"
    path.write_bytes(b"a,b\n")
    made = provenance([path, None, str(path), tmp_path / "gone"], "gears3d segment 'a\nb'")
    assert [one["sha256"] for one in made["inputs"]] == [hash_of(path)]
    assert tomllib.loads(comment(made) + "value = 1\n") == {"value": 1}


def test_measure_prints_the_hashes_of_record_map_and_rig(tmp_path, capsys):
    rig = tmp_path / "rig.toml"
    bench = load("scenarios/rigaud-2020/fig5-20rpm.toml", {"run.duration": "2 s", "sensors.sample_rate": "20 kHz"})
    rig.write_text(bench.document)
    record(bench).write(tmp_path / "r.parquet")
    chart = tmp_path / "record.toml"
    names = {"time": "time_s", "drive": "theta_drive_rad", "loose": "theta_loose_rad"}
    text = "".join(f'[{role}]\nchannel = "{name}"\n' for role, name in names.items())
    chart.write_text(f'format = 1\nfile = "r.parquet"\n{text}')
    with pytest.raises(SystemExit) as stop:
        cli.main(["segment", str(chart), "--rig", str(rig), "--json"])
    assert not stop.value.code
    summary = json.loads(capsys.readouterr().out)
    found = {one["file"]: one["sha256"] for one in summary["provenance"]["inputs"]}
    assert found == {str(path): hash_of(path) for path in (tmp_path / "r.parquet", chart, rig)}
    assert summary["drive_motion"]["harmonics"][0]["frequency_Hz"]["value"]
