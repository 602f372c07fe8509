"""The wheel in an empty environment: with no extra and with each alone, what is installed works, the rest says how."""

import os
import subprocess
import sys
import venv
from pathlib import Path

import pytest

from gears3d.extras import EXTRAS

ROOT = Path(__file__).resolve().parents[2]
PIP = ("-m", "pip", "--disable-pip-version-check", "--quiet")
CHECKED = ("engine", "replay", "formats", "sweep", "video", "cad", "tables")
pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]


def said(python, *arguments, cwd, **more):
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    command = [str(python), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, env=environment | more, check=False)


class Installed:
    """An environment with the wheel, and a folder of a user outside the checkout."""

    def __init__(self, wheel, place):
        self.wheel, self.home = wheel, place / "user"
        self.home.mkdir(parents=True)
        venv.create(place / "venv", with_pip=True)
        self.python = place / "venv" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        self.pip(str(wheel))
        self.plain = self.packages()

    def pip(self, *words):
        done = said(self.python, *PIP, "install", *words, cwd=self.home)
        assert done.returncode == 0, done.stderr

    def packages(self):
        words = ("-m", "pip", "--disable-pip-version-check", "list", "--format=freeze")
        found = set(said(self.python, *words, cwd=self.home).stdout.split())
        assert found
        return found

    def take_away(self):
        """Leave the core alone: what extras brought is uninstalled."""
        more = sorted(line.partition("==")[0] for line in self.packages() - self.plain)
        if more:
            said(self.python, *PIP, "uninstall", "--yes", *more, cwd=self.home)
        assert self.packages() == self.plain

    def verb(self, *arguments):
        done = said(self.python, "-m", "gears3d", *arguments, cwd=self.home)
        assert "Traceback" not in done.stderr, done.stderr
        assert "ImportError" not in done.stdout + done.stderr
        return done


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    pytest.importorskip("hatchling")
    place = tmp_path_factory.mktemp("wheel")
    reach = said(sys.executable, *PIP, "download", "--no-deps", "--dest", place, "typer", cwd=place)
    if reach.returncode:
        pytest.skip("no package index can be reached")
    options = ("--no-deps", "--no-build-isolation", "--wheel-dir", str(place))
    path = os.environ.get("PYTHONPATH", "")
    built = said(sys.executable, *PIP, "wheel", *options, str(ROOT), cwd=place, PYTHONPATH=path)
    assert built.returncode == 0, built.stderr
    (wheel,) = place.glob("gears3d-*.whl")
    return Installed(wheel, place)


@pytest.fixture(scope="module", params=["", *CHECKED])
def one(request, installed):
    """The environment with one extra, and the name of it."""
    installed.take_away()
    if request.param:
        installed.pip(f"{installed.wheel}[{request.param}]")
    return installed, request.param


def shipped(installed):
    code = "from gears3d.scenario.document import shipped; print(shipped() / 'rigaud-2020' / 'fig5-20rpm.toml')"
    return said(installed.python, "-c", code, cwd=installed.home).stdout.strip()


def test_it_comes_from_the_wheel_with_types_and_scenarios(installed):
    code = "import gears3d, pathlib; print(pathlib.Path(gears3d.__file__).parent)"
    package = Path(said(installed.python, "-c", code, cwd=installed.home).stdout.strip())
    assert package.is_relative_to(installed.home.parent)
    assert (package / "py.typed").exists()
    assert (package / "verification" / "papers" / "references.toml").exists()
    assert len([*(package / "verification" / "papers" / "scenarios").rglob("*.toml")]) == len(
        [*(ROOT / "scenarios").rglob("*.toml")]
    )


def test_what_needs_no_extra_works(one):
    installed, _ = one
    rig = shipped(installed)
    for arguments in (
        ("list",),
        ("cite",),
        ("check", rig),
        ("show", rig, "--out", "mesh.png"),
        ("run", rig, "--model", "rigid", "--set", "run.duration=1 s", "--out", "rigid"),
        ("synthesize", rig, "--test", "coastdown", "--speed", "60 rpm", "--out", "rundown.csv"),
        ("identify", "coastdown", "rundown.csv", "--inertia", "0.0695 kg m^2", "--out", "drag.png"),
        ("diagnose", "--help"),
    ):
        done = installed.verb(*arguments)
        assert done.returncode == 0, f"{arguments}: {done.stderr}"
    assert (installed.home / "rigid" / "report.html").exists()
    assert (installed.home / "rigid" / "summary.json").exists()


def test_the_doctor_says_what_works_and_how_to_get_the_rest(one):
    installed, extra = one
    done = installed.verb("doctor")
    assert done.returncode == 0, done.stdout + done.stderr
    text = " ".join(done.stdout.split())
    for name in CHECKED:
        works = f"{name} works: {EXTRAS[name].purpose}" in text
        assert works or f'pip install "gears3d[{name}]"' in text
        assert works == (name == extra or (name, extra) == ("tables", "sweep")), (
            f"{name} in an environment with {extra or 'no extra'}"
        )
    assert ("3D engine and rigid model agree" in text) == (extra == "engine")
    assert ("rigid model and closed form agree" in text) == (extra != "engine")


def test_what_needs_an_extra_works_with_it_and_gives_the_line_for_pip_without(one):
    installed, extra = one
    rig = shipped(installed)
    (installed.home / "a.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(600))
    installed.verb("run", rig, "--model", "rigid", "--set", "run.duration=1 s", "--no-views", "--out", "seen")
    (installed.home / "seen" / "replay.rrd").unlink(missing_ok=True)
    verbs = {
        "engine": ("run", rig, "--set", "run.duration=1 s", "--no-views", "--out", "solid"),
        "replay": ("replay", "seen", "--no-open"),
        "sweep": ("sweep", rig, "--vary", "drag.torque=0.2,0.4 N m", "--periods", "4", "--out", f"swept-{extra}"),
        "video": ("camera", "seen", "--video", "film.mp4", "--rate", "320", "--out", "strip.png"),
        "cad": ("export", rig, "--format", "step", "--gear", "drive", "--chord", "20 um", "--out", "solids"),
        "formats": ("segment", "a.h5", "--rig", rig),
    }
    for name, arguments in verbs.items():
        done = installed.verb(*arguments)
        if name == extra and name != "formats":
            assert done.returncode == 0, f"{name}: {done.stderr}"
        else:
            assert done.returncode == 3, f"{name} in an environment with {extra or 'no extra'}: {done.stderr}"
            line = 'pip install "gears3d[hdf5]"' if name == "formats" else f'pip install "gears3d[{name}]"'
            assert (line in done.stderr) == (name != extra and (name, extra) != ("formats", "sweep"))


def test_a_run_without_rerun_says_how_to_get_the_replay(one):
    installed, extra = one
    done = installed.verb("run", shipped(installed), "--model", "rigid", "--set", "run.duration=1 s", "--out", "viewed")
    assert done.returncode == 0, done.stderr
    assert ('pip install "gears3d[replay]"' in done.stderr) == (extra != "replay")
    assert (installed.home / "viewed" / "replay.rrd").exists() == (extra == "replay")
