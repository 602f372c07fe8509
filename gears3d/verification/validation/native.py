"""Bullet's own contact with the exact-impact settings, and what it does wrong once the pair turns.

At zero mean speed the facets of the hulls hardly move through the contact, and the realised restitution is the one that
was asked. At full rotation they tilt the normal, and it scatters: that is why located contact is the default.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gears3d.simulation import simulate
from gears3d.verification.validation.bench import fig5
from gears3d.verification.validation.check import Check


def realised(restitution: float, mean: int, harder: float = 0.01) -> np.ndarray:
    """Return the realised restitution of each native impact, (k,).

    Units: ``mean`` [rpm]; ``harder`` [m/s].

    The speed of the drive has an amplitude of 2 rpm at 30 Hz, the excitation of figure 5 with 10 % of its speed.
    """
    swing = [{"amplitude": "2 rpm", "frequency": "30 Hz"}]
    scenario = fig5(impact__restitution=restitution, motion__mean=f"{mean} rpm", run__duration="0.3 s")
    impacts = simulate(scenario.with_({"motion.harmonics": swing}), contact="native").impacts
    hard = np.abs(impacts["velocity_m_s"]) > harder
    return -impacts["rebound_m_s"][hard] / impacts["velocity_m_s"][hard]


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    for restitution in (0.5,) if quick else (0.3, 0.5, 0.7):
        found = realised(restitution, mean=0)
        yield Check(f"e = {restitution}, mean speed zero: impacts", len(found), 8, at_least=True)
        worst = float(np.abs(found - restitution).max()) if len(found) else np.nan
        yield Check(f"e = {restitution}, mean speed zero: realised restitution, largest error", worst, 0.01)
    if not quick:
        scatter = float(np.std(realised(0.7, mean=750)))
        yield Check("e = 0.7, 750 rpm: scatter that the facets make", scatter, 0.1, at_least=True)
