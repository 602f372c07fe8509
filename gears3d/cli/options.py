"""Arguments and options that several verbs share."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.groups import warn_renamed
from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.files import PICTURES, refuse_file, refuse_folder
from gears3d.inputs import spooled

if TYPE_CHECKING:
    from gears3d.results import Result
    from gears3d.scenario import Scenario

# The models; their packages are not loaded for the help.
MODELS = ("bullet", "rigid", "plastic", "lubricated")


def command() -> str:
    """Return the command as it was typed."""
    return shlex.join(["gears3d", *sys.argv[1:]])


def to_file(*endings: str) -> Callable[[Any], Any]:
    """Return the callback of an option that names a file to write: it is refused before the verb begins."""

    def check(value: Path | None) -> Path | None:
        if value is not None:
            refuse_file(value, endings)
        return value

    return check


def to_folder(value: Path | None) -> Path | None:
    """Refuse a folder that cannot be created before the verb begins: the callback of an option."""
    if value is not None:
        refuse_folder(value)
    return value


def choice(help: str, *names: str, **more: Any) -> Any:
    """Return an option that takes one of a few words: the help and the shell's completion enumerate them."""

    def check(param: typer.CallbackParam, value: str | None) -> str | None:
        if value and value not in names:
            raise UsageError(f"{param.opts[0]} is {value!r}; {did_you_mean(value, names)}")
        return value

    def complete(incomplete: str) -> list[str]:
        return [name for name in names if name.startswith(incomplete)]

    return typer.Option(help=help, metavar="|".join(names), autocompletion=complete, callback=check, **more)


def from_stdin(files: list[Path] | None) -> list[Path] | None:
    """Replace ``-`` among files by a file with what standard input holds: the callback of an argument."""
    return None if files is None else [spooled() if str(file) == "-" else file for file in files]


def load_rig(rig: Path | None, overrides: Sequence[str] | None) -> Scenario | None:
    """Return the scenario of ``--rig`` with the values of ``--set``; ``None`` without ``--rig``."""
    from gears3d.scenario import load

    if rig is None:
        if overrides:
            raise UsageError("--set changes the scenario of --rig: give --rig as well")
        return None
    return load(rig, overrides or ())


# The callback of an option that names a picture to write.
to_picture = to_file(*PICTURES)
# Ends of names that somebody meant for a file.
NO_FOLDER = re.compile(r"\.(bmp|gif|jpe?g|tiff?|webp|html?|json|md|toml|txt|zip)$", re.IGNORECASE)


def to_results(*files: str) -> Callable[[Any], Any]:
    """Return the callback of ``--out``: a folder, or a file with an ending that ``--out`` took before."""

    def check(value: Path | None) -> Path | None:
        if value is None:
            return None
        if value.suffix.lower() in files and not value.is_dir():
            refuse_file(value)
        elif NO_FOLDER.search(value.name) and not value.is_dir():
            endings = ", ".join(PICTURES)
            raise UsageError(f"{value}: --out names a folder; --plot names a picture, which ends in {endings}")
        elif value.suffix.lower() in files:
            raise InputError(Fault("", "cannot be written: Is a directory", "name a file in it", str(value)))
        else:
            refuse_folder(value)
        return value

    return check


OutFolder = Annotated[
    Path | None, typer.Option("--out", help="Folder for report.html, JSON and data.", callback=to_results(*PICTURES))
]
Plot = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE", help="Picture to write (.png, .svg, .pdf).", callback=to_picture),
]


def places(out: Path | None, plot: Path | None) -> tuple[Path | None, Path | None]:
    """Return folder and picture; a picture in ``--out``, where it was once, moves to ``--plot`` with a warning."""
    if out is None or out.suffix.lower() not in PICTURES or out.is_dir():
        return out, plot
    warn_renamed(f"--out {out}", f"--plot {out}")
    return None, plot or out


def keep(
    result: Result, out: Path | None, plot: Path | None, inputs: Iterable[str | Path | None] = (), scenario: Any = None
) -> list[str]:
    """Write folder and picture of a result where they are wanted; return a line about each, or how to get them."""
    lines = []
    if out is not None:
        result.save(out, scenario=scenario, command=command(), inputs=inputs)
        lines.append(f"report: {out / 'report.html'}")
    if plot is not None:
        result.plot(plot)
        lines.append(f"picture written to {plot}")
    return lines or ["to keep it: --out DIR (report, JSON, data), --plot FILE.png (picture)"]


ScenarioName = Annotated[
    Path,
    typer.Argument(metavar="SCENARIO", help="Shipped scenario (gears3d list scenarios), a TOML file, or - (stdin)."),
]
Records = Annotated[
    list[Path] | None,
    typer.Argument(help="Measured records, a record.toml that names them, or - (stdin).", callback=from_stdin),
]
Rig = Annotated[
    Path | None, typer.Option(metavar="SCENARIO", help="Scenario of the test rig; required for measured records.")
]
OwnRig = Annotated[
    Path | None,
    typer.Option(
        "--rig", metavar="SCENARIO", help="Scenario of the test rig; required unless the record has its base radii."
    ),
]
RequiredRig = Annotated[
    Path, typer.Option("--rig", metavar="SCENARIO", help="Scenario of the test rig: shipped one, or a TOML file.")
]
MapFile = Annotated[Path | None, typer.Option("--map", help="record.toml that defines the channels.")]
Correct = Annotated[
    list[str] | None, typer.Option(metavar="KIND,...", help="Findings of the sensor gate to correct; repeatable.")
]
Begin = Annotated[
    str, typer.Option("--from", metavar="TIME", help='Use the record from here on, in its own time, e.g. "3.2 s".')
]
End = Annotated[str, typer.Option("--to", metavar="TIME", help='Use the record up to here, e.g. "41 s".')]
StatedMotion = Annotated[
    bool,
    typer.Option(
        "--stated-motion",
        help="Compare the records with \\[motion] of the rig; by default the drive's encoder gives the motion.",
    ),
]
Overrides = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a value; repeatable.")
]
RigOverrides = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a value of --rig; repeatable.")
]


def span_of(begin: str, to: str) -> tuple[float | None, float | None]:
    """Return the part of a record between ``--from`` and ``--to`` [s]; ``None`` where one is not given.

    >>> span_of("3200 ms", "")
    (3.2, None)
    """
    from gears3d.units import parse

    limits: list[float | None] = []
    for key, text in (("--from", begin), ("--to", to)):
        try:
            limits.append(parse(text, "time") if text else None)
        except InputError as error:
            raise InputError([Fault(key, fault.message, fault.remedy) for fault in error.faults]) from None
    if limits[0] is not None and limits[1] is not None and limits[0] >= limits[1]:
        raise InputError(Fault("--from, --to", f"are {begin!r} and {to!r}", "give an earlier and a later time"))
    return limits[0], limits[1]
