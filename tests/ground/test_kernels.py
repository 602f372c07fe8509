"""Kernels are kept on the machine by what they are made of; records are read by compiled functions as by Python."""

import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import float64, int64, types

import gears3d
from gears3d import kernels
from gears3d.kernels import fingerprint, inner, njit
from gears3d.records import Floats2, Record, address_of, caller

PACKAGE = Path(gears3d.__file__).parent


class Line(Record):
    points: Floats2
    weight: float = 2.0


class Sheet(Record):
    """A record in a record."""

    line: Line
    count: int
    closed: bool
    law: int = 0


LAW = types.UniTuple(float64, 2)(Line.compiled, int64, float64)
call_law = caller(LAW)


@njit
def doubled(line, i, x):
    return line.weight * line.points[i, 1], x


@njit
def read(sheet, i):
    if sheet.law != 0:
        return call_law(sheet.law, (sheet.line, i, 3))
    return sheet.line.points[i, 0] * sheet.count, 1.0 if sheet.closed else 0.0


def test_compiled_functions_read_records_as_python_does():
    points = np.arange(6.0).reshape(2, 3)[:, ::2]  # not contiguous: the record keeps a copy that is
    sheet = Sheet(Line(points), 5, closed=True)
    assert read(sheet, 1) == (sheet.line.points[1, 0] * sheet.count, 1.0) == (15.0, 1.0)
    assert sheet.line.weight == 2.0


def test_a_function_is_called_by_its_address_with_numbers_cast():
    sheet = Sheet(Line(np.arange(4.0).reshape(2, 2), 10.0), 5, True, address_of(doubled, LAW))
    assert read(sheet, 1) == (30.0, 3.0)


@pytest.mark.parametrize("fields", [(), (np.zeros((2, 2)), 1.0, 3.0), (np.zeros(2),)])
def test_fields_that_do_not_fit_are_refused(fields):
    with pytest.raises(TypeError, match="Line"):
        Line(*fields)


def made(constant, comment=""):
    """Return a kernel that calls another one that reads a constant."""
    scope = {"njit": njit, "inner": inner, "LIMIT": constant, "__name__": __name__}
    exec(
        f"{comment}\n@inner\ndef low(x):\n    return min(x, LIMIT)\n@njit\ndef high(x):\n    return low(x) + 1\n", scope
    )
    return scope["high"]


def test_a_kernel_is_known_by_its_code_the_kernels_it_calls_and_their_constants():
    assert fingerprint(made(3.0)) == fingerprint(made(3.0, "# a comment\n"))
    assert fingerprint(made(3.0)) != fingerprint(made(4.0))
    assert made(4.0)(7.0) == 5.0


PRINT = """
import importlib, pkgutil, sys
import gears3d, gears3d.engine, gears3d.lumped, gears3d.gears
from gears3d.kernels import Inner, fingerprint
from numba.core.dispatcher import Dispatcher
for package in (gears3d.engine, gears3d.lumped, gears3d.gears):
    for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        for name, value in vars(importlib.import_module(found.name)).items():
            if isinstance(value, (Dispatcher, Inner)) and value.py_func.__module__ == found.name:
                print(found.name, name, fingerprint(value))
"""


def printed(folder):
    """Return the fingerprint of every kernel of a copy of the package."""
    paths = os.pathsep.join([str(folder), *filter(None, sys.path)])
    done = subprocess.run(
        [sys.executable, "-c", PRINT],
        env={**os.environ, "PYTHONPATH": paths},
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    return {tuple(line.split()[:2]): line.split()[2] for line in done.stdout.splitlines()}


@pytest.mark.slow
def test_an_edit_of_the_rigid_model_leaves_the_kernels_of_engine_and_gears(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "gears3d", ignore=shutil.ignore_patterns("__pycache__", "papers"))
    before = printed(tmp_path)
    source = tmp_path / "gears3d/lumped/roots.py"
    lines = source.read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("    return "))
    lines[first] += " * 1.0"
    source.write_text("\n".join(lines))
    after = printed(tmp_path)
    changed = {module for (module, name), digits in after.items() if before[module, name] != digits}
    assert changed
    assert all(module.startswith("gears3d.lumped") for module in changed)
    assert any(module.startswith("gears3d.engine") for module, _ in after)


def run_kernel(**env):
    """Run a kernel of the package in a process of its own; return the folder of its cache and what it compiled."""
    code = (
        "import gears3d.kernels as k, numpy as np\n"
        "from gears3d.engine.motion import drive_at\n"
        "drive_at(np.array([[2.0, 0.0, 0.0]]), 1.0)\n"
        "print(k.place(), len(k.compiled))"
    )
    kept = {
        name: value for name, value in os.environ.items() if name not in ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")
    }
    paths = os.pathsep.join([str(PACKAGE.parent), *filter(None, sys.path)])
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**kept, "PYTHONPATH": paths, **env},
        capture_output=True,
        text=True,
        check=True,
    )
    folder, count = done.stdout.split()
    return Path(folder), int(count)


@pytest.mark.slow
def test_kernels_are_kept_and_a_damaged_entry_is_made_again(tmp_path):
    folder, count = run_kernel(NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert folder == tmp_path / "cache"
    assert count > 0
    assert run_kernel(NUMBA_CACHE_DIR=str(folder)) == (folder, 0)
    for entry in folder.glob("*.nbc"):
        entry.write_bytes(entry.read_bytes()[:100])
    assert run_kernel(NUMBA_CACHE_DIR=str(folder))[1] > 0
    assert run_kernel(NUMBA_CACHE_DIR=str(folder))[1] == 0


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "getuid"), reason="modes of folders are POSIX")
def test_a_folder_that_others_may_write_to_is_not_used(tmp_path):
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o777)
    (tmp_path / "link").symlink_to(tmp_path / "own")
    (tmp_path / "own").mkdir(mode=0o700)
    for name in (shared, tmp_path / "link"):
        folder, _ = run_kernel(NUMBA_CACHE_DIR=str(name))
        assert folder not in (shared, tmp_path / "link", tmp_path / "own")
        assert not folder.exists()  # it was for that process alone
    assert not list(shared.iterdir())


def test_a_home_that_cannot_be_written_to_is_no_obstacle(tmp_path):
    (tmp_path / "home").write_text("a file")
    folder, _ = run_kernel(HOME=str(tmp_path / "home"))
    assert not folder.exists()


def test_the_cache_is_private(tmp_path):
    folder, _ = run_kernel(HOME=str(tmp_path), XDG_CACHE_HOME=str(tmp_path / "caches"))
    assert folder == tmp_path / "caches/gears3d/kernels"
    assert not folder.stat().st_mode & (stat.S_IWGRP | stat.S_IWOTH | stat.S_IROTH)


def test_a_watcher_sees_the_names_of_the_kernels_being_compiled():
    seen = []

    @njit
    def fresh(x):
        return x + 1

    fresh.py_func.__module__ = "gears3d.fresh"
    with kernels.watched(seen.append):
        assert fresh(1) == 2
    assert seen == ["fresh.fresh"]


@pytest.mark.parametrize("module", ["integrator", "records", "laws/film", "lumped/steps", "engine/loop"])
def test_sources_change_with_every_module_of_which_models_are_made(tmp_path, monkeypatch, module):
    """Sweeps do not go on with the results of another model."""
    shutil.copytree(PACKAGE, tmp_path / "copy", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(kernels, "HOME", tmp_path / "copy")
    before = kernels.sources.__wrapped__()
    path = tmp_path / f"copy/{module}.py"
    path.write_text(path.read_text() + "\n")
    assert kernels.sources.__wrapped__() != before
