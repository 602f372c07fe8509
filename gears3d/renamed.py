"""Old names of packages: they load the new package, and warn."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable
from typing import Any


def names_of(new: str, old: str) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package that was renamed."""

    def name_of(name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        warnings.warn(f"{old} is called {new} now; the old name will be removed", DeprecationWarning, stacklevel=2)
        return getattr(importlib.import_module(new), name)

    return name_of
