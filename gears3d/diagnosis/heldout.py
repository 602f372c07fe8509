"""Held-out error reduction of an extension: over records or stretches of one, in channels and in the 3D engine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from math import atan2, cos, pi, tan
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import ACCEPT, Cause, contribution, fit, table
from gears3d.diagnosis.evidence import Evidence, standardised_contact, standardised_flight
from gears3d.diagnosis.prediction import CHANNELS, added, impact_sigma, reading_error, residuals, rms_of
from gears3d.diagnosis.preprocessing import in_mesh
from gears3d.effects import Code, SensorEffect
from gears3d.errors import GearsError

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
# Units of the channels, and of contact episodes.
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
FEWEST_POINTS = 3
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
    """Return the parts that are held out in turn: whole records, or stretches of one or two."""
    return list(records) if len(records) > 2 else [part for one in records for part in _stretches(one)]


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
    told: dict[str, Any] = {}
    for k, name in enumerate(("base", "extended")):
        sizes = {}
        for channel, unit in UNITS.items():
            rms = [one.sizes[channel][k] for one in found if channel in one.sizes]
            if rms:
                sizes[channel] = {"value": float(np.sqrt(np.mean(np.square(rms)))), "unit": unit}
        told[name] = {**sizes, "D": float(np.mean([getattr(one, name) for one in found]))}
    held = [{"held_out": list(one.held), "gain": one.gain, "log_likelihood": one.likelihood} for one in found]
    return {**told, "noise": float(np.mean([one.noise for one in found])), "gain": gain,
            "gain_range": ends,
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
    told, plain, events = [], [], dict.fromkeys(ENGINE_CHANNELS, 0)
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
        told.append(worth(some, before, after))
        own = {name: rest for name, rest in residuals(some).items() if name in ENGINE_CHANNELS}
        less = {name: own[name] - contribution([some], effects, (name,)) for name in ENGINE_CHANNELS}
        plain.append(worth(some, own, less))
        for name in ENGINE_CHANNELS:
            events[name] += len(before[name])
        if progress is not None:
            progress((done + 1.0) / len(chosen))
    return EngineCheck(tuple(told), tuple(plain), events)


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
    told = heldout_summary(found.splits if found is not None else ())
    if found is None or not found.splits:
        return {**told, "why": found.why if found is not None else "not asked for"}
    return {**told, "gain_rigid": heldout_summary(found.rigid)["gain"], "events": found.events, "why": ""}


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
    long = [rows for rows in contact_stretches(own.time, own.flank) if len(rows) >= FEWEST_POINTS]
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
    rest = seen.loose - path - reading_error(sensors, "loose", path, fast)
    return standardised_flight(one, rest)


def _contacts(one: Evidence, bench: Bench, sensors: Sequence[Any]) -> Array:
    seen, (of_drive, of_loose) = one.channels.contacts, one.radii
    rest = np.zeros(len(seen.time))
    for rows in contact_stretches(seen.time, seen.flank):
        loose = bench.rest(int(seen.flank[rows[0]]), seen.time[rows])
        drive, speed = np.array([bench.drive(time) for time in seen.time[rows]]).T
        loose = loose + reading_error(sensors, "loose", loose, speed * of_drive / of_loose)
        drive = drive + reading_error(sensors, "drive", drive, speed)
        rest[rows] = seen.place[rows] - (of_loose * loose - of_drive * drive)
    return standardised_contact(one, rest)


def _impacts(one: Evidence, bench: Bench) -> Array:
    seen = one.channels.impacts
    hits = [bench.strike(t, int(side), abs(v)) for t, side, v in zip(seen.time, seen.flank, seen.velocity, strict=True)]
    e = np.array([-hit.rebound_m_s / hit.velocity_m_s for hit in hits])
    return (seen.rebound + e * seen.velocity) / impact_sigma(one)
