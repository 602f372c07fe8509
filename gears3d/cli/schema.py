"""``gears3d schema``: the JSON Schema of the scenario format."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated

import typer


def schema(
    out: Annotated[Path | None, typer.Option(help="File to write; default: print.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="With --out: print the file's name as JSON.")] = False,
) -> None:
    """Print the JSON Schema of scenario format 1, effects included, for editors that complete and check.

    Example: gears3d schema --out gears3d.schema.json
    """
    from gears3d.cli.output import print_json
    from gears3d.scenario import schema as make

    if out is None:
        print_json(make())
        return
    _write(out, json.dumps(make(), indent=2) + "\n")
    if as_json:
        print_json({"schema": str(out)})
    else:
        typer.echo(str(out))


def _write(out: Path, text: str) -> None:
    """Write under a temporary name and rename."""
    from gears3d.errors import Fault, InputError

    temporary = out.with_name(f".{out.name}.{os.getpid()}")
    try:
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(out)
    except OSError as why:
        temporary.unlink(missing_ok=True) if temporary.parent.is_dir() else None
        raise InputError(
            Fault("--out", f"cannot be written: {why.strerror}", "choose another place", str(out))
        ) from why
