"""The rows as text: numbers with their units, and the page of the documentation."""

from __future__ import annotations

from math import floor, log10

from gears3d.verification.papers.claim import Claim, Result
from gears3d.verification.papers.paper import Paper

Held = list[tuple[Paper, list[Result]]]


def number(value: float | str, unit: str = "", tolerance: float = 0.0) -> str:
    """Return a value with its unit, four digits at most; a word as it is.

    Args:
        value: number or word.
        unit: of the number.
        tolerance: of the row; digits below a thousandth of it are left out.

    >>> number(22.3456, "mm/s"), number(3e-15, "mm", 0.1), number("rises")
    ('22.35 mm/s', '0 mm', 'rises')
    """
    if isinstance(value, str):
        return value
    if tolerance:
        value = round(value, 3 - floor(log10(tolerance)))
    return f"{value + 0.0:.4g} {unit}".replace("-", "−").strip()


def allowed(claim: Claim) -> str:
    """Return the tolerance as text; empty for words.

    Args:
        claim: of the row.
    """
    return f"± {claim.tolerance:.3g}" if claim.tolerance else ""


def tally(results: list[Result]) -> str:
    """Return how many rows agree, in words.

    Args:
        results: the rows.
    """
    red = sum(result.verdict == "disagrees" for result in results)
    changed = sum(result.changed for result in results)
    words = f"{len(results)} rows: {len(results) - red} agree, {red} disagree"
    return f"{words}; {changed} not as recorded" if changed else words


def markdown(held: Held) -> str:
    """Return all rows as a page of the documentation.

    Args:
        held: papers with their results.
    """
    every = [result for _, results in held for result in results]
    lines = [
        "# Published figures against gears3d",
        "",
        "Printed by `gears3d papers --out DIR` (`DIR/papers.md`; `DIR/papers.html` has the figures). A row is a number",
        "or a trend that the paper measured, plotted or stated; ours comes out of a simulation or a law. Words must be",
        "equal, numbers within the tolerance. Rows that disagree stay: they are findings, explained below each table.",
        "",
        f"{tally(every)}.",
    ]
    for paper, results in held:
        lines += ["", f"## {paper.name}", "", f"{paper.citation}", "", *_table(results), *_notes(results)]
        if paper.excused:
            lines += ["", "Not represented:", ""]
            lines += [f"- {name}: {why}" for name, why in paper.excused.items()]
    return "\n".join([*lines, ""])


def _table(results: list[Result]) -> list[str]:
    lines = ["| where | quantity | published | ours | tolerance, from | model | |", "|---|---|---|---|---|---|---|"]
    for result in results:
        claim = result.claim
        cells = (
            claim.figure,
            claim.quantity,
            number(claim.published, claim.unit),
            number(result.computed, claim.unit, claim.tolerance),
            ", ".join(filter(None, (allowed(claim), claim.basis))),
            claim.model,
            "agrees" if result.verdict == "agrees" else "**disagrees**",
        )
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return lines


def _notes(results: list[Result]) -> list[str]:
    lines = ["", "Notes:", ""]
    for note, rows in notes(results).items():
        words = "**disagrees:** " if rows[0].verdict == "disagrees" else ""
        lines.append(f"- {places(rows)}: {words}{note}")
    return lines if len(lines) > 3 else []


def notes(results: list[Result]) -> dict[str, list[Result]]:
    """Return the notes in the order of their first row, with all rows that share them.

    Args:
        results: the rows.
    """
    found: dict[str, list[Result]] = {}
    for result in results:
        if result.claim.note:
            found.setdefault(result.claim.note, []).append(result)
    return found


def places(rows: list[Result]) -> str:
    """Return where rows that share a note stand.

    Args:
        rows: at least one.
    """
    first = rows[0].claim
    more = f" and {len(rows) - 1} more" if len(rows) > 1 else ""
    return f"{first.figure}, {first.quantity}{more}"
