"""The findings as a page of the documentation."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

from gears3d.verification.papers.findings.question import Answer, Question

if TYPE_CHECKING:
    from gears3d.verification.papers.bench import Bench

HEAD = """# Open questions of the papers

Printed by `tools/findings`. Published figures that rigid gears do not give. For each: the effects of the catalogue (and
numbers of the rig) that could have caused it, with the size that it takes, solved for in the rigid twin; those that
cannot, up to the largest plausible size; and where `gears3d diagnose` would show each, how large. *Could* means that
the figures named at the head of the section are met with one size, not that it was so. What cannot is told with what
comes nearest, or, where nothing comes nearer than no effect at all, with what the largest size gives.
"""


def page(found: list[tuple[Question, list[Answer]]], bench: Bench) -> str:
    """Return the page.

    Args:
        found: questions with their answers.
        bench: where they were simulated.
    """
    parts = [HEAD]
    for question, each in found:
        parts += [f"## {question.title}\n", wrapped(question.asks), *table(question, each, bench), ""]
        parts += [f"- {answer.suspect.name}: {answer.suspect.note}" for answer in each if answer.suspect.note]
        if question.left_out:
            parts.append(f"- Not tried: {', '.join(question.left_out)}.")
        parts += ["", wrapped(f"**What would decide.** {question.decides}")]
    return "\n".join(parts)


def wrapped(text: str) -> str:
    """Return a paragraph in lines of the documentation's width.

    Args:
        text: of the paragraph.
    """
    return fill(text, 118, break_long_words=False, break_on_hyphens=False) + "\n"


def table(question: Question, each: list[Answer], bench: Bench) -> list[str]:
    """Return the lines of a question's table, what could before what cannot.

    Args:
        question: the question.
        each: its answers.
        bench: where they were simulated.
    """
    more = bool(question.also_column)
    columns = [question.columns, *[question.also_column][: int(more)], "where a diagnosis shows it"]
    lines = [
        f"| effect | verdict | size | largest plausible, why | {' | '.join(columns)} |",
        "|" + "---|" * (4 + len(columns)),
    ]
    for answer in sorted(each, key=lambda one: not one.could):
        suspect = answer.suspect
        where = question.shown(bench, suspect, answer.nearest, answer.phase)
        at = f", {answer.phase:.2f} rad" if len(suspect.phases) > 1 and answer.size else ""
        cells = (
            suspect.name,
            "**could**" if answer.could else "cannot",
            f"{answer.nearest:.3g} {suspect.size}{at}",
            f"{suspect.bound:.3g}, {suspect.because}",
            question.told(answer.values),
            *[answer.also][: int(more)],
            where,
        )
        lines.append("| " + " | ".join(cells) + " |")
    return lines
