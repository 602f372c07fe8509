"""Eccentric teeth: the engine turns real ones, the twin has their first order, both stand against closed forms.

The teeth's axis stands off the axis of rotation. Each flank then touches elsewhere by the offset's part along its
normal, and the backlash changes by twice the offset's part towards the mate times sin αw; the remainder is of second
order, the offset squared over the length of the path of contact.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gears3d.gears import Eccentricity, Pair, quasi_static
from gears3d.recording import Recording
from gears3d.simulation import simulate
from gears3d.verification.validation.bench import fig5
from gears3d.verification.validation.check import Check

OFFSET, PHASE = 40e-6, 0.6  # m and rad


def resting(model: str, gear: str, flank: str) -> Recording:
    """Run a turn at constant speed with the loose gear resting on one flank."""
    effect = {"kind": "eccentricity", "gear": gear, "offset": f"{OFFSET} m", "phase": f"{PHASE} rad"}
    mean = "60 rpm" if flank == "active" else "-60 rpm"
    scenario = fig5(motion__harmonics=[], motion__mean=mean, drag__torque="5 N m", start__state=flank)
    changes = {"effect": [effect], "run.duration": "1 s", "run.output_rate": "200 Hz"}
    return simulate(scenario.with_(changes), model)


def first_order(pair: Pair, gear: str, flank: str, theta: np.ndarray) -> np.ndarray:
    """Return the displacement at which a flank touches, to the first order of the offset [m].

    Units: ``theta`` [rad], (n,).
    """
    sense = 1.0 if gear == "drive" else -1.0
    lean = sense * pair.working_pressure_angle * (1.0 if flank == "active" else -1.0)
    moved = sense * OFFSET * np.sin(theta + PHASE + lean)
    return moved if flank == "active" else pair.backlash + moved


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    pair = fig5().pair()
    second = OFFSET**2 / pair.path_length
    for gear in ("drive",) if quick else ("drive", "loose"):
        for flank in ("active", "reverse"):
            case = f"{gear} 40 um eccentric, {flank} flank"
            engine, twin = (resting(model, gear, flank).signals for model in ("bullet", "rigid"))
            for name, signals in (("engine", engine), ("twin", twin)):
                off = signals["displacement_m"] - first_order(pair, gear, flank, signals[f"theta_{gear}_rad"])
                yield Check(f"{case}: {name} off the first order", float(np.abs(off).max()), second, "m")
            exact = quasi_static(pair.with_mounting(Eccentricity(gear, OFFSET, PHASE)), engine["theta_drive_rad"])
            there = exact.phi_active if flank == "active" else exact.phi_reverse + pair.backlash
            off = float(np.abs(engine["displacement_m"] - there).max())
            yield Check(f"{case}: engine off the surfaces rolled without load", off, 1e-11, "m")
