"""``gears3d replay``: watch a run in the rerun viewer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

_MAGIC = b"RRF"
"""What a rerun recording begins with."""


def replay(
    run: Annotated[Path, typer.Argument(help="Run folder, or an rrd file.")],
    out: Annotated[Path | None, typer.Option(help="File to write; default RUN/replay.rrd.")] = None,
    web: Annotated[bool, typer.Option("--web", help="Show it in the browser instead of a window.")] = False,
    at: Annotated[float | None, typer.Option(help="Put the time cursor there, in seconds, and hold.")] = None,
    open_: Annotated[bool, typer.Option("--open/--no-open", help="Open the viewer.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was made as JSON.")] = False,
) -> None:
    """Make the replay of a run if it is not there and open it in the rerun viewer.

    Without a display it writes a picture beside the replay instead.

    Example: gears3d replay runs/fig5-20rpm --at 2.115
    """
    from gears3d.errors import UsageError

    if web and at is not None:
        raise UsageError("--at works in the window only: leave out --web, or set the time in the browser")
    if at is not None:
        _inside(run, at)
    file = _file(run, out)
    made: dict[str, Any] = {"replay": str(file), "bytes": file.stat().st_size, "picture": None}
    if open_:
        made["picture"] = _open(file, web, at)
    if as_json:
        from gears3d.cli.output import print_json

        print_json(made)
    else:
        typer.echo(f"replay   {file}")
        if made["picture"]:
            typer.echo(f"picture  {made['picture']}")


def _file(run: Path, out: Path | None) -> Path:
    """Return the replay: the one that is there, or a new one where asked for or where there is none."""
    if run.suffix == ".rrd":
        from gears3d.errors import Fault, InputError

        if not run.is_file():
            raise InputError(Fault("", "is not there", "name a run folder or an rrd file", str(run)))
        with run.open("rb") as file:
            if file.read(3) != _MAGIC:
                raise InputError(Fault("", "is no rerun recording", "name a run folder or an rrd file", str(run)))
        if out is not None:
            raise InputError(Fault("--out", f"{run} is a replay already", "name its run folder to make another"))
        return run
    there = run / "replay.rrd"
    if out is None and there.is_file():
        return there
    from gears3d.views.replay import replay as write

    return write(run, out=out or there)


def _inside(run: Path, at: float) -> None:
    """Refuse a time that the run does not hold; what a bare rrd file holds is not known."""
    from gears3d.errors import Fault, InputError

    if run.is_dir():
        from gears3d.runs import read_run

        time = read_run(run).recording.time
        if len(time) and not time[0] <= at <= time[-1]:
            remedy = f"give {time[0]:.6g} to {time[-1]:.6g} s"
            raise InputError(Fault("--at", f"is {at:.6g} s, outside the run", remedy, str(run)))
    elif at < 0:
        raise InputError(Fault("--at", f"is {at:.6g} s, before the recording", "give 0 s or more", str(run)))


def _open(file: Path, web: bool, at: float | None) -> str | None:
    """Open the viewer; return the picture that was made in its place where there is no display."""
    from gears3d.views.replay import viewer

    if web:
        typer.echo("serving the replay to this machine's browsers; Ctrl-C ends", err=True)
        viewer.serve(file)
        return None
    if viewer.has_display():
        viewer.show(file, at)
        return None
    typer.echo("no display here: open the file where there is one (`rerun FILE`), or use --web", err=True)
    picture = file.with_suffix(".png")
    picture.write_bytes(viewer.snapshot(file, at))
    return str(picture)
