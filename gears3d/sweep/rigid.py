"""Points of the rigid model: packed one by one or, where only numbers of rig and motion change, all at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.lumped import layout as at
from gears3d.lumped.batch import BROKEN, STANDSTILL, TOO_LONG, Batch, pack_points
from gears3d.lumped.flanks import perfect
from gears3d.lumped.model import model
from gears3d.lumped.rigid import packed
from gears3d.lumped.start import STATES
from gears3d.scenario.key_paths import written_value
from gears3d.sweep.block import DONE, FAILED, TIME_LIMIT, Raw, one_by_one, scenario_of, setting_row, too_long
from gears3d.sweep.plan import Plan
from gears3d.sweep.watch import Watch
from gears3d.units import parse_any

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

_AMPLITUDE, _FREQUENCY = "motion.harmonics[0].amplitude", "motion.harmonics[0].frequency"
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
"""Keys that change numbers of the packed model and nothing else of it."""
WHY = {
    BROKEN: "the motion is no longer finite",
    STANDSTILL: "time stands still; give a larger impact.stick_velocity",
}


def run_points(plan: Plan, raw: Raw, watch: Watch, skip: Mapping[int, str]) -> None:
    """Run points in the rigid model.

    Args:
        plan: of the sweep.
        raw: filled.
        watch: keeps the time.
        skip: points that are not run.
    """
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
    """Whether all points can be packed at once: one harmonic, perfect flanks, no effects, nothing but numbers varied.

    Args:
        plan: of the sweep.
    """
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
    """Return what points of a plain sweep are packed from, as :func:`gears3d.lumped.batch.pack_points` takes it.

    Args:
        plan: of the sweep.
        points: their numbers, (n,).
    """
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
    radius, swing = same * rig.base_radius_drive, np.abs(q["amplitude"])
    raw.setting[:] = np.column_stack((1 / q["frequency"], mass, swing, radius, force, q["inertia"], tilt))
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
    """Return the packed rigid model of a scenario, flat.

    Args:
        scenario: to be run.

    Raises:
        InputError: the rigid model cannot do it.
    """
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


__all__ = ["flat", "is_plain", "quantities", "run_points", "setting_row"]
