"""Which pairs of teeth may touch, by the angle of the drive gear: Bullet's answers, kept while they are valid.

The loose gear lies within the backlash, so the drive's angle alone decides which pairs of teeth can touch. An answer of
Bullet holds all pairs within a reach. The reach is the largest distance that two teeth in mesh can have
a revolution before they touch, plus the backlash and all deviations of gears and mounting. An answer is thus complete
for all angles within that turn. It is kept for windows of a fraction of a pitch, and is valid again whenever both gears
return to the same teeth. Where all teeth are equal, on ideal axes, it is valid a pitch later for the next teeth.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gears3d.engine.compile import entry, inner
from gears3d.engine.lines import parts_of
from gears3d.engine.mesh import ACTIVE, REVERSE, Mesh, lean_of, meshed, side_gap, tilt_of, tooth_gap
from gears3d.engine.motion import drive_at
from gears3d.gears.flank import Flanks

if TYPE_CHECKING:
    from gears3d.gears import Pair

WINDOWS = 3  # windows in one pitch of the drive
# Windows to either side of the present one that an answer fills: the next query comes after one pitch at the latest.
# Every pair of teeth is in mesh for longer than a pitch, so that all of them are compared with Bullet's gaps.
AHEAD = 2
# Part of a window by which its pairs are searched for beyond its ends, as a step may overshoot by this much.
GUARD = 0.1
# Places in a window at which the pairs that touch first are found, in windows.
NODES = (-GUARD, 0.5, 1.0 + GUARD)
# Part of a gap by which two pairs may change order while the gap closes: levers of two contacts differ by less.
LEVERS = 0.1
BEYOND = 1e-6  # part of a window by which a step ends beyond it
_SEARCH = 60
_LOOKS = 24  # places in a pitch at which the distance of the teeth in mesh is measured
_PITCHES = 3


def _roughness(flanks: Flanks) -> float:
    """Return how far apart the deviations of two teeth in mesh can be [m]."""
    waves = np.abs(flanks.harmonics[:, :, :, 1]).sum(axis=2) + np.abs(flanks.waves[:, :, :, 0]).sum(axis=2)
    return float((2.0 * waves + np.ptp(flanks.offsets, axis=2)).sum(axis=0).max())


def _parting(shape: Mesh, pitch: float, ratio: float, slack: float) -> float:
    """Return the largest distance of two teeth that may touch within the turn of an answer [m]; see the module."""
    turns = np.arange(-_PITCHES * _LOOKS, _PITCHES * _LOOKS + 1) / _LOOKS
    teeth = np.array([[1, 1, ACTIVE]])
    gaps = np.array([side_gap(shape, teeth, ACTIVE, x * pitch, x * pitch * ratio)[0] for x in turns])
    ends = np.full(_LOOKS, math.inf)  # a neighbour's gap is that of this pair a pitch earlier or later
    least = np.minimum(np.minimum(gaps, np.r_[ends, gaps[:-_LOOKS]]), np.r_[gaps[_LOOKS:], ends])
    touching = turns[gaps <= least + slack]
    turn = (AHEAD + 1.0 + GUARD) / WINDOWS
    within = (turns >= touching.min() - turn - 1.0 / _LOOKS) & (turns <= touching.max() + turn + 1.0 / _LOOKS)
    return float(gaps[within & np.isfinite(gaps)].max())


class Nearby:
    """The pairs of teeth that may touch, for all angles of the drive with a query of Bullet.

    Args:
        pair: the gears.
        shape: flanks and edges of the pair.
    """

    def __init__(self, pair: Pair, shape: Mesh) -> None:
        teeth = (pair.drive.teeth, pair.loose.teeth)
        self.width = 2.0 * math.pi / teeth[0] / WINDOWS
        self.table = np.zeros((WINDOWS * math.lcm(*teeth), 3), np.int64)  # first row, end, whether compared with Bullet
        self._teeth, self.equal = teeth, not pair.deviations and not pair.mounting
        self._parts = np.array([parts_of(shape.along, side) for side in (ACTIVE, REVERSE)])
        self.rows = np.zeros((256, 3 if self._parts.max() == 1 else 4), np.int64)
        self._used = 0
        self._shape = shape
        self._ratio = teeth[0] / teeth[1]
        self.slack = 1e-6 + _roughness(shape.edged.flanks)
        wandering = 2.0 * float(np.hypot(shape.offsets[::2], shape.offsets[1::2]).sum())
        tilts = (lean_of(pair), tilt_of(pair, "drive"), tilt_of(pair, "loose"))
        self.tilts = sum(float(np.hypot(*tilt)) for tilt in tilts)
        wandering += max(gear.face_width for gear in (pair.drive, pair.loose)) * self.tilts
        ideal = meshed(replace(pair, deviations=(), mounting=())) if pair.deviations or pair.mounting else shape
        parting = _parting(ideal, WINDOWS * self.width, self._ratio, self.slack)
        self.touching = 1.1 * (pair.backlash + wandering) + self.slack + 20e-6  # reach of the teeth that may touch now
        self.reach = self.touching + parting

    def window(self, angle: float) -> int:
        """Return the window of an angle of the drive [rad], a row of ``table``."""
        return math.floor(angle / self.width) % len(self.table)

    def known(self, angle: float) -> bool:
        """Return whether the pairs at an angle of the drive [rad] are known."""
        return bool(self.table[self.window(angle), 1])

    def teeth(self, angle: float) -> np.ndarray:
        """Return the pairs that may touch at an angle of the drive [rad]: teeth and side, (n, 3).

        Where profiles have waves, a pair has a row for each part of its line of contact, in the fourth column.
        """
        first, end, _ = self.table[self.window(angle)]
        return self.rows[first:end]

    def fill(self, found: np.ndarray, thetas: tuple[float, float]) -> None:
        """Keep the pairs within reach (n, 3) in the windows around the angles of drive and loose gear [rad]."""
        self._room((2 * AHEAD + 1) * len(found) * int(self._parts.max()))
        span = (self.width, self._ratio, self.slack)
        self._used = _fill(self._shape, found, thetas, span, self._parts, self.table, self.rows, self._used)

    def compared(self, angle: float, all_teeth: bool) -> None:
        """Note that the pairs around an angle of the drive [rad], or those of all teeth, are compared with Bullet."""
        around = self.window(angle) + np.arange(-AHEAD, AHEAD + 1)
        self.table[slice(None) if all_teeth and self.equal else around % len(self.table), 2] = 1
        if self.equal:
            turn = WINDOWS * self._teeth[0]
            self._room(2 * turn * int(np.diff(self.table[:, :2]).max()))
            self._used = _repeat(self._teeth, self.window(angle), turn, self.table, self.rows, self._used)

    def _room(self, most: int) -> None:
        """Provide space for further rows."""
        if self._used + most > len(self.rows):
            self.rows = np.concatenate([self.rows, np.zeros((len(self.rows) + most, self.rows.shape[1]), np.int64)])


@entry
def _repeat(counts: tuple[int, int], here: int, turn: int, table: np.ndarray, rows: np.ndarray, used: int) -> int:
    """Write the pairs of the windows within a ``turn`` from those a pitch before; return how many rows are used then.

    ``counts`` are the numbers of teeth of drive and loose gear, ``here`` is the present window.
    """
    for sense in (1, -1):
        for ahead in range(1, turn + 1):
            window, before = (here + sense * ahead) % table.shape[0], here + sense * (ahead - WINDOWS)
            first, end = table[before % table.shape[0], 0], table[before % table.shape[0], 1]
            if table[window, 1] != 0 or end == 0:
                continue
            table[window, 0] = used
            for i in range(first, end):
                rows[used, 0] = (rows[i, 0] + sense - 1) % counts[0] + 1
                rows[used, 1] = (rows[i, 1] + sense - 1) % counts[1] + 1
                rows[used, 2:] = rows[i, 2:]
                used += 1
            table[window, 1] = used
    return used


@entry
def _fill(
    shape: Mesh,
    found: np.ndarray,
    thetas: tuple[float, float],
    span: tuple[float, float, float],
    parts: np.ndarray,
    table: np.ndarray,
    rows: np.ndarray,
    used: int,
) -> int:
    """Write the pairs of the windows around an angle into ``rows`` from ``used`` on; return how many are used then.

    ``span`` is the width of a window [rad], the ratio of the loose gear's turn to the drive's, and by how much more
    open than the nearest a gap may be to count [m]; ``parts`` (2,) are those of the lines of contact of each side.
    """
    width, ratio, slack = span
    here = math.floor(thetas[0] / width)
    keep, gaps = np.zeros(found.shape[0], np.bool_), np.zeros(found.shape[0])
    for number in range(here - AHEAD, here + AHEAD + 1):
        window = number % table.shape[0]
        if table[window, 1] != 0:
            continue
        keep[:] = False
        sides = 0
        for node in NODES:
            turn = (number + node) * width - thetas[0]
            for side in (ACTIVE, REVERSE):
                sides |= _mark(shape, found, side, (thetas[0] + turn, thetas[1] + turn * ratio), slack, gaps, keep)
        if sides != 3 and number != here:  # these pairs are out of reach of this answer
            continue
        table[window, 0] = used
        for i in range(found.shape[0]):
            for part in range(parts[found[i, 2]] if keep[i] else 0):
                rows[used, :3] = found[i]
                rows[used, 3:] = part + 1
                used += 1
        table[window, 1] = used
    return used


@inner
def _mark(shape, found, side, thetas, slack, gaps, keep):
    """Mark the pairs of one side that touch first, where the loose gear is and where that side is closed.

    Return 1 for the active and 2 for the reverse side, 0 without a pair.
    """
    least, lever = math.inf, 1.0
    for i in range(found.shape[0]):
        gaps[i] = math.inf
        if found[i, 2] == side:
            gaps[i], _, by_loose = tooth_gap(shape, thetas[0], thetas[1], found[i])
            if gaps[i] < least:
                least, lever = gaps[i], by_loose
    if least == math.inf:
        return 0
    closed, shut = thetas[1] - least / lever, math.inf
    for i in range(found.shape[0]):
        keep[i] |= gaps[i] <= least + slack
        if gaps[i] <= least + slack + LEVERS * abs(least):
            gaps[i] = tooth_gap(shape, thetas[0], closed, found[i])[0]
            shut = min(shut, gaps[i])
        else:
            gaps[i] = math.inf
    for i in range(found.shape[0]):
        keep[i] |= gaps[i] <= shut + slack
    return 1 + side


@inner
def until_edge(motion: np.ndarray, time: float, width: float, steps: tuple[float, float]) -> float:
    """Return how long a step from ``time`` [s] may last within a window of the drive's angle, ``width`` [rad] wide [s].

    ``steps`` [s] is the longest step, and the one that may be taken if it ends with the window.
    """
    longest, most = steps
    number = math.floor(drive_at(motion, time)[0] / width)
    end = drive_at(motion, time + most)[0] / width - number
    if 0.0 <= end < 1.0:
        return longest
    sign = -1.0 if end < 0.0 else 1.0
    edge = (number + (end >= 1.0)) * width
    low, high, at = 0.0, most, 0.5 * most
    for _ in range(_SEARCH):
        angle, speed, _ = drive_at(motion, time + at)
        miss = sign * (angle - edge) / width
        if miss > 0.0:
            high = at
        else:
            low = at
        if 0.0 < miss < 2.0 * BEYOND:
            break
        at += sign * (BEYOND - miss) * width / speed if speed != 0.0 else 0.0
        if not low < at < high:
            at = 0.5 * (low + high)
    return high
