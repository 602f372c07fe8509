"""Times at which edges of an encoder happened, a column a channel, and both gears on one axis of time."""

from __future__ import annotations

from math import pi
from typing import Literal, NamedTuple

import numpy as np

from gears3d.measured.readers.decode.results import Angle, Edges, Note, positive, refuse, whole_column

# Part of a timer's range: a longer step that ends on an earlier tick is a stamp out of order, not a wrap.
STALE = 0.9

Axis = Literal["loose", "drive", "union", "counters"]


class Common(NamedTuple):
    """Both gears at the same moments.

    Args:
        time: rising [s], (n,).
        drive: angle of the drive gear [rad], (n,).
        loose: angle of the loose gear [rad], (n,).
        notes: of both and of the joining.
    """

    time: np.ndarray
    drive: np.ndarray
    loose: np.ndarray
    notes: tuple[Note, ...] = ()


def stamped(
    stamps: np.ndarray,
    counts_per_revolution: float,
    channel: str = "",
    clock: float | None = None,
    bits: int | None = None,
    direction: np.ndarray | None = None,
) -> Edges:
    """Return the edges of an encoder from the times at which they happened.

    Args:
        stamps: of the edges [s], or ticks of a clock, (k,); empty rows at the end, where the other gear has more, are
            left out.
        counts_per_revolution: edges that were stamped in one revolution.
        channel: named in faults and notes.
        clock: frequency of the clock [Hz] when the stamps are its ticks.
        bits: of the timer, when it wraps; needs ``clock``. It must not go unstamped for a whole round of the timer:
            that leaves no trace.
        direction: sense of each edge, positive or negative, (k,); all positive when not given.

    Raises:
        InputError: the stamps go back, or have gaps.

    >>> found = stamped(np.array([250.0, 254.0, 2.0, np.nan]), 4, "edges 1", clock=1e3, bits=8)
    >>> found.time.round(9).tolist(), (found.angle / pi).tolist()
    ([0.25, 0.254, 0.258], [0.0, 0.5, 1.0])
    """
    positive(counts_per_revolution, "counts_per_revolution")
    stamps = whole_column(_trimmed(stamps, channel), channel)
    notes: list[Note] = []
    if bits is not None:
        if clock is None:
            raise refuse(channel, f"is to wrap after {bits} bits of an unknown clock", "give the clock's frequency")
        stamps, wraps = _unwound(stamps, bits, channel)
        lasts = 2.0**bits / clock
        text = f"the timer wrapped {wraps} times; without an edge for {lasts:.6g} s it would have wrapped unseen"
        notes.append(Note("timer-wrap", channel, wraps, "", text))
    time = stamps / positive(clock, "clock") if clock is not None else stamps.astype(float)
    _refuse_back(time, channel)
    place = shown = np.arange(len(time), dtype=float)
    if direction is not None:
        place, shown = _signed(np.asarray(direction), len(time), channel)
    else:
        text = "edges without a sense: the gear is taken to turn one way all the time"
        notes.append(Note("one-way", channel, float(len(time)), "", text))
    count = 2 * pi / counts_per_revolution
    return Edges(time, count * place, tuple(notes), count * shown)


def common_axis(drive: Edges, loose: Edges, axis: Axis = "loose") -> Common:
    """Return both gears at the same moments.

    Args:
        drive: edges of the drive gear.
        loose: edges of the loose gear.
        axis: at which moments. ``"loose"``, ``"drive"`` or ``"union"``: at the edges of that gear, or of both, angles
            straight between a gear's own edges. ``"counters"``: just before and at every edge of either, angles as two
            counters show them, rounded down: nothing is made up between edges, and what reads counters at the moments
            at which they change, as ``gears3d segment`` does, finds every moment in it.

    Raises:
        InputError: the two have no time in common.

    >>> one = Edges(np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0, 4.0]))
    >>> other = Edges(np.array([0.5, 1.5, 2.5]), np.array([0.0, 1.0, 2.0]))
    >>> joined = common_axis(one, other)
    >>> joined.time.tolist(), joined.drive.tolist(), joined.loose.tolist()
    ([0.5, 1.5], [1.0, 3.0], [0.0, 1.0])
    >>> counters = common_axis(one, other, "counters")
    >>> counters.drive.tolist(), counters.loose.tolist()
    ([0.0, 0.0, 2.0, 2.0, 2.0, 2.0, 4.0], [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    """
    if axis not in ("loose", "drive", "union", "counters"):
        raise refuse("axis", f"is {axis!r}", "give loose, drive, union or counters")
    if len(drive.time) < 2 or len(loose.time) < 2:
        what = f"are {len(drive.time)} of the drive, {len(loose.time)} of the loose gear"
        raise refuse("edges", what, "turn further")
    begin, end = max(drive.time[0], loose.time[0]), min(drive.time[-1], loose.time[-1])
    if begin >= end:
        spans = f"{drive.time[0]:.6g} to {drive.time[-1]:.6g} s and {loose.time[0]:.6g} to {loose.time[-1]:.6g} s"
        raise refuse("edges", f"of both gears have no time in common: {spans}", "stamp both with the same clock")
    both = {"loose": loose.time, "drive": drive.time}
    time = np.unique(both[axis] if axis in both else np.concatenate([drive.time, loose.time]))
    time = time[(time >= begin) & (time <= end)]
    left = sum(int(np.sum((edges.time < begin) | (edges.time > end))) for edges in (drive, loose))
    text = f"{left} edges before {begin:.6g} s or after {end:.6g} s, which only one gear has, are left out"
    joined = (Note("common-time", "", float(left), "", text),) if left else ()
    if axis == "counters":
        time = _doubled(time)
        turned, swung = (_shown(edges, time) for edges in (drive, loose))
    else:
        turned, swung = (np.interp(time, *_once(edges)) for edges in (drive, loose))
    return Common(time, turned, swung, (*drive.notes, *loose.notes, *joined))


def _doubled(time: np.ndarray) -> np.ndarray:
    """Return every moment but the first with another just before it: a hundredth of the way back to its neighbour."""
    before = time[1:] - 0.01 * np.minimum(np.diff(time), np.median(np.diff(time)))
    return np.unique(np.concatenate([time, before]))


def _shown(edges: Edges, time: np.ndarray) -> np.ndarray:
    """Return what the counter of a gear shows at moments from its first edge on."""
    shown = edges.angle if edges.shown is None else edges.shown
    return shown[np.searchsorted(edges.time, time, side="right") - 1]


def on_grid(edges: Edges, time: np.ndarray, channel: str = "") -> Angle:
    """Return the angle at given moments, straight between edges.

    Args:
        edges: of the gear.
        time: moments within those of the edges [s], (n,).
        channel: named in faults and notes.

    Raises:
        InputError: a moment lies before the first or after the last edge.

    >>> on_grid(Edges(np.array([0.0, 1.0]), np.array([0.0, 2.0])), np.array([0.25])).angle.tolist()
    [0.5]
    """
    if len(edges.time) < 2:
        raise refuse(channel, f"has {len(edges.time)} edges", "at least 2 are needed")
    begin, end = float(edges.time[0]), float(edges.time[-1])
    if len(time) and (time[0] < begin or time[-1] > end):
        what = f"is known from {begin:.9g} s to {end:.9g} s, not from {time[0]:.9g} s to {time[-1]:.9g} s"
        raise refuse(channel, what, "cut the record to this time")
    return Angle(np.interp(time, *_once(edges)), edges.notes)


def _once(edges: Edges) -> tuple[np.ndarray, np.ndarray]:
    """Return edges with each moment once, at the mean of its angles."""
    time, place, times = np.unique(edges.time, return_inverse=True, return_counts=True)
    return time, np.bincount(place, edges.angle) / times


def _trimmed(stamps: np.ndarray, channel: str) -> np.ndarray:
    """Return stamps without empty rows at the end."""
    stamps = np.asarray(stamps)
    if stamps.ndim != 1 or stamps.dtype.kind != "f":
        return stamps
    filled = np.flatnonzero(~np.isnan(stamps))
    if not len(filled):
        raise refuse(channel, "has no stamps", "see whether the channel was connected")
    return stamps[: filled[-1] + 1]


def _unwound(stamps: np.ndarray, bits: int, channel: str) -> tuple[np.ndarray, int]:
    """Return ticks of a timer of some bits as if it had more, and how often it wrapped."""
    round_ = 2**bits
    ticks = stamps.astype(np.int64) if stamps.dtype.kind != "f" else np.round(stamps).astype(np.int64)
    outside = (ticks < 0) | (ticks >= round_)
    if outside.any():
        row = int(np.argmax(outside))
        what = f"has {stamps[row]:.12g} at row {row}, more than a timer of {bits} bits can show"
        raise refuse(channel, what, "give the timer's bits, and the clock's frequency for ticks")
    step = np.diff(ticks)
    stale = (step < 0) & (step + round_ > STALE * round_)
    if stale.any():
        row = int(np.argmax(stale)) + 1
        what = f"goes back by {-step[row - 1]} ticks at row {row}, too little for a wrap of {round_} ticks"
        raise refuse(channel, what, "put the stamps in order of time")
    back = step < 0
    return ticks + round_ * np.concatenate([[0], np.cumsum(back)]), int(back.sum())


def _refuse_back(time: np.ndarray, channel: str) -> None:
    """Refuse stamps that go back."""
    back = np.diff(time) < 0.0
    if back.any():
        row = int(np.argmax(back)) + 1
        what = f"goes back by {time[row - 1] - time[row]:.9g} s at row {row}"
        raise refuse(channel, what, "tell clock and bits of the timer if it wraps there")


def _signed(direction: np.ndarray, count: int, channel: str) -> tuple[np.ndarray, np.ndarray]:
    """Return place of each edge and counts from it on, from the sense of each; zero is the first edge."""
    if len(direction) < count:
        raise refuse(channel, f"has {count} edges but {len(direction)} directions", "give one for each edge")
    sense = np.sign(whole_column(direction[:count], channel))
    if not sense.all():
        raise refuse(channel, f"has no direction at row {int(np.argmin(np.abs(sense)))}", "give +1 or -1 for each edge")
    after = np.cumsum(sense)
    place = 0.5 * (after + np.concatenate([[0.0], after[:-1]])) + 0.5
    return place - place[0], after - place[0]
