"""Commented scenarios to start from."""

from __future__ import annotations

from importlib.resources import files

from gears3d.errors import UsageError, did_you_mean

STARTERS = {
    "rattle": "a loose spur gear that rattles",
    "helical": "a helical pair with tip relief and an eccentric gear",
    "bench": "the rig of a test bench, for measured records",
}
"""What each is."""


def starter(kind: str, name: str) -> str:
    """Return the text of a scenario to start from.

    Args:
        kind: one of :data:`STARTERS`.
        name: of the scenario; its title, and the name of the file in the commands of its comments.

    Raises:
        UsageError: there is none of that kind.

    >>> starter("rattle", "mine").splitlines()[0][:50]
    '# mine: a loose gear that rattles on its drive gea'
    >>> starter("rattel", "mine")
    Traceback (most recent call last):
    gears3d.errors.UsageError: there is no scenario to start from 'rattel'; did you mean 'rattle'?
    """
    if kind not in STARTERS:
        raise UsageError(f"there is no scenario to start from {kind!r}; {did_you_mean(kind, list(STARTERS))}")
    text = files("gears3d.scenario").joinpath("starters", f"{kind}.toml").read_text(encoding="utf-8")
    return text.replace("NAME", name)
