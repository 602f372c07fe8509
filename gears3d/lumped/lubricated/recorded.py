"""The lubricated model as a recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import cos, sqrt
from typing import TYPE_CHECKING

import numpy as np

from gears3d.lumped import layout as at
from gears3d.lumped.lubricated.model import pack
from gears3d.lumped.model import Model
from gears3d.lumped.rigid import recorded
from gears3d.lumped.run import Outcome, run
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

WORKS = ("mesh", "drag", "friction", "spring", "damping", "squeeze", "wedge", "drive")


def simulate(scenario: Scenario, progress: Callable[[float], None] | None = None) -> Recording:
    """Run a scenario in the lubricated model.

    Args:
        scenario: with an effect ``oil_film``; its restitution is not used, as the teeth are compliant. Effects of
            sensors do not act here.
        progress: called now and then with the simulated time done [s].

    Returns:
        The recording, with ``mesh_force_N`` (along the normal, on the loose gear, active flank positive) and the
        signals of the contract. An impact is a passage through the height at which the film begins to act, as in the
        rigid twin with oil. ``meta`` has ``rattle_index``, ``works_J`` (:data:`WORKS`), ``felt_height_m``,
        ``counters``, ``contacts`` and ``lyapunov_1_s``.

    Raises:
        InputError: the scenario holds what the model cannot do, or no oil.
        EngineError: the motion cannot continue.

    Source: the lubricated dual-clutch transmission, eqs (1) to (14) and (27) to (33).

    >>> from gears3d.scenario import load
    >>> short = load("scenarios/dct-helical-lubricated/fig13.toml", {"run.duration": "0.1 s", "run.settle": "0 s"})
    >>> recording = simulate(short)
    >>> sorted(set(recording.impacts["flank"].tolist()))
    [0, 1]
    """
    m = pack(scenario)
    rig, duration = scenario.rig(), scenario.run.duration
    m = m._replace(settle=min(scenario.run.settle, duration))
    outcome = run(m, duration, 1.0 / scenario.run.output_rate, scenario.start.state, progress, lyapunov=True)
    made, tilt = recorded(flown(outcome, m), m, scenario, "lubricated"), cos(rig.base_helix_angle)
    signals = {**made.signals, "mesh_force_N": (outcome.forces[:, 0] - outcome.forces[:, 1]) / tilt}
    meta = {
        **made.meta,
        "rattle_index": sqrt(outcome.jerk) / tilt / rig.inertia if outcome.jerk >= 0.0 else None,
        "works_J": dict(zip(WORKS, outcome.works.tolist(), strict=True)),
        "felt_height_m": float(m.film[5] + m.flat()[at.LAYER]),
    }
    return Recording(signals, made.impacts, meta)


def flown(outcome: Outcome, m: Model) -> Outcome:
    """Return a run whose flights are as high as they get above the height at which the film begins to act."""
    impacts = outcome.impacts.copy()
    impacts[:, 6] = np.maximum(impacts[:, 6] - m.film[5], 0.0)
    return replace(outcome, impacts=impacts)
