"""The drive gear's fluctuation, read off its angle."""

from __future__ import annotations

from math import pi

import numpy as np

ENOUGH = 20_000
"""Samples of the fit at most."""


def stroke(time: np.ndarray, angle: np.ndarray, period: float) -> float | None:
    """Return the amplitude of the drive angle's swing at one frequency.

    Args:
        time: of the samples, rising [s], (n,).
        angle: of the drive gear [rad], (n,).
        period: of the fluctuation [s].

    Returns:
        Amplitude of the angle [rad], by least squares beside a steady rotation; times the base radius it is H.
        ``None`` for less than one period, fewer than 16 samples, or a swing below a millionth of the rotation.

    Source: Kadmiri et al. 2012, eqs (18), (26), y = H·cos(ωt − ϕ).

    >>> time = np.linspace(0.0, 2.0, 500)
    >>> round(stroke(time, 3.0 * time + 0.02 * np.cos(10.0 * pi * time + 1.0), 0.2), 9)
    0.02
    """
    step = max(len(time) // ENOUGH, 1)
    time, angle = time[::step], angle[::step]
    if len(time) < 16 or time[-1] - time[0] < period * (1 - 1e-9):
        return None
    since = time - 0.5 * (time[0] + time[-1])
    turn = 2 * pi / period * since
    basis = np.column_stack([np.ones(len(time)), since / (since[-1] or 1.0), np.cos(turn), np.sin(turn)])
    fit = np.linalg.lstsq(basis, angle - angle.mean(), rcond=None)[0]
    size = float(np.hypot(fit[2], fit[3]))
    return size if size > 1e-6 * float(np.ptp(angle)) else None
