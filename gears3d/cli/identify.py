"""``gears3d identify``: laws from measured data."""

from __future__ import annotations

from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from gears3d.identification import Identified

KINDS = ("rundown",)


def identify(
    kind: Annotated[str, typer.Argument(help="What to identify: rundown (the drag on a gear that runs down).")],
    files: Annotated[list[Path], typer.Argument(help="Records of the test: Parquet or CSV.")],
    inertia: Annotated[str, typer.Option(help='Of what runs down, e.g. "0.0695 kg m^2".')] = "",
    inertia_uncertainty: Annotated[str, typer.Option(help='Its standard deviation, e.g. "0.002 kg m^2".')] = "",
    rig: Annotated[Path | None, typer.Option(help="Scenario that knows the inertia.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write a picture there (.png, .svg, .pdf).")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the law as JSON.")] = False,
) -> None:
    """Identify a law from measurements: parameters with 95 % intervals and a snippet for a scenario.

    Example: gears3d identify rundown rundown.parquet --inertia "0.0695 kg m^2" --out drag.png
    """
    from gears3d import identification
    from gears3d.errors import UsageError, did_you_mean

    if kind not in KINDS:
        raise UsageError(f"there is nothing to identify called {kind!r}; {did_you_mean(kind, list(KINDS))}")
    moment, spread = _inertia(inertia, inertia_uncertainty, rig)
    found = identification.identify_rundown(files, moment, spread)
    if out is not None:
        identification.write_picture(out, found)
    if as_json:
        from gears3d.cli.output import print_json

        print_json(found.to_dict())
        return
    _show(found)
    typer.echo(f"picture written to {out}" if out is not None else "for a picture: --out drag.png")


def _inertia(inertia: str, uncertainty: str, rig: Path | None) -> tuple[float, float]:
    from gears3d.errors import Fault, InputError
    from gears3d.scenario import load
    from gears3d.units import parse

    def quantity(text: str, key: str) -> float:
        try:
            value = parse(text, "inertia")
        except InputError as error:
            raise InputError([Fault(key, fault.message, fault.remedy) for fault in error.faults]) from None
        if value < 0.0 or (value == 0.0 and key == "--inertia"):
            raise InputError(Fault(key, f"is {text!r}; a body has mass", "give a positive inertia"))
        return value

    spread = quantity(uncertainty, "--inertia-uncertainty") if uncertainty else 0.0
    if inertia:
        return quantity(inertia, "--inertia"), spread
    if rig is None:
        remedy = 'give --inertia "0.0695 kg m^2" or --rig SCENARIO: a run-down knows only the ratio of drag and inertia'
        raise InputError(Fault("--inertia", "is missing", remedy))
    scenario = load(rig)
    return scenario.rig().inertia, spread or scenario.uncertainty.get("gears.loose.inertia", 0.0)


def _show(found: Identified) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    for note in found.warnings:
        Console(stderr=True, soft_wrap=True, highlight=False).print(f"[yellow]warning:[/] {escape(note)}")
    table = Table(title=f"law: {found.law}", title_justify="left", box=None, padding=(0, 2, 0, 0))
    for column in ("", "value", "± (95 %)", "unit"):
        table.add_column(column, justify="left" if column in ("", "unit") else "right")
    for name, p in found.parameters.items():
        half = 0.5 * (p.high - p.low)
        digits = max(2 - floor(log10(half)), 0) if half > 0.0 else 6
        table.add_row(name, f"{p.value:.{min(digits, 12)}f}", f"{half:.2g}", p.unit)
    console = Console(highlight=False)
    console.print(table)
    held = ", ".join(f"{law} {loss:.3g}" for law, loss in found.goodness["held_out"].items() if loss is not None)
    console.print(f"error on stretches never fitted (mean square, in encoder errors): {held}", soft_wrap=True)
    console.print(f"\n{escape(found.snippet)}", end="")
