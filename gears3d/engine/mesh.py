"""From Bullet's closest points to teeth, and from teeth to the gap on the true flanks."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from gears3d.gears.flank import Flanks, flank_gap

ACTIVE, REVERSE = 0, 1
NOBODY = -1
"""Stands for a tooth when a point lies on no flank that could touch its partner's."""
_PITCH, _ACTIVE_START, _REVERSE_START = 1, 2, 3


@njit(cache=True)
def side_gap(
    flanks: Flanks, teeth: np.ndarray, side: int, theta_drive: float, theta_loose: float
) -> tuple[float, float, float, int]:
    """Return the smallest gap of one side among the candidate teeth, measured on the true flanks.

    Args:
        flanks: of the pair.
        teeth: candidates (n, 3): tooth of the drive gear, tooth of the loose gear, side.
        side: 0 active, 1 reverse.
        theta_drive: angle of the drive gear [rad].
        theta_loose: angle of the loose gear [rad].

    Returns:
        Gap [m], its derivatives by the angles of drive and loose gear [m/rad], and the row of ``teeth`` it is for.
        Teeth whose contact would lie off the flanks count only when there are no others; without candidates the gap
        is infinite.
    """
    best, by_drive, by_loose, row = math.inf, 0.0, 0.0, NOBODY
    on_flank = False
    for i in range(teeth.shape[0]):
        if teeth[i, 2] != side:
            continue
        gap, drive, loose, _, _, _, _, valid = flank_gap(
            flanks, theta_drive, theta_loose, teeth[i, 0], teeth[i, 1], side
        )
        if (valid and not on_flank) or (valid == on_flank and gap < best):
            best, by_drive, by_loose, row, on_flank = gap, drive, loose, i, valid
    return best, by_drive, by_loose, row


@njit(cache=True)
def tooth_at(flanks: Flanks, gear: int, count: int, angle: float) -> tuple[int, int]:
    """Return the number of the tooth (1 to count) and its side at a polar angle.

    Args:
        flanks: of the pair.
        gear: 0 drive, 1 loose.
        count: how many teeth the gear has.
        angle: polar angle in the gear's own frame [rad].
    """
    pitch = flanks.gears[gear, _PITCH]
    middle = 0.5 * (flanks.gears[gear, _ACTIVE_START] + flanks.gears[gear, _REVERSE_START])
    place = (middle - angle) / pitch
    tooth = int(np.rint(place))
    beside = (tooth - place) * pitch
    return tooth % count + 1, ACTIVE if beside > 0.0 else REVERSE


@njit(cache=True)
def teeth_of_points(
    flanks: Flanks,
    counts: tuple[int, int],
    on_drive: np.ndarray,
    on_loose: np.ndarray,
    theta_drive: float,
    theta_loose: float,
) -> np.ndarray:
    """Return which teeth, and which side of them, Bullet's closest points lie on.

    Args:
        flanks: of the pair.
        counts: numbers of teeth of drive and loose gear.
        on_drive: points on the drive gear in the world (n, 3) [m].
        on_loose: points on the loose gear (n, 3) [m].
        theta_drive: angle of the drive gear [rad].
        theta_loose: angle of the loose gear [rad].

    Returns:
        (n, 3): tooth of the drive gear, tooth of the loose gear, side; NOBODY as side where the two do not match.
    """
    distance = flanks.mount[2]
    found = np.zeros((on_drive.shape[0], 3), np.int64)
    for i in range(on_drive.shape[0]):
        angle = math.atan2(on_drive[i, 1], on_drive[i, 0]) - theta_drive
        found[i, 0], side = tooth_at(flanks, 0, counts[0], angle)
        angle = math.atan2(on_loose[i, 1], on_loose[i, 0] - distance) - math.pi + theta_loose
        found[i, 1], mate = tooth_at(flanks, 1, counts[1], angle)
        found[i, 2] = side if side == mate else NOBODY
    return found


@njit(cache=True)
def with_neighbours(found: np.ndarray, counts: tuple[int, int]) -> np.ndarray:
    """Return the tooth pairs found and those that mesh just before and after them, each once, (m, 3)."""
    teeth = np.zeros((3 * found.shape[0], 3), np.int64)
    size = 0
    for shift in (0, -1, 1):
        for i in range(found.shape[0]):
            if found[i, 2] == NOBODY:
                continue
            drive = (found[i, 0] - 1 + shift) % counts[0] + 1
            loose = (found[i, 1] - 1 + shift) % counts[1] + 1
            known = False
            for j in range(size):
                same = teeth[j, 0] == drive and teeth[j, 1] == loose and teeth[j, 2] == found[i, 2]
                known = known or same
            if not known:
                teeth[size, 0], teeth[size, 1], teeth[size, 2] = drive, loose, found[i, 2]
                size += 1
    return teeth[:size].copy()


@njit(cache=True)
def able_to_touch(flanks: Flanks, teeth: np.ndarray, theta_drive: float, theta_loose: float, turn: float) -> np.ndarray:
    """Return the tooth pairs whose contact lies on both flanks now or after a turn to either side.

    A side on which there is none keeps all it has.

    Args:
        flanks: of the pair.
        teeth: candidates (n, 3).
        theta_drive: angle of the drive gear [rad].
        theta_loose: angle of the loose gear [rad].
        turn: of the drive gear [rad], less than the flanks stay in mesh.
    """
    ratio = flanks.gears[0, 0] / flanks.gears[1, 0]
    keep = np.zeros(teeth.shape[0], np.bool_)
    some = np.zeros(2, np.bool_)
    for i in range(teeth.shape[0]):
        side = teeth[i, 2]
        for sign in (0.0, 1.0, -1.0):
            drive, loose = theta_drive + sign * turn, theta_loose + sign * turn * ratio
            if not keep[i]:
                keep[i] = flank_gap(flanks, drive, loose, teeth[i, 0], teeth[i, 1], side)[7]
        some[side] = some[side] or keep[i]
    for i in range(teeth.shape[0]):
        keep[i] = keep[i] or not some[teeth[i, 2]]
    return teeth[keep]
