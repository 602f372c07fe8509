"""``gears3d identify KIND``: laws from measured data.

To add a kind: write ``gears3d/cli/identify/<kind>.py`` (underscores for hyphens) with a typer-style function of that
name, its shared options from ``gears3d.cli.identify.shared``, and add the kind to a test of ``gears3d.virtual_tests``.
"""

from __future__ import annotations

import typer

from gears3d.cli.groups import LazyGroup
from gears3d.virtual_tests import LAWS as KINDS
from gears3d.virtual_tests import RENAMED


class _Kinds(LazyGroup):
    package, line, noun = "gears3d.cli.identify", "gears3d identify", "kind"
    renamed = {"rundown": RENAMED["rundown"]}  # noqa: RUF012
    panels = {"Laws": KINDS}  # noqa: RUF012


app = typer.Typer(cls=_Kinds, name="identify", add_completion=False, no_args_is_help=True)


@app.callback()
def identify() -> None:
    """Identify a law from measurements: parameters with 95 % intervals and a snippet for a scenario.

    Every kind has a --help of its own and takes --out DIR, --plot PICTURE and --json.

    Example: gears3d identify coastdown coastdown.parquet --inertia "0.0695 kg m^2" --plot drag.png
    """
