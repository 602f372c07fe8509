"""Residuals without the nuisances of a record: start of each flight, datum of the displacement, drive's phase."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.coloured import Filter, filter_of, restored, roots_of, whitened

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence

Array = np.ndarray


def without(rest: Array, free: tuple[Array, ...]) -> Array:
    """Return residuals with columns projected out of each row by least squares.

    Args:
        rest: (m, n).
        free: columns in the same weights, each (m, n); linearly dependent ones are skipped.

    >>> without(np.array([[1.0, 2.0, 4.0]]), (np.ones((1, 3)), np.array([[0.0, 1.0, 2.0]]))).round(6).tolist()
    [[0.166667, -0.333333, 0.166667]]
    """
    return freed(rest, orthonormal(free))


def orthonormal(free: tuple[Array, ...]) -> list[Array]:
    """Return columns orthonormalised row by row; linearly dependent ones become zero.

    free: (m, n).
    """
    taken: list[Array] = []
    for column in free:
        whole, own = np.sum(column * column, axis=1, keepdims=True), column
        for _ in range(2):  # two passes are sufficient
            for other in taken:
                own = own - other * np.sum(other * own, axis=1, keepdims=True)
        size = np.sum(own * own, axis=1, keepdims=True)
        taken.append(np.where(size > 1e-16 * whole, own / np.sqrt(np.where(size > 0.0, size, 1.0)), 0.0))
    return taken


def freed(rest: Array, columns: list[Array]) -> Array:
    """Return residuals with orthonormal columns projected out of each row.

    rest: (m, n); columns: (m, n).
    """
    for own in columns:
        rest = rest - own * np.einsum("ij,ij->i", own, rest)[:, None]
    return rest


def free_flight(one: Evidence, path: Array) -> Array:
    """Return angles of flights in standard deviations, without start angle and speed, (f * BINS,).

    path: angle at the points of its flights, real or complex [rad], (f, BINS).
    """
    if not len(path):
        return np.zeros(0)
    return freed(_weighted(one, path), _starts(one)).ravel()


def back_flight(one: Evidence, rest: Array) -> Array:
    """Return the transpose of :func:`free_flight`, applied to residuals of flights, (f, BINS).

    rest: in standard deviations, (f * BINS,).
    """
    flights = one.channels.flights
    value = freed(rest.reshape(flights.time.shape), _starts(one))
    roots = _roots(one)
    return value / flights.sigma if roots is None else np.einsum("fji,fj->fi", roots, value)


def _weighted(one: Evidence, path: Array) -> Array:
    roots = _roots(one)
    return path / one.channels.flights.sigma if roots is None else np.einsum("fij,fj->fi", roots, path)


def _roots(one: Evidence) -> Array | None:
    """Return the whitening matrices of flights; ``None`` with white noise only."""
    flights, slow = one.channels.flights, one.channels.slow.loose_angle
    if slow <= 0.0 or not len(flights.time):
        return None
    if "roots" not in one.kept:
        one.kept["roots"] = roots_of(flights.time, flights.sigma, slow)
    return one.kept["roots"]


def _starts(one: Evidence) -> list[Array]:
    """Return start angle and speed of each flight, orthonormal, each (f, BINS)."""
    if "flight" not in one.kept:
        time = one.channels.flights.time
        x = time - time.mean(axis=1, keepdims=True)
        one.kept["flight"] = orthonormal((_weighted(one, np.ones_like(x)), _weighted(one, x)))
    return one.kept["flight"]


def free_contact(one: Evidence, place: Array) -> Array:
    """Return displacements in contact in standard deviations, without the record's datum, (c,).

    place: [m], (c,).
    """
    return _free_in_time(one, "contact", place, (np.ones_like(place),)) if len(place) else place


def free_drive(one: Evidence, angle: Array) -> Array:
    """Return angles of the drive in standard deviations, without its datum, mean speed and phase, (d,).

    angle: [rad], (d,).
    """
    seen = one.channels.drive
    swing = one.motion.speed(seen.time) - one.motion.mean
    return _free_in_time(one, "drive", angle, (np.ones_like(angle), seen.time - seen.time.mean(), swing))


def in_units(one: Evidence, name: str, rest: Array) -> Array:
    """Return residuals of contact [m] or of the drive [rad] as readings, (n,).

    Args:
        one: the record.
        name: ``"contact"`` or ``"drive"``.
        rest: in standard deviations, in the form of :func:`free_contact` or :func:`free_drive`, (n,).
    """
    if not len(rest):
        return rest
    by = _filter(one, name)
    sigma = one.channels.contacts.sigma if name == "contact" else one.channels.drive.sigma
    return rest * sigma if by is None else restored(rest, by)


def _filter(one: Evidence, name: str) -> Filter | None:
    """Return the whitening filter of contact or of the drive; ``None`` with white noise only."""
    seen, slow = one.channels, one.channels.slow
    size = slow.place if name == "contact" else slow.drive_angle
    if (key := ("white", name)) not in one.kept:
        if name == "contact":
            one.kept[key] = filter_of(seen.contacts.time, seen.contacts.sigma, size) if size > 0.0 else None
        else:
            sigma = np.full(len(seen.drive.time), seen.drive.sigma)
            one.kept[key] = filter_of(seen.drive.time, sigma, size) if size > 0.0 else None
    return one.kept[key]


def _free_in_time(one: Evidence, name: str, values: Array, free: tuple[Array, ...]) -> Array:
    """Return whitened readings of contact or of the drive with columns projected out."""
    by = _filter(one, name)
    sigma = one.channels.contacts.sigma if name == "contact" else one.channels.drive.sigma

    def white(column: Array) -> Array:
        return column / sigma if by is None else whitened(column, by)

    if name not in one.kept:
        one.kept[name] = orthonormal(tuple(white(column)[None] for column in free))
    return freed(white(values)[None], one.kept[name])[0]


def speed_of(one: Evidence, channel: str) -> Array:
    """Return the drive's speed at the points of ``"contacts"`` or ``"drive"`` [rad/s]."""
    if (key := ("speed", channel)) not in one.kept:
        one.kept[key] = one.motion.speed(getattr(one.channels, channel).time)
    return one.kept[key]
