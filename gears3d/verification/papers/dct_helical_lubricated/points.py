"""The operating points of the lubricated dual-clutch transmission and what is read off their runs."""

from __future__ import annotations

from functools import partial
from math import cos, sqrt
from typing import Any

import numpy as np

from gears3d.verification.papers.bench import Bench
from gears3d.verification.papers.claim import Claim

FOLDER = "dct-helical-lubricated"
CASE = f"{FOLDER}/fig13.toml"
claim = partial(Claim, paper=FOLDER, model="lubricated")
GEOMETRY = "on a representative pair: the paper prints neither geometry nor inertia"


def point(
    frequency: float = 50.0,
    acceleration: float = 300.0,
    drag: float = 0.1,
    viscosity: float = 0.01,
    backlash: float = 133.72,
    periods: int = 150,
) -> dict[str, Any]:
    """Return the changes of the base case that make a point; 50 periods are left to settle.

    Args:
        frequency: of the drive [Hz].
        acceleration: amplitude of the drive's [rad/s²].
        drag: torque on the loose gear [N·m].
        viscosity: [Pa·s].
        backlash: along the transverse line of action [µm]; that of the base case is 0.12 mm along the normal.
        periods: that are simulated.

    >>> point(drag=0.3)["drag.torque"]
    '0.3 N m'
    """
    return {
        "motion.harmonics": [{"amplitude": f"{acceleration:g} rad/s^2", "frequency": f"{frequency:g} Hz"}],
        "drag.torque": f"{drag:g} N m",
        "effect[0].viscosity": f"{viscosity:g} Pa s",
        "mount.backlash": f"{backlash:g} um",
        "run.duration": f"{periods / frequency!r} s",
    }


def seen(bench: Bench, quantity: str, **where: Any) -> Any:
    """Return one of the numbers that a point's run is described by.

    Args:
        bench: of the papers.
        quantity: as in ``summary.json``.
        where: what :func:`point` takes.
    """
    return bench.outcome(CASE, point(**where), "lubricated")[quantity]


def motion(bench: Bench, **where: Any) -> str:
    """Return whether a motion ``"repeats"``, and what it is called if not.

    Args:
        bench: of the papers.
        where: what :func:`point` takes.
    """
    name = seen(bench, "motion", **where)
    return "repeats" if name is None or name.endswith("T") else name


def all_repeat(bench: Bench, *points: dict[str, float]) -> str:
    """Return ``"repeats"`` if the motion does at all points, else at how many.

    Args:
        bench: of the papers.
        points: what :func:`point` takes.
    """
    found = [motion(bench, **where) for where in points]
    many = found.count("repeats")
    return "repeats" if many == len(found) else f"repeats at {many} of {len(found)}"


def swept(bench: Bench, friction: str = "lines", **where: Any) -> tuple[float, float, float]:
    """Return rattle index [N/(s·kg·m²)], Rdte [m] and Odte over time [m/s] of a point, over 40 periods after 40.

    Args:
        bench: of the papers.
        friction: ``lubricated.friction`` of the scenario.
        where: what :func:`point` takes.
    """
    from gears3d.lumped.lubricated import error_indices
    from gears3d.lumped.lubricated.model import pack
    from gears3d.lumped.run import run

    def compute() -> tuple[float, float, float]:
        bench.breathe()
        scenario = bench.scenario(CASE, {**point(**where, periods=80), "lubricated.friction": friction})
        rig, period = scenario.rig(), scenario.period
        spacing = period / 400.0
        m = pack(scenario)._replace(settle=40 * period, tolerance=1e-6)
        outcome = run(m, 80 * period, spacing)
        tilt = cos(rig.base_helix_angle)
        later = outcome.samples[outcome.samples[:, 0] > 40 * period]
        error = (0.5 * rig.backlash - later[:, 5]) * tilt
        return sqrt(outcome.jerk) / tilt / rig.inertia, *error_indices(error, spacing)

    return bench.once(f"{FOLDER} swept {friction} {sorted(where.items())}", compute)


def trend(values: Any) -> str:
    """Return how values go on the whole: at each step, or but for some steps back.

    Args:
        values: in order.

    >>> trend([1.0, 2.0, 3.0]), trend([3.0, 2.0, 2.5, 1.0]), trend([1.0, 2.0, 1.0])
    ('rises', 'falls on the whole', 'neither')
    """
    v = np.asarray(values, float)
    steps = np.diff(v)
    if (steps > 0.0).all() or (steps < 0.0).all():
        return "rises" if steps[0] > 0.0 else "falls"
    slope = np.corrcoef(np.arange(len(v)), v)[0, 1] if np.ptp(v) > 0.0 else 0.0
    return f"{'rises' if slope > 0.0 else 'falls'} on the whole" if abs(slope) > 0.6 else "neither"
