"""Records of edges: edges that were stamped as one, and edges that were stamped twice.

A row is an edge, or the moment just before one; an edge more or less is one count for good. Changes from row to row do
not tell that, the times between edges do.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.pace import EVEN
from gears3d.measured.checks.view import View, when
from gears3d.signals import some_steps

REACH = 4
"""Times between edges to either side that tell what is usual."""
WHOLE = 0.99
"""Part of the changes that must be one count, for rows to be edges."""
LONGER = 1.6
"""A time between edges that holds two of them is at least so many times the usual."""
WIDE = 2.5
"""It must stand out by so many times what its neighbours differ by, as logarithms."""
NEAR, STEADY = 0.15, 0.12
"""How near the logarithm of a time must be to that of whole usual ones; how much neighbours may differ for that."""
TOLD = 20
"""Places that can be corrected one by one; an encoder with more of them cannot be used."""
TORN = 0.1
"""Part of the backlash from which on edges that are lost or won spoil what is found of flights."""


class Marks(NamedTuple):
    """The edges of one gear.

    Args:
        row: at which the angle has changed, (k,).
        time: [s], (k,).
        sense: of the change, (k,).
        count: angle between two [rad].
    """

    row: np.ndarray
    time: np.ndarray
    sense: np.ndarray
    count: float


def examine(view: View) -> list[Finding]:
    """Find edges of a gear that were stamped as one, or twice.

    Args:
        view: the record; its time rises, its angles do not wrap.
    """
    found = []
    for name in view.angles:
        marks = marks_of(view, name)
        if marks is None or len(marks.row) < 4 * REACH:
            continue
        for kind, what, (place, missing) in (
            ("merged-edges", "too long for one count: edges are missing", _merged(marks)),
            ("doubled-edges", "divided by an additional edge: the signal bounced", _doubled(marks)),
        ):
            if len(place):
                found.append(_told(view, name, kind, what, marks, place, missing))
    return found


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Give counts back, or take them away, from the row on in which they were lost or won.

    Args:
        columns: each (n,).
        findings: of this check, of one kind.
    """
    mended = dict(columns)
    for finding in findings:
        angle = mended[finding.channel].copy()
        for row in finding.rows:
            angle[row:] += finding.parameters[f"row_{row}"]
        mended[finding.channel] = angle
    return mended


def marks_of(view: View, name: str) -> Marks | None:
    """Return the edges of a gear, ``None`` where rows are samples.

    Args:
        view: the record.
        name: of the column.
    """
    if view.spacing <= 0.0:
        return None
    some = np.abs(view.some_changes(name))
    steps = some_steps(view.time)
    even = np.mean(np.abs(steps - view.spacing) < 0.4 * view.spacing) >= EVEN
    moved = some > 0.0
    if not moved.any() or (even and not moved.all()):
        return None
    count = float(np.median(some[moved]))
    if np.mean(np.abs(some[moved] / count - 1.0) < 1e-3) < WHOLE:
        return None
    pieces = [(first + np.flatnonzero(change), change[change != 0.0]) for first, change in view.changes(name)]
    row = np.concatenate([rows for rows, _ in pieces]) + 1
    return Marks(row, view.time[row], np.sign(np.concatenate([change for _, change in pieces])), count)


def _around(length: np.ndarray, first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the logarithm of what is usual about stretches of times, and how far neighbours are off their trend."""
    reach = np.arange(1, REACH + 1)
    near = np.concatenate([length[first[:, None] - reach[::-1]], length[last[:, None] + reach]], axis=1)
    place = np.concatenate([-reach[::-1], reach])
    middle = near.mean(axis=1)
    slope = (near - middle[:, None]) @ place / float(place @ place)
    return middle, np.ptp(near - slope[:, None] * place, axis=1)


def _one_way(marks: Marks, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return whether the gear turns one way all around stretches of times."""
    turned = np.concatenate([[0], np.cumsum(np.diff(marks.sense) != 0.0)])
    return turned[first - REACH] == turned[last + REACH + 1]


def _merged(marks: Marks) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the edges before which others are missing, and how many."""
    with np.errstate(divide="ignore"):
        length = np.log(np.diff(marks.time))
    long = np.arange(REACH, len(length) - REACH)
    long = long[length[long] > np.maximum(length[long - 1], length[long + 1]) + np.log(LONGER)]
    usual, spread = _around(length, long, long)
    beyond = length[long] - usual
    whole = np.round(np.exp(beyond))
    near = np.abs(beyond - np.log(np.maximum(whole, 1.0))) < NEAR
    sure = (whole > 1.0) & near & (beyond > WIDE * spread) & _one_way(marks, long, long)
    return long[sure] + 1, whole[sure] - 1.0


def _doubled(marks: Marks) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the edges that are too many, and minus one for each."""
    step = np.diff(marks.time)
    first = np.arange(REACH, len(step) - REACH - 1)
    both = step[first] + step[first + 1]
    first = first[both < LONGER * np.minimum(step[first - 1], step[first + 2])]
    with np.errstate(divide="ignore"):
        length = np.log(step)
    usual, spread = _around(length, first, first + 1)
    with np.errstate(invalid="ignore"):
        off = np.abs(np.log(step[first] + step[first + 1]) - usual)
        sure = (off < NEAR) & (spread < STEADY) & _one_way(marks, first, first + 1)
    first, off = first[sure], off[sure]
    run = np.cumsum(np.diff(first, prepend=first[:1] - 9) > 2)  # an edge too many makes two pairs that are too short
    best = np.array([np.flatnonzero(run == one)[np.argmin(off[run == one])] for one in np.unique(run)], int)
    return first[best] + 1, np.full(len(best), -1.0)


def _told(view: View, name: str, kind: str, what: str, marks: Marks, place: np.ndarray, missing: np.ndarray) -> Finding:
    off = missing * marks.count * marks.sense[place]
    worst = float(np.abs(np.cumsum(off)).max())
    many = len(place) > TOLD
    told = f"{len(place)} intervals between edges are {what}, at {when(marks.time, place)}; error of the angle up to "
    told += f"{worst:.4g} rad ({worst / marks.count:.0f} counts)"
    fatal, declared = many, view.declared
    if declared.meshed and declared.radii is not None and declared.backlash is not None:
        moved = worst * declared.radii[0 if "drive" in name else 1]
        fatal |= moved > TORN * declared.backlash
        told += f": permanent shift of the backlash by {1e6 * moved:.3g} um"
    rows = tuple(map(int, marks.row[place[:TOLD]]))
    numbers = {f"row_{row}": float(one) for row, one in zip(rows, off, strict=False)}
    remedy = "check threshold and hysteresis of the edge detection"
    return Finding(kind, name, worst, "rad", told, remedy, fatal, not many, rows=rows, parameters=numbers)
