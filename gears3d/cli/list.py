"""``gears3d list``: everything that goes by a name."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Callable

Rows = list[dict[str, Any]]


def list_(
    what: Annotated[
        str, typer.Argument(metavar="[effects|scenarios|papers|models|starters|tests|units]", help="What to list.")
    ] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print it as JSON.")] = False,
) -> None:
    """List effects, shipped scenarios, papers, models, scenarios to start from, tests of a rig, or units.

    Example: gears3d list effects
    """
    from gears3d.errors import UsageError, did_you_mean

    if what and what not in LISTS:
        raise UsageError(f"unknown list {what!r}; {did_you_mean(what, list(LISTS))}")
    found = {name: rows() for name, rows in LISTS.items() if what in ("", name)}
    if as_json:
        from gears3d.cli.output import print_json

        print_json(found[what] if what else found)
    elif what:
        _show(what, found[what])
    else:
        _show_all(found)


def effects() -> Rows:
    """Return the kinds of effects with their parameters."""
    from gears3d.effects import catalogue

    found = []
    for kind, effect in catalogue().items():
        parameters = {
            name: {
                "family": one.family,
                "default": one.default,
                "low": _finite(one.low),
                "high": _finite(one.high),
                "choices": [*one.choices],
            }
            for name, one in effect.params.items()
        }
        found.append({"name": kind, "about": _first(effect), "place": effect.place, "parameters": parameters})
    return sorted(found, key=lambda one: (one["place"], one["name"]))


def scenarios() -> Rows:
    """Return the shipped scenarios by name."""
    from gears3d.scenario import load
    from gears3d.scenario.document import names

    loaded = {name: load(name) for name in names()}
    return [{"name": name, "about": one.title, "source": one.source} for name, one in loaded.items()]


def papers() -> Rows:
    """Return the papers whose figures are reproduced."""
    from gears3d.verification.papers import papers as every

    return [
        {"name": one.name, "about": one.citation, "rows": len(one.claims), "figures": len(one.figures)}
        for one in every()
    ]


def models() -> Rows:
    """Return the models."""
    from gears3d.simulation.models import ABOUT

    return [{"name": name, "about": about} for name, about in ABOUT.items()]


def starters() -> Rows:
    """Return the scenarios to start from."""
    from gears3d.scenario.starting import STARTERS

    return [{"name": name, "about": about} for name, about in STARTERS.items()]


def tests() -> Rows:
    """Return the tests of a rig: what makes their records, and what identifies from them."""
    from gears3d.virtual_tests import TESTS

    rows: Rows = []
    for name, test in TESTS.items():
        made = [f"synthesize --test {name}"] * test.synthesized + [f"bench {name}"] * test.in_engine
        rows.append({"name": name, "about": test.about, "made_by": made, "identify": [*test.laws]})
    return rows


def units() -> Rows:
    """Return the unit families."""
    from gears3d.units import FAMILIES

    return [
        {"name": name, "about": one.words, "si": one.si, "example": one.example, "units": [*one.units]}
        for name, one in FAMILIES.items()
    ]


# The lists.
LISTS: dict[str, Callable[[], Rows]] = {
    "effects": effects,
    "scenarios": scenarios,
    "papers": papers,
    "models": models,
    "starters": starters,
    "tests": tests,
    "units": units,
}


def _first(effect: type) -> str:
    """Return the first sentence of a docstring, without its source."""
    text = " ".join((inspect.getdoc(effect) or "").split("\n\n")[0].split())
    return text.split(" Source:")[0].replace("``", "").replace("*", "")


def _finite(value: float) -> float | None:
    return value if abs(value) < float("inf") else None


def _show(what: str, rows: Rows) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(highlight=False)
    table = Table(box=None, padding=(0, 2, 0, 0), show_header=False)
    table.add_column(no_wrap=True, overflow="fold", style="bold")
    place = ""
    for one in rows:
        if what == "effects" and one["place"] != place:
            place = one["place"]
            table.add_row(f"[dim]{place.replace('_', ' ')}[/]", "")
        table.add_row(escape(one["name"]), escape(one["about"] + _more(what, one)))
    console.print(table)


def _more(what: str, one: dict[str, Any]) -> str:
    if what == "effects":
        return " " + ", ".join(name if p["default"] is None else f"[{name}]" for name, p in one["parameters"].items())
    if what == "units":
        return f', e.g. "{one["example"]}"'
    if what == "tests":
        identified = ", ".join(f"identify {law}" for law in one["identify"])
        return f": gears3d {' or '.join(one['made_by'])}, then gears3d {identified}"
    return f": {one['rows']} rows, {one['figures']} figures" if what == "papers" else ""


def _show_all(found: dict[str, Rows]) -> None:
    for name, rows in found.items():
        names = (
            ", ".join(one["name"] for one in rows)
            if name != "scenarios"
            else f"{len(rows)} of the papers (gears3d list scenarios)"
        )
        typer.echo(f"{name}: {names}")
    typer.echo(f"more: gears3d list {'|'.join(found)}")
