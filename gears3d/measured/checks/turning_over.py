"""Angles that start again: at a full turn, at 360 degrees, at a power of two of counts."""

from __future__ import annotations

import numpy as np

from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import View, when

FASTER = 20.0
"""A wrap is so many times larger than what the gear does in a row."""
WIDTHS = {"a turn": 2 * np.pi, "half a revolution": np.pi, "360 deg": 360.0, "1 revolution": 1.0}
BITS = range(8, 49)


def examine(view: View) -> list[Finding]:
    """Find angles that fall back by a turn, or by a power of two of their counts.

    Args:
        view: the record; its time rises.
    """
    found = []
    for name in view.angles:
        usual = float(np.quantile(np.abs(view.some_changes(name)), 0.99))
        least = FASTER * max(usual, 1e-12)
        far = np.concatenate([first + np.flatnonzero(np.abs(change) > least) for first, change in view.changes(name)])
        if not far.size:
            continue
        wide = np.abs(view.angles[name][far + 1] - view.angles[name][far]) + usual * 0.5
        width, what = _width(float(np.median(wide)), usual, view.quanta[name])
        angle = view.angles[name]
        if not what or np.ptp(wide) > 3.0 * usual or float(np.ptp(angle)) > width + 3.0 * usual:
            continue
        told = f"jumps {len(far)} times by {what}, at {when(view.time, far)}"
        rows = tuple(map(int, far[:20] + 1))
        found.append(Finding("angle-wrap", name, width, "rad", told, "", True, True, rows=rows))
    return found


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Add the turns up.

    Args:
        columns: each (n,).
        findings: of this check.
    """
    mended = dict(columns)
    for finding in findings:
        angle = columns[finding.channel]
        turns = np.round(np.diff(angle, prepend=angle[0]) / finding.size)
        mended[finding.channel] = angle - finding.size * np.cumsum(turns)
    return mended


def _width(seen: float, slack: float, count: float | None) -> tuple[float, str]:
    """Return the width that a jump stands for and its name, empty when there is none."""
    for what, width in WIDTHS.items():
        if abs(seen - width) < 2.0 * slack + 1e-6 * width:
            return width, what
    for unit, what in ((count or 0.0, "counts"), (1.0, "")):
        for bits in BITS if unit > 0.0 else ():
            if abs(seen - unit * 2.0**bits) < 2.0 * slack:
                return unit * 2.0**bits, f"2^{bits} {what}".strip()
    return 0.0, ""
