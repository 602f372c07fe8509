"""Runs of blocks in the dead band, and where the flights in them touch and leave the flanks."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.segmentation.displacement import Blocks, Kinks, Track
from gears3d.measured.segmentation.flanks import Flanks
from gears3d.measured.segmentation.parabolas import Parabolas

if TYPE_CHECKING:
    from gears3d.measured.drive_motion import Steady

# States of the loose gear; the first two are the codes of the flanks.
ACTIVE, REVERSE, FLIGHT = 0, 1, 2
# In place of a flank where the record begins or ends in flight.
CUT = -1
# Deviations of blocks in contact by which a flight must leave its flank.
CLEAR = 5.0
# Blocks from which on a run spares its first and last one, where the touch may lie.
TRIM = 5
# Flights compared with their flank at a time.
AT_ONCE = 500
# Times at which a parabola may be compared with a flank.
POINTS = 160
# Standard deviations of a flight's distance from a flank within which the two may meet.
NEAR = 4.0
# Stride of a first search through these, and width of the second.
STRIDE, WINDOW = 4, 11


class Runs(NamedTuple):
    """Runs of blocks in the dead band, each a flight or more.

    Args:
        first: first block, (k,).
        last: last block, (k,).
        left: flank before, -1 where the record begins, (k,).
        struck: flank after, -1 where it ends, (k,).
        height: greatest distance from the flank that was left [m], (k,).
    """

    first: np.ndarray
    last: np.ndarray
    left: np.ndarray
    struck: np.ndarray
    height: np.ndarray


def clearance(path: Blocks, flanks: Flanks) -> float:
    """Return the least distance of a block in flight from a flank [m]."""
    return max(CLEAR * max(flanks.rough, path.stray), path.slack)


def zones(path: Blocks, flanks: Flanks, found: Kinks, file: str = "") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return each block's zone, and its distances from the active and to the reverse flank [m], each (m,).

    Raises InputError when the noise fills the dead band.
    """
    low, high = flanks.places(path.time, path.drive, path.loose)
    above, below = path.place - low, high - path.place
    clear = clearance(path, flanks)
    narrow = float(np.min(high - low))
    if narrow < 3.0 * clear:
        what = f"is known to {1e6 * clear:.3g} um only, in a dead band of {1e6 * narrow:.3g} um at its narrowest"
        raise InputError(Fault("theta_loose_rad", what, "use an encoder with more counts, or a wider backlash", file))
    zone = np.full(len(above), FLIGHT, dtype=np.int8)
    zone[above < clear] = ACTIVE
    zone[below < clear] = REVERSE
    near = 3.0 * clear + np.abs(found.jump) * path.width  # blocks may lie to either side of a quick touch
    zone[found.at[(found.jump > 0.0) & (above[found.at] < near)]] = ACTIVE
    zone[found.at[(found.jump < 0.0) & (below[found.at] < near)]] = REVERSE
    return zone, above, below


def runs(zone: np.ndarray, above: np.ndarray, below: np.ndarray) -> Runs:
    """Return the runs of blocks in the dead band.

    ``zone``: of :func:`zones`, (m,); ``above``: distance from the active flank [m], (m,); ``below``: distance to the
    reverse flank [m], (m,).

    >>> zone = np.array([0, 2, 2, 1, 1], dtype=np.int8)
    >>> found = runs(zone, np.array([0.0, 1.0, 2.0, 3.0, 3.0]), np.array([3.0, 2.0, 1.0, 0.0, 0.0]))
    >>> [column.tolist() for column in found]
    [[1], [2], [0], [1], [2.0]]
    """
    flying = np.concatenate([[False], zone == FLIGHT, [False]])
    change = np.flatnonzero(np.diff(flying.astype(np.int8)))
    first, last = change[::2], change[1::2] - 1
    before = np.where(first > 0, zone[np.maximum(first - 1, 0)], CUT)
    after = np.where(last < len(zone) - 1, zone[np.minimum(last + 1, len(zone) - 1)], CUT)
    height = np.zeros(len(first))
    if len(first):
        both = np.stack([first, last + 1], axis=1).ravel()
        tops = [np.maximum.reduceat(np.append(gap, -np.inf), both)[::2] for gap in (above, below)]
        height = np.where(before == REVERSE, tops[1], tops[0])
    return Runs(first, last, before.astype(int), after.astype(int), height)


def touches_missed(
    zone: np.ndarray, above: np.ndarray, below: np.ndarray, found: Runs, wrong: np.ndarray, clear: float
) -> np.ndarray:
    """Return zones in which runs that are not a single parabola are split where they come closest to a flank, (m,).

    A short touch may be rounded off its flank by a block's width.

    ``zone``: so far, (m,); ``above``: distance from the active flank [m], (m,); ``below``: distance to the reverse
    flank [m], (m,); ``clear``: least distance of flight [m].

    >>> zone = np.array([0, 2, 2, 2, 2, 2, 0], dtype=np.int8)
    >>> above = np.array([0.0, 5.0, 4.0, 1.5, 4.0, 2.0, 0.0])
    >>> touches_missed(zone, above, 9.0 - above, runs(zone, above, 9.0 - above), np.array([0]), 1.0).tolist()
    [0, 2, 2, 0, 2, 2, 0]
    """
    parted = zone.copy()
    off = np.minimum(above, below)
    for k in map(int, wrong):
        inner = np.arange(int(found.first[k]) + 1, int(found.last[k]))
        low = inner[(off[inner] <= off[inner - 1]) & (off[inner] <= off[inner + 1]) & (off[inner] < 4.0 * clear)]
        if len(low):
            at = low[np.argmin(off[low])]
            parted[at] = ACTIVE if above[at] < below[at] else REVERSE
    return parted


def readings_of(found: Runs, size: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the first and last reading of each run, without the blocks where a touch may lie, each (k,)."""
    spare = (found.last - found.first + 1 >= TRIM).astype(int)
    first = (found.first + spare) * size
    last = np.minimum((found.last + 1 - spare) * size, count) - 1
    return first, last


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
