"""The measures that published rows share: each takes a case and returns a value in SI units, or a word.

A measure whose first parameter is ``cases`` takes all cases of its row together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, sqrt
from typing import Any

import numpy as np

from gears3d.verification.papers.bench import Case

MEASURES: dict[str, Callable[..., Any]] = {}
REDUCTIONS: dict[str, Callable[[Sequence[Any]], Any]] = {}


def measure(function: Callable[..., Any]) -> Callable[..., Any]:
    """Make a function available to rows by its name."""
    MEASURES[function.__name__] = function
    return function


def reduction(function: Callable[[Sequence[Any]], Any]) -> Callable[[Sequence[Any]], Any]:
    """Make a function available to rows as ``over``."""
    REDUCTIONS[function.__name__] = function
    return function


@reduction
def trend(values: Sequence[float]) -> str:
    """Return how values change on the whole: at every step, or but for some steps back.

    >>> trend([1.0, 2.0, 3.0]), trend([3.0, 2.0, 2.5, 1.0]), trend([1.0, 2.0, 1.0])
    ('rises', 'falls on the whole', 'neither')
    """
    v = np.asarray(values, float)
    steps = np.diff(v)
    if (steps > 0.0).all() or (steps < 0.0).all():
        return "rises" if steps[0] > 0.0 else "falls"
    slope = np.corrcoef(np.arange(len(v)), v)[0, 1] if np.ptp(v) > 0.0 else 0.0
    return f"{'rises' if slope > 0.0 else 'falls'} on the whole" if abs(slope) > 0.6 else "neither"


@reduction
def all_repeat(motions: Sequence[str]) -> str:
    """Return ``"repeats"`` if all motions do, else how many of them."""
    many = motions.count("repeats")
    return "repeats" if many == len(motions) else f"repeats at {many} of {len(motions)}"


@reduction
def relative_change(values: Sequence[float]) -> float:
    """Return the change from the last value to the first, over the last."""
    return values[0] / values[-1] - 1.0


@measure
def outcome(case: Case, of: str) -> float | str:
    """Return an entry of the run's summary."""
    found = case.outcome[of]
    return found if isinstance(found, int | float) else str(found)


@measure
def repetition(case: Case) -> str:
    """Return ``"repeats"`` if the motion does after whatever number of periods, else its name."""
    name = case.outcome["motion"]
    return "repeats" if name is None or name.endswith("T") else name


@measure
def strongest_line(case: Case, begin: float, end: float) -> float:
    """Return the frequency of the strongest line of the displacement between two times [Hz]."""
    run = case.run.between(begin, end)
    place = run.signals["displacement_m"]
    amplitude = np.abs(np.fft.rfft((place - place.mean()) * np.hanning(len(place))))
    return float(np.fft.rfftfreq(len(place), run.time[1] - run.time[0])[int(np.argmax(amplitude))])


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
