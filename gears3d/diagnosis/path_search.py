"""Which causes make the path itself come true: score tests and refits in windows of all records.

What flights, contacts and impacts say one by one depends on where records were cut; the path does not. Each candidate
is tried by how residuals of readings change with its size, what starts and zeros explain taken out; the best are
fitted, the best of these is taken, and every cause is tested again without it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.diagnosis.cause import Cause, begin
from gears3d.diagnosis.library import price
from gears3d.diagnosis.shooting import Linearised, Starts, Windows
from gears3d.effects import SensorEffect
from gears3d.errors import InputError

if TYPE_CHECKING:
    from gears3d.diagnosis.candidates import Candidate

Array = np.ndarray
ACCEPT = 40.0
"""Fall of chi-square over its level that a cause must bring: by chance, among three thousand numbers, in 1e-6."""
STEADY = 5.0
"""Standard errors, by the scatter over windows, that this fall must differ from none by."""
SMALLEST, LARGEST = 0.01, 3.0
"""Sizes in units between which a cause is one: smaller ones come from how the drive's motion is smoothed."""
STEP = 1e-3
"""Of a number in units, for slopes at a fit."""
TRIED = 0.2
"""Part of the size at which candidates have their columns."""
SCORED = 32
"""Windows in which candidates are scored."""
NEAR = 0.1
"""Part of the best score that a candidate needs to be fitted."""
FITTED, POLISHED = 7, 5
"""Candidates that are fitted in a round, and those of them that are fitted with new starts."""
SAME = 0.01
"""Part of what a cause explains by which another must explain less, too, to be excluded: the rest is the model's."""
AGREES = 9.0
"""The same of a cause that was found otherwise: three standard deviations, at a size that is known beforehand."""
EXCLUDED = 16.0
"""Chi-square over the level by which another cause must be worse to be excluded: four standard deviations."""
ROUNDS = 8
"""Causes at most, and rounds of Gauss-Newton."""
FARTHEST = (0.5, 0.2)
"""Units that numbers and starts move in a round at most."""
DAMPED = (1.0, 0.3, 0.1)
"""Parts of a step that are tried."""
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
        others: what was tried in the place of each cause, with the chi-square over the level by which it is worse.
        first: usual mean square with the causes that were found otherwise; infinite where they cannot be fitted.
    """

    causes: tuple[Cause, ...]
    covariance: Array
    gains: Array
    before: float
    after: float
    missed: float
    windows: int
    others: tuple[tuple[tuple[Cause, float], ...], ...]
    first: float


class _State(NamedTuple):
    """Causes, the residuals that they leave, and the windows' starts, zeros and weights with them."""

    causes: tuple[Cause, ...]
    rest: Array
    starts: Starts
    zeros: Array
    weight: Array


def path_search(
    windows: Windows,
    known: Sequence[Candidate],
    first: Sequence[Cause] = (),
    told: Callable[[float], None] = lambda part: None,
) -> Path | None:
    """Return the causes that make the path come true; ``None`` where there are too few windows.

    Args:
        windows: of the records.
        known: candidates.
        first: causes that were found otherwise, tried against those found here.
        told: called with the part that is done.
    """
    if len(windows) < SCORED // 4:
        return None
    base = _polished(windows, _opened(windows))
    tried: dict[str, list[_State]] = {}
    found = _searched(windows, known, base, tried, told)
    theirs = np.inf
    if first and (other := _other(windows, base, first)) is not None:
        theirs = float(np.median(windows.level(other.rest)))
        other = _searched(windows, known, _pruned(windows, other), tried, told)
        if _better(windows, found.rest, other.rest)[0] > ACCEPT:
            found = other
    for cause in first:
        found = _with_agreeing(windows, found, cause)
    _restore(windows, found)
    gains, others = [], []
    for k in range(len(found.causes)):
        less = _polished(windows, _fitted(windows, _without(found, k)))
        gains.append(_better(windows, less.rest, found.rest)[0])
        worse = [
            (one.causes[-1], _better(windows, one.rest, found.rest)[0])
            for one in tried.get(found.causes[k].candidate.kind, ())
            if len(one.causes) == len(found.causes)
        ]
        others.append(tuple(worse))
        _restore(windows, found)
    level = windows.level(found.rest)
    usual = windows.level(found.rest * windows.sigma)
    return Path(
        found.causes, _covariance(windows, found), np.array(gains), float(np.median(windows.level(base.rest))),
        float(np.median(level)), float(np.sqrt(np.median(usual))), len(windows), tuple(others), theirs,
    )  # fmt: skip


def _opened(windows: Windows) -> _State:
    windows.restart((), anew=True)
    return _fitted(windows, _state(windows, (), windows.residuals(())))


def _state(windows: Windows, causes: Sequence[Cause], rest: Array) -> _State:
    return _State(tuple(causes), rest, windows.starts, windows.zeros.copy(), windows.weight.copy())


def _restore(windows: Windows, state: _State) -> None:
    windows.starts, windows.zeros, windows.weight = state.starts, state.zeros.copy(), state.weight.copy()


def _effects(causes: Sequence[Cause]) -> list[object]:
    return [one for one in (cause.effect for cause in causes) if one is not None]


def _other(windows: Windows, base: _State, causes: Sequence[Cause]) -> _State | None:
    """Return causes that were found otherwise, fitted to the path; ``None`` where they cannot be."""
    try:
        _restore(windows, base)
        rest = windows.residuals(_effects(causes))
        return _polished(windows, _fitted(windows, _state(windows, causes, rest)))
    except InputError:
        return None


def _with_agreeing(windows: Windows, found: _State, cause: Cause) -> _State:
    """Return a state with a cause that was found otherwise, where the path is too short for it but does not refute it.

    All of a record shows less than its windows can; a number that the path has as well within its own error stands.
    """
    if any(one.candidate.kind == cause.candidate.kind for one in found.causes) or not _size(cause) > SMALLEST:
        return found
    _restore(windows, found)
    try:
        more = _fitted(windows, found._replace(causes=(*found.causes, cause)))
    except InputError:
        return found
    own = slice(-len(cause.numbers), None)
    apart = more.causes[-1].numbers - cause.numbers
    sigma = np.sqrt(np.diag(_covariance(windows, more))[own])
    return more if np.all(np.abs(apart) < 3.0 * sigma) and _size(more.causes[-1]) > SMALLEST else found


def _searched(
    windows: Windows, known: Sequence[Candidate], now: _State, tried: dict[str, list[_State]],
    told: Callable[[float], None],
) -> _State:  # fmt: skip
    """Return a state with causes added one after the other, as long as they gain."""
    for number in range(ROUNDS):
        told(number / ROUNDS)
        _restore(windows, now)
        tries = []
        for one in _fits(windows, known, now):
            _restore(windows, one)
            tries.append(_polished(windows, _scanned(windows, _polished(windows, one))))
        best = _simplest(windows, now, tries)
        if best is None or not SMALLEST < _size(best.causes[-1]) < LARGEST or not _pays(windows, now, best):
            break
        tried[best.causes[-1].candidate.kind] = [one for one in tries if one is not best]
        now = _pruned(windows, best)
    _restore(windows, now)
    return now


def _pays(windows: Windows, less: _State, more: _State) -> bool:
    gain, sure = _better(windows, less.rest, more.rest)
    return gain > ACCEPT and sure > STEADY


def _better(windows: Windows, less: Array, more: Array) -> tuple[float, float]:
    """Return by how much chi-square falls, over the level of the better residuals, and how sure that is by windows.

    What keeps its sign for some readings counts as one reading.
    """
    a, b = windows.level(less), windows.level(more)
    level = max(float(np.median(b)), 1e-12)
    most = FAR * level + float(np.median(a))
    fall = (np.minimum(a, most) - np.minimum(b, most)) * np.bincount(windows.window, minlength=len(windows))
    return float(fall.sum()) / (level * windows.runs(more)), float(
        fall.mean() / (fall.std() / np.sqrt(len(fall)) + 1e-30)
    )


def _simplest(windows: Windows, now: _State, tries: Sequence[_State]) -> _State | None:
    """Return the simplest of those that the best does not exclude: of fewest numbers, gears before sensors."""
    if not tries:
        return None
    best = tries[0]
    for one in tries[1:]:
        if _better(windows, best.rest, one.rest)[0] > 0.0:
            best = one
    least = max(EXCLUDED, SAME * _better(windows, now.rest, best.rest)[0])
    able = [one for one in tries if one is best or _better(windows, one.rest, best.rest)[0] < least]

    def simple(one: _State) -> tuple[int, float, bool, bool]:
        last = one.causes[-1]
        return len(last.numbers), price(last.candidate), isinstance(last.effect, SensorEffect), one is not best

    return min(able, key=simple)


def _size(cause: Cause) -> float:
    """Return the size of a cause in its units."""
    return float(np.hypot.reduce(cause.numbers[: 2 if cause.candidate.phased else 1])) / cause.candidate.unit


def _without(state: _State, k: int) -> _State:
    return state._replace(causes=state.causes[:k] + state.causes[k + 1 :])


def _pruned(windows: Windows, now: _State) -> _State:
    """Return a state without causes that the others make needless."""
    k = 0
    while k < len(now.causes) and len(now.causes) > 1:
        _restore(windows, now)
        less = _polished(windows, _fitted(windows, _without(now, k)))
        if SMALLEST < _size(now.causes[k]) < LARGEST and _pays(windows, less, now):
            k += 1
        else:
            now, k = less, 0
    _restore(windows, now)
    return now


def _fits(windows: Windows, known: Sequence[Candidate], now: _State) -> list[_State]:
    """Return the best candidates of each kind, fitted together with the causes, best first."""
    scores, level = _scores(windows, known, now)
    able = [one for one in scores if np.hypot.reduce(one[2]) > 0.5 * SMALLEST and one[0] > ACCEPT * level]
    there = {(one.candidate.kind, str(one.candidate.shape)) for one in now.causes}
    made, kinds = [], set()
    for gain, one, units in able:
        if gain < NEAR * able[0][0] or len(made) >= FITTED:
            break
        if one.kind in kinds or (one.kind, str(one.shape)) in there:
            continue
        kinds.add(one.kind)
        _restore(windows, now)
        with suppress(InputError):
            cause = begin(one, np.clip(units, -FARTHEST[0], FARTHEST[0]))
            fit = _fitted(windows, now._replace(causes=(*now.causes, cause)))
            if fit.causes[-1].possible:
                made.append(fit)
    weight = now.weight[windows.window]
    return sorted(made, key=lambda one: float(np.sum((one.rest * weight) ** 2)))[:POLISHED]


def _columns(along: Linearised, causes: Sequence[Cause]) -> list[Array]:
    """Return how predictions change with each number of causes, and with each zero, per unit, (n,) each."""
    windows, columns = along.windows, []
    for cause in causes:
        for j, unit in enumerate(cause.units):
            numbers = cause.numbers.copy()
            numbers[j] += STEP * unit
            columns.append(along.column(cause._replace(numbers=numbers).effect, cause.effect) / STEP)
    record = windows.record[windows.window]
    columns += [(record == k) / windows.sigma * windows.backlash for k in range(len(windows.zeros))]
    return columns


def _fitted(windows: Windows, now: _State, rounds: int = ROUNDS) -> _State:
    """Return causes, zeros and starts with the numbers that leave the least chi-square, by Gauss-Newton."""
    causes = tuple(now.causes)
    weight = windows.weight[windows.window]
    for _ in range(rounds):
        along = windows.along(_effects(causes))
        rest = along.rest
        starts = tuple(one * weight for one in along.starts())
        columns = np.column_stack([one * weight for one in _columns(along, causes)])
        away = windows.without_starts((starts[0], starts[1]))
        own = np.column_stack([away(column) for column in columns.T])
        step = np.linalg.lstsq(own, away(rest * weight), rcond=1e-9)[0]
        numbers = len(step) - len(windows.zeros)
        step[:numbers] = np.clip(step[:numbers], -FARTHEST[0], FARTHEST[0])
        before, zeros, old = float(np.sum((rest * weight) ** 2)), windows.zeros, windows.starts
        for damping in DAMPED:
            moved, at = [], 0
            for cause in causes:
                part = damping * step[at : at + len(cause.numbers)]
                moved.append(cause._replace(numbers=cause.numbers + part * cause.units))
                at += len(cause.numbers)
            left = rest * weight - columns @ (damping * step)
            try:
                effects = _effects(moved)
                windows.zeros = zeros + damping * step[numbers:] * windows.backlash
                tried = windows.moved((starts[0], starts[1]), left, FARTHEST[1])
                new, kept = windows.residuals(effects, tried), windows.residuals(effects)
            except InputError:  # beyond the bounds of a parameter
                windows.zeros = zeros
                continue
            better = windows.level(new) < windows.level(kept)
            windows.starts = Starts(*(np.where(better, a, b) for a, b in zip(tried, old, strict=True)))
            new = _settled(windows, effects, np.where(better[windows.window], new, kept))
            if (after := float(np.sum((new * weight) ** 2))) < before:
                causes, rest = tuple(moved), new
                break
            windows.starts = old
            windows.zeros = zeros
        else:
            break
        if before - after < 1e-4 * before:
            break
    return _state(windows, causes, rest)


def _scanned(windows: Windows, now: _State) -> _State:
    """Return a state whose last cause has another size, where windows with new starts are nearer to that.

    Starts that follow too small a cause hold it where it is; from new starts another size shows to be better.
    """
    for _ in range(ROUNDS):
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
                if _better(windows, (better or now).rest, rest)[0] > ACCEPT:
                    better = _state(windows, causes, rest)
        if better is None or not SMALLEST < _size(better.causes[-1]) < LARGEST:
            break
        now = better
    _restore(windows, now)
    return now


def _settled(windows: Windows, effects: Sequence[object], rest: Array) -> Array:
    """Move the starts alone to where they leave the least of residuals, and return these."""
    for _ in range(SETTLING):
        tried = windows.moved(windows.along(effects).starts(), rest, FARTHEST[1])
        new = windows.residuals(effects, tried)
        better = windows.level(new) < windows.level(rest)
        windows.starts = Starts(*(np.where(better, a, b) for a, b in zip(tried, windows.starts, strict=True)))
        rest = np.where(better[windows.window], new, rest)
    return rest


def _polished(windows: Windows, now: _State, rounds: int = 4) -> _State:
    """Return a state fitted from new starts as long as that makes a difference, windows that part weighted less."""
    for _ in range(rounds):
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
    windows: Windows, known: Sequence[Candidate], now: _State
) -> tuple[list[tuple[float, Candidate, Array]], float]:
    """Return the fall of chi-square that each candidate promises, with its numbers in units, and the level."""
    few, mine = windows.some(SCORED)
    rest, along, weight = now.rest[mine], few.along(_effects(now.causes)), few.weight[few.window]
    starts = tuple(one * weight for one in along.starts())
    away = few.without_starts((starts[0], starts[1]))
    others = np.column_stack([away(one * weight) for one in _columns(along, now.causes)])
    others = np.linalg.qr(others[:, np.any(others != 0.0, axis=0)])[0]
    left = away(rest * weight)
    left = left - others @ (others.T @ left)
    level = float(left @ left) / max(len(left) - others.shape[1] - 2 * len(few), 1)
    scale, found = len(windows) / len(few), []
    for one in known:
        columns = []
        for k in range(2 if one.phased else 1):
            numbers = np.zeros(2 if one.phased else 1)
            numbers[k] = TRIED * one.tried * one.unit
            column = away(along.column(one.effect(numbers)) / (TRIED * one.tried) * weight)
            columns.append(column - others @ (others.T @ column))
        both = np.column_stack(columns)
        normal, right = both.T @ both, both.T @ left
        if np.all(np.isfinite(normal)) and np.trace(normal) > 0.0:
            units = np.linalg.lstsq(normal, right, rcond=1e-10)[0]
            found.append((scale * float(units @ right), one, units))
    return sorted(found, key=lambda each: -each[0]), level


def _covariance(windows: Windows, now: _State) -> Array:
    """Return the covariance of all numbers: that of least squares, at least as wide as windows scatter [SI], (p, p)."""
    units = np.concatenate([np.zeros(0), *(cause.units for cause in now.causes)])
    if not len(units):
        return np.zeros((0, 0))
    weight = windows.weight[windows.window]
    along = windows.along(_effects(now.causes))
    starts = tuple(one * weight for one in along.starts())
    away = windows.without_starts((starts[0], starts[1]))
    own = np.column_stack([away(one * weight) for one in _columns(along, now.causes)])
    rest = away(now.rest * weight)
    inverse = np.linalg.pinv(own.T @ own)
    level = max(float(rest @ rest) / max(len(rest) - own.shape[1] - 2 * len(windows), 1), 1.0)
    pulls = np.column_stack([np.bincount(windows.window, column * rest, len(windows)) for column in own.T])
    scatter = inverse @ (pulls.T @ pulls) @ inverse
    wide = np.sqrt(np.maximum(np.diag(scatter) / np.maximum(level * np.diag(inverse), 1e-300), 1.0))
    return (level * inverse * np.outer(wide, wide))[: len(units), : len(units)] * np.outer(units, units)
