"""Do the angles come in the counts that are declared, and how noisy are they."""

from __future__ import annotations

import numpy as np

from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import View

CLOSE = 1e-3
"""How far counts found may be off the declared ones."""
ALIKE = 0.1
"""How far they may be off for one of both to be a mistake in the number of lines, not lines taken for edges."""
NOISY = 0.06
"""Part of the backlash: records with more noise were never cut."""
ROUNDING = 0.65
"""Noise in counts that rounding alone may seem to make."""
TIMES = (2.0, 4.0, 8.0, 0.5, 0.25, 0.125)
ROWS, COUNTS = 3.0, 2.0
"""Index marks contradict a count by more than what so many rows turn in all, and by so many counts a revolution: a mark
stands at the row after its edge, and a few counts may be lost."""


def examine(view: View) -> list[Finding]:
    """Find encoders that count otherwise than declared, and noise that fills the backlash.

    Args:
        view: the record; its time rises, its angles do not wrap.
    """
    found = [finding for name in view.angles for finding in (*_between_marks(view, name), *_counts(view, name))]
    return [*found, *_noise(view)]


def otherwise(view: View, name: str) -> str:
    """Return as text that an angle comes in slightly other counts than declared, empty where it does not.

    Args:
        view: the record.
        name: of the column.
    """
    declared, count = view.declared.counts.get(name), view.quanta[name]
    seen = 2 * np.pi / count if count else 0.0
    if declared is None or not CLOSE < abs(seen / declared - 1.0) < ALIKE:
        return ""
    return f"{name} was made with {seen:.6g} counts per revolution, the rig declares {declared:.6g}"


def _between_marks(view: View, name: str) -> list[Finding]:
    """Find a count that index marks contradict: between two of them is one true revolution."""
    seen = view.declared.marks.get(name)
    turns = float(np.ptp(view.angles[name])) / (2 * np.pi)
    if seen is None or turns < 1.0:
        return []
    count = view.quanta[name] or 0.0
    row = float(np.quantile(np.abs(view.some_changes(name)), 0.99))
    error = (ROWS * max(row, count) / turns) / (2 * np.pi)
    if abs(seen - 1.0) < max(error, COUNTS * count / (2 * np.pi)):
        return []
    gear, declared = name.split("_")[1], view.declared.counts.get(name)
    told = (
        f"index marks are {seen:.6g} (± {error:.2g}) revolutions of the angle apart: its count per revolution is wrong"
    )
    remedy = f"multiply the {gear} angle by {1.0 / seen:.7g} ({1.0 / (seen + error):.7g} to {1.0 / (seen - error):.7g})"
    if declared is not None:
        true, spread = declared * seen, declared * error
        remedy = f"[{gear}] counts_per_revolution = {true:.6g} instead of {declared:.6g} "
        remedy += f"({true - spread:.6g} to {true + spread:.6g})"
    remedy += ', or zero = "arbitrary" where the encoder is not on the shaft of the gear'
    return [Finding("counts", name, seen, "1", told, remedy, True)]


def _counts(view: View, name: str) -> list[Finding]:
    declared, count = view.declared.counts.get(name), view.quanta[name]
    if declared is None:
        return []
    if count is None:
        return _unseen(view, name, declared)
    seen = 2 * np.pi / count
    if abs(seen / declared - 1.0) < CLOSE or _written(count, 2 * np.pi / declared):
        return []
    told = f"changes in steps of {count:.6g} rad, {seen:.6g} counts per revolution; declared are {declared:.6g}"
    for times in TIMES:
        if abs(seen / declared / times - 1.0) < CLOSE:
            what = f"{times:.0f} times as many" if times > 1.0 else f"one in {1.0 / times:.0f}"
            told += f": {what}, as where lines and edges are confused"
    return [Finding("counts", name, seen, "1", told, "correct sensors.*.counts_per_revolution or the map")]


def _unseen(view: View, name: str, declared: float) -> list[Finding]:
    """Find angles that keep to no counts although counts are declared and large enough to show."""
    step = 2 * np.pi / declared
    rounding = 1e-13 * float(np.abs(view.angles[name]).max(initial=0.0))
    moving = np.abs(view.some_changes(name)) > 10.0 * rounding
    if rounding > 1e-3 * step or np.count_nonzero(moving) < 100:
        return []
    told = f"shows no counts although {declared:.6g} per revolution are declared: filtered, resampled or interpolated"
    return [Finding("counts", name, 0.0, "1", told, "record the raw counter")]


def _written(count: float, declared: float) -> bool:
    """Return whether steps are those of digits in a file, finer than the counts."""
    digits = np.log10(count)
    return count < 0.5 * declared and abs(digits - np.round(digits)) < 1e-3


def _noise(view: View) -> list[Finding]:
    declared = view.declared
    if not declared.meshed or declared.radii is None or declared.backlash is None or len(view.angles) < 2:
        return []
    noise = {name: view.noise[name] for name in view.angles}
    beyond = [one if one > ROUNDING * (view.quanta[name] or 0.0) else 0.0 for name, one in noise.items()]
    length = float(np.hypot(beyond[0] * declared.radii[0], beyond[1] * declared.radii[1]))
    if length < NOISY * declared.backlash:
        return []
    told = f"noise of the readings is {1e6 * length:.3g} um along the line of action, "
    told += f"{length / declared.backlash:.0%} of the backlash ("
    told += ", ".join(f"{name}: {one:.3g} rad" for name, one in noise.items()) + ")"
    return [Finding("noise", "", length, "m", told, "check couplings, or use encoders with a finer resolution")]
