"""Every socket that a verb or tool listens on: on loopback only."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import psutil

from tests.fuzz.kills import MARK, RIG, ours
from tests.fuzz.tally import Tally

ROOT = Path(__file__).resolve().parents[2]
GRID = ("--vary", "drag.torque=0.1..1.5 N m lin 600", "--periods", "200", "--settle", "50", "--no-pictures")
SERVERS = {
    "replay --web": ("-m", "gears3d", "replay", "{run}", "--web"),
    "sweep on two workers": ("-m", "gears3d", "sweep", RIG, *GRID, "--workers", "2", "--out", "{out}"),
    "tools/cluster_demo": ("tools/cluster_demo",),
    "run": ("-m", "gears3d", "run", RIG, "--out", "{out}"),
    "camera": ("-m", "gears3d", "camera", "{run}", "--out", "{out}.png"),
}
"""Commands that serve something, and two that should not."""
LISTENS = {"replay --web", "tools/cluster_demo"}
"""Commands that are known to listen: without a socket of theirs the look proves nothing."""
LOOPBACK = ("127.", "::1")
LOOK_S = 12.0
"""A command is observed for so long at most [s]."""


def listening(mark: str) -> set[tuple[str, int]]:
    """Return address and port of every listening socket of a try's processes."""
    found = set()
    for process in ours(mark):
        with suppress(psutil.Error):
            for one in process.net_connections(kind="inet"):
                if one.status == psutil.CONN_LISTEN or (one.type == 2 and not one.raddr):  # TCP, or UDP that is bound
                    found.add((one.laddr.ip, one.laddr.port))
    return found


def knock(name: str, run: Path, folder: Path) -> set[tuple[str, int]]:
    """Start a command, collect what it listens on, and stop it."""
    given = {"{run}": str(run), "{out}": str(folder / "out"), "{out}.png": str(folder / "out.png")}
    words = [given.get(word, word) for word in SERVERS[name]]
    command = [f"{ROOT}/{words[0]}", *words[1:]] if words[0] != "-m" else [sys.executable, *words]
    mark = folder.name
    environment = {
        **os.environ, MARK: mark, "BROWSER": "true", "TMPDIR": str(folder), "GEARS3D_ENVIRONMENT_READY": "1",
        "GEARS3D_DEMO_PORT": str(20000 + os.getpid() % 20000),
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
    }  # fmt: skip
    silent = subprocess.DEVNULL
    process = subprocess.Popen(command, env=environment, stdout=silent, stderr=silent, cwd=ROOT, start_new_session=True)
    found: set[tuple[str, int]] = set()
    end = time.monotonic() + LOOK_S
    try:
        while process.poll() is None and time.monotonic() < end:
            found |= listening(mark)
            time.sleep(0.2)
    finally:
        process.terminate()
        with suppress(subprocess.TimeoutExpired):
            process.wait(20.0)
        for one in ours(mark):
            with suppress(psutil.Error):
                one.kill()
        process.wait()
    return found


def run(seed: int, names: tuple[str, ...] = tuple(SERVERS)) -> Iterator[Tally]:
    """Start one command after the other; yield the tally after each."""
    tally = Tally("sockets")
    with tempfile.TemporaryDirectory(prefix="fuzz-sockets-") as folder:
        made = Path(folder) / "run"
        command = [sys.executable, "-m", "gears3d", "run", RIG, "--model", "rigid", "--out", str(made)]
        subprocess.run(command, check=True, capture_output=True)
        while True:
            name = names[tally.tried % len(names)]
            found = knock(name, made, Path(tempfile.mkdtemp(dir=folder)))
            if open_ := sorted(one for one in found if not one[0].startswith(LOOPBACK)):
                tally.fault("open to others", f"{name}: {open_}")
            elif name in LISTENS and not found:
                tally.fault("does not listen", name)
            else:
                tally.counts[f"{name}: {len(found)} on loopback"] += 1
            yield tally
