"""The name of the motion: repeating, quasi-periodic, chaotic, or too short to tell."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, log
from typing import NamedTuple

import numpy as np

from gears3d.signals.lyapunov import Exponent, exponent
from gears3d.signals.recurrence import on_closed_curve
from gears3d.signals.strobe import periodicity, stroboscope, widest_phase

Table = Mapping[str, np.ndarray]

LONGEST = 32
"""Largest n of nT that is tried; three repetitions must fit into the time that is looked at."""
ENOUGH = 24
"""Periods below which a motion that does not repeat is too short to tell."""
MOST = 4000
"""Periods of the section at most; the last ones are taken."""
MARGIN = 3.0
"""A model's disturbance must have grown by e to this power, and the number of periods, to be called chaos."""
PER_PERIOD = 32
"""States a period between which the distance of neighbours is followed."""
LEAST = 0.05
"""Growth per period that an exponent from a recording must exceed by three deviations to be called chaos."""


class Motion(NamedTuple):
    """How a motion repeats.

    Args:
        name: ``"1T"``, ``"2T"``, ...; ``"quasi_periodic"``; ``"chaotic"``; ``"aperiodic"``; ``"too_short"``;
            ``None`` without impacts.
        exponent: largest Lyapunov exponent [1/s], minus infinity where contact wipes out every disturbance;
            ``None`` where it is not known.
        deviation: of an exponent that was estimated [1/s].
        source: of the exponent: ``"model"`` or ``"recording"``.
    """

    name: str | None
    exponent: float | None = None
    deviation: float | None = None
    source: str | None = None


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


def motion(signals: Table, impacts: Table, period: float, start: float, end: float, known: float | None) -> Motion:
    """Return how the motion repeats.

    A model's exponent says chaos where it is clearly positive. Then the impacts are asked whether they repeat, the
    stroboscopic section whether it is a closed curve, and neighbours in it whether they part.

    Args:
        signals: ``time_s`` and, where known, ``displacement_m``, ``velocity_m_s``, (n,).
        impacts: those that count: ``time_s``, ``flank``, ``velocity_m_s``, (k,).
        period: of the excitation [s].
        start: of what is looked at [s].
        end: of what is looked at [s].
        known: largest Lyapunov exponent of the model [1/s], ``None`` where no disturbance was followed.

    Returns:
        Its name and what is known of its exponent.

    >>> hits = {"time_s": np.arange(30.0), "flank": np.zeros(30), "velocity_m_s": np.full(30, -0.02)}
    >>> motion({"time_s": np.arange(31.0)}, hits, 1.0, 0.0, 30.0, None).name
    '1T'
    >>> few = {name: values[:2] for name, values in hits.items()}
    >>> motion({"time_s": np.arange(3.0)}, few, 1.0, 0.0, 2.0, None).name
    'too_short'
    """
    known = None if known is None or np.isnan(known) else float(known)
    said = Motion(None, known, None, None if known is None else "model")
    times, flanks, velocities = (impacts[name] for name in ("time_s", "flank", "velocity_m_s"))
    if not times.size:
        return said
    if known is not None and chaotic(known, end - start, period):
        return said._replace(name="chaotic")
    n = periodicity(times, flanks, velocities, period, start, end, LONGEST)
    if n is not None:
        return said._replace(name=f"{n}T")
    if end - start < ENOUGH * period:
        return said._replace(name="too_short")
    begin = max(start, end - MOST * period)
    found = _by_section(signals, impacts, period, begin, end, said)
    return found or said._replace(name="aperiodic")


def _by_section(signals: Table, impacts: Table, period: float, start: float, end: float, said: Motion) -> Motion | None:
    """Return what the stroboscopic section tells, ``None`` if nothing."""
    if not {"displacement_m", "velocity_m_s"} <= signals.keys():
        return None
    points = stroboscope(signals, impacts, period, widest_phase(signals, impacts, period, start, end), start, end)
    spread = max(float(np.ptp(signals["velocity_m_s"])), 1e-300)
    if len(points) < 2 or float(points[:, 1].std()) < 1e-6 * spread:
        return None
    if on_closed_curve(np.hstack([points[:-1], points[1:]])):
        return said._replace(name="quasi_periodic")
    if said.exponent == -inf:
        return None
    grown = growth(signals, impacts, period, start, end)
    if grown is None:
        return None
    rate = PER_PERIOD / period
    if said.source is None:
        said = said._replace(exponent=grown.value * rate, deviation=grown.deviation * rate, source="recording")
        if (grown.value - 3.0 * grown.deviation) * PER_PERIOD > LEAST:
            return said._replace(name="chaotic")
    return said._replace(name="aperiodic")


def growth(signals: Table, impacts: Table, period: float, start: float, end: float) -> Exponent | None:
    """Return the largest Lyapunov exponent that a recording itself shows, per 32nd of a period.

    Args:
        signals: ``time_s``, ``displacement_m``, ``velocity_m_s``, (n,).
        impacts: ``time_s``, (k,).
        period: of the excitation [s].
        start: of what is looked at [s].
        end: of what is looked at [s].

    Returns:
        As :func:`~gears3d.signals.lyapunov.exponent`: 32 states a period, neighbours at the same phase.
    """
    whole = [stroboscope(signals, impacts, period, k / PER_PERIOD, start, end) for k in range(PER_PERIOD)]
    offset = int(np.argmin([phase_first(start, period, k / PER_PERIOD) for k in range(PER_PERIOD)]))
    whole = whole[offset:] + whole[:offset]
    count = min(map(len, whole))
    return exponent(np.stack([one[:count] for one in whole], axis=1).reshape(-1, 2), PER_PERIOD)


def phase_first(start: float, period: float, phase: float) -> float:
    """Return how long after ``start`` a phase comes for the first time, in cycles.

    Args:
        start: [s].
        period: [s].
        phase: in cycles.

    >>> round(phase_first(1.0, 1.0, 0.25), 12)
    0.25
    """
    return float(np.mod(phase - start / period + 1e-9, 1.0) - 1e-9)
