"""Residual patterns over a coordinate, each tested against noise, and a resonance in the readings.

Bin means, the strongest order, the distance of flanks, autocorrelation; of flights: orders of an angle, ringing after
impacts, and decelerations over the place in the gap. A resonance is a frequency that exceeds the background of every
record's spectrum at any speed of the drive, as that of an encoder's mounting does; it corrupts the segmentation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.channels import BINS
from gears3d.diagnosis.evidence import Evidence, Paths, standardised_flight, standardised_flight_transpose
from gears3d.diagnosis.prediction import angle_deficit, double_integral, flight_step, grid_position
from gears3d.errors import EngineError, InputError
from gears3d.measured.noise import estimate_noise
from gears3d.scenario.models import Sensor, Sensors
from gears3d.signals import quantum, robust_deviation
from gears3d.signals.orders import off_multiples, power_at
from gears3d.simulation import simulate
from gears3d.simulation.sensors import encode

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted
    from gears3d.measured.segmentation import Track
    from gears3d.scenario import Scenario

Array = np.ndarray
# Lowest tried order; candidates have whole orders only.
LOWEST_ORDER = 0.125
# Relative distance from a multiple of a fluctuation's order within which an order counts as that, and its maximum with
# few revolutions.
NEAR_MULTIPLE, WIDEST_MULTIPLE = 0.05, 0.2
# Minimum number of records for the condition that an order shows in more than two of them.
MANY_RECORDS = 4
# Number of independent trials per order that a record resolves.
TRIALS_PER_ORDER = 2.0
# Bins over a coordinate other than an angle.
PIECES = 8
# Noise levels from the median at which values are clipped.
CLIPPED = 6.0
# Largest fraction of the sum of squares that a pattern may explain.
MOST_EXPLAINED = 1.0 - 1e-6
# Noise levels at which points of flights are clipped: curvature or ringing may be far larger than usual.
CLIPPED_FLIGHT = 60.0
# Minimum number of points of a channel.
FEWEST_POINTS = 24
# Lags in impacts at which rebounds are compared: those of a period return after a few.
LAGS = (1, 2, 3, 4)
# Ratio of the ends of a band of orders, each of which has its own flights, and orders in it at which the effect of a
# wave is computed; others are interpolated.
BAND, ORDERS_PER_BAND = 2.0, 6
# Noise of flights over the level of their residuals: start angle and speed are fitted to them.
FLIGHT_NOISE = np.sqrt(BINS / (BINS - 2.0))
# Angle of an order's wave that a bin of a flight may span: a mean over more hardly shows it.
WIDEST_BIN = np.pi
# Part of the curvature of flights beyond noise that an order must explain where it is not excluded.
ORDER_SHARE = 0.1
# Orders at most whose gains are computed again with the actual norms of cosine and sine.
RECOMPUTED = 50
# Tried frequencies [Hz], and ratio of neighbouring ones: lower ones do not ring, but repeat with the drive.
LOWEST_RINGING, HIGHEST_RINGING, RINGING_RATIO = 30.0, 250.0, 1.03
# Tried damping ratios; the lowest makes lines about as wide as their distance.
RINGING_DAMPINGS = (0.01, 0.03, 0.1)
# Relative step of the refined frequency, and ratios of the refined damping.
FREQUENCY_STEP, DAMPING_RATIOS = 0.003, (0.5, 1.0, 1.7)
NEAR_FLANK = (0.0, 0.03, 0.07, 0.12, 0.2, 0.35)
# Places in the gap, from the active to the reverse flank, between which decelerations are interpolated linearly.
GAP_KNOTS = np.array([*NEAR_FLANK, 0.5, *(1.0 - x for x in reversed(NEAR_FLANK))])
# Fraction of the largest information on the curve below which a place is skipped: few flights reach every place.
WEAKEST_PLACE = 1e-3
# Places at which the curve is evaluated.
GAP_PLACES = 201
# Fraction of the curvature of flights beyond noise that the place must explain; a correlated cause explains less.
GAP_SHARE = 0.4


def channel_of(name: str) -> str:
    """Return the channel of a structure by its name.

    >>> channel_of("contact.loss_phase"), channel_of("sensor.delay"), channel_of("flight.speed")
    ('loss', 'contact', 'flight')
    """
    own = {"contact.loss_phase": "loss", "sensor.order_drive": "drive", "impact.duration": "flight"}
    own |= dict.fromkeys(("sensor.delay", "sensor.ratio"), "contact")
    return own.get(name, name.split(".")[0])


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


def order_pattern(
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
    if len(value) < FEWEST_POINTS:
        return
    level = max(noise_level(value * sure), least)
    weight = sure / level
    rest = clipped(value, weight) * weight**2
    orders, gains, at = orders_of(angle, highest), [], 0
    for one, spacing in zip(angle, [*locked, *[0.0] * len(angle)], strict=False):
        part = slice(at, at + len(one))
        at += len(one)
        heavy = float(np.sum(weight[part] ** 2))
        if heavy > 0.0:
            gains.append(
                2.0 / heavy * power_at(one, rest[part], orders, highest) * off_fluctuation(orders, spacing, one)
            )
    yield order_structure(name, orders, gains, best_order(gains), level, float(np.sum(weight**2)), unit)


def orders_of(angle: Sequence[Array], highest: int) -> Array:
    """Return orders at the resolution of the longest record.

    angle: [rad].
    """
    return np.arange(LOWEST_ORDER, highest, 0.25 / max(*(_revolutions(one) for one in angle), 1.0))


def _revolutions(angle: Array) -> float:
    return float(np.ptp(angle)) / (2.0 * np.pi) if len(angle) else 0.0


def order_structure(
    name: str, orders: Array, gains: list[Array], best: int, level: float, heavy: float, unit: str
) -> Structure:
    """Return the selected one of many orders, with its gain without the record that shows it most.

    orders: (o,); gains: of each record with its noise level, each (o,); heavy: sum of squares of one over the noise.
    """
    own = np.array([each[best] for each in gains])
    total, seen = float(np.sum(own)), len(own)
    gain = total - float(np.max(own)) if seen > 1 else total
    alone = _false_alarm(own)
    chance = -np.expm1(0.25 * len(orders) * TRIALS_PER_ORDER * np.log1p(-min(alone, 0.5)))
    size = float(np.sqrt(max(total - 2.0 * seen, 0.0) / heavy))
    chance = float(np.clip(chance, 0.0, 1.0))
    return Structure(name, gain, chance, size, unit, float(orders[best]), total * level**2, rank=gain * level**2)


def best_order(gains: list[Array]) -> int:
    """Return the index of the order of largest gain without the record that shows it most.

    gains: (o,).
    """
    total = np.sum(gains, axis=0)
    return int(np.argmax(total - np.max(gains, axis=0) if len(gains) > 1 else total))


def _false_alarm(gains: Array) -> float:
    """Return the probability of as much gain by noise at one order in all records but those of largest gain.

    One of two or three is excluded, two of more: multiples of a fluctuation coincide at two speeds by chance.

    Source: the steps between ordered exponentials are exponentials (Rényi 1953); a gamma law of their sum's mean and
    variance.
    """
    from scipy.stats import gamma

    left_out = min(len(gains) - 1, 1 if len(gains) < MANY_RECORDS else 2)
    kept = np.sort(gains)[: len(gains) - left_out]
    steps = 2.0 / (1.0 + left_out / np.arange(1, len(kept) + 1))
    mean, variance = float(np.sum(steps)), float(np.sum(steps**2))
    return float(gamma.sf(np.sum(kept), mean**2 / variance, scale=variance / mean))


def off_fluctuation(orders: Array, spacing: float, angle: Array) -> Array:
    """Return which orders are not multiples of a fluctuation's, within the resolution of the revolutions.

    orders: (o,); angle: [rad].
    """
    turns = _revolutions(angle)
    if spacing <= 0.0 or turns <= 0.0:
        return np.ones(len(orders), bool)
    return off_multiples(orders, spacing) > np.minimum(
        np.maximum(NEAR_MULTIPLE * spacing, 1.0 / turns), WIDEST_MULTIPLE * spacing
    )


def bin_pattern(
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

    if len(value) < max(FEWEST_POINTS, 2 * pieces):
        return
    level = max(noise_level(value * sure), least)
    value, weight = clipped(value, sure / level), (sure / level) ** 2
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
        gains = [_record_gain(at, weight, value, mean, record == one) for one in each]
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


def _record_gain(at: Array, weight: Array, value: Array, curve: Array, own: Array) -> float:
    """Return the fall of chi-square in some values by a curve with a free mean."""
    heavy = np.bincount(at[own], weight[own], len(curve))
    curve = curve - np.sum(heavy * curve) / np.sum(heavy)
    pull = np.bincount(at[own], weight[own] * value[own], len(curve))
    return float(np.sum(2.0 * curve * pull - heavy * curve**2))


def flank_contrast(name: str, value: Array, sure: Array, over: Array, flank: Array) -> Iterator[Structure]:
    """Find a distance of the flanks that differs between bins over a coordinate."""
    from scipy.stats import chi2

    if len(value) < FEWEST_POINTS:
        return
    level = noise_level(value * sure)
    value, weight = clipped(value, sure / level), (sure / level) ** 2
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


def clipped(value: Array, weight: Array) -> Array:
    """Return values with outliers clipped to the limit of noise: a few of them are not a pattern.

    value: (n,); weight: (n,).

    >>> clipped(np.array([-1.0, 0.0, 1.0, 50.0]), np.ones(4)).tolist()
    [-1.0, 0.0, 1.0, 6.5]
    """
    middle = np.median(value)
    return middle + np.clip(value - middle, -CLIPPED / weight, CLIPPED / weight)


def clipped_flight(rest: Array, level: float) -> Array:
    """Return points of flights in noise levels, clipped so that none decides alone.

    rest: (n,).

    >>> clipped_flight(np.array([3.0, -900.0]), 3.0).tolist()
    [1.0, -60.0]
    """
    return np.clip(rest / level, -CLIPPED_FLIGHT, CLIPPED_FLIGHT)


def likelihood(gain: Any, rest: Array) -> Any:
    """Return twice the log-likelihood gain of a fall of the sum of squares, with the residual as noise.

    An order that explains almost all curvature of most records thus precedes one that gains more in one of them, and
    errors of which a few are far larger than most are not a pattern.

    rest: (n,).

    >>> float(round(likelihood(1.0, np.ones(1000)), 3)), float(round(likelihood(500.0, np.ones(1000)), 1))
    (1.001, 693.1)
    """
    return -len(rest) * np.log1p(-np.minimum(gain / float(rest @ rest), MOST_EXPLAINED))


def noise_level(rest: Array) -> float:
    """Return the noise level in standard deviations by the median absolute deviation.

    rest: (n,).

    >>> noise_level(np.array([-1.0, 0.0, 1.0]))
    1.4826
    """
    return max(robust_deviation(rest - np.median(rest)), 1e-3)


def autocorrelation(rest: Sequence[Array]) -> tuple[float, float, int]:
    """Return the largest autocorrelation of rebounds, its standard deviations, and its lag.

    rest: residuals of each record's impacts in the order of time, in standard deviations.

    >>> white = np.random.default_rng(3).standard_normal(400)
    >>> slow = np.convolve(white, np.ones(20), "valid")
    >>> abs(autocorrelation([white])[1]) < 4.0, autocorrelation([slow])[1] > 8.0, autocorrelation([slow])[2]
    (True, True, 1)
    """
    best = (0.0, 0.0, LAGS[0])
    for lag in LAGS:
        pairs = [(one[:-lag], one[lag:]) for one in rest if len(one) > lag]
        if not pairs:
            continue
        first, later = (np.concatenate(side) for side in zip(*pairs, strict=True))
        product, size = first * later, float(np.sqrt(np.sum(first**2) * np.sum(later**2)))
        spread = float(np.sqrt(np.sum(product**2)))
        if size > 0.0 and spread > 0.0 and float(np.sum(product)) / spread > best[1]:
            best = (float(np.sum(product)) / size, float(np.sum(product)) / spread, lag)
    return best


# A flight over a whole period of an order has the same mean deceleration as without it; its path still deviates.


def flight_order_spectrum(
    name: str, records: Sequence[Evidence], rest: Sequence[Array], angle: Sequence[Array], highest: int,
    locked: Sequence[float],
) -> Iterator[Structure]:  # fmt: skip
    """Return the strongest order of an angle in the paths of flights, with a phase of its own in each record.

    rest: by record, in standard deviations, each (f * BINS,); angle: on the fine grid of flights [rad], each (f, n);
    locked: order of the drive's fluctuation in each record, 0 without one.
    """
    if sum(len(own) for own in rest) < FEWEST_POINTS * BINS:
        return
    level, orders = noise_level(np.concatenate(rest)) * FLIGHT_NOISE, orders_of([one.ravel() for one in angle], highest)
    held = [clipped_flight(own, level) for own in rest]
    gains, total = [], np.zeros(len(orders))
    for one, own, turned, spacing in zip(records, held, angle, locked, strict=True):
        power, heavy = _in_bands(one, _flight_transpose(one, own), turned, orders, highest)
        heavy *= off_fluctuation(orders, spacing, turned)
        gains.append(np.where(heavy > 0.0, 2.0 * power / np.where(heavy > 0.0, heavy, 1.0), 0.0))
        total += heavy / level**2
    if not np.any(total > 0.0):
        return
    scores = [likelihood(gain, own) for gain, own in zip(gains, held, strict=True)]
    tried: set[int] = set()
    while (best := best_order(scores)) not in tried and len(tried) < RECOMPUTED:
        tried.add(best)
        for one, own, turned, gain, sure in zip(records, held, angle, gains, scores, strict=True):
            gain[best] = _order_gain(one, own, turned, float(orders[best])) if gain[best] > 0.0 else 0.0
            sure[best] = likelihood(gain[best], own)
    own = np.array([gain[best] for gain in gains])
    excess = np.array([float(each @ each) - len(each) / level**2 for each in held])[own > 0.0]
    if np.sum(own) > ORDER_SHARE * np.sum(excess) and np.any(own > 0.0):
        found, sure = (
            order_structure(name, orders, each, best, level, float(total[best]), "rad/s^2") for each in (gains, scores)
        )
        yield found._replace(chance=max(found.chance, sure.chance))


def _order_gain(one: Evidence, rest: Array, angle: Array, order: float) -> float:
    """Return the fall of chi-square in a record by one order of any size and phase."""
    shown = _shows_band(angle, _band(np.array(order)))
    wave = flight_response(one, np.exp(1j * order * angle))[shown].ravel()
    columns = np.column_stack([np.real(wave), np.imag(wave)])
    pull = columns.T @ rest.reshape(-1, BINS)[shown].ravel()
    return float(pull @ np.linalg.lstsq(columns.T @ columns, pull, rcond=1e-6)[0])


def _band(orders: Array) -> Array:
    return np.floor(np.log(orders / LOWEST_ORDER) / np.log(BAND)).astype(int)


def _shows_band(angle: Array, band: Array | int) -> Array:
    """Return which flights show the orders of a band: those whose bins span a small part of a period, (f,)."""
    return np.ptp(angle, axis=1) / (BINS - 1) * LOWEST_ORDER * BAND ** (band + 1) < WIDEST_BIN


def _in_bands(one: Evidence, back: Array, angle: Array, orders: Array, highest: int) -> tuple[Array, Array]:
    """Return the squared projection of flights on each order and the squared norm of its unit wave, each (o,)."""
    power, heavy, band = np.zeros(len(orders)), np.zeros(len(orders)), _band(orders)
    for each in range(int(band[-1]) + 1):
        shown, within = _shows_band(angle, each), band == each
        if not np.any(shown):
            break
        power[within] = power_at(angle[shown].ravel(), back[shown].ravel(), orders[within], highest)
        some = LOWEST_ORDER * BAND ** (each + np.linspace(0.0, 1.0, ORDERS_PER_BAND))
        own = [float(np.sum(np.abs(flight_response(one, np.exp(1j * order * angle))[shown]) ** 2)) for order in some]
        heavy[within] = np.exp(np.interp(np.log(orders[within]), np.log(some), np.log(np.maximum(own, 1e-300))))
    return power, heavy


def flight_response(one: Evidence, slowing: Array) -> Array:
    """Return the effect of decelerations on points of flights, in standard deviations, start angle and speed removed.

    slowing: (f, n) [rad/s²].
    """
    return standardised_flight(one, angle_deficit(one, slowing)).reshape(-1, BINS)


def _flight_transpose(one: Evidence, rest: Array) -> Array:
    """Return the transpose of ``flight_response``, points of flights to decelerations on the fine grid, (f, n)."""
    value = standardised_flight_transpose(one, rest)
    below, part, each = grid_position(one)
    spread = np.zeros_like(one.fine[0])
    np.add.at(spread, (each, below), (1.0 - part) * value)
    np.add.at(spread, (each, below + 1), part * value)
    count = spread.shape[1]
    response = double_integral(np.eye(count), np.ones((count, 1)))
    return flight_step(one) ** 2 * (spread @ response.T)


def post_impact_ringing(records: Sequence[Evidence], rest: Sequence[Array], sure: Array) -> Iterator[Structure]:
    """Return the strongest ringing after impacts, in proportion to the change of speed, equal in all records.

    One record is not sufficient: effects that repeat with the drive's fluctuation look like ringing there.

    rest: by record, in standard deviations, each (f * BINS,); sure: one over the standard deviation of each flight's
    deceleration [s²/rad], (f,).
    """
    from scipy.stats import chi2

    some = [(one, own) for one, own in zip(records, rest, strict=True) if len(own) and len(one.channels.impacts.time)]
    if len(some) < 2 or sum(len(own) for _, own in some) < FEWEST_POINTS * BINS:
        return
    value = np.concatenate([own for _, own in some])
    level = noise_level(value)
    value = clipped_flight(value, level)
    turns = (
        2.0
        * pi
        * LOWEST_RINGING
        * RINGING_RATIO ** np.arange(int(np.log(HIGHEST_RINGING / LOWEST_RINGING) / np.log(RINGING_RATIO)))
    )
    parts = np.split(value, np.cumsum([len(own) for _, own in some])[:-1])
    blows = [_excitation(one) for one, _ in some]

    def strongest(tried: list[tuple[float, float]]) -> tuple[float, float, float, float]:
        return max((*_ringing_gain([_ringing(one, *each) for one in blows], parts), *each) for each in tried)

    tried = [(turn, damping) for turn in turns for damping in RINGING_DAMPINGS]
    *_, turn, damping = strongest(tried)
    gain, likely, turn, _ = strongest(
        [(turn * (1.0 + k * FREQUENCY_STEP), damping * share) for k in range(-10, 11) for share in DAMPING_RATIOS]
    )
    chance = float(-np.expm1(10 * len(tried) * np.log1p(-min(float(chi2.sf(likely, 2)), 0.5))))
    size = float(np.sqrt(max(gain, 0.0) * level**2 / np.sum(sure**2)))
    yield Structure("impact.duration", gain, chance, size, "rad/s^2", float(turn) / 2.0 / pi, gain * level**2)


def _ringing_gain(waves: list[Array], parts: list[Array]) -> tuple[float, float]:
    """Return the chi-square fall of one amplitude and phase in all records but the best, and twice its log-likelihood.

    The latter is at most the former. Effects that repeat with the drive's fluctuation or with a gear's angle look like
    a ringing at one speed only.
    """
    columns = [np.column_stack([np.real(wave), np.imag(wave)]) for wave in waves]
    heavy = [own.T @ own for own in columns]
    force = [own.T @ part for own, part in zip(columns, parts, strict=True)]
    whole = np.sum(heavy, axis=0)
    if np.linalg.det(whole) <= 1e-12 * np.trace(whole) ** 2:
        return 0.0, 0.0
    sizes = np.linalg.solve(whole, np.sum(force, axis=0))
    gains = [float(2.0 * sizes @ pull - sizes @ own @ sizes) for own, pull in zip(heavy, force, strict=True)]
    likely = [likelihood(max(gain, 0.0), part) for gain, part in zip(gains, parts, strict=True)]
    gain = sum(gains) - max(gains)
    return gain, min(gain, sum(likely) - max(likely))


class _Excitation(NamedTuple):
    """Impacts of a record, and the points of its flights that respond to them.

    Args:
        apart: time since the previous impact, of each [s], (i,).
        jump: change of speed, (i,).
        last: last impact before each flight, -1 without one, (f,).
        since: time from it to the points of the flight [s], (f, BINS).
        width: averaging time of a point [s], (f, 1).
        heard: the record of the flights.
    """

    apart: Array
    jump: Array
    last: Array
    since: Array
    width: Array
    heard: Evidence


def _excitation(one: Evidence) -> _Excitation:
    """Return the impacts of a record, and the points that respond to them."""
    hits, flights = one.channels.impacts, one.channels.flights
    order = np.argsort(hits.time)
    time, jump = hits.time[order], (hits.rebound - hits.velocity)[order]
    last = np.searchsorted(time, flights.time[:, 0], side="right") - 1
    since = np.maximum(flights.time - time[np.maximum(last, 0)][:, None], 0.0)
    width = (flights.time[:, -1:] - flights.time[:, :1]) / (BINS - 1)
    return _Excitation(np.diff(time, prepend=time[0]), jump, last, since, width, one)


def _ringing(one: _Excitation, turn: float, damping: float) -> Array:
    """Return the response of flight points to the impacts of a record, without start angle and speed."""
    pole = turn * (1j - damping)
    state, now = [], 0j
    for kept, jump in zip(np.exp(pole * one.apart).tolist(), one.jump.tolist(), strict=True):
        now = now * kept + jump
        state.append(now)
    wave = np.where(one.last < 0, 0j, np.array(state)[np.maximum(one.last, 0)])[:, None] * np.exp(pole * one.since)
    return standardised_flight(one.heard, wave * np.sinc(turn * one.width / (2.0 * pi)))


class GapDeceleration(NamedTuple):
    """Decelerations over the place in the gap, in addition to a constant one in each record.

    Args:
        place: from the active flank, 0, to the reverse one, 1, (n,).
        common: of all records together [rad/s²], (n,).
        own: of each record alone; zero where its flights do not reach [rad/s²], (r, n).
        gains: fall of chi-square in each record by the common one, with its noise level, (r,).
        excess: chi-square beyond noise before, (r,).
        likely: twice the logarithm of the likelihood instead, (r,).
        level: of the noise in standard deviations.
    """

    place: Array
    common: Array
    own: Array
    gains: Array
    excess: Array
    likely: Array
    level: float


def gap_deceleration(records: Sequence[Evidence], rest: Sequence[Array]) -> GapDeceleration | None:
    """Return the deceleration over the place in the gap; ``None`` with fewer than two records that reach both flanks.

    One record is not sufficient: effects that repeat with the drive's fluctuation depend on the place there, too.

    Args:
        records: all.
        rest: residuals of the flights by record, in standard deviations, each (f * BINS,).
    """
    some = [(one, own) for one, own in zip(records, rest, strict=True) if len(own) and _reaches_both_flanks(one)]
    if len(some) < 2 or sum(len(own) for _, own in some) < FEWEST_POINTS * BINS:
        return None
    level = noise_level(np.concatenate([own for _, own in some]))
    held = [clipped_flight(own, level) for _, own in some]
    columns = [_gap_columns(one) for one, _ in some]
    heavy = [own.T @ own for own in columns]
    force = [own.T @ value for own, value in zip(columns, held, strict=True)]
    sizes = _solved(np.sum(heavy, axis=0), np.sum(force, axis=0))
    gains = np.array([2.0 * sizes @ pull - sizes @ own @ sizes for own, pull in zip(heavy, force, strict=True)])
    likely = np.array([likelihood(max(own, 0.0), value) for own, value in zip(gains, held, strict=True)])
    excess = np.array([float(value @ value) - len(value) for value in held])
    each = [level * _solved(own, pull) for own, pull in zip(heavy, force, strict=True)]
    place = np.linspace(0.0, 1.0, GAP_PLACES)
    own = np.array([np.interp(place, GAP_KNOTS, one) for one in each])
    return GapDeceleration(place, np.interp(place, GAP_KNOTS, level * sizes), own, gains, excess, likely, level)


def gap_pattern(records: Sequence[Evidence], rest: Sequence[Array]) -> Iterator[Structure]:
    """Return the deceleration over the place in the gap if it explains the curvature of flights, equal in all records.

    rest: by record, in standard deviations, each (f * BINS,).
    """
    from scipy.stats import chi2

    if (found := gap_deceleration(records, rest)) is None:
        return
    best, whole = int(np.argmax(found.gains)), float(np.sum(found.gains))
    gain = whole - float(found.gains[best])
    if gain < GAP_SHARE * (np.sum(found.excess) - found.excess[best]):
        return
    curve = found.common - np.mean(found.common)
    where, size = float(found.place[int(np.argmax(np.abs(curve)))]), float(np.sqrt(np.mean(curve**2)))
    sure = min(gain, float(np.sum(found.likely) - np.max(found.likely)))
    chance = float(chi2.sf(sure, len(GAP_KNOTS) - 1))
    square = found.level**2
    yield Structure("flight.gap", gain, chance, size, "rad/s^2", where, whole * square, rank=gain * square)


def _solved(heavy: Array, pull: Array) -> Array:
    return np.linalg.lstsq(heavy, pull, rcond=WEAKEST_PLACE)[0]


def _reaches_both_flanks(one: Evidence) -> bool:
    """Whether both flanks have impacts, so that their places are known."""
    return len(np.unique(one.channels.impacts.flank)) == 2


def _gap_columns(one: Evidence) -> Array:
    """Return the response of flight points to decelerations about each place, constant removed, (f * BINS, k)."""
    (drive, loose), hits = one.radii, one.channels.impacts
    where = drive * hits.drive - loose * hits.loose
    active, reverse = (float(np.median(where[hits.flank == side])) for side in (0, 1))
    time, angle, _ = one.fine
    at = drive * np.interp(time, one.channels.drive.time, one.channels.drive.angle) - loose * angle
    place = np.clip((at - active) / (reverse - active), 0.0, 1.0)
    made = [-flight_response(one, np.interp(place, GAP_KNOTS, hat)).ravel() for hat in np.eye(len(GAP_KNOTS))]
    columns, constant = np.stack(made, axis=1), np.sum(made, axis=0)
    return columns - np.outer(constant, constant @ columns) / max(float(constant @ constant), 1e-300)


# Tried frequencies [Hz], and ratio of neighbouring ones.
LOWEST, HIGHEST, FREQUENCY_RATIO = 20.0, 1000.0, 1.01
# Minimum number of readings per period of the highest frequency; means over as many as that allows are taken before.
READINGS_PER_PERIOD = 10.0
# Length of the stretches with averaged spectra.
SECONDS = 1.0
# Relative bandwidth of the power, at least the drive's fluctuation, of whose multiples it consists; and the frequency
# ratios, up and down, of the background.
BANDWIDTH, BACKGROUND_RATIO = 0.06, 1.6
# Minimum ratio of the power to the interpolated background, in the record that shows it least.
LEAST_RATIO = 10.0
# Minimum displacement (root mean square), relative to the backlash, that can affect a diagnosis.
SMALLEST_SHARE = 0.005
# Minimum number of records for a fixed frequency; minimum ratio of neighbouring speeds, and of the largest or fastest
# of their fluctuations to the others.
FEWEST_RECORDS, SPEED_RATIO = 3, 1.2


class Resonance(NamedTuple):
    """A frequency that exceeds the background in all records.

    Args:
        structure: as reported.
        frequency: tried [Hz], (t,).
        power: of the displacement about each of them, one row per record [m²], (r, t).
    """

    structure: Structure
    frequency: Array
    power: Array


def resonance(
    admitted: Sequence[Admitted], paths: Paths, expected: Callable[[Admitted], Track | None] | None = None
) -> Resonance | None:
    """Return the resonance of all records, if any; the expected path is by default from the rigid model."""
    expected = expected or _expected
    rigs = [one.rig for one in admitted if one.rig is not None]
    speeds = sorted(abs(rig.motion.mean) for rig in rigs)
    if len(rigs) < FEWEST_RECORDS or speeds[-1] < SPEED_RATIO ** (FEWEST_RECORDS - 1) * speeds[0]:
        return None
    first = [rig.motion.harmonics[0] for rig in rigs if rig.motion.harmonics]
    swings = [(one.frequency, one.amplitude) for one in first]
    if swings and all(max(each) < SPEED_RATIO * min(each) for each in zip(*swings, strict=True)):
        return None  # the same fluctuation at every speed makes the same motion, with the same lines
    tried = LOWEST * FREQUENCY_RATIO ** np.arange(int(np.log(HIGHEST / LOWEST) / np.log(FREQUENCY_RATIO)))
    seen = [_spectrum(one, paths.of(one), tried) for one in admitted]
    ratio, power, sure = (np.array(column) for column in zip(*seen, strict=True))
    best = int(np.argmax(ratio.min(axis=0)))
    if not np.min(ratio[:, best]) > LEAST_RATIO:
        return None
    paths_of_rig = [expected(one) for one in admitted]
    own = [np.ones(len(tried)) if known is None else _spectrum(one, known, tried)[0]
           for one, known in zip(admitted, paths_of_rig, strict=True)]  # fmt: skip
    ratio = ratio / np.maximum(own, 1.0)
    best = int(np.argmax(ratio.min(axis=0)))
    if not np.min(ratio[:, best]) > LEAST_RATIO:
        return None  # the rattle of the rig has the same lines
    size = float(np.sqrt(np.mean(power[:, best] * (1.0 - 1.0 / ratio[:, best]))))
    if size < SMALLEST_SHARE * rigs[0].rig().backlash:
        return None
    gain = float(np.sum(sure[:, best] * np.log(ratio[:, best]) ** 2))
    return Resonance(Structure("impact.duration", gain, 0.0, size, "m", float(tried[best]), gain), tried, power)


def _expected(one: Admitted) -> Track | None:
    """Return the path of a record by the rigid model; ``None`` where the model cannot run."""
    assert one.rig is not None
    try:
        return Paths().of(simulated(one, one.rig))
    except (InputError, EngineError):  # the model does not cover the rig, or its path has no information
        return None


def _spectral_means(values: Array, together: int) -> Array:
    """Return means of neighbouring values."""
    whole = len(values) // together * together
    return values[:whole].reshape(-1, together).mean(axis=1)


def _spectrum(one: Admitted, known: Track, tried: Array) -> tuple[Array, Array, Array]:
    """Return the ratio of power about each frequency to the background, that power [m²], and its precision, each (t,).

    The relative error of power over a bandwidth and a duration is the root of one over their product.
    """
    from scipy.signal import welch

    assert one.rig is not None
    together = max(int(1.0 / (known.step * READINGS_PER_PERIOD * HIGHEST)), 1)
    place = _spectral_means(known.radii[0] * known.drive - known.radii[1] * known.loose, together)
    rate = 1.0 / (known.step * together)
    turn, power = welch(place, rate, nperseg=min(int(SECONDS * rate), len(place)), detrend="linear")
    total = np.concatenate([[0.0], np.cumsum(power)]) * turn[1]
    # the strongest harmonic's frequency separates lines; weak ones are slower, but do not cause rattle
    strongest = max(one.rig.motion.harmonics, key=lambda each: each.amplitude, default=None)
    between = 0.0 if strongest is None else strongest.frequency

    def width(middle: Array) -> Array:
        return np.maximum(BANDWIDTH * middle, between)

    def about(middle: Array) -> Array:
        half = 0.5 * width(middle)
        ends = (np.interp(middle + sign * half, turn - 0.5 * turn[1], total[:-1]) for sign in (1.0, -1.0))
        return np.subtract(*ends)

    own, usual = about(tried), np.sqrt(about(tried / BACKGROUND_RATIO) * about(tried * BACKGROUND_RATIO))
    usual *= width(tried) / np.sqrt(width(tried / BACKGROUND_RATIO) * width(tried * BACKGROUND_RATIO))
    seen = tried * BACKGROUND_RATIO < 0.4 * rate
    ratio = np.where(seen, own / np.maximum(usual, 1e-300), 0.0)
    return ratio, np.where(seen, own, np.nan), width(tried) * len(place) / rate


# In records simulated of the rig alone, results of segmentation and search are errors of these methods: not a cause,
# and not a residual pattern that a cause should explain.


def simulated(one: Admitted, rig: Scenario, seed: int = 0) -> Admitted:
    """Return a simulated record of the rig, with the motion, sampling, counts and noise of the measured one."""
    columns = one.channels.columns
    time, span = columns["time_s"], float(columns["time_s"][-1] - columns["time_s"][0])
    rate = (len(time) - 1) / span
    shifted = [
        {"amplitude": f"{h.amplitude!r} rad/s", "frequency": f"{h.frequency!r} Hz",
         "phase": f"{h.phase + 2.0 * pi * h.frequency * float(time[0])!r} rad"}
        for h in rig.motion.harmonics
    ]  # fmt: skip
    run = {"run.duration": f"{span!r} s", "run.settle": "0 s", "run.output_rate": f"{rate!r} Hz", "run.seed": seed}
    made = simulate(rig.with_({**run, "motion.harmonics": shifted}), "rigid")
    drive, loose = (sensor_of(time, columns[f"theta_{gear}_rad"]) for gear in ("drive", "loose"))
    sensors = Sensors(sample_rate=rate, drive=drive, loose=loose)
    read = encode(made, sensors, seed)
    kept = {name: read.signals[name] for name in ("time_s", "theta_drive_rad", "theta_loose_rad")}
    return replace(one, channels=replace(one.channels, columns=kept), rig=rig, findings=())


def sensor_of(time: np.ndarray, angle: np.ndarray) -> Sensor:
    """Return an encoder with the counts and the noise of a record."""
    count = quantum(angle)
    white = estimate_noise(time, angle).white
    if not count:
        return Sensor(None, white)
    return Sensor(round(2.0 * pi / count), float(np.sqrt(max(white**2 - count**2 / 12.0, 0.0))))
