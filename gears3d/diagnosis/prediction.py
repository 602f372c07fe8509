"""Predictions of the rig in each channel at the measured states, and contributions of effects to them.

One step, one flight, one impact at a time: nothing is integrated beyond a flight, as past the threshold the motion may
be chaotic, and two right simulations diverge after a few impacts. Start angle and speed of each flight, the datum of
the displacement, and the drive's mean speed and phase are nuisances of every record; they are projected out of data and
predictions. All values are in standard deviations of the data, and effects are additive.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import atan2, pi, sqrt
from typing import Any

import numpy as np

from gears3d.diagnosis.channels import Losses
from gears3d.diagnosis.deviation import deviation, wave
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.falling import held_back
from gears3d.diagnosis.followed import flown, followed_back, misread
from gears3d.diagnosis.freed import free_contact, free_drive, free_flight, speed_of
from gears3d.diagnosis.freed import without as without
from gears3d.diagnosis.torque import torque
from gears3d.effects import Code, Gate, Row

Array = np.ndarray
# Points of the two-point Gauss rule, in widths from the middle: every point of a channel is a mean over a width.
GAUSS = 0.5 / sqrt(3.0)
# Names of the channels, in the order of all stacked arrays.
CHANNELS: tuple[str, ...] = ("flight", "contact", "impact", "loss", "drive")


def residuals(one: Evidence) -> dict[str, Array]:
    """Return the data minus the prediction of the rig, by channel.

    Args:
        one: the record.
    """
    found = {name: _BASE[name](one) - added(one, one.scenario.effects, name) for name in CHANNELS}
    return {name: found[name] + added(one, one.spared, name) if one.spared else found[name] for name in CHANNELS}


def added(one: Evidence, effects: Iterable[Any], name: str) -> Array:
    """Return the contribution of effects to the prediction of a channel.

    Args:
        one: the record.
        effects: any.
        name: of the channel.
    """
    effects = list(effects)
    rows = [row for effect in effects for row in effect.rows(one.rig)]
    sensors = [effect for effect in effects if effect.place == "sensor"]
    return _ADDED[name](one, rows, sensors)


def sigmas(one: Evidence, name: str) -> Array:
    """Return the standard deviations of the points of a channel [its unit], in the order of its residuals."""
    return _SIGMA[name](one)


def rms_of(rest: Array, records: Iterable[Evidence], name: str) -> float:
    """Return the root mean square of residuals of a channel [its unit], 0 without any.

    Args:
        rest: in standard deviations, of all records, (n,).
        records: in their order.
        name: of the channel.
    """
    each = rest * np.concatenate([np.zeros(0), *(sigmas(one, name) for one in records)])
    return float(np.sqrt(np.mean(each**2))) if each.size else 0.0


def parts_of(records: Sequence[Evidence], rest: Array) -> dict[str, list[Array]]:
    """Return residuals by channel and record.

    rest: stacked channel by channel, in each record by record, (n,).
    """
    sizes = {
        "flight": [one.channels.flights.time.size for one in records],
        "contact": [len(one.channels.contacts.time) for one in records],
        "impact": [len(one.channels.impacts.time) for one in records],
        "loss": [len(one.channels.losses.time) for one in records],
        "drive": [len(one.drive.time) for one in records],
    }
    found, at = {}, 0
    for name in CHANNELS:
        found[name] = []
        for size in sizes[name]:
            found[name].append(rest[at : at + size])
            at += size
    return found


def reading_error(
    sensors: Iterable[Any], gear: str, angle: Array, speed: Array, known: dict[Any, Any] | None = None
) -> Array:
    """Return the contribution of sensor effects to the reading of one gear [rad].

    angle: [rad]; speed: [rad/s].
    """
    total = np.zeros_like(angle)
    for one in sensors:
        if one.gear == gear:
            late, which = getattr(one, "delay", None), ("drive", "loose").index(gear)
            swing = one.amplitude * wave(which, one.order, one.phase, angle, known) if late is None else -late * speed
            total = total + swing
    return total


def restitution(rows: Iterable[Row], base: float, speed: Array, flank: Array) -> Array:
    """Return the coefficient of restitution of impacts.

    speed: before the impact [m/s]; flank: 0 active, 1 reverse.
    """
    e = np.full_like(speed, base)
    for row in rows:
        if row.code == Code.IMPACT_OFFSET:
            e = e + row.p[0]
        elif row.code == Code.IMPACT_SLOPE:
            e = e + row.p[0] * np.abs(speed)
        elif row.code == Code.IMPACT_FLANK:
            e = e + np.where(flank == 0, 0.5, -0.5) * row.p[0]
    return np.clip(e, 0.0, 1.0)


def _flight_base(one: Evidence) -> Array:
    flights = one.channels.flights
    return free_flight(
        one, flights.loose + held_back(one, one.rig.drag_torque / one.rig.inertia * np.sign(one.fine[2]))
    )


def _flight_added(one: Evidence, rows: list[Row], sensors: list[Any]) -> Array:
    time, angle, speed = one.fine
    path = np.zeros_like(one.channels.flights.time)
    if not any(sensor.gear == "loose" for sensor in sensors) and not any(100 < row.code < 200 for row in rows):
        return path.ravel()
    if any(100 < row.code < 200 for row in rows):
        path = path - held_back(one, torque(rows, speed, angle, time) / one.rig.inertia)
    if any(sensor.gear == "loose" for sensor in sensors):
        fast, seen = speed[:, :: max((speed.shape[1] - 1) // (path.shape[1] - 1), 1)], one.channels.flights
        width = (seen.time[:, -1:] - seen.time[:, :1]) / (path.shape[1] - 1)
        for side in (-1.0, 1.0):
            path = path + 0.5 * reading_error(sensors, "loose", seen.loose + side * GAUSS * width * fast, fast)
    return free_flight(one, path)


def bend(one: Evidence) -> Array:
    """Return the response of flight points to a unit deceleration, without start angle and speed, (f, BINS).

    Args:
        one: the record.
    """
    time = one.channels.flights.time
    x = time - time.mean(axis=1, keepdims=True)
    return free_flight(one, -0.5 * x * x).reshape(time.shape)


def _contact_base(one: Evidence) -> Array:
    seen = one.channels.contacts
    return free_contact(one, seen.place - seen.flank * one.rig.backlash)


def _contact_added(one: Evidence, rows: list[Row], sensors: list[Any]) -> Array:
    seen, (drive, loose) = one.channels.contacts, one.radii
    if not sensors and not any(200 < row.code < 300 for row in rows):
        return np.zeros_like(seen.place)
    speed, place = speed_of(one, "contacts"), np.zeros_like(seen.place)
    for side in (-1.0, 1.0):
        ahead = side * GAUSS * seen.width * speed
        first, second = seen.drive + ahead, seen.loose + ahead * drive / loose
        known = one.kept.setdefault(("contact", side), {})
        place = place + 0.5 * deviation(rows, one.pair, first, second, seen.flank, known)
        if sensors:
            place = place + 0.5 * loose * reading_error(sensors, "loose", second, speed * drive / loose, known)
            place = place - 0.5 * drive * reading_error(sensors, "drive", first, speed, known)
    return free_contact(one, place)


def _impact_base(one: Evidence) -> Array:
    seen = one.channels.impacts
    return (seen.rebound + one.rig.restitution * seen.velocity) / impact_sigma(one)


def _impact_added(one: Evidence, rows: list[Row], sensors: list[Any]) -> Array:
    seen, base = one.channels.impacts, one.rig.restitution
    e = restitution(rows, base, seen.velocity, seen.flank)
    return (base - e) * seen.velocity / impact_sigma(one)


def impact_sigma(one: Evidence) -> Array:
    """Return the standard deviations of rebounds minus their prediction by the rig [m/s].

    Args:
        one: the record.
    """
    seen = one.channels.impacts
    return np.hypot(seen.rebound_sigma, one.rig.restitution * seen.velocity_sigma)


def _loss_base(one: Evidence) -> Array:
    """Return the minimum gap rate of the back-extrapolated flight after a loss."""
    if not len(one.channels.losses.time):
        return np.zeros(0)
    return (one.channels.losses.rate - followed_back(one, None)) / loss_sigma(one)


def _loss_added(one: Evidence, rows: list[Row], sensors: list[Any]) -> Array:
    """Return the effect of torques that change along a flight or act in contact only, and of reading errors."""
    seen = one.channels.losses
    rate = np.zeros_like(seen.time)
    if len(seen.time) and any(100 < row.code < 200 for row in rows):
        rate = followed_back(one, rows) - _late(one, rows)
    if len(seen.time) and any(sensor.gear == "loose" for sensor in sensors):
        rate = rate + misread(one, reading_error(sensors, "loose", *flown(one)))
    return rate / loss_sigma(one)


def _late(one: Evidence, rows: list[Row]) -> Array:
    """Return the speed lost by torques that act in contact only: the active flank is left later, the reverse not."""
    seen, (drive, loose) = one.channels.losses, one.radii
    if not any(100 < row.code < 200 and row.gate != Gate.ALWAYS for row in rows):
        return np.zeros_like(seen.time)
    late, hold = np.zeros_like(seen.time), np.zeros_like(seen.time)
    for _ in range(4):  # the torque changes little during the delay of the loss
        time = seen.time + late
        speed = one.motion.speed(time) * drive / loose
        more = torque(rows, speed, seen.loose, time, seen.flank) - torque(rows, speed, seen.loose, time)
        hold = np.maximum(np.where(seen.flank == 0, 1.0, -1.0) * more, 0.0) * loose / one.rig.inertia
        late = _when(seen, hold)
    g1, g2, g3 = seen.growth.T
    opened = late**2 * (g1 / 2.0 + late * (g2 / 3.0 + late * g3 / 4.0))
    held = late >= seen.span  # no contact loss within the known range
    return np.where(held, opened + (hold - late * (g1 + late * (g2 + late * g3))) * seen.span, opened)


def _when(seen: Losses, hold: Array) -> Array:
    """Return the time from the slowest opening of the gap until its acceleration reaches a value [s], (l,)."""
    low, high = np.zeros_like(hold), seen.span.copy()
    g1, g2, g3 = seen.growth.T
    for _ in range(40):
        middle = 0.5 * (low + high)
        below = middle * (g1 + middle * (g2 + middle * g3)) < hold
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.where(hold > 0.0, high, 0.0)


def loss_sigma(one: Evidence) -> Array:
    """Return the standard deviations of the rates at losses of contact [m/s].

    Args:
        one: the record.
    """
    return np.maximum(one.channels.losses.sigma, 1e-9)


def _drive_base(one: Evidence) -> Array:
    """Return the nominal motion from the start of its first harmonic on."""
    seen, claims = one.drive, one.scenario.motion.harmonics
    if not len(seen.time):
        return np.zeros(0)
    angle = one.motion.mean * seen.time
    shift = _began(one)
    for claim in claims:
        turn = 2.0 * pi * claim.frequency
        shrunk = np.sinc(claim.frequency * seen.width)
        angle = angle - shrunk * claim.amplitude / turn * np.cos(turn * (seen.time + shift) + claim.phase)
    return free_drive(one, seen.angle - angle)


def _began(one: Evidence) -> float:
    """Return the time shift of the nominal motion [s]."""
    if not len(one.motion.harmonics):
        return 0.0
    claim = one.scenario.motion.harmonics[0]
    turn = 2.0 * pi * claim.frequency
    cosine, sine, _ = min(one.motion.harmonics, key=lambda row: abs(row[2] - turn))
    behind = atan2(sine, -cosine) - claim.phase
    return float((behind + pi) % (2.0 * pi) - pi) / turn


def _drive_added(one: Evidence, rows: list[Row], sensors: list[Any]) -> Array:
    seen = one.drive
    if not len(seen.time) or (not sensors and not any(row.code == Code.MOTION_HARMONIC for row in rows)):
        return np.zeros_like(seen.angle)
    speed = speed_of(one, "drive")
    ahead = GAUSS * seen.width * speed
    behind, before = (reading_error(sensors, "drive", seen.angle + side * ahead, speed) for side in (-1.0, 1.0))
    angle = 0.5 * (behind + before)
    for row in rows:
        if row.code == Code.MOTION_HARMONIC:
            turn = 2.0 * pi * row.p[1]
            shrunk = np.sinc(row.p[1] * seen.width)
            angle = angle - shrunk * row.p[0] / turn * np.cos(turn * seen.time + row.p[2])
    return free_drive(one, angle)


_BASE = {
    "flight": _flight_base, "contact": _contact_base, "impact": _impact_base, "loss": _loss_base, "drive": _drive_base,
}  # fmt: skip
_ADDED = {
    "flight": _flight_added, "contact": _contact_added, "impact": _impact_added, "loss": _loss_added,
    "drive": _drive_added,
}  # fmt: skip
_SIGMA = {
    "flight": lambda one: one.channels.flights.sigma.ravel(), "contact": lambda one: one.channels.contacts.sigma,
    "impact": impact_sigma, "loss": loss_sigma,
    "drive": lambda one: np.full(len(one.drive.time), one.drive.sigma),
}  # fmt: skip
