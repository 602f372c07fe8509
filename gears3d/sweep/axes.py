"""What is varied: ``KEY=A..B UNIT lin N``, ``KEY=a,b,c UNIT`` or ``KEY=@file.csv UNIT`` become axes of a grid."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.inputs import read_text, refuse_beyond
from gears3d.scenario.key_paths import key_paths, whole_path
from gears3d.scenario.reader import check_bounds
from gears3d.units import FAMILIES, parse, parse_any

if TYPE_CHECKING:
    from gears3d.scenario import Scenario
    from gears3d.scenario.keys import Key

HOW = 'write "KEY=A..B UNIT lin N", "KEY=A..B UNIT log N", "KEY=a,b,c UNIT" or "KEY=@file.csv UNIT"'
LONGEST, DIGITS = 500, 15
"""Characters of a range, and of its number of values."""
VALUE = 200
"""Bytes of memory for a value, as a number and as it is written."""
MOST = 1 << 26
"""Bytes of a file with values."""
_RANGE = re.compile(r"(.+?)\s*\.\.\s*(.+?)\s+(\w+)\s+([+-]?\S+)")
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
NOT_VARIED = {
    "run.duration": "every point runs a number of whole periods: --periods",
    "run.settle": "every point leaves out a number of whole periods: --settle",
    "run.output_rate": "a sweep keeps no signals",
}
SPACINGS = ("lin", "log")


@dataclass(frozen=True)
class Axis:
    """One varied key and its values.

    Args:
        key: its path in the scenario.
        family: unit family of the values; ``"choice"`` for words.
        written: the values as the scenario takes them, with their unit.
        values: SI, (n,); the places 0, 1, ... of words.
        text: as it was asked for.
    """

    key: str
    family: str
    written: tuple[Any, ...]
    values: tuple[float, ...]
    text: str

    def __len__(self) -> int:
        return len(self.values)

    @property
    def name(self) -> str:
        """The key as a name of a dimension: letters, digits and underscores."""
        return re.sub(r"\W+", "_", self.key).strip("_")

    @property
    def unit(self) -> str:
        """SI unit of the values."""
        return FAMILIES[self.family].si if self.family in FAMILIES else ""


def parse_axis(scenario: Scenario, text: str) -> Axis:
    """Return the axis that a text asks for.

    Args:
        scenario: has the key.
        text: ``"KEY=A..B UNIT lin N"``, ``"... log N"``, ``"KEY=a,b,c UNIT"`` or ``"KEY=@file.csv UNIT"``.

    Raises:
        InputError: an unknown key, a wrong unit, no values, or one that the key does not take.
        UsageError: no axis at all.

    >>> from gears3d.scenario import load
    >>> axis = parse_axis(load("scenarios/rigaud-2020/fig5-20rpm.toml"), "drag.torque=0.2..0.8 N m lin 4")
    >>> axis.values, axis.name, axis.unit
    ((0.2, 0.4, 0.6, 0.8), 'drag_torque', 'N m')
    """
    name, equals, what = (part.strip() for part in text.partition("="))
    if not equals or not name or not what:
        raise UsageError(f"--vary {text!r}: {HOW}")
    path, known = whole_path(scenario, name), key_paths(scenario)
    here = f"--vary {name}"
    if path not in known:
        raise InputError(Fault(here, "is not a known key of this scenario", _near(path, list(known))))
    if path in NOT_VARIED or path.startswith("expect."):
        raise InputError(Fault(here, "cannot be varied", NOT_VARIED.get(path, "it is what must come out")))
    if known[path].family == "text":
        raise InputError(Fault(here, "is a text and cannot be varied", "vary a quantity"))
    try:
        return _axis(path, known[path], what, text)
    except InputError as why:
        raise InputError([Fault(here, fault.message, fault.remedy, fault.file) for fault in why.faults]) from None


def _axis(path: str, key: Key, what: str, text: str) -> Axis:
    if key.family == "choice":
        words = tuple(word.strip().strip("\"'") for word in what.split(","))
        for word in words:
            if word not in key.choices:
                raise InputError(Fault("", f"{word!r} is not allowed", did_you_mean(word, key.choices)))
        return Axis(path, "choice", words, tuple(float(place) for place in range(len(words))), text)
    written = _from_file(what[1:]) if what.startswith("@") else _range(what, key) if ".." in what else _list(what)
    values, families = [], []
    for one in written:
        value, family = parse_any(one, (key.family, *key.also)) if key.also else (parse(one, key.family), key.family)
        check_bounds(one, value, key if family == key.family else _unbound(key, family))
        values.append(value)
        families.append(family)
    if not values:
        raise InputError(Fault("", f"{what!r} has no values", HOW))
    if len(set(families)) > 1:
        raise InputError(Fault("", f"mixes {' and '.join(sorted(set(families)))}", "give one kind of quantity"))
    if len(set(values)) < len(values):
        twice = written[_second(values)]
        raise InputError(Fault("", f"has {twice!r} twice", "give each value once"))
    bare = tuple(values) if not FAMILIES[families[0]].si else tuple(written)
    if families[0] == "count":
        bare = tuple(int(value) for value in values)
    return Axis(path, families[0], bare, tuple(values), text)


def _second(values: list[float]) -> int:
    """Return where the first value that is there twice stands the second time."""
    seen: set[float] = set()
    for place, value in enumerate(values):
        if value in seen:
            return place
        seen.add(value)
    raise ValueError("no value is there twice")


def _near(path: str, known: list[str]) -> str:
    """Return the known keys nearest to one that is not."""
    told = did_you_mean(path, known)
    if told.startswith("did you mean"):
        return told
    alike = [key for key in known if key.rpartition(".")[2] == path.rpartition(".")[2]]
    alike.sort(key=lambda key: not key.endswith(path) and "[" not in key)
    return f"did you mean {' or '.join(alike[:3])}?" if alike else "e.g. drag.torque; `gears3d schema` tells all keys"


def _unbound(key: Key, family: str) -> Key:
    from dataclasses import replace

    return replace(key, family=family)


def _range(what: str, key: Key) -> list[str]:
    match = _RANGE.fullmatch(" ".join(what.split())) if len(what) <= LONGEST else None
    if match is None:
        raise InputError(Fault("", f"{what!r} is no range", HOW))
    first, last, spacing, number = match.groups()
    if spacing not in SPACINGS:
        raise InputError(Fault("", f"{what!r} is no range: {spacing!r} is neither lin nor log", HOW))
    if not number.isdecimal() or len(number) > DIGITS or int(number) < 1:
        raise InputError(Fault("", f"{number!r} is no number of values: the grid would be empty", "give 1 or more"))
    count = int(number)
    refuse_beyond(VALUE * count, "", f"the {count} values of an axis", "give fewer")
    low, unit = _split(first)
    high, own = _split(last)
    if unit and unit != own:
        low, high, own = *_si(first, last, key), ""
    if spacing == "log" and not (low > 0.0 and high > 0.0):
        raise InputError(Fault("", f"{what!r} has a bound that is not above 0", "a log range needs that, or use lin"))
    if count == 1 and low != high:
        raise InputError(Fault("", f"{what!r} is a range of one value", "give 2 or more, or one value alone"))
    numbers = np.linspace(low, high, count) if spacing == "lin" else np.geomspace(low, high, count)
    unit = own or (FAMILIES[key.family].si if unit else "")
    if key.family == "count" and not np.array_equal(numbers, np.round(numbers)):
        raise InputError(Fault("", f"{what!r} has values that are no whole numbers", "give a number that fits"))
    return [f"{float(f'{number:.14g}')!r} {unit}".strip() for number in numbers]


def _si(first: str, last: str, key: Key) -> tuple[float, float]:
    """Return two bounds of unlike units in the SI unit of the key's own family."""
    return parse(first, key.family), parse(last, key.family)


def _split(text: str) -> tuple[float, str]:
    match = re.fullmatch(rf"({_NUMBER})\s*(.*)", text.strip()) if len(text) <= LONGEST else None
    if match is None:
        raise InputError(Fault("", f"{text!r} is no quantity", HOW))
    return float(match[1]), match[2]


def _list(what: str) -> list[str]:
    """Return the parts of a list; one unit at the end serves those without."""
    parts = [part.strip() for part in what.split(",") if part.strip()]
    unit = _split(parts[-1])[1] if parts else ""
    return [part if _split(part)[1] else f"{part} {unit}".strip() for part in parts]


def _from_file(what: str) -> list[str]:
    """Return the first column of a file, a unit after its name serves all that have none."""
    name, _, unit = what.strip().partition(" ")
    try:
        lines = read_text(Path(name), MOST).splitlines()
    except (OSError, UnicodeDecodeError) as why:
        reason = getattr(why, "strerror", None) or "is no text"
        raise InputError(Fault("", f"cannot be read: {reason}", "name a file with one value a line", name)) from why
    cells = [line.split(",")[0].strip() for line in lines]
    cells = [cell for cell in cells if cell and not cell.startswith("#")]
    if cells and not re.match(_NUMBER, cells[0]):
        cells = cells[1:]  # names of the columns
    return [cell if _split(cell)[1] else f"{cell} {unit}".strip() for cell in cells]
