"""The meshes that ship are what their command makes."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = re.findall(r"`tools/(build_meshes [^`]+)`", (ROOT / "meshes/README.md").read_text())


@pytest.mark.parametrize("command", COMMANDS)
def test_shipped_mesh_is_rebuilt_by_its_command(command, tmp_path):
    tool, scenario, folder, *options = command.split()
    words = [sys.executable, ROOT / "tools" / tool, ROOT / scenario, tmp_path, *options]
    subprocess.run(words, check=True, capture_output=True)
    made, *others = tmp_path.iterdir()
    shipped = ROOT / folder / made.name
    assert not others
    assert shipped.stat().st_size < 300_000
    old, new = trimesh.load_mesh(shipped), trimesh.load_mesh(made)
    assert old.is_watertight
    assert np.array_equal(old.faces, new.faces)
    assert new.vertices == pytest.approx(old.vertices, abs=2e-5)


def test_every_shipped_mesh_has_its_command():
    shipped = {str(path.relative_to(ROOT / "meshes")) for path in (ROOT / "meshes").rglob("*.stl")}
    assert shipped == set(re.findall(r"^\| `([^`]+\.stl)`", (ROOT / "meshes/README.md").read_text(), re.M))
    assert len(COMMANDS) == len(shipped) == 1
    missing = subprocess.run(
        [sys.executable, ROOT / "tools/build_meshes", "nowhere.toml", "x"], capture_output=True, text=True, check=False
    )
    assert missing.returncode == 3
    assert "nowhere.toml" in missing.stderr
    assert "Traceback" not in missing.stderr
