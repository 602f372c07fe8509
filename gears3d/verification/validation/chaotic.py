"""The chaotic case, bright steel on the bench of fig. 5 of Rigaud & Perret-Liaudet 2020: engine and twin by statistics.

Two right simulations of it part after a few impacts, so their impacts are held by distribution, with the change of
speeds that these would have shown nine times in ten. The rate of impacts and their mean speed drift for minutes, which
one run cannot tell from a difference: they are held over several runs from different phases of the drive.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import ttest_ind

from gears3d.comparison import compare
from gears3d.recording import Recording
from gears3d.scenario import Scenario, load
from gears3d.scenario.document import shipped
from gears3d.signals import window
from gears3d.simulation import simulate
from gears3d.verification.validation.check import Check

CASE = "fig. 5 at e = 0.95"
# So long that distributions distinguish speeds by less than 10 %
BRIGHT = {"impact.restitution": 0.95, "run.duration": "160 s", "run.settle": "3 s", "run.output_rate": "1 kHz"}
# Of the drive at the start of a run [deg]; chosen before any of them was run
PHASES = (11, 56, 101, 146, 191, 236, 281, 326)
SENSITIVE = 0.1  # Relative change of the speeds that distributions must be able to show
HEIGHT = 0.05e-6  # Impacts count after higher flights [m]
CONFIDENCE = 0.99
WIDTH = 0.01  # Half the interval of a ratio of means: a difference twice as large is found nine times in ten and more


def bright(phase: float) -> Scenario:
    """Return the scenario with the drive at a phase.

    Units: ``phase`` [deg].

    >>> bright(90).motion.harmonics[0].phase
    1.5707963267948966
    """
    return load(shipped() / "rigaud-2020" / "fig5-20rpm.toml", {**BRIGHT, "motion.harmonics[0].phase": f"{phase} deg"})


def summary(run: Recording) -> tuple[float, float]:
    """Return how many impacts there are in a second and their mean speed [m/s]."""
    begin, end = window(run.signals, run.meta)
    time = run.impacts["time_s"]
    kept = (time >= begin) & (time <= end) & (run.impacts["flight_height_m"] > HEIGHT)
    return kept.sum() / (end - begin), float(np.abs(run.impacts["velocity_m_s"][kept]).mean())


def ratio(one: ArrayLike, other: ArrayLike) -> tuple[float, float]:
    """Return the interval of the ratio of two means (Welch 1947, of logarithms: the runs differ by little).

    Shapes: ``one`` (n,); ``other`` (m,).

    >>> [round(float(end), 2) for end in ratio(np.array([1.0, 1.1, 0.9]), np.array([2.0, 2.2, 1.8]))]
    [0.34, 0.73]
    """
    found = ttest_ind(np.log(one), np.log(other), equal_var=False).confidence_interval(CONFIDENCE)
    return float(np.exp(found.low)), float(np.exp(found.high))


def chaotic_claims() -> Iterator[Check]:
    """Give the checks of the chaotic case."""
    runs = [(simulate(bright(phase)), simulate(bright(phase), "rigid")) for phase in PHASES]
    yield from of_distributions(*runs[0])
    said = [[summary(run) for run in models] for models in zip(*runs, strict=True)]
    about = f"{CASE}, {len(PHASES)} runs"
    for name, engine, twin in zip(
        ("impact rates", "mean speeds"), *(zip(*one, strict=True) for one in said), strict=True
    ):
        low, high = ratio(list(engine), list(twin))
        yield Check(f"{about}: half the 99 % interval of the ratio of {name}", (high - low) / 2, WIDTH)
        yield Check(f"{about}: one lies off the interval of the ratio of {name}", float(not low <= 1.0 <= high), 0)


def of_distributions(engine: Recording, twin: Recording) -> Iterator[Check]:
    """Give the checks of one run and its reference by distribution."""
    found = compare(engine, twin, flight_height_min=HEIGHT)
    yield Check(f"{CASE}: impacts compared as distributions", found.impacts_compared, 1000, at_least=True)
    yield Check(f"{CASE}: not chaotic", float(found.mode != "distribution"), 0)
    yield Check(f"{CASE}: distributions that differ", sum(one.different for one in found.tests), 0)
    speeds = [one for one in found.tests if one.quantity.endswith("speed")]
    yield Check(f"{CASE}: distributions of speeds tested", len(speeds), 2, at_least=True)
    least = max((one.detectable or 1.0 for one in speeds), default=1.0)
    yield Check(f"{CASE}: change of speeds that would have been found nine times in ten", least, SENSITIVE)
