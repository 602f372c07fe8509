"""Path search: stepwise selection of causes by trajectory residuals of multiple shooting.

Forward step: a score test ranks candidates, with starts of windows as nuisance parameters; the best are fitted, and the
best fit is taken. Backward step: a drop-one test of each cause. Hypotheses are excluded by likelihood ratio.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from gears3d.diagnosis.causes import (
    ACCEPT_PATH,
    EXCLUDED,
    LARGEST,
    MODEL_ERROR,
    MOST_DRAG,
    SMALLEST,
    Candidate,
    Cause,
    begin,
    goes_by,
    price,
)
from gears3d.diagnosis.evidence import fluctuation_orders, frequencies
from gears3d.diagnosis.path_candidates import SCORED, Sized, carrying, fewer, playing, scores_of, sized
from gears3d.diagnosis.path_fit import (
    ACCOUNTS,
    BENDS,
    BODY,
    FAR,
    FARTHEST,
    LAWS,
    OIL,
    ROUNDS,
    SCATTER,
    SOFT,
    State,
    added,
    agreement_of_diverging,
    carried,
    covariance_of,
    effects_of,
    fall_of,
    fitted,
    gain_of,
    polished,
    referenced,
    refitted,
    restore,
    rezeroed,
    scanned,
    scattering,
    size_of,
    state_of,
    uncorrected,
    unrounded,
    with_spread,
)
from gears3d.diagnosis.prediction import GEARS, restitution
from gears3d.diagnosis.preprocessing import order_of
from gears3d.diagnosis.run_information import (
    SAME,
    Path,
    detectable,
    deviations,
    excludes,
    is_worse,
    least_excluding,
    price_of,
    rival_of,
    scatter_separated,
    widths_of,
)
from gears3d.diagnosis.search import Rival, is_same
from gears3d.diagnosis.shooting import NOISE, Windows
from gears3d.diagnosis.shooting_kernels import Exhausted, slowed, torques_of
from gears3d.effects import Code, SensorEffect
from gears3d.errors import InputError

Array = np.ndarray
# Significance of a fall of chi-square over windows, in standard errors: gains in 14 windows of 100 reach it; of small
# falls, over the root of the fall: 0.5 where all windows gain equally. It was 0.45 of a restitution in a rig of the
# blind benchmark (space3, 4); no cause is named in nine rigs without one.
STEADY, EVEN = 4.0, 0.4
# Windows that must diverge to show a cause that the others do not, and candidates that are fitted to these; relative
# difference of an order and a multiple of the fluctuation's below which both coincide.
FEWEST, FITTED_DIVERGING, LOCKED = 5, 2, 0.003
# Least ratio of mean squares without and with a scatter, whose kicks also explain errors that are correlated over a
# flight: coarse encoders gave up to 1.06, scatters 1.14 and more (space, 458 to 567, 1056); most runs of white noise.
BEYOND = 1.1
# Part of the best score that a candidate needs to be fitted, and to replace a cause; exchanged causes at most; part of
# its size with which a fit begins where the motion of the drive stands for it.
NEAR, LIKE, EXCHANGES, HELD = 0.1, 0.5, 3, 0.1
# Candidates that are fitted in a forward step, and with a law of contact, where a run takes several times as long.
FITTED = (7, 3)
# Largest part of the error that a second body may leave to be the first cause; part of what all causes explain that one
# must gain next to noise, the square of 0.1 %: sizes of others are not more accurate.
MOST_LEFT, MISSIZED = 0.25, 1e-6
# Increasing parts of windows, from their beginning, in which causes are selected; residuals in backlashes up to which
# sensitivities are valid, and from which on, with all causes, the record is of another rig; their quantile.
BEGINNINGS, NEARBY, ASTRAY, MANY = (0.12, 0.17, 0.25, 0.35, 0.5, 0.7, 1.0), 0.02, 0.1, 0.8


class _Stage(NamedTuple):
    """States without and with causes, of drop-one tests, and hypotheses instead of each cause, fitted and excluded."""

    base: State
    found: State
    less: Sequence[State] = ()
    instead: Sequence[tuple[list[State], list[Rival]]] = ()


def path_search(
    windows: Windows, known: Sequence[Candidate], progress: Callable[[float], None] = lambda part: None,
    first: Sequence[Cause] = (),
) -> Path | None:  # fmt: skip
    """Return the causes selected by trajectory residuals; ``None`` with too few windows.

    Args:
        windows: of the records; they get the starts and datums of the result.
        known: candidates.
        progress: called with the part that is done.
        first: causes with which the search begins, fitted with the starts and datums that windows have.

    Where trajectories need more work than windows may take, the result is that of the last complete stage.
    """
    if len(windows) < SCORED // 4:
        return None
    left, windows.work[:], complete = windows.work[0], np.inf, True  # stages alone are limited
    now = state_of(windows, first, windows.residuals(effects_of(first)))
    base = unrounded(windows, polished(windows, _opened(windows), thorough=True))
    reached = _Stage(base, refitted(windows, now) if first else base)
    windows.work[:] = left
    try:
        for each in _stages(windows, known, *reached[:2], progress):
            reached = each
        base, found, less, instead = reached
        left, windows.work[:] = windows.work[0], np.inf
    except Exhausted:
        left, windows.work[:], complete = np.inf, np.inf, False
        base, found = _without_causes(windows, base), refitted(windows, reached.found)
        less = [_less(windows, found, k) for k in range(len(found.causes))]
        instead = [([], []) for _ in less]
    gains = [gain_of(windows, one, found)[0] for one in less]
    others = []
    for gain, (own, excluded) in zip(gains, instead, strict=True):
        least = least_excluding(windows, gain, found.rest)
        costs = [price_of(windows, one, least / EXCLUDED) for one in ((found, *own) if own else ())]
        fits = [rival_of(windows, one, found, least, by - costs[0]) for one, by in zip(own, costs[1:], strict=True)]
        others.append(tuple(sorted([*fits, *excluded], key=lambda one: one.worse)))
    restore(windows, found)
    found = referenced(windows, with_spread(windows, found))
    able = [found, *(one for own, _ in instead for one in own)]
    level, unsure = windows.level(found.rest), max(fall_of(windows, uncorrected(windows, x), x.rest)[0] for x in able)
    restore(windows, found)
    usual, covariance = windows.level(windows.missed(effects_of(found.causes))), covariance_of(windows, found)
    made = Path(
        found.causes, covariance, widths_of(windows, found, covariance), np.array(gains),
        windows.usual(base.rest), windows.usual(found.rest), float(np.mean(level > FAR * max(np.median(level), 1.0))),
        float(np.sqrt(np.median(usual))), len(windows), tuple(others), detectable(windows, known, found, covariance),
        unsure=unsure, deviations=deviations(windows, found.causes), complete=complete,
    )  # fmt: skip
    rows = [row for effect in effects_of(found.causes) for row in effect.rows(windows.values)]
    mean = float(restitution([*windows.base, *rows], windows.values.restitution, np.zeros(1), np.zeros(1))[0])
    windows.work[:] = left
    return scatter_separated(made, mean)


def _stages(
    windows: Windows, known: Sequence[Candidate], base: State, found: State, progress: Callable[[float], None]
) -> Iterator[_Stage]:
    """Yield the result of each stage of a search; competing hypotheses follow from the last."""
    shown = windows.read
    if found.causes:
        now = _backward(windows, base, found)
        found = _forward(windows, known, base, now, lambda part: progress(0.5 * part))
    else:
        found = _selected(windows, known, base, lambda part: progress(0.5 * part))
    yield _Stage(base, found)
    base, found = _with_own_noise(windows, known, base, found)
    yield _Stage(base, found)
    exact = unrounded(windows, found) if found.causes else found
    base = base if windows.read is shown else _without_causes(windows, exact)
    if exact is not found:
        found = _forward(windows, known, base, _backward(windows, base, exact), lambda part: None)
    found = _by_law(windows, known, base, found)
    yield _Stage(base, found)
    yield _Stage(base, *_exchanged(windows, known, base, found, lambda part: progress(0.5 + 0.5 * part)))


def _opened(windows: Windows) -> State:
    windows.restart((), anew=True)
    return rezeroed(windows, fitted(windows, state_of(windows, (), windows.residuals(()))))


def _selected(windows: Windows, known: Sequence[Candidate], base: State, progress: Callable[[float], None]) -> State:
    """Return a state with causes selected forward, as long as they gain.

    Where residuals are too large for sensitivities, causes are first selected in the beginnings of windows. Where
    flights oscillate, or other causes do not explain the beginnings, a second body is fitted first, or a scatter.
    """
    turns = frequencies(windows) if any(one.kind == BODY for one in known) else []
    now, done, tried = base, 0.0, bool(turns)
    for own in (turns, ()) if turns else ():
        now = _with_second_body(windows, known, own, base) if now is base else now
    dense = [one for one in known if one.kind not in (BODY, SCATTER)]  # these explain any rebound of a first impact
    while True:
        done, part, first = _linear_part(windows, now, done)
        if part is windows:
            break
        if _far(part, first.rest) > ACCOUNTS:
            if not tried and not now.causes and (kicked := _scattered(windows, part, known, base, first)) is not None:
                now = kicked
                break
            found, whole = _of_part(windows, part, dense, first, progress)
            if not tried and _far(part, found.rest) > ACCOUNTS:
                tried, swings = True, _with_second_body(windows, known, (), base)
                if swings is not base:
                    now = swings
                    continue
            if _off(part, found) > ASTRAY:
                now = base
                break
            now = whole if found.causes else now
    if any(one.candidate.kind == BODY for one in now.causes) and _far(windows, now.rest) > ACCOUNTS:
        now = min([now, *scattering(windows, known, base, ACCEPT_PATH)], key=lambda one: _far(windows, one.rest))
    return _forward(windows, known, base, _backward(windows, base, now), progress, exact=True)


def _scattered(windows: Windows, part: Windows, known: Sequence[Candidate], base: State, first: State) -> State | None:
    """Return the state with scatter of restitution alone, where that leaves noise, and no other cause does in a part.

    Otherwise causes that fit beginnings would be added one by one to approximate it.
    """
    few, _, there = _sampled(windows, base)
    tries = scattering(few, known, there, -np.inf)  # what is predicted is invalid for large residuals
    if not any(_leaves_noise(few, one) and _kicks(few, there, one) for one in tries):
        return None
    kicked = _whole(windows, base, few, tries[0])
    few, _, there = _sampled(part, first)
    others = any(_leaves_noise(few, one) for one in _tries(part, few, known, there, first))
    return kicked if _leaves_noise(windows, kicked) and not others else None


def _leaves_noise(windows: Windows, one: State) -> bool:
    """Return whether residuals are noise in most windows."""
    return windows.usual(one.rest) < NOISE and _far(windows, one.rest) <= ACCOUNTS


def _of_part(
    windows: Windows, part: Windows, known: Sequence[Candidate], first: State, progress: Callable[[float], None]
) -> tuple[State, State]:
    """Return causes selected in beginnings of windows, and the state of the windows with them.

    Exchanges follow, as causes may have the same effect in shorter parts. A new law stays if no other cause is better.
    """
    base = polished(part, _opened(part))
    restore(part, first)
    found, done = _forward(part, known, base, polished(part, first), progress), None
    if found.causes and part.usual(found.rest) < NOISE and _far(part, found.rest) > ACCOUNTS:  # few deviate
        found = done = _exchanged(part, known, base, found, progress, grown=False)[0]
    if found.causes and _far(part, found.rest) > ACCOUNTS:  # other causes may hide a law
        found = min(found, _law_first(part, known, base, found) or found, key=lambda one: _far(part, one.rest))
        restore(part, found)
    if found is not done and found.causes and _far(part, found.rest) > ACCOUNTS:
        found = _exchanged(part, known, base, found, progress, grown=False)[0]
    whole = polished(windows, carried(windows, found))
    new = {one.candidate.kind for one in found.causes} - {one.candidate.kind for one in first.causes}
    if new & set(LAWS) and windows.usual(whole.rest) > NOISE:
        other = _of_part(windows, part, [one for one in known if one.kind not in LAWS], first, progress)
        return min((found, whole), other, key=lambda one: _far(windows, one[1].rest))
    return found, whole


def _with_own_noise(windows: Windows, known: Sequence[Candidate], base: State, found: State) -> tuple[State, State]:
    """Return the states without and with causes, with 1/f noise that is not confounded with scattering restitution.

    It is estimated where causes leave more than noise, or scatter: kicks explain 1/f noise as well. Then without them,
    unless only they leave noise.
    """
    for kicked in (False, True):
        scatters = any(one.candidate.kind == SCATTER for one in found.causes)
        if not scatters and (kicked or windows.usual(found.rest) < NOISE):
            break
        restore(windows, less := found)
        if scatters:
            causes = [one for one in found.causes if kicked or one.candidate.kind != SCATTER]
            less = polished(windows, fitted(windows, state_of(windows, causes, windows.residuals(effects_of(causes)))))
        if scatters and not kicked and windows.usual(found.rest) < NOISE < ACCOUNTS < windows.usual(less.rest):
            continue
        if not windows.coloured(effects_of(less.causes)):
            break
        base, found = _without_causes(windows, found), refitted(windows, found)
        found = _forward(windows, known, base, _backward(windows, base, found), lambda part: None)
    return base, found


def _by_law(windows: Windows, known: Sequence[Candidate], base: State, found: State) -> State:
    """Return the state of a search that begins with a law of contact, where that explains as much more simply, or more.

    It is tried where causes leave more than noise, need a motion of the drive that its readings exclude, repeat with
    its fluctuation, as the residual of any periodic motion does, or, in long windows, have another law.
    """
    level, there = windows.usual(found.rest), {one.candidate.kind for one in found.causes}
    far = max(level / NOISE, np.abs(found.motion).max(initial=0.0) / STEADY) > 1.0 or _repeats(windows, found)
    if not there or not (far or (there & {OIL, SOFT} and windows.long)):
        return found
    law = _law_first(windows, known, base, found)
    best = (_simplest(windows, base, [found, law]) if law else None) or found
    restore(windows, best)
    return best


def _law_first(windows: Windows, known: Sequence[Candidate], base: State, found: State) -> State | None:
    """Return the state of a search that begins with another law of contact; ``None`` without one.

    The law alone, or, where others hide it, with the other causes that were found with the first law.
    """
    there = [one.candidate.kind for one in found.causes]
    own = [k for k, kind in enumerate(there) if kind in (OIL, SOFT)]
    able = [one for one in known if one.kind not in there]
    law = None if BODY in there else _with_law(windows, able, base)
    if law is None and own:
        restore(windows, found)
        less = polished(windows, fitted(windows, _without(found, own[0])))
        law = _with_law(windows, [one for one in able if one.kind in LAWS], less)
    explained = _far(windows, found.rest) <= ACCOUNTS
    if law is None or (own and explained and windows.usual(law.rest) > MOST_LEFT * windows.usual(base.rest)):
        return None  # not the main cause
    most = len(found.causes) if explained else ROUNDS  # only a simpler explanation is asked for
    return _forward(windows, known, base, law, lambda part: None, most=most)


def _with_law(windows: Windows, known: Sequence[Candidate], base: State) -> State | None:
    """Return a state with a candidate that is tried at several sizes, where one is accepted."""
    few, _, first = _sampled(windows, base)
    least = ACCEPT_PATH * len(few) / len(windows)
    tries = [one for law in sized(few, known, first, first) if law.gain > least for one in law.fitted(few)]
    tries = [_whole(windows, base, few, one) for one in tries]
    return _simplest(windows, base, [one for one in tries if _is_accepted(windows, base, base, one)])


def law_of_contact(windows: Windows, known: Sequence[Candidate]) -> tuple[Cause, ...]:
    """Return the law of contact that alone explains windows best, which get its starts and datums; none if none does.

    Args:
        windows: of the records.
        known: candidates.
    """
    base = polished(windows, _opened(windows), thorough=True)
    law = _with_law(windows, [one for one in known if one.kind in (OIL, SOFT)], base)
    restore(windows, law or base)
    return law.causes if law else ()


def _repeats(windows: Windows, found: State) -> bool:
    """Return whether the order of a cause is a multiple of that of the drive's fluctuation in a record."""
    orders = fluctuation_orders(windows)
    for one in (cause.candidate for cause in found.causes if cause.candidate.phased):
        own = orders[:, GEARS.index(goes_by(one))]
        periods = order_of(one) / own[own > 0.0]
        if np.any(np.abs(periods - np.maximum(np.round(periods), 1.0)) < LOCKED * periods):
            return True
    return False


def _with_second_body(windows: Windows, known: Sequence[Candidate], turns: Sequence[float], base: State) -> State:
    """Return a state with a second body, where it explains most of the trajectory; arguments as below."""
    few, _, first = _sampled(windows, base)
    tries = [_whole(windows, base, few, one) for one in _with_body_at(few, known, turns, first, first, ACCEPT_PATH)]
    tries = [one for one in tries if _is_accepted(windows, base, base, one)]
    restore(windows, base)
    best = _simplest(windows, base, tries) or base
    return best if _far(windows, best.rest) < max(MOST_LEFT * _far(windows, base.rest), ACCOUNTS) else base


def _linear_part(windows: Windows, now: State, done: float) -> tuple[float, Windows, State]:
    """Return the largest part of windows, beyond a given one, with small residuals, these windows, and the state."""
    least = next(part for part in BEGINNINGS if part > done)
    for reach in reversed(BEGINNINGS):
        part = windows.until(reach) if reach < 1.0 else windows
        first = carried(part, now) if reach < 1.0 else now
        if reach <= least or _off(part, first) < NEARBY or _far(part, first.rest) <= ACCOUNTS:
            return reach, part, first
    raise AssertionError


def _off(windows: Windows, now: State) -> float:
    """Return the residual beyond noise that a quantile of windows does not exceed, in backlashes."""
    restore(windows, now)
    missed = _far(windows, windows.missed(effects_of(now.causes)))
    noise = float(np.median(windows.level(windows.sigma)))
    return float(np.sqrt(max(missed - noise, 0.0))) / windows.backlash


def _far(windows: Windows, rest: Array) -> float:
    """Return the mean square of residuals that a quantile of windows does not exceed."""
    return float(np.quantile(windows.level(rest), MANY))


def _forward(
    windows: Windows, known: Sequence[Candidate], base: State, now: State, progress: Callable[[float], None],
    *, exact: bool = False, most: int = ROUNDS,
) -> State:  # fmt: skip
    """Return a state with at most so many causes, selected forward while they gain; a second body where no other does.

    If ``exact``, readings lose the rounding that causes explain: states of other readings cannot be compared.
    """
    alone: list[Sized] | None = None
    for number in range(len(now.causes), most):
        progress(number / ROUNDS)
        few, mine, first = _sampled(windows, now)
        enough, root, tries = ACCEPT_PATH * len(few) / len(windows), _part(few, mine, base), []
        if not now.causes and _far(few, first.rest) > ACCOUNTS:
            alone = sized(few, known, first, root)
            tries = [one for law in alone if law.left < MOST_LEFT for one in law.fitted(few)]
            tries = [one for one in tries if few.usual(one.rest) < NOISE]  # no other cause explains more
        if not tries:
            tries = [one for one in _tries(windows, few, known, first, now) if gain_of(few, first, one)[0] > enough]
            if tries:
                least = max(enough, SAME * max(gain_of(few, first, one)[0] for one in tries))
                alone = sized(few, known, first, root) if alone is None else alone  # a law may replace several causes
                laws = alone + (sized(few, known, first, first) if now.causes else [])
                tries += [one for law in laws if law.gain > least for one in law.fitted(few)]
        tries += [one for one in scattering(few, known, first, enough) if _kicks(few, first, one)]
        if tries:
            tries = [_whole(windows, now, few, one) for one in _not_excluded(few, first, tries, excludes)[1]]
        best = _best_of(windows, base, now, tries)
        if best is None and (one := _of_diverging(windows, known, base, now)) is not None:
            best = _best_of(windows, base, now, [one])
        if best is None and windows.usual(now.rest) > NOISE:
            tries = _with_body_at(few, known, (), first, _part(few, mine, base), enough)
            best = _best_of(windows, base, now, [_whole(windows, now, few, one) for one in tries])
        if best is None:
            break
        read, now = windows.read, unrounded(windows, best) if exact else best
        if windows.read is not read:
            base, alone = _without_causes(windows, now), None
    restore(windows, now)
    return now


def _best_of(windows: Windows, base: State, now: State, tries: Sequence[State]) -> State | None:
    """Return the simplest accepted state that gains after the drop-one tests, in which a cause may displace both."""
    able = [one for one in tries if _is_accepted(windows, base, now, one)]
    while (first := _simplest(windows, now, able)) is not None:
        if gain_of(windows, now, best := _backward(windows, base, first))[0] > 0.0:
            return best
        able = [one for one in able if one is not first]
    return None


def _without_causes(windows: Windows, now: State) -> State:
    """Return the state without causes for the present readings; windows keep another."""
    base = polished(windows, _opened(windows), thorough=True)
    restore(windows, now)
    return base


def _exchanged(
    windows: Windows, known: Sequence[Candidate], base: State, found: State, progress: Callable[[float], None],
    *, grown: bool = True,
) -> tuple[State, list[State], list[tuple[list[State], list[Rival]]]]:  # fmt: skip
    """Return a state with causes replaced by others that explain more, or as much with fewer numbers.

    Forward selection took the first causes without the later ones. If grown, a hypothesis may show one more cause.

    Returns:
        State, drop-one states, and hypotheses instead of each cause; a sample of windows excludes some before.
    """
    before: list[State] = []
    for left in reversed(range(EXCHANGES + 1)):
        found = _fewer(windows, known, base, found)
        left = 0 if any(_has_causes_of(found, one) for one in before) else left  # another exchange would lead here
        before.append(found)
        less, instead = [], []
        for k, cause in enumerate(found.causes):
            progress((EXCHANGES - left + k / len(found.causes)) / (EXCHANGES + 1))
            less.append(_less(windows, found, k))
            (own, excluded), kind = ([], []), cause.candidate.kind
            if kind not in (BODY, SCATTER):
                few, mine, first = _sampled(windows, found)
                few.sampled = windows.part_of(few)  # the best one's motion is that of all windows
                gain = gain_of(few, plain := _part(few, mine, less[-1]), first)[0]
                least = least_excluding(few, gain, first.rest)
                laws = [one for one in known if kind in LAWS and one.kind in {OIL, SOFT} - {kind}]
                asked = sized(few, laws, plain, plain)
                tries = [one for law in asked if law.gain > ACCEPT_PATH for one in law.fitted(few)]
                if kind not in LAWS:
                    tries = _tries(windows, few, known, first, found, k) + scattering(few, known, plain, LIKE * gain)
                more = len(windows) / len(few)
                for one in tries:
                    if (rival := rival_of(few, one, first, least)).excluded:
                        whole = rival._replace(worse=rival.worse * more, deviance=rival.deviance * more)
                        excluded += [whole] if len(one.causes) == len(found.causes) else []
                    else:
                        own.append(_whole(windows, found, few, one))
            same = _with_last(found, k)
            able = [one for one in own if _is_accepted(windows, base, less[-1], one)]
            more = [_of_diverging(windows, known, base, one) for one in (able if left and grown else ())]
            if shows := [one for one in more if one is not None]:  # a cause that this hypothesis hides
                found = _forward(windows, known, base, shows[0], lambda part: None)
                break
            least = least_excluding(windows, gain_of(windows, less[-1], found)[0], found.rest)
            if left and len(found.causes) > 1:  # an equivalent cause may make others needless
                able = [one if excludes(windows, one, found, least) else _backward(windows, base, one) for one in able]
            best = _simplest(windows, less[-1], [same, *able]) or same
            simpler = best is not same and _complexity(best) <= _complexity(same)  # or equally simple, and better
            if left and (simpler or excludes(windows, same, best, least)):
                found = _forward(windows, known, base, _backward(windows, base, best), lambda part: None)
                break
            instead.append(([one for one in own if len(one.causes) == len(found.causes)], excluded))
        else:
            restore(windows, found)
            return found, less, instead
    raise AssertionError


def _has_causes_of(one: State, other: State) -> bool:
    """Return whether two states have the same causes, of any size."""
    same = (any(is_same(cause.candidate, each) for each in other.causes) for cause in one.causes)
    return len(one.causes) == len(other.causes) and all(same)


def _fewer(windows: Windows, known: Sequence[Candidate], base: State, found: State) -> State:
    """Return a state with fewer causes in the place of several collinear ones, where these explain as much."""
    tries = []
    for causes, by in fewer(windows, known, found) if len(found.causes) > 1 else ():
        restore(windows, found)
        windows.turned = windows.turned + by
        with suppress(InputError):
            rest = windows.residuals(effects_of(causes))
            one = polished(windows, fitted(windows, state_of(windows, causes, rest)))
            if not excludes(windows, one, found, least_excluding(windows, 0.0, found.rest)):
                tries.append(one)
    restore(windows, found)
    return _simplest(windows, found, tries) or found


def _is_accepted(windows: Windows, base: State, less: State, more: State) -> bool:
    """Return whether the last cause is accepted: by its size, which a rig can have, and its gain."""
    able = more.causes[-1].possible and SMALLEST < size_of(windows, more.causes[-1]) < LARGEST
    return able and _leaves_drag(windows, more.causes) and _is_significant(windows, base, less, more)


def _leaves_drag(windows: Windows, causes: Sequence[Cause]) -> bool:
    """Return whether torques at mean speed still drag: without, nothing would keep the gear on its driver."""
    drag = windows.values.drag_torque
    rows = [*windows.base, *(row for effect in effects_of(causes) for row in effect.rows(windows.values))]
    torques = torques_of([row for row in rows if row.code != Code.TORQUE_HARMONIC], drag)  # its mean is 0
    return -slowed(np.inf, 0.0, windows.pivot, 0, torques, 1.0) >= (1.0 - MOST_DRAG) * drag


def _is_significant(windows: Windows, base: State, less: State, more: State) -> bool:
    """Return whether the gain of a cause exceeds chance, and model errors in proportion to what is explained.

    Where residuals with it are noise, only errors of sizes count.
    """
    gain, sure = gain_of(windows, less, more)
    sure = max(sure, agreement_of_diverging(windows, less, more))
    if gain <= ACCEPT_PATH or sure <= min(STEADY, EVEN * float(np.sqrt(gain))):
        return False
    part = MISSIZED if windows.usual(more.rest) < NOISE else MODEL_ERROR
    able = gain > part * gain_of(windows, base, more)[0]
    return able and (more.causes[-1].candidate.kind != SCATTER or _kicks(windows, less, more))


def _kicks(windows: Windows, less: State, more: State) -> bool:
    """Return whether a scatter explains more than correlated errors would let it, or leaves white noise."""
    before, after = (float(np.mean(windows.level(one.rest))) for one in (less, more))
    return before >= BEYOND * after or windows.runs(more.rest) < BEYOND


def _simplest(windows: Windows, now: State, tries: Sequence[State]) -> State | None:
    """Return the simplest of the states that the best one does not exclude: fewest numbers, gears before sensors."""
    if not tries:
        return None
    # numbers of single impacts fit a few windows in any case: a scatter must be better in most
    scatters = any(cause.candidate.kind == SCATTER for one in tries for cause in one.causes)
    best, able = _not_excluded(windows, now, tries, excludes if scatters else is_worse)
    return min(able, key=lambda one: (*_complexity(one), one is not best))


def _complexity(one: State) -> tuple[bool, int, float, bool, bool]:
    """Return the sort key of simplicity: a number of each impact, numbers, price and places of the last cause."""
    last = one.causes[-1]
    one_sided = last.candidate.kind == "restitution_asymmetry"  # of one flank, where only one is met
    numbers, kinds = sum(len(cause.numbers) for cause in one.causes), [cause.candidate.kind for cause in one.causes]
    return SCATTER in kinds, numbers, price(last.candidate), one_sided, isinstance(last.effect, SensorEffect)


def _is_bent(now: State) -> bool:
    """Return whether the motion of the drive is corrected by more than its readings allow, in the place of a cause."""
    return float(np.abs(now.motion).max(initial=0.0)) > BENDS


def _without(state: State, k: int) -> State:
    return state._replace(causes=state.causes[:k] + state.causes[k + 1 :])


def _less(windows: Windows, now: State, k: int) -> State:
    """Return the fit without one of the causes."""
    restore(windows, now)
    return polished(windows, fitted(windows, _without(now, k)), thorough=True)


def _with_last(state: State, k: int) -> State:
    return state._replace(causes=(*_without(state, k).causes, state.causes[k]))


def _lean(windows: Windows, now: State) -> State:
    """Return a state without causes that the last one reduced to nothing."""
    for k in reversed(range(len(now.causes) - 1)):
        if size_of(windows, now.causes[k]) < SMALLEST:
            restore(windows, now)
            now = polished(windows, fitted(windows, _without(now, k)))
    return now


def _backward(windows: Windows, base: State, now: State) -> State:
    """Return a state without causes that fail the drop-one test (backward elimination)."""
    k = 0
    while k < len(now.causes):
        if _passes_drop_one(windows, base, now, k):
            k += 1
            continue
        less = _less(windows, now, k)
        if _is_accepted(windows, base, less, _with_last(now, k)):
            k += 1
        else:
            now, k = less, 0
    restore(windows, now)
    return now


def _passes_drop_one(windows: Windows, base: State, now: State, k: int) -> bool:
    """Return whether a sample of windows shows that a cause passes the drop-one test."""
    few, mine, first = _sampled(windows, now)
    if few is windows:
        return False
    less = polished(few, fitted(few, _without(first, k)), thorough=True)
    return _is_accepted(few, _part(few, mine, base), less, _with_last(first, k))


def _sampled(windows: Windows, now: State) -> tuple[Windows, Array, State]:
    """Return a sample of windows for trial fits, which residuals are theirs, and the state in them."""
    restore(windows, now)
    few, mine = windows.some(SCORED)
    return few, mine, _part(few, mine, now)


def _part(few: Windows, mine: Array, now: State) -> State:
    """Return a state of all windows in a sample of them, given which residuals, (n + KICKS w,), are theirs."""
    if len(few) == len(now.price):
        return now
    starts, own = now.starts.only(few.picked), few.picked
    return now._replace(
        rest=now.rest[mine[: len(now.rest)]], starts=starts, weight=now.weight[own], price=now.price[own]
    )


def _whole(windows: Windows, now: State, few: Windows, one: State) -> State:
    """Return a state that was fitted in a sample of windows in all of them.

    windows: all; now: their state, whose starts are taken where the sample has none; few: sample; one: state in it.
    """
    if few is windows:
        return one
    restore(windows, now)
    windows.zeros, windows.turned, windows.motion = one.zeros.copy(), one.turned.copy(), one.motion
    windows.starts = now.starts.put(few.picked, one.starts)
    effects = effects_of(one.causes)
    windows.restart(effects, anew=_is_bent(now) and not _is_bent(one))
    return polished(windows, fitted(windows, state_of(windows, one.causes, windows.residuals(effects))), thorough=True)


def _not_excluded(
    windows: Windows, now: State, tries: Sequence[State], worse: Callable[..., bool] = is_worse
) -> tuple[State, list[State]]:
    """Return the best of states, and those that it does not exclude, as they are not worse by the stated test."""
    best = tries[0]
    for one in tries[1:]:
        if gain_of(windows, best, one)[0] > 0.0:
            best = one
    least = least_excluding(windows, gain_of(windows, now, best)[0], best.rest)
    return best, [one for one in tries if one is best or not worse(windows, one, best, least)]


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
        place: of a cause; only candidates collinear with it are fitted, instead of it.
    """
    made: list[State] = []
    for one in _fits(windows, few, known, first, now, place):
        if few.usual(one.rest) > ACCOUNTS and any(few.usual(other.rest) < NOISE for other in made):
            continue  # one that leaves noise is compared with others at the end
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
    bent = any(one.candidate.kind in LAWS for one in causes)  # scores are less accurate
    # next to a motion of the drive that stands for the cause, its complete size is too much: the first step moves both
    part = HELD if place is None and _is_bent(first) and few.usual(first.rest) < NOISE else 1.0
    most, least = FITTED[bent], NEAR if place is None or bent else LIKE
    made, kinds = [], {}
    for gain, one, units, by, _ in able:
        if gain < least * able[0].gain or len(kinds) >= most:
            break
        key, shape = (one.kind, goes_by(one)), {**one.shape, "flank": ""}  # one of a kind, on each of its flanks
        if kinds.get(key, shape) != shape or any(is_same(one, cause) for cause in now.causes):
            continue
        with suppress(InputError):
            cause = begin(one, part * np.clip(units, -FARTHEST[0], FARTHEST[0]))
            restore(few, first)
            few.turned, fit = few.turned + by, first._replace(causes=(*causes, cause))
            few.keep_readings(effects_of(first.causes), effects_of(fit.causes))
            if place is not None:  # the others, of few windows perhaps, are known
                fit = fitted(few, fit, held=len(causes))
            fit = fitted(few, fit)
            if fit.causes[-1].possible:
                kinds[key] = shape if place is None else None
                made.append(fit)
    few.weight = first.weight
    return sorted(made, key=lambda one: float(np.sum((one.rest * few.weights(one.rest)) ** 2)))


def _of_diverging(windows: Windows, known: Sequence[Candidate], base: State, now: State) -> State | None:
    """Return a state with one more cause, shown by windows that diverge where others are explained; ``None`` if none.

    Among all windows their residuals are clipped, and count little.
    """
    level = windows.level(now.rest)
    usual = float(np.median(level))
    far = np.flatnonzero(level > FAR * max(usual, 1.0))
    if len(far) < FEWEST or usual > ACCOUNTS:
        return None
    known = [one for one in known if one.kind not in LAWS]
    restore(windows, now)
    windows.weight = np.ones(len(windows))
    part, mine = windows.only(far)
    first = _part(part, mine, now._replace(weight=windows.weight))
    asked = sized(part, known, first, first)
    tries = [one for law in asked if law.gain > ACCEPT_PATH for one in law.fitted(part)]
    for one in _fits(part, part, known, first, first, None)[:FITTED_DIVERGING]:
        restore(part, one)
        tries.append(polished(part, scanned(part, polished(part, one)), thorough=True))
    best = _not_excluded(part, first, tries)[1] if tries else []
    best = [one for one in best if len(one.causes) > len(now.causes)]  # datums that only some records determine stay
    best = [_whole(windows, now, part, added(now, one, int(part.record[0]))) for one in best]
    return _simplest(windows, now, [one for one in best if _is_accepted(windows, base, now, one)])


def _with_body_at(
    windows: Windows, known: Sequence[Candidate], turns: Sequence[float], now: State, root: State, least: float
) -> list[State]:
    """Return states with a second body, added or alone, where the gain is enough.

    Args:
        windows: sample.
        known: candidates.
        turns: natural frequencies found in flights [rad/s].
        now: state of the sample.
        root: that without causes.
        least: required fall of chi-square.
    """
    there = any(one.candidate.kind in (*LAWS, SCATTER) for one in now.causes)
    if there or not any(one.kind == BODY for one in known):
        return []
    made = []
    for start in (root, now) if now.causes else (now,):
        one = polished(windows, carrying(windows, turns, now, start))
        if len(one.causes) > len(start.causes) and gain_of(windows, now, one)[0] > least:
            made.append(playing(windows, one, least))
        if windows.usual(one.rest) < NOISE:
            break
    restore(windows, now)
    return made
