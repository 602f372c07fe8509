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
    """Open the sealed answer of a challenge and score a diagnosis.

    Example: gears3d reveal blind found
    """
    from gears3d.challenge import reveal as score

    scored = score(folder, diagnosis)
    if as_json:
        from gears3d.cli.output import print_json

        print_json(scored)
        return
    answer = scored["answer"]
    hidden = [e["kind"] for e in answer["effects"]] + [u["name"] for u in answer["unknown"]]
    typer.echo(f"hidden   {', '.join(hidden) or 'nothing'}  (size {answer['size']:.3g}, seed {answer['seed']})")
    typer.echo(f"verdict  {scored['verdict']}: {'right' if scored['verdict_right'] else 'wrong'}")
    for name in ("kinds_first", "kinds_named", "set_right", "coordinate_right"):
        if scored[name] is not None:
            typer.echo(f"{name.replace('_', ' '):<17}{'yes' if scored[name] else 'no'}")
    if scored["wrong_names"]:
        typer.echo(f"wrongly named    {', '.join(scored['wrong_names'])}")
    if scored["changed"]:
        typer.echo(f"changed since    {', '.join(scored['changed'])}")
    for row in scored["parameters"]:
        error = "" if row["error"] is None else f"  error {row['error']:+.2%}" if row["name"] != "phase" else ""
        typer.echo(f"{row['kind']}.{row['name']}: {_short(row['found'])} for {_short(row['true'])}{error}")


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
