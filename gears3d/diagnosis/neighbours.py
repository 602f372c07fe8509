"""Whether rebounds depend on earlier ones: a real scatter is independent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Array = np.ndarray
# Lags in impacts at which rebounds are compared: those of a period return after a few.
LAGS = (1, 2, 3, 4)


def alike(rest: Sequence[Array]) -> tuple[float, float, int]:
    """Return the largest autocorrelation of rebounds, its standard deviations, and its lag.

    rest: residuals of each record's impacts in the order of time, in standard deviations.

    >>> white = np.random.default_rng(3).standard_normal(400)
    >>> slow = np.convolve(white, np.ones(20), "valid")
    >>> abs(alike([white])[1]) < 4.0, alike([slow])[1] > 8.0, alike([slow])[2]
    (True, True, 1)
    """
    best = (0.0, 0.0, LAGS[0])
    for lag in LAGS:
        pairs = [(one[:-lag], one[lag:]) for one in rest if len(one) > lag]
        if not pairs:
            continue
        first, later = (np.concatenate(side) for side in zip(*pairs, strict=True))
        product, size = first * later, float(np.sqrt(np.sum(first**2) * np.sum(later**2)))
        spread = float(np.sqrt(np.sum(product**2)))
        if size > 0.0 and spread > 0.0 and float(np.sum(product)) / spread > best[1]:
            best = (float(np.sum(product)) / size, float(np.sum(product)) / spread, lag)
    return best
