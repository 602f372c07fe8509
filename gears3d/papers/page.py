"""The page of figures: every figure with its rows and the commands that make them, in one self-contained file."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import jinja2

from gears3d.files import write_text
from gears3d.papers.bench import Bench
from gears3d.papers.claim import Result
from gears3d.papers.paper import Paper
from gears3d.papers.text import Held, allowed, markdown, notes, number, tally
from gears3d.version import __version__

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
    room = files("gears3d.papers") / "templates"
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=jinja2.FunctionLoader(lambda name: (room / name).read_text(encoding="utf-8")),
    )
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
    style = (room / "papers.css").read_text(encoding="utf-8")
    every = [result for _, results in held for result in results]
    return environment.get_template("page.html.j2").render(
        papers=papers, style=style, version=__version__, tally=tally(every)
    )


def _parts(paper: Paper, results: list[Result], bench: Bench) -> Iterator[dict[str, Any]]:
    """Give each figure or table of the paper, in print order, as the template wants it."""
    drawn = {figure.name: figure for figure in paper.figures}
    for name in paper.contents:
        mine = [result for result in results if result.claim.figure == name]
        figure = drawn.get(name)
        if not mine and figure is None:
            continue
        picture = b64encode(figure.png(bench)).decode() if figure else ""
        commands = bench.commands.get(f"{paper.name} {name}", [])
        yield {
            "anchor": f"{paper.name}-{name}".replace(" ", "").replace(".", ""),
            "name": name,
            "title": figure.title if figure else "",
            "caption": figure.caption if figure else "",
            "width": round(figure.size[0] * 96) if figure else 0,
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
