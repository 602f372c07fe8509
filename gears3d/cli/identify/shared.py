"""Options, input of records and output of laws that the kinds of ``gears3d identify`` share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gears3d.cli.options import Begin as Begin
from gears3d.cli.options import Correct as Correct
from gears3d.cli.options import End as End
from gears3d.cli.options import MapFile as MapFile
from gears3d.cli.options import OutFolder as OutFolder
from gears3d.cli.options import Plot as Plot
from gears3d.cli.options import RequiredRig as RequiredRig
from gears3d.cli.options import RigOverrides as RigOverrides
from gears3d.cli.options import StatedMotion as StatedMotion
from gears3d.cli.options import command, from_stdin, keep, places
from gears3d.cli.options import span_of as span_of

if TYPE_CHECKING:
    from gears3d.identify import Identified
    from gears3d.measured.checks import Admitted

Files = Annotated[list[Path], typer.Argument(help="Records of the test, or - (stdin).", callback=from_stdin)]
AsJson = Annotated[bool, typer.Option("--json", help="Print the law as JSON.")]


def admitted(
    files: Sequence[Path],
    rig: Path,
    map_file: Path | None = None,
    correct: Sequence[str] | None = None,
    needs: Sequence[str | Sequence[str]] = ("theta_drive_rad", "theta_loose_rad"),
    stated_motion: bool = False,
    span: tuple[float | None, float | None] = (None, None),
    overrides: Sequence[str] | None = None,
) -> tuple[Admitted, ...]:
    """Return records that passed the sensor gate, each with the rig of its condition."""
    from gears3d.cli.output import show_findings, show_repeated
    from gears3d.measured.checks import admit_each
    from gears3d.scenario import load

    admission = admit_each(
        files, load(rig, overrides or ()), map_file, correct or (), needs=needs, stated_motion=stated_motion, span=span
    )
    records = admission.all()
    show_repeated(admission.repeated)
    for record in records:
        show_findings(record.findings, record.file, quiet=True)
    return records


def inputs_of(records: Iterable[Admitted]) -> list[str | Path | None]:
    """Return the files that records were made from."""
    return [file for one in records for file in one.inputs]


def answer(
    found: Identified, out: Path | None, plot: Path | None, as_json: bool, inputs: Iterable[str | Path | None]
) -> None:
    """Keep the law where it is wanted, and print it with its provenance."""
    from dataclasses import replace

    from gears3d.provenance import comment, provenance

    inputs = list(inputs)
    made = provenance(inputs, command())
    found = replace(found, snippet=comment(made) + found.snippet)
    kept = keep(found, *places(out, plot), inputs)
    if as_json:
        from gears3d.cli.output import print_json

        print_json({**found.to_dict(), "provenance": made})
        return
    _show(found)
    typer.echo("\n".join(kept))


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
    console = Console(highlight=False, emoji=False)
    console.print(table)
    if (over := found.goodness.get("residual_over_noise")) is not None:
        sizes = [
            (found.goodness.get(f"rms_{kind}"), unit) for kind, unit in (("angle_rad", "rad"), ("speed_rad_s", "rad/s"))
        ]
        rms = ", ".join(f"{size:.3g} {unit}" for size, unit in sizes if size is not None)
        structure = f"p = {found.goodness['p_structure']:.2g} for independent errors about this law"
        console.print(
            f"residual: rms {rms}, {over:.3g} times the noise of single readings; {structure}", soft_wrap=True
        )
        for one in found.goodness["coastdowns"][:10]:
            span = f"{one['from_s']:.6g} to {one['to_s']:.6g} s, {one['points']} points, measured: {one['measured']}"
            console.print(f"free phase: {escape(one['file'] or 'record')}: {span}", soft_wrap=True)
    if losses := found.goodness.get("held_out"):
        held = ", ".join(f"{law} {loss:.3g}" for law, loss in losses.items() if loss is not None)
        console.print(f"held-out loss (smaller is better): {held}", soft_wrap=True)
    console.print(f"\n{escape(found.snippet)}", end="")
