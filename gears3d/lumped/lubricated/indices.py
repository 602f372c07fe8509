"""Measures of rattle: rattle index and its sensitivity, effective values of transmission error and its increments."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def rattle_index(force: ArrayLike, spacing: float, inertia: float) -> float:
    """Return RI, the effective value of the mesh force's rate over the loose gear's inertia [N/(s·kg·m²)].

    Where the force jumps, as with damping that acts from the first touch, RI is proportional to spacing^(−1/2) and has
    no limit: compare it at one spacing only.

    Args:
        force: of the mesh along the normal, evenly sampled [N], (n,).
        spacing: of the samples [s].
        inertia: of the loose gear [kg·m²].

    Source: the lubricated dual-clutch transmission, eq. (32).

    >>> round(rattle_index(100.0 * np.sin(np.linspace(0.0, 20.0 * np.pi, 20001)), 1e-3, 2.0), 1)
    111.1
    """
    rate = np.diff(np.asarray(force, float)) / spacing
    return float(np.sqrt(np.mean(rate**2))) / inertia


def sensitivity(index: ArrayLike, parameter: ArrayLike) -> np.ndarray:
    """Return the change of RI with a parameter by forward differences.

    Args:
        index: RI, (n,).
        parameter: rising, (n,).

    Returns:
        Differences, (n − 1,).

    Source: the lubricated dual-clutch transmission, eq. (33).

    >>> sensitivity([1.0, 2.0, 4.0], [0.0, 0.5, 1.0]).tolist()
    [2.0, 4.0]
    """
    return np.diff(np.asarray(index, float)) / np.diff(np.asarray(parameter, float))


def error_indices(error: ArrayLike, spacing: float = 1.0) -> tuple[float, float]:
    """Return Rdte, the effective value of a transmission error, and Odte, that of its increments over ``spacing``.

    Printed Rdte has no 1/N and would grow with the samples; Odte is proportional to the spacing of the samples, so it
    is given for one second: times their spacing it is as printed.

    Args:
        error: evenly sampled [m], (n,).
        spacing: of the samples [s].

    Returns:
        Rdte [m], Odte over the spacing [m/s].

    Source: the lubricated dual-clutch transmission, eqs (34), (35).

    >>> [round(x, 3) for x in error_indices(np.sin(np.linspace(0.0, 2.0 * np.pi, 10001)), 2.0 * np.pi / 10000)]
    [0.707, 0.707]
    """
    samples = np.asarray(error, float)
    return float(np.sqrt(np.mean(samples**2))), float(np.sqrt(np.mean((np.diff(samples) / spacing) ** 2)))
