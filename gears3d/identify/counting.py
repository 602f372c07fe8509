"""What counting does to the place of a flank: an encoder read in step with its turning is off alike at the same angles.

Rounding to counts is a sawtooth over the encoder's angle: at k times the counts of a turn it has the amplitude
q/(pi·k), q the length of a count. Readings see it at |k·counts − j·samples| cycles a turn; neither turns nor samples
average that out, and neighbouring orders do not show it. Of the drive, whose motion is smooth, it can be seen; what
falls on no cycle at all shifts the mean place, and of that only the size is known.
"""

from __future__ import annotations

import numpy as np

TURNING = 0.3
"""Way at both ends on which the drive may not move smoothly [rad]."""
DITHERED = 0.3
"""Noise in counts from which on counting makes no lines."""
FEWEST = 1000
"""Readings of a way, at least, that tell its motion."""
HARMONICS = 400
"""Of the sawtooth, at most."""
LAGS = 400
"""Samples apart, at most, over which a gear is sought to turn by whole counts."""
WHOLE = 0.02
"""Part of a count by which it may miss them."""
NEAR = 0.75
"""Cycles over the record that a line of counting makes at most, to shift the mean place."""


def whole_count(angle: np.ndarray, declared: float | None) -> float:
    """Return the angle of a declared count where the readings keep to it, else 0 [rad].

    Args:
        angle: readings [rad], (n,).
        declared: counts of a revolution.

    >>> whole_count(np.array([0.0, 0.25, 1.75]) * np.pi, 8) / np.pi, whole_count(np.array([0.0, 1.0]), 8)
    (0.25, 0.0)
    """
    if not declared:
        return 0.0
    count = 2 * np.pi / declared
    changes = np.diff(angle[:: max(len(angle) // 1000, 1)]) / count
    off = np.abs(changes - np.round(changes))
    return count if len(off) and np.mean(off < 1e-3 + 1e-13 * np.abs(angle).max() / count) > 0.99 else 0.0


def tremble(counts: np.ndarray) -> float:
    """Return the noise of an angle before it was counted, in counts; that of rounding is none.

    Readings so far apart that the gear has turned by whole counts are alike but for noise: they differ by a count in
    2σ/√π of all cases while the noise σ is small.

    Args:
        counts: readings of a gear that turns evenly, (n,).

    >>> place = 444.4444 * np.arange(20_000)
    >>> noise = np.random.default_rng(1).normal(size=len(place))
    >>> [round(float(tremble(np.floor(place + sigma * noise))), 2) for sigma in (0.0, 0.1, 0.5)]
    [0.0, 0.1, 0.5]
    """
    if len(counts) < 2 * LAGS:
        return np.inf
    step = float(counts[-1] - counts[0]) / (len(counts) - 1)
    lag = np.arange(1, LAGS + 1)
    off = np.abs(lag * step - np.round(lag * step))
    best = int(lag[np.argmin(off)])
    if off[best - 1] > WHOLE:
        return np.inf
    apart = counts[best:] - counts[:-best]
    moved = float(np.var(apart - np.round(np.mean(apart))))
    return moved * np.sqrt(np.pi) / 2.0 if moved < 0.3 else float(np.sqrt(0.5 * (moved - 1.0 / 6.0)))


def shift_by_counting(
    angles: tuple[np.ndarray, np.ndarray], quanta: tuple[float, float], radii: tuple[float, float]
) -> float:
    """Return the deviation of a flank's mean place that counting in step with the turning makes [m].

    Args:
        angles: readings of drive and loose gear on one flank, one way [rad], each (n,).
        quanta: angle of a count of each, 0 for a smooth one [rad].
        radii: base radii [m].
    """
    spare = len(angles[0]) // 8  # a way begins and ends at rest
    variance = 0.0
    for angle, quantum, radius in zip(angles, quanta, radii, strict=True):
        inner = angle[spare : len(angle) - spare]
        if quantum <= 0.0 or len(inner) < 2:
            continue
        counts = np.rint(inner / quantum)
        order = np.arange(1, HARMONICS + 1)
        row = np.arange(len(counts)) - 0.5 * (len(counts) - 1)
        step = float(row @ counts) / float(row @ row)  # of all readings: the first and the last are rounded
        still = np.abs(order * step - np.round(order * step)) * len(counts) < NEAR
        size = radius * quantum / (np.pi * order) * np.exp(-2.0 * (np.pi * order * tremble(counts)) ** 2)
        variance += 0.5 * float(np.sum(size[still] ** 2))
    return float(np.sqrt(variance))


def off_by_counting(time: np.ndarray, angle: np.ndarray, quantum: float) -> np.ndarray:
    """Return what readings of a gear whose motion is smooth are off that motion [rad], (n,).

    Args:
        time: [s], rising, (n,).
        angle: of one way [rad], (n,).
        quantum: angle of a count, 0 for a smooth one [rad]; noise of a third of it leaves no lines.
    """
    from gears3d.measured.segmentation import steady
    from gears3d.measured.segmentation.readings import read_encoder

    off = np.zeros(len(time))
    inner = np.flatnonzero(np.minimum(np.abs(angle - angle[0]), np.abs(angle - angle[-1])) > TURNING)
    if len(inner) >= FEWEST and quantum > 0.0 and tremble(np.rint(angle[inner] / quantum)) < DITHERED:
        rows = slice(int(inner[0]), int(inner[-1]) + 1)
        off[rows] = angle[rows] - steady(read_encoder(time[rows], angle[rows])).curve(time[rows])
    return off
