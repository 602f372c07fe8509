"""Laws of impact: compliant contact, and coefficients of restitution."""

from __future__ import annotations

import math

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
    Theory: docs/theory/rattle.md, equation (1).

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
    Theory: docs/theory/rattle.md, equation (1).

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
    Theory: docs/theory/rattle.md, equation (2).

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
    Theory: docs/theory/contact.md, equation (1).

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
    """Return Ī = I/(m·H·ω), the impulse in units of the drive's own speed fluctuation.

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
    scale = mass * np.asarray(amplitude, dtype=float) * np.asarray(omega, dtype=float)
    return np.asarray(impulses, dtype=float) / scale


def restitution(
    base: float,
    velocity: ArrayLike,
    slope: float = 0.0,
    asymmetry: float = 0.0,
    deviation: float = 0.0,
    normal: ArrayLike = 0.0,
) -> np.ndarray:
    """Return e = clip(e0 + slope·|v| ± asymmetry/2 + deviation·z, 0, 1), + on the active flank, − on the reverse one.

    Constant with ``base`` alone. Impacts on the active flank have a negative velocity, the reverse one with a positive.
    Source: Kadmiri et al. 2012, eqs (3), (19), (20) and fig. 7: linear in the speed, with a normal scatter.
    Theory: docs/theory/contact.md, equation (2).

    Args:
        base: e0.
        velocity: approach velocity ṡ⁻ [m/s].
        slope: [s/m].
        asymmetry: how much larger the restitution of the active flank is than that of the reverse one.
        deviation: standard deviation of the scatter.
        normal: z, standard normal numbers.

    Returns:
        Coefficients, of the common shape of ``velocity`` and ``normal``.

    >>> restitution(0.5, [-0.02, 0.02, 0.2], slope=-5.0, asymmetry=0.1).round(6).tolist()
    [0.45, 0.35, 0.0]
    """
    velocity = np.asarray(velocity, dtype=float)
    side = -0.5 * asymmetry * np.sign(velocity)
    return np.clip(base + slope * np.abs(velocity) + side + deviation * np.asarray(normal, dtype=float), 0.0, 1.0)


def damping_ratio(coefficient: ArrayLike) -> np.ndarray:
    """Return the damping ratio of a linear spring and damper with restitution e, ζ = −ln e/√(π² + ln² e).

    Source: Rigaud & Perret-Liaudet 2020, eq. (20), with the square that the print leaves out.

    Args:
        coefficient: e, from 0 to 1.

    Returns:
        Ratio, 0 at e = 1 and 1 at e = 0, of the shape of ``coefficient``.

    >>> damping_ratio([0.0, 0.3, 1.0]).round(6).tolist()
    [1.0, 0.357857, 0.0]
    """
    with np.errstate(divide="ignore"):
        return 1.0 / np.hypot(1.0, np.pi / np.log(np.asarray(coefficient, dtype=float)))


def restitution_of(ratio: ArrayLike) -> np.ndarray:
    """Return the restitution of a spring and damper of ratio ζ, e = exp(−π·ζ/√(1 − ζ²)).

    The contact lasts half a damped period and may pull at its end. Source: Rigaud & Perret-Liaudet 2020, eq. (20),
    inverted.

    Args:
        ratio: ζ, from 0 to 1.

    Returns:
        Coefficients, of the shape of ``ratio``.

    >>> restitution_of([0.0, 0.357857, 1.0]).round(5).tolist()
    [1.0, 0.3, 0.0]
    """
    ratio = np.asarray(ratio, dtype=float)
    with np.errstate(divide="ignore"):
        return np.exp(-np.pi * ratio / np.sqrt(1.0 - ratio**2))


def scatter(seed: int, index: int) -> float:
    """Return the standard normal number that belongs to an impact: seed and index alone make it.

    Every model that asks for the same impact draws the same number, so that scattered runs can be compared with each
    other impact by impact.

    Args:
        seed: of the run.
        index: of the impact, counted from 0.

    Source: Steele, Lea & Flood 2014 (splitmix64); Box & Muller 1958.

    >>> round(scatter(0, 0), 6) == round(scatter(0, 1), 6), scatter(3, 7) == scatter(3, 7)
    (False, True)
    """
    whole, uniform = (1 << 64) - 1, []
    for i in (1, 2):
        z = (seed * 0xD1342543DE82EF95 + (2 * index + i) * 0x9E3779B97F4A7C15) & whole
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & whole
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & whole
        uniform.append((float((z ^ (z >> 31)) >> 11) + 0.5) / 2**53)
    return math.sqrt(-2.0 * math.log(uniform[0])) * math.cos(2.0 * math.pi * uniform[1])
