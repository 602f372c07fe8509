"""Displacement of the loose gear, and how well it is known, from two encoders that count and tremble."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measurement.drive import Steady, steady
from gears3d.measurement.readings import FEWEST, Reading, read_encoder, stuck
from gears3d.signals import noise_of

LONGEST = 1e-3
"""Longest block [s]: within it the drive's acceleration bends nothing by a micrometre."""
FOLLOWS = 2.0
"""Times their own noise that means of the drive's readings may be off a smooth curve that takes their place."""
CORNER = 16.0
"""Cube of the blocks' width in units of noise, speed and spacing: 32 makes rounding and noise equal."""


class Track(NamedTuple):
    """Both gears at the readings of the loose gear.

    Args:
        time: [s], rising, (n,).
        drive: angle of the drive gear [rad], (n,).
        loose: angle of the loose gear [rad], (n,).
        steady: the drive's motion as a curve.
        sigma_loose: standard deviation of ``loose`` [rad], (n,).
        place: displacement Rb2·θ_loose − Rb1·θ_drive [m], zero anywhere, (n,).
        noise: standard deviation of one reading of ``place`` [m].
        slack: what counting may put ``place`` off by for many readings in a row [m]; 0 where noise dithers the counts.
        radii: base radii of drive and loose gear [m].
        readings: of the drive's and the loose gear's encoder.
    """

    time: np.ndarray
    drive: np.ndarray
    loose: np.ndarray
    steady: Steady
    sigma_loose: np.ndarray
    place: np.ndarray
    noise: float
    slack: float
    radii: tuple[float, float]
    readings: tuple[Reading, Reading]


class Blocks(NamedTuple):
    """Means over a few readings each: short enough for a bounce, long enough to quieten the noise.

    Args:
        time: [s], (m,).
        drive: [rad], (m,).
        loose: [rad], (m,).
        place: [m], (m,).
        noise: standard deviation of ``place`` [m], measured on the blocks themselves.
        slack: of the track [m].
        size: readings in each.
        width: duration of a typical block [s].
    """

    time: np.ndarray
    drive: np.ndarray
    loose: np.ndarray
    place: np.ndarray
    noise: float
    slack: float
    size: int
    width: float


def track(time: np.ndarray, drive: np.ndarray, loose: np.ndarray, radii: tuple[float, float], file: str = "") -> Track:
    """Return displacement and angles at the readings of the loose gear.

    Args:
        time: of the samples [s], rising, (n,).
        drive: angle of the drive gear, zero anywhere [rad], (n,).
        loose: angle of the loose gear, zero anywhere [rad], (n,).
        radii: base radii of drive and loose gear [m].
        file: named in faults.

    Raises:
        InputError: there are too few readings.

    >>> time = np.linspace(0.0, 1.0, 1001)
    >>> float(np.ptp(track(time, 3.0 * time, 3.0 * time + 1e-4, (0.1, 0.1)).place).round(9))
    0.0
    """
    one, other = read_encoder(time, drive), read_encoder(time, loose)
    for name, reading in (("theta_drive_rad", one), ("theta_loose_rad", other)):
        if len(reading.time) < FEWEST:
            what = f"is read {len(reading.time)} times only"
            raise InputError(Fault(name, what, f"a record needs at least {FEWEST} readings", file))
    inside: slice | np.ndarray = slice(None)  # a long record is not copied for nothing
    if other.time[0] < one.time[0] or other.time[-1] > one.time[-1]:
        inside = (other.time >= one.time[0]) & (other.time <= one.time[-1])
    at, angle, sigma = other.time[inside], other.angle[inside], other.sigma[inside]
    curve = steady(one)
    if follows := curve.rest < FOLLOWS:
        driven = curve.curve(at)
    else:
        driven = one.angle if one.time is at or np.array_equal(one.time, at) else np.interp(at, one.time, one.angle)
    place = radii[1] * (angle - angle[0])
    place -= radii[0] * (driven - driven[0])
    theirs = curve.sigma if follows else float(np.median(one.sigma))
    noise = float(np.hypot(radii[1] * np.median(sigma), radii[0] * theirs))
    slack = (0.0 if follows else radii[0] * stuck(one)) + radii[1] * stuck(other)
    return Track(at, driven, angle, curve, sigma, place, noise, slack, radii, (one, other))


def blocks(known: Track) -> Blocks:
    """Return means over blocks, as long as a corner of the path allows.

    A mean over a time W quietens the noise by the root of its readings and rounds a corner of speed v off by v·W/8; W
    keeps that a little below the noise.

    Args:
        known: the displacement.
    """
    spacing = float(np.median(np.diff(known.time)))
    longest = max(int(LONGEST / float(np.quantile(np.diff(known.time), 0.9))), 1)
    floor = max(known.noise, 1e-12)
    speed = _speed(known, floor)
    size = int(np.cbrt(CORNER * floor**2 / (spacing**2 * speed**2))) if speed > 0.0 else longest
    size = int(np.clip(size, 1, longest))
    count = len(known.time) // size
    time, drive, loose, place = (
        column[: count * size].reshape(count, size).mean(axis=1) if size > 1 else column
        for column in (known.time, known.drive, known.loose, known.place)
    )
    quiet = max(noise_of(time, place, clip=4.0), 0.2 * floor / np.sqrt(size), 1e-12)
    return Blocks(time, drive, loose, place, quiet, known.slack, size, size * spacing)


def _speed(known: Track, noise: float) -> float:
    """Return how fast the displacement changes at its liveliest tenth [m/s], between the shortest means to show it."""
    total = np.concatenate([[0.0], np.cumsum(known.place)])
    for size in 2 ** np.arange(0, 16):
        if size > len(known.place) // 16:
            break
        means = np.diff(total[:: max(size, 1)]) / size
        high = float(np.quantile(np.abs(np.diff(means)), 0.9))
        if high > 4.0 * noise * np.sqrt(2.0 / size):
            return high / (size * float(np.median(np.diff(known.time))))
    return 0.0
