"""Values set over a document: ``--set KEY=VALUE`` and ``Scenario.with_``."""

from __future__ import annotations

import datetime
import re
import tomllib
from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any

import tomlkit
from tomlkit.items import AoT

from gears3d.errors import Fault, InputError, UsageError
from gears3d.scenario.document import Document

Override = str | tuple[str, Any]
Overrides = Iterable[Override] | Mapping[str, Any]

_STEP = re.compile(r"\.?([A-Za-z0-9_-]+)|\[(\+|-?[0-9]{1,9})\]")


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
            reason = why.args[0] if isinstance(why, LookupError) else "leads through a value that is no table"
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

    Args:
        text: as on the command line.

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
        raise UsageError(f"{key!r} is no key path: write it dotted with [i], e.g. motion.harmonics[0].amplitude")
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
            raise LookupError(f"{value!r} is no table")
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
        raise LookupError(f"[{index}] of what is no list")
    if not -len(place) <= index < len(place):
        raise LookupError(f"[{index}] of a list of {len(place)}; [+] appends")
