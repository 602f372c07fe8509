"""The command line: ``gears3d VERB``.

To add a verb: write ``gears3d/cli/<verb>.py`` with a typer-style function of that name, or ``<verb>_`` where Python has
one of that name already, and add the name to ``GROUPS``. Its docstring is the help and ends lines with examples that
``tests/cli/test_wheel.py`` runs; it takes ``--json``; options that verbs share are in ``options``. A verb's file is
loaded to show the help, so it imports anything heavy inside its functions. A verb of several kinds has a typer
``app`` in its file. A verb raises ``GearsError`` for what a user can fix, ``typer.Exit(code)`` for another exit code,
and returns for 0.
"""

from __future__ import annotations

import atexit
import gc
import sys
from collections.abc import Sequence
from typing import Annotated, Any

import typer
from typer.main import get_command

from gears3d.cli.groups import LazyGroup
from gears3d.cli.interrupts import exit_code, interrupted, orderly_ends
from gears3d.cli.output import print_error
from gears3d.cli.pipes import quiet_pipes
from gears3d.errors import Fault, GearsError, InputError, UsageError

# The verbs in the order of the help, under the headings of the help.
GROUPS = {
    "Start": ("new", "list", "check", "show", "excitation", "schema", "doctor", "cite"),
    "Simulate": ("run", "sweep", "synthesize", "bench"),
    "Look": ("replay", "camera", "report", "sound", "export", "bundle"),
    "Measure": ("inspect", "segment", "identify"),
    "Explain": ("diagnose", "plan", "compare"),
    "Verify": ("validate", "papers", "challenge", "reveal"),
}
# The verbs in the order of the help.
VERBS = tuple(verb for verbs in GROUPS.values() for verb in verbs)
# Verbs by their old names, which still work and warn.
RENAMED = {"record": "synthesize", "measure": "segment", "describe": "report", "mesh": "export"}

# Objects after which Python looks for cycles. Its own 700 take 10 % of a run, to look through what was imported.
YOUNG = 50_000


class _Verbs(LazyGroup):
    """The verbs; turns errors into text and exit codes."""

    package, line, noun = "gears3d.cli", "gears3d", "verb"
    renamed = RENAMED
    panels = GROUPS
    as_json = False

    def make_context(self, info_name: str | None, args: list[str], *more: Any, **extra: Any) -> Any:
        """Note whether the answer, errors included, is wanted as JSON."""
        self.as_json = "--json" in args
        try:
            _refuse_bytes(args)
            return super().make_context(info_name, args, *more, **extra)
        except UsageError as error:
            print_error(error, self.as_json)
            raise typer.Exit(error.exit_code) from None
        except KeyboardInterrupt:
            raise typer.Exit(exit_code()) from None

    def invoke(self, ctx: Any) -> Any:
        """Run a verb; an error that was raised on purpose becomes its text and its exit code."""
        try:
            return super().invoke(ctx)
        except typer.Exit:
            raise
        except GearsError as error:
            print_error(error, self.as_json)
            raise typer.Exit(error.exit_code) from None
        except KeyboardInterrupt:
            raise typer.Exit(exit_code()) from None
        except Exception as error:
            if interrupted():
                raise typer.Exit(exit_code()) from None
            if not isinstance(error, OSError | MemoryError):
                raise
            print_error(InputError(_of_the_system(error)), self.as_json)
            raise typer.Exit(InputError.exit_code) from None


def _refuse_bytes(words: list[str]) -> None:
    """Refuse arguments that are not text in the encoding of the file system: no result could name such a file."""
    for word in words:
        if any("\ud800" <= letter <= "\udfff" for letter in word):
            encoding = sys.getfilesystemencoding()
            remedy = "rename the file" if encoding == "utf-8" else "set LC_ALL=C.UTF-8"
            raise UsageError(f"{word!a} is not text in {encoding}; {remedy}")


def _of_the_system(error: OSError | MemoryError) -> Fault:
    """Return an error of the operating system as a fault."""
    if isinstance(error, MemoryError):
        return Fault(
            "", "the memory of this machine is not sufficient", "give a shorter run or record, or fewer points"
        )
    return Fault("", error.strerror or str(error), file=str(error.filename or ""))


app = typer.Typer(
    cls=_Verbs,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        from gears3d import __version__

        typer.echo(f"gears3d {__version__}")
        raise typer.Exit


@app.callback()
def gears3d(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Involute gears that rattle inside their backlash: simulate, compare, watch.

    Example: gears3d run rigaud-2020/fig5-20rpm
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with the code of the contract."""
    gc.set_threshold(YOUNG)
    atexit.register(gc.freeze)  # spares the interpreter a last look at a million objects, half a second after a run
    try:
        with quiet_pipes(), orderly_ends():
            get_command(app)(args=[*(sys.argv[1:] if arguments is None else arguments)], prog_name="gears3d")
    except KeyboardInterrupt:  # outside of a verb
        sys.exit(exit_code())
