"""What the neighbours of a value tell: its noise, and the slope there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

_TRIES = 400_000
"""Readings from which a noise floor is taken."""
_AT_ONCE = 1 << 18
"""Values that are looked at at a time: of a long record nothing as long as itself is made on the way."""
_SOME = 200_000
"""Steps that tell what is typical."""


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
    """Return some of the steps from time to time, spread evenly, to tell what is typical.

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
    """Return by how much values are off the parabolas through their neighbours, in standard deviations."""
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
