"""Impacts on the flanks with and without a detected rebound, and the detection limit of rebounds.

Of scattering rebounds a record shows the strong ones; the weak ones appear as immediate contact. To take the strong
ones for all makes restitution too large and its scatter too small.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.identify.impact_pairs import lowest_rebound
from gears3d.measured.segmentation.zones import clearance

if TYPE_CHECKING:
    from gears3d.measured.segmentation.segments import Segments

Array = np.ndarray


class Blows(NamedTuple):
    """Impacts of a record that end a free flight, (b,).

    Args:
        time: [s].
        drive: angle [rad].
        loose: angle [rad].
        flank: 0 active, 1 reverse.
        velocity: approach speed towards the flank, above 0 [m/s].
        velocity_sigma: [m/s].
        rebound: above 0; NaN where none above ``lowest`` was detected [m/s].
        rebound_sigma: [m/s]; 0 without a detected rebound.
        lowest: detection limit of rebounds [m/s].
    """

    time: Array
    drive: Array
    loose: Array
    flank: Array
    velocity: Array
    velocity_sigma: Array
    rebound: Array
    rebound_sigma: Array
    lowest: Array

    @property
    def seen(self) -> Array:
        """Whether the rebound was detected, (b,)."""
        return np.isfinite(self.rebound)


def blows(cut: Segments) -> Blows:
    """Return the impacts of a record; none without a bounce, as its detection limit is then unknown."""
    hits, path = cut.impacts, cut.path
    time, flank = hits["time_s"], np.asarray(hits["flank"], dtype=int)
    if not len(time):
        return none()
    velocity, rebound = np.abs(hits["velocity_m_s"]), np.abs(hits["rebound_m_s"])
    height = clearance(path, cut.flanks)
    lowest = lowest_rebound(time, flank, velocity, rebound, height, path.width)
    sane = hits["testifies"] == 1
    after = np.append(sane[1:], False)  # the flight after a rebound is described by the impact that ends it
    good = sane & (after | np.isnan(rebound)) & (velocity > 0.0) & (hits["velocity_sigma_m_s"] > 0.0)
    good &= np.isfinite(lowest)
    good[-1] = False  # the record ends within the motion after the last one
    rebound = np.where(rebound > lowest, rebound, np.nan)
    slack = np.where(np.isfinite(rebound), hits["rebound_sigma_m_s"], 0.0)
    drive, loose = (np.interp(time, cut.track.time, angle) for angle in (cut.track.drive, cut.track.loose))
    every = Blows(time, drive, loose, flank, velocity, hits["velocity_sigma_m_s"], rebound, slack, lowest)
    return Blows(*(column[good] for column in every))


def none() -> Blows:
    """Return the impacts of a record that could not be segmented."""
    return Blows(*[np.zeros(0)] * len(Blows._fields))
