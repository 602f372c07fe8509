"""The data sheet of a pair as a result, and its lines with their units, for people and for programs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from gears3d.gears import Pair
from gears3d.gears.sheet import Quantity, data_sheet
from gears3d.results import Result
from gears3d.scenario import Scenario
from gears3d.units import FAMILIES, show


@dataclass(frozen=True)
class DataSheet(Result):
    """The data sheet of a pair.

    Args:
        pair: the pair.
        quantities: its lines.
        speed: mean speed of the drive gear [rad/s].
        title: of the scenario.
        source: of the scenario.
    """

    pair: Pair
    quantities: tuple[Quantity, ...]
    speed: float = 0.0
    title: str = ""
    source: str = ""


def data_sheet_of(scenario: Scenario) -> DataSheet:
    """Return the data sheet of a scenario's pair, in the terms of ISO 21771."""
    pair, gears = scenario.pair(), scenario.gears
    quantities = data_sheet(pair, scenario.motion.mean, (gears.drive.density, gears.loose.density))
    return DataSheet(pair, tuple(quantities), scenario.motion.mean, scenario.title, scenario.source)


def rows(sheet: Iterable[Quantity], digits: int = 6) -> list[tuple[str, str, str, tuple[str, ...]]]:
    """Return a data sheet as people read it.

    >>> rows([Quantity("backlash", "normal backlash", "j_bn", "length", (0.00025,))])
    [('backlash', 'normal backlash', 'j_bn', ('250 um',))]
    """
    return [
        (line.group, line.name, line.symbol, tuple(_text(value, line.family, digits) for value in line.values))
        for line in sheet
    ]


def tables(sheet: Iterable[Quantity]) -> list[dict[str, Any]]:
    """Return a data sheet as JSON can hold it.

    >>> tables([Quantity("gears", "number of teeth", "z", "count", (17, 43))])[0]["loose"]
    43
    """
    found = []
    for line in sheet:
        table: dict[str, Any] = {
            "group": line.group,
            "name": line.name,
            "symbol": line.symbol,
            "unit": FAMILIES[line.family].si,
            "source": _source(line.source),
        }
        names = ("value",) if len(line.values) == 1 else ("drive", "loose")
        found.append(table | dict(zip(names, line.values, strict=True)))
    return found


def _source(source: str) -> str:
    return f"ISO 21771:2007 {source}" if source.startswith("(") else source


def _text(value: float | None, family: str, digits: int) -> str:
    return "none" if value is None else show(value, family, digits)
