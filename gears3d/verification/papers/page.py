"""The rows as text, and the pages of rows and figures with the commands that make them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from math import floor, log10
from pathlib import Path
from typing import Any

from gears3d.files import write_text
from gears3d.verification.papers.bench import Bench
from gears3d.verification.papers.published import Claim, Paper, Result
from gears3d.version import __version__
from gears3d.views.pages import engine
from gears3d.views.pages.engine import Head, Key, Picture
from gears3d.views.plots.numbers import figure

SHOWN = 12  # commands on the page for one figure
Compared = list[tuple[Paper, list[Result]]]


def number(value: float | str, unit: str = "", tolerance: float = 0.0) -> str:
    """Return a value with its unit, four digits at most; a word as it is.

    >>> number(22.3456, "mm/s"), number(3e-15, "mm", 0.1), number("rises")
    ('22.35 mm/s', '0 mm', 'rises')
    """
    if isinstance(value, str):
        return value
    if tolerance:
        value = round(value, 3 - floor(log10(tolerance)))
    return f"{value + 0.0:.4g} {unit}".replace("-", "−").strip()


def allowed(claim: Claim) -> str:
    """Return the tolerance as text; empty for words."""
    return f"± {claim.tolerance:.3g}" if claim.tolerance else ""


def tally(results: list[Result]) -> str:
    """Return how many rows agree, in words."""
    red = sum(result.verdict == "disagrees" for result in results)
    changed = sum(result.changed for result in results)
    words = f"{len(results)} rows: {len(results) - red} agree, {red} disagree"
    return f"{words}; {changed} not as recorded" if changed else words


def markdown(compared: Compared) -> str:
    """Return all rows as a page of the documentation."""
    every = [result for _, results in compared for result in results]
    lines = [
        "# Published figures against gears3d",
        "",
        "Printed by `gears3d papers --out DIR` (`DIR/papers.md`; `DIR/papers.html` has the figures). A row is a number",
        "or a trend that the paper measured, plotted or stated; ours comes out of a simulation or a law. Words must be",
        "equal, numbers within the tolerance. Rows that disagree stay: they are findings, explained below each table.",
        "",
        f"{tally(every)}.",
    ]
    for paper, results in compared:
        lines += ["", f"## {paper.name}", "", f"{paper.citation}", "", *_table(results), *_notes(results)]
        if paper.excused:
            lines += ["", "Not represented:", ""]
            lines += [f"- {name}: {why}" for name, why in paper.excused.items()]
    return "\n".join([*lines, ""])


def _table(results: list[Result]) -> list[str]:
    lines = ["| where | quantity | published | ours | tolerance, from | model | |", "|---|---|---|---|---|---|---|"]
    for result in results:
        claim = result.claim
        cells = (
            claim.figure,
            claim.quantity,
            number(claim.published, claim.unit),
            number(result.computed, claim.unit, claim.tolerance),
            ", ".join(filter(None, (allowed(claim), claim.basis))),
            claim.model,
            "agrees" if result.verdict == "agrees" else "**disagrees**",
        )
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return lines


def _notes(results: list[Result]) -> list[str]:
    lines = ["", "Notes:", ""]
    for note, rows in notes(results).items():
        words = "**disagrees:** " if rows[0].verdict == "disagrees" else ""
        lines.append(f"- {places(rows)}: {words}{note}")
    return lines if len(lines) > 3 else []


def notes(results: list[Result]) -> dict[str, list[Result]]:
    """Return the notes in the order of their first row, with all rows that share them."""
    found: dict[str, list[Result]] = {}
    for result in results:
        if result.claim.note:
            found.setdefault(result.claim.note, []).append(result)
    return found


def places(rows: list[Result]) -> str:
    """Return where rows that share a note stand."""
    first = rows[0].claim
    more = f" and {len(rows) - 1} more" if len(rows) > 1 else ""
    return f"{first.figure}, {first.quantity}{more}"


def write(folder: Path, compared: Compared, bench: Bench) -> list[Path]:
    """Write ``papers.json``, ``papers.md``, ``papers.html`` and the same page as ``report.html``."""
    rows = [result.row() for _, results in compared for result in results]
    page = render(compared, bench)
    return [
        write_text(folder / "papers.json", json.dumps(rows, indent=2, ensure_ascii=False, allow_nan=False) + "\n"),
        write_text(folder / "papers.md", markdown(compared)),
        write_text(folder / "papers.html", page),
        write_text(folder / "report.html", page),
    ]


def render(compared: Compared, bench: Bench) -> str:
    """Return the page as HTML that opens without a network."""
    papers = [
        {
            "name": paper.name,
            "citation": paper.citation,
            "tally": tally(results),
            "parts": list(_parts(paper, results, bench)),
            "excused": paper.excused,
        }
        for paper, results in compared
    ]
    every = [result for _, results in compared for result in results]
    red = [f"{one.claim.paper} {one.claim.figure}" for one in every if one.verdict == "disagrees"]
    where = f" Disagreements: {', '.join(dict.fromkeys(red))}." if red else ""
    head = Head(
        "papers",
        "Published figures reproduced",
        "Does gears3d give the numbers and trends that the papers print?",
        f"{tally(every)}.{where}",
        [
            Key("numbers and trends that agree", figure(len(every) - len(red))),
            Key("numbers and trends that disagree", figure(len(red))),
        ],
        "open" if red else "good",
    )
    only = f" --only {compared[0][0].name}" if len(compared) == 1 else ""
    made = {"version": __version__, "command": f"gears3d papers{only} --out DIR"}
    return engine.render("papers.html.j2", head, made, ("papers.json", "papers.md"), papers=papers)


def _parts(paper: Paper, results: list[Result], bench: Bench) -> Iterator[dict[str, Any]]:
    """Return each figure or table of the paper, in print order, as the template needs it."""
    drawn = {figure.name: figure for figure in paper.figures}
    for name in paper.contents:
        mine = [result for result in results if result.claim.figure == name]
        figure = drawn.get(name)
        if not mine and figure is None:
            continue
        picture = figure and Picture(figure.png(bench), f"{name}, drawn again: {figure.title}", figure.caption)
        commands = bench.commands.get(f"{paper.name} {name}", [])
        yield {
            "anchor": f"{paper.name}-{name}".replace(" ", "").replace(".", ""),
            "name": name,
            "title": figure.title if figure else "",
            "picture": picture,
            "rows": _rows(mine),
            "commands": commands[:SHOWN],
            "more": max(len(commands) - SHOWN, 0),
            "red": sum(result.verdict == "disagrees" for result in mine),
        }


def _rows(results: list[Result]) -> list[dict[str, Any]]:
    """Return the rows; a note that several of them share stands at the last one."""
    last = {note: rows[-1] for note, rows in notes(results).items()}
    return [_row(result, last.get(result.claim.note) is result) for result in results]


def _row(result: Result, noted: bool) -> dict[str, Any]:
    claim = result.claim
    return {
        "quantity": claim.quantity,
        "published": number(claim.published, claim.unit),
        "computed": number(result.computed, claim.unit, claim.tolerance),
        "tolerance": allowed(claim),
        "basis": claim.basis,
        "model": claim.model,
        "verdict": result.verdict,
        "changed": result.changed,
        "note": claim.note if noted else "",
    }
