"""Whitening of readings with white and 1/f noise.

Readings in contact and of the drive are filtered in time (innovations of a Kalman filter), those of flights by the
inverse root of their covariance, flight by flight. Noise whose power falls with the frequency is largest at the lowest
orders of a gear, where the strongest causes are expected: taken for white noise, it is mistaken for a cause.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.kernels import njit

Array = np.ndarray
# Ratio of neighbouring relaxation rates: the sum of their spectra is 1/f within 10 %.
RATE_RATIO = 4.0
# Ratio of the slowest relaxation time to the record's duration; the fastest is at the Nyquist frequency of the
# readings, which are means over the sampling interval: white to 15 % there, and to 3 % at the lowest frequencies
# (simulated).
SLOWEST_RELAXATION = 2.0


class Filter(NamedTuple):
    """Whitening filter of readings of one record.

    Args:
        order: of the readings in time, (n,).
        decay: of each part of the slow noise since the previous reading, (n, m).
        gain: of each part, (n, m).
        root: standard deviation of the innovation of each reading, (n,).
    """

    order: Array
    decay: Array
    gain: Array
    root: Array


def filter_of(time: Array, sigma: Array, slow: float) -> Filter:
    """Return the whitening filter of readings with white and 1/f noise.

    time [s], sigma: (n,); slow: root of the power of the 1/f noise per unit of ln f, in the unit of ``sigma``.

    Source: Kalman 1960; 1/f noise as a sum of relaxations (van der Ziel 1950).
    """
    order = np.argsort(time, kind="stable")
    steps = np.diff(time[order], prepend=time[order[0]])
    moved = steps[steps > 0.0]
    rates, variance = _relaxations(float(np.sum(steps)), float(np.median(moved)) if len(moved) else 1.0, slow)
    decay = np.exp(-rates * steps[:, None])
    gain, root = np.zeros_like(decay), np.zeros(len(time))
    _kalman_gains(decay, np.full(len(rates), variance), sigma[order], gain, root)
    return Filter(order, decay, gain, root)


def whitened(values: Array, by: Filter) -> Array:
    """Return the innovations of readings in standard deviations, (n,).

    values: (n,).

    >>> random, slow = np.random.default_rng(1), np.zeros(8193, complex)
    >>> slow[1:] = random.standard_normal((8192, 2)) @ [1.0, 1.0j] / np.sqrt(np.arange(1, 8193))
    >>> shown = (8192.0 * np.fft.irfft(slow)).reshape(-1, 8).mean(axis=1) + 0.5 * random.standard_normal(2048)
    >>> white = whitened(shown, filter_of(np.arange(2048.0), np.full(2048, 0.5), 1.0))
    >>> round(float(np.std(white)), 1), round(4.0 * float(np.std(white.reshape(-1, 16).mean(axis=1))), 1)
    (0.8, 0.9)
    """
    found = np.zeros(len(values))
    made = np.zeros(len(values))
    _innovations(by.decay, by.gain, by.root, np.ascontiguousarray(values[by.order], float), made)
    found[by.order] = made
    return found


def coloured(white: Array, by: Filter) -> Array:
    """Return the readings that :func:`whitened` maps to given innovations, in their unit, (n,).

    white: (n,).

    >>> by = filter_of(np.arange(4.0), np.full(4, 0.1), 1.0)
    >>> coloured(whitened(np.array([1.0, -2.0, 0.5, 3.0]), by), by).round(9).tolist()
    [1.0, -2.0, 0.5, 3.0]
    """
    found, made = np.zeros(len(white)), np.zeros(len(white))
    _readings(by.decay, by.gain, by.root, np.ascontiguousarray(white[by.order], float), made)
    found[by.order] = made
    return found


def roots_of(
    time: Array, sigma: Array, slow: float, longest: float = 0.0, smooth: tuple[float, float] = (0.0, 1.0)
) -> Array:
    """Return the whitening matrices of the points of each flight, (f, b, b).

    Args:
        time: (f, b) [s].
        sigma: standard deviation of white noise, (f, b).
        slow: root of 1/f noise per unit of ln f.
        longest: of the relaxations [s].
        smooth: standard deviation and correlation time [s] of a smooth error.
    """
    lasts = time[:, -1] - time[:, 0]
    rates, variance = _relaxations(
        max(float(lasts.max()), longest), float(lasts.min()) / max(time.shape[1] - 1, 1), slow
    )
    lag = np.abs(time[:, :, None] - time[:, None, :])
    covariance = variance * sum(np.exp(-rate * lag) for rate in rates)
    covariance = covariance + smooth[0] ** 2 * np.exp(-0.5 * (lag / smooth[1]) ** 2)
    covariance = covariance + (sigma**2)[:, :, None] * np.eye(time.shape[1])
    return np.linalg.inv(np.linalg.cholesky(covariance))


def likely_root(rows: Sequence[Array], roots: Sequence[Array | None]) -> Array | None:
    """Return the whitening matrix, ``None`` for white noise, under which residuals, of any size, are most likely.

    The residuals, (n,) each, have no more points than the matrices.

    >>> every, point = np.arange(40.0)[None], np.ones((1, 40))
    >>> roots, rng = [roots_of(every, point, slow)[0] for slow in (0.5, 1.0, 2.0)], np.random.default_rng(1)
    >>> white = rng.standard_normal((200, 40))
    >>> found = likely_root([np.linalg.solve(roots[1], row) for row in white], roots)
    >>> found is roots[1], likely_root(white, [None, *roots])
    (True, None)
    """
    count, best, least = sum(map(len, rows)), None, np.inf
    for root in roots:
        left = rows if root is None else [root[: len(row), : len(row)] @ row for row in rows]
        square = sum(float(row @ row) for row in left)
        scale = 0.0 if root is None else sum(float(np.sum(np.log(np.diag(root)[: len(row)]))) for row in rows)
        if (cost := 0.5 * count * np.log(max(square, 1e-300) / max(count, 1)) - scale) < least:
            best, least = root, cost
    return best


def _relaxations(longest: float, shortest: float, slow: float) -> tuple[Array, float]:
    """Return rates [1/s] of relaxations of equal variance whose sum is 1/f noise, and that variance."""
    ends = 2.0 * np.pi / (SLOWEST_RELAXATION * max(longest, shortest)), np.pi / shortest
    count = max(int(np.ceil(np.log(ends[1] / ends[0]) / np.log(RATE_RATIO))), 1) + 1
    ratio = (ends[1] / ends[0]) ** (1.0 / max(count - 1, 1))
    return ends[0] * ratio ** np.arange(count), slow**2 * np.log(ratio)


@njit(cache=True, error_model="numpy")
def _kalman_gains(decay: Array, variance: Array, sigma: Array, gain: Array, root: Array) -> None:
    """Write the Kalman gains and the standard deviation of each innovation, which do not depend on the readings."""
    count, parts = decay.shape
    known = np.diag(variance)
    for i in range(count):
        for a in range(parts):
            for b in range(parts):
                known[a, b] *= decay[i, a] * decay[i, b]
            known[a, a] += variance[a] * (1.0 - decay[i, a] ** 2)
        toward = known.sum(axis=1)
        new = toward.sum() + sigma[i] ** 2
        root[i] = np.sqrt(new)
        for a in range(parts):
            gain[i, a] = toward[a] / new
        for a in range(parts):
            for b in range(parts):
                known[a, b] -= gain[i, a] * toward[b]


@njit(cache=True, error_model="numpy")
def _innovations(decay: Array, gain: Array, root: Array, values: Array, made: Array) -> None:
    """Write the innovation of each reading in its standard deviations."""
    count, parts = decay.shape
    state = np.zeros(parts)
    for i in range(count):
        new = values[i]
        for a in range(parts):
            state[a] *= decay[i, a]
            new -= state[a]
        for a in range(parts):
            state[a] += gain[i, a] * new
        made[i] = new / root[i]


@njit(cache=True, error_model="numpy")
def _readings(decay: Array, gain: Array, root: Array, white: Array, made: Array) -> None:
    """Write the readings that have given innovations, in their standard deviations."""
    count, parts = decay.shape
    state = np.zeros(parts)
    for i in range(count):
        new = white[i] * root[i]
        made[i] = new
        for a in range(parts):
            state[a] *= decay[i, a]
            made[i] += state[a]
        for a in range(parts):
            state[a] += gain[i, a] * new
