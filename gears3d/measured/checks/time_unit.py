"""Is time in seconds: milliseconds, microseconds, minutes and row numbers in its place.

Either the sampling interval tells, or the motion: a drive that turns as unevenly as the rig declares, but a thousand
times slower, has its time in milliseconds.
"""

from __future__ import annotations

import numpy as np

from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import MESH, View

UNITS = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9, "minutes": 1.0 / 60.0, "hours": 1.0 / 3600.0}
CONTRADICTS = 0.1
"""Part by which the rate of a file and that of a rig may differ."""
CLOSE = 0.02
"""How near a factor must be to that of a unit."""
MEANT = {"milliseconds": 1.3, "microseconds": 1.3, "nanoseconds": 1.3, "minutes": 1.02, "hours": 1.3}
"""The same where the motion alone tells, as a ratio; 60 is near the 57.3 of an angle in degrees."""
MOST = 1e100
"""Upper limit of a speed [rad/s]; the square of a larger one overflows."""
NODES = 20_000
WRAP = 0.25
"""A change of an angle by more than this part of its range is taken for a wrap."""


def examine(view: View) -> list[Finding]:
    """Find time in another unit than seconds, or counted in rows.

    The step must fit the declared sample rate and, where the mean speed is declared, the speed that follows, too: a
    factor that only one of them shows is no proof.

    Args:
        view: the record; its time rises.
    """
    rate, step, stated = view.declared.sample_rate, view.spacing, view.declared.stated_rate
    if rate and stated and abs(stated / rate - 1.0) > CONTRADICTS:
        told = f"the file states a sampling rate of {stated:.6g} Hz, the rig declares {rate:.6g} Hz"
        remedy = f'give sensors.sample_rate = "{stated:.6g} Hz" in the rig or below [condition] if the file is right'
        return [Finding("sample-rate", "time_s", stated / rate, "1", told, remedy, True)]
    if rate is None or step <= 0.0:
        return _by_motion(view)
    for what, factor in (("row numbers", rate), *UNITS.items()):
        if abs(step * rate / factor - 1.0) > CLOSE or not _speed_fits(view, factor):
            continue
        told = f"the sampling interval is {step:.6g}, at {rate:.6g} Hz it is {1.0 / rate:.6g} s: time is in {what}"
        remedy = "or give sensors.sample_rate if this sampling interval is right"
        return [Finding("time-unit", "time_s", factor, "1", told, remedy, True, True)]
    return _by_motion(view)


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Put time into seconds.

    Args:
        columns: each (n,).
        findings: of this check.
    """
    return {**columns, "time_s": columns["time_s"] / findings[0].size}


def off_by(view: View) -> float | None:
    """Return how many times faster than declared the drive turns, where it moves as unevenly as declared.

    Args:
        view: the record; its time rises.

    Returns:
        The ratio; ``None`` where no speed is stated, or the record's fluctuation is another than a stated one.
    """
    about, name = view.declared, MESH[0]
    if about.mean_speed is None or name not in view.angles or not about.meshed or len(view.time) < 4:
        return None
    angle = view.angles[name]
    if angle.dtype.kind not in "fiu" or not np.isfinite(angle.sum()):
        return None
    at = np.unique(np.linspace(0, len(angle) - 1, min(NODES, len(angle))).astype(np.intp))
    way, gone, widest = np.zeros(len(at)), 0.0, WRAP * float(np.ptp(angle))
    for first, change in view.changes(name):
        until = gone + np.cumsum(np.where(np.abs(change) > widest, 0.0, change))
        mine = (at > first) & (at <= first + len(change))
        way[mine] = until[at[mine] - first - 1]
        gone = float(until[-1])
    speed = np.diff(way) / np.diff(view.time[at])
    lasts = float(view.time[-1] - view.time[0])
    mean, whole = float(way[-1]) / lasts, float(np.sqrt(np.mean(speed**2)))
    if not about.swings:
        return abs(mean / about.mean_speed) if about.mean_speed and abs(mean) > 0.2 * whole else None
    declared = np.hypot(about.mean_speed, about.swing / np.sqrt(2.0))
    if not 0.0 < whole < MOST or declared <= 0.0:
        return None
    uneven = np.sqrt(max(whole**2 - mean**2, 0.0)) / whole
    stated = about.swing / np.sqrt(2.0) / declared
    return whole / float(declared) if 0.5 * stated < uneven < 2.0 * stated or stated == 0.0 else None


def _by_motion(view: View) -> list[Finding]:
    """Find time in another unit from the speed of the drive; at constant declared speed the interval must agree."""
    ratio, rate = off_by(view), view.declared.sample_rate
    if ratio is None:
        return []
    for what, factor in UNITS.items():
        close = MEANT[what]
        if not 1.0 / close < ratio * factor < close:
            continue
        steady = view.declared.swings and view.declared.swing == 0.0
        if steady and not (rate and 1.0 / 30.0 < view.spacing * rate / factor < 30.0):
            continue
        told = f"the drive turns {ratio:.4g} times as fast as the rig declares, as unevenly: time is in {what}"
        remedy = "or give the true speed as motion.mean under [condition]"
        return [Finding("time-unit", "time_s", factor, "1", told, remedy, True, True)]
    return []


def _speed_fits(view: View, factor: float) -> bool:
    """Return whether the drive turns at its declared speed once time is divided by the factor; true when unknown."""
    mean, angle = view.declared.mean_speed, view.angles.get("theta_drive_rad")
    if mean is None or angle is None or abs(mean) <= 0.2 * view.declared.swing or not view.declared.meshed:
        return True
    speed = abs(float(angle[-1] - angle[0]) / float(view.time[-1] - view.time[0])) * factor
    return 0.3 < speed / abs(mean) < 3.0
