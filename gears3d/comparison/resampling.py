"""Resampling whole blocks of time, because the impacts of one motion hang together."""

from __future__ import annotations

import numpy as np


def cut(times: np.ndarray, begin: float, length: float, count: int) -> np.ndarray:
    """Return the block of each impact, -1 outside of all.

    Args:
        times: of the impacts [s], (n,).
        begin: of the first block [s].
        length: of a block [s].
        count: number of blocks.

    >>> cut(np.array([0.1, 0.9, 1.1, 7.0]), 0.0, 1.0, 2).tolist()
    [0, 0, 1, -1]
    """
    block = np.floor((times - begin) / length).astype(int)
    block[(block < 0) | (block >= count)] = -1
    return block


def distance(first: np.ndarray, second: np.ndarray, last: np.ndarray, circular: bool) -> np.ndarray:
    """Return how far two weighted samples are apart: Kolmogorov-Smirnov, or Kuiper on a circle.

    Args:
        first: weights of the impacts in the first sample, in order of value, (b, n).
        second: weights in the second sample, (b, n).
        last: whether an impact is the last one of its value, (n,).
        circular: whether the values are angles.

    Returns:
        The distance, (b,); 0 where a sample is empty.

    Source: Kuiper 1960 for the circle.

    >>> both = np.array([[1, 1, 0, 0]]), np.array([[0, 0, 1, 1]])
    >>> distance(*both, np.ones(4, dtype=bool), circular=False).tolist()
    [1.0]
    """
    apart = (_cumulative(first) - _cumulative(second))[:, last]
    above, below = np.maximum(apart.max(axis=1), 0.0), np.maximum(-apart.min(axis=1), 0.0)
    return above + below if circular else np.maximum(above, below)


def _cumulative(weights: np.ndarray) -> np.ndarray:
    summed = np.cumsum(weights, axis=1, dtype=float)
    return summed / np.maximum(summed[:, -1:], 1.0)


def permuted(count: tuple[int, int], times: int, rng: np.random.Generator) -> np.ndarray:
    """Return which blocks are dealt to the first recording, first as it was, then at random.

    Args:
        count: number of blocks of each recording.
        times: number of random deals.
        rng: source of chance.

    Returns:
        Booleans, (1 + times, blocks of both).

    >>> permuted((2, 1), 1, np.random.default_rng(0)).sum(axis=1).tolist()
    [2, 2]
    """
    dealt = np.arange(sum(count)) < count[0]
    return np.vstack([dealt, rng.permuted(np.tile(dealt, (times, 1)), axis=1)])


def drawn(count: int, size: int, times: int, rng: np.random.Generator) -> np.ndarray:
    """Return how often each block is drawn, with replacement.

    Args:
        count: number of blocks.
        size: number of draws.
        times: number of resamples.
        rng: source of chance.

    Returns:
        Counts, (times, count).

    >>> drawn(3, 5, 2, np.random.default_rng(0)).sum(axis=1).tolist()
    [5, 5]
    """
    return rng.multinomial(size, np.full(count, 1.0 / count), size=times)
