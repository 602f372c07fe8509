"""How likely rebounds are under a law of restitution: errors in both speeds, scatter, and a threshold of sight."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from gears3d.identify.restitution.density import densities, noise
from gears3d.identify.restitution.pairs import Pairs

STRAY = 0.002
"""Part of the pairs that may be anything: blows that were run together or told wrongly."""
FLOOR = 1e-3
"""Relative error of a rebound that may always be: what drag and drive do within a flight is known no better."""
TRUST = 0.5
"""Standard deviation of the logarithm of the factor by which stated errors may be off."""
_LEAST = 1e-9


class Errors(NamedTuple):
    """How far the stated errors of speeds are off.

    Args:
        factor: on the stated errors.
        more: what comes on top, as a multiple of a typical stated error and of ``FLOOR`` of the rebound.
    """

    factor: float = 1.0
    more: float = 0.0


class Terms(NamedTuple):
    """Which terms a law has beside its coefficient.

    Args:
        slope: with the speed of approach.
        asymmetry: between the flanks.
        sliding: with the sliding speed; only to be tested.
    """

    slope: bool = False
    asymmetry: bool = False
    sliding: bool = False

    @property
    def name(self) -> str:
        """Of the law."""
        return ("linear" if self.slope else "constant") + ("+asymmetry" if self.asymmetry else "")

    def columns(self, pairs: Pairs, middle: tuple[float, float]) -> np.ndarray:
        """Return what the law's numbers are multiplied with, (n, p).

        Args:
            pairs: impacts.
            middle: typical approach and sliding speed [m/s], in which slopes are counted.
        """
        made = [np.ones(len(pairs.time))]
        if self.slope:
            made.append(pairs.approach / middle[0] - 1.0)
        if self.asymmetry:
            made.append(0.5 * pairs.side)
        if self.sliding:
            made.append(pairs.sliding / middle[1] - 1.0)
        return np.column_stack(made)


def log_density(
    pairs: Pairs, mean: np.ndarray, steep: np.ndarray, deviation: float, errors: Errors, held: np.ndarray | None = None
) -> np.ndarray:
    """Return the logarithm of the density of each seen rebound over approach, given that it was seen, (n,).

    The coefficient is normal about its mean, held within 0 and 1; both speeds have normal errors, and the approach may
    have been anything. Rebounds below the threshold do not count, so the density is that of the rest.

    Args:
        pairs: with rebounds that were seen.
        mean: coefficient of the law, (n,).
        steep: d(rebound)/d(approach), (n,).
        deviation: of the scatter.
        errors: how far the stated ones are off.
        held: ``steep`` that stays as it is while the law is sought: errors of the approach would otherwise pull it
            towards small coefficients, (n,).

    Source: York et al. 2004 for lines with errors in both variables; Carroll & Ruppert 1988 for variances that hold a
    first estimate.
    """
    error, scatter = noise_of_ratio(pairs, steep, errors), max(deviation, _LEAST)
    ratio, cut = pairs.rebound / pairs.approach, pairs.lowest / pairs.approach
    found = densities(ratio, cut, mean, error, scatter, STRAY)
    if held is None:
        return found
    return found + np.log(np.hypot(scatter, error) / np.hypot(scatter, noise_of_ratio(pairs, held, errors)))


def noise_of_ratio(pairs: Pairs, steep: np.ndarray, errors: Errors) -> np.ndarray:
    """Return the standard deviation that errors of the speeds give rebound over approach, (n,).

    Args:
        pairs: with rebounds that were seen.
        steep: d(rebound)/d(approach), (n,).
        errors: how far the stated ones are off.
    """
    sigmas = pairs.approach_sigma, pairs.rebound_sigma
    return noise(pairs.approach, pairs.rebound, sigmas, steep, (errors.factor, errors.more), FLOOR)


def unseen(pairs: Pairs, mean: np.ndarray, deviation: float) -> np.ndarray:
    """Return the chance of each impact that its rebound stays below the threshold of sight, (n,).

    Args:
        pairs: impacts.
        mean: coefficient of the law, (n,).
        deviation: of the scatter.
    """
    return np.exp(log_ndtr((pairs.lowest / pairs.approach - mean) / max(deviation, 1e-3)))
