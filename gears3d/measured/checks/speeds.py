"""Are speeds in rad/s: compared with the angle of the same gear, or else with the mean speed that is stated."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import MESH, View

UNITS = {
    "rpm": 30.0 / np.pi,
    "deg/s": 180.0 / np.pi,
    "revolutions per second": 0.5 / np.pi,
    "revolutions per millisecond": 0.5e-3 / np.pi,
    "thousand rpm": 0.03 / np.pi,
    "rad/min": 60.0,
}
HINTS = {
    "the angles are in degrees": 180.0 / np.pi,
    "the angles are in revolutions": 0.5 / np.pi,
    "time is in milliseconds": 1e-3,
    "time is in microseconds": 1e-6,
    "time is in minutes": 60.0,
}
"""Units that turn the speed of the rig's scenario into another one, by the factor."""
EXACT = 0.005
"""How near a factor must be to that of a unit for a hint: 1 in 600 of records of any speed from 1e-6 to 100 times."""
PARTNERS = {
    "omega_drive_rad_s": ("theta_drive_rad",),
    "omega_loose_rad_s": ("theta_loose_rad",),
    "omega_rad_s": ("theta_rad", "theta_loose_rad", "theta_drive_rad"),
}
BLOCKS = 2000
"""Stretches whose mean speeds are compared."""
ALIKE = 0.9
"""Part of the mean square of a speed that the angle's must explain, for its factor to be told."""
OFF = 0.02
"""How far a factor must be off 1 to be told, and how near it must be to that of a unit."""
MEANT = 0.05
"""How near a factor must be to that of a unit where the declared mean speed alone speaks for it."""


def examine(view: View) -> list[Finding]:
    """Find columns of speed in another unit, of another gear or in another sense than their angle.

    Args:
        view: the record; its time rises, its angles do not wrap.
    """
    found = []
    for name, partners in PARTNERS.items():
        speed = view.columns.get(name)
        if speed is None or speed.dtype.kind not in "fiu" or speed.shape != view.time.shape or len(speed) < 3:
            continue
        own = next((angle for angle in partners if angle in view.columns), None)
        new = _by_angle(view, name, own) if own else _by_mean(view, name)
        found += [] if new is None else [new]
    return found


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Put speeds into rad/s.

    Args:
        columns: each (n,).
        findings: of this check.
    """
    return columns | {one.channel: columns[one.channel] / one.size for one in findings}


def _by_angle(view: View, name: str, angle: str) -> Finding | None:
    """Find a speed that is not the rate of its angle."""
    edges = np.unique(np.linspace(0, len(view.time) - 1, BLOCKS + 1).astype(np.intp))
    speed, lasts = view.columns[name], np.diff(view.time[edges])
    if not np.isfinite(speed.sum()) or not np.isfinite(view.columns[angle].sum()) or np.any(lasts <= 0.0):
        return None
    rate = np.diff(view.columns[angle][edges]) / lasts
    pairs = pairwise(edges)
    middle = np.array([0.5 * (speed[a:b] + speed[a + 1 : b + 1]).mean() for a, b in pairs])
    square, power = float(rate @ rate), float(middle @ middle)
    if square <= 0.0 or power <= 0.0:
        return None
    factor = float(middle @ rate) / square
    if factor**2 * square < ALIKE * power or abs(factor - 1.0) < OFF:
        return None
    told = f"is {factor:.6g} times the rate of {angle}"
    remedy = "or give the unit in record.toml"
    for what, one in UNITS.items():
        if abs(abs(factor) / one - 1.0) < OFF:
            size = float(np.copysign(one, factor))
            told += f": it is in {what}" + (", with inverted sign" if factor < 0.0 else "")
            return Finding("speed-unit", name, size, "1", told, remedy, False, True)
    if abs(factor + 1.0) < OFF:
        return Finding("speed-unit", name, -1.0, "1", f"{told}: its sign is inverted", remedy, False, True)
    remedy = "check which shaft this speed belongs to: only the angles are used"
    return Finding("speed-unit", name, factor, "1", told, remedy)


def compare_with_usual(view: View) -> list[Finding]:
    """Report a drive whose speed is that of the rig's scenario in another unit, where no speed is stated.

    Records may be of any speed, so nothing is concluded from it.

    Args:
        view: the record.
    """
    usual, name = view.declared.usual_speed, MESH[0]
    lasts = float(view.time[-1] - view.time[0]) if len(view.time) > 1 else 0.0
    if view.declared.mean_speed is not None or not usual or name not in view.angles or not lasts > 0.0:
        return []
    seen = float(view.angles[name][-1] - view.angles[name][0]) / lasts
    for what, factor in HINTS.items():
        if abs(seen / usual / factor - 1.0) < EXACT:
            told = f"the drive turns at {seen:.6g} rad/s, {factor:.4g} times the mean speed of the rig: "
            told += f"if both are meant to be the same, {what}"
            remedy = "nothing to do if the record is of another speed"
            return [Finding("other-speed", name, seen / usual, "1", told, remedy)]
    return []


def _by_mean(view: View, name: str) -> Finding | None:
    """Find a speed that fits the declared mean speed in another unit only."""
    mean, teeth, speed = view.declared.mean_speed, view.declared.teeth, view.columns[name]
    if mean is None or abs(mean) <= 0.2 * view.declared.swing or not np.isfinite(speed.sum()):
        return None
    ratio = 1.0 if "drive" in name or teeth is None else teeth[0] / teeth[1]
    seen = float(np.mean(speed)) if view.declared.meshed else float(speed[np.argmax(np.abs(speed))])
    for what, factor in UNITS.items():
        if abs(abs(seen / (mean * ratio)) / factor - 1.0) < MEANT:
            told = f"is {seen:.6g}, the mean speed of the rig gives {abs(mean * ratio):.6g} rad/s: "
            told += f"its unit is probably {what}"
            remedy = "or give the unit in record.toml, or the true speed as motion.mean under [condition]"
            return Finding("speed-unit", name, factor, "1", told, remedy, not view.declared.meshed, True)
    return None
