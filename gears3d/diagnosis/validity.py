"""Validity of causes: those without support from records, rig or predicted path are not accepted."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import fit, score
from gears3d.diagnosis.preprocessing import Note
from gears3d.diagnosis.residual_tests import are_coarse, single_record_note
from gears3d.diagnosis.search import directions
from gears3d.diagnosis.verdict import Named, name_causes, reported_in_addition
from gears3d.diagnosis.windows import path_errors
from gears3d.errors import EngineError, InputError
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.diagnosis.causes import Cause
    from gears3d.diagnosis.evidence import Evidence, Paths
    from gears3d.diagnosis.path_candidates import Scatter
    from gears3d.diagnosis.path_search import Path
    from gears3d.diagnosis.pitch_error import ShortTooth
    from gears3d.diagnosis.residual_patterns import Structure
    from gears3d.diagnosis.search import Rival, Search
    from gears3d.measured.checks import Admitted
    from gears3d.scenario import Scenario

Array = np.ndarray
# Minimum periods of the drive's fluctuation in at least one record, so that its motion repeats.
FEWEST_PERIODS = 3.0
# Minimum number of flights, or impacts, for torques, or restitution, as causes.
FEWEST_EVENTS = 8
# Minimum number of periods of an order, or revolutions of a tooth, in one record.
FEWEST_REVOLUTIONS = 2.0
# Ratio of mean speeds below which they count as one.
SAME_SPEED = 1.25
# Relative deviation of two of the rig's numbers that indicates another test rig.
OTHER_RIG = 0.5
# Ratio of a deviation to the backlash above which a note on the gears' size is given.
GEAR_SIZE = 0.1
# Torques that depend on speed alone, with the number of parameters of each.
SPEED_LAWS = {"drag_coulomb": 1, "drag_viscous": 1, "drag_power": 2, "drag_differential": 2}
EVENTS_OF = {"torque": "flights", "impact": "impacts"}


class Accepted(NamedTuple):
    """Causes that are accepted, and those that are not.

    Args:
        found: the search with the accepted causes.
        others: their competing hypotheses.
        causes: in words.
        suspects: those not accepted, in words.
        notes: all of them.
        decides: whether a verdict may be given.
    """

    found: Search
    others: list[list[Rival]]
    causes: tuple[Named, ...]
    suspects: tuple[Named, ...]
    notes: tuple[Note, ...]
    decides: bool


def split_accepted(
    found: Search,
    others: list[list[Rival]],
    scatter: Scatter | None,
    short: ShortTooth | None,
    rig: Scenario,
    notes: Sequence[Note],
    path: Path | None = None,
) -> Accepted:
    """Separate the causes that records and rig support from those that they do not."""
    additional = reported_in_addition(scatter, short)
    named = sorted([*name_causes(found, others, path), *additional], key=lambda one: -one.gain)
    weak = _insufficient(found) if path is None else [None] * len(found.fit.causes)
    own = [cause.effect for cause, why in zip(found.fit.causes, weak, strict=True) if why is None]
    told = [
        *notes,
        *record_notes(found.records),
        *cause_notes(rig, own),
        *speed_notes(found.records, own),
        *(why for why in weak if why is not None),
    ]
    blocked = any(one.blocks for one in told)
    stays = [why is None and not blocked for why in weak]
    kept = [cause.effect for cause, stay in zip(found.fit.causes, stays, strict=True) if stay]
    causes = tuple(one for one in named if not blocked and (one.effect in kept or one in additional))
    suspects = tuple(one for one in named if one not in causes)
    if not all(stays):
        found = _with_some(found, stays)
        others = [each for each, stay in zip(others, stays, strict=True) if stay]
    return Accepted(found, others, causes, suspects, tuple(told), not blocked and (bool(causes) or not suspects))


def tested_by_prediction(
    accepted: Accepted, admitted: Sequence[Admitted], paths: Paths
) -> tuple[Accepted, list[Structure]]:
    """Return the causes that improve the prediction of the path, and the residual of the path."""
    if not accepted.causes:
        return accepted, []
    try:
        errors = path_errors(accepted.found.records, accepted.causes, admitted, paths.of)
    except (EngineError, InputError):  # the model does not cover the rig
        return accepted, []
    refuted, chance = errors.refuted(), any(one.kind == "restitution_scatter" for one in accepted.causes)
    left = [] if chance else errors.left()
    if not any(refuted):
        return accepted, left
    bad = tuple(one for one, own in zip(accepted.causes, refuted, strict=True) if own)
    told = [
        Note(
            "path-refutes",
            f"{one.kind}: in {len(errors.base)} windows that begin in measured states, the model without it comes"
            f" nearer to the measured displacement: {_um(own)} without it, {_um(errors.extended)} with it,"
            f" {_um(errors.base)} for the rig as it is",
            "check the motion, the counts and the condition of the records",
        )
        for one, own in zip(accepted.causes, errors.without, strict=True)
        if one in bad
    ]
    accepted = _rejecting(accepted, bad, told)
    return accepted, left if accepted.causes else []


def tested_by_path(accepted: Accepted, path: Path, wrong: Sequence[bool], agrees: bool) -> Accepted:
    """Return candidate causes that the path does not contradict in size, and that reduce its error.

    Where the path agrees with the rig as it is, a refuted cause leaves nothing undecided.
    """
    bad = [cause.effect for cause, own in zip(accepted.found.fit.causes, wrong, strict=True) if own]
    refuted = tuple(one for one in accepted.causes if one.effect in bad)
    if not refuted:
        return accepted
    text = (
        f"{', '.join(one.kind for one in refuted)}: the displacement predicted in {path.windows} windows contradicts"
        f" it: it deviates by {np.sqrt(path.before):.3g} times the noise for the rig as it is, and by"
        f" {np.sqrt(path.after):.3g} times with the causes that it shows itself"
    )
    told = Note("path-refutes", text, "check the motion, the counts and the condition of the records")
    left = _rejecting(accepted, refuted, [told])
    return left._replace(decides=accepted.decides) if agrees else left


def _rejecting(accepted: Accepted, refuted: Sequence[Named], notes: Sequence[Note]) -> Accepted:
    """Return the accepted causes without refuted ones, and notes on these."""
    causes = tuple(one for one in accepted.causes if one not in refuted)
    kept = [one.effect for one in causes]
    stays = [cause.effect in kept for cause in accepted.found.fit.causes]
    others = [each for each, stay in zip(accepted.others, stays, strict=True) if stay]
    found = accepted.found if all(stays) else _with_some(accepted.found, stays)
    suspects, told = (*refuted, *accepted.suspects), (*accepted.notes, *notes)
    return Accepted(found, others, causes, suspects, told, accepted.decides and bool(causes))


def _um(errors: Array) -> str:
    return f"{1e6 * float(np.sqrt(np.mean(errors**2))):.3g} um"


def _insufficient(found: Search) -> list[Note | None]:
    """Return why records do not support each cause, ``None`` where they do; compensated ones are tested again."""
    weak = [insufficient_data(found.records, cause) for cause in found.fit.causes]
    while are_coarse(found.records):
        stays = [k for k, why in enumerate(weak) if why is None]
        now = fit(found.records, found.base, [found.fit.causes[k] for k in stays])
        anew = [single_record_note(found.records, now.rest, cause) for cause in now.causes]
        if not any(anew):
            break
        for k, why in zip(stays, anew, strict=True):
            weak[k] = why
    return weak


def _with_some(found: Search, stays: Sequence[bool]) -> Search:
    """Return a search with some of its causes, refitted."""
    causes = [cause for cause, stay in zip(found.fit.causes, stays, strict=True) if stay]
    now = fit(found.records, found.base, causes)
    return found._replace(fit=now, left=score(found.known, now.rest, directions(found.records, now)))


def record_notes(records: Sequence[Evidence]) -> list[Note]:
    """Return the limits of the information in measured records."""
    notes: list[Note] = []
    if not any(len(one.channels.drive.time) for one in records):  # identified by their paths alone
        return notes
    spans = [float(np.ptp(one.channels.drive.time)) for one in records]
    periods = [span / one.scenario.period for span, one in zip(spans, records, strict=True)]
    if max(periods) < FEWEST_PERIODS:
        text = f"the longest record has {max(periods):.3g} periods of {show(records[0].scenario.period, 'time', 4)}"
        remedy = f"record at least {FEWEST_PERIODS:.0f} periods, better 30"
        notes.append(Note("too-short", text, remedy, "", True))
    still = [one for one in records if not len(one.channels.flights.time) and not len(one.channels.impacts.time)]
    told = "without free flights, drag, restitution and backlash are not observable"
    remedy = "increase the fluctuation of the drive: `gears3d excitation` prints the threshold"
    if len(still) == len(records):
        notes.append(Note("no-rattle", f"the gears stay in contact throughout: {told}", remedy))
    else:
        notes += [Note("no-rattle", "the gears stay in contact throughout", remedy, one.name) for one in still]
    speeds = [abs(one.motion.mean) for one in records]
    if max(speeds) < SAME_SPEED * min(speeds) and len(still) < len(records):
        text = (
            f"all records have the same mean speed ({show(speeds[0], 'speed', 4)} of the drive): the speed dependence "
        )
        text += "of torques is determined by the fluctuation only"
        notes.append(Note("one-speed", text, "add records whose mean speeds span a factor of 4 or more"))
    return notes


def insufficient_data(records: Sequence[Evidence], cause: Cause) -> Note | None:
    """Return the reason why records are too few or too short for a cause; ``None`` if they suffice."""
    effect: Any = cause.effect
    if effect is None:
        return None
    word = EVENTS_OF.get(effect.place)
    count = sum(len(getattr(one.channels, word).time) for one in records) if word else FEWEST_EVENTS
    if count < FEWEST_EVENTS:
        text = f"{effect.kind} is supported by {count} {word} only"
        return Note("few-events", text, f"record at least {FEWEST_EVENTS} {word}, better 100")
    order = getattr(effect, "order", 0) or (1 if hasattr(effect, "tooth") or effect.kind == "eccentricity" else 0)
    if not order or effect.place == "motion":
        return None
    gear = getattr(effect, "gear", "loose" if effect.place == "torque" else "drive")
    passes = order * max((_revolutions(one, gear) for one in records), default=0.0)
    if passes < FEWEST_REVOLUTIONS:
        text = f"{effect.kind} occurs {passes:.2g} times in the longest record: it does not repeat"
        return Note(
            "few-turns", text, f"record at least {FEWEST_REVOLUTIONS / order:.2g} revolutions of the {gear} gear"
        )
    return None


def _revolutions(one: Evidence, gear: str) -> float:
    angle = one.channels.drive.angle
    turns = float(np.ptp(angle)) / (2.0 * pi) if len(angle) else 0.0
    return turns if gear == "drive" else turns * one.radii[0] / one.radii[1]


def cause_notes(rig: Scenario, effects: Iterable[Any]) -> list[Note]:
    """Return doubts raised by the causes themselves."""
    claims = {
        "backlash": (rig.rig().backlash, "backlash_offset", "offset", "length", "mount.backlash"),
        "drag torque": (rig.rig().drag_torque, "drag_coulomb", "torque", "torque", "drag.torque"),
        "restitution": (rig.rig().restitution, "restitution_offset", "offset", "ratio", "impact.restitution"),
    }
    notes, off = [], []
    for name, (claim, kind, parameter, family, key) in claims.items():
        change = sum(getattr(one, parameter) for one in effects if one.kind == kind)
        if claim > 0.0 and abs(change) > OTHER_RIG * claim:
            now, was = (
                (f"{each:.3g}" if family == "ratio" else show(each, family, 3)) for each in (claim + change, claim)
            )
            off.append(f"{name} {now} instead of {was}")
        if 0.0 < abs(change) < 1.96 * rig.uncertainty.get(key, 0.0):
            text = f"{name}: the change is within the uncertainty that the rig states for it"
            notes.append(Note("within-uncertainty", text, f"state {key} as found"))
        if kind == "drag_coulomb" and change and claim + change > 0.0:
            text = "the motion shows torque divided by inertia only: an inertia of the loose gear of "
            text += (
                f"{show(rig.rig().inertia * claim / (claim + change), 'inertia', 4)} with the stated drag torque is "
            )
            text += "indistinguishable from this drag torque"
            notes.append(Note("inertia-or-drag", text, "measure the inertia, or weigh it from a drawing"))
        if kind == "backlash_offset" and abs(change) > GEAR_SIZE * claim:
            text = "backlash is an angle times a base radius: gears whose size differs by "
            text += f"{100.0 * -change / (claim + change):+.3g} % (module or numbers of teeth) are indistinguishable"
            notes.append(Note("gear-size", text, "check module and teeth of the rig"))
    if len(off) > 1:
        text = f"the records probably belong to a different rig: {', '.join(off)}"
        notes.append(Note("other-rig", text, "check which scenario belongs to these records", "", True))
    return notes


def speed_notes(records: Sequence[Evidence], effects: Iterable[Any]) -> list[Note]:
    """Return a note if a law of speed has as many numbers as records have mean speeds, so that no record tests it."""
    speeds = np.sort([abs(one.motion.mean) for one in records if len(one.channels.flights.time)])
    if len(speeds) < 2:
        return []
    count = 1 + int(np.count_nonzero(speeds[1:] > SAME_SPEED * speeds[:-1]))
    laws = [one.kind for one in effects if one.kind in SPEED_LAWS]
    numbers = sum(SPEED_LAWS[kind] for kind in laws)
    if not 2 <= count <= numbers:
        return []
    text = (
        f"{' and '.join(laws)} have {numbers} numbers together, the records {count} mean speeds: no record tests how "
    )
    text += "the torque depends on speed"
    return [Note("few-speeds", text, f"add records at {numbers + 1 - count} or more other mean speeds")]


def phase_notes(causes: Iterable[Any]) -> list[Note]:
    """Return the reference of phases without an index mark."""
    told: dict[str, list[str]] = {}
    for one in causes:
        if one.zero:
            told.setdefault(one.zero, []).append(one.kind)
    remedy = "record with a common index mark to obtain phases and tooth numbers on the gears"
    return [
        Note("zeros-arbitrary", f"{', '.join(kinds)}: phase or tooth number counts from the first angle of this "
             "record; the angular datum of the other records is estimated from this effect", remedy, record)
        for record, kinds in told.items()
    ]  # fmt: skip


def tooth_notes(records: Sequence[Evidence]) -> list[Note]:
    """Return a note that single teeth are not excluded in several records without marks."""
    gears = sorted({gear for one in records for gear in one.unmarked})
    if len(records) < 2 or not gears:
        return []
    text = f"angular datum of the {' and the '.join(gears)} gear is unknown: single tooth deviations may be undetected"
    return [Note("teeth-unseen", text, "record with a common index mark")]
