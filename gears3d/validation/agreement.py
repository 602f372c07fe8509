"""Located engine against the rigid twin, at full rotation.

The engine finds the touching teeth with PyBullet and refines the gap on the true flanks; the twin knows base radii and
a backlash. Cases: figure 5 of Rigaud & Perret-Liaudet 2020 at 20 rpm and 3 Hz, over restitution and mean speed.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from gears3d.comparison import Comparison, compare
from gears3d.simulation import simulate
from gears3d.validation.bench import fig5
from gears3d.validation.claim import Claim

RESTITUTIONS = (0.0, 0.3, 0.5, 0.7)
MEAN_SPEEDS = (30, 90, 750)  # rpm


@cache
def against_twin(restitution: float, mean: int) -> Comparison:
    """Run engine and twin on one case and compare them.

    Args:
        restitution: coefficient.
        mean: mean speed of the drive [rpm].
    """
    scenario = fig5(impact__restitution=restitution, motion__mean=f"{mean} rpm")
    return compare(simulate(scenario), simulate(scenario, "rigid"), flight_height_min=0.05e-6)


def claims_of(comparison: Comparison, case: str) -> Iterator[Claim]:
    """Give the claims of one case.

    Args:
        comparison: engine against twin.
        case: its name.
    """
    found = comparison.to_dict()
    yield Claim(f"{case}: impacts missed or invented", found["impacts_missed"] + found["impacts_invented"], 0)
    yield Claim(f"{case}: impacts compared", found["impacts_compared"], 12, at_least=True)
    yield Claim(f"{case}: impact speed, median error", found["velocity_error_median"], 0.002)
    yield Claim(f"{case}: impact speed, 95 % of the errors", found["velocity_error_p95"], 0.006)
    yield Claim(f"{case}: impact speed, bias", abs(found["velocity_bias"]), 0.001)
    yield Claim(f"{case}: phase, median error", found["phase_error_median_cycles"], 1e-4, "cycle")
    yield Claim(f"{case}: regime differs", 0.0 if found["regime_equal"] else 1.0, 0)


def claims(quick: bool = False) -> Iterator[Claim]:
    """Measure them.

    Args:
        quick: two of the twelve cases.
    """
    for mean in MEAN_SPEEDS:
        for restitution in RESTITUTIONS:
            if not quick or (mean, restitution) in ((30, 0.3), (750, 0.7)):
                yield from claims_of(against_twin(restitution, mean), f"e = {restitution}, {mean} rpm")
