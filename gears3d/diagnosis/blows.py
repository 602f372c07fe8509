"""Blows on the flanks, whether their rebound was seen or not, and the rebound below which a record sees none.

Of rebounds that scatter a record shows the strong ones; those that fail are contact at once. To hold the strong ones
for all of them makes restitution too large and its scatter too small.
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
    """Blows of a record that ended a flight which passes for one, (b,).

    Args:
        time: [s].
        drive: angle [rad].
        loose: angle [rad].
        flank: 0 active, 1 reverse.
        velocity: against the flank, before, above 0 [m/s].
        velocity_sigma: [m/s].
        rebound: above 0; NaN where none above ``lowest`` was seen [m/s].
        rebound_sigma: [m/s]; 0 where none was seen.
        lowest: rebound above which the record overlooks none [m/s].
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
        """Whether the rebound was seen, (b,)."""
        return np.isfinite(self.rebound)


def blows(cut: Segments) -> Blows:
    """Return the blows of a record; none where it shows no bounce, for then it tells nothing of what it overlooks.

    Args:
        cut: of :func:`gears3d.measured.segmentation.measure`.
    """
    hits, path = cut.impacts, cut.path
    time, flank = hits["time_s"], np.asarray(hits["flank"], dtype=int)
    if not len(time):
        return none()
    velocity, rebound = np.abs(hits["velocity_m_s"]), np.abs(hits["rebound_m_s"])
    height = clearance(path, cut.flanks)
    lowest = lowest_rebound(time, flank, velocity, rebound, height, path.width)
    sane = hits["testifies"] == 1
    after = np.append(sane[1:], False)  # the flight that a rebound begins is told by the impact that ends it
    good = sane & (after | np.isnan(rebound)) & (velocity > 0.0) & (hits["velocity_sigma_m_s"] > 0.0)
    good &= np.isfinite(lowest)
    good[-1] = False  # what follows the last one is cut off
    rebound = np.where(rebound > lowest, rebound, np.nan)
    slack = np.where(np.isfinite(rebound), hits["rebound_sigma_m_s"], 0.0)
    drive, loose = (np.interp(time, cut.track.time, angle) for angle in (cut.track.drive, cut.track.loose))
    every = Blows(time, drive, loose, flank, velocity, hits["velocity_sigma_m_s"], rebound, slack, lowest)
    return Blows(*(column[good] for column in every))


def none() -> Blows:
    """Return the blows of a record that could not be cut."""
    return Blows(*[np.zeros(0)] * len(Blows._fields))
