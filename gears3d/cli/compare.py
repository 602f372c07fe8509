"""``gears3d compare``: one recording compared with another, or a user's own model with a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gears3d.cli.options import MapFile, OutFolder, Overrides, Plot, choice, keep, places

if TYPE_CHECKING:
    from gears3d.scenario import Scenario


def compare(
    a: Annotated[Path, typer.Argument(help="Tested: a run folder or a record; with a scenario, your model's result.")],
    b: Annotated[
        Path, typer.Argument(help="Reference: a recording of the same kinds (the twin is in RUN/twin), or a scenario.")
    ],
    mode: Annotated[
        str | None, choice("Default: by the reference's Lyapunov exponent.", "trajectory", "distribution")
    ] = None,
    map_file: MapFile = None,
    column: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=COLUMN", help="Column of your model's table, e.g. displacement_m=s; repeatable."),
    ] = None,
    set_: Overrides = None,
    out: OutFolder = None,
    plot: Plot = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the comparison as JSON.")] = False,
) -> None:
    """Compare the impacts of two recordings, or your own lumped model with a scenario; errors relative to the second.

    With a scenario: a verdict by channel (drive, flight, contact, impact) on single flights and impacts, whether the
    motion is chaotic or not; exit code 1 if it is different. Your model's result is time with both angles, or with the
    displacement.

    Example: gears3d compare runs/fig5-20rpm runs/fig5-20rpm/twin --plot comparison.png

    Your model: gears3d compare runs/fig5-20rpm rigaud-2020/fig5-20rpm --out verdict
    """
    from gears3d import comparison
    from gears3d.cli.output import print_json, print_rows, print_warnings
    from gears3d.errors import Fault, InputError, UsageError
    from gears3d.recording import read
    from gears3d.views.rows import comparison_rows

    if _is_scenario(b):
        _verdict(a, b, map_file, column, set_, mode, (out, plot), as_json)
        return
    if set_ or map_file or column:
        raise UsageError("--set, --map and --column go with a scenario as the second argument")
    tested, reference = read(a), read(b)
    for path, record in ((a, tested), (b, reference)):
        if "model" not in record.meta and not len(record.impacts["time_s"]):
            remedy = "name a folder with impacts.parquet, or compare it with a scenario"
            raise InputError(Fault("", "has angles, but not a table of impacts to compare", remedy, str(path)))
    found = comparison.compare(tested, reference, mode=mode)
    lines = keep(found, *places(out, plot), [a, b])
    if as_json:
        print_json(found.details())
        return
    print_warnings(found.notes)
    print_rows(comparison_rows(found), f"{a} compared with {b}", lambda value: value.startswith("different (p"))
    typer.echo("\n".join(lines))


def _is_scenario(path: Path) -> bool:
    from gears3d.scenario.document import find

    return str(path) == "-" or path.suffix == ".toml" or (not path.exists() and find(path).suffix == ".toml")


def _verdict(
    a: Path,
    b: Path,
    map_file: Path | None,
    column: list[str] | None,
    overrides: list[str] | None,
    mode: str | None,
    kept: tuple[Path | None, Path | None],
    as_json: bool,
) -> None:
    """Print the verdict on a user's own model."""
    from rich.console import Console
    from rich.markup import escape

    from gears3d.cli.output import print_json, print_rows
    from gears3d.comparison import validate_model
    from gears3d.comparison.own_model import read_own
    from gears3d.comparison.verdict import rows_of
    from gears3d.errors import UsageError
    from gears3d.scenario import load

    if mode is not None:
        raise UsageError("--mode goes with a recording as the second argument")
    names = dict(each.split("=", 1) for each in column or () if "=" in each)
    if len(names) < len(column or ()):
        raise UsageError("--column: write NAME=COLUMN, e.g. --column displacement_m=s")
    scenario: Scenario = load(b, overrides or ())
    found = validate_model(read_own(a, scenario, map_file, names), scenario)
    inputs = [a / "signals.parquet" if a.is_dir() else a, map_file, scenario.path]
    lines = keep(found, *places(*kept), inputs, scenario)
    if as_json:
        print_json(found.to_dict())
    else:
        rows = rows_of(found.findings)
        print_rows(rows, f"{a} compared with {b}", lambda value: value.endswith("DEVIATES"))
        Console(highlight=False).print(f"[bold]{escape(found.sentence)}[/]", soft_wrap=True)
        typer.echo("\n".join(lines))
    if found.verdict == "different":
        raise typer.Exit(1)
