"""Times of edges, pulses of toothed wheels and speeds as angles; both gears on one axis of time."""

from __future__ import annotations

from math import pi
from typing import Literal, NamedTuple

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
from gears3d.signals import noise_of

# Part of a timer's range: a longer step that ends on an earlier tick is a stamp out of order, not a wrap.
STALE = 0.9

Axis = Literal["loose", "drive", "union", "counters"]
# Ticks between an edge and its neighbours from which on a second stamp at its time is the same edge: edges that come
# faster than one a tick have neighbours no further than two ticks away.
RESOLVED = 4.0
# Ratio of a pulse spacing to its neighbours from which teeth are missing.
GAP = 1.5


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
    """Return the edges of an encoder from the times at which they happened, each once.

    Args:
        stamps: of the edges [s], or ticks of a clock, (k,); empty rows at the end, where the other gear has more, are
            left out.
        counts_per_revolution: edges that were stamped in one revolution.
        channel: named in faults and notes.
        clock: frequency of the clock [Hz] when the stamps are its ticks.
        bits: of the timer, when it wraps; needs ``clock``. It must not go unstamped for a whole round of the timer:
            that leaves no trace.
        direction: sense of each edge, positive or negative, (k,); all positive when not given. Without it edges with
            exactly the same stamp are one edge, unless the stamps are too coarse to tell.

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
    if direction is not None:
        place, shown = _signed(np.asarray(direction), len(time), channel)
    else:
        again = _again(time, None if clock is None else 1.0 / clock)
        if again.any():
            text = f"{again.sum()} of {len(time)} stamps repeat the one before exactly, first at "
            text += f"{time[again][0]:.9g} s: one edge each"
            notes.append(Note("repeated-stamps", channel, float(again.sum()), "", text, harmless=False))
            time = time[~again]
        place = shown = np.arange(len(time), dtype=float)
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


def _again(time: np.ndarray, tick: float | None) -> np.ndarray:
    """Return which stamps repeat the one before, where the stamps around are fine enough to tell two edges, (k,)."""
    again = np.diff(time, prepend=-np.inf) == 0.0
    some = np.flatnonzero(~again)
    if not again.any() or len(some) < 3:
        return np.zeros(len(time), bool)
    wait = np.diff(time[some])
    if tick is None:  # of the file, as waits differ by whole ticks
        change = np.abs(np.diff(wait))
        tick = float(change[change > 4.0 * np.spacing(np.abs(time).max())].min(initial=wait.max()))
    near = np.minimum(np.append(wait, wait[-1]), np.insert(wait, 0, wait[0]))
    return again & (near[np.cumsum(~again) - 1] > RESOLVED * tick)


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


class Spacing(NamedTuple):
    """Spacing errors of a toothed wheel.

    Args:
        error: by which each tooth passes too early, in the order of the pulses from the first on [rad], (m,).
        sigma: standard deviation of each [rad], (m,).
        revolutions: that were averaged.
    """

    error: np.ndarray
    sigma: np.ndarray
    revolutions: int


def tacho(
    time: np.ndarray | Even,
    voltage: np.ndarray,
    positions: int,
    missing: int | Literal["find"] = 0,
    edge: Literal["rising", "falling"] = "rising",
    channel: str = "tacho",
    threshold: float | None = None,
    hysteresis: float | None = None,
) -> Edges:
    """Return when the teeth of a wheel passed, one angle a tooth.

    Args:
        time: of the samples [s], (n,), or their even rate.
        voltage: of the pulses, or 0 and 1 [V], (n,).
        positions: teeth in a revolution, missing ones included: 60 of a wheel 60-2; pulses in a revolution.
        missing: neighbouring teeth that are left out: 2 of a wheel 60-2, or ``"find"``.
        edge: that is taken; that of a tooth's sharper end.
        channel: named in faults and notes.
        threshold: middle of the hysteresis [V]; found when not given.
        hysteresis: full width [V]; 40 % of the difference of the levels when not given.

    Returns:
        Times and angles, zero at the first tooth after the gap, or at the first pulse of a wheel without one.

    Raises:
        InputError: there are no two pulses, or the declared gap is not there.

    >>> turn = np.linspace(0.0, 2.0, 4001)
    >>> found = tacho(turn, np.sin(2 * pi * 6 * turn - 1.0) > 0, positions=6)
    >>> len(found.time), round(float(np.ptp(found.angle) / pi), 6), found.notes[-1].kind
    (12, 3.666667, 'pulses')
    """
    passed = switches(np.asarray(voltage), levels(voltage, channel, threshold, hysteresis))
    return pulses(time, passed, positions, missing, edge)


def pulses(
    time: np.ndarray | Even,
    passed: Switches,
    positions: int,
    missing: int | Literal["find"] = 0,
    edge: Literal["rising", "falling"] = "rising",
) -> Edges:
    """Return when the teeth of a wheel passed, from the switches of its channel; for channels read in blocks.

    Args:
        time: of the samples [s], (n,), or their even rate.
        passed: switches of the channel.
        positions: teeth in a revolution, missing ones included.
        missing: neighbouring teeth that are left out, or ``"find"``.
        edge: that is taken.

    Raises:
        InputError: there are no two pulses, or the declared gap is not there.

    >>> from gears3d.measured.readers.decode.switches import Levels
    >>> row = np.array([0, 1, 2, 5, 6, 7, 10, 11]) + 0.5
    >>> rises = Switches(np.sort(np.r_[row, row + 0.2]), np.array([True, False] * 8), False, 12, Levels(0.3, 0.7, "n"))
    >>> (pulses(Even(1.0), rises, 5, missing=2).angle * 5 / (2 * pi)).round(9).tolist()
    [-5.0, -4.0, -3.0, 0.0, 1.0, 2.0, 5.0, 6.0]
    """
    name = passed.levels.channel
    if positions < 1 or int(positions) != positions:
        raise refuse(name, f"has {positions} positions", "give the teeth in a revolution, missing ones included")
    if edge not in ("rising", "falling"):
        raise refuse(name, f"takes the {edge!r} edges", "give rising or falling")
    at = time_of(passed.row[passed.rises == (edge == "rising")], time)
    if len(at) < 2:
        raise refuse(name, f"has {len(at)} pulses", "see whether the wheel turned, and the thresholds")
    place, notes = _places(at, int(positions), missing, name)
    text = (
        f"{len(at)} pulses, {positions} positions a revolution: the angle is known there only, nothing is seen of what "
        f"happens between two pulses; the wheel is taken to turn one way all the time"
    )
    seen = (*passed.levels.notes, *notes, Note("pulses", name, float(len(at)), "", text))
    return Edges(at, 2 * pi / positions * place, seen)


def _places(at: np.ndarray, positions: int, missing: int | Literal["find"], name: str) -> tuple[np.ndarray, list[Note]]:
    """Return the position of every pulse, zero after the first gap, and irregularities of the gaps."""
    plain = np.arange(len(at), dtype=float)
    if missing == 0:
        return plain, []
    ratio, notes = _ratios(at), []
    found = missing
    if found == "find":
        wide = ratio[ratio > GAP]
        found = round(float(np.median(wide))) - 1 if len(wide) else 0
    gaps = np.flatnonzero((ratio > found + 0.5) & (ratio < found + 1.5)) if found else np.zeros(0, dtype=int)
    if missing == "find":
        notes = [Note("missing-teeth", name, found, "", f"{found} teeth are missing, seen {len(gaps)} times")]
    elif not len(gaps) and len(at) >= positions:
        what = f"shows no gap of {missing} teeth in {len(at)} pulses"
        raise refuse(name, what, "declare the missing teeth as they are, or let them be found")
    if not len(gaps):
        return plain, notes
    between = np.diff(gaps)
    odd = between != positions - found
    if odd.any():
        which = int(np.argmax(odd))
        text = (
            f"{int(odd.sum())} of {len(between)} revolutions have another number of pulses than {positions - found}, "
            f"the first {between[which]} after {at[gaps[which]]:.6g} s"
        )
        notes.append(Note("lost-pulses", name, float(np.sum(np.abs(between - (positions - found)))), "", text, False))
    step = np.ones(len(at))
    step[0] = 0.0
    step[gaps + 1] += found
    place = np.cumsum(step)
    return place - place[gaps[0] + 1], notes


def _ratios(at: np.ndarray) -> np.ndarray:
    """Return every distance of pulses in terms of the mean of its two neighbours; at an end there is but one."""
    own = np.diff(at)
    if len(own) < 2:
        return np.ones(len(own))
    early, late = np.concatenate([[own[1]], own[:-1]]), np.concatenate([own[1:], [own[-2]]])
    return own / np.sqrt(early * late)


def spacing(edges: Edges, positions: int, channel: str = "tacho") -> Spacing:
    """Return the spacing errors of the teeth of a wheel, from whole revolutions at nearly steady speed.

    Every pulse is compared with the mean of the revolution around it. Motion of the shaft itself once or a
    whole number of times per revolution counts as the wheel's: a record of the wheel alone cannot separate the two.

    Args:
        edges: of the wheel.
        positions: teeth in a revolution, missing ones included.
        channel: named in faults.

    Raises:
        InputError: there are fewer than three revolutions.

    >>> even = np.arange(200.0)
    >>> round(float(spacing(Edges(even + 0.01 * (even % 4 == 0), even * pi / 2), 4).error.min() * 2 / pi), 6)
    -0.0075
    """
    place = np.round(edges.angle * positions / (2 * pi)).astype(np.int64)
    full = np.arange(place[0], place[-1] + 1)
    if len(full) < 3 * positions + 1:
        what = f"turned by {(len(full) - 1) / positions:.3g} revolutions"
        raise refuse(channel, what, "spacing is found from three revolutions and more")
    every = np.interp(full, place, edges.time)
    weight = np.ones(positions + 1 if positions % 2 == 0 else positions)
    if positions % 2 == 0:
        weight[[0, -1]] = 0.5
    half = len(weight) // 2
    mean = np.convolve(every, weight / weight.sum(), "valid")
    speed = 2 * pi / positions * np.gradient(np.arange(len(mean)), mean)
    inner = place - place[0]
    own = (inner >= half) & (inner < half + len(mean))
    early = (mean[inner[own] - half] - edges.time[own]) * speed[inner[own] - half]
    tooth = np.mod(place[own], positions)
    seen = np.bincount(tooth, minlength=positions)
    error = np.bincount(tooth, early, minlength=positions) / np.maximum(seen, 1)
    spread = np.bincount(tooth, early**2, minlength=positions) / np.maximum(seen, 1) - error**2
    teeth = seen > 0
    error[teeth] -= error[teeth].mean()
    sigma = np.sqrt(np.maximum(spread, 0.0) / np.maximum(seen - 1, 1))
    return Spacing(np.where(teeth, error, 0.0), np.where(teeth, sigma, 0.0), int(seen.max()))


def evened(edges: Edges, found: Spacing, channel: str = "tacho") -> Edges:
    """Return edges corrected for the spacing errors of the teeth; only on request.

    Args:
        edges: of the wheel.
        found: of :func:`spacing`, from this record or a steadier one of the same wheel, with the same gap.
        channel: named in the note.

    >>> even = np.arange(200.0)
    >>> edges = Edges(even + 0.01 * (even % 4 == 0), even * pi / 2)
    >>> bool(np.ptp(np.diff(np.interp(even, *evened(edges, spacing(edges, 4))[:2]))[9:-9]) < 1e-4)
    True
    """
    positions = len(found.error)
    place = np.round(edges.angle * positions / (2 * pi)).astype(np.int64)
    worst = float(np.max(np.abs(found.error)))
    text = (
        f"teeth put where they stand, up to {worst:.3g} rad off even spacing (sigma {float(found.sigma.max()):.2g} "
        f"rad, {found.revolutions} revolutions); what the shaft itself did once a revolution is gone, too"
    )
    note = Note("spacing-corrected", channel, worst, "rad", text)
    return edges._replace(angle=edges.angle - found.error[np.mod(place, positions)], notes=(*edges.notes, note))


def integrated(time: np.ndarray, speed: np.ndarray, channel: str = "") -> Angle:
    """Return the angle of a measured speed: trapezia, zero at the first sample.

    Errors of the speed accumulate: an offset grows with time, noise with its root. The notes give how far noise and
    the straight lines between samples carry; no record shows its own offset.

    Args:
        time: of the samples, rising [s], (n,).
        speed: [rad/s], (n,).
        channel: named in faults and notes.

    Raises:
        InputError: lengths differ, or time does not rise.

    >>> integrated(np.array([0.0, 1.0, 3.0]), np.array([2.0, 4.0, 4.0])).angle.tolist()
    [0.0, 3.0, 11.0]
    """
    speed, time = whole_column(speed, channel), whole_column(time, "time_s")
    if len(time) != len(speed):
        raise refuse(channel, f"has {len(speed)} rows, time has {len(time)}", "give columns of one length")
    step = np.diff(np.asarray(time, dtype=float))
    if not (step > 0.0).all():
        row = int(np.argmin(step > 0.0)) + 1
        raise refuse("time_s", f"does not rise at row {row}", "put the rows in order of time, each time once")
    speed = np.asarray(speed, dtype=float)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * step)])
    return Angle(angle, (_drift(time, speed, step, channel), _coarse(time, speed, angle, channel)))


def _drift(time: np.ndarray, speed: np.ndarray, step: np.ndarray, channel: str) -> Note:
    """Return how far noise carries the angle until the end."""
    lasts = float(time[-1] - time[0])
    noise = noise_of(np.asarray(time, dtype=float), speed) if len(speed) > 8 else 0.0
    walk = noise * float(np.sqrt(np.sum(step**2)))
    text = (
        f"integrated from a speed over {lasts:.6g} s: noise of {noise:.2g} rad/s carries the angle off by {walk:.2g} "
        f"rad, each 1e-3 rad/s of offset by {1e-3 * lasts:.2g} rad; such an angle holds for short times only"
    )
    return Note("drift", channel, walk, "rad", text, harmless=False)


def _coarse(time: np.ndarray, speed: np.ndarray, angle: np.ndarray, channel: str) -> Note:
    """Return what straight lines between samples cost, from the same with every other sample."""
    rare, own = time[::2], speed[::2]
    half = np.concatenate([[0.0], np.cumsum(0.5 * (own[1:] + own[:-1]) * np.diff(rare))])
    off = float(np.max(np.abs(half - angle[::2]))) / 3.0
    text = f"straight lines between samples of the speed put the angle off by about {off:.2g} rad"
    return Note("integration", channel, off, "rad", text)
