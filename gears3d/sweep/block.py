"""One block of points, computed in one process."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from gears3d.errors import GearsError
from gears3d.lumped import tally
from gears3d.lumped.batch import count_impacts
from gears3d.sweep.measures import Setting, reduce
from gears3d.sweep.plan import Plan
from gears3d.sweep.watch import TooLongError, Watch

DONE, FAILED, TIME_LIMIT, LOST = 0, 1, 2, 3
STATUS = ("done", "failed", "time_limit", "lost")
"""How a point ended, by its ``status``."""


@dataclass
class Raw:
    """Counts and sections of the points of a block before anything is made of them.

    Args:
        points: their numbers, (n,).
        numbers: as :mod:`gears3d.lumped.tally` has them, (n, NUMBERS).
        sections: once a period, (n, keep, SECTIONS).
        setting: a row a point: what :class:`~gears3d.sweep.measures.Setting` has, (n, 7).
        status: how each point ended, (n,).
        why: of the points that were not done.
    """

    points: np.ndarray
    numbers: np.ndarray
    sections: np.ndarray
    setting: np.ndarray
    status: np.ndarray
    why: dict[int, str] = field(default_factory=dict)

    @classmethod
    def empty(cls, plan: Plan, begin: int, end: int) -> Raw:
        """Return room for points.

        Args:
            plan: of the sweep.
            begin: first point.
            end: one after the last.
        """
        n = end - begin
        return cls(
            np.arange(begin, end),
            np.full((n, tally.NUMBERS), np.nan),
            np.full((n, plan.keep, tally.SECTIONS), np.nan),
            np.full((n, len(Setting._fields)), np.nan),
            np.full(n, FAILED, dtype=np.int8),
        )

    def fail(self, row: int, why: str, status: int = FAILED) -> None:
        """Note why a point has no numbers.

        Args:
            row: of the point.
            why: one sentence.
            status: FAILED, TIME_LIMIT or LOST.
        """
        self.status[row] = status
        self.numbers[row], self.sections[row] = np.nan, np.nan
        self.why[int(self.points[row])] = why


@dataclass(frozen=True)
class Block:
    """What a block of points gave.

    Args:
        begin: first point.
        end: one after the last.
        values: variable by name, (n,) or (n, keep); ``status`` and ``seed`` are among them.
        why: of the points that were not done, by number.
        seconds: that it took.
        work: processor's time of the process meanwhile [s].
    """

    begin: int
    end: int
    values: dict[str, np.ndarray]
    why: dict[int, str]
    seconds: float = 0.0
    work: float = 0.0


@lru_cache(maxsize=4)
def scenario_of(plan: Plan) -> Any:
    """Return a plan's scenario, read once a process.

    Args:
        plan: of the sweep.
    """
    return plan.scenario()


def setting_row(scenario: Any) -> tuple[float, ...]:
    """Return what the numbers of one point are held against, in the order of Setting.

    Args:
        scenario: of the point.
    """
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


def runner(model: str) -> Callable[[Plan, Raw, Watch, Mapping[int, str]], None]:
    """Return the function that runs the points of a model.

    Args:
        model: of the sweep.
    """
    if model == "rigid":
        from gears3d.sweep.rigid import run_points
    elif model == "lubricated":
        from gears3d.sweep.lubricated import run_points
    else:
        from gears3d.sweep.recorded import run_points
    return run_points


def compute(
    plan: Plan, begin: int, end: int, watch: Watch | None = None, skip: Mapping[int, str] | None = None
) -> Block:
    """Run the points of a block.

    Args:
        plan: of the sweep.
        begin: first point.
        end: one after the last.
        watch: keeps the time.
        skip: points that are not run, and why.

    Returns:
        The variables of the points; those that could not be run are NaN, with the reason.
    """
    clock, work = time.perf_counter(), time.process_time()
    raw = Raw.empty(plan, begin, end)
    runner(plan.model)(plan, raw, watch or Watch(), skip or {})
    for point, why in (skip or {}).items():
        if begin <= point < end:
            raw.fail(point - begin, why, LOST if "died" in why else TIME_LIMIT)
    setting = Setting(*raw.setting.T)
    values = reduce(plan.measures, raw.numbers, raw.sections, setting, plan.periods - plan.settle)
    values |= {"status": raw.status, "seed": plan.seeds(raw.points)}
    return Block(begin, end, values, raw.why, time.perf_counter() - clock, time.process_time() - work)


@lru_cache(maxsize=4)
def warm(plan: Plan) -> None:
    """Load or compile the kernels of a model, so that no point pays for it with its time; once a process.

    Args:
        plan: of the sweep; its first point is run for two periods.
    """
    if plan.model in ("rigid", "lubricated"):
        compute(replace(plan, periods=2, settle=1, keep=1, follow=False), 0, 1)


def one_by_one(
    plan: Plan, raw: Raw, watch: Watch, skip: Mapping[int, str], run: Callable[[int, Any, bool], None]
) -> None:
    """Run points each with a scenario of its own, and note why one could not be run.

    Args:
        plan: of the sweep.
        raw: filled.
        watch: keeps the time.
        skip: points that are not run.
        run: takes the row, the point's scenario, and whether it goes on from the row before.
    """
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
    """Count the impacts of one run.

    Args:
        plan: of the sweep.
        raw: filled.
        row: of the point.
        impacts: in order of time, (n, 7).
        period: of the excitation [s].
        mass: of the loose gear on the line of action [kg].
        kept: room, (2, m, 2).
    """
    span = plan.settle * period, plan.periods * period
    first = plan.periods - plan.settle - plan.keep
    count_impacts(impacts, *span, period, first, raw.numbers[row], raw.sections[row], kept, mass)


def too_long(limit: float) -> str:
    """Return the sentence of a point that ran too long.

    Args:
        limit: of its time [s].
    """
    return f"ran for longer than {limit:g} s"
