"""The name of the motion: repeating, quasi-periodic, chaotic, or too short to tell."""

from __future__ import annotations

from collections.abc import Mapping
from math import log
from typing import Any

import numpy as np

from gears3d.signals.strobe import periodicity

LONGEST = 8
"""Largest n of nT that is tried, unless the run is long enough for more."""
TOO_SHORT = "too_short"
MARGIN = 3.0
"""A disturbance must have grown by more than e to this power, beyond the number of periods, to be called chaos."""


def chaotic(exponent: float, span: float, period: float) -> bool:
    """Return whether a largest Lyapunov exponent of the model, over a finite time, says chaos.

    In regular motion a disturbance may still grow in proportion to time, so that ln(number of periods) is no sign of
    chaos; what counts is growth well beyond that.

    Args:
        exponent: from the model [1/s].
        span: time that was looked at [s].
        period: of the excitation [s].

    >>> chaotic(2.0, 5.0, 1 / 3), chaotic(0.1, 5.0, 1 / 3), chaotic(float("-inf"), 5.0, 1.0)
    (True, False, False)
    """
    return exponent * span > MARGIN + log(max(span / period, 1.0))


def motion(
    times: np.ndarray,
    flanks: np.ndarray,
    velocities: np.ndarray,
    period: float,
    start: float,
    end: float,
    meta: Mapping[str, Any],
) -> str | None:
    """Return how the impacts repeat.

    Args:
        times: of the impacts that count [s], (k,).
        flanks: 0 active, 1 reverse, (k,).
        velocities: of the impacts [m/s], (k,).
        period: of the excitation [s].
        start: of what is looked at [s].
        end: of what is looked at [s].
        meta: with ``lyapunov_1_s`` [1/s] where the model followed a disturbance.

    Returns:
        ``"1T"``, ``"2T"``, ...; ``"chaotic"``; ``"aperiodic"``; ``"too_short"`` with fewer than three repetitions of
        the longest pattern that is tried; ``None`` without impacts.

    >>> motion(np.arange(30.0), np.zeros(30), np.full(30, -0.02), 1.0, 0.0, 30.0, {})
    '1T'
    >>> motion(np.arange(2.0), np.zeros(2), np.full(2, -0.02), 1.0, 0.0, 2.0, {})
    'too_short'
    """
    if not np.any((times >= start) & (times <= end)):
        return None
    exponent = meta.get("lyapunov_1_s")
    if exponent is not None and chaotic(exponent, end - start, period):
        return "chaotic"
    n = periodicity(times, flanks, velocities, period, start, end, LONGEST)
    if n is not None:
        return f"{n}T"
    return TOO_SHORT if end - start < 3 * LONGEST * period else "aperiodic"
