"""Progress bars on a terminal, nothing when piped, and Ctrl-C at a safe moment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

from gears3d.cli.interrupts import patient_interrupts

Track = Callable[[str, float], Callable[[float], None]]


@contextmanager
def bars() -> Iterator[Track]:
    """Provide ``track(name, total)``; it returns ``tick(done)``, which raises ``KeyboardInterrupt`` after Ctrl-C."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description:>8}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with (
        patient_interrupts() as check,
        Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress,
    ):

        def track(name: str, total: float) -> Callable[[float], None]:
            task = progress.add_task(name, total=total)

            def tick(done: float) -> None:
                progress.update(task, completed=done)
                check()

            return tick

        with _compilation_shown(progress) if console.is_terminal else nullcontext():
            yield track


@contextmanager
def _compilation_shown(progress: Any) -> Iterator[None]:
    """Show the name of the kernel that is being compiled, below the bars."""
    from gears3d.kernels import compiled, watched

    task = progress.add_task("compiling", total=None, visible=False)

    def show(name: str) -> None:
        progress.update(task, description=f"compiling {len(compiled)}: {name}", visible=True)

    with watched(show):
        yield
