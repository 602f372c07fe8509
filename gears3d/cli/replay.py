"""``gears3d replay``: a run in the rerun viewer, or several side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import Correct, MapFile, Rig, RigOverrides, load_rig, to_file

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

# First bytes of a rerun recording.
_MAGIC = b"RRF"


def replay(
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="RUN|RECORD...", help="Run folder, an rrd file, or with --rig a measured record."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write; default RUN/replay.rrd or RECORD.rrd, for several replay.rrd.", callback=to_file()
        ),
    ] = None,
    web: Annotated[bool, typer.Option("--web", help="Show it in the browser instead of a window.")] = False,
    at: Annotated[float | None, typer.Option(help="Time of the cursor in s; the replay starts paused there.")] = None,
    tour: Annotated[
        bool, typer.Option("--tour", help="One period in slow motion with captions; --out may end in .mp4 or .gif.")
    ] = False,
    open_: Annotated[bool, typer.Option("--open/--no-open", help="Open the viewer.")] = True,
    rig: Rig = None,
    map_file: MapFile = None,
    correct: Correct = None,
    set_: RigOverrides = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print a summary as JSON.")] = False,
) -> None:
    """Make the replay of a run or of a measured record and open it in the rerun viewer; that of a run is made once.

    Two to four are shown side by side on one time line. Without a display a picture is written next to the replay.

    Example: gears3d replay runs/fig5-20rpm --at 2.115

    Measured record: gears3d replay rattle.parquet --rig rigaud-2020/fig5-20rpm --out rattle.rrd

    Film of one period with captions: gears3d replay runs/fig5-20rpm --tour --out tour.gif

    Record and run: gears3d replay rattle.parquet runs/fig5-20rpm --rig rigaud-2020/fig5-20rpm --out both.rrd
    """
    from gears3d.errors import UsageError

    if web and at is not None:
        raise UsageError("--at works in the window only: omit --web, or set the time in the browser")
    bench = load_rig(rig, set_)
    if tour:
        file = _tour(runs, bench, map_file, correct, out, at)
    elif len(runs) > 1:
        file = _several(runs, bench, map_file, correct, out, at)
    elif bench is not None:
        file = _measured(runs[0], bench, map_file, correct, out, at)
    elif runs[0].is_file() and runs[0].suffix != ".rrd":
        raise UsageError(f"Missing option '--rig': {runs[0]} is a measured record, give the scenario of its test rig")
    else:
        if at is not None:
            _inside(runs[0], at)
        file = _file(runs[0], out)
    made: dict[str, Any] = {"replay": str(file), "bytes": file.stat().st_size, "picture": None}
    if open_ and file.suffix == ".rrd":
        made["picture"] = _open(file, web, at)
    if as_json:
        from gears3d.cli.output import print_json

        print_json(made)
    else:
        typer.echo(f"replay   {file}")
        if made["picture"]:
            typer.echo(f"picture  {made['picture']}")


def _file(run: Path, out: Path | None) -> Path:
    """Return the replay: an existing one, or a new one where --out is given or none exists."""
    if run.suffix == ".rrd":
        from gears3d.errors import Fault, InputError

        if not run.is_file():
            raise InputError(Fault("", "does not exist", "name a run folder or an rrd file", str(run)))
        with run.open("rb") as file:
            if file.read(3) != _MAGIC:
                raise InputError(Fault("", "is not a rerun recording", "name a run folder or an rrd file", str(run)))
        if out is not None:
            raise InputError(Fault("--out", f"{run} is already a replay", "name its run folder to make another"))
        return run
    there = run / "replay.rrd"
    if out is None and there.is_file():
        return there
    from gears3d.views.replay import replay as write

    return write(run, out=out or there)


def _measured(
    source: Path,
    rig: Scenario | None,
    map_file: Path | None,
    correct: list[str] | None,
    out: Path | None,
    at: float | None,
) -> Path:
    """Return the new replay of a measured record."""
    from gears3d.cli.filmed import filmed
    from gears3d.views.replay import replay as write

    seen = filmed(source, rig, map_file, correct)
    if at is not None:
        _within(seen.recording.time, at, source)
    return write(seen.recording, seen.scenario, out=out or _default_file(source))


def _several(
    sources: list[Path],
    rig: Scenario | None,
    map_file: Path | None,
    correct: list[str] | None,
    out: Path | None,
    at: float | None,
) -> Path:
    """Return the replay of several side by side; records are measured with the rig."""
    from gears3d.cli.filmed import filmed
    from gears3d.errors import Fault, InputError
    from gears3d.views.replay.document import Shown, several

    shown = []
    for source in sources:
        if source.suffix == ".rrd":
            raise InputError(
                Fault("", "is already a replay", "name its run folder to show it with others", str(source))
            )
        is_run = (source / "summary.json").is_file()
        seen = filmed(source, None if is_run else rig, map_file, correct)
        shown.append(Shown(source.name if is_run else source.stem, seen.recording, seen.scenario))
    if at is not None:
        _within(max((one.recording.time for one in shown), key=lambda time: time[-1]), at, sources[0])
    return several(shown, out or Path("replay.rrd"))


def _tour(
    sources: list[Path],
    rig: Scenario | None,
    map_file: Path | None,
    correct: list[str] | None,
    out: Path | None,
    at: float | None,
) -> Path:
    """Return the new tour of one recording."""
    from gears3d.cli.filmed import filmed
    from gears3d.cli.progress import bars
    from gears3d.errors import UsageError
    from gears3d.views.camera import measured, subject
    from gears3d.views.replay.document import write_tour_of

    if len(sources) > 1 or sources[0].suffix == ".rrd":
        raise UsageError("--tour shows one recording: name one run folder, or a measured record with --rig")
    if at is not None:
        raise UsageError("--tour chooses its period: omit --at")
    seen = filmed(sources[0], rig, map_file, correct)
    found = subject(seen.recording, seen.scenario)
    if seen.measurement is not None:
        found = measured(seen.measurement, seen.scenario)
    with bars() as track:
        return write_tour_of(found, seen.scenario, out or Path("tour.rrd"), track("tour", 800.0))


def _default_file(source: Path) -> Path:
    return source / "replay.rrd" if source.is_dir() else source.with_suffix(".rrd")


def _within(time: Any, at: float, source: Path) -> None:
    from gears3d.errors import Fault, InputError

    if len(time) and not time[0] <= at <= time[-1]:
        remedy = f"give {time[0]:.6g} to {time[-1]:.6g} s"
        what = "run" if (source / "scenario.toml").is_file() else "record"
        raise InputError(Fault("--at", f"is {at:.6g} s, outside the {what}", remedy, str(source)))


def _inside(run: Path, at: float) -> None:
    """Refuse a time outside the run; the time span of an rrd file is unknown."""
    from gears3d.errors import Fault, InputError

    if run.is_dir():
        from gears3d.runs import read_run

        _within(read_run(run).recording.time, at, run)
    elif at < 0:
        raise InputError(Fault("--at", f"is {at:.6g} s, before the recording", "give 0 s or more", str(run)))


def _open(file: Path, web: bool, at: float | None) -> str | None:
    """Open the viewer; without a display, write a picture and return it."""
    from gears3d.views.replay import viewer

    if web:
        viewer.serve(file, _browse)
        return None
    if viewer.has_display():
        viewer.show(file, at)
        return None
    typer.echo("no display: open the file on a machine with one (`rerun FILE`), or use --web", err=True)
    picture = file.with_suffix(".png")
    picture.write_bytes(viewer.snapshot(file, at))
    return str(picture)


def _browse(address: str) -> None:
    """Print the address of the replay, and open a browser if there is a display."""
    import os
    import webbrowser

    from gears3d.views.replay import viewer

    typer.echo(f"serving the replay to this machine's browsers, Ctrl-C ends: {address}", err=True)
    if viewer.has_display() or os.environ.get("BROWSER"):
        webbrowser.open(address)
