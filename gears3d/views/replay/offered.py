"""Local web server for rerun's page and one recording; the page has no access to other hosts."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any
from urllib.parse import quote, urlsplit

HOST = "127.0.0.1"
"""Loopback: only this machine can connect."""
POLICY = "default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' blob: data:"
"""Content security policy: without it rerun's page requests fonts and versions, and sends usage data."""
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
