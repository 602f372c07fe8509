"""``gears3d diagnose``: causes of deviations between measured records and a rig, and the extended rig."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import (
    Begin,
    Correct,
    End,
    MapFile,
    Plot,
    Records,
    RequiredRig,
    RigOverrides,
    StatedMotion,
    command,
    span_of,
    to_folder,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gears3d.diagnosis import Diagnosis
    from gears3d.measured.checks import Admitted


def diagnose(
    rig: RequiredRig,
    records: Records = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for report, diagnosis, extended rig and replay.", callback=to_folder)
    ] = None,
    plot: Plot = None,
    map_file: MapFile = None,
    correct: Correct = None,
    begin: Begin = "",
    to: End = "",
    stated_motion: StatedMotion = False,
    set_: RigOverrides = None,
    bodies: Annotated[
        bool, typer.Option("--3d/--no-3d", help="Measure the held-out error reduction in the 3D engine as well.")
    ] = True,
    experiments: Annotated[
        bool, typer.Option("--experiments/--no-experiments", help="Propose runs that separate competing hypotheses.")
    ] = True,
    film: Annotated[
        bool, typer.Option("--replay/--no-replay", help="Write replay.rrd: record, rig and extended rig.")
    ] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print the diagnosis as JSON.")] = False,
) -> None:
    """Find where measured records deviate from a rig, identify the cause, extend the rig, measure the error reduction.

    Example: gears3d diagnose blind/record.toml --rig blind/rig.toml --out found

    Records to practise on: gears3d challenge --seed 7 --out blind

    Several records at several speeds separate causes that one record cannot.
    """
    from gears3d.cli.diagnosed import show
    from gears3d.cli.findings import show_repeated
    from gears3d.cli.progress import bars
    from gears3d.diagnosis import diagnose as examine
    from gears3d.errors import UsageError
    from gears3d.measured.checks import admit_each
    from gears3d.provenance import provenance
    from gears3d.scenario import load

    bench = load(rig, set_ or ())
    if not records and map_file is None:
        raise UsageError("name measured records, e.g. gears3d diagnose record.toml --rig rig.toml --out found")
    span = span_of(begin, to)
    admission = admit_each(records or [], bench, map_file, correct or (), stated_motion=stated_motion, span=span)
    admitted = admission.all()
    show_repeated(admission.repeated)
    with bars() as track:
        tick = track("diagnose", 1.0)
        found = examine(admitted, bench, lambda doing, part: tick(part), bodies=bodies, runs=experiments)
    filmed = ""
    made = provenance([file for one in admitted for file in one.inputs], command())
    if out is not None:
        _write(found, out, made)
        filmed = _replay(found, admitted, out / "replay.rrd") if film else ""
    if plot is not None:
        found.plot(plot)
    if as_json:
        from gears3d.cli.output import print_json

        print_json({**found.to_dict(), "provenance": made})
        return
    show(found)
    if out is None:
        typer.echo("to write a report and the extended rig: --out DIR")
    else:
        typer.echo(f"report: {out / 'report.html'}")
        typer.echo(f"{'extended rig' if found.causes else 'rig unchanged'}: {out / 'extended.toml'}")
    if filmed:
        typer.echo(filmed)


def _write(found: Diagnosis, out: Path, made: dict[str, Any]) -> None:
    import json

    from gears3d.diagnosis import extended_text
    from gears3d.files import replacing
    from gears3d.provenance import comment
    from gears3d.views.pages.diagnosed import write

    out.mkdir(parents=True, exist_ok=True)
    with replacing(out / "diagnosis.json") as unfinished:
        unfinished.write_text(json.dumps({**found.to_dict(), "provenance": made}, indent=2) + "\n", encoding="utf-8")
    with replacing(out / "extended.toml") as unfinished:
        unfinished.write_text((comment(made) if found.causes else "") + extended_text(found), encoding="utf-8")
    write(out / "report.html", found, made, ("diagnosis.json", "extended.toml"))


def _replay(found: Diagnosis, admitted: Sequence[Admitted], file: Path) -> str:
    """Write the replay and return a line about it; where that fails, report the reason and remove an earlier replay."""
    from gears3d.cli.progress import bars
    from gears3d.diagnosis.stretch import stretch
    from gears3d.errors import GearsError
    from gears3d.views.replay.side_by_side import beside, off
    from gears3d.views.replay.write import require_rerun

    with bars() as track:
        tick = track("replay", 2.0)
        try:
            require_rerun()
            made = stretch(found, admitted)
            tick(1.0)
            beside(made, tuple(cause.kind for cause in found.causes), file)
            tick(2.0)
        except GearsError as error:
            file.unlink(missing_ok=True)
            typer.echo(f"no replay.rrd: {error}", err=True)
            return ""
    span = f"{Path(made.name).name}, {made.measured.time[0]:.4g} to {made.measured.time[-1]:.4g} s"
    return f"replay: {file} ({span}. {off(made)})"
