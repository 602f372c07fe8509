"""Verbs in odd environments: without a home, with closed streams, on a full disk, in the C locale, two at once."""

import json
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from gears3d import kernels
from tests.fuzz.kills import RIG, readable
from tests.fuzz.tally import Tally

ROOT = Path(__file__).resolve().parents[2]
VERBS = {
    "list": ("list", "effects"),
    "check": ("check", RIG),
    "describe": ("report", "{run}"),
    "show": ("show", RIG, "--out", "{out}.svg"),
    "run": ("run", RIG, "--model", "rigid", "--set", "run.duration=1 s", "--out", "{out}"),
    "stream": ("run", RIG, "--stream", "--set", "run.duration=1.2 s", "--out", "{out}"),
    "sweep": ("sweep", RIG, "--vary", "drag.torque=0.1..1 N m lin 6", "--periods", "20", "--settle", "5", "--workers",
              "1", "--out", "{out}"),
    "measure": ("segment", "{record}", "--rig", RIG, "--out", "{out}"),
    "faulty": ("check", "nowhere.toml"),
}  # fmt: skip
"""Verbs with their options; the last is refused everywhere."""


@dataclass
class Odd:
    """An environment: variables, a shell line before the verb, limits, and the exit codes permitted besides success."""

    set: dict[str, str] = field(default_factory=dict)
    unset: tuple[str, ...] = ()
    shell: str = '"$@"'
    limit: Callable[[], None] | None = None
    permitted: tuple[int, ...] = ()
    needs: str = ""
    name: str = "out"


def _small_files() -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))


ODD = {
    "as usual": Odd(),
    "no home": Odd(unset=("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")),
    "a home that is no folder": Odd({"HOME": "/dev/null"}, unset=("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")),
    "no kernel cache": Odd({"NUMBA_CACHE_DIR": "/dev/null/kernels"}),
    "no temporary folder": Odd({"TMPDIR": "/nowhere"}),
    "C locale": Odd({"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}),
    "ASCII streams": Odd({"PYTHONIOENCODING": "ascii"}),
    "C locale, ASCII, no colour": Odd({"LC_ALL": "POSIX", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii:strict"}),
    "Latin-1 streams": Odd({"PYTHONIOENCODING": "latin-1"}),
    "closed output": Odd(shell='"$@" >&-'),
    "closed errors": Odd(shell='"$@" 2>&-'),
    "all streams closed": Odd(shell='"$@" <&- >&- 2>&-'),
    "full output": Odd(shell='"$@" >/dev/full', permitted=(3,)),
    "full errors": Odd(shell='"$@" 2>/dev/full', permitted=(3,)),
    "a reader that goes away": Odd(shell='"$@" | true; exit ${PIPESTATUS[0]}'),
    "full disk": Odd(
        shell='mount -t tmpfs -o size=40k tmpfs "$WORK" && cd "$WORK" && "$@"', permitted=(3, 4), needs="-m"
    ),
    "files of 20 kB": Odd(limit=_small_files, permitted=(3, 4)),
    "a folder that is gone": Odd(shell='mkdir gone && cd gone && rmdir ../gone && "$@"', permitted=(3, 4)),
    "a name in another alphabet": Odd(name="Zähne [red] µ 歯車"),
    "a name that is no text": Odd(name="\udcff\udcfe", permitted=(2, 3)),
    "a narrow terminal": Odd({"COLUMNS": "20"}),
    "no terminal, no colour": Odd({"TERM": "dumb", "NO_COLOR": "1"}),
}
"""The environments."""


@cache
def can_unshare(option: str) -> bool:
    """Return whether this user may have name spaces of his own."""
    return not option or not subprocess.run(["unshare", option, "true"], capture_output=True, check=False).returncode


class Bench:
    """A run and a record that the verbs read."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.run, self.record = folder, folder / "run", folder / "record.parquet"
        for words in (
            ("run", RIG, "--model", "rigid", "--set", "run.duration=1 s", "--out", self.run),
            ("synthesize", RIG, "--set", "run.duration=2 s", "--out", self.record),
        ):
            subprocess.run([sys.executable, "-m", "gears3d", *map(str, words)], check=True, capture_output=True)

    def attempt(self, verb: str, odd: Odd) -> str:
        """Give a verb in an environment; return what is wrong."""
        folder = Path(tempfile.mkdtemp(prefix="env-", dir=self.folder))
        home, work, temporaries = (folder / name for name in ("home", "work", "tmp"))
        for one in (home, work, temporaries):
            one.mkdir(mode=0o700)
        out = work / odd.name
        given = {"{out}": str(out), "{out}.svg": f"{out}.svg", "{run}": str(self.run), "{record}": str(self.record)}
        words = [sys.executable, "-m", "gears3d", *(given.get(word, word) for word in VERBS[verb])]
        line = ["bash", "-c", odd.shell, "bash", *words]
        environment = {
            **os.environ, "PYTHONPATH": str(ROOT), "HOME": str(home), "TMPDIR": str(temporaries), "WORK": str(work),
            "NUMBA_CACHE_DIR": str(kernels.place()), "PYTHONDONTWRITEBYTECODE": "1", **odd.set,
        }  # fmt: skip
        for name in odd.unset:
            environment.pop(name, None)
        try:
            done = subprocess.run(
                ["unshare", odd.needs, *line] if odd.needs else line, env=environment, capture_output=True, timeout=120,
                cwd=work, preexec_fn=odd.limit, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return "does not end within 120 s"
        try:
            return self._judged(verb, odd, done, out) or self._outside(home, work, out)
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def _judged(self, verb: str, odd: Odd, done: subprocess.CompletedProcess, out: Path) -> str:
        said = (done.stderr + done.stdout).decode(errors="replace")
        if "Traceback" in said or "Exception ignored" in said:
            return f"traceback: {said[-700:]}"
        permitted = (3, *odd.permitted) if verb == "faulty" else (0, *odd.permitted)
        if done.returncode not in permitted:
            return f"exit code {done.returncode}: {said[-400:]}"
        whole = verb if verb in ("run", "stream") and done.returncode == 0 else ""
        return readable(whole, out) if out.is_dir() else ""

    def _outside(self, home: Path, work: Path, out: Path) -> str:
        """Return what a verb wrote elsewhere than to ``--out`` and to caches."""
        strays = [str(path.relative_to(home)) for path in home.rglob("*") if path.is_file()]
        strays = [path for path in strays if not path.startswith((".cache/", ".config/matplotlib/"))]
        strays += [path.name for path in work.iterdir() if path.name not in (out.name, f"{out.name}.svg")]
        return f"written elsewhere: {strays}" if strays else ""


def together(folder: Path) -> str:
    """Run a verb twice at the same time with an empty kernel cache; return what is wrong."""
    cold = folder / "cold"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cold)}
    running = []
    for name in ("one", "two"):
        words = ("run", RIG, "--model", "rigid", "--no-views", "--set", "run.duration=1 s", "--out", str(folder / name))
        command = [sys.executable, "-m", "gears3d", *words]
        running.append(subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE))
    said = [process.communicate(timeout=300)[1].decode() for process in running]
    if any(process.returncode for process in running):
        return " | ".join(said)[-600:]
    left = [path.name for path in cold.iterdir() if path.suffix != ".nbc"]
    summaries = [json.loads((folder / name / "summary.json").read_text()) for name in ("one", "two")]
    same = summaries[0]["active_velocity_mean_m_s"] == summaries[1]["active_velocity_mean_m_s"]
    shutil.rmtree(cold)
    for name in ("one", "two"):
        shutil.rmtree(folder / name)
    return f"left behind: {left}" if left else "" if same else "different results"


def run(seed: int) -> Iterator[Tally]:
    """Try every verb in every environment, in random order, then again; yield the tally after each."""
    tally, rng = Tally("environments"), random.Random(seed)
    with tempfile.TemporaryDirectory(prefix="fuzz-environments-") as folder:
        bench = Bench(Path(folder))
        while True:
            pairs = [(verb, name) for verb in VERBS for name in ODD if can_unshare(ODD[name].needs)]
            rng.shuffle(pairs)
            for verb, name in pairs:
                if wrong := bench.attempt(verb, ODD[name]):
                    tally.fault("broken", f"{verb}, {name}: {wrong}")
                else:
                    tally.counts["kept"] += 1
                yield tally
            if wrong := together(Path(folder)):
                tally.fault("broken", f"two cold processes at once: {wrong}")
            else:
                tally.counts["two at once"] += 1
            yield tally
