"""Newton's coefficient of restitution: how it falls, differs, scatters, and what damping stands for it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike


def restitution(
    base: float,
    velocity: ArrayLike,
    slope: float = 0.0,
    asymmetry: float = 0.0,
    deviation: float = 0.0,
    normal: ArrayLike = 0.0,
) -> np.ndarray:
    """Return e = clip(e0 + slope·|v| ± asymmetry/2 + deviation·z, 0, 1), + on the active flank, − on the reverse one.

    Constant with ``base`` alone. The active flank is hit with a negative velocity, the reverse one with a positive.
    Source: Kadmiri et al. 2012, eqs (3), (19), (20) and fig. 7: linear in the speed, with a normal scatter.

    Args:
        base: e0.
        velocity: approach velocity ṡ⁻ [m/s].
        slope: [s/m].
        asymmetry: how much more the active flank gives back than the reverse one.
        deviation: standard deviation of the scatter.
        normal: z, standard normal numbers.

    Returns:
        Coefficients, of the common shape of ``velocity`` and ``normal``.

    >>> restitution(0.5, [-0.02, 0.02, 0.2], slope=-5.0, asymmetry=0.1).round(6).tolist()
    [0.45, 0.35, 0.0]
    """
    velocity = np.asarray(velocity, dtype=float)
    side = -0.5 * asymmetry * np.sign(velocity)
    return np.clip(base + slope * np.abs(velocity) + side + deviation * np.asarray(normal, dtype=float), 0.0, 1.0)


def damping_ratio(coefficient: ArrayLike) -> np.ndarray:
    """Return the damping ratio of a linear spring and damper that gives back e, ζ = −ln e/√(π² + ln² e).

    Source: Rigaud & Perret-Liaudet 2020, eq. (20), with the square that the print leaves out.

    Args:
        coefficient: e, from 0 to 1.

    Returns:
        Ratio, 0 at e = 1 and 1 at e = 0, of the shape of ``coefficient``.

    >>> damping_ratio([0.0, 0.3, 1.0]).round(6).tolist()
    [1.0, 0.357857, 0.0]
    """
    with np.errstate(divide="ignore"):
        return 1.0 / np.hypot(1.0, np.pi / np.log(np.asarray(coefficient, dtype=float)))


def restitution_of(ratio: ArrayLike) -> np.ndarray:
    """Return the restitution of a spring and damper of ratio ζ, e = exp(−π·ζ/√(1 − ζ²)).

    The contact lasts half a damped period and may pull at its end. Source: Rigaud & Perret-Liaudet 2020, eq. (20),
    inverted.

    Args:
        ratio: ζ, from 0 to 1.

    Returns:
        Coefficients, of the shape of ``ratio``.

    >>> restitution_of([0.0, 0.357857, 1.0]).round(5).tolist()
    [1.0, 0.3, 0.0]
    """
    ratio = np.asarray(ratio, dtype=float)
    with np.errstate(divide="ignore"):
        return np.exp(-np.pi * ratio / np.sqrt(1.0 - ratio**2))


def scatter(seed: int, index: int) -> float:
    """Return the standard normal number that belongs to an impact: seed and index alone make it.

    Every model that asks for the same impact draws the same number, so that scattered runs can be held against each
    other impact by impact.

    Args:
        seed: of the run.
        index: of the impact, counted from 0.

    Source: Steele, Lea & Flood 2014 (splitmix64); Box & Muller 1958.

    >>> round(scatter(0, 0), 6) == round(scatter(0, 1), 6), scatter(3, 7) == scatter(3, 7)
    (False, True)
    """
    whole, uniform = (1 << 64) - 1, []
    for i in (1, 2):
        z = (seed * 0xD1342543DE82EF95 + (2 * index + i) * 0x9E3779B97F4A7C15) & whole
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & whole
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & whole
        uniform.append((float((z ^ (z >> 31)) >> 11) + 0.5) / 2**53)
    return math.sqrt(-2.0 * math.log(uniform[0])) * math.cos(2.0 * math.pi * uniform[1])
