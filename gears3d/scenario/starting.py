"""Commented scenarios to start from: starters, and copies of shipped scenarios."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from gears3d.errors import UsageError, did_you_mean
from gears3d.scenario.build import build
from gears3d.scenario.document import read

# What each is
STARTERS = {
    "rattle": "a loose spur gear that rattles",
    "helical": "a helical pair with tip relief and an eccentric gear",
    "bench": "the rig of a test bench, for measured records",
}


def starter(kind: str, name: str) -> str:
    """Return the text of a scenario to start from.

    >>> starter("rattle", "mine").splitlines()[0][:50]
    '# mine: a loose gear that rattles on its drive gea'
    >>> starter("rattel", "mine")
    Traceback (most recent call last):
    gears3d.errors.UsageError: unknown kind of scenario to start from: 'rattel'; did you mean 'rattle'?
    """
    if kind not in STARTERS:
        raise UsageError(f"unknown kind of scenario to start from: {kind!r}; {did_you_mean(kind, list(STARTERS))}")
    text = files("gears3d.scenario").joinpath("starters", f"{kind}.toml").read_text(encoding="utf-8")
    return text.replace("NAME", name)


def copy(source: str | Path, title: str) -> str:
    """Return a self-contained copy of a scenario as text: all that it extends is merged in, comments are kept.

    The copy is a question of its own: it has its own title, names its original as source, and has no ``[expect]``.

    >>> text = copy("rigaud-2020/fig6-10Hz", "mine")
    >>> "extends" in text, text.splitlines()[2:4]
    (False, ['title  = "mine"', 'source = "copy of rigaud-2020/fig6-10Hz"'])
    """
    document = read(source)
    build(document)
    document.toml["title"] = title
    document.toml["source"] = f"copy of {source}"
    document.toml.pop("expect", None)
    return document.text().replace(f"gears3d run {source}", f"gears3d run {title}.toml")
