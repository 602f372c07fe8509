"""Stepwise selection of the causes that explain the channels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import FREE, Candidate, candidates
from gears3d.diagnosis.cause import Cause, Fit, begin, contribution, fit, slopes_of
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.library import Library, Scored, library, price, score
from gears3d.diagnosis.motions import lines
from gears3d.diagnosis.prediction import CHANNELS, added, parts_of, residuals
from gears3d.diagnosis.restitution_scatter import with_own_noise
from gears3d.diagnosis.sifting import badly_cut, emptied, without_outliers, without_rolling, without_strays
from gears3d.diagnosis.zeros import dear, goes_by

Array = np.ndarray
# Threshold Δχ² of a cause: false alarm probability 0.03 % over a thousand candidates of two numbers.
ACCEPT = 30.0
# Size in units of its channel below which a cause is ignored: errors of segmentation have this size.
SMALLEST = 0.01
# Size in units above which a cause is rejected: it compensates another. The drive's motion is measured as such, and may
# be of any size.
LARGEST = 3.0
# Ratio to the median contact error of a record above which one does not agree with the others.
APART = 5.0
# Residuals from the strongest cause, in standard deviations, beyond which points of contact and impacts are excluded,
# in turn.
FAR = (100.0, 30.0, 12.0, 7.0)
# Expected chi-square gain of a cause in a record above which its absence there counts.
OWN = 10.0
# Maximum number of causes.
MOST = 5
# Torques with a fitted shape: another of the kind would only compensate the residual of the first.
ONCE = ("drag_power", "drag_drift", "drag_differential")
# Chi-square that a parameter must gain against a competing hypothesis with fewer parameters.
PRICE = 8.0
# Number of candidates that are fitted in each round.
TRIED = 12
# Minimum gain, relative to the best, of a candidate that is fitted.
NEAR = 0.2


class Search(NamedTuple):
    """Result of a search.

    Args:
        fit: the causes.
        base: residuals of the rig as it is, (n,).
        left: gain of further candidates, largest first.
        known: the candidates.
        records: without excluded points.
    """

    fit: Fit
    base: Array
    left: list[Scored]
    known: Library
    records: list[Evidence]


def search(records: Sequence[Evidence], highest: int = 40, first: Sequence[Cause] = ()) -> Search:
    """Return the causes that explain the channels.

    highest: order that is searched; first: known causes, tried before others; they must gain as those do.
    """
    records = with_own_noise([without_strays(one) for one in records])
    strongest = _search(records, highest, 1, first)
    now = strongest.fit
    if now.causes and (better := without_rolling(records, now.rest)) is not None:
        records = better
        now = fit(records, _base(records), now.causes)
    for far in FAR:  # the worst first: they bias the fit that the others are compared with
        if (better := without_outliers(records, _held(records, now), far)) is not None:
            records = better
            now = fit(records, _base(records), now.causes)
    bad = ~_agreeing(records, now) & [badly_cut(one) for one in records]
    records = [emptied(one) if worse else one for one, worse in zip(records, bad, strict=True)]
    return _search(records, highest, MOST, first, strongest.known)


def given(records: Sequence[Evidence], causes: Sequence[Cause], kinds: Sequence[str]) -> Search:
    """Return a search with causes from another source, without points of large residuals."""
    records = with_own_noise([without_strays(one) for one in records])
    effects = [one.effect for one in causes if one.effect is not None]
    for far in FAR:
        rest = _base(records) - contribution(records, effects)
        records = without_outliers(records, rest, far) or records
    asked = [one for one in _candidates(records, 0) if one.kind in kinds]
    base = _base(records)
    return Search(fit(records, base, causes), base, [], library(records, asked), list(records))


def in_own_channels(found: Search, kinds: Sequence[str]) -> list[Cause]:
    """Return causes of some kinds that their channels require in addition to the known ones."""
    asked = [one for one in found.known.candidates if one.kind in kinds]
    if not asked:
        return []
    known = found.known if len(asked) == len(found.known.candidates) else library(found.records, asked)
    none: dict[str, float] = dict.fromkeys(("drive", "loose", ""), 0.0)
    now = begun = found.fit
    while len(now.causes) < len(begun.causes) + MOST:
        able = _able(score(known, now.rest, directions(found.records, now)), none, now.causes)
        if not able:
            break
        now = fit(found.records, found.base, [*now.causes, begin(able[0].candidate, able[0].units)], 8)
    return list(now.causes[len(begun.causes) :])


def _held(records: Sequence[Evidence], now: Fit) -> Array:
    """Return residuals from causes with the numbers of the records that agree, (n,)."""
    agree = _agreeing(records, now)
    if np.all(agree) or not now.causes:
        return now.rest
    some = [one for one, good in zip(records, agree, strict=True) if good]
    effects = [cause.effect for cause in fit(some, _base(some), now.causes).causes]
    return _base(records) - contribution(records, [effect for effect in effects if effect is not None])


def _agreeing(records: Sequence[Evidence], now: Fit) -> Array:
    """Return whether the contact residuals of each record are as small as those of most others, (r,)."""
    own = parts_of(records, now.rest)["contact"]
    errors = np.array([np.sqrt(np.mean(part**2)) if part.size else 0.0 for part in own])
    return errors <= APART * max(float(np.median(errors)), 1.0)


def _base(records: Sequence[Evidence]) -> Array:
    """Return the residuals of the rig as it is, stacked, (n,)."""
    told = [residuals(one) for one in records]
    return np.concatenate([one[name] for name in CHANNELS for one in told])


def known_of(records: Sequence[Evidence], highest: int, before: Library | None = None) -> tuple[Array, Library]:
    """Return the residuals of the rig as it is, stacked, (n,), and the candidates for them."""
    return _base(records), library(records, _candidates(records, highest), before)


def _candidates(records: Sequence[Evidence], highest: int) -> list[Candidate]:
    duration = max(float(one.channels.drive.time[-1] - one.channels.drive.time[0]) for one in records)
    rig = replace(records[0].rig, mean_speed=float(np.mean([abs(one.motion.mean) for one in records])))
    return candidates(rig, duration, highest, *lines(records))


def _search(
    records: Sequence[Evidence], highest: int, most: int, first: Sequence[Cause], before: Library | None = None
) -> Search:
    base, known = known_of(records, highest, before)
    more = {gear: dear(records, gear) for gear in ("drive", "loose", "")}
    now = fit(records, base, first)
    left = score(known, now.rest, directions(records, now))
    while len(now.causes) < most and (able := _able(left, more, now.causes)):
        best = _best(records, base, now, able, more)
        if not best.causes[-1].possible:
            break
        now = best
        left = score(known, now.rest, directions(records, now))
    now = _pruned(records, base, now, more)
    left = score(known, now.rest, directions(records, now))
    return Search(now, base, left, known, list(records))


def next_cause(found: Search) -> Scored | None:
    """Return the next cause that a search would accept; ``None`` if no candidate gains enough."""
    more = {gear: dear(found.records, gear) for gear in ("drive", "loose", "")}
    left = score(found.known, found.fit.rest, directions(found.records, found.fit))
    return next(iter(_able(left, more, found.fit.causes)), None)


def _able(left: list[Scored], more: dict[str, float], causes: Sequence[Cause] = ()) -> list[Scored]:
    """Return the candidates that gain enough at a relevant size, largest gain first.

    If a candidate that is too small gains more in the same channel, it is the cause, and others only resemble it. An
    accepted cause is not added again: its residual does not have its form.
    """
    able, small = [], set()
    there = [(one.candidate.kind, one.candidate.shape) for one in causes if not FREE.get(one.candidate.kind)]
    once = {one.candidate.kind for one in causes if one.candidate.kind in ONCE}
    for one in left:
        if one.gain <= ACCEPT:
            break
        if (one.candidate.kind, one.candidate.shape) in there or one.candidate.kind in once:
            continue
        if one.gain <= ACCEPT + more[goes_by(one.candidate)]:
            continue
        size = float(np.hypot.reduce(one.units))
        if size <= SMALLEST:
            small |= set(one.candidate.channels)
        elif size < _largest(one.candidate) and not small & set(one.candidate.channels):
            able.append(one)
    return able


def _best(records: Sequence[Evidence], base: Array, now: Fit, left: list[Scored], more: dict[str, float]) -> Fit:
    """Return the fit with one more cause, the best of several."""
    tried, kinds = [], {}
    for one in left:
        if one.gain < NEAR * left[0].gain or len(tried) >= TRIED:
            break
        kind = one.candidate.kind
        kinds[kind] = kinds.get(kind, 0) + 1
        bends = kind in FREE
        if kinds[kind] > (1 if bends else 2):
            continue
        same = [one.candidate, *on_both_flanks(one.candidate)] if kinds[kind] == 1 else [one.candidate]
        fits = [fit(records, base, [*now.causes, begin(each, one.units)], 8 if bends else 2) for each in same]
        tried.append(min(fits, key=lambda each: float(np.sum(np.minimum(each.rest**2, FAR[-1] ** 2)))))
    return min(tried, key=lambda one: (not one.causes[-1].possible, _worth(one, more)))


def on_both_flanks(one: Candidate) -> list[Candidate]:
    """Return the candidate on both flanks of a tooth on one.

    Regressors are linear in its thickness; the approach of the gears at a short tooth is not.
    """
    beside = one.kind == "pitch_error" and one.shape["flank"] != "both"
    return [one._replace(shape={**one.shape, "flank": "both"})] if beside else []


def _worth(found: Fit, more: dict[str, float]) -> float:
    gears = {goes_by(cause.candidate) for cause in found.causes}
    zeros = sum(more[gear] for gear in gears)
    return found.chi2 + PRICE * len(found.covariance) + sum(price(cause.candidate) for cause in found.causes) + zeros


def _pruned(records: Sequence[Evidence], base: Array, now: Fit, more: dict[str, float]) -> Fit:
    """Return the fit without causes that the others make needless."""
    now = fit(records, base, now.causes)
    k = 0
    while k < len(now.causes):
        less = fit(records, base, now.causes[:k] + now.causes[k + 1 :])
        least = ACCEPT + more[goes_by(now.causes[k].candidate)]
        if less.chi2 - now.chi2 < least or not _everywhere(records, now.causes[k], less.rest, now.rest):
            now, k = less, 0
        else:
            k += 1
    return now


def _everywhere(records: Sequence[Evidence], cause: Cause, without: Array, rest: Array) -> bool:
    """Whether a cause gains in most of the records in which it should show, not in one poorly segmented record only.

    without, rest: residuals without and with it, (n,).
    """
    if not _within(cause):
        return False
    owner = [np.full(len(added(one, (), name)), k) for name in CHANNELS for k, one in enumerate(records)]
    expected = np.bincount(np.concatenate(owner), (without - rest) ** 2, len(records))
    gained = np.bincount(np.concatenate(owner), without**2 - rest**2, len(records))
    asked = expected > OWN
    return bool(np.sum(gained[asked] > 0.25 * expected[asked]) > 0.5 * np.sum(asked)) or not np.any(asked)


def _within(cause: Cause) -> bool:
    """Whether the size of a cause is possible for a rig."""
    sizes = 2 if cause.candidate.phased else 1
    size = float(np.hypot.reduce(cause.numbers[:sizes])) / cause.candidate.unit
    return SMALLEST / 2.0 < size < _largest(cause.candidate) and cause.possible


def _largest(one: Candidate) -> float:
    return np.inf if one.kind == "drive_motion" else LARGEST


def directions(records: Sequence[Evidence], now: Fit) -> Array | None:
    """Return the slopes of all numbers of a fit, orthonormal, (n, p); ``None`` without causes."""
    if not now.causes:
        return None
    slopes = np.column_stack([column for cause in now.causes for column in slopes_of(records, cause)])
    return np.linalg.qr(slopes)[0]


def keeping(found: Search, causes: Sequence[Cause]) -> Search:
    """Return a search with only some of its causes, in new fits."""
    now = fit(found.records, found.base, causes)
    return found._replace(fit=now, left=score(found.known, now.rest))


def blind(records: Sequence[Evidence]) -> Search:
    """Return a search in records that could not be segmented."""
    none, nowhere = np.zeros(0), slice(0, 0)
    parts = {name: [nowhere] * len(records) for name in CHANNELS}
    known = Library([], {}, dict.fromkeys(CHANNELS, nowhere), tuple(records), parts)
    return Search(fit(records, none, ()), none, [], known, list(records))
