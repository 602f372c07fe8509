"""The mesh stiffness as a Fourier series over the drive's angle."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.gears.deviation import FLANKS, index_of
from gears3d.stiffness.material import STEEL, Material
from gears3d.stiffness.mesh import contact_path, pair_stiffness, reverse_lead

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair


@dataclass(frozen=True)
class MeshStiffness:
    """Stiffness along the transverse line of action, K(θ) = mean + Σj a_j·cos(j·z·θ) + b_j·sin(j·z·θ).

    Args:
        teeth: z of the drive gear; j = 1 is the mesh frequency.
        mean: [N/m].
        cosines: a_j [N/m], (n,).
        sines: b_j [N/m], (n,).

    >>> MeshStiffness(10, 2e8, np.array([1e7]), np.array([0.0]))(np.array([0.0, np.pi / 10])).round(3).tolist()
    [210000000.0, 190000000.0]
    """

    teeth: int
    mean: float
    cosines: NDArray[np.float64]
    sines: NDArray[np.float64]

    def __call__(self, theta: ArrayLike) -> NDArray[np.float64]:
        """Return the stiffness [N/m] at drive angles [rad], (n,)."""
        phases = np.multiply.outer(np.asarray(theta, float), self.teeth * np.arange(1, len(self.cosines) + 1))
        return self.mean + np.cos(phases) @ self.cosines + np.sin(phases) @ self.sines

    @property
    def ripple(self) -> float:
        """Half of the way between the largest and smallest stiffness, over the mean."""
        values = self(np.linspace(0.0, 2.0 * pi / self.teeth, 1024, endpoint=False))
        return float(np.ptp(values)) / (2.0 * self.mean)


def harmonics(pair: Pair, orders: int = 8, flank: str = "active", material: Material = STEEL) -> MeshStiffness:
    """Return the mean mesh stiffness and its first harmonics, from the path of contact without sampling an angle.

    The teeth follow each other by one base pitch, so harmonic j is the Fourier integral of one pair's stiffness over
    its path, and lines of contact that lie askew take sin(π·j·ε_β)/(π·j·ε_β) of it: nothing is left where the overlap
    ratio is whole.

    Args:
        pair: the pair.
        orders: how many harmonics of the mesh frequency.
        flank: ``"active"`` or ``"reverse"``.
        material: of both gears.

    Returns:
        The series.

    Raises:
        InputError: unknown flank.

    Source: the lubricated dual-clutch transmission, eq. (10); the factor of the overlap ratio as for any sum of equal
    slices that are shifted evenly.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30, face_width=0.01)
    >>> series = harmonics(Pair.from_backlash(gear, gear, 1e-4))
    >>> 0.1 < series.ripple < 0.5
    True
    """
    side = 1 - 2 * index_of(flank, FLANKS, "flank")
    begin, end = contact_path(pair)
    path = np.linspace(begin, end, 401 + 24 * orders)
    simpson = np.full(len(path), 2.0)
    simpson[1::2], simpson[[0, -1]] = 4.0, 1.0
    weights = simpson * (path[1] - path[0]) / 3.0 * pair_stiffness(pair, np.clip(path, begin, end), material)
    j = np.arange(orders + 1)
    lead = 0.0 if side > 0 else reverse_lead(pair)
    wave = np.exp(-2j * pi * np.multiply.outer(j, path - lead) / pair.drive.base_pitch) @ weights
    width = min(pair.drive.face_width, pair.loose.face_width)
    scale = width * cos(pair.drive.base_helix_angle) / pair.drive.base_pitch
    parts = scale * wave * np.sinc(j * pair.overlap_ratio)
    return MeshStiffness(pair.drive.teeth, float(parts[0].real), 2.0 * parts[1:].real, -2.0 * side * parts[1:].imag)
