"""The JSON Schema of format 1, for editors; made from the same tables that the reader uses."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Any

from gears3d.effects import catalogue
from gears3d.scenario import keys
from gears3d.scenario.effect_list import key_of
from gears3d.scenario.keys import REQUIRED, Key
from gears3d.units import FAMILIES, show

_NUMBER = r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?"


def schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of format 1.

    Returns:
        A document that JSON can hold; unit families are in the descriptions, as a pattern cannot tell them apart.
    """
    properties: dict[str, Any] = {
        "format": {"const": 1},
        "extends": {
            "type": "string",
            "description": "file, relative to this one, or shipped scenario to start from",
        },
        "versions": {"type": "object", "description": "what made this file"},
    }
    properties |= {name: _key(key) for name, key in keys.TOP.items()}
    properties |= {name: _table(known) for name, known in keys.SECTIONS.items()}
    reliefs = {name: {**_table(keys.RELIEF), "description": about} for name, about in keys.RELIEFS.items()}
    profiles = {name: _table(known) for name, known in keys.DEVIATIONS.items()}
    gear = _table(keys.GEAR)
    gear["properties"] |= reliefs | profiles | {name: _table(known) for name, known in keys.MOUNTINGS.items()}
    properties["gears"]["properties"] |= {**reliefs, **profiles, "drive": gear, "loose": gear}
    properties["mount"]["properties"]["misalignment"] = _table(keys.MISALIGNMENT)
    sensor = _table(keys.SENSOR)
    properties["sensors"]["properties"] |= {"drive": sensor, "loose": sensor}
    properties["motion"]["properties"]["harmonics"] = {"type": "array", "items": _table(keys.HARMONIC)}
    properties["effect"] = {"type": "array", "items": {"oneOf": [_effect(kind) for kind in catalogue().values()]}}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "gears3d scenario, format 1",
        "type": "object",
        "required": ["format"],
        "additionalProperties": False,
        "properties": properties,
    }


def _table(known: Mapping[str, Key]) -> dict[str, Any]:
    """Return the schema of a table; nothing is required, because ``extends`` may give it."""
    properties = {name: _key(key) for name, key in known.items()}
    return {"type": "object", "additionalProperties": False, "properties": properties}


def _effect(kind: Any) -> dict[str, Any]:
    table = _table({name: key_of(param) for name, param in kind.params.items()})
    table["properties"] = {"kind": {"const": kind.kind}, **table["properties"]}
    table["required"] = ["kind", *(name for name, param in kind.params.items() if param.default is None)]
    table["description"] = (kind.__doc__ or "").strip().split("\n")[0]
    return table


def _key(key: Key) -> dict[str, Any]:
    """Return the schema of a value, bare or with an uncertainty."""
    bare = _bare(key)
    about = {"description": _about(key)} if _about(key) else {}
    if key.default is not REQUIRED and key.default is not None:
        about["default"] = key.default
    if key.family == "text":
        return {**bare, **about}
    uncertain = {
        "type": "object",
        "additionalProperties": False,
        "required": ["value"],
        "properties": {"value": bare, "uncertainty": {"type": ["string", "number"]}},
    }
    return {"anyOf": [bare, uncertain], **about}


def _bare(key: Key) -> dict[str, Any]:
    if key.family == "text":
        return {"type": "string"}
    if key.family == "choice":
        return {"enum": list(key.choices)}
    family = FAMILIES[key.family]
    if family.si:
        return {"type": "string", "pattern": rf"^\s*{_NUMBER}\s*\S", "examples": [family.example]}
    number: dict[str, Any] = {"type": "integer" if key.family == "count" else "number"}
    if key.low > -inf:
        number["exclusiveMinimum" if key.above else "minimum"] = key.low
    if key.high < inf:
        number["maximum"] = key.high
    return number if key.family == "count" else {"anyOf": [number, {"type": "string", "pattern": rf"^\s*{_NUMBER}"}]}


def _about(key: Key) -> str:
    """Return what a key is, its family and its bounds."""
    words = [key.doc] if key.doc else []
    if key.family in FAMILIES and FAMILIES[key.family].si:
        kinds = " or ".join(FAMILIES[family].words for family in (key.family, *key.also))
        words += [kinds] if kinds not in words else []
        if key.low > -inf:
            words.append(f"{'more than' if key.above else 'at least'} {show(key.low, key.family)}")
        if key.high < inf:
            words.append(f"at most {show(key.high, key.family)}")
    return "; ".join(words)
