"""Lines of a data sheet with their units on, for people and for programs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from gears3d.gears.sheet import Quantity
from gears3d.units import FAMILIES, show


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
