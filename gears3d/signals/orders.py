"""Order analysis: harmonics of a shaft's angle by least squares, from samples at any angles.

A harmonic is Re(z·exp(i·order·angle)) with the phasor z = amplitude·exp(i·phase). Samples may have gaps; what is
resampled over whole revolutions has :func:`gears3d.signals.order_spectrum`. What decides whether an order is
significant depends on what disturbs the samples, and stands where they are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.signals.noise import robust_deviation

Array = np.ndarray
GEARS = ("drive", "loose")
ROUNDS = 3  # Fits of which each excludes the outliers of the one before
FINE, PADDED = 8, 8  # Bins in a wave of the highest order, and times their number that a transform over them has


def harmonics(angle: Array, orders: Sequence[float]) -> Array:
    """Return cos and -sin of each order, whose coefficients are the parts of its phasor, (n, 2p).

    >>> harmonics(np.array([0.0, 0.5 * np.pi]), [1, 2]).round(9).tolist()
    [[1.0, -0.0, 1.0, -0.0], [0.0, -1.0, -1.0, -0.0]]
    """
    waves = np.multiply.outer(angle, orders)
    return np.stack([np.cos(waves), -np.sin(waves)], axis=-1).reshape(len(angle), 2 * len(orders))


def phasors_of(numbers: Array) -> Array:
    """Return the phasors of coefficients, (p,) of (2p,)."""
    return numbers[0::2] + 1j * numbers[1::2]


def deviations(covariance: Array) -> Array:
    """Return the standard deviation of each part of phasors, (p,), of the covariance of their parts, (2p, 2p)."""
    return np.sqrt(np.maximum(np.diag(covariance).reshape(-1, 2).mean(axis=1), 0.0))


def chances(phasors: Array, covariance: Array) -> Array:
    """Return the probability that noise alone makes a phasor so large, (p,).

    >>> chances(np.array([0.0, 2.0j]), np.eye(4)).round(4).tolist()
    [1.0, 0.1353]
    """
    parts = np.stack([np.real(phasors), np.imag(phasors)], axis=-1)
    blocks = covariance.reshape(len(parts), 2, len(parts), 2)[np.arange(len(parts)), :, np.arange(len(parts))]
    return np.array(
        [np.exp(-0.5 * z @ np.linalg.solve(own, z)) if z.any() else 1.0 for z, own in zip(parts, blocks, strict=True)]
    )


class Fitted(NamedTuple):
    """Least squares without outliers."""

    numbers: Array  # (p,)
    inverse: Array  # of the normal matrix, (p, p)
    rest: Array  # residuals, of outliers as well, (n,)
    limit: float  # residual from which on a value is an outlier

    @property
    def kept(self) -> Array:
        """Values that are no outliers, (n,)."""
        return np.abs(self.rest) <= self.limit


def trimmed(
    columns: Array, values: Array, stray: float, noise: float, kept: Array | None = None, ridge: float = 0.0
) -> Fitted:
    """Fit columns to values without those that are more than ``stray`` deviations off.

    The deviation is that of most residuals, ``noise`` at least; ``ridge`` is added to the normal matrix of columns of
    unit length, where samples may show hardly any difference between two orders.
    """
    kept = np.ones(len(values), bool) if kept is None else kept
    for _ in range(ROUNDS):
        rows = columns[kept]
        normal = rows.T @ rows
        size = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
        scale = np.outer(size, size)
        inverse = (
            np.linalg.inv(normal * scale + ridge * np.eye(len(size)))
            if ridge
            else np.linalg.pinv(normal * scale, hermitian=True)
        )
        numbers = inverse * scale @ (rows.T @ values[kept])
        rest = values - columns @ numbers
        fitted = Fitted(numbers, inverse * scale, rest, stray * max(robust_deviation(rest), noise))
        kept = fitted.kept
    return fitted


def colour_of(rest: Array) -> float:
    """Return by how much the variance of a mean of neighbours exceeds that of independent residuals, 1 to 7."""
    if len(rest) < 64:
        return 1.0
    total = float(np.mean(rest**2))
    alike = [float(np.mean(rest[lag:] * rest[:-lag])) / max(total, 1e-300) for lag in (1, 2, 3)]
    return float(np.clip(1.0 + 2.0 * np.sum(np.maximum(alike, 0.0)), 1.0, 7.0))


def sums(angle: Array, values: Array, highest: int, bins: int = 0) -> Array:
    """Return Σ values·exp(-i·order·angle) of the orders 0 to ``highest``, (highest + 1,).

    With ``bins`` in a wave of the highest order the angle is rounded to bins, for one transform of all orders.
    """
    if bins:
        count = 1 << int(np.ceil(np.log2(bins * highest + bins)))
        turned = np.mod(angle, 2 * np.pi)
        turned /= 2 * np.pi  # in place: of a long record each array is 8 MB
        turned *= count
        place = turned.astype(int)
        del turned
        place %= count
        return np.fft.rfft(np.bincount(place, values, minlength=count))[: highest + 1]
    turn, at, found = np.exp(-1j * angle), values.astype(complex), np.zeros(highest + 1, complex)
    for order in range(highest + 1):
        found[order] = at.sum()
        at = at * turn
    return found


def each_alone(angle: Array, values: Array, highest: int, ridge: float, bins: int = 0) -> tuple[Array, Array]:
    """Return the phasor of each order from 0 to ``highest`` without the others, and its fall of the sum of squares.

    ``ridge``, relative to the number of values, is added to the normal matrix: samples at few angles determine some
    orders poorly. ``bins`` as for :func:`sums`.

    >>> turn = np.linspace(0.0, 20.0, 4001)
    >>> float(np.abs(each_alone(turn, 2e-6 * np.cos(3 * turn + 0.4), 5, 1e-4, 32)[0])[3].round(8))
    2e-06
    """
    right = sums(angle, values, highest, bins)
    twice = sums(angle, np.ones(len(angle)), 2 * highest, bins // 2)[::2]
    (c, s), (even, odd) = ((np.real(one), np.imag(one)) for one in (right, twice))
    own = (0.5 + ridge) * len(values)
    cc, ss, cs = own + 0.5 * even, own - 0.5 * even, 0.5 * odd
    whole = np.maximum(cc * ss - cs * cs, 1e-300)
    a, b = (c * ss - s * cs) / whole, (s * cc - c * cs) / whole
    return a + 1j * b, np.maximum(a * c + b * s, 0.0)


def power_at(angle: Array, values: Array, orders: Array, highest: int) -> Array:
    """Return |Σ values·exp(-i·order·angle)|² of any orders below ``highest``, by a transform over bins, (o,)."""
    from scipy.fft import next_fast_len

    width = 2.0 * np.pi / (FINE * highest)
    place = np.floor((angle - angle.min()) / width).astype(int)
    bins = int(next_fast_len(PADDED * (int(place.max()) + 1), real=True) or 1)
    found = np.abs(np.fft.rfft(np.bincount(place, values), bins)) ** 2
    return np.interp(orders, np.arange(len(found)) * 2.0 * np.pi / (bins * width), found)


def off_multiples(orders: Array, spacing: float) -> Array:
    """Return how far orders are from the nearest multiple of one, (o,).

    >>> off_multiples(np.array([2.9, 4.0]), 1.5).round(9).tolist()
    [0.1, 0.5]
    """
    times = orders / spacing
    return np.abs(times - np.round(times)) * spacing
