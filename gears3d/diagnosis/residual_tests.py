"""Tests of fitted causes: held-out prediction, residual patterns that no cause explains, and contradicted causes.

Causes are fitted to all records, or stretches, but one, and predict that one, on request in the 3D engine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from math import atan2, cos, pi, tan
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import ACCEPT, Cause, contribution, fit, slopes_of, table
from gears3d.diagnosis.channels import BINS
from gears3d.diagnosis.evidence import Evidence, standardised_contact, standardised_flight
from gears3d.diagnosis.prediction import (
    CHANNELS,
    added,
    deceleration_response,
    impact_sigma,
    parts_of,
    reading_error,
    residuals,
    rms_of,
)
from gears3d.diagnosis.preprocessing import Note, in_mesh
from gears3d.diagnosis.residual_patterns import (
    FEWEST_POINTS,
    LAGS,
    PIECES,
    Structure,
    autocorrelation,
    bin_pattern,
    channel_of,
    clipped,
    flank_contrast,
    flight_order_spectrum,
    gap_pattern,
    noise_level,
    order_pattern,
    post_impact_ringing,
)
from gears3d.diagnosis.search import MOST_CAUSES, Search, keeping, next_cause
from gears3d.effects import Code, SensorEffect
from gears3d.errors import GearsError
from gears3d.signals import robust_deviation

if TYPE_CHECKING:
    from gears3d.effects import Row
    from gears3d.engine import Bench
    from gears3d.scenario import Scenario

Array = np.ndarray
# Number of stretches of each of one or two records.
STRETCHES = 4
# Fall of the held-out log-likelihood that refutes causes: the gain required to accept a cause, as half of Δχ².
WORSE = 0.5 * ACCEPT
# Largest loss of a channel in a split, relative to the gain of the causes: torques move the back-extrapolated contact
# losses, which are less precise than flights.
LARGEST_LOSS = 0.25
# Minimum fraction of the total error beyond noise in a split whose own gain counts.
COUNTED_SHARE = 0.01
# Units of the channels, and of the displacement in windows.
UNITS = {"flight": "rad", "contact": "m", "impact": "m/s", "loss": "m/s", "drive": "rad", "visit": "m"}
# Channels that the engine predicts: the drive's motion is prescribed, and contact loss is not a single step.
ENGINE_CHANNELS: tuple[str, ...] = ("flight", "contact", "impact")
# Maximum number of held-out records or stretches.
HELD_PARTS = 3
# Maximum number of events of each held-out part.
MOST_EVENTS = {"flights": 60, "impacts": 80}
# Maximum number of contact stretches of each held-out part.
MOST_STRETCHES = 12
# Minimum number of points of a contact stretch.
FEWEST_STRETCH_POINTS = 3
# Median distances between points above which a new contact begins.
NEW_CONTACT = 4.0


class Split(NamedTuple):
    """One split into training and held-out data.

    Args:
        held: names of the held-out records or stretches.
        base: mean squared standardised error of the rig as it is, over the channels.
        extended: the same with the causes, fitted to the rest.
        noise: the same for noise alone.
        likelihood: gain in log-likelihood.
        sizes: root mean square errors by channel, of base and extended [its unit].
        gains: gain in log-likelihood by channel.
    """

    held: tuple[str, ...]
    base: float
    extended: float
    noise: float
    likelihood: float
    sizes: dict[str, tuple[float, float]]
    gains: dict[str, float] = {}  # noqa: RUF012 - of a tuple, never written to

    @property
    def gain(self) -> float:
        """Relative reduction of the held-out error beyond noise: (base - extended) / (base - noise)."""
        return 1.0 - (self.extended - self.noise) / max(self.base - self.noise, 1e-12)


def splits(records: Sequence[Evidence], causes: Sequence[Cause]) -> list[Split]:
    """Return the held-out error reduction of causes, refitted each time, by record or stretch."""
    parts = heldout_parts(records)
    found = []
    for k, held in enumerate(parts):
        train = [one for i, one in enumerate(parts) if i != k]
        base = np.concatenate([residuals(one)[name] for name in CHANNELS for one in train])
        effects = [c.effect for c in fit(train, base, causes).causes if c.effect is not None]
        before = residuals(held)
        after = {name: before[name] - contribution([held], effects, (name,)) for name in CHANNELS}
        found.append(worth(held, before, after))
    return found


def heldout_parts(records: Sequence[Evidence]) -> list[Evidence]:
    """Return the parts that are held out in turn: records with events, or stretches of one or two; none of one part."""
    full = [one for one in records if _has_events(one)]
    if len(full) <= 2:
        full = [part for one in full for part in _stretches(one) if _has_events(part)]
    return full if len(full) > 1 else []


def _has_events(one: Evidence) -> bool:
    return any(len(rest) for rest in residuals(one).values())


def worth(held: Evidence, before: dict[str, Array], after: dict[str, Array]) -> Split:
    """Return the error reduction of an extension in one held-out part."""
    seen = [name for name in CHANNELS if name in before and len(before[name])]
    level = {n: max(float(np.median(after[n] ** 2)) / 0.4549, 1e-6) for n in seen}
    base, extended = (float(np.mean([np.mean(rest[n] ** 2) for n in seen])) for rest in (before, after))
    gains = {n: 0.5 * float(before[n] @ before[n] - after[n] @ after[n]) / max(level[n], 1.0) for n in seen}
    sizes = {name: (rms_of(before[name], [held], name), rms_of(after[name], [held], name)) for name in seen}
    noise = float(np.mean([min(level[n], float(np.mean(after[n] ** 2))) for n in seen]))
    return Split((held.name,), base, extended, noise, sum(gains.values()), sizes, gains)


def refuted(found: Sequence[Split]) -> set[str]:
    """Return the channels that causes predict worse than the rig as it is, in any held-out split or in all.

    >>> one = Split(("a",), 3.0, 1.1, 1.0, 40.0, {}, {"flight": 60.0, "loss": -20.0})
    >>> refuted([one, one._replace(gains={"flight": 12.0, "loss": 25.0})])
    {'loss'}
    >>> refuted([one._replace(gains={"flight": -3.0})] * 2)
    {'flight'}
    """
    total = {name: sum(one.gains.get(name, 0.0) for one in found) for one in found for name in one.gains}
    none = {name for name, gain in total.items() if gain < 0.0} if sum(total.values()) < 0.0 else set()
    for one in found:
        least = max(WORSE, LARGEST_LOSS * sum(max(gain, 0.0) for gain in one.gains.values()))
        none |= {name for name, gain in one.gains.items() if gain < -least}
    return none


def _stretches(one: Evidence) -> list[Evidence]:
    """Return a record as stretches of time."""
    time = one.channels.drive.time
    edges = np.linspace(time[0], time[-1], STRETCHES + 1)
    found = []
    for a, b in pairwise(edges):
        seen, cut = one.channels, {}
        for name in ("contacts", "impacts", "losses"):
            table = getattr(seen, name)
            keep = (table.time >= a) & (table.time < b)
            cut[name] = type(table)(*(column[keep] for column in table))
        middle = seen.flights.time.mean(axis=1) if len(seen.flights.time) else np.zeros(0)
        keep = (middle >= a) & (middle < b)
        cut["flights"] = type(seen.flights)(*(column[keep] for column in seen.flights))
        inside = (time >= a) & (time < b)
        cut["drive"] = seen.drive._replace(time=time[inside], angle=seen.drive.angle[inside])
        fine = tuple(column[keep] for column in one.fine)
        name = f"{one.name} {a:.4g} to {b:.4g} s"
        found.append(replace(one, name=name, channels=seen._replace(**cut), fine=fine, at=one.at[keep]))
    return found


def heldout_summary(found: Sequence[Split]) -> dict[str, Any]:
    """Return the result of the splits in the form of the contract, without a gain if the rig leaves noise only.

    >>> one = Split(("a",), 3.0, 1.1, 1.0, 40.0, {})
    >>> heldout_summary([one])["gain"], heldout_summary([one._replace(base=0.9)])["gain"]
    (0.95, None)
    """
    if not found:
        return {"base": None, "extended": None, "gain": None}
    excess = [one.base - one.noise for one in found]
    left = sum(one.extended - one.noise for one in found)
    gain = 1.0 - left / sum(excess) if sum(excess) > 0.0 else None
    shows = [one.gain for one, own in zip(found, excess, strict=True) if own > COUNTED_SHARE * sum(excess)]
    ends = [] if gain is None else [min(shows, default=gain), max(shows, default=gain)]
    summary: dict[str, Any] = {}
    for k, name in enumerate(("base", "extended")):
        sizes = {}
        for channel, unit in UNITS.items():
            rms = [one.sizes[channel][k] for one in found if channel in one.sizes]
            if rms:
                sizes[channel] = {"value": float(np.sqrt(np.mean(np.square(rms)))), "unit": unit}
        summary[name] = {**sizes, "D": float(np.mean([getattr(one, name) for one in found]))}
    held = [{"held_out": list(one.held), "gain": one.gain, "log_likelihood": one.likelihood} for one in found]
    return {**summary, "noise": float(np.mean([one.noise for one in found])), "gain": gain, "gain_range": ends,
            "log_likelihood": float(sum(one.likelihood for one in found)), "splits": held}  # fmt: skip


# Flights, impacts and contacts are those of :mod:`gears3d.diagnosis.prediction`, with the same standard deviations and
# nuisances, but the engine predicts each from its measured initial state: a flight follows from the torques alone, an
# impact acts along the common normal of two true flanks, a contact rolls on them. The engine does not use the
# regressors by which the causes were found.


class EngineCheck(NamedTuple):
    """Held-out error reduction of causes in the engine.

    Args:
        splits: from the engine, for each held-out part.
        rigid: from the rigid model over the same events.
        events: number of predicted events by channel.
        why: reason why the engine was not run or failed; empty otherwise.
    """

    splits: tuple[Split, ...]
    rigid: tuple[Split, ...]
    events: dict[str, int]
    why: str = ""


def engine_check(
    records: Sequence[Evidence], causes: Sequence[Cause], progress: Callable[[float], None] | None = None
) -> EngineCheck:
    """Return the held-out error reduction of causes, predicted by the engine."""
    if not causes:
        return EngineCheck((), (), {}, "there is no cause to try")
    if not any(name in ENGINE_CHANNELS for cause in causes for name in cause.candidate.channels):
        return EngineCheck((), (), {}, "the causes have no effect on single flights, impacts or contacts")
    parts = heldout_parts([one for one in records if len(one.channels.drive.time)])
    if not parts:
        return EngineCheck((), (), {}, "no record could be segmented into the flights and contacts that it predicts")
    chosen = np.unique(np.linspace(0, len(parts) - 1, min(HELD_PARTS, len(parts))).round().astype(int))
    checked, plain, events = [], [], dict.fromkeys(ENGINE_CHANNELS, 0)
    for done, k in enumerate(chosen):
        train = [one for i, one in enumerate(parts) if i != k]
        rest = np.concatenate([residuals(one)[name] for name in CHANNELS for one in train])
        effects = [cause.effect for cause in fit(train, rest, causes).causes if cause.effect is not None]
        some = thinned(parts[k], effects)
        try:
            some, effects = in_mesh(some, effects)
            before = engine_residuals(some, ())
            if progress is not None:
                progress((done + 0.5) / len(chosen))
            after = engine_residuals(some, effects)
        except GearsError as error:
            return EngineCheck((), (), {}, str(error))
        checked.append(worth(some, before, after))
        own = {name: rest for name, rest in residuals(some).items() if name in ENGINE_CHANNELS}
        less = {name: own[name] - contribution([some], effects, (name,)) for name in ENGINE_CHANNELS}
        plain.append(worth(some, own, less))
        for name in ENGINE_CHANNELS:
            events[name] += len(before[name])
        if progress is not None:
            progress((done + 1.0) / len(chosen))
    return EngineCheck(tuple(checked), tuple(plain), events)


def engine_residuals(one: Evidence, effects: Sequence[Any]) -> dict[str, Array]:
    """Return the data minus the prediction of the engine, by channel, in standard deviations.

    Raises:
        InputError: the engine does not support an effect or the rig.
        EngineError: a step failed.
    """
    from gears3d.engine import Bench

    sensors = [each for each in (*one.scenario.effects, *effects) if isinstance(each, SensorEffect)]
    with Bench(engine_scenario(one, effects), drive_start(one)) as bench:
        found = {
            "flight": _flights(one, bench, sensors),
            "contact": _contacts(one, bench, sensors),
            "impact": _impacts(one, bench),
        }
    return {name: rest + added(one, one.spared, name) if one.spared else rest for name, rest in found.items()}


def engine_scenario(one: Evidence, effects: Sequence[Any]) -> Scenario:
    """Return the scenario of a record with effects and the measured motion of the drive, without scatter effects."""
    waves = [
        {"amplitude": f"{turn * np.hypot(cosine, sine):.17g} rad/s", "frequency": f"{turn / (2.0 * pi):.17g} Hz",
         "phase": f"{atan2(sine, -cosine):.17g} rad"}
        for cosine, sine, turn in one.motion.harmonics
    ]  # fmt: skip
    rows = [*one.rows, *(row for each in effects for row in each.rows(one.rig))]
    changes: list[tuple[str, Any]] = [("motion.mean", f"{one.motion.mean:.17g} rad/s"), ("motion.harmonics", waves)]
    changes += [("effect[+]", table(each)) for each in effects if each.kind != "restitution_scatter"]
    return one.scenario.with_([*changes, *as_spur_gears(one, rows)])


def as_spur_gears(one: Evidence, rows: Sequence[Row] = ()) -> list[tuple[str, Any]]:
    """Return changes that replace helical gears by the spur gears of their transverse section.

    Helical flanks without corrections roll on each other equally in every transverse section: displacement, backlash
    and forces along the transverse line of action are those of that section, and the engine is faster with it. A single
    tooth deviation carries over another part of the path; rigs with one keep their helix.
    """
    gears = one.pair.drive, one.pair.loose
    if not gears[0].helix_angle or any(row.code == Code.FLANK_TOOTH for row in rows):
        return []
    changes: list[tuple[str, Any]] = [("gears.loose.inertia", f"{one.rig.inertia:.17g} kg m^2")]
    for which, gear in zip(("drive", "loose"), gears, strict=True):
        upon = cos(gear.helix_angle)
        changes += [
            (f"gears.{which}.helix_angle", "0 deg"),
            (f"gears.{which}.module", f"{gear.module / upon:.17g} m"),
            (f"gears.{which}.pressure_angle", f"{atan2(tan(gear.pressure_angle), upon):.17g} rad"),
        ]
        names = ("profile_shift", "addendum", "dedendum", "fillet_radius", "tip_shortening")
        changes += [(f"gears.{which}.{name}", upon * getattr(gear, name)) for name in names]
        changes.append((f"gears.{which}.thickness_allowance", f"{gear.thickness_allowance / upon:.17g} m"))
    return changes


def heldout_3d(found: EngineCheck | None) -> dict[str, Any]:
    """Return the held-out error reduction in the engine in the form of the contract."""
    summary = heldout_summary(found.splits if found is not None else ())
    if found is None or not found.splits:
        return {**summary, "why": found.why if found is not None else "not asked for"}
    return {**summary, "gain_rigid": heldout_summary(found.rigid)["gain"], "events": found.events, "why": ""}


def drive_start(one: Evidence) -> float:
    """Return the drive's angle at time 0 of a record by its motion model [rad]."""
    seen, motion = one.channels.drive, one.motion
    angle = motion.mean * seen.time
    for cosine, sine, turn in motion.harmonics:
        shrunk = np.sinc(turn * seen.width / (2.0 * pi))
        angle = angle + shrunk * (cosine * np.cos(turn * seen.time) + sine * np.sin(turn * seen.time))
    return float(np.mean(seen.angle - angle)) + float(np.sum(motion.harmonics[:, 0]))


def thinned(one: Evidence, effects: Sequence[Any] = ()) -> Evidence:
    """Return a record with some of its events, evenly over time, and contacts where effects predict most."""
    seen, cut = one.channels, {}
    hits = _some(len(seen.impacts.time), MOST_EVENTS["impacts"])
    cut["impacts"] = type(seen.impacts)(*(column[hits] for column in seen.impacts))
    kept = _some(len(seen.flights.time), MOST_EVENTS["flights"])
    cut["flights"] = type(seen.flights)(*(column[kept] for column in seen.flights))
    own = seen.contacts
    long = [rows for rows in contact_stretches(own.time, own.flank) if len(rows) >= FEWEST_STRETCH_POINTS]
    shows = added(one, effects, "contact") ** 2 if effects else np.zeros(len(own.time))
    most = (
        np.argsort([-float(np.mean(shows[rows])) for rows in long], kind="stable")[: MOST_STRETCHES // 2]
        if effects
        else ()
    )
    chosen = np.union1d(_some(len(long), MOST_STRETCHES), np.asarray(most, int))
    rows = np.concatenate([np.zeros(0, int), *(long[k] for k in chosen)])
    cut["contacts"] = type(own)(*(column[rows] for column in own))
    fine = tuple(column[kept] for column in one.fine)
    return replace(one, channels=seen._replace(**cut), fine=fine, at=one.at[kept])


def contact_stretches(time: Array, flank: Array) -> list[Array]:
    """Return which points belong to one contact, contact by contact.

    time: (n,) [s]; flank: (n,).

    >>> [rows.tolist() for rows in contact_stretches(np.array([0.0, 0.1, 0.2, 0.9, 1.0]), np.array([0, 0, 0, 0, 1]))]
    [[0, 1, 2], [3], [4]]
    """
    if len(time) < 2:
        return [np.arange(len(time))] if len(time) else []
    steps = np.diff(time)
    ends = np.flatnonzero((steps > NEW_CONTACT * np.median(steps)) | (np.diff(flank) != 0)) + 1
    return np.split(np.arange(len(time)), ends)


def _some(count: int, most: int) -> Array:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int)) if count else np.zeros(0, int)


def _flights(one: Evidence, bench: Bench, sensors: Sequence[Any]) -> Array:
    seen, (_, angle, speed) = one.channels.flights, one.fine
    if not len(seen.time):
        return np.zeros(0)
    wrong = reading_error(sensors, "loose", angle[:, 0], speed[:, 0])
    path = np.array([
        bench.fly(theta, omega, time)
        for theta, omega, time in zip(angle[:, 0] - wrong, speed[:, 0], seen.time, strict=True)
    ])  # fmt: skip
    fast = speed[:, :: max((speed.shape[1] - 1) // (path.shape[1] - 1), 1)]
    rest = seen.loose - path - reading_error(sensors, "loose", path, fast, true=True)
    return standardised_flight(one, rest)


def _contacts(one: Evidence, bench: Bench, sensors: Sequence[Any]) -> Array:
    seen, (of_drive, of_loose) = one.channels.contacts, one.radii
    rest = np.zeros(len(seen.time))
    for rows in contact_stretches(seen.time, seen.flank):
        loose = bench.rest(int(seen.flank[rows[0]]), seen.time[rows])
        drive, speed = np.array([bench.drive(time) for time in seen.time[rows]]).T
        loose = loose + reading_error(sensors, "loose", loose, speed * of_drive / of_loose, true=True)
        drive = drive + reading_error(sensors, "drive", drive, speed, true=True)
        rest[rows] = seen.place[rows] - (of_loose * loose - of_drive * drive)
    return standardised_contact(one, rest)


def _impacts(one: Evidence, bench: Bench) -> Array:
    seen = one.channels.impacts
    hits = [bench.strike(t, int(side), abs(v)) for t, side, v in zip(seen.time, seen.flank, seen.velocity, strict=True)]
    e = np.array([-hit.rebound_m_s / hit.velocity_m_s for hit in hits])
    return (seen.rebound + e * seen.velocity) / impact_sigma(one)


# Largest false alarm probability of a residual pattern.
FALSE_ALARM = 1e-4
# Largest residual pattern in the channel of a cause, relative to its gain there.
REFUTING_SHARE = 0.25
# Standard deviations of a contact loss that count as 100 %: errors of all other channels move it, too.
LOSS_UNIT = 1e3
# Size in units of the channel below which a pattern comes from segmentation: moments of contact loss, for example, are
# late by a fraction of their sigma.
SMALLEST_PATTERN = {"flight": 0.02, "contact": 0.002, "impact": 0.05, "loss": 1e-3, "drive": 0.002}
# Minimum ratio of an order's gain, for rebounds, to that of the pattern over one revolution; below it the order is
# attributed to that pattern.
FOREIGN_ORDER = 1.5
# Root mean square in standard deviations above which a channel is not explained. The right causes leave 1.5 at most in
# blind tests.
UNEXPLAINED = 3.0
# Standard deviations at which a single point is clipped: 1 % wrongly segmented points must not flag a channel.
CLIPPED_POINT = 15.0
# Channels that are tested.
TESTED_CHANNELS = ("flight", "contact", "drive")
# Count on the base circle, relative to the backlash, above which encoders are coarse: over 20 times that of ordinary
# test rigs, less than half of that of 8192 counts (tests/diagnosis/test_quantisation.py).
COARSE_COUNT = 0.05
# Residual pattern of counts in any record: they repeat with the motion, and so do the errors of earlier impacts.
REPEATED_PATTERN = "impact.time"


def consistent_causes(
    found: Search, highest: int, others: Sequence[Structure]
) -> tuple[Search, list[Structure], list[Structure]]:
    """Return a search without the causes that its residual patterns or held-out data contradict.

    With the residual patterns, and those that coarse encoders cause; others: patterns that prevent the former test.
    """
    while True:
        own, odd = _significant_patterns(found, highest)
        left = [*others, *own]
        kept = [] if others else drop_contradicted(found, left)
        if len(kept) == len(found.fit.causes):
            kept = drop_unpredictive(found)
        if len(kept) == len(found.fit.causes):
            return found, left, odd
        found = keeping(found, kept)


def whole_channels(found: Search, left: Sequence[Structure]) -> tuple[list[Structure], list[Structure]]:
    """Return the channels that deviate as a whole, and those that coarse encoders cause; left: other patterns."""
    off, odd = without_quantisation(found.records, found.fit.rest, channel_chi2)
    return off + [one for one in unused_candidate(found) if one.name not in {each.name for each in [*left, *off]}], odd


def _significant_patterns(found: Search, highest: int) -> tuple[list[Structure], list[Structure]]:
    """Return the residual patterns, and those that coarse encoders cause in one record."""

    def significant(records: Sequence[Evidence], rest: np.ndarray) -> list[Structure]:
        return [one for one in residual_tests(records, rest, highest) if one.chance < FALSE_ALARM]

    return without_quantisation(found.records, found.fit.rest, significant)


def drop_contradicted(found: Search, left: Sequence[Structure]) -> list[Cause]:
    """Return the causes that the records determine, and that neither a residual pattern nor a whole channel refutes."""
    worth: dict[str, float] = {}
    for one in left:
        worth[channel_of(one.name)] = max(worth.get(channel_of(one.name), 0.0), one.worth)
    spans = {name: found.known.spans[name] for name in worth}
    taken = {name: float(found.base[span] @ found.base[span] - found.fit.rest[span] @ found.fit.rest[span])
             for name, span in spans.items()}  # fmt: skip
    bad = {name for name in worth if worth[name] > REFUTING_SHARE * max(taken[name], 1e-9)}
    # What the model lacks in a channel far above its noise moves contacts and impacts, and so all other channels.
    rests = [found.fit.rest[own] for own in found.known.spans.values() if own.stop - own.start >= FEWEST_POINTS]
    most = max(map(robust_deviation, rests), default=0.0)
    less = _without_each(found) if most > UNEXPLAINED else ()
    weak = {k for k, chi2 in enumerate(less) if chi2 - found.fit.chi2 < ACCEPT * most**2}
    return [cause for k, cause in enumerate(found.fit.causes) if k not in weak
            and not bad.intersection(cause.candidate.channels) and _is_determined(found.records, cause)]  # fmt: skip


def _without_each(found: Search) -> list[float]:
    """Return the chi-square of fits without each of the causes, (c,)."""
    causes = found.fit.causes
    return [fit(found.records, found.base, causes[:k] + causes[k + 1 :]).chi2 for k in range(len(causes))]


def _is_determined(records: Sequence[Evidence], cause: Cause) -> bool:
    """Return whether records depend on a cause; not if it moves the restitution out of its range from 0 to 1."""
    return any(bool(np.any(column)) for column in slopes_of(records, cause))


def drop_unpredictive(found: Search) -> list[Cause]:
    """Return the causes without the weakest of those that predict their channel worse than the rig as it is.

    A law with as many numbers as there are speeds or revolutions fits anything; held-out data show that it is wrong.
    """
    causes = list(found.fit.causes)
    if not causes or not (bad := refuted(splits(found.records, causes))):
        return causes
    parts = [contribution(found.records, [one.effect] if one.effect is not None else []) for one in causes]
    touched = [any(np.any(part[found.known.spans[name]]) for name in bad) for part in parts]
    gains = _without_each(found)
    at = [k for k, own in enumerate(touched) if own]
    weakest = min(at, key=lambda k: gains[k], default=None)
    return [one for k, one in enumerate(causes) if k != weakest]


def residual_tests(records: Sequence[Evidence], rest: Array, highest: int) -> list[Structure]:
    """Return the residual patterns over each coordinate, those of the channel of largest residuals first.

    rest: (n,).
    """
    parts = parts_of(records, rest)
    found = [*_flight(records, parts, highest), *_contact(records, parts, highest), *_impact(records, parts, highest),
             *_loss(records, parts), *_drive(records, parts)]  # fmt: skip
    looked, units = max(len(found), 1), _units(records)
    found = [one._replace(chance=min(1.0, one.chance * looked)) for one in found]
    found = [one for one in found if one.size > SMALLEST_PATTERN[channel_of(one.name)] * units[channel_of(one.name)]]
    large: dict[str, float] = dict.fromkeys(CHANNELS, 0.0)
    for one in found:
        name = channel_of(one.name)
        large[name] = max(large[name], one.size / units[name])
    return sorted(found, key=lambda one: (-large[channel_of(one.name)], -(one.rank or one.worth)))


def _units(records: Sequence[Evidence]) -> dict[str, float]:
    """Return the size of 100 % in each channel: drag, backlash, rebound, one sigma, and the angle of the backlash."""
    rig = records[0].rig
    speeds = np.concatenate([np.abs(one.channels.impacts.velocity) for one in records])
    rebound = max(rig.restitution, 0.1) * float(np.median(speeds)) if len(speeds) else 1.0
    slowing = max(rig.drag_torque / rig.inertia, 1e-6)
    angle = rig.backlash / rig.base_radius_drive
    return {"flight": slowing, "contact": rig.backlash, "impact": rebound, "loss": LOSS_UNIT, "drive": angle}


def worst_record(parts: Sequence[Array]) -> int:
    """Return the index of the record of largest residuals, in standard deviations.

    >>> worst_record([np.ones(3), np.zeros(0), np.full(2, -2.0)])
    2
    """
    return int(np.argmax([float(np.mean(part**2)) if part.size else 0.0 for part in parts]))


def _flight(records: Sequence[Evidence], parts: dict[str, list[Array]], highest: int) -> Iterator[Structure]:
    """Return patterns of the residual deceleration of each flight over its speed, angles, and time."""
    slow, weight, columns, flown, own = [], [], [], [], []
    for one, rest in zip(records, parts["flight"], strict=True):
        flights = one.channels.flights
        if not len(flights.time):
            continue
        shape = deceleration_response(one)
        square = np.sum(shape**2, axis=1)
        slow.append(np.sum(shape * rest.reshape(-1, BINS), axis=1) / square)
        weight.append(np.sqrt(square))
        columns.append(np.stack([one.fine[0].mean(axis=1), one.fine[2].mean(axis=1)]))
        flown.append(one)
        own.append(rest)
    if not slow:
        return
    value, sure = np.concatenate(slow), np.concatenate(weight)
    time, speed = np.concatenate(columns, axis=1)
    record = np.repeat(np.arange(len(columns)), [one.shape[1] for one in columns])
    for name, coordinate in (("flight.speed", speed), ("flight.time", time)):
        yield from bin_pattern(name, value, sure, coordinate, "rad/s^2", record=record)
    driven = [np.interp(one.fine[0], one.channels.drive.time, one.channels.drive.angle) for one in flown]
    for gear, angle in (("loose", [one.fine[1] for one in flown]), ("drive", driven)):
        yield from flight_order_spectrum(
            f"flight.angle_{gear}", flown, own, angle, highest, fluctuation_orders(flown, gear)
        )
    yield from gap_pattern(records, parts["flight"])
    yield from post_impact_ringing(records, parts["flight"], sure)


def fluctuation_orders(records: Sequence[Evidence], gear: str) -> list[float]:
    """Return the order of the drive's strongest fluctuation in each record, 0 without one.

    Rattle repeats with that one; all whole orders are multiples of a weak harmonic at order 1 of the drive.
    """
    ratio = {"drive": 1.0, "loose": records[0].radii[0] / records[0].radii[1]}[gear] if records else 1.0
    return [_strongest_harmonic(one.motion.harmonics) / max(abs(one.motion.mean) * ratio, 1e-9) for one in records]


def _strongest_harmonic(harmonics: Array) -> float:
    """Return the angular frequency of the harmonic of greatest speed [rad/s], 0 without any."""
    if not len(harmonics):
        return 0.0
    cosine, sine, turn = harmonics.T
    return float(turn[np.argmax(np.hypot(cosine, sine) * turn)])


def _contact(records: Sequence[Evidence], parts: dict[str, list[Array]], highest: int) -> Iterator[Structure]:
    seen = [one.channels.contacts for one in records]
    value = np.concatenate([rest * one.sigma for one, rest in zip(seen, parts["contact"], strict=True)])
    sure = np.concatenate([1.0 / one.sigma for one in seen])
    for gear in ("drive", "loose"):
        angles = [getattr(one, gear) for one in seen]
        yield from order_pattern(
            f"contact.order_{gear}", value, sure, angles, highest, "m", fluctuation_orders(records, gear)
        )
    speed = np.concatenate([one.motion.speed(one.channels.contacts.time) for one in records])
    yield from bin_pattern("sensor.delay", value, sure, speed, "m")
    time, flank = (np.concatenate([getattr(one, name) for one in seen]) for name in ("time", "flank"))
    active = flank == 0
    yield from bin_pattern("sensor.ratio", value[active], sure[active], time[active], "m")
    yield from flank_contrast("contact.time", value, sure, time, flank)


def _impact(records: Sequence[Evidence], parts: dict[str, list[Array]], highest: int) -> Iterator[Structure]:
    """Return patterns of rebounds; residuals of undetected ones are below their errors, so errors are not reduced."""
    seen = [one.channels.impacts for one in records]
    sigma = np.concatenate([impact_sigma(one) for one in records])
    value, sure = np.concatenate(parts["impact"]) * sigma, 1.0 / sigma
    speed, flank = (np.concatenate([getattr(one, name) for one in seen]) for name in ("velocity", "flank"))
    approach = np.concatenate([_approach(one) for one in records])
    record = np.repeat(np.arange(len(seen)), [len(one.time) for one in seen])
    yield from bin_pattern("impact.speed", value, sure, approach, "m/s", least=1.0, record=record)
    yield from bin_pattern("impact.flank", value, sure, flank.astype(float), "m/s", 2, 1.0, record)
    usual = float(np.median(np.abs(speed))) if len(speed) else 1.0
    share = usual / np.maximum(np.abs(speed), 1e-9)  # change of restitution at the median speed
    value, sure = np.where(flank == 0, 1.0, -1.0) * value * share, sure / share
    angles = {gear: [getattr(one, gear) for one in seen] for gear in ("drive", "loose")}
    locked = {gear: fluctuation_orders(records, gear) for gear in angles}
    yield from restitution_patterns(value, sure, angles, locked, highest)


def restitution_patterns(
    value: Array, sure: Array, angles: dict[str, list[Array]], locked: dict[str, list[float]], highest: int
) -> Iterator[Structure]:
    """Return patterns of restitution over the angles of both gears, and in the sequence of impacts.

    value: change at the median speed of approach [m/s], (n,), records in sequence; sure: one over its standard
    deviation, (n,); angles: by gear and record [rad]; locked: orders of the drive's fluctuation by gear and record.
    """
    teeth, orders = [], []
    record = np.repeat(np.arange(len(angles["drive"])), [len(one) for one in angles["drive"]])
    for gear, turns in angles.items():
        over = np.mod(np.concatenate(turns), 2.0 * np.pi)
        teeth += bin_pattern("impact.tooth", value, sure, over, "m/s", 3 * PIECES, 1.0, record)
        orders += order_pattern(f"impact.order_{gear}", value, sure, turns, highest, "m/s", locked[gear], 1.0)
    most = max((one.gain for one in teeth), default=np.inf)
    yield from [one for one in orders if one.gain > FOREIGN_ORDER * most] or teeth
    yield from _rebound_autocorrelation(value, sure, [len(one) for one in angles["drive"]])


def _approach(one: Evidence) -> Array:
    """Return approach speeds [m/s] with errors independent of those of e times speed minus rebound."""
    seen, e = one.channels.impacts, one.rig.restitution
    share = e * (seen.velocity_sigma / seen.rebound_sigma) ** 2
    return (np.abs(seen.velocity) + share * np.abs(seen.rebound)) / (1.0 + share * e)


def _rebound_autocorrelation(value: Array, sure: Array, sizes: list[int]) -> Iterator[Structure]:
    """Return the pattern of restitution that rebounds share with those shortly before them, of any origin."""
    from scipy.special import log_ndtr

    if len(value) < FEWEST_POINTS:
        return
    level = max(noise_level(value * sure), 1.0)
    kept = clipped(value, sure / level) * sure / level
    share, sigmas, lag = autocorrelation(np.split(kept - np.mean(kept), np.cumsum(sizes)[:-1]))
    size = float(np.sqrt(max(share, 0.0)) * level / np.sqrt(np.mean(sure**2)))
    gain = share * float(kept @ kept)
    yield Structure("impact.time", gain, min(1.0, len(LAGS) * float(np.exp(log_ndtr(-sigmas)))), size, "m/s",
                    float(lag), gain * level**2)  # fmt: skip


def _loss(records: Sequence[Evidence], parts: dict[str, list[Array]]) -> Iterator[Structure]:
    value = np.concatenate(parts["loss"])
    speed = np.concatenate([one.motion.speed(one.channels.losses.time) for one in records])
    record = np.repeat(np.arange(len(records)), [len(part) for part in parts["loss"]])
    yield from bin_pattern("contact.loss_phase", value, np.ones_like(value), speed, "sigma", least=1.0, record=record)


def _drive(records: Sequence[Evidence], parts: dict[str, list[Array]]) -> Iterator[Structure]:
    seen = [one.drive for one in records]
    value = np.concatenate([rest * one.sigma for one, rest in zip(seen, parts["drive"], strict=True)])
    sure = np.concatenate([np.full(len(one.time), 1.0 / one.sigma) for one in seen])
    yield from order_pattern("sensor.order_drive", value, sure, [one.angle for one in seen], 8, "rad")


def unused_candidate(found: Search) -> list[Structure]:
    """Return the remaining candidate where a search ended at the maximum number of causes and would accept one more."""
    if len(found.fit.causes) < MOST_CAUSES or (one := next_cause(found)) is None:
        return []
    name = one.candidate.channels[0]
    off = _whole_channel(found.records, found.fit.rest, name)
    return [] if off is None else [off]


def channel_chi2(records: Sequence[Evidence], rest: Array) -> list[Structure]:
    """Return the channels whose residuals stay far above their noise with all causes, largest first.

    One ``CHANNEL.all`` each, with the root mean square of its points and no place; rest: (n,).
    """
    found = [off for name in TESTED_CHANNELS if (off := _whole_channel(records, rest, name, UNEXPLAINED)) is not None]
    return sorted(found, key=lambda one: -one.gain)


def _whole_channel(records: Sequence[Evidence], rest: Array, name: str, far: float = 0.0) -> Structure | None:
    """Return a channel as a whole; ``None`` where its root mean square is below a number of standard deviations."""
    own = [np.clip(part, -CLIPPED_POINT, CLIPPED_POINT) for part in parts_of(records, rest)[name]]
    whole = np.concatenate([np.zeros(0), *own])
    if not whole.size or float(np.mean(whole**2)) <= far**2:
        return None
    gain = max(float(whole @ whole) - whole.size, 0.0)
    size, worst = rms_of(whole, records, name), records[worst_record(own)].name
    return Structure(f"{name}.all", gain, 0.0, size, UNITS[name], float("nan"), gain, worst)


# Without noise that dithers the counts, the reading errors repeat while the count rate is commensurate with the
# sampling rate: in a complete record at such a speed, and in no other.


def quantum_of(one: Evidence) -> float:
    """Return a count of the coarser encoder on its base circle, relative to the backlash; 0 without counts."""
    sensors = one.scenario.sensors
    counts = (sensors.drive.counts_per_revolution, sensors.loose.counts_per_revolution)
    steps = [2.0 * pi * radius / count for radius, count in zip(one.radii, counts, strict=True) if count]
    return max(steps, default=0.0) / one.rig.backlash


def are_coarse(records: Sequence[Evidence]) -> bool:
    """Return whether encoders are coarse in any of some records."""
    return max(map(quantum_of, records)) > COARSE_COUNT


def without_quantisation(
    records: Sequence[Evidence], rest: Array, test: Callable[[Sequence[Evidence], Array], Sequence[Structure]]
) -> tuple[list[Structure], list[Structure]]:
    """Return the residual patterns of the gears, and those that coarse encoders may cause.

    The latter vanish without the record of largest residuals, or are correlations of rebounds with earlier ones; rest:
    (n,); test: returns the patterns of records and their residuals.
    """
    left = list(test(records, rest))
    if not left or not are_coarse(records):
        return left, []
    kept: set[str] = set()
    for channel in {channel_of(one.name) for one in left}:
        others = _without_farthest(records, rest, channel)
        there = {one.name for one in (left if others is None else test(*others)) if one.name != REPEATED_PATTERN}
        kept |= {one.name for one in left if channel_of(one.name) == channel and one.name in there}
    return [one for one in left if one.name in kept], [one for one in left if one.name not in kept]


def _without_farthest(
    records: Sequence[Evidence], rest: Array, channel: str
) -> tuple[Sequence[Evidence], Array] | None:
    """Return data without the record of largest residuals; ``None`` if no other has points in the channel."""
    parts = parts_of(records, rest)
    worst = worst_record(parts[channel])
    if not any(own.size for k, own in enumerate(parts[channel]) if k != worst):
        return None
    others = [one for k, one in enumerate(records) if k != worst]
    some = [own for name in CHANNELS for k, own in enumerate(parts[name]) if k != worst]
    return others, np.concatenate(some)


def single_record_note(records: Sequence[Evidence], rest: Array, cause: Cause) -> Note | None:
    """Return a note if a cause depends on one of several records of coarse encoders alone, else ``None``.

    rest: (n,).
    """
    if cause.effect is None or len(records) < 2:
        return None
    own = contribution(records, [cause.effect])
    parts = parts_of(records, own * (own + 2.0 * rest))
    gains = np.array([sum(float(np.sum(parts[name][k])) for name in CHANNELS) for k in range(len(records))])
    if float(np.sum(gains) - np.max(gains)) >= ACCEPT:
        return None
    best = records[int(np.argmax(gains))].name
    return _count_note(records, f"the deviations that indicate {cause.candidate.kind} in this record only", best)


def count_notes(records: Sequence[Evidence], gone: Sequence[Structure]) -> list[Note]:
    """Return notes on the residual patterns that are not attributed to the gears."""
    names = sorted({one.name for one in gone})
    return [_count_note(records, f"the residual patterns {', '.join(names)}", "")] if names else []


def _count_note(records: Sequence[Evidence], what: str, record: str) -> Note:
    size = max(map(quantum_of, records))
    text = f"one count of the encoders is {100.0 * size:.2g} % of the backlash: quantisation may cause {what}"
    return Note("coarse-counts", text, "record at other speeds, or with finer encoders", record)
