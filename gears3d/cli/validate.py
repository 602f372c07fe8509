"""``gears3d validate``: how far to trust gears3d, measured on this machine."""

from __future__ import annotations

import sys
from typing import Annotated

import typer


def validate(
    quick: Annotated[bool, typer.Option(help="A part of the cases, in about half a minute.")] = False,
    only: Annotated[str, typer.Option(help="One chapter: solids, twin, agreement, native, faults or effects.")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print the claims as JSON.")] = False,
) -> None:
    """Measure what gears3d claims of itself and hold each number against its bound; exit code 1 if one is missed.

    Example: gears3d validate --quick
    """
    from rich.console import Console
    from rich.table import Table

    from gears3d.cli.output import print_json
    from gears3d.validation import chapters

    console, note = Console(), Console(stderr=True)
    lines, missed = [], 0
    for title, claims in chapters(quick, only):
        table = Table("claim", "measured", "bound", "", title=title, title_justify="left", box=None)
        with note.status(title) if sys.stderr.isatty() and not as_json else _quiet():
            measured = list(claims())
        for claim in measured:
            bound = f"{'>=' if claim.at_least else '<='} {claim.bound:.4g} {claim.unit}"
            verdict = "[green]holds[/]" if claim.holds else "[red]MISSED[/]"
            table.add_row(claim.name, f"{claim.value:.4g} {claim.unit}", bound, verdict)
            missed += not claim.holds
            lines.append({"chapter": title, **vars(claim), "holds": claim.holds})
        if not as_json:
            console.print(table, "")
    if as_json:
        print_json(lines)
    else:
        console.print(f"{len(lines)} claims, {missed} missed")
    if missed:
        raise typer.Exit(1)


def _quiet():  # type: ignore[no-untyped-def]
    from contextlib import nullcontext

    return nullcontext()
