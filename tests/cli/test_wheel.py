"""What people type works where they are: examples of the help, commands of the README and blocks of pages, with the
installed wheel.

The wheel lies in an environment of its own, with the libraries of the tests' environment; the folder is empty and
nothing of the checkout is on its path. Examples that take more than a few seconds run with ``--slow``.
"""

import importlib
import os
import re
import shlex
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.main import get_command

from gears3d import cli

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = re.compile(r"(?:^|: )(gears3d .+)$", re.MULTILINE)
FIRST = ("new", "run", "synthesize", "challenge", "diagnose", "bench", "inspect", "segment")
"""Verbs whose examples write what those of others read."""
PAGES = (
    "start/install",
    "start/first-rattle",
    "start/first-diagnosis",
    "howto/own-gear-pair",
    "howto/own-records",
    "howto/sensor-faults",
    "howto/coast-down",
    "howto/lumped-model",
    "howto/blind-test",
    "howto/share-a-result",
    "howto/sweep-on-a-cluster",
    "howto/export",
    "howto/write-an-effect",
    "howto/write-a-reader",
    "howto/without-pybullet",
    "theory/rattle",
)
"""Pages whose blocks are run one after the other; those that simulate or measure with ``--slow``."""
QUICK_PAGES = ("howto/own-gear-pair", "howto/write-a-reader", "theory/rattle")
QUICK = ("new", "list", "show", "excitation", "export", "check", "schema", "cite")
"""Verbs that need no compiled kernel."""
OF_THE_CLONE = "tools/"
"""Begin of commands that belong to a clone, not to the wheel; those of the installation are no ``sh`` block."""


def examples():
    """Return every example that a help shows, those first that write what others read; each once."""
    found = {}

    def visit(command, words):
        for line in EXAMPLE.findall(command.help or ""):
            found.setdefault(line, line.split()[1])
        for name in command.list_commands(None) if hasattr(command, "list_commands") else ():
            context = command.make_context(words[-1], ["--help"], resilient_parsing=True)
            visit(command.get_command(context, name), [*words, name])

    visit(get_command(cli.app), ["gears3d"])
    rank = {verb: place for place, verb in enumerate(FIRST)}
    return sorted(((verb, line) for line, verb in found.items()), key=lambda one: rank.get(one[0], len(rank)))


def readme():
    """Return the commands of the README's shell blocks, in order, without comments."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```sh\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    lines = "".join(blocks).replace("\\\n", " ").splitlines()
    commands = [re.sub(r"\s+#.*", "", line).strip() for line in lines]
    return [line for line in commands if line and not line.startswith(OF_THE_CLONE)]


@pytest.fixture(scope="session")
def wheel(tmp_path_factory):
    """Return a function that runs a command line in a folder with the installed wheel."""
    place = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(place)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (built,) = place.glob("gears3d-*.whl")
    venv.create(place / "env", with_pip=False, symlinks=True)
    python = next(found for one in ("bin/python", "Scripts/python.exe") if (found := place / "env" / one).exists())
    install = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-index", "--no-deps"]
    subprocess.run([*install, str(built)], check=True, capture_output=True)
    ask = [str(python), "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    packages = Path(subprocess.run(ask, check=True, capture_output=True, text=True).stdout.strip())
    # such a path comes after the environment's own packages, and its editable installs are not read
    (packages / "libraries.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "NUMBA_CACHE_DIR")}
    environment |= {"COLUMNS": "110", "NO_COLOR": "1"}
    environment |= {"PATH": f"{python.parent}{os.pathsep}{os.environ['PATH']}", "MPLBACKEND": "agg"}

    def run(line, folder):
        words = shlex.split(line) if isinstance(line, str) else line
        return subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)

    return SimpleNamespace(run=run, packages=packages)


def adapted(line):
    """Return a command as a machine without a screen runs it: a viewer would stay open."""
    return f"{line} --no-open" if line.startswith("gears3d replay ") else line


def failures(wheel, lines, folder):
    """Run commands one after the other; return those that failed with what they said."""
    done = [(line, wheel.run(adapted(line), folder)) for line in lines]
    return [f"{line}\n{one.stderr}" for line, one in done if one.returncode]


def user_files(folder):
    """Write the files that examples take from the user: a list of bounces, and a spin-up with its coast-down."""
    noise = np.random.default_rng(1)
    before = np.linspace(0.1, 1.0, 40)
    after = 0.5 * before + 1e-3 * noise.normal(size=40)
    table = np.column_stack([before, after])
    np.savetxt(folder / "bounces.csv", table, delimiter=",", header="velocity_before,velocity_after", comments="")
    torque, dry, slope, inertia, rise = 0.2, 0.05, 1e-3, 5e-3, 10.0
    time, last = np.arange(0.0, 40.0, 0.02), (torque - dry) / slope
    top = last * -np.expm1(-slope * rise / inertia)
    up = last * -np.expm1(-slope * np.minimum(time, rise) / inertia)
    down = (top + dry / slope) * np.exp(-slope * np.maximum(time - rise, 0.0) / inertia) - dry / slope
    speed = np.where(time < rise, up, np.maximum(down, 0.0))
    table = np.column_stack([time, speed + 0.02 * noise.normal(size=len(time)) * (speed > 0.0)])
    np.savetxt(folder / "spinups.csv", table, delimiter=",", header="time_s,omega_rad_s", comments="")


def test_the_wheel_is_what_runs(wheel, tmp_path):
    line = 'python -c "import gears3d, gears3d.scenario.document as s; print(gears3d.__file__, s.shipped())"'
    package, scenarios = wheel.run(line, tmp_path).stdout.split()
    assert Path(package).parent.parent.samefile(wheel.packages)
    assert Path(scenarios).samefile(wheel.packages / "gears3d" / "verification" / "papers" / "scenarios")


def test_names_lead_to_scenarios_of_the_wheel(wheel, tmp_path):
    (tmp_path / "mine.toml").write_text('extends = "rigaud-2020/fig5-20rpm"\n[impact]\nrestitution = 0.5\n')
    assert failures(wheel, ["gears3d check mine.toml rigaud-2020/fig10 base/helical-17-43"], tmp_path) == []
    listed = wheel.run("gears3d list scenarios", tmp_path).stdout
    assert "rigaud-2020/fig5-20rpm" in listed
    assert str(wheel.packages) not in listed
    unknown = wheel.run("gears3d run rigaud-2020/fig5-20rmp", tmp_path)
    assert unknown.returncode == 3
    assert "did you mean 'rigaud-2020/fig5-20rpm'?" in unknown.stderr
    assert unknown.stderr.count("error") == 1


def test_every_help_has_an_example_by_name():
    lines = [line for _, line in examples()]
    assert [verb for verb in cli.VERBS if not any(line.startswith(f"gears3d {verb}") for line in lines)] == []
    assert [line for line in lines if "scenarios/" in line] == []
    assert [line for line in readme() if "scenarios/" in line] == []


def test_quick_examples_of_the_help_run(wheel, tmp_path):
    lines = [line for verb, line in examples() if verb in QUICK]
    assert len(lines) > 7
    assert failures(wheel, lines, tmp_path) == []


def test_quick_commands_of_the_readme_run(wheel, tmp_path):
    lines = [line for line in readme() if line.split()[1] in QUICK]
    assert lines
    assert failures(wheel, lines, tmp_path) == []


@pytest.mark.timeout(7200)
@pytest.mark.parametrize(
    "name", [name if name in QUICK_PAGES else pytest.param(name, marks=pytest.mark.slow) for name in PAGES]
)
def test_blocks_of_a_page_run_in_an_empty_folder_and_print_what_it_shows(wheel, tmp_path, monkeypatch, name):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    pages = importlib.import_module("docs_blocks")
    found = pages.blocks((ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8"))
    assert found
    for block in found:
        done = wheel.run(pages.command(block), tmp_path)
        assert done.returncode == 0, f"{block.code}\n{done.stdout}{done.stderr}"
        assert pages.missing(block.shown, done.stdout) == [], f"{block.code}\n{done.stdout}"


@pytest.mark.slow
@pytest.mark.timeout(7200)
@pytest.mark.parametrize(("language", "library"), [("py", "mujoco"), ("bash", "OCP")])
def test_blocks_that_need_another_library_run(wheel, tmp_path, monkeypatch, language, library):
    pytest.importorskip(library)
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    pages = importlib.import_module("docs_blocks")
    found = pages.blocks((ROOT / "docs" / "howto" / "export.md").read_text(encoding="utf-8"), ("sh", language))
    assert [block.language for block in found] == ["sh", language]
    for block in found:
        code = re.sub(r"^pip install .*$", "", block.code, flags=re.MULTILINE)
        done = wheel.run(pages.command(block._replace(code=code)), tmp_path)
        assert done.returncode == 0, f"{code}\n{done.stdout}{done.stderr}"


def test_a_line_that_a_page_shows_in_vain_is_found(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    pages = importlib.import_module("docs_blocks")
    (block,) = pages.blocks("```sh\necho 12\n```\n\n```text\n12 mm\n...\n14 mm\n```\n")
    assert pages.missing(block.shown, "12.01 mm\n13 mm\n14 mm\n") == []
    assert pages.missing(block.shown, "12.01 mm\n13 mm\n15 mm\n") == ["14 mm"]
    assert pages.missing(block.shown, "14 mm\n12 mm\n") == ["14 mm"]


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_all_examples_of_the_help_run(wheel, tmp_path):
    user_files(tmp_path)
    assert failures(wheel, [line for _, line in examples()], tmp_path) == []


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_all_commands_of_the_readme_run(wheel, tmp_path):
    assert failures(wheel, readme(), tmp_path) == []
