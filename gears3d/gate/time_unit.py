"""Is time in seconds: milliseconds, microseconds, minutes and row numbers in its place."""

from __future__ import annotations

import numpy as np

from gears3d.gate.finding import Finding
from gears3d.gate.view import View

UNITS = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9, "minutes": 1.0 / 60.0, "hours": 1.0 / 3600.0}
CLOSE = 0.02
"""How near a factor must be to that of a unit."""


def examine(view: View) -> list[Finding]:
    """Find time in another unit than seconds, or counted in rows.

    The step must fit the declared sample rate and, where the mean speed is declared, the speed that follows, too: a
    factor that only one of them shows is no proof.

    Args:
        view: the record; its time rises.
    """
    rate, step = view.declared.sample_rate, view.spacing
    if rate is None or step <= 0.0:
        return []
    for what, factor in (("row numbers", rate), *UNITS.items()):
        if abs(step * rate / factor - 1.0) > CLOSE or not _speed_fits(view, factor):
            continue
        told = f"the sampling interval is {step:.6g}, at {rate:.6g} Hz it is {1.0 / rate:.6g} s: time is in {what}"
        remedy = "or give sensors.sample_rate if this sampling interval is right"
        return [Finding("time-unit", "time_s", factor, "1", told, remedy, True, True)]
    return []


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Put time into seconds.

    Args:
        columns: each (n,).
        findings: of this check.
    """
    return {**columns, "time_s": columns["time_s"] / findings[0].size}


def _speed_fits(view: View, factor: float) -> bool:
    """Return whether the drive turns at its declared speed once time is divided by the factor; true when unknown."""
    mean, angle = view.declared.mean_speed, view.angles.get("theta_drive_rad")
    if mean is None or angle is None or abs(mean) <= 0.2 * view.declared.swing or not view.declared.meshed:
        return True
    speed = abs(float(angle[-1] - angle[0]) / float(view.time[-1] - view.time[0])) * factor
    return 0.3 < speed / abs(mean) < 3.0
