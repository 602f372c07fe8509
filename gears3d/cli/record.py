"""``gears3d record``: what encoders would have recorded of a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def record(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML).")],
    out: Annotated[Path, typer.Option(help="File to write: .parquet or .csv.")],
    test: Annotated[str, typer.Option(help="rattle: the scenario; rundown: gears that coast.")] = "rattle",
    model: Annotated[str, typer.Option(help="Of the rattle test: rigid or bullet.")] = "rigid",
    seed: Annotated[int | None, typer.Option(help="Of the encoders' noise; default the scenario's.")] = None,
    speed: Annotated[str | None, typer.Option(help='Start of a run-down, e.g. "300 rpm".')] = None,
    turning: Annotated[str, typer.Option(help="In a run-down: loose or drive, out of mesh; both, in mesh.")] = "loose",
    drive_drag: Annotated[str | None, typer.Option(help='Dry drag of the drive that coasts, e.g. "0.1 N m".')] = None,
    drive_damping: Annotated[str | None, typer.Option(help='Viscous drag of it, e.g. "5e-3 N m s/rad".')] = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a value; repeatable.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was written as JSON.")] = False,
) -> None:
    """Record a scenario as a test bench would: two encoders with their counts, rate, noise and errors.

    Example: gears3d record scenarios/rigaud-2020/fig5-20rpm.toml --out rattle.parquet --seed 7
    """
    from gears3d.cli.progress import bars
    from gears3d.errors import Fault, InputError, UsageError, did_you_mean
    from gears3d.scenario import load
    from gears3d.simulation import record as take

    if out.suffix not in (".parquet", ".csv"):
        raise InputError(Fault("--out", f"is {out}", "give a file that ends in .parquet or .csv"))
    question = load(scenario, overrides=set_ or [])
    start = None if speed is None else _start(speed)
    if turning not in ("loose", "drive", "both"):
        raise UsageError(f"--turning is {turning!r}; {did_you_mean(turning, ['loose', 'drive', 'both'])}")
    own = (
        _quantity(drive_drag, "torque", "--drive-drag"),
        _quantity(drive_damping, "rotational_damping", "--drive-damping"),
    )
    with bars() as track:
        shown = track(test, question.run.duration)
        made = take(
            question, test, model=model, seed=seed, speed=start, turning=turning, drive_drag=own, progress=shown
        )
    made.write(out)
    about = {"record": str(out), "samples": len(made.time), "bytes": out.stat().st_size, **made.meta["encoders"]}
    if as_json:
        from gears3d.cli.output import print_json

        print_json(about)
    else:
        typer.echo(f"record   {out}: {len(made.time)} samples of {made.time[-1]:.6g} s")


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
        raise InputError(Fault(key, f"is {text}", "a drag resists: give it as a positive number"))
    return value


def _start(text: str) -> float:
    from gears3d.errors import Fault, InputError

    speed = _quantity(text.lstrip("-"), "speed", "--speed") * (-1.0 if text.startswith("-") else 1.0)
    if speed == 0.0:
        raise InputError(Fault("--speed", "is 0: nothing runs down", "give the speed that the gear starts with"))
    return speed
