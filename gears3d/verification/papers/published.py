"""Published rows and figures as data: a TOML file in the folder of a paper's scenarios becomes claims and figures.

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
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.scenario.document import ROWS, names, shipped
from gears3d.verification.papers.bench import Bench, Case
from gears3d.verification.papers.claim import Claim, Figure, Paper
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
