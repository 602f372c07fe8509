"""How likely seen rebounds are: the sum over all pairs that a search for a law asks for."""

from __future__ import annotations

from math import erfc, exp, hypot, log, pi, sqrt

import numpy as np

from gears3d.kernels import njit


@njit(cache=True)
def phi(x: float) -> float:
    """Return the chance that a normal number stays below ``x``.

    Args:
        x: in standard deviations.
    """
    return 0.5 * erfc(-x / sqrt(2.0))


@njit(cache=True)
def bell(off: float, wide: float) -> float:
    """Return the density of a normal number.

    Args:
        off: distance from its mean.
        wide: standard deviation.
    """
    return exp(-0.5 * (off / wide) ** 2) / (sqrt(2.0 * pi) * wide)


@njit(cache=True)
def noise(
    approach: np.ndarray,
    rebound: np.ndarray,
    sigmas: tuple[np.ndarray, np.ndarray],
    steep: np.ndarray,
    errors: tuple[float, float],
    floor: float,
) -> np.ndarray:
    """Return the standard deviation that errors of the speeds give rebound over approach, (n,).

    Args:
        approach: speed [m/s], (n,).
        rebound: [m/s], (n,).
        sigmas: of both [m/s].
        steep: d(rebound)/d(approach), (n,).
        errors: factor on the stated errors, and what comes on top as a multiple of a typical one.
        floor: relative error of a rebound that may always be.
    """
    speeds = np.hypot(sigmas[1], steep * sigmas[0])
    typical = np.sort(speeds)[len(speeds) // 2]
    return np.hypot(errors[0] * speeds, errors[1] * np.hypot(typical, floor * rebound)) / approach


@njit(cache=True)
def densities(
    ratio: np.ndarray, cut: np.ndarray, mean: np.ndarray, error: np.ndarray, scatter: float, stray: float
) -> np.ndarray:
    """Return the logarithm of the density of rebounds over approach, given that they were seen, (n,).

    Args:
        ratio: rebound over approach, (n,).
        cut: its threshold of sight, (n,).
        mean: coefficient of the law, (n,).
        error: standard deviation of the ratio by errors of the speeds, (n,).
        scatter: of the coefficient, above 0.
        stray: part of the pairs that may be anything.
    """
    found = np.zeros(len(ratio))
    for k in range(len(ratio)):
        wide = hypot(scatter, error[k])
        middle = (mean[k] * error[k] ** 2 + ratio[k] * scatter**2) / wide**2
        slack = scatter * error[k] / wide
        inner = phi((1.0 - middle) / slack) - phi(-middle / slack)
        density = bell(ratio[k] - mean[k], wide) * inner
        density += phi((mean[k] - 1.0) / scatter) * bell(ratio[k] - 1.0, error[k])
        share = max(phi((mean[k] - cut[k]) / wide), 1e-12)
        found[k] = log((1.0 - stray) * density / share + stray / max(1.0 - cut[k], 0.1))
    return found
