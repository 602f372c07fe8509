"""``gears3d papers``: the published figures reproduced, each number next to ours."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gears3d.cli.options import to_folder

if TYPE_CHECKING:
    from rich.console import Console

    from gears3d.verification.papers import Bench, Paper, Result


def papers(
    only: Annotated[str, typer.Option(metavar="PAPER", help="One paper by its short name (gears3d list papers).")] = "",
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for papers.html (the figures), papers.md and papers.json.", callback=to_folder),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the rows as JSON.")] = False,
) -> None:
    """Run the published operating points and compare each number with ours; exit code 1 if a verdict changed.

    Example: gears3d papers --only rigaud-2020 --out runs/papers
    """
    from rich.console import Console

    from gears3d.cli.output import print_json
    from gears3d.verification.papers import hold
    from gears3d.verification.papers import papers as wanted
    from gears3d.verification.papers.page import tally, write

    console = Console(width=None if sys.stdout.isatty() else 140, highlight=False)
    compared: list[tuple[Paper, list[Result]]] = []
    chosen = wanted(only)
    with _bench(sum(len(paper.claims) for paper in chosen)) as bench:
        for paper in chosen:
            results = [hold(claim, bench) for claim in paper.claims]
            compared.append((paper, results))
            if not as_json:
                _print(console, paper, results)
        written = write(out, compared, bench) if out is not None else []
    every = [result for _, results in compared for result in results]
    if as_json:
        print_json([result.row() for result in every])
    else:
        console.print(tally(every))
        for path in written:
            console.print(str(path), soft_wrap=True, markup=False)
    if any(result.changed for result in every):
        raise typer.Exit(1)


@contextmanager
def _bench(count: int) -> Iterator[Bench]:
    """Provide the runs of the papers, with progress and an end after Ctrl-C."""
    from gears3d.cli.progress import bars
    from gears3d.verification.papers import Bench

    with bars() as track:
        tick, done, last = track("papers", count), 0, ""

        def report(text: str) -> None:
            nonlocal done, last
            done, last = done + (text != last), text
            tick(min(done, count), text)

        yield Bench(report)


def _print(console: Console, paper: Paper, results: list[Result]) -> None:
    from rich.markup import escape
    from rich.table import Table

    from gears3d.verification.papers.page import allowed, notes, number, places, tally

    title = f"{paper.name} ({tally(results)})"
    table = Table("where", "quantity", "published", "ours", "tolerance", "model", "", title=title, title_justify="left")
    table.box = None
    for result in results:
        claim = result.claim
        colour = "green" if result.verdict == "agrees" else "red"
        words = f"[{colour}]{result.verdict}[/]" + (" [bold](not as recorded)[/]" if result.changed else "")
        values = (
            number(claim.published, claim.unit),
            number(result.computed, claim.unit, claim.tolerance),
            allowed(claim),
        )
        table.add_row(claim.figure, escape(claim.quantity), *map(escape, values), claim.model, words)
    console.print(table, "")
    for note, rows in notes([each for each in results if each.verdict == "disagrees" or each.changed]).items():
        console.print(f"[red]{escape(places(rows))}:[/] {escape(note)}")
    console.print("")
