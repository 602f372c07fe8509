"""Channels that are off as a whole: no coordinate tells what remains, but too much of it does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.heldout import UNITS
from gears3d.diagnosis.prediction import parts_of, rms_of
from gears3d.diagnosis.remains import farthest
from gears3d.diagnosis.search import MOST, next_cause
from gears3d.diagnosis.structure import Structure

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence
    from gears3d.diagnosis.search import Search

Array = np.ndarray
FAR = 3.0
"""Standard deviations: a channel whose points are farther off in the root mean square is not explained. The right
causes leave 1.5 at most in blind tests."""
STRAY = 15.0
"""Standard deviations at which a single point counts at most: a hundredth of them, cut wrongly, is no whole channel."""
ASKED = ("flight", "contact", "drive")
"""Channels that are asked."""


def unspent(found: Search) -> list[Structure]:
    """Return what is left where a search ended at as many causes as it may name, and one more would be accepted.

    Args:
        found: by the search.
    """
    if len(found.fit.causes) < MOST or (one := next_cause(found)) is None:
        return []
    name = one.candidate.channels[0]
    off = _off(found.records, found.fit.rest, name)
    return [] if off is None else [off]


def amiss(records: Sequence[Evidence], rest: Array) -> list[Structure]:
    """Return the channels whose errors stay far above their noise whatever the causes, farthest off first.

    Args:
        records: all.
        rest: residuals that the causes leave, stacked, (n,).

    Returns:
        One ``CHANNEL.all`` each, with the root mean square of its points, and no place.
    """
    found = [off for name in ASKED if (off := _off(records, rest, name, FAR)) is not None]
    return sorted(found, key=lambda one: -one.gain)


def _off(records: Sequence[Evidence], rest: Array, name: str, far: float = 0.0) -> Structure | None:
    """Return a channel as a whole; ``None`` where its points are nearer than so many standard deviations."""
    own = [np.clip(part, -STRAY, STRAY) for part in parts_of(records, rest)[name]]
    whole = np.concatenate([np.zeros(0), *own])
    if not whole.size or float(np.mean(whole**2)) <= far**2:
        return None
    gain = max(float(whole @ whole) - whole.size, 0.0)
    size, worst = rms_of(whole, records, name), records[farthest(own)].name
    return Structure(f"{name}.all", gain, 0.0, size, UNITS[name], float("nan"), gain, worst)
