"""``gears3d identify coastdown``: the drag on a coasting gear."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gears3d.cli.identify.shared import (
    AsJson,
    Begin,
    Correct,
    End,
    Files,
    MapFile,
    OutFolder,
    Plot,
    RigOverrides,
    answer,
    span_of,
)
from gears3d.cli.options import load_rig

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gears3d.identify import Identified, Inertia, Track
    from gears3d.scenario import Scenario


def coastdown(
    files: Files,
    inertia: Annotated[str, typer.Option(help='Inertia that coasts down, e.g. "0.0695 kg m^2".')] = "",
    inertia_uncertainty: Annotated[
        str, typer.Option(help='Standard deviation of the inertia, e.g. "0.002 kg m^2".')
    ] = "",
    torque: Annotated[
        str,
        typer.Option(
            help='Known torque under which the gear spins up where its speed rises, e.g. "0.2 N m": identifies the'
            " inertia, too, where neither --inertia nor --rig gives it."
        ),
    ] = "",
    torque_uncertainty: Annotated[str, typer.Option(help='Standard deviation of the torque, e.g. "0.004 N m".')] = "",
    law: Annotated[str | None, typer.Option(help='Fit this law, e.g. "coulomb+viscous"; default: the best.')] = None,
    meshed: Annotated[list[Path] | None, typer.Option(help="Coast-down of both gears in mesh; repeatable.")] = None,
    drive_alone: Annotated[
        list[Path] | None, typer.Option(help="Coast-down of the drive gear alone; repeatable.")
    ] = None,
    rig: Annotated[
        Path | None,
        typer.Option(metavar="SCENARIO", help="Scenario of the test rig. Required with --meshed or without --inertia."),
    ] = None,
    begin: Begin = "",
    to: End = "",
    map_file: MapFile = None,
    correct: Correct = None,
    set_: RigOverrides = None,
    out: OutFolder = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Identify the drag from coast-downs out of mesh; for several assemblies from a campaign file (.toml).

    With --meshed and --drive-alone: the mesh drag, in addition to the drag of each gear alone.

    Example: gears3d identify coastdown coastdown.parquet --inertia "0.0695 kg m^2" --plot drag.png

    Drag and inertia from spin-ups and coast-downs: gears3d identify coastdown record.toml --torque "0.2 N m"
    """
    from gears3d import identify as ident
    from gears3d.errors import UsageError

    span, bench = span_of(begin, to), load_rig(rig, set_)
    inputs: list[str | Path | None] = [*(file for file in files if file.suffix == ".toml"), map_file, rig]
    push = _quantity(torque, "torque", "--torque") if torque else 0.0
    doubt = _quantity(torque_uncertainty, "torque", "--torque-uncertainty") if torque_uncertainty else 0.0
    if torque_uncertainty and not torque:
        raise UsageError("--torque-uncertainty needs --torque")
    read = partial(_tracks, map_file=map_file, correct=correct, inputs=inputs, span=span)
    if [file for file in files if file.suffix == ".toml" and ident.is_campaign(file)]:
        if len(files) > 1 or inertia or law or meshed or drive_alone or torque:
            raise UsageError("a campaign file contains inertias and laws: omit the other options")
        campaign = ident.read_campaign(files[0], read)
        found = ident.identify_assemblies(*campaign)
    elif meshed or drive_alone:
        if torque:
            raise UsageError("--torque goes with coast-downs of one gear alone: omit --meshed and --drive-alone")
        found = _mesh(files, drive_alone or [], meshed or [], bench, read)
    else:
        known = (None, 0.0) if torque and not inertia and rig is None else _inertia(inertia, inertia_uncertainty, bench)
        tracks = read(files, "loose", torque=push)
        found = ident.identify_coastdown(tracks, *known, law=law, torque=push, torque_uncertainty=doubt)
    answer(found, out, plot, as_json, inputs)


def _tracks(
    files: Sequence[Path],
    gear: str,
    map_file: Path | None,
    correct: list[str] | None,
    inputs: list[str | Path | None],
    span: tuple[float | None, float | None],
    torque: float = 0.0,
) -> list[Track]:
    """Return coast-downs that passed the sensor gate; print its findings and which files are excluded."""
    from gears3d.cli.output import show_findings, show_repeated
    from gears3d.identify import read_tracks

    tracks = read_tracks(files, gear, map_file, correct or (), show_repeated, span, torque)
    inputs += [track.file for track in tracks]
    for track in tracks:
        show_findings(track.findings, track.file, quiet=True)
    return tracks


def _mesh(
    loose: list[Path],
    drive: list[Path],
    meshed: list[Path],
    scenario: Scenario | None,
    read: Callable[[Sequence[Path], str], list[Track]],
) -> Identified:
    from gears3d import identify as ident
    from gears3d.errors import Fault, InputError, UsageError

    if scenario is None:
        raise UsageError("Missing option '--rig': mesh drag needs both inertias and both base radii")
    constants = scenario.rig()

    def inertia(gear: str) -> Inertia:
        value = getattr(scenario.gears, gear).inertia
        if value is None:
            remedy = "give the inertia of the drive and of all that turns with it when it coasts"
            raise InputError(Fault(f"gears.{gear}.inertia", "is missing", remedy, str(scenario.path or "")))
        return ident.Inertia(value, scenario.uncertainty.get(f"gears.{gear}.inertia", 0.0))

    return ident.identify_mesh_drag(
        read(loose, "loose"),
        read(drive, "drive"),
        read(meshed, "loose"),
        (inertia("loose"), inertia("drive")),
        constants.base_radius_loose / constants.base_radius_drive,
    )


def _quantity(text: str, family: str, key: str) -> float:
    """Return an inertia or torque in SI; a standard deviation may be 0."""
    from gears3d.errors import Fault, InputError
    from gears3d.units import parse

    try:
        value = parse(text, family)
    except InputError as error:
        raise InputError([Fault(key, fault.message, fault.remedy) for fault in error.faults]) from None
    if value < 0.0 or (value == 0.0 and not key.endswith("uncertainty")):
        raise InputError(Fault(key, f"is {text!r}", f"give a positive {family}"))
    return value


def _inertia(inertia: str, uncertainty: str, scenario: Scenario | None) -> tuple[float, float]:
    from gears3d.errors import UsageError

    spread = _quantity(uncertainty, "inertia", "--inertia-uncertainty") if uncertainty else 0.0
    if inertia:
        return _quantity(inertia, "inertia", "--inertia"), spread
    if scenario is None:
        reason = "a coast-down determines only the ratio of drag and inertia"
        raise UsageError(f"Missing option '--inertia' or '--rig': {reason}; e.g. --inertia \"0.0695 kg m^2\"")
    return scenario.rig().inertia, spread or scenario.uncertainty.get("gears.loose.inertia", 0.0)
