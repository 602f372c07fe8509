"""Drag torques on a gear that turns freely, and the run-downs from which they are measured.

A drag torque resists: it has the sign of the speed, and the equation of motion subtracts it.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike


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
    """Return the torque of bearings and encoder behind a run-down Ω(t) = a + b·e^(−λt).

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
