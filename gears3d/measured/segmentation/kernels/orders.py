"""Flanks over the angles of both gears: sums of orders, without a matrix of their columns."""

from __future__ import annotations

from math import floor

import numpy as np

from gears3d.kernels import njit

# What a term is: a constant, a power of time, orders of either gear.
OFFSET, DRIFT, DRIVE, LOOSE = range(4)
# Powers of two among orders: the highest is below 2**BITS.
BITS = 16
# Times processed together, for vectorisation.
TOGETHER = 64


# Parts of pi/4 short enough for their products with whole numbers to be exact.
EIGHTH = (7.85398125648498535156e-1, 3.77489470793079817668e-8, 2.69515142907905952645e-15)
SINE = (1.58962301576546568060e-10, -2.50507477628578072866e-8, 2.75573136213857245213e-6,
        -1.98412698295895385996e-4, 8.33333333332211858878e-3, -1.66666666666666307295e-1)  # fmt: skip
# Coefficients of both over an eighth of a turn to either side, highest power first (Moshier's Cephes library).
COSINE = (-1.13585365213876817300e-11, 2.08757008419747316778e-9, -2.75573141792967388112e-7,
          2.48015872888517045348e-5, -1.38888888888730564116e-3, 4.16666666666665929218e-2)  # fmt: skip


@njit(cache=True)
def turned(angle: np.ndarray, cosine: np.ndarray, sine: np.ndarray) -> None:
    """Write cosine and sine of angles, to rounding; without branches, so that several are computed at once.

    ``angle``: up to 1e8 [rad], (n,); ``cosine``: written, (n,) or longer; ``sine``: written, (n,) or longer.
    """
    for i in range(len(angle)):
        quarters = floor(angle[i] * 0.6366197723675814 + 0.5)
        y = 2.0 * quarters
        x = ((angle[i] - y * EIGHTH[0]) - y * EIGHTH[1]) - y * EIGHTH[2]
        z = x * x
        s = SINE[0] * z + SINE[1]
        s = (((s * z + SINE[2]) * z + SINE[3]) * z + SINE[4]) * z + SINE[5]
        s = x + x * z * s
        c = COSINE[0] * z + COSINE[1]
        c = (((c * z + COSINE[2]) * z + COSINE[3]) * z + COSINE[4]) * z + COSINE[5]
        c = 1.0 - 0.5 * z + z * z * c
        quarter = quarters - 4.0 * floor(0.25 * quarters)
        odd = quarter - 2.0 * floor(0.5 * quarter)
        half = 1.0 - 2.0 * floor(0.5 * quarter)  # -1 in the second half of a turn
        cosine[i] = half * (c if odd == 0.0 else -s)
        sine[i] = half * (s if odd == 0.0 else c)


@njit(cache=True)
def _squared(angle: np.ndarray, sort: np.ndarray, order: np.ndarray, gear: int, re: np.ndarray, im: np.ndarray) -> None:
    """Write cosine and sine of angles times 1, 2, 4, ..., as far as a gear's orders need them, by squaring.

    ``angle``: of the gear [rad], (n,), n at most TOGETHER; ``sort``: of each term, (m,); ``order``: of each, (m,);
    ``re``: written, (BITS, TOGETHER); ``im``: written, (BITS, TOGETHER).
    """
    top, count = 0, len(angle)
    for j in range(len(sort)):
        if sort[j] == gear:
            top = max(top, order[j])
    if top == 0:
        return
    turned(angle, re[0], im[0])
    bit = 1
    while top >> bit:
        for i in range(count):
            a, b = re[bit - 1, i], im[bit - 1, i]
            re[bit, i], im[bit, i] = a * a - b * b, 2.0 * a * b
        bit += 1


@njit(cache=True)
def _power(order: int, re: np.ndarray, im: np.ndarray, count: int, cosine: np.ndarray, sine: np.ndarray) -> None:
    """Write cosine and sine of a multiple of angles, from those of powers of two, (count,)."""
    for i in range(count):
        cosine[i], sine[i] = 1.0, 0.0
    bit = 0
    while order >> bit:
        if (order >> bit) & 1:
            for i in range(count):
                a, b = cosine[i], sine[i]
                cosine[i], sine[i] = a * re[bit, i] - b * im[bit, i], a * im[bit, i] + b * re[bit, i]
        bit += 1


@njit(cache=True)
def _term(
    sort: int, order: int, x: np.ndarray, turns: tuple, cosine: np.ndarray, sine: np.ndarray
) -> int:  # fmt: skip
    """Write the columns of one term at some times, (n,) each, and return how many there are.

    ``x``: times from -1 to 1, (n,).
    """
    count = len(x)
    if sort == OFFSET:
        for i in range(count):
            cosine[i] = 1.0
        return 1
    if sort == DRIFT:
        for i in range(count):
            cosine[i] = x[i] if order == 1 else 1.5 * x[i] * x[i] - 0.5
        return 1
    if sort == DRIVE:
        _power(order, turns[0], turns[1], count, cosine, sine)
    else:
        _power(order, turns[2], turns[3], count, cosine, sine)
    return 2


@njit(cache=True)
def columns(
    sort: np.ndarray, order: np.ndarray, x: np.ndarray, drive: np.ndarray, loose: np.ndarray, written: np.ndarray
) -> None:
    """Write the columns at times and angles: what each term is there.

    ``sort``: of each term, one of the four, (m,); ``order``: or degree of each, (m,); ``x``: times from -1 to 1, (n,);
    ``drive``: [rad], (n,); ``loose``: [rad], (n,); ``written``: one number for a constant or a power, two for an order,
    (n, p).
    """
    turns = (
        np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER))
    )  # fmt: skip
    cosine, sine = np.zeros(TOGETHER), np.zeros(TOGETHER)
    for first in range(0, len(x), TOGETHER):
        last = min(first + TOGETHER, len(x))
        _squared(drive[first:last], sort, order, DRIVE, turns[0], turns[1])
        _squared(loose[first:last], sort, order, LOOSE, turns[2], turns[3])
        at = 0
        for j in range(len(sort)):
            width = _term(sort[j], order[j], x[first:last], turns, cosine, sine)
            for i in range(last - first):
                written[first + i, at] = cosine[i]
                if width == 2:
                    written[first + i, at + 1] = sine[i]
            at += width


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

    ``sort``: of each term, (m,); ``order``: or degree of each, (m,); ``x``: times from -1 to 1, (n,); ``drive``: [rad],
    (n,); ``loose``: [rad], (n,); ``numbers``: of each sum, (s, p); ``written``: (s, n).
    """
    turns = (
        np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER))
    )  # fmt: skip
    cosine, sine = np.zeros(TOGETHER), np.zeros(TOGETHER)
    for first in range(0, len(x), TOGETHER):
        last = min(first + TOGETHER, len(x))
        count = last - first
        _squared(drive[first:last], sort, order, DRIVE, turns[0], turns[1])
        _squared(loose[first:last], sort, order, LOOSE, turns[2], turns[3])
        for s in range(numbers.shape[0]):
            written[s, first:last] = 0.0
        at = 0
        for j in range(len(sort)):
            width = _term(sort[j], order[j], x[first:last], turns, cosine, sine)
            for s in range(numbers.shape[0]):
                one, other = numbers[s, at], numbers[s, at + width - 1]
                own = written[s, first:last]
                for i in range(count):
                    own[i] += one * cosine[i]
                if width == 2:
                    for i in range(count):
                        own[i] += other * sine[i]
            at += width
