"""Verbs killed at random instants: what is finished is whole, nothing is lost or left behind, the same command goes on.

A fresh namespace of process ids gives some of them the same id every time, as a container does.
"""

import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

import psutil
from pyarrow.parquet import read_table

from gears3d import kernels
from gears3d.runs import read_run
from tests.fuzz.tally import Tally

RIG = "rigaud-2020/fig5-20rpm"
GRID = ("--vary", "drag.torque=0.1..1.5 N m lin 48", "--periods", "400", "--settle", "50")
SWEEP = ("sweep", RIG, *GRID, "--block", "4", "--no-pictures")
VERBS = {
    "run": ("run", RIG, "--model", "rigid", "--set", "run.duration=3 s"),
    "engine": ("run", RIG, "--set", "run.duration=1.2 s"),
    "stream": ("run", RIG, "--stream", "--set", "run.duration=1.2 s"),
    "sweep": (*SWEEP, "--workers", "2"),
    "alone": (*SWEEP, "--workers", "0"),
    "cluster": (*SWEEP, "--scheduler", "{scheduler}"),
    "measure": ("segment", "{record}", "--rig", RIG),
    "diagnose": ("diagnose", "{record}", "--rig", RIG, "--no-replay", "--no-3d", "--no-experiments"),
}
"""Verbs that write a folder; ``--out`` is added."""
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
MARK = "GEARS3D_KILLED_BY_THE_SUITE"
"""Variable that marks the processes of one try."""
PATIENCE_S = 20.0
"""Time in which children of a killed process must end [s]."""
ENDS = {signal.SIGKILL: (-9, 137), signal.SIGTERM: (143, -15), signal.SIGINT: (130, -2)}
"""Exit codes after each signal; negative ones before the verb is loaded."""


class Bench:
    """Files and processes that all tries share."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.record = folder / "record.parquet"
        self.scheduler = ""
        self._cluster: list[subprocess.Popen] = []
        self._finished: dict[str, tuple[float, dict[str, str]]] = {}
        self.command("synthesize", RIG, "--set", "run.duration=2 s", "--out", str(self.record))

    def words(self, verb: str, out: Path) -> list[str]:
        """Return the command line of a verb."""
        if verb == "cluster" and not self.scheduler:
            self._start()
        given = {"{record}": str(self.record), "{scheduler}": self.scheduler}
        return [*(given.get(word, word) for word in VERBS[verb]), "--out", str(out)]

    def command(self, *words: str) -> None:
        """Run a verb that must succeed."""
        subprocess.run([sys.executable, "-m", "gears3d", *words], check=True, capture_output=True, timeout=600)

    def finished(self, verb: str) -> tuple[float, dict[str, str]]:
        """Return how long a verb takes undisturbed, and the digests of its results."""
        if verb not in self._finished:
            out = self.folder / f"{verb}-finished"
            words, begin = self.words(verb, out), time.monotonic()
            self.command(*words)
            self._finished[verb] = time.monotonic() - begin, digests(out)
        return self._finished[verb]

    def _start(self) -> None:
        port = 20000 + os.getpid() % 20000
        here = ("--host", "127.0.0.1", "--no-dashboard", "--dashboard-address", "127.0.0.1:0")
        self.scheduler = f"tcp://127.0.0.1:{port}"
        for words in (
            ("scheduler", *here, "--port", str(port)),
            ("worker", self.scheduler, *here, "--nworkers", "1", "--nthreads", "1", "--no-nanny",
             "--local-directory", str(self.folder)),
        ):  # fmt: skip
            command, silent = [sys.executable, "-m", "dask", *words], subprocess.DEVNULL
            self._cluster.append(subprocess.Popen(command, stdout=silent, stderr=silent))

    def close(self) -> None:
        """Stop the cluster and remove the folder."""
        for process in self._cluster:
            process.kill()
            process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def digests(out: Path) -> dict[str, str]:
    """Return a digest of every result that does not depend on time and place."""
    found = {}
    for path in sorted(out.rglob("*")):
        if path.suffix in (".parquet", ".nc", ".csv"):
            found[str(path.relative_to(out))] = hashlib.sha256(_content(path)).hexdigest()
        elif path.name in ("summary.json", "diagnosis.json"):
            told = json.loads(path.read_text())
            found[str(path.relative_to(out))] = str(told.get("verdict", told.get("regime")))
    return found


def _content(path: Path) -> bytes:
    if path.suffix == ".parquet":
        return repr(read_table(path).to_pydict()).encode()
    if path.suffix == ".nc":
        from gears3d.sweep import open_dataset

        with open_dataset(path) as data:
            return b"".join(
                str(name).encode() + data[name].values.tobytes() for name in sorted(data.variables, key=str)
            )
    return path.read_bytes()


def readable(verb: str, out: Path) -> str:
    """Return what is wrong with a folder after a kill; empty if everything under a final name is whole."""
    try:
        if verb in ("run", "engine", "stream") and out.exists():
            read_run(out)
            if not any((out / name).exists() for name in ("report.html", "contacts.parquet")):
                return "neither report nor contacts"
        for path in out.rglob("*") if out.exists() else ():
            hidden = any(part.startswith(".") for part in path.relative_to(out).parts)
            if hidden or path.is_dir():
                continue
            if path.suffix == ".json":
                json.loads(path.read_text())
            elif path.suffix == ".html" and "</html>" not in path.read_text():
                return f"{path.name} is cut off"
            elif path.suffix in (".parquet", ".nc"):
                _content(path)
    except Exception as error:  # whatever a reader raises is a fault of the file
        return f"{type(error).__name__}: {error}"
    return ""


def ours(mark: str) -> list[psutil.Process]:
    """Return the processes of one try."""
    found = []
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            if process.environ().get(MARK) == mark and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
    return found


@cache
def _can_unshare() -> bool:
    tried = subprocess.run(["unshare", "-pf", "--mount-proc", "true"], capture_output=True, check=False)
    return tried.returncode == 0


class Try:
    """One verb, one signal, one instant."""

    def __init__(self, bench: Bench, rng: random.Random, verb: str) -> None:
        self.bench, self.verb = bench, verb
        self.number = rng.choice(SIGNALS)
        takes, self.expected = bench.finished(verb)
        self.after = rng.uniform(0.0, 0.35) if rng.random() < 0.3 else rng.uniform(0.0, 1.1 * takes)
        self.contained = rng.random() < 0.3 and _can_unshare()
        self.cold = rng.random() < 0.1
        self.before = rng.random() < 0.4
        self.folder = Path(tempfile.mkdtemp(prefix="kill-", dir=bench.folder))
        self.out = self.folder / "work" / "out"
        for name in ("work", "tmp", "home", "kernels"):
            (self.folder / name).mkdir(mode=0o700)
        self.environment = {
            **os.environ, MARK: self.folder.name, "TMPDIR": str(self.folder / "tmp"), "HOME": str(self.folder / "home"),
            "NUMBA_CACHE_DIR": str(self.folder / "kernels" if self.cold else kernels.place()),
        }  # fmt: skip

    def __str__(self) -> str:
        where = (
            f"{'container, ' if self.contained else ''}{'cold, ' if self.cold else ''}{'again' if self.before else ''}"
        )
        return f"{self.verb}, {self.number.name} after {self.after:.2f} s, {where}"

    def run(self) -> str:
        """Kill, look, and give the same command again; return what is wrong."""
        words = [sys.executable, "-m", "gears3d", *self.bench.words(self.verb, self.out)]
        if self.before:  # an earlier result is in the place
            shutil.copytree(self.bench.folder / f"{self.verb}-finished", self.out)
        if wrong := self._killed(words):
            return wrong
        if wrong := self._left_running():
            return wrong
        if self.before and self.verb in ("run", "engine", "stream", "measure") and not self.out.exists():
            subprocess.run([*words[:3], "list", "models"], env=self.environment, check=True, capture_output=True)
        if wrong := readable(self.verb, self.out):
            return f"unreadable after the kill: {wrong}"
        again = subprocess.run(words, env=self.environment, capture_output=True, text=True, timeout=600, check=False)
        if again.returncode:
            return f"the same command ends with {again.returncode}: {again.stderr[-400:]}"
        if wrong := readable(self.verb, self.out):
            return f"unreadable afterwards: {wrong}"
        if digests(self.out) != self.expected:
            return f"other results: {digests(self.out)} for {self.expected}"
        return self._left_over()

    def _killed(self, words: list[str]) -> str:
        inside = ["unshare", "-pf", "--mount-proc", "--kill-child", "bash", "-c", '"$@"; exit $?', "bash", *words]
        process = subprocess.Popen(
            inside if self.contained else words, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, start_new_session=True,
        )  # fmt: skip
        time.sleep(self.after)
        for one in self._python(process):
            with suppress(psutil.Error):
                one.send_signal(self.number)
        try:
            _, said = process.communicate(timeout=120)
        except subprocess.TimeoutExpired:
            process.kill()
            return "does not end within 120 s"
        # Python's own start ends with a traceback after Ctrl-C, before the first line of the verb
        ours_too = "__main__.py" in said or "_run_module_as_main" not in said or self.number != signal.SIGINT
        if "Traceback" in said and ours_too:
            return f"traceback: {said[-600:]}"
        permitted = (0, *ENDS[self.number], *(() if ours_too else (1,)))
        if process.returncode not in permitted and (process.returncode - 256) not in permitted:
            return f"exit code {process.returncode}: {said[-300:]}"
        return ""

    def _python(self, process: subprocess.Popen) -> list[psutil.Process]:
        """Return the process to send the signal to."""
        with suppress(psutil.Error):
            known = psutil.Process(process.pid)
            if not self.contained:
                return [known]
            verb = [sys.executable, "-m", "gears3d"]
            return [one for one in known.children(recursive=True) if one.cmdline()[:3] == verb]
        return []

    def _left_running(self) -> str:
        end = time.monotonic() + PATIENCE_S
        while (left := ours(self.folder.name)) and time.monotonic() < end:
            time.sleep(0.1)
        for process in left:
            with suppress(psutil.Error):
                process.kill()
        return f"still running: {[process.pid for process in left]}" if left else ""

    def _left_over(self) -> str:
        for folder, permitted in (("work", {"out"}), ("tmp", set())):
            left = {path.name for path in (self.folder / folder).iterdir()} - permitted
            if left:
                return f"left behind in {folder}: {sorted(left)}"
        hidden = [str(path) for path in self.out.rglob(".*") if path.name != ".lock"]
        hidden += [str(path) for path in self.out.rglob("parts")]
        hidden += [str(path) for path in (self.folder / "kernels").rglob("*") if path.suffix not in (".nbc", "")]
        return f"left behind: {hidden}" if hidden else self._left_running()

    def close(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self.folder, ignore_errors=True)


def run(seed: int, verbs: tuple[str, ...] = tuple(VERBS)) -> Iterator[Tally]:
    """Kill verbs without end; yield the tally after every try."""
    rng, tally = random.Random(seed), Tally("kills")
    bench = Bench(Path(tempfile.mkdtemp(prefix="fuzz-kills-")))
    try:
        while True:
            one = Try(bench, rng, verbs[tally.tried % len(verbs)])
            try:
                wrong = one.run()
            finally:
                one.close()
            if wrong:
                tally.fault("broken", f"try {tally.tried} of seed {seed}: {one}: {wrong}")
            else:
                tally.counts[f"{one.verb} {one.number.name[3:]}"] += 1
            yield tally
    finally:
        bench.close()
