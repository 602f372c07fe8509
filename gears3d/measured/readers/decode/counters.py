"""Counters and angles that wrap: after some bits, after a revolution."""

from __future__ import annotations

from math import pi

import numpy as np

from gears3d.measured.readers.decode.results import Angle, Note, positive, refuse, whole_column

# Part of the range: larger steps between samples are reported.
NOTABLE = 0.25


def counter(
    counts: np.ndarray,
    counts_per_revolution: float,
    bits: int | None = None,
    signed: bool = False,
    period: int | None = None,
    channel: str = "",
) -> Angle:
    """Return the angle of a counter that wraps.

    Args:
        counts: as read, whole numbers, (n,).
        counts_per_revolution: of the encoder with its decoding.
        bits: of the counter: 8, 16, 24, 32 or any other up to 53.
        signed: whether it goes from -2^(bits-1) on.
        period: counts after which it wraps, in place of ``bits``: an encoder's counts when its index resets it.
        channel: named in faults and notes.

    Raises:
        InputError: counts are not whole or outside the range, or a step could be either of two.

    >>> (counter(np.array([250, 254, 2, 6], dtype=np.uint8), 8, bits=8).angle * 4 / pi).round(9).tolist()
    [250.0, 254.0, 258.0, 262.0]
    """
    positive(counts_per_revolution, "counts_per_revolution")
    counts = whole_column(counts, channel, 1)
    if (bits is None) == (period is None):
        raise refuse(channel, "is a counter of unknown range", "give either bits or period")
    span = int(positive(period, "period")) if period is not None else 2 ** int(positive(bits or 0, "bits"))
    if span < 4 or span > 2**53:
        raise refuse(channel, f"has a range of {span} counts", "a counter has 2 to 53 bits")
    whole = counts.astype(np.int64) if counts.dtype.kind != "f" else np.round(counts).astype(np.int64)
    if counts.dtype.kind == "f" and not np.array_equal(whole, counts):
        row = int(np.argmax(whole != counts))
        raise refuse(channel, f"is {counts[row]:.9g} at row {row}, no whole count", "read it as an angle")
    least = -span // 2 if signed else 0
    outside = (whole < least) | (whole >= least + span)
    if outside.any():
        row = int(np.argmax(outside))
        what = f"is {whole[row]} at row {row}, outside {least} to {least + span - 1}"
        raise refuse(channel, what, "give the counter's bits and whether it is signed")
    unwrapped, notes = _unwrapped(whole, span, channel, "counts")
    return Angle(2 * pi / counts_per_revolution * unwrapped, notes)


def wrapped_angle(angle: np.ndarray, period: float = 2 * pi, channel: str = "") -> Angle:
    """Return the unwrapped angle of an angle that wraps after a revolution or another period.

    Args:
        angle: as read [rad], (n,).
        period: after which it wraps [rad], or in any other unit that the angle has, too.
        channel: named in faults and notes.

    Returns:
        The angle in the unit that it came in.

    Raises:
        InputError: it covers more than the period, or a step could be either of two.

    >>> wrapped_angle(np.array([350.0, 355.0, 0.0, 5.0]), 360.0).angle.tolist()
    [350.0, 355.0, 360.0, 365.0]
    """
    positive(period, "period")
    angle = whole_column(angle, channel, 1)
    if np.ptp(angle) > period * (1.0 + 1e-6):
        what = f"goes from {angle.min():.6g} to {angle.max():.6g}: it does not begin anew every {period:.6g}"
        raise refuse(channel, what, "leave the wrapping out, or give its period")
    unwrapped, notes = _unwrapped(angle.astype(float), period, channel, "of the angle's unit")
    return Angle(unwrapped, notes)


def _unwrapped(values: np.ndarray, span: float, channel: str, unit: str) -> tuple[np.ndarray, tuple[Note, ...]]:
    """Return values without jumps, and how often they jumped.

    A step is ambiguous at half the range, and where the other of the two steps that it may be, a range more or less,
    lies nearer to the step before.
    """
    found = np.unwrap(values, period=span)
    step = np.diff(found)
    largest = float(np.abs(step).max(initial=0.0))
    doubtful = 2 * np.abs(step) >= span
    doubtful[1:] |= 2 * np.abs(np.diff(step)) > span
    if doubtful.any():
        row = int(np.argmax(doubtful)) + 1
        what = f"goes from {values[row - 1]:.9g} to {values[row]:.9g} at row {row}: forwards or backwards by about half"
        raise refuse(channel, f"{what} its range of {span:.9g}", "sample faster, or use a counter of more bits")
    wraps = int(np.sum(np.abs(np.diff(values)) * 2 > span))
    notes = [Note("wraps", channel, wraps, "", f"wrapped {wraps} times")] if wraps else []
    if largest > NOTABLE * span:
        text = f"moves by up to {largest:.6g} {unit} between samples, {100 * largest / span:.3g} % of its range"
        text += ": at twice the range and more a step would be misread unseen"
        notes.append(Note("large-steps", channel, largest / span, "", text, harmless=False))
    return found, tuple(notes)
