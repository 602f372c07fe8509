"""Effects: the change that each makes in the engine is the change that it makes in the twin.

Every effect is tried at a size that an engineer meets, and as small as ten times the engine's own error budget of the
gap: the parameter is scaled down until the impacts move by that length. What is compared is the *change* (with minus
without) of times and speeds of the first impacts on both flanks.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

from gears3d.recording import Recording
from gears3d.simulation import simulate
from gears3d.verification.validation.bench import fig5
from gears3d.verification.validation.check import Check

AGREEMENT = 0.05
FIRST = 8  # How many impacts after the start are compared: four on either flank

Effect = dict[str, Any]

# Effects whose size can go to zero: kind, fixed parameters, scaled parameter at an engineer's size
SIZES: dict[str, tuple[str, Effect, str]] = {
    "transmission error, drive": ("transmission_error", {"order": 7, "phase": "40 deg"}, "amplitude=5e-6 m"),
    "transmission error, loose": ("transmission_error", {"order": 5, "gear": "loose"}, "amplitude=5e-6 m"),
    "transmission error, active flank": ("transmission_error", {"order": 3, "flank": "active"}, "amplitude=5e-6 m"),
    "eccentricity, drive": ("eccentricity", {"phase": "40 deg"}, "offset=5e-6 m"),
    "eccentricity, loose": ("eccentricity", {"phase": "-70 deg", "gear": "loose"}, "offset=5e-6 m"),
    "backlash offset": ("backlash_offset", {}, "offset=2e-5 m"),
    "backlash variation": ("backlash_variation", {"order": 4, "phase": "40 deg"}, "amplitude=1e-5 m"),
    "Coulomb drag": ("drag_coulomb", {}, "torque=0.02 N m"),
    "viscous drag": ("drag_viscous", {}, "coefficient=5e-3 N m s/rad"),
    "drag as a power of speed": ("drag_power", {"exponent": 1.5}, "coefficient=5e-3 N m"),
    "drag against a shaft": ("drag_differential", {"shaft_speed": "60 rpm"}, "coefficient=5e-3 N m s/rad"),
    "drag over position": ("drag_position", {"order": 5, "phase": "40 deg"}, "amplitude=0.02 N m"),
    "drag that drifts": ("drag_drift", {"time_constant": "0.1 s"}, "relative_change=0.1"),
    "drag in mesh": ("mesh_drag", {}, "coefficient=5e-3 N m s/rad"),
    "restitution offset": ("restitution_offset", {}, "offset=0.05"),
    "restitution over speed": ("restitution_speed", {}, "slope=-3 s/m"),
    "restitution asymmetry": ("restitution_asymmetry", {}, "asymmetry=0.1"),
    "drive motion, order": ("drive_motion", {"order": 28, "phase": "40 deg"}, "amplitude=0.02 rad/s"),
    "drive motion, angle": ("drive_motion", {"frequency": "7 Hz"}, "amplitude=5e-4 rad"),
}

# Effects that have one sign
RESIST = ("viscous drag", "drag as a power of speed", "drag against a shaft", "drag in mesh")


def effect(name: str, scale: float) -> list[Effect]:
    """Return the effect as a scenario has it."""
    kind, fixed, sized = SIZES[name]
    key, text = sized.split("=")
    number, _, unit = text.partition(" ")
    size = float(number) * scale
    return [{"kind": kind, **fixed, key: f"{size!r} {unit}" if unit else size}]


@cache
def run(model: str, name: str = "", scale: float = 1.0) -> Recording:
    """Run figure 5 with one effect, or with none."""
    scenario = fig5(run__duration="0.34 s")
    return simulate(scenario.with_({"effect": effect(name, scale)}) if name else scenario, model)


def change(model: str, name: str, scale: float) -> np.ndarray:
    """Return the change that an effect makes, as lengths and speeds over their typical size, (2·FIRST,)."""
    plain, more = run(model).impacts, run(model, name, scale).impacts
    moved = [more[key][:FIRST] - plain[key][:FIRST] for key in ("time_s", "velocity_m_s")]
    return np.concatenate([moved[0] * np.abs(plain["velocity_m_s"][:FIRST]), moved[1] * 1e-2])


def disagreement(name: str, scale: float) -> float:
    """Return how far the engine's change is from the twin's, over the size of the twin's."""
    engine, twin = change("bullet", name, scale), change("rigid", name, scale)
    return float(np.linalg.norm(engine - twin) / np.linalg.norm(twin))


def smallest(name: str) -> float:
    """Return the factor at which the effect moves the impacts by ten times the engine's error budget."""
    budget = run("bullet").meta["error_budget"]["total"]
    probe = 1e-3
    moved = np.abs(change("rigid", name, probe)[:FIRST]).max()
    return float(probe * 10 * budget / moved)


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    for name in SIZES:
        signs = (1,) if quick or name in RESIST else (1, -1)
        for sign in signs:
            for words, scale in (("", 1.0),) if quick else (("", 1.0), (", at 10 x the budget", smallest(name))):
                sized = f"{name}{' reversed' if sign < 0 else ''}{words}"
                yield Check(f"{sized}: change off the twin's", disagreement(name, sign * scale), AGREEMENT)
    yield from carried()
    yield from compliance()
    yield from friction()


def carried() -> Iterator[Check]:
    """Give the checks of a carried body, which has no size that goes to zero: a small one is a stiff system."""
    body = {"kind": "carried_inertia", "inertia": "5e-3 kg m^2", "stiffness": "400 N m/rad"}
    body |= {"damping": "0.05 N m s/rad"}
    scenario = fig5(run__duration="0.34 s")
    for words, play in (("", "0 rad"), (" with a play of 0.2 mrad", "0.2 mrad")):
        more = scenario.with_({"effect": [{**body, "play": play}]})
        changes = []
        for model in ("bullet", "rigid"):
            plain, found = run(model).impacts, simulate(more, model).impacts
            moved = [found[key][:FIRST] - plain[key][:FIRST] for key in ("time_s", "velocity_m_s")]
            changes.append(np.concatenate([moved[0] * np.abs(plain["velocity_m_s"][:FIRST]), moved[1] * 1e-2]))
        off = np.linalg.norm(changes[0] - changes[1]) / np.linalg.norm(changes[1])
        yield Check(f"carried body{words}: change off the twin's", float(off), AGREEMENT)


def compliance() -> Iterator[Check]:
    """Give the checks of compliant teeth, which take the place of the restitution law."""
    scenario = fig5(run__duration="0.34 s")
    spring = {"kind": "tooth_compliance", "stiffness": "2.6e6 N/m", "damping": "1200 N s/m"}
    soft = scenario.with_({"effect": [spring]})
    changes = []
    for model in ("bullet", "rigid"):
        hard, more = simulate(scenario, model).impacts, simulate(soft, model).impacts
        moved = [more[key][:2] - hard[key][:2] for key in ("velocity_m_s", "rebound_m_s")]
        changes.append(np.concatenate([moved[0], moved[1]]))
    off = np.linalg.norm(changes[0] - changes[1]) / np.linalg.norm(changes[1])
    yield Check("tooth compliance, 2.6 N/µm: change off the twin's", float(off), AGREEMENT)


def friction() -> Iterator[Check]:
    """Give the checks of friction between rigid flanks, which changes impulses and nothing else."""
    scenario = fig5(run__duration="0.34 s")
    rough = scenario.with_({"effect": [{"kind": "mesh_friction", "coefficient": 0.05}]})
    plain, engine, twin = simulate(scenario), simulate(rough), simulate(rough, "rigid")
    paid = (run.impacts["impulse_N_s"][:FIRST] / plain.impacts["impulse_N_s"][:FIRST] - 1.0 for run in (engine, twin))
    ours, theirs = paid
    off = float(np.linalg.norm(ours - theirs) / np.linalg.norm(theirs))
    yield Check("friction in mesh: change of the impulses off the twin's", off, AGREEMENT)
    moved = np.abs(engine.signals["displacement_m"] - plain.signals["displacement_m"]).max()
    yield Check("friction in mesh: change of the motion of rigid flanks", float(moved), 1e-10, "m")
