"""Teeth that stand back, by the corners of paths: the gear turns back beyond the flank while that tooth should carry.

Where few visits touch a flank, and none rests there, corners are all that is seen of it. They say which tooth it is
without any doubt, but its depth no better than that it is at least as deep: gears fall no further than neighbours let
them, and a corner is rounded off by the time over which readings are taken together.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import SHOWS, Candidate
from gears3d.diagnosis.cause import Cause, begin
from gears3d.diagnosis.deviation import Gear, Side, over_tooth
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.rivals import EXCLUDED, Rival
from gears3d.diagnosis.sentences import sure
from gears3d.diagnosis.struck import GEARS, SIDES, outward
from gears3d.effects import catalogue
from gears3d.units import show

Array = np.ndarray
MISSING = 1.0
"""Depth of a tooth that might as well not be there [m]."""
DEPTHS = tuple(np.geomspace(0.003, 0.6, 200))
"""Depths that are tried, as parts of the backlash."""
HELD = 64.0
"""Chi-square that a corner may be worth: where the path was cut wrongly, it is anywhere."""
LEAST, OTHERS = 70.0, 30.0
"""Chi-square that a tooth must gain, more than a corner may be worth, and where none is known without the best record:
where no tooth stands back, the best of all comes to a quarter of that at most (tests/diagnosis/test_pockets.py)."""
SINGLE = 2.0
"""Times what any tooth elsewhere on its flank would gain that a single one must."""
FEWEST, CLEAR = 3, 3.0
"""Corners that a tooth must bring nearer, where it moves them by so many standard deviations."""
AWAY = 3
"""Pitches from a tooth to where its neighbours no longer pass for it."""
FALL = 3.84
"""Fall of the gain from its top, of which only chance has more in one of twenty (chi-square, one degree of freedom)."""


class Pocket(NamedTuple):
    """A tooth that stands back, further than the gear was seen to fall there.

    Args:
        effect: pitch error as deep as it is at least.
        gain: in chi-square.
        why: it is held for one, a sentence without a stop.
        others: teeth that corners do not exclude in its place: at a ratio of 1 the one that it always meets.
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
        """Whether it is no chance."""
        return self.gain > LEAST and self.corners >= FEWEST


def pocket(records: Sequence[Evidence]) -> Pocket | None:
    """Return the tooth that stands back by the corners of paths, as deep as it is at least; ``None`` if none does.

    Args:
        records: all, cut without that tooth.
    """
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
        f" {sure(best.gain)}"
    )
    return Pocket(_effect(best), best.gain, why, others)


def as_cause(tooth: Any, unit: float) -> Cause:
    """Return a pitch error as a cause with its size.

    Args:
        tooth: the pitch error.
        unit: of its size [m].
    """
    shape = {"gear": tooth.gear, "tooth": tooth.tooth, "flank": tooth.flank}
    candidate = Candidate(tooth.kind, shape, "offset", unit, False, SHOWS[tooth.place])
    return begin(candidate, np.array([tooth.offset / unit]))


def _effect(one: _Tooth) -> Any:
    """Return a tooth that stands back as a pitch error, as deep as it is at least."""
    offset = -outward(SIDES.index(one.side)) * one.depth
    return catalogue()["pitch_error"](offset=offset, tooth=one.tooth, gear=one.gear, flank=one.side)


def on_both(records: Sequence[Evidence], effect: Any) -> Any:
    """Return a pitch error that is on both flanks where corners of paths say so; as it was where they do not.

    A tooth out of step stands out on one flank, where it is seen, and as far back on the other.

    Args:
        records: all.
        effect: pitch error, with its size.
    """
    found = _behind(records, effect) if may_be_on_both(effect) else None
    return replace(effect, flank="both") if found is not None and found.clear else effect


def may_be_on_both(effect: Any) -> bool:
    """Whether a pitch error stands out on one flank; one that stands back there would throw the gear off the other.

    Args:
        effect: pitch error, with its size.
    """
    return effect.flank != "both" and effect.offset * outward(SIDES.index(effect.flank)) > 0.0


def denied(records: Sequence[Evidence], effect: Any) -> bool:
    """Whether corners of paths speak against a tooth that stands out on one flank standing back on the other.

    Args:
        records: all.
        effect: pitch error of one flank, with its size.
    """
    found = _behind(records, effect)
    return found is not None and found.gain < 0.0


def _behind(records: Sequence[Evidence], effect: Any) -> _Tooth | None:
    """Return what corners on a tooth's other flank gain where it stands back as far as it stands out on its own."""
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
        """Return what a tooth that stands back gains at the best of some depths; ``None`` where too few corners are.

        Args:
            gear: whose tooth it is.
            tooth: its number.
            depths: that are tried, growing [m], (k,).
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

    Errors are those that most of its corners have: where a flank was drawn wrongly, all are off.
    """
    seen = one.channels.corners
    mine = (seen.flank == flank) & np.isfinite(seen.off)
    off, sigma = seen.off[mine], seen.sigma[mine]
    off = off - np.median(off) if off.size else off
    usual = 1.4826 * float(np.median(np.abs(off) / sigma)) if off.size else 1.0
    return seen.drive[mine], seen.loose[mine], off, sigma * max(usual, 1.0), np.full(off.size, number)


def _teeth(records: Sequence[Evidence]) -> Iterator[_Tooth]:
    """Yield the teeth that would gain anything by standing back."""
    pair = records[0].pair
    depths = np.array(DEPTHS) * pair.backlash
    for seen in (_Corners(records, flank) for flank in (0, 1)):
        for gear in GEARS:
            for tooth in range(1, pair.gear(gear).teeth + 1):
                if (found := seen.tooth(gear, tooth, depths)) is not None:
                    yield found


def _elsewhere(one: Evidence, this: _Tooth, that: _Tooth) -> bool:
    """Whether two teeth are of one gear and flank, and not beside each other."""
    teeth = one.pair.gear(that.gear).teeth
    apart = (this.tooth - that.tooth) % teeth
    return (this.gear, this.side) == (that.gear, that.side) and min(apart, teeth - apart) > AWAY
