"""From a speed to an angle."""

from __future__ import annotations

import numpy as np

from gears3d.measured.readers.decode.results import Angle, Note, refuse, whole_column
from gears3d.signals import noise_of


def integrated(time: np.ndarray, speed: np.ndarray, channel: str = "") -> Angle:
    """Return the angle of a measured speed: trapezia, zero at the first sample.

    Errors of the speed accumulate: an offset grows with time, noise with its root. The notes give how far noise and
    the straight lines between samples carry; no record shows its own offset.

    Args:
        time: of the samples, rising [s], (n,).
        speed: [rad/s], (n,).
        channel: named in faults and notes.

    Raises:
        InputError: lengths differ, or time does not rise.

    >>> integrated(np.array([0.0, 1.0, 3.0]), np.array([2.0, 4.0, 4.0])).angle.tolist()
    [0.0, 3.0, 11.0]
    """
    speed, time = whole_column(speed, channel), whole_column(time, "time_s")
    if len(time) != len(speed):
        raise refuse(channel, f"has {len(speed)} rows, time has {len(time)}", "give columns of one length")
    step = np.diff(np.asarray(time, dtype=float))
    if not (step > 0.0).all():
        row = int(np.argmin(step > 0.0)) + 1
        raise refuse("time_s", f"does not rise at row {row}", "put the rows in order of time, each time once")
    speed = np.asarray(speed, dtype=float)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * step)])
    return Angle(angle, (_drift(time, speed, step, channel), _coarse(time, speed, angle, channel)))


def _drift(time: np.ndarray, speed: np.ndarray, step: np.ndarray, channel: str) -> Note:
    """Return how far noise carries the angle until the end."""
    lasts = float(time[-1] - time[0])
    noise = noise_of(np.asarray(time, dtype=float), speed) if len(speed) > 8 else 0.0
    walk = noise * float(np.sqrt(np.sum(step**2)))
    text = (
        f"integrated from a speed over {lasts:.6g} s: noise of {noise:.2g} rad/s carries the angle off by {walk:.2g} "
        f"rad, each 1e-3 rad/s of offset by {1e-3 * lasts:.2g} rad; such an angle holds for short times only"
    )
    return Note("drift", channel, walk, "rad", text, harmless=False)


def _coarse(time: np.ndarray, speed: np.ndarray, angle: np.ndarray, channel: str) -> Note:
    """Return what straight lines between samples cost, from the same with every other sample."""
    rare, own = time[::2], speed[::2]
    half = np.concatenate([[0.0], np.cumsum(0.5 * (own[1:] + own[:-1]) * np.diff(rare))])
    off = float(np.max(np.abs(half - angle[::2]))) / 3.0
    text = f"straight lines between samples of the speed put the angle off by about {off:.2g} rad"
    return Note("integration", channel, off, "rad", text)
