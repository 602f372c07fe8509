"""Angular datums of records with a single tooth deviation, which passes through mesh once per revolution."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import log, pi
from typing import NamedTuple

import numpy as np

from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.library import Library
from gears3d.diagnosis.prediction import deviation
from gears3d.diagnosis.zeros import SHOWS
from gears3d.effects import catalogue

Array = np.ndarray
# Tried places per pitch.
STEPS = 32
# Tried deviations of a tooth, in backlashes: larger ones carry before and behind their place, too.
SIZES = (0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.2, 0.4)
# Residual at which a point is clipped, in backlashes.
FAR = 0.5


class Tooth(NamedTuple):
    """A tooth deviation at some angle of its gear in each record.

    Args:
        gain: in chi-square, of a common size and a place for each record, minus that of the trials.
        place: angle of the tooth in each record [rad], (r,).
        worth: gain in each record, (r,).
        teeth: of the gear.
    """

    gain: float
    place: Array
    worth: Array
    teeth: int

    @property
    def turns(self) -> Array:
        """Shift of each record that moves the tooth to the nearest tooth position."""
        clear = np.flatnonzero(self.worth > SHOWS)
        first = int(clear[0]) if len(clear) else int(np.argmax(self.worth))
        pitch = 2.0 * pi / self.teeth
        there = pitch * round(float(self.place[first]) / pitch)
        return (there - self.place + pi) % (2.0 * pi) - pi


def tooth(known: Library, rest: Array, gear: str) -> Tooth:
    """Return the tooth of a gear that explains most of the contact residuals.

    rest: (n,).
    """
    own = [rest[known.spans["contact"]][part] for part in known.parts["contact"]]
    teeth = known.records[0].rig.teeth_drive if gear == "drive" else known.records[0].rig.teeth_loose
    count = teeth * STEPS
    sums = [_binned(one, part, gear, count) for one, part in zip(known.records, own, strict=True)]
    shapes = [_shape(known.records, gear, flank, sign * size, count)
              for flank, sign, size in product(("both", "active", "reverse"), (1.0, -1.0), SIZES)]  # fmt: skip
    found = [_matched(sums, shape) for shape in shapes]
    gain, place, worth = max(found, key=lambda each: each[0])
    asked = int(np.sum(worth > 0.0))
    return Tooth(gain - 2.0 * asked * log(len(shapes) * count), place, worth, teeth)


def _binned(one: Evidence, rest: Array, gear: str, count: int) -> tuple[Array, Array]:
    """Return sums of contact residuals, in standard deviations, and of points over a revolution, by flank, (2, n)."""
    seen = one.channels.contacts
    angle = seen.drive if gear == "drive" else seen.loose
    at = np.floor(np.mod(angle, 2.0 * pi) / (2.0 * pi) * count + 0.5).astype(int) % count + seen.flank * count
    far = FAR * one.rig.backlash / seen.sigma
    held = np.clip(rest - np.median(rest), -far, far) if len(rest) else rest
    off = np.bincount(at, held / np.maximum(seen.sigma, 1e-300), 2 * count)
    weight = np.bincount(at, 1.0 / np.maximum(seen.sigma, 1e-300) ** 2, 2 * count)
    return off.reshape(2, count), weight.reshape(2, count)


def _shape(records: Sequence[Evidence], gear: str, flank: str, size: float, count: int) -> Array:
    """Return the response over a revolution to a tooth at angle 0 of a size in backlashes, over that size, (2, n)."""
    one, angle = records[0], np.arange(count) * 2.0 * pi / count
    offset = size * one.rig.backlash
    rows = catalogue()["pitch_error"](offset=offset, tooth=1, gear=gear, flank=flank).rows(one.rig)
    sides = [deviation(rows, one.pair, angle, angle, np.full(count, side)) for side in (0, 1)]
    return np.array(sides) / abs(offset)


def _matched(sums: Sequence[tuple[Array, Array]], shape: Array) -> tuple[float, Array, Array]:
    """Return the gain of the shape at its best place in each record, the places [rad], and the gains by record."""
    turned = np.conj(np.fft.rfft(shape))
    squared = np.conj(np.fft.rfft(shape**2))
    count = shape.shape[1]
    places, linear, heavy = np.zeros(len(sums)), np.zeros(len(sums)), np.zeros(len(sums))
    for k, (off, weight) in enumerate(sums):
        whole = max(float(weight.sum()), 1e-300)
        mean = np.fft.irfft(np.fft.rfft(weight) * turned, count).sum(axis=0)
        right = np.fft.irfft(np.fft.rfft(off) * turned, count).sum(axis=0) - mean * off.sum() / whole
        square = np.fft.irfft(np.fft.rfft(weight) * squared, count).sum(axis=0) - mean**2 / whole
        some = square > 1e-2 * max(float(square.max()), 1e-300)
        gain = np.where(some & (right > 0.0), right**2 / np.where(some, square, 1.0), 0.0)
        best = int(np.argmax(gain))
        left, here, next_ = gain[best - 1], gain[best], gain[(best + 1) % count]
        bow = left - 2.0 * here + next_
        ahead = 0.5 * (left - next_) / bow if bow < 0.0 else 0.0
        places[k] = (best + float(np.clip(ahead, -0.5, 0.5))) * 2.0 * pi / count
        linear[k], heavy[k] = (right[best], square[best]) if here > 0.0 else (0.0, 0.0)
    worth = linear**2 / np.maximum(heavy, 1e-300)
    return float(linear.sum() ** 2 / max(heavy.sum(), 1e-300)), places, worth
