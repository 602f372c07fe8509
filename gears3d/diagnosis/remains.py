"""Residual patterns that no cause explains, and the coordinate of each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gears3d.diagnosis.channels import BINS
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.neighbours import LAGS, alike
from gears3d.diagnosis.placing import placed
from gears3d.diagnosis.prediction import CHANNELS, deceleration_response, impact_sigma, parts_of
from gears3d.diagnosis.ringing import rung
from gears3d.diagnosis.structure import FEWEST, PIECES, Structure, binned, held, level_of, parted, scanned
from gears3d.diagnosis.waving import waved

Array = np.ndarray
# Standard deviations of a contact loss that count as 100 %: errors of all other channels move it, too.
VAGUE = 1e3
# Size in units of the channel below which a pattern comes from segmentation: moments of contact loss, for example, are
# late by a fraction of their sigma.
SMALL = {"flight": 0.02, "contact": 0.002, "impact": 0.05, "loss": 1e-3, "drive": 0.002}
# Minimum ratio of an order's gain, for rebounds, to that of the pattern over one revolution; below it the order is
# attributed to that pattern.
FOREIGN = 1.5


def structures(records: Sequence[Evidence], rest: Array, highest: int) -> list[Structure]:
    """Return the residual patterns over each coordinate, those of the channel of largest residuals first.

    rest: (n,).
    """
    parts = parts_of(records, rest)
    found = [*_flight(records, parts, highest), *_contact(records, parts, highest), *_impact(records, parts, highest),
             *_loss(records, parts), *_drive(records, parts)]  # fmt: skip
    looked, units = max(len(found), 1), _units(records)
    found = [one._replace(chance=min(1.0, one.chance * looked)) for one in found]
    found = [one for one in found if one.size > SMALL[channel_of(one.name)] * units[channel_of(one.name)]]
    large: dict[str, float] = dict.fromkeys(CHANNELS, 0.0)
    for one in found:
        name = channel_of(one.name)
        large[name] = max(large[name], one.size / units[name])
    return sorted(found, key=lambda one: (-large[channel_of(one.name)], -(one.rank or one.worth)))


def channel_of(name: str) -> str:
    """Return the channel of a structure by its name.

    >>> channel_of("contact.loss_phase"), channel_of("sensor.delay"), channel_of("flight.speed")
    ('loss', 'contact', 'flight')
    """
    own = {"contact.loss_phase": "loss", "sensor.order_drive": "drive", "impact.duration": "flight"}
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


def farthest(parts: Sequence[Array]) -> int:
    """Return the index of the record of largest residuals, in standard deviations.

    >>> farthest([np.ones(3), np.zeros(0), np.full(2, -2.0)])
    2
    """
    return int(np.argmax([float(np.mean(part**2)) if part.size else 0.0 for part in parts]))


def _flight(records: Sequence[Evidence], parts: dict[str, list[Array]], highest: int) -> Iterator[Structure]:
    """Return patterns of the residual deceleration of each flight over its speed, angles, and time."""
    slow, weight, columns, flown, own = [], [], [], [], []
    for one, rest in zip(records, parts["flight"], strict=True):
        flights = one.channels.flights
        if not len(flights.time):
            continue
        shape = deceleration_response(one)
        square = np.sum(shape**2, axis=1)
        slow.append(np.sum(shape * rest.reshape(-1, BINS), axis=1) / square)
        weight.append(np.sqrt(square))
        columns.append(np.stack([one.fine[0].mean(axis=1), one.fine[2].mean(axis=1)]))
        flown.append(one)
        own.append(rest)
    if not slow:
        return
    value, sure = np.concatenate(slow), np.concatenate(weight)
    time, speed = np.concatenate(columns, axis=1)
    record = np.repeat(np.arange(len(columns)), [one.shape[1] for one in columns])
    for name, coordinate in (("flight.speed", speed), ("flight.time", time)):
        yield from binned(name, value, sure, coordinate, "rad/s^2", record=record)
    driven = [np.interp(one.fine[0], one.channels.drive.time, one.channels.drive.angle) for one in flown]
    for gear, angle in (("loose", [one.fine[1] for one in flown]), ("drive", driven)):
        yield from waved(f"flight.angle_{gear}", flown, own, angle, highest, _locked(flown, gear))
    yield from placed(records, parts["flight"])
    yield from rung(records, parts["flight"], sure)


def _locked(records: Sequence[Evidence], gear: str) -> list[float]:
    """Return the order of the drive's strongest fluctuation in each record, 0 without one.

    Rattle repeats with that one; all whole orders are multiples of a weak harmonic at order 1 of the drive.
    """
    ratio = {"drive": 1.0, "loose": records[0].radii[0] / records[0].radii[1]}[gear] if records else 1.0
    return [_strongest(one.motion.harmonics) / max(abs(one.motion.mean) * ratio, 1e-9) for one in records]


def _strongest(harmonics: Array) -> float:
    """Return the angular frequency of the harmonic of greatest speed [rad/s], 0 without any."""
    if not len(harmonics):
        return 0.0
    cosine, sine, turn = harmonics.T
    return float(turn[np.argmax(np.hypot(cosine, sine) * turn)])


def _contact(records: Sequence[Evidence], parts: dict[str, list[Array]], highest: int) -> Iterator[Structure]:
    seen = [one.channels.contacts for one in records]
    value = np.concatenate([rest * one.sigma for one, rest in zip(seen, parts["contact"], strict=True)])
    sure = np.concatenate([1.0 / one.sigma for one in seen])
    for gear in ("drive", "loose"):
        angles = [getattr(one, gear) for one in seen]
        yield from scanned(f"contact.order_{gear}", value, sure, angles, highest, "m", _locked(records, gear))
    speed = np.concatenate([one.motion.speed(one.channels.contacts.time) for one in records])
    yield from binned("sensor.delay", value, sure, speed, "m")
    time, flank = (np.concatenate([getattr(one, name) for one in seen]) for name in ("time", "flank"))
    active = flank == 0
    yield from binned("sensor.ratio", value[active], sure[active], time[active], "m")
    yield from parted("contact.time", value, sure, time, flank)


def _impact(records: Sequence[Evidence], parts: dict[str, list[Array]], highest: int) -> Iterator[Structure]:
    """Return patterns of rebounds; residuals of undetected ones are below their errors, so errors are not reduced."""
    seen = [one.channels.impacts for one in records]
    sigma = np.concatenate([impact_sigma(one) for one in records])
    value, sure = np.concatenate(parts["impact"]) * sigma, 1.0 / sigma
    speed, flank = (np.concatenate([getattr(one, name) for one in seen]) for name in ("velocity", "flank"))
    approach = np.concatenate([_approach(one) for one in records])
    record = np.repeat(np.arange(len(seen)), [len(one.time) for one in seen])
    yield from binned("impact.speed", value, sure, approach, "m/s", least=1.0, record=record)
    yield from binned("impact.flank", value, sure, flank.astype(float), "m/s", 2, 1.0, record)
    usual = float(np.median(np.abs(speed))) if len(speed) else 1.0
    share = usual / np.maximum(np.abs(speed), 1e-9)  # change of restitution at the median speed
    value, sure = np.where(flank == 0, 1.0, -1.0) * value * share, sure / share
    teeth, orders = [], []
    for gear in ("drive", "loose"):
        turns = [getattr(one, gear) for one in seen]
        over = np.mod(np.concatenate(turns), 2.0 * np.pi)
        teeth += binned("impact.tooth", value, sure, over, "m/s", 3 * PIECES, 1.0, record)
        orders += scanned(f"impact.order_{gear}", value, sure, turns, highest, "m/s", _locked(records, gear), 1.0)
    most = max((one.gain for one in teeth), default=np.inf)
    yield from [one for one in orders if one.gain > FOREIGN * most] or teeth
    yield from _wander(value, sure, [len(one.time) for one in seen])


def _approach(one: Evidence) -> Array:
    """Return approach speeds [m/s] with errors independent of those of e times speed minus rebound."""
    seen, e = one.channels.impacts, one.rig.restitution
    share = e * (seen.velocity_sigma / seen.rebound_sigma) ** 2
    return (np.abs(seen.velocity) + share * np.abs(seen.rebound)) / (1.0 + share * e)


def _wander(value: Array, sure: Array, sizes: list[int]) -> Iterator[Structure]:
    """Return the pattern of restitution that rebounds share with those shortly before them, of any origin."""
    from scipy.special import log_ndtr

    if len(value) < FEWEST:
        return
    level = max(level_of(value * sure), 1.0)
    kept = held(value, sure / level) * sure / level
    share, sigmas, lag = alike(np.split(kept - np.mean(kept), np.cumsum(sizes)[:-1]))
    size = float(np.sqrt(max(share, 0.0)) * level / np.sqrt(np.mean(sure**2)))
    gain = share * float(kept @ kept)
    yield Structure("impact.time", gain, min(1.0, len(LAGS) * float(np.exp(log_ndtr(-sigmas)))), size, "m/s",
                    float(lag), gain * level**2)  # fmt: skip


def _loss(records: Sequence[Evidence], parts: dict[str, list[Array]]) -> Iterator[Structure]:
    value = np.concatenate(parts["loss"])
    speed = np.concatenate([one.motion.speed(one.channels.losses.time) for one in records])
    record = np.repeat(np.arange(len(records)), [len(part) for part in parts["loss"]])
    yield from binned("contact.loss_phase", value, np.ones_like(value), speed, "sigma", least=1.0, record=record)


def _drive(records: Sequence[Evidence], parts: dict[str, list[Array]]) -> Iterator[Structure]:
    seen = [one.drive for one in records]
    value = np.concatenate([rest * one.sigma for one, rest in zip(seen, parts["drive"], strict=True)])
    sure = np.concatenate([np.full(len(one.time), 1.0 / one.sigma) for one in seen])
    yield from scanned("sensor.order_drive", value, sure, [one.angle for one in seen], 8, "rad")
