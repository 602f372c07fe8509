"""Processes on this machine that run blocks; one that dies or hangs is replaced, and its block run again."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from math import inf
from multiprocessing.connection import Connection, wait
from typing import Any

from gears3d.errors import EngineError, GearsError, InputError
from gears3d.sweep.block import Block, Watch
from gears3d.sweep.models import compute, warm
from gears3d.sweep.plan import Plan

GRACE = 5.0  # A process that does not stop a point by itself is killed so much later than the point's time is up [s]
DEATHS = 3  # So many processes may die at one point before it is given up
_LOOK = 0.2  # Time between two looks at the processes [s]

# What a block may raise; anything else ends its process
MISTAKES = (
    GearsError, ArithmeticError, AssertionError, AttributeError, LookupError, MemoryError, OSError, RuntimeError,
    TypeError, ValueError,
)  # fmt: skip

Compute = Callable[..., Block]
Span = tuple[int, int]


def work(pipe: Connection, place: Any, plan: Plan, limit: float, run: Compute) -> None:
    """Run blocks until told to stop: what a process of the pool does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    parent = multiprocessing.parent_process()

    def tell(point: int, done: int) -> None:
        place[0], place[1] = point, done

    warm(plan)
    watch = Watch(limit, tell, lambda: parent is not None and not parent.is_alive())
    while True:
        try:
            asked = pipe.recv()
        except (EOFError, OSError):
            return
        if asked is None:
            return
        begin, end, skip = asked
        place[0], place[1] = -1, 0
        try:
            answer: tuple[str, Any] = ("done", run(plan, begin, end, watch, skip))
        except KeyboardInterrupt:
            return
        except InputError as error:
            answer = ("fault", error.faults)
        except MISTAKES as error:
            answer = ("mistake", f"{type(error).__name__}: {error}")
        try:
            pipe.send(answer)
        except OSError:
            return


@dataclass
class _Worker:
    process: Any
    pipe: Connection
    place: Any
    span: Span
    skip: dict[int, str]
    point: int = -1
    since: float = field(default_factory=time.monotonic)


class Pool:
    """Processes that run the blocks of a sweep."""

    def __init__(self, plan: Plan, workers: int, limit: float = inf, run: Compute = compute) -> None:
        self.plan, self.workers, self.limit, self._run = plan, workers, limit, run
        self._context: Any = multiprocessing.get_context("forkserver" if hasattr(os, "fork") else "spawn")
        if hasattr(os, "fork"):
            self._context.set_forkserver_preload(["gears3d.sweep.models"])
        self._busy: list[_Worker] = []
        self._idle: list[tuple[Any, Connection, Any]] = []
        self._deaths: dict[int, int] = {}

    def blocks(self, spans: Sequence[Span], tick: Callable[[int], None] | None = None) -> Iterator[Block]:
        """Run blocks and give them as they are finished, in any order."""
        waiting: list[tuple[Span, dict[int, str]]] = [(span, {}) for span in reversed(spans)]
        try:
            while waiting or self._busy:
                while waiting and len(self._busy) < self.workers:
                    self._give(*waiting.pop())
                ready = wait([each.pipe for each in self._busy], timeout=_LOOK)
                for worker in [each for each in self._busy if each.pipe in ready]:
                    block = self._hear(worker, waiting)
                    if block is not None:
                        yield block
                for worker in [each for each in self._busy if self._hangs(each)]:
                    self._kill(worker, f"ran for longer than {self.limit:g} s and had to be killed", waiting)
                if tick is not None:
                    tick(sum(int(each.place[1]) for each in self._busy))
        finally:
            self.close()

    def close(self) -> None:
        """Stop all processes."""
        for worker in self._busy:
            worker.process.kill()
        for process, pipe, _ in self._idle:
            try:
                pipe.send(None)
            except OSError:
                process.kill()
        for process in [*(each.process for each in self._busy), *(process for process, _, _ in self._idle)]:
            process.join(timeout=2.0)
            if process.is_alive():
                process.kill()
                process.join()
        self._busy, self._idle = [], []

    def _give(self, span: Span, skip: dict[int, str]) -> None:
        process, pipe, place = self._idle.pop() if self._idle else self._begin()
        try:
            pipe.send((*span, skip))
        except OSError:  # it died while it was idle
            process, pipe, place = self._begin()
            pipe.send((*span, skip))
        self._busy.append(_Worker(process, pipe, place, span, skip))

    def _begin(self) -> tuple[Any, Connection, Any]:
        mine, theirs = self._context.Pipe()
        place = self._context.RawArray("q", [-1, 0])
        arguments = (theirs, place, self.plan, self.limit, self._run)
        process = self._context.Process(target=work, args=arguments, daemon=True)
        try:
            process.start()
        except OSError as error:
            raise EngineError(f"no process can be started: {error.strerror}; give fewer --workers") from error
        theirs.close()
        return process, mine, place

    def _hear(self, worker: _Worker, waiting: list[tuple[Span, dict[int, str]]]) -> Block | None:
        try:
            kind, what = worker.pipe.recv()
        except (EOFError, OSError):
            self._bury(worker, waiting)
            return None
        self._busy.remove(worker)
        self._idle.append((worker.process, worker.pipe, worker.place))
        if kind == "fault":
            raise InputError(what)
        if kind == "mistake":
            raise EngineError(f"points {worker.span[0]} to {worker.span[1] - 1} cannot be run: {what}")
        return what

    def _hangs(self, worker: _Worker) -> bool:
        now = int(worker.place[0])
        if now != worker.point:
            worker.point, worker.since = now, time.monotonic()
        return now >= 0 and time.monotonic() - worker.since > self.limit + GRACE

    def _bury(self, worker: _Worker, waiting: list[tuple[Span, dict[int, str]]]) -> None:
        """Take away a process that died; its block is run again, without a point that has killed too many."""
        worker.process.join()
        self._busy.remove(worker)
        point = int(worker.place[0]) if worker.place[0] >= 0 else worker.span[0]
        self._deaths[point] = self._deaths.get(point, 0) + 1
        skip = dict(worker.skip)
        if self._deaths[point] >= DEATHS:
            skip[point] = f"{DEATHS} processes died at this point, the last with exit code {worker.process.exitcode}"
        waiting.append((worker.span, skip))

    def _kill(self, worker: _Worker, why: str, waiting: list[tuple[Span, dict[int, str]]]) -> None:
        worker.process.kill()
        worker.process.join()
        self._busy.remove(worker)
        waiting.append((worker.span, {**worker.skip, worker.point: why}))
