"""Residuals freed of what nobody knows of a record: start of each flight, zero of the displacement, drive's phase."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.coloured import Filter, filter_of, restored, roots_of, whitened

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence

Array = np.ndarray


def without(rest: Array, free: tuple[Array, ...]) -> Array:
    """Return residuals, each row freed of columns by least squares.

    Args:
        rest: (m, n).
        free: columns in the same weights, each (m, n); those that are nothing but the others are passed over.

    >>> without(np.array([[1.0, 2.0, 4.0]]), (np.ones((1, 3)), np.array([[0.0, 1.0, 2.0]]))).round(6).tolist()
    [[0.166667, -0.333333, 0.166667]]
    """
    return freed(rest, orthonormal(free))


def orthonormal(free: tuple[Array, ...]) -> list[Array]:
    """Return columns made orthonormal row by row; what is nothing but the ones before becomes zero.

    Args:
        free: columns, each (m, n).
    """
    taken: list[Array] = []
    for column in free:
        whole, own = np.sum(column * column, axis=1, keepdims=True), column
        for _ in range(2):  # twice is enough
            for other in taken:
                own = own - other * np.sum(other * own, axis=1, keepdims=True)
        size = np.sum(own * own, axis=1, keepdims=True)
        taken.append(np.where(size > 1e-16 * whole, own / np.sqrt(np.where(size > 0.0, size, 1.0)), 0.0))
    return taken


def freed(rest: Array, columns: list[Array]) -> Array:
    """Return residuals, each row without its share of orthonormal columns.

    Args:
        rest: (m, n).
        columns: of :func:`orthonormal`, each (m, n).
    """
    for own in columns:
        rest = rest - own * np.einsum("ij,ij->i", own, rest)[:, None]
    return rest


def free_flight(one: Evidence, path: Array) -> Array:
    """Return angles of flights in standard deviations, free of start angle and speed, (f * BINS,).

    Args:
        one: the record.
        path: angle at the points of its flights, real or complex [rad], (f, BINS).
    """
    if not len(path):
        return np.zeros(0)
    return freed(_weighted(one, path), _starts(one)).ravel()


def back_flight(one: Evidence, rest: Array) -> Array:
    """Return the transpose of :func:`free_flight`, applied to residuals of flights, (f, BINS).

    Args:
        one: the record.
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
    """Return what makes the points of flights white; ``None`` where they have no noise but white."""
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
    """Return displacements in contact in standard deviations, free of the record's zero, (c,).

    Args:
        one: the record.
        place: at its points of contact [m], (c,).
    """
    return _free_in_time(one, "contact", place, (np.ones_like(place),)) if len(place) else place


def free_drive(one: Evidence, angle: Array) -> Array:
    """Return angles of the drive in standard deviations, free of its zero, mean speed and phase, (d,).

    Args:
        one: the record.
        angle: at its points of the drive's motion [rad], (d,).
    """
    seen = one.channels.drive
    swing = one.motion.speed(seen.time) - one.motion.mean
    return _free_in_time(one, "drive", angle, (np.ones_like(angle), seen.time - seen.time.mean(), swing))


def in_units(one: Evidence, name: str, rest: Array) -> Array:
    """Return residuals of contact [m] or of the drive [rad] as readings, (n,).

    Args:
        one: the record.
        name: ``"contact"`` or ``"drive"``.
        rest: in standard deviations, as :func:`free_contact` or :func:`free_drive` has them, (n,).
    """
    if not len(rest):
        return rest
    by = _filter(one, name)
    sigma = one.channels.contacts.sigma if name == "contact" else one.channels.drive.sigma
    return rest * sigma if by is None else restored(rest, by)


def _filter(one: Evidence, name: str) -> Filter | None:
    """Return what makes readings of contact or of the drive white; ``None`` where they have no noise but white."""
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
    """Return readings of contact or of the drive made white, without their share of columns that are free."""
    by = _filter(one, name)
    sigma = one.channels.contacts.sigma if name == "contact" else one.channels.drive.sigma

    def white(column: Array) -> Array:
        return column / sigma if by is None else whitened(column, by)

    if name not in one.kept:
        one.kept[name] = orthonormal(tuple(white(column)[None] for column in free))
    return freed(white(values)[None], one.kept[name])[0]


def speed_of(one: Evidence, channel: str) -> Array:
    """Return the drive's speed at the points of contact, or of its motion [rad/s].

    Args:
        one: the record.
        channel: ``"contacts"`` or ``"drive"``.
    """
    if (key := ("speed", channel)) not in one.kept:
        one.kept[key] = one.motion.speed(getattr(one.channels, channel).time)
    return one.kept[key]
