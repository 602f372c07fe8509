"""The papers by name."""

from __future__ import annotations

from dataclasses import dataclass

from gears3d.errors import UsageError, did_you_mean
from gears3d.verification.papers.claim import Claim
from gears3d.verification.papers.figure import Figure
from gears3d.verification.papers.published import read

# in the order of the table; each has a folder of scenarios with its published rows
PAPERS = ("kadmiri-2012", "rigaud-2020", "ottewill-2010", "dct-helical-lubricated")


@dataclass(frozen=True)
class Paper:
    """What is taken from one paper.

    Args:
        name: short name, as in ``source`` of the scenarios.
        citation: authors, title, journal, year.
        contents: its figures and tables, in print order.
        claims: the rows.
        figures: those that are drawn again.
        excused: figures and tables without a row, and why.
    """

    name: str
    citation: str
    contents: tuple[str, ...]
    claims: tuple[Claim, ...]
    figures: tuple[Figure, ...]
    excused: dict[str, str]

    @property
    def forgotten(self) -> list[str]:
        """Figures and tables that are neither represented by a row nor excused."""
        there = {claim.figure for claim in self.claims} | set(self.excused)
        return [name for name in self.contents if name not in there]


def paper(name: str) -> Paper:
    """Return a paper by name.

    Args:
        name: one of :data:`PAPERS`.

    Raises:
        UsageError: there is no such paper.

    >>> paper("rigaud-202")
    Traceback (most recent call last):
    gears3d.errors.UsageError: there is no paper 'rigaud-202'; did you mean 'rigaud-2020'?
    """
    if name not in PAPERS:
        raise UsageError(f"there is no paper {name!r}; {did_you_mean(name, PAPERS)}")
    return Paper(name, **read(name))


def papers(only: str = "") -> list[Paper]:
    """Return the papers.

    Args:
        only: the name of one; all when empty.

    Raises:
        UsageError: there is no such paper.
    """
    return [paper(name) for name in ([only] if only else PAPERS)]
