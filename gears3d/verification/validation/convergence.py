"""The step of the engine: the order of its error, the error that half the step tells, and the books of work.

Under constant torques flights are parabolas and nothing depends on the step. Here the torque varies with the loose
gear's angle and grows with its speed. A flight shorter than the step is a single one, at any step: the order
shows where flights are longer, so it is the median over the impacts.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gears3d.engine import simulate
from gears3d.recording import Recording
from gears3d.scenario import Scenario
from gears3d.verification.validation.bench import fig5
from gears3d.verification.validation.check import Check

AMPLITUDE, ORDER, VISCOUS = 0.6, 36, 0.05  # N m, per revolution of the loose gear, N m s/rad
EFFECTS = [
    {"kind": "drag_position", "amplitude": f"{AMPLITUDE} N m", "order": ORDER},
    {"kind": "drag_viscous", "coefficient": f"{VISCOUS} N m s/rad"},
]
STEP = 5e-4  # s


def bench(duration: float) -> Scenario:
    """Return figure 5 with torques that change all the time.

    Units: ``duration`` [s].
    """
    rate = {"run.output_rate": "20 kHz", "impact.restitution": 0.5}
    return fig5().with_({"effect": EFFECTS, "run.duration": f"{duration} s", **rate})


def work_off(made: Recording, scenario: Scenario) -> float:
    """Return how far the works on the loose gear are off its kinetic energy, in parts of what impacts and drag take.

    In flight drag takes energy, at an impact the drive gives some and the flanks lose some; stretches of permanent
    contact are left out.
    """
    rig, signals, hits = scenario.rig(), made.signals, made.impacts
    time, omega, theta = signals["time_s"], signals["omega_loose_rad_s"], signals["theta_loose_rad"]
    torque = rig.drag_torque * np.sign(omega) + VISCOUS * omega + AMPLITUDE * np.cos(ORDER * theta)
    drag = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * ((torque * omega)[1:] + (torque * omega)[:-1]))])
    energy = 0.5 * rig.inertia * omega**2
    mass = rig.inertia / rig.base_radius_loose**2
    flank = rig.base_radius_drive * np.interp(hits["time_s"], time, signals["omega_drive_rad_s"])
    before, after = hits["velocity_m_s"], hits["rebound_m_s"]
    given, lost = hits["impulse_N_s"] * flank, 0.5 * mass * (before**2 - after**2)
    resting = np.array(made.meta["contacts"]).reshape(-1, 3)
    free = [0.0, *resting[:, 1:].ravel(), time[-1]]
    off, taken = 0.0, 0.0
    for start, end in zip(free[::2], free[1::2], strict=True):
        first, last = np.searchsorted(time, (start, end)) + np.array([1, -1])
        if last <= first:
            continue
        some = (hits["time_s"] > time[first]) & (hits["time_s"] <= time[last])
        spent = float(lost[some].sum()) + drag[last] - drag[first]
        off += abs(float(given[some].sum()) - spent - (energy[last] - energy[first]))
        taken += abs(spent)
    return float(off / taken)


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    scenario = bench(0.4)
    exact = _speeds(simulate(scenario, step=STEP / 8))
    coarse, fine = simulate(scenario, step=STEP, error_estimate=True), simulate(scenario, step=STEP / 2)
    errors = [np.abs(_speeds(run) - exact) for run in (coarse, fine)]
    name = "torque over angle and speed: order of the error of impact speeds"
    yield Check(name, float(np.median(np.log2(errors[0] / errors[1]))), 3.7, at_least=True)
    told = coarse.meta["error_estimate"]["impact_velocity_m_s"]
    yield Check(
        "step of 0.5 ms: that error, estimated with half the step, off the true one",
        abs(told / errors[0].max() - 1.0),
        0.1,
    )
    usual = simulate(scenario, error_estimate=True).meta["error_estimate"]
    yield Check("the step that is chosen: error of the displacement, told", usual["displacement_m"], 1e-10, "m")
    yield Check("the step that is chosen: error of an impact speed, told", usual["impact_velocity_m_s"], 1e-7, "m/s")
    long = bench(2.0)
    yield Check("work of drive, drag and impacts off the kinetic energy", work_off(simulate(long), long), 0.005)


def _speeds(made: Recording) -> np.ndarray:
    return made.impacts["velocity_m_s"]
