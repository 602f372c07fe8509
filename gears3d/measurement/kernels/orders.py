"""Flanks over the angles of both gears: sums of orders, without a matrix of their columns."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from gears3d.kernels import njit

OFFSET, DRIFT, DRIVE, LOOSE = range(4)
"""What a term is: a constant, a power of time, orders of either gear."""


@njit(cache=True)
def _power(re: float, im: float, order: int) -> tuple[float, float]:
    """Return cosine and sine of a multiple of an angle, by squaring."""
    a, b = 1.0, 0.0
    while order > 0:
        if order & 1:
            a, b = a * re - b * im, a * im + b * re
        re, im = re * re - im * im, 2.0 * re * im
        order >>= 1
    return a, b


@njit(cache=True)
def row(
    sort: np.ndarray, order: np.ndarray, x: float, drive: float, loose: float, written: np.ndarray
) -> None:  # fmt: skip
    """Write the columns of one time: what each term is there.

    Args:
        sort: of each term, one of the four, (m,).
        order: or degree of each, (m,).
        x: time, from -1 at the record's begin to 1 at its end.
        drive: angle [rad].
        loose: angle [rad].
        written: one number for a constant or a power, two for an order, (p,).
    """
    d0, d1, l0, l1 = cos(drive), sin(drive), cos(loose), sin(loose)
    at = 0
    for j in range(len(sort)):
        if sort[j] == OFFSET:
            written[at] = 1.0
            at += 1
        elif sort[j] == DRIFT:
            written[at] = x if order[j] == 1 else 1.5 * x * x - 0.5
            at += 1
        else:
            re, im = (d0, d1) if sort[j] == DRIVE else (l0, l1)
            written[at], written[at + 1] = _power(re, im, order[j])
            at += 2


@njit(cache=True)
def columns(
    sort: np.ndarray, order: np.ndarray, x: np.ndarray, drive: np.ndarray, loose: np.ndarray, written: np.ndarray
) -> None:
    """Write the columns at times and angles.

    Args:
        sort: of each term, (m,).
        order: or degree of each, (m,).
        x: times from -1 to 1, (n,).
        drive: [rad], (n,).
        loose: [rad], (n,).
        written: (n, p).
    """
    for i in range(len(x)):
        row(sort, order, x[i], drive[i], loose[i], written[i])


@njit(cache=True)
def sums(
    sort: np.ndarray,
    order: np.ndarray,
    x: np.ndarray,
    drive: np.ndarray,
    loose: np.ndarray,
    numbers: np.ndarray,
    written: np.ndarray,
) -> None:
    """Write sums of the columns.

    Args:
        sort: of each term, (m,).
        order: or degree of each, (m,).
        x: times from -1 to 1, (n,).
        drive: [rad], (n,).
        loose: [rad], (n,).
        numbers: of each sum, (s, p).
        written: (s, n).
    """
    own = np.zeros(numbers.shape[1])
    for i in range(len(x)):
        row(sort, order, x[i], drive[i], loose[i], own)
        for s in range(numbers.shape[0]):
            total = 0.0
            for p in range(len(own)):
                total += numbers[s, p] * own[p]
            written[s, i] = total
