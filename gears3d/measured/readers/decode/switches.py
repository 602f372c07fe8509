"""From a voltage to the moments at which it switches, and the results of decoders: angles, and notes on faults."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError

# Samples processed at a time: they fit into the cache and bound the memory.
BLOCK = 1 << 18
# Samples from which levels are found.
LOOKED_AT = 1 << 18
# Width of the hysteresis unless given, of the difference of both levels.
BAND = 0.4
# Least distance of two levels in standard deviations of each: 2.7 are halves of a normal noise, 3.5 of a triangle, 4.6
# of a sine.
APART = 3.2

# Share of samples: fewer are spikes where the others have two levels of their own, pulses where not.
RARE = 1e-3


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
    gears3d.errors.InputError: theta: is not a number at row 1 (cut the record there, or leave the row out)
    """
    values = np.asarray(values)
    if values.ndim != 1 or values.dtype.kind not in "biuf":
        raise refuse(
            channel, f"is not a column of numbers but {values.dtype} of shape {values.shape}", "read one column"
        )
    if len(values) < least:
        raise refuse(channel, f"has {len(values)} rows", f"at least {least} are needed")
    if values.dtype.kind == "f" and not np.isfinite(total := float(np.sum(values, dtype=float))):
        bad = ~np.isfinite(values)
        if bad.any():
            raise refuse(
                channel, f"is not a number at row {int(np.argmax(bad))}", "cut the record there, or leave the row out"
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


class Levels(NamedTuple):
    """When a voltage counts as high and as low.

    Args:
        low: it is low once below [V].
        high: it is high once above [V].
        channel: named in faults and notes.
        notes: how they were found.
    """

    low: float
    high: float
    channel: str = ""
    notes: tuple[Note, ...] = ()

    @property
    def middle(self) -> float:
        """Voltage that defines the moment of an edge [V]."""
        return 0.5 * (self.low + self.high)


class Switches(NamedTuple):
    """Moments at which a channel switches.

    Args:
        row: of each moment, between samples, rising, (k,); samples count from 0.
        rises: whether it goes high there, (k,); alternates.
        first: whether it is high at the start.
        samples: seen in all.
        levels: that were used.
    """

    row: np.ndarray
    rises: np.ndarray
    first: bool
    samples: int
    levels: Levels


def levels(
    voltage: np.ndarray, channel: str = "", threshold: float | None = None, hysteresis: float | None = None
) -> Levels:
    """Return the thresholds of a channel with two levels, found from the levels unless given.

    The levels are means of the two clusters of least spread; the hysteresis stands around the middle between them.

    Args:
        voltage: of the channel, or 0 and 1 of a logic input [V], (n,).
        channel: named in faults and notes.
        threshold: middle of the hysteresis [V]; found when not given.
        hysteresis: full width [V]; 40 % of the difference of the levels when not given, 0 for none.

    Raises:
        InputError: the voltage has no two levels, or not both sides of the thresholds.

    >>> rest = levels(np.array([0.1, 4.9, 5.1, -0.1] * 10), "A")
    >>> round(rest.low, 9), round(rest.high, 9), rest.notes[0].kind
    (1.5, 3.5, 'thresholds')
    """
    if hysteresis is not None and not hysteresis >= 0:
        raise refuse(channel, f"has a hysteresis of {hysteresis:g} V", "give a width of 0 or more")
    if len(voltage) < 2:
        raise refuse(channel, f"has {len(voltage)} rows", "at least 2 are needed")
    if threshold is not None and hysteresis is not None:
        return Levels(threshold - 0.5 * hysteresis, threshold + 0.5 * hysteresis, channel)
    seen = _some(voltage)
    if not np.isfinite(seen).all():
        raise refuse(channel, "has values that are no numbers", "cut the record there, or leave these rows out")
    lower, upper, share = _rests(seen, channel)
    middle = 0.5 * (lower + upper) if threshold is None else threshold
    if not lower < middle < upper:
        what = f"has levels of {lower:.4g} V and {upper:.4g} V, not on both sides of {middle:.4g} V"
        raise refuse(channel, what, "leave threshold out: it is found from the levels")
    width = BAND * (upper - lower) if hysteresis is None else hysteresis
    text = (
        f"levels {lower:.4g} V and {upper:.4g} V, high for {100 * share:.3g} % of the samples: "
        f"high above {middle + 0.5 * width:.4g} V, low below {middle - 0.5 * width:.4g} V"
    )
    note = Note("thresholds", channel, middle, "V", text)
    return Levels(middle - 0.5 * width, middle + 0.5 * width, channel, (note,))


def _some(voltage: np.ndarray) -> np.ndarray:
    """Return samples that show both levels: some at random, and the extremes of every stretch, rare pulses included."""
    if len(voltage) <= LOOKED_AT:
        return np.asarray(voltage, dtype=float)
    at_random = voltage[np.sort(np.random.default_rng(0).integers(0, len(voltage), LOOKED_AT))]
    stretch = max(len(voltage) // LOOKED_AT, 4096)
    extremes = [np.zeros(0)]
    for block in _blocks(np.asarray(voltage)):
        starts = np.arange(0, len(block), stretch)
        extremes += [np.minimum.reduceat(block, starts), np.maximum.reduceat(block, starts)]
    return np.concatenate([at_random, *extremes]).astype(float)


def _rests(seen: np.ndarray, channel: str) -> tuple[float, float, float]:
    """Return lower level, upper level and the share of samples at the upper; a few spikes are no level."""
    if seen.min() == seen.max():
        raise refuse(channel, f"stays at {seen[0]:.4g} V", "see whether the channel was connected and the shaft turned")
    lower, upper, spread, above = _two_means(seen)
    most = above if np.mean(above) > 0.5 else ~above
    if np.mean(most) > 1.0 - RARE and np.ptp(seen[most]) > 0.0:
        inner = _two_means(seen[most])
        if inner[1] - inner[0] >= APART * inner[2] and RARE < np.mean(inner[3]) < 1.0 - RARE:
            lower, upper, spread, above = inner
    if upper - lower < APART * spread:
        what = f"has no two levels: {lower:.4g} V and {upper:.4g} V with a spread of {spread:.2g} V"
        raise refuse(channel, what, "give threshold and hysteresis, or look at the wiring")
    return lower, upper, float(above.mean())


def _two_means(seen: np.ndarray) -> tuple[float, float, float, np.ndarray]:
    """Return the means of the two clusters of least spread, their spread, and which values are in the upper."""
    above = seen > 0.5 * (seen.min() + seen.max())
    lower, upper = float(seen[~above].mean()), float(seen[above].mean())
    for _ in range(50):
        before, above = above, seen > 0.5 * (lower + upper)
        lower, upper = float(seen[~above].mean()), float(seen[above].mean())
        if np.array_equal(before, above):
            break
    spread = float(np.sqrt(np.mean(np.square(seen - np.where(above, upper, lower)))))
    return lower, upper, spread, above


def switches(voltage: np.ndarray | Iterable[np.ndarray], rest: Levels) -> Switches:
    """Return when a channel switches, as a Schmitt trigger defines it, at crossings of the middle between samples.

    Only a voltage that passes the whole hysteresis switches: noise less than its width makes no edges. The moment is
    the mean of first and last crossing of the middle on this way, straight between samples, so that neither the sense
    of the edge nor noise moves it. An edge between two samples of a logic input is placed halfway between them.

    Args:
        voltage: of the channel [V], (n,), or an iterable of blocks of it, for records longer than the memory.
        rest: thresholds, of :func:`levels`.

    Raises:
        InputError: a row is NaN or infinite, or the voltage is never outside the hysteresis.

    >>> found = switches(np.array([0.0, 0.0, 1.0, 1.0, 0.0]), Levels(0.3, 0.7))
    >>> found.row.tolist(), found.rises.tolist(), found.first
    ([1.5, 3.5], [True, False], False)
    """
    state = _State(0, None, 0, np.zeros(0), np.zeros(0))
    first: bool | None = None
    rows, rises = [np.zeros(0)], [np.zeros(0, dtype=bool)]
    for block in _blocks(voltage):
        _refuse_gaps(block, state.samples, rest.channel)
        at, up, begins, state = _passed(block, rest, state)
        first = begins if first is None else first
        rows.append(at)
        rises.append(up)
    if first is None:
        what = f"is never below {rest.low:.4g} V nor above {rest.high:.4g} V"
        raise refuse(rest.channel, what, "give a smaller hysteresis, or see whether the shaft turned")
    return Switches(np.concatenate(rows), np.concatenate(rises), first, state.samples, rest)


class _State(NamedTuple):
    """State passed from one block to the next: samples, last known state and its row, last sample, crossings."""

    samples: int
    high: bool | None
    known: int
    last: np.ndarray
    crossings: np.ndarray


def _blocks(voltage: np.ndarray | Iterable[np.ndarray]) -> Iterator[np.ndarray]:
    """Return blocks of a channel, small ones of an array."""
    if not isinstance(voltage, np.ndarray):
        yield from (np.asarray(block) for block in voltage)
        return
    for begin in range(0, len(voltage), BLOCK):
        yield np.asarray(voltage[begin : begin + BLOCK])


def _refuse_gaps(block: np.ndarray, start: int, channel: str) -> None:
    """Refuse a block with NaN or infinity."""
    if block.dtype.kind == "f" and not np.isfinite(block.sum()):
        bad = ~np.isfinite(block)
        row = start + int(np.argmax(bad))
        raise refuse(channel, f"is not a number at row {row}", "cut the record there, or leave the row out")


def _passed(block: np.ndarray, rest: Levels, state: _State) -> tuple[np.ndarray, np.ndarray, bool | None, _State]:
    """Return rows and senses of the switches in a block, the first known state, and the state for the next block."""
    high = block > rest.high
    at = np.flatnonzero(high | (block < rest.low))
    known, is_high = state.samples + at, high[at]
    begins = bool(is_high[0]) if len(at) else None
    if state.high is not None:
        known, is_high = np.concatenate([[state.known], known]), np.concatenate([[state.high], is_high])
    crossing = np.concatenate([state.crossings, _crossings(block, rest.middle, state)])
    turn = np.flatnonzero(is_high[1:] != is_high[:-1])
    early = crossing[np.searchsorted(crossing, known[turn])]
    late = crossing[np.searchsorted(crossing, known[turn + 1]) - 1]
    samples = state.samples + len(block)
    last = block[-1:].astype(float) if len(block) else state.last
    if not len(known):
        return np.zeros(0), np.zeros(0, dtype=bool), None, _State(samples, None, 0, last, crossing[:0])
    open_ = crossing[np.searchsorted(crossing, known[-1]) :]
    after = _State(samples, bool(is_high[-1]), int(known[-1]), last, open_[[0, -1]] if len(open_) else open_)
    return 0.5 * (early + late), is_high[turn + 1], begins, after


def _crossings(block: np.ndarray, middle: float, state: _State) -> np.ndarray:
    """Return where the middle is crossed in a block, straight between samples, as rows of the record."""
    over = block > middle
    row = np.flatnonzero(over[1:] != over[:-1])
    here, there = block[row].astype(float), block[row + 1].astype(float)
    found = state.samples + row + (middle - here) / (there - here)
    if len(block) and len(state.last) and (state.last[0] > middle) != over[0]:
        seam = state.samples - 1 + (middle - state.last[0]) / (float(block[0]) - state.last[0])
        found = np.concatenate([[seam], found])
    return found
