"""``gears3d synthesize``: a scenario as two encoders would record it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gears3d.cli.groups import warn_renamed
from gears3d.cli.options import MODELS, Overrides, ScenarioName, choice
from gears3d.errors import UsageError, did_you_mean
from gears3d.files import refuse_file
from gears3d.virtual_tests import RENAMED, SYNTHESIZED

if TYPE_CHECKING:
    from gears3d.scenario import Scenario


def _record_file(out: Path) -> Path:
    """Return the file of the record."""
    file = out if out.suffix else out / "record.parquet"
    refuse_file(file, (".parquet", ".csv"))
    return file


def _named(test: str) -> str:
    """Return the name of a test for an old one."""
    if test in RENAMED:
        warn_renamed(f"--test {test}", f"--test {RENAMED[test]}")
    elif test not in SYNTHESIZED:
        raise UsageError(f"--test: there is no test {test!r}; {did_you_mean(test, SYNTHESIZED)}")
    return RENAMED.get(test, test)


def synthesize(
    scenario: ScenarioName,
    out: Annotated[
        Path,
        typer.Option(help="Record to write: .parquet or .csv; or a folder for record.parquet.", callback=_record_file),
    ],
    test: Annotated[
        str,
        typer.Option(
            metavar="|".join(SYNTHESIZED), callback=_named, help="Test of the rig; gears3d list tests describes each."
        ),
    ] = "rattle",
    model: Annotated[str, choice("Model of the rattle test.", *MODELS)] = "rigid",
    seed: Annotated[int | None, typer.Option(help="Seed of the encoder noise; default: of the scenario.")] = None,
    speed: Annotated[
        str | None, typer.Option(help="Initial speed of a coast-down; drive speed of slow revolutions (1 rpm).")
    ] = None,
    turning: Annotated[
        str, choice("Coasting gear: loose or drive, out of mesh; both, in mesh.", "loose", "drive", "both")
    ] = "loose",
    drive_drag: Annotated[
        str | None, typer.Option(help='Coulomb drag of the coasting drive gear, e.g. "0.1 N m".')
    ] = None,
    drive_damping: Annotated[
        str | None, typer.Option(help='Viscous drag of the coasting drive gear, e.g. "5e-3 N m s/rad".')
    ] = None,
    amplitudes: Annotated[
        str | None, typer.Option(help='Speed amplitudes of a threshold test: "0.8 rpm..2.6 rpm"; default Λ = 0.5..1.6.')
    ] = None,
    turns: Annotated[float | None, typer.Option(help="Slow revolutions of the drive gear, each way.")] = None,
    set_: Overrides = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print a summary as JSON.")] = False,
) -> None:
    """Synthesize the record of a test rig: two encoders with their counts, rate, noise and errors.

    Example: gears3d synthesize rigaud-2020/fig5-20rpm --out rattle.parquet --seed 7

    Coast-down: gears3d synthesize rigaud-2020/fig5-20rpm --test coastdown --speed "60 rpm" --out coastdown.parquet

    Slow revolutions: gears3d synthesize rigaud-2020/fig2 --test transmission-error --out slow.parquet

    Threshold: gears3d synthesize rigaud-2020/fig5-20rpm --test threshold --set "run.duration=20 s" --out sweep.parquet
    """
    from gears3d.cli.progress import bars
    from gears3d.scenario import load
    from gears3d.simulation import synthesize as take

    question = load(scenario, overrides=set_ or [])
    how = {
        "speed": None if speed is None else _start(speed),
        "turning": turning,
        "amplitudes": None if amplitudes is None else _span(amplitudes),
        "drive_drag": (
            _quantity(drive_drag, "torque", "--drive-drag"),
            _quantity(drive_damping, "rotational_damping", "--drive-damping"),
        ),
    }
    with bars() as track:
        shown = track(test, _lasts(question, test, how["speed"], turns))
        made = take(question, test, model=model, seed=seed, turns=turns, progress=shown, **how)
    made.write(out)
    about = {"record": str(out), "samples": len(made.time), "bytes": out.stat().st_size, **made.meta["encoders"]}
    if as_json:
        from gears3d.cli.output import print_json

        print_json(about)
    else:
        typer.echo(f"record   {out}: {len(made.time)} samples of {made.time[-1]:.6g} s")


def _span(text: str) -> tuple[float, float]:
    from gears3d.errors import Fault, InputError

    low, dots, high = text.partition("..")
    if not dots:
        raise InputError(Fault("--amplitudes", f"is {text!r}", 'give two, e.g. "0.8 rpm..2.6 rpm"'))
    return _quantity(low.strip(), "speed", "--amplitudes"), _quantity(high.strip(), "speed", "--amplitudes")


def _lasts(question: Scenario, test: str, speed: float | None, turns: float | None) -> float:
    from math import pi

    from gears3d.simulation.recorder import SLOW, hunting

    return (
        question.run.duration
        if test != "transmission-error"
        else 4.0 * pi * (turns or hunting(question)) / (speed or SLOW)
    )


def _quantity(text: str | None, family: str, key: str) -> float:
    from gears3d.errors import Fault, InputError
    from gears3d.units import parse

    if text is None:
        return 0.0
    try:
        value = parse(text, family)
    except InputError as error:
        raise InputError([Fault(key, fault.message, fault.remedy) for fault in error.faults]) from None
    if value < 0.0:
        raise InputError(Fault(key, f"is {text}", "give a positive number"))
    return value


def _start(text: str) -> float:
    from gears3d.errors import Fault, InputError

    speed = _quantity(text.lstrip("-"), "speed", "--speed") * (-1.0 if text.startswith("-") else 1.0)
    if speed == 0.0:
        raise InputError(Fault("--speed", "is 0: nothing turns", "give another speed"))
    return speed
