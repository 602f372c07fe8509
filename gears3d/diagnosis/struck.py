"""Protruding teeth, at which no flank was estimated: path corners of equal distance on a single tooth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.channels import VelocityJumps
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import GEARS, NEGLIGIBLE, REACH, SIDES, Gear, over_tooth, pitches_from
from gears3d.effects import catalogue

if TYPE_CHECKING:
    from gears3d.gears import Pair

Array = np.ndarray
# Probability, anywhere in the search, below which a number of corners off the flank on one tooth is significant.
CHANCE = 1e-6
# Minimum distance of a corner from its flank, in standard deviations.
OFF = 8.0
# Ratio of the displacement to the thickness of a tooth above which its corners determine the thickness.
WHOLE = 0.9
# Minimum number of corners on a tooth for its thickness.
FEWEST = 4
# Largest median deviation of the corners from the thickness, relative to it.
ALIKE = 0.1
# Minimum fraction of deviating corners on a tooth; with fewer, the tooth does not protrude.
MOSTLY = 0.5


def outward(flank: int) -> float:
    """Return the sign of a pitch error with a positive deviation on a flank, towards the other gear.

    flank: 0 active, 1 reverse.

    >>> outward(0), outward(1)
    (1.0, -1.0)
    """
    return 1.0 if flank == 0 else -1.0


def struck(records: Sequence[Evidence]) -> tuple[Any, ...]:
    """Return the pitch error of the protruding tooth, with its size; none without one.

    A gear that bounces off a protruding tooth is never at rest there, but always rebounds at the same height. This
    needs no estimated flights or flanks.
    """
    if not (found := [one for one in _teeth(records) if one.chance < CHANCE]):
        return ()
    best = max(found, key=lambda one: one.worth)
    sign = outward(best.flank) * (1.0 if best.out else -1.0)
    return (
        catalogue()["pitch_error"](offset=sign * best.size, tooth=best.tooth, gear=best.gear, flank=SIDES[best.flank]),
    )


class _Tooth(NamedTuple):
    """Tooth with deviating corners: surplus of those that agree, probability, distance [m], sign."""

    worth: int
    chance: float
    size: float
    gear: Gear
    tooth: int
    flank: int
    out: bool


def _seen(records: Sequence[Evidence]) -> VelocityJumps:
    """Return the corners of all records."""
    return VelocityJumps(
        *(np.concatenate(column) for column in zip(*(one.channels.velocity_jumps for one in records), strict=True))
    )


def _on(seen: VelocityJumps, pair: Pair, which: tuple[Gear, int, int, bool]) -> tuple[Array, ...]:
    """Return thicknesses by the corners on a tooth, whether these deviate, and which of all deviate and miss it."""
    gear, tooth, flank, out = which
    mine = (seen.flank == flank) & np.isfinite(seen.off)  # a flank without an estimate has no place
    own = (seen.drive if gear == "drive" else seen.loose)[mine]
    shape = over_tooth(pair, gear, tooth, SIDES[flank], NEGLIGIBLE if out else -NEGLIGIBLE, own) / NEGLIGIBLE
    whole = np.abs(shape) > WHOLE
    size, sigma = seen.off[mine][whole] / shape[whole], seen.sigma[mine]
    return size, size > OFF * sigma[whole], np.abs(seen.off[mine]) > OFF * sigma, shape == 0.0


def _teeth(records: Sequence[Evidence]) -> Iterator[_Tooth]:
    """Generate the teeth on which enough corners agree."""
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


def without_teeth(one: Evidence, teeth: Sequence[Any]) -> Evidence:
    """Return a record without the impacts where single teeth are in mesh, on either flank.

    Such a tooth makes the gear rebound between both flanks so fast that readings show one impact.
    """
    kept: dict[str, Any] = {}
    for name in ("impacts", "censored_impacts"):
        seen = getattr(one.channels, name)
        turned = [pitches_from(one.pair, each.gear, each.tooth, getattr(seen, each.gear)) for each in teeth]
        far = np.all(np.abs(turned) > REACH, axis=0)
        kept[name] = type(seen)(*(column[far] for column in seen))
    out = len(one.channels.impacts.time) - len(kept["impacts"].time)
    left_out = {**one.channels.left_out, "impact": one.channels.left_out.get("impact", 0) + out}
    return replace(one, channels=one.channels._replace(**kept, left_out=left_out))
