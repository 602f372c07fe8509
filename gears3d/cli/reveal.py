"""``gears3d reveal``: open the answer of a challenge and score a diagnosis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import command, to_results

if TYPE_CHECKING:
    from gears3d.results import Result


def reveal(
    folder: Annotated[Path, typer.Argument(help="Folder of the challenge.")],
    diagnosis: Annotated[Path, typer.Argument(help="diagnosis.json, or the folder that holds it.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder for report.html and score.json.", callback=to_results())
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the score as JSON.")] = False,
) -> None:
    """Open the sealed answer of a challenge and score a diagnosis.

    Example: gears3d reveal blind found
    """
    from gears3d.verification.challenge import reveal as score

    scored = score(folder, diagnosis)
    if out is not None:
        file = diagnosis / "diagnosis.json" if diagnosis.is_dir() else diagnosis
        _result(scored).save(out, command=command(), inputs=[folder / "answer.sealed", file])
    if as_json:
        from gears3d.cli.output import print_json

        print_json(scored)
        return
    answer = scored["answer"]
    typer.echo(f"hidden   {_hidden(answer)}  (size {answer['size']:.3g}, seed {answer['seed']})")
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


def _hidden(answer: dict[str, Any]) -> str:
    kinds = [e["kind"] for e in answer["effects"]] + [u["name"] for u in answer["unknown"]]
    return ", ".join(kinds) or "nothing"


def _result(scored: dict[str, Any]) -> Result:
    from gears3d.views.results import Contents, Told

    hidden = _hidden(scored["answer"])
    verdict = f"{scored['verdict'].replace('_', ' ')}: {'right' if scored['verdict_right'] else 'wrong'}"
    rows = [("hidden", hidden), ("verdict", verdict), ("wrongly named", ", ".join(scored["wrong_names"]))]
    rows += [
        (f"{row['kind']}.{row['name']}", f"{_short(row['found'])} found, {_short(row['true'])} hidden")
        for row in scored["parameters"]
    ]
    word, right = scored["verdict"].replace("_", " "), "right" if scored["verdict_right"] else "wrong"
    answer = f"The verdict ({word}) is {right}."
    question = "Does the diagnosis name the hidden cause?"
    return Told(Contents("score", "challenge", "Score of a diagnosis", question, answer, rows, scored))


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
