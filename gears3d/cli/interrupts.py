"""Orderly interrupts: Ctrl-C, TERM and a closed terminal raise an exception, at a safe moment if required."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

# Signals that interrupt.
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
_came: list[signal.Signals] = []


def interrupted() -> bool:
    """Return whether a signal came since the verb began.

    Extension modules may replace the ``KeyboardInterrupt`` by an error of their own.
    """
    return bool(_came)


def exit_code() -> int:
    """Return the exit code after the last signal: 130 for Ctrl-C, 143 for TERM, 129 for a closed terminal."""
    return 128 + int(_came[-1] if _came else signal.SIGINT)


@contextmanager
def orderly_ends() -> Iterator[None]:
    """Make TERM and a closed terminal raise ``SystemExit``, as Ctrl-C raises ``KeyboardInterrupt``.

    CPython ends itself by SIGINT instead of the exit code if a ``KeyboardInterrupt`` passed through ``exec`` of a
    string, of which dataclasses are made (``unhandled_keyboard_interrupt`` in pythonrun.c).

    Ignored signals remain ignored, e.g. under ``nohup``. Outside the main thread nothing changes.
    """

    def end(number: int, _: object) -> None:
        _came.append(signal.Signals(number))
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(exit_code())

    _came.clear()
    with _handled(end, [one for one in SIGNALS if signal.getsignal(one) is not signal.SIG_IGN]):
        yield


@contextmanager
def patient_interrupts() -> Iterator[Callable[[], None]]:
    """Provide a function that raises ``KeyboardInterrupt`` if a signal arrived since its last call.

    A second signal before the first was handled interrupts at once. Outside the main thread nothing changes.
    """
    waiting = False

    def note(number: int, _: object) -> None:
        nonlocal waiting
        _came.append(signal.Signals(number))
        if waiting:
            raise KeyboardInterrupt
        waiting = True

    def check() -> None:
        nonlocal waiting
        if waiting:
            waiting = False
            raise KeyboardInterrupt

    with _handled(note, [one for one in SIGNALS if callable(signal.getsignal(one))]):
        yield check


@contextmanager
def _handled(handler: Any, signals: list[Any]) -> Iterator[None]:
    """Install a handler for some signals; restore the previous handlers afterwards."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = [(one, signal.signal(one, handler)) for one in signals]
    try:
        yield
    finally:
        for one, earlier in before:
            signal.signal(one, earlier)
