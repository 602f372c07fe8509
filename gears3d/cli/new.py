"""``gears3d new``: a scenario to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the scenario; NAME.toml is written.")],
    kind: Annotated[str, typer.Option(help="rattle, helical, or bench for the rig of measured records.")] = "rattle",
    as_json: Annotated[bool, typer.Option("--json", help="Print what was made as JSON.")] = False,
) -> None:
    """Write a commented scenario to start from; a file that is there is never overwritten.

    Example: gears3d new first --kind rattle
    """
    from gears3d.errors import Fault, InputError, UsageError
    from gears3d.scenario.starting import starter

    file = Path(name if name.endswith(".toml") else f"{name}.toml")
    stem = file.name.removesuffix(".toml")
    if not stem.strip() or any(sign in stem for sign in '"\\\n'):
        raise UsageError(f"{name!r} is no name for a file")
    text = starter(kind, stem)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with file.open("x", encoding="utf-8") as made:
            made.write(text)
    except FileExistsError as error:
        raise InputError(Fault("", "is there already", "take another name", str(file))) from error
    except OSError as error:
        raise InputError(Fault("", f"cannot be written: {error.strerror}", "name another place", str(file))) from error
    then = [f"gears3d excitation {file}", f"gears3d run {file} --out runs/{stem}"]
    if kind == "bench":
        then = [f"gears3d measure FILE --guess --rig {file} --out record.toml"]
    if as_json:
        from gears3d.cli.output import print_json

        print_json({"scenario": str(file), "kind": kind, "next": then})
        return
    typer.echo(f"written to {file}; then: {' and '.join(then)}")
