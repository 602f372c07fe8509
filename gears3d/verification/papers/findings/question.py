"""An open question of a paper, what could have caused it, and the size that it would take."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.verification.papers.bench import Bench

Make = Callable[["Rig", float, float], tuple[Any, ...]]
Change = Callable[["Rig", float], "Rig"]


@dataclass(frozen=True)
class Suspect:
    """An effect of the catalogue, or a number of the rig, that may be to blame.

    Args:
        name: what it is, its kind first.
        size: what its size is measured in, ``"of the drag"`` or ``"µm"``.
        bound: the largest plausible size, in that measure.
        because: where the bound comes from.
        make: its effects for a rig, a size and a phase [rad].
        change: the rig with a number off by a size.
        phases: tried, the smallest size counts [rad].
        note: what is known of it besides.
        steps: sizes tried up to the bound.
    """

    name: str
    size: str
    bound: float
    because: str
    make: Make = lambda rig, size, phase: ()
    change: Change = lambda rig, size: rig
    phases: tuple[float, ...] = (0.0,)
    note: str = ""
    steps: int = 12


@dataclass(frozen=True)
class Answer:
    """What a scan over a suspect's sizes gave.

    Args:
        suspect: who.
        size: the smallest size that gives the published figure; None when none does up to the bound.
        phase: of that size, or of the nearest [rad].
        values: at that size, or those that came nearest.
        nearest: the size that came nearest; the bound where no size comes nearer than none does.
        holds: whether everything the paper says is met with this size, not the target alone.
        also: what else the question asks, as text.
    """

    suspect: Suspect
    size: float | None
    phase: float
    values: np.ndarray
    nearest: float
    holds: bool
    also: str = ""

    @property
    def could(self) -> bool:
        """Whether the suspect could be the cause."""
        return self.size is not None and self.holds


@dataclass(frozen=True)
class Question:
    """A published figure that the base model does not give.

    Args:
        title: of its section.
        asks: what the paper gives and what the rigid model gives, as a paragraph.
        columns: heading of the values.
        suspects: in the order of the table.
        values: of a suspect at a size and a phase [rad].
        scalar: what is solved for, from the values.
        target: published.
        tolerance: within which a size counts as found.
        holds: whether values meet everything the paper says.
        told: the values as text.
        shown: channel of `gears3d diagnose` in which a suspect of a size shows, with the size expected there.
        decides: what would tell the suspects apart, as a paragraph.
        also: what else the paper says, judged at the size found: whether it is met, and what comes out.
        also_column: heading of that.
        left_out: kinds of the catalogue that were not tried.
    """

    title: str
    asks: str
    columns: str
    suspects: tuple[Suspect, ...]
    values: Callable[[Bench, Suspect, float, float], np.ndarray]
    scalar: Callable[[np.ndarray], float]
    target: float
    tolerance: float
    holds: Callable[[np.ndarray], bool]
    told: Callable[[np.ndarray], str]
    shown: Callable[[Bench, Suspect, float, float], str]
    decides: str
    also: Callable[[Bench, Suspect, float, float], tuple[bool, str]] | None = None
    also_column: str = ""
    left_out: tuple[str, ...] = ()


def answers(question: Question, bench: Bench) -> Iterator[Answer]:
    """Scan every suspect of a question.

    Args:
        question: the question.
        bench: where it is simulated.

    Yields:
        One answer a suspect.
    """
    for suspect in question.suspects:
        bench.breathe()
        yield answer(question, suspect, bench)


def answer(question: Question, suspect: Suspect, bench: Bench) -> Answer:
    """Find the smallest size of a suspect that gives the published figure, over all its phases.

    Args:
        question: the question.
        suspect: one of its suspects.
        bench: where it is simulated.
    """
    found: list[tuple[float, float]] = []
    near: list[tuple[float, float, float]] = []
    for phase in suspect.phases:

        def at(size: float, phase: float = phase) -> float:
            return question.scalar(question.values(bench, suspect, size, phase)) - question.target

        size, best, off = solve(at, suspect.bound, question.tolerance, suspect.steps)
        near.append((off, best, phase))
        if size is not None:
            found.append((size, phase))
    size, phase = min(found, default=(None, min(near)[2]))
    nearest = (min(near)[1] or suspect.bound) if size is None else size
    values = question.values(bench, suspect, nearest, phase)
    holds, also = question.holds(values), ""
    if question.also is not None and size is not None:
        met, also = question.also(bench, suspect, size, phase)
        holds = holds and met
    return Answer(suspect, size, phase, values, nearest, holds, also)


def solve(
    off: Callable[[float], float], bound: float, tolerance: float, steps: int
) -> tuple[float | None, float, float]:
    """Return the smallest size at which a quantity is on target, the size that comes nearest, and how near.

    Args:
        off: distance from the target by size, with its sign.
        bound: largest size tried.
        tolerance: a distance that counts as on target.
        steps: sizes tried up to the bound; between two on either side of the target it is bisected.

    >>> size, *_ = solve(lambda x: x * x - 2.0, 3.0, 1e-6, 10)
    >>> round(size, 5)
    1.41421
    >>> solve(lambda x: 3.0 - x, 2.0, 0.1, 4)
    (None, 2.0, 1.0)
    """
    sizes = bound * np.arange(steps + 1) / steps
    offs: list[float] = []
    nearest = (np.inf, 0.0)
    for i, size in enumerate(sizes):
        offs.append(off(float(size)))
        if abs(offs[i]) < nearest[0]:
            nearest = abs(offs[i]), float(size)
        if i and offs[i - 1] * offs[i] <= 0.0:
            low, high, below = float(sizes[i - 1]), float(size), offs[i - 1]
            for _ in range(24):
                middle = 0.5 * (low + high)
                here = off(middle)
                if abs(here) <= 0.2 * tolerance:
                    return middle, middle, abs(here)
                low, high, below = (middle, high, here) if here * below > 0.0 else (low, middle, below)
        if abs(offs[i]) <= tolerance:
            return float(size), float(size), abs(offs[i])
    return None, nearest[1], float(nearest[0])
