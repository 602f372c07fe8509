"""Laws of restitution fitted to pairs of speeds, by greatest likelihood."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, t

from gears3d.identify.restitution.descent import bend, least
from gears3d.identify.restitution.likelihood import TRUST, Errors, Terms, log_density, noise_of_ratio
from gears3d.identify.restitution.pairs import Pairs
from gears3d.identify.restitution.repeated import repeated

ROUNDS = 3
"""Times that variances are told the law anew."""


class Fit(NamedTuple):
    """A fitted law.

    Args:
        terms: of the law.
        numbers: of its columns, (p,).
        covariance: of these, (p, p).
        deviation: of the scatter.
        errors: how far the stated errors turned out to be off.
        middle: typical approach and sliding speed [m/s], in which slopes are counted.
        score: logarithm of the likelihood.
        count: pairs.
        repeats: share of the errors that impacts of one kind have in common.
    """

    terms: Terms
    numbers: np.ndarray
    covariance: np.ndarray
    deviation: float
    errors: Errors
    middle: tuple[float, float]
    score: float
    count: int
    repeats: float

    def mean(self, pairs: Pairs) -> np.ndarray:
        """Return the coefficient that the law gives impacts, (n,).

        Args:
            pairs: impacts.
        """
        return self.terms.columns(pairs, self.middle) @ self.numbers

    def steep(self, pairs: Pairs) -> np.ndarray:
        """Return d(rebound)/d(approach), (n,).

        Args:
            pairs: impacts.
        """
        return _steep(self.terms, self.numbers, self.mean(pairs), pairs, self.middle)

    @property
    def quantile(self) -> float:
        """Standard errors to either side that hold 95 %."""
        return float(t.ppf(0.975, max(self.count - len(self.numbers) - 1, 1)))


def _steep(
    terms: Terms, numbers: np.ndarray, mean: np.ndarray, pairs: Pairs, middle: tuple[float, float]
) -> np.ndarray:
    return mean + (numbers[1] * pairs.approach / middle[0] if terms.slope else 0.0)


def fit(pairs: Pairs, terms: Terms, first: Fit | None = None, deviation: float | None = None) -> Fit:
    """Return the law that makes seen rebounds likeliest; variances by restricted likelihood.

    Args:
        pairs: with rebounds that were seen.
        terms: of the law.
        first: a fit of the same terms to begin with; the covariance is then left out (NaN).
        deviation: of the scatter, where it is given.

    Source: Patterson & Thompson 1971 for the likelihood that pays for the law's numbers.
    """
    middle = (float(np.mean(pairs.approach)), float(np.mean(pairs.sliding))) if first is None else first.middle
    columns = terms.columns(pairs, middle)
    if first is None:
        ratio = pairs.rebound / pairs.approach
        numbers = np.linalg.lstsq(columns, ratio, rcond=None)[0]
        spread = 1.4826 * float(np.median(np.abs(ratio - columns @ numbers)))
        start = np.concatenate([numbers, [min(max(spread, 1e-3), 0.5), 0.0, 0.3]])
    else:
        numbers = first.numbers
        more = first.errors.more if deviation is None else max(first.errors.more, 0.1)
        start = np.concatenate([numbers, [max(first.deviation, 1e-3), np.log(first.errors.factor), more]])
    count = len(numbers)
    bounds = [(None, None)] * count + [(0.0, 1.0), (-1.5, 1.5), (0.0, 3.0)]
    if first is not None and deviation is None:  # errors of speeds stay as all pairs told them
        bounds[count + 1 :] = [(value, value) for value in start[count + 1 :]]
    if deviation is not None:
        start[count], bounds[count] = deviation, (deviation, deviation)

    def cost(x: np.ndarray, held: np.ndarray) -> float:
        mean, errors = columns @ x[:count], Errors(float(np.exp(x[count + 1])), float(x[count + 2]))
        steep = _steep(terms, x[:count], mean, pairs, middle)
        told = log_density(pairs, mean, steep, x[count], errors, held)
        wide = np.hypot(max(x[count], 1e-9), noise_of_ratio(pairs, held, errors))
        freedom = np.linalg.slogdet(columns.T @ (columns / wide[:, None] ** 2))[1]  # what the law's numbers take up
        expected = 0.5 * (x[count + 1] / TRUST) ** 2 + 0.5 * x[count + 2] ** 2
        return expected + 0.5 * freedom - float(told.sum())

    held = _steep(terms, numbers, columns @ numbers, pairs, middle)
    unit = np.append(_typical(columns, pairs, held, start[-3]), [max(0.2 * start[-3], 1e-4), 0.2, 0.2])
    value = np.inf
    for _ in range(ROUNDS if first is None else 1):
        found = least(lambda x, steep=held: cost(x, steep), start, unit, bounds)
        start, value = found.x, float(found.fun)
        fresh = _steep(terms, start[:count], columns @ start[:count], pairs, middle)
        if np.max(np.abs(fresh - held)) < 1e-4:
            break
        held = fresh
    spread = [count] if deviation is None and start[count] > 1e-4 else []
    free = [*range(count), *spread, count + 1] + ([count + 2] if start[count + 2] > 0.05 else [])
    covariance = np.full((count, count), np.nan)
    if first is None:
        covariance = _inverse(bend(lambda x: cost(x, held), start, 0.3 * unit, free), count)
    errors = Errors(float(np.exp(start[count + 1])), float(start[count + 2]))
    share = np.nan
    if first is None:
        mean = columns @ start[:count]
        noise = noise_of_ratio(pairs, _steep(terms, start[:count], mean, pairs, middle), errors)
        common, share = repeated(pairs, columns, pairs.rebound / pairs.approach - mean, float(start[count]), noise)
        covariance = covariance + common
    deviation = float(start[count])
    return Fit(terms, start[:count], covariance, deviation, errors, middle, -value, len(pairs.time), share)


def _typical(columns: np.ndarray, pairs: Pairs, steep: np.ndarray, deviation: float) -> np.ndarray:
    """Return about how well each number of a law is known, (p,)."""
    wide = np.hypot(deviation, noise_of_ratio(pairs, steep, Errors()))
    return np.sqrt(np.diag(np.linalg.pinv(columns.T @ (columns / wide[:, None] ** 2))))


def _inverse(bent: np.ndarray, count: int) -> np.ndarray:
    """Return the covariance of the law's numbers; where variances are not told, that at given variances."""
    if np.linalg.eigvalsh(bent)[0] > 0.0:
        return np.linalg.inv(bent)[:count, :count]
    return np.linalg.pinv(bent[:count, :count], hermitian=True)


def scatter_interval(pairs: Pairs, best: Fit) -> tuple[float, float]:
    """Return the 95 % interval of the scatter's standard deviation, cut at 0 and 1, from the profile of the likelihood.

    Args:
        pairs: with rebounds that were seen.
        best: the fitted law.
    """
    drop = 0.5 * float(chi2.ppf(0.95, 1))

    def short(deviation: float) -> float:
        return best.score - fit(pairs, best.terms, best, deviation).score - drop

    fine = max(0.01 * best.deviation, 1e-6)
    low = 0.0 if short(0.0) <= 0.0 else _zero(short, 0.0, best.deviation, fine)
    high, step = best.deviation, max(0.5 * best.deviation, 1e-4)
    while high < 1.0:
        upper = min(high + step, 1.0)
        if short(upper) > 0.0:
            return low, _zero(short, high, upper, fine)
        high, step = upper, 2.0 * step
    return low, 1.0


def _zero(of: Callable[[float], float], low: float, high: float, fine: float) -> float:
    found: Any = brentq(of, low, high, xtol=fine)
    return float(found)
