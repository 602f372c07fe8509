"""Output of verbs: JSON on stdout, errors on stderr. rich drops colour when piped or when NO_COLOR is set."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import typer

from gears3d.errors import Fault, GearsError, InputError

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted, Finding


def print_json(data: Any) -> None:
    """Print data as JSON on stdout."""
    sys.stdout.write(json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def fault_table(fault: Fault) -> dict[str, str]:
    """Return a fault as a table for JSON."""
    return {"file": fault.file, "key": fault.key, "message": fault.message, "remedy": fault.remedy}


def print_error(error: GearsError, as_json: bool = False) -> None:
    """Print an error as text on stderr and, if requested, as JSON on stdout."""
    faults = error.faults if isinstance(error, InputError) else (Fault("", str(error)),)
    print_faults(faults)
    if as_json:
        tables = [fault_table(fault) for fault in faults]
        print_json({"error": {"exit_code": error.exit_code, "message": str(error), "faults": tables}})


def print_faults(faults: tuple[Fault, ...]) -> None:
    """Print faults on stderr, one line each with the remedy below."""
    from rich.console import Console
    from rich.text import Text

    console = Console(stderr=True, highlight=False, soft_wrap=True)
    for fault in faults:
        line = Text("error: ", style="bold red")
        if fault.file:
            line.append(f"{fault.file}: ", style="dim")
        if fault.key:
            line.append(f"{fault.key}: ", style="bold")
        line.append(fault.message, style="default")
        console.print(line)
        if fault.remedy:
            console.print(Text(f"       {fault.remedy}", style="cyan"))


def print_rows(rows: Iterable[tuple[str, str]], title: str = "", bad: Callable[[str], bool] | None = None) -> None:
    """Print (name, value) as a table; values that are bad are red."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, value in rows:
        table.add_row(name, f"[red]{escape(value)}[/]" if bad is not None and bad(value) else escape(value))
    Console(highlight=False).print(table)


def print_warnings(notes: Iterable[str]) -> None:
    """Print what weakens a result on stderr."""
    from rich.console import Console
    from rich.markup import escape

    for note in notes:
        Console(stderr=True, soft_wrap=True, highlight=False).print(f"[yellow]warning:[/] {escape(note)}")


def residual_line(goodness: Mapping[str, Any]) -> str:
    """Return the residual of a drag law relative to noise, and its structure; nothing for other laws."""
    over = goodness.get("residual_over_noise")
    if over is None:
        return ""
    sizes = [(goodness.get(f"rms_{kind}"), unit) for kind, unit in (("angle_rad", "rad"), ("speed_rad_s", "rad/s"))]
    rms = ", ".join(f"{size:.3g} {unit}" for size, unit in sizes if size is not None)
    structure = f"p = {goodness['p_structure']:.2g} for independent errors about this law"
    return f"residual: rms {rms}, {over:.3g} times the noise of single readings; {structure}"


def show_findings(findings: Sequence[Finding], file: str = "", quiet: bool = False) -> None:
    """Print findings on stderr, one line each."""
    if quiet and not findings:
        return
    from rich.console import Console
    from rich.markup import escape

    from gears3d.measured.checks import told

    console = Console(stderr=True, soft_wrap=True, highlight=False)
    place = f"{file}: " if file else ""
    for finding in findings:
        console.print(f"[yellow]sensors:[/] {escape(place + told(finding))}")
    if not findings:
        console.print(f"{escape(place)}sensors: no findings")


def show_repeated(repeated: Sequence[Admitted]) -> None:
    """Print on stderr which files are excluded, as they repeat the readings of others."""
    for one in repeated:
        evidence = next(finding.evidence for finding in one.findings if finding.kind == "duplicated-file")
        typer.echo(f"excluded: {one.file}: {evidence}", err=True)
