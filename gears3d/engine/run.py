"""Runs of the engine: from a scenario through the Bullet world to a recording, with the error due to the step."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.effects.rows import Code, Gear, Row, torque_constant
from gears3d.effects.support import NATIVE, refused
from gears3d.engine.budget import Watch
from gears3d.engine.bullet import require_bullet
from gears3d.engine.carried import contact_step
from gears3d.engine.closing import ContactSystem
from gears3d.engine.faults import YIELDED
from gears3d.engine.films import film_of
from gears3d.engine.forced import TOLERANCE, springs_of
from gears3d.engine.impact import ImpactLaw
from gears3d.engine.lines import slices_of
from gears3d.engine.located import Located, Settings
from gears3d.engine.log import Log
from gears3d.engine.mesh import lean_of, meshed, offset_of, tilt_of
from gears3d.engine.motion import fastest, motion_table
from gears3d.engine.native import STEP, Native
from gears3d.engine.torques import friction, gated, torque_table
from gears3d.engine.world import KEPT, Body, World, lent_world
from gears3d.errors import EngineError, Fault, GearsError, InputError, UsageError, did_you_mean
from gears3d.gears import HarmonicDeviation, Pair, pieces
from gears3d.recording import Recording
from gears3d.scenario.models import eccentricities, flank_deviations
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

# Order of the error in the step: flights and compliant contacts use two Gauss points a step; native is Bullet's own
# integration.
ORDER = {"located": 4, "native": 1}
PARTED = 0.01  # distance of two runs, as a part of the backlash, beyond which they are independent
Parts = tuple[World, ContactSystem, Watch, Log]
Begin = Callable[[ContactSystem, tuple[float, float]], tuple[Log, list[tuple[int, float, float]]]]
CONTACTS = ("located", "native")
# Above it the two evaluations of the reaction in a step miss contact losses due to reliefs [s].
LONGEST_STEP = 1e-3
TURN_PER_STEP = 0.3  # largest turn of the drive gear in one step, in tooth pitches
STRETCH = 1.25  # factor by which a step may be longer where a window of near teeth ends there
MOST_STEPS = 1e9  # of a run in contact with a carried body, which would take hours
# Smallest number of steps in one period of the fastest harmonic of motion, torque or flanks.
STEPS_PER_WAVE = 40.0


def halved(made: Recording, finer: Recording, backlash: float, order: int) -> dict[str, Any]:
    """Return the error of a run ``made``, as estimated by the run ``finer`` with half its longest step.

    The dict has ``order``, that of the error in the step; ``step_s`` and ``half_step_s`` as in the runs' ``meta``;
    ``until_s``, up to which both were compared, and ``parted``, whether they diverged there, as chaotic motions do with
    any step; ``displacement_m`` and ``displacement_rms_m``; and of ``impacts`` compared one by one the largest
    ``impact_time_s`` and ``impact_velocity_m_s``. All errors are those of ``made``: the difference times
    2^order/(2^order - 1). ``backlash`` is in m.

    Source: Richardson's extrapolation.
    """
    share = 2.0**order / (2.0**order - 1.0)
    count = min(len(made.time), len(finer.time))
    apart = np.abs(made.signals["displacement_m"][:count] - finer.signals["displacement_m"][:count])
    gone = np.flatnonzero(apart > PARTED * backlash)
    parted = bool(gone.size)
    count = int(gone[0]) if parted else count
    until = float(made.time[count - 1]) if count else 0.0
    ours, theirs = ({name: hits[hits_name] for name, hits_name in _COMPARED} for hits in (made.impacts, finer.impacts))
    hits = min(*(int(np.searchsorted(table["time"], until, side="right")) for table in (ours, theirs)))
    other = np.flatnonzero(ours["flank"][:hits] != theirs["flank"][:hits])
    hits = int(other[0]) if other.size else hits
    off = {name: np.abs(ours[name][:hits] - theirs[name][:hits]) for name in ("time", "velocity")}
    return {
        "order": order,
        "step_s": made.meta["longest_step_s"],
        "half_step_s": finer.meta["longest_step_s"],
        "until_s": until,
        "parted": parted or bool(other.size),
        "displacement_m": share * float(apart[:count].max(initial=0.0)),
        "displacement_rms_m": share * float(np.sqrt(np.mean(apart[:count] ** 2))) if count else 0.0,
        "impacts": hits,
        "impact_time_s": share * float(off["time"].max(initial=0.0)),
        "impact_velocity_m_s": share * float(off["velocity"].max(initial=0.0)),
    }


_COMPARED = (("time", "time_s"), ("flank", "flank"), ("velocity", "velocity_m_s"))


def simulate(
    scenario: Scenario,
    pair: Pair | None = None,
    contact: str = "located",
    progress: Callable[[float], None] | None = None,
    *,
    step: float | None = None,
    path: np.ndarray | None = None,
    error_estimate: bool = False,
) -> Recording:
    """Run a scenario as rigid bodies in PyBullet.

    Args:
        scenario: the scenario to be simulated.
        pair: gears that replace the scenario's own; the scenario's flank effects are added to them.
        contact: ``"located"`` (impacts where the true flanks meet) or ``"native"`` (Bullet's own contact response).
        progress: called now and then with the simulated time done [s].
        step: longest step of located contact, or the step of native contact [s]; ``None``: chosen, or 10 µs.
        path: of the drive in place of the scenario's motion, as :func:`gears3d.engine.motion.there_and_back` gives;
            with one, ``step`` may be longer than those of usual speeds.
        error_estimate: run once more with half the step, and give in ``meta["error_estimate"]`` the result of
            :func:`gears3d.engine.run.halved` for both; progress then goes to twice the duration.

    Returns:
        The recording, with ``meta["error_budget"]``; after Ctrl-C the part up to then, with ``meta["interrupted"]``.

    Raises:
        UsageError: the contact is not known.
        InputError: gears that cannot be made, or what this engine or Bullet's own contact cannot do.
        EngineError: jammed gears, teeth that overlap, a raw gap outside the hull budget, a state that is
            not a number; its ``partial`` is the recording up to that instant, with ``meta["stopped_by"]``.

    Theory: docs/theory/engine.md, equations (1), (2).
    """
    check_contact(contact)
    asked = Asked(scenario, pair, contact, progress, step, path)
    made = _run(asked)
    if not error_estimate or made.meta["interrupted"]:
        return made

    def later(done: float) -> None:
        if progress is not None:
            progress(scenario.run.duration + done)

    finer = _run(asked._replace(progress=later, step=0.5 * made.meta["longest_step_s"]))
    backlash = (scenario.pair() if pair is None else pair).backlash
    return Recording(
        made.signals,
        made.impacts,
        {**made.meta, "error_estimate": halved(made, finer, backlash, ORDER[contact])},
    )


def check_contact(contact: str) -> None:
    """Raise a UsageError for the name of an unknown contact."""
    if contact not in CONTACTS:
        raise UsageError(f"there is no contact {contact!r}; {did_you_mean(contact, CONTACTS)}")


class Outcome(NamedTuple):
    """Result of a run.

    Args:
        log: samples and impacts.
        meta: what is known about them.
        signals: the columns of the samples.
        stopped: why it could not continue.
    """

    log: Log
    meta: dict[str, Any]
    signals: Callable[[], dict[str, np.ndarray]]
    stopped: GearsError | None


class Asked(NamedTuple):
    """A requested run, as :func:`simulate` takes it.

    Args:
        scenario: the scenario to be simulated.
        pair: gears that replace the scenario's own.
        contact: ``"located"`` or ``"native"``.
        progress: called now and then.
        step: longest, or of native contact [s].
        path: of the drive in place of the scenario's motion.
    """

    scenario: Scenario
    pair: Pair | None = None
    contact: str = "located"
    progress: Callable[[float], None] | None = None
    step: float | None = None
    path: np.ndarray | None = None


def _run(asked: Asked) -> Recording:
    found = simulated(asked)
    made = Recording(found.signals(), found.log.impact_columns(), found.meta)
    if found.stopped is not None:
        raise EngineError(str(found.stopped), made if len(made.time) > 1 else None) from found.stopped
    return made


def simulated(asked: Asked, begin: Begin | None = None) -> Outcome:
    """Run a scenario once, up to its end or its first error.

    ``begin`` gives the log, and the list of permanent contacts, for a system and its base radii [m]; ``None``: in
    memory. A MissingExtraError states that PyBullet is not installed.
    """
    require_bullet()
    scenario, pair, contact, progress, step, path = asked
    rows = scenario.rows()
    gears, torques, _ = prepared(scenario, pair, rows, contact)
    began = clock.perf_counter()
    film, rig = film_of(rows, gears.backlash), scenario.rig()
    shape = meshed(gears, film.minimum)
    arm = friction(rows) * gears.loose.base_radius
    motion = motion_table(scenario, rows) if path is None else path
    system = ContactSystem(shape, motion, torques, gated(torques), rig.inertia, arm, film)
    most = LONGEST_STEP if path is None or step is None else step
    longest = longest_step(motion, rows, gears, most)
    stretched = longest_step(motion, rows, gears, most, STRETCH * TURN_PER_STEP)
    watch = Watch(gears, shape, slices_of(gears))
    radii = (gears.drive.base_radius, gears.loose.base_radius)
    span = (scenario.run.duration, scenario.run.output_rate)
    log, contacts = (Log(*span), []) if begin is None else begin(system, radii)
    with lent_world(bodies(scenario, gears), respond=contact == "native") as world:
        if contact == "native":
            longest = STEP if step is None else step
            run = _native(scenario, rows, gears, (world, system, watch, log), longest)
        else:
            usual = longest
            if step is not None:
                longest, stretched = min(step, longest), min(step, stretched)
            run = _located(scenario, rows, (longest, stretched, longest / usual), (world, system, watch, log))
        run.contacts = contacts
        complete, stopped = False, None
        try:
            complete = run.run(progress)
        except (EngineError, InputError) as error:
            stopped = error
    meta: dict[str, Any] = {
        "model": "bullet",
        "contact": contact,
        "steps": run.steps,
        "longest_step_s": longest,
        "queries": watch.queries,
        "contacts": run.contacts,
        "error_budget": _budget(watch.report(run.located), contact),
        "interrupted": not complete,
        "reached_s": run.time,
        "base_radius_drive_m": radii[0],
        "base_radius_loose_m": radii[1],
        "wall_s": clock.perf_counter() - began,
    }
    if stopped is not None:
        meta["stopped_by"] = str(stopped)
    return Outcome(log, meta, lambda: log.signals(system.motion, radii), stopped)


def prepared(
    scenario: Scenario, pair: Pair | None, rows: tuple[Row, ...], contact: str = "located"
) -> tuple[Pair, np.ndarray, ImpactLaw]:
    """Return the gears with all effects on their flanks, the table of torques and the law of impacts.

    Args:
        scenario: the scenario to be simulated.
        pair: gears that replace the scenario's own.
        rows: of all effects.
        contact: as for :func:`simulate`.

    Raises:
        InputError: what the engine cannot do.
    """
    gears = scenario.pair() if pair is None else pair
    _refuse(scenario, gears, contact, rows)
    torques = torque_table([torque_constant(scenario.rig().drag_torque), *rows])
    return _shaped(scenario, gears, rows), torques, _law(scenario, rows)


def _budget(parts: dict[str, float], contact: str) -> dict[str, float]:
    """Return the error budget; with Bullet's own contact, its hulls touch, and the total is theirs."""
    if contact == "native":
        parts = {**parts, "total": abs(parts["raw_minus_refined_mean"]) + parts["raw_minus_refined_max"]}
    return parts


def _refuse(scenario: Scenario, pair: Pair, contact: str, rows: tuple[Row, ...]) -> None:
    """Refuse what this engine, or Bullet's own contact, cannot do."""
    file = "" if scenario.path is None else str(scenario.path)
    faults = []
    if pair.drive.helix_angle != 0.0 and contact == "native":
        text = f"is {show(pair.drive.helix_angle, 'angle')}: Bullet's own contact is that of spur teeth only"
        faults.append(Fault("gears.helix_angle", text, "use contact = located", file))
    faults += refused(scenario.effects, scenario.rig(), NATIVE if contact == "native" else "bullet", file)
    for row in rows:
        if row.code == Code.TORQUE_CARRIED and scenario.run.duration > MOST_STEPS * (step := contact_step(row)):
            text = f"has a carried body that needs steps of {step:.2g} s, more than {MOST_STEPS:g} in the run"
            faults.append(Fault("effect", text, "give it more inertia, a softer spring or less damping", file))
    if faults:
        raise InputError(faults)


def _shaped(scenario: Scenario, pair: Pair, rows: tuple[Row, ...]) -> Pair:
    """Return the gears with the scenario's effects on their flanks."""
    try:
        return pair.with_deviations(*flank_deviations(rows)).with_mounting(*eccentricities(rows))
    except InputError as why:
        file = "" if scenario.path is None else str(scenario.path)
        raise InputError([replace(fault, key="effect", file=file) for fault in why.faults]) from why


def bodies(scenario: Scenario, pair: Pair) -> tuple[Body, Body]:
    """Return both gears for Bullet: turned into the world as they are when both angles are 0.

    Args:
        scenario: gives the loose gear's inertia.
        pair: the gears.
    """
    return _bodies(pieces, pair, scenario.rig().inertia)


@lru_cache(maxsize=KEPT)
def _bodies(hulls: Callable[..., list[np.ndarray]], pair: Pair, inertia: float) -> tuple[Body, Body]:
    """As :func:`bodies`: the same objects for the same gears, so that their world is reused."""
    made = []
    for which, sense, moment in (("drive", 1, 1e3 * inertia), ("loose", -1, inertia)):
        turn = pair.rotation(which, 0.0)
        flip = np.array([math.copysign(1.0, math.cos(turn))] * 2 + [1.0])
        off, tilt = np.append(offset_of(pair, which), 0.0), np.append(tilt_of(pair, which), 0.0)
        teeth = np.stack(hulls(pair, which, slices=slices_of(pair)))
        teeth += off + teeth[..., 2:] * tilt
        lean = (0.0, 0.0) if which == "drive" else (float(lean_of(pair)[0]), float(lean_of(pair)[1]))
        made.append(Body(teeth * flip, pair.centre(which), moment, sense, lean))
    return made[0], made[1]


def longest_step(
    motion: np.ndarray,
    rows: tuple[Row, ...],
    pair: Pair,
    most: float = LONGEST_STEP,
    turn: float = TURN_PER_STEP,
) -> float:
    """Return the longest step [s] that resolves the mesh and every harmonic of motion, torque and flanks.

    It is at most ``most`` [s]; ``turn`` is the largest turn of the drive gear in one step, in tooth pitches.
    """
    speed, frequency = fastest(motion)
    speed_loose = speed * pair.drive.base_radius / pair.loose.base_radius
    waves = [frequency]
    waves += [row.p[0] * speed_loose for row in rows if row.code == Code.TORQUE_HARMONIC]
    waves += [speed if row.p[0] == Gear.DRIVE else speed_loose for row in rows if row.code == Code.FLANK_ECCENTRIC]
    for deviation in pair.deviations:
        if isinstance(deviation, HarmonicDeviation):
            waves.append(deviation.order * (speed if deviation.gear == "drive" else speed_loose))
    times = [most]
    times += [2.0 * math.pi / STEPS_PER_WAVE / wave for wave in waves if wave > 0.0]
    if speed > 0.0:
        times.append(turn * 2.0 * math.pi / pair.drive.teeth / speed)
    return min(times)


def _stroke(scenario: Scenario) -> tuple[float, float]:
    """Return circular frequency [rad/s] and phase [rad] of the first harmonic, zeros without one."""
    harmonics = scenario.motion.harmonics
    return (2.0 * math.pi * harmonics[0].frequency, harmonics[0].phase) if harmonics else (0.0, 0.0)


def _law(scenario: Scenario, rows: tuple[Row, ...]) -> ImpactLaw:
    return ImpactLaw(scenario.impact.restitution, rows, scenario.run.seed)


def _located(scenario: Scenario, rows: tuple[Row, ...], steps: tuple[float, float, float], parts: Parts) -> Located:
    world, system, watch, log = parts
    settings = Settings(
        duration=scenario.run.duration,
        longest_step=steps[0],
        stretched_step=steps[1],
        law=_law(scenario, rows),
        stick_velocity=scenario.impact.stick_velocity,
        springs=springs_of(rows),
        start=scenario.start.state,
        stroke=_stroke(scenario),
        deepest=YIELDED * scenario.gears.drive.module,
        tolerance=TOLERANCE * steps[2] ** ORDER["located"],
    )
    return Located(world, system, settings, watch, log)


def _native(scenario: Scenario, rows: tuple[Row, ...], pair: Pair, parts: Parts, step: float) -> Native:
    world, system, watch, log = parts
    settings = (scenario.run.duration, step, scenario.impact.stick_velocity)
    radii = (pair.drive.base_radius, pair.loose.base_radius)
    law = _law(scenario, rows)
    return Native(world, system, radii, law, watch, log, settings, _stroke(scenario))
