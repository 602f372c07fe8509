"""Periods of one direction of a sweep beside the flights that a threshold makes of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.identify.liftoff import landed, lifted
from gears3d.identify.swing import BINS, Periods
from gears3d.identify.unwaved import PRESSED, phases, pressed

MOST = 1.6
"""Excitation, over the threshold, up to which flights count: they are back on the flank before the period ends."""
LEAST = 0.6
"""Excitation from which on periods count as quiet ones that testify."""
HIGHEST = 0.6
"""Part of the backlash that a flight may rise to and count."""
_SMOOTH = 9
"""Bins over which an opening is averaged."""
_READ = 5
"""Bins in sure contact that a period must have been read in."""
_STEP = 1e-4
"""Relative step of differences."""


class Flown(NamedTuple):
    """Periods of one direction in order of the swing, all records together.

    Args:
        place: displacement in each bin without its mean in contact [m], NaN where nothing was read, (k, BINS).
        phase: mean phase of the readings in each bin [rad], (k, BINS).
        level: amplitude of the drive's acceleration [rad/s²], (k,).
        ramp: its relative change in a radian, (k,).
        unit: height of a flight per acceleration and unit of :func:`lifted` [m·s²/rad], (k,).
        opening: how far the gap opens [m], (k,).
        rough: noise of the contact [m].
        record: place of the record, (k,).
        middle: time of each period [s], (k,).
    """

    place: np.ndarray
    phase: np.ndarray
    level: np.ndarray
    ramp: np.ndarray
    unit: np.ndarray
    opening: np.ndarray
    rough: float
    record: np.ndarray
    middle: np.ndarray

    def heights(self, value: float) -> np.ndarray:
        """Return the flights that a threshold makes, means over the bins [m], (k, BINS).

        Args:
            value: amplitude of the drive's acceleration at which contact is lost [rad/s²].
        """
        ratio = self.level / value
        height = lifted(self.phase, ratio, self.ramp)
        bend = -np.cos(self.phase) - 1.0 / np.maximum(ratio, 1e-300)[:, None]
        mean = height + np.where(height > 0.0, bend, 0.0) * (2.0 * np.pi / BINS) ** 2 / 24.0
        return (self.unit * self.level)[:, None] * np.maximum(mean, 0.0)

    def usable(self, value: float, backlash: float) -> np.ndarray:
        """Return which bins count: sure contact, and the first flight of periods in which it ends on the flank it left.

        The bin in which a flight ends holds some of the rebound.

        Args:
            value: the threshold [rad/s²].
            backlash: [m].
        """
        ratio = self.level / value
        low = (self.heights(value).max(axis=1) < HIGHEST * backlash) & (ratio < MOST) & (ratio > LEAST)
        over = landed(self.phase, ratio, self.ramp)
        over[:, :-1] |= over[:, 1:]
        return low[:, None] & ~over & (self.phase > PRESSED[0]) & np.isfinite(self.place)

    def rest(self, value: float, use: np.ndarray) -> np.ndarray:
        """Return what the law leaves over, each period about its own mean [m], NaN where nothing counts, (k, BINS).

        Args:
            value: the threshold [rad/s²].
            use: which bins count, (k, BINS).
        """
        rest = np.where(use, self.place - self.heights(value), np.nan)
        count = np.maximum(use.sum(axis=1), 1)
        return rest - (np.nansum(rest, axis=1) / count)[:, None]

    def slope(self, value: float, use: np.ndarray) -> np.ndarray:
        """Return how the rest changes with the threshold [m·s²/rad], (k, BINS).

        Args:
            value: the threshold [rad/s²].
            use: which bins count, (k, BINS).
        """
        step = _STEP * value
        return (self.rest(value + step, use) - self.rest(value - step, use)) / (2.0 * step)


def gathered(laid: list[Periods], chosen: list[np.ndarray], radius: float) -> Flown:
    """Return chosen periods of several records in order of their swing.

    Args:
        laid: records by periods, waves taken off.
        chosen: which periods of each, (k,) each.
        radius: base radius of the drive gear [m].
    """
    from scipy.ndimage import uniform_filter1d

    def together(one_of: list[np.ndarray]) -> np.ndarray:
        return np.concatenate([values[pick] for values, pick in zip(one_of, chosen, strict=True)])

    place, level = together([one.place for one in laid]), together([one.level for one in laid])
    unit = together([radius / one.rate**2 for one in laid])
    record = together([np.full(len(one.level), at) for at, one in enumerate(laid)])
    ramp = together([one.rise for one in laid]) / (2.0 * np.pi * level)
    middle = together([one.middle for one in laid])
    phase = together([one.phase for one in laid])
    resting = pressed()
    read = (np.isfinite(place[:, resting]).sum(axis=1) >= _READ) & (np.isfinite(place).mean(axis=1) > 0.5)
    order = np.flatnonzero(read)[np.argsort(level[read], kind="stable")]
    place = place[order] - np.nanmean(np.where(resting, place[order], np.nan), axis=1, keepdims=True)
    known = np.isfinite(place)
    sums = uniform_filter1d(np.where(known, place, 0.0), _SMOOTH, axis=1, mode="nearest")
    smooth = sums / np.maximum(uniform_filter1d(known.astype(float), _SMOOTH, axis=1, mode="nearest"), 0.3)
    opening = smooth[:, (phases() > 1.6) & (phases() < 5.6)].max(axis=1)
    rough = 1.4826 * float(np.median(np.abs(smooth[:, resting]))) if len(smooth) else 0.0
    phase = np.where(known, phase[order], phases())
    columns = (place, phase, level[order], ramp[order], unit[order], opening, max(rough, 1e-12))
    return Flown(*columns, record[order], middle[order])
