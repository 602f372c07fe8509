"""Old names of packages, modules and what they hold: they load the new one, and warn."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Mapping
from typing import Any


def names_of(new: str, old: str, names: Mapping[str, str] | None = None) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package that was renamed, with new names by old ones where they differ."""

    def name_of(name: str) -> Any:
        missing = AttributeError(f"module {old!r} has no attribute {name!r}")
        if name.startswith("__"):  # what doctest and pytest look for in every module imports nothing
            raise missing
        named, now = importlib.import_module(new), (names or {}).get(name, name)
        if not hasattr(named, now):
            raise missing
        warnings.warn(f"{old} is called {new} now; the old name will be removed", DeprecationWarning, stacklevel=2)
        return getattr(named, now)

    return name_of


def module_of(package: str, renamed: Mapping[str, str], old: str) -> Any:
    """Return the module that a package's module with an old name became part of."""
    if old not in renamed:
        raise AttributeError(f"module {package!r} has no attribute {old!r}")
    new = f"{package}.{renamed[old]}"
    warnings.warn(
        f"{package}.{old} is part of {new} now; the old name will be removed", DeprecationWarning, stacklevel=3
    )
    return importlib.import_module(new)


def renamed_in(package: str, renamed: Mapping[str, str], old: str) -> Any:
    """Return what a package calls by another name now."""
    if old not in renamed:
        raise AttributeError(f"module {package!r} has no attribute {old!r}")
    new = renamed[old]
    warnings.warn(
        f"{package}.{old} is called {new} now; the old name will be removed", DeprecationWarning, stacklevel=3
    )
    return getattr(importlib.import_module(package), new)
