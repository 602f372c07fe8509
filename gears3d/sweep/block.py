"""One block of points: arrays for its numbers, a watch over its time, points run one by one."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import GearsError
from gears3d.lumped import tally
from gears3d.lumped.batch import count_impacts
from gears3d.sweep.measures import Setting
from gears3d.sweep.plan import Plan

if TYPE_CHECKING:
    from gears3d.lumped.batch import Batch

DONE, FAILED, TIME_LIMIT, LOST = 0, 1, 2, 3
STATUS = ("done", "failed", "time_limit", "lost")  # How a point ended, by its ``status``


class TooLongError(Exception):
    """A point ran for longer than it may."""


class Watch:
    """Times points and reports how far a block has come."""

    def __init__(
        self,
        limit: float = inf,
        tell: Callable[[int, int], None] | None = None,
        stopped: Callable[[], bool] | None = None,
    ) -> None:
        self.limit, self._tell, self._stopped = limit, tell, stopped
        self._begin = time.monotonic()
        self._point = self._done = 0
        self._interrupted = False

    def start(self, point: int, done: int) -> None:
        """Note that a point begins."""
        self._begin, self._point, self._done = time.monotonic(), point, done
        self.check()

    def check(self, _: float = 0.0) -> None:
        """Look at the clock; models call it with the simulated time that they have reached."""
        if self._tell is not None:
            self._tell(self._point, self._done)
        if self._stopped is not None and self._stopped():
            raise KeyboardInterrupt
        if time.monotonic() - self._begin > self.limit:
            raise TooLongError

    @contextmanager
    def over(self, batch: Batch, points: Sequence[int]) -> Iterator[None]:
        """Watch a batch from a thread of its own while the block runs."""
        over = threading.Event()
        thread = threading.Thread(target=self._look, args=(batch, points, over), daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()
        if self._interrupted or (self._stopped is not None and self._stopped()):
            raise KeyboardInterrupt

    def _look(self, batch: Batch, points: Sequence[int], over: threading.Event) -> None:
        from gears3d.lumped.batch import ALL

        place, begin = -1, time.monotonic()
        while not over.wait(min(0.05, 0.2 * self.limit)):
            now = int(batch.cursor[0])
            if now != place:
                place, begin = now, time.monotonic()
            try:
                if self._tell is not None:
                    self._tell(int(points[min(now, len(points) - 1)]), int(batch.cursor[1]))
            except KeyboardInterrupt:  # belongs to the thread that waits for the batch
                self._interrupted = True
            if self._interrupted or (self._stopped is not None and self._stopped()):
                batch.stop[0] = ALL
            elif time.monotonic() - begin > self.limit:
                batch.stop[0] = now


@dataclass
class Raw:
    """Counts and sections of the points of a block before anything is made of them."""

    points: np.ndarray  # their numbers, (n,)
    numbers: np.ndarray  # as :mod:`gears3d.lumped.tally` has them, (n, NUMBERS)
    sections: np.ndarray  # once a period, (n, keep, SECTIONS)
    setting: np.ndarray  # a row a point: what :class:`~gears3d.sweep.measures.Setting` has, (n, 7)
    status: np.ndarray  # how each point ended, (n,)
    why: dict[int, str] = field(default_factory=dict)  # of the points that were not done

    @classmethod
    def empty(cls, plan: Plan, begin: int, end: int) -> Raw:
        """Return arrays for points, not filled."""
        n = end - begin
        return cls(
            np.arange(begin, end),
            np.full((n, tally.NUMBERS), np.nan),
            np.full((n, plan.keep, tally.SECTIONS), np.nan),
            np.full((n, len(Setting._fields)), np.nan),
            np.full(n, FAILED, dtype=np.int8),
        )

    def fail(self, row: int, why: str, status: int = FAILED) -> None:
        """Note why a point has no numbers."""
        self.status[row] = status
        self.numbers[row], self.sections[row] = np.nan, np.nan
        self.why[int(self.points[row])] = why


@dataclass(frozen=True)
class Block:
    """What a block of points gave."""

    begin: int  # first point
    end: int  # one after the last
    values: dict[str, np.ndarray]  # variable by name, (n,) or (n, keep); ``status`` and ``seed`` are among them
    why: dict[int, str]  # of the points that were not done, by number
    seconds: float = 0.0  # that it took
    work: float = 0.0  # processor's time of the process meanwhile [s]


@lru_cache(maxsize=4)
def scenario_of(plan: Plan) -> Any:
    """Return a plan's scenario, read once a process.

    Args:
        plan: of the sweep.
    """
    return plan.scenario()


def setting_row(scenario: Any) -> tuple[float, ...]:
    """Return the reference values of one point, in the order of Setting."""
    rig = scenario.rig()
    first = scenario.motion.harmonics[0].amplitude if scenario.motion.harmonics else 0.0
    return (
        scenario.period,
        rig.inertia / rig.base_radius_loose**2,
        abs(first),
        rig.base_radius_drive,
        rig.drag_torque / rig.base_radius_loose,
        rig.inertia,
        float(np.cos(rig.base_helix_angle)),
    )


def one_by_one(
    plan: Plan, raw: Raw, watch: Watch, skip: Mapping[int, str], run: Callable[[int, Any, bool], None]
) -> None:
    """Run points each with a scenario of its own, and note why one could not be run."""
    for row, point in enumerate(raw.points):
        fresh = not plan.follow or point % plan.chain == 0
        if int(point) in skip:
            continue
        watch.start(int(point), row)
        try:
            scenario = plan.scenario(int(point))
            raw.setting[row] = setting_row(scenario)
            run(row, scenario, not fresh)
            raw.status[row] = DONE
        except TooLongError:
            raw.fail(row, too_long(watch.limit), TIME_LIMIT)
        except GearsError as error:
            raw.fail(row, str(error).replace("\n", "; "))
        except (ArithmeticError, ValueError, LookupError, RuntimeError, MemoryError) as error:
            raw.fail(row, f"{type(error).__name__}: {error}")


def fill(plan: Plan, raw: Raw, row: int, impacts: np.ndarray, period: float, mass: float, kept: np.ndarray) -> None:
    """Count the impacts of one run."""
    span = plan.settle * period, plan.periods * period
    first = plan.periods - plan.settle - plan.keep
    count_impacts(impacts, *span, period, first, raw.numbers[row], raw.sections[row], kept, mass)


def too_long(limit: float) -> str:
    """Return the sentence of a point that ran too long."""
    return f"ran for longer than {limit:g} s"
