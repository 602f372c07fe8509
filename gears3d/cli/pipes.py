"""Output into a pipe whose reader goes away, as in ``gears3d schema | head``: the rest is not printed."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class Pipe:
    """A text stream that falls silent when its reader has gone, in place of an error.

    Args:
        stream: standard output or error.
    """

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write; return the number of characters.

        Args:
            text: to write.
        """
        try:
            return self._stream.write(text)
        except BrokenPipeError:
            self._fall_silent()
            return len(text)

    def flush(self) -> None:
        """Pass on the buffer."""
        try:
            self._stream.flush()
        except BrokenPipeError:
            self._fall_silent()

    def _fall_silent(self) -> None:
        """Redirect the stream, and its buffer, to the null device."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)


def _take_greek(stream: Any) -> None:
    """Let a stream take every letter: as UTF-8 in files and pipes, in a console of another code page as ``?``."""
    try:
        "Λµ²−χ".encode(stream.encoding or "utf-8")
    except (UnicodeEncodeError, LookupError):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(**({"errors": "replace"} if stream.isatty() else {"encoding": "utf-8"}))


def _warning(message: Warning | str, *_: Any, **__: Any) -> str:
    """Return a warning as one line, without the place in the code."""
    return f"warning: {message}\n"


@contextmanager
def quiet_pipes() -> Iterator[None]:
    """Let standard output and error fall silent when their reader has gone; exit codes stay what they are."""
    before = sys.stdout, sys.stderr
    for stream in before:
        _take_greek(stream)
    shown, warnings.formatwarning = warnings.formatwarning, _warning
    sys.stdout, sys.stderr = Pipe(sys.stdout), Pipe(sys.stderr)
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        sys.stdout, sys.stderr = before
        warnings.formatwarning = shown
