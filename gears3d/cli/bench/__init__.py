"""``gears3d bench TEST``: virtual tests, run in the 3D engine.

To add a test: write ``gears3d/cli/bench/<test>.py`` (underscores for hyphens) with a typer-style function of that name,
its shared options from ``gears3d.cli.bench.shared``, and add the test to ``gears3d.virtual_tests``.
"""

from __future__ import annotations

import typer

from gears3d.cli.groups import LazyGroup
from gears3d.virtual_tests import IN_ENGINE, RENAMED


class _Tests(LazyGroup):
    package, line, noun = "gears3d.cli.bench", "gears3d bench", "test"
    renamed = RENAMED
    panels = {"Tests": IN_ENGINE}  # noqa: RUF012


app = typer.Typer(cls=_Tests, name="bench", add_completion=False, no_args_is_help=True)


@app.callback()
def bench() -> None:
    """Run a virtual test of a rig in the 3D engine; write its records as a test rig would, and its results.

    Every test has a --help of its own and takes --out DIR and --json.

    Example: gears3d bench transmission-error rigaud-2020/fig2 --out ste
    """
