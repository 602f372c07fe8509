"""Drag over temperature: significance, rate, and exponent of the oil's viscosity."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from gears3d.identify.coastdown_fit import Fit
from gears3d.laws.film import dynamic_viscosity


class Oil(NamedTuple):
    """An oil by its data sheet.

    Args:
        points: temperature [°C] and kinematic viscosity [m²/s] of two points.
        density: at 15 °C [kg/m³].
    """

    points: tuple[tuple[float, float], tuple[float, float]]
    density: float = 860.0


def trends(best: Fit, temperatures: Mapping[str, float | None], oil: Oil | None) -> dict[str, Any]:
    """Return the temperature trend of every number identified at several temperatures.

    ``temperatures``: by the suffix of part names after ``@`` [°C]. Returns by ``part.name``:
    ``temperature_degC``, ``value`` and ``sigma`` at each; ``change_1_K``, slope of the number's logarithm, with
    ``value`` and ``ci95``; ``p_constant``, the chance of such values if nothing changed; ``p_exponential``, if the
    change is exponential; with an oil, ``viscosity_exponent`` and ``p_viscosity``.

    Source: Kadmiri et al. 2012, eq. (8) (shear goes with µ), (10)-(12) (churning with µ^0.21).
    """
    places: dict[str, list[tuple[float, int]]] = {}
    for place, (part, name) in enumerate(best.model.names()):
        base, _, at = part.partition("@")
        temperature = temperatures.get(at)
        if at and temperature is not None:
            places.setdefault(f"{base}.{name}", []).append((temperature, place))
    covariance = best.covariance
    found = {}
    for name, where in places.items():
        where.sort()
        at, chosen = np.array([t for t, _ in where]), [place for _, place in where]
        found[name] = _trend(at, best.numbers[chosen], covariance[np.ix_(chosen, chosen)], oil)
    return found


def _trend(at: np.ndarray, values: np.ndarray, covariance: np.ndarray, oil: Oil | None) -> dict[str, Any]:
    sigma = np.sqrt(np.diag(covariance))
    told: dict[str, Any] = {"temperature_degC": at.tolist(), "value": values.tolist(), "sigma": sigma.tolist()}
    _, _, told["p_constant"] = generalised(np.ones((len(at), 1)), values, covariance)
    if np.any(values <= 0.0):
        return told
    logs, spread = np.log(values), covariance / np.outer(values, values)
    told["change_1_K"], told["p_exponential"] = _slope(at, logs, spread)
    if oil is not None:
        thick = np.log(dynamic_viscosity(oil.points, oil.density, at))
        told["viscosity_exponent"], told["p_viscosity"] = _slope(thick, logs, spread)
    return told


def _slope(at: np.ndarray, logs: np.ndarray, spread: np.ndarray) -> tuple[dict[str, Any], float | None]:
    numbers, error, chance = generalised(np.column_stack([np.ones(len(at)), at - at.mean()]), logs, spread)
    slope, wide = float(numbers[1]), 1.96 * float(error[1])
    return {"value": slope, "ci95": [slope - wide, slope + wide]}, chance


def generalised(
    columns: np.ndarray, values: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float | None]:
    """Return generalised least squares: numbers, their standard deviations, and the chance of the misfit.

    ``columns``: of the law, (n, p); ``values``: (n,); ``covariance``: of these, (n, n). Returns numbers (p,),
    deviations (p,), and the chance that chi-square is as large; ``None`` without a degree of freedom.

    >>> numbers, sigma, chance = generalised(np.ones((4, 1)), np.array([1.0, 3.0, 1.0, 3.0]), np.eye(4))
    >>> float(numbers[0]), float(sigma[0]), round(chance, 3)
    (2.0, 0.5, 0.261)
    """
    from scipy.special import chdtrc

    inverse = np.linalg.inv(covariance)
    spread = np.linalg.inv(columns.T @ inverse @ columns)
    numbers = spread @ columns.T @ inverse @ values
    rest = values - columns @ numbers
    free = len(values) - columns.shape[1]
    chance = float(chdtrc(free, rest @ inverse @ rest)) if free > 0 else None
    return numbers, np.sqrt(np.diag(spread)), chance
