"""The index of an encoder: where its angle is zero, and whether all counts are there."""

from __future__ import annotations

import numpy as np

from gears3d.measured.readers.decode.quadrature import Counted
from gears3d.measured.readers.decode.results import Note, refuse
from gears3d.measured.readers.decode.switches import Switches

# Counts by which the place of an index may vary: it is passed between two edges.
SLACK = 1.0


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
