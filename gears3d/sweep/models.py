"""Points of a block in every model, computed in one process."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache, partial
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.lumped import layout as at
from gears3d.lumped import tally
from gears3d.lumped.batch import BROKEN, STANDSTILL, TOO_LONG, Batch, pack_points, room
from gears3d.lumped.flanks import perfect
from gears3d.lumped.kernel import STATES
from gears3d.lumped.lubricated.model import flown, pack
from gears3d.lumped.model import model
from gears3d.lumped.rigid import packed
from gears3d.lumped.run import run
from gears3d.scenario.keys import written_value
from gears3d.signals.motion import stroboscope
from gears3d.simulation import simulate
from gears3d.sweep.block import (
    DONE,
    FAILED,
    LOST,
    TIME_LIMIT,
    Block,
    Raw,
    Watch,
    fill,
    one_by_one,
    scenario_of,
    too_long,
)
from gears3d.sweep.measures import Setting, reduce
from gears3d.sweep.plan import Plan
from gears3d.units import parse_any

if TYPE_CHECKING:
    from gears3d.scenario import Scenario


_AMPLITUDE, _FREQUENCY = "motion.harmonics[0].amplitude", "motion.harmonics[0].frequency"
# Keys that change numbers of the packed model and nothing else of it
PLAIN = {
    "motion.mean": "mean",
    _AMPLITUDE: "amplitude",
    _FREQUENCY: "frequency",
    "motion.harmonics[0].phase": "phase",
    "drag.torque": "torque",
    "impact.restitution": "restitution",
    "impact.stick_velocity": "stick_velocity",
    "mount.backlash": "backlash",
    "gears.loose.inertia": "inertia",
    "run.seed": "seed",
}
WHY = {
    BROKEN: "the motion is no longer finite",
    STANDSTILL: "time stands still; give a larger impact.stick_velocity",
}
WATCHED = 10.0  # periods between two looks at the clock: a stop costs a call and a shorter step
FINEST = 100  # Sections are taken at a multiple of this part of a period


def _run_rigid(plan: Plan, raw: Raw, watch: Watch, skip: Mapping[int, str]) -> None:
    """Run points in the rigid model."""
    if is_plain(plan):
        table = _packed(plan, raw)
        rows = np.array([row for row, point in enumerate(raw.points) if int(point) not in skip], dtype=int)
        start = np.full(len(rows), STATES.index(scenario_of(plan).start.state))
        table = table[rows]
    else:
        table, rows, start = _packed_one_by_one(plan, raw, watch, skip)
    ends = np.flatnonzero(np.diff(raw.points[rows] // plan.chain)) + 1 if plan.follow else []
    for part in np.split(np.arange(len(rows)), ends):
        if len(part):
            _run(plan, raw, watch, table[part], rows[part], start[part])


def is_plain(plan: Plan) -> bool:
    """Whether all points can be packed at once: one harmonic, perfect flanks, no effects, only numbers varied."""
    scenario = scenario_of(plan)
    return (
        all(axis.key in PLAIN for axis in plan.axes)
        and len(scenario.motion.harmonics) == 1
        and scenario.motion.harmonics[0].order is None
        and scenario.motion.record is None
        and not scenario.effects
        and (scenario.mount.centre_distance is None or "mount.backlash" not in [axis.key for axis in plan.axes])
        and perfect(scenario.pair())
    )


def quantities(plan: Plan, points: np.ndarray) -> dict[str, np.ndarray]:
    """Return what points of a plain sweep are packed from, as :func:`gears3d.lumped.batch.pack_points` takes it."""
    scenario = scenario_of(plan)
    rig, harmonic = scenario.rig(), scenario.motion.harmonics[0]
    size, family = parse_any(written_value(scenario, _AMPLITUDE), ("speed", "angle", "acceleration"))
    base = {
        "mean": scenario.motion.mean, "amplitude": size, "frequency": harmonic.frequency, "phase": harmonic.phase,
        "torque": rig.drag_torque, "restitution": rig.restitution, "stick_velocity": scenario.impact.stick_velocity,
        "backlash": rig.backlash, "inertia": rig.inertia,
    }  # fmt: skip
    found = {name: np.full(len(points), float(value)) for name, value in base.items()}
    for axis in plan.axes:
        if axis.key == _AMPLITUDE:
            family = axis.family
    for key, values in plan.values(points).items():
        found[PLAIN[key]] = values
    turn = 2 * np.pi * found["frequency"]
    if family != "speed":
        found["amplitude"] = found["amplitude"] * (turn if family == "angle" else 1 / turn)
    if any(axis.key == "mount.backlash" for axis in plan.axes):
        values, places = np.unique(found["backlash"], return_inverse=True)
        found["backlash"] = np.array([_backlash(plan, value) for value in values.tolist()])[places]
    return found | {"seed": plan.seeds(points).astype(float)}


@lru_cache(maxsize=65536)
def _backlash(plan: Plan, value: float) -> float:
    """Return the backlash that the pair has at its centre distance: the value to rounding."""
    scenario = scenario_of(plan)
    return replace(scenario, mount=replace(scenario.mount, backlash=value)).pair().backlash


def _packed(plan: Plan, raw: Raw) -> np.ndarray:
    q = quantities(plan, raw.points)
    scenario = scenario_of(plan)
    rig = scenario.rig()
    drive = (float(q["amplitude"][0]) or 1.0, float(q["frequency"][0]), float(q["phase"][0]))
    base = model(rig, [drive], (), scenario.impact.stick_velocity, 0).flat()
    mass = q["inertia"] / rig.base_radius_loose**2
    force = q["torque"] / rig.base_radius_loose
    same = np.ones(len(mass))
    tilt = same * float(np.cos(rig.base_helix_angle))
    radius, amplitude = same * rig.base_radius_drive, np.abs(q["amplitude"])
    raw.setting[:] = np.column_stack((1 / q["frequency"], mass, amplitude, radius, force, q["inertia"], tilt))
    return pack_points(base, q)


def _packed_one_by_one(
    plan: Plan, raw: Raw, watch: Watch, skip: Mapping[int, str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return packed models, their rows and starts; those that cannot be built are noted."""
    packed: dict[int, tuple[np.ndarray, int]] = {}

    def build(row: int, scenario: Scenario, _: bool) -> None:
        packed[row] = flat(scenario), STATES.index(scenario.start.state)

    one_by_one(plan, raw, watch, skip, build)
    raw.status[:] = FAILED
    width = max((len(numbers) for numbers, _ in packed.values()), default=0)
    table = np.zeros((len(packed), width))
    for place, (numbers, _) in enumerate(packed.values()):
        table[place, : len(numbers)] = numbers
    rows = np.array(list(packed), dtype=int)
    if plan.follow and len(table) and table[0, at.FLOOR] > 0.0:
        what = "of the rigid model with an oil film cannot be followed from point to point"
        raise InputError(Fault("--follow", f"the motion {what}", "leave it out, or --model lubricated"))
    return table, rows, np.array([start for _, start in packed.values()], dtype=int)


def flat(scenario: Scenario) -> np.ndarray:
    """Return the packed rigid model of a scenario, flat."""
    m = packed(scenario)
    if m.backlash <= 0.0 and m.stiffness == 0.0:
        raise InputError(Fault("mount.backlash", "leaves no gap", "give more"))
    return m.flat()


def _run(plan: Plan, raw: Raw, watch: Watch, table: np.ndarray, rows: np.ndarray, start: Any) -> None:
    times = (plan.periods, plan.settle, plan.keep)
    batch = Batch(table, raw.setting[rows, 0], times, start, plan.follow, plan.strobe)
    with watch.over(batch, raw.points[rows].tolist()):
        batch.run()
    raw.numbers[rows], raw.sections[rows] = batch.found, batch.sections
    raw.status[rows] = DONE
    for place in np.flatnonzero(batch.status):
        code = int(batch.status[place])
        if code == TOO_LONG:
            limit = watch.limit if watch.limit < inf else 0.0
            raw.fail(int(rows[place]), too_long(limit), TIME_LIMIT)
        else:
            raw.fail(int(rows[place]), WHY[code])


def _run_lubricated(plan: Plan, raw: Raw, watch: Watch, skip: Mapping[int, str]) -> None:
    """Run points in the lubricated model."""
    jerk = "ri" in plan.measures
    kept = room(plan.periods - plan.settle)
    last: list[np.ndarray] = []

    def one(row: int, scenario: Scenario, goes_on: bool) -> None:
        m = pack(scenario)
        begun = _going_on(last[-1], m.radius_loose) if plan.follow and goes_on and last else None
        last.clear()
        period = scenario.period
        end = plan.periods * period
        spacing = period if plan.strobe == 0.0 else period / FINEST
        m = m._replace(settle=plan.settle * period if jerk else -1.0)
        put = None if begun is None else partial(np.copyto, src=begun)
        outcome = flown(run(m, end, spacing, scenario.start.state, watch.check, chunk=WATCHED * period, put=put), m)
        if outcome.interrupted:
            raise KeyboardInterrupt
        last.append(outcome.state)
        mass = m.inertia / m.radius_loose**2
        fill(plan, raw, row, outcome.impacts[np.argsort(outcome.impacts[:, 0], kind="stable")], period, mass, kept)
        each = 1 if plan.strobe == 0.0 else FINEST
        first = (plan.periods - plan.keep) * each + round(plan.strobe * each)
        taken = outcome.samples[first::each][: plan.keep]
        raw.sections[row, : len(taken), : tally.FIRST] = taken[:, 5:7]
        if jerk:
            raw.numbers[row, tally.JERK] = outcome.jerk

    one_by_one(plan, raw, watch, skip, one)


def _going_on(state: np.ndarray, radius_loose: float) -> np.ndarray:
    """Return a state at the end of whole periods as one at time 0."""
    begun = state.copy()
    for since in (at.ENTRY, at.CONTACT_SINCE, at.LAST_IMPACT):
        begun[since] -= state[at.TIME]
    begun[at.ANGLE] = begun[at.DISPLACEMENT] / radius_loose
    begun[at.TIME] = begun[at.MARK] = begun[at.JERK] = begun[at.RISING] = 0.0
    return begun


def _run_recorded(plan: Plan, raw: Raw, watch: Watch, skip: Mapping[int, str]) -> None:
    """Run points in the plastic model or in the engine."""
    kept = room(plan.periods - plan.settle)

    def one(row: int, scenario: Scenario, _: bool) -> None:
        recording = simulate(scenario, plan.model, progress=watch.check)
        if recording.meta.get("interrupted"):
            raise KeyboardInterrupt
        hits, period = recording.impacts, scenario.period
        unknown = np.full(len(hits["time_s"]), np.nan)
        names = ("time_s", "flank", "velocity_m_s", "rebound_m_s", "impulse_N_s", "displacement_m", "flight_height_m")
        impacts = np.column_stack([np.asarray(hits.get(name, unknown), dtype=float) for name in names])
        fill(plan, raw, row, impacts.reshape(-1, len(names)), period, float(raw.setting[row, 1]), kept)
        begin = (plan.periods - plan.keep) * period
        taken = stroboscope(recording.signals, hits, period, plan.strobe, begin * (1 - 1e-12), plan.periods * period)
        taken = taken[: plan.keep]
        raw.sections[row, : len(taken), : tally.FIRST] = taken

    one_by_one(plan, raw, watch, skip, one)


_RUN = {"rigid": _run_rigid, "lubricated": _run_lubricated}  # all others through a recording of each point


def compute(
    plan: Plan, begin: int, end: int, watch: Watch | None = None, skip: Mapping[int, str] | None = None
) -> Block:
    """Run the points of a block.

    Args:
        plan: of the sweep.
        begin: first point.
        end: one after the last.
        watch: keeps the time.
        skip: points that are not run, and why.

    Returns:
        The variables of the points; those that could not be run are NaN, with the reason.
    """
    clock, work = time.perf_counter(), time.process_time()
    raw = Raw.empty(plan, begin, end)
    _RUN.get(plan.model, _run_recorded)(plan, raw, watch or Watch(), skip or {})
    for point, why in (skip or {}).items():
        if begin <= point < end:
            raw.fail(point - begin, why, LOST if "died" in why else TIME_LIMIT)
    setting = Setting(*raw.setting.T)
    values = reduce(plan.measures, raw.numbers, raw.sections, setting, plan.periods - plan.settle)
    values |= {"status": raw.status, "seed": plan.seeds(raw.points)}
    return Block(begin, end, values, raw.why, time.perf_counter() - clock, time.process_time() - work)


@lru_cache(maxsize=4)
def warm(plan: Plan) -> None:
    """Load or compile the kernels of a model, so that no point pays for it with its time; once a process."""
    if plan.model in ("rigid", "lubricated"):
        compute(replace(plan, periods=2, settle=1, keep=1, follow=False), 0, 1)
