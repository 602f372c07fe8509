"""Progress bars on a terminal, one line a stage in a log, and Ctrl-C at a safe moment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from time import monotonic
from typing import Any, Protocol

import typer

from gears3d.cli.interrupts import patient_interrupts

# Seconds before the first line where the error stream is not a terminal, and between lines of one stage.
QUIET, EVERY = 10.0, 30.0


class Tick(Protocol):
    """Takes what is done, and optionally the current stage; raises ``KeyboardInterrupt`` after Ctrl-C."""

    def __call__(self, done: float, doing: str = "") -> None:
        """Report progress."""
        ...


Track = Callable[[str, float], Tick]


@contextmanager
def bars() -> Iterator[Track]:
    """Provide ``track(name, total)``; it returns ``tick(done, doing)``.

    On a terminal bars show progress. Otherwise the error stream gets a line for each stage, after ``QUIET`` seconds.
    """
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description:>8}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    log = None if console.is_terminal else _Log()
    with (
        patient_interrupts() as check,
        Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress,
    ):

        def track(name: str, total: float) -> Tick:
            task = progress.add_task(escape(name), total=total)

            def tick(done: float, doing: str = "") -> None:
                stage = f"{name}: {doing}" if doing else name
                progress.update(task, completed=done, description=escape(stage))
                if log is not None:
                    log.note(stage, done / total if total else 0.0)
                check()

            return tick

        with _compilation_shown(progress) if console.is_terminal else nullcontext():
            yield track


class _Log:
    """Lines on the error stream: of each new stage, and of one that lasts."""

    def __init__(self) -> None:
        self.began = self.last = monotonic()
        self.stage = ""

    def note(self, stage: str, part: float) -> None:
        """Print a line if the stage is new or the last line is old."""
        now = monotonic()
        if now - self.began < QUIET or (stage == self.stage and now - self.last < EVERY):
            return
        self.stage, self.last = stage, now
        typer.echo(f"{stage}, {100.0 * min(part, 1.0):.0f} %, {now - self.began:.0f} s", err=True)


@contextmanager
def _compilation_shown(progress: Any) -> Iterator[None]:
    """Show the name of the kernel that is being compiled, below the bars."""
    from gears3d.kernels import compiled, watched

    task = progress.add_task("compiling", total=None, visible=False)

    def show(name: str) -> None:
        progress.update(task, description=f"compiling {len(compiled)}: {name}", visible=True)

    with watched(show):
        yield
