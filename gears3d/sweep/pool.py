"""Processes on this machine that run blocks; one that dies or hangs is replaced, and its block run again."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, field
from math import inf
from typing import Any

from pebble import ProcessExpired, ProcessPool

from gears3d.errors import EngineError, InputError
from gears3d.sweep.block import Block, Watch
from gears3d.sweep.models import compute, warm
from gears3d.sweep.plan import Plan

GRACE = 5.0  # A process that does not stop a point by itself is killed so much later than the point's time is up [s]
DEATHS = 3  # So many processes may die at one point before it is given up
_LOOK = 0.2  # Time between two looks at the processes [s]
_NO_PROCESS = "no process can be started; give fewer --workers"

Compute = Callable[..., Block]
Span = tuple[int, int]
# Of a process: plan, time limit of a point [s], function that computes blocks, and the point and number of finished
# points of each block, which the parent reads.
_here: tuple[Plan, float, Compute, Any] | None = None


def _begin(plan: Plan, limit: float, run: Compute, places: Any) -> None:
    """Prepare a process of the pool."""
    global _here
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    warm(plan)
    _here = plan, limit, run, places


def _run(number: int, span: Span, skip: dict[int, str]) -> Block:
    """Return a block, in a process of the pool."""
    assert _here is not None
    plan, limit, run, places = _here
    parent = multiprocessing.parent_process()

    def tell(point: int, done: int) -> None:
        places[2 * number], places[2 * number + 1] = point, done

    tell(-1, 0)
    return run(plan, *span, Watch(limit, tell, lambda: parent is not None and not parent.is_alive()), skip)


@dataclass
class _Task:
    number: int
    span: Span
    skip: dict[int, str]
    point: int = -1
    since: float = field(default_factory=time.monotonic)


def _scheduled(pool: ProcessPool, task: _Task) -> Future[Block]:
    """Return the future of a block; an EngineError states that no process can be started."""
    try:
        return pool.schedule(_run, args=(task.number, task.span, task.skip))
    except (OSError, RuntimeError) as error:
        raise EngineError(f"{_NO_PROCESS}: {error}") from error


class Pool:
    """Processes that run the blocks of a sweep."""

    def __init__(self, plan: Plan, workers: int, limit: float = inf, run: Compute = compute) -> None:
        self.plan, self.workers, self.limit, self._run = plan, workers, limit, run
        self._context: Any = multiprocessing.get_context("forkserver" if hasattr(os, "fork") else "spawn")
        if hasattr(os, "fork"):
            self._context.set_forkserver_preload(["gears3d.sweep.models"])
        self._pool: ProcessPool | None = None

    def blocks(self, spans: Sequence[Span], tick: Callable[[int], None] | None = None) -> Iterator[Block]:
        """Run blocks and give them as they are finished, in any order."""
        places = self._context.RawArray("q", [-1, 0] * len(spans))
        deaths: dict[int, int] = {}
        started = (self.plan, self.limit, self._run, places)
        self._pool = pool = ProcessPool(self.workers, initializer=_begin, initargs=started, context=self._context)
        todo = [_Task(number, span, {}) for number, span in enumerate(spans)][::-1]
        running: dict[Future[Block], _Task] = {}
        try:
            while todo or running:
                while todo and len(running) < self.workers:
                    task = todo.pop()
                    places[2 * task.number], task.since = -1, time.monotonic()
                    running[_scheduled(pool, task)] = task
                for future in wait(running, timeout=_LOOK, return_when=FIRST_COMPLETED).done:
                    task = running.pop(future)
                    try:
                        yield future.result()
                    except ProcessExpired as error:
                        point = max(int(places[2 * task.number]), task.span[0])
                        deaths[point] = deaths.get(point, 0) + 1
                        if deaths[point] >= DEATHS:
                            why = f"{DEATHS} processes died at this point, the last with exit code {error.exitcode}"
                            task.skip[point] = why
                        todo.append(task)
                    except CancelledError:
                        task.skip[task.point] = f"ran for longer than {self.limit:g} s and had to be killed"
                        todo.append(task)
                    except InputError:
                        raise
                    except Exception as error:
                        what = f"{type(error).__name__}: {error}"
                        points = f"{task.span[0]} to {task.span[1] - 1}"
                        raise EngineError(f"points {points} cannot be run: {what}") from error
                for future in [future for future, task in running.items() if self._hangs(task, places)]:
                    future.cancel()
                if not pool.active:
                    raise EngineError(_NO_PROCESS)
                if tick is not None:
                    tick(sum(int(places[2 * task.number + 1]) for task in running.values()))
        finally:
            self.close()

    def close(self) -> None:
        """Stop all processes."""
        if self._pool is not None:
            self._pool.stop()
            self._pool.join()
            self._pool = None

    def _hangs(self, task: _Task, places: Any) -> bool:
        now = int(places[2 * task.number])
        if now != task.point:
            task.point, task.since = now, time.monotonic()
        return now >= 0 and time.monotonic() - task.since > self.limit + GRACE
