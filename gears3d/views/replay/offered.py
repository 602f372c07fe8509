"""One file for a page of another port to fetch: rerun's own server of recordings keeps a core busy while it serves."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.parse import quote

HOST = "127.0.0.1"
"""Where it is served: only this machine can reach it."""


@contextmanager
def offered(path: Path, page: str) -> Iterator[str]:
    """Serve a file while the context lasts.

    Args:
        path: the file.
        page: the only origin whose pages may read it, e.g. ``"http://127.0.0.1:9090"``.

    Yields:
        The file's address.
    """
    name = f"/{quote(path.name)}"

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self._begin():
                with path.open("rb") as file:
                    shutil.copyfileobj(file, self.wfile)

        def do_HEAD(self) -> None:
            self._begin()

        def _begin(self) -> bool:
            if self.path != name:
                self.send_error(404)
                return False
            self.send_response(200)
            self.send_header("Content-Type", "application/octet-stream")
            self.send_header("Content-Length", str(path.stat().st_size))
            self.send_header("Access-Control-Allow-Origin", page)
            self.end_headers()
            return True

        def log_message(self, format: str, *args: object) -> None:
            """Do not log requests."""

    with ThreadingHTTPServer((HOST, 0), Handler) as server:
        server.daemon_threads = True
        thread = Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield f"http://{HOST}:{server.server_port}{name}"
        finally:
            server.shutdown()
            thread.join()
