"""Oil films in the twin and in the engine against their laws.

The representative helical pair of a dual-clutch transmission with 10 mPa·s: the height at which it floats follows from
the laws alone; its fall back on it from a stiff integration of them that shares nothing with either model. Then the
published speed fluctuation of fig. 13, in which the pair rattles through its oil: the solids against the twin.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, pi, sin

import numpy as np

from gears3d.laws import film
from gears3d.scenario import Scenario, load
from gears3d.simulation import simulate
from gears3d.verification.validation.check import Check

PAIR = """
format = 1
title = "Representative helical pair 17/43 of a dual-clutch transmission"
[gears]
module = "2.75 mm"
pressure_angle = "20 deg"
helix_angle = "28 deg"
face_width = "16 mm"
drive = { teeth = 17 }
loose = { teeth = 43, inertia = "3.71e-3 kg m^2" }
[mount]
backlash = "0.13372 mm"
[motion]
mean = "1500 rpm"
[drag]
torque = "0.1 N m"
[run]
duration = "20 ms"
settle = "0 s"
[[effect]]
kind = "oil_film"
viscosity = "10 mPa s"
"""
SMALLEST = 1e-6  # Thickness of the film that the roughness leaves [m], the default of the effect


def along(scenario: Scenario, s: float, speed_drive: float, speed_loose: float) -> float:
    """Return the force of both films along the transverse line of action [N], from the laws of the normal section.

    Units: ``s`` [m]; ``speed_drive`` [rad/s]; ``speed_loose`` [rad/s].
    """
    rig = scenario.rig()
    angles, turn = (rig.working_pressure_angle, rig.base_helix_angle), cos(rig.base_helix_angle)
    rolling = (film.rolling_radius(radius, *angles) for radius in (rig.base_radius_drive, rig.base_radius_loose))
    u = sum(radius * speed for radius, speed in zip(rolling, (speed_drive, speed_loose), strict=True))
    velocity = rig.base_radius_loose * speed_loose - rig.base_radius_drive * speed_drive
    length = film.contact_length(rig.face_width, rig.contact_ratio, rig.base_helix_angle)
    radius = film.equivalent_radius(rig.base_radius_drive, rig.base_radius_loose, *angles)
    half = 0.5 * rig.backlash * turn
    force = film.mesh_film_force(half - s * turn, -velocity * turn, half, u, length, 0.01, radius, SMALLEST)
    return float(force) * turn


def check_film(quick: bool = False) -> Iterator[Check]:
    """Oil films in the twin and in the engine against their laws.

    The representative helical pair of a dual-clutch transmission with 10 mPa·s: the height at which it floats follows
    from the laws alone; its fall back on it from a stiff integration of them that shares nothing with either model.
    Then the published speed fluctuation of fig. 13, in which the pair rattles through its oil: the solids against the
    twin.
    """
    from scipy.integrate import solve_ivp
    from scipy.optimize import root_scalar

    scenario = load(PAIR)
    rig = scenario.rig()
    mean, ratio = rig.mean_speed, rig.base_radius_drive / rig.base_radius_loose
    load_ = rig.drag_torque / rig.base_radius_loose
    bracket = (1e-6, 0.4 * rig.backlash)
    floats = root_scalar(lambda s: along(scenario, s, mean, mean * ratio) - load_, bracket=bracket, xtol=1e-22).root
    found = simulate(scenario, "rigid").signals["displacement_m"]
    yield Check("height of the pair that floats on its film, off", float(np.abs(found / floats - 1).max()), 1e-9)
    yield Check("that film along the normal, off 6.4 um", abs(floats * cos(rig.base_helix_angle) - 6.4e-6), 1e-7, "m")

    swing = {"motion.harmonics": [{"amplitude": "300 rad/s^2", "frequency": "50 Hz"}], "start.state": "free"}
    falling = scenario.with_({**swing, "effect[0].viscosity": "100 mPa s"})
    done = simulate(falling, "rigid").signals
    omega = 100 * pi

    def right(t: float, y: np.ndarray) -> list[float]:
        drive = mean + 300 / omega * sin(omega * t)
        force = 10 * along(falling, y[0], drive, y[1])  # ten times the viscosity
        velocity = rig.base_radius_loose * y[1] - rig.base_radius_drive * drive
        return [velocity, (rig.base_radius_loose * force - rig.drag_torque * np.sign(y[1])) / rig.inertia]

    times, start = done["time_s"], [done["displacement_m"][0], done["omega_loose_rad_s"][0]]
    theirs = solve_ivp(right, (0, times[-1] + 1e-9), start, "Radau", times, rtol=1e-8, atol=[1e-14, 1e-11])
    off = float(np.abs(done["displacement_m"] - theirs.y[0]).max() / rig.backlash)
    yield Check("motion over 20 ms on a film of 0.1 Pa s against scipy's Radau", off, 1e-6, "backlash")
    solids = simulate(falling, "bullet").signals["displacement_m"]
    off = float(np.abs(solids - theirs.y[0]).max() / rig.backlash)
    yield Check("the same of helical solids in the engine against scipy's Radau", off, 1e-6, "backlash")
    yield from _rattling(scenario.with_({**swing, "start.state": "active", "run.duration": "0.1 s"}))


def _rattling(scenario: Scenario) -> Iterator[Check]:
    """Hold the engine's passages through the film against the twin's."""
    engine, twin = (simulate(scenario, model) for model in ("bullet", "rigid"))
    ours, theirs = engine.impacts, twin.impacts
    missed = abs(len(ours["time_s"]) - len(theirs["time_s"]))
    yield Check("passages of 0.1 s of fig. 13 that the engine misses or invents", float(missed), 0.0)
    count = min(len(ours["time_s"]), len(theirs["time_s"]))
    speed = np.abs(theirs["velocity_m_s"][:count])
    for name, what in (("velocity_m_s", "at the entry"), ("rebound_m_s", "at the exit")):
        off = np.abs(ours[name][:count] - theirs[name][:count]) / speed
        yield Check(f"speed {what} of these passages, engine off the twin", float(off.max(initial=0.0)), 1e-5)
    off = np.abs(engine.signals["displacement_m"] - twin.signals["displacement_m"]).max()
    yield Check("displacement in between, engine off the twin", float(off), 1e-9, "m")
