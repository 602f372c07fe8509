"""Options, quantities and the output folder that the tests of ``gears3d bench`` share."""

from __future__ import annotations

import csv
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import Overrides as Overrides
from gears3d.cli.options import Plot as Plot
from gears3d.cli.options import ScenarioName as ScenarioName

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from gears3d.recording import Recording
    from gears3d.results import Result
    from gears3d.scenario import Scenario

OutFolder = Annotated[Path, typer.Option("--out", help="Folder for report.html, records, table, picture and summary.")]
Seed = Annotated[int | None, typer.Option(help="Seed of the encoder noise; default: of the scenario.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print summary.json.")]


def quantity(text: str, family: str, key: str) -> float:
    """Return a positive quantity of the command line in SI units."""
    from gears3d.errors import Fault, InputError
    from gears3d.units import parse

    try:
        value = parse(text, family)
    except InputError as error:
        raise InputError([Fault(key, fault.message, fault.remedy) for fault in error.faults]) from None
    if value <= 0.0:
        raise InputError(Fault(key, f"is {text}", "give a quantity above 0"))
    return value


def quantities(text: str, family: str, key: str) -> list[float]:
    """Return positive quantities, separated by commas, in SI units; the last unit applies to those without.

    >>> quantities("1, 2 Hz", "frequency", "--frequencies")
    [1.0, 2.0]
    """
    parts = [part.strip() for part in text.split(",")]
    unit = parts[-1].lstrip("+-.0123456789eE").strip()
    bare = [part.replace(".", "", 1).isdigit() for part in parts]
    return [quantity(f"{part} {unit}" if one else part, family, key) for part, one in zip(parts, bare, strict=True)]


def write(
    place: Path,
    scenario: Scenario,
    summary: dict[str, Any],
    *,
    tables: Mapping[str, Mapping[str, np.ndarray]],
    pictures: Mapping[str, Callable[[], Figure]],
    records: Mapping[str, Recording] | None = None,
    result: Result,
    plot: Path | None,
) -> dict[str, Any]:
    """Write the folder of a test, whole or not at all; return the summary."""
    from gears3d import __version__
    from gears3d.files import write_text
    from gears3d.provenance import provenance
    from gears3d.runs import RunFolder
    from gears3d.views.results import page

    command, records = shlex.join(["gears3d", *sys.argv[1:]]), records or {}
    summary = {
        **summary,
        "title": scenario.title,
        "source": scenario.source,
        "files": {"scenario": "scenario.toml", **{kind: sorted(some) for kind, some in
                  (("records", records), ("tables", tables), ("pictures", pictures))}},
        "version": __version__,
        "command": command,
    }  # fmt: skip
    with RunFolder(place) as folder:
        folder.write_scenario(scenario, f"gears3d {__version__}\n{command}")
        for name, record in records.items():
            record.write(folder.path / name)
        for name, columns in tables.items():
            _write_table(folder.path / name, columns)
        for name, draw in pictures.items():
            draw().savefig(folder.path / name, dpi=130)
        folder.write_summary(summary)
        files = ["summary.json", *sorted(file.name for file in folder.path.iterdir())]
        made = provenance([scenario.path], command)
        write_text(folder.path / "report.html", page(result, made, tuple(files)))
        folder.commit()
    if plot is not None:
        result.plot(plot)
    return summary


def _write_table(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(columns)
        out.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))


def finish(summary: dict[str, Any], as_json: bool, lines: Sequence[str]) -> None:
    """Print the results: the summary as JSON, or as lines of text."""
    if as_json:
        from gears3d.cli.output import print_json

        print_json(summary)
        return
    for line in lines:
        typer.echo(line)
