"""What the neighbours of a value tell: its noise, and the slope there."""

from __future__ import annotations

import numpy as np

_MAD = 1.4826
_TRIES = 400_000
"""Readings from which a noise floor is taken."""


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


def noise_of(time: np.ndarray, values: np.ndarray, sigma: np.ndarray | float = 1.0, clip: float | None = None) -> float:
    """Return the noise of a series that is smooth but for it, in units of ``sigma``.

    Every value is held against the parabola through one neighbour before and two after it; the median of what is left
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
    time, values = time[: _TRIES * step], values[: _TRIES * step]
    before, here, after, later = time[:-3], time[1:-2], time[2:-1], time[3:]
    with np.errstate(divide="ignore", invalid="ignore"):
        first = (here - after) * (here - later) / ((before - after) * (before - later))
        second = (here - before) * (here - later) / ((after - before) * (after - later))
        third = (here - before) * (here - after) / ((later - before) * (later - after))
    rest = values[1:-2] - first * values[:-3] - second * values[2:-1] - third * values[3:]
    var = np.broadcast_to(np.square(sigma), (len(values),)) if np.ndim(sigma) == 0 else np.square(sigma)[: len(values)]
    spread = np.sqrt(var[1:-2] + first**2 * var[:-3] + second**2 * var[2:-1] + third**2 * var[3:])
    standard = rest / spread
    standard = standard[np.isfinite(standard)]
    if not standard.size:
        return 0.0
    middle = _MAD * float(np.median(np.abs(standard)))
    if clip is None or middle == 0.0:
        return middle
    return float(np.sqrt(np.mean(np.minimum(standard**2, (clip * middle) ** 2))))
