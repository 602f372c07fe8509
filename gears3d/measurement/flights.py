"""Flights one by one: a parabola through the loose gear's angle, and where it meets the flanks."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.measurement.flanks import Flanks
from gears3d.measurement.smoothing import Blocks, Track
from gears3d.signals import noise_of

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

POINTS = 160
"""Times at which a parabola is held against a flank."""
FEWEST = 5
"""Readings that a flight needs."""

STEADY = 0.4e-3
"""Time over which the drive's angle is averaged before it is smoothed [s]."""
LOOSE = 0.2
"""Part by which the deceleration of a short flight may always differ from that of the others."""


class Shafts(NamedTuple):
    """Both gears' angles as smooth functions of time, to say where a flank is at any moment.

    Args:
        drive: angle [rad] over time, smoothed: the drive's motion is imposed and knows no impacts.
        loose: times and angles of the loose gear, only to tell its orders, (2, m).
        flanks: over both angles.
        origin: angles of drive and loose gear at which the displacement is zero [rad].
        radii: base radii [m].
    """

    drive: CubicSpline
    loose: np.ndarray
    flanks: Flanks
    origin: tuple[float, float]
    radii: tuple[float, float]

    def gap(self, time: np.ndarray, loose: np.ndarray, flank: np.ndarray) -> np.ndarray:
        """Return the distance from a flank, above 0 in the dead band [m].

        Args:
            time: [s], any shape.
            loose: angle of the loose gear [rad], the same.
            flank: 0 active, 1 reverse, the same.
        """
        driven = self.drive(time)
        turned = np.interp(time, self.loose[0], self.loose[1])
        low, high = self.flanks.places(time.ravel(), driven.ravel(), turned.ravel())
        place = self.radii[1] * (loose - self.origin[1]) - self.radii[0] * (driven - self.origin[0])
        return np.where(flank == 1, high.reshape(time.shape) - place, place - low.reshape(time.shape))


class Parabolas(NamedTuple):
    """Parabolas through flights, over x = (t − middle)/half.

    Args:
        middle: [s], (k,).
        half: [s], (k,).
        numbers: of 1, x, x² [rad], (k, 3).
        covariance: of these [rad²], (k, 3, 3).
        chi2: per degree of freedom, NaN without any, (k,).
        readings: (k,).
    """

    middle: np.ndarray
    half: np.ndarray
    numbers: np.ndarray
    covariance: np.ndarray
    chi2: np.ndarray
    readings: np.ndarray

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return the angles at times (k, g) [rad]."""
        x = (time - self.middle[:, None]) / self.half[:, None]
        return self.numbers[:, :1] + x * (self.numbers[:, 1:2] + x * self.numbers[:, 2:])

    def spread(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the standard deviations of angle [rad] and speed [rad/s] at times (k, g)."""
        x = (time - self.middle[:, None]) / self.half[:, None]
        one, zero = np.ones_like(x), np.zeros_like(x)
        place = np.stack([one, x, x * x], axis=-1)
        speed = np.stack([zero, one, 2.0 * x], axis=-1) / self.half[:, None, None]
        found = (np.einsum("kga,kab,kgb->kg", row, self.covariance, row) for row in (place, speed))
        angle, turning = (np.sqrt(np.maximum(values, 0.0)) for values in found)
        return angle, turning

    @property
    def deceleration(self) -> tuple[np.ndarray, np.ndarray]:
        """The deceleration and its standard deviation [rad/s²], each (k,)."""
        factor = 2.0 / self.half**2
        return -factor * self.numbers[:, 2], factor * np.sqrt(self.covariance[:, 2, 2])


def shafts(known: Track, path: Blocks, flanks: Flanks) -> Shafts:
    """Return both shafts' motion; the drive's is smoothed over as many blocks as its bends allow.

    Args:
        known: the displacement.
        path: the same in blocks.
        flanks: of the record.
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import savgol_filter

    few = max(int(STEADY / path.width), 1)
    count = len(path.time) // few
    time, drive = (column[: count * few].reshape(count, few).mean(axis=1) for column in (path.time, path.drive))
    noise, smooth = noise_of(time, drive), drive
    for window in (5, 9, 17, 33, 65):
        if 4 * window > len(time) or noise <= 0.0:
            break
        tried = savgol_filter(drive, window, 3)
        rest = 1.4826 * float(np.median(np.abs(tried - drive)))
        if rest > 1.05 * noise:
            break
        smooth = tried
    smooth = np.array(smooth)
    smooth[1:-1] -= np.diff(smooth, 2) / 24.0 * (1.0 - (few * path.size) ** -2.0)  # a mean lies inside its curve
    curve = CubicSpline(time, smooth)
    origin = (float(known.drive[0]), float(known.loose[0]))
    return Shafts(curve, np.stack([path.time, path.loose]), flanks, origin, known.radii)


def fit(known: Track, first: np.ndarray, last: np.ndarray, law: tuple[float, float] | None = None) -> Parabolas:
    """Fit a parabola to each flight by weighted least squares.

    Constant deceleration is what dry friction, and any drag within one flight, comes to.

    Args:
        known: readings of the loose gear.
        first: index of each flight's first reading, (k,).
        last: index of its last one, (k,).
        law: deceleration that is expected and how much it varies [rad/s²]; short flights do not tell their own.

    Source: Rigaud & Perret-Liaudet 2020, eq. (13).
    """
    count = len(first)
    middle, half = np.zeros(count), np.ones(count)
    numbers, covariance = np.zeros((count, 3)), np.zeros((count, 3, 3))
    chi2, readings = np.full(count, np.nan), (last - first + 1).astype(float)
    for k, (begin, end) in enumerate(zip(first, last, strict=True)):
        time, angle = known.time[begin : end + 1], known.loose[begin : end + 1]
        middle[k], half[k] = 0.5 * (time[0] + time[-1]), 0.5 * (time[-1] - time[0])
        x = (time - middle[k]) / half[k]
        base = angle[len(angle) // 2]
        weight = 1.0 / known.sigma_loose[begin : end + 1]
        rows = np.stack([weight, weight * x, weight * x * x])
        normal, right = rows @ rows.T, rows @ (weight * (angle - base))
        if law is not None:
            strength = (0.5 * half[k] ** 2 * law[1]) ** -2
            normal[2, 2] += strength
            right[2] -= strength * 0.5 * half[k] ** 2 * law[0]
        size = 1.0 / np.sqrt(np.diag(normal))
        covariance[k] = np.linalg.inv(normal * np.outer(size, size)) * np.outer(size, size)
        numbers[k] = covariance[k] @ right
        rest = weight * (angle - base) - numbers[k] @ rows
        numbers[k, 0] += base
        if len(time) > 3:
            chi2[k] = float(rest @ rest) / (len(time) - 3)
    return Parabolas(middle, half, numbers, covariance, chi2, readings)


def common_law(paths: Parabolas) -> tuple[float, float] | None:
    """Return the deceleration that flights have in common and how much it varies [rad/s²]; ``None`` without any.

    Args:
        paths: of all flights; the better known half that pass for parabolas are asked.
    """
    slowing, slack = paths.deceleration
    sane = np.flatnonzero(paths.chi2 < 3.0)
    if not len(sane):
        return None
    best = sane[np.argsort(slack[sane])][: max(len(sane) // 2, 1)]
    middle = float(np.median(slowing[best]))
    varies = 1.4826 * float(np.median(np.abs(slowing[best] - middle)))
    return middle, 2.0 * varies + LOOSE * abs(middle) + 2.0 * float(np.median(slack[best]))


def crossings(paths: Parabolas, where: Shafts, of: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return where the parabolas of flights cross those of the next ones, which needs no flank.

    Args:
        paths: of all flights.
        where: both shafts.
        of: flights whose end is the start of the next one, (i,).
        near: about when [s], (i,).

    Returns:
        Time [s], angles of drive and loose gear [rad], displacement and its standard deviation [m], each (i,).
    """
    one, other = (Parabolas(*(column[k] for column in paths)) for k in (of, of + 1))
    time = near[:, None].copy()
    step = 1e-3 * np.minimum(one.half, other.half)[:, None]
    for _ in range(6):
        apart = one.at(time) - other.at(time)
        slope = (one.at(time + step) - other.at(time + step) - apart) / step
        time = time - np.clip(apart / np.where(slope == 0.0, np.inf, slope), -100.0 * step, 100.0 * step)
    (first, _), (second, _) = one.spread(time), other.spread(time)
    angle, driven = one.at(time)[:, 0], where.drive(time[:, 0])
    place = where.radii[1] * (angle - where.origin[1]) - where.radii[0] * (driven - where.origin[0])
    turned = np.interp(time[:, 0], where.loose[0], where.loose[1])
    return time[:, 0], driven, turned, place, where.radii[1] * np.hypot(first, second)[:, 0]


class Touches(NamedTuple):
    """Where parabolas meet a flank.

    Args:
        time: [s], (k,).
        sigma: of the time [s], (k,).
        velocity: of the displacement against the flank, in the displacement's sense [m/s], (k,).
        velocity_sigma: [m/s], (k,).
        met: whether the parabola meets the flank at all, (k,).
    """

    time: np.ndarray
    sigma: np.ndarray
    velocity: np.ndarray
    velocity_sigma: np.ndarray
    met: np.ndarray


def meet(
    paths: Parabolas, where: Shafts, flank: np.ndarray, begin: np.ndarray, span: np.ndarray, tangent: np.ndarray
) -> Touches:
    """Return where parabolas meet flanks, looking from ``begin`` over ``span``, which is negative for looking back.

    Across a flank the first zero of the gap counts. Where a flank is left without a blow (``tangent``) gap and its rate
    vanish together: the moment counts at which both are least in their standard deviations.

    Args:
        paths: of the flights, (k,).
        where: the flanks are.
        flank: that is met, 0 active, 1 reverse, (k,).
        begin: [s], (k,).
        span: [s], (k,).
        tangent: whether the flank was left without a blow, (k,).
    """
    grid = begin[:, None] + span[:, None] * np.linspace(0.0, 1.0, POINTS)
    side = np.broadcast_to(flank[:, None], grid.shape)
    gap = where.gap(grid, paths.at(grid), side)
    step = span[:, None] / (POINTS - 1)
    rate = np.gradient(gap, axis=1) / step
    angle, turning = paths.spread(grid)
    rough = where.flanks.rough / 3.0
    spread = np.hypot(where.radii[1] * angle, rough)
    slower = where.radii[1] * turning + 1e-12
    closed = gap <= 0.0
    rows = np.arange(len(grid))
    hit = np.where(closed.any(axis=1), np.argmax(closed, axis=1), np.argmin(gap, axis=1))
    before = np.maximum(hit - 1, 0)
    fall = gap[rows, before] - gap[rows, hit]
    part = np.where(closed[rows, hit] & (fall > 0.0), gap[rows, hit] / np.where(fall > 0.0, fall, 1.0), 0.0)
    part = np.clip(part, -1.0, 0.0)
    time = grid[rows, hit] + part * step[:, 0]
    fast = rate[rows, hit] + part * (rate[rows, hit] - rate[rows, before])
    sigma = spread[rows, hit] / np.maximum(np.abs(fast), slower[rows, hit])
    off = (gap / spread) ** 2 + (rate / slower) ** 2
    least = np.argmin(off, axis=1)
    close = np.sum(off < off[rows, least][:, None] + 1.0, axis=1) * np.abs(step[:, 0])
    time = np.where(tangent, grid[rows, least], time)
    sigma = np.where(tangent, 0.5 * close, sigma)
    fast = np.where(tangent, rate[rows, least], fast)
    sign = np.where(flank == 1, -1.0, 1.0)
    met = closed.any(axis=1) | tangent
    return Touches(time, sigma, sign * fast, slower[rows, np.where(tangent, least, hit)], met)
