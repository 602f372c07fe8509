"""Does time rise evenly: rows that are missing in the time base, and stamps that tremble."""

from __future__ import annotations

import numpy as np

from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import View, when
from gears3d.signals import changes, some_steps

EVEN = 0.9
"""Part of the steps that must be alike for rows to be samples and not events."""
TREMBLE = 0.02
"""Jitter, in steps, from which it is told."""
WIDE, SURE = 1.6, 6.0
"""A gap is wider than so many steps, and than a step by so many standard deviations of the steps."""


def examine(view: View) -> list[Finding]:
    """Find gaps in the time base and jitter.

    Args:
        view: the record; its time rises.
    """
    steps, step = some_steps(view.time), view.spacing
    if np.mean(np.abs(steps - step) < 0.4 * step) < EVEN:
        return []
    spread = 1.4826 * float(np.median(np.abs(steps - step)))
    widest = max(WIDE * step, step + SURE * spread)
    return [*_gaps(view, step, widest), *_jitter(view, steps, step, widest)]


def _gaps(view: View, step: float, widest: float) -> list[Finding]:
    wide = np.concatenate([first + np.flatnonzero(steps > widest) for first, steps in changes(view.time)])
    if not wide.size:
        return []
    length = view.time[wide + 1] - view.time[wide]
    lost = np.round(length / step - 1.0)
    longest = float(length.max())
    told = f"{lost.sum():.0f} rows of {len(view.time) + lost.sum():.0f} are missing in {len(wide)} gaps, "
    told += f"the longest is {longest:.6g} s, at {when(view.time, wide)}"
    rows = tuple(map(int, wide[:20] + 1))
    return [Finding("gaps", "time_s", longest, "s", told, "flights across a gap are not observed", rows=rows)]


def _jitter(view: View, steps: np.ndarray, step: float, widest: float) -> list[Finding]:
    off = steps[steps < widest] - step
    rms = float(np.sqrt(np.mean(off**2) / 2.0))
    if rms < TREMBLE * step:
        return []
    ticks = float(np.ptp(off)) < 2.5 * float(np.abs(off)[np.abs(off) > 0.01 * step].min(initial=np.inf))
    told = (
        f"time stamps have a jitter of {rms:.3g} s rms ({rms / step:.1%} of a step), at most {np.abs(off).max():.3g} s"
    )
    told += ", as from rounding to too few digits" if ticks else ""
    if view.declared.radii is not None and view.angles:
        name, angle = next(iter(view.angles.items()))
        radius = view.declared.radii[0 if "drive" in name else 1]
        speed = abs(float(angle[-1] - angle[0]) / max(float(view.time[-1] - view.time[0]), 1e-300)) * radius
        told += f": {1e6 * speed * rms:.3g} um along the line of action"
    return [
        Finding(
            "jitter", "time_s", rms, "s", told, "if sampling was uniform, give the sampling rate instead of time stamps"
        )
    ]
