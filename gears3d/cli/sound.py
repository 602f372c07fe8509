"""``gears3d sound``: the impacts of a run as a WAV file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import choice, to_file

if TYPE_CHECKING:
    from gears3d.signals.sound import Mode


def sound(
    run: Annotated[Path, typer.Argument(help="Run folder, or a folder with signals.parquet and impacts.parquet.")],
    out: Annotated[Path, typer.Option(help="The WAV file.", callback=to_file(".wav"))] = Path("rattle.wav"),
    slow: Annotated[float, typer.Option(help="Slow-motion factor; the bursts keep their pitch.")] = 1.0,
    rate: Annotated[int, typer.Option(metavar="44100|48000", help="Sampling rate in Hz.")] = 48_000,
    by: Annotated[str, choice("Scale of a burst; default impulse where known.", "impulse", "energy", "velocity")] = "",
    stereo: Annotated[bool, typer.Option("--stereo", help="Active flank left, reverse flank right.")] = False,
    mode: Annotated[
        list[str] | None,
        typer.Option(metavar="HZ,MS,WEIGHT", help="Structural mode: frequency, decay, weight; repeatable."),
    ] = None,
    constant: Annotated[
        float | None, typer.Option(help="A of the rattle level 10 log10(A w^2 dOmega), of your test rig, s^3/rad^3.")
    ] = None,
    whine: Annotated[float, typer.Option(help="Level of the whine in dB, for the sum with --constant.")] = 78.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print numbers and levels as JSON.")] = False,
) -> None:
    """Write the impacts as a sound: each excites a few modes of a fictitious structure, scaled by its impulse.

    Example: gears3d sound runs/fig5-20rpm --out rattle.wav --slow 4 --stereo
    """
    from gears3d.errors import UsageError
    from gears3d.recording import read
    from gears3d.recording.sound import levels, write_wav
    from gears3d.signals.sound import MODES

    if constant is not None and not constant > 0.0:
        raise UsageError(f"--constant is {constant:g}: a number above 0")
    recording = read(run)
    modes = tuple(_mode(text) for text in mode) if mode else MODES
    done = write_wav(recording, out, slow=slow, rate=rate, by=by or None, stereo=stereo, modes=modes)
    loud = levels(recording, constant, whine)
    if as_json:
        from gears3d.cli.output import print_json

        print_json({**done, "levels": loud})
        return
    _show(done, loud)


def _mode(text: str) -> Mode:
    from gears3d.errors import UsageError
    from gears3d.signals.sound import Mode

    try:
        frequency, decay, weight = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"--mode {text!r}: give Hz, ms and weight, as in --mode 1150,12,1") from None
    return Mode(frequency, decay * 1e-3, weight)


def _show(done: dict[str, Any], loud: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, value in rows(done, loud):
        table.add_row(name, escape(value))
    console = Console(highlight=False)
    console.print(table)
    console.print(f"written to [bold]{escape(done['file'])}[/]", soft_wrap=True)


def rows(done: dict[str, Any], loud: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the table's lines as (name, value)."""
    pace = "real time" if done["slow"] == 1.0 else f"{done['slow']:g} times slower"
    bursts = ", ".join(f"{m['frequency_Hz']:g} Hz ({m['decay_s'] * 1e3:g} ms)" for m in done["modes"])
    lines = [
        ("sound", f"{done['duration_s']:.2f} s, {pace}, {done['impacts']} impacts"),
        ("modes of an impact", f"{bursts}: fictitious, not a measured structure"),
        ("scaled by", f"{done['by']}; full scale is {1 / done['full_scale_per_unit']:.3g} {done['unit']}")
        if done["full_scale_per_unit"]
        else ("scaled by", f"{done['by']}: silence"),
    ]
    if loud["energy_J_s"]:
        level = f"{loud['energy_level_dB']:.1f} dB re 1 pW"
        lines.append(
            ("power dissipated by impacts", f"{loud['energy_J_s'] * 1e3:.3g} mW ({level}); not all of it is radiated")
        )
    if loud["rattle_drive_level_dB"] is not None:
        lines.append(("10 log10(ω²ΔΩ)", f"{loud['rattle_drive_level_dB']:.1f} dB, plus a constant of the test rig"))
    if loud["total_level_dB"] is not None:
        parts = f"whine {loud['whine_level_dB']:.1f}, rattle {loud['rattle_level_dB']:.1f}"
        lines.append(("sound pressure level", f"{loud['total_level_dB']:.1f} dB re 20 µPa ({parts})"))
    return lines
