"""Bullet's own contact with the exact-impact settings, and what it does wrong once the pair turns.

At zero mean speed the facets of the hulls do not move through the contact, and the realised restitution is the one that
was asked. At full rotation they tilt the normal, and it scatters: that is why located contact is the default.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gears3d.simulation import simulate
from gears3d.validation.bench import fig5
from gears3d.validation.claim import Claim


def realised(restitution: float, mean: int, duration: float = 0.7, harder: float = 2e-3) -> np.ndarray:
    """Return the realised restitution of each native impact, (k,).

    Args:
        restitution: what was asked.
        mean: mean speed of the drive [rpm].
        duration: of the run [s].
        harder: only impacts of at least this speed count [m/s].
    """
    scenario = fig5(impact__restitution=restitution, motion__mean=f"{mean} rpm", run__duration=f"{duration} s")
    impacts = simulate(scenario, contact="native").impacts
    speed = np.abs(impacts["velocity_m_s"])
    return np.abs(impacts["rebound_m_s"] / impacts["velocity_m_s"])[speed > harder]


def claims(quick: bool = False) -> Iterator[Claim]:
    """Measure them.

    Args:
        quick: one restitution.
    """
    for restitution in (0.5,) if quick else (0.3, 0.5, 0.7):
        found = realised(restitution, mean=0)
        yield Claim(f"e = {restitution}, not turning: impacts", len(found), 4, at_least=True)
        worst = float(np.abs(found - restitution).max()) if len(found) else np.nan
        yield Claim(f"e = {restitution}, not turning: realised restitution, largest error", worst, 0.01)
