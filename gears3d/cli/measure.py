"""``gears3d measure``: flights, contacts and impacts of a measured record."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer


def measure(
    record: Annotated[Path, typer.Argument(help="Measured record (.parquet or .csv): time_s and both angles.")],
    rig: Annotated[
        Path | None, typer.Option(help="Scenario with the gears of the bench: base radii, teeth, inertia.")
    ] = None,
    map_file: Annotated[Path | None, typer.Option("--map", help="record.toml that says what the channels are.")] = None,
    correct: Annotated[
        list[str] | None, typer.Option(metavar="KIND,...", help="Faults of sensors and clock to correct.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for signals, impacts, summary and picture.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Examine the sensors of a measured record, then cut it into flights and contacts.

    Example: gears3d measure rattle.parquet --rig scenarios/rigaud-2020/fig5-20rpm.toml --out measured
    """
    from gears3d import measurement
    from gears3d.cli.findings import show_findings
    from gears3d.gate import admit
    from gears3d.scenario import load

    admitted = admit(record, None if rig is None else load(rig), map_file, correct or ())
    if not as_json:
        show_findings(admitted.findings)
    found = measurement.measure(admitted.recording, admitted.rig, admitted.file)
    found.summary["quality"]["findings"] = [finding.to_dict() for finding in admitted.findings]
    if out is not None:
        _write(found, out)
    if as_json:
        from gears3d.cli.output import print_json

        print_json(found.summary)
        return
    _show(found.summary, str(record))
    typer.echo(f"written to {out}" if out is not None else "to keep it, with a picture: --out DIR")


def _write(found: Any, out: Path) -> None:
    from gears3d.runs import RunFolder
    from gears3d.views.measured import write_picture

    with RunFolder(out) as folder:
        folder.write_recording(found.recording)
        folder.write_summary(found.summary)
        write_picture(folder.path / "measured.png", found)
        folder.commit()


def _show(summary: dict[str, Any], title: str) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, value in rows(summary):
        table.add_row(name, value)
    Console(highlight=False).print(table)


def rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the table's lines as (name, value).

    Args:
        summary: of a measurement.
    """
    quality, flights, flanks = summary["quality"], summary["cut"], summary["flanks"]
    lines = [
        ("record", f"{quality['samples']} samples, {quality['duration_s']:.6g} s, {quality['sample_rate_Hz']:.6g} Hz")
    ]
    for gear, one in quality["encoders"].items():
        counts = one["counts_per_revolution"]
        what = f"{counts:.0f} counts a revolution, read as {one['read_as']}" if counts else "no counts seen"
        lines.append((f"encoder, {gear}", what))
    lines.append(("noise", f"{_um(quality['noise_m'])} a reading, {_um(quality['noise_in_contact_m'])} in contact"))
    lines.append(("flights seen", f"higher than {_um(quality['flight_height_min_m'])}"))
    if flanks["backlash_m"] is None:
        lines.append(("backlash", "not seen: the reverse flank was never struck"))
    else:
        low, high = flanks["backlash_m"]["ci95"]
        lines.append(("backlash", f"{_um(flanks['backlash_m']['value'])} (95 %: {1e6 * low:.5g} to {1e6 * high:.5g})"))
    for place, orders in flanks["orders"].items():
        strong = sorted(orders, key=lambda one: -one["amplitude_m"])[:3]
        told = ", ".join(f"{_um(one['amplitude_m'])} at order {one['order']} of the {one['gear']}" for one in strong)
        lines.append((f"{place}, orders", told))
    lines.append(("regime", str(summary["regime"]).replace("_", " ")))
    for name in ("active", "reverse"):
        speed = summary[f"{name}_velocity_mean_m_s"]
        mean = "" if speed is None else f", mean {1e3 * speed:.4g} mm/s"
        lines.append((f"impacts, {name}", f"{summary[f'{name}_impacts']}{mean}"))
    lines.append(("flights", f"{flights['whole_flights']} whole, {flights['testifying']} pass for parabolas"))
    dropped = ", ".join(f"{count} {why.replace('_', ' ')}" for why, count in flights["dropped"].items() if count)
    lines.append(("left out", dropped or "nothing"))
    slowing = flights["deceleration_median_rad_s2"]
    if slowing is not None:
        lines.append(("deceleration in flight", f"{slowing:.4g} rad/s^2 (median)"))
    return lines


def _um(length: float) -> str:
    return f"{1e6 * length:.4g} um"
