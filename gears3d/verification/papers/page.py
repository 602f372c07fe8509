"""The page of figures: every figure with its rows and the commands that make them, in one self-contained file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gears3d.files import write_text
from gears3d.verification.papers.bench import Bench
from gears3d.verification.papers.claim import Result
from gears3d.verification.papers.paper import Paper
from gears3d.verification.papers.text import Held, allowed, markdown, notes, number, tally
from gears3d.version import __version__
from gears3d.views.pages import engine
from gears3d.views.pages.engine import Head, Key, Picture
from gears3d.views.plots.numbers import figure

SHOWN = 12
"""Commands shown for one figure."""


def write(folder: Path, held: Held, bench: Bench) -> list[Path]:
    """Write ``papers.json``, ``papers.md``, ``papers.html`` and the same page as ``report.html``.

    Args:
        folder: where; made if need be.
        held: papers with their results.
        bench: whose runs the figures are drawn from.

    Returns:
        The paths.

    Raises:
        InputError: they cannot be written.
    """
    rows = [result.row() for _, results in held for result in results]
    page = render(held, bench)
    return [
        write_text(folder / "papers.json", json.dumps(rows, indent=2, ensure_ascii=False, allow_nan=False) + "\n"),
        write_text(folder / "papers.md", markdown(held)),
        write_text(folder / "papers.html", page),
        write_text(folder / "report.html", page),
    ]


def render(held: Held, bench: Bench) -> str:
    """Return the page as HTML that opens without a network.

    Args:
        held: papers with their results.
        bench: whose runs the figures are drawn from.
    """
    papers = [
        {
            "name": paper.name,
            "citation": paper.citation,
            "tally": tally(results),
            "parts": list(_parts(paper, results, bench)),
            "excused": paper.excused,
        }
        for paper, results in held
    ]
    every = [result for _, results in held for result in results]
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
    only = f" --only {held[0][0].name}" if len(held) == 1 else ""
    made = {"version": __version__, "command": f"gears3d papers{only} --out DIR"}
    return engine.render("papers.html.j2", head, made, ("papers.json", "papers.md"), papers=papers)


def _parts(paper: Paper, results: list[Result], bench: Bench) -> Iterator[dict[str, Any]]:
    """Give each figure or table of the paper, in print order, as the template wants it."""
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
