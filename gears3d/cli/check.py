"""``gears3d check``: every fault of scenario files, without simulating."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gears3d.cli.options import MODELS, Overrides, choice


def check(
    files: Annotated[
        list[Path], typer.Argument(metavar="SCENARIO...", help="Shipped scenarios, TOML files, or - (stdin).")
    ],
    set_: Overrides = None,
    model: Annotated[str, choice("Also list what this model does not take.", *MODELS)] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print the faults as JSON.")] = False,
) -> None:
    """List all faults of scenario files, each with its key and a remedy; exit code 3 if there are any.

    Example: gears3d check rigaud-2020/fig5-20rpm rigaud-2020/fig10

    With --model also what that model does not take, such as effects that do not act in it.
    """
    from gears3d.cli.output import fault_table, print_faults, print_json
    from gears3d.errors import InputError
    from gears3d.scenario import load

    if model:
        from gears3d.simulation import refusals

    results: list[dict[str, Any]] = []
    for file in files:
        try:
            scenario = load(file, set_ or ())
            faults = tuple(refusals(scenario, model)) if model else ()
        except InputError as error:
            faults = error.faults
        results.append({"file": str(file), "ok": not faults, "faults": [fault_table(fault) for fault in faults]})
        if not as_json:
            print_faults(faults)
            typer.echo(f"{file}: {_verdict(len(faults))}")
    if as_json:
        print_json({"ok": all(result["ok"] for result in results), "files": results})
    if not all(result["ok"] for result in results):
        raise typer.Exit(InputError.exit_code)


def _verdict(count: int) -> str:
    return "ok" if count == 0 else "1 fault" if count == 1 else f"{count} faults"
