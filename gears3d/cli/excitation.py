"""``gears3d excitation``: excitation, thresholds and expected regime of a scenario, without a simulation."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import OutFolder, Overrides, Plot, ScenarioName, keep, places

if TYPE_CHECKING:
    from gears3d.simulation.excitation import Assessment


def excitation(
    scenario: ScenarioName,
    out: OutFolder = None,
    plot: Plot = None,
    set_: Overrides = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON, SI units.")] = False,
) -> None:
    """Report excitation, thresholds and expected regime of a scenario, without a simulation.

    Example: gears3d excitation rigaud-2020/fig5-20rpm --plot map.png
    """
    from gears3d.scenario import load
    from gears3d.simulation.excitation import assess

    loaded = load(scenario, set_ or ())
    found = assess(loaded)
    folder, picture = places(out, plot)
    kept = keep(found, folder, picture, [loaded.path], loaded)
    if as_json:
        from gears3d.cli.output import print_json

        about = {"scenario": str(scenario), "title": loaded.title, "source": loaded.source}
        print_json({**about, **found.to_dict(), "map": str(picture) if picture is not None else None})
        return
    _print(found, loaded.title or str(scenario))
    typer.echo("\n".join(kept))


def _print(found: Assessment, title: str) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from gears3d.views.rows import assessment_rows

    console = Console(highlight=False, width=None if sys.stdout.isatty() else 120)
    table = Table(title=escape(title), title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, symbol, value in assessment_rows(found):
        table.add_row(escape(name), symbol, escape(value))
    console.print(table)
    expected = found.expected
    word = expected.regime.replace("_", " ")
    basis = "" if expected.basis == "none" else f" ({expected.basis})"
    console.print(f"expected regime: [bold]{word}[/]{basis}{escape(': ' + expected.why) if expected.why else ''}")
    if expected.flights:
        console.print(_flights(found))
    for note in found.notes:
        console.print(f"note: {escape(note)}")


# Flights of a cycle that are printed; JSON has them all.
SHOWN = 8


def _flights(found: Assessment) -> Any:
    from rich.table import Table

    from gears3d.units import show

    expected = found.expected
    often = "" if expected.impacts_per_period is None else f": {expected.impacts_per_period:.3g} impacts per period"
    long = "" if expected.periods in (None, 1) else f", a cycle takes {expected.periods} periods"
    title = f"one cycle{often}{long}" if expected.periods else "from the first contact loss on"
    columns = ("contact loss", "at phase", "impact on", "at phase", "free flight", "velocity", "height")
    table = Table(*columns, title=title, title_justify="left", box=None, padding=(0, 2, 0, 0))
    for flight in expected.flights[:SHOWN]:
        table.add_row(
            flight["left"], f"{flight['lost_rad']:.4f} rad", flight["struck"], f"{flight['hit_rad']:.4f} rad",
            show(flight["duration_s"], "time", 4), show(flight["velocity_m_s"], "velocity", 4),
            show(flight["height_m"], "length", 4),
        )  # fmt: skip
    if len(expected.flights) > SHOWN:
        table.add_row(f"and {len(expected.flights) - SHOWN} more")
    return table
