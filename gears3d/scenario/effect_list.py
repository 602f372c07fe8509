"""Reads ``[[effect]]``: a kind and its parameters become an effect object."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gears3d.effects import Param, catalogue
from gears3d.errors import InputError
from gears3d.scenario.keys import REQUIRED, Key
from gears3d.scenario.reader import Reader
from gears3d.units import FAMILIES


def read_effects(reader: Reader, written: Any) -> tuple[Any, ...]:
    """Return the effects of a scenario.

    Args:
        reader: takes the faults.
        written: the list of tables.

    Returns:
        Effect objects in order; the faulty ones are left out.
    """
    if not isinstance(written, list):
        reader.fault("effect", "is no list", "write [[effect]] with double brackets")
        return ()
    effects = [_effect(reader, item, f"effect[{index}]") for index, item in enumerate(written)]
    return tuple(effect for effect in effects if effect is not None)


def key_of(param: Param) -> Key:
    """Return a parameter as a key of the format.

    Args:
        param: of an effect.
    """
    return Key(
        param.family,
        FAMILIES[param.family].words if param.family in FAMILIES else "",
        REQUIRED if param.default is None else param.default,
        low=param.low,
        high=param.high,
        choices=param.choices,
        also=param.also,
    )


def _effect(reader: Reader, written: Any, place: str) -> Any:
    table = reader.table(written, place)
    kinds = catalogue()
    kind = table.pop("kind", None)
    if kind is None:
        reader.fault(f"{place}.kind", "is missing", "known: " + ", ".join(kinds))
        return None
    if not isinstance(kind, str) or kind not in kinds:
        reader.fault(f"{place}.kind", f"{kind!r} is no known effect", reader.meant(str(kind), list(kinds)))
        return None
    params: Mapping[str, Param] = kinds[kind].params
    before = len(reader.faults)
    reader.unknown(table, place, list(params))
    values = {name: _value(reader, table, place, name, param) for name, param in params.items()}
    if len(reader.faults) > before:
        return None
    for name, param in params.items():
        if param.also:
            values[f"{name}_family"] = reader.families.get(f"{place}.{name}", param.family)
    try:
        return kinds[kind](**values)
    except InputError as why:
        for fault in why.faults:
            reader.fault(f"{place}.{fault.key}".rstrip("."), fault.message, fault.remedy)
    except ValueError as why:
        reader.fault(place, str(why))
    return None


def _value(reader: Reader, table: dict[str, Any], place: str, name: str, param: Param) -> Any:
    """Read a parameter; a default is SI already."""
    if name not in table and param.default is not None:
        return param.default
    return reader.value(table, place, name, key_of(param))
