"""Turns what was written into SI values, key by key, and collects every fault on the way."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import Any

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.scenario.document import Document
from gears3d.scenario.keys import REQUIRED, Key
from gears3d.units import FAMILIES, parse, parse_any, show

MOST_HINTS = 100
"""Faults with a guess of what was meant."""


class Reader:
    """Reads values of a document; afterwards ``faults`` and ``uncertainty`` are complete.

    Args:
        document: the merged document.
    """

    def __init__(self, document: Document) -> None:
        self.document = document
        self.faults: list[Fault] = []
        self.uncertainty: dict[str, float] = {}
        self.families: dict[str, str] = {}
        """The family of each value that may be of several."""

    def fault(self, key: str, message: str, remedy: str = "") -> None:
        """Note a fault at a key path."""
        self.faults.append(Fault(key, message, remedy, self.document.file_of(key)))

    def meant(self, word: str, known: Sequence[str]) -> str:
        """Return what a word was probably meant to be; nothing beyond some faults, as a guess takes a while."""
        return did_you_mean(word, known) if len(self.faults) < MOST_HINTS else ""

    def in_order(self) -> list[Fault]:
        """Return the faults in the order of the file; a missing key stands at the end of its table."""
        places: dict[str, int] = {}
        last: dict[str, int] = {}
        for index, place in enumerate(_places(self.document.toml, "")):
            places[place] = index
            while place and last.get(place) != index:
                last[place] = index
                place = _parent(place)

        def position(fault: Fault) -> tuple[int, int]:
            if fault.key in places:
                return places[fault.key], 0
            key = fault.key
            while key and key not in places:
                key = _parent(key)
            return last[key] if key else -1, 1

        return sorted(self.faults, key=position)

    def table(self, value: Any, place: str) -> dict[str, Any]:
        """Return a table, or an empty one with a fault."""
        if isinstance(value, Mapping):
            return dict(value)
        self.fault(place, f"{value!r} is no table", f"write [{place}] and its keys below")
        return {}

    def keys(
        self, table: Mapping[str, Any], place: str, known: Mapping[str, Key], more: Iterable[str] = ()
    ) -> dict[str, Any]:
        """Read all keys of a table.

        Args:
            table: as written.
            place: its key path.
            known: what it may hold.
            more: names that others read.

        Returns:
            SI value of every known key; ``None`` for what is missing or faulty.
        """
        self.unknown(table, place, [*known, *more])
        return {name: self.value(table, place, name, key) for name, key in known.items()}

    def unknown(self, table: Mapping[str, Any], place: str, known: list[str]) -> None:
        """Note every key that is not known."""
        for name in table:
            if name not in known:
                here = f"{place}.{name}" if place else name
                self.fault(here, "is not a known key", self.meant(name, known))

    def value(self, table: Mapping[str, Any], place: str, name: str, key: Key) -> Any:
        """Read one key; a missing required one is a fault."""
        here = f"{place}.{name}" if place else name
        written = table.get(name)
        if written is None:
            if key.default is REQUIRED:
                about = f" ({key.doc})" if key.doc else ""
                self.fault(here, f"is missing{about}", _example(name, key))
                return None
            if key.default is None:
                return None
            written = key.default
        uncertainty = None
        if isinstance(written, Mapping) and key.family != "text":
            self.unknown(written, here, ["value", "uncertainty"])
            if "value" not in written:
                self.fault(here, "a table here needs a value", 'e.g. { value = "0.22 N m", uncertainty = "5 %" }')
                return None
            written, uncertainty = written["value"], written.get("uncertainty")
        try:
            value = self._convert(written, here, key)
            if uncertainty is not None:
                self.uncertainty[here] = _uncertainty(uncertainty, value, self.families.get(here, key.family))
        except InputError as why:
            for fault in why.faults:
                self.fault(here, fault.message, fault.remedy)
            return None
        return value

    def _convert(self, written: Any, here: str, key: Key) -> Any:
        if key.family == "text":
            if isinstance(written, str):
                return str(written)
            raise InputError(Fault("", f"{written!r} is no text", "put it in quotes"))
        if key.family == "choice":
            if isinstance(written, str) and written in key.choices:
                return str(written)
            raise InputError(Fault("", f"{written!r} is not allowed", did_you_mean(str(written), key.choices)))
        if key.also:
            value, self.families[here] = parse_any(written, (key.family, *key.also))
            key = replace(key, family=self.families[here])
        else:
            value = parse(written, key.family)
        check_bounds(written, value, key)
        return int(value) if key.family == "count" else value


def _parent(place: str) -> str:
    return place[: max(place.rfind("."), place.rfind("["), 0)]


def _places(item: Any, place: str) -> Iterator[str]:
    """Yield every key path of a document, in order."""
    if isinstance(item, Mapping):
        inner = [(f"{place}.{name}" if place else name, value) for name, value in item.items()]
    elif isinstance(item, list):
        inner = [(f"{place}[{index}]", value) for index, value in enumerate(item)]
    else:
        return
    for here, value in inner:
        yield here
        yield from _places(value, here)


def check_bounds(written: Any, value: float, key: Key) -> None:
    """Raise an ``InputError`` with one fault when a value is out of a key's bounds.

    Args:
        written: the value as written, for the message.
        value: SI.
        key: with the bounds.

    Raises:
        InputError: it is.
    """
    low = value <= key.low if key.above else value < key.low
    if not low and value <= key.high:
        return
    least = f"more than {show(key.low, key.family)}" if key.above else f"at least {show(key.low, key.family)}"
    if key.low == -inf:
        allowed = f"at most {show(key.high, key.family)}"
    else:
        allowed = least if key.high == inf else f"{least} and at most {show(key.high, key.family)}"
    shown = repr(str(written)) if isinstance(written, str) else f"{written}"
    raise InputError(Fault("", f"is {shown}; must be {allowed}", key.why))


def _uncertainty(written: Any, value: Any, family: str) -> float:
    """Return a standard uncertainty in SI; per cent are of the value, anything else is of the value's family."""
    if family in ("choice", "text"):
        raise InputError(Fault("", "a word has no uncertainty", "leave it out"))
    if isinstance(written, str) and written.rstrip().endswith(("%", "percent")):
        size = parse(written, "ratio") * abs(value)
    else:
        size = parse(written, "ratio" if family == "count" else family)
    if size < 0:
        raise InputError(Fault("", f"uncertainty {written!r} is negative", "give a standard deviation"))
    return size


def _example(name: str, key: Key) -> str:
    if key.family == "choice":
        return f'e.g. {name} = "{key.choices[0]}"'
    family = FAMILIES.get(key.family)
    if family is None:
        return f'{name} = "..."'
    return f'e.g. {name} = "{family.example}"' if family.si else f"e.g. {name} = {family.example}"
