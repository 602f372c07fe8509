"""Reads tables of a document as their models, and notes every fault with its key path, in the order of the file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.scenario.document import Document
from gears3d.scenario.models import Key, keys_of
from gears3d.units import FAMILIES, parse

MOST_HINTS = 100  # faults with a guess of what was meant: each takes a while
FAULTY = object()  # in place of a value that has a fault: it is read as None


class Reader:
    """Reads tables of a document; afterwards ``faults`` and ``uncertainty`` are complete."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.faults: dict[Fault, None] = {}  # each once, in the order in which they are found
        self.uncertainty: dict[str, float] = {}
        self.families: dict[str, str] = {}  # of each value that may be of several

    def fault(self, key: str, message: str, remedy: str = "") -> None:
        """Note a fault at a key path."""
        self.faults[Fault(key, message, remedy, self.document.file_of(key))] = None

    def meant(self, word: str, known: Sequence[str]) -> str:
        """Return what a word was probably meant to be."""
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
        self.fault(place, f"{value!r} is not a table", f"write [{place}] and its keys below")
        return {}

    def unknown(self, table: Mapping[str, Any], place: str, known: Sequence[str]) -> None:
        """Note every key that is not known."""
        for name in table:
            if name not in known:
                self.fault(below(place, name), "is not a known key", self.meant(name, known))

    def read(self, table: type, written: Any, place: str, others: Iterable[str] = (), **given: Any) -> Any:
        """Return a table as its model, ``None`` for what is missing or faulty; ``given`` values are SI already.

        ``others`` are names that are read elsewhere.
        """
        written, keys = self.table(written, place), keys_of(table)
        self.unknown(written, place, [*keys, *others])
        own = {name: value for name, value in written.items() if name in keys}
        while True:
            try:
                return _adapter(table).validate_python({**given, **own}, context=_Place(self, place, given.keys()))
            except ValidationError as error:
                for each in error.errors(include_url=False):
                    name = str(each["loc"][0])
                    if each["type"] == "missing":
                        about = f" ({keys[name].doc})" if keys[name].doc else ""
                        self.fault(below(place, name), f"is missing{about}", _example(name, keys[name]))
                    else:
                        told = each.get("ctx", {})
                        self.fault(below(place, name), told["message"], told["remedy"])
                    own[name] = FAULTY

    def value(self, key: Key, written: Any, here: str) -> Any:
        """Return the SI value of what is written at a key path, with its uncertainty noted."""
        uncertainty = None
        if isinstance(written, Mapping) and key.family != "text":
            self.unknown(written, here, ["value", "uncertainty"])
            if "value" not in written:
                remedy = 'e.g. { value = "0.22 N m", uncertainty = "5 %" }'
                raise InputError(Fault("", "a table here needs a value", remedy))
            written, uncertainty = written["value"], written.get("uncertainty")
        value, family = key.value(written)
        if key.also:
            self.families[here] = family
        if uncertainty is not None:
            self.uncertainty[here] = _uncertainty(uncertainty, value, family)
        return value


@dataclass
class _Place:
    """Where a table stands: what its model asks for the SI values of its keys."""

    reader: Reader
    place: str
    given: Iterable[str]

    def value(self, key: Key, written: Any, name: str) -> Any:
        if written is FAULTY:
            return None
        if name in self.given:
            return written
        return self.reader.value(key, written, below(self.place, name))


@cache
def _adapter(table: type) -> TypeAdapter[Any]:
    return TypeAdapter(table)


def below(place: str, name: str) -> str:
    """Return the path of a key in a table."""
    return f"{place}.{name}" if place else name


def _parent(place: str) -> str:
    return place[: max(place.rfind("."), place.rfind("["), 0)]


def _places(item: Any, place: str) -> Iterator[str]:
    """Yield every key path of a document, in order."""
    if isinstance(item, Mapping):
        inner = [(below(place, name), value) for name, value in item.items()]
    elif isinstance(item, list):
        inner = [(f"{place}[{index}]", value) for index, value in enumerate(item)]
    else:
        return
    for here, value in inner:
        yield here
        yield from _places(value, here)


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
