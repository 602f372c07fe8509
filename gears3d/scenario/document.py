"""TOML in and out: the file, what it extends, and the values set over it."""

from __future__ import annotations

import glob
import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from os import PathLike
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import ParseError, TOMLKitError

from gears3d.errors import Fault, InputError, UsageError
from gears3d.inputs import MOST_TEXT, is_folder, is_there, stdin_bytes
from gears3d.inputs import read_text as text_of
from gears3d.scenario.shipped import find, names

DEEPEST = 30
"""Files that extend one another."""


@dataclass
class Document:
    """A scenario as written, with everything it extends merged in.

    Args:
        toml: the document, comments kept.
        path: the file; ``None`` when it came as text.
        origin: key path -> the file it was taken from, where that is not ``path``.
    """

    toml: tomlkit.TOMLDocument
    path: Path | None
    origin: dict[str, str] = field(default_factory=dict)

    def file_of(self, key: str) -> str:
        """Return the name of the file that a key path stands in."""
        while key:
            if key in self.origin:
                return self.origin[key]
            key = key[: max(key.rfind("."), key.rfind("["), 0)]
        return str(self.path or "")

    def text(self) -> str:
        """Return the resolved document as TOML."""
        written = tomlkit.dumps(self.toml)
        plain = self.toml.unwrap()
        try:
            same = tomllib.loads(written) == plain
        except tomllib.TOMLDecodeError:
            same = False
        return written if same else tomlkit.dumps(plain)


def read(source: str | Path | Mapping[str, Any]) -> Document:
    """Read a scenario and all that it extends.

    Args:
        source: a path, the name of a shipped scenario, TOML text (anything with a line break, or ``=`` and no
            ``.toml`` at its end), a mapping, or ``-`` for standard input.

    Returns:
        The merged document.

    Raises:
        InputError: no such file or name, not TOML, or a circle of ``extends``.
        UsageError: none of the four.
    """
    if isinstance(source, Mapping):
        return read_text(_written(source))
    if not isinstance(source, str | PathLike):
        what = f"{source!r} is a {type(source).__name__}"
        raise UsageError(f'{what}, no scenario: give a file, TOML text or a mapping, e.g. load("case.toml")')
    if isinstance(source, str) and ("\n" in source or ("=" in source and not source.endswith(".toml"))):
        return read_text(source)
    if str(source) == "-":
        return read_text(_stdin())
    return _file(find(source), ())


def _stdin() -> str:
    data = stdin_bytes(MOST_TEXT)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as why:
        raise InputError(Fault("", f"is not UTF-8 text: byte {why.start}", "save it as UTF-8", "-")) from None


def read_text(text: str, path: Path | None = None) -> Document:
    """Read a scenario from text; ``path`` is where relative files count from."""
    return _resolve(_parse(text, str(path or "text")), path, ())


def _written(mapping: Mapping[str, Any]) -> str:
    """Return a mapping as TOML."""
    try:
        return tomlkit.dumps(mapping)
    except (TOMLKitError, ValueError, TypeError, RecursionError) as why:
        told = str(why) or "it is nested too deep"
        raise InputError(Fault("", f"cannot be written as TOML: {told}", "give texts, numbers, lists, tables")) from why


def _parse(text: str, name: str) -> tomlkit.TOMLDocument:
    if len(text) > MOST_TEXT:
        told = f"has {len(text)} characters, at most {MOST_TEXT} are read"
        raise InputError(Fault("", told, "is it a scenario?", name))
    try:
        return tomlkit.parse(text)
    except ParseError as why:
        reason = str(why).rsplit(" at line", 1)[0]
        raise InputError(
            Fault("", f"is not TOML: line {why.line}, column {why.col}: {reason}", "see https://toml.io", name)
        ) from why
    except (TOMLKitError, ValueError) as why:
        raise InputError(Fault("", f"is not TOML: {why}", "see https://toml.io", name)) from why
    except RecursionError as why:
        raise InputError(Fault("", "is nested too deep", "see https://toml.io", name)) from why


def _file(path: Path, chain: tuple[Path, ...]) -> Document:
    try:
        text = text_of(path)
    except FileNotFoundError:
        raise InputError(
            Fault("", "there is no such file and no shipped scenario of this name", _near(path), str(path))
        ) from None
    except IsADirectoryError:
        raise InputError(Fault("", "is a folder", "give a .toml file", str(path))) from None
    except UnicodeDecodeError as why:
        raise InputError(Fault("", f"is not UTF-8 text: byte {why.start}", "save it as UTF-8", str(path))) from None
    except OSError as why:
        raise InputError(Fault("", f"cannot be read: {why.strerror}", file=str(path))) from None
    return _resolve(_parse(text, str(path)), path, chain)


def _near(path: Path) -> str:
    """Return a remedy for a missing scenario: a path that ends with ``.toml`` means a file, any other a name."""
    word = path.as_posix().removesuffix(".toml")
    known = {**{name.rpartition("/")[2]: name for name in names()}, **{name: name for name in names()}}
    name = [repr(known[near]) for near in get_close_matches(word, known, n=1, cutoff=0.7)]
    files = _near_files(path)
    near = (files or name) if path.suffix == ".toml" else (name or files)
    return _meant(near) if near else f"{near_files(path)}; gears3d list scenarios prints the names"


def near_files(path: Path) -> str:
    """Return a remedy that names the files nearest to a missing one.

    Args:
        path: the missing file.
    """
    if near := _near_files(path):
        return _meant(near)
    folder, pattern, names = _neighbours(path)
    some = ", ".join(sorted(names)[:5])
    return f"{folder} has {some}" if some else f"{folder} has no {pattern}"


def _meant(near: list[str]) -> str:
    return f"did you mean {' or '.join(near)}?"


def _near_files(path: Path) -> list[str]:
    """Return up to two files with a name near to that of a missing one, in quotes."""
    _, _, names = _neighbours(path)
    return [repr(str(names[near])) for near in get_close_matches(path.name, list(names), n=2, cutoff=0.5)]


def _neighbours(path: Path) -> tuple[Path, str, dict[str, Path]]:
    """Return the nearest folder that exists, the pattern of files like the missing one, and those files by name."""
    folder = path.parent
    while not is_folder(folder) and folder != folder.parent:
        folder = folder.parent
    pattern = "*.toml" if path.suffix in ("", ".toml") else f"*{glob.escape(path.suffix)}"
    names = {other.name: other for other in sorted(folder.glob(pattern))}
    if not names and folder != Path():
        names = {other.name: other for other in sorted(folder.glob(f"*/{pattern}"))}
    return folder, pattern, names


def _resolve(toml: tomlkit.TOMLDocument, path: Path | None, chain: tuple[Path, ...]) -> Document:
    """Merge in what a document extends; make the paths in it absolute."""
    document = Document(toml, path)
    folder = path.parent if path else Path()
    motion = toml.get("motion")
    if isinstance(motion, Mapping) and isinstance(motion.get("record"), str):
        motion["record"] = _absolute(folder / motion["record"], "motion.record", path)  # type: ignore[index]
    if "extends" not in toml:
        return document
    base = toml.pop("extends")
    if not isinstance(base, str):
        raise InputError(Fault("extends", f"{base!r} is not a file name", 'e.g. "base.toml"', str(path or "")))
    target = find(base, folder)
    whole = Path(_absolute(target, "extends", path))
    chain = (*chain, Path(_absolute(path, "", path))) if path else chain
    if len(chain) > DEEPEST:
        told = f"{base!r} is file {len(chain) + 1} of a chain"
        raise InputError(Fault("extends", told, f"at most {DEEPEST} files may extend one another", str(path)))
    if whole in chain:
        circle = " -> ".join(link.name for link in (*chain, target))
        raise InputError(Fault("extends", f"goes round in a circle: {circle}", "take one out", str(path or "")))
    try:
        below = _file(target, chain)
    except InputError:
        if is_there(target):
            raise
        remedy = _near(target if target.suffix == ".toml" else Path(base))
        fault = Fault("extends", f"there is no file {str(target)!r}", remedy, str(path or ""))
        raise InputError(fault) from None
    _merge(toml, below.toml, "", below, document)
    return document


def _absolute(file: Path, key: str, path: Path | None) -> str:
    """Return a path that no longer depends on a folder."""
    try:
        return os.path.realpath(file)
    except (OSError, ValueError):
        raise InputError(
            Fault(key, f"{str(file)!r} is not a valid file name", "name a file", str(path or ""))
        ) from None


def _merge(own: Any, base: Any, place: str, below: Document, document: Document) -> None:
    """Add to ``own`` what only ``base`` has; tables are merged, everything else is replaced as a whole."""
    for key, item in base.items():
        here = f"{place}.{key}" if place else key
        if key not in own:
            own[key] = item
            document.origin[here] = below.file_of(here)
            document.origin.update({k: v for k, v in below.origin.items() if k.startswith(here)})
        elif isinstance(own[key], Mapping) and isinstance(item, Mapping) and "value" not in own[key]:
            _merge(own[key], item, here, below, document)
