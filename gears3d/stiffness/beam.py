"""A tooth as a cantilever whose thickness changes: bending, shear and compression from the energy that they store."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.stiffness.material import STEEL, Material

Array = NDArray[np.float64]

SHEAR_FACTOR = 1.2
"""Of a rectangular section: its shear energy over that of an even stress."""


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
