"""Located engine against the rigid twin, at full rotation.

The engine finds the touching teeth with PyBullet and refines the gap on the true flanks; the twin knows base radii and
a backlash. Cases: figure 5 of Rigaud & Perret-Liaudet 2020 at 20 rpm and 3 Hz, over restitution and mean speed; then
with flanks that the twin rolls on the gears' surfaces beforehand and the engine touches one by one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from gears3d.comparison import Comparison, compare
from gears3d.recording import Recording
from gears3d.scenario import Scenario
from gears3d.simulation import simulate
from gears3d.verification.validation.bench import fig5
from gears3d.verification.validation.check import Check

RESTITUTIONS = (0.0, 0.3, 0.5, 0.7)
MEAN_SPEEDS = (30, 90, 750)  # rpm


def _tooth(gear: str, flank: str, tooth: int, offset: str) -> dict[str, Any]:
    return {"effect": [{"kind": "pitch_error", "gear": gear, "flank": flank, "tooth": tooth, "offset": offset}]}


# Overrides of figure 5 by the shape that they give the flanks; each is felt by impacts
SHAPES: dict[str, dict[str, Any]] = {
    "tooth 14 of the drive +20 um, active flank": _tooth("drive", "active", 14, "20 um"),
    "tooth 8 of the drive +20 um, reverse flank": _tooth("drive", "reverse", 8, "-20 um"),
    "tooth 14 of the loose gear +20 um, active flank": _tooth("loose", "active", 14, "20 um"),
    "tooth 9 of the loose gear +20 um, reverse flank": _tooth("loose", "reverse", 9, "-20 um"),
    "tip relief of 20 um over 7 mm": {"gears.tip_relief": {"amount": "20 um", "length": "7 mm"}},
    "profile slope of the drive 10 um": {"gears.drive.profile_slope": {"amount": "10 um"}},
    "profile slope of the loose gear 10 um": {"gears.loose.profile_slope": {"amount": "10 um"}},
    "drive 40 um eccentric": {"gears.drive.eccentricity": {"offset": "40 um", "phase": "0.6 rad"}},
    "loose gear 40 um eccentric": {"gears.loose.eccentricity": {"offset": "40 um", "phase": "0.6 rad"}},
}


@cache
def against_twin(restitution: float, mean: int) -> Comparison:
    """Run engine and twin on one case and compare them.

    Units: ``mean`` [rpm].
    """
    scenario = fig5(impact__restitution=restitution, motion__mean=f"{mean} rpm")
    return compare(simulate(scenario), simulate(scenario, "rigid"), flight_height_min=0.05e-6)


def claims_of(comparison: Comparison, case: str) -> Iterator[Check]:
    """Give the checks of one case."""
    found = comparison.to_dict()
    yield Check(f"{case}: impacts missed or invented", found["impacts_missed"] + found["impacts_invented"], 0)
    yield Check(f"{case}: impacts compared", found["impacts_compared"], 12, at_least=True)
    yield Check(f"{case}: impact speed, median error", found["velocity_error_median"], 0.002)
    yield Check(f"{case}: impact speed, 95 % of the errors", found["velocity_error_p95"], 0.006)
    yield Check(f"{case}: impact speed, bias", abs(found["velocity_bias"]), 0.001)
    yield Check(f"{case}: phase, median error", found["phase_error_median_cycles"], 1e-4, "cycle")
    yield Check(f"{case}: regime differs", 0.0 if found["regime_equal"] else 1.0, 0)


def along_action(recording: Recording, scenario: Scenario) -> Recording:
    """Return the engine's recording with the speeds of impacts along the line of action, as the twin's are.

    The engine has them along the flanks' common normal. It leans by the slope of the loose gear's deviation, so that
    its lever is not the base radius; speeds and impulse of an impact tell the lever.

    Args:
        recording: of the engine, without friction of the flanks.
        scenario: for the loose gear's inertia and base radius.
    """
    rig, table = scenario.rig(), recording.impacts
    change = table["rebound_m_s"] - table["velocity_m_s"]
    lever = np.sqrt(rig.inertia * change / table["impulse_N_s"])
    turned = {name: table[name] * rig.base_radius_loose / lever for name in ("velocity_m_s", "rebound_m_s")}
    return replace(recording, impacts={**table, **turned})


@cache
def on_shape(name: str, restitution: float) -> Comparison:
    """Run engine and twin on figure 5 with other flanks and compare them."""
    scenario = fig5(impact__restitution=restitution).with_(SHAPES[name])
    engine = along_action(simulate(scenario), scenario)
    return compare(engine, simulate(scenario, "rigid"), flight_height_min=0.05e-6)


def shape_claims(name: str) -> Iterator[Check]:
    """Give the checks of one shape, each the worse of restitution 0 and 0.5."""
    both = [on_shape(name, restitution).to_dict() for restitution in (0.0, 0.5)]
    worst = {key: max(abs(one[key]) for one in both) for key in both[0] if key.startswith(("velocity_", "phase_"))}
    counted = [one["impacts_missed"] + one["impacts_invented"] for one in both]
    yield Check(f"{name}: impacts missed or invented", max(counted), 0)
    yield Check(f"{name}: impact speed, median error", worst["velocity_error_median"], 0.002)
    yield Check(f"{name}: impact speed, 95 % of the errors", worst["velocity_error_p95"], 0.006)
    yield Check(f"{name}: impact speed, bias", worst["velocity_bias"], 0.001)
    yield Check(f"{name}: phase, median error", worst["phase_error_median_cycles"], 1e-4, "cycle")


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    for mean in MEAN_SPEEDS:
        for restitution in RESTITUTIONS:
            if not quick or (mean, restitution) in ((30, 0.3), (750, 0.7)):
                yield from claims_of(against_twin(restitution, mean), f"e = {restitution}, {mean} rpm")
    for name in SHAPES:
        if not quick or name.startswith("tip relief"):
            yield from shape_claims(name)
