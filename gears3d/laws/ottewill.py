"""The dimensionless rattle of Ottewill et al. 2010: time in revolutions, displacements in rad.

θ1 = 2πτ + ε·cos(2πτ + ϕ), x = θ1 − θ2 − e, drive contact at x = +β, reverse contact at x = −β.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gears3d.laws.error_function import Orders

NO_ERROR = Orders(np.zeros(0, dtype=int), np.zeros(0), np.zeros(0))


class Dimensional(NamedTuple):
    """The same rig in SI units.

    Args:
        inertia: of the loose gear [kg·m²].
        drag_viscous: drag of the loose gear's bearings [N·m·s/rad].
        mesh_drag: what contact adds to it [N·m·s/rad].
        backlash: width of the dead band along the line of action [m].
    """

    inertia: float
    drag_viscous: float
    mesh_drag: float
    backlash: float


def dimensional(
    damping: float, damping_contact: float, half_backlash: float, inertia: float, speed: float, base_radius: float
) -> Dimensional:
    """Return the rig in SI units: c = δ·I·Ω, contact adds (δcontact − δ)·I·Ω, b = 2β·Rb.

    Source: Ottewill et al. 2010, eqs (2), (6), (8) and (12).

    Args:
        damping: δ of free flight.
        damping_contact: δcontact.
        half_backlash: β [rad].
        inertia: I [kg·m²].
        speed: Ω [revolutions/s].
        base_radius: Rb [m].

    >>> dimensional(2.3, 4.2, 1.63e-2, 0.01, 1.0, 0.050743).drag_viscous
    0.023
    """
    flow = inertia * speed
    return Dimensional(inertia, damping * flow, (damping_contact - damping) * flow, 2 * half_backlash * base_radius)


def displacement(x: ArrayLike, half_backlash: float, base_radius: float) -> np.ndarray:
    """Return the displacement above the active flank, s − φ = (β − x)·Rb; the error is φ = −e·Rb.

    Source: Ottewill et al. 2010, eq. (6).

    Args:
        x: dynamic transmission error [rad].
        half_backlash: β [rad].
        base_radius: Rb [m].

    Returns:
        Displacement [m], of the shape of ``x``.

    >>> displacement([0.0163, -0.0163], 0.0163, 0.05).round(6).tolist()
    [0.0, 0.00163]
    """
    return (half_backlash - np.asarray(x, dtype=float)) * base_radius


def drive(revolutions: ArrayLike, amplitude: float, phase: float, derivative: int = 0) -> np.ndarray:
    """Return the drive's angle θ1 = 2πτ + ε·cos(2πτ + ϕ), or its first or second derivative by τ.

    Source: Ottewill et al. 2010, eq. (1).

    Args:
        revolutions: τ.
        amplitude: ε [rad].
        phase: ϕ [rad].
        derivative: 0, 1 or 2.

    Returns:
        Angle [rad], of the shape of ``revolutions``.

    >>> float(drive(0.0, 0.4, 0.0)), round(float(drive(0.25, 0.0, 0.0, 1)), 6)
    (0.4, 6.283185)
    """
    turned = 2 * np.pi * np.asarray(revolutions, dtype=float)
    mean = (turned, 2 * np.pi, 0.0)[derivative]
    return mean + amplitude * (2 * np.pi) ** derivative * np.cos(turned + phase + 0.5 * np.pi * derivative)


def forcing(
    revolutions: ArrayLike, amplitude: float, phase: float, damping: float, error: Orders = NO_ERROR
) -> np.ndarray:
    """Return 2πδ − 2πε·√(4π² + δ²)·cos(2πτ + ϕ − atan(δ/2π)) − e'' − δ·e', primes by τ, e a function of θ1.

    With δcontact it is the flank's push: contact ends when it turns negative. With δ it drives the free flight.
    Source: Ottewill et al. 2010, eqs (7), (9), (12) and (13).

    Args:
        revolutions: τ.
        amplitude: ε [rad].
        phase: ϕ [rad].
        damping: δ or δcontact.
        error: e over θ1 [rad].

    Returns:
        Acceleration of x by τ [rad], of the shape of ``revolutions``.

    >>> round(float(forcing(0.0, 0.343749, np.arctan(2.3 / (2 * np.pi)), 2.3)), 4)  # just before contact is lost
    0.0
    """
    turned = 2 * np.pi * np.asarray(revolutions, dtype=float) + phase
    reach = 2 * np.pi * amplitude * np.hypot(2 * np.pi, damping)
    given = 2 * np.pi * damping - reach * np.cos(turned - np.arctan(damping / (2 * np.pi)))
    if not len(error.order):
        return given
    angle = drive(revolutions, amplitude, phase)
    speed, acceleration = drive(revolutions, amplitude, phase, 1), drive(revolutions, amplitude, phase, 2)
    slope = error.at(angle, 1)
    return given - error.at(angle, 2) * speed**2 - slope * acceleration - damping * slope * speed


def loss_amplitude(damping: ArrayLike) -> np.ndarray:
    """Return the amplitude above which a pair without errors loses contact, ε* = δ/√(4π² + δ²).

    Source: Ottewill et al. 2010, eq. (12) with e = 0.

    Args:
        damping: δcontact.

    Returns:
        Amplitudes [rad], of the shape of ``damping``.

    >>> loss_amplitude([2.3, 3.7, 4.2]).round(6).tolist()
    [0.343749, 0.507429, 0.555727]
    """
    damping = np.asarray(damping, dtype=float)
    return damping / np.hypot(2 * np.pi, damping)


def rundown_angle(final: float, damping: float, revolutions: ArrayLike) -> np.ndarray:
    """Return the angle of a shaft that runs down under viscous damping alone, θ∞·(1 − e^(−δτ)).

    Source: Ottewill et al. 2010, eq. (15).

    Args:
        final: θ∞ [rad].
        damping: δ.
        revolutions: τ = Ω·t.

    Returns:
        Angle [rad], of the shape of ``revolutions``.

    >>> rundown_angle(2.0, 2.3, [0.0, 1e9]).tolist()
    [0.0, 2.0]
    """
    return final * (1.0 - np.exp(-damping * np.asarray(revolutions, dtype=float)))


def rundown_damping(revolutions: ArrayLike, angle: ArrayLike, final: float) -> np.ndarray:
    """Return the damping at each moment of a coast-down, the slope of −ln(θ∞ − θ2) over τ.

    Source: Ottewill et al. 2010, eq. (16).

    Args:
        revolutions: τ, (n,).
        angle: θ2, less than ``final`` [rad], (n,).
        final: θ∞ [rad].

    Returns:
        δ, (n,).

    >>> tau = np.linspace(0.0, 1.0, 5)
    >>> rundown_damping(tau, rundown_angle(2.0, 2.3, tau), 2.0).round(6).tolist()
    [2.3, 2.3, 2.3, 2.3, 2.3]
    """
    left = final - np.asarray(angle, dtype=float)
    return -np.gradient(np.log(left), np.asarray(revolutions, dtype=float))
