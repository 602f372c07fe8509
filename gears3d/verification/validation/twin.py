"""The rigid twin against closed forms.

Plastic orbit (e = 0) of Rigaud & Perret-Liaudet 2020, eqs (17)-(19): times at which contact is lost and impact speeds
follow from four transcendental equations, solved here by bracketing; approach speeds after rebounds from the same
equations with e > 0, and the threshold from Λ = 1 (eq. 7).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gears3d.laws import crossing, loss_phases
from gears3d.scenario import Scenario
from gears3d.simulation import simulate
from gears3d.verification.validation.bench import fig5, swing
from gears3d.verification.validation.check import Check

CASES = {"20 rpm, 3 Hz, 250 um": (20, 3, 250), "5 rpm, 3 Hz, 250 um": (5, 3, 250), "4 rpm, 10 Hz, 200 um": (4, 10, 200)}


def plastic(amplitude: int, frequency: int, backlash: int) -> Scenario:
    """Return figure 5 with perfectly plastic impacts.

    Units: ``amplitude`` [rpm].
    """
    harmonics = [{"amplitude": f"{amplitude} rpm", "frequency": f"{frequency} Hz"}]
    overrides = {"impact.restitution": 0.0, "mount.backlash": f"{backlash} um", "motion.harmonics": harmonics}
    return fig5().with_({**overrides, "run.duration": f"{2.2 / frequency} s"})


def orbit(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and approach speeds [m/s] of reverse and active impact in the plastic orbit's first period."""
    drive = swing(scenario)
    phases = loss_phases(drive.excitation)
    gaps = (scenario.rig().backlash, -scenario.rig().backlash)
    hits = [crossing(drive.speed, drive.omega, drive.pull, phase, gap) for phase, gap in zip(phases, gaps, strict=True)]
    return np.array([hit[0] for hit in hits]), np.array([hit[1] for hit in hits])


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    for name, case in CASES.items():
        scenario = plastic(*case)
        times, speeds = orbit(scenario)
        impacts = simulate(scenario, "rigid").impacts
        off = float(np.abs(impacts["time_s"][:2] - times).max() / scenario.period)
        yield Check(f"plastic orbit, {name}: impact times off", off, 1e-8, "period")
        yield Check(
            f"plastic orbit, {name}: impact speeds off",
            float(np.abs(impacts["velocity_m_s"][:2] / speeds - 1).max()),
            1e-8,
        )
    for excitation, expected in ((0.999, 0), (1.001, 1)):
        scenario = threshold(excitation)
        count = len(simulate(scenario, "rigid").impacts["time_s"])
        yield Check(
            f"excitation {excitation}: impacts in a period {'none' if not expected else 'some'}: wrong",
            float((count > 0) != bool(expected)),
            0,
        )


def threshold(excitation: float) -> Scenario:
    """Return figure 5 at a given excitation Λ = J·ω·ΔΩ/Td (Rigaud & Perret-Liaudet 2020, eq. 7)."""
    rig = fig5().rig()
    amplitude = excitation * rig.drag_torque / rig.inertia / (2 * np.pi * 3.0)
    return fig5().with_({"motion.harmonics": [{"amplitude": f"{amplitude!r} rad/s", "frequency": "3 Hz"}]})
