"""The rerun viewer: shown to people, served to browsers of this machine, or run without a window for pictures."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from types import TracebackType
from typing import IO, Any
from urllib.parse import quote, urlsplit

from gears3d.errors import Fault, GearsError, MissingExtraError
from gears3d.extras import pip_line, require
from gears3d.files import outside_environment
from gears3d.views.replay.scene import TIMELINE

# Loopback: only this machine can connect.
HOST = "127.0.0.1"
# Content security policy: without it rerun's page requests fonts and versions, and sends usage data.
POLICY = "default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' blob: data:"
_PASSED = ("Content-Type", "Content-Encoding", "Content-Length")


@contextmanager
def offered(path: Path, port: int) -> Iterator[tuple[str, str]]:
    """Serve a file and rerun's page while the context lasts; rerun's own recording server keeps one core busy."""
    name = f"/{quote(path.name)}"

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if (
                self.headers.get("Host") != f"{HOST}:{server.server_port}"
            ):  # DNS rebinding: another site's name resolves to this address
                self.send_error(403)
            elif urlsplit(self.path).path == name:
                self._begin(200, {"Content-Type": "application/octet-stream", "Content-Length": path.stat().st_size})
                with path.open("rb") as file:
                    self._send(file)
            else:
                self._pass_on()

        do_HEAD = do_GET

        def _pass_on(self) -> None:
            inner = HTTPConnection(HOST, port, timeout=30.0)
            try:
                inner.request("GET", self.path, headers={"Accept-Encoding": self.headers.get("Accept-Encoding", "")})
                answer = inner.getresponse()
                kept = {name: value for name, value in answer.getheaders() if name.title() in _PASSED}
                self._begin(answer.status, kept)
                self._send(answer)
            finally:
                inner.close()

        def _send(self, content: Any) -> None:
            if self.command == "GET":
                shutil.copyfileobj(content, self.wfile)

        def _begin(self, status: int, headers: Mapping[str, object]) -> None:
            self.send_response(status)
            for one, value in headers.items():
                self.send_header(one, str(value))
            self.send_header("Content-Security-Policy", POLICY)
            self.end_headers()

        def log_message(self, format: str, *args: object) -> None:
            """Do not log requests."""

    with ThreadingHTTPServer((HOST, 0), Handler) as server:
        server.daemon_threads = True
        thread = Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            here = f"http://{HOST}:{server.server_port}"
            yield here, f"{here}{name}"
        finally:
            server.shutdown()
            thread.join()


# What to type where there is no graphics driver (Debian, Ubuntu).
DRIVER = "apt install mesa-vulkan-drivers"
# How long a viewer may take to start or to paint [s].
PATIENCE = 60.0
_POLL = 0.1  # [s]
# Equal screenshots in a row that count as painted: a busy machine was seen to give two before the last lines came.
_STILL = 5
# Runs a viewer until its standard input is closed, which the operating system does for a killed process.
_GUARD = """
import os, signal, subprocess, sys, threading
viewer = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL)
def end():
    sys.stdin.read()
    os.killpg(0, signal.SIGTERM) if hasattr(os, "killpg") else viewer.terminate()
threading.Thread(target=end, daemon=True).start()
code = viewer.wait()
os._exit(code if code >= 0 else 128 - code)
"""


class ViewerError(GearsError):
    """The viewer cannot show a replay; the text says what to type."""

    exit_code = 4


def executable() -> str:
    """Return the path of the viewer that came with the installed rerun."""
    found = shutil.which("rerun", path=str(Path(sys.executable).parent)) or shutil.which("rerun")
    if not found:
        raise MissingExtraError(Fault("", "the rerun viewer is not installed", pip_line("replay")), "replay")
    return found


def has_display() -> bool:
    """Return whether a window can be opened here."""
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def show(path: Path, at: float | None = None) -> None:
    """Open a replay in the viewer's own window and come back."""
    if at is None:
        _alone([executable(), str(path)])
        return
    client, _ = _start(path, ["--hide-welcome-screen"], None)
    _seek(client, at)


def serve(path: Path, told: Callable[[str], object]) -> int:
    """Serve a replay to browsers until interrupted; only this machine can reach it."""
    port = _free_port()
    with tempfile.TemporaryFile("w+") as log, offered(path, port) as (page, file):
        command = [executable(), "--bind", HOST, "--web-viewer-port", str(port), "--serve-web", file]
        process = _guarded(command, log)
        try:
            _until_it_answers(process, port, log, path)
            told(f"{page}/?url={quote(file, safe='')}&theme=dark&hide_welcome_screen=1")
            return process.wait()
        finally:
            _stop(process)


class Headless:
    """A viewer without a window that paints a replay; use it as a context.

    Args:
        path: an rrd file.
        size: width and height of the pictures in pixels.

    Raises:
        ViewerError: the viewer or a graphics driver is missing.
    """

    def __init__(self, path: Path, size: tuple[int, int] = (1600, 900)) -> None:
        self.path = path
        self.size = size

    def __enter__(self) -> Headless:
        self._log: IO[str] = tempfile.TemporaryFile("w+")
        window = f"{self.size[0]}x{self.size[1]}"
        options = ["--headless", "--hide-welcome-screen", "--window-size", window]
        try:
            self._client, self._process = _start(self.path, options, self._log)
        except BaseException:
            self._log.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _stop(self._process)
        self._log.close()

    def span(self) -> tuple[float, float]:
        """Return the first and the last instant [s]."""
        timelines = self._client.get_state().recordings[0].timelines
        ours = next(line for line in timelines if line.name == TIMELINE)
        return ours.start * 1e-9, ours.end * 1e-9

    def picture(self, at: float, view: str = "") -> bytes:
        """Return a picture at an instant."""
        _seek(self._client, at)
        known = {shown.origin: shown.view_id for shown in self._client.get_state().views}
        if view and view not in known:
            raise ViewerError(f"there is no view {view!r}; the replay has {', '.join(sorted(known))}")
        return _settled(self._client, known.get(view))


def snapshot(path: Path, at: float | None = None) -> bytes:
    """Return a picture of a replay, painted without a window."""
    with Headless(path) as viewer:
        return viewer.picture(sum(viewer.span()) / 2.0 if at is None else at)


def _start(path: Path, options: Sequence[str], log: IO[str] | None) -> tuple[Any, subprocess.Popen[str]]:
    """Start a viewer on a free port and wait until it has loaded the file."""
    ViewerClient = require("rerun.experimental", "the viewer", "replay").ViewerClient
    port = _free_port()
    command = [executable(), "--bind", "127.0.0.1", "--port", str(port), *options, str(path)]
    process = _alone(command) if log is None else _guarded(command, log)
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and process.poll() is None:
        try:
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            state = client.get_state()
            if state.active_recording and not state.loading and state.views:
                return client, process
        except (ConnectionError, RuntimeError):
            pass  # not up yet
        time.sleep(_POLL)
    _stop(process)
    said = ""
    if log is not None:
        log.seek(0)
        said = log.read()
    raise ViewerError(_why(said, path))


def _until_it_answers(process: subprocess.Popen[str], port: int, log: IO[str], path: Path) -> None:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and process.poll() is None:
        with suppress(OSError), socket.create_connection((HOST, port), timeout=1.0):
            return
        time.sleep(_POLL)
    log.seek(0)
    raise ViewerError(_why(log.read(), path))


def _alone(command: Sequence[str]) -> subprocess.Popen[str]:
    """Start a viewer that outlives this process."""
    quiet, environment = subprocess.DEVNULL, _silent(outside_environment())
    return subprocess.Popen(
        command, stdout=quiet, stderr=quiet, text=True, env=environment, start_new_session=True
    )  # fmt: skip


def _guarded(command: Sequence[str], log: IO[str]) -> subprocess.Popen[str]:
    """Start a viewer that ends with this process, also if this process is killed."""
    guard = [sys.executable, "-IS", "-c", _GUARD, *command]
    return subprocess.Popen(
        guard, stdin=subprocess.PIPE, stdout=log, stderr=log, text=True, env=_silent(), start_new_session=True
    )


def _silent(environment: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return an environment in which rerun collects no usage data.

    ``CI`` is rerun's own switch for a process (re_analytics, native/pipeline.rs); a user's ``FORCE_RERUN_ANALYTICS=1``
    overrides it.
    """
    return {"CI": "1", **environment}


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def _why(said: str, path: Path) -> str:
    """Why a viewer did not start, from what it printed."""
    panics = [line.split("panicked at", 1)[1].strip(" :'") for line in said.splitlines() if "panicked at" in line]
    panic = panics[0][:80] if panics else ""
    if "render context" in said or "graphics adapter" in said:
        return f"the viewer finds no graphics driver: {DRIVER}" + (f" (it says: {panic})" if panic else "")
    last = said.strip().splitlines()[-1].strip() if said.strip() else "no message"
    return f"the viewer does not start: {panic or last} (try `rerun {path}`)"


def _seek(client: Any, at: float) -> None:
    try:
        client.set_time(TIMELINE, duration=float(at), play_state="paused")
    except (ConnectionError, RuntimeError, ValueError) as error:
        raise ViewerError(f"the viewer does not go to {at:g} s: {str(error).splitlines()[0]}") from error


def _settled(client: Any, view: str | None) -> bytes:
    """Take screenshots until they change no more."""
    end = time.monotonic() + PATIENCE
    last, still = b"", 0
    while time.monotonic() < end:
        try:
            taken = client.take_screenshot(view)
        except (ConnectionError, RuntimeError) as error:
            raise ViewerError(f"the viewer does not paint: {str(error).splitlines()[0]}; {DRIVER}") from error
        still = still + 1 if taken == last else 1
        if still == _STILL:
            return taken
        last = taken
        time.sleep(_POLL)
    return last


def _stop(process: subprocess.Popen[str]) -> None:
    """End the launcher and the viewer that it launched."""
    if process.stdin is not None:
        process.stdin.close()
    with suppress(ProcessLookupError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGTERM)
        else:
            process.terminate()
    try:
        process.wait(5.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
