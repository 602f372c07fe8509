"""Residuals freed of what nobody knows of a record: start of each flight, zero of the displacement, drive's phase."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

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
        path: angle at the points of its flights [rad], (f, BINS).
    """
    flights = one.channels.flights
    if not len(path):
        return np.zeros(0)
    if "flight" not in one.kept:
        x = flights.time - flights.time.mean(axis=1, keepdims=True)
        one.kept["flight"] = orthonormal((1.0 / flights.sigma, x / flights.sigma))
    return freed(path / flights.sigma, one.kept["flight"]).ravel()


def free_contact(one: Evidence, place: Array) -> Array:
    """Return displacements in contact in standard deviations, free of the record's zero, (c,).

    Args:
        one: the record.
        place: at its points of contact [m], (c,).
    """
    if not len(place):
        return place
    sigma = one.channels.contacts.sigma
    if "contact" not in one.kept:
        one.kept["contact"] = orthonormal(((1.0 / sigma)[None],))
    return freed((place / sigma)[None], one.kept["contact"])[0]


def free_drive(one: Evidence, angle: Array) -> Array:
    """Return angles of the drive in standard deviations, free of its zero, mean speed and phase, (d,).

    Args:
        one: the record.
        angle: at its points of the drive's motion [rad], (d,).
    """
    seen = one.channels.drive
    if "drive" not in one.kept:
        swing = one.motion.speed(seen.time) - one.motion.mean
        free = (np.ones_like(angle), seen.time - seen.time.mean(), swing)
        one.kept["drive"] = orthonormal(tuple(column[None] for column in free))
    return freed((angle / seen.sigma)[None], one.kept["drive"])[0]


def speed_of(one: Evidence, channel: str) -> Array:
    """Return the drive's speed at the points of contact, or of its motion [rad/s].

    Args:
        one: the record.
        channel: ``"contacts"`` or ``"drive"``.
    """
    if (key := ("speed", channel)) not in one.kept:
        one.kept[key] = one.motion.speed(getattr(one.channels, channel).time)
    return one.kept[key]
