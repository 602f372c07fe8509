"""``gears3d new``: a scenario to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gears3d.cli.options import choice


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the scenario; NAME.toml is written.")],
    kind: Annotated[
        str, choice("Starter: a pair that rattles (default), a helical pair, a test rig.", "rattle", "helical", "bench")
    ] = "",
    from_: Annotated[
        str, typer.Option("--from", metavar="SCENARIO", help="Copy this scenario: shipped name or file.")
    ] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print file and next commands as JSON.")] = False,
) -> None:
    """Write a commented scenario to start from; an existing file is never overwritten.

    Example: gears3d new first --kind rattle

    Self-contained copy of a shipped scenario (gears3d list scenarios): gears3d new mine --from rigaud-2020/fig5-20rpm
    """
    from gears3d.errors import Fault, InputError, UsageError
    from gears3d.scenario.starting import copy, starter

    file = Path(name if name.endswith(".toml") else f"{name}.toml")
    stem = file.name.removesuffix(".toml")
    if not stem.strip() or any(sign in stem for sign in '"\\\n'):
        raise UsageError(f"{name!r} is not a name for a file")
    if kind and from_:
        raise UsageError("give one of --kind and --from")
    kind = kind or ("" if from_ else "rattle")
    text = copy(from_, stem) if from_ else starter(kind, stem)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with file.open("x", encoding="utf-8") as made:
            made.write(text)
    except FileExistsError as error:
        raise InputError(Fault("", "exists already", "choose another name", str(file))) from error
    except OSError as error:
        raise InputError(Fault("", f"cannot be written: {error.strerror}", "choose a folder", str(file))) from error
    then = [f"gears3d excitation {file}", f"gears3d run {file} --out runs/{stem}"]
    if kind == "bench":
        then = [f"gears3d inspect FILE --guess --rig {file} --out record.toml"]
    if as_json:
        from gears3d.cli.output import print_json

        print_json({"scenario": str(file), "kind": kind or None, "from": from_ or None, "next": then})
        return
    typer.echo(f"written to {file}; then: {' and '.join(then)}")
