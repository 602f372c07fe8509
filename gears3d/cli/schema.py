"""``gears3d schema``: the JSON Schema of the scenario format."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from gears3d.cli.options import to_file


def schema(
    out: Annotated[Path | None, typer.Option(help="File to write; default: print.", callback=to_file())] = None,
    as_json: Annotated[bool, typer.Option("--json", help="With --out: print the file's name as JSON.")] = False,
) -> None:
    """Print the JSON Schema of scenario format 1, effects included, for editors that complete and check.

    Example: gears3d schema --out gears3d.schema.json
    """
    from gears3d.cli.output import print_json
    from gears3d.files import write_text
    from gears3d.scenario import schema as make

    if out is None:
        print_json(make())
        return
    write_text(out, json.dumps(make(), indent=2) + "\n")
    if as_json:
        print_json({"schema": str(out)})
    else:
        typer.echo(str(out))
