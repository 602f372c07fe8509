"""Scatter of restitution: variance of the rebounds beyond their own errors, in proportion to the speed.

Rebounds below a record's detection limit are not observed. They count by the probability of that: without them,
restitution would be too large and its scatter too small. Noise hides stronger ones as well, independent of their speed;
that probability is estimated with the scatter, so that missed rebounds are not taken for weak ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import log_ndtr

from gears3d.diagnosis.causes import ACCEPT
from gears3d.diagnosis.channels import CensoredImpacts, Impacts
from gears3d.diagnosis.evidence import Evidence

Array = np.ndarray
# Minimum number of rebounds.
FEWEST = 20
# Fraction of outlying impacts: wrongly segmented, or merged.
OUTLYING = 0.003
# Maximum fraction of missed rebounds above the detection limit of a record, and its prior mean.
MISSED, USUALLY_MISSED = 0.9, 0.1
# Initial logits of that fraction: 2 % and half of ``MISSED``.
MISSED_STARTS = (-4.0, 0.0)
# Standard deviation of the logarithm of the factor on stated errors.
ERROR_FACTOR = 0.3
# Fraction of the rebounds that are weak.
WEAKER = 0.25
# Information of an impact without rebound, relative to one with rebound, below which it is skipped.
INFORMATIVE = 0.01


class Rebounds(NamedTuple):
    """Impacts of all records, in coefficients of restitution, (b,).

    Args:
        ratio: rebound over approach speed; NaN without a detected rebound.
        error: standard deviation of the ratio by the errors of both speeds.
        cut: detection limit of the ratio.
        speed: of approach [m/s].
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
        """Whether the rebound was detected, (b,)."""
        return np.isfinite(self.ratio)


class Scatter(NamedTuple):
    """The scatter of restitution.

    Args:
        value: standard deviation of the coefficient.
        sigma: of the value.
        gain: fall of chi-square against errors of the speeds alone.
        noise: factor on the stated errors of the speeds.
        missed: fraction of missed rebounds above the detection limit.
    """

    value: float
    sigma: float
    gain: float
    noise: float
    missed: float


def rebounds(records: Sequence[Evidence]) -> Rebounds:
    """Return the impacts of records in coefficients of restitution."""
    rows = []
    for k, one in enumerate(records):
        seen = one.channels.censored_impacts
        slack = np.where(seen.seen, seen.rebound_sigma, _weakest(seen))
        error = np.hypot(slack, one.rig.restitution * seen.velocity_sigma) / seen.velocity
        side = np.where(seen.flank == 0, 1.0, -1.0)
        rows.append((seen.rebound / seen.velocity, error, seen.lowest / seen.velocity, seen.velocity, side,
                     np.full(len(side), k)))  # fmt: skip
    return Rebounds(*(np.concatenate(column) for column in zip(*rows, strict=True)))


def _weakest(seen: CensoredImpacts) -> float:
    """Return the standard deviation of the weaker detected rebounds, as an estimate for the undetected ones."""
    known = seen.seen & (seen.rebound <= np.nanquantile(seen.rebound, WEAKER)) if np.any(seen.seen) else seen.seen
    return float(np.median(seen.rebound_sigma[known])) if np.any(known) else 0.0


def mean_restitution(records: Sequence[Evidence], effects: Iterable[Any] = ()) -> Array:
    """Return the coefficient of each impact by the rig and effects, (b,)."""
    from gears3d.diagnosis.prediction import restitution

    effects, found = list(effects), []
    for one in records:
        seen, own = one.channels.censored_impacts, [*one.scenario.effects, *effects]
        rows = [row for effect in own for row in effect.rows(one.rig)]
        found.append(restitution(rows, one.rig.restitution, seen.velocity, seen.flank))
    return np.concatenate(found)


def scatter(records: Sequence[Evidence], effects: Iterable[Any] = ()) -> Scatter | None:
    """Return the maximum-likelihood scatter of restitution in addition to the errors of the speeds, whose size is free.

    ``None`` with too few rebounds; effects determine the mean.
    """
    every = rebounds(records)
    if np.sum(every.seen) < FEWEST:
        return None
    cost = _cost(every, mean_restitution(records, effects), np.zeros((len(every.speed), 0)))
    plain, found = _most_likely(every, cost, np.zeros(0))
    value = abs(float(found.x[1]))
    step = max(0.05 * value, 1e-4)
    profile = [cost(np.array([found.x[0], value + k * step, *found.x[2:]])) for k in (-1.0, 0.0, 1.0)]
    bend = (profile[0] - 2.0 * profile[1] + profile[2]) / step**2
    sigma = float(np.sqrt(2.0 / bend)) if bend > 0.0 else np.inf
    return Scatter(value, sigma, float(plain.fun - found.fun), _error_factor(found.x[0]), _missed_fraction(found.x[2]))


def with_own_noise(records: Sequence[Evidence]) -> list[Evidence]:
    """Return records whose impacts have the standard deviations of a scattering restitution.

    A cause of the mean is compared with the scatter, and with the impacts without a rebound. The dependence on speed
    and flank is fitted with it. A normal error with the slope and curvature of the likelihood replaces that of each
    impact; one without a rebound becomes an impact.

    Source: the working response of iteratively reweighted least squares (McCullagh & Nelder 1989, section 2.5), of
    likelihoods that are censored (Tobin 1958).
    """
    every = rebounds(records)
    if np.sum(every.seen) < FEWEST:
        return list(records)
    middle = float(np.median(every.speed[every.seen]))
    columns = np.column_stack([np.ones_like(every.speed), every.speed / middle - 1.0, 0.5 * every.side])
    base = mean_restitution(records)
    cost = _cost(every, base, columns)
    begin = np.linalg.lstsq(columns[every.seen], (every.ratio - base)[every.seen], rcond=None)[0]
    plain, found = _most_likely(every, cost, begin)
    if plain.fun - found.fun < ACCEPT:
        return list(records)
    mean = base + columns @ found.x[3:]
    made, sigma = working(every, mean, float(found.x[1]), _error_factor(found.x[0]), _missed_fraction(found.x[2]))
    return [_with_impacts(one, made[every.record == k], sigma[every.record == k]) for k, one in enumerate(records)]


def working(
    every: Rebounds, mean: Array, deviation: float, noise: float = 1.0, missed: float = 0.0
) -> tuple[Array, Array]:
    """Return, for each impact, a coefficient and standard deviation with its likelihood's slope and curvature, (b,).

    mean: coefficient of each, (b,); noise: factor on the stated errors; missed: fraction of missed rebounds.

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
    )  # probability that it was weak
    pull = weak * ratio
    bend = np.maximum(pull * (pull + at), 1e-12)
    made = np.where(every.seen, every.ratio, mean - pull / bend * spread)
    return made, np.where(every.seen, spread, spread / np.sqrt(bend))


def _with_impacts(one: Evidence, made: Array, sigma: Array) -> Evidence:
    """Return a record with its impacts, except those without information."""
    seen = one.channels.censored_impacts
    least = float(np.median(sigma[seen.seen])) if np.any(seen.seen) else 0.0
    kept = seen.seen | (sigma < least / np.sqrt(INFORMATIVE))
    sign = np.where(seen.flank == 0, -1.0, 1.0)
    none = np.zeros_like(sigma)
    impacts = Impacts(seen.time, seen.drive, seen.loose, seen.flank, sign * seen.velocity, none,
                      -sign * made * seen.velocity, sigma * seen.velocity, seen.seen)  # fmt: skip
    return replace(one, channels=one.channels._replace(impacts=Impacts(*(column[kept] for column in impacts))))


def _error_factor(log: float) -> float:
    """Return the factor on the stated errors, at least 1: stated errors are not attributed to scatter."""
    return float(np.exp(max(log, 0.0)))


def _missed_fraction(logit: float) -> float:
    """Return the fraction of missed rebounds above the detection limit."""
    return OUTLYING + (MISSED - OUTLYING) / (1.0 + float(np.exp(-np.clip(logit, -50.0, 50.0))))


def _cost(every: Rebounds, base: Array, columns: Array) -> Callable[[Array], float]:
    """Return minus twice the log-likelihood of (log noise, scatter, missed fraction, additions to the mean...)."""
    seen = every.seen

    def cost(numbers: Array) -> float:
        mean, missed = base + columns @ numbers[3:], _missed_fraction(numbers[2])
        spread = np.hypot(_error_factor(numbers[0]) * every.error, numbers[1])
        spread = np.maximum(spread, 1e-9)
        normal = -0.5 * np.square((every.ratio[seen] - mean[seen]) / spread[seen]) - np.log(
            np.sqrt(2.0 * np.pi) * spread[seen]
        )
        shown = np.logaddexp(normal + np.log1p(-OUTLYING), np.log(OUTLYING)) + np.log1p(-missed)
        below = log_ndtr((every.cut[~seen] - mean[~seen]) / spread[~seen])
        hidden = np.logaddexp(below + np.log1p(-missed), np.log(missed))
        likely = float(np.sum(shown) + np.sum(hidden))
        return (
            -2.0 * likely + (numbers[0] / ERROR_FACTOR) ** 2 + 2.0 * missed / USUALLY_MISSED + (numbers[2] / 10.0) ** 2
        )

    return cost


def _most_likely(every: Rebounds, cost: Callable[[Array], float], begin: Array) -> tuple[Any, Any]:
    """Return the maximum-likelihood noise alone, and noise and scatter together, each with additions to the mean."""
    from scipy.optimize import minimize

    usual = max(float(np.median(every.error[every.seen])), 1e-4)
    apart = every.ratio[every.seen] - np.median(every.ratio[every.seen])
    wide = max(1.4826 * float(np.median(np.abs(apart))), usual)
    options = {"xatol": 1e-5, "fatol": 1e-3, "maxiter": 4000, "maxfev": 4000, "adaptive": True}

    def least(function: Callable[[Array], float], starts: list[list[float]]) -> Any:
        tried = [minimize(function, [*one, *begin], method="Nelder-Mead", options=options) for one in starts]
        best = min(tried, key=lambda each: each.fun)
        return minimize(function, best.x, method="Nelder-Mead", options=options) if len(begin) else best

    plain = least(lambda x: cost(np.concatenate([x[:1], [0.0], x[1:]])), [[0.5, logit] for logit in MISSED_STARTS])
    few, many = MISSED_STARTS[0], float(plain.x[1])
    return plain, least(cost, [[0.0, wide, few], [0.2, 0.3 * usual, few], [0.2, 0.3 * usual, many]])
