"""Published rows and figures as data: a TOML file in the folder of a paper's scenarios becomes claims and figures.

A claim is what a paper gives, how gears3d computes the same, and the tolerance between both; a bench holds it.

A row names its scenario (``scenario``, with ``set`` or ``vary`` for changed values), a shared measure (``measure``,
with ``args``) and the reduction of several values to one (``over``; of arrays each first, where it is a list).
``scenario``, ``args`` and each key of ``vary`` may be lists: the measure is then evaluated for every combination.
``words`` maps the value to a word of the paper.
``[defaults]`` completes every row and figure; a ``note`` without a space is a name in ``[notes]``; ``[scenarios]`` has
named lists of scenarios.
"""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from itertools import product
from math import isfinite
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.scenario.document import ROWS, names, shipped
from gears3d.verification.papers.bench import Bench, Case
from gears3d.verification.papers.drawings import DRAWINGS
from gears3d.verification.papers.measures import MEASURES, REDUCTIONS

# in the order of the table; each has a folder of scenarios with its published rows
PAPERS = ("kadmiri-2012", "rigaud-2020", "ottewill-2010", "dct-helical-lubricated")

WHERE = ("scenario", "set", "vary", "model", "args")
TEXT = ("figure", "quantity", "published", "tolerance", "unit", "model", "recorded", "note", "basis")
ROW = {*WHERE, *TEXT, "measure", "over", "words"}
FIGURE = {*WHERE, "name", "title", "size", "caption", "drawing"}
HEAD = {"citation", "contents", "excused", "notes", "defaults", "scenarios", "row", "figure", "question", "cause"}

# from SI, in which measures return their values, to the units of the rows
SCALE = {"mm": 1e3, "µm": 1e6, "mm/s": 1e3, "ms": 1e3, "mrad": 1e3, "%": 1e2}

Verdict = Literal["agrees", "disagrees"]


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One row: a number or a trend that a paper measured, plotted or stated, and how it is computed.

    Args:
        paper: name of the paper, ``"rigaud-2020"``.
        figure: where the paper gives it, ``"fig. 5"`` or ``"table 1"``.
        quantity: what it is.
        published: what the paper gives; a word for a regime or a trend.
        tolerance: largest distance of the computed value, in the unit; 0 for words, which must be equal.
        unit: of both and of the tolerance; empty for ratios, counts and words.
        model: source of the computed value: ``"rigid"``, ``"bullet"``, ``"lubricated"``, ``"gears"`` or ``"law"``.
        compute: the value in the unit, from the runs of a bench.
        recorded: the verdict on record; the command exits with 1 when the verdict differs.
        note: reason of a disagreement, or a remark on the number.
        basis: where the tolerance comes from.

    Raises:
        ValueError: a word with a tolerance, or a number without a positive one.
    """

    paper: str
    figure: str
    quantity: str
    published: float | str
    tolerance: float = 0.0
    unit: str = ""
    model: str = "rigid"
    compute: Callable[[Bench], float | str]
    recorded: Verdict = "agrees"
    note: str = ""
    basis: str = ""

    def __post_init__(self) -> None:
        if isinstance(self.published, str) != (self.tolerance == 0.0) or not self.tolerance >= 0.0:
            raise ValueError(f"{self.quantity}: words have tolerance 0, numbers a positive one, not {self.tolerance}")


@dataclass(frozen=True)
class Result:
    """A claim with its computed value.

    Args:
        claim: the claim.
        computed: the value in the unit of the claim, or a word.
    """

    claim: Claim
    computed: float | str

    @property
    def verdict(self) -> Verdict:
        """Whether the computed value agrees with the published one."""
        return verdict(self.claim.published, self.computed, self.claim.tolerance)

    @property
    def changed(self) -> bool:
        """Whether the verdict differs from the one on record."""
        return self.verdict != self.claim.recorded

    def row(self) -> dict[str, Any]:
        """Return the row as JSON can hold it; a computed value that is not finite becomes its name."""
        claim, computed = self.claim, self.computed
        if not isinstance(computed, str):
            computed = float(computed) if isfinite(computed) else str(float(computed))
        published = {name: getattr(claim, name) for name in ("paper", "figure", "quantity", "published")}
        limits = {name: getattr(claim, name) for name in ("tolerance", "unit", "model")}
        return {
            **published,
            "computed": computed,
            **limits,
            "verdict": self.verdict,
            "note": claim.note,
            "recorded": claim.recorded,
            "basis": claim.basis,
        }


def verdict(published: float | str, computed: float | str, tolerance: float) -> Verdict:
    """Return whether a computed value agrees with a published one.

    Args:
        published: value of the paper.
        computed: value of gears3d; NaN never agrees with a number.
        tolerance: largest distance of two numbers; words must be equal.

    Raises:
        TypeError: one is a word, the other a number.

    >>> verdict(22.3, 22.9, 2.1), verdict("rises", "falls", 0.0)
    ('agrees', 'disagrees')
    """
    if isinstance(published, str) != isinstance(computed, str):
        raise TypeError(f"published is {published!r} but computed is {computed!r}: both words or both numbers")
    if isinstance(published, str) or isinstance(computed, str):
        return "agrees" if published == computed else "disagrees"
    return "agrees" if abs(computed - published) <= tolerance else "disagrees"


def hold(claim: Claim, bench: Bench) -> Result:
    """Compute the value of a claim and compare it with the published one.

    Args:
        claim: the claim.
        bench: where its simulations run.
    """
    with bench.working_on(f"{claim.paper}, {claim.figure}: {claim.quantity}", f"{claim.paper} {claim.figure}"):
        return Result(claim, claim.compute(bench))


@dataclass(frozen=True)
class Figure:
    """A figure of a paper, drawn from runs of the bench in the paper's own layout.

    Args:
        paper: name of the paper.
        name: ``"fig. 5"``; the page has it with the claims of the same figure.
        title: of the figure.
        draw: draws on an empty matplotlib figure from the bench's runs.
        size: width and height [in].
        caption: remarks, and differences from the paper's figure.
    """

    paper: str
    name: str
    title: str
    draw: Callable[[Bench, Any], None]
    size: tuple[float, float] = (9.0, 5.0)
    caption: str = ""

    def png(self, bench: Bench, dpi: int = 110) -> bytes:
        """Return the figure as a PNG picture.

        Args:
            bench: where its simulations run.
            dpi: dots per inch.
        """
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure as Sheet

        look: dict[Any, Any] = {
            "font.size": 9,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "legend.frameon": False,
        }
        with rc_context(look), bench.working_on(f"{self.paper}, {self.name}: drawing", f"{self.paper} {self.name}"):
            sheet = Sheet(figsize=self.size, layout="constrained")
            FigureCanvasAgg(sheet)
            self.draw(bench, sheet)
            picture = BytesIO()
            sheet.savefig(picture, format="png", dpi=dpi)
        return picture.getvalue()


@dataclass(frozen=True)
class Paper:
    """A paper: its claims, its figures, and why other figures are excused.

    Args:
        name: short name, as in ``source`` of the scenarios.
        citation: authors, title, journal, year.
        contents: its figures and tables, in print order.
        claims: the rows, (n,).
        figures: that are reproduced.
        excused: figures and tables without a row, and why.
    """

    name: str
    citation: str
    contents: tuple[str, ...]
    claims: tuple[Claim, ...]
    figures: tuple[Figure, ...]
    excused: dict[str, str]

    @property
    def forgotten(self) -> list[str]:
        """Figures and tables that have neither a row nor an excuse."""
        known = {claim.figure for claim in self.claims} | set(self.excused)
        return [name for name in self.contents if name not in known]


def paper(name: str) -> Paper:
    """Return a paper by name.

    Args:
        name: one of :data:`PAPERS`.

    Raises:
        UsageError: the name is unknown.

    >>> paper("rigaud-202")
    Traceback (most recent call last):
    gears3d.errors.UsageError: there is no paper 'rigaud-202'; did you mean 'rigaud-2020'?
    """
    if name not in PAPERS:
        raise UsageError(f"there is no paper {name!r}; {did_you_mean(name, PAPERS)}")
    return parse(name, file_of(name))


def papers(only: str = "") -> list[Paper]:
    """Return the papers.

    Args:
        only: the name of one; all when empty.

    Raises:
        UsageError: the name is unknown.
    """
    return [paper(name) for name in ([only] if only else PAPERS)]


def file_of(paper: str) -> Path:
    """Return the file of a paper's published rows."""
    return shipped() / paper / ROWS


def load(file: Path) -> dict[str, Any]:
    """Return the tables of a file of published rows as they stand."""
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror})") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{file}: is not TOML: {error}") from error


def parse(name: str, file: Path) -> Paper:
    """Return the paper that a file holds; every fault with file, row and key."""
    head = load(file)
    notes = head.get("notes", {})
    faults = [*_unknown(head, HEAD, ""), *_missing(head, ("citation", "contents"), "")]
    rows, figures = (
        [_complete(table, head.get("defaults", {}), head.get("scenarios", {})) for table in head.get(key, [])]
        for key in ("row", "figure")
    )
    for number, row in enumerate(rows):
        faults += _faults(row, f"row[{number}]", ROW, ("figure", "quantity", "published", "scenario", "measure"), notes)
    for number, figure in enumerate(figures):
        faults += _faults(figure, f"figure[{number}]", FIGURE, ("name", "title", "scenario", "drawing"), notes)
    if faults:
        raise InputError([Fault(each.key, each.message, each.remedy, str(file)) for each in faults])
    return Paper(
        name,
        head["citation"],
        tuple(head["contents"]),
        tuple(_claim(name, row, notes) for row in rows),
        tuple(_figure(name, figure) for figure in figures),
        head.get("excused", {}),
    )


def _complete(table: Mapping[str, Any], defaults: Mapping[str, Any], lists: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row or figure with defaults, and with the scenarios of the list that it names."""
    full = {**defaults, **table}
    named = full.get("scenario")
    return {**full, "scenario": lists[named]} if isinstance(named, str) and named in lists else full


def _unknown(table: Mapping[str, Any], known: set[str], place: str) -> Iterator[Fault]:
    for key in table.keys() - known:
        yield Fault(f"{place}.{key}".strip("."), "is unknown", did_you_mean(key, sorted(known)))


def _missing(table: Mapping[str, Any], needed: Iterable[str], place: str) -> Iterator[Fault]:
    for key in needed:
        if key not in table:
            yield Fault(f"{place}.{key}".strip("."), "is missing", f"give {key}")


def _faults(
    table: Mapping[str, Any], place: str, known: set[str], needed: tuple[str, ...], notes: Mapping[str, str]
) -> Iterator[Fault]:
    """Return unknown and missing keys, unknown measures, and arguments that the measure does not take."""
    yield from _unknown(table, known, place)
    yield from _missing(table, needed, place)
    for key, registry in (("measure", MEASURES), ("drawing", DRAWINGS), ("over", REDUCTIONS)):
        for name in _listed(table.get(key, [])):
            if name not in registry:
                yield Fault(f"{place}.{key}", f"{name!r} does not exist", did_you_mean(name, [*registry]))
    for name in _listed(table.get("scenario", [])):
        if name not in names():
            yield Fault(f"{place}.scenario", f"{name!r} is not shipped", did_you_mean(name, names()))
    if table.get("recorded", "agrees") not in ("agrees", "disagrees"):
        yield Fault(f"{place}.recorded", f"is {table['recorded']!r}", 'give "agrees" or "disagrees"')
    note = table.get("note", "")
    if note and " " not in note and note not in notes:
        yield Fault(f"{place}.note", f"{note!r} is not in [notes]", did_you_mean(note, [*notes]))
    yield from _unfit(table, place, MEASURES.get(table.get("measure", "")), 1)
    yield from _unfit(table, place, DRAWINGS.get(table.get("drawing", "")), 2)


def _unfit(table: Mapping[str, Any], place: str, function: Callable[..., Any] | None, given: int) -> Iterator[Fault]:
    if function is None:
        return
    for args in _listed(table.get("args", {})):
        try:
            inspect.signature(function).bind(*(None,) * given, **args)
        except TypeError as error:
            yield Fault(f"{place}.args", f"do not fit: {error}", f"see {function.__module__}.{function.__name__}")


def _claim(paper: str, row: Mapping[str, Any], notes: Mapping[str, str]) -> Claim:
    text = {key: row[key] for key in TEXT if key in row}
    text["note"] = notes.get(row.get("note", ""), row.get("note", ""))
    try:
        return Claim(paper=paper, **text, compute=partial(evaluate, row=row))
    except ValueError as error:
        raise InputError(f"{paper}, {row['figure']}: {error}") from error


def _figure(paper: str, figure: Mapping[str, Any]) -> Figure:
    def draw(bench: Bench, sheet: Any) -> None:
        DRAWINGS[figure["drawing"]](cases(bench, figure), sheet, **figure.get("args", {}))

    size = tuple(figure.get("size", (9.0, 5.0)))
    return Figure(paper, figure["name"], figure["title"], draw, size, figure.get("caption", ""))


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def cases(bench: Bench, table: Mapping[str, Any]) -> list[Case]:
    """Return the cases of a row or figure: every scenario with every combination of the varied values."""
    vary = table.get("vary", {})
    return [
        bench.case(name, {**table.get("set", {}), **dict(zip(vary, values, strict=True))}, table.get("model", "rigid"))
        for name in _listed(table.get("scenario", []))
        for values in product(*vary.values())
    ]


def evaluate(bench: Bench, row: Mapping[str, Any]) -> float | str:
    """Return the value of a row in its unit, or its word."""
    measure, each = MEASURES[row["measure"]], cases(bench, row)
    together = next(iter(inspect.signature(measure).parameters)) == "cases"
    found = [measure(one, **args) for one in ([each] if together else each) for args in _listed(row.get("args", {}))]
    for reduce in (REDUCTIONS[name] for name in _listed(row.get("over", []))):
        found = [reduce(each) for each in found] if isinstance(found[0], np.ndarray) else [reduce(found)]
    value = found[0]
    if len(found) > 1 or isinstance(value, np.ndarray):
        where = f"{row['figure']}, {row['quantity']}"
        raise InputError(Fault(where, f"{row['measure']} gives several values", "reduce them with over"))
    if "words" in row:
        return _word(value, row["words"])
    return value if isinstance(value, str) else float(value) * SCALE.get(row.get("unit", ""), 1.0)


def _word(value: float | str, words: Any) -> str:
    """Return the word of a word, or that of the first limit above a number."""
    if isinstance(value, str):
        return words.get(value, value)
    return next((word for limit, word in words if value < limit), words[-1][1])
