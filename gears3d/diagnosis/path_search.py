"""Stepwise selection of causes by trajectory residuals: score tests and refits in windows of all records.

Forward step: candidates are ranked by a score test with starts of windows as nuisance parameters; the best are fitted,
the best fit is taken. Backward step: a drop-one test of every cause. Records need no segmentation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from gears3d.diagnosis.causes import (
    ACCEPT_PATH,
    EXCLUDED,
    FREE,
    LARGEST,
    MODEL_ERROR,
    SMALLEST,
    Candidate,
    Cause,
    begin,
    excluding,
    price,
)
from gears3d.diagnosis.path_candidates import SCORED, Scatter, carrying, fewer, frequencies, playing, scores_of
from gears3d.diagnosis.path_fit import (
    ACCOUNTS,
    BODY,
    FAR,
    FARTHEST,
    LAWS,
    OIL,
    ROUNDS,
    SCATTER,
    SOFT,
    State,
    by_drive,
    covariance_of,
    effects_of,
    fall_of,
    fitted,
    followed,
    gain_of,
    polished,
    referenced,
    restore,
    rezeroed,
    scanned,
    settled,
    size_of,
    state_of,
    with_spread,
)
from gears3d.diagnosis.search import Rival, is_same, occam
from gears3d.diagnosis.shooting import NOISE, Windows
from gears3d.effects import SensorEffect
from gears3d.errors import InputError

Array = np.ndarray
STEADY = 4.0
"""Standard errors, by the scatter over windows, each of which counts for as much as excludes a cause at most, that this
fall must differ from none by: that of fourteen windows out of a hundred."""
EVEN = 0.4
"""The same of small falls, over the root of the fall: where all windows gain alike it is 0.5 at most. It was 0.45 of a
restitution in a rig of the blind benchmark (space3, 4); with it nothing is named in nine rigs without a cause."""
SCATTERED, SPREADS = (0.3, 0.1, 0.03, 0.01), 3
"""Sizes in units from the best of which the fit of a scatter begins, and rounds in which the size follows the kicks."""
SIZES = {
    OIL: (0.03, 0.06, 0.12, 0.25, 0.5),
    SOFT: (1.6, 2.5, 4.0, 6.3, 10.0, 25.0, 100.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0),
    "backlash_offset": (-0.6, -0.4, -0.25, -0.1, 0.1, 0.25, 0.5, 1.0),
}
"""Sizes in units at which laws of contact are tried, and what moves a flank away from where the path meets it: slopes
say nothing of those."""
DAMPINGS = (0.05, 0.15)
"""Parts of the critical damping at which compliant teeth are tried."""
NEAR, LIKE, EXCHANGES = 0.1, 0.5, 3
"""Part of the best score that a candidate needs to be fitted, and to replace a cause, and exchanged causes at most."""
FITTED = (7, 2)
"""Candidates that are fitted in a round, and between films of oil, where a run takes ten times as long."""
SAME = 0.01
"""Part of what a cause explains by which another must explain less, too, to be excluded: the rest is the model's."""
LEFT = 0.25
"""Part of the chi-square that is left beyond noise by which another cause must be worse, too."""
APART = 3.0
"""Standard errors, by the scatter over windows, that this must differ from none by."""
MOST_LEFT = 0.25
"""Part of the path's error that a body on a spring may leave to be the first cause."""
BEGINNINGS, NEARBY, ASTRAY, MANY = (0.12, 0.17, 0.25, 0.35, 0.5, 0.7, 1.0), 0.02, 0.1, 0.8
"""Parts of windows, from their beginning on, in which causes are sought one after the other; parts of the backlash up
to which the path is near in so many windows, so that slopes say what candidates promise, and from which on, with all
that is found, it is that of another rig."""


class Path(NamedTuple):
    """Causes by which the path comes true.

    Args:
        causes: with their numbers.
        covariance: of all numbers, in the order of the causes [SI], (p, p).
        gains: fall of chi-square, over its level, that each cause brings beside the others, (c,).
        before: usual mean square of a window's residuals without causes.
        after: with them.
        parted: part of the windows whose motion parts from the model's.
        missed: root mean square of what is left in usual windows [m].
        windows: how many.
        others: what was tried in the place of each cause, by chi-square over the level, best first.
        seen: smallest size of causes of one number that the path shows beside these, in units, by kind.
        scatter: of the restitution, in addition to the causes.
        unsure: fall of chi-square, over its level, that the uncertainty of the drive's motion explains.
    """

    causes: tuple[Cause, ...]
    covariance: Array
    gains: Array
    before: float
    after: float
    parted: float
    missed: float
    windows: int
    others: tuple[tuple[Rival, ...], ...]
    seen: dict[str, float]
    scatter: Scatter | None = None
    unsure: float = 0.0


class Against(NamedTuple):
    """Causes that were found otherwise, fitted to the path.

    Args:
        causes: with the numbers that the path gives them.
        covariance: of these [SI], (p, p).
        level: usual mean square of a window's residuals with them.
    """

    causes: tuple[Cause, ...]
    covariance: Array
    level: float


def path_search(
    windows: Windows, known: Sequence[Candidate], told: Callable[[float], None] = lambda part: None
) -> Path | None:
    """Return the causes that make the path come true; ``None`` where there are too few windows.

    Args:
        windows: of the records; they are left as the causes have them.
        known: candidates.
        told: called with the part that is done.
    """
    if len(windows) < SCORED // 4:
        return None
    base = polished(windows, _opened(windows), thorough=True)
    found = _searched(windows, known, base, lambda part: told(0.5 * part))
    base, found = _recoloured(windows, known, base, found)
    found, less, instead = _exchanged(windows, known, base, found, lambda part: told(0.5 + 0.5 * part))
    gains = [gain_of(windows, one, found)[0] for one in less]
    others = []
    for gain, (own, excluded) in zip(gains, instead, strict=True):
        least = _least(windows, gain, found.rest)
        cost = _price(windows, found, least) if own else 0.0
        fits = [_rival(windows, one, found, least, _price(windows, one, least) - cost) for one in own]
        others.append(tuple(sorted([*fits, *excluded], key=lambda one: one.worse)))
    restore(windows, found)
    found = referenced(windows, found)
    restore(windows, found)
    level, unsure = windows.level(found.rest), _unsure(windows, [found, *(one for own, _ in instead for one in own)])
    usual, covariance = windows.level(windows.missed(effects_of(found.causes))), covariance_of(windows, found)
    made = Path(
        found.causes, covariance, np.array(gains), float(np.median(windows.level(base.rest))),
        float(np.median(level)), float(np.mean(level > FAR * max(float(np.median(level)), 1.0))),
        float(np.sqrt(np.median(usual))), len(windows), tuple(others),
        _seen(windows, known, found, covariance), unsure=unsure,
    )  # fmt: skip
    return _apart(made)


def _unsure(windows: Windows, states: Sequence[State]) -> float:
    """Return the fall of chi-square, over its level, that the uncertainty of the drive explains in one of states."""
    return max(fall_of(windows, one.rest, one.beyond)[0] if one.beyond is not None else 0.0 for one in states)


def _apart(path: Path) -> Path:
    """Return a path whose scatter of the restitution is no longer among its causes."""
    kinds = [one.candidate.kind for one in path.causes]
    if SCATTER not in kinds:
        return path
    k = kinds.index(SCATTER)
    at = sum(len(one.numbers) for one in path.causes[:k])
    value, sigma = float(path.causes[k].numbers[0]), float(np.sqrt(path.covariance[at, at]))
    covariance = np.delete(np.delete(path.covariance, at, axis=0), at, axis=1)
    return path._replace(
        causes=path.causes[:k] + path.causes[k + 1 :], others=path.others[:k] + path.others[k + 1 :],
        covariance=covariance, gains=np.delete(path.gains, k),
        scatter=Scatter(value, sigma, float(path.gains[k]), 1.0, 0.0),
    )  # fmt: skip


def halves(windows: Windows, causes: Sequence[Cause]) -> list[tuple[float, float, float, float, float]]:
    """Return what causes are worth in every second window, fitted to the others, and the other way about.

    Args:
        windows: of the records, with starts that fit.
        causes: with their numbers.

    Returns:
        Mean square of residuals without and with the causes, in variances of the noise; root mean squares of the same
        [m]; gain in log-likelihood.
    """
    made, before = [], state_of(windows, causes, windows.read)
    for first in (0, 1):
        parts = [windows.only(np.arange(k, len(windows), 2))[0] for k in (first, 1 - first)]
        for one in parts:
            one.zeros, one.turned = before.zeros.copy(), before.turned.copy()
        now = fitted(parts[0], state_of(parts[0], causes, parts[0].read))
        held, levels = parts[1], []
        for told in ((), now.causes):
            held.restart(effects_of(told))
            rest = settled(held, effects_of(told), held.residuals(effects_of(told)))
            level, missed = held.level(rest), held.level(held.missed(effects_of(told)))
            levels.append((float(np.median(level)), float(np.sqrt(np.median(missed))), state_of(held, told, rest)))
        (base, off, blind), (extended, left, more) = levels
        gain = 0.5 * gain_of(held, blind, more)[0]
        made.append((base, extended, off, left, gain))
    restore(windows, before)
    return made


def against(windows: Windows, causes: Sequence[Cause], turned: Sequence[tuple[float, float]]) -> Against | None:
    """Return causes that were found otherwise, fitted to the path; ``None`` where the rig cannot have them.

    Args:
        windows: of the records, with starts that fit.
        causes: in the place of all others.
        turned: what is added to the angles of both gears in each record, from which they count [rad].
    """
    before = state_of(windows, (), windows.read)
    windows.turned = np.array(turned, float).reshape(-1, 2)
    try:
        rest = windows.residuals(effects_of(causes))
        found = polished(windows, fitted(windows, state_of(windows, causes, rest)))
        return Against(found.causes, covariance_of(windows, found), float(np.median(windows.level(found.rest))))
    except InputError:
        return None
    finally:
        restore(windows, before)


def promised(windows: Windows, scatter: Cause) -> float:
    """Return by how much a scatter of the restitution lowers chi-square over its level, less its price."""
    before = state_of(windows, (), windows.read)
    gain = _promised(windows, state_of(windows, (scatter,), windows.residuals(effects_of([scatter]))))
    restore(windows, before)
    return gain


def _seen(windows: Windows, known: Sequence[Candidate], found: State, covariance: Array) -> dict[str, float]:
    """Return the smallest size of causes of one number that the path shows beside others, in units, by kind.

    Of a cause that is there it is the smallest change; what only a cause larger than any would show is left out.
    """
    plain = [one for one in known if not one.phased and not one.shape and one.kind not in (*FREE, *LAWS, SCATTER)]
    there, at = {}, 0
    for one in found.causes:
        there[one.candidate.kind] = float(np.sqrt(ACCEPT_PATH * covariance[at, at])) / one.candidate.unit
        at += len(one.numbers)
    scores, level = scores_of(windows, [one for one in plain if one.kind not in there], found, -np.inf)
    sizes = {one.candidate.kind: float(np.sqrt(ACCEPT_PATH * level / one.worth)) for one in scores if one.worth > 0.0}
    kinds = {one.kind for one in plain}
    return {kind: size for kind, size in {**sizes, **there}.items() if size < LARGEST and kind in kinds}


def _opened(windows: Windows) -> State:
    windows.restart((), anew=True)
    return rezeroed(windows, fitted(windows, state_of(windows, (), windows.residuals(()))))


def _searched(windows: Windows, known: Sequence[Candidate], base: State, told: Callable[[float], None]) -> State:
    """Return a state with causes added one after the other, as long as they gain.

    Where the path is so far off that slopes say little, causes are first sought in the beginnings of windows, as long
    as the path is near with those that are known. Where flights oscillate, a body on a spring is sought first, and
    where other causes do not explain beginnings.
    """
    turns = frequencies(windows) if any(one.kind == BODY for one in known) else []
    now, done, tried = base, 0.0, bool(turns)
    for own in (turns, ()) if turns else ():
        now = _swinging(windows, known, own, base) if now is base else now
    dense = [one for one in known if one.kind not in (BODY, SCATTER)]  # which explain any rebound of a first impact
    while True:
        done, part, first = _near(windows, now, done)
        if part is windows:
            break
        if _far(part, first.rest) > ACCOUNTS:
            found = _added(part, dense, polished(part, _opened(part)), polished(part, first), told)
            if not tried and _far(part, found.rest) > ACCOUNTS:
                tried, swings = True, _swinging(windows, known, (), base)
                if swings is not base:
                    now = swings
                    continue
            if _off(part, found) > ASTRAY:
                now = base
                break
            now = polished(windows, _carried(windows, found)) if found.causes else now
    return _added(windows, known, base, _pruned(windows, base, now), told)


def _recoloured(windows: Windows, known: Sequence[Candidate], base: State, found: State) -> tuple[State, State]:
    """Return the states without and with causes where restitution that scatters does not stand for 1/f noise.

    Kicks of impacts explain it as well. It is estimated from the residuals without them, then from those of all causes.
    """
    for kicked in (False, True):
        if not any(one.candidate.kind == SCATTER for one in found.causes):
            break
        restore(windows, found)
        causes = [one for one in found.causes if kicked or one.candidate.kind != SCATTER]
        rest = windows.residuals(effects_of(causes))
        less = polished(windows, fitted(windows, state_of(windows, causes, rest)))
        if not windows.coloured(effects_of(less.causes)):
            break
        base = polished(windows, _opened(windows), thorough=True)
        restore(windows, found)
        rest = windows.residuals(effects_of(found.causes))
        found = polished(windows, fitted(windows, state_of(windows, found.causes, rest)), thorough=True)
        found = _added(windows, known, base, _pruned(windows, base, found), lambda part: None)
    return base, found


def _swinging(windows: Windows, known: Sequence[Candidate], turns: Sequence[float], base: State) -> State:
    """Return a state with a body on a spring, where it explains most of the path; arguments as below."""
    few, _, first = _sampled(windows, base)
    tries = [_whole(windows, base, few, one) for one in _carrying(few, known, turns, first, first, ACCEPT_PATH)]
    tries = [one for one in tries if _taken(windows, base, base, one)]
    restore(windows, base)
    best = _simplest(windows, base, tries)
    if best is None or not _far(windows, best.rest) < max(MOST_LEFT * _far(windows, base.rest), ACCOUNTS):
        return base
    return best


def _near(windows: Windows, now: State, done: float) -> tuple[float, Windows, State]:
    """Return the largest part of windows, beyond one that is done, in which the path is near, these, and the state."""
    least = next(part for part in BEGINNINGS if part > done)
    for reach in reversed(BEGINNINGS):
        part = windows.until(reach) if reach < 1.0 else windows
        first = _carried(part, now) if reach < 1.0 else now
        if reach <= least or _off(part, first) < NEARBY or _far(part, first.rest) <= ACCOUNTS:
            return reach, part, first
    raise AssertionError


def _off(windows: Windows, now: State) -> float:
    """Return by how much, beyond noise, many windows are off at most, in backlashes."""
    restore(windows, now)
    missed, noise = (
        _far(windows, windows.missed(effects_of(now.causes))),
        float(np.median(windows.level(windows.sigma))),
    )
    return float(np.sqrt(max(missed - noise, 0.0))) / windows.backlash


def _far(windows: Windows, rest: Array) -> float:
    """Return the mean square of residuals that many windows do not exceed."""
    return float(np.quantile(windows.level(rest), MANY))


def _carried(part: Windows, now: State) -> State:
    """Return the causes of a state in windows of another length."""
    part.zeros, part.turned, part.weight = now.zeros.copy(), now.turned.copy(), np.ones(len(part))
    effects = effects_of(now.causes)
    part.starts = now.starts
    part.restart(effects)
    rest = settled(part, effects, part.residuals(effects))
    return rezeroed(part, state_of(part, now.causes, rest))


def _added(
    windows: Windows, known: Sequence[Candidate], base: State, now: State, told: Callable[[float], None]
) -> State:
    """Return a state with more causes, one after the other, as long as they gain.

    A body on a spring is tried where nothing else explains the path.
    """
    for number in range(len(now.causes), ROUNDS):
        told(number / ROUNDS)
        few, mine, first = _sampled(windows, now)
        tries = _tries(windows, few, known, first, now)
        enough = ACCEPT_PATH * len(few) / len(windows)
        if tries:
            least = max(enough, SAME * max(gain_of(few, first, one)[0] for one in tries))
            root = _part(few, mine, base)
            for start in (first, root) if now.causes else (first,):  # a law may do what several causes stood in for
                for one in _at_sizes(few, known, first, start, least):
                    restore(few, one)
                    tries.append(polished(few, scanned(few, polished(few, one)), thorough=True))
        for one in _scattered(few, known, first, enough):
            restore(few, one)
            tries.append(polished(few, one, thorough=True))
        if tries:
            tries = [_whole(windows, now, few, one) for one in _not_excluded(few, first, tries)[1]]
        best = _simplest(windows, now, [one for one in tries if _taken(windows, base, now, one)])
        if best is None and float(np.median(windows.level(now.rest))) > NOISE:
            tries = _carrying(few, known, (), first, _part(few, mine, base), enough)
            tries = [_whole(windows, now, few, one) for one in tries]
            best = _simplest(windows, now, [one for one in tries if _taken(windows, base, now, one)])
        if best is None:
            break
        best = _pruned(windows, base, best)
        if gain_of(windows, now, best)[0] <= 0.0:
            break
        now = best
    restore(windows, now)
    return now


def _exchanged(
    windows: Windows, known: Sequence[Candidate], base: State, found: State, told: Callable[[float], None]
) -> tuple[State, list[State], list[tuple[list[State], list[Rival]]]]:
    """Return a state with other causes in the place of some, where these explain more or are simpler.

    Causes that came first were taken without those that came later.

    Returns:
        State, states without each of its causes, and with others in the place of each, of which those that a sample
        of windows excludes are not fitted to all.
    """
    for left in reversed(range(EXCHANGES + 1)):
        found = _fewer(windows, known, base, found)
        less, instead = [], []
        for k, cause in enumerate(found.causes):
            told((EXCHANGES - left + k / len(found.causes)) / (EXCHANGES + 1))
            restore(windows, found)
            less.append(polished(windows, fitted(windows, _without(found, k)), thorough=True))
            own, excluded = [], []
            if cause.candidate.kind not in (*LAWS, SCATTER):
                few, mine, first = _sampled(windows, found)
                plain = _part(few, mine, less[-1])
                gain = gain_of(few, plain, first)[0]
                least, tries = _least(few, gain, first.rest), _tries(windows, few, known, first, found, k)
                for one in _scattered(few, known, plain, LIKE * gain):
                    restore(few, one)
                    tries.append(polished(few, one, thorough=True))
                for one in tries:
                    if (rival := _rival(few, one, first, least)).excluded:
                        more = len(windows) / len(few)
                        whole = rival._replace(worse=rival.worse * more, deviance=rival.deviance * more)
                        excluded += [whole] if len(one.causes) == len(found.causes) else []
                    else:
                        own.append(_whole(windows, found, few, one))
            same = found._replace(causes=(*less[-1].causes, cause))
            able = [one for one in own if _taken(windows, base, less[-1], one)]
            least = _least(windows, gain_of(windows, less[-1], found)[0], found.rest)
            if left and len(found.causes) > 1:  # what is as good may make others needless
                able = [one if _excludes(windows, one, found, least) else _pruned(windows, base, one) for one in able]
            best = _simplest(windows, less[-1], [same, *able]) or same
            if left and (_simple(best) < _simple(same) or _excludes(windows, same, best, least)):
                found = _added(windows, known, base, _pruned(windows, base, best), lambda part: None)
                break
            own = [one for one in own if len(one.causes) == len(found.causes)]
            instead.append((own, excluded))
        else:
            restore(windows, found)
            return found, less, instead
    raise AssertionError


def _fewer(windows: Windows, known: Sequence[Candidate], base: State, found: State) -> State:
    """Return a state with fewer causes in the place of several that look like others, where these explain as much."""
    tries = []
    for causes in fewer(windows, known, found) if len(found.causes) > 1 else ():
        restore(windows, found)
        with suppress(InputError):
            rest = windows.residuals(effects_of(causes))
            one = polished(windows, fitted(windows, state_of(windows, causes, rest)))
            if not _excludes(windows, one, found, _least(windows, gain_of(windows, base, found)[0], found.rest)):
                tries.append(one)
    restore(windows, found)
    return _simplest(windows, base, tries) or found


def _taken(windows: Windows, base: State, less: State, more: State) -> bool:
    """Return whether the last cause is one: of a size that matters, and of gain."""
    return SMALLEST < size_of(windows, more.causes[-1]) < LARGEST and _pays(windows, base, less, more)


def _pays(windows: Windows, base: State, less: State, more: State) -> bool:
    """Return whether a cause gains more than chance, and than the errors of a model that explains so much.

    Where residuals are noise with it, errors of the model do not count.
    """
    gain, sure = gain_of(windows, less, more)
    if gain <= ACCEPT_PATH or sure <= min(STEADY, EVEN * float(np.sqrt(gain))):
        return False
    return float(np.median(windows.level(more.rest))) < NOISE or gain > MODEL_ERROR * gain_of(windows, base, more)[0]


def _simplest(windows: Windows, now: State, tries: Sequence[State]) -> State | None:
    """Return the simplest of those that the best does not exclude: of fewest numbers, gears before sensors."""
    if not tries:
        return None
    best, able = _not_excluded(windows, now, tries)
    return min(able, key=lambda one: (*_simple(one), one is not best))


def _simple(one: State) -> tuple[int, float, bool, bool]:
    """Return by what a state is simpler than others: numbers, price of the last cause, places that it may stand for."""
    last = one.causes[-1]
    one_sided = last.candidate.kind == "restitution_asymmetry"  # that of a flank, where only one is met
    numbers = sum(len(cause.numbers) for cause in one.causes)
    return numbers, price(last.candidate), one_sided, isinstance(last.effect, SensorEffect)


def _least(windows: Windows, gain: float, rest: Array) -> float:
    """Return the chi-square over the level by which a cause must be worse to be excluded.

    Four standard deviations; part of what the better one explains, for a model errs, less where what it leaves is
    noise; and part of what it leaves beyond noise, which something else does that may be taken for either.
    """
    level = float(np.median(windows.level(rest)))
    if level < NOISE:
        return excluding(gain)
    return max(EXCLUDED, SAME * gain, LEFT * (level - 1.0) / level * len(windows.read) / windows.runs(rest))


def _is_worse(windows: Windows, one: State, other: State, least: float) -> bool:
    """Return whether a state leaves more than another by so much.

    Where the other leaves noise, and this one does not account for the path, four standard deviations are enough.
    """
    off, left = (float(np.median(windows.level(each.rest))) for each in (one, other))
    return gain_of(windows, one, other)[0] > (EXCLUDED if left < NOISE < ACCOUNTS < off else least)


def _rival(windows: Windows, one: State, best: State, least: float, cost: float = 0.0) -> Rival:
    """Return the last cause of a state as a hypothesis in the place of one of the best; chi-square as above.

    Its deviance is limited by the error of a model, which excludes it at so much, and by its scatter over windows.

    cost: chi-square that its parameters cost more than those of the best.
    """
    worse, sure = gain_of(windows, one, best)
    deviance = min(EXCLUDED * worse / least, sure * abs(sure)) + cost
    return Rival((one.causes[-1],), worse, _excludes(windows, one, best, least), deviance)


def _price(windows: Windows, one: State, least: float) -> float:
    """Return the chi-square that the parameters of a state cost."""
    restore(windows, one)
    units = np.concatenate([np.zeros(0), *(cause.units for cause in one.causes)])
    return occam(covariance_of(windows, one) * least / EXCLUDED, units)


def _excludes(windows: Windows, one: State, other: State, least: float) -> bool:
    """Return whether a state leaves more than another, by so much, and in windows all over the records."""
    return _is_worse(windows, one, other, least) and gain_of(windows, one, other)[1] > APART


def _without(state: State, k: int) -> State:
    return state._replace(causes=state.causes[:k] + state.causes[k + 1 :])


def _lean(windows: Windows, now: State) -> State:
    """Return a state without causes that have become nothing by the last one."""
    for k in reversed(range(len(now.causes) - 1)):
        if size_of(windows, now.causes[k]) < SMALLEST:
            restore(windows, now)
            now = polished(windows, fitted(windows, _without(now, k)))
    return now


def _pruned(windows: Windows, base: State, now: State) -> State:
    """Return a state without causes that the others make needless."""
    k = 0
    while k < len(now.causes):
        if _needed(windows, base, now, k):
            k += 1
            continue
        restore(windows, now)
        less = polished(windows, fitted(windows, _without(now, k)), thorough=True)
        if _taken(windows, base, less, now._replace(causes=(*less.causes, now.causes[k]))):
            k += 1
        else:
            now, k = less, 0
    restore(windows, now)
    return now


def _needed(windows: Windows, base: State, now: State, k: int) -> bool:
    """Return whether a sample of windows shows already that a cause gains enough beside the others."""
    few, mine, first = _sampled(windows, now)
    if few is windows:
        return False
    less = polished(few, fitted(few, _without(first, k)), thorough=True)
    return _taken(few, _part(few, mine, base), less, first._replace(causes=(*less.causes, now.causes[k])))


def _sampled(windows: Windows, now: State) -> tuple[Windows, Array, State]:
    """Return a sample of windows in which fits are tried first, which residuals are theirs, and the state in them."""
    restore(windows, now)
    few, mine = windows.some(SCORED)
    return few, mine, _part(few, mine, now)


def _part(few: Windows, mine: Array, now: State) -> State:
    """Return a state of all windows in a sample of them, (n + KICKS w,) of whose residuals are given."""
    if len(few) == len(now.price):
        return now
    own, rows = few.picked, mine[: len(now.rest)]
    return now._replace(
        rest=now.rest[rows], starts=now.starts.only(own), weight=now.weight[own], price=now.price[own],
        beyond=None if now.beyond is None else now.beyond[rows],
    )  # fmt: skip


def _whole(windows: Windows, now: State, few: Windows, one: State) -> State:
    """Return a state that was fitted in a sample of windows in all of them.

    Args:
        windows: all.
        now: their present state, whose starts are taken where the sample has none.
        few: sample.
        one: state in it.
    """
    if few is windows:
        return one
    restore(windows, now)
    windows.zeros, windows.turned = one.zeros.copy(), one.turned.copy()
    windows.starts = now.starts.put(few.picked, one.starts)
    effects = effects_of(one.causes)
    windows.restart(effects)
    return polished(windows, fitted(windows, state_of(windows, one.causes, windows.residuals(effects))), thorough=True)


def _not_excluded(windows: Windows, now: State, tries: Sequence[State]) -> tuple[State, list[State]]:
    """Return the best of states, and those that it does not exclude."""
    best = tries[0]
    for one in tries[1:]:
        if gain_of(windows, best, one)[0] > 0.0:
            best = one
    least = _least(windows, gain_of(windows, now, best)[0], best.rest)
    return best, [one for one in tries if one is best or not _is_worse(windows, one, best, least)]


def _tries(
    windows: Windows, few: Windows, known: Sequence[Candidate], first: State, now: State, place: int | None = None
) -> list[State]:
    """Return the best candidates of each kind, fitted together with the causes in a sample of windows.

    Args:
        windows: all, in which candidates are scored.
        few: the sample.
        known: candidates.
        first: state of the sample.
        now: state of all.
        place: of a cause, in the place of which candidates that look like it are fitted.
    """
    made = []
    for one in _fits(windows, few, known, first, now, place):
        restore(few, one)
        started = rezeroed(few, one) if place is None else one
        restore(few, started)
        made.append(_lean(few, polished(few, scanned(few, polished(few, started)), thorough=True)))
    return made


def _fits(
    windows: Windows, few: Windows, known: Sequence[Candidate], first: State, now: State, place: int | None
) -> list[State]:
    """Return the best candidates of each kind, fitted together with the causes, best first; arguments as above."""
    restore(windows, now)
    scores, level = scores_of(windows, known, now, place=place)
    able = [one for one in scores if np.hypot.reduce(one.units) > 0.5 * SMALLEST and one.gain > ACCEPT_PATH * level]
    causes = first.causes if place is None else _without(first, place).causes
    most = FITTED[1 if any(one.candidate.kind in LAWS for one in causes) else 0]
    least = NEAR if place is None else LIKE
    made, kinds = [], set()
    for gain, one, units, by, _ in able:
        if gain < least * able[0].gain or len(made) >= most:
            break
        if one.kind in kinds or any(is_same(one, cause) for cause in now.causes):
            continue
        with suppress(InputError):
            cause = begin(one, np.clip(units, -FARTHEST[0], FARTHEST[0]))
            restore(few, first)
            few.turned = few.turned + by
            fit = fitted(few, first._replace(causes=(*causes, cause)))
            if fit.causes[-1].possible:
                kinds.add(one.kind)
                made.append(fit)
    few.weight = first.weight
    return sorted(made, key=lambda one: float(np.sum((one.rest * few.weights(one.rest)) ** 2)))


def _at_sizes(windows: Windows, known: Sequence[Candidate], now: State, start: State, least: float) -> list[State]:
    """Return causes to start from with one as well that is tried at several sizes, where some windows gain so much."""
    made, there = [], {one.candidate.kind for one in start.causes}
    there |= set(LAWS) if there & set(LAWS) else set()
    for law in (one for one in known if one.kind in SIZES and one.kind not in there):
        restore(windows, start)
        few, mine = windows.some(SCORED // 2)
        zeros, best, most = windows.zeros, None, least * len(few) / len(windows)
        for cause in _begun(windows, law):
            effects = [*effects_of(start.causes), cause.effect]
            few.zeros, before = zeros.copy(), now.rest[mine[: len(now.rest)]]
            for _ in range(2):  # on oil or compliant teeth the gear lies off the zero that rigid dry flanks have
                few.restart(effects)
                missed = few.missed(effects)
                for k in range(len(zeros)):
                    own = few.record[few.window] == k
                    few.zeros[k] += float(np.median(missed[own])) if np.any(own) else 0.0
            gain = fall_of(few, before, few.residuals(effects))[0]
            if gain > most:
                most, best = gain, (cause, few.zeros)
        if best is None:
            continue
        with suppress(InputError):
            causes, windows.zeros = (*start.causes, best[0]), best[1].copy()
            windows.restart(effects_of(causes))
            made.append(fitted(windows, state_of(windows, causes, windows.residuals(effects_of(causes)))))
    return made


def _begun(windows: Windows, law: Candidate) -> list[Cause]:
    """Return a cause at the sizes at which it is tried."""
    if law.kind != SOFT:
        return [begin(law, np.array([size])) for size in SIZES[law.kind]]
    mass = windows.values.inertia / windows.values.base_radius_loose**2
    logarithm = -float(np.log(np.clip(windows.values.restitution, 0.05, 0.95)))
    own = logarithm / float(np.hypot(np.pi, logarithm))  # with which a linear spring has the rig's restitution
    return [
        begin(law._replace(shape={"damping": 2.0 * damping * float(np.sqrt(size * law.unit * mass))}), np.array([size]))
        for size in SIZES[SOFT]
        for damping in (*DAMPINGS, own)
    ]


def _carrying(
    windows: Windows, known: Sequence[Candidate], turns: Sequence[float], now: State, root: State, least: float
) -> list[State]:
    """Return causes with a body on a spring as well, and that alone, where it gains so much.

    Args:
        windows: sample.
        known: candidates.
        turns: natural frequencies that flights suggest [rad/s].
        now: state of the sample.
        root: that without causes.
        least: fall of chi-square that it must bring.
    """
    there = any(one.candidate.kind in (*LAWS, SCATTER) for one in now.causes)
    if there or not any(one.kind == BODY for one in known):
        return []
    made = []
    for start in (root, now) if now.causes else (now,):
        one = polished(windows, carrying(windows, turns, now, start))
        if len(one.causes) > len(start.causes) and gain_of(windows, now, one)[0] > least:
            made.append(playing(windows, one, least))
        if float(np.median(windows.level(one.rest))) < NOISE:
            break
    restore(windows, now)
    return made


def _scattered(windows: Windows, known: Sequence[Candidate], now: State, least: float) -> list[State]:
    """Return causes with restitution that scatters as well, where flanks are dry and that promises to gain so much."""
    own = next((one for one in known if one.kind == SCATTER), None)
    if own is None or any(one.candidate.kind in (*LAWS, SCATTER) for one in now.causes):
        return []
    restore(windows, now)
    best, most = None, least
    for size in SCATTERED:
        causes = (*now.causes, begin(own, np.array([size])))
        tried = state_of(windows, causes, windows.residuals(effects_of(causes)))
        if (gain := _promised(windows, tried)) > most:
            best, most = tried, gain
    if best is None:
        return []
    for _ in range(SPREADS):
        rest = followed(windows, effects_of(best.causes), best.rest)
        best = with_spread(windows, fitted(windows, state_of(windows, best.causes, rest)))
    return [best]


def _promised(windows: Windows, now: State) -> float:
    """Return by how much kicks lower chi-square over its level, to first order, less their price."""
    along, weight = windows.along(effects_of(now.causes)), windows.weights(now.rest)
    columns, driven = [one * weight for one in along.starts()], along.driven()
    left, prices = [], []
    for own in (columns[:2], columns):
        away = windows.without_starts(own)
        explained, price = by_drive(windows, now.rest, driven, away)
        left.append(away(now.rest * weight - explained))
        prices.append(float(price.sum()))
    level = max(float(np.median(windows.level(left[1]))), 1e-12)
    fall = float(left[0] @ left[0] - left[1] @ left[1]) / (level * windows.runs(left[1]))
    return fall - (prices[1] - prices[0]) - float(now.price.sum())
