"""Helical gears in the engine: lines of contact, ratio and thrust are those of geometry, impacts those of the twin."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, pi, tan

import numpy as np

from gears3d.comparison import compare
from gears3d.engine import Bench
from gears3d.engine.lines import facing
from gears3d.engine.mesh import meshed
from gears3d.gears import contact_lines
from gears3d.recording import Recording
from gears3d.scenario import Scenario
from gears3d.simulation import simulate
from gears3d.verification.validation.bench import fig5
from gears3d.verification.validation.check import Check

# Unequal teeth with profile shifts
UNEQUAL = {
    "gears.module": "3 mm",
    "gears.helix_angle": "25 deg",
    "gears.face_width": "14 mm",
    "gears.drive.teeth": 19,
    "gears.loose.teeth": 31,
    "gears.drive.profile_shift": 0.3,
    "gears.loose.profile_shift": -0.2,
}
TWIN = {"gears.helix_angle": "25 deg"}  # The bench of figure 5 with helical teeth


def ratio_off(scenario: Scenario) -> float:
    """Return how far the displacement of resting gears is off a constant on either flank, over a turn [m]."""
    pair = scenario.pair()
    times = np.linspace(0.0, 2.0 * pi / scenario.motion.mean, 400)
    off = 0.0
    with Bench(scenario) as bench:
        drive = np.array([bench.drive(time)[0] for time in times])
        for side, place in ((0, 0.0), (1, pair.backlash)):
            moved = pair.loose.base_radius * bench.rest(side, times) - pair.drive.base_radius * drive
            off = max(off, float(np.abs(moved - place).max()))
    return off


def lines_off(scenario: Scenario) -> float:
    """Return how far the engine's lines of contact end off those of the plane of action, along the face [m]."""
    pair, off = scenario.pair(), 0.0
    mesh = meshed(pair)
    for theta in np.linspace(0.0, 2.0 * pi, 97):
        for side, flank in enumerate(("active", "reverse")):
            lines = contact_lines(pair, float(theta), flank)
            loose = (pair.drive.base_radius * theta + side * pair.backlash) / pair.loose.base_radius
            for teeth, points in zip(lines.teeth, lines.points, strict=True):
                both = (int(teeth[0]), int(teeth[1]))
                found = facing(mesh.edged, mesh.along, (float(theta), loose), both, side, 0.0)[:2]
                off = max(off, float(np.abs(np.array(found) - np.sort(points[:, 2])).max()))
    return off


def thrust_off(made: Recording, scenario: Scenario) -> float:
    """Return how far axial over tangential impulse is off the tangent of the helix angle, relative."""
    pair, hits = scenario.pair(), made.impacts
    mass = scenario.rig().inertia / pair.loose.base_radius**2
    tangential = mass * (hits["rebound_m_s"] - hits["velocity_m_s"]) * cos(pair.working_pressure_angle)
    return float(np.abs(np.abs(hits["axial_impulse_N_s"] / tangential) / tan(pair.drive.helix_angle) - 1.0).max())


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    unequal = fig5(motion__harmonics=[]).with_({**UNEQUAL, "run.duration": "1 s"})
    yield Check("19:31 with shifts, 25 deg: ratio off a constant, over a turn", ratio_off(unequal), 1e-7, "m")
    yield Check("19:31 with shifts, 25 deg: ends of lines of contact off", lines_off(unequal), 1e-9, "m")
    for restitution in (0.3,) if quick else (0.3, 0.7):
        scenario = fig5(impact__restitution=restitution).with_(TWIN)
        made = simulate(scenario)
        found = compare(made, simulate(scenario, "rigid"), flight_height_min=0.05e-6).to_dict()
        case = f"90:90, 25 deg, e = {restitution}"
        yield Check(f"{case}: impacts missed or invented", found["impacts_missed"] + found["impacts_invented"], 0)
        yield Check(f"{case}: impacts compared", found["impacts_compared"], 12, at_least=True)
        yield Check(f"{case}: impact speed, median error", found["velocity_error_median"], 0.005)
        yield Check(f"{case}: impact speed, 95 % of the errors", found["velocity_error_p95"], 0.015)
        yield Check(f"{case}: axial over tangential impulse off", thrust_off(made, scenario), 0.01)
