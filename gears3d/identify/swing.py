"""The drive's swing in a record: amplitude and phase over time, and the record laid out by the periods of the swing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError

BINS = 192
"""Bins of a period."""
_STEPS = 128
"""Means that a period of the drive's angle is taken in before its swing is fitted."""
_WINDOW = 2
"""Periods in which one amplitude is fitted."""
_SMOOTH = 5
"""Amplitudes, half a period apart, that a straight line runs through."""
FEWEST = 6
"""Periods that a record must have."""


class Swing(NamedTuple):
    """The drive's acceleration about its mean motion as the real part of level·exp(i·omega·t), slowly changing.

    Args:
        omega: [rad/s].
        time: where it is known [s], (w,).
        level: complex amplitude of the acceleration [rad/s²], (w,).
    """

    omega: float
    time: np.ndarray
    level: np.ndarray

    def phase(self, time: np.ndarray) -> np.ndarray:
        """Return the phase of the acceleration, a cosine's, at some times, growing [rad], (n,).

        Args:
            time: [s], (n,).
        """
        return self.omega * time + np.interp(time, self.time, np.unwrap(np.angle(self.level)))

    def amplitude(self, time: np.ndarray) -> np.ndarray:
        """Return the amplitude of the acceleration at some times [rad/s²], (n,).

        Args:
            time: [s], (n,).
        """
        return np.interp(time, self.time, np.abs(self.level))


class Periods(NamedTuple):
    """A record laid out by periods, which begin where the drive speeds up most and flanks are pressed hardest.

    Args:
        place: mean displacement in each bin [m], NaN where nothing was read, (k, BINS).
        drive: mean angle of the drive gear there [rad], (k, BINS).
        loose: mean angle of the loose gear there [rad], (k, BINS).
        time: mean time there [s], (k, BINS).
        phase: mean phase there, from the beginning of the period [rad], (k, BINS).
        middle: time in the middle of each period [s], (k,).
        level: amplitude of the drive's acceleration in each period [rad/s²], (k,).
        rise: its change from period to period [rad/s²], (k,).
        rate: of the phase, which a swing that grows shifts [rad/s], (k,).
        omega: of the swing [rad/s].
    """

    place: np.ndarray
    drive: np.ndarray
    loose: np.ndarray
    time: np.ndarray
    phase: np.ndarray
    middle: np.ndarray
    level: np.ndarray
    rise: np.ndarray
    rate: np.ndarray
    omega: float


def find_swing(time: np.ndarray, angle: np.ndarray, frequency: float, file: str = "") -> Swing:
    """Return amplitude and phase of the drive's swing over time.

    Args:
        time: of the readings [s], rising, (n,).
        angle: of the drive gear [rad], (n,).
        frequency: of the swing [Hz].
        file: named in faults.

    Raises:
        InputError: too few periods, or too few readings in one.

    >>> time = np.linspace(0.0, 4.0, 8001)
    >>> swing = find_swing(time, 3.0 * time + (0.1 + 0.02 * time) * np.cos(6 * np.pi * time), 3.0)
    >>> (swing.amplitude(np.array([1.0, 2.0, 3.0])) / (6 * np.pi) ** 2).round(4).tolist()
    [0.12, 0.14, 0.16]
    """
    span = float(time[-1] - time[0])
    if span * frequency < FEWEST:
        remedy = f"record {FEWEST} periods or more"
        raise InputError(Fault("time_s", f"holds {span * frequency:.3g} periods of {frequency:.6g} Hz", remedy, file))
    edge = np.arange(time[0], time[-1], 1.0 / (frequency * _STEPS))
    at = np.unique(np.searchsorted(time, edge))
    at = at[at < len(time)]
    size = np.diff(at, append=len(time))
    if len(at) < 16 * span * frequency:
        raise InputError(Fault("theta_drive_rad", "is read less than 16 times a period", "record faster", file))
    mean = np.add.reduceat(time, at) / size
    angle = np.add.reduceat(angle, at) / size
    omega = 2.0 * np.pi * frequency
    shrunk = np.sinc(1.0 / _STEPS)
    middles = np.arange(mean[0] + 0.5 * _WINDOW / frequency, mean[-1] - 0.5 * _WINDOW / frequency, 0.5 / frequency)
    levels = np.zeros(len(middles), complex)
    for place, middle in enumerate(middles):
        low, high = np.searchsorted(mean, [middle - 0.5 * _WINDOW / frequency, middle + 0.5 * _WINDOW / frequency])
        since = mean[low:high] - middle
        turn, ramp = omega * mean[low:high], since * frequency
        columns = [np.ones_like(since), since, np.cos(turn), np.sin(turn), ramp * np.cos(turn), ramp * np.sin(turn)]
        found = np.linalg.lstsq(np.column_stack(columns), angle[low:high] - angle[low], rcond=None)[0]
        levels[place] = (found[2] - 1j * found[3]) / shrunk
    smooth = _smooth(levels)
    if len(smooth) < 2:
        raise InputError(Fault("time_s", "holds too few periods", f"record {FEWEST} periods or more", file))
    return Swing(omega, middles, 2j * omega * np.gradient(smooth, middles) - omega**2 * smooth)


def _smooth(levels: np.ndarray) -> np.ndarray:
    """Return straight lines through a few neighbours each."""
    from scipy.signal import savgol_filter

    if len(levels) < _SMOOTH:
        return levels
    real, imaginary = (np.asarray(savgol_filter(part, _SMOOTH, 1)) for part in (np.real(levels), np.imag(levels)))
    return real + 1j * imaginary


def periods(swing: Swing, time: np.ndarray, place: np.ndarray, drive: np.ndarray, loose: np.ndarray) -> Periods:
    """Return a record laid out by the periods of its swing, whole ones only.

    Args:
        swing: of the drive.
        time: of the readings [s], (n,).
        place: displacement [m], (n,).
        drive: angle of the drive gear [rad], (n,).
        loose: angle of the loose gear [rad], (n,).
    """
    inside = (time >= swing.time[0]) & (time <= swing.time[-1])
    time, place, drive, loose = time[inside], place[inside], drive[inside], loose[inside]
    phase = swing.phase(time) / (2.0 * np.pi)
    first, last = int(np.ceil(phase[0])), int(np.floor(phase[-1]))
    bins = np.floor((phase - first) * BINS).astype(int)
    kept = (bins >= 0) & (bins < (last - first) * BINS)
    count = np.bincount(bins[kept], minlength=(last - first) * BINS).astype(float)
    count[count == 0.0] = np.nan

    def mean(values: np.ndarray) -> np.ndarray:
        sums = np.bincount(bins[kept], values[kept], minlength=(last - first) * BINS)
        return (sums / count).reshape(-1, BINS)

    moments = np.interp(first + np.arange(last - first) + 0.5, phase, time)
    rate = 2.0 * np.pi / np.diff(np.interp(first + np.arange(last - first + 1), phase, time))
    level = swing.amplitude(moments)
    turn = 2.0 * np.pi * (mean(phase - first) - np.arange(last - first)[:, None])
    laid = (mean(place), mean(drive), mean(loose), mean(time), turn)
    return Periods(*laid, moments, level, np.gradient(level), rate, swing.omega)
