"""Torques that resist an idle gear: Coulomb, bearings, and oil that end faces and periphery shear."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

PLATE = 0.036  # Force of a turbulent plate over ½·ρ·U²·L·Re^(−1/5), with its factor ½


def coulomb(torque: float, speed: ArrayLike) -> np.ndarray:
    """Return dry friction, C = torque·sgn Ω; 0 at rest, where it takes any value up to ``torque``.

    Source: Rigaud & Perret-Liaudet 2020, section 4: run-downs with a constant deceleration.

    Args:
        torque: of sliding [N·m].
        speed: Ω [rad/s].

    Returns:
        Torque [N·m], of the shape of ``speed``.

    >>> coulomb(0.22, [-3.0, 0.0, 3.0]).tolist()
    [-0.22, 0.0, 0.22]
    """
    return torque * np.sign(np.asarray(speed, dtype=float))


def viscous(coefficient: float, speed: ArrayLike) -> np.ndarray:
    """Return the torque of a laminar film, C = cv·Ω.

    Source: Kadmiri et al. 2012, eq. (6).

    Args:
        coefficient: cv [N·m·s/rad].
        speed: Ω [rad/s].

    Returns:
        Torque [N·m], of the shape of ``speed``.

    >>> viscous(1e-3, [10.0, -20.0]).tolist()
    [0.01, -0.02]
    """
    return coefficient * np.asarray(speed, dtype=float)


def power(coefficient: float, exponent: float, speed: ArrayLike) -> np.ndarray:
    """Return a churning torque fitted as a power of the speed, C = K·|Ω|^β·sgn Ω.

    Source: Kadmiri et al. 2012, eq. (7).

    Args:
        coefficient: K [N·m·(s/rad)^β].
        exponent: β.
        speed: Ω [rad/s].

    Returns:
        Torque [N·m], of the shape of ``speed``.

    >>> power(0.01, 0.5, [-4.0, 9.0]).tolist()
    [-0.02, 0.03]
    """
    speed = np.asarray(speed, dtype=float)
    return coefficient * np.abs(speed) ** exponent * np.sign(speed)


def bearing(asymptote: float, rate: float, inertia: float, speed: ArrayLike) -> np.ndarray:
    """Return the torque of bearings and encoder behind a coast-down Ω(t) = a + b·e^(−λt).

    C1 = −Is·λ·a·sgn Ω + Is·λ·Ω: solid friction −Is·λ·a and viscous damping Is·λ.
    Source: Kadmiri et al. 2012, eqs (4) and (5).

    Args:
        asymptote: a, negative where there is solid friction [rad/s].
        rate: λ [1/s].
        inertia: Is, of everything that runs down [kg·m²].
        speed: Ω [rad/s].

    Returns:
        Torque [N·m], of the shape of ``speed``.

    >>> bearing(-20.0, 0.5, 0.01, [0.0, 100.0]).tolist()
    [0.0, 0.6]
    """
    return coulomb(-inertia * rate * asymptote, speed) + viscous(inertia * rate, speed)


def rundown(asymptote: float, start: float, rate: float, time: ArrayLike) -> np.ndarray:
    """Return the speed of a shaft that runs down under solid and viscous friction, Ω(t) = a + b·e^(−λt), then rest.

    Source: Kadmiri et al. 2012, eq. (4), with b = Ω(0) − a.

    Args:
        asymptote: a, at most 0 [rad/s].
        start: Ω(0), at least 0 [rad/s].
        rate: λ [1/s].
        time: since release [s].

    Returns:
        Speed [rad/s], of the shape of ``time``.

    >>> rundown(-25.0, 75.0, 0.5, [0.0, 10.0]).tolist()
    [75.0, 0.0]
    """
    decay = np.exp(-rate * np.asarray(time, dtype=float))
    return np.maximum(asymptote + (start - asymptote) * decay, 0.0)


def couette(
    viscosity: ArrayLike, length: float, radius: float, clearance: float, differential: ArrayLike
) -> np.ndarray:
    """Return the torque of the oil sheared between a gear and its shaft, C2 = 2π·µ·L·Rs³·ΔΩ/js.

    The speed is that of the gear against its shaft: the whole speed of the gear where the shaft stands still, the
    difference of the two where a ratio is engaged. Source: Kadmiri et al. 2012, eq. (8).

    Args:
        viscosity: dynamic, µ [Pa·s].
        length: of the interface, L [m].
        radius: of the shaft, Rs [m].
        clearance: radial, js [m].
        differential: ΔΩ [rad/s].

    Returns:
        Torque [N·m], of the common shape of ``viscosity`` and ``differential``.

    >>> round(float(couette(0.03, 0.02, 0.02, 50e-6, 80.0)), 6)
    0.048255
    """
    viscosity, differential = np.asarray(viscosity, dtype=float), np.asarray(differential, dtype=float)
    return 2 * np.pi * viscosity * length * radius**3 * differential / clearance


def seetharaman_sides(tip_diameter: float, density: ArrayLike, viscosity: ArrayLike, speed: ArrayLike) -> np.ndarray:
    """Return the oil drag on the sides of a half immersed gear, C3 = 0.0256·π·Dt⁴·√(ρ·µ·|Ω|³)·sgn Ω.

    Restored from a damaged print by its constants and dimensions. Half a von Kármán disc has 0.0192 in place of
    0.0256, laminar plates over the half discs 0.012 to 0.013: uncertain by a factor of two. Its exponent 1.5 conflicts
    with the run-downs of the paper that prints it. Source: Kadmiri et al. 2012, eq. (9).

    Args:
        tip_diameter: Dt [m].
        density: ρ [kg/m³].
        viscosity: dynamic, µ [Pa·s].
        speed: Ω [rad/s].

    Returns:
        Torque [N·m], of the common shape of the arguments.

    >>> round(float(seetharaman_sides(0.1, 850.0, 0.03, 100.0)), 6)
    0.040613
    """
    speed = np.asarray(speed, dtype=float)
    root = np.sqrt(np.asarray(density, dtype=float) * np.asarray(viscosity, dtype=float) * np.abs(speed) ** 3)
    return 0.0256 * np.pi * tip_diameter**4 * root * np.sign(speed)


def assembly(torques: Iterable[ArrayLike]) -> np.ndarray:
    """Return the drag of an assembly, the sum over its parts.

    Source: Kadmiri et al. 2012, eqs (5) to (7): C' = C1 + C2 + C3.

    Args:
        torques: one a part [N·m].

    Returns:
        Torque [N·m], of the common shape of the parts.

    >>> assembly([coulomb(0.2, [10.0, -10.0]), viscous(1e-3, [10.0, -10.0])]).tolist()
    [0.21000000000000002, -0.21000000000000002]
    """
    return np.sum(np.broadcast_arrays(*torques), axis=0, dtype=float)


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
