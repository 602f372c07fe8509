"""The flanks of a pair as arrays that compiled functions take.

Gears are numbered 0 drive, 1 loose; flanks 0 active, 1 reverse; teeth from 1 in order of meshing.
"""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gears3d.gears.deviation import FLANKS, GEARS, HarmonicDeviation, ProfileSlope, ProfileWave, ToothDeviation
from gears3d.records import Floats1, Floats2, Floats3, Floats4, Record

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair

DRIVE, LOOSE = 0, 1
ACTIVE, REVERSE = 0, 1
PATH, BASE_SUM, DISTANCE, DIRECTION = 0, 1, 2, 3
BASE, PITCH, ACTIVE_START, REVERSE_START, FORM_ROLL, TIP_ROLL = 0, 1, 2, 3, 4, 5
TURN = 2.0 * pi
ROOT_RELIEF, TIP_RELIEF = 6, 10
START, REACH, AMOUNT, POWER = 0, 1, 2, 3
ACTIVE_PROFILE, PROFILE_REACH, FLOOR = 14, 15, 16
LEAST_TURN = 0.2
"""How much the normal of a flank that is not perfect turns at least for one unit of roll: 1 on the involute."""


class Flanks(Record):
    """The flanks of a pair as arrays that compiled functions take.

    Args:
        mount: working length between the base circles, sum of the base radii, centre distance [m] and direction of
            the line of action's normal [rad] that the flanks are made for, (4,).
        gears: for each gear base radius [m], angle between teeth with the sign of its rotation [rad], normal direction
            at the start of tooth 1's active and reverse involute [rad], roll angles of form circle and tip [rad]; of
            root and tip relief start and length in roll angle [rad], amount at the end [m] and power; roll angle at the
            start of the active profile and from there to the tip, and from where on the active and reverse flanks are
            regular with their profile deviations [rad], (2, 18).
        harmonics: order, amplitude [m], phase [rad] for each gear and flank, (2, 2, n, 3).
        offsets: constant material of each tooth [m], (2, 2, teeth).
        slopes: profile slope of each tooth [m]; nothing where no profile deviates, (2, 2, teeth or 0).
        waves: amplitude [m], circular waves by roll angle [rad/rad], phase [rad] and tooth, 0 for all, of the waves of
            profiles, for each gear and flank (2, 2, n, 4).
        turned: by how much the sections are turned on about +z in their gears [rad], (2,): a harmonic deviation is a
            function of the gear's angle at the moment of touching, and a section that stands ahead of its gear by some
            angle meets what it shall impose at an angle that much larger.
        shaped: address of the support function of flanks that are no perfect involutes; 0 where all are.
    """

    mount: Floats1
    gears: Floats2
    harmonics: Floats4
    offsets: Floats3
    slopes: Floats3
    waves: Floats4
    turned: Floats1
    shaped: int


def steepness(slopes: NDArray[np.float64], waves: NDArray[np.float64], reach: float) -> tuple[float, float, float]:
    """Return bounds on slope and bend by roll angle and on the size of a flank's profile deviations, over all teeth.

    Args:
        slopes: as in :class:`Flanks`, of one flank.
        waves: as in :class:`Flanks`, of one flank.
        reach: from the start of the active profile to the tip [rad].

    Returns:
        Largest slope [m/rad], bend [m/rad²] and material [m].
    """
    slope = float(np.max(np.abs(slopes), initial=0.0))
    size, number = np.abs(waves[:, 0]), waves[:, 1]
    return slope / reach + float(size @ number), float(size @ number**2), 0.5 * slope + float(size.sum())


def profiles(pair: Pair, gears: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sort the deviations of profiles by gear, flank and tooth."""
    found = [d for d in pair.deviations if isinstance(d, ProfileSlope | ProfileWave)]
    slopes = np.zeros((2, 2, max(pair.drive.teeth, pair.loose.teeth) if found else 0))
    lists: list[list[list[list[float]]]] = [[[], []], [[], []]]
    for each in found:
        gear, flank = GEARS.index(each.gear), FLANKS.index(each.flank)
        if isinstance(each, ProfileSlope):
            slopes[gear, flank, slice(None) if each.tooth is None else each.tooth - 1] += each.amount
        else:
            number = TURN * each.waves / gears[gear, PROFILE_REACH]
            lists[gear][flank].append([each.amplitude, number, each.phase, float(each.tooth or 0)])
    return slopes, _table(lists, 4)


def _table(lists: list[list[list[list[float]]]], width: int) -> NDArray[np.float64]:
    """Return lists of rows for each gear and flank as one array, filled up with zeros."""
    table = np.zeros((2, 2, max(len(rows) for gear in lists for rows in gear), width))
    for gear in (0, 1):
        for flank in (0, 1):
            for place, entry in enumerate(lists[gear][flank]):
                table[gear, flank, place] = entry
    return table


def deviations(pair: Pair) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sort the deviations by gear and flank; an absent harmonic has amplitude 0."""
    lists: list[list[list[list[float]]]] = [[[], []], [[], []]]
    offsets = np.zeros((2, 2, max(pair.drive.teeth, pair.loose.teeth)))
    for deviation in pair.deviations:
        gear, flank = GEARS.index(deviation.gear), FLANKS.index(deviation.flank)
        if isinstance(deviation, HarmonicDeviation):
            lists[gear][flank].append([float(deviation.order), deviation.amplitude, deviation.phase])
        elif isinstance(deviation, ToothDeviation):
            offsets[gear, flank, deviation.tooth - 1] += deviation.offset
    return _table(lists, 3), offsets


def relief_starts(flanks: Flanks, gear: int) -> NDArray[np.float64]:
    """Return the roll angles at which the reliefs of a gear start [rad], ascending, those that there are.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
    """
    starts = flanks.gears[gear, [ROOT_RELIEF + START, TIP_RELIEF + START]]
    return starts[np.isfinite(starts)]
