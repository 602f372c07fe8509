"""Maximum likelihood of a restitution law with errors in both speeds, and the choice among laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import log_ndtr, ndtr
from scipy.stats import chi2, t

from gears3d.identify.impact_pairs import Pairs
from gears3d.signals import robust_deviation


def noise(
    approach: np.ndarray,
    rebound: np.ndarray,
    sigmas: tuple[np.ndarray, np.ndarray],
    steep: np.ndarray,
    errors: tuple[float, float],
    floor: float,
) -> np.ndarray:
    """Return the standard deviation that errors of the speeds give rebound over approach, (n,)."""
    speeds = np.hypot(sigmas[1], steep * sigmas[0])
    middle = len(speeds) // 2
    typical = np.partition(speeds, middle)[middle]
    return np.hypot(errors[0] * speeds, errors[1] * np.hypot(typical, floor * rebound)) / approach


def densities(
    ratio: np.ndarray, cut: np.ndarray, mean: np.ndarray, error: np.ndarray, scatter: float, stray: float
) -> np.ndarray:
    """Return the logarithm of the density of observed rebounds over approach, (n,)."""
    wide = np.hypot(scatter, error)
    middle = (mean * error**2 + ratio * scatter**2) / wide**2
    slack = scatter * error / wide
    density = _normal(ratio - mean, wide) * (ndtr((1.0 - middle) / slack) - ndtr(-middle / slack))
    density += ndtr((mean - 1.0) / scatter) * _normal(ratio - 1.0, error)
    share = np.maximum(ndtr((mean - cut) / wide), 1e-12)
    return np.log((1.0 - stray) * density / share + stray / np.maximum(1.0 - cut, 0.1))


def _normal(off: np.ndarray, wide: np.ndarray) -> np.ndarray:
    return np.exp(-0.5 * (off / wide) ** 2) / (sqrt(2.0 * pi) * wide)


STRAY = 0.002  # Part of the pairs that may be anything: impacts that were merged or misclassified
# Least relative error of a rebound: the uncertainty of drag and drive motion within a flight
FLOOR = 1e-3
TRUST = 0.5  # Standard deviation of the logarithm of the factor by which stated errors may be off
_LEAST = 1e-9


class Errors(NamedTuple):
    """Correction of the stated errors of speeds."""

    factor: float = 1.0  # on the stated errors
    more: float = 0.0  # what comes on top, as a multiple of a typical stated error and of ``FLOOR`` of the rebound


class Terms(NamedTuple):
    """Which terms a law has in addition to its coefficient."""

    slope: bool = False  # with the speed of approach
    asymmetry: bool = False  # between the flanks
    sliding: bool = False  # with the sliding speed; only to be tested

    @property
    def name(self) -> str:
        """Of the law."""
        return ("linear" if self.slope else "constant") + ("+asymmetry" if self.asymmetry else "")

    def columns(self, pairs: Pairs, middle: tuple[float, float]) -> np.ndarray:
        """Return what the law's numbers are multiplied with, (n, p)."""
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
    """Return the standard deviation that errors of the speeds give rebound over approach, (n,)."""
    sigmas = pairs.approach_sigma, pairs.rebound_sigma
    return noise(pairs.approach, pairs.rebound, sigmas, steep, (errors.factor, errors.more), FLOOR)


def unseen(pairs: Pairs, mean: np.ndarray, deviation: float) -> np.ndarray:
    """Return the chance of each impact that its rebound stays below the threshold of sight, (n,)."""
    return np.exp(log_ndtr((pairs.lowest / pairs.approach - mean) / max(deviation, 1e-3)))


STEP = 1e-4  # Part of a typical error over which slopes are taken


def least(
    cost: Callable[[np.ndarray], float],
    start: np.ndarray,
    unit: np.ndarray,
    bounds: Sequence[tuple[float | None, float | None]],
) -> Any:
    """Return the minimum of a cost, as ``scipy.optimize.minimize`` does.

    Every number is scaled with its typical error: unscaled, a search stops before a coefficient known to 1e-4 is
    found.

    >>> def steep(x):
    ...     return 1e8 * (x[0] - 0.5) ** 2 + (x[1] - 2.0) ** 2
    >>> found = least(steep, np.zeros(2), np.array([1e-4, 1.0]), [(None, None)] * 2)
    >>> bool(abs(found.x[0] - 0.5) < 1e-6 and abs(found.x[1] - 2.0) < 1e-2)
    True
    """
    from scipy.optimize import minimize

    scaled = [tuple(None if end is None else end / one for end in pair) for pair, one in zip(bounds, unit, strict=True)]
    options = {"maxiter": 200, "eps": STEP, "ftol": 1e-11}
    found: Any = minimize(lambda y: cost(y * unit), start / unit, method="L-BFGS-B", bounds=scaled, options=options)
    found.x = np.array(found.x) * unit
    return found


def bend(cost: Callable[[np.ndarray], float], at: np.ndarray, step: np.ndarray, free: Sequence[int]) -> np.ndarray:
    """Return the second derivatives of a cost in its free numbers, (f, f).

    >>> bend(lambda x: 3.0 * x[0] ** 2 + x[0] * x[1], np.zeros(2), np.full(2, 0.1), [0, 1]).round(6).tolist()
    [[6.0, 1.0], [1.0, 0.0]]
    """
    size = len(free)
    bent = np.zeros((size, size))
    for i in range(size):
        for j in range(i, size):
            total = 0.0
            for a in (1.0, -1.0):
                for b in (1.0, -1.0):
                    x = at.copy()
                    x[free[i]] += a * step[free[i]]
                    x[free[j]] += b * step[free[j]]
                    total += a * b * cost(x)
            bent[i, j] = bent[j, i] = total / (4.0 * step[free[i]] * step[free[j]])
    return bent


# Share of the errors that repeats: its typical size, and the standard deviation of its logarithm between records
EXPECTED, BETWEEN = 0.2, 0.7
SHARES = np.geomspace(0.02, 6.0, 60)  # Shares that are weighed
CUT = 3.0  # Deviations at which the residual of a pair is clipped


def groups(pairs: Pairs) -> np.ndarray:
    """Return the group of each pair: record, flank, where the approach came from and where the rebound goes, (n,).

    >>> ones = np.ones(4)
    >>> four = Pairs(np.array([0, 0, 1, 1]), ones, np.zeros(4, int), *[ones] * 6, np.array([3, 2, 2, 2]))
    >>> groups(four).tolist()
    [1, 0, 2, 2]
    """
    code = (pairs.record.astype(int) * 2 + pairs.flank.astype(int)) * 4 + pairs.kind.astype(int)
    return np.unique(code, return_inverse=True)[1]


def repeated(
    pairs: Pairs, columns: np.ndarray, off: np.ndarray, scatter: float, noise: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return what errors that repeat add to the covariance of a law's numbers, (p, p), and their share of all errors.

    Every group of impacts has one error in common: the errors of drive motion, flank and rounding to counts are
    equal at the same phase of the motion, however often it comes. Its share of the errors is weighed by restricted
    likelihood, from how the groups differ beyond the law, and from what records usually have.

    Source: Patterson & Thompson 1971 for the restricted likelihood; Laird & Ware 1982 for effects of groups.
    """
    weight = 1.0 / (scatter**2 + noise**2)
    own = groups(pairs)
    count = int(own.max()) + 1
    off = np.clip(off, -CUT / np.sqrt(weight), CUT / np.sqrt(weight))
    lean = np.array([np.bincount(own, weight * noise * column, count) for column in columns.T])
    pull, size = np.bincount(own, weight * noise * off, count), np.bincount(own, weight * noise**2, count)
    inside, right = (columns.T * weight) @ columns, columns.T @ (weight * off)
    told = np.zeros(len(SHARES))
    for k, share in enumerate(SHARES):
        grip = share**2 / (1.0 + share**2 * size)
        normal, rest = inside - (lean * grip) @ lean.T, right - lean @ (grip * pull)
        misfit = -float(grip @ pull**2) - float(rest @ np.linalg.solve(normal, rest))
        spread = float(np.log1p(share**2 * size).sum()) + float(np.linalg.slogdet(normal)[1])
        told[k] = -0.5 * (misfit + spread + (np.log(share / EXPECTED) / BETWEEN) ** 2)
    chance = np.exp(told - told.max())
    square = float(chance @ SHARES**2 / chance.sum())
    moved = np.linalg.solve(inside, lean)  # of the numbers by an error of each group
    return square * moved @ moved.T, float(np.sqrt(square))


def of_flanks(pairs: Pairs, columns: np.ndarray, steep: np.ndarray, wide: np.ndarray) -> np.ndarray:
    """Return what errors of the flanks' speeds add to the covariance of a law's numbers, (p, p).

    A flank that is taken to move towards the gear by f makes each approach faster by f and the rebound slower by f; all
    impacts of a record have the errors of its flanks in common.

    ``columns``: of the law, (n, p); ``steep``: d(rebound)/d(approach), (n,); ``wide``: standard deviation of rebound
    over approach, (n,).
    """
    if pairs.flank_error is None:
        return np.zeros((columns.shape[1], columns.shape[1]))
    weighted = columns.T / wide**2
    ratio = -(pairs.side * (1.0 + steep) / pairs.approach)[:, None] * pairs.flank_error
    moved = np.linalg.solve(weighted @ columns, weighted @ ratio)
    return moved @ moved.T


ROUNDS = 3  # Iterations of variances and law


class Fit(NamedTuple):
    """A fitted law."""

    terms: Terms  # of the law
    numbers: np.ndarray  # of its columns, (p,)
    covariance: np.ndarray  # of these, (p, p)
    deviation: float  # of the scatter
    errors: Errors  # how far the stated errors turned out to be off
    middle: tuple[float, float]  # typical approach and sliding speed [m/s], in which slopes are counted
    score: float  # logarithm of the likelihood
    count: int  # pairs
    repeats: float  # share of the errors that impacts of one kind have in common

    def mean(self, pairs: Pairs) -> np.ndarray:
        """Return the coefficient that the law gives impacts, (n,)."""
        return self.terms.columns(pairs, self.middle) @ self.numbers

    def steep(self, pairs: Pairs) -> np.ndarray:
        """Return d(rebound)/d(approach), (n,)."""
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

    Source: Patterson & Thompson 1971 for the likelihood that pays for the law's numbers.
    """
    middle = (float(np.mean(pairs.approach)), float(np.mean(pairs.sliding))) if first is None else first.middle
    columns = terms.columns(pairs, middle)
    if first is None:
        ratio = pairs.rebound / pairs.approach
        numbers = np.linalg.lstsq(columns, ratio, rcond=None)[0]
        spread = robust_deviation(ratio - columns @ numbers)
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
        steep = _steep(terms, start[:count], mean, pairs, middle)
        noise = noise_of_ratio(pairs, steep, errors)
        common, share = repeated(pairs, columns, pairs.rebound / pairs.approach - mean, float(start[count]), noise)
        covariance = covariance + common + of_flanks(pairs, columns, steep, np.hypot(start[count], noise))
    deviation = float(start[count])
    return Fit(terms, start[:count], covariance, deviation, errors, middle, -value, len(pairs.time), share)


def _typical(columns: np.ndarray, pairs: Pairs, steep: np.ndarray, deviation: float) -> np.ndarray:
    """Return the approximate standard error of each number of a law, (p,)."""
    wide = np.hypot(deviation, noise_of_ratio(pairs, steep, Errors()))
    return np.sqrt(np.diag(np.linalg.pinv(columns.T @ (columns / wide[:, None] ** 2))))


def _inverse(bent: np.ndarray, count: int) -> np.ndarray:
    """Return the covariance of the law's numbers; where variances are not identifiable, that at given variances."""
    if np.linalg.eigvalsh(bent)[0] > 0.0:
        return np.linalg.inv(bent)[:count, :count]
    return np.linalg.pinv(bent[:count, :count], hermitian=True)


def scatter_interval(pairs: Pairs, best: Fit) -> tuple[float, float]:
    """Return the 95 % interval of the scatter, within 0 and 1, from the profile of the likelihood."""
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


# Laws that compete; Rigaud & Perret-Liaudet 2020, eq. (16), and Kadmiri et al. 2012, fig. 7
CANDIDATES = (Terms(), Terms(slope=True), Terms(asymmetry=True), Terms(slope=True, asymmetry=True))
FOLDS = 12  # Stretches or groups of records that are held out in turn
# Relative difference between impacts that is reported at least: errors that a periodic motion repeats look so
LEAST = 2.0 * FLOOR
LEVEL = (
    0.01  # A richer law is taken when its better prediction has a smaller p-value than this, and so have its parameters
)


def folds_of(pairs: Pairs) -> np.ndarray:
    """Return the group of each pair: whole records where there are enough, else stretches of time, (n,).

    >>> from gears3d.identify.impact_pairs import Pairs
    >>> four = Pairs(np.array([0, 0, 1, 1]), np.arange(4.0), *[np.ones(4)] * 8)
    >>> folds_of(four).tolist()
    [0, 1, 2, 3]
    """
    names = np.unique(pairs.record)
    if len(names) >= FOLDS:
        return np.searchsorted(names, pairs.record) % FOLDS
    order = np.lexsort((pairs.time, pairs.record))
    folds = np.zeros(len(order), int)
    folds[order] = np.arange(len(order)) * min(FOLDS, len(order)) // len(order)
    return folds


def held_out(pairs: Pairs, whole: Fit, folds: np.ndarray) -> np.ndarray:
    """Return each group's mean log-density under a law fitted without it, (folds,)."""
    told = np.zeros(int(folds.max()) + 1)
    for fold in range(len(told)):
        rest, own = pairs.only(folds != fold), pairs.only(folds == fold)
        found = fit(rest, whole.terms, whole)
        told[fold] = log_density(own, found.mean(own), found.steep(own), found.deviation, found.errors).mean()
    return told


def choose(pairs: Pairs) -> tuple[Fit, dict[str, Fit], dict[str, np.ndarray]]:
    """Return the law taken, all laws fitted, and the held-out scores of each by group."""
    laws = [terms for terms in CANDIDATES if not terms.asymmetry or min(np.bincount(pairs.flank, minlength=2)) >= 5]
    if not wide_enough(pairs):
        laws = [terms for terms in laws if not terms.slope]
    fits = {terms.name: fit(pairs, terms) for terms in laws}
    folds = folds_of(pairs)
    scores = {name: held_out(pairs, found, folds) for name, found in fits.items()}
    sizes = np.bincount(folds)
    best = fits["constant"]
    for size in (2, 3):
        better = [f for f in fits.values() if len(f.numbers) == size and _beats(f, best, pairs, scores, sizes)]
        if better:
            best = max(better, key=lambda f: scores[f.terms.name].mean())
    return best, fits, scores


NARROW = 1.5  # Ratio of fastest to slowest approach below which a slope does not show


def wide_enough(pairs: Pairs) -> bool:
    """Return whether speeds on one flank differ enough to show a slope."""
    ends = [np.quantile(pairs.approach[pairs.flank == flank], (0.05, 0.95)) for flank in np.unique(pairs.flank)]
    return any(high > NARROW * low for low, high in ends)


def _impossible_at_rest(law: Fit) -> bool:
    """Return whether a law gives a coefficient outside 0 to 1 in the slowest impacts."""
    row = np.zeros(len(law.numbers))
    row[0], row[1] = 1.0, -1.0
    value, sigma = float(row @ law.numbers), float(np.sqrt(row @ law.covariance @ row))
    return value - 2.0 * sigma > 1.0 or value + 2.0 * sigma < 0.0


def _beats(richer: Fit, simpler: Fit, pairs: Pairs, scores: dict[str, np.ndarray], sizes: np.ndarray) -> bool:
    if np.ptp(richer.mean(pairs) - simpler.mean(pairs)) < LEAST * np.mean(simpler.mean(pairs)):
        return False
    if richer.terms.slope and _impossible_at_rest(richer):
        return False
    if not set(_named(simpler.terms)) <= set(_named(richer.terms)):
        return False
    gain = scores[richer.terms.name] - scores[simpler.terms.name]
    if gain.mean() <= 0.0 or not np.any(gain):
        return False
    return rarely_by_chance(gain, sizes) and all(_known(richer, place) for place in _added(richer.terms, simpler.terms))


def rarely_by_chance(gain: np.ndarray, sizes: np.ndarray) -> bool:
    """Return whether so much better a prediction has a p-value below 1 %.

    Either most groups are predicted better, or all together so much better that this is improbable under the simpler
    law: a ratio of likelihoods exceeds 1/p with a chance of p at most. Groups of a few impacts at the middle of the
    speeds contain no information on a slope, so that the first criterion alone would miss it in short records.

    Source: Wilcoxon 1945 for ranks; Royall 1997 for the bound on the ratio.

    >>> some, none = np.array([3.0, 2.0, 3.0, 0.0]), np.array([0.1, -0.1, 0.1, -0.05])
    >>> rarely_by_chance(some, np.full(4, 2)), rarely_by_chance(none, np.full(4, 2))
    (True, False)
    """
    from scipy.stats import wilcoxon

    verdict: Any = wilcoxon(gain, alternative="greater")
    return bool(verdict.pvalue < LEVEL or gain @ sizes > np.log(1.0 / LEVEL))


def _known(law: Fit, place: int) -> bool:
    """Return whether a number differs from 0 although impacts of one kind share their errors."""
    from scipy.stats import t

    limit = float(t.ppf(1.0 - 0.5 * LEVEL, max(law.count - len(law.numbers) - 1, 1)))
    return abs(law.numbers[place]) > limit * np.sqrt(law.covariance[place, place])


def _added(richer: Terms, simpler: Terms) -> list[int]:
    """Return the places of the numbers that only the richer law has."""
    places = {"slope": 1, "asymmetry": 1 + int(richer.slope)}
    return [places[name] for name in _named(richer) if name not in _named(simpler)]


def _named(terms: Terms) -> list[str]:
    return [name for name, there in terms._asdict().items() if there]
