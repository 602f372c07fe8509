"""Groups of commands whose files are loaded when they are needed, and old names that still work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any, ClassVar

import typer
from typer.core import TyperGroup
from typer.main import get_command

from gears3d.errors import UsageError, did_you_mean


def warn_renamed(old: str, new: str) -> None:
    """Print one line on stderr about an old name that still works."""
    typer.echo(f"warning: {old} is called {new} now; the old name will be removed", err=True)


class LazyGroup(TyperGroup):
    """Loads a command's file when it is asked for; an old name works and prints one line of warning."""

    package: ClassVar[str]
    """The package with one file per command, hyphens as underscores."""
    line: ClassVar[str]
    """The words before the command."""
    noun: ClassVar[str]
    """What a command is called in messages."""
    renamed: ClassVar[Mapping[str, str]] = {}
    """New names by the old ones."""
    panels: ClassVar[Mapping[str, Sequence[str]]] = {}
    """Commands by the heading in the help that they stand under."""
    single: ClassVar[bool] = False
    """Whether ``package`` is one module that has a function for each command."""

    def names(self) -> Sequence[str]:
        """Return the commands in the order of the help."""
        return [name for names in self.panels.values() for name in names]

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the commands whose file is there."""
        return [name for name in self.names() if find_spec(self._module(name))]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command."""
        if (new := self.renamed.get(cmd_name)) is not None:
            if not ctx.resilient_parsing:
                warn_renamed(f"'{self.line} {cmd_name}'", f"'{self.line} {new}'")
            cmd_name = new
        if cmd_name not in (known := self.list_commands(ctx)):
            if ctx.resilient_parsing:  # a shell completes the line
                return None
            raise UsageError(f"unknown {self.noun} {cmd_name!r}; {did_you_mean(cmd_name, known)}")
        made, name = import_module(self._module(cmd_name)), cmd_name.replace("-", "_")
        if hasattr(made, "app") and not self.single:
            command = get_command(made.app)
        else:
            app = typer.Typer(add_completion=False)
            app.command(cmd_name)(getattr(made, name, None) or getattr(made, f"{name}_"))
            command = get_command(app)
        for panel, names in self.panels.items():
            if cmd_name in names:
                setattr(command, "rich_help_panel", panel)  # noqa: B010 typer reads it, but does not declare it
        return command

    def _module(self, name: str) -> str:
        return self.package if self.single else f"{self.package}.{name.replace('-', '_')}"
