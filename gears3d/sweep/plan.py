"""Plan of a sweep: scenario, varied keys and their values, model, times."""

from __future__ import annotations

import hashlib
import json
import pickle
import re
from dataclasses import asdict, dataclass
from functools import cached_property, lru_cache
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.inputs import read_text, refuse_beyond
from gears3d.scenario.keys import key_paths, whole_path
from gears3d.units import FAMILIES, parse, parse_any
from gears3d.version import __version__

if TYPE_CHECKING:
    from gears3d.scenario import Scenario
    from gears3d.scenario.models import Key


HOW = 'write "KEY=A..B UNIT lin N", "KEY=A..B UNIT log N", "KEY=a,b,c UNIT" or "KEY=@file.csv UNIT"'
LONGEST, DIGITS = 500, 15  # Characters of a range, and of its number of values
VALUE = 200  # Bytes of memory for a value, as a number and as it is written
MOST = 1 << 26  # Bytes of a file with values
_RANGE = re.compile(r"(.+?)\s*\.\.\s*(.+?)\s+(\w+)\s+([+-]?\S+)")
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
NOT_VARIED = {
    "run.duration": "every point runs a number of whole periods: --periods",
    "run.settle": "every point leaves out a number of whole periods: --settle",
    "run.output_rate": "a sweep keeps no signals",
}
SPACINGS = ("lin", "log")
FORMAT = 1  # Of the plan's file
DIRECTIONS = ("up", "down")


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
        (key if family == key.family else _unbound(key, family)).check_bounds(one, value)
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
        raise InputError(Fault("", f"{what!r} is not a range", HOW))
    first, last, spacing, number = match.groups()
    if spacing not in SPACINGS:
        raise InputError(Fault("", f"{what!r} is not a range: {spacing!r} is neither lin nor log", HOW))
    if not number.isdecimal() or len(number) > DIGITS or int(number) < 1:
        raise InputError(Fault("", f"{number!r} is not a number of values: the grid would be empty", "give 1 or more"))
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
        raise InputError(Fault("", f"{text!r} is not a quantity", HOW))
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
        reason = getattr(why, "strerror", None) or "is not a text"
        raise InputError(Fault("", f"cannot be read: {reason}", "name a file with one value a line", name)) from why
    cells = [line.split(",")[0].strip() for line in lines]
    cells = [cell for cell in cells if cell and not cell.startswith("#")]
    if cells and not re.match(_NUMBER, cells[0]):
        cells = cells[1:]  # names of the columns
    return [cell if _split(cell)[1] else f"{cell} {unit}".strip() for cell in cells]


@dataclass(frozen=True)
class Plan:
    """A sweep as data that any process can take.

    Args:
        document: the resolved scenario as TOML text.
        path: its file, from which files that it names are found; empty for none.
        model: ``"rigid"``, ``"lubricated"``, ``"plastic"`` or ``"bullet"``.
        measures: groups of variables.
        axes: what is varied; the one that is followed is the last.
        follow: whether the motion is followed along the last axis, up and down, each point from where one ended.
        periods: whole periods that a point runs.
        settle: of these, left out at the begin.
        keep: of these, at the end, of which a section is kept.
        strobe: when in a period sections are taken, in cycles.
        seed: of all random numbers.
    """

    document: str
    path: str
    model: str
    measures: tuple[str, ...]
    axes: tuple[Axis, ...]
    follow: bool
    periods: int
    settle: int
    keep: int
    strobe: float
    seed: int

    @cached_property
    def key(self) -> str:
        """Digits that change with scenario, model, axes, times, seed, version and compiled kernels."""
        from gears3d.kernels import sources

        whole = {**self.table(), "version": __version__, "kernels": sources(), "format": FORMAT}
        return hashlib.sha256(json.dumps(whole, sort_keys=True).encode()).hexdigest()[:32]

    def table(self) -> dict[str, Any]:
        """Return the plan as JSON can hold it."""
        axes = [{**asdict(axis), "values": [value.hex() for value in axis.values]} for axis in self.axes]
        return {**asdict(self), "axes": axes}

    @property
    def dims(self) -> tuple[tuple[str, int], ...]:
        """Names and sizes of the grid's dimensions, the last one running fastest."""
        ways = (("direction", len(DIRECTIONS)),) if self.follow else ()
        return (*ways, *((axis.name, len(axis)) for axis in self.axes))

    @property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the grid's dimensions."""
        return tuple(size for _, size in self.dims)

    @property
    def size(self) -> int:
        """Number of points."""
        return prod(self.shape)

    @property
    def chain(self) -> int:
        """Points that follow each other and cannot be parted."""
        return len(self.axes[-1]) if self.follow else 1

    def places(self, points: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the places of points on each axis, (n,) each.

        A followed axis is run backwards on the way down.

        Args:
            points: numbers of points, (n,).
        """
        found = list(np.unravel_index(points, self.shape))
        if self.follow:
            down = found[0] == 1
            found = found[1:]
            found[-1] = np.where(down, len(self.axes[-1]) - 1 - found[-1], found[-1])
        return tuple(found)

    def values(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """Return the SI values of points by key, (n,) each.

        Args:
            points: numbers of points, (n,).
        """
        return {
            axis.key: np.array(axis.values)[place] for axis, place in zip(self.axes, self.places(points), strict=True)
        }

    def changes(self, point: int) -> dict[str, Any]:
        """Return what a point sets over the scenario, as it would be written.

        Args:
            point: its number.
        """
        places = self.places(np.array([point]))
        told = {axis.key: axis.written[int(place[0])] for axis, place in zip(self.axes, places, strict=True)}
        return {**told, "run.duration": f"{self.periods} periods", "run.settle": f"{self.settle} periods"}

    def seeds(self, points: np.ndarray) -> np.ndarray:
        """Return the seed of each point, (n,); it depends on the values there and on nothing else of the grid.

        Args:
            points: numbers of points, (n,).
        """
        values = self.values(points)
        if "run.seed" in values:
            return values["run.seed"].astype(np.int64)
        found = np.full(len(points), self.seed, dtype=np.uint64)
        for name in sorted(values):
            told = hashlib.blake2b(name.encode(), digest_size=8).digest()
            found = _mixed(found ^ np.uint64(int.from_bytes(told, "little")))
            found = _mixed(found ^ (values[name] + 0.0).view(np.uint64))
        return (found >> np.uint64(16)).astype(np.int64)

    def scenario(self, point: int | None = None) -> Any:
        """Return the scenario, or that of one point.

        Args:
            point: its number.

        Raises:
            InputError: the values of the point do not go together.
        """
        from gears3d.scenario.build import build
        from gears3d.scenario.document import apply

        document = pickle.loads(_read(self.document, self.path))
        if point is not None:
            seed = int(self.seeds(np.array([point]))[0])
            apply(document, {**self.changes(point), "run.seed": seed})
        return build(document)


@lru_cache(maxsize=4)
def _read(text: str, path: str) -> bytes:
    """Return a document read once a process; reading it takes six times as long as unpickling it."""
    from gears3d.scenario.document import read_text

    return pickle.dumps(read_text(text, Path(path) if path else None))


def _mixed(numbers: np.ndarray) -> np.ndarray:
    """Return numbers of 64 bits stirred so that every bit depends on all (splitmix64)."""
    z = numbers + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def from_table(table: dict[str, Any]) -> Plan:
    """Return the plan that :meth:`Plan.table` gave."""
    axes = [
        Axis(a["key"], a["family"], tuple(a["written"]), tuple(map(float.fromhex, a["values"])), a["text"])
        for a in table["axes"]
    ]
    return Plan(**{**table, "axes": tuple(axes), "measures": tuple(table["measures"])})
