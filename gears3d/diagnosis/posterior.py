"""Posterior probability of sets of causes, from the likelihoods of all hypotheses that were fitted in each place.

The weight of a hypothesis is the Laplace approximation of its evidence: exp(−Δχ²/2), Δχ² divided by what a model of
these records may err by (the same division that decides whether it is excluded), times the ratio of posterior to prior
width of its parameters. No cause at all pays nothing for the choice among all candidates. What is not in the catalogue,
or was not fitted, has the probability with which names were wrong in blind tests.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from math import exp, prod
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import ACCEPT

Array = np.ndarray
# Standard deviation of a parameter before any record is seen, in units: deviations of real rigs are 5 to 50 %.
PRIOR = 0.3
# Probability that a named cause stands for one outside the catalogue: 2 of 46 names were wrong in blind tests over the
# operating space (space, 170 to 218), with one success and one failure added (Laplace).
OUTSIDE = 0.06
# Probability down to which a set of causes is stated.
STATED = 0.005
# Number of sets that are stated at most.
MOST = 6
# Chi-square difference of a weight of nothing.
LEAST = 1e3


class Option(NamedTuple):
    """One hypothesis in the place of a cause.

    Args:
        kinds: of its causes; empty without any, ``None`` for what is outside the catalogue.
        probability: among all hypotheses in this place.
    """

    kinds: tuple[str, ...] | None
    probability: float


class Probable(NamedTuple):
    """A set of causes and its posterior probability.

    Args:
        kinds: of the causes, sorted; ``None`` for all other sets together.
        probability: of the set.
    """

    kinds: tuple[str, ...] | None
    probability: float

    @property
    def text(self) -> str:
        """Return the set in words."""
        return "other sets, or outside the catalogue" if self.kinds is None else " + ".join(self.kinds) or "no cause"

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary."""
        return {"causes": None if self.kinds is None else list(self.kinds), "probability": self.probability}


def occam(covariance: Array, units: Array) -> float:
    """Return the chi-square that the parameters of a hypothesis cost: the logarithm of prior over posterior volume.

    covariance: of its numbers [SI], (p, p); units: unit size of each [SI], (p,).
    """
    known = np.linalg.eigvalsh(np.nan_to_num(covariance / np.outer(units, units), nan=1e12, posinf=1e12))
    return float(np.sum(np.log1p(PRIOR**2 / np.maximum(known, 1e-300))))


def options(kind: str, gain: float, others: Sequence[tuple[tuple[str, ...], float]]) -> tuple[Option, ...]:
    """Return the hypotheses in the place of a cause, that itself first, with their probabilities.

    gain: fall of chi-square by the cause; others: kinds of competing hypotheses, and by how much they are worse.
    """
    worse = [0.0, *(one for _, one in others), gain - ACCEPT]
    weights = [exp(-0.5 * min(max(one, 0.0), LEAST)) for one in worse]
    kinds = [(kind,), *(kinds for kinds, _ in others), ()]
    known = (1.0 - OUTSIDE) / sum(weights)
    told = [Option(own, known * weight) for own, weight in zip(kinds, weights, strict=True)]
    return (*told, Option(None, OUTSIDE))


def posterior(places: Sequence[Sequence[Option]]) -> tuple[Probable, ...]:
    """Return the most probable sets of causes, best first, and the probability of all others.

    Causes are independent of each other: pairs that are not have been compared jointly by the search.

    places: hypotheses in the place of each cause.
    """
    if not places:
        return ()
    sums: dict[tuple[str, ...], float] = {}
    for kinds, probability in _sets(places):
        sums[kinds] = sums.get(kinds, 0.0) + probability
    best = sorted(sums.items(), key=lambda one: -one[1])[:MOST]
    stated = [Probable(kinds, probability) for kinds, probability in best if probability >= STATED]
    return (*stated, Probable(None, 1.0 - sum(one.probability for one in stated)))


def _sets(places: Sequence[Sequence[Option]]) -> Iterator[tuple[tuple[str, ...], float]]:
    """Yield all sets of causes of the catalogue that are not negligible, with their probabilities."""
    kept = [[one for one in place if one.kinds is not None and one.probability >= STATED] for place in places]
    for chosen in product(*kept):
        kinds = tuple(sorted(kind for one in chosen if one.kinds is not None for kind in one.kinds))
        yield kinds, prod(one.probability for one in chosen)
