"""Teeth that are struck where no flank was drawn: corners of the path, all as far off, on one tooth and no other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.channels import Corners
from gears3d.diagnosis.deviation import BENT, Gear, Side, over_tooth
from gears3d.diagnosis.evidence import Evidence
from gears3d.effects import catalogue

if TYPE_CHECKING:
    from gears3d.gears import Pair

Array = np.ndarray
GEARS: tuple[Gear, ...] = ("drive", "loose")
SIDES: tuple[Side, Side] = ("active", "reverse")
CHANCE = 1e-6
"""Probability, anywhere in the search, below which so many corners off the flank on one tooth are no chance."""
OFF = 8.0
"""Standard deviations that a corner is off its flank by, at least."""
WHOLE = 0.9
"""Part of a tooth's thickness by which it moves the other gear where its corners tell how thick it is."""
FEWEST = 4
"""Corners on a tooth that tell its thickness."""
ALIKE = 0.1
"""Part of the thickness by which half of the corners may differ from it."""
MOSTLY = 0.5
"""Part of the corners on a tooth that must be off: where few are, it is no flank that they are off."""


def outward(flank: int) -> float:
    """Return the sign of a pitch error whose tooth stands out on a flank, towards the other gear.

    Args:
        flank: 0 active, 1 reverse.

    >>> outward(0), outward(1)
    (1.0, -1.0)
    """
    return 1.0 if flank == 0 else -1.0


def struck(records: Sequence[Evidence]) -> tuple[Any, ...]:
    """Return the pitch error of the tooth that is struck off the flanks, with its size; none where there is none.

    A tooth that stands out by more than the gear stays on it for is never seen at rest: the gear bounces off, always at
    the same height. Flights and flanks need no drawing for that.

    Args:
        records: all.
    """
    if not (found := [one for one in _teeth(records) if one.chance < CHANCE]):
        return ()
    best = max(found, key=lambda one: one.worth)
    sign = outward(best.flank) * (1.0 if best.out else -1.0)
    return (
        catalogue()["pitch_error"](offset=sign * best.size, tooth=best.tooth, gear=best.gear, flank=SIDES[best.flank]),
    )


class _Tooth(NamedTuple):
    """Tooth on which corners are off: how many more agree than do not, by what chance, how far [m], out or back."""

    worth: int
    chance: float
    size: float
    gear: Gear
    tooth: int
    flank: int
    out: bool


def _seen(records: Sequence[Evidence]) -> Corners:
    """Return the corners of all records."""
    return Corners(*(np.concatenate(column) for column in zip(*(one.channels.corners for one in records), strict=True)))


def _on(seen: Corners, pair: Pair, which: tuple[Gear, int, int, bool]) -> tuple[Array, ...]:
    """Return thicknesses that corners on a tooth tell, whether they are off, and whether those are on no such tooth."""
    gear, tooth, flank, out = which
    mine = (seen.flank == flank) & np.isfinite(seen.off)  # a flank that was not drawn is nowhere
    own = (seen.drive if gear == "drive" else seen.loose)[mine]
    shape = over_tooth(pair, gear, tooth, SIDES[flank], BENT if out else -BENT, own) / BENT
    whole = np.abs(shape) > WHOLE
    size, sigma = seen.off[mine][whole] / shape[whole], seen.sigma[mine]
    return size, size > OFF * sigma[whole], np.abs(seen.off[mine]) > OFF * sigma, shape == 0.0


def _teeth(records: Sequence[Evidence]) -> Iterator[_Tooth]:
    """Yield the teeth on which enough corners agree."""
    from scipy.stats import binom

    pair, seen = records[0].pair, _seen(records)
    sorts = list(product(GEARS, (0, 1), (True, False)))
    for gear, side, out in sorts:
        teeth = pair.gear(gear).teeth
        for tooth in range(1, teeth + 1):
            size, far, off, other = _on(seen, pair, (gear, tooth, side, out))
            if np.count_nonzero(far) < max(FEWEST, MOSTLY * len(far)):
                continue
            usual = float(np.median(size[far]))
            agreed = int(np.count_nonzero(np.abs(size[far] - usual) < ALIKE * usual))
            if agreed < MOSTLY * len(far):
                continue
            share = (np.count_nonzero(off & other) + 1.0) / (np.count_nonzero(other) + 2.0)
            chance = float(binom.sf(np.count_nonzero(far) - 1, len(far), share)) * len(sorts) * teeth
            yield _Tooth(2 * agreed - len(far), chance, usual, gear, tooth, side, out)
