"""How to cite gears3d, and the works behind its laws."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib.resources import files

from gears3d.version import __version__

TITLE = "gears3d: involute gears as exact solids that rattle inside their backlash"
AUTHORS = "The gears3d developers"
YEAR = 2026  # Of the release


@dataclass(frozen=True)
class Reference:
    """A work that a law comes from."""

    key: str  # short name
    authors: tuple[str, ...]  # initials and names
    title: str  # of the work
    source: str  # journal, volume and pages, or publisher
    year: int  # of publication
    used: str  # what gears3d takes from it

    def __str__(self) -> str:
        return f"{', '.join(self.authors)} ({self.year}): {self.title}. {self.source}."


def references() -> tuple[Reference, ...]:
    """Return the works behind the laws, the most used first.

    >>> print(references()[1].authors[0], references()[1].year)
    Y. Kadmiri 2012
    """
    text = files("gears3d.verification.papers").joinpath("references.toml").read_text(encoding="utf-8")
    return tuple(Reference(**{**one, "authors": tuple(one["authors"])}) for one in tomllib.loads(text)["reference"])


def software() -> str:
    """Return the line that cites gears3d in its installed version."""
    return f"{AUTHORS} ({YEAR}): {TITLE}. Version {__version__}."


def bibtex() -> str:
    """Return the BibTeX entry of gears3d."""
    return (
        "@software{gears3d,\n"
        f"  author  = {{{{{AUTHORS}}}}},\n"
        f"  title   = {{{TITLE}}},\n"
        f"  version = {{{__version__}}},\n"
        f"  year    = {{{YEAR}}}\n"
        "}"
    )
