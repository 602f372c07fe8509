"""Points of the lubricated model, each from rest or from where the point before it ended."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gears3d.lumped import tally
from gears3d.lumped.batch import room
from gears3d.lumped.lubricated import layout as at
from gears3d.lumped.lubricated.model import pack
from gears3d.lumped.lubricated.run import run
from gears3d.sweep.block import Raw, fill, one_by_one
from gears3d.sweep.plan import Plan
from gears3d.sweep.watch import Watch

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

FINEST = 100
"""Sections are taken at a multiple of this part of a period."""


def run_points(plan: Plan, raw: Raw, watch: Watch, skip: Mapping[int, str]) -> None:
    """Run points in the lubricated model.

    Args:
        plan: of the sweep.
        raw: filled.
        watch: keeps the time.
        skip: points that are not run.
    """
    jerk = "ri" in plan.measures
    kept = room(plan.periods - plan.settle)
    last: list[np.ndarray] = []

    def one(row: int, scenario: Scenario, goes_on: bool) -> None:
        begun = _going_on(last[-1]) if plan.follow and goes_on and last else None
        last.clear()
        m = pack(scenario)
        period = scenario.period
        end = plan.periods * period
        spacing = period if plan.strobe == 0.0 else period / FINEST
        outcome = run(
            m, end, scenario.start.state, spacing, plan.settle * period, scenario.lubricated.tolerance,
            books=jerk, progress=watch.check, state=begun,
        )  # fmt: skip
        if outcome.interrupted:
            raise KeyboardInterrupt
        last.append(outcome.state)
        mass = float(m.numbers[at.MASS])
        fill(plan, raw, row, outcome.impacts[np.argsort(outcome.impacts[:, 0], kind="stable")], period, mass, kept)
        each = 1 if plan.strobe == 0.0 else FINEST
        first = (plan.periods - plan.keep) * each + round(plan.strobe * each)
        taken = outcome.samples[first::each][: plan.keep]
        raw.sections[row, : len(taken), : tally.FIRST] = taken[:, 1:3]
        if jerk:
            raw.numbers[row, tally.JERK] = outcome.jerk

    one_by_one(plan, raw, watch, skip, one)


def _going_on(state: np.ndarray) -> np.ndarray:
    """Return a state at the end of whole periods as one at time 0."""
    begun = state.copy()
    begun[at.ENTRY] -= state[at.TIME]
    begun[at.TIME] = begun[at.STEP] = begun[at.JERK] = begun[at.RISING] = 0.0
    begun[at.BOOKS :] = 0.0
    return begun
