"""The scenarios that come with gears3d, and the one place where a path or a name becomes a scenario file."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from gears3d.errors import InputError
from gears3d.inputs import is_file


@cache
def shipped() -> Path:
    """Return the folder of the shipped scenarios: in the installed package, or in the repository next to the package.

    Raises:
        InputError: neither of them exists.

    >>> (shipped() / "base").is_dir()
    True
    """
    here = Path(__file__).resolve()
    places = (here.parents[1] / "papers" / "scenarios", here.parents[2] / "scenarios")
    for place in places:
        if (place / "base").is_dir():
            return place
    raise InputError(f"the shipped scenarios are missing: neither {places[0]} nor {places[1]} exists")


@cache
def names() -> tuple[str, ...]:
    """Return the names of the shipped scenarios: their paths below :func:`shipped`, without ``.toml``.

    Raises:
        InputError: the shipped scenarios are missing.

    >>> "rigaud-2020/fig5-20rpm" in names()
    True
    """
    files = sorted(shipped().rglob("*.toml"))
    return tuple(file.relative_to(shipped()).as_posix().removesuffix(".toml") for file in files)


def find(place: str | Path, folder: Path = Path()) -> Path:
    """Return the scenario file that a path or the name of a shipped scenario denotes; an existing file wins.

    Args:
        place: path, or name.
        folder: the folder that a relative path starts from.

    Returns:
        The file; where there is neither a file nor a name, the path that was not found.

    Raises:
        InputError: the shipped scenarios are missing.

    >>> find("rigaud-2020/fig5-20rpm").name, find("mine.toml").name
    ('fig5-20rpm.toml', 'mine.toml')
    """
    file, name = folder / place, Path(place).as_posix()
    return shipped() / f"{name}.toml" if not is_file(file) and name in names() else file
