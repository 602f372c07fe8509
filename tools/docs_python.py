"""Pages of the Python interface: the names that packages export, by sphinx's autodoc."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from types import ModuleType
from typing import Any

PACKAGES = (
    "gears3d",
    "gears3d.scenario",
    "gears3d.effects",
    "gears3d.gears",
    "gears3d.stiffness",
    "gears3d.simulation",
    "gears3d.recording",
    "gears3d.signals",
    "gears3d.comparison",
    "gears3d.bench",
    "gears3d.measured.readers",
    "gears3d.measured.checks",
    "gears3d.measured.segmentation",
    "gears3d.identify",
    "gears3d.diagnosis",
    "gears3d.sweep",
    "gears3d.runs",
    "gears3d.results",
    "gears3d.units",
    "gears3d.errors",
)
"""Packages and modules with a page, in the order of the list. Laws and effects have pages of their own in addition."""


def python() -> dict[str, str]:
    """Return all pages of the Python interface by name, the first of them the list of the others."""
    pages, at_home = {}, {id(value) for _, value in names("gears3d")}
    for package in PACKAGES:
        known = set() if package == "gears3d" else at_home
        pages[page_of(package)] = page(package, known)
    listed = "\n".join(page_of(package) for package in PACKAGES)
    head = [
        "# Python interface",
        "Names that packages export; everything else may change without notice. `import gears3d` loads no other "
        "package; names are loaded on first use.",
        f"```{{toctree}}\n:maxdepth: 1\n\n{listed}\n```",
    ]
    return {"python": "\n\n".join(head) + "\n", **pages}


def page_of(package: str) -> str:
    """Return the name of the page of a package."""
    return f"python-{package.replace('.', '-')}"


def page(package: str, known: set[int]) -> str:
    """Return the page of one package; names that another page has are listed only."""
    module = importlib.import_module(package)
    parts = [f"# {package}", f"```{{eval-rst}}\n.. automodule:: {package}\n   :no-index:\n```"]
    elsewhere = []
    for name, value in names(package):
        if id(value) in known:
            elsewhere.append(f"`{name}`")
        elif directive := directive_of(value):
            more = "\n   :members:\n   :undoc-members:" if directive == "autoclass" and is_own(value) else ""
            parts.append(f"## {name}\n\n```{{eval-rst}}\n.. {directive}:: {package}.{name}{more}\n```")
        else:
            parts.append(f"## {name}\n\nConstant of type `{type(value).__name__}`.")
    if elsewhere:
        parts.append(f"Also exported here: {', '.join(elsewhere)}.")
    assert isinstance(module, ModuleType)
    return "\n\n".join(parts) + "\n"


def is_own(value: Any) -> bool:
    """Whether a class is no exception: their members are those of Python."""
    return not (isinstance(value, type) and issubclass(value, BaseException))


def directive_of(value: Any) -> str:
    """Return the directive of autodoc for a value, or an empty string."""
    if inspect.isclass(value):
        return "autoclass"
    if callable(value):
        return "autofunction"
    return ""


def names(package: str) -> Iterator[tuple[str, Any]]:
    """Yield the exported names of a package with their values, in alphabetical order; of aliases the first one."""
    module = importlib.import_module(package)
    found = getattr(module, "__all__", None) or [*exported(module)]
    seen = set()
    for name in sorted(found, key=str.lower):
        value = getattr(module, name)
        if name.startswith("_") or inspect.ismodule(value) or id(value) in seen:
            continue
        if inspect.isclass(value) or callable(value):
            seen.add(id(value))
        yield name, value


def exported(module: ModuleType) -> Iterator[str]:
    """Yield names that a module without ``__all__`` exports: those imported ``as`` themselves, or defined in it."""
    text = inspect.getsource(module)
    again = re.findall(r"^ *from [\w.]+ import (\w+) as \1$", text, re.MULTILINE)
    if again:
        yield from dict.fromkeys(again)
        return
    for name, value in vars(module).items():
        if getattr(value, "__module__", "") == module.__name__ and not name.startswith("_"):
            yield name
