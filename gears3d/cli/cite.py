"""``gears3d cite``: how to cite gears3d and the works behind its laws."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer


def cite(as_json: Annotated[bool, typer.Option("--json", help="Print it as JSON.")] = False) -> None:
    """Print how to cite gears3d, and the papers and standards that its laws come from.

    Example: gears3d cite
    """
    from gears3d.verification.papers.references import AUTHORS, TITLE, YEAR, bibtex, references, software
    from gears3d.version import __version__

    if as_json:
        from gears3d.cli.output import print_json

        own = {"authors": [AUTHORS], "title": TITLE, "version": __version__, "year": YEAR}
        print_json({"software": {**own, "text": software(), "bibtex": bibtex()},
                    "references": [{**asdict(one), "text": str(one)} for one in references()]})  # fmt: skip
        return
    typer.echo(f"{software()}\n\n{bibtex()}\n\nCite the source of the laws that you use, too:")
    for one in references():
        typer.echo(f"  {one}\n    {one.used}")
