"""Preprocessing of records: sensor effects are removed before segmentation and recorded in the evidence.

If the encoders are read in sequence, the displacement follows the speed; if that is a large fraction of the backlash,
the flanks appear to move and segmentation fails. The sensor gate estimates the delay without segmentation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.diagnosis.candidates import ONE_SIDED
from gears3d.diagnosis.cause import fit
from gears3d.diagnosis.datums import turn
from gears3d.diagnosis.evidence import Evidence, Paths, of_cut
from gears3d.diagnosis.pockets import Pocket, as_cause, denied, may_be_on_both, on_both, pocket
from gears3d.diagnosis.prediction import deviation
from gears3d.diagnosis.search import Search, aligned_search, keeping, on_both_flanks
from gears3d.diagnosis.struck import struck, without_teeth
from gears3d.effects import catalogue
from gears3d.errors import InputError
from gears3d.measured.segmentation import alike, segments_of
from gears3d.measured.segmentation.explained import ENOUGH
from gears3d.measured.segmentation.segments import DOUBTFUL
from gears3d.measured.segmentation.smoothing import Shape

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted
    from gears3d.measured.segmentation.flanks import Flanks
    from gears3d.scenario import Scenario

Array = np.ndarray

# Maximum number of re-segmentations with the teeth found.
AGAIN = 2
# Maximum number of single teeth of the flanks in a re-segmentation.
MOST_TEETH = 2
# Fraction of a record that another's flanks must explain in addition to its own flanks to replace them.
BETTER = 0.005
# Fraction of the records with a delay in the sensor gate above which all are corrected for it.
MOST = 0.5


def delay_of(admitted: Sequence[Admitted]) -> float:
    """Return the reading delay of the loose gear against the drive [s], 0 if the sensor gate finds none."""
    seen = [each.size for one in admitted for each in one.findings if each.kind == "skew" and not each.corrected]
    return float(np.median(seen)) if len(seen) > MOST * len(admitted) else 0.0


def ready(
    one: Admitted,
    delay: float = 0.0,
    teeth: Sequence[Any] = (),
    paths: Paths | None = None,
    turned: tuple[float, float] = (0.0, 0.0),
    like: Flanks | None = None,
) -> Evidence:
    """Return a record as evidence, segmented without the reading delay of the loose gear.

    Args:
        one: the record.
        delay: of the loose gear's readings [s]; the evidence has it as spared, so that it remains to be explained.
        teeth: pitch errors that the flanks are known to have, of any size.
        paths: of the records, as far as they are computed.
        turned: added to the angles of drive and loose gear [rad].
        like: flanks of another record that replace its own in the segmentation.

    Raises:
        InputError: the record cannot be measured.
    """
    assert one.rig is not None
    spared = () if delay == 0.0 else (catalogue()["encoder_skew"](delay=delay, gear="loose"),)
    shapes = tuple(_shape(one.rig, each, flank, turned) for each in teeth for flank in _flanks(each))
    known = (paths or Paths()).of(one, delay)
    cut = alike(known, like, one.file) if like else segments_of(known, one.rig, one.file, shapes=shapes)
    made = of_cut(cut, one.rig, one.file, spared, stated="harmonics" in one.stated)
    return turn(replace(made, unmarked=tuple(one.recording.meta.get("zero_arbitrary", ()))), *turned)


def with_one_flank(admitted: Sequence[Admitted], records: list[Evidence], paths: Paths | None = None) -> list[Evidence]:
    """Return the records; poorly segmented ones are re-segmented with the flanks of the best one.

    All are records of the same gears. Flanks that explain no more of a record than its own are rejected: its angular
    datum may differ.
    """
    came, delay = {one.file: one for one in admitted}, delay_of(admitted)
    sure = [one for one in records if one.flanks is not None and one.flanks.gap is not None and one.doubt < DOUBTFUL]
    if not sure:
        return records
    best = min(sure, key=lambda one: one.doubt).flanks

    def anew(one: Evidence) -> Evidence:
        if one.doubt <= BETTER:
            return one
        try:
            made = ready(came[one.name], delay, paths=paths, turned=one.turned, like=best)
        except InputError:
            return one
        return made if made.doubt < one.doubt - BETTER else one

    return [anew(one) for one in records]


def along_another(
    one: Admitted, records: Sequence[Evidence], delay: float, paths: Paths | None = None
) -> tuple[Evidence, str] | None:
    """Return a record that cannot be segmented alone, segmented from the flanks of another, and that record's name.

    Records of one rig have the same flanks; slow noise hides them in some records only. The segmentation must explain
    as much as that of any record; else ``None``.
    """
    sure = [each for each in records if each.flanks is not None and each.flanks.gap is not None]
    if not sure:
        return None
    best = min(sure, key=lambda each: each.doubt)
    try:
        made = ready(one, delay, paths=paths, like=best.flanks)
    except InputError:
        return None
    return (made, best.name) if made.doubt < 1.0 - ENOUGH else None


def single_teeth(found: Search) -> tuple[Any, ...]:
    """Return the pitch errors among the causes of a search, by gear, tooth and sign."""
    effects = [cause.effect for cause in found.fit.causes if cause.candidate.kind == "pitch_error"]
    kept = {(one.gear, one.tooth, one.offset > 0.0): one for one in effects if one is not None}
    return tuple(kept[key] for key in sorted(kept)[:MOST_TEETH])


def searched(
    admitted: Sequence[Admitted],
    records: list[Evidence],
    highest: int,
    paths: Paths | None = None,
    tell: Callable[[str, float], None] = lambda doing, part: None,
) -> tuple[list[Evidence], Search, Pocket | None]:
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
    if delay == 0.0 and (late := _delay_in(found)):
        tell("repeating the segmentation without encoder delay", 0.62)
        timely = aligned_search([_cut_anew(came[one.name], one, late, (), paths) for one in records], highest)
        if _delay_in(timely[1]):
            delay, (records, found) = late, timely
    deep, before = None if struck(records) else pocket(records), (records, found)
    for _ in range(AGAIN):
        teeth = (*known, *_others(known, struck(records))) or _effect(deep) or single_teeth(found)
        teeth = tuple(on_both(records, one) for one in teeth)
        if _places(teeth) <= _places(known):
            break
        known = teeth[:MOST_TEETH]
        tell("repeating the segmentation with single tooth deviations", 0.65)
        records = [_cut_anew(came[one.name], one, delay, known, paths) for one in records]
        tell("searching for causes", 0.7)
        records, found = aligned_search(
            records, highest, [as_cause(one, records[0].rig.backlash) for one in known if deep is None]
        )
    named = _places(single_teeth(found)) | _places(single_teeth(before[1]))
    if deep is None and not named & _places(known):
        return *before, None  # the candidate is not a tooth
    if deep is not None:  # the search finds a depth that contradicts the observed approach
        found = keeping(found, [one for one in found.fit.causes if one.candidate.kind != "pitch_error"])
    return records, whole_teeth(found), deep


def whole_teeth(found: Search) -> Search:
    """Return a search whose single displaced teeth are on both flanks unless the records indicate one flank only."""
    causes = list(found.fit.causes)
    for k, cause in enumerate(found.fit.causes):
        effect = cause.effect
        for whole in on_both_flanks(cause.candidate):
            if effect is None or not may_be_on_both(effect) or denied(found.records, effect):
                continue
            tried = fit(found.records, found.base, [*causes[:k], cause._replace(candidate=whole), *causes[k + 1 :]])
            if tried.chi2 < found.fit.chi2 + ONE_SIDED:
                causes, found = list(tried.causes), found._replace(fit=tried)
    return found


def _delay_in(found: Search) -> float:
    """Return the reading delay of the loose gear in a search [s], 0 without one."""
    late = [cause.effect for cause in found.fit.causes if cause.candidate.kind == "encoder_skew"]
    return sum(one.delay if one.gear == "loose" else -one.delay for one in late if one is not None)


def _others(known: Sequence[Any], found: Sequence[Any]) -> Sequence[Any]:
    """Return teeth that are not known already: further deviations of known ones come from segmentation."""
    there = {(one.gear, one.tooth) for one in known}
    return [one for one in found if (one.gear, one.tooth) not in there]


def _effect(deep: Pocket | None) -> tuple[Any, ...]:
    return () if deep is None else (deep.effect,)


def _places(teeth: Sequence[Any]) -> set[tuple[str, int, bool]]:
    return {(one.gear, one.tooth, one.offset > 0.0) for one in teeth}


def _cut_anew(one: Admitted, before: Evidence, delay: float, teeth: Sequence[Any], paths: Paths | None) -> Evidence:
    """Return a record re-segmented with possible single teeth, without impacts there; unchanged if that fails."""
    try:
        made = ready(one, delay, teeth, paths, before.turned)
        return without_teeth(made, teeth) if teeth else made
    except InputError:
        return before


def _flanks(tooth: Any) -> tuple[int, ...]:
    """Return the flanks that a pitch error is on, 0 active, 1 reverse."""
    return {"active": (0,), "reverse": (1,)}.get(tooth.flank, (0, 1))


def _shape(rig: Scenario, tooth: Any, flank: int, turned: tuple[float, float]) -> Shape:
    """Return the effect of a pitch error of its sign on a flank over both angles, and its expected size."""
    whole = replace(tooth, flank="both")
    rows, pair = whole.rows(rig.rig()), rig.pair()

    def over(drive: Array, loose: Array) -> Array:
        own = deviation(rows, pair, drive + turned[0], loose + turned[1], np.full(len(drive), flank))
        return own / abs(tooth.offset)

    return Shape(over, flank, abs(tooth.offset), True)
