"""Channels that are off as a whole: no coordinate tells what remains, but too much of it does."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.heldout import UNITS
from gears3d.diagnosis.prediction import rms_of, sigmas
from gears3d.diagnosis.structure import Structure

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence
    from gears3d.diagnosis.search import Search

Array = np.ndarray
FAR = 5.0
"""Standard deviations: a channel whose points are farther off in the root mean square is not explained."""
STRAY = 15.0
"""Standard deviations at which a single point counts at most: a hundredth of them, cut wrongly, is no whole channel."""
ASKED = ("flight", "contact")
"""Channels that are asked."""


def amiss(found: Search) -> list[Structure]:
    """Return the channels whose errors stay far above their noise whatever the causes, farthest off first.

    Args:
        found: by the search.

    Returns:
        One ``CHANNEL.all`` each, with the root mean square of its points, and no place.
    """
    told = []
    for name in ASKED:
        rest = np.clip(found.fit.rest[found.known.spans[name]], -STRAY, STRAY)
        if not rest.size or float(np.mean(rest**2)) <= FAR**2:
            continue
        gain = float(rest @ rest) - rest.size
        size = rms_of(rest, found.records, name)
        worst = _farthest(found.records, name, rest)
        told.append(Structure(f"{name}.all", gain, 0.0, size, UNITS[name], float("nan"), gain, worst))
    return sorted(told, key=lambda one: -one.gain)


def _farthest(records: list[Evidence], name: str, rest: Array) -> str:
    """Return the name of the record whose points are farthest off."""
    sizes = [len(sigmas(one, name)) for one in records]
    parts = np.split(rest**2, np.cumsum(sizes)[:-1])
    means = [float(np.mean(part)) if part.size else 0.0 for part in parts]
    return records[int(np.argmax(means))].name
