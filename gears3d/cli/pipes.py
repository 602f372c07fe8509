"""Output into a pipe whose reader goes away, as in ``gears3d schema | head``: the rest is not printed."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


class Pipe:
    """A text stream that discards its output when the reader has gone, instead of raising an error.

    Args:
        stream: standard output or error.
        silent: errors after which output is discarded; others are raised.
    """

    def __init__(self, stream: Any, silent: type[OSError] = BrokenPipeError) -> None:
        self._stream, self._silent = stream, silent

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write; return the number of characters."""
        try:
            return self._stream.write(text)
        except self._silent:
            self._fall_silent()
            return len(text)

    def flush(self) -> None:
        """Pass on the buffer."""
        try:
            self._stream.flush()
        except self._silent:
            self._fall_silent()

    def _fall_silent(self) -> None:
        """Redirect the stream, and its buffer, to the null device."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)


def _usable(stream: Any) -> Any:
    """Return a stream for every letter: UTF-8 in files and pipes, ``?`` in consoles of other code pages.

    A stream that the caller has closed (None) is replaced by the null device.
    """
    if stream is None:
        return Path(os.devnull).open("w", encoding="utf-8")
    try:
        "Λµ²−χ".encode(stream.encoding or "utf-8")
    except (UnicodeEncodeError, LookupError):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(**({"errors": "replace"} if stream.isatty() else {"encoding": "utf-8"}))
    return stream


def _warning(message: Warning | str, *_: Any, **__: Any) -> str:
    """Return a warning as one line, without the place in the code."""
    return f"warning: {message}\n"


@contextmanager
def quiet_pipes() -> Iterator[None]:
    """Let standard output and error fall silent when their reader has gone; exit codes stay what they are."""
    before = sys.stdout, sys.stderr
    streams = [_usable(stream) for stream in before]
    shown, warnings.formatwarning = warnings.formatwarning, _warning
    sys.stdout, sys.stderr = Pipe(streams[0]), Pipe(streams[1], OSError)  # a full disk behind stderr: nothing to tell
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        sys.stdout, sys.stderr = before
        warnings.formatwarning = shown
