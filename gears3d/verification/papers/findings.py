"""Open questions of the papers: which effects of the catalogue could explain a published figure, and at which size.

A question is ``[question]`` in the file of a paper's published rows; every ``[[cause]]`` is a candidate cause with the
largest plausible size, which is scanned for the smallest size that gives the published figure.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from math import pi
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.effects import catalogue
from gears3d.effects.rows import Code, Gate
from gears3d.errors import InputError
from gears3d.files import write_text
from gears3d.verification.papers.bench import Bench, Case
from gears3d.verification.papers.evaluations import EVALUATIONS, Cause, Evaluation
from gears3d.verification.papers.published import file_of, load

if TYPE_CHECKING:
    from gears3d.effects import Rig

QUESTIONS = ("kadmiri-2012", "rigaud-2020", "ottewill-2010")


@dataclass(frozen=True, kw_only=True)
class Question:
    """A published figure that rigid gears do not give, with its candidate causes."""

    title: str
    asks: str
    columns: str
    scenario: str
    target: float
    tolerance: float
    decides: str
    evaluation: Evaluation
    causes: tuple[Cause, ...]
    first_phase: float = 0.0
    also_column: str = ""
    left_out: tuple[str, ...] = ()

    def phases(self, cause: Cause) -> list[float]:
        """Return the phases at which a cause is tried [rad]."""
        if cause.phases == 1:
            return [0.0]
        return [self.first_phase + 2 * pi * i / cause.phases for i in range(cause.phases)]


@dataclass(frozen=True)
class Answer:
    """Result of the scan of a cause: the smallest size that gives the published figure, or none up to the bound."""

    cause: Cause
    size: float | None
    phase: float
    values: np.ndarray
    nearest: float  # size that came nearest; the bound where no size comes nearer than no effect
    holds: bool  # everything that the paper states is met with this size, not the target alone
    also: str = ""

    @property
    def could(self) -> bool:
        """Whether it could be the cause."""
        return self.size is not None and self.holds


@cache
def question(paper: str) -> Question:
    """Return the open question of a paper.

    >>> question("kadmiri-2012").columns
    'Λ at 250, 500, 750, 1000 rpm'
    """
    file = file_of(paper)
    data = load(file)
    try:
        given = data["question"] | {"evaluation": EVALUATIONS[data["question"]["evaluation"]]}
        return Question(**given, causes=tuple(Cause(**each) for each in data["cause"]))
    except (KeyError, TypeError) as error:
        raise InputError(f"{file}: [question] or [[cause]] has an unknown or missing key: {error}") from error


def questions(only: str = "") -> list[Question]:
    """Return the open questions, or that of one paper."""
    return [question(name) for name in ([only] if only else QUESTIONS)]


def answers(question: Question, bench: Bench) -> Iterator[Answer]:
    """Return the answers for every cause of a question, one by one."""
    for cause in question.causes:
        bench.breathe()
        yield answer(question, cause, bench)


def answer(question: Question, cause: Cause, bench: Bench) -> Answer:
    """Find the smallest size of a cause that gives the published figure, over all its phases."""
    evaluation = question.evaluation
    found: list[tuple[float, float]] = []
    near: list[tuple[float, float, float]] = []
    for phase in question.phases(cause):

        def error(size: float, phase: float = phase) -> float:
            return evaluation.scalar(evaluation.values(bench, cause, size, phase)) - question.target

        size, best, off = solve(error, cause.bound, question.tolerance, cause.steps)
        near.append((off, best, phase))
        if size is not None:
            found.append((size, phase))
    size, phase = min(found, default=(None, min(near)[2]))
    nearest = (min(near)[1] or cause.bound) if size is None else size
    values = evaluation.values(bench, cause, nearest, phase)
    holds, also = evaluation.holds(values), ""
    if question.also_column and size is not None:
        met, also = evaluation.also(bench, cause, size, phase)
        holds = holds and met
    return Answer(cause, size, phase, values, nearest, holds, also)


def solve(
    error: Callable[[float], float], bound: float, tolerance: float, steps: int
) -> tuple[float | None, float, float]:
    """Return the smallest size on target, the size that comes nearest, and its distance from the target.

    Between two sizes on either side of the target it is bisected.

    >>> size, *_ = solve(lambda x: x * x - 2.0, 3.0, 1e-6, 10)
    >>> round(size, 5)
    1.41421
    >>> solve(lambda x: 3.0 - x, 2.0, 0.1, 4)
    (None, 2.0, 1.0)
    """
    sizes = bound * np.arange(steps + 1) / steps
    errors: list[float] = []
    nearest = (np.inf, 0.0)
    for i, size in enumerate(sizes):
        errors.append(error(float(size)))
        if abs(errors[i]) < nearest[0]:
            nearest = abs(errors[i]), float(size)
        if i and errors[i - 1] * errors[i] <= 0.0:
            low, high, below = float(sizes[i - 1]), float(size), errors[i - 1]
            for _ in range(24):
                middle = 0.5 * (low + high)
                here = error(middle)
                if abs(here) <= 0.2 * tolerance:
                    return middle, middle, abs(here)
                low, high, below = (middle, high, here) if here * below > 0.0 else (low, middle, below)
        if abs(errors[i]) <= tolerance:
            return float(size), float(size), abs(errors[i])
    return None, nearest[1], float(nearest[0])


def shown(case: Case, cause: Cause, size: float, phase: float) -> str:
    """Return the channel of a diagnosis in which a cause shows, and how large it is there."""
    rig = case.rig
    if cause.harmonic:
        first = case.scenario.motion.harmonics[0]
        speed, frequency = size * first.amplitude, cause.harmonic * first.frequency
        return _size(rig, catalogue()["drive_motion"](amplitude=speed, frequency=frequency))
    if cause.inertia:
        claimed = rig.drag_torque / rig.inertia
        return f"flight: deceleration −{claimed * size / (1 + size):.3g} rad/s² (rig: {claimed:.3g})"
    return "; ".join(_size(rig, effect) for effect in cause.effects(rig, size, phase)) or "nothing"


def _size(rig: Rig, effect: Any) -> str:
    """Return channel and size of one effect at the rig's mean speed."""
    order = f" at order {effect.order}" if hasattr(effect, "order") else ""
    if effect.place == "torque":
        return _torque(rig, effect, order)
    if effect.place == "motion":
        speed, frequency, _ = effect.rows(rig)[0].p
        angle = abs(speed) / (2 * pi * frequency)
        return f"drive: {1e3 * angle:.3g} mrad at {frequency:.3g} Hz, {1e6 * angle * rig.base_radius_drive:.3g} µm"
    if effect.place == "geometry":
        size = next(getattr(effect, name) for name in ("amplitude", "offset") if hasattr(effect, name))
        return f"contact: {1e6 * abs(size):.3g} µm{order}" if size else "contact: the backlash"
    if effect.place == "sensor":
        if hasattr(effect, "delay"):
            return f"contact: {1e3 * effect.delay:.3g} ms of delay"
        return f"contact: {1e3 * effect.amplitude:.3g} mrad{order}"
    if effect.place == "impact":
        names = ("offset", "asymmetry", "standard_deviation", "slope")
        name = next(each for each in names if hasattr(effect, each))
        return f"impact: restitution, {name.replace('_', ' ')} {getattr(effect, name):.2g}"
    if "stiffness" in effect.params:
        yielded = rig.drag_torque / rig.base_radius_loose / effect.stiffness
        return f"contact: flanks deform by {1e6 * yielded:.3g} µm under the drag"
    return "flight and impact: paths near a flank"


def _torque(rig: Rig, effect: Any, order: str) -> str:
    from gears3d.simulation.excitation import resisting

    row, angles = effect.rows(rig)[0], np.linspace(0.0, 2 * pi, 361)
    if row.code == Code.TORQUE_FRICTION:
        return "loss: nothing where the flank force is zero"
    torque = np.broadcast_to(resisting(row, rig.mean_speed_loose, angles), angles.shape)
    largest = float(torque[np.argmax(np.abs(torque))]) / rig.inertia
    if row.gate == Gate.CONTACT:
        return f"loss: contact decelerates by {largest * rig.base_radius_loose:.3g} m/s² more than flight"
    over = f"{order} of the loose gear" if order else ""
    claimed = f" (rig: {rig.drag_torque / rig.inertia:.3g})" if rig.drag_torque else ""
    return f"flight: deceleration {largest:.3g} rad/s²{over}{claimed}".replace("-", "−")


HEAD = """# Open questions of the papers

Made from `scenarios/PAPER/findings.csv`, which `tools/findings` writes, and from `[question]` in `published.toml`.
Published figures that rigid gears do not give. For each: the effects of the catalogue (and numbers of the rig) that
could have caused it, with the size, solved for in the rigid model; those that cannot, up to the largest plausible
size; and the channel in which `gears3d diagnose` would show each. *Could* means that the figures named at the head of
the section are met with one size, not that this is the cause. A cause that cannot is listed with the size that comes
nearest, or, where no size comes nearer than no effect, with the largest size.
"""
COLUMNS: tuple[str, ...] = ("effect", "verdict", "size", "largest_plausible", "values", "also", "shows_in")


def page(found: list[tuple[Question, list[dict[str, str]]]]) -> str:
    """Return questions with the rows of their answers as a page of the site."""
    parts = [HEAD]
    for question, rows in found:
        tried = {row["effect"] for row in rows}
        parts += [f"## {question.title}\n", _wrapped(question.asks), *table(question, rows), ""]
        parts += [f"- {cause.name}: {cause.note}" for cause in question.causes if cause.note and cause.name in tried]
        if question.left_out:
            parts.append(f"- Not tried: {', '.join(question.left_out)}.")
        parts += ["", _wrapped(f"**Decisive measurement.** {question.decides}")]
    return "\n".join(parts)


def _wrapped(text: str) -> str:
    return fill(text, 118, break_long_words=False, break_on_hyphens=False) + "\n"


def table(question: Question, rows: list[dict[str, str]]) -> list[str]:
    """Return the lines of a question's table."""
    names = ("effect", "verdict", "size", "largest plausible, why", question.columns, question.also_column, "channel")
    shown = [(key, name) for key, name in zip(COLUMNS, names, strict=True) if key != "also" or question.also_column]
    lines = ["| " + " | ".join(name for _, name in shown) + " |", "|" + "---|" * len(shown)]
    for row in rows:
        cells = {**row, "verdict": "**could**" if row["verdict"] == "could" else row["verdict"]}
        lines.append("| " + " | ".join(cells[key] for key, _ in shown) + " |")
    return lines


def rows_of(question: Question, each: list[Answer], bench: Bench) -> list[dict[str, str]]:
    """Return answers as texts by :data:`COLUMNS`, possible causes first."""
    rows = []
    for answer in sorted(each, key=lambda one: not one.could):
        cause = answer.cause
        at = f", {answer.phase:.2f} rad" if cause.phases > 1 and answer.size else ""
        texts = (
            cause.name,
            "could" if answer.could else "cannot",
            f"{answer.nearest:.3g} {cause.unit}{at}",
            f"{cause.bound:.3g}, {cause.because}",
            question.evaluation.text(answer.values),
            answer.also if question.also_column else "",
            shown(bench.case(question.scenario), cause, answer.nearest, answer.phase),
        )
        rows.append(dict(zip(COLUMNS, texts, strict=True)))
    return rows


def recorded(paper: str) -> list[dict[str, str]]:
    """Return the answers on record to the question of a paper, as texts by :data:`COLUMNS`."""
    with record_of(paper).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def record(paper: str, rows: list[dict[str, str]]) -> Path:
    """Write answers to the file of a paper and return it."""
    text = io.StringIO(newline="")
    written = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    written.writeheader()
    written.writerows(rows)
    return write_text(record_of(paper), text.getvalue())


def record_of(paper: str) -> Path:
    """Return the file of the answers on record, beside the published rows of a paper."""
    return file_of(paper).with_name("findings.csv")
