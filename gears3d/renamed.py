"""Old names of packages: they load the new package, and warn."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable
from typing import Any


def names_of(new: str, old: str) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package that was renamed."""

    def name_of(name: str) -> Any:
        named = importlib.import_module(new)
        if name.startswith("__") or not hasattr(named, name):  # what doctest and pytest look for in every module
            raise AttributeError(f"module {old!r} has no attribute {name!r}")
        warnings.warn(f"{old} is called {new} now; the old name will be removed", DeprecationWarning, stacklevel=2)
        return getattr(named, name)

    return name_of
