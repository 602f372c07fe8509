"""``gears3d challenge``: hide an effect in synthetic records and seal the answer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def challenge(
    out: Annotated[Path, typer.Option(help="Folder to write.")],
    seed: Annotated[int | None, typer.Option(help="Draws the same challenge again; default: a new one.")] = None,
    effect: Annotated[
        list[str] | None, typer.Option(metavar="KIND", help="Kind to hide; repeatable. Default: the seed decides.")
    ] = None,
    none: Annotated[bool, typer.Option("--none", help="Hide nothing.")] = False,
    unknown: Annotated[bool, typer.Option("--unknown", help="Hide a cause outside the catalogue.")] = False,
    rig: Annotated[Path | None, typer.Option(help="Scenario of the bench; default: drawn.")] = None,
    size: Annotated[float | None, typer.Option(help="Of the effect, as a share of its unit size.")] = None,
    noise: Annotated[float | None, typer.Option(help="Of the encoders, as a share of the gap.")] = None,
    duration: Annotated[str | None, typer.Option(help='Of a record, e.g. "3 s".')] = None,
    records: Annotated[int, typer.Option(help="How many.", min=1, max=20)] = 5,
    zero: Annotated[
        str, typer.Option(metavar="common|arbitrary", help="Marks that encoders count from in all records, or in each.")
    ] = "common",
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a value of --rig; repeatable.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was written as JSON.")] = False,
) -> None:
    """Hide an effect, nothing, or something no catalogue has in records of a bench, and seal the answer.

    Example: gears3d challenge --seed 7 --out blind
    """
    import os

    from gears3d.challenge import hide, plan
    from gears3d.cli.progress import bars
    from gears3d.errors import UsageError
    from gears3d.scenario import load
    from gears3d.units import parse

    if sum(map(bool, (effect, none, unknown))) > 1:
        raise UsageError("give one of --effect, --none and --unknown")
    if set_ and rig is None:
        raise UsageError("--set changes the scenario of --rig, which is not given")
    for name, share in (("--size", size), ("--noise", noise)):
        if share is not None and not 0.0 <= share <= 10.0:
            raise UsageError(f"{name} is {share}: a share, e.g. 0.2")
    kinds = effect or (() if none else ("unknown",) if unknown else None)
    seed = int.from_bytes(os.urandom(6), "big") if seed is None else abs(seed)
    bench = None if rig is None else load(rig, overrides=set_ or [])
    length = None if duration is None else parse(duration, "time")
    made = plan(seed, kinds, rig=bench, size=size, noise=noise, duration=length, records=records, zero=zero)
    with bars() as track:
        about = hide(made, out, track)
    if as_json:
        from gears3d.cli.output import print_json

        print_json({"folder": str(out), **about})
    else:
        typer.echo(f"hidden   {out}: {len(about['records'])} records, rig.toml, record.toml")
        typer.echo(f"sealed   {out / 'answer.sealed'}  SHA-256 {about['answer_sha256'][:16]}…")
