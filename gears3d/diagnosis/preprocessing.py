"""Preprocessing of records: those that can be used, their segmentation, and a common angular datum.

Where encoders are read in sequence, the displacement follows the speed, and segmentation fails if that is a large
fraction of the backlash: the sensor gate estimates the delay without segmentation; it is removed before.
Without index marks, the angular datum of each record is a nuisance parameter of effects that depend on a gear's angle.
The strongest of these, or a single tooth deviation, determines the differences of datums; once angles are shifted, all
causes are searched as in records with common marks. A phase for each record is a degree of freedom that noise has, too:
the threshold of such effects is higher.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import product
from math import degrees, log, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import Candidate, Cause, Regressors, contribution, gear_of, goes_by, slopes_of
from gears3d.diagnosis.evidence import Evidence, Paths, in_units, of_cut, standardised_contact
from gears3d.diagnosis.prediction import CHANNELS, GEARS, deviation, residuals
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
    notes = []
    for one in admitted:
        lost = one.recording.meta.get("zero_arbitrary", ())
        effects = one.rig.effects if one.rig is not None else ()
        bound = [each.kind for each in effects if gear_of(each.kind, getattr(each, "gear", None)) in lost]
        if bound:
            text = f"the rig has {', '.join(bound)}, which depends on a gear angle with unknown datum in this record"
            remedy = "give records with an index mark, or remove the effect from the rig: it will be identified again"
            notes.append(Note("zeros-unknown", text, remedy, one.file, True))
    return notes


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


# Largest false alarm probability of a cause with a phase.
FALSE_ALARM = 3e-7
# Minimum chi-square gain of a record whose datum is the reference of phases.
REFERENCE_GAIN = 25.0
# Tried phases and sizes, number of refinements of the sizes, and Newton rounds.
TRIED_PHASES, TRIED_SIZES, REFINEMENTS, NEWTON_ROUNDS = 256, 48, 3, 20
# Largest tried size, relative to that of the stiffest direction of a record.
LARGEST_SIZE = 4.0
# Step of an angle, for slopes [rad].
ANGLE_STEP = 1e-5
# Smallest shift of a datum that is applied, in standard deviations.
CERTAIN_SHIFT = 0.1
# Tried places per pitch.
PLACES_PER_PITCH = 32
# Tried deviations of a tooth, in backlashes: larger ones carry before and behind their place, too.
TOOTH_SIZES = (0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.2, 0.4)
# Residual at which a point is clipped, in backlashes.
CLIPPED = 0.5
# Number of Gauss-Newton rounds.
JOINT_ROUNDS = 4
# Largest step in a round, in radians of a datum and in units of a number.
JOINT_STEP = 0.3


def turn(one: Evidence, drive: float, loose: float) -> Evidence:
    """Return a record with its angles shifted to other datums.

    drive, loose: added to the angles [rad].
    """
    if drive == 0.0 and loose == 0.0:
        return one
    seen, (time, angle, speed) = one.channels, one.fine
    names = ("contacts", "impacts", "losses", "contact_ends", "velocity_jumps", "censored_impacts")
    both = {name: (own := getattr(seen, name))._replace(drive=own.drive + drive, loose=own.loose + loose)
            for name in names}  # fmt: skip
    flights = seen.flights._replace(loose=seen.flights.loose + loose)
    moved = seen._replace(**both, flights=flights, drive=seen.drive._replace(angle=seen.drive.angle + drive))
    turned = one.turned[0] + drive, one.turned[1] + loose
    return replace(one, channels=moved, fine=(time, angle + loose, speed), turned=turned)


def moved(effect: Any, drive: float, loose: float) -> Any:
    """Return an effect for angles that are shifted.

    drive, loose: shifts of the angles [rad].

    Raises:
        InputError: it is at a tooth.
    """
    by = {"drive": drive, "loose": loose}.get(gear_of(effect.kind, getattr(effect, "gear", None)), 0.0)
    if by == 0.0:
        return effect
    if not hasattr(effect, "phase"):
        text = "acts at one tooth, but the angular datum of this record relative to the teeth is unknown"
        raise InputError(Fault(effect.kind, text, "give records with an index mark"))
    phase = effect.phase + getattr(effect, "order", 1) * by
    return replace(effect, phase=float((phase + pi) % (2.0 * pi) - pi))


def in_mesh(one: Evidence, effects: Sequence[Any]) -> tuple[Evidence, list[Any]]:
    """Return a record whose loose gear has the angular datum of a mesh with both gears at 0, and effects for it."""
    seen, (drive, loose) = one.channels.contacts, one.radii
    if "loose" not in one.unmarked or not len(seen.time):
        return one, list(effects)
    ahead = seen.loose - (drive * seen.drive + seen.flank * one.rig.backlash) / loose
    by = float(np.median(ahead))
    return turn(one, 0.0, -by), [moved(effect, 0.0, by) for effect in effects]


def free_phases(records: Sequence[Evidence], gear: str) -> int:
    """Return the number of phases, beyond one, of an effect that depends on a gear's angle."""
    count = sum(gear in one.unmarked for one in records)
    return count - (count == len(records) and count > 0)


def parameter_penalty(records: Sequence[Evidence], gear: str) -> float:
    """Return the additional chi-square threshold of a cause for its phases in the records."""
    return worth_of(free_phases(records, gear))


def worth_of(more: int) -> float:
    """Return the chi-square that noise gains by additional phases."""
    from scipy.stats import chi2

    return float(chi2.isf(FALSE_ALARM, 2 + more) - chi2.isf(FALSE_ALARM, 2)) if more else 0.0


class Phases(NamedTuple):
    """Information of each record alone on a candidate.

    Args:
        candidate: with a phase.
        gain: of a common size and a phase for each record, in chi-square.
        phase: in each record [rad], (r,).
        worth: information on each phase: the inverse of its variance, (r,).
        size: common size, in units.
    """

    candidate: Candidate
    gain: float
    phase: Array
    worth: Array
    size: float = 0.0


def exceeds_uncertainty(found: Phases, by: Array) -> bool:
    """Whether the datum shifts of records exceed their uncertainty.

    by: shift of each record [rad], (r,).
    """
    return bool(np.any(np.abs(by) * order_of(found.candidate) * np.sqrt(np.maximum(found.worth, 0.0)) > CERTAIN_SHIFT))


def strongest_phased(known: Regressors, rest: Array, gear: str, orders: Sequence[int] = ()) -> Phases | None:
    """Return the candidate of largest gain with one size and a phase in each record; ``None`` without any.

    rest: residuals, stacked, (n,); orders: whose multiples are excluded.
    """
    tried = []
    for which, one in enumerate(known.candidates):
        if one.phased and goes_by(one) == gear and not any(order_of(one) % n == 0 for n in orders):
            normal, right = _normal_equations(known, which, rest)
            most = np.einsum("ki,kij,kj->", right, np.linalg.pinv(normal, rcond=1e-9, hermitian=True), right)
            tried.append((float(most), one, normal, right))
    tried.sort(key=lambda each: -each[0])
    best: Phases | None = None
    for most, one, normal, right in tried:
        if best is not None and most < best.gain:  # a size in each record would have that gain, too
            break
        found = one_size(one, normal, right)
        best = found if best is None or found.gain > best.gain else best
    return best


def _normal_equations(known: Regressors, which: int, rest: Array) -> tuple[Array, Array]:
    """Return the normal equations of a candidate in each record, (r, 2, 2) and (r, 2)."""
    count = len(known.records)
    normal, right = np.zeros((count, 2, 2)), np.zeros((count, 2))
    for name, stack in known.stacks.items():
        rows = np.flatnonzero(stack.owner == which)
        for k, part in enumerate(known.parts[name] if len(rows) else ()):
            own = stack.columns[rows, part].astype(float)
            normal[k] += own @ own.T
            right[k] += own @ rest[known.spans[name]][part]
    return normal, right


def one_size(one: Candidate, normal: Array, right: Array) -> Phases:
    """Return the common size of all records and the phase of each, of largest gain.

    Records may determine a candidate in one direction only, as with all flights at one angle: then the size of the
    others determines the phase, so that no record is solved by itself.
    """
    phase = np.linspace(0.0, 2.0 * pi, TRIED_PHASES, endpoint=False)
    toward = np.stack([np.cos(phase), -np.sin(phase)])
    linear, square = right @ toward, np.einsum("in,kij,jn->kn", toward, normal, toward)
    stiffest = np.maximum(np.linalg.eigvalsh(normal)[:, -1], 1e-300)
    largest = LARGEST_SIZE * float(np.max(np.hypot(*right.T) / stiffest))
    tried = np.linspace(0.0, largest, TRIED_SIZES + 1)[1:]
    for _ in range(REFINEMENTS):
        gain = 2.0 * tried[:, None, None] * linear - tried[:, None, None] ** 2 * square
        best = int(np.argmax(gain.max(axis=2).sum(axis=1)))
        size, at = float(tried[best]), phase[np.argmax(gain[best], axis=1)]
        step = tried[1] - tried[0]
        tried = np.linspace(max(size - step, 0.0), size + step, TRIED_SIZES + 1)[1:]
    best_gain, found = -np.inf, (size, at, np.zeros(len(at)))
    for left in reversed(range(NEWTON_ROUNDS + 1)):
        u, v = np.array([np.cos(at), -np.sin(at)]).T, np.array([-np.sin(at), -np.cos(at)]).T
        nu, nv = np.einsum("kij,kj->ki", normal, u), np.einsum("kij,kj->ki", normal, v)
        bow = size * np.sum(u * right, axis=1) + size**2 * (np.sum(v * nv, axis=1) - np.sum(u * nu, axis=1))
        reached = float(np.sum(2.0 * size * np.sum(u * right, axis=1) - size**2 * np.sum(u * nu, axis=1)))
        if reached > best_gain:
            best_gain, found = reached, (size, at, bow)
        if not left:
            break
        slope = size * np.sum(v * right, axis=1) - size**2 * np.sum(v * nu, axis=1)
        at = at + np.where(bow > 0.0, np.clip(slope / np.where(bow > 0.0, bow, 1.0), -0.05, 0.05), 0.0)
        cross = np.sum(v * right, axis=1) - 2.0 * size * np.sum(v * nu, axis=1)
        stiff = np.sum(u * nu) - np.sum(np.where(bow > 0.0, cross**2 / np.where(bow > 0.0, bow, 1.0), 0.0))
        off = float(np.sum(u * right) - size * np.sum(u * nu))
        size = size + off / stiff if stiff > 0.0 else size
    size, at, bow = found
    return Phases(one, best_gain, at, np.maximum(bow, 0.0), size)


def datum_shifts(known: Regressors, rest: Array, gear: str, orders: Sequence[int] = ()) -> tuple[Array, Phases] | None:
    """Return the datum shift of each record that gives the strongest candidate one phase [rad], (r,).

    With the candidate; ``None`` without a significant one. rest: (n,); multiples of ``orders`` are excluded.
    """
    from scipy.stats import chi2

    best = strongest_phased(known, rest, gear, orders)
    if best is None or best.gain < chi2.isf(FALSE_ALARM, 2 + free_phases(known.records, gear)):
        return None
    lost = np.array([gear in one.unmarked for one in known.records])
    first = reference(best.worth if np.all(lost) else np.where(lost, 0.0, best.worth))
    away = (best.phase - best.phase[first] + pi) % (2.0 * pi) - pi
    return np.where(lost & (best.worth > 0.0), away / order_of(best.candidate), 0.0), best


def order_of(one: Candidate) -> int:
    """Return the periods per revolution of a candidate with a phase."""
    return int(one.shape.get("order", 1))


def reference(worth: Array) -> int:
    """Return the record whose datum is the reference of all others: the first in which the candidate shows.

    worth: (r,).

    >>> reference(np.array([3.0, 80.0, 900.0])), reference(np.array([3.0, 2.0]))
    (1, 0)
    """
    clear = np.flatnonzero(worth > REFERENCE_GAIN)
    return int(clear[0]) if len(clear) else int(np.argmax(worth))


def has_original_datum(one: Evidence, gear: str) -> bool:
    """Whether a record has a gear's angle as it was read."""
    return abs(one.turned[GEARS.index(gear)]) < 1e-9


def slopes_of_datums(one: Evidence, effects: Sequence[Any], own: Array, gears: Sequence[str]) -> list[Array]:
    """Return the derivatives of the effects' contributions to a record by its datums [1/rad], each (n,).

    own: their contributions as they are, (n,).
    """
    turned = [turn(one, *(ANGLE_STEP if gear == each else 0.0 for each in GEARS)) for gear in gears]
    return [(contribution([each], effects) - own) / ANGLE_STEP for each in turned]


def reference_record(records: Sequence[Evidence], effect: Any) -> str:
    """Return the record whose datum is the reference of an effect's phase; empty if all have marks."""
    gear = gear_of(effect.kind, getattr(effect, "gear", None))
    if not gear or not all(gear in one.unmarked for one in records):
        return ""
    return next((one.name for one in records if has_original_datum(one, gear)), records[0].name)


class SingleTooth(NamedTuple):
    """A tooth deviation at some angle of its gear in each record.

    Args:
        gain: in chi-square, of a common size and a place for each record, minus that of the trials.
        place: angle of the tooth in each record [rad], (r,).
        worth: gain in each record, (r,).
        teeth: of the gear.
    """

    gain: float
    place: Array
    worth: Array
    teeth: int

    @property
    def turns(self) -> Array:
        """Shift of each record that moves the tooth to the nearest tooth position."""
        clear = np.flatnonzero(self.worth > REFERENCE_GAIN)
        first = int(clear[0]) if len(clear) else int(np.argmax(self.worth))
        pitch = 2.0 * pi / self.teeth
        there = pitch * round(float(self.place[first]) / pitch)
        return (there - self.place + pi) % (2.0 * pi) - pi


def single_tooth(known: Regressors, rest: Array, gear: str) -> SingleTooth:
    """Return the tooth of a gear that explains most of the contact residuals.

    rest: (n,).
    """
    own = [rest[known.spans["contact"]][part] for part in known.parts["contact"]]
    teeth = known.records[0].rig.teeth_drive if gear == "drive" else known.records[0].rig.teeth_loose
    count = teeth * PLACES_PER_PITCH
    sums = [_binned_contact(one, part, gear, count) for one, part in zip(known.records, own, strict=True)]
    shapes = [_tooth_response(known.records, gear, flank, sign * size, count)
              for flank, sign, size in product(("both", "active", "reverse"), (1.0, -1.0), TOOTH_SIZES)]  # fmt: skip
    found = [_best_places(sums, shape) for shape in shapes]
    best = max(range(len(found)), key=lambda k: found[k][0])
    place = found[best][1]
    columns = [standardised_contact(one, _at_place(one, shapes[best], gear, at))
               for one, at in zip(known.records, place, strict=True)]  # fmt: skip
    linear = np.array([max(float(column @ part), 0.0) for column, part in zip(columns, own, strict=True)])
    square = np.array([max(float(column @ column), 1e-300) for column in columns])
    worth = linear**2 / square
    asked, seen = int(np.sum(worth > 0.0)), worth > 0.0
    gain = float(linear.sum() ** 2 / max(square[seen].sum(), 1e-300))
    return SingleTooth(gain - 2.0 * asked * log(len(shapes) * count), place, worth, teeth)


def _angle_of(one: Evidence, gear: str) -> Array:
    """Return the angle of a gear at the points in contact, within a revolution [rad], (c,)."""
    seen = one.channels.contacts
    return np.mod(seen.drive if gear == "drive" else seen.loose, 2.0 * pi)


def _at_place(one: Evidence, shape: Array, gear: str, place: float) -> Array:
    """Return a response over a revolution, (2, n), at the points in contact, turned to a place [rad], (c,)."""
    count = shape.shape[1]
    at = np.mod(_angle_of(one, gear) - place, 2.0 * pi) / (2.0 * pi) * count
    own = shape[one.channels.contacts.flank]
    first = np.floor(at).astype(int)
    rows, part = np.arange(len(at)), at - first
    return (1.0 - part) * own[rows, first % count] + part * own[rows, (first + 1) % count]


def _binned_contact(one: Evidence, rest: Array, gear: str, count: int) -> tuple[Array, Array]:
    """Return sums of contact residuals and of weights over a revolution, by flank, (2, n).

    Residuals are those of readings: whitened ones of a tooth would be found before and behind its place.
    """
    seen = one.channels.contacts
    at = np.floor(_angle_of(one, gear) / (2.0 * pi) * count + 0.5).astype(int) % count + seen.flank * count
    far, own = CLIPPED * one.rig.backlash, in_units(one, "contact", rest)
    held = np.clip(own - np.median(own), -far, far) if len(own) else own
    weight = 1.0 / np.maximum(seen.sigma, 1e-300) ** 2
    off, weight = np.bincount(at, held * weight, 2 * count), np.bincount(at, weight, 2 * count)
    return off.reshape(2, count), weight.reshape(2, count)


def _tooth_response(records: Sequence[Evidence], gear: str, flank: str, size: float, count: int) -> Array:
    """Return the response over a revolution to a tooth at angle 0 of a size in backlashes, over that size, (2, n)."""
    one, angle = records[0], np.arange(count) * 2.0 * pi / count
    offset = size * one.rig.backlash
    rows = catalogue()["pitch_error"](offset=offset, tooth=1, gear=gear, flank=flank).rows(one.rig)
    sides = [deviation(rows, one.pair, angle, angle, np.full(count, side)) for side in (0, 1)]
    return np.array(sides) / abs(offset)


def _best_places(sums: Sequence[tuple[Array, Array]], shape: Array) -> tuple[float, Array]:
    """Return the gain of the shape at its best place in each record, and the places [rad]."""
    turned = np.conj(np.fft.rfft(shape))
    squared = np.conj(np.fft.rfft(shape**2))
    count = shape.shape[1]
    places, linear, heavy = np.zeros(len(sums)), np.zeros(len(sums)), np.zeros(len(sums))
    for k, (off, weight) in enumerate(sums):
        whole = max(float(weight.sum()), 1e-300)
        mean = np.fft.irfft(np.fft.rfft(weight) * turned, count).sum(axis=0)
        right = np.fft.irfft(np.fft.rfft(off) * turned, count).sum(axis=0) - mean * off.sum() / whole
        square = np.fft.irfft(np.fft.rfft(weight) * squared, count).sum(axis=0) - mean**2 / whole
        some = square > 1e-2 * max(float(square.max()), 1e-300)
        gain = np.where(some & (right > 0.0), right**2 / np.where(some, square, 1.0), 0.0)
        best = int(np.argmax(gain))
        left, here, next_ = gain[best - 1], gain[best], gain[(best + 1) % count]
        bow = left - 2.0 * here + next_
        ahead = 0.5 * (left - next_) / bow if bow < 0.0 else 0.0
        places[k] = (best + float(np.clip(ahead, -0.5, 0.5))) * 2.0 * pi / count
        linear[k], heavy[k] = (right[best], square[best]) if here > 0.0 else (0.0, 0.0)
    return float(linear.sum() ** 2 / max(heavy.sum(), 1e-300)), places


def settled(records: Sequence[Evidence], causes: Sequence[Cause]) -> tuple[Array, float]:
    """Return datum shifts of records, (r, 2) [rad], from the joint fit with causes, and the change of chi-square."""
    turned, changed, now, begun = np.zeros((len(records), 2)), 0.0, list(records), tuple(causes)
    for _ in range(JOINT_ROUNDS if causes else 0):
        width, count = sum(len(cause.numbers) for cause in causes), 0
        units = np.concatenate([cause.units for cause in causes])
        effects = [cause.effect for cause in causes if cause.effect is not None]
        tables, rests, places = [], [], []
        for k, one in enumerate(now):
            own = contribution([one], effects)
            rest_of = residuals(one)
            rests.append(np.concatenate([rest_of[name] for name in CHANNELS]) - own)
            lost = [
                side
                for side, gear in enumerate(GEARS)
                if gear in one.unmarked and not has_original_datum(records[k], gear)
            ]
            zeros = slopes_of_datums(one, effects, own, [GEARS[side] for side in lost])
            tables.append((np.column_stack([c for cause in causes for c in slopes_of([one], cause)]), zeros))
            places += [(k, side) for side in lost]
        normal, right = np.zeros((width + len(places),) * 2), np.zeros(width + len(places))
        for (slopes, zeros), rest in zip(tables, rests, strict=True):
            at = [*range(width), *range(width + count, width + count + len(zeros))]
            table = np.column_stack([slopes, *zeros])
            normal[np.ix_(at, at)] += table.T @ table
            right[at] += table.T @ rest
            count += len(zeros)
        scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        move = np.linalg.pinv(normal / np.outer(scale, scale), rcond=1e-9, hermitian=True) @ (right / scale) / scale
        move = np.clip(move, -JOINT_STEP, JOINT_STEP)
        ends = np.cumsum([len(cause.numbers) for cause in causes])[:-1]
        steps = np.split(move[:width] * units, ends)
        causes = tuple(c._replace(numbers=c.numbers + step) for c, step in zip(causes, steps, strict=True))
        for (k, side), by in zip(places, move[width:], strict=True):
            turned[k, side] += by
        now = [turn(one, *by) for one, by in zip(records, turned, strict=True)]
    effects = [cause.effect for cause in begun if cause.effect is not None]
    for one, other in zip(records, now, strict=True):
        changed += float(np.sum((contribution([other], effects) - contribution([one], effects)) ** 2))
    return turned, changed
