"""``gears3d identify KIND``: laws from measured data.

To add a kind: write ``gears3d/cli/identify/<kind>.py`` (underscores for hyphens) with a typer-style function of that
name, its shared options from ``gears3d.cli.identify.shared``, and add the kind to ``KINDS``.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from gears3d.errors import UsageError, did_you_mean

KINDS = ("rundown", "restitution", "transmission-error", "backlash", "threshold")
"""The kinds in the order of the help."""


def _module(kind: str) -> str:
    return f"gears3d.cli.identify.{kind.replace('-', '_')}"


class _Kinds(TyperGroup):
    """Loads a kind's file when it is asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the kinds whose file is there."""
        return [kind for kind in KINDS if find_spec(_module(kind))]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a kind.

        Raises:
            UsageError: the kind is unknown.
        """
        if cmd_name not in (known := self.list_commands(ctx)):
            raise UsageError(f"unknown kind {cmd_name!r}; {did_you_mean(cmd_name, known)}")
        one = typer.Typer(add_completion=False)
        one.command(cmd_name)(getattr(import_module(_module(cmd_name)), cmd_name.replace("-", "_")))
        return get_command(one)


app = typer.Typer(cls=_Kinds, name="identify", add_completion=False, no_args_is_help=True)


@app.callback()
def identify() -> None:
    """Identify a law from measurements: parameters with 95 % intervals and a snippet for a scenario.

    Every kind has a --help of its own and takes --out PICTURE and --json.

    Example: gears3d identify rundown rundown.parquet --inertia "0.0695 kg m^2" --out drag.png
    """
