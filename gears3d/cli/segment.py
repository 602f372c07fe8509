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
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON; a list if several.")] = False,
) -> None:
    """Segment measured records into free flights and contacts, after the examination of their sensors.

    Example: gears3d segment rattle.parquet --rig rigaud-2020/fig5-20rpm --out measured

    With a map of the channels: gears3d segment record.toml --rig rigaud-2020/fig5-20rpm
    """
    from gears3d.cli.findings import show_repeated
    from gears3d.cli.output import print_json
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
    places = [out] if single else _places([Path(one.file) for one in admission.admitted], out)
    for place in places:
        if place is not None:
            refuse_foreign(place)
    summaries, faults = [], list(admission.faults)
    for admitted, place in zip(admission.admitted, places, strict=False):
        try:
            _require_rig(admitted)
            summaries.append(_one(admitted, place, as_json))
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


def _one(admitted: Admitted, place: Path | None, as_json: bool) -> dict[str, Any]:
    """Measure one record, write it and return its summary."""
    from gears3d.cli.findings import show_findings
    from gears3d.cli.progress import bars
    from gears3d.measured import segmentation
    from gears3d.provenance import provenance
    from gears3d.views.report.measured import durations, orders_told

    file = admitted.file
    if not as_json:
        show_findings(admitted.findings)
    with bars() as track:
        found = segmentation.measure(
            admitted.recording, admitted.rig, file, track("measure", 1.0), motion=admitted.motion
        )
    found.summary["quality"]["findings"] = [finding.to_dict() for finding in admitted.findings]
    found.summary["provenance"] = provenance(admitted.inputs, command())
    found.summary.update(file=file, durations=durations(found), contact_orders=orders_told(found))
    if place is not None:
        _write(found, admitted.rig, place)
    if not as_json:
        for warning in found.summary["warnings"]:
            typer.echo(f"warning: {warning}", err=True)
        _show(found.summary, file)
        typer.echo("to write a report: --out DIR" if place is None else f"report: {place / 'report.html'}")
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
    from gears3d.cli.pictures import over_a_period
    from gears3d.runs import RunFolder
    from gears3d.version import __version__
    from gears3d.views.measured import write_picture
    from gears3d.views.report.measured import write

    found.summary.update(version=__version__, command=command())
    with RunFolder(out) as folder:
        folder.write_recording(found.recording)
        folder.write_summary(found.summary)
        write_picture(folder.path / "measured.png", found)
        files = sorted(file.name for file in folder.path.iterdir())
        write(folder.path / "report.html", found, tuple(files), over_a_period(found, rig))
        folder.commit()


def _show(summary: dict[str, Any], title: str) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, value in rows(summary):
        table.add_row(name, escape(value))
    Console(highlight=False).print(table)


def rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the table's lines as (name, value).

    Args:
        summary: of a measurement.
    """
    from gears3d.measured.drive_motion import told

    quality, flights, flanks = summary["quality"], summary["cut"], summary["flanks"]
    lines = [
        ("record", f"{quality['samples']} samples, {quality['duration_s']:.6g} s, {quality['sample_rate_Hz']:.6g} Hz")
    ]
    for gear, one in quality["encoders"].items():
        counts = one["counts_per_revolution"]
        what = (
            f"{counts:.0f} counts per revolution, read as {one['read_as']}" if counts else "quantisation not detected"
        )
        lines.append((f"encoder, {gear}", what))
    if summary["status"] == "unexplained":
        return [("explained", "no: impacts, regime and backlash are withheld"), *lines, *_visible(summary)]
    lines.append(("noise", f"{_um(quality['noise_m'])} per reading, {_um(quality['noise_in_contact_m'])} in contact"))
    lines.append(("detected free flights", f"higher than {_um(quality['flight_height_min_m'])}"))
    if flanks["backlash_m"] is None:
        lines.append(("backlash", "not measured: no contact with the reverse flank"))
    else:
        low, high = flanks["backlash_m"]["ci95"]
        lines.append(("backlash", f"{_um(flanks['backlash_m']['value'])} (95 %: {1e6 * low:.5g} to {1e6 * high:.5g})"))
    for place, orders in flanks["orders"].items():
        strong = sorted(orders, key=lambda one: -one["amplitude_m"])[:3]
        shown = ", ".join(f"{_um(one['amplitude_m'])} at order {one['order']} of the {one['gear']}" for one in strong)
        lines.append((f"{place}, orders", shown))
    lines.append(("drive", told(summary["drive_motion"])))
    lines.append(("regime", str(summary["regime"]).replace("_", " ")))
    for name in ("active", "reverse"):
        speed = summary[f"{name}_velocity_mean_m_s"]
        mean = "" if speed is None else f", mean {1e3 * speed:.4g} mm/s"
        lines.append((f"impacts, {name}", f"{summary[f'{name}_impacts']}{mean}"))
    lines.append(
        ("free flights", f"{flights['whole_flights']} complete, {flights['testifying']} pass the goodness-of-fit test")
    )
    dropped = ", ".join(f"{count} {why.replace('_', ' ')}" for why, count in flights["dropped"].items() if count)
    lines.append(("excluded", dropped or "nothing"))
    slowing = flights["deceleration_median_rad_s2"]
    if slowing is not None:
        lines.append(("deceleration in free flight", f"{slowing:.4g} rad/s^2 (median)"))
    return lines


def _um(length: float) -> str:
    return f"{1e6 * length:.4g} um"


def _visible(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the table's lines of a record that is not explained: what it shows without a segmentation."""
    seen = summary["visible"]
    lines = [("noise", f"{_um(summary['quality']['noise_m'])} per reading")]
    ratio, gears = seen["ratio_loose_over_drive"], seen["ratio_of_base_radii"]
    shown = "not known" if ratio is None else f"{ratio:.6g}"
    lines.append(("ratio, loose over drive", f"{shown} in the record, {gears:.6g} of the rig"))
    lines.append(("mean speed, drive", f"{seen['drive_speed_mean_rad_s']:.5g} rad/s"))
    lines.append(
        ("displacement, range", f"{_um(seen['displacement_range_m'])}, drift {_um(seen['drift_m_s'])} per second")
    )
    strong = [f"{_um(one['amplitude_m'])} at order {one['order']} of the {one['gear']}" for one in seen["orders"][:3]]
    lines.append(("displacement, orders", ", ".join(strong) or "none exceeds the noise"))
    return lines
