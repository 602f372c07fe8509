"""Which causes, added one after the other, make the channels come true."""

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
from gears3d.diagnosis.scatter import with_own_noise
from gears3d.diagnosis.sifting import badly_cut, emptied, without_outliers, without_rolling, without_strays
from gears3d.diagnosis.zeros import dear, goes_by

Array = np.ndarray
ACCEPT = 30.0
"""Fall of chi-square that a cause must bring: by chance, among a thousand candidates of two numbers, in 0.03 %."""
SMALLEST = 0.01
"""Size in units of its channel below which a cause is none: the cutting of records makes as much by itself."""
LARGEST = 3.0
"""Size in units above which a cause is none: it makes up for what is hardly its own. The drive's motion is measured as
such, and may be of any size."""
APART = 5.0
"""Times the usual error of contact of a record from which on one does not agree with the others."""
FAR = (100.0, 30.0, 12.0, 7.0)
"""Standard deviations from what the strongest cause leaves beyond which points of contact and impacts are left out, one
after the other."""
OWN = 10.0
"""Chi-square that a cause must be expected to gain in a record, for its absence there to count."""
MOST = 5
"""Causes at most."""
ONCE = ("drag_power", "drag_drift", "drag_differential")
"""Torques whose shape is fitted: what one of them leaves, another of its kind only patches."""
PRICE = 8.0
"""Chi-square that a number must be worth against a rival with fewer."""
TRIED = 12
"""Candidates that are fitted in each round."""
NEAR = 0.2
"""Part of the best gain that a candidate needs to be fitted."""


class Search(NamedTuple):
    """What a search found.

    Args:
        fit: the causes.
        base: residuals of the rig as it is, (n,).
        left: what further candidates would still gain, most first.
        known: the candidates.
        records: without the points that do not belong to their channel.
    """

    fit: Fit
    base: Array
    left: list[Scored]
    known: Library
    records: list[Evidence]


def search(records: Sequence[Evidence], highest: int = 40, first: Sequence[Cause] = ()) -> Search:
    """Return the causes that make the channels come true.

    Args:
        records: of one rig.
        highest: order that is looked for.
        first: causes that are known to be there, and tried before others; they must gain as those do.
    """
    records = with_own_noise([without_strays(one) for one in records])
    strongest = _search(records, highest, 1, first)
    now = strongest.fit
    if now.causes and (better := without_rolling(records, now.rest)) is not None:
        records = better
        now = fit(records, _base(records), now.causes)
    for far in FAR:  # the worst first: they bend the fit that the others are held against
        if (better := without_outliers(records, _held(records, now), far)) is not None:
            records = better
            now = fit(records, _base(records), now.causes)
    bad = ~_agreeing(records, now) & [badly_cut(one) for one in records]
    records = [emptied(one) if worse else one for one, worse in zip(records, bad, strict=True)]
    return _search(records, highest, MOST, first, strongest.known)


def given(records: Sequence[Evidence], causes: Sequence[Cause], kinds: Sequence[str]) -> Search:
    """Return a search with causes that are known otherwise, without points that they leave far off.

    Args:
        records: of one rig.
        causes: with their numbers.
        kinds: of the candidates that it knows.
    """
    records = with_own_noise([without_strays(one) for one in records])
    effects = [one.effect for one in causes if one.effect is not None]
    for far in FAR:
        rest = _base(records) - contribution(records, effects)
        records = without_outliers(records, rest, far) or records
    asked = [one for one in _candidates(records, 0) if one.kind in kinds]
    base = _base(records)
    return Search(fit(records, base, causes), base, [], library(records, asked), list(records))


def in_own_channels(found: Search, kinds: Sequence[str]) -> list[Cause]:
    """Return causes of some kinds that their channels ask for beside those that are known.

    Args:
        found: with the causes that are known.
        kinds: that are looked for.
    """
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
    """Return residuals that causes leave with the numbers of those records that agree, (n,).

    Args:
        records: all.
        now: causes with the numbers that a record that was cut badly may have bent.
    """
    agree = _agreeing(records, now)
    if np.all(agree) or not now.causes:
        return now.rest
    some = [one for one, good in zip(records, agree, strict=True) if good]
    effects = [cause.effect for cause in fit(some, _base(some), now.causes).causes]
    return _base(records) - contribution(records, [effect for effect in effects if effect is not None])


def _agreeing(records: Sequence[Evidence], now: Fit) -> Array:
    """Return whether contact of each record is as near to what a fit makes of it as that of most others, (r,)."""
    own = parts_of(records, now.rest)["contact"]
    errors = np.array([np.sqrt(np.mean(part**2)) if part.size else 0.0 for part in own])
    return errors <= APART * max(float(np.median(errors)), 1.0)


def _base(records: Sequence[Evidence]) -> Array:
    """Return the residuals of the rig as it is, stacked, (n,)."""
    told = [residuals(one) for one in records]
    return np.concatenate([one[name] for name in CHANNELS for one in told])


def known_of(records: Sequence[Evidence], highest: int, before: Library | None = None) -> tuple[Array, Library]:
    """Return the residuals of the rig as it is, stacked, (n,), and the candidates that are looked for in them.

    Args:
        records: of one rig.
        highest: order that is looked for.
        before: candidates of the same records, some of whose channels may have had other points.
    """
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
    """Return the cause that a search would accept next; ``None`` where no candidate gains enough.

    Args:
        found: by the search.
    """
    more = {gear: dear(found.records, gear) for gear in ("drive", "loose", "")}
    left = score(found.known, found.fit.rest, directions(found.records, found.fit))
    return next(iter(_able(left, more, found.fit.causes)), None)


def _able(left: list[Scored], more: dict[str, float], causes: Sequence[Cause] = ()) -> list[Scored]:
    """Return the candidates that would gain enough at a size that matters, most first.

    Where one that is too small gains more in the same channel, that is what is there, and others only look like it. A
    cause that is there already is none anew: what it leaves is not of its form.
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

    Columns are straight lines in its thickness; how far a tooth that stands back lets gears fall is none.
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
    """Whether a cause gains in most of the records in which it should show, not in a single one that was cut badly.

    Args:
        records: all.
        cause: that is asked about.
        without: residuals without it, (n,).
        rest: residuals with it, (n,).
    """
    if not _within(cause):
        return False
    owner = [np.full(len(added(one, (), name)), k) for name in CHANNELS for k, one in enumerate(records)]
    expected = np.bincount(np.concatenate(owner), (without - rest) ** 2, len(records))
    gained = np.bincount(np.concatenate(owner), without**2 - rest**2, len(records))
    asked = expected > OWN
    return bool(np.sum(gained[asked] > 0.25 * expected[asked]) > 0.5 * np.sum(asked)) or not np.any(asked)


def _within(cause: Cause) -> bool:
    """Whether the size of a cause is one that a rig may have."""
    sizes = 2 if cause.candidate.phased else 1
    size = float(np.hypot.reduce(cause.numbers[:sizes])) / cause.candidate.unit
    return SMALLEST / 2.0 < size < _largest(cause.candidate) and cause.possible


def _largest(one: Candidate) -> float:
    return np.inf if one.kind == "drive_motion" else LARGEST


def directions(records: Sequence[Evidence], now: Fit) -> Array | None:
    """Return the slopes of all numbers of a fit, orthonormal, (n, p); ``None`` without causes.

    Args:
        records: all.
        now: the fit.
    """
    if not now.causes:
        return None
    slopes = np.column_stack([column for cause in now.causes for column in slopes_of(records, cause)])
    return np.linalg.qr(slopes)[0]


def keeping(found: Search, causes: Sequence[Cause]) -> Search:
    """Return a search of whose causes only some were accepted after all.

    Args:
        found: by the search.
        causes: that stay, in new fits.
    """
    now = fit(found.records, found.base, causes)
    return found._replace(fit=now, left=score(found.known, now.rest))


def blind(records: Sequence[Evidence]) -> Search:
    """Return a search in records that could not be cut.

    Args:
        records: without a point in any channel.
    """
    none, nowhere = np.zeros(0), slice(0, 0)
    parts = {name: [nowhere] * len(records) for name in CHANNELS}
    known = Library([], {}, dict.fromkeys(CHANNELS, nowhere), tuple(records), parts)
    return Search(fit(records, none, ()), none, [], known, list(records))
