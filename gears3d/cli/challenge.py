"""``gears3d challenge``: synthetic records with a hidden effect and a sealed answer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gears3d.cli.options import RigOverrides, choice, load_rig, to_folder


def challenge(
    out: Annotated[Path, typer.Option(help="Folder to write.", callback=to_folder)],
    seed: Annotated[
        int | None, typer.Option(help="Random seed; the same seed repeats the challenge. Default: a new one.")
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND",
            help="Effect to hide (gears3d list effects), not of another package; repeatable. Default: by the seed.",
        ),
    ] = None,
    none: Annotated[bool, typer.Option("--none", help="Hide no effect.")] = False,
    unknown: Annotated[bool, typer.Option("--unknown", help="Hide a cause outside the catalogue.")] = False,
    rig: Annotated[
        Path | None, typer.Option(metavar="SCENARIO", help="Scenario of the test rig; default: chosen by the seed.")
    ] = None,
    size: Annotated[float | None, typer.Option(help="Size of the effect, relative to its unit size.")] = None,
    noise: Annotated[float | None, typer.Option(help="Encoder noise, relative to the backlash.")] = None,
    duration: Annotated[str | None, typer.Option(help='Duration of a record, e.g. "3 s".')] = None,
    records: Annotated[int, typer.Option(help="Number of records.", min=1, max=20)] = 5,
    zero: Annotated[
        str,
        choice("Angular datum of the encoders: the same in all records, or arbitrary in each.", "common", "arbitrary"),
    ] = "common",
    set_: RigOverrides = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print a summary as JSON.")] = False,
) -> None:
    """Write records of a test rig with a hidden effect, none, or a cause outside the catalogue; seal the answer.

    Example: gears3d challenge --seed 7 --out blind
    """
    import os

    from gears3d.cli.progress import bars
    from gears3d.effects import catalogue
    from gears3d.errors import UsageError
    from gears3d.units import parse
    from gears3d.verification.challenge import ASKED, KINDS, hide, plan

    if sum(map(bool, (effect, none, unknown))) > 1:
        raise UsageError("give one of --effect, --none and --unknown")
    for kind in effect or ():
        if kind in catalogue() and kind not in (*KINDS, *ASKED):
            why = "is an effect of another package: the generator of a challenge has no equation for it"
            raise UsageError(f"--effect: {kind!r} {why}")
    for name, share in (("--size", size), ("--noise", noise)):
        if share is not None and not 0.0 <= share <= 10.0:
            raise UsageError(f"{name} is {share}: a share, e.g. 0.2")
    kinds = effect or (() if none else ("unknown",) if unknown else None)
    seed = int.from_bytes(os.urandom(6), "big") if seed is None else abs(seed)
    bench = load_rig(rig, set_)
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
