"""Results of the decoders: angles, and notes on faults found while decoding."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError


class Note(NamedTuple):
    """An observation or assumption of a decoder, for the gate to report.

    Args:
        kind: one word with hyphens: ``"thresholds"``, ``"illegal-transitions"``, ``"lost-counts"``.
        channel: that it was seen in.
        size: how large, in ``unit``.
        unit: of the size; empty for a number or a share.
        text: one sentence with what was seen and where.
        harmless: whether it only describes the decoding; ``False`` for a fault of the channel.
    """

    kind: str
    channel: str
    size: float
    unit: str
    text: str
    harmless: bool = True


class Angle(NamedTuple):
    """An angle at every sample.

    Args:
        angle: unwrapped, zero anywhere unless an index tells it [rad], (n,).
        notes: what was seen.
        speed: that the angle was integrated from [rad/s], (n,); ``None`` where an angle was measured.
    """

    angle: np.ndarray
    notes: tuple[Note, ...] = ()
    speed: np.ndarray | None = None


class Edges(NamedTuple):
    """Angles that a shaft passed, and when.

    Args:
        time: of each edge [s], not falling, (k,).
        angle: of each edge, zero anywhere unless an index tells it [rad], (k,).
        notes: what was seen.
        shown: angle that a counter shows from each edge on, rounded down [rad], (k,); ``None`` where it is ``angle``.
    """

    time: np.ndarray
    angle: np.ndarray
    notes: tuple[Note, ...] = ()
    shown: np.ndarray | None = None


class Even(NamedTuple):
    """Time of samples at an even rate, in place of an array of times.

    Args:
        step: between two samples [s].
        start: of the first sample [s].
    """

    step: float
    start: float = 0.0

    def at(self, row: np.ndarray) -> np.ndarray:
        """Return the time of rows, fractions of rows included [s].

        >>> Even(0.5, 1.0).at(np.array([0.0, 2.5])).tolist()
        [1.0, 2.25]
        """
        return self.start + self.step * np.asarray(row, dtype=float)


def time_of(row: np.ndarray, time: np.ndarray | Even) -> np.ndarray:
    """Return the time of fractional rows by linear interpolation.

    ``row``: counted from 0, fractions allowed, (k,); ``time``: of the samples [s], (n,), or their even rate.

    >>> time_of(np.array([0.5, 1.0]), np.array([0.0, 2.0, 3.0])).tolist()
    [1.0, 2.0]
    """
    if isinstance(time, Even):
        return time.at(row)
    if len(time) < 2:
        return np.full(len(row), float(time[0]) if len(time) else 0.0)
    whole = np.clip(np.floor(row).astype(np.int64), 0, len(time) - 2)
    early, late = np.asarray(time[whole], dtype=float), np.asarray(time[whole + 1], dtype=float)
    return early + (row - whole) * (late - early)


def refuse(channel: str, message: str, remedy: str) -> InputError:
    """Return an InputError that names a channel, for the caller to raise.

    >>> str(refuse("A1", "has no edge", "look at the wiring"))
    'A1: has no edge (look at the wiring)'
    """
    return InputError(Fault(channel, message, remedy))


def whole_column(values: np.ndarray, channel: str, least: int = 2) -> np.ndarray:
    """Return a column without gaps.

    ``values``: as read, (n,). Raises InputError when the values are not numeric, too few, or contain NaN or infinity.

    >>> whole_column(np.array([1.0, np.nan]), "theta")
    Traceback (most recent call last):
    gears3d.errors.InputError: theta: is no number at row 1 (cut the record there, or leave the row out)
    """
    values = np.asarray(values)
    if values.ndim != 1 or values.dtype.kind not in "biuf":
        raise refuse(channel, f"is no column of numbers but {values.dtype} of shape {values.shape}", "read one column")
    if len(values) < least:
        raise refuse(channel, f"has {len(values)} rows", f"at least {least} are needed")
    if values.dtype.kind == "f" and not np.isfinite(total := float(np.sum(values, dtype=float))):
        bad = ~np.isfinite(values)
        if bad.any():
            raise refuse(
                channel, f"is no number at row {int(np.argmax(bad))}", "cut the record there, or leave the row out"
            )
        raise refuse(channel, f"sums up to {total}", "give numbers of the size of a signal")
    return values


def positive(value: float, name: str) -> float:
    """Return a positive finite number.

    Raises InputError when it is zero, negative or not finite.

    >>> positive(2048, "lines")
    2048.0
    """
    if not (np.isfinite(value) and value > 0):
        raise refuse(name, f"is {value:g}", "give a positive number")
    return float(value)


def told(notes: Sequence[Note], kind: str) -> Note | None:
    """Return the first note of a kind, or ``None``.

    >>> told([Note("wraps", "n", 2, "", "wrapped twice")], "wraps").size
    2
    """
    return next((note for note in notes if note.kind == kind), None)
