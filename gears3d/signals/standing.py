"""Up to which frequency a signal stands out of its noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

STANDS_OUT = 20.0
"""Times the floor of the noise: no mean over SEGMENTS spectra comes near that by chance."""
SEGMENTS = 8
"""Of the mean spectrum, half overlapping ones besides."""
QUIET = 0.01
"""Noise in the second derivative that needs no smoothing, part of all of it."""


def content(values: NDArray[np.float64], step: float) -> float | None:
    """Return the highest frequency at which the spectrum of a signal stands out of a white noise.

    Args:
        values: equally spaced in time, (n,); a trend is taken out.
        step: between samples [s].

    Returns:
        Frequency [Hz]; ``None`` where noise is no matter even in the second derivative, or nothing stands out.

    >>> time = np.arange(20_000) * 1e-3
    >>> noise = 0.01 * np.random.default_rng(1).standard_normal(len(time))
    >>> 5.0 <= content(np.sin(2 * np.pi * 5.0 * time) + noise, 1e-3) < 7.0
    True
    >>> content(np.sin(2 * np.pi * 5.0 * time), 1e-3) is None
    True
    """
    from scipy.signal import welch

    bent = np.diff(values, 2)  # low frequencies, which are large, would leak into all others
    length = max(len(bent) // SEGMENTS, min(len(bent), 64))
    frequency, power = welch(bent, 1.0 / step, "blackmanharris", length, detrend="constant")
    frequency, power = frequency[1:], power[1:] / (16.0 * np.sin(np.pi * frequency[1:] * step) ** 4)
    floor = float(np.median(power[len(power) // 2 :]))
    if np.sqrt(6.0 * floor * 0.5 / step) <= QUIET * np.sqrt(np.mean(bent**2)):
        return None
    out = np.flatnonzero(power > STANDS_OUT * floor)
    return float(frequency[out[-1]]) if len(out) else None
