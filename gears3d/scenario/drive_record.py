"""A measured motion of the drive gear: read, checked and smoothed once, for every model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gears3d.errors import Fault, InputError
from gears3d.signals import content

if TYPE_CHECKING:
    from gears3d.scenario.build import Scenario

Array = NDArray[np.float64]
COLUMNS = ("time_s", "theta_drive_rad")
LEAST = 12  # So few samples make no motion
ORDER = 4  # Of the Butterworth low-pass, which runs forwards and backwards
STEADY = 0.01  # Difference of the times between samples, part of one, up to which they are taken for equal
BEYOND = 4.0  # Bandwidth over the highest frequency above the noise: the low-pass takes 1.5e-5 of it


class DriveRecord(NamedTuple):
    """Angle of the drive gear over time, both from 0."""

    time: Array  # equally spaced when smoothed [s], (n,)
    theta: Array  # angle [rad], (n,)
    bandwidth: float | None  # up to which it is smoothed [Hz]; ``None``: it is as it was recorded


def drive_record(scenario: Scenario) -> DriveRecord:
    """Return the measured drive motion of a scenario, smoothed up to ``motion.bandwidth`` without a shift in phase.

    Without it, a motion whose noise would show in its acceleration is smoothed up to four times the highest
    frequency above the noise, if its samples are equally spaced.

    Source: Butterworth low-pass of order 4 run both ways, -6 dB at the bandwidth.
    """
    path, bandwidth = scenario.motion.record, scenario.motion.bandwidth
    if path is None:
        raise InputError(Fault("motion.record", "is not given", "name a file with the drive's angle"))
    time, theta = _read(path)
    if time[-1] < scenario.run.duration:
        raise _fault(path, f"lasts {time[-1]:.6g} s, the run {scenario.run.duration:.6g} s", "shorten run.duration")
    step = float(np.median(np.diff(time)))
    even = np.linspace(0.0, time[-1], round(time[-1] / step) + 1)
    raw = np.interp(even, time, theta)
    if bandwidth is None:
        steady = np.ptp(np.diff(time)) < STEADY * step
        highest = content(theta, step) if steady else None  # what fills uneven steps would count as noise
        bandwidth = None if highest is None else BEYOND * highest
        if bandwidth is None or bandwidth >= 0.5 / step:
            return DriveRecord(time, theta, None)
    from scipy.signal import butter, sosfiltfilt

    if bandwidth >= 0.5 / step:
        limit = f"{0.5 / step:.6g} Hz, half the record's sample rate"
        raise InputError(Fault("motion.bandwidth", f"is {bandwidth:.6g} Hz, not below {limit}", "give less"))
    trend = raw[-1] * even / even[-1]
    smooth = sosfiltfilt(butter(ORDER, bandwidth, fs=1.0 / even[1], output="sos"), raw - trend) + trend
    return DriveRecord(even, smooth - smooth[0], bandwidth)


def _read(path: Path) -> tuple[Array, Array]:
    from gears3d.recording.files import columns_of

    columns = columns_of(path)
    missing = [name for name in COLUMNS if name not in columns]
    if missing:
        raise _fault(path, f"has no column {' or '.join(missing)}", f"name its columns {', '.join(COLUMNS)}")
    time, theta = (np.asarray(columns[name], dtype=np.float64) for name in COLUMNS)
    if len(time) < LEAST:
        raise _fault(path, f"has {len(time)} samples", f"give {LEAST} or more")
    for name, values in zip(COLUMNS, (time, theta), strict=True):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise _fault(path, f"column {name} is not finite in row {bad[0] + 1}", "fill its gaps")
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if len(back):
        raise _fault(path, f"time_s does not rise after row {back[0] + 1}", "sort it, each time once")
    return time - time[0], theta - theta[0]


def _fault(path: Path, message: str, remedy: str) -> InputError:
    return InputError(Fault("motion.record", message, remedy, str(path)))
