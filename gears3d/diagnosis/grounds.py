"""Data sufficiency for a diagnosis, before and after the search for causes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.datums import gear_of
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.diagnosis.cause import Cause
    from gears3d.diagnosis.evidence import Evidence
    from gears3d.measured.checks import Admitted
    from gears3d.scenario import Scenario

Array = np.ndarray
# Minimum periods of the drive's fluctuation in at least one record, so that its motion repeats.
PERIODS = 3.0
# Minimum number of flights, or impacts, for torques, or restitution, as causes.
EVENTS = 8
# Minimum number of periods of an order, or revolutions of a tooth, in one record.
TURNS = 2.0
# Ratio of mean speeds below which they count as one.
ALIKE = 1.25
# Minimum ratio of the measured fluctuation to the nominal one; below it the motion is another.
SWING = 0.5
# Relative deviation of the mean speed from the nominal one that is reported.
OTHER_SPEED = 0.05
# Relative deviation of two of the rig's numbers that indicates another test rig.
OTHER_RIG = 0.5
# Ratio of a deviation to the backlash above which a note on the gears' size is given.
SIZED = 0.1
# Torques that depend on speed alone, with the number of parameters of each.
OF_SPEED = {"drag_coulomb": 1, "drag_viscous": 1, "drag_power": 2, "drag_differential": 2}
POINTS = 20_000
NEEDS = {"torque": "flights", "impact": "impacts"}


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


def of_channels(admitted: Iterable[Admitted]) -> list[Note]:
    """Return defects of the motion of records as admitted."""
    return [note for one in admitted for note in _of_channels(one)]


def _of_channels(one: Admitted) -> list[Note]:
    from math import degrees

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
    few = slice(None, None, max(len(time) // POINTS, 1))
    angles = [np.asarray(one.recording.signals[f"theta_{gear}_rad"])[few] for gear in ("drive", "loose")]
    radii = rig.rig().base_radius_drive, rig.rig().base_radius_loose
    turns = [2.0 * pi * each.frequency for each in harmonics]
    if turns and (time[-1] - time[0]) * min(turns) < 2.0 * pi:
        return []
    (rest, size, mean), (far, _, _) = (_apart(time[few], angle, turns) for angle in angles)
    claimed = float(
        np.hypot.reduce([0.0, *(each.amplitude / turn for each, turn in zip(harmonics, turns, strict=True))])
    )
    if turns and far * radii[1] < rest * radii[0] / 3.0 and rest * radii[0] > 0.05 * rig.rig().backlash:
        text = "the loose gear has the nominal motion of the drive gear, and the drive gear rattles: "
        text += (
            f"deviations from a steady fluctuation are {1e6 * far * radii[1]:.3g} um and {1e6 * rest * radii[0]:.3g} um"
        )
        return [Note("channels-swapped", text, "change the channels' names in record.toml", one.file, True)]
    if "harmonics" in one.stated and (size < SWING * claimed or (not turns and rest * radii[0] > rig.rig().backlash)):
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


def _apart(time: Array, angle: Array, turns: Sequence[float]) -> tuple[float, float, float]:
    """Return the deviation of an angle from steady fluctuations [rad rms], its size and mean speed [rad, rad/s]."""
    x = time - time.mean()
    columns = [np.ones_like(x), x]
    for turn in turns:
        columns += [np.cos(turn * x), np.sin(turn * x)]
    table = np.column_stack(columns)
    found = np.linalg.lstsq(table, angle, rcond=None)[0]
    return float(np.std(angle - table @ found)), float(np.hypot.reduce([0.0, *found[2:]])), float(found[1])


def of_records(records: Sequence[Evidence]) -> list[Note]:
    """Return the limits of the information in measured records."""
    notes: list[Note] = []
    if not any(len(one.channels.drive.time) for one in records):  # identified by their paths alone
        return notes
    spans = [float(np.ptp(one.channels.drive.time)) for one in records]
    periods = [span / one.scenario.period for span, one in zip(spans, records, strict=True)]
    if max(periods) < PERIODS:
        text = f"the longest record has {max(periods):.3g} periods of {show(records[0].scenario.period, 'time', 4)}"
        remedy = f"record at least {PERIODS:.0f} periods, better 30"
        notes.append(Note("too-short", text, remedy, "", True))
    still = [one for one in records if not len(one.channels.flights.time) and not len(one.channels.impacts.time)]
    told = "without free flights, drag, restitution and backlash are not observable"
    remedy = "increase the fluctuation of the drive: `gears3d excitation` prints the threshold"
    if len(still) == len(records):
        notes.append(Note("no-rattle", f"the gears stay in contact throughout: {told}", remedy))
    else:
        notes += [Note("no-rattle", "the gears stay in contact throughout", remedy, one.name) for one in still]
    speeds = [abs(one.motion.mean) for one in records]
    if max(speeds) < ALIKE * min(speeds) and len(still) < len(records):
        text = (
            f"all records have the same mean speed ({show(speeds[0], 'speed', 4)} of the drive): the speed dependence "
        )
        text += "of torques is determined by the fluctuation only"
        notes.append(Note("one-speed", text, "add records whose mean speeds span a factor of 4 or more"))
    return notes


def carried(records: Sequence[Evidence], cause: Cause) -> Note | None:
    """Return the reason why records are too few or too short for a cause; ``None`` if they suffice."""
    effect: Any = cause.effect
    if effect is None:
        return None
    word = NEEDS.get(effect.place)
    count = sum(len(getattr(one.channels, word).time) for one in records) if word else EVENTS
    if count < EVENTS:
        text = f"{effect.kind} is supported by {count} {word} only"
        return Note("few-events", text, f"record at least {EVENTS} {word}, better 100")
    order = getattr(effect, "order", 0) or (1 if hasattr(effect, "tooth") or effect.kind == "eccentricity" else 0)
    if not order or effect.place == "motion":
        return None
    gear = getattr(effect, "gear", "loose" if effect.place == "torque" else "drive")
    passes = order * max((_turns(one, gear) for one in records), default=0.0)
    if passes < TURNS:
        text = f"{effect.kind} occurs {passes:.2g} times in the longest record: it does not repeat"
        return Note("few-turns", text, f"record at least {TURNS / order:.2g} revolutions of the {gear} gear")
    return None


def _turns(one: Evidence, gear: str) -> float:
    angle = one.channels.drive.angle
    turns = float(np.ptp(angle)) / (2.0 * pi) if len(angle) else 0.0
    return turns if gear == "drive" else turns * one.radii[0] / one.radii[1]


def of_causes(rig: Scenario, effects: Iterable[Any]) -> list[Note]:
    """Return doubts raised by the causes themselves."""
    claims = {
        "backlash": (rig.rig().backlash, "backlash_offset", "offset", "length"),
        "drag torque": (rig.rig().drag_torque, "drag_coulomb", "torque", "torque"),
        "restitution": (rig.rig().restitution, "restitution_offset", "offset", "ratio"),
    }
    notes, off = [], []
    for name, (claim, kind, parameter, family) in claims.items():
        change = sum(getattr(one, parameter) for one in effects if one.kind == kind)
        if claim > 0.0 and abs(change) > OTHER_RIG * claim:
            now, was = (
                (f"{each:.3g}" if family == "ratio" else show(each, family, 3)) for each in (claim + change, claim)
            )
            off.append(f"{name} {now} instead of {was}")
        if kind == "backlash_offset" and abs(change) > SIZED * claim:
            text = "backlash is an angle times a base radius: gears whose size differs by "
            text += f"{100.0 * -change / (claim + change):+.3g} % (module or numbers of teeth) are indistinguishable"
            notes.append(Note("gear-size", text, "check module and teeth of the rig"))
    if len(off) > 1:
        text = f"the records probably belong to a different rig: {', '.join(off)}"
        notes.append(Note("other-rig", text, "check which scenario belongs to these records", "", True))
    return notes


def of_speeds(records: Sequence[Evidence], effects: Iterable[Any]) -> list[Note]:
    """Return a note if a law of speed has as many numbers as records have mean speeds, so that no record tests it."""
    speeds = np.sort([abs(one.motion.mean) for one in records if len(one.channels.flights.time)])
    if len(speeds) < 2:
        return []
    count = 1 + int(np.count_nonzero(speeds[1:] > ALIKE * speeds[:-1]))
    laws = [one.kind for one in effects if one.kind in OF_SPEED]
    numbers = sum(OF_SPEED[kind] for kind in laws)
    if not 2 <= count <= numbers:
        return []
    text = (
        f"{' and '.join(laws)} have {numbers} numbers together, the records {count} mean speeds: no record tests how "
    )
    text += "the torque depends on speed"
    return [Note("few-speeds", text, f"add records at {numbers + 1 - count} or more other mean speeds")]


def of_zeros(admitted: Iterable[Admitted]) -> list[Note]:
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


def of_phases(causes: Iterable[Any]) -> list[Note]:
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


def of_teeth(records: Sequence[Evidence]) -> list[Note]:
    """Return a note that single teeth are not excluded in several records without marks."""
    gears = sorted({gear for one in records for gear in one.unmarked})
    if len(records) < 2 or not gears:
        return []
    text = f"angular datum of the {' and the '.join(gears)} gear is unknown: single tooth deviations may be undetected"
    return [Note("teeth-unseen", text, "record with a common index mark")]
