"""Counts of an encoder and the moments at which they change: the angles that a quantised record really knows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.signals.local import local_slope

_MOST = 200_000
"""Samples that are looked at to find the quantum."""
_FIT = 1e-3
"""How far, in quanta, a difference may be off a whole number."""
_SHARE = 0.999
"""Part of the differences that must be whole numbers of quanta."""

_REACH = 8
"""Edges to either side from which the time of one count is taken."""


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
        The smallest change [rad] when nearly all changes are whole multiples of it; ``None`` for a smooth record.

    >>> round(quantum(np.floor(np.linspace(0, 50, 1001) ** 1.2) * 0.25), 12)
    0.25
    """
    changes = np.abs(np.diff(angle[:_MOST]))
    scale = np.abs(angle[:_MOST]).max(initial=0.0)
    changes = changes[changes > 1e-13 * scale + 1e-300]
    if changes.size < 10:
        return None
    smallest = float(changes.min())
    first = changes[changes < 1.5 * smallest].mean()  # rounding of large angles averages out
    multiples = changes[changes < 100.0 * first] / first
    off = np.abs(multiples - np.round(multiples))
    rounding = 1e-13 * scale / first
    return float(first) if np.mean(off < _FIT + 10.0 * rounding) >= _SHARE else None


def count_of(angle: np.ndarray) -> float | None:
    """Return the angle of one count, also where several pass from sample to sample.

    Args:
        angle: of a record [rad], (n,).

    Returns:
        The largest angle [rad] of which all changes are whole multiples; ``None`` for a smooth record.

    >>> turn = np.linspace(0.0, 6.0, 3001) ** 1.1
    >>> round(count_of(np.floor(turn / 1e-4) * 1e-4), 12), count_of(turn)
    (0.0001, None)
    """
    angle = angle[:_MOST]
    rounding = 1e-12 * float(np.abs(angle).max(initial=0.0)) + 1e-300
    changes = np.sort(np.abs(np.diff(angle)))
    steps = np.diff(changes)
    steps = steps[steps > rounding]
    if not steps.size or (count := float(steps.min())) < 20.0 * rounding:
        return None
    for _ in range(3):  # the smallest step is rounded most; the sum of all changes least
        whole = np.round(changes / count)
        close = whole <= 0.1 * count / rounding
        count = float(changes[close].sum() / max(whole[close].sum(), 1.0))
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
