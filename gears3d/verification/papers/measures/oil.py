"""Oil and drag: indices of the lubricated model, rebound through a film, coast-downs and their drag."""

from __future__ import annotations

from math import cos, pi, sqrt
from typing import Any

import numpy as np

from gears3d.laws import drag, film
from gears3d.laws.churning import churning
from gears3d.laws.contact import equivalent_mass
from gears3d.verification.papers.bench import Case
from gears3d.verification.papers.measures.registry import measure

SOFT = 2.6e6  # stiffness of the flanks that fits the printed duration of impacts, Kadmiri et al. 2012, fig. 6 [N/m]
FILM, ROUGHNESS = 50e-6, 1e-6  # assumed for a fall through an oil film [m]
ENCODER = 0.6  # printed drag of the encoder in the measured assembly, Kadmiri et al. 2012 [N·m]
START = 750 * 19 / 37 * pi / 30  # speed of the loose gear at release, Kadmiri et al. 2012, figs 8 to 10 [rad/s]
SHEAR = (0.025, 0.0225, 50e-6)  # length, radius and clearance of the bearing of the loose gear, assumed [m]
PINION = (
    0.0548,
    0.016,
    0.0548,
    2e-3,
    860.0,
)  # radius, width, depth [m], oil [m³], density [kg/m³] of eq. (10), assumed


@measure
def lubricated_index(case: Case, of: str) -> float:
    """Return the index ``rattle`` [N/(s·kg·m²)], ``rdte`` [m] or ``odte`` [m/s], over 40 periods after 40."""
    from gears3d.lumped.lubricated import error_indices
    from gears3d.lumped.lubricated.model import pack
    from gears3d.lumped.run import run

    def compute() -> tuple[float, float, float]:
        case.bench.breathe()
        scenario = case.with_({"run.duration": "80 periods"}).scenario
        rig, period = scenario.rig(), scenario.period
        spacing = period / 400.0
        outcome = run(pack(scenario)._replace(settle=40 * period, tolerance=1e-6), 80 * period, spacing)
        tilt = cos(rig.base_helix_angle)
        later = outcome.samples[outcome.samples[:, 0] > 40 * period]
        error = (0.5 * rig.backlash - later[:, 5]) * tilt
        return sqrt(outcome.jerk) / tilt / rig.inertia, *error_indices(error, spacing)

    return case.once("lubricated indices", compute)[("rattle", "rdte", "odte").index(of)]


@measure
def film_rebound(case: Case, velocity: float, viscosity: float, rolling: float = 0.0) -> float:
    """Return the coefficient of restitution of a fall through an oil film onto an elastic, rough flank."""
    from scipy.integrate import solve_ivp

    rig = case.rig
    mass = equivalent_mass(rig.inertia, rig.base_radius_loose)
    length = film.contact_length(rig.face_width, rig.contact_ratio, rig.base_helix_angle)
    radius = film.equivalent_radius(
        rig.base_radius_drive, rig.base_radius_loose, rig.working_pressure_angle, rig.base_helix_angle
    )

    def fall(_: float, state: np.ndarray) -> list[float]:
        height, speed = state
        oil = film.film_force(height, speed, rolling, length, viscosity, radius, ROUGHNESS)
        return [speed, (float(oil) + SOFT * max(0.0, ROUGHNESS - height)) / mass]

    def away(_: float, state: np.ndarray) -> float:
        return state[0] - FILM - ROUGHNESS

    away.terminal, away.direction = True, 1.0  # type: ignore[attr-defined]
    flown: Any = solve_ivp(fall, (0.0, 0.1), [FILM, -velocity], events=away, rtol=1e-8, atol=1e-12, max_step=2e-5)
    return float(flown.y_events[0][0][1]) / velocity if len(flown.y_events[0]) else 0.0


@measure
def modelled_drag(case: Case, law: str) -> float:
    """Return the drag at the loose gear's mean speed by ``assembly`` (encoder, eqs 8 and 10) or ``disc`` (9) [N·m]."""
    speed = case.rig.mean_speed_loose
    if law == "disc":
        return float(drag.seetharaman_sides(0.115, 860.0, 0.03, speed))
    oil = churning(*PINION, 0.03, speed)
    return float(drag.assembly([drag.coulomb(ENCODER, speed), drag.couette(0.03, *SHEAR, speed), oil]))


def viscosity(temperature: float) -> float:
    """Return the dynamic viscosity of the oil [Pa·s], through the printed 0.08 at 20 °C and 0.03 at 50 °C.

    >>> round(viscosity(20.0), 6), round(viscosity(50.0), 6)
    (0.08, 0.03)
    """
    from gears3d.laws.film import density, kinematic_viscosity

    points = tuple((at, mu / float(density(870.0, at))) for at, mu in ((20.0, 0.08), (50.0, 0.03)))
    return float(density(870.0, temperature) * kinematic_viscosity((points[0], points[1]), temperature))


def assembly(version: int, temperature: float = 50.0) -> list[dict[str, Any]]:
    """Return the effects of an assembly: 1 bearings, 2 with the shaft's shear, 3 with churning; sizes assumed."""
    thickness = viscosity(temperature)
    shear, oil = float(drag.couette(thickness, *SHEAR, 1.0)), float(churning(*PINION, thickness, 1.0))
    return [
        {"kind": "drag_viscous", "coefficient": "2e-4 N m s/rad"},
        {"kind": "drag_viscous", "coefficient": f"{shear!r} N m s/rad"},
        {"kind": "drag_power", "coefficient": f"{oil!r} N m", "exponent": 0.59},
    ][:version]


def coastdown(case: Case, version: int, temperature: float = 50.0) -> tuple[np.ndarray, np.ndarray]:
    """Return time [s] and speed [rad/s] of the loose gear's simulated coast-down from its mean speed."""
    from gears3d.lumped.rig_tests import rundown

    def compute() -> tuple[np.ndarray, np.ndarray]:
        scenario = case.with_({"effect": assembly(version, temperature)}).scenario
        signals = rundown(scenario, speed=START).signals
        return signals["time_s"], signals["omega_loose_rad_s"]

    return case.once(f"coast-down {version} {temperature}", compute)


@measure
def coastdown_time(case: Case, version: int, temperature: float = 50.0) -> float:
    """Return when the coast-down ends [s]."""
    time, speed = coastdown(case, version, temperature)
    return float(time[speed > 0][-1])


@measure
def coastdown_misfit(case: Case, version: int) -> float:
    """Return the rms distance of the coast-down from the best a + b·e^(−λt), over its initial speed."""
    from scipy.optimize import curve_fit

    time, speed = coastdown(case, version)
    moving, start = speed > 0, speed[0]

    def law(t: np.ndarray, asymptote: float, rate: float) -> np.ndarray:
        return drag.rundown(asymptote, start, rate, t)

    (asymptote, rate), _ = curve_fit(law, time[moving], speed[moving], p0=(-10.0, 0.5))
    return float(np.sqrt(np.mean((law(time[moving], asymptote, rate) - speed[moving]) ** 2)) / start)
