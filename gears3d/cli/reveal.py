"""``gears3d reveal``: open the answer of a challenge and score a diagnosis."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def reveal(
    folder: Annotated[Path, typer.Argument(help="Folder of the challenge.")],
    diagnosis: Annotated[Path, typer.Argument(help="diagnosis.json, or the folder that holds it.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the score as JSON.")] = False,
) -> None:
    """Open the sealed answer of a challenge and tell what a diagnosis got right.

    Example: gears3d reveal blind found
    """
    from gears3d.challenge import reveal as score

    told = score(folder, diagnosis)
    if as_json:
        from gears3d.cli.output import print_json

        print_json(told)
        return
    answer = told["answer"]
    hidden = [e["kind"] for e in answer["effects"]] + [u["name"] for u in answer["unknown"]]
    typer.echo(f"hidden   {', '.join(hidden) or 'nothing'}  (size {answer['size']:.3g}, seed {answer['seed']})")
    typer.echo(f"verdict  {told['verdict']}: {'right' if told['verdict_right'] else 'wrong'}")
    for name in ("kinds_first", "kinds_named", "set_right", "coordinate_right"):
        if told[name] is not None:
            typer.echo(f"{name.replace('_', ' '):<17}{'yes' if told[name] else 'no'}")
    if told["wrong_names"]:
        typer.echo(f"wrongly named    {', '.join(told['wrong_names'])}")
    if told["changed"]:
        typer.echo(f"changed since    {', '.join(told['changed'])}")
    for row in told["parameters"]:
        error = "" if row["error"] is None else f"  error {row['error']:+.2%}" if row["name"] != "phase" else ""
        typer.echo(f"{row['kind']}.{row['name']}: {_short(row['found'])} for {_short(row['true'])}{error}")


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
