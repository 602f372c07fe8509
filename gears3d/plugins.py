"""Effects and readers of other packages, found by their entry points; a broken one costs a warning."""

from __future__ import annotations

import multiprocessing
import warnings
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from typing import Any


class PluginWarning(UserWarning):
    """A plug-in of another package cannot be used."""


def plug_in(group: str, accept: Callable[[Callable[[], Any], str], None]) -> dict[str, str]:
    """Pass every entry point of a group to a function; what fails is excluded with one warning.

    Args:
        group: ``"gears3d.effects"`` or ``"gears3d.readers"``.
        accept: takes a function that loads the entry point, and the name of its package; raises what it finds wrong.

    Returns:
        Why entry points are excluded, a sentence each, by their names.
    """
    excluded = {}
    for point in sorted(entry_points(group=group), key=lambda one: (package_of(one), one.name)):
        package = package_of(point)
        try:
            accept(point.load, package)
        except (Exception, SystemExit) as error:  # code of third parties may raise any exception
            why = " ".join(str(error).split()) or "no reason given"
            excluded[point.name] = f"the package {package} is excluded: {type(error).__name__}: {why}"
            warn(group, point.name, package, f"{type(error).__name__}: {why}")
    return excluded


def warn(group: str, name: str, package: str, why: str) -> None:
    """Warn of a plug-in that is not used, in the main process alone.

    Args:
        group: of entry points.
        name: of the entry point.
        package: that brings it.
        why: it is excluded.
    """
    if multiprocessing.parent_process() is None:
        text = f"plug-in {name!r} ({group}) of the package {package} is excluded: {why}"
        warnings.warn(f"{text} (update or uninstall {package})", PluginWarning, stacklevel=3)


def package_of(point: EntryPoint) -> str:
    """Return the name of the package that an entry point belongs to.

    Args:
        point: of any group.
    """
    return point.dist.name if point.dist is not None else point.value.partition(":")[0].partition(".")[0]
