"""A measured run-down, ready to be fitted: edges or samples, how fast, and how well each is known."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.recording import columns_of
from gears3d.signals import edges, local_slope, noise_of, quantum

SLOWEST = 0.03
"""Part of the starting speed below which a run-down does not testify: stiction and the last count spoil it."""
FLOOR = 0.1
"""Error of an edge that always remains, in counts."""
FASTER = 0.2
"""Part of the starting speed by which a gear that runs down may seem to speed up; errors of encoders make less."""
FEWEST = 50
"""So few edges or samples tell nothing."""


class Track(NamedTuple):
    """One run-down.

    Args:
        time: since the first point [s], (n,).
        angle: in the sense of rotation, from 0 [rad], (n,).
        sigma: standard deviation of the angle [rad], (n,).
        speed: at the first point [rad/s].
        slowest: speed at the last point [rad/s].
        quantum: angle of a count [rad], ``None`` for a smooth record.
        file: where it came from.
    """

    time: np.ndarray
    angle: np.ndarray
    sigma: np.ndarray
    speed: float
    slowest: float
    quantum: float | None
    file: str


def read_track(path: str | Path) -> Track:
    """Read a run-down from a file.

    Args:
        path: CSV or Parquet with ``time_s`` and ``theta_loose_rad`` or ``omega_rad_s``.

    Returns:
        The track.

    Raises:
        InputError: columns are missing, not finite or not in order of time, or nothing runs down freely.
    """
    columns = columns_of(Path(path))
    file = str(path)
    if "time_s" not in columns:
        raise InputError(Fault("time_s", "is missing", "a run-down has time_s and theta_loose_rad", file))
    angle = next((columns[name] for name in ("theta_loose_rad", "theta_rad") if name in columns), None)
    time = columns["time_s"]
    if angle is None:
        if "omega_rad_s" not in columns:
            raise InputError(Fault("theta_loose_rad", "is missing", "or give omega_rad_s", file))
        speed = columns["omega_rad_s"]
        _refuse_bad({"time_s": time, "omega_rad_s": speed}, file)
        angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    _refuse_bad({"time_s": time, "theta_loose_rad": angle}, file)
    return make_track(time, angle, file)


def make_track(time: np.ndarray, angle: np.ndarray, file: str = "") -> Track:
    """Return a run-down from bare arrays.

    Args:
        time: [s], rising, (n,).
        angle: [rad], (n,).
        file: named in faults.

    Raises:
        InputError: nothing runs down.

    >>> t = np.linspace(0.0, 1.0, 1001)
    >>> round(make_track(t, 3.0 * t - 1.5 * t**2).speed, 1)
    3.0
    """
    if angle[-1] < angle[0]:
        angle = -angle
    angle = angle - angle[0]
    count = quantum(angle)
    if count is None:
        slack = np.zeros(len(time))
        noise = max(noise_of(time, angle), 1e-12 * float(np.abs(angle).max(initial=1.0)))
    else:
        found = edges(time, angle, count)
        time, angle, slack = found
        noise = FLOOR * count
    if len(time) < FEWEST:
        remedy = "record a longer run-down, or with more counts"
        raise InputError(Fault("theta_loose_rad", f"changes {len(time)} times only", remedy, file))
    speed = local_slope(time, angle, max(len(time) // 200, 5))
    first = float(speed[: max(len(speed) // 50, 1)].mean())
    slow = np.flatnonzero(speed < SLOWEST * first)
    last = slow[0] if slow.size else len(time)
    if last < FEWEST or not speed[last - 1] < 0.98 * first:
        raise InputError(
            Fault("theta_loose_rad", "does not run down", "record from the release to the standstill", file)
        )
    time, angle, slack, speed = time[:last], angle[:last], slack[:last], speed[:last]
    if np.max(speed - np.minimum.accumulate(speed)) > FASTER * first:
        raise InputError(
            Fault("theta_loose_rad", "speeds up again: no free gear does", "record the loose gear out of mesh", file)
        )
    sigma = np.hypot(np.abs(speed) * slack, noise)
    return Track(time - time[0], angle - angle[0], sigma, first, float(speed[-1]), count, file)


def _refuse_bad(columns: dict[str, np.ndarray], file: str) -> None:
    for name, values in columns.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise InputError(Fault(f"{name}, row {bad[0] + 1}", "is no finite number", "cut it out", file))
    time = columns["time_s"]
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size:
        raise InputError(Fault(f"time_s, row {back[0] + 2}", "does not rise", "sort the record by time", file))
    if len(time) < FEWEST:
        raise InputError(Fault("time_s", f"has {len(time)} rows", f"give at least {FEWEST}", file))
