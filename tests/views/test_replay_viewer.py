"""What the real viewer paints, without a window, and the verb that opens it."""

import contextlib
import io
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gears3d.cli import main
from gears3d.scenario import load
from gears3d.views.replay import replay, viewer
from gears3d.views.replay import scene as colours
from tests.views.film import film

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def rrd(tmp_path_factory):
    scenario = load(ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml")
    recording = film(scenario)
    return replay(recording, scenario, out=tmp_path_factory.mktemp("viewer") / "replay.rrd"), recording


@pytest.fixture(scope="module")
def shots(rrd):
    path, recording = rrd
    hit = recording.impacts["time_s"]
    try:
        with viewer.Headless(path, (1280, 720)) as window:
            return {
                "span": window.span(),
                "reverse": {view: painted(window, hit[0] + 1e-3, view) for view in ("/scene", "/zone")},
                "active": {view: painted(window, hit[1] + 1e-3, view) for view in ("/scene", "/zone")},
                "flight": {view: painted(window, 0.5 / 3.0, view) for view in ("/scene", "/zone")},
                "whole": painted(window, hit[0] + 1e-3, ""),
            }
    except viewer.ViewerError as error:
        pytest.skip(str(error))


def painted(window, at, view):
    return np.asarray(Image.open(io.BytesIO(window.picture(at, view))).convert("RGB")).astype(int)


def share(picture, colour, tolerance=24):
    """Share of the pixels that have about this colour."""
    return np.mean(np.abs(picture - np.array(colour)).max(axis=-1) <= tolerance)


@pytest.mark.viewer
def test_gears_fill_their_views(shots):
    for view in ("/scene", "/zone"):
        picture = shots["flight"][view]
        middle = picture.shape[1] // 2
        left, right = picture[:, : middle - 20], picture[:, middle + 20 :]
        assert share(left, colours.DRIVE, 40) > 0.25
        assert share(right, colours.LOOSE, 40) > 0.25
        assert share(left, colours.LOOSE) < 0.01
        assert share(right, colours.DRIVE) < 0.01


@pytest.mark.viewer
def test_both_gears_are_framed_with_their_teeth(shots):
    picture = shots["flight"]["/scene"]
    background = np.abs(picture - np.array([0x16, 0x18, 0x1D])).max(axis=-1) <= 6
    for edge in (background[:, :3], background[:, -3:], background[:3], background[-3:]):
        assert edge.mean() > 0.98
    crossings = np.abs(np.diff(background.astype(int), axis=1)).sum(axis=1)
    assert crossings.max() >= 6  # teeth in silhouette


@pytest.mark.viewer
def test_marks_have_the_colour_of_the_flank_that_is_hit(shots):
    active, reverse, flight = (share_of_marks(shots[name]["/scene"]) for name in ("active", "reverse", "flight"))
    assert active[0] > 10 * max(active[1], 1e-6)
    assert reverse[1] > 10 * max(reverse[0], 1e-6)
    assert max(flight) < 1e-6


def share_of_marks(picture):
    return [share(picture, colour) for colour in colours.FLANKS]


@pytest.mark.viewer
def test_the_gap_is_seen_in_flight_and_closes_in_contact(shots):
    for name, seen in (("flight", True), ("active", False)):
        assert bool(share(shots[name]["/zone"], colours.FLIGHT, 6) > 2e-4) is seen
    flanks = share_of_marks(shots["flight"]["/zone"])
    assert min(flanks) > 0.003


@pytest.mark.viewer
def test_curves_are_seen_beside_the_pictures(shots):
    right = shots["whole"][:, 720:]
    assert share(right, colours.LINE, 30) > 0.002
    assert min(share_of_marks(right)) > 0.0003
    assert shots["span"] == pytest.approx((0.0, 1.0))


def run_verb(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["replay", *arguments])
    return stop.value.code or 0, capsys.readouterr()


def test_verb_takes_a_file(rrd, capsys):
    path, _ = rrd
    code, said = run_verb([str(path), "--no-open", "--json"], capsys)
    assert code == 0
    assert json.loads(said.out) == {"replay": str(path), "bytes": path.stat().st_size, "picture": None}


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["gone.rrd"], 3, "does not exist"),
        (["nowhere"], 3, "gears3d run"),
        (["nowhere", "--web", "--at", "1"], 2, "--at works in the window only"),
    ],
)
def test_verb_refuses(arguments, code, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    got, said = run_verb(arguments, capsys)
    assert got == code
    assert words in said.err


def test_verb_without_viewer_says_what_to_install(rrd, capsys, monkeypatch):
    monkeypatch.setattr(viewer, "has_display", lambda: False)
    monkeypatch.setattr(viewer.shutil, "which", lambda name, path=None: None)
    monkeypatch.setattr(viewer.sys, "executable", "/nowhere/python")
    code, said = run_verb([str(rrd[0])], capsys)
    assert code == 3
    assert 'pip install "gears3d[replay]"' in said.err


def test_missing_driver_is_named(rrd, monkeypatch):
    monkeypatch.setenv("VK_ICD_FILENAMES", "/nowhere")
    monkeypatch.setenv("VK_DRIVER_FILES", "/nowhere")
    monkeypatch.setenv("WGPU_BACKEND", "vulkan")
    with pytest.raises(viewer.ViewerError, match=r"no graphics driver.*apt install mesa-vulkan-drivers"):
        viewer.snapshot(rrd[0])


@pytest.mark.viewer
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")
def test_no_viewer_outlives_its_context(rrd, shots):
    with viewer.Headless(rrd[0], (640, 360)):
        assert processes(rrd[0])
    assert gone(rrd[0])


def processes(path):
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            words = entry.read_bytes().split(b"\0")
            if b"--headless" in words and str(path).encode() in words:
                found.append(entry.parent.name)
    return found


def gone(path):
    for _ in range(50):
        if not processes(path):
            return True
        time.sleep(0.1)
    return False


@pytest.mark.viewer
def test_verb_without_display_writes_a_picture(rrd, shots, capsys, monkeypatch):
    monkeypatch.setattr(viewer, "has_display", lambda: False)
    code, said = run_verb([str(rrd[0]), "--at", "0.1", "--json"], capsys)
    assert code == 0
    made = json.loads(said.out)
    with Image.open(made["picture"]) as picture:
        assert picture.size == (1600, 900)
    assert "no display" in said.err


@pytest.mark.slow
@pytest.mark.viewer
def test_pictures_of_the_readme_can_be_made(shots, tmp_path):
    command = [sys.executable, "tools/screenshots.py", "scenarios/rigaud-2020/fig5-20rpm.toml", str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    # curves.layout gives both views of the gears 36 % of the window; the other picture is all gears
    for name, least in (("replay.png", 0.08), ("mesh-zone.png", 0.2)):
        assert (tmp_path / name).stat().st_size <= 300_000
        assert (ROOT / "docs/pictures" / name).stat().st_size <= 300_000
        with Image.open(tmp_path / name) as fresh, Image.open(ROOT / "docs/pictures" / name) as kept:
            assert fresh.size == kept.size
            seen = np.asarray(fresh.convert("RGB")).astype(int)
            assert min(share_of_marks(seen)) > 0.001
            assert min(share(seen, colours.DRIVE), share(seen, colours.LOOSE)) > least
