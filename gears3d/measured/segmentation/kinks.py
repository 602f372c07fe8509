"""Velocity jumps of a path: where, and by how much. An impact is one; the loss of contact is not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.measured.segmentation.smoothing import Blocks

# Blocks to either side.
SCALES = (3, 6, 12, 24, 48)
# How many of these are used at first: longer ones detect weaker jumps and merge neighbours.
USUAL = 4
# Standard deviations of a jump from which on it is used to find flanks.
SURE = 7.0
# Standard deviations from which a longer reach is not used: it would merge neighbouring jumps.
PLAIN = 2.0 * SURE
# Part of its size that a jump keeps at half the reach, and again at half of that; a smooth curve keeps 1/8.
SHARP = 0.6
# Blocks from which on the scatter about the model is known to 25 %: eight degrees of freedom.
LEFT = 13
# Standard deviations by which noise may hide the jump at shorter reaches than half.
NOISY = 3.0


class Kinks(NamedTuple):
    """Significant velocity jumps of a path.

    Args:
        at: index of the block, (k,).
        jump: of the speed, above 0 when pushed off the active flank [m/s], (k,).
        place: of the path there [m], (k,).
    """

    at: np.ndarray
    jump: np.ndarray
    place: np.ndarray


def templates(reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the weights that estimate the jump of slope and the place at the middle of 2·reach + 1 points.

    The model is a cubic with a jump of slope in the middle, so that a smooth curve does not count.

    >>> jump, place = templates(4)
    >>> at = np.arange(-4.0, 5.0)
    >>> round(float(jump @ (3.0 * np.abs(at) + at**2)), 9), round(float(place @ (7.0 + np.abs(at))), 9)
    (6.0, 7.0)
    """
    at = np.arange(-reach, reach + 1) / reach
    even = np.column_stack([np.ones_like(at), at**2, np.abs(at)])
    inverse = np.linalg.pinv(even)
    return 2.0 * inverse[2] / reach, inverse[0]


def kinks(path: Blocks, scales: int = USUAL) -> Kinks:
    """Return the significant velocity jumps that are sharp, one within two reaches of it at most."""
    count = len(path.time)
    best, jumps, places = np.zeros(count), np.zeros(count), np.zeros(count)
    reaches = np.zeros(count, int)
    finer: list[tuple[np.ndarray, float]] = []
    width = np.gradient(path.time) if count > 1 else np.ones(count)
    for reach in SCALES[:scales]:
        if 4 * reach >= count:
            break
        slope, level = templates(reach)
        jump = np.convolve(path.place, slope[::-1], "same")
        standard = np.abs(jump) / (_left(path, reach) * np.linalg.norm(slope))
        standard[:reach] = standard[-reach:] = 0.0
        standard[np.abs(jump) < 2.0 * path.slack * np.abs(slope).max()] = 0.0  # the possible error of one block
        sharp = np.ones(count, bool)
        for levels, (shorter, sigma) in enumerate(reversed(finer), 1):
            least = SHARP**levels * np.abs(jump) - (NOISY * sigma if levels > 1 else 0.0)
            sharp &= shorter * np.sign(jump) > least
        better = (standard > best) & sharp & (best < PLAIN)
        best[better], jumps[better], reaches[better] = standard[better], jump[better], reach
        places[better] = np.convolve(path.place, level[::-1], "same")[better]
        finer.append((jump, path.noise * float(np.linalg.norm(slope))))
    found = _peaks(best, jumps / width, places, reaches)
    return Kinks(*(column[_turns_away(path, found, reaches[found.at])] for column in found))


def _left(path: Blocks, reach: int) -> np.ndarray:
    """Return the standard deviation of a block by noise and by the misfit of the model about each block, (m,).

    The misfit is smooth: of any number of blocks as many are independent as in the shortest window that shows it.
    """
    count = 2 * reach + 1
    if count < LEFT:
        return np.full(len(path.place), path.noise)
    at = np.arange(-reach, reach + 1) / reach
    base = np.linalg.qr(np.column_stack([np.ones_like(at), at, at**2, at**3, np.abs(at)]))[0]
    middle = path.place - np.median(path.place)
    rest = np.convolve(middle**2, np.ones(count), "same")
    for column in base.T:
        rest -= np.convolve(middle, column[::-1], "same") ** 2
    missed = np.maximum(rest / (count - base.shape[1]) - path.noise**2, 0.0)
    return np.sqrt(path.noise**2 + missed * count / LEFT)


def _turns_away(path: Blocks, found: Kinks, reach: np.ndarray) -> np.ndarray:
    """Return whether the path stays, before and after each jump, on the side to which its speed jumps, (k,)."""
    good = np.ones(len(found.at), bool)
    for part in (reach, reach // 2):
        sides = [path.place[np.clip(found.at + way, 0, len(path.place) - 1)] - found.place for way in (-part, part)]
        away = np.stack(sides) * np.sign(found.jump)
        good &= away.min(axis=0) > -5.0 * path.noise - 0.2 * np.maximum(away.max(axis=0), 0.0)
    return good


def _peaks(standard: np.ndarray, jump: np.ndarray, place: np.ndarray, reach: np.ndarray) -> Kinks:
    """Keep jumps without a stronger one nearby: of the same sign within two reaches, of the other within one.

    A jump makes weaker ones of the other sign within its reach; farther ones are impacts on the other flank.
    """
    sure = np.flatnonzero(standard > SURE)
    order = sure[np.argsort(-standard[sure])]
    taken = np.zeros((2, len(standard)), bool)
    kept = []
    for k in order:
        own = int(jump[k] < 0.0)
        if not taken[own, k]:
            kept.append(k)
            for sign, wide in ((own, 2 * reach[k]), (1 - own, reach[k])):
                taken[sign, max(k - wide, 0) : k + wide + 1] = True
    at = np.sort(np.array(kept, int))
    return Kinks(at, jump[at], place[at])
