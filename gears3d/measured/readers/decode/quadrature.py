"""Two channels in quadrature: counts with their direction, and the moments at which they change."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from gears3d.measured.readers.decode.results import Angle, Edges, Even, Note, positive, refuse, time_of
from gears3d.measured.readers.decode.switches import Switches, levels, switches

# Counts a line: rising edges of A, both edges of A, all edges of both.
DECODINGS = (1, 2, 4)
# Share of illegal transitions from which the two channels do not determine a direction.
MOSTLY = 0.5


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
