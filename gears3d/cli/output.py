"""Output of verbs: JSON on stdout, errors on stderr. rich drops colour when piped or when NO_COLOR is set."""

from __future__ import annotations

import json
import sys
from typing import Any

from gears3d.errors import Fault, GearsError, InputError


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
