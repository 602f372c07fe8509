"""Pitch errors: detection of protruding and short teeth, and the search with re-segmentation for them.

Segmentation estimates flanks of low orders. A tooth that deviates from these shows by velocity jumps of the path on it,
or by contact losses whenever it passes through mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from math import log, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import EXCLUDED, ONE_SIDED, SHOWS, Candidate, Cause, begin, fit, significance
from gears3d.diagnosis.channels import VelocityJumps
from gears3d.diagnosis.evidence import Evidence, Paths
from gears3d.diagnosis.prediction import (
    GEARS,
    NEGLIGIBLE,
    REACH,
    SIDES,
    Gear,
    Side,
    influence,
    over_tooth,
    pitches_from,
)
from gears3d.diagnosis.preprocessing import delay_of, preprocess
from gears3d.diagnosis.residual_patterns import Structure
from gears3d.diagnosis.residual_tests import fluctuation_orders
from gears3d.diagnosis.search import Rival, Search, aligned_search, keeping, on_both_flanks
from gears3d.effects import catalogue
from gears3d.errors import InputError
from gears3d.measured.noise import SUBHARMONICS
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.gears import Pair
    from gears3d.measured.checks import Admitted

Array = np.ndarray
# Maximum number of re-segmentations with the teeth found.
RESEGMENTATIONS = 2
# Maximum number of single teeth of the flanks in a re-segmentation.
MOST_TEETH = 2
# Probability, anywhere in the search, below which a number of velocity jumps off the flank on one tooth, or of contact
# ends at one place, is significant.
CHANCE = 1e-6
# Minimum distance of a velocity jump from its flank, in standard deviations.
OFF_FLANK = 8.0
# Ratio of the displacement to the thickness of a tooth above which its velocity jumps determine the thickness.
FULL_INFLUENCE = 0.9
# Minimum number of velocity jumps on a tooth for its thickness.
FEWEST_JUMPS = 4
# Largest median deviation of the velocity jumps from the thickness, relative to it.
AGREEMENT = 0.1
# Minimum fraction of deviating velocity jumps on a tooth; with fewer, the tooth does not protrude.
MOSTLY = 0.5
# Smallest reported probability, as the chi-square with 2 degrees of freedom.
SMALLEST_CHANCE = 1e-300
# Bins per pitch; a window has as many.
BINS_PER_PITCH = 2
# Distance in pitches beyond which another tooth, or a second place with as many contact ends, is distinguishable: an
# order of the gear has several places.
AWAY = 3
# Displacement of the other gear, relative to the thickness of a tooth, at which the contact loss begins.
LOSS_BEGINS = 0.02
# Depth of a missing tooth [m].
MISSING_DEPTH = 1.0
# Tried depths, relative to the backlash.
TRIED_DEPTHS = tuple(np.geomspace(0.003, 0.6, 200))
# Largest chi-square of a velocity jump: a wrongly segmented path may have it anywhere.
CLIPPED = 64.0
# Minimum chi-square gain of a tooth, above that of a single velocity jump, and the same without the best record:
# without a short tooth the largest gain is at most 25 % of that (tests/diagnosis/test_pockets.py).
SHORT_GAIN, SHORT_GAIN_OF_OTHERS = 70.0, 30.0
# Minimum ratio of its gain to that of any tooth elsewhere on its flank.
SINGLE = 2.0
# Minimum number of improved velocity jumps of a tooth, each moved by at least that many standard deviations.
FEWEST_IMPROVED, CLEARLY_MOVED = 3, 3.0
# Fall of the gain from its maximum with a probability of 5 % (chi-square, one degree of freedom).
DEPTH_FALL = 3.84


def single_teeth(found: Search) -> tuple[Any, ...]:
    """Return the pitch errors among the causes of a search, by gear, tooth and sign."""
    effects = [cause.effect for cause in found.fit.causes if cause.candidate.kind == "pitch_error"]
    kept = {(one.gear, one.tooth, one.offset > 0.0): one for one in effects if one is not None}
    return tuple(kept[key] for key in sorted(kept)[:MOST_TEETH])


def search_with_resegmentation(
    admitted: Sequence[Admitted],
    records: list[Evidence],
    highest: int,
    paths: Paths | None = None,
    tell: Callable[[str, float], None] = lambda doing, part: None,
) -> tuple[list[Evidence], Search, ShortTooth | None]:
    """Return the records as a search used them, its result, and a short tooth out of reach.

    A delay of the encoders moves the flanks with the speed, and impacts with them: if the sensor gate missed it, it is
    removed from the records once it is known. A tooth with a positive deviation is not where flanks of low orders are
    estimated, and corrupts the segmentation of events on it: the records are re-segmented with a flank that may have
    it, and searched again.
    """
    known: tuple[Any, ...] = ()
    tell("searching for causes", 0.6)
    came, delay = {one.file: one for one in admitted}, delay_of(admitted)
    records, found = aligned_search(records, highest)
    if delay == 0.0 and (late := _found_delay(found)):
        tell("repeating the segmentation without encoder delay", 0.62)
        timely = aligned_search([_resegmented(came[one.name], one, late, (), paths) for one in records], highest)
        if _found_delay(timely[1]):
            delay, (records, found) = late, timely
    short, before = None if protruding_tooth(records) else short_tooth(records), (records, found)
    beyond = () if short is None else (short.effect,)
    for _ in range(RESEGMENTATIONS):
        teeth = (*known, *_unknown_teeth(known, protruding_tooth(records))) or beyond or single_teeth(found)
        teeth = tuple(on_both(records, one) for one in teeth)
        if _identities(teeth) <= _identities(known):
            break
        known = teeth[:MOST_TEETH]
        tell("repeating the segmentation with single tooth deviations", 0.65)
        records = [_resegmented(came[one.name], one, delay, known, paths) for one in records]
        tell("searching for causes", 0.7)
        records, found = aligned_search(
            records, highest, [as_cause(one, records[0].rig.backlash) for one in known if short is None]
        )
    named = _identities(single_teeth(found)) | _identities(single_teeth(before[1]))
    if short is None and not named & _identities(known):
        return *before, None  # the candidate is not a tooth
    if short is not None:  # the search finds a depth that contradicts the observed approach
        found = keeping(found, [one for one in found.fit.causes if one.candidate.kind != "pitch_error"])
    return records, whole_teeth(found), short


def whole_teeth(found: Search) -> Search:
    """Return a search whose single displaced teeth are on both flanks unless the records indicate one flank only."""
    causes = list(found.fit.causes)
    for k, cause in enumerate(found.fit.causes):
        effect = cause.effect
        for whole in on_both_flanks(cause.candidate):
            if effect is None or not may_be_on_both(effect) or contradicted_on_other_flank(found.records, effect):
                continue
            tried = fit(found.records, found.base, [*causes[:k], cause._replace(candidate=whole), *causes[k + 1 :]])
            if tried.chi2 < found.fit.chi2 + ONE_SIDED:
                causes, found = list(tried.causes), found._replace(fit=tried)
    return found


def _found_delay(found: Search) -> float:
    """Return the reading delay of the loose gear in a search [s], 0 without one."""
    late = [cause.effect for cause in found.fit.causes if cause.candidate.kind == "encoder_skew"]
    return sum(one.delay if one.gear == "loose" else -one.delay for one in late if one is not None)


def _unknown_teeth(known: Sequence[Any], found: Sequence[Any]) -> Sequence[Any]:
    """Return teeth that are not known already: further deviations of known ones come from segmentation."""
    there = {(one.gear, one.tooth) for one in known}
    return [one for one in found if (one.gear, one.tooth) not in there]


def _identities(teeth: Sequence[Any]) -> set[tuple[str, int, bool]]:
    return {(one.gear, one.tooth, one.offset > 0.0) for one in teeth}


def _resegmented(one: Admitted, before: Evidence, delay: float, teeth: Sequence[Any], paths: Paths | None) -> Evidence:
    """Return a record re-segmented with possible single teeth, without impacts there; unchanged if that fails."""
    try:
        made = preprocess(one, delay, teeth, paths, before.turned)
        return without_teeth(made, teeth) if teeth else made
    except InputError:
        return before


def outward(flank: int) -> float:
    """Return the sign of a pitch error with a positive deviation on a flank, towards the other gear.

    flank: 0 active, 1 reverse.

    >>> outward(0), outward(1)
    (1.0, -1.0)
    """
    return 1.0 if flank == 0 else -1.0


def protruding_tooth(records: Sequence[Evidence]) -> tuple[Any, ...]:
    """Return the pitch error of the protruding tooth, with its size; none without one.

    A gear that bounces off a protruding tooth is never at rest there, but always rebounds at the same height. This
    needs no estimated flights or flanks.
    """
    if not (found := [one for one in _protruding_teeth(records) if one.chance < CHANCE]):
        return ()
    best = max(found, key=lambda one: one.worth)
    sign = outward(best.flank) * (1.0 if best.out else -1.0)
    return (
        catalogue()["pitch_error"](offset=sign * best.size, tooth=best.tooth, gear=best.gear, flank=SIDES[best.flank]),
    )


class _ProtrudingTooth(NamedTuple):
    """Tooth with deviating velocity jumps: surplus of those that agree, probability, distance [m], sign."""

    worth: int
    chance: float
    size: float
    gear: Gear
    tooth: int
    flank: int
    out: bool


def _all_jumps(records: Sequence[Evidence]) -> VelocityJumps:
    """Return the velocity jumps of all records."""
    return VelocityJumps(
        *(np.concatenate(column) for column in zip(*(one.channels.velocity_jumps for one in records), strict=True))
    )


def _jumps_on(seen: VelocityJumps, pair: Pair, which: tuple[Gear, int, int, bool]) -> tuple[Array, ...]:
    """Return thicknesses by the jumps on a tooth, whether these deviate, and which of all jumps deviate and miss it."""
    gear, tooth, flank, out = which
    mine = (seen.flank == flank) & np.isfinite(seen.off)  # a flank without an estimate has no place
    own = (seen.drive if gear == "drive" else seen.loose)[mine]
    shape = over_tooth(pair, gear, tooth, SIDES[flank], NEGLIGIBLE if out else -NEGLIGIBLE, own) / NEGLIGIBLE
    whole = np.abs(shape) > FULL_INFLUENCE
    size, sigma = seen.off[mine][whole] / shape[whole], seen.sigma[mine]
    return size, size > OFF_FLANK * sigma[whole], np.abs(seen.off[mine]) > OFF_FLANK * sigma, shape == 0.0


def _protruding_teeth(records: Sequence[Evidence]) -> Iterator[_ProtrudingTooth]:
    """Generate the teeth on which enough velocity jumps agree."""
    from scipy.stats import binom

    pair, seen = records[0].pair, _all_jumps(records)
    sorts = list(product(GEARS, (0, 1), (True, False)))
    for gear, side, out in sorts:
        teeth = pair.gear(gear).teeth
        for tooth in range(1, teeth + 1):
            size, far, off, other = _jumps_on(seen, pair, (gear, tooth, side, out))
            if np.count_nonzero(far) < max(FEWEST_JUMPS, MOSTLY * len(far)):
                continue
            usual = float(np.median(size[far]))
            agreed = int(np.count_nonzero(np.abs(size[far] - usual) < AGREEMENT * usual))
            if agreed < MOSTLY * len(far):
                continue
            share = (np.count_nonzero(off & other) + 1.0) / (np.count_nonzero(other) + 2.0)
            chance = float(binom.sf(np.count_nonzero(far) - 1, len(far), share)) * len(sorts) * teeth
            yield _ProtrudingTooth(2 * agreed - len(far), chance, usual, gear, tooth, side, out)


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


# A tooth with a positive deviation larger than the drag can follow makes the loose gear leave whenever the tooth passes
# through mesh. No contact is then detected on it, and neighbouring events are segmented wrongly; but the place of the
# contact losses, revolution after revolution, identifies the tooth.


def tooth_synchronous_contact_loss(records: Sequence[Evidence], causes: Sequence[Any]) -> list[Structure]:
    """Return the unexplained tooth-synchronous contact loss if no pitch error is among the causes.

    At most one structure: its size is the fraction of the contacts that end there, its place the tooth.
    """
    if any(cause.candidate.kind == "pitch_error" for cause in causes):
        return []
    if (peak := _sharpest_peak(records)) is None:
        return []
    gain, tooth = -2.0 * log(max(peak.chance, SMALLEST_CHANCE)), float(_tooth_of(records[0], peak))
    return [Structure(f"contact.tooth_{peak.gear}", gain, peak.chance, peak.share, "1", tooth, gain)]


class _Peak(NamedTuple):
    """Place at which most contacts of a flank end: probability, place in pitches, and fraction of all ends."""

    chance: float
    place: float
    gear: Gear
    flank: int
    share: float


def _tooth_of(one: Evidence, peak: _Peak) -> int:
    """Return the tooth whose contact loss begins where contact ends."""
    at, moved = influence(one.pair, peak.gear, SIDES[peak.flank], NEGLIGIBLE)
    there = at[np.abs(moved) > LOSS_BEGINS * NEGLIGIBLE]
    return round(peak.place - float(there[0]) / (2.0 * pi)) % one.pair.gear(peak.gear).teeth + 1


def _sharpest_peak(records: Sequence[Evidence]) -> _Peak | None:
    """Return the place of contact ends of least probability; ``None`` if no place is significant."""
    found = [each for gear in GEARS for flank in (0, 1) if (each := _peak(records, gear, flank)) is not None]
    best = min(found, default=None)
    return best if best is not None and best.chance * len(found) < CHANCE else None


def _peak(records: Sequence[Evidence], gear: Gear, flank: int) -> _Peak | None:
    """Return the place at which most contacts of a flank end; ``None`` with too few of them."""
    from scipy.stats import binom

    teeth = records[0].pair.gear(gear).teeth
    ends, bins = [one.channels.contact_ends for one in records], BINS_PER_PITCH * teeth
    angles = [getattr(each, gear)[each.flank == flank] for each in ends]
    places = [np.mod(own * teeth / (2.0 * pi), teeth) for own in angles]
    orders = fluctuation_orders(records, gear)
    places = [
        each[np.unique(each.astype(int), return_index=True)[1]] if _is_locked(order, own, teeth) else each
        for each, order, own in zip(places, orders, angles, strict=True)
    ]
    counts = np.array([np.bincount((own * BINS_PER_PITCH).astype(int) % bins, minlength=bins) for own in places])
    windows = np.sum([np.roll(counts, -k, axis=1) for k in range(BINS_PER_PITCH)], axis=0)
    total, most = windows.sum(axis=0), windows.max(axis=0)
    sizes = np.array([len(own) for own in places])
    others = total - most if len(records) > 1 else total
    left = sizes.sum() - sizes[np.argmax(windows, axis=0)] if len(records) > 1 else np.full(len(total), sizes.sum())
    here = np.arange(len(total))
    apart = np.minimum(np.mod(here[:, None] - here, len(total)), np.mod(here - here[:, None], len(total)))
    elsewhere = np.where(apart >= AWAY * BINS_PER_PITCH, others / np.maximum(left, 1), 0.0).max(axis=1)
    usual = np.clip(np.maximum(1.0 / teeth, elsewhere), 0.0, 1.0)
    chances = binom.sf(others - 1, left, usual) * BINS_PER_PITCH * teeth
    best = int(np.argmin(chances))
    away = np.mod(np.concatenate(places) - best / BINS_PER_PITCH, teeth)
    if not (ends := away[away < 1.0]).size:
        return None
    return _Peak(
        float(chances[best]), best / BINS_PER_PITCH + float(np.median(ends)), gear, flank, ends.size / away.size
    )


def _is_locked(order: float, angle: Array, teeth: int) -> bool:
    """Return whether a motion repeats at the same places of a gear: ends of contact at one of them count as one.

    ``order``: periods in a revolution, 0 without; ``angle``: at ends of contact [rad], (n,).
    """
    if not order or not len(angle):
        return False
    turns = np.array(SUBHARMONICS) / order
    slips = np.abs(turns - np.round(turns)) / turns * float(np.ptp(angle)) / (2.0 * pi)
    return bool(np.any((np.round(turns) > 0.0) & (slips * teeth < 1.0)))


# If few contact episodes reach a flank, and the gear never rests on it, velocity jumps are the only observation. They
# identify the tooth, but bound its depth only from below: gears approach no further than neighbouring teeth allow, and
# a velocity jump is rounded by the averaging time of the readings.


class ShortTooth(NamedTuple):
    """A tooth with a negative deviation beyond the observed approach of the gears.

    Args:
        effect: pitch error of the least possible depth.
        gain: in chi-square.
        why: reason for the identification, a sentence without a stop.
        others: teeth that velocity jumps do not exclude in its place: at a ratio of 1 the tooth that it always meets.
    """

    effect: Any
    gain: float
    why: str
    others: tuple[Rival, ...] = ()


class _CandidateTooth(NamedTuple):
    """Tooth of a gear, its gain, least depth [m], jumps that it moves clearly, gain in all records but the best."""

    gain: float
    gear: Gear
    side: Side
    tooth: int
    depth: float
    jumps: int
    others: float

    @property
    def clear(self) -> bool:
        """Whether it is significant."""
        return self.gain > SHORT_GAIN and self.jumps >= FEWEST_IMPROVED


def short_tooth(records: Sequence[Evidence]) -> ShortTooth | None:
    """Return the short tooth from velocity jumps with its least depth; ``None`` without one."""
    found = sorted(_short_teeth(records), key=lambda one: -one.gain)
    if not found or not found[0].clear or found[0].others < SHORT_GAIN_OF_OTHERS:
        return None
    best = found[0]
    if any(SINGLE * one.gain > best.gain for one in found[1:] if _elsewhere(records[0], one, best)):
        return None
    unit = records[0].rig.backlash
    others = tuple(
        Rival((as_cause(_least_pitch_error(one), unit),), best.gain - one.gain, False, best.gain - one.gain)
        for one in found[1:]
        if best.gain - one.gain < EXCLUDED
    )
    why = (
        f"{best.jumps} impacts on the {best.side} flank at this tooth, and at no other of its gear, lie behind the"
        f" flank: negative tooth deviation of at least {show(best.depth, 'length', 3)}; total significance"
        f" {significance(best.gain)}"
    )
    return ShortTooth(_least_pitch_error(best), best.gain, why, others)


def as_cause(tooth: Any, unit: float) -> Cause:
    """Return a pitch error as a cause with its size.

    unit: [m].
    """
    shape = {"gear": tooth.gear, "tooth": tooth.tooth, "flank": tooth.flank}
    candidate = Candidate(tooth.kind, shape, "offset", unit, False, SHOWS[tooth.place])
    return begin(candidate, np.array([tooth.offset / unit]))


def _least_pitch_error(one: _CandidateTooth) -> Any:
    """Return a short tooth as a pitch error of its least depth."""
    offset = -outward(SIDES.index(one.side)) * one.depth
    return catalogue()["pitch_error"](offset=offset, tooth=one.tooth, gear=one.gear, flank=one.side)


def on_both(records: Sequence[Evidence], effect: Any) -> Any:
    """Return a pitch error on both flanks if velocity jumps indicate it, else unchanged.

    A displaced tooth has a positive deviation on the flank where it is detected, and a negative one on the other.
    """
    found = _gain_on_other_flank(records, effect) if may_be_on_both(effect) else None
    return replace(effect, flank="both") if found is not None and found.clear else effect


def may_be_on_both(effect: Any) -> bool:
    """Whether a pitch error is positive on one flank; a negative one there implies impacts on the other flank."""
    return effect.flank != "both" and effect.offset * outward(SIDES.index(effect.flank)) > 0.0


def contradicted_on_other_flank(records: Sequence[Evidence], effect: Any) -> bool:
    """Whether velocity jumps contradict a negative deviation on the other flank of a tooth with a positive one."""
    found = _gain_on_other_flank(records, effect)
    return found is not None and found.gain < 0.0


def _gain_on_other_flank(records: Sequence[Evidence], effect: Any) -> _CandidateTooth | None:
    """Return the gain of velocity jumps on a tooth's other flank by the opposite deviation there."""
    seen = _FlankJumps(records, 1 - SIDES.index(effect.flank))
    return seen.tooth(effect.gear, effect.tooth, np.array([abs(effect.offset)]))


class _FlankJumps:
    """Corners of all records on one flank.

    Args:
        records: all.
        flank: 0 active, 1 reverse.
    """

    def __init__(self, records: Sequence[Evidence], flank: int) -> None:
        self.pair = records[0].pair
        self.side: Side = SIDES[flank]
        drive, loose, off, sigma, owner = zip(*(_jumps_of(one, flank, k) for k, one in enumerate(records)), strict=True)
        self.angles = {"drive": np.concatenate(drive), "loose": np.concatenate(loose)}
        self.off, self.sigma, self.owner = np.concatenate(off), np.concatenate(sigma), np.concatenate(owner)
        self.before = np.minimum((self.off / self.sigma) ** 2, CLIPPED)

    def tooth(self, gear: Gear, tooth: int, depths: Array) -> _CandidateTooth | None:
        """Return the gain of a short tooth at its best depth; ``None`` with too few velocity jumps.

        depths: tried, increasing [m], (k,).
        """
        deepest = over_tooth(self.pair, gear, tooth, self.side, -MISSING_DEPTH, self.angles[gear])
        at = np.flatnonzero(deepest)
        if at.size < FEWEST_IMPROVED:
            return None
        moved = np.sign(deepest[at]) * np.minimum(depths[:, None], np.abs(deepest[at]))
        after = np.minimum(((self.off[at] - moved) / self.sigma[at]) ** 2, CLIPPED)
        gains = np.sum(self.before[at] - after, axis=1)
        best = int(np.argmax(gains))
        own = np.bincount(self.owner[at], self.before[at] - after[best])
        least = int(np.flatnonzero(gains > gains[best] - DEPTH_FALL)[0])
        near = (np.abs(moved[best]) > CLEARLY_MOVED * self.sigma[at]) & (after[best] < self.before[at])
        count = int(np.count_nonzero(near))
        others = float(gains[best] - np.max(own))
        return _CandidateTooth(float(gains[best]), gear, self.side, tooth, float(depths[least]), count, others)


def _jumps_of(one: Evidence, flank: int, number: int) -> tuple[Array, ...]:
    """Return both angles, distance from the flank, its error, and the record's number of each of its velocity jumps.

    Errors are those of most velocity jumps: at a wrongly estimated flank, all deviate.
    """
    seen = one.channels.velocity_jumps
    mine = (seen.flank == flank) & np.isfinite(seen.off)
    off, sigma = seen.off[mine], seen.sigma[mine]
    off = off - np.median(off) if off.size else off
    usual = 1.4826 * float(np.median(np.abs(off) / sigma)) if off.size else 1.0
    return seen.drive[mine], seen.loose[mine], off, sigma * max(usual, 1.0), np.full(off.size, number)


def _short_teeth(records: Sequence[Evidence]) -> Iterator[_CandidateTooth]:
    """Generate the teeth that gain with a negative deviation."""
    pair = records[0].pair
    depths = np.array(TRIED_DEPTHS) * pair.backlash
    for seen in (_FlankJumps(records, flank) for flank in (0, 1)):
        for gear in GEARS:
            for tooth in range(1, pair.gear(gear).teeth + 1):
                if (found := seen.tooth(gear, tooth, depths)) is not None:
                    yield found


def _elsewhere(one: Evidence, this: _CandidateTooth, that: _CandidateTooth) -> bool:
    """Whether two teeth are of one gear and flank, and not neighbours."""
    teeth = one.pair.gear(that.gear).teeth
    apart = (this.tooth - that.tooth) % teeth
    return (this.gear, this.side) == (that.gear, that.side) and min(apart, teeth - apart) > AWAY
