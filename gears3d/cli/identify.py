"""``gears3d identify KIND``: laws from measured data.

To add a kind: write a typer-style function of its name (underscores for hyphens) and add the kind to a test of
``gears3d.virtual_tests``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import partial
from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gears3d.cli.groups import LazyGroup
from gears3d.cli.options import (
    Begin,
    Correct,
    End,
    MapFile,
    OutFolder,
    Plot,
    RequiredRig,
    Rig,
    RigOverrides,
    StatedMotion,
    command,
    from_stdin,
    keep,
    load_rig,
    places,
    span_of,
)
from gears3d.virtual_tests import LAWS as KINDS
from gears3d.virtual_tests import RENAMED

if TYPE_CHECKING:
    from collections.abc import Callable

    from gears3d.identify import Identified, Inertia, Track
    from gears3d.identify.restitution_list import ImpactList
    from gears3d.measured.checks import Admitted
    from gears3d.measured.readers import Signal, Source
    from gears3d.scenario import Scenario

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

    from gears3d.cli.output import print_warnings, residual_line

    print_warnings(found.warnings)
    table = Table(title=f"law: {found.law}", title_justify="left", box=None, padding=(0, 2, 0, 0))
    for column in ("", "value", "± (95 %)", "unit"):
        table.add_column(column, justify="left" if column in ("", "unit") else "right")
    for name, p in found.parameters.items():
        half = 0.5 * (p.high - p.low)
        digits = max(2 - floor(log10(half)), 0) if half > 0.0 else 6
        table.add_row(name, f"{p.value:.{min(digits, 12)}f}", f"{half:.2g}", p.unit)
    console = Console(highlight=False, emoji=False)
    console.print(table)
    if line := residual_line(found.goodness):
        console.print(line, soft_wrap=True)
        for one in found.goodness["coastdowns"][:10]:
            span = f"{one['from_s']:.6g} to {one['to_s']:.6g} s, {one['points']} points, measured: {one['measured']}"
            console.print(f"free phase: {escape(one['file'] or 'record')}: {span}", soft_wrap=True)
    if losses := found.goodness.get("held_out"):
        held = ", ".join(f"{law} {loss:.3g}" for law, loss in losses.items() if loss is not None)
        console.print(f"held-out loss (smaller is better): {held}", soft_wrap=True)
    console.print(f"\n{escape(found.snippet)}", end="", soft_wrap=True)


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

    Drag and inertia from spin-ups and coast-downs: gears3d identify coastdown spinups.csv --torque "0.2 N m"
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


def backlash(
    files: Files,
    rig: RequiredRig,
    map_file: MapFile = None,
    correct: Correct = None,
    begin: Begin = "",
    to: End = "",
    stated_motion: StatedMotion = False,
    set_: RigOverrides = None,
    out: OutFolder = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Identify the mean backlash and its orders from slow revolutions forward and back.

    Example: gears3d identify backlash slow.parquet --rig rigaud-2020/fig2 --plot backlash.png
    """
    from gears3d.identify import identify_backlash

    records = admitted(
        files, rig, map_file, correct, stated_motion=stated_motion, span=span_of(begin, to), overrides=set_
    )
    answer(identify_backlash(records), out, plot, as_json, inputs_of(records))


# A column whose name occurs again, as readers number it: another drop in the same table.
_REPEATED = re.compile(r"\s*\((\d+)\)$")
if TYPE_CHECKING:
    from gears3d.identify.restitution_list import ImpactList
    from gears3d.measured.readers import Signal, Source


def restitution(
    files: Files,
    rig: Rig = None,
    map_file: MapFile = None,
    correct: Correct = None,
    begin: Begin = "",
    to: End = "",
    stated_motion: StatedMotion = False,
    set_: RigOverrides = None,
    out: OutFolder = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Identify the law of restitution from rattle records of one rig: constant or linear in speed, flanks, scatter.

    Without --rig from lists of impacts: speeds before and after, times of bounces or heights of bounces.

    Example: gears3d identify restitution rattle.parquet --rig rigaud-2020/fig5-20rpm --plot e.png

    From a list: gears3d identify restitution bounces.csv
    """
    from gears3d.cli.progress import bars
    from gears3d.errors import UsageError
    from gears3d.identify import identify_restitution
    from gears3d.identify.restitution_list import identify_restitution_list
    from gears3d.measured.segmentation import measure

    if rig is None:
        load_rig(rig, set_)  # refuses --set alone
    if rig is None and map_file is None and (lists := _lists(files)):
        answer(identify_restitution_list(lists), out, plot, as_json, files)
        return
    if rig is None:
        from gears3d.identify.restitution_list import EXPECTED

        raise UsageError(f"Missing option '--rig' for rattle records; a list of impacts needs none, but {EXPECTED}")
    records = admitted(
        files, rig, map_file, correct, stated_motion=stated_motion, span=span_of(begin, to), overrides=set_
    )
    with bars() as track:
        found = [
            measure(one.recording, one.rig, one.file, track(f"measure {Path(one.file).name}", 1.0), motion=one.motion)
            for one in records
        ]
    bench = next(one.rig for one in records if one.rig is not None)
    law = identify_restitution(found, bench.rig())
    answer(law, out, plot, as_json, inputs_of(records))


def _lists(files: Sequence[Path]) -> list[ImpactList]:
    """Return the lists of impacts that the files are; none where one of them is a record."""
    from gears3d.measured.readers import open_source

    found: list[ImpactList] = []
    for path in files:
        if path.suffix.lower() == ".toml" or path.is_dir():
            return []
        source = open_source(path)
        groups: dict[tuple[str, str], list[Signal]] = {}
        for each in source.signals:
            if each.numeric:
                repeat = _REPEATED.search(each.bare)
                groups.setdefault((each.label.rpartition("/")[0], repeat[1] if repeat else ""), []).append(each)
        lists = [one for signals in groups.values() if (one := _list(source, signals)) is not None]
        if not lists:
            return []
        found += lists
    return found


def _list(source: Source, signals: Sequence[Signal]) -> ImpactList | None:
    """Return the list of impacts that the signals of a group are, in SI units."""
    from gears3d.errors import Fault, InputError
    from gears3d.identify.restitution_list import FAMILIES, list_of, roles_of
    from gears3d.measured.readers.unit import to_si
    from gears3d.recording.columns import unit_of
    from gears3d.units import parse_any

    names = [_REPEATED.sub("", each.bare) for each in signals]
    own = {role: signals[place] for role, place in roles_of(names).items()}
    if not own:
        return None
    columns, linear = {}, True
    loaded = source.load([each.name for each in own.values()], None)
    for role, signal in own.items():
        unit = signal.told_unit or _ending(signal.label) or unit_of(signal.label)
        factor = 1.0
        if unit and role in FAMILIES:
            try:
                if FAMILIES[role] == "time":
                    factor = to_si(unit, ("time",))[0]
                else:
                    families = ("speed", "velocity") if FAMILIES[role] == "speed" else ("length",)
                    factor, family = parse_any(f"1 {unit}", families)
                    linear = linear and family != "speed"
            except InputError as error:
                faults = [Fault(signal.name, one.message, one.remedy, source.file) for one in error.faults]
                raise InputError(faults) from error
        columns[role] = loaded[signal.name] * factor
    return list_of(columns, linear, source.file)


def _ending(name: str) -> str:
    """Return a unit that ends a name and that the contract does not have."""
    endings = {"_mm_s": "mm/s", "_mm": "mm", "_cm": "cm", "_ms": "ms"}
    return next((unit for end, unit in endings.items() if name.endswith(end)), "")


def threshold(
    files: Files,
    rig: RequiredRig,
    map_file: MapFile = None,
    correct: Correct = None,
    begin: Begin = "",
    to: End = "",
    stated_motion: StatedMotion = False,
    set_: RigOverrides = None,
    out: OutFolder = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Identify the excitation at contact loss from sweeps up and down, and the drag that follows from it.

    In a file the speed-fluctuation amplitude rises, falls or both, slowly; or it is constant, files in order of time.

    Example: gears3d identify threshold sweep.parquet --rig rigaud-2020/fig5-20rpm --plot threshold.png
    """
    from gears3d import identify as ident

    sweeps = []
    records = admitted(
        files, rig, map_file, correct, stated_motion=stated_motion, span=span_of(begin, to), overrides=set_
    )
    for record in records:
        assert record.rig is not None
        sweeps.append(ident.Sweep(record.recording, record.rig, record.file))
    answer(ident.identify_threshold(sweeps), out, plot, as_json, inputs_of(records))


def transmission_error(
    files: Files,
    rig: RequiredRig,
    map_file: MapFile = None,
    correct: Correct = None,
    begin: Begin = "",
    to: End = "",
    stated_motion: StatedMotion = False,
    set_: RigOverrides = None,
    out: OutFolder = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Identify the transmission error of both flanks, order by order, from slow revolutions forward and back.

    Example: gears3d identify transmission-error slow.parquet --rig rigaud-2020/fig2 --plot ste.png
    """
    from gears3d.identify import identify_transmission_error

    records = admitted(
        files, rig, map_file, correct, stated_motion=stated_motion, span=span_of(begin, to), overrides=set_
    )
    answer(identify_transmission_error(records), out, plot, as_json, inputs_of(records))


class _Kinds(LazyGroup):
    package, line, noun, single = "gears3d.cli.identify", "gears3d identify", "kind", True
    renamed = {"rundown": RENAMED["rundown"]}  # noqa: RUF012
    panels = {"Laws": KINDS}  # noqa: RUF012


app = typer.Typer(cls=_Kinds, name="identify", add_completion=False, no_args_is_help=True)


@app.callback()
def identify() -> None:
    """Identify a law from measurements: parameters with 95 % intervals and a snippet for a scenario.

    Every kind has a --help of its own and takes --out DIR, --plot PICTURE and --json.

    Example: gears3d identify coastdown coastdown.parquet --inertia "0.0695 kg m^2" --plot drag.png
    """
