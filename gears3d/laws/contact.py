"""The loose gear along the line of action: what drives it, what it weighs, what holds it, what an impact gives it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def drive_amplitude(speed: ArrayLike, base_radius: float, omega: ArrayLike) -> np.ndarray:
    """Return the amplitude of the drive's displacement along the line of action, H = A'·Rb1/ω.

    Source: Kadmiri et al. 2012, eq. (26).

    Args:
        speed: amplitude A' of the drive's rotational speed [rad/s].
        base_radius: Rb1, of the drive gear [m].
        omega: circular frequency ω of the fluctuation [rad/s].

    Returns:
        Amplitude [m], of the common shape of ``speed`` and ``omega``.

    >>> round(float(drive_amplitude(4.19, 0.0254, 156.9)), 6)
    0.000678
    """
    return np.asarray(speed, dtype=float) * base_radius / np.asarray(omega, dtype=float)


def drag_force(torque: ArrayLike, base_radius: float) -> np.ndarray:
    """Return the drag as a force along the line of action, F = C/Rb2.

    Source: Kadmiri et al. 2012, eq. (17).

    Args:
        torque: C, on the loose gear [N·m].
        base_radius: Rb2, of the loose gear [m].

    Returns:
        Force [N], of the shape of ``torque``.

    >>> round(float(drag_force(0.893, 0.051)), 3)
    17.51
    """
    return np.asarray(torque, dtype=float) / base_radius


def equivalent_mass(inertia: float, base_radius: float) -> float:
    """Return the loose gear's mass along the line of action, m = Ig/Rb2².

    Source: Kadmiri et al. 2012, eq. (16).

    Args:
        inertia: Ig [kg·m²].
        base_radius: Rb2, of the loose gear [m].

    >>> round(equivalent_mass(9.884e-4, 0.051), 4)
    0.38
    """
    return inertia / base_radius**2


def reaction(
    force: float, mass: float, drive_acceleration: ArrayLike, backlash_acceleration: ArrayLike = 0.0
) -> np.ndarray:
    """Return the force that keeps the loose gear on a flank, R = F + m·(ÿ + j̈).

    The active flank (without j̈) holds while R > 0, the reverse flank while R < 0. Source: Kadmiri et al. 2012,
    eqs (21) and (22); the print of (22) has no j̈, which is right for a constant backlash only.

    Args:
        force: F, of the drag [N].
        mass: m [kg].
        drive_acceleration: ÿ, of the flank that drives [m/s²].
        backlash_acceleration: j̈, on the reverse flank [m/s²].

    Returns:
        Force on the loose gear [N], of the common shape of the accelerations.

    >>> reaction(17.5, 0.38, [0.0, -100.0]).tolist()
    [17.5, -20.5]
    """
    accelerations = np.asarray(drive_acceleration, dtype=float) + np.asarray(backlash_acceleration, dtype=float)
    return force + mass * accelerations


def impulse(mass: float, velocity: ArrayLike, coefficient: ArrayLike) -> np.ndarray:
    """Return the impulse on the loose gear, I = −m·(1 + e)·ṡ⁻: positive on the active flank.

    Source: Kadmiri et al. 2012, eqs (27) and (28).

    Args:
        mass: m [kg].
        velocity: approach velocity ṡ⁻ [m/s].
        coefficient: e, of restitution.

    Returns:
        Impulse [N·s], of the common shape of ``velocity`` and ``coefficient``.

    >>> impulse(0.38, [-0.1, 0.1], 0.3).round(6).tolist()
    [0.0494, -0.0494]
    """
    return -mass * (1.0 + np.asarray(coefficient, dtype=float)) * np.asarray(velocity, dtype=float)


def dimensionless_impulse(impulses: ArrayLike, mass: float, amplitude: ArrayLike, omega: ArrayLike) -> np.ndarray:
    """Return Ī = I/(m·H·ω), the impulse in units of the drive's own swing.

    Source: Kadmiri et al. 2012, eq. (29).

    Args:
        impulses: I [N·s].
        mass: m [kg].
        amplitude: H [m].
        omega: ω [rad/s].

    Returns:
        Dimensionless impulses, of the common shape of the arguments.

    >>> round(float(dimensionless_impulse(0.05, 0.38, 0.68e-3, 156.9)), 4)
    1.2333
    """
    swing = mass * np.asarray(amplitude, dtype=float) * np.asarray(omega, dtype=float)
    return np.asarray(impulses, dtype=float) / swing
