"""Which blocks of a path lie at a flank and which in the dead band, and the runs that they make."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.segmentation.flanks import Flanks
from gears3d.measured.segmentation.kinks import Kinks
from gears3d.measured.segmentation.smoothing import Blocks

# States of the loose gear; the first two are the codes of the flanks.
ACTIVE, REVERSE, FLIGHT = 0, 1, 2
# In place of a flank where the record begins or ends in flight.
CUT = -1
# Deviations of blocks in contact by which a flight must leave its flank.
CLEAR = 5.0
# Blocks from which on a run spares its first and last one, where the touch may lie.
TRIM = 5


class Runs(NamedTuple):
    """Runs of blocks in the dead band, each a flight or more.

    Args:
        first: first block, (k,).
        last: last block, (k,).
        left: flank before, -1 where the record begins, (k,).
        struck: flank after, -1 where it ends, (k,).
        height: greatest distance from the flank that was left [m], (k,).
    """

    first: np.ndarray
    last: np.ndarray
    left: np.ndarray
    struck: np.ndarray
    height: np.ndarray


def clearance(path: Blocks, flanks: Flanks) -> float:
    """Return the least distance of a block in flight from a flank [m]."""
    return max(CLEAR * max(flanks.rough, path.stray), path.slack)


def zones(path: Blocks, flanks: Flanks, found: Kinks, file: str = "") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return each block's zone, and its distances from the active and to the reverse flank [m], each (m,).

    Raises InputError when the noise fills the dead band.
    """
    low, high = flanks.places(path.time, path.drive, path.loose)
    above, below = path.place - low, high - path.place
    clear = clearance(path, flanks)
    narrow = float(np.min(high - low))
    if narrow < 3.0 * clear:
        what = f"is known to {1e6 * clear:.3g} um only, in a dead band of {1e6 * narrow:.3g} um at its narrowest"
        raise InputError(Fault("theta_loose_rad", what, "use an encoder with more counts, or a wider backlash", file))
    zone = np.full(len(above), FLIGHT, dtype=np.int8)
    zone[above < clear] = ACTIVE
    zone[below < clear] = REVERSE
    near = 3.0 * clear + np.abs(found.jump) * path.width  # blocks may lie to either side of a quick touch
    zone[found.at[(found.jump > 0.0) & (above[found.at] < near)]] = ACTIVE
    zone[found.at[(found.jump < 0.0) & (below[found.at] < near)]] = REVERSE
    return zone, above, below


def runs(zone: np.ndarray, above: np.ndarray, below: np.ndarray) -> Runs:
    """Return the runs of blocks in the dead band.

    ``zone``: of :func:`zones`, (m,); ``above``: distance from the active flank [m], (m,); ``below``: distance to the
    reverse flank [m], (m,).

    >>> zone = np.array([0, 2, 2, 1, 1], dtype=np.int8)
    >>> found = runs(zone, np.array([0.0, 1.0, 2.0, 3.0, 3.0]), np.array([3.0, 2.0, 1.0, 0.0, 0.0]))
    >>> [column.tolist() for column in found]
    [[1], [2], [0], [1], [2.0]]
    """
    flying = np.concatenate([[False], zone == FLIGHT, [False]])
    change = np.flatnonzero(np.diff(flying.astype(np.int8)))
    first, last = change[::2], change[1::2] - 1
    before = np.where(first > 0, zone[np.maximum(first - 1, 0)], CUT)
    after = np.where(last < len(zone) - 1, zone[np.minimum(last + 1, len(zone) - 1)], CUT)
    height = np.zeros(len(first))
    if len(first):
        both = np.stack([first, last + 1], axis=1).ravel()
        tops = [np.maximum.reduceat(np.append(gap, -np.inf), both)[::2] for gap in (above, below)]
        height = np.where(before == REVERSE, tops[1], tops[0])
    return Runs(first, last, before.astype(int), after.astype(int), height)


def touches_missed(
    zone: np.ndarray, above: np.ndarray, below: np.ndarray, found: Runs, wrong: np.ndarray, clear: float
) -> np.ndarray:
    """Return zones in which runs that are not a single parabola are split where they come closest to a flank, (m,).

    A short touch may be rounded off its flank by a block's width.

    ``zone``: so far, (m,); ``above``: distance from the active flank [m], (m,); ``below``: distance to the reverse
    flank [m], (m,); ``clear``: least distance of flight [m].

    >>> zone = np.array([0, 2, 2, 2, 2, 2, 0], dtype=np.int8)
    >>> above = np.array([0.0, 5.0, 4.0, 1.5, 4.0, 2.0, 0.0])
    >>> touches_missed(zone, above, 9.0 - above, runs(zone, above, 9.0 - above), np.array([0]), 1.0).tolist()
    [0, 2, 2, 0, 2, 2, 0]
    """
    parted = zone.copy()
    off = np.minimum(above, below)
    for k in map(int, wrong):
        inner = np.arange(int(found.first[k]) + 1, int(found.last[k]))
        low = inner[(off[inner] <= off[inner - 1]) & (off[inner] <= off[inner + 1]) & (off[inner] < 4.0 * clear)]
        if len(low):
            at = low[np.argmin(off[low])]
            parted[at] = ACTIVE if above[at] < below[at] else REVERSE
    return parted


def readings_of(found: Runs, size: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the first and last reading of each run, without the blocks where a touch may lie, each (k,)."""
    spare = (found.last - found.first + 1 >= TRIM).astype(int)
    first = (found.first + spare) * size
    last = np.minimum((found.last + 1 - spare) * size, count) - 1
    return first, last
