"""The channels of a measured record: flights, contact, impacts, contact losses, the drive's motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.diagnosis import blows
from gears3d.diagnosis.coloured import Slow
from gears3d.diagnosis.leaving import leaving
from gears3d.measured.segmentation.kinks import kinks
from gears3d.measured.segmentation.zones import clearance

if TYPE_CHECKING:
    from gears3d.measured.segmentation.segments import Segments

Array = np.ndarray

# Points of a flight.
BINS = 12
# Approximate number of contact points of a record.
CONTACT = 4000
# Approximate number of points of the drive's motion of a record.
DRIVE = 4000
# Largest movement, in its noise, over this many blocks before and after, of a point off both flanks that counts as
# contact.
STILL, BESIDE = 6.0, 4
# Ratio of the error that the contact-loss rates of a record have in common to their standard deviation.
COMMON = 0.3
# Largest common rounding of path corners, relative to the noise; blocks are as long as that allows.
ROUNDED = 1.0
# Standard deviations between the ends of a flight and its points.
CLEAR = 4.0


class Flights(NamedTuple):
    """Angle of the loose gear in flight, each flight in bins of equal duration, (f, BINS).

    Args:
        time: [s].
        loose: [rad].
        sigma: standard deviation of ``loose`` [rad].
    """

    time: Array
    loose: Array
    sigma: Array


class Contacts(NamedTuple):
    """Displacement in contact, (c,).

    Args:
        time: [s].
        drive: angle [rad].
        loose: angle [rad].
        flank: 0 active, 1 reverse.
        place: displacement, with an arbitrary datum [m].
        sigma: standard deviation of ``place`` [m].
        width: averaging time of each [s].
    """

    time: Array
    drive: Array
    loose: Array
    flank: Array
    place: Array
    sigma: Array
    width: Array


class Impacts(NamedTuple):
    """Impacts with a rebound, (i,).

    Args:
        time: [s].
        drive: angle [rad].
        loose: angle [rad].
        flank: 0 active, 1 reverse.
        velocity: towards the flank, before [m/s].
        velocity_sigma: [m/s].
        rebound: after [m/s].
        rebound_sigma: [m/s].
        seen: whether the rebound was detected; otherwise it is the expected value under scatter of restitution.
    """

    time: Array
    drive: Array
    loose: Array
    flank: Array
    velocity: Array
    velocity_sigma: Array
    rebound: Array
    rebound_sigma: Array
    seen: Array


class Losses(NamedTuple):
    """Contact losses without an impact, (l,), by the flights that follow (:mod:`gears3d.diagnosis.leaving`).

    Args:
        time: of the slowest opening of the gap of the back-extrapolated flight [s].
        drive: angle [rad].
        loose: angle [rad].
        flank: of the contact loss, 0 active, 1 reverse.
        rate: of the gap at that time, 0 where contact and flight have the same torques [m/s].
        sigma: of the rate [m/s].
        growth: of the gap's acceleration after that time, by powers of time [m/s³, ...], (l, 3).
        span: time after that until which this holds [s].
        after: times after that, to the last reading of the flight [s], (l, n).
        ahead: angle that the loose gear has turned by then [rad], (l, n).
        begun: time after that of the flight's first reading [s].
        curved: change of the deceleration with the loose gear's speed in the back-extrapolation [1/s].
    """

    time: Array
    drive: Array
    loose: Array
    flank: Array
    rate: Array
    sigma: Array
    growth: Array
    span: Array
    after: Array
    ahead: Array
    begun: Array
    curved: Array


class Drive(NamedTuple):
    """Angle of the drive gear, averaged over equal times, (d,).

    Args:
        time: [s].
        angle: [rad].
        sigma: standard deviation of each [rad].
        width: averaging time of each [s].
    """

    time: Array
    angle: Array
    sigma: float
    width: float


class Partings(NamedTuple):
    """Ends of contacts of any type, (p,).

    Args:
        drive: angle [rad].
        loose: angle [rad].
        flank: of the contact, 0 active, 1 reverse.
    """

    drive: Array
    loose: Array
    flank: Array


class Corners(NamedTuple):
    """Sharp reversals of the path, at an estimated flank or not, (k,).

    Args:
        drive: angle [rad].
        loose: angle [rad].
        flank: at which it reverses, 0 active, 1 reverse.
        off: distance from the estimated flank [m].
        sigma: standard deviation of ``off`` [m].
    """

    drive: Array
    loose: Array
    flank: Array
    off: Array
    sigma: Array


class Channels(NamedTuple):
    """The channels of one record.

    Args:
        flights: angles in flight.
        contacts: displacement in contact.
        impacts: speeds before and after.
        losses: contact losses without an impact.
        drive: its motion.
        left_out: number of excluded points by channel.
        partings: ends of contacts.
        blows: impacts with and without a detected rebound.
        corners: of the path.
        slow: 1/f noise, in addition to the standard deviations of the points.
    """

    flights: Flights
    contacts: Contacts
    impacts: Impacts
    losses: Losses
    drive: Drive
    left_out: dict[str, int]
    blows: blows.Blows = blows.none()
    partings: Partings = Partings(np.zeros(0), np.zeros(0), np.zeros(0, int))
    corners: Corners = Corners(np.zeros(0), np.zeros(0), np.zeros(0, int), np.zeros(0), np.zeros(0))
    slow: Slow = Slow()


def channels(cut: Segments) -> Channels:
    """Return the channels of a measured record; points that fail their noise test are excluded and counted."""
    (flights, few), (losses, stray) = _flights(cut), _losses(cut)
    impacts, silent = _impacts(cut)
    contacts, moving = _contacts(cut)
    corners, beside = _corners(cut)
    contacts = Contacts(*(np.append(one, more) for one, more in zip(contacts, beside, strict=True)))
    left_out = {"flight": few, "loss": stray, "impact": silent, "contact": moving}
    partings = Partings(*_angles(cut, cut.contacts["end_s"]), cut.contacts["flank"].astype(int))
    drive, loose = cut.track.models
    slow = Slow(cut.track.model.flicker, drive.flicker, loose.flicker)
    return Channels(
        flights, contacts, impacts, losses, _drive(cut), left_out, blows.blows(cut), partings, corners, slow
    )


def nothing() -> Channels:
    """Return channels without a point, of a record that could not be segmented."""
    none, bins = np.zeros(0), np.zeros((0, BINS))
    losses = Losses(none, none, none, none, none, none, np.zeros((0, 3)), none, bins, bins, none, none)
    contacts, impacts = Contacts(*[none] * len(Contacts._fields)), Impacts(*[none] * len(Impacts._fields))
    return Channels(Flights(bins, bins, bins), contacts, impacts, losses, Drive(none, none, 1.0, 0.0), {})


def _flights(cut: Segments) -> tuple[Flights, int]:
    known, table = cut.track, cut.flights
    spacing = float(np.median(np.diff(known.time)))
    first = table["start_s"] + CLEAR * np.minimum(table["start_sigma_s"], 1e-3) + spacing
    last = table["end_s"] - CLEAR * np.minimum(table["end_sigma_s"], 1e-3) - spacing
    begin, stop = np.searchsorted(known.time, first), np.searchsorted(known.time, last)
    good = (table["testifies"] == 1) & (stop - begin >= 2 * BINS)
    columns = []
    for a, b in zip(begin[good], stop[good], strict=True):
        edges = np.linspace(0, b - a, BINS + 1).astype(int)
        size = np.diff(edges)
        time, loose, square = (
            np.add.reduceat(x[a:b], edges[:-1]) / size for x in (known.time, known.loose, known.sigma_loose**2)
        )
        columns.append((time, loose, np.sqrt(square / size)))
    shape = (len(columns), BINS)
    made = [np.array([row[k] for row in columns]).reshape(shape) for k in range(3)]
    return Flights(*made), int(np.count_nonzero(~good))


def _contacts(cut: Segments) -> tuple[Contacts, int]:
    """Return means over neighbouring blocks well within contacts, each of the nearer flank.

    A tooth with a positive thickness deviation holds the gear away from the estimated flanks unless they include it;
    flights that begin or end there are not detected as flights, but they move.
    """
    path, table = cut.path, cut.contacts
    lasts = table["end_s"] - table["start_s"]
    spare = np.minimum(np.maximum(0.15 * lasts, 2.0 * path.width), 0.4 * lasts)
    first = np.searchsorted(path.time, table["start_s"] + spare)
    stop = np.searchsorted(path.time, table["end_s"] - spare)
    total = int(np.sum(np.maximum(stop - first, 0)))
    few = max(total // CONTACT, 1)
    spans = [a + np.arange(max(b - a, 0) // few * few) for a, b in zip(first, stop, strict=True)]
    at = np.concatenate([*spans, np.zeros(0, int)]).reshape(-1, few)
    time, drive, loose, place = (values[at].mean(axis=1) for values in (path.time, path.drive, path.loose, path.place))
    side = np.repeat(table["flank"].astype(int), [len(span) // few for span in spans])
    resting = np.ones(len(time), bool)
    if cut.flanks.gap is not None and len(time):
        flanks = np.stack(cut.flanks.places(time, drive, loose))
        off = np.abs(place - flanks)
        side = np.argmin(off, axis=0)
        ends = [path.place[np.clip(at[:, 0] + k * BESIDE, 0, len(path.place) - 1)] for k in (-1, 1)]
        still = np.abs(ends[1] - ends[0]) < STILL * np.maximum(path.noise, path.slack)
        known = bool(path.shapes) and all(shape.known for shape in path.shapes)  # no other cause holds the gear away
        resting = (off.min(axis=0) < clearance(path, cut.flanks)) | (still & (not known))
    sigma = max(path.noise / np.sqrt(few), path.slack, 1e-12)
    width = path.time[at[:, -1]] - path.time[at[:, 0]] + path.width
    made = Contacts(time, drive, loose, side, place, np.full(len(time), sigma), width)
    return Contacts(*(column[resting] for column in made)), int(np.sum(~resting))


def _corners(cut: Segments) -> tuple[Corners, Contacts]:
    """Return the corners of the path, and as contact those on a single tooth that the flank estimate includes.

    A tooth with a positive thickness deviation makes the gear bounce: only bounces are observed on it.
    """
    path = cut.path
    found = kinks(path)
    at, flank = found.at, (found.jump < 0.0).astype(int)
    time, drive, loose = path.time[at], path.drive[at], path.loose[at]
    drawn = cut.flanks.places(time, drive, loose)
    off = found.place - np.where(flank == 1, drawn[1], drawn[0])
    sigma = np.full(len(at), max(path.noise, path.slack, 1e-12))
    clear = clearance(path, cut.flanks)
    tooth = (np.abs(cut.flanks.lifted(drive, loose, flank)) > clear) & (np.abs(off) < clear)
    common = np.sqrt(1.0 + ROUNDED**2 * np.count_nonzero(tooth))
    beside = Contacts(time, drive, loose, flank, found.place, sigma * common, np.full(len(at), path.width))
    return Corners(drive, loose, flank, off, sigma), Contacts(*(column[tooth] for column in beside))


def _impacts(cut: Segments) -> tuple[Impacts, int]:
    """Return impacts on flanks, without those on a deviating tooth: on its edges the rebound differs."""
    table = cut.impacts
    good = np.isfinite(table["rebound_m_s"]) & np.isfinite(table["rebound_sigma_m_s"]) & (table["testifies"] == 1)
    drive, loose = _angles(cut, table["time_s"])
    off = cut.flanks.lifted(drive, loose, table["flank"].astype(int)) if cut.path.shapes else np.zeros(len(drive))
    good &= np.abs(off) < max(cut.path.noise, cut.path.slack, 1e-12)
    time, drive, loose = table["time_s"][good], drive[good], loose[good]
    names = ("velocity_m_s", "velocity_sigma_m_s", "rebound_m_s", "rebound_sigma_m_s")
    before, before_sigma, after, after_sigma = (table[name][good] for name in names)
    flank, seen = table["flank"][good].astype(int), np.ones(len(time), bool)
    found = Impacts(time, drive, loose, flank, before, before_sigma, after, after_sigma, seen)
    return found, int(np.sum(~good))


def _losses(cut: Segments) -> tuple[Losses, int]:
    table = cut.flights
    some = np.flatnonzero(table["blow"] == 0)
    found = leaving(cut, some)
    flank = table["left"][found.flight].astype(int)
    sigma = _scattered(found.rate, found.sigma, flank)
    losses = Losses(found.time, *_angles(cut, found.time), flank, found.rate, sigma, *found[4:])
    return losses, len(some) - len(found.time)


def _scattered(value: Array, sigma: Array, flank: Array) -> Array:
    """Return standard deviations that include the scatter, and an error common to all losses of a flank."""
    wider = sigma.copy()
    for side in (0, 1):
        own = np.flatnonzero(flank == side)
        if len(own):
            usual = 1.4826 * float(np.median(np.abs(value[own] - np.median(value[own]))))
            wider[own] = np.maximum(sigma[own], usual) * np.sqrt(1.0 + COMMON**2 * len(own))
    return wider


def _angles(cut: Segments, time: Array) -> tuple[Array, Array]:
    known = cut.track
    return np.interp(time, known.time, known.drive), np.interp(time, known.time, known.loose)


def _drive(cut: Segments) -> Drive:
    reading = cut.track.readings[0]
    few = max(len(reading.time) // DRIVE, 1)
    count = len(reading.time) // few
    time, angle = (x[: count * few].reshape(count, few).mean(axis=1) for x in (reading.time, reading.angle))
    sigma = float(np.median(reading.sigma)) / np.sqrt(few)
    return Drive(time, angle, sigma, float(np.median(np.diff(time))) if count > 1 else 0.0)
