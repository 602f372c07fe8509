"""Points of any model through its recording: the closed form, and runs in the 3D engine, one task each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gears3d.lumped import tally
from gears3d.lumped.batch import room
from gears3d.signals.motion import stroboscope
from gears3d.simulation import simulate
from gears3d.sweep.block import Raw, fill, one_by_one
from gears3d.sweep.plan import Plan
from gears3d.sweep.watch import Watch

if TYPE_CHECKING:
    from gears3d.scenario import Scenario


def run_points(plan: Plan, raw: Raw, watch: Watch, skip: Mapping[int, str]) -> None:
    """Run points in the plastic model or in the engine.

    Args:
        plan: of the sweep.
        raw: filled.
        watch: keeps the time.
        skip: points that are not run.
    """
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
