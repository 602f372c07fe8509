"""Findings of the sensor gate as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted, Finding


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
    import typer

    for one in repeated:
        evidence = next(finding.evidence for finding in one.findings if finding.kind == "duplicated-file")
        typer.echo(f"excluded: {one.file}: {evidence}", err=True)
