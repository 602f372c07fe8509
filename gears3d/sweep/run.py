"""A sweep from plan to dataset: estimate of time and memory, blocks in this process, in processes or on a cluster."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from math import ceil, inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.results import Result
from gears3d.sweep.block import Block, Watch
from gears3d.sweep.dataset import assemble, counted, refuse_lacking
from gears3d.sweep.measures import chosen
from gears3d.sweep.models import compute, warm
from gears3d.sweep.plan import Axis, Plan, parse_axis
from gears3d.sweep.store import Store

if TYPE_CHECKING:
    from gears3d.scenario import Scenario


TRIED = {"rigid": 8, "lubricated": 3, "plastic": 3, "bullet": 1}  # Places of the grid that are tried of each model
TOGETHER = 64  # Points at a place where they are packed at once
FEW = 6  # Periods of which they run
BLOCK_S = 4.0  # What a block is to take [s]
MOST = 16384  # Points of a block at most
SLOWEST_S = 60.0  # What a point may take at least before it is given up, unless told otherwise [s]
KEPT = 32  # Periods of which sections are kept unless told otherwise
LONGEST_S = 86400.0  # A sweep that is expected to take longer than this is not begun unasked [s]
MODELS = ("rigid", "lubricated", "plastic", "bullet")
SERIAL = 64  # Points, or chains of them, of a block in this process


@dataclass(frozen=True)
class Estimate:
    """What a sweep costs.

    Args:
        points: of the grid.
        point_s: time of a point in one process [s].
        workers: processes.
    """

    points: int
    point_s: float
    workers: int

    @property
    def total_s(self) -> float:
        """Time of the whole sweep [s]."""
        return self.points * self.point_s / self.workers

    def __str__(self) -> str:
        each, whole = duration(self.point_s), duration(self.total_s)
        cores = "1 process" if self.workers == 1 else f"{self.workers} processes"
        return f"{self.points} points at {each} each: about {whole} in {cores}"


def duration(seconds: float) -> str:
    """Return a time as people say it.

    >>> duration(2e-4), duration(90.0), duration(3.2e7)
    ('200 us', '1.5 min', '1.01 years')
    """
    for unit, size in (("years", 3.156e7), ("days", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"


def estimate(plan: Plan, workers: int, limit: float = inf, tick: Callable[[int], None] | None = None) -> Estimate:
    """Try a few points in a process of its own and return what all will take."""
    from gears3d.sweep.models import is_plain
    from gears3d.sweep.pool import Pool

    few = min(plan.periods, FEW)
    settle = min(plan.settle, few - 1)
    short = replace(plan, periods=few, settle=settle, keep=min(plan.keep, few - settle), follow=False)
    tried = min(TRIED[plan.model], short.size)
    width = TOGETHER if plan.model == "rigid" and is_plain(short) else 1
    points = sorted({(2 * i + 1) * short.size // (2 * tried) for i in range(tried)})
    spans = [(point, min(point + width, short.size)) for point in points]
    pool = Pool(short, 1, max(limit, SLOWEST_S))
    tried_blocks = list(pool.blocks(spans, tick))
    tried_blocks = tried_blocks[1:] or tried_blocks  # the first one reads the scenario, too
    each = sum(block.seconds for block in tried_blocks) / sum(block.end - block.begin for block in tried_blocks)
    return Estimate(plan.size, each * plan.periods / few, workers)


def block_size(plan: Plan, expected: Estimate) -> int:
    """Return how many points a block is to have.

    Args:
        plan: of the sweep.
        expected: what it costs.
    """
    wanted = min(BLOCK_S / max(expected.point_s, 1e-9), plan.size / (4 * expected.workers), MOST)
    return min(max(1, round(wanted / plan.chain)) * plan.chain, plan.size)


def refuse_endless(expected: Estimate, longest: float) -> None:
    """Refuse a sweep that takes longer than one has time for.

    Args:
        expected: what it costs.
        longest: that is allowed [s].

    Raises:
        InputError: it is longer.
    """
    if expected.total_s > longest:
        remedy = (
            f"give fewer points or periods, more --workers or a --scheduler, or --longest '{expected.total_s:.0f} s'"
        )
        raise InputError(Fault("--vary", f"{expected}; more than {duration(longest)} are not begun unasked", remedy))


@dataclass(frozen=True, repr=False)
class Done(Result):
    """What a sweep came to.

    Args:
        place: its folder.
        plan: what it was.
        counts: points by how they ended.
        resumed: points that were there before.
        seconds: that it took.
        work_s: processors' time of the points that were run now [s].
        expected: what it was expected to take; ``None`` when nothing was left to do.
    """

    place: Path
    plan: Plan
    counts: dict[str, int]
    resumed: int
    seconds: float
    work_s: float
    expected: Estimate | None


def make_plan(
    scenario: Scenario,
    vary: Sequence[str],
    model: str = "rigid",
    measures: Sequence[str] = (),
    follow: str = "",
    periods: int | None = None,
    settle: int | None = None,
    keep: int | None = None,
    strobe: float = 0.0,
) -> Plan:
    """Return the plan of a sweep.

    Args:
        scenario: what is varied.
        vary: ``"KEY=A..B UNIT lin N"`` and the like, one for each axis.
        model: ``"rigid"``, ``"lubricated"``, ``"plastic"`` or ``"bullet"``.
        measures: groups of variables; all that the model has unless given.
        follow: key of the axis along which the motion is followed up and down; each point from rest when empty.
        periods: whole periods that a point runs; as many as fit into ``run.duration`` unless given.
        settle: of these, left out at the begin; ``run.settle`` unless given.
        keep: of these, at the end, of which sections are kept.
        strobe: when in a period sections are taken, in cycles.

    Raises:
        InputError: an unknown key, measure or unit; carries every fault.
        UsageError: an unknown model, nothing to vary, or numbers of periods that do not go together.
    """
    if model not in MODELS:
        raise UsageError(f"there is no model {model!r}; {did_you_mean(model, MODELS)}")
    if not vary:
        raise UsageError('nothing is varied: give --vary "KEY=A..B UNIT lin N"')
    if scenario.motion.record is not None:
        raise InputError(Fault("motion.record", "a measured motion cannot be swept", "give mean and harmonics"))
    axes, faults = [], []
    for text in vary:
        try:
            axes.append(parse_axis(scenario, text))
        except InputError as why:
            faults += why.faults
    groups: tuple[str, ...] = ()
    try:
        groups = chosen(tuple(measures), model)
    except InputError as why:
        faults += why.faults
    if faults:
        raise InputError(faults)
    _check_apart(axes)
    axes = _last(axes, follow, scenario)
    total = periods if periods is not None else max(1, ceil(scenario.run.duration / scenario.period - 1e-9))
    out = settle if settle is not None else ceil(scenario.run.settle / scenario.period - 1e-9)
    if not 0 <= out < total:
        raise UsageError(f"of {total} periods {out} are excluded, and nothing remains: give more --periods")
    if not 0.0 <= strobe < 1.0 or (model == "lubricated" and abs(100 * strobe - round(100 * strobe)) > 1e-9):
        raise UsageError(f"--strobe {strobe:g}: give 0 or more and less than 1 cycles, in hundredths")
    kept = min(KEPT if keep is None else keep, total - out)
    if kept < 1:
        raise UsageError(f"--keep {keep}: give 1 or more")
    path = "" if scenario.path is None else str(Path(scenario.path).resolve())
    if "poincare" not in groups:
        kept = 1
    return Plan(
        scenario.document, path, model, groups, tuple(axes), bool(follow), total, out, kept, strobe, scenario.run.seed
    )


def _check_apart(axes: Sequence[Axis]) -> None:
    names = [axis.key for axis in axes]
    for name in names:
        if names.count(name) > 1:
            raise InputError(Fault(f"--vary {name}", "is varied twice", "give each key once"))


def _last(axes: list[Axis], follow: str, scenario: Scenario) -> list[Axis]:
    """Return the axes with the one that is followed at the end."""
    if not follow:
        return axes
    from gears3d.scenario.keys import whole_path

    names = [axis.key for axis in axes]
    key = whole_path(scenario, follow)
    if key not in names:
        raise InputError(Fault(f"--follow {follow}", "is not varied", did_you_mean(key, names)))
    followed = axes[names.index(key)]
    if followed.family == "choice" or list(followed.values) != sorted(followed.values):
        raise InputError(Fault(f"--follow {follow}", "needs values that rise", "give them in rising order"))
    return [axis for axis in axes if axis is not followed] + [followed]


def sweep(
    plan: Plan,
    out: str | Path,
    workers: int | None = None,
    scheduler: str = "",
    limit: float = inf,
    longest: float = LONGEST_S,
    block: int | None = None,
    about: dict[str, Any] | None = None,
    tell: Callable[[str], None] | None = None,
    track: Callable[[int], None] | None = None,
) -> Done:
    """Run a sweep, or its remaining points, and write its dataset.

    Args:
        plan: from :func:`make_plan`.
        out: folder; one that holds a part of the same sweep is gone on with.
        workers: processes on this machine, all cores unless given; 0: in this process, which nothing protects.
        scheduler: address of a dask scheduler, in place of processes on this machine.
        limit: of a point [s].
        longest: that the sweep is allowed to take [s].
        block: points of a block; as many as take some seconds unless given.
        about: attributes of the dataset in addition to its own.
        tell: takes a sentence now and then.
        track: takes the number of points that are done now and then; may raise.

    Returns:
        Where everything is, and how many points ended in which way.

    Raises:
        InputError: the folder is another's or cannot be written, or the sweep would take too long.
        EngineError: the scheduler or its workers are gone.

    >>> from tempfile import mkdtemp
    >>> from gears3d.scenario import load
    >>> plan = make_plan(load("scenarios/rigaud-2020/fig5-20rpm.toml"), ["drag.torque=0.2..0.8 N m lin 4"], periods=6)
    >>> sweep(plan, mkdtemp(), workers=0).counts
    {'done': 4, 'failed': 0, 'time_limit': 0, 'lost': 0}
    """
    refuse_lacking()
    if plan.model == "bullet":
        from gears3d.engine.bullet import require_bullet

        require_bullet()
    begin = time.perf_counter()
    workers = cores() if workers is None else workers
    if workers < 0 or (block is not None and (block < 1 or block % plan.chain)):
        what = f"--workers {workers}" if workers < 0 else f"--block {block}"
        raise UsageError(f"{what}: give 0 or more workers, and blocks of a multiple of {plan.chain} points")
    expected, work = None, 0.0
    with Store(Path(out), plan).opened() as store:
        if store.complete:
            store.clear()  # of what a kill right after the dataset left
            return Done(store.place, plan, counted(store.place), plan.size, time.perf_counter() - begin, 0.0, None)
        with closing(_crew(plan, workers, scheduler, limit)) as crew:
            if not store.block:
                if workers or scheduler:
                    expected = estimate(plan, max(crew.workers, 1), limit, lambda _: track(0) if track else None)
                    refuse_endless(expected, longest)
                    (tell or _silent)(str(expected))
                size = block or (block_size(plan, expected) if expected else min(SERIAL * plan.chain, plan.size))
                store.write_plan(size, about or {})
            todo = [span for span in store.blocks() if not store.has(*span)]
            resumed = plan.size - sum(last - first for first, last in todo)
            if resumed:
                (tell or _silent)(f"{resumed} of {plan.size} points are there already")
            progress = _Progress(resumed, track)
            for found in crew.blocks(todo, progress.tick):
                store.write(found)
                progress.add(found.end - found.begin)
                work += found.work
        counts = assemble(store, about or {})
        store.clear()
    return Done(store.place, plan, counts, resumed, time.perf_counter() - begin, work, expected)


class _Progress:
    def __init__(self, done: int, track: Callable[[int], None] | None) -> None:
        self._done, self._track = done, track

    def add(self, points: int) -> None:
        self._done += points
        self.tick(0)

    def tick(self, running: int) -> None:
        if self._track is not None:
            self._track(self._done + running)


class Alone:
    """Runs blocks in this process, one after the other."""

    workers = 1

    def __init__(self, plan: Plan, limit: float = inf) -> None:
        self.plan, self.limit = plan, limit

    def blocks(self, spans: Sequence[tuple[int, int]], tick: Callable[[int], None] | None = None) -> Iterator[Block]:
        """Run blocks and give them one after the other."""
        if self.limit < inf:
            warm(self.plan)
        for span in spans:
            yield compute(self.plan, *span, Watch(self.limit, lambda _, done: tick(done) if tick else None))

    def close(self) -> None:
        """Do nothing."""


def _crew(plan: Plan, workers: int, scheduler: str, limit: float) -> Any:
    if scheduler:
        from gears3d.sweep.cluster import Cluster

        return Cluster(plan, scheduler, limit)
    if workers == 0:
        return Alone(plan, limit)
    from gears3d.sweep.pool import Pool

    return Pool(plan, workers, limit)


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _silent(_: str) -> None:
    pass
