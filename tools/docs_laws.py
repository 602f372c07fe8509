"""The documentation's page of the laws in closed form: equation, source, arguments and picture of every function."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from docs_curves import CURVES
from docs_drawing import Plot, draw, save
from docs_motions import MOTIONS
from docs_reference import arguments, cell, prose, returned

PLOTS: dict[str, Callable[[], Plot]] = CURVES | MOTIONS


def laws(folder: Path) -> str:
    """Return the page of all functions of ``gears3d.laws``, and draw their pictures.

    Args:
        folder: of the page.
    """
    page = [
        "# Laws in closed form",
        "Made from `gears3d.laws`, one function per equation. Quantities are in SI units; pictures are drawn by the "
        "functions themselves when this site is built (`tools/docs`).",
    ]
    for name, module in modules():
        page.append(f"## {name.replace('_', ' ')}")
        page.append(prose(inspect.getdoc(module) or ""))
        for law in functions(module):
            page += section(f"{name}.{law.__name__}", law, folder)
    return "\n\n".join(page) + "\n"


def section(name: str, law: Callable[..., Any], folder: Path) -> Iterator[str]:
    """Yield the paragraphs of one law and draw its picture."""
    told = inspect.getdoc(law) or ""
    yield f"### {law.__name__}"
    yield f"`gears3d.laws.{name}({', '.join(inspect.signature(law).parameters)})`"
    yield prose(told)
    shown = PLOTS[name]()
    place = f"laws/{name.replace('.', '-')}.png"
    save(draw(shown), folder / place)
    lines = ", ".join(line for line in shown.lines if line)
    yield f"![{shown.y} over {shown.x}{f': {lines}' if lines else ''}]({place})"
    rows = [f"| `{one}` | {cell(words)} |" for one, words in arguments(told).items()]
    if rows:
        yield "| argument | what it is |\n|---|---|\n" + "\n".join(rows)
    if gives := returned(told):
        yield f"*Returns:* {cell(gives)}"


def modules() -> Iterator[tuple[str, Any]]:
    """Yield the modules of ``gears3d.laws`` by name."""
    package = importlib.import_module("gears3d.laws")
    for found in pkgutil.iter_modules(package.__path__):
        yield found.name, importlib.import_module(f"gears3d.laws.{found.name}")


def functions(module: Any) -> list[Callable[..., Any]]:
    """Return the public functions that a module defines, in its order."""
    own = inspect.getmembers(module, inspect.isfunction)
    mine = [one for name, one in own if one.__module__ == module.__name__ and not name.startswith("_")]
    return sorted(mine, key=lambda one: one.__code__.co_firstlineno)
