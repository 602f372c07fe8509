"""Channels that deviate as a whole: their chi-square is too large, although no coordinate shows a pattern."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.heldout import UNITS
from gears3d.diagnosis.prediction import parts_of, rms_of
from gears3d.diagnosis.remains import farthest
from gears3d.diagnosis.search import MOST_CAUSES, next_cause
from gears3d.diagnosis.structure import Structure

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence
    from gears3d.diagnosis.search import Search

Array = np.ndarray
# Root mean square in standard deviations above which a channel is not explained. The right causes leave 1.5 at most in
# blind tests.
FAR = 3.0
# Standard deviations at which a single point is clipped: 1 % wrongly segmented points must not flag a channel.
STRAY = 15.0
# Channels that are tested.
ASKED = ("flight", "contact", "drive")


def unspent(found: Search) -> list[Structure]:
    """Return the remaining candidate where a search ended at the maximum number of causes and would accept one more."""
    if len(found.fit.causes) < MOST_CAUSES or (one := next_cause(found)) is None:
        return []
    name = one.candidate.channels[0]
    off = _off(found.records, found.fit.rest, name)
    return [] if off is None else [off]


def amiss(records: Sequence[Evidence], rest: Array) -> list[Structure]:
    """Return the channels whose residuals stay far above their noise with all causes, largest first.

    One ``CHANNEL.all`` each, with the root mean square of its points and no place; rest: (n,).
    """
    found = [off for name in ASKED if (off := _off(records, rest, name, FAR)) is not None]
    return sorted(found, key=lambda one: -one.gain)


def _off(records: Sequence[Evidence], rest: Array, name: str, far: float = 0.0) -> Structure | None:
    """Return a channel as a whole; ``None`` where its root mean square is below a number of standard deviations."""
    own = [np.clip(part, -STRAY, STRAY) for part in parts_of(records, rest)[name]]
    whole = np.concatenate([np.zeros(0), *own])
    if not whole.size or float(np.mean(whole**2)) <= far**2:
        return None
    gain = max(float(whole @ whole) - whole.size, 0.0)
    size, worst = rms_of(whole, records, name), records[farthest(own)].name
    return Structure(f"{name}.all", gain, 0.0, size, UNITS[name], float("nan"), gain, worst)
