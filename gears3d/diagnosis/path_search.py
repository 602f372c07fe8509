"""Which causes make the path itself come true: score tests and refits in windows of all records.

What flights, contacts and impacts say one by one depends on where records were cut; the path does not. Each candidate
is tried by how residuals of readings change with its size, what starts and zeros explain taken out; the best are
fitted, the best of these is taken, and every cause is tested again without it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from math import gcd, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import FREE
from gears3d.diagnosis.cause import Cause, begin, moved
from gears3d.diagnosis.library import price
from gears3d.diagnosis.scatter import Scatter
from gears3d.diagnosis.shooting import KICKS, Linearised, Starts, Windows, WithoutStarts
from gears3d.diagnosis.zeros import GEARS, Phases, goes_by, one_size, order_of, reference, worth_of
from gears3d.effects import SensorEffect
from gears3d.errors import InputError

if TYPE_CHECKING:
    from gears3d.diagnosis.candidates import Candidate

Array = np.ndarray
ACCEPT = 40.0
"""Fall of chi-square over its level that a cause must bring: by chance, among three thousand numbers, in 1e-6."""
STEADY = 4.0
"""Standard errors, by the scatter over windows, each of which counts for as much as excludes a cause at most, that this
fall must differ from none by: that of fourteen windows out of a hundred."""
SMALLEST, LARGEST = 0.01, 3.0
"""Sizes in units between which a cause is one: smaller ones come from how the drive's motion is smoothed."""
STEP = 1e-3
"""Of a number in units, for slopes at a fit."""
TRIED = 0.2
"""Part of the size at which candidates have their columns."""
SQUARED, OIL, SCATTER = "mesh_drag", "oil_film", "restitution_scatter"
"""A cause that is felt with its square, one that changes all of the path from its smallest size on, and one by which
every impact has a number of its own."""
SCATTERED, SPREADS = (0.3, 0.1, 0.03, 0.01), 3
"""Sizes in units from the best of which the fit of a scatter begins, and rounds in which the size follows the kicks."""
BENT, LEAST = 0.02, 0.1
"""Part of the size by which columns of these are taken, and the least size of that, in units."""
OILS = (0.03, 0.06, 0.12, 0.25, 0.5)
"""Sizes in units at which oil is tried."""
SCORED = 32
"""Windows in which candidates are scored."""
NEAR = 0.1
"""Part of the best score that a candidate needs to be fitted."""
FITTED = (7, 2)
"""Candidates that are fitted in a round, and between films of oil, where a run takes ten times as long."""
SAME = 0.01
"""Part of what a cause explains by which another must explain less, too, to be excluded: the rest is the model's."""
LEFT = 0.25
"""Part of the chi-square that is left beyond noise by which another cause must be worse, too."""
APART = 3.0
"""Standard errors, by the scatter over windows, that this must differ from none by."""
ERRS = 1e-3
"""Part of what all causes explain that a model of them may err by: a cause that gains less is none."""
EXCLUDED = 16.0
"""Chi-square over the level by which another cause must be worse to be excluded: four standard deviations."""
ROUNDS = 8
"""Causes at most, and rounds of Gauss-Newton."""
FARTHEST = (0.5, 0.2, 0.05)
"""Units that numbers and starts move in a round at most, and radians that angles turn."""
TURNED = 1e-5
"""Of an angle, for slopes [rad]."""
DAMPED = (1.0, 0.3, 0.1)
"""Parts of a step that are tried."""
REACHES = tuple(0.08 * 1.25**k for k in range(12))
"""Parts of a window, from its beginning on, whose readings starts and kicks follow one after the other."""
SETTLING = 2
"""Rounds in which starts follow a step of the numbers before it is judged."""
SCAN = (0.8, 1.25)
"""Times its size that a cause is tried at."""
FAR = 9.0
"""Times the level from which on a window counts as no more than that: its motion parted from the model's."""


class Path(NamedTuple):
    """Causes by which the path comes true.

    Args:
        causes: with their numbers.
        covariance: of all numbers, in the order of the causes [SI], (p, p).
        gains: fall of chi-square, over its level, that each cause brings beside the others, (c,).
        before: usual mean square of a window's residuals without causes.
        after: with them.
        missed: root mean square of what is left in usual windows [m].
        windows: how many.
        others: what was tried in the place of each cause, with the chi-square over the level by which it is worse, and
            whether the path excludes it.
        seen: smallest size of causes of one number that the path shows beside these, in units, by kind.
        scatter: of the restitution beside the causes.
    """

    causes: tuple[Cause, ...]
    covariance: Array
    gains: Array
    before: float
    after: float
    missed: float
    windows: int
    others: tuple[tuple[tuple[Cause, float, bool], ...], ...]
    seen: dict[str, float]
    scatter: Scatter | None = None


class _State(NamedTuple):
    """Causes, the residuals that they leave, and the windows' starts, zeros and weights with them.

    The price of kicks is the logarithm by which they lower the evidence, twice, in each window.
    """

    causes: tuple[Cause, ...]
    rest: Array
    starts: Starts
    zeros: Array
    turned: Array
    weight: Array
    price: Array


class _Score(NamedTuple):
    """What a candidate promises: fall of chi-square, its numbers in units, how records are turned for it [rad].

    Its worth is chi-square over the square of the first number.
    """

    gain: float
    candidate: Candidate
    units: Array
    by: Array
    worth: float


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
    base = _polished(windows, _opened(windows))
    tried: dict[str, list[_State]] = {}
    found = _searched(windows, known, base, tried, told)
    gains, others = [], []
    for k in range(len(found.causes)):
        less = _polished(windows, _fitted(windows, _without(found, k)))
        gains.append(_better(windows, less, found)[0])
        least = _least(windows, gains[-1], found.rest)
        worse = [
            (one.causes[-1], _better(windows, one, found)[0], _excludes(windows, one, found, least))
            for one in tried.get(found.causes[k].candidate.kind, ())
            if len(one.causes) == len(found.causes)
        ]
        others.append(tuple(worse))
        _restore(windows, found)
    level = windows.level(found.rest)
    usual = windows.level(windows.missed(_effects(found.causes)))
    made = Path(
        found.causes, _covariance(windows, found), np.array(gains), float(np.median(windows.level(base.rest))),
        float(np.median(level)), float(np.sqrt(np.median(usual))), len(windows), tuple(others),
        _seen(windows, known, found),
    )  # fmt: skip
    return _apart(made)


def _apart(path: Path) -> Path:
    """Return a path whose scatter of the restitution stands beside its causes."""
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
    made, before = [], _state(windows, causes, windows.read)
    for first in (0, 1):
        parts = [windows.only(np.arange(k, len(windows), 2))[0] for k in (first, 1 - first)]
        for one in parts:
            one.zeros, one.turned = before.zeros.copy(), before.turned.copy()
        now = _fitted(parts[0], _state(parts[0], causes, parts[0].read))
        held, levels = parts[1], []
        for told in ((), now.causes):
            held.restart(_effects(told))
            rest = _settled(held, _effects(told), held.residuals(_effects(told)))
            level, missed = held.level(rest), held.level(held.missed(_effects(told)))
            levels.append((float(np.median(level)), float(np.sqrt(np.median(missed))), _state(held, told, rest)))
        (base, off, blind), (extended, left, more) = levels
        gain = 0.5 * _better(held, blind, more)[0]
        made.append((base, extended, off, left, gain))
    _restore(windows, before)
    return made


def against(windows: Windows, causes: Sequence[Cause], turned: Sequence[tuple[float, float]]) -> Against | None:
    """Return causes that were found otherwise, fitted to the path; ``None`` where the rig cannot have them.

    Args:
        windows: of the records, with starts that fit.
        causes: in the place of all others.
        turned: what is added to the angles of both gears in each record, from which they count [rad].
    """
    before = _state(windows, (), windows.read)
    windows.turned = np.array(turned, float).reshape(-1, 2)
    try:
        rest = windows.residuals(_effects(causes))
        found = _polished(windows, _fitted(windows, _state(windows, causes, rest)))
        return Against(found.causes, _covariance(windows, found), float(np.median(windows.level(found.rest))))
    except InputError:
        return None
    finally:
        _restore(windows, before)


def _seen(windows: Windows, known: Sequence[Candidate], found: _State) -> dict[str, float]:
    """Return the smallest size of causes of one number that the path shows beside others, in units, by kind."""
    plain = [one for one in known if not one.phased and not one.shape and one.kind not in (*FREE, OIL, SCATTER)]
    scores, level = _scores(windows, plain, found, -np.inf)
    return {one.candidate.kind: float(np.sqrt(ACCEPT * level / one.worth)) for one in scores if one.worth > 0.0}


def _opened(windows: Windows) -> _State:
    windows.restart((), anew=True)
    return _fitted(windows, _state(windows, (), windows.residuals(())))


def _state(windows: Windows, causes: Sequence[Cause], rest: Array) -> _State:
    return _State(
        tuple(causes), rest, windows.starts, windows.zeros.copy(), windows.turned.copy(), windows.weight.copy(),
        _price(windows, causes),
    )  # fmt: skip


def _restore(windows: Windows, state: _State) -> None:
    windows.starts, windows.zeros, windows.turned = state.starts, state.zeros.copy(), state.turned.copy()
    windows.weight = state.weight.copy()


def _effects(causes: Sequence[Cause]) -> list[object]:
    return [one for one in (cause.effect for cause in causes) if one is not None]


def _searched(
    windows: Windows, known: Sequence[Candidate], base: _State, tried: dict[str, list[_State]],
    told: Callable[[float], None],
) -> _State:  # fmt: skip
    """Return a state with causes added one after the other, as long as they gain."""
    now = base
    for number in range(ROUNDS):
        told(number / ROUNDS)
        _restore(windows, now)
        tries = []
        for one in _fits(windows, known, now):
            _restore(windows, one)
            tries.append(_polished(windows, _scanned(windows, _polished(windows, one))))
        if tries:
            least = max(ACCEPT, SAME * max(_better(windows, now, one)[0] for one in tries))
            for one in _oiled(windows, known, now, least):
                _restore(windows, one)
                tries.append(_polished(windows, _scanned(windows, _polished(windows, one))))
        for one in _scattered(windows, known, now):
            _restore(windows, one)
            tries.append(_polished(windows, one))
        best = _simplest(windows, now, tries)
        if (
            best is None
            or not SMALLEST < _size(windows, best.causes[-1]) < LARGEST
            or not _pays(windows, base, now, best)
        ):
            break
        tried[best.causes[-1].candidate.kind] = [one for one in tries if one is not best]
        now = _pruned(windows, base, best)
    _restore(windows, now)
    return now


def _pays(windows: Windows, base: _State, less: _State, more: _State) -> bool:
    """Return whether a cause gains more than chance, and than the errors of a model that explains so much."""
    gain, sure = _better(windows, less, more)
    return gain > max(ACCEPT, ERRS * _better(windows, base, more)[0]) and sure > STEADY


def _better(windows: Windows, less: _State, more: _State) -> tuple[float, float]:
    """Return by how much chi-square falls, over the level of the better residuals, and how sure that is by windows.

    What keeps its sign for some readings counts as one reading.
    """
    return _fall(windows, less.rest, more.rest, more.price - less.price)


def _fall(windows: Windows, less: Array, more: Array, price: Array | float = 0.0) -> tuple[float, float]:
    """Return the same of residuals, of which the better ones may have a price in each window."""
    a, b = windows.level(less), windows.level(more)
    level = max(float(np.median(b)), 1e-12)
    most = FAR * level + float(np.median(a))
    fall = (np.minimum(a, most) - np.minimum(b, most)) * np.bincount(windows.window, minlength=len(windows))
    fall = fall / (level * windows.runs(more)) - price
    bounded = np.clip(fall, -EXCLUDED, EXCLUDED)
    return float(fall.sum()), float(bounded.mean() / (bounded.std() / np.sqrt(len(fall)) + 1e-30))


def _simplest(windows: Windows, now: _State, tries: Sequence[_State]) -> _State | None:
    """Return the simplest of those that the best does not exclude: of fewest numbers, gears before sensors."""
    if not tries:
        return None
    best = tries[0]
    for one in tries[1:]:
        if _better(windows, best, one)[0] > 0.0:
            best = one
    least = _least(windows, _better(windows, now, best)[0], best.rest)
    able = [one for one in tries if one is best or _better(windows, one, best)[0] < least]

    def simple(one: _State) -> tuple[int, float, bool, bool, bool]:
        last = one.causes[-1]
        one_sided = last.candidate.kind == "restitution_asymmetry"  # that of a flank, where only one is met
        sensor = isinstance(last.effect, SensorEffect)
        return len(last.numbers), price(last.candidate), one_sided, sensor, one is not best

    return min(able, key=simple)


def _least(windows: Windows, gain: float, rest: Array) -> float:
    """Return the chi-square over the level by which a cause must be worse to be excluded.

    Four standard deviations; part of what the better one explains, for a model errs; and part of what it leaves beyond
    noise, which something else does that may be taken for either.
    """
    level = float(np.median(windows.level(rest)))
    beyond = max(level - 1.0, 0.0) / level * len(windows.read) / windows.runs(rest)
    return max(EXCLUDED, SAME * gain, LEFT * beyond)


def _excludes(windows: Windows, one: _State, other: _State, least: float) -> bool:
    """Return whether a state leaves more than another, by so much, and in windows all over the records."""
    worse, sure = _better(windows, one, other)
    return worse > least and sure > APART


def _size(windows: Windows, cause: Cause) -> float:
    """Return the size of a cause in its units, those of a power of the speed at its own exponent."""
    size = float(np.hypot.reduce(cause.numbers[: 2 if cause.candidate.phased else 1])) / cause.candidate.unit
    if cause.candidate.kind == "drag_power":
        size *= windows.pivot ** (float(np.exp(cause.numbers[1])) - cause.candidate.shape["exponent"])
    return size


def _without(state: _State, k: int) -> _State:
    return state._replace(causes=state.causes[:k] + state.causes[k + 1 :])


def _pruned(windows: Windows, base: _State, now: _State) -> _State:
    """Return a state without causes that the others make needless."""
    k = 0
    while k < len(now.causes) and len(now.causes) > 1:
        _restore(windows, now)
        less = _polished(windows, _fitted(windows, _without(now, k)))
        if SMALLEST < _size(windows, now.causes[k]) < LARGEST and _pays(windows, base, less, now):
            k += 1
        else:
            now, k = less, 0
    _restore(windows, now)
    return now


def _fits(windows: Windows, known: Sequence[Candidate], now: _State) -> list[_State]:
    """Return the best candidates of each kind, fitted together with the causes, best first."""
    scores, level = _scores(windows, known, now)
    able = [one for one in scores if np.hypot.reduce(one.units) > 0.5 * SMALLEST and one.gain > ACCEPT * level]
    there = {(one.candidate.kind, str(one.candidate.shape)) for one in now.causes}
    most = FITTED[1 if any(one.candidate.kind == OIL for one in now.causes) else 0]
    made, kinds = [], set()
    for gain, one, units, by, _ in able:
        if gain < NEAR * able[0].gain or len(made) >= most:
            break
        if one.kind in kinds or (one.kind, str(one.shape)) in there:
            continue
        with suppress(InputError):
            cause = begin(one, np.clip(units, -FARTHEST[0], FARTHEST[0]))
            _restore(windows, now)
            windows.turned = windows.turned + by
            fit = _fitted(windows, now._replace(causes=(*now.causes, cause)))
            if fit.causes[-1].possible:
                kinds.add(one.kind)
                made.append(fit)
    windows.weight = now.weight
    return sorted(made, key=lambda one: float(np.sum((one.rest * windows.weights(one.rest)) ** 2)))


def _oiled(windows: Windows, known: Sequence[Candidate], now: _State, least: float) -> list[_State]:
    """Return causes with oil between the flanks as well, where some windows promise that it gains so much."""
    oil = next((one for one in known if one.kind == OIL), None)
    if oil is None or any(one.candidate.kind == OIL for one in now.causes):
        return []
    _restore(windows, now)
    few, mine = windows.some(SCORED // 2)
    zeros, best, most = windows.zeros, None, least * len(few) / len(windows)
    for size in OILS:
        effects = [*_effects(now.causes), oil.effect(np.array([size * oil.unit]))]
        few.zeros, before = zeros.copy(), now.rest[mine[: len(now.rest)]]
        for _ in range(2):  # what floats on oil lies off the zero that dry flanks have
            few.restart(effects)
            missed = few.missed(effects)
            for k in range(len(zeros)):
                own = few.record[few.window] == k
                few.zeros[k] += float(np.median(missed[own])) if np.any(own) else 0.0
        gain = _fall(few, before, few.residuals(effects))[0]
        if gain > most:
            most, best = gain, (size, few.zeros)
    if best is None:
        return []
    with suppress(InputError):
        cause = begin(oil, np.array([best[0]]))
        windows.zeros = best[1].copy()
        windows.restart(_effects([*now.causes, cause]))
        rest = windows.residuals(_effects([*now.causes, cause]))
        return [_fitted(windows, _state(windows, (*now.causes, cause), rest))]
    return []


def _scattered(windows: Windows, known: Sequence[Candidate], now: _State) -> list[_State]:
    """Return causes with restitution that scatters as well, where flanks are dry."""
    own = next((one for one in known if one.kind == SCATTER), None)
    if own is None or any(one.candidate.kind in (OIL, SCATTER) for one in now.causes):
        return []
    _restore(windows, now)
    best, most = None, ACCEPT
    for size in SCATTERED:
        causes = (*now.causes, begin(own, np.array([size])))
        tried = _state(windows, causes, windows.residuals(_effects(causes)))
        if (gain := _promised(windows, tried)) > most:
            best, most = tried, gain
    if best is None:
        return []
    for _ in range(SPREADS):
        rest = _followed(windows, _effects(best.causes), best.rest)
        best = _spread(windows, _fitted(windows, _state(windows, best.causes, rest)))
    return [best]


def _followed(windows: Windows, effects: Sequence[object], rest: Array) -> Array:
    """Move starts and kicks of each window to where they follow its readings from the first on, where that is better.

    One impact after the other comes within reach; all at once, those that come late hold the first where they are.

    Args:
        windows: that go with starts; restitution scatters.
        effects: of the causes.
        rest: residuals of the present starts.

    Returns:
        Residuals.
    """
    before = windows.starts
    windows.restart(effects, anew=True, until=REACHES[0])
    new = windows.residuals(effects)
    for reach in REACHES:
        early = windows.early(reach, len(new))
        for _ in range(SETTLING):
            along = windows.along(effects)
            tried = windows.moved([one * early for one in along.starts()], new * early, along.spread, FARTHEST[1])
            moved = windows.residuals(effects, tried)
            better = windows.level(moved * early) < windows.level(new * early)
            windows.starts = tried.where(better, windows.starts)
            new = np.where(better[windows.every[: len(new)]], moved, new)
    better = windows.level(new) < windows.level(rest)
    windows.starts = windows.starts.where(better, before)
    return np.where(better[windows.every[: len(rest)]], new, rest)


def _promised(windows: Windows, now: _State) -> float:
    """Return by how much kicks lower chi-square over its level, to first order, less their price."""
    columns = [one * windows.weights(one) for one in windows.along(_effects(now.causes)).starts()]
    rest = now.rest * windows.weights(now.rest)
    without, within = windows.without_starts(columns[:2])(rest), windows.without_starts(columns)(rest)
    level = max(float(np.median(windows.level(within))), 1e-12)
    fall = float(without @ without - within @ within) / (level * windows.runs(within))
    return fall - float(now.price.sum())


def _kicked(windows: Windows, causes: Sequence[Cause]) -> tuple[WithoutStarts, Array] | None:
    """Return what takes starts and kicks out of columns, and how well each kick is known by itself, 0 to 1, (w, K).

    ``None`` where restitution does not scatter.
    """
    along = windows.along(_effects(causes))
    if not along.spread:
        return None
    columns = along.starts()
    own = windows.without_starts([one * windows.weights(one) for one in columns])
    return own, np.clip(1.0 - own.variances()[:, -KICKS:], 0.0, 1.0)


def _price(windows: Windows, causes: Sequence[Cause]) -> Array:
    """Return twice the logarithm by which kicks lower the evidence of each window, (w,)."""
    own = _kicked(windows, causes) if any(one.candidate.kind == SCATTER for one in causes) else None
    if own is None:
        return np.zeros(len(windows))
    return 2.0 * np.sum(np.log(np.maximum(own[0].sizes[:, -KICKS:], 1.0)), axis=1)


def _spread(windows: Windows, now: _State) -> _State:
    """Return a state whose restitution scatters as its kicks do. Source: MacKay 1992, Neural Computation 4(3)."""
    k = next((k for k, one in enumerate(now.causes) if one.candidate.kind == SCATTER), None)
    own = None if k is None else _kicked(windows, now.causes)
    if k is None or own is None:
        return now
    size = np.sqrt(np.sum(windows.starts.kicks**2) / max(float(own[1].sum()), 1e-9))
    last = now.causes[k]
    size = np.clip(size, 0.1 * SMALLEST * last.candidate.unit, last.candidate.unit)
    causes = (*now.causes[:k], last._replace(numbers=np.array([size])), *now.causes[k + 1 :])
    return _state(windows, causes, windows.residuals(_effects(causes)))


def _columns(along: Linearised, causes: Sequence[Cause]) -> list[Array]:
    """Return how predictions change with each number of causes, and with each zero, per unit, (n,) each."""
    windows, columns = along.windows, []
    oil = any(cause.candidate.kind == OIL for cause in causes)  # a film is thin where most happens: no straight line
    for k, cause in enumerate(causes):
        bent = oil or cause.candidate.kind == SQUARED
        for j, unit in enumerate(cause.units):
            step = BENT * max(abs(cause.numbers[j]) / unit, LEAST) if bent else STEP
            numbers = cause.numbers.copy()
            numbers[j] += step * unit
            other = cause._replace(numbers=numbers)
            if bent:
                rest = windows.residuals(_effects([*causes[:k], other, *causes[k + 1 :]]))
                columns.append((along.rest - rest) / step)
            else:
                columns.append(along.column(other.effect, cause.effect) / step)
    record = windows.record[windows.every[: len(along.rest)]]
    unit = along.extended(windows.backlash / windows.sigma)
    columns += [(record == k) * unit for k in range(len(windows.zeros))]
    for side, records in _loose_angles(windows, causes):
        by = (TURNED, 0.0) if side == 0 else (0.0, TURNED)
        own = [one.effect for one in causes if goes_by(one.candidate) == GEARS[side]]
        turned = sum((along.column(one, one, by) for one in own if one is not None), np.zeros(len(record)))
        columns += [np.where(record == k, turned / STEP, 0.0) for k in records]
    return columns


def _loose_angles(windows: Windows, causes: Sequence[Cause]) -> list[tuple[int, list[int]]]:
    """Return the records whose angles of each gear count from anywhere, as far as causes tell them.

    Where no record has a mark, the phases of causes count from the first.
    """
    told = []
    for side, gear in enumerate(GEARS):
        own = [one.candidate for one in causes if goes_by(one.candidate) == gear]
        lost = np.flatnonzero(windows.lost[:, side]).tolist()
        if len(lost) == len(windows.lost) and any(one.phased for one in own):
            lost = lost[1:]
        if own and lost:
            told.append((side, lost))
    return told


def _fitted(windows: Windows, now: _State, rounds: int = ROUNDS) -> _State:
    """Return causes, zeros and starts with the numbers that leave the least chi-square, by Gauss-Newton."""
    causes = tuple(now.causes)
    units = np.concatenate([np.zeros(0), *(cause.units for cause in causes)])
    rest = now.rest
    for _ in range(rounds):
        along = windows.along(_effects(causes))
        rest, weight = along.rest, windows.weights(along.rest)
        starts = [one * weight for one in along.starts()]
        columns = np.column_stack([one * weight for one in _columns(along, causes)])
        away = windows.without_starts(starts)
        own = np.column_stack([away(column) for column in columns.T])
        step = np.linalg.lstsq(own, away(rest * weight), rcond=1e-9)[0]
        numbers = sum(len(cause.numbers) for cause in causes)
        step[:numbers] = _shortened(causes, step[:numbers])
        before, old = float(np.sum((rest * weight) ** 2)), windows.starts
        zeros, turned, angles = windows.zeros, windows.turned, _loose_angles(windows, causes)
        for damping in DAMPED:
            left = rest * weight - columns @ (damping * step)
            try:
                trial = moved(causes, damping * step[:numbers] * units, windows.pivot)
                if any(one.candidate.kind == OIL and one.numbers[0] <= 0.0 for one in trial):
                    continue
                effects = _effects(trial)
                at = numbers + len(zeros)
                windows.zeros = zeros + damping * step[numbers:at] * windows.backlash
                windows.turned = turned.copy()
                for side, records in angles:
                    by = damping * step[at : at + len(records)] * TURNED / STEP
                    windows.turned[records, side] += np.clip(by, -FARTHEST[2], FARTHEST[2])
                    at += len(records)
                tried = windows.moved(starts, left, along.spread, FARTHEST[1])
                new, kept = windows.residuals(effects, tried), windows.residuals(effects)
            except InputError:  # beyond the bounds of a parameter
                windows.zeros, windows.turned = zeros, turned
                continue
            better = windows.level(new) < windows.level(kept)
            windows.starts = tried.where(better, old)
            new = _settled(windows, effects, np.where(better[windows.every[: len(new)]], new, kept))
            if (after := float(np.sum((new * weight) ** 2))) < before:
                causes, rest = trial, new
                break
            windows.starts, windows.zeros, windows.turned = old, zeros, turned
        else:
            break
        if before - after < 1e-4 * before:
            break
    return _state(windows, causes, rest)


def _shortened(causes: Sequence[Cause], step: Array) -> Array:
    """Return a step in units, those of each cause no longer than is allowed and in their direction."""
    made, at = step.copy(), 0
    for cause in causes:
        own = slice(at, at + len(cause.numbers))
        at = own.stop
        made[own] *= FARTHEST[0] / max(float(np.max(np.abs(step[own]))), FARTHEST[0])
    return made


def _scanned(windows: Windows, now: _State) -> _State:
    """Return a state whose last cause has another size, where windows with new starts are nearer to that.

    Starts that follow too small a cause hold it where it is; from new starts another size shows to be better.
    """
    for _ in range(ROUNDS if now.causes[-1].candidate.kind != SCATTER else 0):
        better = None
        for factor in SCAN:
            _restore(windows, now)
            last = now.causes[-1]
            sizes = np.where(np.arange(len(last.numbers)) < (2 if last.candidate.phased else 1), factor, 1.0)
            causes = (*now.causes[:-1], last._replace(numbers=last.numbers * sizes))
            with suppress(InputError):
                effects = _effects(causes)
                windows.restart(effects)
                rest = _settled(windows, effects, windows.residuals(effects))
                tried = _state(windows, causes, rest)
                if _better(windows, better or now, tried)[0] > ACCEPT:
                    better = tried
        if better is None or not SMALLEST < _size(windows, better.causes[-1]) < LARGEST:
            break
        now = better
    _restore(windows, now)
    return now


def _settled(windows: Windows, effects: Sequence[object], rest: Array) -> Array:
    """Move the starts alone to where they leave the least of residuals, and return these."""
    for _ in range(SETTLING):
        along = windows.along(effects)
        tried = windows.moved(along.starts(), rest, along.spread, FARTHEST[1])
        new = windows.residuals(effects, tried)
        better = windows.level(new) < windows.level(rest)
        windows.starts = tried.where(better, windows.starts)
        rest = np.where(better[windows.every[: len(rest)]], new, rest)
    return rest


def _polished(windows: Windows, now: _State, rounds: int = 4) -> _State:
    """Return a state fitted from new starts as long as that makes a difference, windows that part weighted less."""
    for _ in range(2 * rounds if any(cause.free for cause in now.causes) else rounds):  # a shape needs more
        now = _spread(windows, now)
        level = windows.level(now.rest)
        windows.weight = 1.0 / np.sqrt(np.maximum(level / (4.0 * max(float(np.median(level)), 1e-12)), 1.0))
        windows.restart(_effects(now.causes))
        new = _fitted(windows, now)
        before, after = float(np.sum(level)), float(np.sum(windows.level(new.rest)))
        if after >= before:
            _restore(windows, now._replace(weight=windows.weight))
            return now._replace(weight=windows.weight)
        now = new
        if after > 0.99 * before:
            break
    return now


def _scores(
    windows: Windows, known: Sequence[Candidate], now: _State, least: float = ACCEPT
) -> tuple[list[_Score], float]:
    """Return what each candidate promises, most first, and the level of the residuals, without what promises less."""
    few, mine = windows.some(SCORED)
    rest, along = now.rest[mine[: len(now.rest)]], few.along(_effects(now.causes))
    weight = few.weights(rest)
    away = few.without_starts([one * weight for one in along.starts()])
    others = np.column_stack([away(one * weight) for one in _columns(along, now.causes)])
    others = np.linalg.qr(others[:, np.any(others != 0.0, axis=0)])[0]
    left = away(rest * weight)
    left = left - others @ (others.T @ left)
    level = float(left @ left) / max(len(left) - others.shape[1] - 2 * len(few), 1)
    scale, found, asked = len(windows) / len(few), [], []
    turning = _Turning(windows, now.causes)
    record = few.record[few.every[: len(rest)]]
    for one in known:
        if one.kind in (OIL, SCATTER) or not turning.told(one):
            continue
        columns = []
        for k in range(2 if one.phased else 1):
            numbers = np.zeros(2 if one.phased else 1)
            part = one.tried * (1.0 if one.kind == SQUARED else TRIED)
            numbers[k] = part * one.unit
            if one.kind == SQUARED:
                changed = along.rest - few.residuals([*_effects(now.causes), one.effect(numbers)])
            else:
                changed = along.column(one.effect(numbers))
            column = away(changed / part * weight)
            columns.append(column - others @ (others.T @ column))
        normal, right = _by_record(np.column_stack(columns), left, record, len(windows.zeros))
        if np.all(np.isfinite(normal)) and np.trace(normal.sum(axis=0)) > 0.0:
            bound = np.einsum("ki,kij,kj->", right, np.linalg.pinv(normal, rcond=1e-9, hermitian=True), right)
            asked.append((scale * float(bound), one, normal, right))
    asked.sort(key=lambda each: -each[0])
    best: dict[str, float] = {}
    for bound, one, normal, right in asked:  # with a size in each record a candidate gains as much at most
        if bound < max(least * level, best.get(one.kind, 0.0)):
            continue
        gain, units, by = turning.best(one, normal, right)
        if one.kind == SQUARED:
            gain, units = gain * float(units[0] > 0.0), np.sqrt(np.maximum(units, 0.0) * one.tried)
        gain = scale * gain - turning.dear(one) * level
        best[one.kind] = max(best.get(one.kind, 0.0), gain)
        found.append(_Score(gain, one, units, by, scale * float(normal[:, 0, 0].sum())))
    return sorted(found, key=lambda each: -each.gain), level


def _by_record(columns: Array, left: Array, record: Array, count: int) -> tuple[Array, Array]:
    """Return the normal equations of columns in each record, (r, p, p) and (r, p)."""
    parts = [record == k for k in range(count)]
    normal = np.array([columns[one].T @ columns[one] for one in parts])
    return normal, np.array([columns[one].T @ left[one] for one in parts])


class _Turning:
    """How records whose encoders begin anywhere are turned for a candidate.

    Args:
        windows: of the records.
        causes: that are there, by which angles may be aligned already.
    """

    def __init__(self, windows: Windows, causes: Sequence[Cause]) -> None:
        self.windows = windows
        self.orders = {
            gear: [order_of(one.candidate) for one in causes if one.candidate.phased and goes_by(one.candidate) == gear]
            for gear in GEARS
        }

    def _free(self, one: Candidate) -> int:
        """Return how many angles a candidate has beyond one."""
        gear = goes_by(one)
        if not gear or self.orders[gear]:
            return 0
        lost = self.windows.lost[:, GEARS.index(gear)]
        return int(lost.sum()) - bool(np.all(lost))

    def told(self, one: Candidate) -> bool:
        """Return whether a candidate can be asked about: not a tooth, where angles are not aligned."""
        return one.phased or not self._free(one)

    def dear(self, one: Candidate) -> float:
        """Return the chi-square that a candidate must gain more for the angles that it has free."""
        return worth_of(self._free(one))

    def best(self, one: Candidate, normal: Array, right: Array) -> tuple[float, Array, Array]:
        """Return the gain of a candidate, its numbers in units, and by how much records are turned, (r, 2) [rad].

        Args:
            one: the candidate.
            normal: equations of its numbers in each record, (r, p, p).
            right: of the same, (r, p).
        """
        by = np.zeros_like(self.windows.turned)
        gear, order = goes_by(one), order_of(one)
        side = GEARS.index(gear) if gear else 0
        lost = self.windows.lost[:, side]
        known = gcd(*self.orders[gear]) if gear else 0
        if one.phased and known > 1 and order % known and np.any(lost):
            by[:, side] = self._branches(one_size(one, normal, right), lost, 2.0 * pi / known)
            shift = order * by[:, side]
            turned = np.array([[np.cos(shift), np.sin(shift)], [-np.sin(shift), np.cos(shift)]])
            normal, right = (
                np.einsum("ijk,kil,lmk->kjm", turned, normal, turned),
                np.einsum("ijk,ki->kj", turned, right),
            )
        elif one.phased and self._free(one):
            seen = one_size(one, normal, right)
            first = 0 if np.all(lost) else reference(np.where(lost, 0.0, seen.worth))
            away = (seen.phase - seen.phase[first] + pi) % (2.0 * pi) - pi
            by[:, side] = np.where(lost, away / order, 0.0)
            units = seen.size * np.array([np.cos(seen.phase[first]), -np.sin(seen.phase[first])])
            return seen.gain, units, by
        common, pull = normal.sum(axis=0), right.sum(axis=0)
        units = np.linalg.lstsq(common, pull, rcond=1e-10)[0]
        return float(units @ pull), units, by

    @staticmethod
    def _branches(seen: Phases, lost: Array, period: float) -> Array:
        """Return by how many whole periods of orders that are aligned each record is turned [rad], (r,)."""
        own = 2.0 * pi / order_of(seen.candidate)
        first = 0 if np.all(lost) else int(np.argmin(lost))
        away = (seen.phase - seen.phase[first]) / order_of(seen.candidate)
        tried = period * np.arange(round(2.0 * pi / period))
        off = np.abs((tried[None] - away[:, None] + 0.5 * own) % own - 0.5 * own)
        return np.where(lost & (seen.worth > 0.0), tried[np.argmin(off, axis=1)], 0.0)


def _covariance(windows: Windows, now: _State) -> Array:
    """Return the covariance of all numbers: that of least squares, at least as wide as windows scatter [SI], (p, p)."""
    units = np.concatenate([np.zeros(0), *(cause.units for cause in now.causes)])
    if not len(units):
        return np.zeros((0, 0))
    along = windows.along(_effects(now.causes))
    weight = windows.weights(along.rest)
    away = windows.without_starts([one * weight for one in along.starts()])
    own = np.column_stack([away(one * weight) for one in _columns(along, now.causes)])
    rest = away(now.rest * weight)
    inverse = np.linalg.pinv(own.T @ own)
    level = max(float(rest @ rest) / max(len(rest) - own.shape[1] - 2 * len(windows), 1), 1.0)
    every = windows.every[: len(rest)]
    pulls = np.column_stack([np.bincount(every, column * rest, len(windows)) for column in own.T])
    scatter = inverse @ (pulls.T @ pulls) @ inverse
    wide = np.sqrt(np.maximum(np.diag(scatter) / np.maximum(level * np.diag(inverse), 1e-300), 1.0))
    made = (level * inverse * np.outer(wide, wide))[: len(units), : len(units)] * np.outer(units, units)
    kinds = [one.candidate.kind for one in now.causes for _ in one.numbers]
    if SCATTER in kinds and (told := _kicked(windows, now.causes)) is not None:
        at = kinds.index(SCATTER)
        size = now.causes[[one.candidate.kind for one in now.causes].index(SCATTER)].numbers[0]
        made[at, at] = size**2 / (2.0 * max(float(np.sum(told[1] ** 2)), 1e-9))
    return made
