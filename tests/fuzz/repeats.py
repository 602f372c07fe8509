"""The same command gives the same bits: twice, with an empty kernel cache, with 1, 2 and 3 workers, resumed."""

import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from gears3d import kernels
from tests.fuzz.kills import RIG, digests
from tests.fuzz.tally import Tally

MODELS = {
    "rigid": ("run", RIG, "--model", "rigid", "--set", "run.duration=2 s"),
    "engine": ("run", RIG, "--set", "run.duration=1.2 s"),
    "noisy": ("run", RIG, "--model", "rigid", "--set", "run.duration=2 s", "--set",
              "effect=[{kind='restitution_scatter', standard_deviation='0.05'}]"),
}  # fmt: skip
"""Runs that are given three times."""
WORKERS = ("0", "1", "2", "3")


class Bench:
    """Runs verbs in folders of their own."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.number = folder, 0

    def new(self) -> Path:
        """Return a place that does not exist."""
        self.number += 1
        return self.folder / f"out-{self.number}"

    def command(self, words: tuple[str, ...], cache: Path | None = None) -> dict[str, str]:
        """Run a verb into a new folder; return the digests of its results."""
        out = self.new()
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache or kernels.place())}
        command = [sys.executable, "-m", "gears3d", *words, "--no-views", "--out", str(out)]
        if words[0] == "sweep":
            command.remove("--no-views")
        subprocess.run(command, check=True, capture_output=True, env=environment, timeout=600)
        return digests(out)

    def interrupted(self, words: tuple[str, ...], after: float) -> dict[str, str]:
        """Run a sweep, kill it, and run it again to the end."""
        out = self.new()
        command = [sys.executable, "-m", "gears3d", *words, "--out", str(out)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with suppress(subprocess.TimeoutExpired):
            process.wait(after)
        process.kill()
        process.wait()
        time.sleep(1.0)  # its workers notice that it is gone, and let go of the folder
        subprocess.run(command, check=True, capture_output=True, timeout=600)
        return digests(out)


def run(seed: int) -> Iterator[Tally]:
    """Repeat runs and sweeps with values drawn from the seed; yield the tally after each comparison."""
    rng, tally = random.Random(seed), Tally("repeats")
    with tempfile.TemporaryDirectory(prefix="fuzz-repeats-") as folder:
        bench = Bench(Path(folder))
        while True:
            drag, rebound = rng.uniform(0.1, 0.6), rng.uniform(0.0, 0.6)
            drawn = ("--set", f"drag.torque={drag!r} N m", "--set", f"impact.restitution={rebound!r}")
            for name, words in MODELS.items():
                first = bench.command((*words, *drawn))
                for how, cache in (("again", None), ("with an empty cache", bench.new())):
                    same = bench.command((*words, *drawn), cache) == first
                    _note(tally, same, f"{name} {how}", f"drag {drag!r}, restitution {rebound!r}, seed {seed}")
                    yield tally
            grid = ("--vary", f"drag.torque=0.1..{drag + 0.7!r} N m lin 40", "--periods", "100", "--settle", "20")
            words = ("sweep", RIG, *grid, "--block", str(rng.randint(1, 9)), "--no-pictures", *drawn[2:])
            found = [bench.command((*words, "--workers", workers)) for workers in WORKERS]
            for workers, one in zip(WORKERS[1:], found[1:], strict=True):
                _note(tally, one == found[0], f"sweep with {workers} workers", f"{words}")
                yield tally
            resumed = bench.interrupted((*words, "--workers", "2"), rng.uniform(0.5, 3.0))
            _note(tally, resumed == found[0], "sweep resumed", f"{words}")
            yield tally


def _note(tally: Tally, same: bool, what: str, how: str) -> None:
    if same:
        tally.counts[what] += 1
    else:
        tally.fault("differs", f"{what}: {how}")
