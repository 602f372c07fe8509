"""``gears3d bench TEST``: virtual tests, run in the 3D engine.

To add a test: write ``gears3d/cli/bench/<test>.py`` with a typer-style function of that name, its shared options from
``gears3d.cli.bench.shared``, and add the test to ``TESTS``.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from gears3d.errors import UsageError, did_you_mean

TESTS = ("ste", "rundown", "threshold", "drop")
"""The tests in the order of the help."""


class _Tests(TyperGroup):
    """Loads a test's file when it is asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the tests whose file is there."""
        return [test for test in TESTS if find_spec(f"gears3d.cli.bench.{test}")]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a test.

        Raises:
            UsageError: the test is unknown.
        """
        if cmd_name not in (known := self.list_commands(ctx)):
            raise UsageError(f"unknown test {cmd_name!r}; {did_you_mean(cmd_name, known)}")
        one = typer.Typer(add_completion=False)
        one.command(cmd_name)(getattr(import_module(f"gears3d.cli.bench.{cmd_name}"), cmd_name))
        return get_command(one)


app = typer.Typer(cls=_Tests, name="bench", add_completion=False, no_args_is_help=True)


@app.callback()
def bench() -> None:
    """Run a virtual test of a rig in the 3D engine; write its records as a test rig would, and its results.

    Every test has a --help of its own and takes --out DIR and --json.

    Example: gears3d bench ste rigaud-2020/fig2 --out ste
    """
