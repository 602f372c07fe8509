"""Which law of restitution the record asks for: a richer one only where it foretells held-out impacts better."""

from __future__ import annotations

from typing import Any

import numpy as np

from gears3d.identify.restitution.fitting import Fit, fit
from gears3d.identify.restitution.likelihood import FLOOR, Terms, log_density
from gears3d.identify.restitution.pairs import Pairs

CANDIDATES = (Terms(), Terms(slope=True), Terms(asymmetry=True), Terms(slope=True, asymmetry=True))
"""Laws that compete; Rigaud & Perret-Liaudet 2020, eq. (16), and Kadmiri et al. 2012, fig. 7."""
FOLDS = 12
"""Stretches or groups of records that are held out in turn."""
LEAST = 2.0 * FLOOR
"""Relative difference between impacts below which none is claimed: errors that a periodic motion repeats look so."""
LEVEL = 0.01
"""A richer law is taken when its better prediction would come by chance this rarely, its numbers, too."""


def folds_of(pairs: Pairs) -> np.ndarray:
    """Return the group of each pair: whole records where there are enough, else stretches of time, (n,).

    Args:
        pairs: in order of record and time.

    >>> from gears3d.identify.restitution.pairs import Pairs
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
    """Return each group's mean logarithm of the density under a law that never saw it, (folds,).

    Args:
        pairs: with rebounds that were seen.
        whole: the law fitted to all of them.
        folds: group of each pair, (n,).
    """
    told = np.zeros(int(folds.max()) + 1)
    for fold in range(len(told)):
        rest, own = pairs.only(folds != fold), pairs.only(folds == fold)
        found = fit(rest, whole.terms, whole)
        told[fold] = log_density(own, found.mean(own), found.steep(own), found.deviation, found.errors).mean()
    return told


def choose(pairs: Pairs) -> tuple[Fit, dict[str, Fit], dict[str, np.ndarray]]:
    """Return the law taken, all laws fitted, and the held-out scores of each by group.

    Args:
        pairs: with rebounds that were seen.
    """
    laws = [terms for terms in CANDIDATES if not terms.asymmetry or min(np.bincount(pairs.flank, minlength=2)) >= 5]
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


def _beats(richer: Fit, simpler: Fit, pairs: Pairs, scores: dict[str, np.ndarray], sizes: np.ndarray) -> bool:
    if np.ptp(richer.mean(pairs) - simpler.mean(pairs)) < LEAST * np.mean(simpler.mean(pairs)):
        return False
    if not set(_named(simpler.terms)) <= set(_named(richer.terms)):
        return False
    gain = scores[richer.terms.name] - scores[simpler.terms.name]
    if gain.mean() <= 0.0 or not np.any(gain):
        return False
    return rarely_by_chance(gain, sizes) and all(_known(richer, place) for place in _added(richer.terms, simpler.terms))


def rarely_by_chance(gain: np.ndarray, sizes: np.ndarray) -> bool:
    """Return whether so much better a prediction would come by chance less than once in a hundred times.

    Either most groups are foretold better, or all together so much better that the simpler law would hardly let it
    happen: a ratio of likelihoods exceeds 1/p with a chance of p at most. Groups of a few impacts at the middle of the
    speeds know nothing of a slope, so that the first alone would miss it in short records.

    Args:
        gain: of the mean logarithm of the density, by group, (folds,).
        sizes: pairs in each group, (folds,).

    Source: Wilcoxon 1945 for ranks; Royall 1997 for the bound on the ratio.

    >>> some, none = np.array([3.0, 2.0, 3.0, 0.0]), np.array([0.1, -0.1, 0.1, -0.05])
    >>> rarely_by_chance(some, np.full(4, 2)), rarely_by_chance(none, np.full(4, 2))
    (True, False)
    """
    from scipy.stats import wilcoxon

    verdict: Any = wilcoxon(gain, alternative="greater")
    return bool(verdict.pvalue < LEVEL or gain @ sizes > np.log(1.0 / LEVEL))


def _known(law: Fit, place: int) -> bool:
    """Return whether a number is told from 0 although impacts of one kind share their errors."""
    from scipy.stats import t

    limit = float(t.ppf(1.0 - 0.5 * LEVEL, max(law.count - len(law.numbers) - 1, 1)))
    return abs(law.numbers[place]) > limit * np.sqrt(law.covariance[place, place])


def _added(richer: Terms, simpler: Terms) -> list[int]:
    """Return the places of the numbers that only the richer law has."""
    places = {"slope": 1, "asymmetry": 1 + int(richer.slope)}
    return [places[name] for name in _named(richer) if name not in _named(simpler)]


def _named(terms: Terms) -> list[str]:
    return [name for name, there in terms._asdict().items() if there]
