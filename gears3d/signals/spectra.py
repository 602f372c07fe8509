"""Amplitude spectra over frequency and over the order of a gear, and the average over its revolutions."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from gears3d.errors import UsageError

FEWEST = 16  # Samples, and samples per revolution, below which a spectrum is not computed
MOST_POINTS = 1 << 14  # Points per revolution of a resampled signal at most


class Spectrum(NamedTuple):
    """A one-sided amplitude spectrum.

    Args:
        at: frequency [Hz] or order [1], from 0, (n,).
        amplitude: of the sine there, in the unit of the signal, (n,); at 0 the mean.
        resolution: distance of two lines that can be separated, in the unit of ``at``.
    """

    at: np.ndarray
    amplitude: np.ndarray
    resolution: float


class Average(NamedTuple):
    """A signal averaged over revolutions.

    Args:
        angle: of the gear within its revolution [rad], (n,).
        mean: of the signal there, (n,).
        deviation: between revolutions, (n,).
        revolutions: number of them.
    """

    angle: np.ndarray
    mean: np.ndarray
    deviation: np.ndarray
    revolutions: int


def frequency_spectrum(time: np.ndarray, values: np.ndarray, window: str = "hann") -> Spectrum:
    """Return the amplitude spectrum over frequency; a sine of amplitude A reads A.

    A line between two bins reads low by up to 15 % with the window "hann", 0.1 % with "flattop", 36 % with "boxcar";
    in exchange their lines are 1.5, 3.8 and 1 bins wide.

    Args:
        time: of the samples, rising [s], (n,); samples that are not evenly spaced are interpolated.
        values: (n,).
        window: name of one that ``scipy.signal.get_window`` knows.

    Returns:
        The spectrum, up to half the sampling rate.

    Raises:
        UsageError: fewer than 16 samples, or an unknown window.

    >>> time = np.arange(1000) / 1000
    >>> found = frequency_spectrum(time, 2.0 + 0.3 * np.sin(2 * pi * 50 * time))
    >>> found.amplitude[[0, 50]].round(9).tolist(), found.at[50].round(9).tolist()
    ([2.0, 0.3], 50.0)
    """
    if len(time) < FEWEST:
        raise UsageError(f"a spectrum needs {FEWEST} samples, there are {len(time)}: look at a longer time")
    step = np.diff(time)
    mean = float(time[-1] - time[0]) / (len(time) - 1)
    if float(np.abs(step - mean).max()) > 1e-6 * mean:
        even = time[0] + mean * np.arange(len(time))
        values = np.interp(even, time, values)
    return _spectrum(values, mean, window)


def order_spectrum(
    angle: np.ndarray, values: np.ndarray, window: str = "boxcar", points: int | None = None
) -> Spectrum:
    """Return the amplitude spectrum over the order of a gear at any speed; a sine of amplitude A reads A.

    The signal is resampled over the gear's angle and cut to whole revolutions, so that whole orders need no window.

    Args:
        angle: of the gear at the samples, rising [rad], (n,).
        values: (n,).
        window: name of one that ``scipy.signal.get_window`` knows.
        points: per revolution; as many as there are samples unless given.

    Returns:
        The spectrum, up to half the points per revolution.

    Raises:
        UsageError: less than one revolution, a gear that turns back, fewer than 16 samples a revolution, or an
            unknown window.

    >>> time = np.linspace(0.0, 1.0, 4001)
    >>> angle = 2 * pi * (10 * time + 0.5 * np.sin(9 * time))
    >>> found = order_spectrum(angle, 0.3 * np.cos(7 * angle + 1.0))
    >>> round(float(found.amplitude[np.argmin(np.abs(found.at - 7))]), 4)
    0.3
    """
    even, _, points = _over_angle(angle, values, points)
    return _spectrum(even, 1.0 / points, window)


def synchronous_average(angle: np.ndarray, values: np.ndarray, points: int | None = None) -> Average:
    """Return a signal averaged over the revolutions of a gear: what is not locked to it averages out.

    Args:
        angle: of the gear at the samples, rising [rad], (n,).
        values: (n,).
        points: per revolution; as many as there are samples unless given.

    Returns:
        The average over whole revolutions, from the angle of the first sample that is a multiple of 2π on.

    Raises:
        UsageError: as for :func:`order_spectrum`.

    >>> angle = np.linspace(0.0, 20 * pi, 5001)
    >>> found = synchronous_average(angle, np.cos(angle) + np.cos(0.1 * angle), points=100)
    >>> bool(np.abs(found.mean - np.cos(found.angle)).max() < 1e-3), found.revolutions
    (True, 10)
    """
    begin = np.ceil(angle[0] / (2 * pi) - 1e-9) * 2 * pi if len(angle) else 0.0
    even, revolutions, points = _over_angle(angle, values, points, begin)
    table = even.reshape(revolutions, points)
    return Average(2 * pi * np.arange(points) / points, table.mean(axis=0), table.std(axis=0), revolutions)


def lines(spectrum: Spectrum, count: int = 5, least: float = 0.02) -> list[tuple[float, float]]:
    """Return the strongest lines of a spectrum.

    Args:
        spectrum: with its mean at 0, which is left out.
        count: of lines at most.
        least: part of the strongest that a line must reach.

    Returns:
        Place and amplitude of each local maximum, strongest first.

    >>> lines(Spectrum(np.arange(6.0), np.array([9.0, 0.0, 3.0, 1.0, 2.0, 0.0]), 1.0))
    [(2.0, 3.0), (4.0, 2.0)]
    """
    a = spectrum.amplitude
    if len(a) < 4:
        return []
    inner = np.flatnonzero((a[1:-1] >= a[:-2]) & (a[1:-1] > a[2:])) + 1
    inner = inner[spectrum.at[inner] >= 2.0 * spectrum.resolution] if len(inner) else inner
    best = inner[np.argsort(-a[inner])][:count]
    return [(float(spectrum.at[i]), float(a[i])) for i in best if a[i] >= least * a[best[0]] > 0.0]


def _spectrum(values: np.ndarray, step: float, window: str) -> Spectrum:
    from scipy.signal import get_window

    try:
        weight = np.asarray(get_window(window, len(values)))
    except ValueError as error:
        raise UsageError(f"there is no window {window!r}: try hann, flattop or boxcar") from error
    mean = float(values.mean())
    amplitude = np.abs(np.fft.rfft((values - mean) * weight)) * 2.0 / weight.sum()
    if len(values) % 2 == 0:
        amplitude[-1] *= 0.5
    amplitude[0] = abs(mean)
    noise_width = float(np.sum(weight**2) / np.sum(weight) ** 2)
    return Spectrum(np.fft.rfftfreq(len(values), step), amplitude, noise_width / step)


def _over_angle(
    angle: np.ndarray, values: np.ndarray, points: int | None, begin: float | None = None
) -> tuple[np.ndarray, int, int]:
    """Return a signal at even angles over whole revolutions, their number, and the points per revolution."""
    from scipy.interpolate import make_interp_spline

    if len(angle) < FEWEST:
        raise UsageError(f"a spectrum needs {FEWEST} samples, there are {len(angle)}: look at a longer time")
    if float(np.diff(angle).min()) <= 0.0:
        raise UsageError("the gear turns back or stands still: its order is not defined, look at frequency instead")
    first = float(angle[0]) if begin is None else begin
    revolutions = int((float(angle[-1]) - first) / (2 * pi) + 1e-9)
    if revolutions < 1:
        raise UsageError("there is no whole revolution of the gear: look at a longer time, or at frequency")
    points = points or min(int(np.ceil(len(angle) * 2 * pi / (angle[-1] - angle[0]))), MOST_POINTS)
    if points < FEWEST:
        raise UsageError(f"there are {points} samples a revolution, {FEWEST} are needed: raise run.output_rate")
    at = first + 2 * pi * np.arange(revolutions * points) / points
    return make_interp_spline(angle, values, k=3)(np.minimum(at, angle[-1])), revolutions, points
