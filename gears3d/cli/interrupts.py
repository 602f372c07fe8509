"""Ctrl-C that waits for a safe moment: compiled code and Bullet must not be interrupted inside a call."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def patient_interrupts() -> Iterator[Callable[[], None]]:
    """Provide a function that raises ``KeyboardInterrupt`` once if Ctrl-C was pressed since; call it at safe moments.

    A second Ctrl-C that finds the first still waiting interrupts at once. Outside the main thread nothing changes.

    Returns:
        A context that provides the function.
    """
    waiting = False

    def note(*_: object) -> None:
        nonlocal waiting
        if waiting:
            raise KeyboardInterrupt
        waiting = True

    def check() -> None:
        nonlocal waiting
        if waiting:
            waiting = False
            raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield check
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)
