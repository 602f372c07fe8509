"""The impacts of a run as the report's plots take them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.comparison.matching import match
from gears3d.views.report.traces import TICK

if TYPE_CHECKING:
    from gears3d.recording import Recording

QUANTA = {
    "velocity_m_s": 1e-7,
    "rebound_m_s": 1e-7,
    "phase_rad": 1e-6,
    "impulse_N_s": 1e-7,
    "flight_height_m": 1e-10,
    "tooth_drive": 1.0,
    "tooth_loose": 1.0,
}
"""Quantum of each column that is embedded."""


def impact_table(recording: Recording, quanta: dict[str, float] = QUANTA) -> dict[str, Any]:
    """Return the impacts as integers of stated quanta."""
    impacts = recording.impacts
    return {
        "tick": TICK,
        "time": np.rint(impacts["time_s"] / TICK).astype(np.int64).tolist(),
        "flank": impacts["flank"].tolist(),
        "columns": {name: whole(impacts[name], quantum) for name, quantum in quanta.items()},
    }


def whole(values: Any, quantum: float) -> dict[str, Any]:
    """Return a column as whole multiples of a quantum; what is not finite is ``None``.

    >>> whole([0.25, float("nan")], 0.1)
    {'quantum': 0.1, 'values': [2, None]}
    """
    scaled = np.asarray(values, float) / quantum
    rounded = [int(value) if ok else None for value, ok in zip(np.rint(scaled), np.isfinite(scaled), strict=True)]
    return {"quantum": quantum, "values": rounded}


def speed_errors(
    recording: Recording, twin: Recording, period: float, least_height: float
) -> dict[str, list[int] | list[float]]:
    """Return how far each impact's speed is from the twin's, impact by impact as the comparison pairs them."""
    mine, theirs = match(recording.impacts, twin.impacts, period)
    counts = ~(twin.impacts["flight_height_m"][theirs] <= least_height)
    mine, theirs = mine[counts], theirs[counts]
    speed = np.abs(recording.impacts["velocity_m_s"][mine])
    truth = np.abs(twin.impacts["velocity_m_s"][theirs])
    known = truth > 0
    error = (speed[known] - truth[known]) / truth[known]
    return {"impact": mine[known].tolist(), "error": [float(f"{value:.4g}") for value in error]}


def speed_histogram(recording: Recording, twin: Recording | None, bins: int = 40) -> dict[str, Any]:
    """Return how often impacts are how fast, by flank."""
    both = [one for one in (recording, twin) if one is not None]
    speeds = [np.abs(one.impacts["velocity_m_s"]) for one in both]
    fastest = max((float(s.max()) for s in speeds if s.size), default=0.0)
    if not fastest > 0:
        return {"edges": [], "run": [[], []], "twin": None}
    edges = np.linspace(0.0, fastest * 1.0001, bins + 1)
    counts = [
        [np.histogram(speed[one.impacts["flank"] == f], edges)[0].tolist() for f in (0, 1)]
        for one, speed in zip(both, speeds, strict=True)
    ]
    return {
        "edges": [float(f"{edge:.5g}") for edge in edges],
        "run": counts[0],
        "twin": counts[1] if twin is not None else None,
    }
