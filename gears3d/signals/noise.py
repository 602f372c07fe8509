"""Noise of samples: robust deviations, local slopes, counts of encoders, highest frequency above the noise."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_TRIES = 400_000  # Readings from which a noise floor is taken
_AT_ONCE = 1 << 18  # Values that are looked at at a time: of a long record nothing as long as itself is made on the way
_SOME = 200_000  # Steps from which the typical one is taken
_MOST = 200_000  # Samples that are looked at to find the quantum
_FIT = 1e-3  # How far, in quanta, a difference may be off a whole number
_SHARE = 0.999  # Part of the differences that must be whole numbers of quanta
_ROUNDED = 10.0  # Ratio of the angle of a count to the unit to which a file rounds angles, from which both show
_FEWEST = 20  # Counts that a rounded record must pass
_UNEVEN = 0.01  # Part of its changes that must have other numbers of counts than most have
_REACH = 8  # Edges to either side from which the time of one count is taken
STANDS_OUT = 20.0  # Times the floor of the noise: no mean over SEGMENTS spectra comes near that by chance
SEGMENTS = 8  # Of the mean spectrum, half overlapping ones besides
QUIET = 0.01  # Noise in the second derivative that needs no smoothing, part of all of it


def changes(values: np.ndarray, at_once: int = _AT_ONCE) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the changes from value to value in pieces, each with the number of its first one.

    Args:
        values: (n,).
        at_once: changes in a piece.

    >>> [(first, change.tolist()) for first, change in changes(np.array([0.0, 1.0, 3.0, 6.0]), 2)]
    [(0, [1.0, 2.0]), (2, [3.0])]
    """
    for first in range(0, len(values) - 1, at_once):
        yield first, np.diff(values[first : first + at_once + 1])


def some_steps(time: np.ndarray) -> np.ndarray:
    """Return some of the steps from time to time, spread evenly, from which the typical one is taken.

    Args:
        time: (n,).

    >>> some_steps(np.array([0.0, 1.0, 3.0])).tolist(), len(some_steps(np.arange(1_000_000.0)))
    ([1.0, 2.0], 200000)
    """
    every = max((len(time) - 1) // _SOME, 1)
    first = np.arange(0, max(len(time) - 1, 0), every)
    return (time[first + 1] - time[first])[: _SOME if every > 1 else None]


def local_slope(time: np.ndarray, values: np.ndarray, reach: int) -> np.ndarray:
    """Return the slope near each value, from neighbours on both sides; from fewer at the ends.

    Args:
        time: rising [s], (n,).
        values: (n,).
        reach: how many neighbours off.

    Returns:
        Slopes, (n,).

    >>> local_slope(np.arange(5.0), np.arange(5.0) ** 2, 1).tolist()
    [1.0, 2.0, 4.0, 6.0, 7.0]
    """
    low = np.clip(np.arange(len(time)) - reach, 0, None)
    high = np.clip(np.arange(len(time)) + reach, None, len(time) - 1)
    return (values[high] - values[low]) / np.maximum(time[high] - time[low], 1e-300)


def robust_deviation(values: np.ndarray) -> float:
    """Return the standard deviation about zero of most of some values, from the median of their magnitudes.

    Args:
        values: of any shape; 0 is returned of none.

    >>> robust_deviation(np.array([-1.0, 1.0, 100.0]))
    1.4826
    """
    return 1.4826 * float(np.median(np.abs(values))) if values.size else 0.0


def noise_of(time: np.ndarray, values: np.ndarray, sigma: np.ndarray | float = 1.0, clip: float | None = None) -> float:
    """Return the noise of a series that is smooth but for it, in units of ``sigma``.

    Every value is compared with the parabola through one neighbour before and two after it; the median of the residuals
    tells the noise and does not see impacts, which are few.

    Args:
        time: rising, not necessarily evenly [s], (n,).
        values: (n,).
        sigma: expected deviation of each value, one number or (n,).
        clip: take the root of the mean square in place of the median, what is larger than so many medians cut: counts
            have few values, and a median stays on one of them.

    Returns:
        Standard deviation over the expected one.

    >>> time = np.linspace(0.0, 1.0, 20001)
    >>> round(noise_of(time, 5.0 * time**2 + np.random.default_rng(1).normal(0.0, 0.01, len(time))), 3)
    0.01
    """
    step = 2 if len(time) > 2 * _TRIES else 1
    count = min(_TRIES * step, len(time))
    spread = np.broadcast_to(sigma, (len(values),))
    parts = [
        _bent(*(column[first : min(first + _AT_ONCE + 3, count)] for column in (time, values, spread)))
        for first in range(0, max(count - 3, 0), _AT_ONCE)
    ]
    standard = np.concatenate([*parts, np.zeros(0)])
    if not standard.size:
        return 0.0
    middle = robust_deviation(standard)
    if clip is None or middle == 0.0:
        return middle
    return float(np.sqrt(np.mean(np.minimum(np.abs(standard), clip * middle) ** 2)))


def _bent(time: np.ndarray, values: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Return by how much values differ from the parabolas through their neighbours, in standard deviations."""
    before, here, after, later = time[:-3], time[1:-2], time[2:-1], time[3:]
    with np.errstate(divide="ignore", invalid="ignore"):
        first = (here - after) * (here - later) / ((before - after) * (before - later))
        second = (here - before) * (here - later) / ((after - before) * (after - later))
        third = (here - before) * (here - after) / ((later - before) * (later - after))
    rest = values[1:-2] - first * values[:-3] - second * values[2:-1] - third * values[3:]
    var = np.square(sigma)
    spread = np.sqrt(var[1:-2] + first**2 * var[:-3] + second**2 * var[2:-1] + third**2 * var[3:])
    standard = rest / spread
    return standard[np.isfinite(standard)]


class Edges(NamedTuple):
    """Angles that an encoder passed, and when.

    Args:
        time: best estimate of the moment [s], (n,).
        angle: of the edge that was passed [rad], (n,).
        slack: standard deviation of the moment [s], (n,).
    """

    time: np.ndarray
    angle: np.ndarray
    slack: np.ndarray


def quantum(angle: np.ndarray) -> float | None:
    """Return the angle of one count.

    Args:
        angle: of a record, in order of time [rad], (n,).

    Returns:
        The smallest change [rad] when nearly all changes are whole multiples of it, to within the decimals of a file;
        ``None`` for a smooth record.

    >>> counts = np.floor(np.linspace(0, 50, 1001) ** 1.2)
    >>> round(quantum(counts * 0.25), 12), round(360 / quantum(np.round(counts * 360 / 4096, 3)), 1)
    (0.25, 4096.0)
    """
    every = np.abs(np.diff(angle[:_MOST]))
    scale = np.abs(angle[:_MOST]).max(initial=0.0)
    changes = every[every > 1e-13 * scale + 1e-300]
    if changes.size < 10:
        return None
    smallest = float(changes.min())
    if changes.size == every.size and changes.max() < 1.5 * smallest:
        return None  # as many counts in every sample, or none at all: :func:`count_of` knows
    first = changes[changes < 1.5 * smallest].mean()  # rounding of large angles averages out
    multiples = changes[changes < 100.0 * first] / first
    off = np.abs(multiples - np.round(multiples))
    rounding = 1e-13 * scale / first
    return float(first) if np.mean(off < _FIT + 10.0 * rounding) >= _SHARE else _rounded_count(angle[:_MOST])


def _rounded_count(angle: np.ndarray) -> float | None:
    """Return the angle of one count of angles that a file rounds to a finer unit, as 0.088 deg of 4096 counts.

    Each count has one rounded angle, so that angles differ by more than half a count or not at all, and changes by
    whole counts to within the unit of rounding.
    """
    values = np.unique(angle)
    change = np.diff(angle)
    seen = np.unique(np.concatenate([np.abs(change), np.diff(values)]))
    gaps = np.unique(np.diff(seen))
    gaps = gaps[gaps > 1e-13 * np.abs(angle).max()]
    if len(gaps) < 2:
        return None
    at = int(np.argmax(gaps[1:] / gaps[:-1]))
    unit, count = float(gaps[at]), float(gaps[at + 1])
    if not _is_decimal(unit):  # readings that miss updates change by none, one or two equal steps of many counts
        return None
    error = 2.0 * unit
    for _ in range(4):  # more counts in a change divide its error by more
        whole = np.round(seen / count)
        close = (whole > 0.0) & (whole * error < 0.2 * count)
        if count < _ROUNDED * unit or not close.any():
            return None
        count, error = float(seen[close].sum() / whole[close].sum()), unit / float(whole[close].max())
    whole = np.round(change / count)
    if np.mean(np.abs(change - whole * count) < 1.05 * unit) < _SHARE or np.diff(values).min() < 0.5 * count:
        return None
    number = np.concatenate([[0.0], np.cumsum(whole)])
    numbers = np.sort(np.unique(np.abs(whole), return_counts=True)[1])
    if np.ptp(number) < _FEWEST or numbers[:-1].sum() < _UNEVEN * len(whole):
        return None  # even steps of many counts look like counts, too
    return float(np.polyfit(number, angle, 1)[0])


def _is_decimal(unit: float) -> bool:
    """Return whether an angle [rad] is one or two units of a decimal place, in radians, degrees or revolutions."""
    decades = np.log10(unit * np.outer([1.0, 180.0 / np.pi, 0.5 / np.pi], [1.0, 0.5]))
    return bool(np.any(np.abs(decades - np.round(decades)) < 0.002))


def count_of(angle: np.ndarray) -> float | None:
    """Return the angle of one count, also where several pass from sample to sample.

    Args:
        angle: of a record [rad], (n,).

    Returns:
        The largest angle [rad] of which all changes are whole multiples; ``None`` for a smooth record.

    >>> turn = np.linspace(0.0, 6.0, 3001) ** 1.1
    >>> round(count_of(np.floor(turn / 1e-4) * 1e-4), 12), count_of(turn)
    (0.0001, None)
    >>> fast = 2.2e-5 * (3719.0 * np.arange(8000) + np.round(3.0 * np.sin(np.arange(8000))))
    >>> round(count_of(fast), 12)
    2.2e-05
    """
    angle = angle[:_MOST]
    rounding = 1e-12 * float(np.abs(angle).max(initial=0.0)) + 1e-300
    every = np.sort(np.abs(np.diff(angle)))
    changes = every[every > rounding]  # readings may repeat
    steps = np.diff(every)
    steps = steps[steps > rounding]
    if not steps.size or (count := float(steps.min())) < 20.0 * rounding:
        return None
    error = rounding  # of the count; the sum of many counts is rounded least, and says how many more are in a change
    exact = 4.0 * np.finfo(float).eps * float(np.abs(angle).max())
    for values in (np.abs(changes - changes[len(changes) // 2]), changes, changes):
        whole = np.round(values / count)
        close = whole <= 0.1 * count / error
        if (most := float(whole[close].max(initial=0.0))) < 1.0:
            return None
        count = float(values[close].sum() / whole[close].sum())
        seen = float(np.abs(values - whole * count)[close].max())  # often less rounding than is admitted
        error = min(rounding, seen + exact) / most
        if count < 20.0 * rounding:
            return None
    off = np.abs(changes / count - np.round(changes / count))
    return count if np.mean(off < _FIT + 4.0 * rounding / count) > 0.999 else None


def edges(time: np.ndarray, angle: np.ndarray, quantum: float) -> Edges:
    """Return the moments at which a counter changed, in place of what it showed in between.

    A counter that rounds down knows the angle exactly at the moment it changes. When it shows a change, that moment
    lies back by anything up to one sample, or up to the time that one count takes where that is shorter.

    Args:
        time: of the samples [s], (n,).
        angle: as counted, whole numbers of quanta [rad], (n,).
        quantum: of :func:`quantum` [rad].

    Returns:
        One edge for each sample that differs from the one before.

    >>> true = np.linspace(0.0, 1.0, 21)
    >>> found = edges(true, np.floor(true / 0.1 + 1e-9) * 0.1, 0.1)
    >>> bool(np.all(np.abs(found.angle - found.time) <= 0.05 + 1e-9))
    True
    """
    change = np.diff(angle)
    at = np.flatnonzero(np.abs(change) > 0.5 * quantum) + 1
    passed = np.where(change[at - 1] > 0.0, angle[at], angle[at] + quantum)
    with np.errstate(divide="ignore"):
        for_a_count = quantum / np.abs(local_slope(time[at], passed, _REACH))
    back = np.minimum(time[at] - time[at - 1], for_a_count)
    return Edges(time[at] - 0.5 * back, passed, back / np.sqrt(12.0))


def content(values: NDArray[np.float64], step: float) -> float | None:
    """Return the highest frequency at which the spectrum of a signal exceeds a white noise.

    Args:
        values: equally spaced in time, (n,); a trend is taken out.
        step: between samples [s].

    Returns:
        Frequency [Hz]; ``None`` where noise is negligible even in the second derivative, or nothing exceeds it.

    >>> time = np.arange(20_000) * 1e-3
    >>> noise = 0.01 * np.random.default_rng(1).standard_normal(len(time))
    >>> 5.0 <= content(np.sin(2 * np.pi * 5.0 * time) + noise, 1e-3) < 7.0
    True
    >>> content(np.sin(2 * np.pi * 5.0 * time), 1e-3) is None
    True
    """
    from scipy.signal import welch

    bent = np.diff(values, 2)  # low frequencies, which are large, would leak into all others
    length = max(len(bent) // SEGMENTS, min(len(bent), 64))
    frequency, power = welch(bent, 1.0 / step, "blackmanharris", length, detrend="constant")
    frequency, power = frequency[1:], power[1:] / (16.0 * np.sin(np.pi * frequency[1:] * step) ** 4)
    floor = float(np.median(power[len(power) // 2 :]))
    if np.sqrt(6.0 * floor * 0.5 / step) <= QUIET * np.sqrt(np.mean(bent**2)):
        return None
    out = np.flatnonzero(power > STANDS_OUT * floor)
    return float(frequency[out[-1]]) if len(out) else None
