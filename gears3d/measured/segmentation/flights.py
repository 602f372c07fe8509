"""Where the paths of flights meet the flanks and each other."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.measured.segmentation.flanks import Flanks
from gears3d.measured.segmentation.parabolas import Parabolas
from gears3d.measured.segmentation.smoothing import Blocks, Track

if TYPE_CHECKING:
    from gears3d.measured.segmentation.drive import Steady

# Flights compared with their flank at a time.
AT_ONCE = 500
# Times at which a parabola may be compared with a flank.
POINTS = 160
# Standard deviations of a flight's distance from a flank within which the two may meet.
NEAR = 4.0
# Stride of a first search through these, and width of the second.
STRIDE, WINDOW = 4, 11


class Shafts(NamedTuple):
    """Both gears' angles as smooth functions of time, for the position of a flank at any moment.

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

        ``time``: [s], any shape; ``loose``: angle of the loose gear [rad], the same.
        """
        driven = self.drive.curve(time)
        turned = np.interp(time, self.loose[0], self.loose[1])
        low, high = self.flanks.places(time.ravel(), driven.ravel(), turned.ravel())
        place = self.radii[1] * (loose - self.origin[1]) - self.radii[0] * (driven - self.origin[0])
        return np.where(flank == 1, high.reshape(time.shape) - place, place - low.reshape(time.shape))

    def rate_sigma(self, time: np.ndarray, flank: np.ndarray, near: float) -> np.ndarray:
        """Return the standard deviation of a flank's speed [m/s], (k,).

        ``time``: [s], (k,); ``flank``: 0 active, 1 reverse, (k,); ``near``: time over which a flank is straight [s].
        """
        times = time + 0.5 * near * np.array([[-1.0], [1.0]])
        return self.flanks.rate_sigma(times, self.drive.curve(times), np.interp(times, *self.loose), flank)


def shafts(known: Track, path: Blocks, flanks: Flanks) -> Shafts:
    """Return both shafts' motion."""
    return Shafts(known.steady, np.stack([path.time, path.loose]), flanks, known.origin, known.radii)


def crossings(paths: Parabolas, where: Shafts, of: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return where the parabolas of flights cross those of the next ones, which needs no flank.

    ``of``: flights whose end is the start of the next one, (i,); ``near``: about when [s], (i,). Returns time [s],
    angles of drive and loose gear [rad], displacement and its standard deviation [m], each (i,).
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
        near: whether it comes as close as its standard deviation allows for it to meet, (k,).
    """

    time: np.ndarray
    sigma: np.ndarray
    velocity: np.ndarray
    velocity_sigma: np.ndarray
    met: np.ndarray
    near: np.ndarray

    def moving(self, where: Shafts, flank: np.ndarray, near: float) -> Touches:
        """Return the same touches, with the uncertainty of the flank's own speed in the speeds.

        The path of a flight shows whether it ends with an impact; the impact speed also depends on the flank's speed.

        ``flank``: that is touched, 0 active, 1 reverse, (k,); ``near``: time over which a flank is straight [s].
        """
        return self._replace(velocity_sigma=np.hypot(self.velocity_sigma, where.rate_sigma(self.time, flank, near)))


def meet(paths: Parabolas, where: Shafts, flank: np.ndarray, begin: np.ndarray, span: np.ndarray) -> Touches:
    """Return where parabolas meet flanks: the first zero of the gap from ``begin`` over ``span``.

    ``paths``: of the flights, (k,); ``flank``: that is met, 0 active, 1 reverse, (k,); ``begin``: [s], (k,); ``span``:
    negative for looking back [s], (k,).
    """
    if len(begin) > AT_ONCE:
        return _joined(meet, paths, where, flank, begin, span)
    step = span[:, None] / (POINTS - 1)
    at = _about(paths, where, flank, begin, step)
    time = begin[:, None] + step * at
    gap = _gap(paths, where, flank, time)
    rate = _slope(gap) / step
    closed, rows = gap <= 0.0, np.arange(len(at))
    hit = np.where(np.any(closed, axis=1), np.argmax(closed, axis=1), np.argmin(gap, axis=1))
    before = np.maximum(hit - 1, 0)
    fall = gap[rows, before] - gap[rows, hit]
    part = np.where(closed[rows, hit] & (fall > 0.0), gap[rows, hit] / np.where(fall > 0.0, fall, 1.0), 0.0)
    part = np.clip(part, -1.0, 0.0)
    bent = rate[rows, hit] + 0.5 * part * (rate[rows, hit] - rate[rows, before])  # mean rate from the zero to the hit
    down = (part < 0.0) & (bent * step[:, 0] < 0.0)
    part = np.where(down, np.clip(gap[rows, hit] / np.where(down, -bent * step[:, 0], 1.0), -1.0, 0.0), part)
    spread, slower = (column[:, 0] for column in _spread(paths, where, flank, begin, span, time[rows, hit][:, None]))
    fast = rate[rows, hit] + part * (rate[rows, hit] - rate[rows, before])
    sigma = spread / np.maximum(np.abs(fast), slower)
    sign = np.where(flank == 1, -1.0, 1.0)
    met = np.any(closed, axis=1)
    near = gap[rows, hit] < NEAR * spread
    return Touches(time[rows, hit] + part * step[:, 0], sigma, sign * fast, slower, met, near)


def leave(paths: Parabolas, where: Shafts, flank: np.ndarray, begin: np.ndarray, span: np.ndarray) -> Touches:
    """Return where parabolas leave flanks without an impact, so that gap and its rate vanish together.

    The moment taken is that at which both are least, in their standard deviations.

    ``flank``: that is left, 0 active, 1 reverse, (k,).
    """
    if len(begin) > AT_ONCE:
        return _joined(leave, paths, where, flank, begin, span)
    step = span[:, None] / (POINTS - 1)
    time = begin[:, None] + step * np.arange(POINTS)
    gap = _gap(paths, where, flank, time)
    rate = _slope(gap) / step
    spread, slower = _spread(paths, where, flank, begin, span, time)
    off = (gap / spread) ** 2 + (rate / slower) ** 2
    least, rows = np.argmin(off, axis=1), np.arange(len(time))
    close = np.sum(off < off[rows, least][:, None] + 1.0, axis=1) * np.abs(step[:, 0])
    sign = np.where(flank == 1, -1.0, 1.0)
    met = np.ones(len(time), bool)
    return Touches(time[rows, least], 0.5 * close, sign * rate[rows, least], slower[rows, least], met, met)


def _joined(
    one: Callable[..., Touches], paths: Parabolas, where: Shafts, flank: np.ndarray, begin: np.ndarray, span: np.ndarray
) -> Touches:
    """Return the touches of many flights, some at a time."""
    parts = []
    for first in range(0, len(begin), AT_ONCE):
        rows = slice(first, first + AT_ONCE)
        some = paths.some(np.arange(len(begin))[rows])
        parts.append(one(some, where, flank[rows], begin[rows], span[rows]))
    return Touches(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _about(paths: Parabolas, where: Shafts, flank: np.ndarray, begin: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return the few among ``POINTS`` times about which the gap is first closed, or least, (k, WINDOW)."""
    coarse = np.append(np.arange(0, POINTS - 1, STRIDE), POINTS - 1)
    gap = _gap(paths, where, flank, begin[:, None] + step * coarse)
    closed = gap <= 0.0
    near = coarse[np.where(closed.any(axis=1), np.argmax(closed, axis=1), np.argmin(gap, axis=1))]
    return np.clip(near - STRIDE - 2, 0, POINTS - WINDOW)[:, None] + np.arange(WINDOW)


def _slope(gap: np.ndarray) -> np.ndarray:
    """Return the change of gaps from one time to the next, exact for parabolas also at both ends, (k, g)."""
    return np.gradient(gap, axis=1, edge_order=2)


def _gap(paths: Parabolas, where: Shafts, flank: np.ndarray, time: np.ndarray) -> np.ndarray:
    return where.gap(time, paths.at(time), np.broadcast_to(flank[:, None], time.shape))


def _spread(
    paths: Parabolas, where: Shafts, flank: np.ndarray, begin: np.ndarray, span: np.ndarray, time: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the standard deviations of gap [m] and its rate [m/s] at some times, (k, g)."""
    angle, turning = paths.spread(time)
    middle = begin + span * (POINTS // 2) / (POINTS - 1)
    placed = where.flanks.sigma(middle, where.drive.curve(middle), np.interp(middle, *where.loose), flank)
    others = np.hypot(placed, where.radii[0] * where.drive.sigma)
    spread = np.hypot(where.radii[1] * angle, others[:, None])
    return spread, np.hypot(where.radii[1] * turning, where.radii[0] * where.drive.speed_sigma) + 1e-12
