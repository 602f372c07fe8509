"""Least squares for the path of every flight, flight by flight over its readings."""

from __future__ import annotations

from math import expm1, sqrt

import numpy as np

from gears3d.kernels import njit

# Change of the drag over half a flight below which a parabola is exact to rounding.
SLIGHT = 1e-4
# The same below which seven powers are exact to rounding.
FAINT = 0.03


@njit(cache=True)
def bent(x: float, change: float) -> float:
    """Return how a deceleration of 2 about x = 0, proportional to speed apart from that, bends a path."""
    if abs(change) < SLIGHT:
        return x * x * (1.0 - change * x / 3.0)
    y = change * x
    if abs(y) < FAINT:
        series = 1.0 - y / 7.0 * (1.0 - y / 8.0 * (1.0 - y / 9.0))
        return x * x * (1.0 - y / 3.0 * (1.0 - y / 4.0 * (1.0 - y / 5.0 * (1.0 - y / 6.0 * series))))
    return 2.0 * (change * x + expm1(-change * x)) / change**2


@njit(cache=True)
def sum_each(
    time: np.ndarray,
    angle: np.ndarray,
    sigma: np.ndarray,
    first: np.ndarray,
    last: np.ndarray,
    slope: float,
    middle: np.ndarray,
    half: np.ndarray,
    base: np.ndarray,
    sums: np.ndarray,
) -> None:
    """Write what least squares for offset, speed and bend of each flight need of its readings.

    ``time``: of the readings [s], (n,); ``angle``: of the loose gear [rad], (n,); ``sigma``: of the angle [rad], (n,);
    ``first``: index of each flight's first reading, (k,); ``last``: index of its last one, (k,); ``slope``: change of
    the deceleration with the speed [1/s]; ``middle``: written, [s], (k,); ``half``: written, [s], (k,); ``base``: angle
    from which those of the flight are counted, written [rad], (k,); ``sums``: written: products of the three columns,
    row by row from the diagonal on, then with the angle, (k, 9).
    """
    for k in range(len(first)):
        begin, end = first[k], last[k]
        middle[k], half[k] = 0.5 * (time[begin] + time[end]), 0.5 * (time[end] - time[begin])
        base[k], change = angle[begin + (end - begin + 1) // 2], slope * half[k]
        a00 = a01 = a02 = a11 = a12 = a22 = b0 = b1 = b2 = 0.0
        for i in range(begin, end + 1):
            x = (time[i] - middle[k]) / half[k]
            b, w, y = bent(x, change), 1.0 / sigma[i] ** 2, angle[i] - base[k]
            a00 += w
            a01 += w * x
            a02 += w * b
            a11 += w * x * x
            a12 += w * x * b
            a22 += w * b * b
            b0 += w * y
            b1 += w * x * y
            b2 += w * b * y
        for j, one in enumerate((a00, a01, a02, a11, a12, a22, b0, b1, b2)):
            sums[k, j] = one


@njit(cache=True)
def solve_each(
    base: np.ndarray,
    sums: np.ndarray,
    strength: np.ndarray,
    expected: np.ndarray,
    numbers: np.ndarray,
    covariance: np.ndarray,
) -> None:
    """Write offset, speed and bend of each flight.

    ``base``: of :func:`sum_each` [rad], (k,); ``sums``: of :func:`sum_each`, (k, 9); ``strength``: weight of what is
    expected of the third number [1/rad²], (k,); ``expected``: of the third number [rad], (k,); ``numbers``: written,
    [rad], (k, 3); ``covariance``: written, [rad²], (k, 3, 3).
    """
    for k in range(len(base)):
        a00, a01, a02, a11, a12, a22, b0, b1, b2 = sums[k]
        a22, b2 = a22 + strength[k], b2 + strength[k] * expected[k]
        s0, s1, s2 = 1.0 / sqrt(a00), 1.0 / sqrt(a11), 1.0 / sqrt(a22)
        p, q, r = a01 * s0 * s1, a02 * s0 * s2, a12 * s1 * s2
        det = 1.0 + 2.0 * p * q * r - p * p - q * q - r * r
        c = covariance[k]
        c[0, 0], c[1, 1], c[2, 2] = (
            (1.0 - r * r) / det * s0 * s0,
            (1.0 - q * q) / det * s1 * s1,
            (1.0 - p * p) / det * s2 * s2,
        )
        c[0, 1] = c[1, 0] = (q * r - p) / det * s0 * s1
        c[0, 2] = c[2, 0] = (p * r - q) / det * s0 * s2
        c[1, 2] = c[2, 1] = (p * q - r) / det * s1 * s2
        numbers[k, 0] = c[0, 0] * b0 + c[0, 1] * b1 + c[0, 2] * b2 + base[k]
        numbers[k, 1] = c[1, 0] * b0 + c[1, 1] * b1 + c[1, 2] * b2
        numbers[k, 2] = c[2, 0] * b0 + c[2, 1] * b1 + c[2, 2] * b2


@njit(cache=True)
def judge_each(
    time: np.ndarray,
    angle: np.ndarray,
    sigma: np.ndarray,
    first: np.ndarray,
    last: np.ndarray,
    slope: float,
    middle: np.ndarray,
    half: np.ndarray,
    base: np.ndarray,
    numbers: np.ndarray,
    chi2: np.ndarray,
) -> None:
    """Write chi-square per degree of freedom of flights that have any.

    ``middle``: of the flights [s], (k,); ``half``: [s], (k,); ``base``: of :func:`sum_each` [rad], (k,); ``numbers``:
    of their paths [rad], (k, 3); ``chi2``: written, (k,).
    """
    for k in range(len(first)):
        begin, end = first[k], last[k]
        if end - begin + 1 <= 3:
            continue
        n0, n1, n2 = numbers[k, 0] - base[k], numbers[k, 1], numbers[k, 2]
        change, total = slope * half[k], 0.0
        for i in range(begin, end + 1):
            x = (time[i] - middle[k]) / half[k]
            total += ((angle[i] - base[k] - n0 - x * n1 - bent(x, change) * n2) / sigma[i]) ** 2
        chi2[k] = total / (end - begin - 2)


@njit(cache=True)
def _product(one: np.ndarray, other: np.ndarray) -> float:
    total = 0.0
    for i in range(len(one)):
        total += one[i] * other[i]
    return total


@njit(cache=True)
def third_powers(
    time: np.ndarray,
    angle: np.ndarray,
    sigma: np.ndarray,
    first: np.ndarray,
    last: np.ndarray,
    slope: float,
    middle: np.ndarray,
    half: np.ndarray,
    numbers: np.ndarray,
    most: int,
    own: np.ndarray,
    slack: np.ndarray,
) -> None:
    """Write the correction of the slope by each flight, and its standard deviation.

    The third power of time is orthogonalised to the three columns of the flight (Gram-Schmidt).

    ``time``: of the readings [s], (n,); ``angle``: of the loose gear [rad], (n,); ``sigma``: of the angle [rad], (n,);
    ``first``: index of each flight's first reading, (k,); ``last``: index of its last one, (k,); ``slope``: with which
    the flights were fitted [1/s]; ``middle``: of the flights [s], (k,); ``half``: [s], (k,); ``numbers``: of their
    paths [rad], (k, 3); ``own``: written, [1/s], (k,); ``slack``: written, [1/s], (k,).
    """
    for k in range(len(first)):
        begin, end = first[k], last[k]
        few = max((end - begin) // most, 1)
        count = (end - begin + 1) // few
        rows, rest = np.zeros((4, count)), np.zeros(count)
        change = slope * half[k]
        for i in range(count):
            x = y = 0.0
            for j in range(begin + i * few, begin + (i + 1) * few):
                x += time[j] - middle[k]
                y += angle[j] - numbers[k, 0]
            x, y = x / (few * half[k]), y / few
            w = sqrt(few) / sigma[begin + i * few]
            b = bent(x, change)
            further = (bent(x, change + 0.01) - b) / 0.01 * half[k] * numbers[k, 2]
            rows[0, i], rows[1, i], rows[2, i], rows[3, i] = w, w * x, w * b, w * further
            rest[i] = w * (y - x * numbers[k, 1] - b * numbers[k, 2])
        scale = 0.0
        for m in range(4):
            for _ in range(2):  # twice is enough
                for n in range(m):
                    part = _product(rows[m], rows[n])
                    for i in range(count):
                        rows[m, i] -= part * rows[n, i]
            size = sqrt(_product(rows[m], rows[m]))
            if m == 2:
                scale = size
            if m < 3:
                for i in range(count):
                    rows[m, i] /= size
            elif size > 1e-12 * scale:
                own[k], slack[k] = _product(rows[3], rest) / size**2, 1.0 / size


@njit(cache=True)
def spread(
    x: np.ndarray, half: np.ndarray, slope: np.ndarray, covariance: np.ndarray, angle: np.ndarray, speed: np.ndarray
) -> None:
    """Write the standard deviations of angle [rad] and speed [rad/s] of flights.

    ``x``: times in half flights, (k, g); ``half``: of the flights [s], (k,); ``slope``: of the deceleration over speed
    in each [1/s], (k,); ``covariance``: of the numbers of their paths [rad²], (k, 3, 3); ``angle``: written, (k, g);
    ``speed``: written, (k, g).
    """
    for k in range(x.shape[0]):
        c, change = covariance[k], slope[k] * half[k]
        for g in range(x.shape[1]):
            t = x[k, g]
            b = bent(t, change)
            rate = t * (2.0 - change * t) if abs(change) < SLIGHT else -2.0 * expm1(-change * t) / change
            place = c[0, 0] + t * t * c[1, 1] + b * b * c[2, 2] + 2.0 * (t * c[0, 1] + b * c[0, 2] + t * b * c[1, 2])
            turn = c[1, 1] + rate * rate * c[2, 2] + 2.0 * rate * c[1, 2]
            angle[k, g], speed[k, g] = sqrt(max(place, 0.0)), sqrt(max(turn, 0.0)) / half[k]
