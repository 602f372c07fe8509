"""Teeth with a negative deviation, from path corners: the gear reverses beyond the flank while that tooth is in mesh.

If few contact episodes reach a flank, and the gear never rests on it, corners are the only observation. They identify
the tooth, but bound its depth only from below: gears approach no further than neighbouring teeth allow, and a corner is
rounded by the averaging time of the readings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import SHOWS, Candidate
from gears3d.diagnosis.cause import Cause, begin, significance
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import GEARS, SIDES, Gear, Side, over_tooth
from gears3d.diagnosis.search import EXCLUDED, Rival
from gears3d.diagnosis.struck import outward
from gears3d.effects import catalogue
from gears3d.units import show

Array = np.ndarray
# Depth of a missing tooth [m].
MISSING = 1.0
# Tried depths, relative to the backlash.
DEPTHS = tuple(np.geomspace(0.003, 0.6, 200))
# Largest chi-square of a corner: a wrongly segmented path may have it anywhere.
HELD = 64.0
# Minimum chi-square gain of a tooth, above that of a single corner, and the same without the best record: without a
# short tooth the largest gain is at most 25 % of that (tests/diagnosis/test_pockets.py).
LEAST, OTHERS = 70.0, 30.0
# Minimum ratio of its gain to that of any tooth elsewhere on its flank.
SINGLE = 2.0
# Minimum number of improved corners of a tooth, each moved by at least that many standard deviations.
FEWEST, CLEAR = 3, 3.0
# Distance in pitches beyond which a neighbouring tooth is distinguishable.
AWAY = 3
# Fall of the gain from its maximum with a probability of 5 % (chi-square, one degree of freedom).
FALL = 3.84


class Pocket(NamedTuple):
    """A tooth with a negative deviation beyond the observed approach of the gears.

    Args:
        effect: pitch error of the least possible depth.
        gain: in chi-square.
        why: reason for the identification, a sentence without a stop.
        others: teeth that corners do not exclude in its place: at a ratio of 1 the tooth that it always meets.
    """

    effect: Any
    gain: float
    why: str
    others: tuple[Rival, ...] = ()


class _Tooth(NamedTuple):
    """Tooth of a gear, its gain, least depth [m], corners that it moves clearly, gain in all records but the best."""

    gain: float
    gear: Gear
    side: Side
    tooth: int
    depth: float
    corners: int
    others: float

    @property
    def clear(self) -> bool:
        """Whether it is significant."""
        return self.gain > LEAST and self.corners >= FEWEST


def pocket(records: Sequence[Evidence]) -> Pocket | None:
    """Return the short tooth from path corners with its least depth; ``None`` without one."""
    found = sorted(_teeth(records), key=lambda one: -one.gain)
    if not found or not found[0].clear or found[0].others < OTHERS:
        return None
    best = found[0]
    if any(SINGLE * one.gain > best.gain for one in found[1:] if _elsewhere(records[0], one, best)):
        return None
    unit = records[0].rig.backlash
    others = tuple(
        Rival((as_cause(_effect(one), unit),), best.gain - one.gain, False)
        for one in found[1:]
        if best.gain - one.gain < EXCLUDED
    )
    why = (
        f"{best.corners} impacts on the {best.side} flank at this tooth, and at no other of its gear, lie behind the"
        f" flank: negative tooth deviation of at least {show(best.depth, 'length', 3)}; total significance"
        f" {significance(best.gain)}"
    )
    return Pocket(_effect(best), best.gain, why, others)


def as_cause(tooth: Any, unit: float) -> Cause:
    """Return a pitch error as a cause with its size.

    unit: [m].
    """
    shape = {"gear": tooth.gear, "tooth": tooth.tooth, "flank": tooth.flank}
    candidate = Candidate(tooth.kind, shape, "offset", unit, False, SHOWS[tooth.place])
    return begin(candidate, np.array([tooth.offset / unit]))


def _effect(one: _Tooth) -> Any:
    """Return a short tooth as a pitch error of its least depth."""
    offset = -outward(SIDES.index(one.side)) * one.depth
    return catalogue()["pitch_error"](offset=offset, tooth=one.tooth, gear=one.gear, flank=one.side)


def on_both(records: Sequence[Evidence], effect: Any) -> Any:
    """Return a pitch error on both flanks if path corners indicate it, else unchanged.

    A displaced tooth has a positive deviation on the flank where it is detected, and a negative one on the other.
    """
    found = _behind(records, effect) if may_be_on_both(effect) else None
    return replace(effect, flank="both") if found is not None and found.clear else effect


def may_be_on_both(effect: Any) -> bool:
    """Whether a pitch error is positive on one flank; a negative one there implies impacts on the other flank."""
    return effect.flank != "both" and effect.offset * outward(SIDES.index(effect.flank)) > 0.0


def denied(records: Sequence[Evidence], effect: Any) -> bool:
    """Whether path corners contradict a negative deviation on the other flank of a tooth with a positive one."""
    found = _behind(records, effect)
    return found is not None and found.gain < 0.0


def _behind(records: Sequence[Evidence], effect: Any) -> _Tooth | None:
    """Return the gain of corners on a tooth's other flank by the opposite deviation there."""
    seen = _Corners(records, 1 - SIDES.index(effect.flank))
    return seen.tooth(effect.gear, effect.tooth, np.array([abs(effect.offset)]))


class _Corners:
    """Corners of all records on one flank.

    Args:
        records: all.
        flank: 0 active, 1 reverse.
    """

    def __init__(self, records: Sequence[Evidence], flank: int) -> None:
        self.pair = records[0].pair
        self.side: Side = SIDES[flank]
        drive, loose, off, sigma, owner = zip(*(_of(one, flank, k) for k, one in enumerate(records)), strict=True)
        self.angles = {"drive": np.concatenate(drive), "loose": np.concatenate(loose)}
        self.off, self.sigma, self.owner = np.concatenate(off), np.concatenate(sigma), np.concatenate(owner)
        self.before = np.minimum((self.off / self.sigma) ** 2, HELD)

    def tooth(self, gear: Gear, tooth: int, depths: Array) -> _Tooth | None:
        """Return the gain of a short tooth at its best depth; ``None`` with too few corners.

        depths: tried, increasing [m], (k,).
        """
        deepest = over_tooth(self.pair, gear, tooth, self.side, -MISSING, self.angles[gear])
        at = np.flatnonzero(deepest)
        if at.size < FEWEST:
            return None
        moved = np.sign(deepest[at]) * np.minimum(depths[:, None], np.abs(deepest[at]))
        after = np.minimum(((self.off[at] - moved) / self.sigma[at]) ** 2, HELD)
        gains = np.sum(self.before[at] - after, axis=1)
        best = int(np.argmax(gains))
        own = np.bincount(self.owner[at], self.before[at] - after[best])
        least = int(np.flatnonzero(gains > gains[best] - FALL)[0])
        near = (np.abs(moved[best]) > CLEAR * self.sigma[at]) & (after[best] < self.before[at])
        count = int(np.count_nonzero(near))
        others = float(gains[best] - np.max(own))
        return _Tooth(float(gains[best]), gear, self.side, tooth, float(depths[least]), count, others)


def _of(one: Evidence, flank: int, number: int) -> tuple[Array, ...]:
    """Return both angles, distance from the flank, its error, and the record's number of each of its corners.

    Errors are those of most corners: at a wrongly estimated flank, all deviate.
    """
    seen = one.channels.velocity_jumps
    mine = (seen.flank == flank) & np.isfinite(seen.off)
    off, sigma = seen.off[mine], seen.sigma[mine]
    off = off - np.median(off) if off.size else off
    usual = 1.4826 * float(np.median(np.abs(off) / sigma)) if off.size else 1.0
    return seen.drive[mine], seen.loose[mine], off, sigma * max(usual, 1.0), np.full(off.size, number)


def _teeth(records: Sequence[Evidence]) -> Iterator[_Tooth]:
    """Generate the teeth that gain with a negative deviation."""
    pair = records[0].pair
    depths = np.array(DEPTHS) * pair.backlash
    for seen in (_Corners(records, flank) for flank in (0, 1)):
        for gear in GEARS:
            for tooth in range(1, pair.gear(gear).teeth + 1):
                if (found := seen.tooth(gear, tooth, depths)) is not None:
                    yield found


def _elsewhere(one: Evidence, this: _Tooth, that: _Tooth) -> bool:
    """Whether two teeth are of one gear and flank, and not neighbours."""
    teeth = one.pair.gear(that.gear).teeth
    apart = (this.tooth - that.tooth) % teeth
    return (this.gear, this.side) == (that.gear, that.side) and min(apart, teeth - apart) > AWAY
