"""Measures and reductions by name.

A measure takes a case and returns a value or an array in SI units, or a word; one whose first parameter is ``cases``
takes all cases of its row together. A reduction makes one value of several.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

MEASURES: dict[str, Callable[..., Any]] = {}
REDUCTIONS: dict[str, Callable[[Sequence[Any]], Any]] = {}


def measure(function: Callable[..., Any]) -> Callable[..., Any]:
    """Make a function available to rows by its name."""
    MEASURES[function.__name__] = function
    return function


def reduction(function: Callable[[Sequence[Any]], Any]) -> Callable[[Sequence[Any]], Any]:
    """Make a function available to rows as ``over``."""
    REDUCTIONS[function.__name__] = function
    return function


@reduction
def mean(values: Sequence[float]) -> float:
    """Return the mean."""
    return float(np.mean(values))


@reduction
def spread(values: Sequence[float]) -> float:
    """Return the largest value less the smallest."""
    return float(np.ptp(values))


@reduction
def relative_spread(values: Sequence[float]) -> float:
    """Return the largest value less the smallest, over the mean."""
    return float(np.ptp(values) / np.mean(values))


@reduction
def deviation(values: Sequence[float]) -> float:
    """Return the standard deviation."""
    return float(np.std(values))


@reduction
def relative_deviation(values: Sequence[float]) -> float:
    """Return the standard deviation over the magnitude of the mean."""
    return float(np.std(values) / abs(np.mean(values)))


@reduction
def smallest_share(values: Sequence[float]) -> float:
    """Return the smallest value over the largest."""
    return float(min(values) / max(values))


@reduction
def largest(values: Sequence[float]) -> float:
    """Return the largest value."""
    return float(max(values))


@reduction
def ratio(values: Sequence[float]) -> float:
    """Return the first value over the last."""
    return float(values[0] / values[-1])


@reduction
def decibels(values: Sequence[float]) -> float:
    """Return the first value over the last [dB]."""
    return float(10 * np.log10(values[0] / values[-1]))


@reduction
def distance(values: Sequence[float]) -> float:
    """Return how far the first value is from the last."""
    return float(abs(values[0] - values[-1]))


@reduction
def relative_change(values: Sequence[float]) -> float:
    """Return the change from the last value to the first, over the last."""
    return values[0] / values[-1] - 1.0


@reduction
def growth(values: Sequence[float]) -> float:
    """Return by how much more the last of three values exceeds the second than that the first.

    >>> growth([1.0, 2.0, 4.0])
    2.0
    """
    return float((values[2] - values[1]) / (values[1] - values[0]))


@reduction
def trend(values: Sequence[float]) -> str:
    """Return how values change on the whole: at every step, or but for some steps back.

    >>> trend([1.0, 2.0, 3.0]), trend([3.0, 2.0, 2.5, 1.0]), trend([1.0, 2.0, 1.0])
    ('rises', 'falls on the whole', 'neither')
    """
    v = np.asarray(values, float)
    steps = np.diff(v)
    if (steps > 0.0).all() or (steps < 0.0).all():
        return "rises" if steps[0] > 0.0 else "falls"
    slope = np.corrcoef(np.arange(len(v)), v)[0, 1] if np.ptp(v) > 0.0 else 0.0
    return f"{'rises' if slope > 0.0 else 'falls'} on the whole" if abs(slope) > 0.6 else "neither"


@reduction
def all_repeat(motions: Sequence[str]) -> str:
    """Return ``"repeats"`` if all motions do, else how many of them."""
    many = motions.count("repeats")
    return "repeats" if many == len(motions) else f"repeats at {many} of {len(motions)}"
