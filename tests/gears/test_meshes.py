"""The meshes that ship are what their commands make, and are the papers' gears."""

import hashlib
import importlib.machinery
import importlib.util
import json
from math import cos, radians
from pathlib import Path

import numpy as np
import pytest
import trimesh

from gears3d import cli
from gears3d.scenario import load

ROOT = Path(__file__).resolve().parents[2]
LOADER = importlib.machinery.SourceFileLoader("build_meshes", str(ROOT / "tools/build_meshes"))
TOOL = importlib.util.module_from_spec(importlib.util.spec_from_loader("build_meshes", LOADER))
LOADER.exec_module(TOOL)
COMMANDS = TOOL.commands()
BASES = {path.stem: path for path in (ROOT / "scenarios/base").glob("*.toml")}


@pytest.mark.parametrize("command", COMMANDS, ids=lambda words: words[1].split("/")[-1])
def test_shipped_meshes_are_rebuilt_by_their_command(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    place = command.index("--out") + 1
    folder = ROOT / command[place]
    with pytest.raises(SystemExit) as stop:
        cli.main([*command[:place], str(tmp_path), *command[place + 1 :]])
    assert not stop.value.code
    capsys.readouterr()
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in folder.iterdir()}
    for new_file in tmp_path.glob("*.stl"):
        shipped = folder / new_file.name
        old, new = trimesh.load_mesh(shipped), trimesh.load_mesh(new_file)
        assert shipped.stat().st_size < 400_000
        assert old.is_watertight
        assert np.array_equal(old.faces, new.faces)
        assert new.vertices == pytest.approx(old.vertices, abs=2e-5)
        card, fresh = (json.loads((f / new_file.with_suffix(".json").name).read_text()) for f in (folder, tmp_path))
        assert card["files"]["stl"]["sha256"] == hashlib.sha256(shipped.read_bytes()).hexdigest()
        assert card["data"] == fresh["data"]
        assert card.keys() == fresh.keys()
        assert card["pair"].keys() == fresh["pair"].keys()
        assert card["chord_m"] == fresh["chord_m"]
        assert card["solid"] == fresh["solid"]
        assert card["mass_properties"]["mass_kg"] == pytest.approx(fresh["mass_properties"]["mass_kg"], rel=1e-9)
        assert card["command"] == "gears3d " + " ".join(f'"{w}"' if " " in w else w for w in _in_order(command))


def _in_order(command):
    """The words as a card writes them: scenario, out, format, chord, gear."""
    options = dict(zip(command[2::2], command[3::2], strict=True)) | {"--format": "stl"}
    order = [name for name in ("--out", "--format", "--chord", "--gear") if name in options]
    return [*command[:2], *(word for name in order for word in (name, options[name]))]


def test_everything_that_ships_has_a_command_and_a_definition():
    folders = {path.parent.name for path in (ROOT / "meshes").rglob("*.stl")}
    assert folders == {Path(words[words.index("--out") + 1]).name for words in COMMANDS} == set(BASES)
    assert sum(path.stat().st_size for path in (ROOT / "meshes").rglob("*") if path.is_file()) < 2_000_000


def test_pairs_of_the_papers():
    pairs = {name: load(path).pair() for name, path in BASES.items()}
    kadmiri = pairs["kadmiri-2012"]
    assert (kadmiri.drive.teeth, kadmiri.loose.teeth) == (19, 37)
    assert kadmiri.loose.base_radius == pytest.approx(51.0e-3, abs=1e-7)
    assert load(BASES["kadmiri-2012"]).gears.loose.inertia == pytest.approx(0.38 * 51e-3**2, rel=1e-4)
    ottewill = pairs["ottewill-2010"]
    assert (ottewill.drive.teeth, ottewill.loose.teeth) == (18, 18)
    assert 2 * ottewill.drive.reference_radius == pytest.approx(0.108, rel=1e-12)
    assert ottewill.backlash / ottewill.loose.base_radius == pytest.approx(2 * 1.63e-2, rel=3e-4)
    rigaud = pairs["rigaud-2020"]
    assert (rigaud.drive.teeth, rigaud.loose.teeth, rigaud.backlash) == (90, 90, pytest.approx(250e-6, abs=1e-15))
    helical = pairs["helical-17-43"]
    assert (helical.drive.teeth, helical.loose.teeth, helical.drive.helix_angle) == (17, 43, radians(28))
    assert helical.normal_backlash == pytest.approx(0.12e-3, rel=1e-4)
    assert 1500 / 60 * helical.drive.teeth == 425
    assert helical.drive.base_radius == pytest.approx(24.476e-3, abs=5e-7)
    assert cos(helical.drive.base_helix_angle) == pytest.approx(cos(radians(26.178)), abs=1e-5)


def test_tool_refuses_what_it_does_not_know(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["build_meshes", "nowhere"])
    assert TOOL.main() == 2
    assert "no command of meshes/README.md names nowhere" in capsys.readouterr().err
