"""How thick an oil is at a temperature, from the two viscosities of its data sheet."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

KELVIN = 273.15
EXPANSION = 7e-4
"""Volume expansion of a mineral oil [1/K]."""


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
