"""Validity of causes: those without support from records, rig or predicted path are not accepted.

Predicted path: in windows over the records, the rigid model is started from a measured state under the drive's measured
motion. Over a period the motion has no time to diverge by chance, but a wrong cause has an effect. An excerpt is one
such window, for the views.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from gears3d.diagnosis import path_fit
from gears3d.diagnosis.causes import ACCEPT, fit, score, table
from gears3d.diagnosis.path_candidates import scatter
from gears3d.diagnosis.path_fit import LAWS
from gears3d.diagnosis.prediction import MOST_SCATTER, deviation, reading_error
from gears3d.diagnosis.preprocessing import Note, moved, turn
from gears3d.diagnosis.residual_patterns import Structure, bin_pattern, channel_of
from gears3d.diagnosis.residual_tests import FALSE_ALARM, are_coarse, restitution_patterns, single_record_note
from gears3d.diagnosis.search import directions
from gears3d.diagnosis.shooting import at_rest
from gears3d.diagnosis.verdict import SAME_SPEED, Named, cause_notes, name_causes, reported_in_addition, speed_notes
from gears3d.effects import Code, SensorEffect, catalogue
from gears3d.errors import EngineError, Fault, InputError
from gears3d.lumped.pickup import Start, pick_up
from gears3d.lumped.rigid import tooth
from gears3d.recording import Recording
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.diagnosis.causes import Cause, Fit
    from gears3d.diagnosis.evidence import Evidence, Paths
    from gears3d.diagnosis.path_candidates import Scatter
    from gears3d.diagnosis.pitch_error import ShortTooth
    from gears3d.diagnosis.residual_tests import Split
    from gears3d.diagnosis.run_information import Deviations, Path
    from gears3d.diagnosis.search import Rival, Search
    from gears3d.diagnosis.shooting import Windows
    from gears3d.measured.checks import Admitted
    from gears3d.measured.segmentation import Track
    from gears3d.scenario import Scenario

Array = np.ndarray
# Minimum periods of the drive's fluctuation in at least one record, so that its motion repeats.
FEWEST_PERIODS = 3.0
# Minimum number of flights, or impacts, for torques, or restitution, as causes.
FEWEST_EVENTS = 8
# Multiple of the drag torque that keeps any gear of the operating space on its flank; quantiles of windows, and ratio
# of their residuals with it and without up to which it explains them as well: it was 0.98 of a gear that stays in
# contact (space, 1073), and several hundred where a mesh drag is found (577).
HELD, MOST_WINDOWS, AS_WELL = 30.0, (0.5, 0.8), 1.1
# Minimum number of periods of an order, or revolutions of a tooth, in one record.
FEWEST_REVOLUTIONS = 2.0
EVENTS_OF = {"torque": "flights", "impact": "impacts"}
# Scatter of restitution, in units of the coefficient, that segmentation causes by itself.
SEGMENTATION_SCATTER = 0.05
# Minimum scatter of a record relative to that of all, and fraction of the records that must have it: it belongs to the
# gears; in a few records only, it comes from segmentation.
SAME_SCATTER, SCATTERING_RECORDS = 0.5, 0.5
# Largest fraction of the residuals of impacts explained by patterns, for the rest to be called scatter.
EXPLAINED_SHARE = 0.1


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
    records: Sequence[Evidence] = (),
    windows: Windows | None = None,
) -> Accepted:
    """Separate the causes that records and rig support from those that they do not.

    path: with the causes; records: all, in sequence: one is the reference of phases; windows: of the path.
    """
    additional = reported_in_addition(scatter, short)
    named = sorted([*name_causes(found, others, path, records), *additional], key=lambda one: -one.gain)
    weak = _insufficient(found) if windows is None else _unbounded(windows, found.fit)
    own = [cause.effect for cause, why in zip(found.fit.causes, weak, strict=True) if why is None]
    stated = [
        *notes,
        *record_notes(found.records, followed=windows is not None),
        *cause_notes(rig, own),
        *speed_notes(found.records, own),
        *(why for why in weak if why is not None),
    ]
    blocked = any(one.blocks for one in stated)
    stays = [why is None and not blocked for why in weak]
    kept = [cause.effect for cause, stay in zip(found.fit.causes, stays, strict=True) if stay]
    causes = tuple(one for one in named if not blocked and (one.effect in kept or one in additional))
    suspects = tuple(one for one in named if one not in causes)
    if not all(stays):
        found = _with_some(found, stays)
        others = [each for each, stay in zip(others, stays, strict=True) if stay]
    return Accepted(found, others, causes, suspects, tuple(stated), not blocked and (bool(causes) or not suspects))


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
    stated = [
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
    accepted = _rejecting(accepted, bad, stated)
    return accepted, left if accepted.causes else []


def level_in(longer: Windows, causes: Sequence[Cause]) -> float:
    """Return the median mean square of residuals in longer windows, with the starts alone fitted.

    Args:
        longer: windows, with datums and motion of those to which the causes were fitted.
        causes: with their numbers.
    """
    effects = path_fit.effects_of(causes)
    longer.restart(effects, anew=True)
    rest = path_fit.settled(longer, effects, longer.residuals(effects))
    rest = path_fit.refined(longer, effects, path_fit.followed(longer, effects, rest))
    shown = longer.read
    rest = path_fit.settled(longer, effects, longer.residuals(effects)) if longer.unrounded(effects) else rest
    longer.read = shown
    return longer.usual(rest)


def fitted_in(longer: Windows, causes: Sequence[Cause], most: float) -> tuple[Cause, ...]:
    """Return causes fitted to longer windows, where these leave at most a mean square of residuals; none otherwise."""
    now = path_fit.state_of(longer, causes, longer.residuals(path_fit.effects_of(causes)))
    now = path_fit.refitted(longer, now) if causes else now
    return now.causes if longer.usual(now.rest) < most else ()


class Against(NamedTuple):
    """Causes of the channel search, fitted to the trajectory.

    Args:
        causes: with the numbers that fit the trajectory.
        covariance: of these [SI], (p, p).
        level: median mean square of a window's residuals with them.
    """

    causes: tuple[Cause, ...]
    covariance: Array
    level: float


def halves(windows: Windows, causes: Sequence[Cause]) -> list[tuple[float, float, float, float, float]]:
    """Return the held-out prediction of every second window by causes fitted to the others, and vice versa.

    Args:
        windows: of the records, with starts that fit.
        causes: with their numbers.

    Returns:
        Mean square of residuals without and with the causes, in variances of the noise; their root mean squares [m];
        gain in log-likelihood.
    """
    made, before = [], path_fit.state_of(windows, causes, windows.read)
    for first in (0, 1):
        parts = [windows.only(np.arange(k, len(windows), 2))[0] for k in (first, 1 - first)]
        for one in parts:
            one.zeros, one.turned = before.zeros.copy(), before.turned.copy()
        now = path_fit.fitted(parts[0], path_fit.state_of(parts[0], causes, parts[0].read))
        held, levels = parts[1], []
        for trial in ((), now.causes):
            held.restart(path_fit.effects_of(trial))
            rest = path_fit.settled(held, path_fit.effects_of(trial), held.residuals(path_fit.effects_of(trial)))
            level, missed = held.level(rest), held.level(held.missed(path_fit.effects_of(trial)))
            levels.append(
                (float(np.median(level)), float(np.sqrt(np.median(missed))), path_fit.state_of(held, trial, rest))
            )
        (base, off, blind), (extended, left, more) = levels
        gain = 0.5 * path_fit.gain_of(held, blind, more)[0]
        made.append((base, extended, off, left, gain))
    path_fit.restore(windows, before)
    return made


def against(windows: Windows, causes: Sequence[Cause], turned: Sequence[tuple[float, float]]) -> Against | None:
    """Return causes of the channel search fitted to the trajectory; ``None`` where the rig cannot have them.

    Args:
        windows: of the records, with starts that fit.
        causes: of the channel search.
        turned: shifts of the angular datums of both gears in each record [rad].
    """
    before = path_fit.state_of(windows, (), windows.read)
    windows.turned = np.array(turned, float).reshape(-1, 2)
    try:
        rest = windows.residuals(path_fit.effects_of(causes))
        found = path_fit.polished(windows, path_fit.fitted(windows, path_fit.state_of(windows, causes, rest)))
        return Against(found.causes, path_fit.covariance_of(windows, found), windows.usual(found.rest))
    except InputError:
        return None
    finally:
        path_fit.restore(windows, before)


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
    note = Note("path-refutes", text, "check the motion, the counts and the condition of the records")
    left = _rejecting(accepted, refuted, [note])
    return left._replace(decides=accepted.decides) if agrees else left


def _rejecting(accepted: Accepted, refuted: Sequence[Named], notes: Sequence[Note]) -> Accepted:
    """Return the accepted causes without refuted ones, and notes on these."""
    causes = tuple(one for one in accepted.causes if one not in refuted)
    kept = [one.effect for one in causes]
    stays = [cause.effect in kept for cause in accepted.found.fit.causes]
    others = [each for each, stay in zip(accepted.others, stays, strict=True) if stay]
    found = accepted.found if all(stays) else _with_some(accepted.found, stays)
    suspects, stated = (*refuted, *accepted.suspects), (*accepted.notes, *notes)
    return Accepted(found, others, causes, suspects, stated, accepted.decides and bool(causes))


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


def _unbounded(windows: Windows, now: Fit) -> list[Note | None]:
    """Return why the trajectory does not determine each cause, ``None`` where it does.

    Of a gear that stays in contact throughout, it shows some torque that is large enough: not which, and no film.
    """
    causes = now.causes
    torques = [one.effect is not None and one.effect.place == "torque" for one in causes]
    replaced = [own or one.candidate.kind in LAWS for one, own in zip(causes, torques, strict=True)]
    if not any(torques):
        return [None] * len(causes)
    held = catalogue()["drag_coulomb"](torque=HELD * windows.values.drag_torque)
    others = path_fit.effects_of([one for one, own in zip(causes, replaced, strict=True) if not own])
    free, none = windows.level(windows.residuals(path_fit.effects_of(causes))), np.zeros(len(windows))
    still = windows.level(windows.residuals([*others, held], at_rest(none, none, 1)))
    holds = bool(np.all(np.quantile(still, MOST_WINDOWS) <= AS_WELL * np.quantile(free, MOST_WINDOWS)))
    spread = np.split(np.diag(now.covariance), np.cumsum([len(one.numbers) for one in causes])[:-1])
    varies = [bool(np.any(np.isfinite(own) & (own > 0.0))) for own in spread]  # the trajectory, with its size
    shows = [not holds and (sure or not own) for own, sure in zip(torques, varies, strict=True)]
    text = "the gears stay in contact throughout: any torque that is large enough for that explains the records as well"
    remedy = "increase the fluctuation of the drive: `gears3d excitation` prints the threshold"
    return [
        Note("few-events", f"{one.candidate.kind}: {text}", remedy) if own and not sure else None
        for one, own, sure in zip(causes, replaced, shows, strict=True)
    ]


def _with_some(found: Search, stays: Sequence[bool]) -> Search:
    """Return a search with some of its causes, refitted."""
    causes = [cause for cause, stay in zip(found.fit.causes, stays, strict=True) if stay]
    now = fit(found.records, found.base, causes)
    return found._replace(fit=now, left=score(found.known, now.rest, directions(found.records, now)))


def record_notes(records: Sequence[Evidence], *, followed: bool) -> list[Note]:
    """Return the limits of the information in measured records; followed: whether their trajectories are explained."""
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
    free = [one for one in records if len(one.channels.flights.time) >= FEWEST_EVENTS]
    if free and not followed and not any(len(one.motion.harmonics) for one in free):
        text = "gears lose contact, but the readings of the drive show no periodic fluctuation"
        notes.append(Note("motion-unseen", text, "record with a finer encoder of the drive", "", True))
    reason = "without free flights, drag, restitution and backlash are not observable"
    remedy = "increase the fluctuation of the drive: `gears3d excitation` prints the threshold"
    if len(still) == len(records):
        notes.append(Note("no-rattle", f"the gears stay in contact throughout: {reason}", remedy))
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


# Maximum duration of a window, or a stretch, in seconds; half of that if the drive does not fluctuate.
LONGEST = 2.0
# Number of windows of a record in which models are compared with the measurement.
WINDOWS = 8
# Ratio of distances above which one counts as larger, and the probability by chance of as many larger ones.
FARTHER, CHANCE = 1.05, 0.01
# Largest squared distance of the extended rig, relative to the rig's, and its largest ratio to the noise.
HARDLY, NOISY = 0.5, 5.0
# Noise of a displacement [m] of a record without any.
ROUNDING = 1e-15
# Samples per second; readings are averaged to it, which reduces noise.
RATE = 8000.0
# Minimum and maximum number of points that define the drive's motion in the models.
KNOTS = (24, 4000)
# Time to either side for the estimate of place and speed without a segmented flight [s].
BESIDE = 2.5e-3
# Limits of the middle of the gap, relative to the backlash.
AMID = (0.3, 0.7)


class Begin(NamedTuple):
    """Initial state: time [s], displacement [m] and its rate [m/s], or the flank in contact."""

    time: float
    place: float
    rate: float
    riding: int | None = None


class PathErrors(NamedTuple):
    """Deviation of models from the measured path, from measured states on: windows of a period over all records.

    Args:
        record: name of each window's record, (w,).
        noise: of the measured displacement, (w,) [m].
        base: root mean square distance of the rig's displacement from the measured one, (w,) [m].
        extended: the same of the extended rig, (w,).
        without: the same of the extended rig without each of the causes, (c, w).
    """

    record: tuple[str, ...]
    noise: Array
    base: Array
    extended: Array
    without: Array

    def refuted(self) -> list[bool]:
        """Return for each cause whether the path is predicted better without it; true for all if the rig is better."""
        if _farther(self.extended, self.base):
            return [True] * len(self.without)
        return [_farther(self.extended, own) for own in self.without]

    def left(self) -> list[Structure]:
        """Return the residual of the path with the extended rig if it is hardly smaller than with the rig."""
        if not len(self.base):
            return []
        base, extended, noise = (float(np.mean(one**2)) for one in (self.base, self.extended, self.noise))
        noise = max(noise, ROUNDING**2)
        if extended < max(HARDLY * base, NOISY**2 * noise):
            return []
        worst, size = self.record[int(np.argmax(self.extended))], float(np.sqrt(extended))
        return [Structure("path.all", extended / noise, 0.0, size, "m", float("nan"), extended / noise, worst)]


def _farther(one: Array, other: Array) -> bool:
    """Return whether distances are larger as a whole, and in significantly more windows."""
    from scipy.stats import binomtest

    if not len(one) or float(np.sum(one**2)) <= float(np.sum(other**2)):
        return False
    more, less = int(np.sum(one > FARTHER * other)), int(np.sum(other > FARTHER * one))
    return bool(more > 0 and binomtest(more, more + less, 0.5, "greater").pvalue < CHANCE)


def path_errors(
    records: Sequence[Evidence],
    causes: Sequence[Named],
    admitted: Sequence[Admitted],
    track: Callable[[Admitted], Track],
) -> PathErrors:
    """Return the deviations of rig and extended rig from the measured paths."""
    named, noise, far = [], [], []
    for one in admitted:
        seen = next((each for each in records if each.name == one.file), None)
        if seen is None or one.rig is None:
            continue
        known = track(one)
        own, tables = as_read(seen, causes)
        rigs = [one.rig, with_effects(one.rig, tables)]
        rigs += [with_effects(one.rig, tables[:k] + tables[k + 1 :]) for k in range(len(tables))]
        zeros = [zero_of(known, own, rig) for rig in rigs]
        period = one.rig.period if one.rig.motion.harmonics else 0.25 * LONGEST
        span, first, last = min(period, LONGEST), float(known.time[0]), float(known.time[-1])
        free = first  # overlapping windows are not independent
        for at in np.linspace(first, max(last - 2.0 * period - span, first), WINDOWS):
            begin = begin_of(known, own, zeros[1], one.rig, float(at))
            if begin.time < free or begin.time + span > last:
                continue
            free = begin.time + span
            measured, few = readings(known, own, zeros[1], (begin.time, begin.time + span), one.rig)
            place = measured.signals["displacement_m"]
            row = []
            for rig, zero in zip(rigs, zeros, strict=True):
                start = begin._replace(place=begin.place + zeros[1] - zero)
                made = followed(rig, rigs[1], start, zero, span, known)[0]
                path = np.interp(measured.time, made.time, made.signals["displacement_m"])
                row.append(float(np.sqrt(np.mean((path + zero - place - zeros[1]) ** 2))))
            named.append(one.file)
            noise.append(known.noise / np.sqrt(few))
            far.append(row)
    table_of = np.array(far).T if far else np.zeros((2 + len(causes), 0))
    return PathErrors(tuple(named), np.array(noise), table_of[0], table_of[1], table_of[2:])


def with_effects(rig: Scenario, tables: Sequence[dict[str, Any]]) -> Scenario:
    """Return a rig with more effects."""
    return rig.with_([("effect[+]", each) for each in tables]) if tables else rig


def as_read(seen: Evidence, causes: Sequence[Named]) -> tuple[Evidence, list[dict[str, Any]]]:
    """Return a record's evidence, and causes, over the angles as read."""
    turned = seen.turned
    if turned == (0.0, 0.0):
        return seen, [cause.table for cause in causes]
    return turn(seen, -turned[0], -turned[1]), [table(moved(cause.effect, *turned)) for cause in causes]


def _place(known: Track, drive: Array, loose: Array) -> Array:
    """Return the displacement, with the datum of both angles [m]."""
    return known.radii[1] * loose - known.radii[0] * drive


def zero_of(known: Track, seen: Evidence | None, extended: Scenario) -> float:
    """Return the displacement of the record on the active flank, without deviations [m]."""
    own = seen.channels.contacts if seen is not None else None
    if seen is not None and own is not None and len(own.time):
        rows, b = extended.rows(), extended.rig().backlash
        flanks = deviation(rows, seen.pair, own.drive, own.loose, own.flank) + b * own.flank
        rest = _place(known, own.drive, own.loose) - flanks
        late = reading_error(seen.spared, "loose", own.loose, known.steady.curve(own.time, 1) * _ratio(known))
        return float(np.median(rest + known.radii[1] * late))
    some = slice(None, None, max(len(known.time) // 200_000, 1))
    low, high = np.quantile(known.place[some], [0.002, 0.998])
    b = extended.rig().backlash
    first = known.radii[1] * known.origin[1] - known.radii[0] * known.origin[0]
    return first + float(0.5 * (low + high - b) if high - low > 0.8 * b else low)


def _ratio(known: Track) -> float:
    return known.radii[0] / known.radii[1]


def begin_of(known: Track, seen: Evidence | None, zero: float, rig: Scenario, half: float) -> Begin:
    """Return the start of a stretch: in the middle of the longest flight of a period after a time."""
    period = rig.period if rig.motion.harmonics else 0.25 * LONGEST
    if seen is not None and len(seen.fine[0]):
        time, angle, speed = (column[:, column.shape[1] // 2] for column in seen.fine)
        lasts = seen.fine[0][:, -1] - seen.fine[0][:, 0]
        near = np.flatnonzero((time >= half) & (time < half + period))
        at = int(near[np.argmax(lasts[near])]) if len(near) else int(np.argmin(np.abs(time - half)))
        drive, rate = known.steady.curve(time[at]), known.steady.curve(time[at], 1)
        place = known.radii[1] * (angle[at] - _beside(seen, at)) - known.radii[0] * drive - zero
        return Begin(float(time[at]), float(place), float(known.radii[1] * speed[at] - known.radii[0] * rate))
    return _amid(known, zero, rig, half)


def _beside(seen: Evidence, at: int) -> float:
    """Return the deviation of bin means of a flight from its curved path [rad]."""
    time, _, speed = (column[at] for column in seen.fine)
    width = float(np.median(np.diff(seen.channels.flights.time[at])))
    return float((speed[-1] - speed[0]) / (time[-1] - time[0])) * width**2 / 24.0


def _amid(known: Track, zero: float, rig: Scenario, half: float) -> Begin:
    """Return the first crossing of the gap after a time, or the flank with permanent contact."""
    b, first = rig.rig().backlash, int(np.searchsorted(known.time, half))
    drive, loose, _ = known.part(slice(first, None))
    share = (_place(known, drive, loose) - zero) / b
    between = np.flatnonzero((share > AMID[0]) & (share < AMID[1]))
    if not len(between):
        return Begin(half, 0.0, 0.0, 0 if np.median(share) < 0.5 else 1)
    at = float(known.time[first + between[0]])
    rows = slice(*np.searchsorted(known.time, [at - BESIDE, at + BESIDE]))
    drive, loose, _ = known.part(rows)
    line = np.polyfit(known.time[rows] - at, _place(known, drive, loose) - zero, 2)
    return Begin(at, float(line[2]), float(line[1]))


def readings(
    known: Track, seen: Evidence | None, zero: float, span: tuple[float, float], rig: Scenario
) -> tuple[Recording, int]:
    """Return the averaged readings of a stretch, and the number of readings per sample."""
    first, last = np.searchsorted(known.time, span)
    few = max(int(1.0 / (RATE * known.spacing)), 1)
    count = max((last - first) // few, 1)
    rows = slice(first, first + count * few)
    time, loose = (values[rows].reshape(count, -1).mean(axis=1) for values in (known.time, known.loose))
    drive = known.steady.curve(time)
    signals = {
        "time_s": time,
        "theta_drive_rad": drive,
        "theta_loose_rad": loose,
        "omega_drive_rad_s": known.steady.curve(time, 1),
        "displacement_m": _place(known, drive, loose) - zero,
    }
    meta = {"model": "measured", "title": rig.title}
    return Recording(signals, _impacts(known, seen, span, rig), meta), few


def _impacts(known: Track, seen: Evidence | None, span: tuple[float, float], rig: Scenario) -> dict[str, Array]:
    if seen is None:
        return {}
    own, values = seen.channels.impacts, rig.rig()
    keep = (own.time >= span[0]) & (own.time <= span[1])
    velocity, rebound = own.velocity[keep], own.rebound[keep]
    return {
        "time_s": own.time[keep],
        "flank": own.flank[keep],
        "velocity_m_s": velocity,
        "rebound_m_s": rebound,
        "impulse_N_s": values.inertia / known.radii[1] ** 2 * (rebound - velocity),
        "tooth_drive": tooth(own.drive[keep], values.teeth_drive),
        "tooth_loose": tooth(own.loose[keep], values.teeth_loose),
    }


def followed(
    rig: Scenario, extended: Scenario, begin: Begin, zero: float, span: float, known: Track
) -> tuple[Recording, float]:
    """Return the prediction of a stretch by a rig as read by its encoders, and the shift of its flanks by these [m]."""
    time = np.linspace(begin.time, begin.time + span, _knots(known, span))
    read, speed = known.steady.curve(time), known.steady.curve(time, 1)
    sensors = [one for one in rig.effects if isinstance(one, SensorEffect)]
    wrong = _misread(known, sensors, read, speed, zero + begin.place)
    more = _swing(extended, time) - _swing(rig, time)  # a motion effect of the extended rig only
    drive = read - reading_error(sensors, "drive", read, speed) - (more - more[0])
    rate = begin.rate - known.radii[0] * float(np.gradient(drive - read, time, edge_order=2)[0])
    rate -= float(np.gradient(wrong, time, edge_order=2)[0])
    loose = (begin.place + zero + known.radii[0] * read[0]) / known.radii[1]
    start = Start(begin.time, float(drive[0]), float(loose), float(begin.place - wrong[0]), rate)
    made = pick_up(rig, start, time, drive, RATE, begin.riding)
    signals = dict(made.signals)
    signals["displacement_m"] = signals["displacement_m"] + np.interp(made.time, time, wrong)
    return Recording(signals, made.impacts, made.meta), 1.1 * float(np.abs(wrong).max())


def _knots(known: Track, span: float) -> int:
    """Return the number of points of the drive's motion: two per knot interval of its curve."""
    return int(np.clip(np.ceil(2.0 * span / known.steady.curve.bends) + 1, *KNOTS))


def _misread(known: Track, sensors: Sequence[Any], drive: Array, speed: Array, place: float) -> Array:
    """Return the contribution of sensors to the displacement, with its mean as the record's datum [m]."""
    loose = (place + known.radii[0] * drive) / known.radii[1]
    wrong = known.radii[1] * reading_error(sensors, "loose", loose, speed * _ratio(known))
    wrong = wrong - known.radii[0] * reading_error(sensors, "drive", drive, speed)
    return wrong - wrong.mean()


def _swing(rig: Scenario, time: Array) -> Array:
    """Return the contribution of motion effects to the drive's angle [rad]."""
    total = np.zeros_like(time)
    for row in rig.rows():
        if row.code == Code.MOTION_HARMONIC:
            turn = 2.0 * pi * row.p[1]
            total -= row.p[0] / turn * np.cos(turn * time + row.p[2])
    return total


# Shown periods of the drive's slowest fluctuation, limited to the length of a window.
PERIODS = 3.0
# Standard deviations of a sample within which the measured gear is shown on a flank.
ON_FLANK = 4.0
# The same relative to the backlash.
ON_FLANK_SHARE = 5e-3


@dataclass(frozen=True, eq=False)
class Excerpt:
    """One motion three times, each with its displacement from the mean active flank.

    Args:
        name: of the record.
        measured: readings, averaged; with impacts if the record was segmented.
        base: the rig from the measured initial state, under the drive's measured motion.
        extended: the same with the causes.
        rig: scenario of the record's condition.
        extended_rig: the same with the causes.
        near: gaps within which each of the three is shown on a flank [m].
        riding: flank in contact at the start; ``None`` in flight.
    """

    name: str
    measured: Recording
    base: Recording
    extended: Recording
    rig: Scenario
    extended_rig: Scenario
    near: tuple[float, float, float]
    riding: int | None = None


class Diagnosed(Protocol):
    """The part of a diagnosis that an excerpt needs."""

    @property
    def found(self) -> Search: ...  # noqa: D102
    @property
    def causes(self) -> Sequence[Named]: ...  # noqa: D102
    @property
    def held(self) -> Sequence[Split]: ...  # noqa: D102
    @property
    def zeros(self) -> dict[str, float]: ...  # noqa: D102


def excerpt(found: Diagnosed, admitted: Sequence[Admitted]) -> Excerpt:
    """Return a stretch of the record with the largest gain by the causes, or of the first.

    Raises:
        InputError: no record determines the place of the loose gear, or the rigid model does not cover the rig.
        EngineError: the motion cannot be continued.
    """
    from gears3d.measured.segmentation import path_of

    one = _largest_gain(found, admitted)
    assert one.rig is not None
    known = path_of(one.recording, one.rig, one.file)
    seen, extended, zero = _extended(found, one, known)
    noise = known.noise
    begin = begin_of(known, seen, zero, one.rig, _begin_search(known, one.rig))
    span = _duration(one.rig, known, begin)
    measured, few = readings(known, seen, zero, (begin.time, begin.time + span), one.rig)
    seen_as = [followed(rig, extended, begin, zero, span, known) for rig in (one.rig, extended)]
    touching = max(ON_FLANK * max(noise / np.sqrt(few), known.slack), ON_FLANK_SHARE * one.rig.rig().backlash)
    near = (float(touching), seen_as[0][1], seen_as[1][1])
    return Excerpt(one.file, measured, seen_as[0][0], seen_as[1][0], one.rig, extended, near, begin.riding)


def _extended(found: Diagnosed, one: Admitted, known: Track) -> tuple[Evidence | None, Scenario, float]:
    """Return a record's evidence by angles as read, its extended rig, and the displacement on the flank."""
    assert one.rig is not None
    seen, tables = next((each for each in found.found.records if each.name == one.file), None), []
    if seen is None:
        tables = [cause.table for cause in found.causes]
    else:
        seen, tables = as_read(seen, found.causes)
    extended = with_effects(one.rig, tables)
    held_off = any(cause.kind in LAWS for cause in found.causes)  # from the active flank
    zero = found.zeros.get(one.file) if held_off else None
    return seen, extended, zero_of(known, seen, extended) if zero is None else zero


def _largest_gain(found: Diagnosed, admitted: Sequence[Admitted]) -> Admitted:
    """Return the record with the largest likelihood gain by the causes, or the first that was used."""
    used = {each.name for each in found.found.records}
    usable = [one for one in admitted if one.rig is not None and one.file in used] or list(admitted)
    if not usable:
        raise InputError(Fault("", "no record is given", "name at least one"))
    gains = [sum(each.likelihood for each in found.held if each.held[0].startswith(one.file)) for one in usable]
    return usable[int(np.argmax(gains))]


def _duration(rig: Scenario, known: Track, begin: Begin) -> float:
    frequencies = [one.frequency for one in rig.motion.harmonics if one.frequency > 0.0]
    wanted = min(PERIODS / min(frequencies), LONGEST) if frequencies else 0.5 * LONGEST
    return min(wanted, float(known.time[-1]) - begin.time)


def _begin_search(known: Track, rig: Scenario) -> float:
    """Return the start time of the search for a stretch in the middle of a record [s]."""
    half = 0.5 * float(known.time[0] + known.time[-1])
    period = rig.period if rig.motion.harmonics else 0.25 * LONGEST
    return max(half - 0.5 * PERIODS * period, float(known.time[0]))


def own_scatter(records: Sequence[Evidence], found: Search, left: Sequence[Structure]) -> Scatter | None:
    """Return the scatter of restitution about the prediction with causes; ``None`` without any, or if it follows a law.

    Rebounds that depend on angles, speed, flank or earlier rebounds do not scatter: an unknown variable causes them.
    """
    effects = [cause.effect for cause in found.fit.causes if cause.effect is not None]
    spread = scatter(records, effects)
    unit = max(found.records[0].rig.restitution, 0.1)
    if spread is None or spread.gain < ACCEPT or not SEGMENTATION_SCATTER * unit <= spread.value <= MOST_SCATTER:
        return None
    own = np.array([each.value for one in records if (each := scatter([one], effects)) is not None])
    like = (own > SAME_SCATTER * spread.value) & (own < spread.value / SAME_SCATTER)
    if len(own) and float(np.mean(like)) < SCATTERING_RECORDS:
        return None
    rest = found.fit.rest[found.known.spans["impact"]]
    worth = max((one.worth for one in left if channel_of(one.name) == "impact"), default=0.0)
    return spread if worth < EXPLAINED_SHARE * float(rest @ rest) else None


def scatter_patterns(seen: Deviations | None, highest: int) -> list[Structure]:
    """Return what the restitutions of single impacts depend on, strongest first; what depends does not scatter.

    highest: order that is tested.
    """
    if seen is None or not len(seen.value):
        return []
    usual, (own, sure) = float(np.median(seen.speed)), (seen.value, 1.0 / seen.sigma)
    record = np.repeat(np.arange(len(seen.drive)), [len(one) for one in seen.drive])
    angles = {"drive": seen.drive, "loose": seen.loose}
    locked = dict(zip(angles, seen.locked.T.tolist(), strict=True))
    found = [
        *bin_pattern("impact.speed", own * usual, sure / usual, seen.speed, "m/s", least=1.0, record=record),
        *bin_pattern("impact.flank", own * usual, sure / usual, seen.flank.astype(float), "m/s", 2, 1.0, record),
        *restitution_patterns(own * usual, sure / usual, angles, locked, highest),
    ]
    least = EXPLAINED_SHARE * float(np.sum((own * sure) ** 2))
    clear = [one for one in found if one.chance * len(found) < FALSE_ALARM and one.worth > least]
    return sorted(clear, key=lambda one: -one.worth)
