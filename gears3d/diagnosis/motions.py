"""Frequencies and orders at which the drive's motion deviates from the nominal one."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np

from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import residuals

# Number of lines that are examined in each record.
PEAKS = 3
# Ratio of a line to the median line from which it is examined.
CLEAR = 5.0
# Counts of the encoder: samples that beat with its counts make lines of up to 1/pi of a count.
COUNTED = 0.35


def lines(records: Sequence[Evidence]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the strongest lines of the drive's deviation from its nominal motion.

    As frequencies [Hz], and the same lines as orders of the mean speed.
    """
    frequencies, orders = [], []
    for one in records:
        drive = one.drive
        if len(drive.time) < 64:
            continue
        spectrum = np.abs(np.fft.rfft(residuals(one)["drive"] * np.hanning(len(drive.time))))
        at = np.fft.rfftfreq(len(drive.time), drive.width)
        peak = np.flatnonzero((spectrum[1:-1] >= spectrum[:-2]) & (spectrum[1:-1] > spectrum[2:])) + 1
        strong = peak[spectrum[peak] > max(CLEAR * np.median(spectrum), _counted(one))]
        for k in strong[np.argsort(-spectrum[strong])][:PEAKS]:
            left, here, right = np.log(spectrum[k - 1 : k + 2] + 1e-300)
            shift = 0.5 * (left - right) / (left - 2.0 * here + right)
            frequency = float((k + shift) * (at[1] - at[0]))
            frequencies.append(frequency)
            if one.motion.mean:
                orders.append(2.0 * pi * frequency / abs(one.motion.mean))
    return tuple(frequencies), tuple(orders)


def _counted(one: Evidence) -> float:
    """Return the height of a line that the counts of the drive's encoder may cause."""
    drive, counts = one.channels.drive, one.scenario.sensors.drive.counts_per_revolution
    if not counts:
        return 0.0
    return COUNTED * 2.0 * pi / counts * 0.25 * len(drive.time) / drive.sigma  # half of the mean of a Hann window
