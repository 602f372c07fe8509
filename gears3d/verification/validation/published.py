"""Published cases in the engine against the twin: figures of Rigaud & Perret-Liaudet, and the helical pair of Kadmiri.

Figures 5, 6, 8 and 10 to 12 of Rigaud & Perret-Liaudet 2020 run as they are shipped, those of fig. 12 with their
transmission error; the pair 19:37 of Kadmiri et al. 2012 at the four speeds of its table 1, swinging at Λ = 1.5, 3
and 6. Each is held impact by impact against the twin; the chaotic case on the bench of fig. 5 by statistics.
"""

from __future__ import annotations

from collections.abc import Iterator

from gears3d.comparison import Comparison, compare
from gears3d.scenario import Scenario, load
from gears3d.scenario.document import shipped
from gears3d.simulation import simulate
from gears3d.simulation.excitation import assess
from gears3d.verification.validation.chaotic import chaotic_claims
from gears3d.verification.validation.check import Check

# Of Rigaud & Perret-Liaudet 2020
FIGURES = (
    *(f"fig5-{speed}rpm" for speed in ("0", "1.6", "5", "20")),
    *(f"fig6-{frequency}Hz" for frequency in ("0.7", "1", "3", "5", "10")),
    *("fig8", "fig10", "fig11", "fig12-0rpm", "fig12-1.6rpm-3Hz", "fig12-20rpm-3Hz"),
    *(f"fig12-5rpm-{frequency}Hz" for frequency in (1, 3, 5, 10)),
)
SPEEDS = (250, 500, 750, 1000)  # Mean speeds of table 1 of Kadmiri et al. 2012 [rpm]
EXCITATIONS = (1.5, 3.0, 6.0)  # Λ of that pair
# Errors of impact speeds, median and 95 %, of spur and of helical gears
BOUNDS = {False: (0.002, 0.006), True: (0.005, 0.015)}


def rigaud(figure: str) -> Scenario:
    """Return the scenario of a figure."""
    return load(shipped() / "rigaud-2020" / f"{figure}.toml")


def kadmiri(speed: int, excitation: float) -> Scenario:
    """Return the pair 19:37 at a mean speed, with the drag of table 1, swinging twice a turn.

    Units: ``speed`` [rpm].

    >>> round(assess(kadmiri(500, 3.0)).excitation_total, 2)
    3.0
    """
    still = load(shipped() / "kadmiri-2012" / f"table1-{speed}rpm.toml")
    unit = assess(still).harmonics[0].threshold_amplitude_rad_s
    swing = {"motion.harmonics[0].amplitude": f"{excitation * unit!r} rad/s"}
    return still.with_({**swing, "run.duration": "40 periods", "run.settle": "10 periods"})


def against_twin(scenario: Scenario) -> Comparison:
    """Run engine and twin and compare them."""
    return compare(simulate(scenario), simulate(scenario, "rigid"), flight_height_min=0.05e-6)


def claims_of(scenario: Scenario, case: str) -> Iterator[Check]:
    """Give the checks of one case that is not chaotic."""
    found = against_twin(scenario)
    median, most = BOUNDS[scenario.pair().drive.helix_angle != 0.0]
    yield Check(f"{case}: chaotic", float(found.mode != "trajectory"), 0)
    yield Check(f"{case}: impacts missed or invented", _known(found.impacts_missed) + _known(found.impacts_invented), 0)
    yield Check(f"{case}: regime differs", float(not found.regime_equal), 0)
    if found.impacts_compared:
        about = f"{case}: speed of {found.impacts_compared} impacts"
        yield Check(f"{about}, median error", _known(found.velocity_error_median), median)
        yield Check(f"{about}, 95 % of the errors", _known(found.velocity_error_p95), most)


def _known(error: float | None) -> float:
    """Return an error, or not a number where nothing was matched: no check holds by that."""
    return float("nan") if error is None else error


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    for figure in ("fig8",) if quick else FIGURES:
        yield from claims_of(rigaud(figure), figure.replace("fig", "fig. ", 1).replace("-", ", ", 1))
    for speed in (1000,) if quick else SPEEDS:
        for excitation in (3.0,) if quick else EXCITATIONS:
            case = f"19:37 helical, {speed} rpm, excitation {excitation:g}"
            yield from claims_of(kadmiri(speed, excitation), case)
    if not quick:
        yield from chaotic_claims()
