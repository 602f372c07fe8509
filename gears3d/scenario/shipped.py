"""The scenarios that come with gears3d: in the installed package, or beside it in the repository."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from gears3d.errors import InputError


@cache
def shipped() -> Path:
    """Return the folder of the shipped scenarios.

    Raises:
        InputError: there is none.

    >>> (shipped() / "base").is_dir()
    True
    """
    here = Path(__file__).resolve()
    places = (here.parents[1] / "papers" / "scenarios", here.parents[2] / "scenarios")
    for place in places:
        if (place / "base").is_dir():
            return place
    raise InputError(f"the scenarios of the papers are missing: neither {places[0]} nor {places[1]} is there")
