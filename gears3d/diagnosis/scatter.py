"""Restitution that scatters: more variance of the rebounds than their own errors, in proportion to the speed.

Rebounds below a record's threshold of sight were not seen. They count by the chance of that: without them, restitution
would be found too large and its scatter too small. Under noise a record overlooks stronger ones as well, whatever their
speed; how often is estimated with the scatter, so that rebounds that were overlooked are not held for weak ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import log_ndtr

from gears3d.diagnosis.blows import Blows
from gears3d.diagnosis.channels import Impacts
from gears3d.diagnosis.evidence import Evidence

Array = np.ndarray
FEWEST = 20
"""Rebounds without which nothing is said of their scatter."""
STRAY = 0.003
"""Part of the blows that may be anything: cut wrongly, or run together."""
MISSED, USUAL = 0.9, 0.1
"""Part of the rebounds above the threshold of sight that a record overlooks at most, and its mean beforehand."""
OVERLOOKED = (-4.0, 0.0)
"""Logits of that part at which a fit begins: 2 % and a half of ``MISSED``."""
TRUST = 0.3
"""Standard deviation of the logarithm of the factor by which stated errors may be off."""
SURE = 30.0
"""Gain in chi-square from which on a scatter of restitution is believed."""
WEAK = 0.25
"""Part of the rebounds that are weak."""
TELLS = 0.01
"""Information of a blow without rebound, as part of that of one with, below which it tells nothing of restitution."""


class Rebounds(NamedTuple):
    """Blows of all records, in coefficients of restitution, (b,).

    Args:
        ratio: rebound over speed before; NaN where no rebound was seen.
        error: standard deviation of the ratio by the errors of both speeds.
        cut: ratio above which none is overlooked.
        speed: before [m/s].
        side: +1 on the active, -1 on the reverse flank.
        record: index of the record.
    """

    ratio: Array
    error: Array
    cut: Array
    speed: Array
    side: Array
    record: Array

    @property
    def seen(self) -> Array:
        """Whether the rebound was seen, (b,)."""
        return np.isfinite(self.ratio)


class Scatter(NamedTuple):
    """How restitution scatters.

    Args:
        value: standard deviation of the coefficient.
        sigma: of the value.
        gain: fall of chi-square against errors of the speeds alone.
        noise: factor on the stated errors of the speeds.
        missed: part of the rebounds above the threshold of sight that were overlooked.
    """

    value: float
    sigma: float
    gain: float
    noise: float
    missed: float


def rebounds(records: Sequence[Evidence]) -> Rebounds:
    """Return the blows of records in coefficients of restitution.

    Args:
        records: all.
    """
    rows = []
    for k, one in enumerate(records):
        seen = one.channels.blows
        slack = np.where(seen.seen, seen.rebound_sigma, _weakest(seen))
        error = np.hypot(slack, one.rig.restitution * seen.velocity_sigma) / seen.velocity
        side = np.where(seen.flank == 0, 1.0, -1.0)
        rows.append((seen.rebound / seen.velocity, error, seen.lowest / seen.velocity, seen.velocity, side,
                     np.full(len(side), k)))  # fmt: skip
    return Rebounds(*(np.concatenate(column) for column in zip(*rows, strict=True)))


def _weakest(seen: Blows) -> float:
    """Return the standard deviation of the weaker rebounds that were seen, which that of the unseen ones would have."""
    known = seen.seen & (seen.rebound <= np.nanquantile(seen.rebound, WEAK)) if np.any(seen.seen) else seen.seen
    return float(np.median(seen.rebound_sigma[known])) if np.any(known) else 0.0


def means(records: Sequence[Evidence], effects: Iterable[Any] = ()) -> Array:
    """Return the coefficient that rig and effects give to each blow, (b,).

    Args:
        records: all.
        effects: beside those of the rig.
    """
    from gears3d.diagnosis.prediction import restitution

    effects, found = list(effects), []
    for one in records:
        seen, own = one.channels.blows, [*one.scenario.effects, *effects]
        rows = [row for effect in own for row in effect.rows(one.rig)]
        found.append(restitution(rows, one.rig.restitution, seen.velocity, seen.flank))
    return np.concatenate(found)


def scatter(records: Sequence[Evidence], effects: Iterable[Any] = ()) -> Scatter | None:
    """Return how restitution scatters beside the errors of the speeds, whose size is left free.

    Args:
        records: all.
        effects: that make the mean what it is.

    Returns:
        The scatter of greatest likelihood; ``None`` of too few rebounds.
    """
    every = rebounds(records)
    if np.sum(every.seen) < FEWEST:
        return None
    cost = _cost(every, means(records, effects), np.zeros((len(every.speed), 0)))
    plain, found = _likeliest(every, cost, np.zeros(0))
    value = abs(float(found.x[1]))
    step = max(0.05 * value, 1e-4)
    profile = [cost(np.array([found.x[0], value + k * step, *found.x[2:]])) for k in (-1.0, 0.0, 1.0)]
    bend = (profile[0] - 2.0 * profile[1] + profile[2]) / step**2
    sigma = float(np.sqrt(2.0 / bend)) if bend > 0.0 else np.inf
    return Scatter(value, sigma, float(plain.fun - found.fun), _worse(found.x[0]), _missed(found.x[2]))


def with_own_noise(records: Sequence[Evidence]) -> list[Evidence]:
    """Return records whose impacts are known as well as restitution allows that really scatters.

    A cause of the mean must be held against the scatter, and against the blows without a rebound. What speed and flank
    explain is fitted with it. A normal error stands for each blow that has the slope and the bend of its likelihood
    there; of one without a rebound it takes the place of the impact.

    Args:
        records: all.

    Source: the working response of iteratively reweighted least squares (McCullagh & Nelder 1989, section 2.5), of
    likelihoods that are censored (Tobin 1958).
    """
    every = rebounds(records)
    if np.sum(every.seen) < FEWEST:
        return list(records)
    middle = float(np.median(every.speed[every.seen]))
    columns = np.column_stack([np.ones_like(every.speed), every.speed / middle - 1.0, 0.5 * every.side])
    base = means(records)
    cost = _cost(every, base, columns)
    begin = np.linalg.lstsq(columns[every.seen], (every.ratio - base)[every.seen], rcond=None)[0]
    plain, found = _likeliest(every, cost, begin)
    if plain.fun - found.fun < SURE:
        return list(records)
    mean = base + columns @ found.x[3:]
    made, sigma = working(every, mean, float(found.x[1]), _worse(found.x[0]), _missed(found.x[2]))
    return [_with(one, made[every.record == k], sigma[every.record == k]) for k, one in enumerate(records)]


def working(
    every: Rebounds, mean: Array, deviation: float, noise: float = 1.0, missed: float = 0.0
) -> tuple[Array, Array]:
    """Return for each blow the coefficient and its standard deviation that have its likelihood's slope and bend, (b,).

    Args:
        every: the blows.
        mean: coefficient of each, (b,).
        deviation: of the scatter.
        noise: factor on the stated errors.
        missed: part of the rebounds above the threshold of sight that were overlooked.

    >>> none, one = np.array([np.nan]), np.ones(1)
    >>> seen = Rebounds(np.array([0.5]), 0.0 * one, 0.2 * one, one, one, 0 * one)
    >>> [x.round(3).tolist() for x in working(seen, 0.4 * one, 0.1)]
    [[0.5], [0.1]]
    >>> [x.round(3).tolist() for x in working(seen._replace(ratio=none), 0.2 * one, 0.1)]
    [[0.075], [0.125]]
    """
    spread = np.hypot(deviation, noise * every.error)
    at = (every.cut - mean) / spread
    ratio = np.exp(-0.5 * at**2 - 0.5 * np.log(2.0 * np.pi) - log_ndtr(at))
    weak = 1.0 / (
        1.0 + missed / max(1.0 - missed, 1e-12) * np.exp(np.minimum(-log_ndtr(at), 700.0))
    )  # chance that it was weak
    pull = weak * ratio
    bend = np.maximum(pull * (pull + at), 1e-12)
    made = np.where(every.seen, every.ratio, mean - pull / bend * spread)
    return made, np.where(every.seen, spread, spread / np.sqrt(bend))


def _with(one: Evidence, made: Array, sigma: Array) -> Evidence:
    """Return a record with its blows as impacts, except those that tell nothing."""
    seen = one.channels.blows
    least = float(np.median(sigma[seen.seen])) if np.any(seen.seen) else 0.0
    kept = seen.seen | (sigma < least / np.sqrt(TELLS))
    sign = np.where(seen.flank == 0, -1.0, 1.0)
    none = np.zeros_like(sigma)
    impacts = Impacts(seen.time, seen.drive, seen.loose, seen.flank, sign * seen.velocity, none,
                      -sign * made * seen.velocity, sigma * seen.velocity, seen.seen)  # fmt: skip
    return replace(one, channels=one.channels._replace(impacts=Impacts(*(column[kept] for column in impacts))))


def _worse(log: float) -> float:
    """Return the factor on the stated errors, no less than 1: what errors as they are stated explain is no scatter."""
    return float(np.exp(max(log, 0.0)))


def _missed(logit: float) -> float:
    """Return the part of the rebounds above the threshold of sight that were overlooked."""
    return STRAY + (MISSED - STRAY) / (1.0 + float(np.exp(-np.clip(logit, -50.0, 50.0))))


def _cost(every: Rebounds, base: Array, columns: Array) -> Callable[[Array], float]:
    """Return minus twice the log-likelihood of (log of the noise, scatter, part missed, what the mean has more...)."""
    seen = every.seen

    def cost(numbers: Array) -> float:
        mean, missed = base + columns @ numbers[3:], _missed(numbers[2])
        spread = np.hypot(_worse(numbers[0]) * every.error, numbers[1])
        spread = np.maximum(spread, 1e-9)
        normal = -0.5 * np.square((every.ratio[seen] - mean[seen]) / spread[seen]) - np.log(
            np.sqrt(2.0 * np.pi) * spread[seen]
        )
        shown = np.logaddexp(normal + np.log1p(-STRAY), np.log(STRAY)) + np.log1p(-missed)
        below = log_ndtr((every.cut[~seen] - mean[~seen]) / spread[~seen])
        hidden = np.logaddexp(below + np.log1p(-missed), np.log(missed))
        likely = float(np.sum(shown) + np.sum(hidden))
        return -2.0 * likely + (numbers[0] / TRUST) ** 2 + 2.0 * missed / USUAL + (numbers[2] / 10.0) ** 2

    return cost


def _likeliest(every: Rebounds, cost: Callable[[Array], float], begin: Array) -> tuple[Any, Any]:
    """Return the likeliest noise alone, and noise and scatter together, each with what the mean has more."""
    from scipy.optimize import minimize

    usual = max(float(np.median(every.error[every.seen])), 1e-4)
    apart = every.ratio[every.seen] - np.median(every.ratio[every.seen])
    wide = max(1.4826 * float(np.median(np.abs(apart))), usual)
    options = {"xatol": 1e-5, "fatol": 1e-3, "maxiter": 4000, "maxfev": 4000, "adaptive": True}

    def least(function: Callable[[Array], float], starts: list[list[float]]) -> Any:
        tried = [minimize(function, [*one, *begin], method="Nelder-Mead", options=options) for one in starts]
        best = min(tried, key=lambda each: each.fun)
        return minimize(function, best.x, method="Nelder-Mead", options=options) if len(begin) else best

    plain = least(lambda x: cost(np.concatenate([x[:1], [0.0], x[1:]])), [[0.5, logit] for logit in OVERLOOKED])
    few, many = OVERLOOKED[0], float(plain.x[1])
    return plain, least(cost, [[0.0, wide, few], [0.2, 0.3 * usual, few], [0.2, 0.3 * usual, many]])
