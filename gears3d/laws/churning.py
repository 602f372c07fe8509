"""The torque of a gear that churns oil, after Changenet & Velex (2007) as Kadmiri et al. (2012) use it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

LAMINAR_END = 6000.0  # Ω·R·B/ν up to which the first form of the torque coefficient holds
TURBULENT_START = 9000.0  # Ω·R·B/ν from which the second form holds; between the two the coefficient is interpolated
GRAVITY = 9.81  # m/s²


def wetted_surface(radius: float, face_width: float, depth: float, flanks: float = 0.0) -> float:
    """Return the submerged surface of a gear, S = R²·(2θ − sin 2θ) + 2·R·B·θ + flanks with cos θ = 1 − h/R.

    Source: Changenet & Velex 2007, as cited for Kadmiri et al. 2012, eq. (10).

    Args:
        radius: R, of the reference circle [m].
        face_width: B [m].
        depth: h, how deep the reference circle dips into the oil, at most its diameter [m].
        flanks: submerged surface of the tooth flanks beyond the reference cylinder [m²].

    Raises:
        ValueError: the depth is not between 0 and the diameter.

    >>> round(wetted_surface(0.05, 0.02, 0.05), 6)  # half immersed: half of both faces, half of the periphery
    0.010996
    """
    if not 0.0 <= depth <= 2 * radius:
        raise ValueError(f"a depth of {depth:.6g} m does not lie between 0 and the diameter {2 * radius:.6g} m")
    angle = float(np.arccos(1.0 - depth / radius))
    return radius**2 * (2 * angle - float(np.sin(2 * angle))) + 2 * radius * face_width * angle + flanks


def torque_coefficient(
    radius: float, face_width: float, depth: float, volume: float, kinematic_viscosity: ArrayLike, speed: ArrayLike
) -> np.ndarray:
    """Return the dimensionless torque Cm of a churning gear.

    Up to Ω·R·B/ν = 6000 it is 1.366·(h/D)^0.45·(V/D³)^0.1·Fr^−0.6·Re^−0.21, from 9000 on
    3.644·(h/D)^0.1·(V/D³)^−0.35·Fr^−0.88·(B/D)^0.85, between them a straight line, with Fr = Ω²·R/g and Re = Ω·R²/ν.
    The forms need not meet, so the torque may fall with the speed between the two limits.
    Source: Kadmiri et al. 2012, eqs (11) and (12), restored; the second form and the limits from Changenet & Velex
    2007 as quoted in the literature.

    Args:
        radius: R = D/2, of the reference circle [m].
        face_width: B [m].
        depth: h [m].
        volume: of the oil in the sump, V [m³].
        kinematic_viscosity: ν [m²/s].
        speed: Ω, not 0 [rad/s].

    Returns:
        Coefficient, of the common shape of ``kinematic_viscosity`` and ``speed``.

    >>> round(float(torque_coefficient(0.05, 0.02, 0.05, 2e-3, 35e-6, 40.0)), 6)
    0.057213
    """
    speed, viscosity = np.abs(np.asarray(speed, dtype=float)), np.asarray(kinematic_viscosity, dtype=float)
    diameter = 2 * radius
    froude, reynolds = speed**2 * radius / GRAVITY, speed * radius**2 / viscosity
    dip, sump, width = depth / diameter, volume / diameter**3, face_width / diameter
    laminar = 1.366 * dip**0.45 * sump**0.1 * froude**-0.6 * reynolds**-0.21
    turbulent = 3.644 * dip**0.1 * sump**-0.35 * froude**-0.88 * width**0.85
    passed = (speed * radius * face_width / viscosity - LAMINAR_END) / (TURBULENT_START - LAMINAR_END)
    part = np.clip(passed, 0.0, 1.0)
    return (1.0 - part) * laminar + part * turbulent


def churning(
    radius: float,
    face_width: float,
    depth: float,
    volume: float,
    density: ArrayLike,
    viscosity: ArrayLike,
    speed: ArrayLike,
    flanks: float = 0.0,
) -> np.ndarray:
    """Return the churning torque C3 = ½·ρ·Ω²·S·R³·Cm, with the sign of Ω; as Ω^0.59·µ^0.21 in the first form.

    The damaged print reads like S·h³ for ½·S·R³ and D for R in Froude and Reynolds number; the source has this form.
    Source: Kadmiri et al. 2012, eqs (10) to (12).

    Args:
        radius: R, of the reference circle [m].
        face_width: B [m].
        depth: h [m].
        volume: of the oil in the sump, V [m³].
        density: ρ [kg/m³].
        viscosity: dynamic, µ [Pa·s].
        speed: Ω [rad/s]; 0 gives 0.
        flanks: submerged surface of the tooth flanks beyond the reference cylinder [m²].

    Returns:
        Torque [N·m], of the common shape of ``density``, ``viscosity`` and ``speed``.

    >>> round(float(churning(0.05, 0.02, 0.05, 2e-3, 850.0, 0.02975, 40.0)), 6)
    0.053472
    """
    speed, density = np.asarray(speed, dtype=float), np.asarray(density, dtype=float)
    turning = np.where(speed == 0.0, 1.0, speed)
    kinematic = np.asarray(viscosity, dtype=float) / density
    coefficient = torque_coefficient(radius, face_width, depth, volume, kinematic, turning)
    surface = wetted_surface(radius, face_width, depth, flanks)
    return 0.5 * density * speed * np.abs(speed) * surface * radius**3 * coefficient
