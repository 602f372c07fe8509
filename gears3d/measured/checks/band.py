"""Where the loose gear lies still beside the drive: means over short blocks, and the stretches in contact.

In contact the displacement keeps still but for the flanks' own error and, where one channel is read later than the
other, for the delay times the speed. Stretches are therefore those in which the displacement, freed of a delay that is
sought at the same time, moves no more than the noise lets it. Flanks are not needed for that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.measured.checks.view import MESH, View
from gears3d.signals import noise_of

SHORTEST = 2.5e-4
"""First length of a block [s]."""
QUIET = 0.03
"""Part of the liveliest speeds that the noise of a block's speed may be."""
FEWEST = 4
"""Blocks in a stretch."""
SEARCHED = 8000
"""Blocks among which the delay is sought."""
DELAYS = np.concatenate([-np.geomspace(1e-2, 1e-6, 80), [0.0], np.geomspace(1e-6, 1e-2, 80)])
"""Delays that are tried [s]."""
STILLER = 1.5
"""A delay is allowed for where it makes so many times as many blocks lie still."""
PERIOD = 60
"""Blocks in a period of the drive's motion, at least."""
SMOOTHER = 4
"""The acceleration is taken over so many times the way of the speed: its noise is that of the displacement, too, and
where both share a block it passes for a delay."""
LINE = 12.0
"""A line of a spectrum stands so many times above its floor."""
EVEN = 1e-4
"""Part of its mean speed by which a drive that turns evenly may fluctuate."""
BLURRED = 0.01
"""Part of the backlash that the noise of a block may be: more hides what flies and what does not."""


class Band(NamedTuple):
    """Blocks of a record, each (m,).

    Args:
        time: [s].
        drive: [rad].
        loose: [rad].
        place: displacement Rb2·θ_loose − Rb1·θ_drive, zero anywhere [m].
        speed: of the loose gear as the drive gives it [rad/s].
        acceleration: of the same [rad/s²].
        stretch: number of the stretch in contact, -1 outside.
        noise: of ``place`` [m].
        width: of a block [s].
        frequency: at which the drive's speed changes most [Hz], 0 when it does not.
    """

    time: np.ndarray
    drive: np.ndarray
    loose: np.ndarray
    place: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    stretch: np.ndarray
    noise: float
    width: float
    frequency: float


def band_of(view: View) -> Band | None:
    """Return the blocks of a record, ``None`` when it is too short or the rig is not known.

    Args:
        view: the record; its time rises, its angles do not wrap, its ratio is right.
    """
    declared = view.declared
    if not declared.meshed or declared.radii is None or declared.backlash is None or len(view.angles) < 2:
        return None
    if view.spacing <= 0.0 or len(view.time) < 1000:
        return None
    frequency = _frequency(view)
    longest = min(1.0 / (PERIOD * frequency) if frequency else 1e-2, 1e-2, 1e-3 * len(view.time) * view.spacing)
    size = max(int(SHORTEST / view.spacing), 1)
    while True:
        time, drive, loose = (_means(values, size) for values in (view.time, *view.angles.values()))
        place = declared.radii[1] * (loose - loose[0]) - declared.radii[0] * (drive - drive[0])
        noise = max(noise_of(time, place), 1e-6 * declared.backlash)
        width = size * view.spacing
        moved = np.abs(np.diff(place))
        lively = max(float(np.quantile(moved, 0.9)), 0.1 * declared.backlash * width / 0.02)
        if noise * np.sqrt(2.0) < QUIET * lively or 2.0 * width > longest:
            break
        size *= 2
    reach = max(round(1.0 / (PERIOD * frequency) / width), 1) if frequency else 8
    ratio = declared.radii[0] / declared.radii[1]
    speed = ratio * _slope(time, drive, reach)
    smooth = SMOOTHER * reach
    acceleration = ratio * _slope(time, _slope(time, drive, smooth), smooth)
    if noise > BLURRED * declared.backlash:
        return None
    stretch = _stretches(time, place, declared.radii[1] * acceleration, noise)
    return Band(time, drive, loose, place, speed, acceleration, stretch, noise, width, frequency)


def _means(values: np.ndarray, size: int) -> np.ndarray:
    count = len(values) // size
    return values[: count * size].reshape(count, size).mean(axis=1)


def _slope(time: np.ndarray, values: np.ndarray, reach: int) -> np.ndarray:
    at = np.arange(len(time))
    low, high = np.maximum(at - reach, 0), np.minimum(at + reach, len(time) - 1)
    return (values[high] - values[low]) / (time[high] - time[low])


def _frequency(view: View) -> float:
    """Return the strongest frequency of the drive's speed about its mean [Hz], 0 when it turns evenly."""
    angle = view.angles[MESH[0]]
    size = max(len(angle) // 16_384, 1)
    time, angle = _means(view.time, size), _means(angle, size)
    way = float(angle[-1] - angle[0])
    window = np.hanning(len(time))
    rest = (angle - np.linspace(angle[0], angle[-1], len(angle))) * window
    lines = np.abs(np.fft.rfft(rest - rest.mean())) * 2.0 / window.sum()
    lasting = float(time[-1] - time[0])
    speeds = lines * 2 * np.pi * np.arange(len(lines)) / lasting
    speeds[:2] = 0.0
    speeds[lines < LINE * np.median(lines[len(lines) // 2 :])] = 0.0
    at = int(np.argmax(speeds))
    return at / lasting if speeds[at] > EVEN * abs(way) / lasting else 0.0


def _stretches(time: np.ndarray, place: np.ndarray, pull: np.ndarray, noise: float) -> np.ndarray:
    """Return the number of each block's stretch in contact, -1 outside, (m,).

    Args:
        time: [s], (m,).
        place: [m], (m,).
        pull: acceleration along the line of action [m/s²], (m,).
        noise: of ``place`` [m].
    """
    step = np.diff(time)
    speed = np.diff(place) / step
    pull = 0.5 * (pull[1:] + pull[:-1])
    sigma = np.sqrt(2.0) * noise / float(np.median(step))
    scale = 2.0 * sigma + 0.01 * float(np.quantile(np.abs(speed), 0.9))
    some = slice(None, None, max(len(speed) // SEARCHED, 1))
    score = np.array([np.mean(np.exp(-0.5 * ((speed[some] + pull[some] * one) / scale) ** 2)) for one in DELAYS])
    best = int(np.argmax(score))
    delay = DELAYS[best] if score[best] > STILLER * score[len(DELAYS) // 2] else 0.0
    still = np.abs(speed + pull * delay) < 2.0 * scale
    edge = np.diff(np.concatenate([[False], still, [False]]).astype(np.int8))
    first, last = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1)
    number = np.full(len(time), -1)
    for k, (begin, end) in enumerate(zip(first, last, strict=True)):
        if end - begin + 1 >= FEWEST:
            number[begin : end + 1] = k
    return number
