"""``gears3d bundle``: a result folder as one archive to hand to a colleague."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gears3d.cli.options import to_file


def bundle(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Result folder, which --out DIR of a verb wrote.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Archive to write; default DIR.zip here.", callback=to_file(".zip")),
    ] = None,
    replay: Annotated[bool, typer.Option("--replay", help="Include replays (.rrd).")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the content of the archive as JSON.")] = False,
) -> None:
    """Pack a result folder into one zip: report, JSON, data, scenario, and a manifest with hashes and version.

    Example: gears3d bundle runs/fig5-20rpm --out fig5.zip
    """
    from gears3d.runs import bundle as pack

    made = pack(folder, out, replay)
    if as_json:
        from gears3d.cli.output import print_json

        print_json(made.to_dict())
        return
    for one in made.files:
        typer.echo(f"{_size(one['bytes']):>9}  {one['file']}")
    for name in made.excluded:
        typer.echo(f" excluded  {name}{': --replay includes it' if name.endswith('.rrd') else ''}")
    typer.echo(f"{made.path}: {len(made.files)} files and MANIFEST.json, {_size(made.bytes)}")


def _size(count: int) -> str:
    for unit, factor in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= factor:
            return f"{count / factor:.3g} {unit}"
    return f"{count} B"
