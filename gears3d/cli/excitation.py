"""``gears3d excitation``: excitation, thresholds and expected regime of a scenario, without a simulation."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import Overrides, ScenarioName, to_picture

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gears3d.simulation.excitation import Assessment

Line = tuple[str, str, str]


def excitation(
    scenario: ScenarioName,
    out: Annotated[
        Path | None,
        typer.Option(help="Map of regimes with the operating point to write (.png, .svg, .pdf).", callback=to_picture),
    ] = None,
    set_: Overrides = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON, SI units.")] = False,
) -> None:
    """Report excitation, thresholds and expected regime of a scenario, without a simulation.

    Example: gears3d excitation rigaud-2020/fig5-20rpm --out map.png
    """
    from gears3d.scenario import load
    from gears3d.simulation.excitation import assess

    loaded = load(scenario, set_ or ())
    found = assess(loaded)
    if out is not None:
        from gears3d.views.excitation import write_map

        write_map(out, found, loaded.title)
    if as_json:
        from gears3d.cli.output import print_json

        about = {"scenario": str(scenario), "title": loaded.title, "source": loaded.source}
        print_json({**about, **found.to_dict(), "map": str(out) if out is not None else None})
        return
    _print(found, loaded.title or str(scenario))
    typer.echo(f"map written to {out}" if out is not None else "for a map of the regimes: --out map.png")


def _print(found: Assessment, title: str) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(highlight=False, width=None if sys.stdout.isatty() else 120)
    table = Table(title=escape(title), title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, symbol, value in lines(found):
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


def lines(found: Assessment) -> Iterator[Line]:
    """Return the table's lines: name, symbol, value.

    Args:
        found: the assessment.
    """
    from gears3d.units import show

    yield "mass on the line of action", "m", show(found.mass_kg, "mass")
    for part in found.drag:
        gate = "" if part["acts"] == "always" else f" ({part['acts']} only)"
        yield f"drag at the mean speed: {part['source']}{gate}", "", show(part["torque_N_m"], "torque")
    yield "drag in contact", "Td", show(found.drag_torque_N_m, "torque")
    yield "drag on the line of action", "F", show(found.drag_force_N, "force")
    yield "deceleration by the drag alone", "Td/J", show(found.deceleration_rad_s2, "acceleration")
    yield "backlash", "j", show(found.backlash_m, "length")
    if found.backlash_narrowest_m != found.backlash_m:
        yield "backlash at its narrowest", "", show(found.backlash_narrowest_m, "length")
    for wave in found.harmonics:
        speed, frequency = show(wave.amplitude_rad_s, "speed"), show(wave.frequency_Hz, "frequency")
        yield f"{wave.source}: {speed} at {frequency}", "", ""
        yield "  amplitude on the line of action", "H", show(wave.stroke_m, "length")
        yield "  excitation", "Λ", f"{wave.excitation:.4g}"
        yield "  dimensionless backlash", "j/H", f"{wave.backlash_dimensionless:.4g}"
        threshold = show(wave.threshold_amplitude_rad_s, "speed", 4), show(wave.threshold_frequency_Hz, "frequency", 4)
        yield "  threshold Λ = 1", "", f"{threshold[0]} at this frequency, {threshold[1]} at this amplitude"
    yield "largest deceleration of the combined motion", "", show(found.deceleration_largest_rad_s2, "acceleration")
    yield "excitation of the combined motion", "Λ", f"{found.excitation_total:.4g}"


SHOWN = 8
"""Flights of a cycle that are printed; JSON has them all."""


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
