"""Without what only POSIX systems have, records are identified and diagnosed, and rigid models run."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gears3d.errors import InputError
from gears3d.runs.folder import MARK, RunFolder

ROOT = Path(__file__).resolve().parents[2]
RIG = ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml"
UNPOSIX = """
import multiprocessing.popen_fork, os, platform, signal, subprocess, sys, tempfile
# libraries find out by themselves where they are
import matplotlib.figure, numba.core.caching, numpy, pebble, platformdirs.unix, pyarrow.parquet, pydantic
import scipy.optimize, typer
platform.platform()
for name in ("fcntl", "resource", "pwd", "grp", "termios", "tty", "pty", "syslog"):
    sys.modules[name] = None
sys.modules["msvcrt"] = type(sys)("msvcrt")  # Windows has it
sys.modules["msvcrt"].LK_NBLCK, sys.modules["msvcrt"].locking = 2, lambda *_: None
for name in ("getuid", "geteuid", "getgid", "fork", "killpg", "setsid", "getpgid", "sched_getaffinity", "sysconf",
             "uname", "nice", "mkfifo", "statvfs", "getloadavg", "wait", "forkpty", "chown"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGKILL", "SIGHUP", "SIGPIPE", "SIGUSR1", "SIGALRM", "alarm", "setitimer"):
    if hasattr(signal, name):
        delattr(signal, name)
"""
"""Takes away what Windows does not have from gears3d; the libraries below it are those of this machine."""


def unposix(code, cwd):
    from gears3d import kernels

    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(kernels.place())}
    return subprocess.run(
        [sys.executable, "-c", UNPOSIX + code], capture_output=True, text=True, cwd=cwd, env=environment, check=False
    )


def verb(cwd, *arguments):
    return unposix(f"from gears3d.cli import main\nmain({[*map(str, arguments)]!r})", cwd)


def verbs(cwd, each):
    """Give verbs one after the other to one process, which ends with the first that fails."""
    code = (
        "from gears3d.cli import main\n"
        f"for words in {[[*map(str, arguments)] for arguments in each]!r}:\n"
        "    try:\n        main(words)\n"
        "    except SystemExit as end:\n"
        "        if end.code:\n            raise SystemExit(f'{words}: {end.code}')\n"
    )
    return unposix(code, cwd)


@pytest.mark.slow
def test_every_module_is_imported(tmp_path):
    code = (
        "import importlib, pkgutil, gears3d\n"
        "for one in pkgutil.walk_packages(gears3d.__path__, 'gears3d.'):\n"
        "    one.name.endswith('__main__') or importlib.import_module(one.name)\n"
    )
    done = unposix(code, tmp_path)
    assert done.returncode == 0, done.stderr


def test_a_rigid_run_and_what_is_identified_from_records(tmp_path):
    short = ("--set", "run.duration=2 s")
    each = (
        ("run", RIG, "--model", "rigid", "--out", "a run", *short),
        ("run", RIG, "--model", "rigid", "--out", "a run", *short),  # takes the place of the first
        ("report", "a run"),
        ("synthesize", RIG, "--test", "coastdown", "--speed", "60 rpm", "--out", "rundown.csv"),
        ("identify", "coastdown", "rundown.csv", "--inertia", "0.0695 kg m^2", "--out", "drag.png"),
        ("synthesize", RIG, "--model", "rigid", "--out", "rattle.csv", *short),
        ("segment", "rattle.csv", "--rig", RIG, "--out", "measured"),
        ("doctor", "--no-check"),
    )
    done = verbs(tmp_path, each)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "measured" / "report.html").stat().st_size > 100_000


@pytest.mark.slow
def test_a_diagnosis_and_a_sweep(tmp_path):
    speeds = (15, 20, 30)
    for speed in speeds:
        more = ("--set", f"motion.mean={speed} rpm", "--set", "drag.torque=0.3 N m", "--seed", speed)
        assert verb(tmp_path, "record", RIG, "--model", "rigid", "--out", f"{speed}.csv", *more).returncode == 0
    done = verb(tmp_path, "diagnose", *(f"{one}.csv" for one in speeds), "--rig", RIG, "--out", "found", "--no-replay")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "found" / "diagnosis.json").exists()


@pytest.mark.parametrize("code_page", ["cp1252", "cp437", "ascii"])
def test_output_into_a_pipe_is_utf_8_whatever_the_code_page(code_page):
    words = [sys.executable, "-m", "gears3d", "excitation", str(RIG)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": code_page}
    done = subprocess.run(words, capture_output=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr.decode()
    assert "Λ" in done.stdout.decode("utf-8")


def test_an_earlier_run_that_cannot_be_taken_away_stays(tmp_path, monkeypatch):
    place = tmp_path / "run"
    place.mkdir()
    (place / MARK).write_text("{}", encoding="utf-8")
    before = Path.rename

    def rename(self, target):
        if self.parent.name == "new":
            raise PermissionError(13, "The process cannot access the file")
        return before(self, target)

    monkeypatch.setattr(Path, "rename", rename)
    with (
        pytest.raises(InputError, match="cannot be replaced: The process cannot access the file"),
        RunFolder(place) as one,
    ):
        one.commit()
    assert [path.name for path in tmp_path.iterdir()] == ["run"]
    assert (place / MARK).read_text(encoding="utf-8") == "{}"
