"""The signals of a run, thinned so that lines between the points left keep every flight's shape."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from gears3d.recording import Recording

TICK = 1e-7
"""Time step of the embedded data, s."""

CHANNELS = {
    "displacement_m": (1e-9, 1e-4),
    "velocity_m_s": (1e-6, 3e-4),
    "omega_drive_rad_s": (1e-6, 1e-3),
    "omega_loose_rad_s": (1e-6, 1e-3),
}
"""Quantum and tolerance (fraction of the range) of each signal that is drawn."""

MOST_POINTS = 30_000


def traces(recording: Recording, twin: Recording | None = None, most: int = MOST_POINTS) -> dict[str, Any]:
    """Return the signals of a run and its twin on one thinned time axis, as integers of stated quanta."""
    if not len(recording.time):
        return {"tick": TICK, "time": [], "run": {}, "twin": None}
    with_corners = [cornered(one) for one in (recording, twin) if one is not None]
    ticks = np.unique(np.concatenate([thinned(columns, most) for columns in with_corners]))
    tables = [_table(columns, ticks) for columns in with_corners]
    return {
        "tick": TICK,
        "time": np.diff(ticks, prepend=0).tolist(),
        "run": tables[0],
        "twin": tables[1] if twin is not None else None,
    }


def _table(columns: dict[str, np.ndarray], ticks: np.ndarray) -> dict[str, Any]:
    out = {}
    for name, (quantum, _) in CHANNELS.items():
        if name in columns:
            values = np.interp(ticks, columns["tick"], columns[name])
            values = np.rint(values / quantum).astype(np.int64)
            out[name] = {"quantum": quantum, "steps": np.diff(values, prepend=0).tolist()}
    return out


def cornered(recording: Recording) -> dict[str, np.ndarray]:
    """Return the signals with two points put in at every impact: just before and just after.

    The sampled signals cut these corners off. Displacement before is carried on from the last sample; the speeds
    jump by what the impact table says.
    """
    time = recording.time
    columns = {name: recording.signals[name] for name in CHANNELS if name in recording.signals}
    hits = recording.impacts["time_s"]
    inside = (hits > time[0]) & (hits < time[-1])
    hits = hits[inside]
    jumps = (recording.impacts["rebound_m_s"] - recording.impacts["velocity_m_s"])[inside]
    corners = _corners(columns, time, hits, jumps)
    ticks = np.concatenate([np.rint(time / TICK), np.rint(hits / TICK) - 1, np.rint(hits / TICK) + 1])
    ticks, first = np.unique(ticks.astype(np.int64), return_index=True)
    merged = {name: np.concatenate([columns[name], *corners[name]])[first] for name in columns}
    return {"tick": ticks, **merged, "keep": first >= len(time)}


def _corners(
    columns: dict[str, np.ndarray], time: np.ndarray, hits: np.ndarray, jumps: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return each channel just before and just after every impact.

    A speed is what the samples on both sides say, less its jump, shared out over the sampling interval. Where two
    impacts fall into one interval the line between the samples has to do.
    """
    before = np.searchsorted(time, hits) - 1
    single = (np.bincount(before, minlength=len(time))[before] == 1) & np.isfinite(jumps)
    share = (hits - time[before]) / np.diff(time)[before]
    jump_of = {"velocity_m_s": jumps, "omega_loose_rad_s": jumps / _lever(columns)}
    out = {}
    for name, values in columns.items():
        between = np.interp(hits, time, values)
        left = right = between
        if name == "displacement_m" and "velocity_m_s" in columns:
            ahead = values[before] + columns["velocity_m_s"][before] * (hits - time[before])
            left = right = np.where(single, ahead, between)
        elif name in jump_of:
            left = values[before] + (np.diff(values)[before] - jump_of[name]) * share
            left, right = np.where(single, left, between), np.where(single, left + jump_of[name], between)
        out[name] = (left, right)
    return out


def _lever(columns: dict[str, np.ndarray]) -> float:
    """Return the loose gear's base radius [m], from velocity = Rb2·ω_loose − Rb1·ω_drive; infinity if unknown."""
    if not {"omega_loose_rad_s", "omega_drive_rad_s", "velocity_m_s"} <= columns.keys():
        return float("inf")
    speeds = np.stack([columns["omega_loose_rad_s"], -columns["omega_drive_rad_s"]], axis=1)
    return float(np.linalg.lstsq(speeds, columns["velocity_m_s"], rcond=None)[0][0]) or float("inf")


def thinned(columns: dict[str, np.ndarray], most: int = MOST_POINTS) -> np.ndarray:
    """Return the ticks between which straight lines stay within the channels' tolerances."""
    if len(columns["tick"]) < 3:
        return columns["tick"]
    tick = columns["tick"].astype(float)
    scaled = [
        columns[name] / max(float(np.ptp(columns[name])) * tolerance, quantum)
        for name, (quantum, tolerance) in CHANNELS.items()
        if name in columns
    ]
    start = np.linspace(0, len(tick) - 1, min(len(tick), 1500)).astype(int)
    start = np.union1d(start, np.flatnonzero(columns["keep"]))
    slack = 1.0
    while True:
        limit = max(most, len(start))
        at = knots(tick, np.array(scaled), start, slack, limit)
        if len(at) <= limit or slack > 1e6:
            return columns["tick"][at]
        slack *= 2.0


def knots(x: np.ndarray, y: np.ndarray, start: np.ndarray, tolerance: float = 1.0, most: float = np.inf) -> np.ndarray:
    """Return indices between which straight lines are nowhere further than a tolerance from the points.

    Every interval with a larger error is split at its worst point, all intervals at once, until all errors are small
    (Ramer 1972; Douglas & Peucker 1973, measured along y).

    >>> knots(np.arange(5.0), np.array([[0.0, 1.0, 2.0, 1.0, 0.0]]), np.array([0, 4]), 0.1).tolist()
    [0, 2, 4]
    """
    at = start
    alive = np.arange(len(x))
    while alive.size and len(at) <= most:
        segment = np.searchsorted(at, alive, side="right") - 1
        segment = np.minimum(segment, len(at) - 2)
        left, right = at[segment], at[segment + 1]
        share = (x[alive] - x[left]) / (x[right] - x[left])
        error = np.zeros(len(alive))
        for channel in y:
            line = channel[left] + share * (channel[right] - channel[left])
            np.maximum(error, np.abs(channel[alive] - line), out=error)
        begins = np.flatnonzero(np.diff(segment, prepend=-1))
        worst = np.repeat(np.maximum.reduceat(error, begins), np.diff(begins, append=len(alive)))
        bad = worst > tolerance
        peak = np.flatnonzero(bad & (error == worst))
        first = np.flatnonzero(np.diff(segment[peak], prepend=-1))
        at = np.sort(np.concatenate([at, alive[peak[first]]]))
        alive = alive[bad]
    return at
