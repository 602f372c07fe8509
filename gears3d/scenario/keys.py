"""What format 1 has: its JSON Schema, made from the models, and every key of a scenario by its path."""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import inf
from typing import Any

from gears3d.effects import catalogue
from gears3d.scenario.build import Scenario, key_of
from gears3d.scenario.document import read_text
from gears3d.scenario.models import (
    DEVIATIONS,
    MOUNTINGS,
    RELIEFS,
    REQUIRED,
    SECTIONS,
    GearSpec,
    Harmonic,
    Heading,
    Key,
    MisalignmentTable,
    ReliefTable,
    Sensor,
    keys_of,
)
from gears3d.units import FAMILIES, show

_NUMBER = r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?"
_LAST = re.compile(r"\[-(\d+)\]")


def schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of format 1; unit families are in the descriptions, as no pattern has them."""
    properties: dict[str, Any] = {
        "format": {"const": 1},
        "extends": {
            "type": "string",
            "description": "file, relative to this one, or shipped scenario to start from",
        },
        "versions": {"type": "object", "description": "what made this file"},
    }
    properties |= {name: _key(key) for name, key in keys_of(Heading).items()}
    properties |= {name: _table(keys_of(table)) for name, table in SECTIONS.items()}
    reliefs = {name: {**_table(keys_of(ReliefTable)), "description": about} for name, about in RELIEFS.items()}
    profiles = {name: _table(keys_of(table)) for name, table in DEVIATIONS.items()}
    gear = _table(keys_of(GearSpec))
    gear["properties"] |= reliefs | profiles | {name: _table(keys_of(table)) for name, table in MOUNTINGS.items()}
    properties["gears"]["properties"] |= {**reliefs, **profiles, "drive": gear, "loose": gear}
    properties["mount"]["properties"]["misalignment"] = _table(keys_of(MisalignmentTable))
    sensor = _table(keys_of(Sensor))
    properties["sensors"]["properties"] |= {"drive": sensor, "loose": sensor}
    properties["motion"]["properties"]["harmonics"] = {"type": "array", "items": _table(keys_of(Harmonic))}
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


def key_paths(scenario: Scenario) -> dict[str, Key]:
    """Return the keys of a scenario with their families and bounds, by path; it has its own harmonics and effects.

    >>> from gears3d.scenario import load
    >>> key_paths(load("scenarios/rigaud-2020/fig5-20rpm.toml"))["motion.harmonics[0].amplitude"].also
    ('angle', 'acceleration')
    """
    written = _written(scenario)
    found = _paths("", SECTIONS)
    for gear in ("drive", "loose"):
        found |= _paths("gears.", {gear: GearSpec}) | _paths("sensors.", {gear: Sensor})
        found |= _paths(f"gears.{gear}.", MOUNTINGS)
    for place in ("gears.", "gears.drive.", "gears.loose."):
        found |= _paths(place, dict.fromkeys(RELIEFS, ReliefTable) | DEVIATIONS)
    found |= _paths("mount.", {"misalignment": MisalignmentTable})
    for index, _ in enumerate(written.get("motion", {}).get("harmonics", ())):
        found |= _paths("motion.", {f"harmonics[{index}]": Harmonic})
    for index, effect in enumerate(written.get("effect", ())):
        params = catalogue()[effect["kind"]].params
        found |= {f"effect[{index}].{name}": key_of(param) for name, param in params.items()}
    return found


def whole_path(scenario: Scenario, path: str) -> str:
    """Return a path with its places counted from the front: [-1] is the last of a list, [-2] the one before.

    >>> from gears3d.scenario import load
    >>> whole_path(load("scenarios/rigaud-2020/fig5-20rpm.toml"), "motion.harmonics[-1].phase")
    'motion.harmonics[0].phase'
    """
    written = _written(scenario)
    sizes = {
        "motion.harmonics": len(written.get("motion", {}).get("harmonics", ())),
        "effect": len(written.get("effect", ())),
    }
    match = _LAST.search(path)
    if match is None or path[: match.start()] not in sizes:
        return path
    return f"{path[: match.start()]}[{sizes[path[: match.start()]] - int(match[1])}]{path[match.end() :]}"


def written_value(scenario: Scenario, path: str) -> Any:
    """Return what stands at a key path, without its uncertainty; ``None`` when nothing does.

    >>> from gears3d.scenario import load
    >>> written_value(load("scenarios/rigaud-2020/fig5-20rpm.toml"), "motion.harmonics[0].amplitude")
    '20 rpm'
    """
    place: Any = _written(scenario)
    for step in re.findall(r"[^.\[\]]+", path):
        try:
            place = place[int(step) if isinstance(place, list) else step]
        except (KeyError, IndexError, ValueError, TypeError):
            return None
    return place["value"] if isinstance(place, Mapping) and "value" in place else place


def _written(scenario: Scenario) -> dict[str, Any]:
    return read_text(scenario.document, scenario.path).toml.unwrap()


def _paths(place: str, tables: Mapping[str, type]) -> dict[str, Key]:
    return {f"{place}{table}.{name}": key for table, known in tables.items() for name, key in keys_of(known).items()}
