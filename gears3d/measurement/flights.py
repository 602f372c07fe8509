"""Where the paths of flights meet the flanks and each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.measurement.flanks import Flanks
from gears3d.measurement.parabolas import Parabolas
from gears3d.measurement.smoothing import Blocks, Track

if TYPE_CHECKING:
    from gears3d.measurement.drive import Steady

AT_ONCE = 500
"""Flights that are held against their flank at a time."""
POINTS = 160
"""Times at which a parabola is held against a flank."""


class Shafts(NamedTuple):
    """Both gears' angles as smooth functions of time, to say where a flank is at any moment.

    Args:
        drive: the motion of the drive, which is imposed and knows no impacts.
        loose: times and angles of the loose gear, only to tell its orders, (2, m).
        flanks: over both angles.
        origin: angles of drive and loose gear at which the displacement is zero [rad].
        radii: base radii [m].
    """

    drive: Steady
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
        driven = self.drive.curve(time)
        turned = np.interp(time, self.loose[0], self.loose[1])
        low, high = self.flanks.places(time.ravel(), driven.ravel(), turned.ravel())
        place = self.radii[1] * (loose - self.origin[1]) - self.radii[0] * (driven - self.origin[0])
        return np.where(flank == 1, high.reshape(time.shape) - place, place - low.reshape(time.shape))


def shafts(known: Track, path: Blocks, flanks: Flanks) -> Shafts:
    """Return both shafts' motion.

    Args:
        known: the displacement.
        path: the same in blocks.
        flanks: of the record.
    """
    return Shafts(known.steady, np.stack([path.time, path.loose]), flanks, known.origin, known.radii)


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
    one, other = paths.some(of), paths.some(of + 1)
    time = near[:, None].copy()
    step = 1e-3 * np.minimum(one.half, other.half)[:, None]
    for _ in range(6):
        apart = one.at(time) - other.at(time)
        slope = (one.at(time + step) - other.at(time + step) - apart) / step
        time = time - np.clip(apart / np.where(slope == 0.0, np.inf, slope), -100.0 * step, 100.0 * step)
    (first, _), (second, _) = one.spread(time), other.spread(time)
    angle, driven = one.at(time)[:, 0], where.drive.curve(time[:, 0])
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
    if len(begin) > AT_ONCE:
        parts = []
        for first in range(0, len(begin), AT_ONCE):
            rows = slice(first, first + AT_ONCE)
            some = paths.some(np.arange(len(begin))[rows])
            parts.append(meet(some, where, flank[rows], begin[rows], span[rows], tangent[rows]))
        return Touches(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
    grid = begin[:, None] + span[:, None] * np.linspace(0.0, 1.0, POINTS)
    side = np.broadcast_to(flank[:, None], grid.shape)
    gap = where.gap(grid, paths.at(grid), side)
    step = span[:, None] / (POINTS - 1)
    rate = np.gradient(gap, axis=1) / step
    angle, turning = paths.spread(grid)
    middle = grid[:, POINTS // 2]
    placed = where.flanks.sigma(middle, where.drive.curve(middle), np.interp(middle, *where.loose), flank)
    others = np.hypot(placed, where.radii[0] * where.drive.sigma)
    spread = np.hypot(where.radii[1] * angle, others[:, None])
    slower = np.hypot(where.radii[1] * turning, where.radii[0] * where.drive.speed_sigma) + 1e-12
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
