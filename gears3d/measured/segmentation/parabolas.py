"""Flights as parabolas in the angle of the loose gear, fitted to readings."""

from __future__ import annotations

from math import expm1, sqrt
from typing import NamedTuple

import numpy as np

from gears3d.kernels import njit
from gears3d.measured.encoder import usual
from gears3d.measured.segmentation.displacement import Track
from gears3d.signals import robust_deviation

# Change of the drag over half a flight below which a parabola is exact to rounding.
SLIGHT = 1e-4
# The same below which seven powers are exact to rounding.
FAINT = 0.03
# Readings that a flight needs.
FEWEST = 5
# Part by which the deceleration of a short flight may always differ from that of the others.
LOOSE = 0.2
# Relative standard deviation of a variance from the median absolute deviation of n normal values, times √n.
MAD_ERROR = 2.33
# Deviations by which a change of the drag within flights must be known to be taken.
SURE = 4.0
# Readings of a flight beyond which neighbours are averaged before its third power is looked for.
MOST = 2000


# Deviation of readings from a parabola, over the displacement of the flight, that is immaterial.
IMMATERIAL = 1e-3
# Readings of a flight, and flights, that show whether noise in them is slow.
LONG, TOLD = 20, 10
# Largest factor by which the variance of rounding to counts is underestimated: third differences of a sawtooth of
# 1/6 count have that much less of it than white noise.
COUNTED = 1.6
# Sums of 1/k², 1/k³ and 1/k⁴ from k = 3 on.
TAILS = {2: 0.394934, 3: 0.077057, 4: 0.019823}
# From 1, x, x² to Legendre polynomials, which have independent numbers.
LEGENDRE = np.array([[1.0, 0.0, 1.0 / 3.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0 / 3.0]])


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
def spread_each(
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


class Law(NamedTuple):
    """Deceleration law common to all flights.

    Args:
        deceleration: of the loose gear at ``speed`` [rad/s²].
        slope: change with its speed, between flights [1/s].
        speed: of the loose gear [rad/s].
        varies: how much a flight may differ [rad/s²].
        seen: least and greatest speed of the flights that told it [rad/s]; beyond them it is not extrapolated.
    """

    deceleration: float
    slope: float
    speed: float
    varies: float
    seen: tuple[float, float]

    def at(self, speed: np.ndarray) -> np.ndarray:
        """Return the deceleration expected at speeds [rad/s²]."""
        return self.deceleration + self.slope * (np.clip(speed, *self.seen) - self.speed)


class Parabolas(NamedTuple):
    """Paths of flights, over x = (t − middle)/half: 1, x and :func:`bend`, which without ``slope`` is x².

    Args:
        middle: [s], (k,).
        half: [s], (k,).
        numbers: of the three [rad], (k, 3).
        covariance: of these [rad²], (k, 3, 3).
        chi2: per degree of freedom over what the model of noise expects, NaN without any, (k,).
        readings: (k,).
        slope: change of the deceleration with the loose gear's speed within each flight [1/s], (k,).
        base: angle from which those of each flight are summed [rad], (k,).
        sums: of its readings, which all that is fitted to them begins with, (k, 9).
        freedom: degrees of freedom that a white noise of the same scatter of chi-square has, (k,).
        share: part of the slow noise that the model states which flights show, (k,).
        rounding: variance of a reading over the measured one, (k,).
    """

    middle: np.ndarray
    half: np.ndarray
    numbers: np.ndarray
    covariance: np.ndarray
    chi2: np.ndarray
    readings: np.ndarray
    slope: np.ndarray
    base: np.ndarray
    sums: np.ndarray
    freedom: np.ndarray
    share: np.ndarray
    rounding: np.ndarray

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return the angles at times (k, g) [rad]."""
        x = (time - self.middle[:, None]) / self.half[:, None]
        bent, _ = bend(x, (self.slope * self.half)[:, None])
        return self.numbers[:, :1] + x * self.numbers[:, 1:2] + bent * self.numbers[:, 2:]

    def spread(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the standard deviations of angle [rad] and speed [rad/s] at times (k, g)."""
        x = (time - self.middle[:, None]) / self.half[:, None]
        angle, turning = np.zeros_like(x), np.zeros_like(x)
        spread_each(x, self.half, self.slope, np.ascontiguousarray(self.covariance), angle, turning)
        return angle, turning

    @property
    def deceleration(self) -> tuple[np.ndarray, np.ndarray]:
        """The deceleration at half time and its standard deviation [rad/s²], each (k,)."""
        factor = 2.0 / self.half**2
        return -factor * self.numbers[:, 2], factor * np.sqrt(self.covariance[:, 2, 2])

    def some(self, which: np.ndarray) -> Parabolas:
        """Return those of an index or mask."""
        return Parabolas(*(column[which] for column in self))


def bend(x: np.ndarray, change: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """Return how a deceleration of 2 about x = 0, proportional to speed apart from that, bends a path, and its rate.

    The path solves y'' = 2 − κ·y', y(0) = y'(0) = 0: y = 2·(κx − 1 + exp(−κx))/κ².

    >>> x = np.linspace(-1.0, 1.0, 5)
    >>> bool(np.allclose(bend(x, 0.0)[0], x**2)), bool(np.allclose(bend(x, 1e-3)[0], x**2 - 1e-3 * x**3 / 3, atol=1e-6))
    (True, True)
    """
    small = np.abs(change) < SLIGHT
    if np.all(small):
        return x * x * (1.0 - change * x / 3.0), x * (2.0 - change * x)
    safe = np.where(small, 1.0, change)
    power = -np.expm1(-safe * x)
    bent = np.where(small, x * x * (1.0 - change * x / 3.0), 2.0 * (safe * x - power) / safe**2)
    return bent, np.where(small, x * (2.0 - change * x), 2.0 * power / safe)


def fit(known: Track, first: np.ndarray, last: np.ndarray, slope: float = 0.0, law: Law | None = None) -> Parabolas:
    """Fit each flight by weighted least squares.

    Each has its own deceleration, constant as under dry friction. With ``slope`` it changes with the speed within the
    flight, as under viscous drag.

    ``first``: index of each flight's first reading, (k,); ``last``: index of its last one, (k,); ``slope``: change of
    the deceleration with the loose gear's speed [1/s].

    Source: Rigaud & Perret-Liaudet 2020, eq. (13); Ottewill et al. 2010, eq. (4).
    """
    count = len(first)
    middle, half, base, sums = np.zeros(count), np.ones(count), np.zeros(count), np.zeros((count, 9))
    numbers, covariance = np.zeros((count, 3)), np.zeros((count, 3, 3))
    chi2, readings = np.full(count, np.nan), (last - first + 1).astype(float)
    given = (known.time, known.shown, known.sigma_loose, first, last, slope, middle, half, base)
    sum_each(*given, sums)
    solve_each(base, sums, *_expected(known, first, last, law), numbers, covariance)
    judge_each(*given, numbers, chi2)
    numbers[:, 0] += known.lift
    slight = (IMMATERIAL * _extent(known, first, last) / (known.radii[1] * known.sigma_loose[(first + last) // 2])) ** 2
    share = _shown_share(known, 2.0 * half, readings, chi2)
    expected, freedom = _expected_scatter(known, 2.0 * half, readings, share)
    chi2 = np.maximum(chi2 - slight, np.minimum(chi2, expected)) / expected
    more = _rounding(known, readings, chi2)
    chi2, covariance = chi2 / more, _coloured(known, 2.0 * half, readings, share, covariance) * more
    slopes = np.full(count, slope)
    factor = np.full(count, more)
    return Parabolas(middle, half, numbers, covariance, chi2, readings, slopes, base, sums, freedom, share, factor)


def tied(known: Track, first: np.ndarray, last: np.ndarray, free: Parabolas, law: Law | None) -> Parabolas:
    """Return flights of :func:`fit` with a prior of their deceleration; their chi-square is unchanged.

    ``first``: index of each flight's first reading, (k,); ``last``: index of its last one, (k,).
    """
    numbers, covariance = np.zeros_like(free.numbers), np.zeros_like(free.covariance)
    solve_each(free.base, free.sums, *_expected(known, first, last, law), numbers, covariance)
    numbers[:, 0] += known.lift
    covariance = _coloured(known, 2.0 * free.half, free.readings, free.share, covariance)
    covariance = covariance * free.rounding[:, None, None]
    return free._replace(numbers=numbers, covariance=covariance)


def _extent(known: Track, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return the range of the displacement of each flight [m], (k,)."""
    if not len(first):
        return np.zeros(0)
    places = np.stack([known.part(rows)[2] for rows in (first, (first + last) // 2, last)])
    return np.ptp(places, axis=0)


def _slow_parts(
    known: Track, lasts: np.ndarray, readings: np.ndarray, share: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the power of 1/f noise and of random walk at one half-wave in each flight, in that of white noise."""
    model = known.models[1]
    white = np.maximum(usual(known.sigma_loose) ** 2 / np.maximum(readings, 1.0), 1e-300)
    return share * model.flicker**2 / white, share * (model.walk / np.pi) ** 2 * lasts / white


def _shown_share(known: Track, lasts: np.ndarray, readings: np.ndarray, chi2: np.ndarray) -> np.ndarray:
    """Return the part of the slow noise that flights show: near impacts the noise model alone states too much."""
    expected, _ = _expected_scatter(known, lasts, readings, np.ones(len(lasts)))
    seen = np.isfinite(chi2) & (readings > LONG)
    share = 1.0
    if np.count_nonzero(seen) >= TOLD and (more := float(np.median(expected[seen])) - 1.0) > 0.0:
        share = float(np.clip((np.median(chi2[seen]) - 1.0) / more, 0.0, 1.0))
    return np.full(len(lasts), share)


def _rounding(known: Track, readings: np.ndarray, chi2: np.ndarray) -> float:
    """Return the ratio of the variance of a counted reading in all flights to the measured one.

    Rounding errors are correlated with the motion: differences of neighbours over- or underestimate them.
    """
    seen = np.isfinite(chi2) & (readings > LONG)
    if known.readings[1].kind != "counts" or np.count_nonzero(seen) < TOLD:
        return 1.0
    return float(np.clip(np.median(chi2[seen]), 1.0, COUNTED))


def _expected_scatter(
    known: Track, lasts: np.ndarray, readings: np.ndarray, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean of chi-square by degree of freedom, and the degrees of freedom that give its scatter, (k,).

    The residual of a fit consists of the half-waves from 3 on in the flight; the power of each is that of white noise,
    1/f noise over k and random walk over k² (Satterthwaite 1946).
    """
    flicker, walk = _slow_parts(known, lasts, readings, share)
    count = np.maximum(readings - 3.0, 1.0)
    tails = [np.log(np.maximum(readings, 3.0)) + np.euler_gamma - 1.5, *(TAILS[power] for power in (2, 3, 4))]
    first = count + flicker * tails[0] + walk * tails[1]
    second = count + 2.0 * flicker * tails[0] + (2.0 * walk + flicker**2) * tails[1]
    second = second + 2.0 * flicker * walk * tails[2] + walk**2 * tails[3]
    return first / count, first**2 / second


def _coloured(
    known: Track, lasts: np.ndarray, readings: np.ndarray, share: np.ndarray, covariance: np.ndarray
) -> np.ndarray:
    """Return covariances of offset, speed and bend under noise that is not white: more at their own half-waves."""
    flicker, walk = _slow_parts(known, lasts, readings, share)
    if not np.any(flicker) and not np.any(walk):
        return covariance
    wide = np.log(np.maximum((known.time[-1] - known.time[0]) / np.maximum(lasts, 1e-300), 1.1))
    powers = np.stack([1.0 + 2.0 * flicker * np.maximum(wide, 0.1) + 4.0 * walk, 1.0 + flicker + walk,
                       1.0 + flicker / 2.0 + walk / 4.0], axis=1)  # fmt: skip
    root = np.sqrt(powers)
    apart = LEGENDRE @ covariance @ LEGENDRE.T * root[:, :, None] * root[:, None, :]
    back = np.linalg.inv(LEGENDRE)
    return back @ apart @ back.T


def _expected(known: Track, first: np.ndarray, last: np.ndarray, law: Law | None) -> tuple[np.ndarray, np.ndarray]:
    """Return weight [1/rad²] and size [rad] of what is expected of each flight's third number, each (k,)."""
    if law is None:
        return np.zeros(len(first)), np.zeros(len(first))
    lasted, turned = (column[last] - column[first] for column in (known.time, known.shown))
    return (0.125 * lasted**2 * law.varies) ** -2, -0.125 * lasted**2 * law.at(turned / lasted)


def slope_within(
    known: Track, first: np.ndarray, last: np.ndarray, straight: Parabolas | None = None
) -> tuple[float, float]:
    """Return how the deceleration changes with speed within flights, and its standard deviation [1/s].

    Under viscous drag a flight is not a parabola; its third power of time gives the slope, the same for all flights.
    The estimate is the weighted median of all, which is robust to segments that are not flights.

    ``first``: index of each flight's first reading, (k,); ``last``: index of its last one, (k,).
    """
    slope, sigma = 0.0, np.inf
    long = last - first >= 4 * FEWEST
    if np.count_nonzero(long) < 3:
        return slope, sigma
    first, last = first[long], last[long]
    made = fit(known, first, last) if straight is None else straight.some(long)
    for turn in range(4):
        made = made if turn == 0 else fit(known, first, last, slope)
        own, slack = _third_powers(known, first, last, slope, made)
        told = np.isfinite(own) & (slack > 0.0)
        if np.count_nonzero(told) < 3:
            return 0.0, np.inf
        step = _weighted_median(own[told], 1.0 / slack[told])
        pulls = 1.4826 * float(np.median(np.abs(own[told] - step) / slack[told]))
        sigma = 1.2533 * max(pulls, 1.0) / float(np.sqrt(np.sum(slack[told] ** -2.0)))
        slope += step
        if abs(step) < 0.1 * sigma:
            break
    return slope, sigma


def _third_powers(
    known: Track, first: np.ndarray, last: np.ndarray, slope: float, made: Parabolas
) -> tuple[np.ndarray, np.ndarray]:
    """Return the correction of the slope by each flight, and its standard deviation [1/s], each (k,)."""
    own, slack = np.full(len(first), np.nan), np.full(len(first), np.nan)
    numbers = made.numbers - np.array([known.lift, 0.0, 0.0])
    given = (known.time, known.shown, known.sigma_loose, first, last, slope, made.middle, made.half, numbers)
    third_powers(*given, MOST, own, slack)
    return own, slack


def _weighted_median(values: np.ndarray, weight: np.ndarray) -> float:
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(share, 0.5 * share[-1])])


def common_law(flights: Parabolas) -> Law | None:
    """Return the deceleration that flights have in common; ``None`` without any.

    Args:
        flights: of all flights; the better known half that pass for parabolas are asked.
    """
    slowing, slack = flights.deceleration
    sane = np.flatnonzero(flights.chi2 < 3.0)
    if not len(sane):
        return None
    best = sane[np.argsort(slack[sane])][: max(len(sane) // 2, 1)]
    speed = (flights.numbers[:, 1] / flights.half)[best]
    middle, centre = float(np.median(slowing[best])), float(np.median(speed))
    slope = _between(speed - centre, slowing[best] - middle)
    rest = slowing[best] - middle - slope * (speed - centre)
    spread, own = robust_deviation(rest - np.median(rest)), float(np.median(slack[best]))
    more = max(spread**2 * (1.0 + MAD_ERROR / np.sqrt(len(best))) - own**2, 0.0)  # beyond what noise makes of one drag
    varies = 2.0 * np.sqrt(more) + LOOSE * abs(middle) + 2.0 * 1.2533 * max(spread, own) / np.sqrt(len(best))
    seen = (float(speed.min()), float(speed.max()))
    return Law(middle + float(np.median(rest)), slope, centre, varies, seen)


def _between(speed: np.ndarray, slowing: np.ndarray) -> float:
    """Return the slope of decelerations over speeds, 0 where it is not significant [1/s]."""
    if len(speed) < 12 or np.ptp(speed) == 0.0:
        return 0.0
    weight = np.ones(len(speed))
    slope = offset = spread = 0.0
    for _ in range(5):
        rows = np.stack([np.ones_like(speed), speed])
        offset, slope = np.linalg.lstsq((rows * weight).T, slowing * weight, rcond=None)[0]
        rest = slowing - offset - slope * speed
        spread = robust_deviation(rest)
        weight = np.clip(1.0 - (rest / max(6.0 * spread, 1e-300)) ** 2, 0.0, None)
    off = speed - np.average(speed, weights=weight + 1e-12)
    sigma = spread / float(np.sqrt(np.sum(weight * off**2)))
    return float(slope) if abs(slope) > SURE * sigma else 0.0
