"""Preprocessing of records: those that can be used, and their segmentation without known sensor effects.

If the encoders are read in sequence, the displacement follows the speed; if that is a large fraction of the backlash,
the flanks appear to move and segmentation fails. The sensor gate estimates the delay without segmentation: it is
removed before, and recorded in the evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from math import degrees, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import gear_of
from gears3d.diagnosis.datums import turn
from gears3d.diagnosis.evidence import Evidence, Paths, of_cut
from gears3d.diagnosis.prediction import deviation
from gears3d.effects import catalogue
from gears3d.errors import Fault, InputError
from gears3d.measured.segmentation import alike, segments_of
from gears3d.measured.segmentation.displacement import Shape
from gears3d.measured.segmentation.results import ENOUGH
from gears3d.measured.segmentation.segments import DOUBTFUL
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted
    from gears3d.measured.segmentation.flanks import Flanks
    from gears3d.scenario import Scenario

Array = np.ndarray
# Minimum ratio of the measured fluctuation to the nominal one; below it the motion is another.
LEAST_FLUCTUATION = 0.5
# Relative deviation of the mean speed from the nominal one that is reported.
OTHER_SPEED = 0.05
# Readings of an angle that are compared with the nominal motion, about.
COMPARED_READINGS = 20_000
# Fraction of a record that another's flanks must explain in addition to its own flanks to replace them.
BETTER_FLANKS = 0.005
# Fraction of the records with a delay in the sensor gate above which all are corrected for it.
DELAYED_SHARE = 0.5


class Note(NamedTuple):
    """A condition that weakens or prevents a diagnosis.

    Args:
        kind: one word with hyphens.
        text: the observation, with its size.
        remedy: recommended action.
        record: of the observation; empty for all together.
        blocks: whether no cause may be named while it holds.
    """

    kind: str
    text: str
    remedy: str
    record: str = ""
    blocks: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary."""
        return self._asdict()


def _motion_notes(one: Admitted) -> list[Note]:
    rig, time = one.rig, one.recording.time
    if rig is None or len(time) < 16:
        return []
    turned = [each for each in one.findings if each.kind == "sense" and not each.corrected]
    if turned:
        text = "both gears rotate opposite to the nominal direction, which exchanges active and reverse flank"
        remedy = "--correct sense, or give the true motion under [condition]"
        return [Note("turned-round", text, remedy, one.file, True)]
    harmonics = rig.motion.harmonics
    if rig.motion.record is not None:
        return []
    few = slice(None, None, max(len(time) // COMPARED_READINGS, 1))
    angles = [np.asarray(one.recording.signals[f"theta_{gear}_rad"])[few] for gear in ("drive", "loose")]
    radii = rig.rig().base_radius_drive, rig.rig().base_radius_loose
    turns = [2.0 * pi * each.frequency for each in harmonics]
    if turns and (time[-1] - time[0]) * min(turns) < 2.0 * pi:
        return []
    (rest, size, mean), (far, _, _) = (_off_steady_motion(time[few], angle, turns) for angle in angles)
    claimed = float(
        np.hypot.reduce([0.0, *(each.amplitude / rate for each, rate in zip(harmonics, turns, strict=True))])
    )
    if turns and far * radii[1] < rest * radii[0] / 3.0 and rest * radii[0] > 0.05 * rig.rig().backlash:
        text = "the loose gear has the nominal motion of the drive gear, and the drive gear rattles: "
        text += (
            f"deviations from a steady fluctuation are {1e6 * far * radii[1]:.3g} um and {1e6 * rest * radii[0]:.3g} um"
        )
        return [Note("channels-swapped", text, "change the channels' names in record.toml", one.file, True)]
    if "harmonics" in one.stated and (
        size < LEAST_FLUCTUATION * claimed or (not turns and rest * radii[0] > rig.rig().backlash)
    ):
        text = (
            f"the drive fluctuates by {degrees(size):.3g} deg at the nominal frequencies (nominal "
            f"{degrees(claimed):.3g} deg), with other motion of {degrees(rest):.3g} deg rms"
        )
        return [Note("other-motion", text, "give the motion of this record under [condition]", one.file, True)]
    if "mean" in one.stated and abs(mean - rig.motion.mean) > OTHER_SPEED * abs(rig.motion.mean):
        text = f"mean speed of the drive is {show(mean, 'speed', 4)}, nominal is {show(rig.motion.mean, 'speed', 4)}"
        return [Note("other-speed", text, "give the motion of this record under [condition]; the measured one is used",
                     one.file)]  # fmt: skip
    return []


def _off_steady_motion(time: Array, angle: Array, turns: Sequence[float]) -> tuple[float, float, float]:
    """Return the deviation of an angle from steady fluctuations [rad rms], its size and mean speed [rad, rad/s]."""
    x = time - time.mean()
    columns = [np.ones_like(x), x]
    for rate in turns:
        columns += [np.cos(rate * x), np.sin(rate * x)]
    table = np.column_stack(columns)
    found = np.linalg.lstsq(table, angle, rcond=None)[0]
    return float(np.std(angle - table @ found)), float(np.hypot.reduce([0.0, *found[2:]])), float(found[1])


def _datum_notes(admitted: Iterable[Admitted]) -> list[Note]:
    """Return the elements of a rig that depend on the angle of a gear with an unknown angular datum."""
    told = []
    for one in admitted:
        lost = one.recording.meta.get("zero_arbitrary", ())
        effects = one.rig.effects if one.rig is not None else ()
        bound = [each.kind for each in effects if gear_of(each.kind, getattr(each, "gear", None)) in lost]
        if bound:
            text = f"the rig has {', '.join(bound)}, which depends on a gear angle with unknown datum in this record"
            remedy = "give records with an index mark, or remove the effect from the rig: it will be identified again"
            told.append(Note("zeros-unknown", text, remedy, one.file, True))
    return told


def usable(admitted: Sequence[Admitted]) -> tuple[list[Admitted], list[Note]]:
    """Return the records with the motion of the rig, if there is one, and notes on these and the others."""
    notes = [*(note for one in admitted for note in _motion_notes(one)), *_datum_notes(admitted)]
    bad = {note.record for note in notes if note.blocks}
    if len(bad) == len({one.file for one in admitted}):
        return list(admitted), notes
    notes = [
        note._replace(blocks=False, remedy=f"{note.remedy} (this record was excluded)") if note.blocks else note
        for note in notes
    ]
    return [one for one in admitted if one.file not in bad], notes


def segmented(
    admitted: Sequence[Admitted], notes: list[Note], tell: Callable[[str, float], None], paths: Paths
) -> tuple[list[Evidence], list[Note]]:
    """Return the records that can be measured, and notes on these and the others."""
    records: dict[str, Evidence] = {}
    faults: dict[str, InputError] = {}
    delay = delay_of(admitted)
    for k, one in enumerate(admitted):
        tell(f"measuring {one.file}", 0.1 + 0.5 * k / len(admitted))
        assert one.rig is not None
        try:
            records[one.file] = preprocess(one, delay, paths=paths)
        except InputError as error:
            faults[one.file] = error
    if not records:
        every = [fault for error in faults.values() for fault in error.faults]
        raise InputError([*(Fault("", note.text, note.remedy, note.record) for note in notes), *every])
    stated, own = [], list(records.values())
    for one in admitted:
        if (error := faults.get(one.file)) is None:
            continue
        first = error.faults[0]
        if (found := with_flanks_of_another(one, own, delay, paths)) is None:
            stated += [Note("not-measured", f"record excluded: {fault.key} {fault.message}", fault.remedy, one.file)
                     for fault in error.faults]  # fmt: skip
        else:
            records[one.file], like = found
            text = f"segmented along the flanks of {like}, as by itself it {first.message}"
            stated.append(Note("flanks-of-another", text, "record longer, or with less noise", one.file))
    kept = [records[one.file] for one in admitted if one.file in records]
    return with_best_flanks(admitted, kept, paths), [*notes, *stated]


def delay_of(admitted: Sequence[Admitted]) -> float:
    """Return the reading delay of the loose gear against the drive [s], 0 if the sensor gate finds none."""
    seen = [each.size for one in admitted for each in one.findings if each.kind == "skew" and not each.corrected]
    return float(np.median(seen)) if len(seen) > DELAYED_SHARE * len(admitted) else 0.0


def preprocess(
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
    shapes = tuple(_tooth_shape(one.rig, each, flank, turned) for each in teeth for flank in _flanks_of(each))
    known = (paths or Paths()).of(one, delay)
    cut = alike(known, like, one.file) if like else segments_of(known, one.rig, one.file, shapes=shapes)
    made = of_cut(cut, one.rig, one.file, spared, stated="harmonics" in one.stated)
    return turn(replace(made, unmarked=tuple(one.recording.meta.get("zero_arbitrary", ()))), *turned)


def with_best_flanks(
    admitted: Sequence[Admitted], records: list[Evidence], paths: Paths | None = None
) -> list[Evidence]:
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
        if one.doubt <= BETTER_FLANKS:
            return one
        try:
            made = preprocess(came[one.name], delay, paths=paths, turned=one.turned, like=best)
        except InputError:
            return one
        return made if made.doubt < one.doubt - BETTER_FLANKS else one

    return [anew(one) for one in records]


def with_flanks_of_another(
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
        made = preprocess(one, delay, paths=paths, like=best.flanks)
    except InputError:
        return None
    return (made, best.name) if made.doubt < 1.0 - ENOUGH else None


def _flanks_of(tooth: Any) -> tuple[int, ...]:
    """Return the flanks that a pitch error is on, 0 active, 1 reverse."""
    return {"active": (0,), "reverse": (1,)}.get(tooth.flank, (0, 1))


def _tooth_shape(rig: Scenario, tooth: Any, flank: int, turned: tuple[float, float]) -> Shape:
    """Return the effect of a pitch error of its sign on a flank over both angles, and its expected size."""
    whole = replace(tooth, flank="both")
    rows, pair = whole.rows(rig.rig()), rig.pair()

    def over(drive: Array, loose: Array) -> Array:
        own = deviation(rows, pair, drive + turned[0], loose + turned[1], np.full(len(drive), flank))
        return own / abs(tooth.offset)

    return Shape(over, flank, abs(tooth.offset), True)
