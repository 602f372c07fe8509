"""Whether a record knows where its flanks are: paths before and after a blow meet there, and know no flank."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from gears3d.recording import FLANKS

if TYPE_CHECKING:
    from gears3d.identify.restitution.pairs import Pairs

DOUBT = 1.5
"""Median of depth over its standard deviation from which a flank is not believed; 0.67 where all is right."""
STRAY = 4.0
"""Deviations from the median from which on a blow does not tell where its flank is."""
SURE = 0.2
"""Relative deviation up to which a flight tells its own deceleration; that of others has the record's median."""
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


def mean_depths(flights: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return how much deeper than assumed each flank lies in the mean of its blows [m], (2,).

    A mean that its own standard error may explain is shrunk towards 0. Flanks that are misplaced beyond belief have 0.

    Args:
        flights: of a measurement.
    """
    found, beyond = np.zeros(len(FLANKS)), misplaced(flights)
    depth, sigma, flank = depths(flights)
    for code in range(len(FLANKS)):
        own = (flank == code) & (sigma > 0.0)
        if np.count_nonzero(own) < FEWEST or code in beyond:
            continue
        off, weight = depth[own], sigma[own] ** -2.0
        weight = weight * (np.abs(off - np.median(off)) < STRAY * sigma[own])
        if not weight.any():
            continue
        mean = float(np.average(off, weights=weight))
        error = max(float(np.linalg.norm(weight * (off - mean)) / weight.sum()), float(weight.sum()) ** -0.5)
        found[code] = mean * max(1.0 - (error / mean) ** 2, 0.0) if mean else 0.0
    return found


def speeds_set_right(
    flights: Mapping[str, np.ndarray], drive: Callable[[np.ndarray], np.ndarray], radii: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return what is to be added to each blow's speeds of approach and rebound [m/s], as paths meet there, each (k,).

    Where a flank lies deeper by d, the approach lasts d/v longer and the rebound begins d/w earlier, both under the
    acceleration of the free gear: 0.1 um is 0.5 % of a rebound of 25 mm/s under 40 m/s².

    Args:
        flights: of a measurement, in order of time.
        drive: angular acceleration of the drive gear [rad/s²] over time [s].
        radii: base radii of drive and loose gear [m].
    """
    deep = mean_depths(flights)[np.asarray(flights["struck"], dtype=int)]
    slowing, slack = flights["deceleration_rad_s2"], flights["deceleration_sigma_rad_s2"]
    typical = float(np.median(slowing))
    slowing = np.where(slack < SURE * abs(typical), slowing, typical)
    toward = np.where(np.asarray(flights["struck"]) == 1, 1.0, -1.0)
    after = np.minimum(np.arange(len(slowing)) + 1, len(slowing) - 1)
    late, early = (
        toward * (-radii[1] * slowing[of] - radii[0] * drive(time))
        for of, time in ((np.arange(len(slowing)), flights["end_s"]), (after, flights["start_s"][after]))
    )
    fast, slow = np.abs(flights["velocity_m_s"]), np.abs(flights["departure_m_s"][after])
    return late * deep / np.maximum(fast, 1e-9), early * deep / np.maximum(slow, 1e-9)


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
