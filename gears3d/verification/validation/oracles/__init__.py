"""Independent ways to the rigid twin's motion: events, time stepping, springs and dampers, closed forms.

None of them shares code with the twin. Moreau's stepping and scipy's events solve the same equations; springs tend to
them; the plastic model and the cycle in closed form integrate nothing. Cases: Rigaud & Perret-Liaudet 2020, figs 5, 10.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gears3d.laws.orbit import cycle
from gears3d.scenario import Scenario
from gears3d.simulation import simulate
from gears3d.verification.validation.bench import fig5, swing
from gears3d.verification.validation.check import Check
from gears3d.verification.validation.oracles import events, moreau, penalty
from gears3d.verification.validation.oracles.case import Case as Case
from gears3d.verification.validation.oracles.case import case as case

# each orbit by its amplitude [rpm], frequency [Hz], backlash [µm], and number of periods
ORBITS = {
    "20 rpm, 3 Hz, 250 um": (20, 3, 250, 20),
    "4 rpm, 10 Hz, 200 um": (4, 10, 200, 20),
    "5 rpm, 1 Hz, 250 um, single-sided": (5, 1, 250, 5),
}
STEPS = (500, 1000, 2000, 4000, 8000, 16000)
STIFFNESSES = (1e7, 1e8, 1e9)


def bench(rpm: float, hertz: float, backlash: float, restitution: float, periods: float) -> Scenario:
    """Return a case of the bench.

    Units: ``backlash`` [µm].
    """
    return fig5().with_(
        {
            "motion.harmonics": [{"amplitude": f"{rpm} rpm", "frequency": f"{hertz} Hz"}],
            "mount.backlash": f"{backlash} um", "impact.restitution": restitution,
            "run.duration": f"{periods / hertz!r} s", "run.output_rate": f"{max(STEPS) * hertz} Hz",
        }
    )  # fmt: skip


def stepping_errors(scenario: Scenario) -> np.ndarray:
    """Return the mean distance of Moreau's stepping from the twin over one period [m], for each of ``STEPS``."""
    twin = simulate(scenario, "rigid").signals["displacement_m"]
    found = []
    for steps in STEPS:
        places = moreau.step_through(case(scenario), scenario.run.duration, steps)
        found.append(float(np.abs(places - twin[:: max(STEPS) // steps]).mean()))
    return np.array(found)


def order(sizes: np.ndarray, errors: np.ndarray) -> float:
    """Return the exponent with which errors fall with a size, by least squares of the logarithms.

    Shapes: ``sizes`` (n,); ``errors`` (n,).

    >>> round(order(np.array([1.0, 2.0, 4.0]), np.array([1.0, 0.5, 0.25])), 9)
    1.0
    """
    return float(-np.polyfit(np.log(sizes), np.log(errors), 1)[0])


def yielding_errors(scenario: Scenario, stiffnesses: tuple[float, ...], pulls: bool) -> np.ndarray:
    """Return the largest relative error of approach and rebound of springs against the twin's impacts across the gap.

    Units: ``stiffnesses`` [N/m], (n,).
    """
    twin = simulate(scenario, "rigid").impacts
    hard = twin["flight_height_m"] > 0.9 * scenario.rig().backlash
    true = np.stack([twin["velocity_m_s"][hard], twin["rebound_m_s"][hard]])
    found = []
    for stiffness in stiffnesses:
        soft = penalty.impacts(case(scenario), scenario.run.duration, stiffness, pulls)
        soft = soft[soft[:, 4] > 0.9 * scenario.rig().backlash]
        same = np.array_equal(soft[:, 1], twin["flank"][hard])
        found.append(float(np.abs(soft[:, 2:4].T / true - 1).max()) if same else np.inf)
    return np.array(found)


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    yield from _closed_forms()
    for restitution in (0.3,) if quick else (0.3, 0.6):
        yield from _restarted(restitution)
    for restitution in (0.0, 0.5) if quick else (0.0, 0.3, 0.5, 0.7):
        errors = stepping_errors(bench(20, 3, 250, restitution, 1))
        name = f"Moreau's time stepping, e = {restitution}"
        yield Check(f"{name}: order of convergence in the step", order(np.array(STEPS), errors), 0.9, at_least=True)
        yield Check(f"{name}: mean distance at {max(STEPS)} steps a period", errors[-1] / 250e-6, 1e-3, "backlash")
    for pulls in (False, True):
        yield from _yielding(0.3, pulls)
    off = penalty.given_back(penalty.ratio_for(0.3, pulls=True)) - 0.3
    yield Check("eq. (20) on a force that may not pull, e = 0.3: restitution too large by", off, 0.05, at_least=True)


def _closed_forms() -> Iterator[Check]:
    for name, (rpm, hertz, backlash, periods) in ORBITS.items():
        scenario = bench(rpm, hertz, backlash, 0.0, periods).with_({"run.output_rate": "2 kHz"})
        ours, twin = simulate(scenario, "plastic"), simulate(scenario, "rigid")
        columns = [(ours.signals[key], twin.signals[key]) for key in ours.signals]
        columns += [(ours.impacts[key], twin.impacts[key]) for key in ours.impacts]
        off = max(float(np.abs(a - b).max()) if a.shape == b.shape else np.inf for a, b in columns)
        yield Check(f"plastic model, {name}, {periods} periods: any number off", off, 1e-9)
    for restitution in (0.3, 0.7):
        scenario = bench(20, 3, 250, restitution, 1)
        closed = cycle(swing(scenario), 250e-6, lambda flank, speed, e=restitution: e, 1e-4)
        twin = simulate(scenario, "rigid").impacts["velocity_m_s"]
        ours = np.array([flight.velocity for flight in closed.flights])
        off = float(np.abs(ours / twin - 1).max()) if ours.shape == twin.shape else np.inf
        yield Check(f"cycle in closed form, e = {restitution}: speed of any impact off", off, 1e-8)


def _restarted(restitution: float) -> Iterator[Check]:
    scenario = bench(20, 3, 250, restitution, 1)
    theirs = events.impacts(case(scenario), scenario.run.duration)
    twin = simulate(scenario, "rigid").impacts
    ours = np.stack([twin[name] for name in ("time_s", "flank", "velocity_m_s", "rebound_m_s")], axis=1)
    same = ours.shape == theirs.shape
    name = f"scipy restarted at events, e = {restitution}"
    yield Check(f"{name}: impacts missed or invented", abs(len(ours) - len(theirs)), 0)
    off = np.abs(ours - theirs).max(axis=0) if same else np.full(4, np.inf)
    yield Check(f"{name}: impact times off", float(off[0] / scenario.period), 1e-8, "period")
    yield Check(f"{name}: impact speeds off", float(off[2]), 1e-9, "m/s")


def _yielding(restitution: float, pulls: bool) -> Iterator[Check]:
    scenario = bench(20, 3, 250, restitution, 1)
    errors = yielding_errors(scenario, STIFFNESSES, pulls)
    name = f"spring and damper{' by eq. (20), may pull' if pulls else ', may not pull'}, e = {restitution}"
    yield Check(f"{name}: order in the stiffness", order(np.array(STIFFNESSES), errors), 0.45, at_least=True)
    drive = swing(scenario)
    passage = np.pi * np.sqrt(case(scenario).mass / max(STIFFNESSES))
    rebound = simulate(scenario, "rigid").impacts["rebound_m_s"][0]
    bound = float((drive.speed * drive.omega + drive.pull) * passage / abs(rebound))
    yield Check(f"{name}: speeds off at 1 N/nm; bound: what a passage adds to a rebound", errors[-1], bound)
