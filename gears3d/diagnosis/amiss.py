"""Channels that are off as a whole: no coordinate tells what remains, but too much of it does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.heldout import UNITS
from gears3d.diagnosis.prediction import parts_of, rms_of
from gears3d.diagnosis.remains import farthest
from gears3d.diagnosis.structure import Structure

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence

Array = np.ndarray
FAR = 5.0
"""Standard deviations: a channel whose points are farther off in the root mean square is not explained."""
STRAY = 15.0
"""Standard deviations at which a single point counts at most: a hundredth of them, cut wrongly, is no whole channel."""
ASKED = ("flight", "contact")
"""Channels that are asked."""


def amiss(records: Sequence[Evidence], rest: Array) -> list[Structure]:
    """Return the channels whose errors stay far above their noise whatever the causes, farthest off first.

    Args:
        records: all.
        rest: residuals that the causes leave, stacked, (n,).

    Returns:
        One ``CHANNEL.all`` each, with the root mean square of its points, and no place.
    """
    told, parts = [], parts_of(records, rest)
    for name in ASKED:
        own = [np.clip(part, -STRAY, STRAY) for part in parts[name]]
        whole = np.concatenate([np.zeros(0), *own])
        if not whole.size or float(np.mean(whole**2)) <= FAR**2:
            continue
        gain = float(whole @ whole) - whole.size
        size = rms_of(whole, records, name)
        worst = records[farthest(own)].name
        told.append(Structure(f"{name}.all", gain, 0.0, size, UNITS[name], float("nan"), gain, worst))
    return sorted(told, key=lambda one: -one.gain)
