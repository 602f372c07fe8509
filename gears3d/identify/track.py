"""A measured run-down, ready to be fitted: edges or samples, how fast, and how well each is known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.checks import Admitted, Finding, admit, admit_each
from gears3d.measured.readers import Channels
from gears3d.signals import edges, local_slope, noise_of, quantum

SLOWEST = 0.03
"""Part of the starting speed below which a run-down does not testify: stiction and the last count spoil it."""
FLOOR = 0.1
"""Error of an edge that always remains, in counts."""
FASTER = 0.2
"""Part of the starting speed by which a gear that runs down may seem to speed up; errors of encoders make less."""
GEARS = ("loose", "drive")
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
        temperature: mean of the record's own [°C], ``None`` where it has none.
        findings: of the sensor gate.
    """

    time: np.ndarray
    angle: np.ndarray
    sigma: np.ndarray
    speed: float
    slowest: float
    quantum: float | None
    file: str
    temperature: float | None = None
    findings: tuple[Finding, ...] = ()


def read_track(
    path: str | Path, gear: str = "loose", map_file: str | Path | None = None, correct: Sequence[str] = ()
) -> Track:
    """Read a run-down from a file.

    Args:
        path: a file with ``time_s`` and ``theta_loose_rad`` (or ``omega_rad_s``), maybe ``temperature_degC``.
        gear: ``"loose"`` or ``"drive"``, whose angle counts.
        map_file: ``record.toml``.
        correct: kinds of findings of the sensor gate to correct.

    Returns:
        The track.

    Raises:
        InputError: columns are missing, not finite or not in order of time, or nothing runs down freely.
    """
    return _track(admit(path, None, map_file, correct, needs=(_names(gear),)), gear)


def read_tracks(
    paths: Sequence[str | Path],
    gear: str = "loose",
    map_file: str | Path | None = None,
    correct: Sequence[str] = (),
    excluded: Callable[[Sequence[Admitted]], object] = len,
) -> list[Track]:
    """Read several run-downs, each once.

    Args:
        paths: as for :func:`read_track`.
        gear: as for :func:`read_track`.
        map_file: as for :func:`read_track`.
        correct: as for :func:`read_track`; ``"duplicated-file"`` excludes a file that repeats another's readings.
        excluded: called with the records that are excluded for that.

    Returns:
        The tracks.

    Raises:
        InputError: as for :func:`read_track`, of all files together, or a file repeats the readings of another.
    """
    admission = admit_each(paths, None, map_file, correct, needs=(_names(gear),))
    admitted = admission.all()
    excluded(admission.repeated)
    return [_track(one, gear) for one in admitted]


def _names(gear: str) -> tuple[str, ...]:
    """Columns of which one must be there, the best first."""
    return (f"theta_{gear}_rad", "theta_rad", f"omega_{gear}_rad_s", "omega_rad_s")


def _track(admitted: Admitted, gear: str) -> Track:
    channels = admitted.channels
    columns, file = channels.columns, channels.file
    name = next(name for name in _names(gear) if name in columns)
    time, values = columns["time_s"], columns[name]
    _refuse_bad({"time_s": time, name: values}, file)
    if name.startswith("omega"):
        values = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])
    track = make_track(time, values, file)
    return track._replace(temperature=_temperature(channels, file), findings=admitted.findings)


def _temperature(channels: Channels, file: str) -> float | None:
    """Return the mean temperature of a record [°C]."""
    if (values := channels.columns.get("temperature_degC")) is not None:
        if not np.all(np.isfinite(values)):
            raise InputError(Fault("temperature_degC", "is not finite everywhere", "cut it out", file))
        return float(values.mean())
    told = channels.meta.get("temperature_degC")
    return float(told) if isinstance(told, int | float) else None


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
