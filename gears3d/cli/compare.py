"""``gears3d compare``: one recording compared with another."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gears3d.cli.options import choice, to_picture

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
    out: Annotated[Path | None, typer.Option(help="Picture to write (.png, .svg, .pdf).", callback=to_picture)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the comparison as JSON.")] = False,
) -> None:
    """Compare the impacts of two recordings; errors are relative to the second.

    Example: gears3d compare runs/fig5-20rpm runs/fig5-20rpm/twin --out comparison.png
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
    if out is not None:
        comparison.write_picture(out, found, tested, reference)
    if as_json:
        from gears3d.cli.output import print_json

        print_json(found.details())
        return
    _show(found, f"{a} compared with {b}")
    typer.echo(f"picture written to {out}" if out is not None else "for a picture: --out comparison.png")


def _show(found: Comparison, title: str) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    for note in found.notes:
        Console(stderr=True, soft_wrap=True, highlight=False).print(f"[yellow]warning:[/] {escape(note)}")
    table = Table(title=escape(title), title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, value in rows(found):
        table.add_row(name, value)
    Console(highlight=False).print(table)


def rows(found: Comparison) -> list[tuple[str, str]]:
    """Return the table's lines as (name, value).

    Args:
        found: the comparison.
    """
    verdict = "the same" if found.regime_equal else "different"
    regimes = " and ".join(dict.fromkeys(regime.replace("_", " ") for regime in found.regimes))
    lines = [("mode", found.mode), ("regime", f"{verdict} ({regimes})")]
    if found.mode == "trajectory":
        lines.append(("impacts", f"{found.impacts_matched} of {found.impacts_compared} matched"))
        lines.append(("", f"{found.impacts_missed} missed, {found.impacts_invented} invented"))
    else:
        lines.append(("impacts", f"{found.impacts_compared} in the reference, not paired"))
    median, p95, bias = found.velocity_error_median, found.velocity_error_p95, found.velocity_bias
    if median is not None and p95 is not None and bias is not None:
        what = "95 % below" if found.mode == "trajectory" else "of the 95th percentile"
        lines.append(("impact speed error", f"median {_percent(median)}, {what} {_percent(p95)}"))
        lines.append(("", f"bias {_percent(bias, '+')}"))
    if found.phase_error_median_cycles is not None:
        lines.append(("phase error", f"{found.phase_error_median_cycles:.2g} cycles"))
    for test in found.tests:
        word = "[red]different[/]" if test.different else "no difference found"
        power = f"; minimum detectable effect {_percent(test.detectable)}" if test.detectable else ""
        lines.append((test.quantity.replace(".", " "), f"{word} (p = {test.p_value:.2g}{power})"))
    if found.rate_ratio is not None:
        value, low, high = found.rate_ratio
        lines.append(("impacts per time, ratio", f"{value:.3f} ({low:.3f} to {high:.3f})"))
    lines.append(("counted", f"impacts after free flights higher than {found.flight_height_min_m * 1e6:.3g} µm"))
    return lines


def _percent(value: float, sign: str = "") -> str:
    return f"{100 * value:{sign}.2g} %"
