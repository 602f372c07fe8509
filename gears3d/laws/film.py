"""Oil: viscosity over temperature, squeeze and wedge of a film between two flanks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

KELVIN = 273.15
EXPANSION = 7e-4  # Volume expansion of a mineral oil [1/K]


def kinematic_viscosity(points: tuple[tuple[float, float], tuple[float, float]], temperature: ArrayLike) -> np.ndarray:
    """Return ν(T) from log₁₀ log₁₀(ν + 0.7) = A − B·log₁₀ T, with ν in mm²/s and T in kelvin.

    Source: ASTM D341, its form for ν above 2 mm²/s.

    Args:
        points: temperature [°C] and viscosity [m²/s] of two points, such as those at 40 and 100 °C.
        temperature: [°C].

    Returns:
        Viscosity [m²/s], of the shape of ``temperature``.

    Raises:
        ValueError: the points have one temperature, or a viscosity of at most 0.3 mm²/s.

    >>> (kinematic_viscosity(((40.0, 34e-6), (100.0, 7e-6)), [40.0, 75.0, 100.0]) * 1e6).round(3).tolist()
    [34.0, 11.978, 7.0]
    """
    (first, thick), (second, thin) = points
    if first == second:
        raise ValueError(f"both points lie at {first:.6g} °C; give two temperatures")
    if min(thick, thin) <= 0.3e-6:
        raise ValueError(f"a viscosity of {min(thick, thin):.6g} m²/s is outside the law; give more than 0.3e-6 m²/s")
    heights = [np.log10(np.log10(value * 1e6 + 0.7)) for value in (thick, thin)]
    places = [np.log10(value + KELVIN) for value in (first, second)]
    slope = (heights[1] - heights[0]) / (places[1] - places[0])
    height = heights[0] + slope * (np.log10(np.asarray(temperature, dtype=float) + KELVIN) - places[0])
    return (10 ** (10**height) - 0.7) * 1e-6


def density(at_15: float, temperature: ArrayLike) -> np.ndarray:
    """Return the density of an oil, ρ = ρ15/(1 + α·(T − 15 °C)) with α = 7e-4 1/K.

    Source: definition of the volume expansion, with a value usual for mineral oils.

    Args:
        at_15: density at 15 °C, as data sheets state it [kg/m³].
        temperature: [°C].

    Returns:
        Density [kg/m³], of the shape of ``temperature``.

    >>> density(850.0, [15.0, 75.0]).round(2).tolist()
    [850.0, 815.74]
    """
    return at_15 / (1.0 + EXPANSION * (np.asarray(temperature, dtype=float) - 15.0))


def dynamic_viscosity(
    points: tuple[tuple[float, float], tuple[float, float]], at_15: float, temperature: ArrayLike
) -> np.ndarray:
    """Return µ(T) = ρ(T)·ν(T).

    Source: ASTM D341 for ν.

    Args:
        points: temperature [°C] and kinematic viscosity [m²/s] of two points.
        at_15: density at 15 °C [kg/m³].
        temperature: [°C].

    Returns:
        Viscosity [Pa·s], of the shape of ``temperature``.

    >>> round(float(dynamic_viscosity(((40.0, 34e-6), (100.0, 7e-6)), 850.0, 75.0)), 5)
    0.00977
    """
    return density(at_15, temperature) * kinematic_viscosity(points, temperature)


def equivalent_radius(
    base_radius_drive: float, base_radius_loose: float, pressure_angle: float, base_helix_angle: float
) -> float:
    """Return the radius of the cylinder on a plane that two flanks amount to at the pitch point [m].

    1/r = cos(beta_b)·(1/ρ1 + 1/ρ2) with ρ = Rb·tan α: the curvatures of two involutes in the normal section.

    Args:
        base_radius_drive: [m].
        base_radius_loose: [m].
        pressure_angle: working, transverse [rad].
        base_helix_angle: [rad].

    Source: Kadmiri et al. 2012, eq. (2), in the normal section of a helical pair.

    >>> round(equivalent_radius(24.476e-3, 61.909e-3, 0.391006, 0.456892), 6)
    0.008057
    """
    transverse = np.tan(pressure_angle) / (1.0 / base_radius_drive + 1.0 / base_radius_loose)
    return float(transverse / np.cos(base_helix_angle))


def contact_length(face_width: float, contact_ratio: float, base_helix_angle: float) -> float:
    """Return the mean length of all lines of contact together, L = b·ε_α/cos(beta_b) [m].

    Args:
        face_width: [m].
        contact_ratio: transverse.
        base_helix_angle: [rad].

    Source: geometry (ISO 21771); L of the lubricated dual-clutch transmission, eq. (12).

    >>> round(contact_length(16e-3, 1.372, 0.456892), 5)
    0.02446
    """
    return float(face_width * contact_ratio / np.cos(base_helix_angle))


def rolling_radius(base_radius: float, pressure_angle: float, base_helix_angle: float) -> float:
    """Return what a gear's speed is multiplied with to get its share of the entraining speed [m].

    v = ω·Rb·tan α is the speed of the flank past the pitch point, and the share v·cos(beta)/cos(beta_b) with
    tan(beta) = tan(beta_b)/cos(α) on the pitch cylinder.

    Args:
        base_radius: [m].
        pressure_angle: working, transverse [rad].
        base_helix_angle: [rad].

    Source: the lubricated dual-clutch transmission, eq. (13).

    >>> round(2 * 157.08 * rolling_radius(24.476e-3, 0.391006, 0.456892), 2)
    3.12
    """
    helix = np.arctan(np.tan(base_helix_angle) / np.cos(pressure_angle))
    return float(base_radius * np.tan(pressure_angle) * np.cos(helix) / np.cos(base_helix_angle))


def entraining_speed(v_drive: Any, v_loose: Any, helix_angle: float, base_helix_angle: float) -> Any:
    """Return the speed that draws oil in, u = (vp + vg)·cos(beta)/cos(beta_b) [m/s].

    Args:
        v_drive: rolling speed of the drive gear's flank [m/s].
        v_loose: rolling speed of the loose gear's flank [m/s].
        helix_angle: on the pitch cylinder [rad].
        base_helix_angle: [rad].

    Source: the lubricated dual-clutch transmission, eq. (13).

    >>> round(float(entraining_speed(1.0, 1.0, 0.488692, 0.456892)), 4)
    1.9677
    """
    return (np.asarray(v_drive) + v_loose) * (np.cos(helix_angle) / np.cos(base_helix_angle))


def wedge(thickness: Any, length: float, viscosity: float, radius: float) -> Any:
    """Return the wedge coefficient, Cw = 2·L·η0·req/h [N·s/m].

    It is that of Reynolds' equation with the half-Sommerfeld condition and the *sum* of the rolling speeds.

    Args:
        thickness: of the film, h [m].
        length: of the lines of contact [m].
        viscosity: dynamic [Pa·s].
        radius: equivalent [m].

    Source: the lubricated dual-clutch transmission, eq. (12).
    Theory: docs/theory/contact.md, equation (4).

    >>> round(float(wedge(1e-6, 0.0245, 0.01, 8e-3)), 9)
    3.92
    """
    return 2.0 * length * viscosity * radius / np.asarray(thickness)


def squeeze(thickness: Any, length: float, viscosity: float, radius: float) -> Any:
    """Return the squeeze coefficient, Cs = (3π·L·η0/√2)·(req/h)^1.5 [N·s/m].

    Half of that of a gap which is full of oil, 3√2·π·L·η0·(req/h)^1.5.

    Args:
        thickness: of the film, h [m].
        length: of the lines of contact [m].
        viscosity: dynamic [Pa·s].
        radius: equivalent [m].

    Source: the lubricated dual-clutch transmission, eq. (12).
    Theory: docs/theory/contact.md, equation (4).

    >>> round(float(squeeze(1e-6, 0.1, 0.01, 1e-4)), 9)
    6.664324407
    """
    return 3.0 * np.pi * length * viscosity / np.sqrt(2.0) * (radius / np.asarray(thickness)) ** 1.5


def film_force(
    thickness: Any, rate: Any, speed: Any, length: float, viscosity: float, radius: float, minimum: float = 0.0
) -> Any:
    """Return how the film of one flank pushes, f = Cw·|u| − Cs·min(ḣ, 0) [N]; it never pulls.

    Args:
        thickness: h [m]; below ``minimum`` the coefficients are those at ``minimum``.
        rate: of the thickness, ḣ [m/s].
        speed: that draws oil in, u [m/s]; the inlet is on whichever side the flanks roll towards.
        length: of the lines of contact [m].
        viscosity: dynamic [Pa·s].
        radius: equivalent [m].
        minimum: thickness that the roughness leaves [m].

    Source: the lubricated dual-clutch transmission, eq. (11).
    Theory: docs/theory/contact.md, equation (4).

    >>> round(float(film_force(1e-6, -0.01, 2.0, 0.1, 0.01, 1e-4)), 9)
    0.466643244
    >>> round(float(film_force(1e-6, 0.01, 2.0, 0.1, 0.01, 1e-4)), 9)
    0.4
    """
    h = np.maximum(thickness, minimum)
    approach = np.minimum(rate, 0.0)
    return wedge(h, length, viscosity, radius) * np.abs(speed) - squeeze(h, length, viscosity, radius) * approach


def mesh_film_force(
    displacement: Any,
    velocity: Any,
    half_backlash: float,
    speed: Any,
    length: float,
    viscosity: float,
    radius: float,
    minimum: float = 0.0,
) -> Any:
    """Return the force of both films on the loose gear, F = f(cb − xn, −ẋn) − f(cb + xn, ẋn) [N].

    Positive when the active flank pushes more. Printed is h = cb − |xn| without a sign, with which both films would
    push the same way; here the force is odd in (xn, ẋn) and has no jump at xn = 0.

    Args:
        displacement: along the normal from the middle of the backlash towards the active flank, xn [m].
        velocity: ẋn [m/s].
        half_backlash: cb [m].
        speed: that draws oil in, u [m/s].
        length: of the lines of contact [m].
        viscosity: dynamic [Pa·s].
        radius: equivalent [m].
        minimum: thickness that the roughness leaves [m].

    Source: the lubricated dual-clutch transmission, eqs (11), (14).

    >>> round(float(mesh_film_force(50e-6, 0.0, 60e-6, 2.0, 0.1, 0.01, 1e-4)), 9)
    0.036363636
    """
    x = np.asarray(displacement)
    oil = (speed, length, viscosity, radius, minimum)
    return film_force(half_backlash - x, -np.asarray(velocity), *oil) - film_force(half_backlash + x, velocity, *oil)


def resting_thickness(load: float, speed: float, length: float, viscosity: float, radius: float) -> float:
    """Return the thickness at which the wedge carries a load, h0 = 2·L·η0·req·|u|/F [m].

    Args:
        load: on the flank, along the normal [N].
        speed: that draws oil in [m/s].
        length: of the lines of contact [m].
        viscosity: dynamic [Pa·s].
        radius: equivalent [m].

    Source: the lubricated dual-clutch transmission, eqs (11), (12), at rest.

    >>> round(resting_thickness(1.8, 3.118, 0.0245, 0.01, 8.057e-3), 9)
    6.839e-06
    """
    return 2.0 * length * viscosity * radius * abs(speed) / load


def squeezed_speed(
    thickness: Any, start: float, speed: float, mass: float, length: float, viscosity: float, radius: float
) -> Any:
    """Return the speed of approach left at a thickness when nothing but the squeeze acts [m/s].

    m·dv/dh = Cs(h) gives v = v0 − (2/m)·(h·Cs(h) − h0·Cs(h0)): between two thicknesses the oil takes the same speed
    from every approach, fast or slow. Below zero means that the approach ended before.

    Args:
        thickness: h [m].
        start: thickness h0 at which the speed was v0 [m].
        speed: v0, positive towards the flank [m/s].
        mass: of the loose gear along the normal [kg].
        length: of the lines of contact [m].
        viscosity: dynamic [Pa·s].
        radius: equivalent [m].

    Source: the lubricated dual-clutch transmission, eqs (11), (12), integrated.

    >>> round(float(squeezed_speed(1e-6, 60e-6, 0.02, 1.2, 0.0245, 0.01, 8.057e-3)), 6)
    0.018286
    """
    h = np.asarray(thickness)
    taken = h * squeeze(h, length, viscosity, radius) - start * squeeze(start, length, viscosity, radius)
    return speed - 2.0 * taken / mass
