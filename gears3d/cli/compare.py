"""``gears3d compare``: one recording compared with another."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gears3d.cli.options import OutFolder, Plot, choice, keep, places

if TYPE_CHECKING:
    from gears3d.comparison import Comparison


def compare(
    a: Annotated[Path, typer.Argument(help="Tested recording: a run folder, a Parquet or CSV record.")],
    b: Annotated[
        Path, typer.Argument(help="Reference recording, of the same kinds; the twin of a run is in RUN/twin.")
    ],
    mode: Annotated[
        str | None, choice("Default: by the reference's Lyapunov exponent.", "trajectory", "distribution")
    ] = None,
    out: OutFolder = None,
    plot: Plot = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the comparison as JSON.")] = False,
) -> None:
    """Compare the impacts of two recordings; errors are relative to the second.

    Example: gears3d compare runs/fig5-20rpm runs/fig5-20rpm/twin --plot comparison.png
    """
    from gears3d import comparison
    from gears3d.errors import Fault, InputError
    from gears3d.recording import read

    tested, reference = read(a), read(b)
    for path, record in ((a, tested), (b, reference)):
        if "model" not in record.meta and not len(record.impacts["time_s"]):
            remedy = "name a folder with impacts.parquet"
            raise InputError(Fault("", "has angles, but not a table of impacts to compare", remedy, str(path)))
    found = comparison.compare(tested, reference, mode=mode)
    lines = keep(found, *places(out, plot), [a, b])
    if as_json:
        from gears3d.cli.output import print_json

        print_json(found.details())
        return
    _show(found, f"{a} compared with {b}")
    typer.echo("\n".join(lines))


def _show(found: Comparison, title: str) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from gears3d.views.results.rows import comparison_rows

    for note in found.notes:
        Console(stderr=True, soft_wrap=True, highlight=False).print(f"[yellow]warning:[/] {escape(note)}")
    table = Table(title=escape(title), title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, value in comparison_rows(found):
        table.add_row(name, f"[red]{value}[/]" if value.startswith("different (p") else value)
    Console(highlight=False).print(table)
