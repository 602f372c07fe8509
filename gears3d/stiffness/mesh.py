"""Mesh stiffness: of one pair of teeth, of all pairs in contact, its harmonics, and ISO 6336-1 to compare with."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, degrees, pi, tan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.gears.deviation import FLANKS, index_of
from gears3d.stiffness.tooth import STEEL, Material, tooth_compliance

if TYPE_CHECKING:
    from gears3d.gears.gear import Gear
    from gears3d.gears.pair import Pair


Array = NDArray[np.float64]
POINTS = 1001  # Of the path of contact, where it is summed up
THEORY_TO_MEASUREMENT = 0.8  # C_M, which corrects the theoretical single stiffness of solid discs to the measured one


def contact_path(pair: Pair) -> tuple[float, float]:
    """Return where the path of contact begins and ends, from the pitch point in the sense of its motion [m].

    Args:
        pair: the pair.

    Source: ISO 21771:2007, path of contact between the tip circles.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30)
    >>> begin, end = contact_path(Pair.from_backlash(gear, gear, 1e-4))
    >>> bool(abs(begin + end) < 1e-12)
    True
    """
    tangent = tan(pair.working_pressure_angle)
    begin, end = (gear.base_radius * (gear.tip_roll - tangent) for gear in (pair.loose, pair.drive))
    return -begin, end


def pair_stiffness(pair: Pair, place: ArrayLike, material: Material = STEEL) -> Array:
    """Return the stiffness of two teeth, normal to their flanks, for a unit of length of their line of contact.

    Args:
        pair: the pair.
        place: of the contact, from the pitch point along the path of contact in the sense of its motion [m].
        material: of both gears.

    Returns:
        Stiffness [N/m²], 0 where these teeth do not touch.

    Source: the lubricated dual-clutch transmission, eq. (9).

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30)
    >>> [round(float(k) / 1e9, 1) for k in pair_stiffness(Pair.from_backlash(gear, gear, 1e-4), [0.0, 0.1])]
    [15.3, 0.0]
    """
    at = np.asarray(place, float)
    begin, end = contact_path(pair)
    inside = np.clip(at, begin, end)
    tangent = tan(pair.working_pressure_angle)
    drive = tooth_compliance(pair, "drive", tangent + inside / pair.drive.base_radius, material)
    loose = tooth_compliance(pair, "loose", tangent - inside / pair.loose.base_radius, material)
    stiffness = 1.0 / (drive.total + loose.total + material.hertz)
    return np.where((at >= begin) & (at <= end), stiffness, 0.0)


def mesh_stiffness(
    pair: Pair, theta: ArrayLike, flank: str = "active", slices: int | None = None, material: Material = STEEL
) -> Array:
    """Return the stiffness of all pairs of teeth in contact, along the transverse line of action.

    Slices across the face deflect independently; without a number there are infinitely many. Along the normal of a
    helical tooth the stiffness is that over cos² of the base helix angle.

    Args:
        pair: the pair.
        theta: angle of the drive gear [rad], (n,).
        flank: ``"active"`` or ``"reverse"``, the side on which the gears rest.
        slices: how many, each at its middle; ``None``: the limit of ever more.
        material: of both gears.

    Returns:
        Stiffness [N/m], (n,).

    Raises:
        InputError: unknown flank.

    Source: the lubricated dual-clutch transmission, section 2.2: slices, summed over the pairs in contact.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30, face_width=0.01)
    >>> single, double = mesh_stiffness(Pair.from_backlash(gear, gear, 1e-4), [0.0, 0.1])
    >>> bool(1.5 * single < double < 2.0 * single)
    True
    """
    side = 1.0 - 2.0 * index_of(flank, FLANKS, "flank")
    angles = np.asarray(theta, float)
    first = pair.drive.base_radius * side * angles + (0.0 if side > 0.0 else reverse_lead(pair))
    width = min(pair.drive.face_width, pair.loose.face_width)
    slope, pitch = tan(pair.drive.base_helix_angle), pair.drive.base_pitch
    reach = 0.5 * abs(slope) * width
    begin, end = contact_path(pair)
    # whole pitches that bring any part of any line between begin and end
    low, high = np.floor((np.min(first) - reach - end) / pitch), np.ceil((np.max(first) + reach - begin) / pitch)
    places = first[..., None] - pitch * np.arange(low, high + 1)
    if slices is None and reach > 0.0:
        total = _swept(pair, places, reach, material) * width / (2.0 * reach)
    else:
        count = slices or 1
        heights = ((np.arange(count) + 0.5) / count - 0.5) * width
        total = pair_stiffness(pair, places[..., None] + slope * heights, material).sum(axis=-1) * width / count
    return total.sum(axis=-1) * cos(pair.drive.base_helix_angle)  # /cos: longer line, cos²: transverse


def reverse_lead(pair: Pair) -> float:
    """Return where the reverse flank of tooth 1 is touched at drive angle 0, along its own path of contact [m]."""
    angle = pair.working_pressure_angle
    return 2.0 * pair.drive.base_radius * (pair.half_angle("drive") - (tan(angle) - angle))


def _swept(pair: Pair, places: Array, reach: float, material: Material) -> Array:
    """Integral of the pair stiffness over the path that each line of contact covers [N/m]."""
    begin, end = contact_path(pair)
    path = begin + (end - begin) * 0.5 * (1.0 - np.cos(pi * np.linspace(0.0, 1.0, POINTS)))
    stiffness = pair_stiffness(pair, np.clip(path, begin, end), material)
    slopes = np.diff(stiffness) / np.diff(path)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (stiffness[1:] + stiffness[:-1]) * np.diff(path))])

    def up_to(place: Array) -> Array:
        at = np.clip(place, begin, end)
        i = np.clip(np.searchsorted(path, at) - 1, 0, POINTS - 2)
        along = at - path[i]
        return total[i] + along * (stiffness[i] + 0.5 * along * slopes[i])

    return up_to(places + reach) - up_to(places - reach)


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


def iso_single_stiffness(pair: Pair, correction: float = THEORY_TO_MEASUREMENT) -> float:
    """Return the largest stiffness c' of one pair of teeth of solid steel gears under a load of 100 N/mm or more.

    1/c'th = 0.04723 + 0.15551/zn1 + 0.25791/zn2 − 0.00635·x1 − 0.11654·x1/zn1 − 0.00193·x2 − 0.24188·x2/zn2
    + 0.00529·x1² + 0.00182·x2² [mm·µm/N] and c' = c'th·C_M·C_B·cos β with C_B for the basic rack.

    Args:
        pair: the pair.
        correction: C_M; 1 for the theoretical stiffness.

    Returns:
        Stiffness for a unit of face width [N/m²].

    Source: ISO 6336-1:2006, section 9.3.1.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30, dedendum=1.2)
    >>> round(iso_single_stiffness(Pair.from_backlash(gear, gear, 1e-4)) / 1e9, 2)
    13.11
    """
    drive, loose = pair.drive, pair.loose
    first, second = (_virtual_teeth(gear) for gear in (drive, loose))
    x1, x2 = drive.profile_shift, loose.profile_shift
    flexibility = 0.04723 + 0.15551 / first + 0.25791 / second - 0.00635 * x1 - 0.11654 * x1 / first
    flexibility += -0.00193 * x2 - 0.24188 * x2 / second + 0.00529 * x1**2 + 0.00182 * x2**2
    rack = 0.5 * sum((1.0 + 0.5 * (1.2 - gear.dedendum)) for gear in (drive, loose))
    rack *= 1.0 - 0.02 * (20.0 - degrees(drive.pressure_angle))
    return 1e9 / flexibility * correction * rack * cos(drive.helix_angle)


def iso_mesh_stiffness(pair: Pair, correction: float = THEORY_TO_MEASUREMENT) -> float:
    """Return the mean mesh stiffness c_γα·b, c_γα = c'·(0.75·ε_α + 0.25), along the transverse line of action [N/m].

    Args:
        pair: the pair.
        correction: C_M; 1 for the theoretical stiffness.

    Source: ISO 6336-1:2006, section 9.3.2.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30, face_width=0.01)
    >>> round(iso_mesh_stiffness(Pair.from_backlash(gear, gear, 1e-4)) / 1e6)
    184
    """
    width = min(pair.drive.face_width, pair.loose.face_width)
    return width * iso_single_stiffness(pair, correction) * (0.75 * pair.contact_ratio + 0.25)


def _virtual_teeth(gear: Gear) -> float:
    """Teeth of the spur gear that fits the normal section, zn = z/(cos²βb·cos β); ISO 21771."""
    return gear.teeth / (cos(gear.base_helix_angle) ** 2 * cos(gear.helix_angle))
