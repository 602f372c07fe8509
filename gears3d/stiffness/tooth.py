"""Compliance of one tooth along the normal: bending beam, gear body and contact."""

from __future__ import annotations

from math import cos, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.gears.gear import fillet_points, form

if TYPE_CHECKING:
    from gears3d.gears.gear import Gear
    from gears3d.gears.pair import Pair

Array = NDArray[np.float64]
SHEAR_FACTOR = 1.2  # Of a rectangular section: its shear energy over that of an even stress
# Half the angle that a tooth spans at the root circle, as far as the coefficients were fitted [rad]
ROOT_ANGLE = (0.01, 0.12)
BODY_RATIO = (1.4, 7.0)  # Root radius over bore radius, as far as they were fitted
STATIONS = 300  # Of a fillet, and of a flank


class Material(NamedTuple):
    """An isotropic elastic material.

    Args:
        young: modulus of elasticity E [Pa].
        poisson: ν.

    >>> round(STEEL.shear / 1e9, 2)
    79.23
    """

    young: float = 2.06e11
    poisson: float = 0.3

    @property
    def shear(self) -> float:
        """Shear modulus G [Pa]."""
        return self.young / (2.0 * (1.0 + self.poisson))

    @property
    def hertz(self) -> float:
        """Compliance of the contact of two such bodies for a unit length of line, 4·(1 − ν²)/(π·E) [m²/N].

        A line contact has no stiffness of its own, it depends on how deep in the bodies one measures and a little on
        the load; this is the constant that the potential energy method takes. Source: Yang & Sun 1985, as used by
        Yang & Lin 1987 and Wu, Zuo & Parey 2008.
        """
        return 4.0 * (1.0 - self.poisson**2) / (pi * self.young)


STEEL = Material()  # Steel as ISO 6336-1 has it: 206 GPa, 0.3


class Beam(NamedTuple):
    """A symmetric beam of unit width that is clamped at its first station.

    Args:
        height: of the stations along the middle line, rising [m], (n,).
        half: half the thickness there [m], (n,).
    """

    height: Array
    half: Array


def bend(
    beam: Beam, place: ArrayLike, offset: ArrayLike, angle: ArrayLike, material: Material = STEEL
) -> tuple[Array, Array, Array]:
    """Return the compliances of a cantilever in the direction of a force at its side.

    The force acts at a height ``place`` and a distance ``offset`` from the middle line; its component across the beam
    is cos of ``angle``, the one towards the clamp sin. With I = 2·h³/3 and A = 2·h a unit of width:
    bending ∫[(d − x)·cos α − y·sin α]²/(E·I)dx, shear ∫1.2·cos²α/(G·A)dx, compression ∫sin²α/(E·A)dx, each from the
    clamp to the place.

    Args:
        beam: its stations; between two of them 1/I and 1/A are straight.
        place: height d of the force [m], (m,).
        offset: its distance y from the middle line [m], (m,).
        angle: α, by which it points to the clamp [rad], (m,).
        material: of the beam.

    Returns:
        Compliance from bending, shear and compression for a unit of width [m²/N], (m,) each.

    Source: Yang & Lin 1987; Tian 2004 for shear; the lubricated dual-clutch transmission, eq. (9).

    >>> slab = Beam(np.linspace(0.0, 0.05, 401), np.full(401, 1e-3))
    >>> bending, _, _ = bend(slab, 0.05, 0.0, 0.0)
    >>> round(float(bending * STEEL.young * (2e-3) ** 3 / 12 / (0.05**3 / 3)), 5)
    1.0
    """
    x = beam.height - beam.height[0]
    inertia, area = 1.5 / beam.half**3, 0.5 / beam.half
    sums = [_running(x, inertia * x**power) for power in range(3)] + [_running(x, area)]
    at = np.asarray(place, float) - beam.height[0]
    c, s = np.cos(angle), np.sin(angle)
    zeroth, first, second, length = (np.interp(at, x, total) for total in sums)
    arm = at * c - np.asarray(offset, float) * s
    bending = (arm**2 * zeroth - 2.0 * arm * c * first + c**2 * second) / material.young
    shear = SHEAR_FACTOR * c**2 * length / material.shear
    return bending, shear, s**2 * length / material.young


def _running(x: Array, y: Array) -> Array:
    """Integral of y from the first x on, by trapezia."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(x))])


# A to F of L*, M*, P* and Q*
COEFFICIENTS = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)


def foundation(
    arm: ArrayLike,
    angle: ArrayLike,
    thickness: float,
    root_angle: float,
    body_ratio: float = BODY_RATIO[0],
    material: Material = STEEL,
) -> NDArray[np.float64]:
    """Return how far a tooth moves with its body, cos²α/E·(L*·(u/S)² + M*·u/S + P*·(1 + Q*·tan²α)).

    The body is an elastic ring that stands still at the bore, so the twist between bore and root is part of it: P*
    grows with the square of the ratio of the radii. Outside the range of the fit its nearest end is taken.

    Args:
        arm: u, from the root circle to where the force crosses the middle of the tooth [m], (m,).
        angle: α, by which the force points to the axis [rad], (m,).
        thickness: S of the tooth at the root [m].
        root_angle: half the angle that the tooth spans there [rad].
        body_ratio: root radius over bore radius.
        material: of the gear.

    Returns:
        Compliance for a unit of width, in the direction of the force [m²/N], (m,).

    Source: Sainsot, Velex & Duverger 2004; the lubricated dual-clutch transmission, eq. (9).

    >>> far, near = foundation([4e-3, 2e-3], 0.35, 6e-3, 0.05, 2.0)
    >>> bool(far > near)
    True
    """
    theta, ratio = float(np.clip(root_angle, *ROOT_ANGLE)), float(np.clip(body_ratio, *BODY_RATIO))
    terms = np.array([theta**-2, ratio**2, ratio / theta, 1.0 / theta, ratio, 1.0])
    second, first, constant, slant = COEFFICIENTS @ terms
    lever = np.asarray(arm, float) / thickness
    shape = second * lever**2 + first * lever + constant * (1.0 + slant * np.tan(angle) ** 2)
    return np.cos(angle) ** 2 * shape / material.young


class Compliance(NamedTuple):
    """Compliance of one tooth in the direction of a force, for a unit of length along the tooth [m²/N].

    Args:
        bending: of the tooth as a cantilever.
        shear: of the tooth.
        axial: of the tooth, pressed towards its root.
        foundation: of the body under it.
    """

    bending: Array
    shear: Array
    axial: Array
    foundation: Array

    @property
    def total(self) -> Array:
        """The sum [m²/N]."""
        return self.bending + self.shear + self.axial + self.foundation


def tooth_compliance(pair: Pair, which: str, roll: ArrayLike, material: Material = STEEL) -> Compliance:
    """Return the compliance of a tooth normal to its flank.

    A helical tooth bends across its own direction: its section is the transverse one with all that lies across the
    middle of the tooth, thickness and tangent of the force's angle, times cos β. Deviations and reliefs do not enter.

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.
        roll: roll angle of the flank where the force acts [rad], (m,).
        material: of the gear.

    Returns:
        The compliances for a unit of length along the tooth.

    Source: the lubricated dual-clutch transmission, eq. (9): potential energy method.

    >>> from gears3d.gears import Gear, Pair
    >>> gear = Gear(2e-3, 30)
    >>> low, high = tooth_compliance(Pair.from_backlash(gear, gear, 1e-4), "drive", [0.3, 0.5]).total
    >>> bool(high > low)
    True
    """
    gear, half = pair.gear(which), pair.half_angle(which)
    across = cos(gear.helix_angle)
    beam = _section(gear, half, across)
    rolls = np.asarray(roll, float)
    slant = np.arctan(np.tan(rolls - half) * across)
    radius, polar = _flank(gear, half, rolls)
    place, offset = radius * np.cos(polar), radius * np.sin(polar) * across
    bending, shear, axial = bend(beam, place, offset, slant, material)
    arm = np.maximum(place - offset * np.tan(slant) - gear.root_radius, 0.0)
    narrow = float(beam.half[0] / gear.root_radius) * cos(gear.helix_angle) ** 2  # on the wider virtual root circle
    ratio = BODY_RATIO[0] if gear.bore is None else 2.0 * gear.root_radius / gear.bore
    body = foundation(arm, slant, 2.0 * float(beam.half[0]), narrow, ratio, material)
    return Compliance(bending, shear, axial, body)


def _flank(gear: Gear, half: float, roll: Array) -> tuple[Array, Array]:
    """Distance from the axis [m] and angle from the middle of the tooth [rad] of points of the involute."""
    return gear.base_radius * np.hypot(1.0, roll), half - (roll - np.arctan(roll))


def _section(gear: Gear, half: float, across: float) -> Beam:
    """The tooth from root circle to tip; what lies across its middle is scaled."""
    lowest, first = form(gear, half)
    angles = 0.5 * pi - (0.5 * pi - first) * np.linspace(0.0, 1.0, STATIONS)
    curve = fillet_points(gear, half, angles)
    rolls = np.linspace(lowest, gear.tip_roll, STATIONS + 1)[1:]
    radius, polar = _flank(gear, half, rolls)
    radius, polar = np.append(curve[:, 0], radius), np.append(curve[:, 1], polar)
    height, side = radius * np.cos(polar), radius * np.sin(polar)
    rising = np.append(True, np.diff(np.maximum.accumulate(height)) > 0.0)
    return Beam(height[rising], across * side[rising])
