"""The generator beside the twin: two programs that share no equation of motion."""

import numpy as np

from gears3d.scenario import load
from gears3d.simulation import simulate
from gears3d.verification.challenge import happen

RATTLE = "scenarios/rigaud-2020/fig5-20rpm.toml"
SPRING = {"kind": "tooth_compliance", "stiffness": "50000 N/m", "damping": "50 N s/m"}

CASES = {
    "transmission_error": {"order": 3, "amplitude": "50 um", "phase": "40 deg"},
    "transmission_error, one flank of the loose gear": {
        "order": 3,
        "amplitude": "50 um",
        "phase": "40 deg",
        "gear": "loose",
        "flank": "active",
    },
    "backlash_offset": {"offset": "50 um"},
    "backlash_variation": {"amplitude": "50 um", "order": 2, "phase": "10 deg"},
    "drag_coulomb": {"torque": "0.05 N m"},
    "drag_viscous": {"coefficient": "0.03 N m s/rad"},
    "drag_power": {"coefficient": "0.01 N m", "exponent": 1.5},
    "drag_differential": {"coefficient": "0.01 N m s/rad", "shaft_speed": "100 rpm"},
    "drag_position": {"amplitude": "0.08 N m", "order": 5, "phase": "10 deg"},
    "drag_drift": {"relative_change": -0.4, "time_constant": "1 s"},
    "mesh_drag": {"coefficient": "0.03 N m s/rad"},
    "mesh_friction": {"coefficient": 0.2},
    "restitution_offset": {"offset": 0.2},
    "restitution_speed": {"slope": "5 s/m"},
    "restitution_asymmetry": {"asymmetry": 0.2},
    "drive_motion": {"amplitude": "2 rpm", "frequency": "7 Hz", "phase": "20 deg"},
    "drive_motion, an angle by order": {"amplitude": "0.5 deg", "order": 3, "phase": "20 deg"},
}
"""Kinds that both programs have in the same words; what follows them after a comma tells cases of a kind apart."""


def rattle(effects, duration="2 s", base=RATTLE, **more):
    return load(base, {"run.duration": duration, "run.settle": "0 s", **more, "effect": effects})


def beside(scenario, **how):
    """Return both recordings of a scenario: the generator's and the twin's."""
    return happen(scenario, **how), simulate(scenario, model="rigid")


def differences(ours, theirs, least=1e-4):
    """Return the largest differences in time [s], velocity [m/s], rebound [m/s] and impulse [N·s] of all impacts."""
    tables = []
    for recording in (ours, theirs):
        hard = np.abs(recording.impacts["velocity_m_s"]) > least
        tables.append({name: values[hard] for name, values in recording.impacts.items()})
    a, b = tables
    assert len(a["time_s"]) == len(b["time_s"])
    assert (a["flank"] == b["flank"]).all()
    names = ("time_s", "velocity_m_s", "rebound_m_s", "impulse_N_s")
    return {name: float(np.abs(a[name] - b[name]).max()) for name in names}


def apart(ours, theirs):
    """Return the largest distance of the two displacements [m]."""
    return float(np.abs(ours.signals["displacement_m"] - theirs.signals["displacement_m"]).max())
