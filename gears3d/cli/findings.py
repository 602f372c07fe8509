"""What the sensor gate found, for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gears3d.gate import Finding


def show_findings(findings: Sequence[Finding], file: str = "", quiet: bool = False) -> None:
    """Print what was found on stderr, one line each.

    Args:
        findings: of the gate.
        file: named where there are several.
        quiet: say nothing when nothing was found.
    """
    from rich.console import Console
    from rich.markup import escape

    from gears3d.gate import told

    console = Console(stderr=True, soft_wrap=True, highlight=False)
    place = f"{file}: " if file else ""
    for finding in findings:
        console.print(f"[yellow]sensors:[/] {escape(place + told(finding))}")
    if not findings and not quiet:
        console.print(f"{escape(place)}sensors: nothing found")
