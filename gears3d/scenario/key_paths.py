"""Every key that a scenario has or may have, by its path."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gears3d.effects import catalogue
from gears3d.scenario import keys
from gears3d.scenario.document import read_text
from gears3d.scenario.effect_list import key_of
from gears3d.scenario.keys import Key

if TYPE_CHECKING:
    from gears3d.scenario.model import Scenario

_LAST = re.compile(r"\[-(\d+)\]")


def key_paths(scenario: Scenario) -> dict[str, Key]:
    """Return the keys of a scenario with their families and bounds, by path.

    Args:
        scenario: its harmonics and effects are those that it has.

    >>> from gears3d.scenario import load
    >>> key_paths(load("scenarios/rigaud-2020/fig5-20rpm.toml"))["motion.harmonics[0].amplitude"].also
    ('angle', 'acceleration')
    """
    written = _written(scenario)
    found = {f"{section}.{name}": key for section, table in keys.SECTIONS.items() for name, key in table.items()}
    for gear in ("drive", "loose"):
        found |= {f"gears.{gear}.{name}": key for name, key in keys.GEAR.items()}
        found |= {f"sensors.{gear}.{name}": key for name, key in keys.SENSOR.items()}
        found |= _tables(f"gears.{gear}", keys.MOUNTINGS)
    for place in ("gears", "gears.drive", "gears.loose"):
        found |= _tables(place, dict.fromkeys(keys.RELIEFS, keys.RELIEF) | keys.DEVIATIONS)
    found |= _tables("mount", {"misalignment": keys.MISALIGNMENT})
    for index, _ in enumerate(written.get("motion", {}).get("harmonics", ())):
        found |= _tables("motion", {f"harmonics[{index}]": keys.HARMONIC})
    for index, effect in enumerate(written.get("effect", ())):
        params = catalogue()[effect["kind"]].params
        found |= {f"effect[{index}].{name}": key_of(param) for name, param in params.items()}
    return found


def whole_path(scenario: Scenario, path: str) -> str:
    """Return a path with its places counted from the front.

    Args:
        scenario: has the lists.
        path: with [-1] for the last of a list, [-2] for the one before.

    >>> from gears3d.scenario import load
    >>> whole_path(load("scenarios/rigaud-2020/fig5-20rpm.toml"), "motion.harmonics[-1].phase")
    'motion.harmonics[0].phase'
    """
    written = _written(scenario)
    sizes = {"motion.harmonics": len(written.get("motion", {}).get("harmonics", ())),
             "effect": len(written.get("effect", ()))}  # fmt: skip
    match = _LAST.search(path)
    if match is None or path[: match.start()] not in sizes:
        return path
    return f"{path[: match.start()]}[{sizes[path[: match.start()]] - int(match[1])}]{path[match.end() :]}"


def written_value(scenario: Scenario, path: str) -> Any:
    """Return what stands at a path, without its uncertainty; ``None`` when nothing does.

    Args:
        scenario: where it stands.
        path: of a key, as :func:`key_paths` has it.

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


def _tables(place: str, tables: Mapping[str, Mapping[str, Key]]) -> dict[str, Key]:
    return {f"{place}.{table}.{name}": key for table, known in tables.items() for name, key in known.items()}
