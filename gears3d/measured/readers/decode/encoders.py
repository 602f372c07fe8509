"""Counters, quadrature and index marks of encoders as angles."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from gears3d.measured.readers.decode.switches import (
    Angle,
    Edges,
    Even,
    Note,
    Switches,
    levels,
    positive,
    refuse,
    switches,
    time_of,
    whole_column,
)

# Counts a line: rising edges of A, both edges of A, all edges of both.
DECODINGS = (1, 2, 4)
# Share of illegal transitions from which the two channels do not determine a direction.
MOSTLY = 0.5
# Part of the range: larger steps between samples are reported.
NOTABLE = 0.25
# Counts by which the place of an index may vary: it is passed between two edges.
SLACK = 1.0


class Counted(NamedTuple):
    """Counts of an encoder and when they change.

    Args:
        row: of each change, between samples, rising, (k,).
        count: after each change, (k,).
        first: count at the start.
        samples: of the record.
        counts_per_revolution: lines times decoding.
        notes: thresholds, illegal transitions, phase of the channels.
    """

    row: np.ndarray
    count: np.ndarray
    first: int
    samples: int
    counts_per_revolution: float
    notes: tuple[Note, ...]

    def edges(self, time: np.ndarray | Even) -> Edges:
        """Return the angles at which the count changed, the same for both senses of rotation, and when.

        Args:
            time: of the samples [s], (n,), or their even rate.
        """
        before = np.concatenate([[self.first], self.count[:-1]])
        place = 0.5 * (before + self.count) + 0.5
        count = 2 * pi / self.counts_per_revolution
        return Edges(time_of(self.row, time), count * place, self.notes, count * self.count)

    def angle(self) -> Angle:
        """Return the angle that the counter shows at every sample: rounded down to a count."""
        begins = np.concatenate([[0], np.floor(self.row).astype(np.int64) + 1, [self.samples]])
        count = np.concatenate([[self.first], self.count]) * (2 * pi / self.counts_per_revolution)
        return Angle(np.repeat(count, np.diff(begins)), self.notes)


def quadrature(
    a: np.ndarray,
    b: np.ndarray,
    lines: float,
    decoding: int = 4,
    channels: tuple[str, str] = ("A", "B"),
    threshold: float | None = None,
    hysteresis: float | None = None,
) -> Counted:
    """Decode the two channels of an incremental encoder, voltages or logic levels.

    The angle grows while A leads B. Where both channels change between the same two samples the shaft passed two edges
    unseen: they are counted in the previous direction, and reported.

    Args:
        a: voltage of channel A, or 0 and 1 [V], (n,); a memory map will do.
        b: of channel B [V], (n,).
        lines: periods of a channel in a revolution.
        decoding: counts a line: 1, 2 or 4.
        channels: names of both, for faults and notes.
        threshold: middle of the hysteresis of both [V]; found from each channel's levels when not given.
        hysteresis: full width for both [V]; 40 % of the difference of the levels when not given.

    Returns:
        Counts; ``.edges(time)`` gives the moments between samples, ``.angle()`` an angle at every sample.

    Raises:
        InputError: a channel has no two levels, lengths differ, or most transitions are illegal.

    >>> turn = np.linspace(0.0, 2 * pi, 2001)
    >>> found = quadrature(np.sin(2 * turn) > 0, np.sin(2 * turn - pi / 2) > 0, lines=2)
    >>> len(found.row), found.notes[-1].kind, float(np.ptp(found.angle().angle) / pi)
    (8, 'phase', 2.0)
    """
    if len(a) != len(b):
        raise refuse(channels[1], f"has {len(b)} rows, {channels[0]} has {len(a)}", "give channels of one length")
    pair = [
        switches(volts, levels(volts, name, threshold, hysteresis))
        for volts, name in zip((np.asarray(a), np.asarray(b)), channels, strict=True)
    ]
    return counted(pair[0], pair[1], lines, decoding)


def counted(a: Switches, b: Switches, lines: float, decoding: int = 4) -> Counted:
    """Count the switches of two channels; for channels that were read in blocks.

    Args:
        a: of channel A.
        b: of channel B.
        lines: periods of a channel in a revolution.
        decoding: counts a line: 1, 2 or 4.

    Raises:
        InputError: the decoding is unknown, or most transitions are illegal.

    >>> from gears3d.measured.readers.decode.switches import Levels
    >>> rest = Levels(0.3, 0.7)
    >>> a = switches(np.array([0, 1, 1, 0, 0, 1]), rest)
    >>> b = switches(np.array([0, 0, 1, 1, 0, 0]), rest)
    >>> counted(a, b, lines=1).count.tolist(), counted(a, b, lines=1, decoding=1).count.tolist()
    ([1, 2, 3, 4, 5], [1, 2])
    """
    positive(lines, "lines")
    if decoding not in DECODINGS:
        raise refuse("decoding", f"is {decoding}", "give 1, 2 or 4 counts a line")
    row, step, illegal = _steps(a, b)
    place = np.cumsum(np.concatenate([[_begins(a, b)], step]))
    count = (place + (4 // decoding - 1)) // (4 // decoding)
    changed = np.diff(count) != 0
    notes = [*a.levels.notes, *b.levels.notes, *_illegal(a, b, row, illegal), *_phase(a, b, row, step, illegal)]
    return Counted(row[changed], count[1:][changed], int(count[0]), a.samples, lines * decoding, tuple(notes))


def _steps(a: Switches, b: Switches) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rows, steps in quarters of a line and which were illegal, in order of time."""
    row = np.concatenate([a.row, b.row])
    order = np.argsort(row, kind="stable")
    row, of_a = row[order], (order < len(a.row))
    state_a = a.first ^ (np.cumsum(of_a) % 2).astype(bool)
    state_b = b.first ^ (np.cumsum(~of_a) % 2).astype(bool)
    step = np.where((state_a != state_b) == of_a, 1, -1)
    same = np.floor(row[1:]) == np.floor(row[:-1])
    illegal = np.concatenate([same, [False]])[: len(row)]
    follows = np.concatenate([[False], same])[: len(row)]
    row[:-1][same] = 0.5 * (row[:-1] + row[1:])[same]
    row, step, illegal = row[~follows], step[~follows], illegal[~follows]
    if illegal.any():
        legal = np.flatnonzero(~illegal)
        if np.mean(illegal) > MOSTLY:
            what = f"changes in the same sample as {b.levels.channel} {int(np.sum(illegal))} times of {len(row)}"
            raise refuse(a.levels.channel, what, "sample faster, or see whether both are the same signal")
        last = np.searchsorted(legal, np.flatnonzero(illegal)) - 1
        step[illegal] = 2 * step[legal[np.maximum(last, 0)]]
    return row, step, illegal


def _illegal(a: Switches, b: Switches, row: np.ndarray, illegal: np.ndarray) -> list[Note]:
    """Return the note on transitions in which both channels changed."""
    if not illegal.any():
        return []
    name = f"{a.levels.channel}/{b.levels.channel}"
    text = (
        f"{int(illegal.sum())} of {len(row)} transitions change both channels in one sample, the first at row "
        f"{int(np.ceil(row[illegal][0]))}: each was counted as two in the direction before"
    )
    return [Note("illegal-transitions", name, float(illegal.sum()), "", text, harmless=False)]


def _phase(a: Switches, b: Switches, row: np.ndarray, step: np.ndarray, illegal: np.ndarray) -> list[Note]:
    """Return how far the quarters of a line are from equal, over whole lines passed in one direction."""
    if len(row) < 5:
        return []
    place = _begins(a, b) + np.cumsum(step)
    onward = np.abs(np.convolve(np.where(illegal, 0, step), np.ones(5, dtype=int), "valid")) == 5
    begin = np.flatnonzero(onward)
    share = (row[begin + 1] - row[begin]) / (row[begin + 4] - row[begin])
    quarter = np.where(step[begin] > 0, place[begin], place[begin] - 1) % 4
    seen = np.bincount(quarter, minlength=4)
    if not seen.all():
        return []
    widths = np.bincount(quarter, share, minlength=4) / seen
    names = ("both low", f"{a.levels.channel} high", "both high", f"{b.levels.channel} high")
    text = "quarters of a line: " + ", ".join(f"{name} {100 * w:.3g} %" for name, w in zip(names, widths, strict=True))
    return [Note("phase", f"{a.levels.channel}/{b.levels.channel}", float(np.max(np.abs(widths - 0.25))), "", text)]


def _begins(a: Switches, b: Switches) -> int:
    """Return the quarter of a line in which the record begins."""
    return (2 if a.first else 3) if b.first else int(a.first)


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
        what = f"goes from {angle.min():.6g} to {angle.max():.6g}: it does not restart every {period:.6g}"
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


def indexed(counts: Counted, z: Switches) -> Counted:
    """Put the zero of the counts at the first index pulse and compare the counts between pulses with the declared ones.

    An index lies in the middle of the counts during its pulse, so that it is independent of the sense of rotation.
    A pulse in which the shaft reverses is excluded. Lost and extra counts are reported, not corrected.

    Args:
        counts: of the encoder.
        z: switches of its index, of :func:`gears3d.measured.readers.decode.switches.switches`.

    Returns:
        The counts from the index on, with notes on every revolution.

    Raises:
        InputError: no index pulse is whole, or all revolutions have another number of counts than was declared.

    >>> from gears3d.measured.readers.decode.switches import Levels
    >>> logic = Levels(0.3, 0.7, "Z")
    >>> counts = Counted(np.arange(20) + 0.5, np.arange(1, 21), 0, 22, 8.0, ())
    >>> z = Switches(np.array([2.5, 3.5, 10.5, 11.5, 18.5, 19.5]), np.array([1, 0] * 3, bool), False, 22, logic)
    >>> found = indexed(counts, z)
    >>> found.first, [note.kind for note in found.notes]
    (-3, ['index'])
    """
    name = z.levels.channel
    if z.samples != counts.samples:
        raise refuse(name, f"has {z.samples} rows, A and B have {counts.samples}", "give channels of one length")
    place, left_out = _places(counts, z)
    if not len(place):
        raise refuse(name, "has no whole pulse", "turn by more than a revolution, or leave the index out")
    per_turn = counts.counts_per_revolution
    travel = np.diff(place)
    _refuse_declared(travel, per_turn, name)
    turns = np.round(travel / per_turn)
    off = travel - turns * per_turn
    odd = np.abs(off) > SLACK
    notes = [*counts.notes, *z.levels.notes]
    text = f"{len(place)} index pulses, the shaft turned by {int(turns.sum())} revolutions between them"
    text += f"; {left_out} pulses in which it turned back or stood still are left out" if left_out else ""
    notes.append(Note("index", name, float(len(place)), "", text))
    if odd.any():
        notes.append(_lost(off, odd, turns, place, name))
    zero = int(np.floor(place[0]))
    return counts._replace(count=counts.count - zero, first=counts.first - zero, notes=tuple(notes))


def _places(counts: Counted, z: Switches) -> tuple[np.ndarray, int]:
    """Return the place of each whole pulse in counts, and how many were no passages."""
    begin = 0 if len(z.rises) and z.rises[0] else 1
    pulses = z.row[begin : begin + 2 * ((len(z.row) - begin) // 2)].reshape(-1, 2)
    series = np.concatenate([[counts.first], counts.count])
    before = np.searchsorted(counts.row, pulses - 0.75)
    after = np.searchsorted(counts.row, pulses + 0.75)
    rise = 0.5 * (series[before[:, 0]] + series[after[:, 0]])
    fall = 0.5 * (series[before[:, 1]] + series[after[:, 1]])
    width = np.abs(fall - rise)
    passed = width >= 0.5 * np.median(width) if len(width) else np.zeros(0, dtype=bool)
    return (0.5 * (rise + fall) + 0.5)[passed], int(np.sum(~passed))


def _refuse_declared(travel: np.ndarray, per_turn: float, name: str) -> None:
    """Refuse a declared number of counts that all revolutions contradict."""
    whole = np.abs(travel[np.abs(travel) > 2.0 * SLACK])
    if len(whole) < 2:
        return
    typical = float(np.median(whole))
    agree = np.abs(whole - typical) <= SLACK
    if np.mean(agree) > 0.5 and abs(typical - per_turn) > SLACK:
        what = f"comes every {typical:.6g} counts, {int(agree.sum())} times of {len(whole)}, not {per_turn:.6g}"
        raise refuse(name, what, f"declare {typical:.6g} counts a revolution: lines times decoding")


def _lost(off: np.ndarray, odd: np.ndarray, turns: np.ndarray, place: np.ndarray, name: str) -> Note:
    """Return which revolutions have too few or too many counts."""
    worst = int(np.argmax(np.abs(off)))
    text = (
        f"{int(odd.sum())} of {len(off)} stretches from index to index have lost or extra counts, {np.sum(off):+.6g} "
        f"in sum, the worst {off[worst]:+.6g} over {int(turns[worst])} revolutions from count {place[worst]:.6g} on"
    )
    return Note("lost-counts", name, float(np.sum(np.abs(off[odd]))), "", text, harmless=False)
