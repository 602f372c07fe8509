"""Held-out error reduction of an extension when PyBullet simulates rigid bodies.

Flights, impacts and contacts are those of :mod:`gears3d.diagnosis.prediction`, with the same standard deviations and
nuisances, but the engine predicts each from its measured initial state: a flight follows from the torques alone, an
impact acts along the common normal of two true flanks, a contact rolls on them. The engine does not use the regressors
by which the causes were found.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import atan2, cos, pi, tan
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.cause import Cause, contribution, fit, table
from gears3d.diagnosis.datums import in_mesh
from gears3d.diagnosis.evidence import standardised_contact, standardised_flight
from gears3d.diagnosis.heldout import Split, parts_of, worth
from gears3d.diagnosis.prediction import CHANNELS, added, impact_sigma, reading_error, residuals
from gears3d.diagnosis.verdict import heldout
from gears3d.effects import Code, SensorEffect
from gears3d.errors import GearsError

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence
    from gears3d.effects import Row
    from gears3d.engine import Bench
    from gears3d.scenario import Scenario

Array = np.ndarray
# Channels that the engine predicts: the drive's motion is prescribed, and contact loss is not a single step.
SEEN: tuple[str, ...] = ("flight", "contact", "impact")
# Maximum number of held-out records or stretches.
HELD = 3
# Maximum number of events of each held-out part.
EVENTS = {"flights": 60, "impacts": 80}
# Maximum number of contact stretches of each held-out part.
STRETCHES = 12
# Minimum number of points of a contact stretch.
FEWEST = 3
# Median distances between points above which a new contact begins.
APART = 4.0


class Bodies(NamedTuple):
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


def in_bodies(
    records: Sequence[Evidence], causes: Sequence[Cause], progress: Callable[[float], None] | None = None
) -> Bodies:
    """Return the held-out error reduction of causes, predicted by the engine."""
    if not causes:
        return Bodies((), (), {}, "there is no cause to try")
    if not any(name in SEEN for cause in causes for name in cause.candidate.channels):
        return Bodies((), (), {}, "the causes have no effect on single flights, impacts or contacts")
    parts = parts_of(records)
    chosen = np.unique(np.linspace(0, len(parts) - 1, min(HELD, len(parts))).round().astype(int))
    told, plain, events = [], [], dict.fromkeys(SEEN, 0)
    for done, k in enumerate(chosen):
        train = [one for i, one in enumerate(parts) if i != k]
        rest = np.concatenate([residuals(one)[name] for name in CHANNELS for one in train])
        effects = [cause.effect for cause in fit(train, rest, causes).causes if cause.effect is not None]
        some = thinned(parts[k], effects)
        try:
            some, effects = in_mesh(some, effects)
            before = predicted(some, ())
            if progress is not None:
                progress((done + 0.5) / len(chosen))
            after = predicted(some, effects)
        except GearsError as error:
            return Bodies((), (), {}, str(error))
        told.append(worth(some, before, after))
        own = {name: rest for name, rest in residuals(some).items() if name in SEEN}
        less = {name: own[name] - contribution([some], effects, (name,)) for name in SEEN}
        plain.append(worth(some, own, less))
        for name in SEEN:
            events[name] += len(before[name])
        if progress is not None:
            progress((done + 1.0) / len(chosen))
    return Bodies(tuple(told), tuple(plain), events)


def predicted(one: Evidence, effects: Sequence[Any]) -> dict[str, Array]:
    """Return the data minus the prediction of the engine, by channel, in standard deviations.

    Raises:
        InputError: the engine does not support an effect or the rig.
        EngineError: a step failed.
    """
    from gears3d.engine import Bench

    sensors = [each for each in (*one.scenario.effects, *effects) if isinstance(each, SensorEffect)]
    with Bench(extended(one, effects), began(one)) as bench:
        found = {
            "flight": _flights(one, bench, sensors),
            "contact": _contacts(one, bench, sensors),
            "impact": _impacts(one, bench),
        }
    return {name: rest + added(one, one.spared, name) if one.spared else rest for name, rest in found.items()}


def extended(one: Evidence, effects: Sequence[Any]) -> Scenario:
    """Return the scenario of a record with effects and the measured motion of the drive, without scatter effects."""
    waves = [
        {"amplitude": f"{turn * np.hypot(cosine, sine):.17g} rad/s", "frequency": f"{turn / (2.0 * pi):.17g} Hz",
         "phase": f"{atan2(sine, -cosine):.17g} rad"}
        for cosine, sine, turn in one.motion.harmonics
    ]  # fmt: skip
    rows = [*one.rows, *(row for each in effects for row in each.rows(one.rig))]
    changes: list[tuple[str, Any]] = [("motion.mean", f"{one.motion.mean:.17g} rad/s"), ("motion.harmonics", waves)]
    changes += [("effect[+]", table(each)) for each in effects if each.kind != "restitution_scatter"]
    return one.scenario.with_([*changes, *upright(one, rows)])


def upright(one: Evidence, rows: Sequence[Row] = ()) -> list[tuple[str, Any]]:
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
    return changes


def heldout_3d(found: Bodies | None) -> dict[str, Any]:
    """Return the held-out error reduction in the engine in the form of the contract."""
    told = heldout(found.splits if found is not None else ())
    if found is None or not found.splits:
        return {**told, "why": found.why if found is not None else "not asked for"}
    return {**told, "gain_rigid": heldout(found.rigid)["gain"], "events": found.events, "why": ""}


def began(one: Evidence) -> float:
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
    hits = _some(len(seen.impacts.time), EVENTS["impacts"])
    cut["impacts"] = type(seen.impacts)(*(column[hits] for column in seen.impacts))
    kept = _some(len(seen.flights.time), EVENTS["flights"])
    cut["flights"] = type(seen.flights)(*(column[kept] for column in seen.flights))
    own = seen.contacts
    long = [rows for rows in stretches(own.time, own.flank) if len(rows) >= FEWEST]
    shows = added(one, effects, "contact") ** 2 if effects else np.zeros(len(own.time))
    most = (
        np.argsort([-float(np.mean(shows[rows])) for rows in long], kind="stable")[: STRETCHES // 2] if effects else ()
    )
    chosen = np.union1d(_some(len(long), STRETCHES), np.asarray(most, int))
    rows = np.concatenate([np.zeros(0, int), *(long[k] for k in chosen)])
    cut["contacts"] = type(own)(*(column[rows] for column in own))
    fine = tuple(column[kept] for column in one.fine)
    return replace(one, channels=seen._replace(**cut), fine=fine, at=one.at[kept])


def stretches(time: Array, flank: Array) -> list[Array]:
    """Return which points belong to one contact, contact by contact.

    time: (n,) [s]; flank: (n,).

    >>> [rows.tolist() for rows in stretches(np.array([0.0, 0.1, 0.2, 0.9, 1.0]), np.array([0, 0, 0, 0, 1]))]
    [[0, 1, 2], [3], [4]]
    """
    if len(time) < 2:
        return [np.arange(len(time))] if len(time) else []
    steps = np.diff(time)
    ends = np.flatnonzero((steps > APART * np.median(steps)) | (np.diff(flank) != 0)) + 1
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
    for rows in stretches(seen.time, seen.flank):
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
