"""Bullet's own gaps beside the refined ones: which teeth are near, and whether hulls and flanks still agree."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gears3d.engine.closing import TOUCH
from gears3d.engine.lines import merged
from gears3d.engine.mesh import (
    Mesh,
    both_sides,
    lean_of,
    survey,
    teeth_of_points,
    tilt_of,
)
from gears3d.engine.motion import drive_at
from gears3d.engine.world import MARGIN, MM, World
from gears3d.errors import EngineError
from gears3d.gears import piece_budget
from gears3d.gears.flank import Flanks

if TYPE_CHECKING:
    from gears3d.engine.closing import Plant
    from gears3d.gears import Pair

WIDENINGS = 6
"""How often the search for near teeth is widened before the gears count as out of mesh."""
DEEP = 2e-5
"""Overlaps of yielding flanks deeper than this are not held against Bullet's, which are those of whole hulls [m]."""
FAR = 3e-4
"""Gaps wider than this are not held against Bullet's: the ends of the hulls' flanks may be nearest there [m]."""
MARGINS = 2.0 * MARGIN / MM
"""By how much Bullet's margins, one a body, make a raw gap smaller [m]."""


def _roughness(flanks: Flanks) -> float:
    """Return how far apart the deviations of two teeth in mesh can be [m]."""
    waves = np.abs(flanks.harmonics[:, :, :, 1]).sum(axis=2)
    return float((2.0 * waves + np.ptp(flanks.offsets, axis=2)).sum(axis=0).max())


class Watch:
    """Asks Bullet for the near teeth and holds its gaps against those of the true flanks.

    Args:
        pair: the gears.
        shape: flanks and edges of the pair.
        turn: of the drive gear in one step at most [rad].
        slices: of Bullet's teeth along the face.
    """

    def __init__(self, pair: Pair, shape: Mesh, turn: float, slices: int | None = None) -> None:
        self._shape = shape
        self._turn = turn
        self._slack = 1e-6 + _roughness(shape.edged.flanks)
        # two arcs of a quarter of the path's length as radius part by this much over the turn of a step
        parting = (turn * pair.drive.base_radius) ** 2 / (0.25 * pair.path_length)
        wandering = 2.0 * float(np.hypot(shape.offsets[::2], shape.offsets[1::2]).sum())
        tilts = [float(np.hypot(*tilt)) for tilt in (lean_of(pair), tilt_of(pair, "drive"), tilt_of(pair, "loose"))]
        wandering += max(gear.face_width for gear in (pair.drive, pair.loose)) * sum(tilts)
        self._reach = 1.1 * (pair.backlash + wandering) + self._slack + parting + 20e-6
        self._counts = (pair.drive.teeth, pair.loose.teeth)
        self._parts = piece_budget(pair, slices=slices)
        self._sums = np.zeros(4)
        # flanks are refined in sections across the drive's axis
        self._parts["tilt_error_m"] = 0.5 * sum(tilts) ** 2 * (pair.drive.tip_radius + pair.loose.tip_radius)
        self.allowed = self._parts["gap_error_m"] + self._parts["tilt_error_m"]
        self.queries = 0
        self.teeth = np.zeros((0, 3), dtype=np.int64)

    def look(self, world: World, plant: Plant, time: float, theta_loose: float) -> None:
        """Query Bullet once, name the candidate teeth, and check the raw gaps.

        Args:
            world: gears posed as at ``time``.
            plant: for the drive gear's motion.
            time: s.
            theta_loose: rad.

        Raises:
            EngineError: a raw gap differs from the refined one by more than the hulls can account for.
        """
        theta_drive = drive_at(plant.motion, time)[0]
        found, raw = self._near(world, theta_drive, theta_loose, time)
        thetas, limits = (theta_drive, theta_loose), (self._slack, -DEEP, FAR)
        keep = np.zeros(len(found), bool)
        row, excess, refined = survey(
            self._shape, found, raw + MARGINS, thetas, self._turn, limits, (np.zeros(len(found)), keep), self._sums
        )
        self.teeth = found[keep]
        if abs(excess) > self.allowed:
            self._refuse(found[row], float(raw[row]), refined, time)

    def _near(self, world: World, theta_drive: float, theta_loose: float, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the teeth that Bullet finds near each other (n, 3), on both flanks, and its gaps (n,) [m]."""
        reach = self._reach
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

    def report(self, located: float, strayed: float) -> dict[str, float]:
        """Return the error budget, all in m.

        Args:
            located: largest gap left at an impact.
            strayed: largest distance between where Bullet arrived and the path that was planned.

        Returns:
            ``facet_chord``, ``slice_edge`` of helical teeth, ``axis_tilt`` of axes that are not parallel,
            ``hull_quantisation``, ``hull_margins`` of Bullet's hulls; ``raw_minus_refined_mean``, and about it, margins
            taken out, ``_std``, ``_max``; ``raw_allowed``; ``location``, ``step`` and the ``total`` of what an impact's
            place depends on, which the hulls do not.
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
            "step": strayed,
            "total": located + strayed + TOUCH,
        }
