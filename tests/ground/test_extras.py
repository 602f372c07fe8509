"""Without an extra everything else works, and what needs it gives the line for pip, never a traceback."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from gears3d import extras
from gears3d.errors import MissingExtraError

ROOT = Path(__file__).resolve().parents[2]
LIBRARIES = sorted({module for one in extras.EXTRAS.values() for module in one.libraries})
RUN = "scenarios/rigaud-2020/fig5-20rpm.toml"
BLOCKED = f"""
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {LIBRARIES!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Absent())
"""


def without_extras(*arguments, cwd=ROOT):
    code = f"{BLOCKED}from gears3d.cli import main\nmain({[*map(str, arguments)]!r})"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=cwd, env=environment)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    place = tmp_path_factory.mktemp("runs") / "rigid"
    return without_extras("run", RUN, "--model", "rigid", "--set", "run.duration=1 s", "--out", place), place


def test_every_extra_of_the_project_is_known_with_its_packages():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = project["optional-dependencies"]
    for name, extra in extras.EXTRAS.items():
        packages = []
        for line in declared[name]:
            inner = line.removeprefix("gears3d[").removesuffix("]") if line.startswith("gears3d[") else None
            packages += [one for part in inner.split(",") for one in declared[part]] if inner else [line]
        assert sorted(one.split(">")[0] for one in packages) == sorted(extra.libraries.values()), name
    core = {line.split(">")[0] for line in project["dependencies"]}
    assert core.isdisjoint({name for one in extras.EXTRAS.values() for name in one.libraries.values()})


def test_every_module_is_imported_without_any_extra():
    code = (
        f"{BLOCKED}import importlib, pkgutil, gears3d\n"
        "names = [one.name for one in pkgutil.walk_packages(gears3d.__path__, 'gears3d.')]\n"
        "for name in names:\n    name.endswith('__main__') or importlib.import_module(name)\n"
        "print(len(names), len(dir(gears3d)), gears3d.replay.__name__)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.split()[0]) > 300


def test_a_run_of_the_rigid_model_is_whole_but_for_its_replay(run):
    done, place = run
    assert done.returncode == 0, done.stderr
    assert (
        'no replay.rrd: a replay needs rerun-sdk, which is not installed (pip install "gears3d[replay]")' in done.stderr
    )
    assert {"report.html", "summary.json", "signals.parquet"} <= {path.name for path in place.iterdir()}
    assert not (place / "replay.rrd").exists()


def test_the_doctor_says_what_works_and_how_to_get_the_rest():
    done = without_extras("doctor")
    assert done.returncode == 0, done.stderr
    text = " ".join(done.stdout.split())
    assert "rigid model and closed form agree" in text
    for name in ("engine", "replay", "formats", "sweep", "video", "cad", "tables"):
        assert f'pip install "gears3d[{name}]"' in text


@pytest.mark.parametrize(
    ("extra", "arguments"),
    [
        ("engine", ("run", RUN, "--out", "made")),
        ("engine", ("run", RUN, "--stream", "--out", "made")),
        ("engine", ("bench", "transmission-error", RUN, "--out", "made")),
        ("engine", ("bench", "drop", RUN, "--out", "made")),
        ("engine", ("export", RUN, "--out", "made")),
        ("cad", ("export", RUN, "--format", "step", "--out", "made")),
        ("engine", ("validate", "--only", "helical")),
        ("replay", ("replay", "RUN")),
        ("replay", ("replay", "RUN", "RUN", "--out", "made")),
        ("sweep", ("sweep", RUN, "--vary", "drag.torque=0.2,0.4 N m", "--out", "made")),
        ("video", ("camera", "RUN", "--video", "made.mp4", "--out", "made.png")),
    ],
    ids=lambda value: value if isinstance(value, str) else "-".join(value[:2]),
)
def test_a_verb_that_needs_an_extra_gives_the_line_for_pip(extra, arguments, run, tmp_path):
    words = [str(run[1]) if word == "RUN" else str(ROOT / word) if word == RUN else word for word in arguments]
    done = without_extras(*words, cwd=tmp_path)
    assert done.returncode == MissingExtraError.exit_code, done.stdout + done.stderr
    assert f'pip install "gears3d[{extra}]"' in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "made").exists()


def test_from_python_it_is_an_error_of_gears3d(monkeypatch):
    import gears3d

    monkeypatch.setitem(sys.modules, "pybullet", None)
    scenario = gears3d.load(ROOT / RUN)
    with pytest.raises(MissingExtraError, match=r'pip install "gears3d\[engine\]".*--model rigid') as caught:
        gears3d.simulate(scenario)
    assert caught.value.extra == "engine"


def test_what_is_installed_but_broken_is_not_called_missing(monkeypatch, tmp_path):
    (tmp_path / "av.py").write_text(
        "raise ImportError('libav.so.7: cannot open shared object file')\n", encoding="utf-8"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "av", raising=False)
    with pytest.raises(MissingExtraError, match=r"cannot be loaded: libav\.so\.7"):
        extras.require("av", "a film", "video")


def test_pip_has_to_compile_pybullet_where_there_is_no_wheel(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    assert "with a C++ compiler" in extras.pip_line("engine")
    assert extras.pip_line("replay") == 'pip install "gears3d[replay]"'
