"""Predictions of the rig in each channel at the measured states, and contributions of effects to them.

One step, one flight, one impact at a time: nothing is integrated beyond a flight, as past the threshold the motion may
be chaotic, and two right simulations diverge after a few impacts. Start angle and speed of each flight, the datum of
the displacement, and the drive's mean speed and phase are nuisances of every record; they are projected out of data and
predictions. All values are in standard deviations of the data, and effects are additive.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from math import atan2, cos, pi, sin, sqrt
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from scipy.optimize import brentq

from gears3d.diagnosis.channels import Losses
from gears3d.diagnosis.evidence import (
    Evidence,
    drive_speed,
    standardised_contact,
    standardised_drive,
    standardised_flight,
)
from gears3d.diagnosis.evidence import project_out as project_out
from gears3d.effects import Code, Gate, Row
from gears3d.gears import ToothDeviation, quasi_static
from gears3d.measured.drive_motion import Smoothing
from gears3d.measured.segmentation.parabolas import bend

if TYPE_CHECKING:
    from gears3d.gears import Pair
    from gears3d.measured.segmentation import Track

Array = np.ndarray
# Rounds in which the error of an encoder at a gear's angle is found from its reading; each has n·A of the rest before.
READING_ROUNDS = 2
# Readings of a mean up to which their rounding is computed; least part of them, over that of even rounding, that are
# rounded by 0.4 counts and more; distance of windows in time [s], longer than any record.
MOST_READINGS, EVENLY, AWAY = 64, 0.8, 1e5
# Points of the two-point Gauss rule, in widths from the middle: every point of a channel is a mean over a width.
GAUSS = 0.5 / sqrt(3.0)
# Names of the channels, in the order of all stacked arrays.
CHANNELS: tuple[str, ...] = ("flight", "contact", "impact", "loss", "drive")
# Thickness, relative to the backlash, at which the gap of a tooth next to loaded teeth is computed, and the negative
# thickness of a tooth that can no longer touch [m].
THICK, THIN = 0.95, 1e-3
# Gap of a tooth that never comes near [m].
NEVER = 1.0
# Thickness of a tooth with a negligible deviation [m].
NEGLIGIBLE = 1e-6
# Range of a tooth's influence to either side, in pitches, and number of points over it.
REACH, INFLUENCE_POINTS = 2.25, 289
Gear = Literal["drive", "loose"]
Side = Literal["active", "reverse"]
GEARS: tuple[Gear, Gear] = ("drive", "loose")
SIDES: tuple[Side, Side] = ("active", "reverse")


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
    sensors: Iterable[Any], gear: str, angle: Array, speed: Array, known: dict[Any, Any] | None = None, *,
    true: bool = False,
) -> Array:  # fmt: skip
    """Return the contribution of sensor effects to the reading of one gear [rad].

    angle: as read, or, if ``true``, that of the gear [rad]; speed: [rad/s].
    """
    which, own = ("drive", "loose").index(gear), [one for one in sensors if one.gear == gear]
    waves = [one for one in own if not hasattr(one, "delay")]
    both = [[wave(which, one.order, one.phase - by, angle, known) for by in (0.0, 0.5 * pi)] for one in waves]
    late = sum((one.delay for one in own if hasattr(one, "delay")), 0.0)
    total = sum((one.amplitude * cosine for one, (cosine, _) in zip(waves, both, strict=True)), np.zeros_like(angle))
    for _ in range(READING_ROUNDS if waves and not true else 0):  # the gear is behind its reading by the error
        by = [one.order * total for one in waves]
        total = sum(
            (one.amplitude * (cosine * np.cos(off) + sine * np.sin(off))
             for one, (cosine, sine), off in zip(waves, both, by, strict=True)), np.zeros_like(angle),
        )  # fmt: skip
    return total - late * speed if late else total


class Unfollowed:
    """What the drive's curves do not follow of the errors of its encoder: they are smooth, and drawn through readings.

    Args:
        tracks: of the records.
        record: of each window, (w,).
        time: of the nodes [s], (w, nodes).
        drive: angle of the drive there by the curves [rad], and two derivatives, (w, nodes) each.
    """

    def __init__(self, tracks: Sequence[Track], record: Array, time: Array, drive: Sequence[Array]) -> None:
        self._tracks, self._record, self._time, self._drive = tracks, record, time, drive
        self._curves: list[tuple[Smoothing, Array]] = []
        self._known: dict[int, Array] = {}

    def of(self, order: int) -> Array:
        """Return exp(i·order·angle) less what the curves follow of it, and two derivatives, (3, w, nodes)."""
        if order not in self._known:
            self._known[order] = self._made(order)
        return self._known[order]

    def _made(self, order: int) -> Array:
        for one in self._tracks[len(self._curves) :]:
            smoothing = Smoothing(one.readings[0], one.steady)
            self._curves.append((smoothing, one.steady.curve(smoothing.time)))
        angle, speed, rate = self._drive
        turn = np.exp(1j * order * angle)
        made = np.array([turn, 1j * order * speed * turn, (1j * order * rate - (order * speed) ** 2) * turn])
        for k in np.unique(self._record).tolist():
            smoothing, seen = self._curves[k]
            curve, own = smoothing(np.exp(1j * order * seen)), self._record == k
            for n in range(3):
                made[n, own] -= curve(self._time[own], n)
        return made.astype(np.complex64)


def errors_of(tracks: Sequence[Track], record: Array, time: Array) -> tuple[Array, Array, Array]:
    """Return errors of the drive's curves at the nodes [rad], and two derivatives, by one standard deviation.

    Of each parameter of a record's harmonics, (m, w, nodes) each; records may have different numbers of them.

    Args:
        tracks: of the records.
        record: of each window, (w,).
        time: of the nodes [s], (w, nodes).
    """
    made = []
    for order in range(3):
        own = [tracks[k].steady.curve.errors(at, order) for k, at in zip(record, time, strict=True)]
        most = max(map(len, own), default=0)
        rows = [np.concatenate([one, np.zeros((most - len(one), time.shape[1]))]) for one in own]
        made.append(np.array(rows).reshape(len(time), most, time.shape[1]).transpose(1, 0, 2))
    return made[0], made[1], made[2]


class Rounding:
    """Rounding of the loose gear's readings to counts in windows, which the trajectory determines.

    Where the gear passes equal parts of a count between samples, or the fluctuation is locked to the rotation, these
    errors repeat: they are not noise, and causes would explain them.

    Args:
        tracks: of the records.
        seen: windows whose readings are rounded: number, times [s] and displacements [m] of all readings.
        radius: base radius of the loose gear [m].
        window, time, read: of the means, (n,).
    """

    def __init__(
        self, tracks: Sequence[Track], seen: Iterable[tuple[int, Array, Array]], radius: float, window: Array,
        time: Array, read: Array,
    ) -> None:  # fmt: skip
        self._counts = [radius * (one.readings[1].quantum or 0.0) for one in tracks]
        self._window, self._means, self._read = window, time, read
        count, made = np.bincount(window), [(np.zeros(0, dtype=int), np.zeros(0), np.zeros(0))]
        first = np.searchsorted(window, np.arange(len(count)))
        for number, at, place in seen:
            size = len(at) // count[number]
            if size <= MOST_READINGS:  # in means of more it averages out
                mean = np.repeat(first[number] + np.arange(count[number]), size)
                made.append((mean, at[: len(mean)], place[: len(mean)]))
        self._mean, self._time, self._place = (np.concatenate(columns) for columns in zip(*made, strict=True))

    def removed(self, made: Array, record: Array) -> Array:
        """Return the means of readings [m] without the part of their rounding that predictions explain, (n,).

        made: prediction of each mean [m]; record: of each.
        """
        read, window, every = self._read.copy(), self._window, self._mean
        first, last = (np.searchsorted(window, window[every], side) for side in ("left", "right"))
        at = np.clip(self._time, self._means[first], self._means[last - 1]) + AWAY * window[every]
        off = self._place - np.interp(at, self._means + AWAY * window, made)
        for k in np.unique(record[every]).tolist():
            own, means, step = record[every] == k, record == k, self._counts[k]
            wrong = off[own] - step * np.round(off[own] / step)
            if np.mean(np.abs(wrong) > 0.4 * step) < EVENLY * 0.2:  # the trajectory determines no rounding
                continue
            mean, rest = np.bincount(every[own], wrong, len(read))[means], (read - made)[means]
            mean /= np.maximum(np.bincount(every[own], minlength=len(read))[means], 1)
            calm = np.abs(rest) < step
            part = float(mean[calm] @ rest[calm]) / max(float(mean[calm] @ mean[calm]), 1e-300)
            read[means] -= np.clip(part, 0.0, 1.0) * mean
        return read


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


# Smallest and largest scatter of a restitution that a rig can have; most impacts are clipped at the largest, and a
# larger one looks the same.
LEAST_SCATTER, MOST_SCATTER = 1e-6, 1.0


def untruncated(spread: float, mean: float) -> tuple[float, float]:
    """Return the standard deviation of a normal restitution of which 0 to 1 is seen, and its slope over what is seen.

    spread: root mean square deviation from the mean within 0 to 1; mean: of all.

    >>> [round(one, 3) for one in untruncated(0.05, 0.5)]
    [0.05, 1.0]
    """
    from scipy.stats import truncnorm

    def seen(size: float) -> float:
        return size * sqrt(float(truncnorm.moment(2, -mean / size, (1.0 - mean) / size)))

    spread = max(spread, LEAST_SCATTER)
    able = spread < seen(MOST_SCATTER)
    found: Any = brentq(lambda one: seen(one) - spread, LEAST_SCATTER, MOST_SCATTER) if able else MOST_SCATTER
    size, step = float(found), 1e-3 * float(found)
    return size, step / max(seen(size + 0.5 * step) - seen(size - 0.5 * step), 1e-3 * step)


def _flight_base(one: Evidence) -> Array:
    flights = one.channels.flights
    return standardised_flight(
        one, flights.loose + angle_deficit(one, one.rig.drag_torque / one.rig.inertia * np.sign(one.fine[2]))
    )


def _flight_added(one: Evidence, rows: list[Row], sensors: list[Any]) -> Array:
    time, angle, speed = one.fine
    path = np.zeros_like(one.channels.flights.time)
    if not any(sensor.gear == "loose" for sensor in sensors) and not any(100 < row.code < 200 for row in rows):
        return path.ravel()
    if any(100 < row.code < 200 for row in rows):
        path = path - angle_deficit(one, torque(rows, speed, angle, time) / one.rig.inertia)
    if any(sensor.gear == "loose" for sensor in sensors):
        fast, seen = speed[:, :: max((speed.shape[1] - 1) // (path.shape[1] - 1), 1)], one.channels.flights
        width = (seen.time[:, -1:] - seen.time[:, :1]) / (path.shape[1] - 1)
        for side in (-1.0, 1.0):
            path = path + 0.5 * reading_error(sensors, "loose", seen.loose + side * GAUSS * width * fast, fast)
    return standardised_flight(one, path)


def deceleration_response(one: Evidence) -> Array:
    """Return the response of flight points to a unit deceleration, without start angle and speed, (f, BINS).

    Args:
        one: the record.
    """
    time = one.channels.flights.time
    x = time - time.mean(axis=1, keepdims=True)
    return standardised_flight(one, -0.5 * x * x).reshape(time.shape)


def _contact_base(one: Evidence) -> Array:
    seen = one.channels.contacts
    return standardised_contact(one, seen.place - seen.flank * one.rig.backlash)


def _contact_added(one: Evidence, rows: list[Row], sensors: list[Any]) -> Array:
    seen, (drive, loose) = one.channels.contacts, one.radii
    if not sensors and not any(200 < row.code < 300 for row in rows):
        return np.zeros_like(seen.place)
    speed, place = drive_speed(one, "contacts"), np.zeros_like(seen.place)
    for side in (-1.0, 1.0):
        ahead = side * GAUSS * seen.width * speed
        first, second = seen.drive + ahead, seen.loose + ahead * drive / loose
        known = one.cache.setdefault(("contact", side), {})
        place = place + 0.5 * deviation(rows, one.pair, first, second, seen.flank, known)
        if sensors:
            place = place + 0.5 * loose * reading_error(sensors, "loose", second, speed * drive / loose, known)
            place = place - 0.5 * drive * reading_error(sensors, "drive", first, speed, known)
    return standardised_contact(one, place)


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
    return (one.channels.losses.rate - back_extrapolated_rate(one, None)) / loss_sigma(one)


def _loss_added(one: Evidence, rows: list[Row], sensors: list[Any]) -> Array:
    """Return the effect of torques that change along a flight or act in contact only, and of reading errors."""
    seen = one.channels.losses
    rate = np.zeros_like(seen.time)
    if len(seen.time) and any(100 < row.code < 200 for row in rows):
        rate = back_extrapolated_rate(one, rows) - _late_loss(one, rows)
    if len(seen.time) and any(sensor.gear == "loose" for sensor in sensors):
        rate = rate + misread_rate(one, reading_error(sensors, "loose", *loss_paths(one)))
    return rate / loss_sigma(one)


def _late_loss(one: Evidence, rows: list[Row]) -> Array:
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
        late = _time_of_acceleration(seen, hold)
    g1, g2, g3 = seen.growth.T
    opened = late**2 * (g1 / 2.0 + late * (g2 / 3.0 + late * g3 / 4.0))
    held = late >= seen.span  # no contact loss within the known range
    return np.where(held, opened + (hold - late * (g1 + late * (g2 + late * g3))) * seen.span, opened)


def _time_of_acceleration(seen: Losses, hold: Array) -> Array:
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
    shift = _nominal_shift(one)
    for claim in claims:
        turn = 2.0 * pi * claim.frequency
        shrunk = np.sinc(claim.frequency * seen.width)
        angle = angle - shrunk * claim.amplitude / turn * np.cos(turn * (seen.time + shift) + claim.phase)
    return standardised_drive(one, seen.angle - angle)


def _nominal_shift(one: Evidence) -> float:
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
    speed = drive_speed(one, "drive")
    ahead = GAUSS * seen.width * speed
    behind, before = (reading_error(sensors, "drive", seen.angle + side * ahead, speed) for side in (-1.0, 1.0))
    angle = 0.5 * (behind + before)
    for row in rows:
        if row.code == Code.MOTION_HARMONIC:
            turn = 2.0 * pi * row.p[1]
            shrunk = np.sinc(row.p[1] * seen.width)
            angle = angle - shrunk * row.p[0] / turn * np.cos(turn * seen.time + row.p[2])
    return standardised_drive(one, angle)


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


def double_integral(values: Array, step: Array) -> Array:
    """Return the double integral of an acceleration from rest, with linear interpolation, (f, n).

    values: (f, n); step: (f, 1).

    >>> double_integral(np.full((1, 3), 2.0), np.ones((1, 1))).tolist()
    [[0.0, 1.0, 4.0]]
    """
    rate, total = np.zeros_like(values), np.zeros_like(values)
    rate[:, 1:] = np.cumsum(0.5 * (values[:, 1:] + values[:, :-1]) * step, axis=1)
    total[:, 1:] = np.cumsum(rate[:, :-1] * step + step**2 * (values[:, :-1] / 3.0 + values[:, 1:] / 6.0), axis=1)
    return total


def angle_deficit(one: Evidence, slowing: Array) -> Array:
    """Return the angle deficit of flights at their points by decelerations [rad], (f, BINS).

    slowing: on the fine grid of flights, real or complex [rad/s²], (f, n).
    """
    if not len(one.at):
        return np.zeros_like(one.at)
    total = double_integral(slowing, flight_step(one))
    below, part, each = grid_position(one)
    return (1.0 - part) * total[each, below] + part * total[each, below + 1]


def flight_step(one: Evidence) -> Array:
    """Return the step of each flight's fine grid [s], (f, 1)."""
    time = one.fine[0]
    return (time[:, -1:] - time[:, :1]) / (time.shape[1] - 1)


def grid_position(one: Evidence) -> tuple[Array, Array, Array]:
    """Return the fine points before those of the flights, the fraction to the next one, and the flight of each."""
    below = np.clip(one.at.astype(int), 0, one.fine[0].shape[1] - 2)
    return below, one.at - below, np.arange(len(below))[:, None]


# A torque that changes along a flight makes its path deviate from a parabola, and an error of the encoder does so to
# its readings. The parabola through the readings of the flight is then wrong at contact loss, which precedes the first
# of them: by a speed that looks like a late loss.


def back_extrapolated_rate(one: Evidence, rows: Iterable[Row] | None) -> Array:
    """Return the effect of torques in flight on the minimum gap rate of the parabola [m/s], (l,).

    Parabolas with a deceleration that follows the speed fit no constant torque: then the drag of the rig counts, too;
    ``None`` as rows stands for it.
    """
    seen, after = one.channels.losses, one.channels.losses.after
    step, (angle, speed) = _loss_step(one), loss_paths(one)
    drag = one.rig.drag_torque * np.sign(speed)
    resists = drag if rows is None else torque(rows, speed, angle, seen.time[:, None] + after)
    return _parabola_rate(one, double_integral(-resists / one.rig.inertia, step))


def misread_rate(one: Evidence, wrong: Array) -> Array:
    """Return the effect of reading errors along flights on the minimum gap rate [m/s], (l,).

    Flanks are estimated from the same readings, and so have the reading error at contact loss.

    wrong: added to the loose gear's readings at the times of its flights [rad], (l, n).
    """
    step = _loss_step(one)
    rate = np.gradient(wrong, axis=1, edge_order=2)[:, 0] / step[:, 0]
    seen = one.channels.losses
    drawn = one.rig.base_radius_loose * np.where(seen.flank == 0, rate, -rate)
    return _parabola_rate(one, wrong) - drawn


def loss_paths(one: Evidence) -> tuple[Array, Array]:
    """Return angle [rad] and speed [rad/s] of the loose gear along the flights that follow losses, each (l, n)."""
    if "flown" not in one.cache:
        seen = one.channels.losses
        one.cache["flown"] = seen.loose[:, None] + seen.ahead, np.gradient(seen.ahead, axis=1) / _loss_step(one)
    return one.cache["flown"]


def _loss_step(one: Evidence) -> Array:
    """Return the step of the times along flights [s], (l, 1)."""
    after = one.channels.losses.after
    return (after[:, -1:] - after[:, :1]) / (after.shape[1] - 1)


def _parabola_rate(one: Evidence, path: Array) -> Array:
    """Return the gap rate at the loss by the parabola through a path from the first reading on [m/s], (l,).

    path: (l, n) [rad].
    """
    if "parabola" not in one.cache:
        one.cache["parabola"] = _rate_weights(one)
    off = np.einsum("lg,lg->l", one.cache["parabola"], path)
    return one.rig.base_radius_loose * np.where(one.channels.losses.flank == 0, off, -off)


def _rate_weights(one: Evidence) -> Array:
    """Return the weights of points of a path in its rate at the loss by the fitted parabola [1/s], (l, n)."""
    seen, after = one.channels.losses, one.channels.losses.after
    middle = 0.5 * (seen.begun + after[:, -1])[:, None]
    half = after[:, -1:] - middle
    x, change = (after - middle) / half, seen.curved[:, None] * half
    bent, rate = bend(x, change)
    basis = np.stack([np.ones_like(x), x, bent], axis=-1) * (after >= seen.begun[:, None])[..., None]
    wanted = np.stack([np.zeros_like(rate[:, 0]), np.ones_like(rate[:, 0]), rate[:, 0]], axis=-1) / half
    normal = np.einsum("lga,lgb->lab", basis, basis)  # singular with fewer than three readings
    numbers = np.linalg.pinv(normal, rcond=1e-12, hermitian=True) @ wanted[..., None]
    return (basis @ numbers)[..., 0]


def deviation(
    rows: Iterable[Row],
    pair: Pair,
    drive: Array,
    loose: Array,
    flank: Array,
    known: dict[Any, Any] | None = None,
) -> Array:
    """Return the displacement by effects of the loose gear on a flank [m].

    A single tooth counts by the contact of rolling gears (:func:`influence`). The cache ``known`` holds the shapes at
    exactly these points.

    drive: (n,) [rad]; loose: (n,) [rad]; flank: (n,).

    >>> from gears3d.effects.rows import flank_harmonic
    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(3.5e-3, 30)
    >>> row = flank_harmonic(0, 1, 0, -2e-5, 0.0)
    >>> deviation([row], Pair.from_backlash(gear, gear, 1e-4), np.zeros(2), np.zeros(2), np.array([0, 1])).tolist()
    [0.0, 2e-05]
    """
    total = np.zeros_like(drive)
    for row in rows:
        p = row.p
        if not 200 < row.code < 300:
            continue
        own = drive if p[0] == 0 else loose
        if row.code == Code.FLANK_HARMONIC:
            total = total + (p[3] if p[1] == 0 else -p[3]) * (flank == p[1]) * wave(p[0], p[2], p[4], own, known)
        elif row.code == Code.FLANK_ECCENTRIC:
            total = total + _eccentric_deviation(pair, p[0], p[1], own + p[2], flank)
        elif row.code == Code.FLANK_TOOTH:
            total = total + _tooth_deviation(row, pair, own, flank, known)
    return total


def _eccentric_deviation(pair: Pair, gear: float, offset: float, angle: Array, flank: Array) -> Array:
    """Return the displacement by eccentric teeth [m]: exact, by the contact of two involutes at another distance.

    The line of centres turns by an angle, and the pressure angle changes. First order: offset·sin(angle ± αw).

    angle: of the offset to the line of centres [rad], (n,).
    """
    base = pair.drive.base_radius + pair.loose.base_radius
    along, across = pair.centre_distance - offset * np.cos(angle), offset * np.sin(angle)
    unwound = np.sqrt(np.maximum(along**2 + across**2 - base**2, 0.0)) / base  # tan αw at this distance
    before = np.tan(pair.working_pressure_angle)
    wider = (unwound - np.arctan(unwound)) - (before - np.arctan(before))
    return base * (np.where(gear == 0, 1.0, -1.0) * np.arctan2(across, along) - np.where(flank == 0, 1.0, -1.0) * wider)


def wave(gear: float, order: float, phase: float, angle: Array, known: dict[Any, Any] | None = None) -> Array:
    """Return the cosine of an order of a gear's angle; the cache ``known`` is for exactly these points.

    gear: 0 drive, 1 loose; phase: [rad]; angle: [rad], (n,).

    >>> wave(0, 2, np.pi / 2.0, np.array([np.pi / 4.0]), {}).round(9).tolist()
    [-1.0]
    """
    if known is None:
        return np.cos(order * angle + phase)
    if (key := ("wave", gear, order)) not in known:
        known[key] = np.cos(order * angle), np.sin(order * angle)
    cosine, sine = known[key]
    return cos(phase) * cosine - sin(phase) * sine if phase else cosine


def _tooth_deviation(row: Row, pair: Pair, own: Array, flank: Array, known: dict[Any, Any] | None) -> Array:
    """Return the effect of a tooth on its flank, 0 on the other [m]."""
    key = ("tooth", *row.p[:4])
    if known is not None and key in known:
        return known[key]
    gear: Gear = "drive" if row.p[0] == 0 else "loose"
    side: Side = "active" if row.p[1] == 0 else "reverse"
    mine, shape = np.flatnonzero(flank == row.p[1]), np.zeros_like(own)
    shape[mine] = over_tooth(pair, gear, row.p[2], side, row.p[3], own[mine])
    if known is not None:
        known[key] = shape
    return shape


def over_tooth(pair: Pair, gear: Gear, tooth: float, side: Side, thickness: float, own: Array) -> Array:
    """Return the effect of a tooth on the displacement [m].

    thickness: deviation [m]; own: angle of its gear [rad], (n,).
    """
    angle, moved = influence(pair, gear, side, thickness)
    return np.interp(2.0 * pi * pitches_from(pair, gear, tooth, own), angle, moved, left=0.0, right=0.0)


def pitches_from(pair: Pair, gear: Gear, tooth: float, own: Array) -> Array:
    """Return the pitches from a tooth's place in mesh to the gear's angle, up to half a revolution to either side.

    own: (n,) [rad].

    >>> from gears3d.gears import Gear, Pair
    >>> pair = Pair.from_backlash(Gear(3.5e-3, 30), Gear(3.5e-3, 30), 1e-4)
    >>> pitches_from(pair, "drive", 2, np.array([0.0, 2.0 * pi / 30])).round(9).tolist()
    [-1.0, 0.0]
    """
    teeth = pair.gear(gear).teeth
    return (np.mod(own - (tooth - 1.0) * 2.0 * pi / teeth + pi, 2.0 * pi) - pi) * teeth / (2.0 * pi)


def influence(pair: Pair, gear: Gear, side: Side, thickness: float) -> tuple[Array, Array]:
    """Return the effect of a tooth on the displacement [m], over its gear's angle times its teeth.

    Rigid gears touch at the pair of teeth with the largest centre distance. A tooth with a positive thickness deviation
    is that pair wherever its nominal gap is less than the deviation, before and behind its place in mesh, too; with a
    negative deviation the gears approach by the deviation, or to contact with the edges of the neighbouring teeth,
    whichever is less.

    thickness: deviation [m].
    """
    at, here, gap, depth = _single_tooth_gap(pair, gear, side)
    sign = 1.0 if side == "active" else -1.0
    if thickness > 0.0:
        moved = sign * np.maximum(thickness - np.interp(at + _advance(pair, gear, sign * thickness), here, gap), 0.0)
    else:
        moved = -sign * np.minimum(-thickness, depth)
    if gear == "drive":
        return at, moved
    behind = (pair.backlash if side == "reverse" else 0.0) + moved
    return at + behind / pair.loose.base_radius * pair.loose.teeth, moved


def _advance(pair: Pair, gear: Gear, thickness: float) -> float:
    """Return the advance of a flank with a positive deviation on the drive, times its teeth [rad]."""
    return thickness / pair.drive.base_radius * pair.drive.teeth if gear == "drive" else 0.0


@lru_cache(maxsize=64)
def _single_tooth_gap(pair: Pair, gear: Gear, side: Side) -> tuple[Array, Array, Array, Array]:
    """Return the gap of one tooth next to loaded teeth over its own angle, and the approach without that tooth [m].

    Angles are of the drive, times its teeth: first those of the approach, then those of the gap.
    """
    at = 2.0 * pi * np.linspace(-REACH, REACH, INFLUENCE_POINTS)
    size, column = THICK * pair.backlash, 0 if side == "active" else 1
    true = _imposed_displacement(pair)[column]
    out = np.abs(_imposed_displacement(pair.with_deviations(ToothDeviation(gear, side, 1, size)))[column] - true)
    thin = (ToothDeviation(gear, flank, 1, -THIN) for flank in ("active", "reverse"))
    back = np.abs(_imposed_displacement(pair.with_deviations(*thin))[column] - true)
    here = at + _advance(pair, gear, size if side == "active" else -size)
    return at, here, np.where(out > 1e-3 * size, size - out, NEVER), np.where(back > 1e-12, back, 0.0)


@lru_cache(maxsize=32)
def _imposed_displacement(pair: Pair) -> tuple[Array, Array]:
    """Return the displacement imposed by the active and the reverse flank about tooth 1 [m]."""
    found = quasi_static(pair, 2.0 * pi * np.linspace(-REACH, REACH, INFLUENCE_POINTS) / pair.drive.teeth)
    return found.phi_active, found.phi_reverse


def torque(rows: Iterable[Row], speed: Array, angle: Array, time: Array, flank: Array | None = None) -> Array:
    """Return the resisting torque of effects on a rotating loose gear [N·m].

    speed: [rad/s]; angle: [rad]; time: [s]; flank: 0 active, 1 reverse, ``None`` in flight.

    >>> from gears3d.effects.rows import torque_linear
    >>> torque([torque_linear(2.0, 1.0)], np.array([3.0]), np.zeros(1), np.zeros(1)).tolist()
    [4.0]
    """
    total = np.zeros_like(speed)
    for row in rows:
        if 100 < row.code < 200 and row.code != Code.TORQUE_FRICTION:
            total = total + _gated(row.gate, flank) * _torque_value(row, speed, angle, time)
    return total


def _gated(gate: int, flank: Array | None) -> Array | float:
    if gate == Gate.ALWAYS:
        return 1.0
    if flank is None:
        return float(gate == Gate.FLIGHT)
    if gate == Gate.FLIGHT:
        return 0.0
    return 1.0 if gate == Gate.CONTACT else np.where(flank == gate - Gate.ACTIVE, 1.0, 0.0)


def _torque_value(row: Row, speed: Array, angle: Array, time: Array) -> Array:
    p, dry = row.p, np.sign(speed)
    if row.code == Code.TORQUE_CONSTANT:
        return p[0] * dry
    if row.code == Code.TORQUE_LINEAR:
        return p[0] * (speed - p[1])
    if row.code == Code.TORQUE_POWER:
        return p[0] * np.abs(speed) ** p[1] * dry
    if row.code == Code.TORQUE_HARMONIC:
        return p[1] * np.cos(p[0] * angle + p[2])
    if row.code == Code.TORQUE_RELAX:
        return p[0] * -np.expm1(-time / p[1]) * dry
    if row.code == Code.TORQUE_CARRIED:  # its spring has no torque of its own
        return 0.0 * speed
    points = np.array(row.table)
    return np.interp((speed, angle, time)[int(p[0])], points[:, 0], points[:, 1])
