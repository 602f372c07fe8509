"""Cases in a process of their own, which is ended when one takes too long and begun anew when one ends it."""

import importlib
import multiprocessing
import os
import random
import resource
import shutil
import sys
import tempfile
import traceback
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path

from tests.fuzz.tally import Tally

DEADLINE = 10.0
"""Seconds that a case may take."""
START = 300.0
"""Seconds that the process may take to begin, which imports and compiles."""
GROWTH = 2 << 30
"""Bytes by which a case may grow the process."""
ROOM = 8 << 30
"""Bytes of data at which the system refuses more, for the sake of the machine."""
BATCH = 100


def run(part: str, seed: int) -> Iterator[Tally]:
    """Try cases of a part without end; yield the tally after every batch.

    Args:
        part: a module of this folder with ``prepare(folder)``, which returns a function that takes a random generator
            and the number of a case, and returns its outcome and, for a broken promise, what it was.
        seed: of all cases.
    """
    tally = Tally(part)
    case = 0
    while True:
        case = yield from _process(part, seed, case, tally)


def repeat(part: str, seed: int, case: int) -> None:
    """Try one case here, and print what comes of it."""
    folder = Path(tempfile.mkdtemp(prefix="fuzz-")) / "work"
    folder.mkdir()
    attempt = importlib.import_module(f"tests.fuzz.{part}").prepare(folder)
    sys.stdout.write("\n".join([str(folder), *attempt(_random(seed, case), case), ""]))


def _process(part: str, seed: int, case: int, tally: Tally) -> Iterator[Tally]:
    """Try cases in one process until it ends; return the number of the next case."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    outer = Path(tempfile.mkdtemp(prefix="fuzz-"))
    folder = outer / "work"  # what a case must not touch lies beside it
    folder.mkdir()
    process = context.Process(target=_work, args=(there, part, seed, case, str(folder)), daemon=True)
    process.start()
    there.close()
    try:
        patience = START
        while True:
            how = f"tools/fuzz --seed {seed} {part}: python -m tests.fuzz.{part} {seed} {case}"
            if not here.poll(patience):
                tally.fault("hang", f"{how}: more than {patience:.0f} s")
                return case + 1
            try:
                outcome, told = here.recv()
            except (EOFError, OSError):
                process.join()
                if patience == START:
                    raise RuntimeError(f"{part} does not begin: exit code {process.exitcode}") from None
                tally.fault("crash", f"{how}: exit code {process.exitcode}")
                return case + 1
            if patience == START:
                patience = DEADLINE
                continue
            if told:
                tally.fault(outcome, f"{how}: {told}")
            else:
                tally.counts[outcome] += 1
            case += 1
            if tally.tried % BATCH == 0:
                yield tally
    finally:
        process.kill()
        process.join()
        shutil.rmtree(outer, ignore_errors=True)


def _work(pipe: Connection, part: str, seed: int, case: int, folder: str) -> None:
    """Try cases; send the outcome of each."""
    resource.setrlimit(resource.RLIMIT_DATA, (ROOM, ROOM))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.environ["GEARS3D_MAX_BYTES"] = str(GROWTH // 4)
    attempt = importlib.import_module(f"tests.fuzz.{part}").prepare(Path(folder))
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
        sys.stdout = sys.stderr = nowhere
        pipe.send(("ready", ""))
        while True:
            before = _memory(reset=True)
            try:
                outcome, told = attempt(_random(seed, case), case)
            except Exception as error:
                where = traceback.extract_tb(error.__traceback__)
                own = [frame for frame in where if "gears3d" in frame.filename] or where
                last = f"{Path(own[-1].filename).name}:{own[-1].lineno}"
                outcome, told = "traceback", f"{type(error).__name__}: {str(error)[:120]!r} at {last}"
            growth = _memory() - before
            if growth > GROWTH and not told:
                outcome, told = "large", f"grew by {growth / 2**30:.2f} GiB"
            pipe.send((outcome, told))
            case += 1


def _random(seed: int, case: int) -> random.Random:
    return random.Random(f"{seed}/{case}")


def _memory(reset: bool = False) -> int:
    """Return the largest resident memory since it was last reset [bytes]."""
    try:
        if reset:
            Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return next(int(line.split()[1]) << 10 for line in lines if line.startswith("VmHWM"))
    except (OSError, StopIteration):
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10
