"""How long a sweep will take, from a few of its points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING

from gears3d.errors import Fault, InputError

if TYPE_CHECKING:
    from gears3d.sweep.plan import Plan

TRIED = {"rigid": 8, "lubricated": 3, "plastic": 3, "bullet": 1}
"""Places of the grid that are tried of each model."""
TOGETHER = 64
"""Points at a place where they are packed at once."""
FEW = 6
"""Periods of which they run."""
BLOCK_S = 4.0
"""What a block is to take [s]."""
MOST = 16384
"""Points of a block at most."""
SLOWEST_S = 60.0
"""What a point may take at least before it is given up, unless told otherwise [s]."""


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

    Args:
        seconds: [s].

    >>> duration(2e-4), duration(90.0), duration(3.2e7)
    ('200 us', '1.5 min', '1.01 years')
    """
    for unit, size in (("years", 3.156e7), ("days", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"


def estimate(plan: Plan, workers: int, limit: float = inf, tick: Callable[[int], None] | None = None) -> Estimate:
    """Try a few points in a process of its own and return what all will take.

    Args:
        plan: of the sweep.
        workers: processes that will run it.
        limit: of a point [s].
        tick: called now and then with a number; may raise.
    """
    from gears3d.sweep.pool import Pool
    from gears3d.sweep.rigid import is_plain

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
