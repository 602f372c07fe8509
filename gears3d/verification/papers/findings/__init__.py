"""Open questions of the papers: which effects of the catalogue could have caused them, at which size, and which not.

A question is a module of this room that holds ``QUESTION``; :func:`questions` gives them in the order of the page.
"""

from importlib import import_module

from gears3d.verification.papers.findings.question import Answer as Answer
from gears3d.verification.papers.findings.question import Question as Question
from gears3d.verification.papers.findings.question import Suspect as Suspect
from gears3d.verification.papers.findings.question import answer as answer
from gears3d.verification.papers.findings.question import answers as answers

QUESTIONS = ("kadmiri", "rigaud", "ottewill")


def questions(only: str = "") -> list[Question]:
    """Return the questions.

    Args:
        only: the name of one; all when empty.

    >>> [each.columns for each in questions("kadmiri")]
    ['Λ at 250, 500, 750, 1000 rpm']
    """
    names = [only] if only else QUESTIONS
    return [import_module(f"gears3d.verification.papers.findings.{name}").QUESTION for name in names]
