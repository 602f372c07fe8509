"""Drag of a gear that dips into oil, by plates in turbulent flow, and of its bearing.

"The lubricated dual-clutch transmission" is the paper on the nonlinear rattle of a lubricated helical pair, its
equations quoted by number. A gear of a gearbox has Reynolds numbers of 10⁴ to 10⁵, short of those for which plates are
turbulent: the two churning laws are upper ends.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

PLATE = 0.036
"""Force of a turbulent plate over ½·ρ·U²·L·Re^(−1/5), with its factor ½."""


def end_faces(radius: float, height: float, density: float, kinematic_viscosity: float, speed: ArrayLike) -> np.ndarray:
    """Return the drag of oil on both faces of a gear, rings of plates as long as the arc that each dips.

    T = 2·∫ 0.036·ν^(1/5)·ρ·ω^(9/5)·r^(18/5)·(2θ)^(4/5) dr with cos θ = height/r. Printed, the arc divides, with which
    the torque would fall with the depth, and the ring is as wide as a step along the oil's surface, which holds only
    for an axis at that height.

    Args:
        radius: of the face [m].
        height: of the axis above the oil, between −radius and radius [m].
        density: ρ [kg/m³].
        kinematic_viscosity: ν [m²/s].
        speed: ω [rad/s].

    Returns:
        Torque [N·m], of the shape of ``speed``.

    Raises:
        ValueError: the gear does not dip, or nothing of it shows.

    Source: the lubricated dual-clutch transmission, eq. (15), restored.

    >>> round(float(end_faces(0.065, 0.045, 816.0, 12e-6, 62.1)), 4)
    0.0076
    """
    _check(radius, height)
    nodes, weights = np.polynomial.legendre.leggauss(64)
    low = max(height, 0.0)
    u = 0.5 * (nodes + 1.0)
    ring = low + (radius - low) * u**2  # the arc begins like a root
    arc = 2.0 * np.arccos(np.clip(height / ring, -1.0, 1.0))
    total = np.sum(weights * u * (radius - low) * ring**3.6 * arc**0.8)
    turning = np.asarray(speed, float)
    return 2.0 * PLATE * kinematic_viscosity**0.2 * density * np.abs(turning) ** 1.8 * np.sign(turning) * total


def periphery(
    radius: float, face_width: float, height: float, density: float, kinematic_viscosity: float, speed: ArrayLike
) -> np.ndarray:
    """Return the drag of oil on the rim of a gear, r·0.036·(ω·r)^(9/5)·ν^(1/5)·ρ·R^(4/5)·B; R the arc that dips.

    Printed is the force without its lever r.

    Args:
        radius: r [m].
        face_width: B [m].
        height: of the axis above the oil, between −radius and radius [m].
        density: ρ [kg/m³].
        kinematic_viscosity: ν [m²/s].
        speed: ω [rad/s].

    Returns:
        Torque [N·m], of the shape of ``speed``.

    Raises:
        ValueError: the gear does not dip, or nothing of it shows.

    Source: the lubricated dual-clutch transmission, eq. (16).

    >>> round(float(periphery(0.065, 16e-3, 0.045, 816.0, 12e-6, 62.1)), 4)
    0.0064
    """
    _check(radius, height)
    arc = 2.0 * np.arccos(height / radius) * radius
    turning = np.asarray(speed, float)
    force = PLATE * np.abs(turning * radius) ** 1.8 * kinematic_viscosity**0.2 * density * arc**0.8 * face_width
    return radius * force * np.sign(turning)


def rolling_bearing(factor: float, diameter: float, kinematic_viscosity: float, speed: ArrayLike) -> np.ndarray:
    """Return the drag of a bearing without load: 10³·f0·(ν·N)^(2/3)·dm³, or 16·f0·dm³ below ν·N = 0.002.

    Args:
        factor: f0, of bearing and lubrication.
        diameter: dm, mean [m].
        kinematic_viscosity: ν [m²/s].
        speed: of the gear against its shaft [rad/s]; N in the formula is in rpm.

    Returns:
        Torque [N·m], of the shape of ``speed``.

    Source: the lubricated dual-clutch transmission, eq. (24); ISO/TR 14179-2.

    >>> round(float(rolling_bearing(12.0, 0.045, 12e-6, 62.1)), 4)
    0.0405
    """
    turning = np.asarray(speed, float)
    product = kinematic_viscosity * np.abs(turning) * 30.0 / np.pi
    torque = np.where(product >= 0.002, 1e3 * factor * product ** (2.0 / 3.0), 16.0 * factor) * diameter**3
    return torque * np.sign(turning)


def _check(radius: float, height: float) -> None:
    if not -radius < height < radius:
        raise ValueError(f"an axis {height:.6g} m above the oil does not let a gear of {radius:.6g} m dip into it")
