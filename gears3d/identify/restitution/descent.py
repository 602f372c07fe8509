"""The least of a cost whose numbers differ widely in size, and how it bends there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

STEP = 1e-4
"""Part of a typical error over which slopes are taken."""


def least(
    cost: Callable[[np.ndarray], float],
    start: np.ndarray,
    unit: np.ndarray,
    bounds: Sequence[tuple[float | None, float | None]],
) -> Any:
    """Return where a cost is least, as ``scipy.optimize.minimize`` does.

    Every number is counted in its own typical error: in plain numbers a search rests before a coefficient known to a
    ten-thousandth is found.

    Args:
        cost: of numbers (p,).
        start: numbers to begin with, (p,).
        unit: about how well each is known, (p,).
        bounds: of each, ``None`` for none.

    >>> def steep(x):
    ...     return 1e8 * (x[0] - 0.5) ** 2 + (x[1] - 2.0) ** 2
    >>> found = least(steep, np.zeros(2), np.array([1e-4, 1.0]), [(None, None)] * 2)
    >>> bool(abs(found.x[0] - 0.5) < 1e-6 and abs(found.x[1] - 2.0) < 1e-2)
    True
    """
    from scipy.optimize import minimize

    scaled = [tuple(None if end is None else end / one for end in pair) for pair, one in zip(bounds, unit, strict=True)]
    options = {"maxiter": 200, "eps": STEP, "ftol": 1e-11}
    found: Any = minimize(lambda y: cost(y * unit), start / unit, method="L-BFGS-B", bounds=scaled, options=options)
    found.x = np.array(found.x) * unit
    return found


def bend(cost: Callable[[np.ndarray], float], at: np.ndarray, step: np.ndarray, free: Sequence[int]) -> np.ndarray:
    """Return the second derivatives of a cost in its free numbers, (f, f).

    Args:
        cost: of numbers (p,).
        at: numbers, (p,).
        step: over which differences are taken, (p,).
        free: indices of the free numbers, (f,).

    >>> bend(lambda x: 3.0 * x[0] ** 2 + x[0] * x[1], np.zeros(2), np.full(2, 0.1), [0, 1]).round(6).tolist()
    [[6.0, 1.0], [1.0, 0.0]]
    """
    size = len(free)
    bent = np.zeros((size, size))
    for i in range(size):
        for j in range(i, size):
            total = 0.0
            for a in (1.0, -1.0):
                for b in (1.0, -1.0):
                    x = at.copy()
                    x[free[i]] += a * step[free[i]]
                    x[free[j]] += b * step[free[j]]
                    total += a * b * cost(x)
            bent[i, j] = bent[j, i] = total / (4.0 * step[free[i]] * step[free[j]])
    return bent
