"""Probability density of observed rebounds, truncated at the detection threshold."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
from scipy.special import ndtr


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
        errors: factor on the stated errors, and an added error as a multiple of a typical one.
        floor: least relative error of a rebound.
    """
    speeds = np.hypot(sigmas[1], steep * sigmas[0])
    middle = len(speeds) // 2
    typical = np.partition(speeds, middle)[middle]
    return np.hypot(errors[0] * speeds, errors[1] * np.hypot(typical, floor * rebound)) / approach


def densities(
    ratio: np.ndarray, cut: np.ndarray, mean: np.ndarray, error: np.ndarray, scatter: float, stray: float
) -> np.ndarray:
    """Return the logarithm of the density of observed rebounds over approach, (n,).

    Args:
        ratio: rebound over approach, (n,).
        cut: its detection threshold, (n,).
        mean: coefficient of the law, (n,).
        error: standard deviation of the ratio by errors of the speeds, (n,).
        scatter: of the coefficient, above 0.
        stray: part of the pairs that are outliers.
    """
    wide = np.hypot(scatter, error)
    middle = (mean * error**2 + ratio * scatter**2) / wide**2
    slack = scatter * error / wide
    density = _normal(ratio - mean, wide) * (ndtr((1.0 - middle) / slack) - ndtr(-middle / slack))
    density += ndtr((mean - 1.0) / scatter) * _normal(ratio - 1.0, error)
    share = np.maximum(ndtr((mean - cut) / wide), 1e-12)
    return np.log((1.0 - stray) * density / share + stray / np.maximum(1.0 - cut, 0.1))


def _normal(off: np.ndarray, wide: np.ndarray) -> np.ndarray:
    return np.exp(-0.5 * (off / wide) ** 2) / (sqrt(2.0 * pi) * wide)
