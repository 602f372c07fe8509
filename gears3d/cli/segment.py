"""``gears3d segment``: flights, contacts and impacts of a measured record."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.groups import warn_renamed
from gears3d.cli.options import (
    Begin,
    Correct,
    End,
    MapFile,
    OwnRig,
    Plot,
    Records,
    RigOverrides,
    StatedMotion,
    command,
    load_rig,
    span_of,
)

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted


def segment(
    records: Records = None,
    rig: OwnRig = None,
    map_file: MapFile = None,
    guess: Annotated[bool, typer.Option("--guess", hidden=True)] = False,
    correct: Correct = None,
    begin: Begin = "",
    to: End = "",
    stated_motion: StatedMotion = False,
    set_: RigOverrides = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for report.html, signals, impacts, summary; a subfolder per record if several."),
    ] = None,
    plot: Plot = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON; a list if several.")] = False,
) -> None:
    """Segment measured records into free flights and contacts, after the examination of their sensors.

    Example: gears3d segment rattle.parquet --rig rigaud-2020/fig5-20rpm --out measured

    With a map of the channels: gears3d segment record.toml --rig rigaud-2020/fig5-20rpm
    """
    from gears3d.cli.output import print_json, show_repeated
    from gears3d.errors import InputError, UsageError
    from gears3d.measured.checks import admit_each
    from gears3d.measured.readers import files_of
    from gears3d.runs.folder import refuse_foreign

    bench = load_rig(rig, set_)
    if guess:
        from gears3d.cli.inspect import propose_map

        warn_renamed("'gears3d segment --guess'", "'gears3d inspect --guess'")
        propose_map(records or [], bench, map_file, out, rig)
        return
    if not records and map_file is None:
        raise UsageError("name a measured record, e.g. gears3d segment rattle.parquet --rig SCENARIO")
    span = span_of(begin, to)
    admission = admit_each(records or [], bench, map_file, correct or (), stated_motion=stated_motion, span=span)
    show_repeated(admission.repeated)
    single = len(files_of(records or [], map_file)) == 1
    if plot is not None and not single:
        raise UsageError("--plot draws one record: name one, or --out DIR for a folder of each")
    places = [out] if single else _places([Path(one.file) for one in admission.admitted], out)
    for place in places:
        if place is not None:
            refuse_foreign(place)
    summaries, faults = [], list(admission.faults)
    for admitted, place in zip(admission.admitted, places, strict=False):
        try:
            _require_rig(admitted)
            summaries.append(_one(admitted, place, plot, as_json))
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    if as_json:
        print_json(summaries[0] if single else summaries)


def _require_rig(admitted: Admitted) -> None:
    """Refuse a record without base radii: neither a rig was given, nor is it the record of a model."""
    from gears3d.errors import UsageError

    if admitted.rig is None and "base_radius_drive_m" not in admitted.recording.meta:
        raise UsageError(
            f"Missing option '--rig': {admitted.file} has no base radii, give the scenario of the test rig"
        )


def _one(admitted: Admitted, place: Path | None, plot: Path | None, as_json: bool) -> dict[str, Any]:
    """Measure one record, write it and return its summary."""
    from gears3d.cli.output import print_rows, show_findings
    from gears3d.cli.progress import bars
    from gears3d.measured import segmentation
    from gears3d.provenance import provenance
    from gears3d.views.pages.measured import durations, orders_told
    from gears3d.views.rows import measurement_rows

    file = admitted.file
    if not as_json:
        show_findings(admitted.findings)
    with bars() as track:
        found = segmentation.measure(
            admitted.recording, admitted.rig, file, track(f"measure {Path(file).name}", 1.0), motion=admitted.motion
        )
    found.summary["quality"]["findings"] = [finding.to_dict() for finding in admitted.findings]
    found.summary["provenance"] = provenance(admitted.inputs, command())
    found.summary.update(file=file, durations=durations(found), contact_orders=orders_told(found))
    if place is not None:
        _write(found, admitted.rig, place)
    if plot is not None:
        found.plot(plot)
    if not as_json:
        for warning in found.summary["warnings"]:
            typer.echo(f"warning: {warning}", err=True)
        print_rows(measurement_rows(found.summary), file)
        typer.echo(
            "to keep it: --out DIR (report, JSON, data), --plot FILE.png"
            if place is None
            else f"report: {place / 'report.html'}"
        )
    return found.summary


def _places(files: list[Path], out: Path | None) -> list[Path | None]:
    """Return the folder of every record among several, OUT/<stem>."""
    if out is None:
        return [None] * len(files)
    names: list[str] = []
    for file in files:
        stem = file.stem if file.suffix else file.name
        again = names.count(stem)
        names.append(stem if not again else f"{stem}-{sum(name.startswith(stem) for name in names) + 1}")
    return [out / name for name in names]


def _write(found: Any, rig: Any, out: Path) -> None:
    from gears3d.runs import RunFolder
    from gears3d.version import __version__
    from gears3d.views.pages.measured import write
    from gears3d.views.pages.run import over_a_period

    found.summary.update(version=__version__, command=command())
    with RunFolder(out) as folder:
        folder.write_recording(found.recording)
        folder.write_summary(found.summary)
        found.plot(folder.path / "measured.png")
        files = sorted(file.name for file in folder.path.iterdir())
        write(folder.path / "report.html", found, tuple(files), over_a_period(found, rig))
        folder.commit()
