"""A bundle holds a result folder with the hashes of its files; what is not a result is refused in one line."""

import hashlib
import json
import zipfile

import pytest

import gears3d as g3
from gears3d import cli
from gears3d.errors import InputError, UsageError

NAME = "rigaud-2020/fig5-20rpm"


def run(capsys, *words):
    with pytest.raises(SystemExit) as stop:
        cli.main([*map(str, words)])
    said = capsys.readouterr()
    return stop.value.code or 0, said.out, said.err


@pytest.fixture
def result(tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text(f'extends = "{NAME}"\n', encoding="utf-8")
    folder = g3.assess(g3.load(rig)).save(tmp_path / "kept", command="gears3d excitation rig.toml", inputs=[rig])
    (folder / "replay.rrd").write_bytes(b"RRF0" * 100)
    (folder / ".hidden").write_text("not for others")
    (folder / "link").symlink_to("/etc/hostname")
    return folder


def test_an_archive_holds_the_result_and_the_hashes_of_its_files(result, tmp_path, capsys):
    code, out, err = run(capsys, "bundle", result, "--out", tmp_path / "b.zip")
    assert (code, err) == (0, "")
    with zipfile.ZipFile(tmp_path / "b.zip") as archive:
        assert archive.testzip() is None
        held = {name.removeprefix("b/"): archive.read(name) for name in archive.namelist()}
    manifest = json.loads(held.pop("MANIFEST.json"))
    assert set(held) == {"report.html", "excitation.json", "excitation.png", "inputs/rig.toml"}
    assert {one["file"]: (one["bytes"], one["sha256"]) for one in manifest["files"]} == {
        name: (len(data), hashlib.sha256(data).hexdigest()) for name, data in held.items()
    }
    assert manifest["gears3d"] == manifest["made_with"]["version"] == g3.__version__
    assert manifest["made_with"]["command"] == "gears3d excitation rig.toml"
    assert "excluded  replay.rrd: --replay includes it" in out
    size = (tmp_path / "b.zip").stat().st_size
    assert out.splitlines()[-1] == f"{tmp_path / 'b.zip'}: 4 files and MANIFEST.json, {size / 1e3:.3g} kB"


def test_the_same_folder_gives_the_same_bytes_and_a_replay_where_it_is_wanted(result, tmp_path):
    one, again = (g3.bundle(result, tmp_path / name / "b.zip") for name in ("x", "y"))
    assert one.path.read_bytes() == again.path.read_bytes()
    full = g3.bundle(result, tmp_path / "z.zip", replay=True)
    assert "replay.rrd" in [file["file"] for file in full.files]
    assert json.loads(json.dumps(full.to_dict()))["bytes"] == full.bytes


def test_an_input_that_changed_since_stays_out(result, tmp_path):
    (tmp_path / "rig.toml").write_text("changed", encoding="utf-8")
    assert [one["file"] for one in g3.bundle(result, tmp_path / "b.zip").files if "inputs" in one["file"]] == []


def test_a_bundle_in_the_folder_itself_does_not_hold_itself(result, monkeypatch):
    monkeypatch.chdir(result)
    for _ in range(2):
        made = g3.bundle(".")
        assert made.path.name == "kept.zip"
        assert [one["file"] for one in made.files if one["file"].endswith("zip")] == []


def test_what_is_not_a_result_is_refused_in_one_line(tmp_path, capsys):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "thesis.tex").write_text("years of work")
    for place in (tmp_path / "thesis", tmp_path / "nowhere", tmp_path / "thesis" / "thesis.tex"):
        code, out, err = run(capsys, "bundle", place)
        assert (code, out) == (3, "")
        assert err.count("error: ") == 1
        assert "--out DIR wrote" in err
    with pytest.raises(InputError, match="is not a result folder"):
        g3.bundle(tmp_path / "thesis")


def test_an_archive_is_called_zip(result, tmp_path):
    with pytest.raises(UsageError, match=r"\.zip"):
        g3.bundle(result, tmp_path / "b.tar")
