"""Whether a record knows where its flanks are: paths before and after a blow meet there, and know no flank."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gears3d.identification.restitution.pairs import Pairs
from gears3d.recording import FLANKS

DOUBT = 1.5
"""Median of depth over its standard deviation from which a flank is not believed; 0.67 where all is right."""
FEWEST = 4
"""Blows on a flank that tell its place."""
BLIND, CLEAR = 0.25, 0.1
"""Parts of the fast impacts whose rebound is missed on one flank, while the other shows all but so many."""


def depths(flights: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return how much deeper than the flank each blow happened, its standard deviation [m], and the flank, each (k,).

    The path before a blow reaches the assumed flank at one moment, the path after it leaves it at another. Both paths
    meet deeper by the time between, over 1/v + 1/w.

    Args:
        flights: of a measurement, in order of time.

    >>> two = {"struck": np.array([0, 0]), "blow": np.array([0, 1]), "end_s": np.array([1.0, 2.0])}
    >>> two |= {"start_s": np.array([0.0, 1.003]), "end_sigma_s": np.ones(2), "start_sigma_s": np.ones(2)}
    >>> two |= {"velocity_m_s": np.array([-2.0, -1.0]), "departure_m_s": np.array([0.0, 1.0])}
    >>> depths(two)[0].round(6).tolist()
    [0.002]
    """
    after = np.flatnonzero(np.asarray(flights["blow"]) == 1)
    after = after[after > 0]
    before = after - 1
    slow = 1.0 / np.abs(flights["velocity_m_s"][before]) + 1.0 / np.maximum(
        np.abs(flights["departure_m_s"][after]), 1e-9
    )
    apart = flights["start_s"][after] - flights["end_s"][before]
    sigma = np.hypot(flights["start_sigma_s"][after], flights["end_sigma_s"][before])
    return apart / slow, sigma / slow, np.asarray(flights["struck"][before], dtype=int)


def misplaced(flights: Mapping[str, np.ndarray]) -> dict[int, float]:
    """Return the flanks whose blows contradict their place, with the typical depth [m].

    Args:
        flights: of a measurement.
    """
    depth, sigma, flank = depths(flights)
    found = {}
    for code in range(len(FLANKS)):
        own = (flank == code) & (sigma > 0.0)
        if np.count_nonzero(own) >= FEWEST and np.median(np.abs(depth[own]) / sigma[own]) > DOUBT:
            found[code] = float(np.median(np.abs(depth[own])))
    return found


def blind(chosen: Pairs) -> int | None:
    """Return the flank of which rebounds are missed while the other shows them.

    Args:
        chosen: impacts fast enough for their rebound to be seen.
    """
    missed = [
        float(np.mean(~chosen.seen[chosen.flank == code])) if np.any(chosen.flank == code) else 1.0 for code in (0, 1)
    ]
    worse = int(np.argmax(missed))
    if np.any(chosen.flank == worse) and missed[worse] > BLIND and missed[1 - worse] < CLEAR:
        return worse
    return None
