"""Open questions of the papers: which effects of the catalogue could explain a published figure, and at which size.

A question is ``[question]`` in the file of a paper's published rows; every ``[[cause]]`` is a candidate cause with the
largest plausible size, which is scanned for the smallest size that gives the published figure.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from math import inf, nan, pi, sqrt
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.effects import catalogue
from gears3d.effects.rows import Code, Gate
from gears3d.errors import InputError
from gears3d.files import write_text
from gears3d.verification.papers.bench import Bench, Case
from gears3d.verification.papers.measures.responses import excitation
from gears3d.verification.papers.measures.tooth_errors import disconnections, shift
from gears3d.verification.papers.published import file_of, load

if TYPE_CHECKING:
    from gears3d.effects import Rig

QUESTIONS = ("kadmiri-2012", "rigaud-2020", "ottewill-2010")


@dataclass(frozen=True, kw_only=True)
class Cause:
    """A candidate cause: an effect, a harmonic of the drive's speed, or the inertia of the rig, by its size.

    A parameter of ``effect`` is a literal, or a list whose product it is: numbers, ``"size"``, ``"phase"``, a quantity
    of the rig, or ``"1/..."`` of one of these.
    """

    name: str
    unit: str
    bound: float
    because: str
    effect: Mapping[str, Any] = field(default_factory=dict)
    harmonic: int = 0
    inertia: bool = False
    phases: int = 1
    steps: int = 12
    note: str = ""

    def effects(self, rig: Rig, size: float, phase: float) -> list[Any]:
        """Return the effect of a size and a phase [rad] on a rig; none without a size."""
        if not self.effect or not size:
            return []
        values = {key: _value(given, rig, size, phase) for key, given in self.effect.items() if key != "kind"}
        if ratio := values.pop("damping_ratio", 0.0):
            values["damping"] = 2 * ratio * sqrt(values["stiffness"] * rig.inertia) / rig.base_radius_loose
        return [catalogue()[self.effect["kind"]](**values)]

    def rig(self, rig: Rig, size: float) -> Rig:
        """Return the rig, with larger inertia where that is the cause."""
        return replace(rig, inertia=rig.inertia * (1 + size)) if self.inertia else rig

    def drive(self, first: Sequence[float], size: float, phase: float) -> list[tuple[float, float, float]]:
        """Return the drive's first harmonic, and that of the cause: amplitude [rad/s], frequency [Hz], phase [rad]."""
        speed, frequency, start = first
        own = [(size * speed, self.harmonic * frequency, pi / 2 + phase)] if self.harmonic and size else []
        return [(speed, frequency, start), *own]


def _value(given: Any, rig: Rig, size: float, phase: float) -> Any:
    if not isinstance(given, list):
        return given
    product, known = 1.0, {"size": size, "phase": phase}
    for factor in given:
        if isinstance(factor, str):
            name = factor.removeprefix("1/")
            value = known[name] if name in known else float(getattr(rig, name))
            product *= value if name == factor else 1.0 / value
        else:
            product *= factor
    return product


class Evaluation:
    """Values with a cause at a size and a phase, the scalar that is solved for, and whether all statements hold."""

    def values(self, bench: Bench, cause: Cause, size: float, phase: float) -> np.ndarray:
        """Return the values that stand in the table."""
        raise NotImplementedError

    def scalar(self, found: np.ndarray) -> float:
        """Return what is compared with the target."""
        raise NotImplementedError

    def holds(self, found: np.ndarray) -> bool:
        """Return whether the values meet everything that the paper states."""
        raise NotImplementedError

    def text(self, found: np.ndarray) -> str:
        """Return the values as text."""
        raise NotImplementedError

    def also(self, bench: Bench, cause: Cause, size: float, phase: float) -> tuple[bool, str]:
        """Return whether a further statement of the paper holds at the size found, and its values as text."""
        raise NotImplementedError


class LossOfContact(Evaluation):
    """Kadmiri et al. 2012, table 1: Λ at the loss of contact for four mean speeds."""

    SPEEDS, PRINTED = (250, 500, 750, 1000), (0.35, 0.34, 0.37, 0.34)
    SCATTER = 0.06  # a speed may be this far from its printed Λ: twice the scatter of the four
    UNNOTICED = 5e-8  # lower flights are no loss [m]

    def values(self, bench: Bench, cause: Cause, size: float, phase: float) -> np.ndarray:
        """Return Λ for the four speeds, with the claimed drag, inertia and first harmonic."""
        return np.array([self._lost(bench, speed, cause, size, phase) for speed in self.SPEEDS])

    def _lost(self, bench: Bench, speed: int, cause: Cause, size: float, phase: float) -> float:
        from gears3d.lumped.model import model
        from gears3d.lumped.run import run

        case = bench.case(f"kadmiri-2012/table1-{speed}rpm")
        first = case.scenario.motion.harmonics[0]
        effects, rig = cause.effects(case.rig, size, phase), cause.rig(case.rig, size)
        hidden = sum(e.amplitude * e.order * rig.mean_speed / first.amplitude for e in effects if e.place == "sensor")
        rows = [row for effect in effects if effect.place != "sensor" for row in effect.rows(rig)]
        unit = excitation(case)
        periods = 40.0 if any(hasattr(effect, "order") for effect in effects) else 5.0
        low, high = 0.02 / unit, 3.0 / unit
        for _ in range(11):
            middle = 0.5 * (low + high)
            drive = cause.drive((middle * first.amplitude, first.frequency, first.phase), size, phase)
            impacts = run(model(rig, drive, rows), periods / first.frequency).impacts
            low, high = (low, middle) if (impacts[:, 6] > self.UNNOTICED).any() else (middle, high)
        return (0.5 * (low + high) - hidden) * unit

    def scalar(self, found: np.ndarray) -> float:
        """Return the mean."""
        return float(found.mean())

    def holds(self, found: np.ndarray) -> bool:
        """Return whether every speed is near its own."""
        return bool(np.abs(found - self.PRINTED).max() < self.SCATTER)

    def text(self, found: np.ndarray) -> str:
        """Return the four."""
        return ", ".join(f"{each:.2f}" if each < inf else "–" for each in found)


class ImpactSpeeds(Evaluation):
    """Rigaud & Perret-Liaudet 2020, fig. 5: impact speeds on both flanks, and the threshold of fig. 4."""

    CASE = "rigaud-2020/fig5-20rpm"
    ACTIVE, REVERSE = 22.3, 19.9  # printed mean impact speeds [mm/s]
    THRESHOLD, SCATTER = 1.09, 0.19  # printed Λ* and its standard deviation
    PERIODS, SETTLED = 22, 2
    DRIFT = 30.1 * pi / 30  # mean speed [rad/s]: off 30 rpm, so that the mesh drifts past the excitation as on a rig
    BACKLASHES = np.geomspace(80e-6, 2e-3, 8)  # tried [m]; 2 mm is the rig's largest
    UNNOTICED = 1e-6  # lower flights are no rattle [m]

    def speeds(self, bench: Bench, cause: Cause, size: float, phase: float, backlash: float) -> tuple[float, float]:
        """Return the mean speeds of the impacts after crossings on active and reverse flank, both positive [mm/s]."""
        from gears3d.lumped.model import model
        from gears3d.lumped.run import run

        elastic = cause.name.startswith("restitution")
        rig = replace(
            bench.case(self.CASE).rig,
            backlash=backlash,
            restitution=0.3 if elastic else 0.0,
            mean_speed=self.DRIFT,
        )
        effects = cause.effects(rig, size, phase)
        rows = [row for effect in effects if effect.place != "sensor" for row in effect.rows(rig)]
        drive = cause.drive((20 * pi / 30, 3.0, 0.0), size, phase)
        impacts = run(model(rig, drive, rows), self.PERIODS / 3.0).impacts
        crossed = np.flatnonzero(np.diff(impacts[:, 1])) + 1
        settled = impacts[crossed[impacts[crossed, 0] > self.SETTLED / 3.0]]
        # A late reading shows an earlier speed of the loose gear: in flight it differs by the drag over the delay.
        late = sum(e.delay for e in effects if e.kind == "encoder_skew") * rig.drag_torque / rig.inertia
        late *= rig.base_radius_loose
        both = (-settled[settled[:, 1] == 0.0, 2] - late, settled[settled[:, 1] == 1.0, 2] + late)
        active, reverse = (1e3 * float(each.mean()) if len(each) else nan for each in both)
        return active, reverse

    def values(self, bench: Bench, cause: Cause, size: float, phase: float) -> np.ndarray:
        """Return both speeds [mm/s] at the backlash that gives the active flank its own, and that backlash [µm]."""
        from scipy.optimize import brentq

        def error(backlash: float) -> float:
            return self.speeds(bench, cause, size, phase, backlash)[0] - self.ACTIVE

        before = error(self.BACKLASHES[0])
        for low, high in pairwise(self.BACKLASHES):
            after = error(high)
            if before <= 0.0 <= after:
                backlash = float(brentq(error, low, high, xtol=2e-7))  # type: ignore[arg-type]
                return np.array([*self.speeds(bench, cause, size, phase, backlash), 1e6 * backlash])
            before = after
        return np.full(3, nan)

    def scalar(self, found: np.ndarray) -> float:
        """Return the speed on the reverse flank."""
        return float(found[1])

    def holds(self, found: np.ndarray) -> bool:
        """Return whether both speeds are the printed ones."""
        return bool(abs(found[0] - self.ACTIVE) < 0.1 and abs(found[1] - self.REVERSE) < 0.1)

    def text(self, found: np.ndarray) -> str:
        """Return both speeds and the backlash."""
        return f"{found[0]:.1f}, −{found[1]:.1f}; {found[2]:.0f} µm" if found[0] > 0 else "none gives 22.3"

    def also(self, bench: Bench, cause: Cause, size: float, phase: float) -> tuple[bool, str]:
        """Return whether the threshold at 3 Hz is still the printed one at 30 and 90 rpm, and the two."""
        from gears3d.lumped.model import model
        from gears3d.lumped.run import run

        found = []
        for mean in (self.DRIFT, 3 * self.DRIFT):
            rig = replace(bench.case(self.CASE).rig, restitution=0.0, mean_speed=mean)
            effects = cause.effects(replace(rig, mean_speed=self.DRIFT), size, phase)
            rows = [row for effect in effects if effect.place != "sensor" for row in effect.rows(rig)]
            unit = rig.inertia * 2 * pi * 3.0 / rig.drag_torque
            low, high = 0.01, 3.0
            for _ in range(9):
                middle = 0.5 * (low + high)
                drive = cause.drive((middle / unit, 3.0, 0.0), size, phase)
                impacts = run(model(rig, drive, rows), self.PERIODS / 3.0).impacts
                low, high = (low, middle) if (impacts[:, 6] > self.UNNOTICED).any() else (middle, high)
            found.append(0.5 * (low + high))
        good = bool(np.abs(np.array(found) - self.THRESHOLD).max() < 2 * self.SCATTER)
        return good, ", ".join(f"{each:.2f}" if each > 0.02 else "0" for each in found)


class ContourShift(Evaluation):
    """Ottewill et al. 2010, fig. 9: shift of the contours of case iv, and how similar they are when shifted back."""

    CASE = "ottewill-2010/case-iv"
    AMPLITUDES, PHASES = (0.40, 0.44), tuple(2 * pi * i / 16 for i in range(16))  # of the compared contours [rad]
    ALIKE = 0.5  # correlation with the model's contour from which on the general shape is the same

    def drawn(self, bench: Bench, cause: Cause | None = None, size: float = 0.0, phase: float = 0.0) -> np.ndarray:
        """Return the disconnections of case iv with a cause [rad], (2, 16)."""
        case = bench.case(self.CASE)
        more = cause.effects(case.rig, size, phase) if cause else []
        points = [(amplitude, turn) for amplitude in self.AMPLITUDES for turn in self.PHASES]
        return disconnections(case, points, more=more).reshape(len(self.AMPLITUDES), len(self.PHASES))

    def values(self, bench: Bench, cause: Cause, size: float, phase: float) -> np.ndarray:
        """Return the shift [rad] and the correlation when shifted back."""
        plain = bench.once("ottewill-2010 findings", lambda: self.drawn(bench))
        other = self.drawn(bench, cause, size, phase)
        if not (np.ptp(plain) > 0.0 and np.ptp(other) > 0.0):
            return np.zeros(2)
        moved = shift(plain, other)
        steps = round(moved / (2 * pi) * len(self.PHASES))
        each = [np.corrcoef(np.roll(plain, way * steps, axis=1).ravel(), other.ravel())[0, 1] for way in (1, -1)]
        return np.array([moved, max(each)])

    def scalar(self, found: np.ndarray) -> float:
        """Return the shift of a contour of the same shape."""
        return float(found[0]) if found[1] > self.ALIKE else 0.0

    def holds(self, found: np.ndarray) -> bool:
        """Return whether the shift is π within 0.5 and the shape is kept."""
        return bool(pi - found[0] <= 0.5 and found[1] > self.ALIKE)

    def text(self, found: np.ndarray) -> str:
        """Return both."""
        return f"{found[0]:.1f}; {found[1]:.2f}"


EVALUATIONS: dict[str, Evaluation] = {
    "loss_of_contact": LossOfContact(),
    "impact_speeds": ImpactSpeeds(),
    "contour_shift": ContourShift(),
}


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
    """Return the file of the answers on record, next to the published rows of a paper."""
    return file_of(paper).with_name("findings.csv")
