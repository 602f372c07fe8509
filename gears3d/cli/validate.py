"""``gears3d validate``: the checks of gears3d, run on this machine."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import command, to_results
from gears3d.verification.validation.check import CHAPTERS

if TYPE_CHECKING:
    from rich.console import Console

    from gears3d.results import Result
    from gears3d.verification.validation import Check

Measured = list[tuple[str, list["Check"]]]


def validate(
    quick: Annotated[bool, typer.Option(help="Part of the cases, in about a minute.")] = False,
    only: Annotated[str, typer.Option(metavar="CHAPTER", help=f"One chapter: {', '.join(CHAPTERS)}.")] = "",
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for report.html, validation.json and validation.md, or the file of the latter.",
            callback=to_results(".md"),
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the checks as JSON.")] = False,
) -> None:
    """Run the checks of gears3d and compare each number with its bound; exit code 1 if one is missed.

    Example: gears3d validate --quick
    """
    from rich.console import Console

    from gears3d.cli.output import print_json
    from gears3d.files import write_text
    from gears3d.verification.validation import chapters

    console = Console(width=None if sys.stdout.isatty() else 120)
    measured: Measured = []
    for title, checks in chapters(quick, only):
        with Console(stderr=True).status(title) if sys.stderr.isatty() and not as_json else nullcontext():
            measured.append((title, list(checks())))
        if not as_json:
            _print(console, *measured[-1])
    every = [check for _, checks in measured for check in checks]
    missed = sum(not check.holds for check in every)
    if as_json:
        print_json([_plain(title, check) for title, checks in measured for check in checks])
    else:
        console.print(f"{len(every)} checks, {missed} missed")
    if out is not None and out.suffix == ".md":
        write_text(out, markdown(measured))
    elif out is not None:
        _result(measured).save(out, command=command())
    if missed:
        raise typer.Exit(1)


def _result(measured: Measured) -> Result:
    from gears3d.views.results import Contents, Told

    every = [(title, check) for title, checks in measured for check in checks]
    missed = [check.name for _, check in every if not check.holds]
    rows = [
        (f"{title}: {check.name}", f"{_words(check)[0]} ({_words(check)[1]}) {'holds' if check.holds else 'MISSED'}")
        for title, check in every
    ]
    answer = f"{len(every)} checks, {len(missed)} missed{': ' if missed else ''}{', '.join(missed)}."
    question = "Do the numbers of gears3d hold on this machine against closed forms and independent codes?"
    data = {"checks": [_plain(title, check) for title, check in every]}
    tables = {"validation.md": lambda path: path.write_text(markdown(measured), encoding="utf-8")}
    return Told(Contents("validation", "validation", "Validation", question, answer, rows, data, tables=tables))


def _print(console: Console, title: str, checks: list[Check]) -> None:
    from rich.table import Table

    table = Table("check", "measured", "bound", "", title=title, title_justify="left", box=None)
    for check in checks:
        table.add_row(check.name, *_words(check), "[green]holds[/]" if check.holds else "[red]MISSED[/]")
    console.print(table, "")


def _words(check: Check) -> tuple[str, str]:
    """Return measured value and bound as text."""
    sign = "≥" if check.at_least else "≤"
    return f"{check.value:.3g} {check.unit}".strip(), f"{sign} {check.bound:.3g} {check.unit}".strip()


def _plain(title: str, check: Check) -> dict[str, Any]:
    return {"chapter": title, **vars(check), "holds": check.holds}


def markdown(measured: Measured) -> str:
    """Return the table as a page of the documentation."""
    import platform

    from gears3d.version import __version__

    about = f"gears3d {__version__}, Python {platform.python_version()}, {platform.machine()}"
    lines = ["# Validation", "", f"Printed by `gears3d validate` ({about}).", ""]
    for title, checks in measured:
        lines += [f"## {title}", "", "| check | measured | bound | |", "|---|---|---|---|"]
        for check in checks:
            value, bound = _words(check)
            lines.append(f"| {check.name} | {value} | {bound} | {'holds' if check.holds else '**missed**'} |")
        lines.append("")
    return "\n".join(lines)
