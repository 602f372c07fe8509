"""Stepwise selection of the causes that explain the channels, competing hypotheses, and their probabilities.

Points that segmentation assigned to a wrong flank or moment are excluded before. Where angular datums are unknown,
records are aligned, searched, and aligned again by the causes found. Every cause is then replaced by each other
candidate: those that the likelihood ratio does not exclude are competing hypotheses. Their posterior probability is the
Laplace approximation: exp(−Δχ²/2), Δχ² over what a model of these records may err by, times the ratio of posterior to
prior volume of the parameters (Occam factor). What is not in the catalogue has the probability of wrong names in blind
tests.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import exp, pi, prod
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import (
    ACCEPT,
    EXCLUDED,
    FREE,
    Candidate,
    Cause,
    Fit,
    Regressors,
    Scored,
    acceptable,
    begin,
    candidates,
    contribution,
    drive_lines,
    excluding,
    fit,
    goes_by,
    is_accepted,
    price,
    regressors_of,
    score,
    slopes_of,
    table,
)
from gears3d.diagnosis.channels import Flights
from gears3d.diagnosis.evidence import Evidence, evidence
from gears3d.diagnosis.path_candidates import FEWEST_REBOUNDS, with_own_noise
from gears3d.diagnosis.prediction import CHANNELS, GEARS, added, deceleration_response, parts_of, project_out, residuals
from gears3d.diagnosis.preprocessing import (
    Phases,
    datum_shifts,
    exceeds_uncertainty,
    free_phases,
    order_of,
    parameter_penalty,
    reference,
    settled,
    single_tooth,
    turn,
)
from gears3d.errors import GearsError
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

Array = np.ndarray
# Ratio to the median contact error of a record above which one does not agree with the others.
INCONSISTENT = 5.0
# Residuals from the strongest cause, in standard deviations, beyond which points of contact and impacts are excluded,
# in turn.
FAR = (100.0, 30.0, 12.0, 7.0)
# Maximum number of causes.
MOST_CAUSES = 5
# Chi-square that a parameter must gain against a competing hypothesis with fewer parameters.
PRICE = 8.0
# Number of candidates that are fitted in each round.
TRIED = 12
# Minimum gain, relative to the best, of a candidate that is fitted.
FITTED_GAIN = 0.2
SINGLE_TOOTH = "pitch_error"
# Chi-square threshold of a single tooth, beyond that of its free places, to fix the angular datums.
TOOTH_GAIN = 60.0
# Maximum number of joint fits of datums and causes, and the change of chi-square that ends them.
JOINT_FITS, ENOUGH = 2, 1.0
# Maximum number of rounds of alignment and search.
ALIGNMENTS = 3
# Distance from the others of its flank, in median distances, beyond which a contact loss is excluded.
STRAY = 6.0
# Difference from the other flights of a record, relative to the drag's deceleration, that is always accepted.
ACCEPTED_SPREAD = 0.5
# Fraction of a record's flights that defines the usual deviation from a parabola.
USUAL_SHAPE = 0.9
# Maximum fraction of excluded points of a channel of a record: errors of segmentation are fewer.
MOST_EXCLUDED = 0.2


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
    known: Regressors
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
    bad = ~_agreeing(records, now) & [badly_segmented(one) for one in records]
    records = [reject_record(one) if worse else one for one, worse in zip(records, bad, strict=True)]
    return _search(records, highest, MOST_CAUSES, first, strongest.known)


def given(records: Sequence[Evidence], causes: Sequence[Cause], kinds: Sequence[str]) -> Search:
    """Return a search with causes from another source, without points of large residuals."""
    records = with_own_noise([without_strays(one) for one in records])
    effects = [one.effect for one in causes if one.effect is not None]
    for far in FAR:
        rest = _base(records) - contribution(records, effects)
        records = without_outliers(records, rest, far) or records
    asked = [one for one in _candidates(records, 0) if one.kind in kinds]
    base = _base(records)
    return Search(fit(records, base, causes), base, [], regressors_of(records, asked), list(records))


def in_own_channels(found: Search, kinds: Sequence[str]) -> list[Cause]:
    """Return causes of some kinds that their channels require in addition to the known ones."""
    asked = [one for one in found.known.candidates if one.kind in kinds]
    if not asked:
        return []
    known = found.known if len(asked) == len(found.known.candidates) else regressors_of(found.records, asked)
    none: dict[str, float] = dict.fromkeys(("drive", "loose", ""), 0.0)
    now = begun = found.fit
    while len(now.causes) < len(begun.causes) + MOST_CAUSES:
        able = acceptable(score(known, now.rest, directions(found.records, now)), none, now.causes)
        if not able:
            break
        more = fit(found.records, found.base, [*now.causes, begin(able[0].candidate, able[0].units)], 8)
        if not _has_determined_sizes(more):
            break
        now = more
    return list(now.causes[len(begun.causes) :])


def _has_determined_sizes(now: Fit) -> bool:
    """Return whether each size differs from 0 by four standard deviations: neighbouring lines cancel each other."""
    at, sure = 0, []
    for cause in now.causes:
        own = slice(at, at + (2 if cause.candidate.phased else 1))
        at += len(cause.numbers)
        size = cause.numbers[: own.stop - own.start]
        sure.append(size @ np.linalg.pinv(now.covariance[own, own], hermitian=True) @ size > EXCLUDED)
    return all(sure)


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
    return errors <= INCONSISTENT * max(float(np.median(errors)), 1.0)


def _base(records: Sequence[Evidence]) -> Array:
    """Return the residuals of the rig as it is, stacked, (n,)."""
    rests = [residuals(one) for one in records]
    return np.concatenate([one[name] for name in CHANNELS for one in rests])


def known_of(records: Sequence[Evidence], highest: int, before: Regressors | None = None) -> tuple[Array, Regressors]:
    """Return the residuals of the rig as it is, stacked, (n,), and the candidates for them."""
    return _base(records), regressors_of(records, _candidates(records, highest), before)


def _candidates(records: Sequence[Evidence], highest: int) -> list[Candidate]:
    duration = max(float(one.channels.drive.time[-1] - one.channels.drive.time[0]) for one in records)
    rig = replace(records[0].rig, mean_speed=float(np.mean([abs(one.motion.mean) for one in records])))
    return candidates(rig, duration, highest, *drive_lines(records))


def _search(
    records: Sequence[Evidence], highest: int, most: int, first: Sequence[Cause], before: Regressors | None = None
) -> Search:
    base, known = known_of(records, highest, before)
    more = {gear: parameter_penalty(records, gear) for gear in ("drive", "loose", "")}
    now = fit(records, base, first)
    left = score(known, now.rest, directions(records, now))
    while len(now.causes) < most and (able := acceptable(left, more, now.causes)):
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
    more = {gear: parameter_penalty(found.records, gear) for gear in ("drive", "loose", "")}
    left = score(found.known, found.fit.rest, directions(found.records, found.fit))
    return next(iter(acceptable(left, more, found.fit.causes)), None)


def _best(records: Sequence[Evidence], base: Array, now: Fit, left: list[Scored], more: dict[str, float]) -> Fit:
    """Return the fit with one more cause, the best of several."""
    tried, kinds = [], {}
    for one in left:
        if one.gain < FITTED_GAIN * left[0].gain or len(tried) >= TRIED:
            break
        kind, bends = one.candidate.kind, one.candidate.kind in FREE
        kinds[kind] = kinds.get(kind, 0) + 1
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
        if is_accepted(records, now.causes[k], less, now, more):
            k += 1
        else:
            now, k = less, 0
    return now


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
    known = Regressors([], {}, dict.fromkeys(CHANNELS, nowhere), tuple(records), parts)
    return Search(fit(records, none, ()), none, [], known, list(records))


def aligned_search(records: list[Evidence], highest: int, first: Sequence[Cause] = ()) -> tuple[list[Evidence], Search]:
    """Return the records with angles counted from the datum of one of them, and the result of a search there.

    Each gear is aligned by the strongest candidate that depends on its angle. In the first round it is taken from the
    records as they are; in later rounds the effects of the other causes are removed before.
    """
    gears = [gear for gear in GEARS if free_phases(records, gear)]
    if not gears:
        return records, search(records, highest, first)
    base, known = known_of(with_own_noise([without_strays(one) for one in records]), highest)
    shifts = {gear: _datum_shifts(known, base, gear) for gear in gears}
    found = None
    for _ in range(ALIGNMENTS):
        by = {gear: _applied_shifts(records, gear, shifts.get(gear)) for gear in GEARS}
        if found is not None and not any(
            one is not None and exceeds_uncertainty(one[1], by[gear]) for gear, one in shifts.items()
        ):
            break
        records = [turn(*each) for each in zip(records, by["drive"], by["loose"], strict=True)]
        found = search(records, highest, first)
        shifts = {gear: _remaining_shifts(found, gear) for gear in gears}
    assert found is not None
    for _ in range(JOINT_FITS):
        by, changed = settled(found.records, found.fit.causes)
        if changed < ENOUGH:
            break
        records = [turn(one, *pair) for one, pair in zip(records, by, strict=True)]
        found = search(records, highest, first)
    return records, found


def _datum_shifts(known: Regressors, rest: Array, gear: str) -> tuple[Array, Phases] | None:
    """Return the datum shifts of records from the candidate of largest gain with an order, or from a single tooth."""
    phases, single = datum_shifts(known, rest, gear), single_tooth(known, rest, gear)
    lost = np.array([gear in one.unmarked for one in known.records])
    if not np.all(lost) or single.gain < (phases[1].gain if phases is not None else TOOTH_GAIN):
        return phases
    one = Candidate(SINGLE_TOOTH, {"gear": gear}, "offset", 1.0, False, ("contact",))
    return single.turns, Phases(one, single.gain, single.place, single.worth * single.teeth**2)


def _applied_shifts(records: Sequence[Evidence], gear: str, shifts: tuple[Array, Phases] | None) -> Array:
    """Return the datum shifts of records; a record that shows the candidate clearly keeps its datum."""
    if shifts is None:
        return np.zeros(len(records))
    by, seen = shifts
    if seen.candidate.kind == SINGLE_TOOTH or not all(gear in one.unmarked for one in records):
        return by
    first, side = reference(seen.worth), GEARS.index(gear)
    return by - (records[first].turned[side] + by[first])


def _remaining_shifts(found: Search, gear: str) -> tuple[Array, Phases] | None:
    """Return the remaining datum shifts of records, from the residuals without the causes of other angles."""
    own = [cause for cause in found.fit.causes if goes_by(cause.candidate) == gear]
    effects = [cause.effect for cause in own if cause.effect is not None]
    parts = contribution(found.records, effects)
    shifts = _datum_shifts(found.known, found.fit.rest + parts, gear)
    if (
        shifts is None
        or shifts[1].candidate.kind == SINGLE_TOOTH
        or order_of(shifts[1].candidate) == 1
        or exceeds_uncertainty(shifts[1], shifts[0])
    ):
        return shifts
    strongest = [one for one in effects if getattr(one, "order", 1) == order_of(shifts[1].candidate)]
    rest = found.fit.rest + parts - contribution(found.records, strongest)
    return _whole_periods(shifts, datum_shifts(found.known, rest, gear, [order_of(shifts[1].candidate)]))


def _whole_periods(shifts: tuple[Array, Phases], other: tuple[Array, Phases] | None) -> tuple[Array, Phases]:
    """Return shifts by whole periods of the strongest order, selected by another order."""
    if other is None:
        return shifts
    period, own = 2.0 * pi / order_of(shifts[1].candidate), 2.0 * pi / order_of(other[1].candidate)
    tried = period * np.arange(order_of(shifts[1].candidate))
    off = np.abs((tried[None] - other[0][:, None] + own / 2.0) % own - own / 2.0)
    best = tried[np.argmin(off, axis=1)]
    return np.where(other[0] == 0.0, 0.0, best), other[1]


def without_strays(one: Evidence) -> Evidence:
    """Return a record without contact losses, and flights, far from all others of their flank.

    A gear that rolls off the edge of a tooth moves on a parabola, too, but not on that of a flight.
    """
    rest_of = residuals(one)
    one = _without_rolling(one, rest_of["flight"])
    losses, rest = one.channels.losses, rest_of["loss"]
    good = np.ones(len(rest), bool)
    for flank in (0, 1):
        own = losses.flank == flank
        if np.any(own):
            middle = np.median(rest[own])
            usual = max(1.4826 * float(np.median(np.abs(rest[own] - middle))), 1.0)
            good[own] = np.abs(rest[own] - middle) < STRAY * usual
    kept = type(losses)(*(column[good] for column in losses))
    left_out = {**one.channels.left_out, "loss": one.channels.left_out.get("loss", 0) + int(np.sum(~good))}
    return replace(one, channels=one.channels._replace(losses=kept, left_out=left_out))


def _without_rolling(one: Evidence, rest: Array) -> Evidence:
    """Return a record without the few flights that differ from all others in deceleration or shape."""
    flights = one.channels.flights
    if len(flights.time) < FEWEST_REBOUNDS:
        return one
    shape = deceleration_response(one)
    square, rest = np.sum(shape**2, axis=1), rest.reshape(shape.shape)
    slow, sigma = np.sum(shape * rest, axis=1) / square, square**-0.5
    off = np.abs(slow - np.median(slow))
    usual = 1.4826 * float(np.median(off)) + ACCEPTED_SPREAD / STRAY * one.rig.drag_torque / one.rig.inertia
    bent = np.sqrt(np.mean(project_out(rest, (shape,)) ** 2, axis=1))
    good = (off < STRAY * np.hypot(usual, sigma)) & (bent < STRAY * max(float(np.quantile(bent, USUAL_SHAPE)), 1.0))
    if np.all(good) or np.mean(~good) > MOST_EXCLUDED:
        return one
    kept = Flights(*(column[good] for column in flights))
    left_out = {**one.channels.left_out, "flight": one.channels.left_out.get("flight", 0) + int(np.sum(~good))}
    seen = one.channels._replace(flights=kept, left_out=left_out)
    return replace(one, channels=seen, fine=tuple(column[good] for column in one.fine), at=one.at[good])


def badly_segmented(one: Evidence) -> bool:
    """Whether more of a record's contact was excluded than errors of segmentation explain."""
    out = one.channels.left_out.get("contact", 0)
    return out > MOST_EXCLUDED * (out + len(one.channels.contacts.time))


def reject_record(one: Evidence) -> Evidence:
    """Return a record with only the drive's motion."""
    seen, names = one.channels, {"flights": "flight", "contacts": "contact", "impacts": "impact", "losses": "loss"}
    sizes = {channel: len(getattr(seen, name).time) for name, channel in names.items()}
    left_out = {channel: seen.left_out.get(channel, 0) + size for channel, size in sizes.items()}
    gone: dict[str, Any] = {}
    for name in (*names, "censored_impacts", "contact_ends", "velocity_jumps"):
        points = getattr(seen, name)
        gone[name] = type(points)(*(column[:0] for column in points))
    kept = seen._replace(**gone, left_out=left_out)
    return replace(one, channels=kept, fine=tuple(column[:0] for column in one.fine), at=one.at[:0])


def without_rolling(records: Sequence[Evidence], rest: Array) -> list[Evidence] | None:
    """Return records without the few flights that a cause leaves far from all others; ``None`` without any.

    If the readings of all flights are distorted equally, wrongly segmented ones show only once that is explained.

    rest: stacked as :mod:`gears3d.diagnosis.prediction` does, (n,).
    """
    found = [_without_rolling(*each) for each in zip(records, parts_of(records, rest)["flight"], strict=True)]
    return found if any(a is not b for a, b in zip(found, records, strict=True)) else None


def without_outliers(records: Sequence[Evidence], rest: Array, most: float) -> list[Evidence] | None:
    """Return records without contact points and impacts of large residuals; ``None`` without any.

    rest: stacked as :mod:`gears3d.diagnosis.prediction` does, (n,); most: largest residual, in standard deviations.
    """
    parts, found = parts_of(records, rest), []
    for k, one in enumerate(records):
        seen = one.channels
        kept, left_out = {}, dict(seen.left_out)
        for name, own in (("contact", seen.contacts), ("impact", seen.impacts)):
            off = parts[name][k]
            if name == "contact" and len(off):  # its datum is arbitrary, and was biased by the outliers
                off = off - np.median(off)
            far = np.abs(off) > most
            if not np.any(far) or np.mean(far) > MOST_EXCLUDED:
                continue
            kept[name + "s"] = type(own)(*(column[~far] for column in own))
            left_out[name] = left_out.get(name, 0) + int(np.sum(far))
        found.append(replace(one, channels=seen._replace(**kept, left_out=left_out)) if kept else one)
    return found if any(a is not b for a, b in zip(found, records, strict=True)) else None


# Number of hypotheses of other kinds that are fitted for each cause.
FITTED_RIVALS = 6
# Maximum number of pairs of a cause and a competing hypothesis for which runs are proposed.
PAIRS = 3
# Duration of a proposed run [s].
RUN_DURATION = 12.0
# Minimum simulated duration of it, in seconds and in periods of the drive.
SIMULATED, SIMULATED_PERIODS = 3.0, 8.0
# Duration ratio of the run that is only longer.
LONGER = 5


class Rival(NamedTuple):
    """One or two causes that replace another.

    Args:
        causes: of the hypothesis.
        worse: rise of chi-square against the cause.
        excluded: whether the data exclude it.
        deviance: twice the fall of the logarithm of the evidence: the rise over what a model may err by, with the price
            of additional parameters.
    """

    causes: tuple[Cause, ...]
    worse: float
    excluded: bool
    deviance: float

    @property
    def kinds(self) -> tuple[str, ...]:
        """Return the kinds of its causes."""
        return tuple(cause.candidate.kind for cause in self.causes)


def rivals(records: Sequence[Evidence], found: Search) -> list[list[Rival]]:
    """Return for each cause the hypotheses that could replace it, best first."""
    now, result, level = found.fit, [], _chi2_level(found)
    for k, cause in enumerate(now.causes):
        others = now.causes[:k] + now.causes[k + 1 :]
        less = fit(records, found.base, others)
        tried, own = _hypotheses(records, found, less, cause), []
        least = excluding((less.chi2 - now.chi2) / level)
        scale = level * least / EXCLUDED
        for causes, one in tried:
            worse = one.chi2 - now.chi2
            deviance = worse / scale + _price(one, scale) - _price(now, scale)
            own.append(Rival(causes, worse, worse > level * least, deviance))
        result.append(sorted(own, key=lambda one: one.worse))
    return result


def _price(one: Fit, scale: float) -> float:
    """Return the chi-square that the parameters of a fit cost, its covariance times a scale."""
    return occam(scale * one.covariance, np.concatenate([cause.units for cause in one.causes])) if one.causes else 0.0


def _hypotheses(
    records: Sequence[Evidence], found: Search, less: Fit, cause: Cause
) -> list[tuple[tuple[Cause, ...], Fit]]:
    tried, seen = [], set()
    count = len(less.causes)
    for one in score(found.known, less.rest, directions(records, less)):
        key = (one.candidate.kind, *(one.candidate.shape.get(name) for name in ("gear", "tooth")))
        if key in seen or (is_same(one.candidate, cause)):
            continue
        if len(tried) >= FITTED_RIVALS or one.gain < 0.2 * (less.chi2 - found.fit.chi2):
            break
        seen.add(key)
        rounds = 8 if one.candidate.kind in FREE else 3
        made = fit(records, found.base, [*less.causes, begin(one.candidate, one.units)], rounds)
        tried.append((made.causes[count:], made))
    if cause.candidate.kind == "drag_differential":
        plain = {one.kind: one for one in found.known.candidates if one.kind in ("drag_coulomb", "drag_viscous")}
        both = [begin(one, np.array([1e-3])) for one in plain.values()]
        made = fit(records, found.base, [*less.causes, *both], 3)
        tried.append((made.causes[count:], made))
    return tried


def is_same(candidate: Candidate, cause: Cause) -> bool:
    """Whether a candidate is the cause itself, except for refined parameters."""
    own = cause.candidate
    bends = FREE.get(own.kind, {})
    shapes = [{name: value for name, value in one.shape.items() if name not in bends} for one in (candidate, own)]
    return candidate.kind == own.kind and shapes[0] == shapes[1]


# The rigid twin simulates each proposed run with the found causes, encoders with the noise of the records read it, and
# it is segmented into channels. The causes' predictions replace its data; the competing hypothesis is fitted to them
# and to the existing records, with all its numbers free. The value of the run is the rise of chi-square.


@dataclass(frozen=True)
class Run:
    """One possible run.

    Args:
        change: difference from the record of middle speed, in words.
        keys: of the scenario that change, with their values.
        duration: [s].
        sigma: predicted standard deviations between the cause and the other hypothesis, over all records; ``None`` for
            a run that cannot be predicted.
    """

    change: str
    keys: dict[str, Any]
    duration: float
    sigma: float | None = None


@dataclass(frozen=True)
class Experiment:
    """Runs that separate a cause from a competing hypothesis.

    Args:
        cause: kind of the cause.
        rival: kinds of the competing hypothesis.
        now: standard deviations between the two in the existing records.
        runs: best first.
    """

    cause: str
    rival: str
    now: float
    runs: tuple[Run, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary."""
        runs = [
            {"change": one.change, "set": one.keys, "duration_s": one.duration, "sigma": one.sigma} for one in self.runs
        ]
        return {"cause": self.cause, "rival": self.rival, "sigma_now": self.now, "runs": runs}


def experiments(
    found: Search, others: Sequence[Sequence[Rival]], progress: Callable[[float], None] = lambda part: None
) -> tuple[Experiment, ...]:
    """Return, for each pair of a cause and a hypothesis that is not excluded, the runs that separate them."""
    pairs = [(k, one) for k, each in enumerate(others) for one in each if not one.excluded][:PAIRS]
    if not pairs:
        return ()
    like = sorted(found.records, key=lambda one: abs(one.motion.mean))[len(found.records) // 2]
    effects = [cause.effect for cause in found.fit.causes if cause.effect is not None]
    planned = runs(like)
    seen: list[Evidence | None] = []
    for k, run in enumerate(planned):
        seen.append(simulated_run(like, run, effects))
        progress(0.7 * (k + 1) / len(planned))
    result = []
    for at, (k, rival) in enumerate(pairs):
        causes = (*found.fit.causes[:k], *rival.causes, *found.fit.causes[k + 1 :])
        made = [
            run if one is None else replace(run, sigma=separation(found, one, run.duration, effects, causes))
            for run, one in zip(planned, seen, strict=True)
        ]
        made.sort(key=lambda run: -(run.sigma or 0.0))
        kinds = " + ".join(rival.kinds)
        now = float(np.sqrt(max(rival.worse, 0.0) / _chi2_level(found)))
        result.append(Experiment(found.fit.causes[k].candidate.kind, kinds, now, tuple(made)))
        progress(0.7 + 0.3 * (at + 1) / len(pairs))
    return tuple(result)


def runs(like: Evidence) -> list[Run]:
    """Return the tried runs: another speed, fluctuation amplitude, frequency or drag, or only a longer one."""
    mean, drag, waves = like.motion.mean, like.scenario.drag.torque, like.scenario.motion.harmonics
    tried: list[tuple[str, dict[str, Any]]] = [
        (f"mean speed {word}", {"motion.mean": show(by * mean, "speed", 4)})
        for by, word in ((1.0 / 3.0, "× 1/3"), (3.0, "× 3"))
        if mean
    ]
    swings = ((2.0, 1.0, "amplitude × 2"), (0.7, 1.0, "amplitude × 0.7"), (1.0, 1.6, "frequency × 1.6"))
    for by, faster, word in swings:
        if waves:
            tried.append((word, {"motion.harmonics": [_wave(one, by, faster) for one in waves]}))
    if drag:
        tried.append(("drag × 2 by a known brake", {"drag.torque": show(2.0 * drag, "torque", 4)}))
    return [
        *(Run(word, keys, RUN_DURATION) for word, keys in tried),
        Run(f"same settings, duration × {LONGER}", {}, LONGER * RUN_DURATION),
    ]


def _wave(one: Any, by: float, faster: float) -> dict[str, str]:
    amplitude, frequency = show(by * one.amplitude, "speed", 4), show(faster * one.frequency, "frequency", 4)
    return {"amplitude": amplitude, "frequency": frequency, "phase": show(one.phase, "angle", 4)}


def simulated_run(like: Evidence, run: Run, effects: Sequence[Any]) -> Evidence | None:
    """Return a run as evidence from the twin with effects; ``None`` if it cannot be simulated or measured."""
    from gears3d.measured.segmentation import measure
    from gears3d.simulation import record

    lasts = max(SIMULATED, SIMULATED_PERIODS * like.scenario.period)
    changes = [("run.duration", f"{lasts:.6g} s"), ("run.settle", "0 s"), *_noise(like), *run.keys.items()]
    try:
        bench = like.scenario.with_(changes)
        truth: Scenario = bench.with_([("effect[+]", table(one)) for one in effects]) if effects else bench
        made = evidence(measure(record(truth, seed=1), bench, run.change), bench, run.change, stated=like.stated)
    except GearsError:
        return None
    return made if len(made.channels.flights.time) else None


def _noise(like: Evidence) -> list[tuple[str, str]]:
    """Return the noise of the record's encoders as keys of a scenario."""
    seen, rate = like.channels, like.scenario.sensors.sample_rate
    found = []
    if len(seen.flights.time):
        each = np.ptp(seen.flights.time, axis=1) / (seen.flights.time.shape[1] - 1)  # of one bin
        readings = np.maximum(np.median(each) * rate, 1.0)
        found.append(("sensors.loose.noise", f"{np.median(seen.flights.sigma) * np.sqrt(readings):.6g} rad"))
    sigma = seen.drive.sigma * np.sqrt(max(seen.drive.width * rate, 1.0))
    return [*found, ("sensors.drive.noise", f"{sigma:.6g} rad")]


def separation(found: Search, run: Evidence, duration: float, effects: Sequence[Any], rival: Sequence[Cause]) -> float:
    """Return the standard deviations between causes and another hypothesis with a further run, over all records.

    The run is evidence from the twin with the causes; what was simulated is repeated to the duration [s].
    """
    times = max(round(duration / float(np.ptp(run.channels.drive.time))), 1)
    records = [*found.records, *[run] * times]
    old = [residuals(one) for one in found.records]
    new = {name: added(run, effects, name) for name in CHANNELS}
    data = np.concatenate([part[name] for name in CHANNELS for part in (*old, *[new] * times)])
    worse = fit(records, data, rival).chi2 - found.fit.chi2
    return float(np.sqrt(max(worse, 0.0) / _chi2_level(found)))


def _chi2_level(found: Search) -> float:
    return max(found.fit.chi2 / max(len(found.fit.rest), 1), 1.0)


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
    stated = [Option(own, known * weight) for own, weight in zip(kinds, weights, strict=True)]
    return (*stated, Option(None, OUTSIDE))


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
