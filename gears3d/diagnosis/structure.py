"""Residual patterns over a coordinate: bin means, strongest order, distance of flanks; each tested against noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from gears3d.signals import robust_deviation
from gears3d.signals.orders import off_multiples, power_at

Array = np.ndarray
# Lowest tried order; candidates have whole orders only.
LOWEST = 0.125
# Relative distance from a multiple of a fluctuation's order within which an order counts as that, and its maximum with
# few revolutions.
NEAR, WIDEST = 0.05, 0.2
# Minimum number of records for the condition that an order shows in more than two of them.
MANY = 4
# Number of independent trials per order that a record resolves.
SIDES = 2.0
# Bins over a coordinate other than an angle.
PIECES = 8
# Noise levels from the median at which values are clipped.
FAR = 6.0
# Largest fraction of the sum of squares that a pattern may explain.
MOST = 1.0 - 1e-6
# Noise levels at which points of flights are clipped: curvature or ringing may be far larger than usual.
BENDS = 60.0
# Minimum number of points of a channel.
FEWEST = 24


class Structure(NamedTuple):
    """A residual pattern of a channel.

    Args:
        name: channel and coordinate, as the contract names them.
        gain: fall of chi-square by a free curve over that coordinate, with the channel's noise level.
        chance: false alarm probability over the complete search.
        size: root mean square of the curve in the channel's unit.
        unit: of the size.
        where: order, or place of its maximum over the coordinate; NaN for a whole channel.
        worth: fall of chi-square with the stated noise.
        record: of its maximum; empty where it is reported of all together.
        rank: the part of ``worth`` without the record that shows it most, for the ranking; 0 for all.
    """

    name: str
    gain: float
    chance: float
    size: float
    unit: str
    where: float
    worth: float = 0.0
    record: str = ""
    rank: float = 0.0


def scanned(
    name: str,
    value: Array,
    sure: Array,
    angle: list[Array],
    highest: int,
    unit: str,
    locked: Sequence[float] = (),
    least: float = 0.0,
) -> Iterator[Structure]:
    """Find the strongest order of an angle, an integer or not, with a phase of its own in each record.

    The datum of an angle may differ between records and disturbances are not of whole orders, so that powers of records
    are added, not phasors. Orders are as dense as the longest record resolves. Multiples of the order of the drive's
    fluctuation are excluded in each record; of several records the one that shows an order most is excluded.

    value: in the channel's unit, (n,), records in sequence; sure: one over its standard deviation, (n,); locked: order
    of the drive's fluctuation in each record, 0 without one; least: lower limit of the errors, in standard deviations.
    """
    if len(value) < FEWEST:
        return
    level = max(level_of(value * sure), least)
    weight = sure / level
    rest = held(value, weight) * weight**2
    orders, gains, at = orders_of(angle, highest), [], 0
    for one, spacing in zip(angle, [*locked, *[0.0] * len(angle)], strict=False):
        part = slice(at, at + len(one))
        at += len(one)
        heavy = float(np.sum(weight[part] ** 2))
        if heavy > 0.0:
            gains.append(2.0 / heavy * power_at(one, rest[part], orders, highest) * apart(orders, spacing, one))
    yield strongest(name, orders, gains, best_of(gains), level, float(np.sum(weight**2)), unit)


def orders_of(angle: Sequence[Array], highest: int) -> Array:
    """Return orders at the resolution of the longest record.

    angle: [rad].
    """
    return np.arange(LOWEST, highest, 0.25 / max(*(_turns(one) for one in angle), 1.0))


def _turns(angle: Array) -> float:
    return float(np.ptp(angle)) / (2.0 * np.pi) if len(angle) else 0.0


def strongest(
    name: str, orders: Array, gains: list[Array], best: int, level: float, heavy: float, unit: str
) -> Structure:
    """Return the selected one of many orders, with its gain without the record that shows it most.

    orders: (o,); gains: of each record with its noise level, each (o,); heavy: sum of squares of one over the noise.
    """
    own = np.array([each[best] for each in gains])
    total, seen = float(np.sum(own)), len(own)
    gain = total - float(np.max(own)) if seen > 1 else total
    alone = _by_chance(own)
    chance = -np.expm1(0.25 * len(orders) * SIDES * np.log1p(-min(alone, 0.5)))
    size = float(np.sqrt(max(total - 2.0 * seen, 0.0) / heavy))
    chance = float(np.clip(chance, 0.0, 1.0))
    return Structure(name, gain, chance, size, unit, float(orders[best]), total * level**2, rank=gain * level**2)


def best_of(gains: list[Array]) -> int:
    """Return the index of the order of largest gain without the record that shows it most.

    gains: (o,).
    """
    total = np.sum(gains, axis=0)
    return int(np.argmax(total - np.max(gains, axis=0) if len(gains) > 1 else total))


def _by_chance(gains: Array) -> float:
    """Return the probability of as much gain by noise at one order in all records but those of largest gain.

    One of two or three is excluded, two of more: multiples of a fluctuation coincide at two speeds by chance.

    Source: the steps between ordered exponentials are exponentials (Rényi 1953); a gamma law of their sum's mean and
    variance.
    """
    from scipy.stats import gamma

    left_out = min(len(gains) - 1, 1 if len(gains) < MANY else 2)
    kept = np.sort(gains)[: len(gains) - left_out]
    steps = 2.0 / (1.0 + left_out / np.arange(1, len(kept) + 1))
    mean, variance = float(np.sum(steps)), float(np.sum(steps**2))
    return float(gamma.sf(np.sum(kept), mean**2 / variance, scale=variance / mean))


def apart(orders: Array, spacing: float, angle: Array) -> Array:
    """Return which orders are not multiples of a fluctuation's, within the resolution of the revolutions.

    orders: (o,); angle: [rad].
    """
    turns = _turns(angle)
    if spacing <= 0.0 or turns <= 0.0:
        return np.ones(len(orders), bool)
    return off_multiples(orders, spacing) > np.minimum(np.maximum(NEAR * spacing, 1.0 / turns), WIDEST * spacing)


def binned(
    name: str,
    value: Array,
    sure: Array,
    over: Array,
    unit: str,
    pieces: int = PIECES,
    least: float = 0.0,
    record: Array | None = None,
) -> Iterator[Structure]:
    """Find bin means over a coordinate that differ from a common mean.

    value, sure, over, record: (n,); with several records the one of largest gain is excluded; least: lower limit of the
    errors, in standard deviations.
    """
    from scipy.stats import chi2

    if len(value) < max(FEWEST, 2 * pieces):
        return
    level = max(level_of(value * sure), least)
    value, weight = held(value, sure / level), (sure / level) ** 2
    edges = np.unique(np.quantile(over, np.linspace(0.0, 1.0, pieces + 1)))
    if len(edges) < 3:
        edges = np.unique([over.min(), 0.5 * (over.min() + over.max()), over.max()])
        if len(edges) < 3:
            return
    at, count = np.clip(np.searchsorted(edges, over, side="right") - 1, 0, len(edges) - 2), len(edges) - 1
    heavy, mean = _means(at, weight, value, count)
    gain = whole = float(np.sum(heavy * mean**2))
    size = float(np.sqrt(gain / np.sum(heavy)))
    if record is not None and len(each := np.unique(record)) > 1:
        gains = [_told(at, weight, value, mean, record == one) for one in each]
        gain = sum(gains) - max(gains)
    where = int(np.argmax(np.abs(mean)))
    middle = 0.5 * (edges[where] + edges[where + 1])
    chance = float(chi2.sf(gain, len(edges) - 2))
    worth = whole * level**2
    yield Structure(name, gain, chance, size, unit, float(middle), worth, rank=gain * level**2)


def _means(at: Array, weight: Array, value: Array, count: int) -> tuple[Array, Array]:
    """Return weight and mean of each bin, minus the mean of all."""
    heavy = np.bincount(at, weight, count)
    mean = np.bincount(at, weight * value, count) / np.maximum(heavy, 1e-300)
    return heavy, mean - np.sum(heavy * mean) / np.sum(heavy)


def _told(at: Array, weight: Array, value: Array, curve: Array, own: Array) -> float:
    """Return the fall of chi-square in some values by a curve with a free mean."""
    heavy = np.bincount(at[own], weight[own], len(curve))
    curve = curve - np.sum(heavy * curve) / np.sum(heavy)
    pull = np.bincount(at[own], weight[own] * value[own], len(curve))
    return float(np.sum(2.0 * curve * pull - heavy * curve**2))


def parted(name: str, value: Array, sure: Array, over: Array, flank: Array) -> Iterator[Structure]:
    """Find a distance of the flanks that differs between bins over a coordinate."""
    from scipy.stats import chi2

    if len(value) < FEWEST:
        return
    level = level_of(value * sure)
    value, weight = held(value, sure / level), (sure / level) ** 2
    edges = np.quantile(over, np.linspace(0.0, 1.0, PIECES + 1))
    at = np.clip(np.searchsorted(edges, over, side="right") - 1, 0, PIECES - 1) + PIECES * flank
    heavy = np.bincount(at, weight, 2 * PIECES)
    mean = np.bincount(at, weight * value, 2 * PIECES) / np.maximum(heavy, 1e-300)
    (first, second), (low, high) = heavy.reshape(2, -1), mean.reshape(2, -1)
    both = (np.bincount(at, minlength=2 * PIECES).reshape(2, -1) > 1).all(axis=0)
    if np.count_nonzero(both) < 2:
        return
    apart, heavy = (high - low)[both], (first * second / (first + second))[both]
    apart = apart - np.sum(heavy * apart) / np.sum(heavy)
    gain, where = float(np.sum(heavy * apart**2)), int(np.argmax(np.abs(apart)))
    middle = float((0.5 * (edges[1:] + edges[:-1]))[both][where])
    size = float(np.sqrt(gain / np.sum(heavy)))
    yield Structure(name, gain, float(chi2.sf(gain, len(apart) - 1)), size, "m", middle, gain * level**2)


def held(value: Array, weight: Array) -> Array:
    """Return values with outliers clipped to the limit of noise: a few of them are not a pattern.

    value: (n,); weight: (n,).

    >>> held(np.array([-1.0, 0.0, 1.0, 50.0]), np.ones(4)).tolist()
    [-1.0, 0.0, 1.0, 6.5]
    """
    middle = np.median(value)
    return middle + np.clip(value - middle, -FAR / weight, FAR / weight)


def bounded(rest: Array, level: float) -> Array:
    """Return points of flights in noise levels, clipped so that none decides alone.

    rest: (n,).

    >>> bounded(np.array([3.0, -900.0]), 3.0).tolist()
    [1.0, -60.0]
    """
    return np.clip(rest / level, -BENDS, BENDS)


def likelihood(gain: Any, rest: Array) -> Any:
    """Return twice the log-likelihood gain of a fall of the sum of squares, with the residual as noise.

    An order that explains almost all curvature of most records thus precedes one that gains more in one of them, and
    errors of which a few are far larger than most are not a pattern.

    rest: (n,).

    >>> float(round(likelihood(1.0, np.ones(1000)), 3)), float(round(likelihood(500.0, np.ones(1000)), 1))
    (1.001, 693.1)
    """
    return -len(rest) * np.log1p(-np.minimum(gain / float(rest @ rest), MOST))


def level_of(rest: Array) -> float:
    """Return the noise level in standard deviations by the median absolute deviation.

    rest: (n,).

    >>> level_of(np.array([-1.0, 0.0, 1.0]))
    1.4826
    """
    return max(robust_deviation(rest - np.median(rest)), 1e-3)
