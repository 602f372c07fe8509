"""What a recording came to, in a few words and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gears3d.signals.pattern import FLIGHT_HEIGHT_MIN, impacts_per_period, regime
from gears3d.signals.strobe import periodicity

FLANKS = ("active", "reverse")


def window(signals: Mapping[str, np.ndarray], meta: Mapping[str, Any]) -> tuple[float, float]:
    """Return begin and end of what is looked at: after settling, up to the last sample.

    Args:
        signals: with ``time_s`` [s], (n,).
        meta: with ``settle_s`` when something is to be left out.

    Returns:
        Begin and end [s]; both the same when the recording ends before it has settled.

    >>> window({"time_s": np.array([0.0, 1.0, 2.0])}, {"settle_s": 0.5})
    (0.5, 2.0)
    """
    time = signals["time_s"]
    if not len(time):
        return 0.0, 0.0
    start = max(float(time[0]), float(meta.get("settle_s") or 0.0))
    return min(start, float(time[-1])), float(time[-1])


def describe(
    signals: Mapping[str, np.ndarray], impacts: Mapping[str, np.ndarray], meta: Mapping[str, Any]
) -> dict[str, Any]:
    """Return regime, repetition, number and mean speeds of the impacts after the settling time.

    Impacts after flights no higher than 0.05 µm are left out; where the height is not known, they count.

    Args:
        signals: with ``time_s`` [s], (n,).
        impacts: the contract's columns, (k,).
        meta: ``period_s`` [s], ``settle_s`` [s] and ``lyapunov_1_s`` [1/s], as far as known.

    Returns:
        What JSON can hold: ``regime``, ``motion`` (``"1T"``, ``"2T"``, ..., ``"chaotic"``, ``"aperiodic"``, or
        ``None`` without impacts), ``impacts``, ``impacts_per_period``, and for each flank
        ``active_impacts``, ``active_velocity_mean_m_s``, ``active_velocity_std_m_s``; ``None`` where there are none.

    >>> hits = {"time_s": np.array([0.5]), "flank": np.array([0]), "velocity_m_s": np.array([-0.02])}
    >>> found = describe({"time_s": np.array([0.0, 1.0])}, hits, {})
    >>> found["regime"], found["active_velocity_mean_m_s"], found["reverse_velocity_mean_m_s"]
    ('single_sided', -0.02, None)
    """
    start, end = window(signals, meta)
    height = impacts.get("flight_height_m", np.full(len(impacts["time_s"]), np.nan))
    counts = (impacts["time_s"] >= start) & (impacts["time_s"] <= end) & ~(height <= FLIGHT_HEIGHT_MIN)
    times, flanks, velocities = (impacts[name][counts] for name in ("time_s", "flank", "velocity_m_s"))
    known = meta.get("period_s")
    period = float(known) if known else max(end - start, 1e-300)
    found: dict[str, Any] = {
        "regime": regime(times, flanks, period, start, end),
        "motion": _motion(periodicity(times, flanks, velocities, period, start, end), len(times), meta),
        "impacts": len(times),
        "impacts_per_period": impacts_per_period(times, period, start, end) if known else None,
    }
    for code, name in enumerate(FLANKS):
        speeds = velocities[flanks == code]
        found[f"{name}_impacts"] = len(speeds)
        found[f"{name}_velocity_mean_m_s"] = float(speeds.mean()) if speeds.size else None
        found[f"{name}_velocity_std_m_s"] = float(speeds.std()) if speeds.size else None
    return found


def _motion(n: int | None, count: int, meta: Mapping[str, Any]) -> str | None:
    if (meta.get("lyapunov_1_s") or 0.0) > 0.0:
        return "chaotic"
    if n is not None:
        return f"{n}T"
    return "aperiodic" if count else None
