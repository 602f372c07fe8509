"""Bullet's own gaps compared with the refined ones: the near teeth, and the agreement of hulls and flanks."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from gears3d.engine.closing import TOUCH
from gears3d.engine.lines import merged
from gears3d.engine.mesh import Mesh, both_sides, compare_raw, teeth_of_points
from gears3d.engine.motion import drive_at
from gears3d.engine.nearby import Nearby
from gears3d.engine.world import KEPT, MARGIN, MM, World
from gears3d.errors import EngineError
from gears3d.gears import piece_budget

if TYPE_CHECKING:
    from gears3d.engine.closing import ContactSystem
    from gears3d.gears import Pair

WIDENINGS = 6  # the gears count as out of mesh when the search for near teeth was widened this often
# Deeper overlaps of compliant flanks are not compared with Bullet's, which are those of whole hulls [m].
DEEP = 2e-5
FAR = 3e-4  # wider gaps are not compared with Bullet's: the ends of the hulls' flanks may be nearest there [m]
# Turn of the drive after which Bullet's gaps are compared again where the near teeth are known [rad].
COMPARE_AFTER = 0.618 * 2.0 * math.pi
MARGINS = 2.0 * MARGIN / MM  # Bullet's margins, one for each body, reduce a raw gap by this much [m]

_budget = lru_cache(maxsize=KEPT)(piece_budget)


class Watch:
    """Queries Bullet for the near teeth and compares its gaps with those of the true flanks.

    Args:
        pair: the gears.
        shape: flanks and edges of the pair.
        slices: of Bullet's teeth along the face.
    """

    def __init__(self, pair: Pair, shape: Mesh, slices: int | None = None) -> None:
        self._shape = shape
        self.nearby = Nearby(pair, shape)
        self._counts = (pair.drive.teeth, pair.loose.teeth)
        self._parts = dict(_budget(pair, slices=slices))
        self._sums = np.zeros(4)
        # flanks that are compared, by gear, side and tooth; a gear's missing teeth count as compared
        self._seen = np.ones((2, 2, max(self._counts)), np.int64)
        for gear, count in enumerate(self._counts):
            self._seen[gear, :, :count] = 0
        # flanks are refined in sections across the drive's axis
        tilt = 0.5 * self.nearby.tilts**2 * (pair.drive.tip_radius + pair.loose.tip_radius)
        self._parts["tilt_error_m"] = tilt
        self.allowed = self._parts["gap_error_m"] + self._parts["tilt_error_m"]
        self.queries = 0

    def look(self, world: World, system: ContactSystem, time: float, theta_loose: float) -> None:
        """Query Bullet once with the gears posed as at ``time`` [s], find the candidate teeth, and check the raw gaps.

        A raw gap that differs from the refined one by more than the hulls can account for is an EngineError.
        """
        theta_drive = drive_at(system.motion, time)[0]
        known = self.nearby.known(theta_drive)
        reach = self.nearby.touching if known else self.nearby.reach
        found, raw = self._near(world, theta_drive, theta_loose, time, reach)
        thetas, limits = (theta_drive, theta_loose), (self.nearby.slack, -DEEP, FAR)
        row, excess, refined = compare_raw(self._shape, found, raw + MARGINS, thetas, limits, self._sums, self._seen)
        if abs(excess) > self.allowed:
            self._refuse(found[row], float(raw[row]), refined, time)
        if not known:
            self.nearby.fill(found, thetas)
        self.nearby.compared(theta_drive, bool(self._seen.all()))

    def _near(
        self, world: World, theta_drive: float, theta_loose: float, time: float, reach: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the teeth that Bullet finds near each other (n, 3), on both flanks, and its gaps (n,) [m]."""
        for _ in range(WIDENINGS):
            on_drive, on_loose, raw = world.nearest(reach)
            self.queries += 1
            found = teeth_of_points(self._shape, self._counts, on_drive, on_loose, theta_drive, theta_loose)
            if not self._shape.planar:
                found, raw = merged(found, raw)
            if both_sides(found):
                return found, raw
            reach *= 1.5
        raise EngineError(
            f"no teeth near each other on one of the flanks at t = {time:.6g} s: "
            "the gears are out of mesh (smaller centre distance or backlash, stiffer teeth)"
        )

    def _refuse(self, teeth: np.ndarray, raw: float, refined: float, time: float) -> None:
        flank = ("active", "reverse")[teeth[2]]
        raise EngineError(
            f"t = {time:.6g} s, {flank} flanks, drive tooth {teeth[0]} against loose tooth {teeth[1]}: Bullet measures "
            f"a gap of {(raw + MARGINS) * 1e6:.3f} µm, the flanks {refined * 1e6:.3f} µm; the hulls account for "
            f"{self.allowed * 1e6:.2f} µm of difference (collision pieces and flanks are not of the same gears)"
        )

    def report(self, located: float) -> dict[str, float]:
        """Return the error budget, all in m; ``located`` is the largest gap at an impact.

        ``facet_chord``, ``slice_edge`` of helical teeth, ``axis_tilt`` of axes that are not parallel,
        ``hull_quantisation``, ``hull_margins`` of Bullet's hulls; ``raw_minus_refined_mean``, and about it, margins
        subtracted, ``_std``, ``_max``; ``raw_allowed``; ``location``, ``step`` (0: no event falls between two steps)
        and the ``total`` of the errors of an impact's place, which do not include the hulls.
        """
        count = max(self._sums[0], 1.0)
        mean = self._sums[1] / count
        spread = math.sqrt(max(self._sums[2] / count - mean * mean, 0.0))
        return {
            "facet_chord": self._parts["chord_error_m"],
            "slice_edge": self._parts["slice_error_m"],
            "axis_tilt": self._parts["tilt_error_m"],
            "hull_quantisation": self._parts["quantum_m"],
            "hull_margins": MARGINS,
            "raw_minus_refined_mean": mean - MARGINS,
            "raw_minus_refined_std": spread,
            "raw_minus_refined_max": self._sums[3],
            "raw_allowed": self.allowed,
            "location": located,
            "step": 0.0,
            "total": located + TOUCH,
        }
