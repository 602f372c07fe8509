"""From a file, a name, text or a mapping to a merged TOML document, with values set over it."""

from __future__ import annotations

import datetime
import glob
import os
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cache
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import ParseError, TOMLKitError
from tomlkit.items import AoT

from gears3d.errors import Fault, InputError, UsageError
from gears3d.inputs import MOST_TEXT, is_file, is_folder, is_there, stdin_bytes
from gears3d.inputs import read_text as text_of

DEEPEST = 30  # Files that extend one another
Override = str | tuple[str, Any]
Overrides = Iterable[Override] | Mapping[str, Any]
ROWS = "published.toml"  # published rows in the folder of a paper's scenarios, read by gears3d.verification.papers
_STEP = re.compile(r"\.?([A-Za-z0-9_-]+)|\[(\+|-?[0-9]{1,9})\]")


@cache
def shipped() -> Path:
    """Return the folder of the shipped scenarios: in the installed package, or in the repository next to the package.

    >>> (shipped() / "base").is_dir()
    True
    """
    here = Path(__file__).resolve()
    places = (here.parents[1] / "verification" / "papers" / "scenarios", here.parents[2] / "scenarios")
    for place in places:
        if (place / "base").is_dir():
            return place
    raise InputError(f"the shipped scenarios are missing: neither {places[0]} nor {places[1]} exists")


@cache
def names() -> tuple[str, ...]:
    """Return the names of the shipped scenarios: their paths below :func:`shipped`, without ``.toml``.

    >>> "rigaud-2020/fig5-20rpm" in names()
    True
    """
    files = sorted(file for file in shipped().rglob("*.toml") if file.name != ROWS)
    return tuple(file.relative_to(shipped()).as_posix().removesuffix(".toml") for file in files)


def find(place: str | Path, folder: Path = Path()) -> Path:
    """Return the scenario file that a path or the name of a shipped scenario denotes; an existing file wins.

    >>> find("rigaud-2020/fig5-20rpm").name, find("mine.toml").name
    ('fig5-20rpm.toml', 'mine.toml')
    """
    file, name = folder / place, Path(place).as_posix()
    return shipped() / f"{name}.toml" if not is_file(file) and name in names() else file


@dataclass
class Document:
    """A scenario as written, with everything it extends merged in."""

    toml: tomlkit.TOMLDocument  # the document, comments kept
    path: Path | None  # the file; ``None`` when it came as text
    # key path -> the file it was taken from, where that is not ``path``
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
    """Return a remedy that names the files nearest to a missing one."""
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


def apply(document: Document, overrides: Overrides) -> None:
    """Set values over a document.

    Args:
        document: changed in place.
        overrides: mapping or pairs of key path and value, or ``"KEY=VALUE"`` texts. Key paths are dotted with [i];
            ``[-1]`` is the last of a list and ``[+]`` appends to it.

    Raises:
        UsageError: no overrides at all, a text without ``=`` or a malformed key path.
        InputError: a key path that leads nowhere.
    """
    if isinstance(overrides, str) or not isinstance(overrides, Iterable):
        raise UsageError(f"{overrides!r} are no overrides: give a mapping, e.g. {{'motion.mean': '90 rpm'}}, or a list")
    listed: Any = overrides.items() if isinstance(overrides, Mapping) else overrides
    pairs = [_pair(each) for each in listed]
    faults = []
    for key, value in pairs:
        try:
            _set(document.toml, key, value)
        except (LookupError, TypeError, AttributeError, ValueError) as why:
            reason = why.args[0] if isinstance(why, LookupError) else "leads through a value that is not a table"
            faults.append(Fault(key, f"cannot be set: {reason}", file="--set"))
        document.origin[key] = "--set"
    if faults:
        raise InputError(faults)


def _pair(override: Override) -> tuple[str, Any]:
    if not isinstance(override, str):
        return override
    key, equals, text = override.partition("=")
    if not equals:
        raise UsageError(f"--set {override!r}: write KEY=VALUE, e.g. --set run.duration='1 s'")
    return key.strip(), literal(text.strip())


def literal(text: str) -> Any:
    """Return the value of a TOML literal; bare text is a string.

    >>> literal("0.3"), literal("30 rpm"), literal('"0.3"'), literal("{ value = 1 }")
    (0.3, '30 rpm', '0.3', {'value': 1})
    """
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    value = table["value"]
    dated = isinstance(value, datetime.date | datetime.time)
    return value if len(table) == 1 and not dated else text


def _steps(key: str) -> list[str | int]:
    """Split a key path; ``[+]`` becomes the text ``"+"``."""
    steps: list[str | int] = []
    end = 0
    for match in _STEP.finditer(key):
        if match.start() != end:
            break
        end = match.end()
        index = match[2]
        steps.append(match[1] if index is None else index if index == "+" else int(index))
    if not steps or end != len(key):
        raise UsageError(f"{key!r} is not a key path: write it dotted with [i], e.g. motion.harmonics[0].amplitude")
    return steps


def _set(toml: Any, key: str, value: Any) -> None:
    steps = _steps(key)
    if steps[0] == "extends":
        raise LookupError("extends is read before anything is set; write it in the file")
    place = toml
    for step, following in pairwise(steps):
        place = _enter(place, step, isinstance(following, int) or following == "+")
    last = steps[-1]
    if last == "+":
        place.append(_item(place, value))
    elif isinstance(last, int):
        _check(place, last)
        place[last] = _item(place, value)
    else:
        place[last] = value


def _item(place: Any, value: Any) -> Any:
    """Return a value as an element of a list; an array of tables takes tables alone."""
    if isinstance(place, AoT):
        if not isinstance(value, Mapping):
            raise LookupError(f"{value!r} is not a table")
        table = tomlkit.table()
        table.update(value)
        return table
    return value


def _enter(place: Any, step: str | int, list_follows: bool) -> Any:
    """Go one step down; tables and lists that are missing are made."""
    if step == "+":
        place.append(_item(place, {}))
        return place[-1]
    if isinstance(step, int):
        _check(place, step)
        return place[step]
    if step not in place:
        place[step] = (tomlkit.aot() if step == "effect" else tomlkit.array()) if list_follows else tomlkit.table()
    return place[step]


def _check(place: Any, index: int) -> None:
    if not isinstance(place, list):
        raise LookupError(f"[{index}] of what is not a list")
    if not -len(place) <= index < len(place):
        raise LookupError(f"[{index}] of a list of {len(place)}; [+] appends")
