"""Points of the lubricated model, each from rest or from where the point before it ended."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gears3d.lumped import layout as at
from gears3d.lumped import tally
from gears3d.lumped.batch import room
from gears3d.lumped.lubricated.model import pack
from gears3d.lumped.lubricated.recorded import flown
from gears3d.lumped.run import run
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
        m = pack(scenario)
        begun = _going_on(last[-1], m.radius_loose) if plan.follow and goes_on and last else None
        last.clear()
        period = scenario.period
        end = plan.periods * period
        spacing = period if plan.strobe == 0.0 else period / FINEST
        m = m._replace(settle=plan.settle * period if jerk else -1.0)
        put = None if begun is None else partial(np.copyto, src=begun)
        outcome = flown(run(m, end, spacing, scenario.start.state, watch.check, chunk=period, put=put), m)
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
    begun[at.WORKS : at.WORKS + at.N_WORKS] = 0.0
    return begun
