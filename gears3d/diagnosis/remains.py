"""What no cause explains: structure left in the residuals, and the coordinate it lives in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.fft import next_fast_len

from gears3d.diagnosis.channels import BINS
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.neighbours import LAGS, alike
from gears3d.diagnosis.prediction import CHANNELS, bend, impact_sigma

Array = np.ndarray
LOWEST = 0.125
"""Order from which on they are looked through; candidates have whole ones only."""
FINE, PADDED = 8, 8
"""Bins to a period of the highest order, and times their number that the transform over them has."""
SIDES = 2.0
"""Orders that noise may take for the strongest, to one that a record tells apart."""
PIECES = 8
"""Bins over a coordinate that is no angle."""
VAGUE = 1e3
"""Standard deviations of a loss of contact that count as 100 %: everything that is off elsewhere moves it, too."""
SMALL = {"flight": 0.02, "contact": 0.002, "impact": 0.05, "loss": 1e-3, "drive": 0.002}
"""Size in units of the channel below which structure is the cutting's own: moments of losing contact, to name one, come
late by part of their sigma."""
FOREIGN = 1.5
"""Times what folds into a turn that an order must explain of rebounds, to be none that does."""
FAR = 6.0
"""Levels of noise from the middle at which values are held."""
FEWEST = 24
"""Points without which a channel has no structure to show."""


class Structure(NamedTuple):
    """Something left in a channel.

    Args:
        name: channel and coordinate, as the contract names them.
        gain: fall of chi-square by a free curve over that coordinate, noise of the channel taken as its level.
        chance: probability that as much comes by chance anywhere in the search.
        size: root mean square of the curve in the channel's unit.
        unit: of the size.
        where: order, or where over the coordinate it is largest; NaN for a whole channel.
        worth: fall of chi-square, the noise taken as stated.
        record: in which it is largest; empty where it is told of all together.
    """

    name: str
    gain: float
    chance: float
    size: float
    unit: str
    where: float
    worth: float = 0.0
    record: str = ""


def structures(records: Sequence[Evidence], rest: Array, highest: int) -> list[Structure]:
    """Return what is left over each coordinate, those of the channel that is farthest off first.

    Args:
        records: all.
        rest: residuals that the causes leave, stacked, (n,).
        highest: order that is looked for.
    """
    parts = _parts(records, rest)
    found = [*_flight(records, parts, highest), *_contact(records, parts, highest), *_impact(records, parts, highest),
             *_loss(records, parts), *_drive(records, parts)]  # fmt: skip
    looked, units = max(len(found), 1), _units(records)
    found = [one._replace(chance=min(1.0, one.chance * looked)) for one in found]
    found = [one for one in found if one.size > SMALL[channel_of(one.name)] * units[channel_of(one.name)]]
    large: dict[str, float] = dict.fromkeys(CHANNELS, 0.0)
    for one in found:
        name = channel_of(one.name)
        large[name] = max(large[name], one.size / units[name])
    return sorted(found, key=lambda one: (-large[channel_of(one.name)], -one.gain))


def channel_of(name: str) -> str:
    """Return the channel that a structure is seen in.

    Args:
        name: of the structure, as the contract has it.

    >>> channel_of("contact.loss_phase"), channel_of("sensor.delay"), channel_of("flight.speed")
    ('loss', 'contact', 'flight')
    """
    own = {"contact.loss_phase": "loss", "sensor.order_drive": "drive"}
    own |= dict.fromkeys(("sensor.delay", "sensor.ratio"), "contact")
    return own.get(name, name.split(".")[0])


def _units(records: Sequence[Evidence]) -> dict[str, float]:
    """Return the size of 100 % in each channel: drag, backlash, rebound, one sigma, and the angle of the backlash."""
    rig = records[0].rig
    speeds = np.concatenate([np.abs(one.channels.impacts.velocity) for one in records])
    rebound = max(rig.restitution, 0.1) * float(np.median(speeds)) if len(speeds) else 1.0
    slowing = max(rig.drag_torque / rig.inertia, 1e-6)
    angle = rig.backlash / rig.base_radius_drive
    return {"flight": slowing, "contact": rig.backlash, "impact": rebound, "loss": VAGUE, "drive": angle}


def _parts(records: Sequence[Evidence], rest: Array) -> dict[str, list[Array]]:
    """Return the residuals by channel and record."""
    sizes = {
        "flight": [one.channels.flights.time.size for one in records],
        "contact": [len(one.channels.contacts.time) for one in records],
        "impact": [len(one.channels.impacts.time) for one in records],
        "loss": [len(one.channels.losses.time) for one in records],
        "drive": [len(one.channels.drive.time) for one in records],
    }
    found, at = {}, 0
    for name in CHANNELS:
        found[name] = []
        for size in sizes[name]:
            found[name].append(rest[at : at + size])
            at += size
    return found


def _flight(records: Sequence[Evidence], parts: dict[str, list[Array]], highest: int) -> Iterator[Structure]:
    """Deceleration that each flight has left, over its speed, angles, and time."""
    slow, weight, columns = [], [], []
    for one, rest in zip(records, parts["flight"], strict=True):
        flights = one.channels.flights
        if not len(flights.time):
            continue
        x = flights.time - flights.time.mean(axis=1, keepdims=True)
        shape = bend(x, flights.sigma)
        square = np.sum(shape**2, axis=1)
        slow.append(np.sum(shape * rest.reshape(-1, BINS), axis=1) / square)
        weight.append(np.sqrt(square))
        time, angle, speed = (values.mean(axis=1) for values in one.fine)
        drive = np.interp(time, one.channels.drive.time, one.channels.drive.angle)
        columns.append(np.stack([time, angle, speed, drive]))
    if not slow:
        return
    value, sure = np.concatenate(slow), np.concatenate(weight)
    time, _, speed, _ = np.concatenate(columns, axis=1)
    for name, coordinate in (("flight.speed", speed), ("flight.time", time)):
        yield from _binned(name, value, sure, coordinate, "rad/s^2")
    for name, row in (("flight.angle_loose", 1), ("flight.angle_drive", 3)):
        yield from _scanned(name, value, sure, [one[row] for one in columns], highest, "rad/s^2")


def _contact(records: Sequence[Evidence], parts: dict[str, list[Array]], highest: int) -> Iterator[Structure]:
    seen = [one.channels.contacts for one in records]
    value = np.concatenate([rest * one.sigma for one, rest in zip(seen, parts["contact"], strict=True)])
    sure = np.concatenate([1.0 / one.sigma for one in seen])
    for gear in ("drive", "loose"):
        yield from _scanned(f"contact.order_{gear}", value, sure, [getattr(one, gear) for one in seen], highest, "m")
    speed = np.concatenate([one.motion.speed(one.channels.contacts.time) for one in records])
    yield from _binned("sensor.delay", value, sure, speed, "m")
    yield from _binned("sensor.ratio", value, sure, np.concatenate([one.time for one in seen]), "m")


def _impact(records: Sequence[Evidence], parts: dict[str, list[Array]], highest: int) -> Iterator[Structure]:
    """Rebounds; those that were not seen lie nearer to what is expected than their errors, so these are no smaller."""
    seen = [one.channels.impacts for one in records]
    sigma = np.concatenate([impact_sigma(one) for one in records])
    value, sure = np.concatenate(parts["impact"]) * sigma, 1.0 / sigma
    speed, flank = (np.concatenate([getattr(one, name) for one in seen]) for name in ("velocity", "flank"))
    yield from _binned("impact.speed", value, sure, np.abs(speed), "m/s", least=1.0)
    yield from _binned("impact.flank", value, sure, flank.astype(float), "m/s", 2, 1.0)
    usual = float(np.median(np.abs(speed))) if len(speed) else 1.0
    share = usual / np.maximum(np.abs(speed), 1e-9)  # what becomes of restitution at the usual speed
    value, sure = np.where(flank == 0, 1.0, -1.0) * value * share, sure / share
    teeth, orders = [], []
    for gear in ("drive", "loose"):
        turns = [getattr(one, gear) for one in seen]
        over = np.mod(np.concatenate(turns), 2.0 * np.pi)
        teeth += _binned("impact.tooth", value, sure, over, "m/s", 3 * PIECES, 1.0)
        orders += _scanned(f"impact.order_{gear}", value, sure, turns, highest, "m/s", 1.0)
    most = max((one.gain for one in teeth), default=np.inf)
    yield from [one for one in orders if one.gain > FOREIGN * most] or teeth
    yield from _wander(value, sure, [len(one.time) for one in seen])


def _wander(value: Array, sure: Array, sizes: list[int]) -> Iterator[Structure]:
    """Restitution that rebounds share with those shortly before them, whatever it comes from."""
    from scipy.special import log_ndtr

    if len(value) < FEWEST:
        return
    level = max(_level(value * sure), 1.0)
    held = _held(value, sure / level) * sure / level
    share, sigmas, lag = alike(np.split(held - np.mean(held), np.cumsum(sizes)[:-1]))
    size = float(np.sqrt(max(share, 0.0)) * level / np.sqrt(np.mean(sure**2)))
    gain = share * float(held @ held)
    yield Structure("impact.time", gain, min(1.0, len(LAGS) * float(np.exp(log_ndtr(-sigmas)))), size, "m/s",
                    float(lag), gain * level**2)  # fmt: skip


def _loss(records: Sequence[Evidence], parts: dict[str, list[Array]]) -> Iterator[Structure]:
    value = np.concatenate(parts["loss"])
    speed = np.concatenate([one.motion.speed(one.channels.losses.time) for one in records])
    yield from _binned("contact.loss_phase", value, np.ones_like(value), speed, "sigma", least=1.0)


def _drive(records: Sequence[Evidence], parts: dict[str, list[Array]]) -> Iterator[Structure]:
    seen = [one.channels.drive for one in records]
    value = np.concatenate([rest * one.sigma for one, rest in zip(seen, parts["drive"], strict=True)])
    sure = np.concatenate([np.full(len(one.time), 1.0 / one.sigma) for one in seen])
    yield from _scanned("sensor.order_drive", value, sure, [one.angle for one in seen], 8, "rad")


def _scanned(
    name: str, value: Array, sure: Array, angle: list[Array], highest: int, unit: str, least: float = 0.0
) -> Iterator[Structure]:
    """The strongest order of an angle, whole or not, whatever its phase in each record.

    Orders stand as close as the turns of the longest record tell them apart; errors are no smaller than ``least``
    standard deviations.
    """
    from scipy.stats import chi2

    if len(value) < FEWEST:
        return
    level = max(_level(value * sure), least)
    weight = sure / level
    rest = _held(value, weight) * weight**2
    longest = max(float(np.ptp(one)) / (2.0 * np.pi) for one in angle if len(one))
    orders = np.arange(LOWEST, highest, 0.25 / max(longest, 1.0))
    gains, at, seen = np.zeros(len(orders)), 0, 0
    for one in angle:
        part = slice(at, at + len(one))
        at += len(one)
        heavy = float(np.sum(weight[part] ** 2))
        if heavy > 0.0:
            gains += 2.0 / heavy * _power(one, rest[part], highest, orders)
            seen += 1
    best = int(np.argmax(gains))
    alone = float(chi2.sf(gains[best], 2 * seen))
    chance = -np.expm1(0.25 * len(orders) * SIDES * np.log1p(-min(alone, 0.5)))
    size = float(np.sqrt(max(gains[best] - 2.0 * seen, 0.0) / np.sum(weight**2)))
    gain, chance = float(gains[best]), float(np.clip(chance, 0.0, 1.0))
    yield Structure(name, gain, chance, size, unit, float(orders[best]), gain * level**2)


def _power(angle: Array, rest: Array, highest: int, orders: Array) -> Array:
    """Return the square of the sum of values turned back by each order, from a transform over bins of the angle."""
    width = 2.0 * np.pi / (FINE * highest)
    place = np.floor((angle - angle.min()) / width).astype(int)
    bins = int(next_fast_len(PADDED * (int(place.max()) + 1), real=True) or 1)
    found = np.abs(np.fft.rfft(np.bincount(place, rest), bins)) ** 2
    return np.interp(orders, np.arange(len(found)) * 2.0 * np.pi / (bins * width), found)


def _binned(
    name: str, value: Array, sure: Array, over: Array, unit: str, pieces: int = PIECES, least: float = 0.0
) -> Iterator[Structure]:
    """Means in bins over a coordinate, against one mean; errors are no smaller than ``least`` standard deviations."""
    from scipy.stats import chi2

    if len(value) < max(FEWEST, 2 * pieces):
        return
    level = max(_level(value * sure), least)
    value, weight = _held(value, sure / level), (sure / level) ** 2
    edges = np.unique(np.quantile(over, np.linspace(0.0, 1.0, pieces + 1)))
    if len(edges) < 3:
        edges = np.unique([over.min(), 0.5 * (over.min() + over.max()), over.max()])
        if len(edges) < 3:
            return
    at = np.clip(np.searchsorted(edges, over, side="right") - 1, 0, len(edges) - 2)
    heavy = np.bincount(at, weight, len(edges) - 1)
    mean = np.bincount(at, weight * value, len(edges) - 1) / np.maximum(heavy, 1e-300)
    mean = mean - np.sum(heavy * mean) / np.sum(heavy)
    gain = float(np.sum(heavy * mean**2))
    where = int(np.argmax(np.abs(mean)))
    middle = 0.5 * (edges[where] + edges[where + 1])
    size = float(np.sqrt(np.sum(heavy * mean**2) / np.sum(heavy)))
    yield Structure(name, gain, float(chi2.sf(gain, len(edges) - 2)), size, unit, float(middle), gain * level**2)


def _held(value: Array, weight: Array) -> Array:
    """Return values, those far from the others moved to where noise ends: a few of them make no structure."""
    middle = np.median(value)
    return middle + np.clip(value - middle, -FAR / weight, FAR / weight)


def _level(rest: Array) -> float:
    """Return the level of the noise in standard deviations, from the middle of the distribution."""
    return max(1.4826 * float(np.median(np.abs(rest - np.median(rest)))), 1e-3)
