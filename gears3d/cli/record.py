"""``gears3d record``: what encoders would have recorded of a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def record(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML).")],
    out: Annotated[Path, typer.Option(help="File to write: .parquet or .csv.")],
    test: Annotated[str, typer.Option(help="rattle: the scenario; rundown: the loose gear out of mesh.")] = "rattle",
    model: Annotated[str, typer.Option(help="Of the rattle test: rigid or bullet.")] = "rigid",
    seed: Annotated[int | None, typer.Option(help="Of the encoders' noise; default the scenario's.")] = None,
    speed: Annotated[str | None, typer.Option(help='Start of a run-down, e.g. "300 rpm".')] = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a value; repeatable.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was written as JSON.")] = False,
) -> None:
    """Record a scenario as a test bench would: two encoders with their counts, rate, noise and errors.

    Example: gears3d record scenarios/rigaud-2020/fig5-20rpm.toml --out rattle.parquet --seed 7
    """
    from gears3d.cli.progress import bars
    from gears3d.errors import Fault, InputError
    from gears3d.scenario import load
    from gears3d.simulation import record as take

    if out.suffix not in (".parquet", ".csv"):
        raise InputError(Fault("--out", f"is {out}", "give a file that ends in .parquet or .csv"))
    question = load(scenario, overrides=set_ or [])
    start = None if speed is None else _start(speed)
    with bars() as track:
        made = take(question, test, model=model, seed=seed, speed=start, progress=track(test, question.run.duration))
    made.write(out)
    about = {"record": str(out), "samples": len(made.time), "bytes": out.stat().st_size, **made.meta["encoders"]}
    if as_json:
        from gears3d.cli.output import print_json

        print_json(about)
    else:
        typer.echo(f"record   {out}: {len(made.time)} samples of {made.time[-1]:.6g} s")


def _start(text: str) -> float:
    from gears3d.errors import Fault, InputError
    from gears3d.units import parse

    try:
        speed = parse(text, "speed")
    except InputError as error:
        raise InputError([Fault("--speed", fault.message, fault.remedy) for fault in error.faults]) from None
    if speed == 0.0:
        raise InputError(Fault("--speed", "is 0: nothing runs down", "give the speed that the gear starts with"))
    return speed
