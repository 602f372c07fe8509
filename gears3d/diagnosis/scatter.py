"""Restitution that scatters: more variance of the rebounds than their own errors, in proportion to the speed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.evidence import Evidence

Array = np.ndarray
FAR = 5.0
"""Usual distances beyond which a rebound was measured wrongly."""
ROUNDS = 4
FEWEST = 20
"""Impacts without which nothing is said of their scatter."""


class Scatter(NamedTuple):
    """How restitution scatters.

    Args:
        value: standard deviation of the coefficient.
        sigma: of the value.
        gain: fall of chi-square against errors of the speeds alone.
        noise: factor on the stated errors of the speeds.
    """

    value: float
    sigma: float
    gain: float
    noise: float


def scatter(records: Sequence[Evidence], rest: Array) -> Scatter | None:
    """Return how restitution scatters beside the errors of the speeds, whose size is left free.

    Args:
        records: all.
        rest: residuals of the impacts in standard deviations, (i,).

    Returns:
        The scatter of greatest likelihood; ``None`` of too few impacts.
    """
    from gears3d.diagnosis.prediction import impact_sigma

    if len(rest) < FEWEST:
        return None
    speed = np.concatenate([np.abs(one.channels.impacts.velocity) / impact_sigma(one) for one in records])

    usual = max(1.4826 * float(np.median(np.abs(rest))), 1e-3)
    near = np.abs(rest) < FAR * usual
    for _ in range(ROUNDS):  # a few rebounds measured wrongly are no scatter
        plain, found = _likeliest(rest[near], speed[near], usual)
        again = rest**2 < FAR**2 * (np.exp(2.0 * found.x[0]) + (found.x[1] * speed) ** 2)
        if np.array_equal(again, near):
            break
        near = again
    cost = _cost(rest[near], speed[near])
    value = abs(float(found.x[1]))
    step = max(0.05 * value, 1e-4)
    profile = [cost(np.array([found.x[0], value + k * step])) for k in (-1.0, 0.0, 1.0)]
    bend = (profile[0] - 2.0 * profile[1] + profile[2]) / step**2
    sigma = float(np.sqrt(2.0 / bend)) if bend > 0.0 else np.inf
    return Scatter(value, sigma, float(plain.fun - found.fun), float(np.exp(found.x[0])))


def _cost(rest: Array, speed: Array) -> Callable[[Array], float]:
    """Return minus twice the logarithm of the likelihood of (logarithm of the noise, scatter)."""

    def cost(numbers: Array) -> float:
        variance = np.exp(2.0 * numbers[0]) + (numbers[1] * speed) ** 2
        return float(np.sum(np.log(variance) + rest**2 / variance))

    return cost


def _likeliest(rest: Array, speed: Array, usual: float) -> tuple[Any, Any]:
    """Return the likeliest noise alone, and noise and scatter together."""
    from scipy.optimize import minimize

    cost = _cost(rest, speed)
    plain = minimize(lambda x: cost(np.array([x[0], 0.0])), [np.log(usual)], method="Nelder-Mead")
    share = usual / np.median(speed)
    starts = [(np.log(0.5 * usual), 0.5 * share), (np.log(usual), 0.1 * share)]
    return plain, min((minimize(cost, start, method="Nelder-Mead") for start in starts), key=lambda each: each.fun)
