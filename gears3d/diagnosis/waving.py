"""Orders of an angle of a torque on gears in flight, by their effect on the paths, not on mean decelerations.

A flight over a whole period of an order has the same mean deceleration as without it; its path still deviates.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gears3d.diagnosis.channels import BINS
from gears3d.diagnosis.evidence import Evidence, standardised_flight, standardised_flight_transpose
from gears3d.diagnosis.prediction import angle_deficit, double_integral, flight_step, grid_position
from gears3d.diagnosis.structure import (
    FEWEST,
    LOWEST,
    Structure,
    apart,
    best_of,
    bounded,
    level_of,
    likelihood,
    orders_of,
    strongest,
)
from gears3d.signals.orders import power_at

Array = np.ndarray
# Ratio of the ends of a band of orders, each of which has its own flights, and orders in it at which the effect of a
# wave is computed; others are interpolated.
BAND, BETWEEN = 2.0, 6
# Noise of flights over the level of their residuals: start angle and speed are fitted to them.
FREE = np.sqrt(BINS / (BINS - 2.0))
# Angle of an order's wave that a bin of a flight may span: a mean over more hardly shows it.
LONGEST = np.pi
# Part of the curvature of flights beyond noise that an order must explain where it is not excluded.
SHARE = 0.1
# Orders at most whose gains are computed again with the actual norms of cosine and sine.
AGAIN = 50


def waved(
    name: str, records: Sequence[Evidence], rest: Sequence[Array], angle: Sequence[Array], highest: int,
    locked: Sequence[float],
) -> Iterator[Structure]:  # fmt: skip
    """Return the strongest order of an angle in the paths of flights, with a phase of its own in each record.

    rest: by record, in standard deviations, each (f * BINS,); angle: on the fine grid of flights [rad], each (f, n);
    locked: order of the drive's fluctuation in each record, 0 without one.
    """
    if sum(len(own) for own in rest) < FEWEST * BINS:
        return
    level, orders = level_of(np.concatenate(rest)) * FREE, orders_of([one.ravel() for one in angle], highest)
    held = [bounded(own, level) for own in rest]
    gains, total = [], np.zeros(len(orders))
    for one, own, turned, spacing in zip(records, held, angle, locked, strict=True):
        power, heavy = _in_bands(one, _backwards(one, own), turned, orders, highest)
        heavy *= apart(orders, spacing, turned)
        gains.append(np.where(heavy > 0.0, 2.0 * power / np.where(heavy > 0.0, heavy, 1.0), 0.0))
        total += heavy / level**2
    if not np.any(total > 0.0):
        return
    told = [likelihood(gain, own) for gain, own in zip(gains, held, strict=True)]
    tried: set[int] = set()
    while (best := best_of(told)) not in tried and len(tried) < AGAIN:
        tried.add(best)
        for one, own, turned, gain, sure in zip(records, held, angle, gains, told, strict=True):
            gain[best] = _gain(one, own, turned, float(orders[best])) if gain[best] > 0.0 else 0.0
            sure[best] = likelihood(gain[best], own)
    own = np.array([gain[best] for gain in gains])
    excess = np.array([float(each @ each) - len(each) / level**2 for each in held])[own > 0.0]
    if np.sum(own) > SHARE * np.sum(excess) and np.any(own > 0.0):
        found, sure = (
            strongest(name, orders, each, best, level, float(total[best]), "rad/s^2") for each in (gains, told)
        )
        yield found._replace(chance=max(found.chance, sure.chance))


def _gain(one: Evidence, rest: Array, angle: Array, order: float) -> float:
    """Return the fall of chi-square in a record by one order of any size and phase."""
    told = _shown(angle, _band(np.array(order)))
    wave = paths_of(one, np.exp(1j * order * angle))[told].ravel()
    columns = np.column_stack([np.real(wave), np.imag(wave)])
    pull = columns.T @ rest.reshape(-1, BINS)[told].ravel()
    return float(pull @ np.linalg.lstsq(columns.T @ columns, pull, rcond=1e-6)[0])


def _band(orders: Array) -> Array:
    return np.floor(np.log(orders / LOWEST) / np.log(BAND)).astype(int)


def _shown(angle: Array, band: Array | int) -> Array:
    """Return which flights show the orders of a band: those whose bins span a small part of a period, (f,)."""
    return np.ptp(angle, axis=1) / (BINS - 1) * LOWEST * BAND ** (band + 1) < LONGEST


def _in_bands(one: Evidence, back: Array, angle: Array, orders: Array, highest: int) -> tuple[Array, Array]:
    """Return the squared projection of flights on each order and the squared norm of its unit wave, each (o,)."""
    power, heavy, band = np.zeros(len(orders)), np.zeros(len(orders)), _band(orders)
    for each in range(int(band[-1]) + 1):
        told, within = _shown(angle, each), band == each
        if not np.any(told):
            break
        power[within] = power_at(angle[told].ravel(), back[told].ravel(), orders[within], highest)
        some = LOWEST * BAND ** (each + np.linspace(0.0, 1.0, BETWEEN))
        own = [float(np.sum(np.abs(paths_of(one, np.exp(1j * order * angle))[told]) ** 2)) for order in some]
        heavy[within] = np.exp(np.interp(np.log(orders[within]), np.log(some), np.log(np.maximum(own, 1e-300))))
    return power, heavy


def paths_of(one: Evidence, slowing: Array) -> Array:
    """Return the effect of decelerations on points of flights, in standard deviations, start angle and speed removed.

    slowing: (f, n) [rad/s²].
    """
    return standardised_flight(one, angle_deficit(one, slowing)).reshape(-1, BINS)


def _backwards(one: Evidence, rest: Array) -> Array:
    """Return the transpose of ``paths_of``, points of flights to decelerations on the fine grid, (f, n)."""
    value = standardised_flight_transpose(one, rest)
    below, part, each = grid_position(one)
    spread = np.zeros_like(one.fine[0])
    np.add.at(spread, (each, below), (1.0 - part) * value)
    np.add.at(spread, (each, below + 1), part * value)
    count = spread.shape[1]
    response = double_integral(np.eye(count), np.ones((count, 1)))
    return flight_step(one) ** 2 * (spread @ response.T)
