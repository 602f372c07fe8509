"""``gears3d report``: the results of one recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gears3d.cli.options import OutFolder, Plot, keep, places


def report(
    run: Annotated[Path, typer.Argument(help="Run folder, or a folder with signals.parquet and impacts.parquet.")],
    lines: Annotated[int, typer.Option(min=1, help="Number of lines of each spectrum.")] = 5,
    out: OutFolder = None,
    plot: Plot = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print all results as JSON.")] = False,
) -> None:
    """Report the results of a recording: regime, motion, impacts, energies, durations, lines of its spectra.

    Example: gears3d report runs/fig5-20rpm/twin --plot sections.png
    """
    from gears3d.cli.output import print_json, print_rows
    from gears3d.errors import Fault, InputError
    from gears3d.recording import describe as told
    from gears3d.recording import read
    from gears3d.views.rows import recording_rows, spectra_of

    recording = read(run)
    if "model" not in recording.meta and not len(recording.impacts["time_s"]):
        remedy = "name a folder with impacts.parquet"
        raise InputError(Fault("", "has angles, but not a table of impacts to describe", remedy, str(run)))
    found = {**told(recording), "spectra": spectra_of(recording, lines)}
    kept = keep(recording, *places(out, plot), [run / "signals.parquet", run / "impacts.parquet"])
    if as_json:
        print_json(found)
        return
    print_rows(recording_rows(found), str(run))
    typer.echo("\n".join(kept))
