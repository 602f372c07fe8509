"""``gears3d camera``: the mesh as a high-speed camera sees it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from gears3d.views.camera import Look, Shot, Subject


def camera(
    source: Annotated[Path, typer.Argument(metavar="RUN|RECORD", help="Run folder, or a measured record.")],
    out: Annotated[Path, typer.Option(help="Picture to write (.png, .svg, .pdf).")] = Path("strip.png"),
    frames: Annotated[int, typer.Option(min=1, max=60, help="Pictures, first and last included.")] = 9,
    over: Annotated[
        str, typer.Option(metavar="SPAN", help='period, mesh, revolution, "2 periods" or "20 ms".')
    ] = "period",
    at: Annotated[
        str | None, typer.Option(metavar="TIME", help='First picture, e.g. "1.5 s"; default amid an active contact.')
    ] = None,
    zoom: Annotated[str, typer.Option(help="mesh, tooth or gears.")] = "mesh",
    exaggerate: Annotated[str, typer.Option(metavar="FACTOR", help="Drawn gap over gap, 1 is true scale.")] = "auto",
    backlit: Annotated[bool, typer.Option("--backlit", help="Dark gears before a light, no colours.")] = False,
    drive: Annotated[str, typer.Option(help="Side of the drive gear: left or right.")] = "left",
    numbers: Annotated[str, typer.Option(help="pairs, from the first picture on, or teeth of each gear.")] = "pairs",
    video: Annotated[Path | None, typer.Option(help="Film to write too (.mp4) of the same span.")] = None,
    rate: Annotated[float, typer.Option(min=1.0, help="Frames a second that the film is taken with.")] = 3200.0,
    slow: Annotated[
        float | None, typer.Option(help="Times slower that it is shown; default: 25 frames a second.")
    ] = None,
    rig: Annotated[Path | None, typer.Option(help="Scenario of the bench, for measured records.")] = None,
    map_file: Annotated[Path | None, typer.Option("--map", help="record.toml that says what the channels are.")] = None,
    correct: Annotated[
        list[str] | None, typer.Option(metavar="KIND,...", help="Faults of sensors and clock to correct.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what the pictures show as JSON.")] = False,
) -> None:
    """Draw the teeth in mesh in pictures over a period, from a run or from a measured record.

    Example: gears3d camera runs/fig5-20rpm --out strip.png

    A film of a period: gears3d camera runs/fig5-20rpm --video rattle.mp4 --rate 3200 --slow 128

    Like the camera of a bench: gears3d camera rattle.parquet --rig rig.toml --backlit --drive right --exaggerate 1
    """
    from gears3d.views.camera import Look, shots, write_strip

    _refuse_words(drive=(drive, ("left", "right")), numbers=(numbers, ("pairs", "teeth")))
    subject = _subject(source, rig, map_file, correct or [])
    look = Look(subject.pair, _factor(exaggerate), zoom, backlit, drive == "right", numbers == "teeth")
    lasts, periods = _span(over, subject, "--over")
    start = subject.begin(lasts) if at is None else _span(at, subject, "--at")[0]
    pictures = shots(subject, frames, start, lasts)
    write_strip(out, subject, look, pictures, periods)
    film = None if video is None else _film(video, subject, look, (start, lasts), rate, slow)
    if as_json:
        from gears3d.cli.output import print_json

        print_json({**_found(out, subject, look, pictures), "film": film})
    else:
        _show(out, subject, look, pictures)
        if film is not None:
            told = f"{film['frames']} frames, {rate:g} a second slowed {film['slowed']:g} times"
            typer.echo(f"film written to {video}: {told}")


def _film(
    path: Path, subject: Subject, look: Look, span: tuple[float, float], rate: float, slow: float | None
) -> dict[str, Any]:
    from gears3d.cli.progress import bars
    from gears3d.views.camera import write_film

    with bars() as track:
        return write_film(path, subject, look, span, rate, slow, track("film", span[1] * rate))


def _refuse_words(**options: tuple[str, tuple[str, ...]]) -> None:
    from gears3d.errors import UsageError, did_you_mean

    for name, (word, known) in options.items():
        if word not in known:
            raise UsageError(f"--{name} is {word!r}; {did_you_mean(word, known)}")


def _subject(source: Path, rig: Path | None, map_file: Path | None, correct: list[str]) -> Subject:
    from gears3d.cli.filmed import filmed
    from gears3d.views.camera import measured, subject

    seen = filmed(source, rig, map_file, correct)
    if seen.measurement is not None:
        return measured(seen.measurement, seen.scenario)
    return subject(seen.recording, seen.scenario)


def _factor(text: str) -> float | None:
    from gears3d.errors import Fault, InputError

    if text == "auto":
        return None
    try:
        return float(text.rstrip("x×"))
    except ValueError:
        raise InputError(Fault("--exaggerate", f"is {text!r}", "give auto, or a number such as 5")) from None


def _span(text: str, subject: Subject, option: str) -> tuple[float, float | None]:
    """Return a time [s] and, where it is one in periods, how many."""
    from gears3d.errors import Fault, InputError
    from gears3d.units import parse

    turn = subject.revolution
    known = {"period": subject.period, "revolution": turn, "mesh": turn / subject.pair.drive.teeth}
    number, _, word = text.strip().partition(" ") if " " in text.strip() else ("1", "", text.strip())
    singular = word.strip().removesuffix("es" if word.strip() == "meshes" else "s")
    if singular in known:
        try:
            count = float(number)
        except ValueError:
            raise InputError(Fault(option, f"is {text!r}", 'give e.g. "2 periods"')) from None
        return count * known[singular], count if singular == "period" else None
    try:
        return parse(text, "time"), None
    except InputError as error:
        remedy = 'give a time such as "20 ms", or "2 periods", "1 mesh", "1 revolution"'
        raise InputError([Fault(option, fault.message, remedy) for fault in error.faults]) from None


def _found(out: Path, subject: Subject, look: Look, pictures: tuple[Shot, ...]) -> dict[str, Any]:
    from gears3d.views.camera.shots import table

    return {
        "picture": str(out),
        "start_s": pictures[0].time,
        "period_s": subject.period,
        "backlash_m": subject.pair.backlash,
        "exaggeration": look.factor,
        "teeth_placed": subject.placed,
        "frames": [table(subject, shot) for shot in pictures],
    }


def _show(out: Path, subject: Subject, look: Look, pictures: tuple[Shot, ...]) -> None:
    from rich.console import Console
    from rich.table import Table

    from gears3d.views.camera.shots import WORDS, told

    rows = Table(box=None, padding=(0, 2, 0, 0))
    for name in ("time [s]", "pairs", "shows", "gaps [µm]"):
        rows.add_column(name, justify="left" if name == "shows" else "right")
    for shot in pictures:
        gaps = " + ".join(f"{1e6 * gap:.4g}" for gap in shot.gaps) if shot.flank < 0 else ""
        rows.add_row(f"{shot.time:.6g}", told(shot.pairs), WORDS[shot.flank], gaps)
    Console(highlight=False).print(rows)
    if not subject.placed:
        typer.echo(
            "the record does not tell where its teeth stand: tooth 1 is taken to begin at the pitch point", err=True
        )
    typer.echo(f"gap drawn {look.factor:g} times as wide; picture written to {out}")
