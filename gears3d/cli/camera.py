"""``gears3d camera``: the mesh as in a high-speed recording."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import (
    Correct,
    MapFile,
    OutFolder,
    Rig,
    RigOverrides,
    choice,
    command,
    load_rig,
    places,
    to_file,
    to_picture,
)

if TYPE_CHECKING:
    from gears3d.scenario import Scenario
    from gears3d.views.camera import Strip


def camera(
    source: Annotated[Path, typer.Argument(metavar="RUN|RECORD", help="Run folder, or a measured record.")],
    out: OutFolder = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Picture to write (.png, .svg, .pdf); default strip.png.", callback=to_picture
        ),
    ] = None,
    frames: Annotated[int, typer.Option(min=1, max=60, help="Pictures, first and last included.")] = 9,
    over: Annotated[
        str, typer.Option(metavar="SPAN", help='period, mesh, revolution, "2 periods" or "20 ms".')
    ] = "period",
    at: Annotated[
        str | None,
        typer.Option(
            metavar="TIME", help='First picture, e.g. "1.5 s"; default: middle of a contact on the active flank.'
        ),
    ] = None,
    zoom: Annotated[str, choice("What fills a picture.", "mesh", "tooth", "gears")] = "mesh",
    exaggerate: Annotated[
        str, typer.Option(metavar="FACTOR", help="Ratio of the drawn gap to the true gap; 1 is true scale.")
    ] = "auto",
    backlit: Annotated[bool, typer.Option("--backlit", help="Dark gears on a light background, no colours.")] = False,
    drive: Annotated[str, choice("Side of the driving gear.", "left", "right")] = "left",
    numbers: Annotated[
        str, choice("Number tooth pairs from the first picture on, or the teeth of each gear.", "pairs", "teeth")
    ] = "pairs",
    video: Annotated[
        Path | None, typer.Option(help="Video to write as well (.mp4), of the same span.", callback=to_file(".mp4"))
    ] = None,
    rate: Annotated[float, typer.Option(min=1.0, help="Frame rate of the recording, 1/s.")] = 3200.0,
    slow: Annotated[
        float | None, typer.Option(help="Slow-motion factor of the playback; default: 25 frames per second.")
    ] = None,
    rig: Rig = None,
    map_file: MapFile = None,
    correct: Correct = None,
    set_: RigOverrides = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the content of the pictures as JSON.")] = False,
) -> None:
    """Draw the teeth in mesh in pictures over a period, from a run or from a measured record.

    Example: gears3d camera runs/fig5-20rpm --plot strip.png

    Video of a period: gears3d camera runs/fig5-20rpm --video rattle.mp4 --rate 3200 --slow 128

    Measured record: gears3d camera rattle.parquet --rig rigaud-2020/fig5-20rpm --backlit --drive right --exaggerate 1
    """
    taken = _taken(
        _seen(source, rig, map_file, correct or [], set_),
        frames=frames, over=over, at=at, zoom=zoom, exaggerate=_factor(exaggerate), backlit=backlit, drive=drive,
        numbers=numbers,
    )  # fmt: skip
    folder, picture = places(out, plot)
    if folder is None and picture is None:
        picture = Path("strip.png")
    if picture is not None:
        taken.save(picture)
    if folder is not None:
        taken.save(folder, command=command(), inputs=[source, rig])
    film = None if video is None else _film(video, taken, rate, slow)
    if as_json:
        from gears3d.cli.output import print_json

        print_json({**_found(picture, taken), "film": film})
    else:
        _show(picture, folder, taken)
        if film is not None:
            size = f"{film['frames']} frames at {rate:g} 1/s, played {film['slowed']:g} times slower"
            typer.echo(f"video written to {video}: {size}")


def _film(path: Path, taken: Strip, rate: float, slow: float | None) -> dict[str, Any]:
    from gears3d.cli.progress import bars
    from gears3d.views.camera import write_film

    with bars() as track:
        return write_film(path, taken.subject, taken.look, taken.span, rate, slow, track("video", taken.span[1] * rate))


def _seen(
    source: Path, rig: Path | None, map_file: Path | None, correct: list[str], overrides: list[str] | None
) -> tuple[Any, Scenario]:
    from gears3d.cli.filmed import filmed

    seen = filmed(source, load_rig(rig, overrides), map_file, correct)
    return seen.measurement or seen.recording, seen.scenario


def _taken(seen: tuple[Any, Scenario], **asked: Any) -> Strip:
    """Return the pictures; faults of options carry their names on the command line."""
    from gears3d.errors import InputError
    from gears3d.views.camera import camera as take

    try:
        return take(*seen, **asked)
    except InputError as error:
        raise InputError([replace(f, key=f"--{f.key}") if f.key in asked else f for f in error.faults]) from None


def _factor(text: str) -> float | None:
    from gears3d.errors import Fault, InputError

    if text == "auto":
        return None
    try:
        return float(text.rstrip("x×"))
    except ValueError:
        raise InputError(Fault("--exaggerate", f"is {text!r}", "give auto, or a number such as 5")) from None


def _found(picture: Path | None, taken: Strip) -> dict[str, Any]:
    return {"picture": None if picture is None else str(picture), **taken.to_dict()}


def _show(picture: Path | None, folder: Path | None, taken: Strip) -> None:
    from rich.console import Console
    from rich.table import Table

    from gears3d.views.camera.subject import told
    from gears3d.views.plots.section import WORDS

    rows = Table(box=None, padding=(0, 2, 0, 0))
    for name in ("time [s]", "pairs", "shows", "gaps [µm]"):
        rows.add_column(name, justify="left" if name == "shows" else "right")
    for shot in taken.shots:
        gaps = " + ".join(f"{1e6 * gap:.4g}" for gap in shot.gaps) if shot.flank < 0 else ""
        rows.add_row(f"{shot.time:.6g}", told(shot.pairs), WORDS[shot.flank], gaps)
    Console(highlight=False).print(rows)
    if not taken.subject.placed:
        typer.echo(
            "tooth positions are unknown in this record: tooth 1 is assumed to start at the pitch point", err=True
        )
    typer.echo(f"gap drawn {taken.look.factor:g} times its width")
    if picture is not None:
        typer.echo(f"picture written to {picture}")
    if folder is not None:
        typer.echo(f"report: {folder / 'report.html'}")
