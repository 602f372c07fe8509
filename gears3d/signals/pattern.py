"""The pattern of impacts: which flanks are struck, and how often."""

from __future__ import annotations

import numpy as np

FLANKS = ("active", "reverse")
"""Names of the flanks, in the order of their codes."""
REGIMES = ("contact", "single_sided", "double_sided")
FLIGHT_HEIGHT_MIN = 0.05e-6
"""Impacts after flights no higher than this, m, are not counted: they are the last trembling of a bounce."""
SHARE = 0.1
"""A flank counts as struck when it is struck in more than this part of the periods."""


def regime(times: np.ndarray, flanks: np.ndarray, period: float, start: float, end: float) -> str:
    """Return which flanks are struck again and again.

    A flank that is struck in no more than a tenth of the periods counts as not struck: a transient that outlasted
    the settling time does not name the regime.

    Args:
        times: of the impacts that count [s], (k,).
        flanks: 0 active, 1 reverse, (k,).
        period: of the excitation [s].
        start: of what is looked at [s].
        end: of what is looked at [s].

    Returns:
        ``"contact"`` (no flank is struck), ``"single_sided"`` or ``"double_sided"``.

    Source: the three regimes of Comparin & Singh 1989 (no impact, single-sided and double-sided impacts).

    >>> regime(np.array([0.1, 0.6, 1.1, 1.6]), np.array([0, 1, 0, 1]), 1.0, 0.0, 2.0)
    'double_sided'
    """
    inside = (times >= start) & (times <= end)
    periods = max((end - start) / period, 1.0)
    struck = 0
    for flank in (0, 1):
        cycles = np.floor((times[inside & (flanks == flank)] - start) / period)
        struck += len(np.unique(cycles)) > SHARE * periods
    return REGIMES[struck]


def impacts_per_period(times: np.ndarray, period: float, start: float, end: float) -> float | None:
    """Return the mean number of impacts in a period, over the last whole number of periods.

    Args:
        times: of the impacts that count [s], (k,).
        period: of the excitation [s].
        start: of what is looked at [s].
        end: of what is looked at [s].

    Returns:
        The mean; ``None`` when there is not one whole period.

    >>> impacts_per_period(np.array([0.1, 0.6, 1.1, 1.6, 2.1]), 1.0, 0.0, 2.05)
    2.0
    """
    periods = int((end - start) / period + 1e-9)
    if periods < 1:
        return None
    first = end - periods * period
    return float(np.count_nonzero((times > first) & (times <= end)) / periods)
