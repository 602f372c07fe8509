"""Rows on the run-downs of figs 8 to 10 of Kadmiri et al. 2012: trends, as no number is printed."""

from __future__ import annotations

from functools import partial
from math import pi
from typing import Any

import numpy as np

from gears3d.laws.churning import churning
from gears3d.laws.drag import couette, rundown
from gears3d.verification.papers.bench import Bench
from gears3d.verification.papers.claim import Claim

FOLDER = "kadmiri-2012"
claim = partial(Claim, paper=FOLDER)
NAME = f"{FOLDER}/fig10-rundown.toml"
TEMPERATURES = (30, 40, 50, 55)
"""Of fig. 10 [°C]."""
START = 750 * 19 / 37 * pi / 30
"""Speed at release [rad/s]."""


def viscosity(temperature: float) -> float:
    """Return the dynamic viscosity of the oil [Pa·s], through the printed 0.08 at 20 °C and 0.03 at 50 °C.

    Args:
        temperature: [°C].

    >>> round(viscosity(20.0), 6), round(viscosity(50.0), 6)
    (0.08, 0.03)
    """
    from gears3d.laws.film import density, kinematic_viscosity

    points = tuple((at, mu / float(density(870.0, at))) for at, mu in ((20.0, 0.08), (50.0, 0.03)))
    return float(density(870.0, temperature) * kinematic_viscosity((points[0], points[1]), temperature))


def added(version: int, temperature: float = 50.0) -> list[dict[str, Any]]:
    """Return the effects of an assembly version: 1 bearings, 2 and the shaft's shear, 3 and churning; sizes assumed.

    Args:
        version: 1, 2 or 3.
        temperature: of the oil [°C].
    """
    bearings = {"kind": "drag_viscous", "coefficient": "2e-4 N m s/rad"}
    thickness = viscosity(temperature)
    shear = float(couette(thickness, 0.025, 0.0225, 50e-6, 1.0))
    unit = float(churning(0.0548, 0.016, 0.0548, 2e-3, 860.0, thickness, 1.0))
    oil = {"kind": "drag_power", "coefficient": f"{unit!r} N m", "exponent": 0.59}
    return [bearings, {"kind": "drag_viscous", "coefficient": f"{shear!r} N m s/rad"}, oil][:version]


def curve(bench: Bench, version: int, temperature: float = 50.0) -> tuple[np.ndarray, np.ndarray]:
    """Return time [s] and speed [rad/s] of a simulated run-down.

    Args:
        bench: of the papers.
        version: of the assembly, 1 to 3.
        temperature: of the oil [°C].
    """
    from gears3d.lumped import rundown as alone

    def compute() -> tuple[np.ndarray, np.ndarray]:
        scenario = bench.scenario(NAME, {"effect": added(version, temperature)})
        signals = alone.rundown(scenario, speed=START).signals
        return signals["time_s"], signals["omega_loose_rad_s"]

    return bench.once(f"{FOLDER} rundown {version} {temperature}", compute)


def stop(bench: Bench, version: int, temperature: float = 50.0) -> float:
    """Return when the run-down ends [s].

    Args:
        bench: of the papers.
        version: of the assembly, 1 to 3.
        temperature: of the oil [°C].
    """
    time, speed = curve(bench, version, temperature)
    return float(time[speed > 0][-1])


def misfit(bench: Bench) -> float:
    """Return the rms distance of the first version's run-down from the best a + b·e^(−λt), over its start.

    Args:
        bench: of the papers.
    """
    from scipy.optimize import curve_fit

    time, speed = curve(bench, 1)
    moving = speed > 0
    law = lambda t, a, rate: rundown(a, START, rate, t)  # noqa: E731
    (a, rate), _ = curve_fit(law, time[moving], speed[moving], p0=(-10.0, 0.5))
    return float(np.sqrt(np.mean((law(time[moving], a, rate) - speed[moving]) ** 2)) / START)


def warmer(bench: Bench) -> str:
    """Return what warmer oil does to the time that the third version takes to stop.

    Args:
        bench: of the papers.
    """
    steps = np.diff([stop(bench, 3, temperature) for temperature in TEMPERATURES])
    return "longer" if (steps > 0).all() else "not longer"


CLAIMS = (
    claim(
        figure="fig. 8",
        quantity="run-down of the drained shaft against a + b exp(-lambda t), rms over the speed at release",
        published=0.0,
        tolerance=0.005,
        compute=misfit,
        basis="width of the plotted line",
        note="simulated with solid and viscous friction, whose sizes are assumed",
    ),
    claim(
        figure="fig. 9",
        quantity="time to stop with the shear at the shaft added",
        published="shorter",
        compute=lambda bench: "shorter" if stop(bench, 2) < stop(bench, 1) else "longer",
        note="eq. (8) with an assumed clearance; the printed viscosity at 50 degC",
    ),
    claim(
        figure="fig. 10",
        quantity="time to stop from 30 to 55 degC",
        published="longer",
        compute=warmer,
        note="eqs (8) and (10) with an oil of the printed 0.08 Pa s at 20 and 0.03 at 50 degC; sizes assumed",
    ),
)
"""Rows of figs 8 to 10."""
