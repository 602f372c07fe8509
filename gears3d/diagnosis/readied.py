"""Records made ready for cutting: what the sensors do to them is taken out first, and given back to the evidence.

Encoders that are read one after the other make the displacement follow the speed; by a large part of the backlash no
flank stands still then, and nothing is cut rightly. The gate tells the delay without any cutting.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.diagnosis.aligned import aligned
from gears3d.diagnosis.cause import fit
from gears3d.diagnosis.deviation import deviation
from gears3d.diagnosis.evidence import Evidence, of_cut
from gears3d.diagnosis.library import ONE_SIDED
from gears3d.diagnosis.paths import Paths
from gears3d.diagnosis.pockets import Pocket, as_cause, denied, may_be_on_both, on_both, pocket
from gears3d.diagnosis.search import Search, keeping, on_both_flanks
from gears3d.diagnosis.sifting import off_teeth
from gears3d.diagnosis.struck import struck
from gears3d.diagnosis.zeros import turn
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

AGAIN = 2
"""Times that records are cut anew with the teeth that were found."""
MOST_TEETH = 2
"""Teeth that flanks may have when they are cut anew."""
BETTER = 0.005
"""Part of a record that another's flanks must explain in addition to its own, for them to be believed."""
MOST = 0.5
"""Part of the records in which the gate must see a delay for all of them to have it."""


def delay_of(admitted: Sequence[Admitted]) -> float:
    """Return by how much the loose gear is read later than the drive [s], 0 where the gate sees no such thing.

    Args:
        admitted: records that passed the sensor gate; a delay that was corrected there counts no more.
    """
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
    """Return a record as evidence, cut as if the loose gear had been read in time with the drive.

    Args:
        one: the record.
        delay: of the loose gear's readings [s]; the evidence has it as spared, so that it remains to be explained.
        teeth: pitch errors that the flanks are known to have, whatever their sizes.
        paths: of the records, as far as they are known.
        turned: what is added to the angles of drive and loose gear [rad].
        like: flanks of another record that it is cut along in place of those that it shows itself.

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
    """Return the records, those that were cut badly cut along the flanks of the one that was cut best.

    All are records of the same gears. Those that explain no more of a record than its own did are not its flanks: its
    zeros may be elsewhere.

    Args:
        admitted: records as they came in.
        records: the same, those that could be measured.
        paths: of the records, as far as they are known.
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
    """Return a record that cannot be measured by itself, cut from the flanks of another on, and whose these are.

    Records of one rig have the same flanks; slow noise hides them in one record rather than in another. The cut must
    explain as much as that of any record; else ``None``.

    Args:
        one: the record.
        records: of the same rig, those that could be measured.
        delay: as for :func:`ready`.
        paths: of the records, as far as they are known.
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
    """Return the pitch errors among the causes of a search, by gear, tooth and whether they stand out.

    Args:
        found: by the search.
    """
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
    """Return the records as a search saw them, what it finds, and a tooth that stands back out of reach.

    A delay of the encoders moves the flanks with the speed, and blows with them: of one that the gate did not see the
    records are freed once it is known. A tooth that stands out is not where flanks of low orders are drawn, and spoils
    the cutting of what happens on it: the records are cut anew with a flank that may have it, and searched anew.

    Args:
        admitted: records as they came in.
        records: the same, those that could be measured.
        highest: order that is looked for.
        paths: of the records, as far as they are known.
        tell: called with what is being done and the part of the whole that is done.
    """
    known: tuple[Any, ...] = ()
    tell("searching for causes", 0.6)
    came, delay = {one.file: one for one in admitted}, delay_of(admitted)
    records, found = aligned(records, highest)
    if delay == 0.0 and (late := _delay_in(found)):
        tell("repeating the segmentation without encoder delay", 0.62)
        timely = aligned([_cut_anew(came[one.name], one, late, (), paths) for one in records], highest)
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
        records, found = aligned(
            records, highest, [as_cause(one, records[0].rig.backlash) for one in known if deep is None]
        )
    named = _places(single_teeth(found)) | _places(single_teeth(before[1]))
    if deep is None and not named & _places(known):
        return *before, None  # what was suspected is no tooth
    if deep is not None:  # its depth is not what the search makes of where the gear was seen
        found = keeping(found, [one for one in found.fit.causes if one.candidate.kind != "pitch_error"])
    return records, whole_teeth(found), deep


def whole_teeth(found: Search) -> Search:
    """Return a search that has single teeth out of step, on both flanks, where nothing says that they are on one only.

    Args:
        found: by the search.
    """
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
    """Return by how much a search has the loose gear read later than the drive [s], 0 where it is read in time."""
    late = [cause.effect for cause in found.fit.causes if cause.candidate.kind == "encoder_skew"]
    return sum(one.delay if one.gear == "loose" else -one.delay for one in late if one is not None)


def _others(known: Sequence[Any], found: Sequence[Any]) -> Sequence[Any]:
    """Return teeth that are not known already: what is still off on those is how records were cut."""
    there = {(one.gear, one.tooth) for one in known}
    return [one for one in found if (one.gear, one.tooth) not in there]


def _effect(deep: Pocket | None) -> tuple[Any, ...]:
    return () if deep is None else (deep.effect,)


def _places(teeth: Sequence[Any]) -> set[tuple[str, int, bool]]:
    return {(one.gear, one.tooth, one.offset > 0.0) for one in teeth}


def _cut_anew(one: Admitted, before: Evidence, delay: float, teeth: Sequence[Any], paths: Paths | None) -> Evidence:
    """Return a record cut with flanks that may have single teeth, less impacts there; as before where it cannot be."""
    try:
        made = ready(one, delay, teeth, paths, before.turned)
        return off_teeth(made, teeth) if teeth else made
    except InputError:
        return before


def _flanks(tooth: Any) -> tuple[int, ...]:
    """Return the flanks that a pitch error is on, 0 active, 1 reverse."""
    return {"active": (0,), "reverse": (1,)}.get(tooth.flank, (0, 1))


def _shape(rig: Scenario, tooth: Any, flank: int, turned: tuple[float, float]) -> Shape:
    """Return what a pitch error of its sign does to a flank, over both angles, and the size it is expected to have."""
    whole = replace(tooth, flank="both")
    rows, pair = whole.rows(rig.rig()), rig.pair()

    def over(drive: Array, loose: Array) -> Array:
        own = deviation(rows, pair, drive + turned[0], loose + turned[1], np.full(len(drive), flank))
        return own / abs(tooth.offset)

    return Shape(over, flank, abs(tooth.offset), True)
