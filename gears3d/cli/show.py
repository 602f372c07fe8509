"""``gears3d show``: the data sheet of a scenario's pair, and its mesh as a drawing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import OutFolder, Overrides, Plot, ScenarioName, keep, places

if TYPE_CHECKING:
    from gears3d.gears.sheet import Quantity
    from gears3d.scenario import Scenario


def show(
    scenario: ScenarioName,
    out: OutFolder = None,
    plot: Plot = None,
    set_: Overrides = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the data sheet as JSON, SI units.")] = False,
) -> None:
    """Print the data sheet of a gear pair in the terms of ISO 21771, and draw its mesh.

    Example: gears3d show base/rigaud-2020 --plot mesh.png
    """
    from gears3d.scenario import load
    from gears3d.views.sheet import data_sheet_of

    loaded = load(scenario, set_ or ())
    found = data_sheet_of(loaded)
    sheet, (folder, picture) = found.quantities, places(out, plot)
    kept = keep(found, folder, picture, [loaded.path], loaded)
    if as_json:
        from gears3d.cli.output import print_json

        print_json(_answer(loaded, scenario, sheet, picture))
        return
    _print(loaded, scenario, sheet)
    typer.echo("\n".join(kept))


def _answer(loaded: Scenario, path: Path, sheet: tuple[Quantity, ...], out: Path | None) -> dict[str, Any]:
    from gears3d.views.sheet import tables

    return {
        "scenario": str(path),
        "title": loaded.title,
        "source": loaded.source,
        "inertia_simulated_kg_m2": {"drive": loaded.gears.drive.inertia, "loose": loaded.gears.loose.inertia},
        "sheet": tables(sheet),
        "drawing": str(out) if out is not None else None,
    }


def _print(loaded: Scenario, path: Path, sheet: tuple[Quantity, ...]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from gears3d.views.sheet import rows

    table = Table(title=escape(loaded.title or str(path)), title_justify="left", box=None, padding=(0, 2, 0, 0))
    for name in ("", "", "pair | drive", "loose"):
        table.add_column(name, overflow="fold")
    group = ""
    for line_group, name, symbol, texts in rows(sheet):
        if line_group != group:
            group = line_group
            table.add_row("", "", "", "")
            table.add_row(f"[bold]{escape(group)}[/]", "", "", "")
        same = len(texts) == 2 and texts[0] == texts[1]
        table.add_row(escape(name), escape(symbol), texts[0], "same" if same else texts[-1] if len(texts) == 2 else "")
    inertia = loaded.gears.loose.inertia
    if inertia is not None:
        from gears3d.units import show as text

        table.add_row("moment of inertia in simulations", "J", "imposed motion", text(inertia, "inertia"))
    Console(highlight=False).print(table)
