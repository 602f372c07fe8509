"""Candidates of the path search: score tests of effects, a second body on a spring, and scatter of restitution.

Score test: trajectory residuals are regressed on the sensitivity of the motion to a small size of each candidate; the
starts of windows and present causes are nuisance parameters. Two candidates need tests of their own.

Second body on a spring: it is found by the frequency of its twist in flights, where these begin with impacts; otherwise
in beginnings of windows, by fits on a grid of frequencies.

Scatter of restitution: variance of rebounds beyond their errors; those below the detection limit are censored data.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations, product
from math import gcd, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.special import log_ndtr

from gears3d.diagnosis.causes import ACCEPT, ACCEPT_PATH, LARGEST, SMALLEST, Candidate, Cause, begin, goes_by, swings
from gears3d.diagnosis.channels import CensoredImpacts, Impacts
from gears3d.diagnosis.evidence import Evidence, in_gap
from gears3d.diagnosis.path_fit import (
    BODY,
    LAWS,
    OIL,
    RUB,
    SCATTER,
    SOFT,
    SQUARED,
    State,
    columns_of,
    effects_of,
    fall_of,
    fitted,
    followed,
    gain_of,
    nuisances,
    polished,
    restore,
    scanned,
    state_of,
    unknown_datums,
)
from gears3d.diagnosis.prediction import GEARS, restitution
from gears3d.diagnosis.preprocessing import Phases, one_size, order_of, reference, worth_of
from gears3d.diagnosis.shooting import NOISE
from gears3d.errors import InputError

if TYPE_CHECKING:
    from gears3d.diagnosis.shooting import Linearised, Windows

Array = np.ndarray
# Part of the tried size that is the step of a candidate's sensitivities.
SCORE_STEP = 0.2
# Windows of a score test.
SCORED = 32
# Candidates whose sensitivities are whitened together.
BATCH = 32
# Smallest part of a cause's effect that a collinear candidate explains; largest part of the joint effect of several
# causes that fewer may leave, as it is not quite linear; number of candidates of which sets are formed, and of sets
# that are fitted. Chosen on one rig with equal teeth (seed 1 of the benchmark of three causes); 16 candidates have at
# most 2516 sets of four.
ALIKE, NONLINEAR, POOL, SETS = 0.2, 0.02, 16, 2
# Sizes in units at which nonlinear causes are tried: laws of contact, and an offset that keeps the gear from a flank;
# score tests at size 0 have no power for these.
SIZES = {
    OIL: (0.03, 0.06, 0.12, 0.25, 0.5),
    SOFT: (1.6, 2.5, 4.0, 6.3, 10.0, 25.0, 100.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0),
    "backlash_offset": (-0.6, -0.4, -0.25, -0.1, 0.1, 0.25, 0.5, 1.0),
}
# Parts of the critical damping at which compliant teeth are tried; windows in which sizes of laws are tried: all sizes
# in the first, if many, and so many of the best in the second; 12 missed one (space3, 346).
TRIED_DAMPINGS, SAMPLES, TRIED = (0.05, 0.15), (6, 16), 24


class Score(NamedTuple):
    """Score test of a candidate: fall of chi-square, numbers in units, shifts of angular datums [rad].

    Its worth is chi-square over the square of the first number.
    """

    gain: float
    candidate: Candidate
    units: Array
    by: Array
    worth: float


def scores_of(
    windows: Windows, known: Sequence[Candidate], now: State, least: float = ACCEPT_PATH, place: int | None = None
) -> tuple[list[Score], float]:
    """Return the score tests of candidates above a threshold, best first, and the level of the residuals.

    Args:
        windows: of the records.
        known: candidates.
        now: present causes.
        least: threshold of the fall of chi-square over the level.
        place: of a cause that is replaced: candidates are tested along the same trajectory, with its effect removed.
    """
    few, mine = windows.some(SCORED)
    rest, along = now.rest[mine[: len(now.rest)]], few.along(effects_of(now.causes))
    weight, away = few.weights(rest), nuisances(along)
    others = away(np.array([one * weight for one in columns_of(along, now.causes)])).T
    left, causes = away.residuals(rest * weight), list(now.causes)
    if place is not None:
        cause = causes.pop(place)
        at = sum(len(one.numbers) for one in causes[:place])
        size = (cause.numbers / cause.units)[: 2 if cause.candidate.phased else 1]
        own, linear = others[:, at : at + len(size)].T, along.oiled and cause.candidate.kind not in LAWS
        if linear:  # in long windows the response is bent over the steps of a fit
            own = away(along.extended(_own(along, now.causes, cause.candidate)) * weight)
        left = left + size @ own
        kept = [side for side, _ in unknown_datums(few, causes)]
        sides = [side for side, records in unknown_datums(few, now.causes) for _ in records]
        first = others.shape[1] - len(sides)
        gone = [first + k for k, side in enumerate(sides) if side not in kept]  # datums that the cause determines
        others = np.delete(others, [*range(at, at + len(cause.numbers)), *gone], axis=1)
    others = np.linalg.qr(others[:, np.any(others != 0.0, axis=0)])[0]
    left = left - others @ (others.T @ left)
    level = float(left @ left) / max(len(left) - others.shape[1] - 2 * len(few), 1)
    scale, found, asked = len(windows) / len(few), [], []
    datums = _Datums(windows, causes)
    able = [one for one in known if one.kind not in (*LAWS, SCATTER) and datums.testable(one)]
    for one, columns in _effects(along, now.causes, able, lambda rows: away(rows * weight)):
        columns = columns - (columns @ others) @ others.T
        normal, right = _by_record(columns, left, away.record, len(windows.zeros))
        if np.all(np.isfinite(normal)) and np.trace(normal.sum(axis=0)) > 0.0:
            bound = np.einsum("ki,kij,kj->", right, np.linalg.pinv(normal, rcond=1e-9, hermitian=True), right)
            asked.append((scale * float(bound), one, normal, right))
    asked.sort(key=lambda each: -each[0])
    best: dict[tuple[str, str], float] = {}
    for bound, one, normal, right in asked:  # upper bound of the gain: a size in each record
        own = one.kind, goes_by(one)
        if bound < max(least * level, best.get(own, 0.0)):
            continue
        gain, units, by = datums.best(one, normal, right)
        if one.kind == SQUARED:
            gain, units = gain * float(units[0] > 0.0), np.sqrt(np.maximum(units, 0.0) * one.tried)
        gain = scale * gain - datums.penalty(one) * level
        best[own] = max(best.get(own, 0.0), gain)
        found.append(Score(gain, one, units, by, scale * float(normal[:, 0, 0].sum())))
    return sorted(found, key=lambda each: -each.gain), level


def _effects(
    along: Linearised, causes: Sequence[Cause], able: Sequence[Candidate], away: Callable[[Array], Array]
) -> Iterator[tuple[Candidate, Array]]:
    """Yield candidates with the sensitivities of predictions per unit, (p, n), starts projected out."""
    for at in range(0, len(able), BATCH):
        batch = able[at : at + BATCH]
        own = [_own(along, causes, one) for one in batch]
        rows = away(along.extended(np.concatenate(own)))
        yield from zip(batch, np.split(rows, np.cumsum([len(one) for one in own])[:-1]), strict=True)


def _own(along: Linearised, causes: Sequence[Cause], one: Candidate) -> Array:
    """Return the sensitivities of displacements at the readings to the numbers of a candidate, per unit, (p, n)."""
    windows, columns = along.windows, []
    for k in range(2 if one.phased else 1):
        numbers = np.zeros(2 if one.phased else 1)
        part = one.tried * (1.0 if one.kind == SQUARED else SCORE_STEP)
        numbers[k] = part * one.unit
        if one.kind in (SQUARED, RUB) or (along.oiled and "impact" in one.channels):  # no events are kept in oil
            missed = windows.missed([*effects_of(causes), one.effect(numbers)])
            changed = (windows.read - along.run.made - missed) / windows.sigma
        else:
            changed = along.change(one.effect(numbers))
        columns.append(changed / part)
    return np.array(columns)


def fewer(windows: Windows, known: Sequence[Candidate], now: State) -> list[tuple[tuple[Cause, ...], Array]]:
    """Return sets of causes with fewer numbers that are collinear with the present causes, and shifts of datums [rad].

    Several causes may approximate fewer that were not found: a deviation of each gear for an eccentricity. Along one
    trajectory effects are nearly linear in their sizes, so that every small set can be tried by linear regression.

    Args:
        windows: of the records.
        known: candidates.
        now: present causes.

    Returns:
        Of each group of causes collinear with the same candidates, the best sets of one, two and more; and single
        causes of a gear whose angular datums no present cause determines, each with the shifts that it has, (r, 2).
    """
    few, _ = windows.some(SCORED)
    along = few.along(effects_of(now.causes))
    weight, away = few.weights(along.rest), nuisances(along)
    found = away(np.array([one * weight for one in columns_of(along, now.causes)])).T
    ends, count = np.cumsum([0, *(len(one.numbers) for one in now.causes)]), len(windows.zeros)
    zeros, plain = (np.linalg.qr(own[:, np.any(own != 0.0, axis=0)])[0]
                    for own in (found[:, ends[-1] :], found[:, ends[-1] : ends[-1] + count]))  # fmt: skip
    effects = []
    for one, at in zip(now.causes, ends, strict=False):
        size = (one.numbers / one.units)[: 2 if one.candidate.phased else 1]
        effects.append(found[:, at : at + len(size)] @ size)
    done = [column - zeros @ (zeros.T @ column) for column in effects]
    datums, able, columns, free = _Datums(windows, now.causes), [], [], []
    asked = [one for one in known if one.kind not in (*LAWS, SCATTER, SQUARED) and datums.testable(one)]
    for one, rows in _effects(along, now.causes, asked, lambda rows: away(rows * weight)):
        own = rows - (rows @ zeros) @ zeros.T
        if not np.all(np.isfinite(own)) or not np.any(own):
            continue
        if datums.fixed(one):
            able.append(one)
            columns.append(own.T)
        elif one.phased and not datums.orders[goes_by(one)]:
            free.append((one, rows - (rows @ plain) @ plain.T))
    alike = np.array([[_share(own, column) for own in columns] for column in done]).reshape(len(done), len(able))
    made, still = [], np.zeros_like(windows.turned)
    for group in _groups(alike > ALIKE):
        numbers = sum(len(now.causes[k].numbers) for k in group)
        pool = np.argsort(-np.max(alike[group], axis=0))[:POOL]
        pool = [int(k) for k in pool if np.max(alike[group, k]) > ALIKE]
        rest = tuple(one for k, one in enumerate(now.causes) if k not in group)
        for own, units in _sets(
            [columns[k] for k in pool], np.sum([done[k] for k in group], axis=0), numbers, len(group)
        ):
            causes = [begin(able[pool[k]], one) for k, one in zip(own, units, strict=True)]
            made.append(((*rest, *causes), still))
        whole, single = np.sum([effects[k] for k in group], axis=0), []
        whole = whole - plain @ (plain.T @ whole)
        for one, own in free if numbers > 2 else ():
            gain, units, by = datums.best(one, *_by_record(own, whole, away.record, count))
            if gain > (1.0 - NONLINEAR) * float(whole @ whole) and SMALLEST < np.hypot.reduce(units) < LARGEST:
                single.append((gain, ((*rest, begin(one, units)), by)))
        made += [one for _, one in sorted(single, key=lambda each: -each[0])[:SETS]]
    return made


class Sized:
    """A law of contact, or an offset of the backlash, at the best of the sizes at which it is tried.

    Args:
        start: state of windows without it.
        best: the same with it, in a sample of these windows; fitted, in two rounds, only with other causes.
        gain: fall of chi-square in windows.
        left: part of the usual residual of the sample that it leaves.
    """

    def __init__(self, start: State, best: State, gain: float, left: float) -> None:
        self.gain, self.left, self._start, self._best = gain, left, start, best
        self._made: list[State] | None = None

    def fitted(self, windows: Windows) -> list[State]:
        """Return its state fitted to windows; none where a rig cannot have it. The fit is made once."""
        if self._made is None:
            self._made, causes = [], self._best.causes
            restore(windows, self._start)
            windows.zeros = self._best.zeros.copy()
            with suppress(InputError):
                windows.restart(effects_of(causes))
                one = fitted(windows, state_of(windows, causes, windows.residuals(effects_of(causes))))
                self._made = [polished(windows, scanned(windows, polished(windows, one)), thorough=True)]
        return self._made


def sized(windows: Windows, known: Sequence[Candidate], now: State, start: State) -> list[Sized]:
    """Return laws of contact, and an offset of the backlash, in addition to a state, each at its best size.

    Args:
        windows: of the records.
        known: candidates.
        now: state with which they are compared.
        start: state to which they are added.
    """
    made, there = [], {one.candidate.kind for one in start.causes}
    there |= set(LAWS) if there & set(LAWS) else set()
    for law in (one for one in known if one.kind in SIZES and one.kind not in there):
        restore(windows, start)
        asked = trials(windows, law, windows.zeros)
        for most in SAMPLES[len(asked) <= TRIED :]:
            few, mine = windows.some(most)
            before = now.rest[mine[: len(now.rest)]]
            tries = [_at_size(few, start, cause, datums) for cause, datums in asked]
            falls = [fall_of(few, before, one.rest)[0] for one in tries]
            order = np.argsort(falls)[: -TRIED - 1 : -1]
            asked, tries = [asked[k] for k in order], [tries[k] for k in order]
        if law.kind in LAWS and (start.causes or few.usual(before) < NOISE):  # others, or starts, stood for a part
            for k, one in enumerate(tries):
                restore(few, one)
                tries[k] = fitted(few, one, 2)
        gain, k = max((fall_of(few, before, one.rest)[0], k) for k, one in enumerate(tries))
        left = few.usual(tries[k].rest) / max(few.usual(before), 1e-12)
        made.append(Sized(start, tries[k], gain * len(windows) / len(few), left))
    return made


def _at_size(few: Windows, start: State, cause: Cause, datums: Array) -> State:
    """Return a state with one more cause, whose numbers are not fitted."""
    causes = (*start.causes, cause)
    few.zeros, few.turned, effects = datums.copy(), start.turned.copy(), effects_of(causes)
    for _ in range(2):  # oil or compliant teeth shift the datum that rigid dry flanks have
        few.restart(effects)
        missed = few.missed(effects)
        for k in range(len(datums)):
            own = few.record[few.window] == k
            few.zeros[k] += float(np.median(missed[own])) if np.any(own) else 0.0
    return state_of(few, causes, few.residuals(effects))


def trials(windows: Windows, law: Candidate, zeros: Array) -> list[tuple[Cause, Array]]:
    """Return a law at each size at which it is tried, with datums: those of rigid flanks, and of steady contact.

    In steady contact the mean displacement of compliant teeth is their deflection by the drag.
    """
    if law.kind != SOFT:
        return [(begin(law, np.array([size])), zeros.copy()) for size in SIZES[law.kind]]
    record, mass = windows.record[windows.window], windows.values.inertia / windows.values.base_radius_loose**2
    means = [np.mean(windows.read[record == k]) if np.any(record == k) else zero for k, zero in enumerate(zeros)]
    logarithm = -float(np.log(np.clip(windows.values.restitution, 0.05, 0.95)))
    own = logarithm / float(np.hypot(np.pi, logarithm))  # damping ratio of a linear spring with the rig's restitution
    made, load = [], windows.values.drag_torque / windows.radii[1]
    for size, ratio in product(SIZES[SOFT], (*TRIED_DAMPINGS, own)):
        shape = {"damping": 2.0 * ratio * float(np.sqrt(size * law.unit * mass))}
        cause = begin(law._replace(shape=shape), np.array([size]))
        made += [(cause, zeros.copy()), (cause, np.array(means) + load / float(cause.numbers[0]))]
    return made


def _share(own: Array, column: Array) -> float:
    """Return the part of the square of a column that others explain."""
    return float(np.sum((np.linalg.qr(own)[0].T @ column) ** 2) / max(float(column @ column), 1e-300))


def _groups(alike: Array) -> list[list[int]]:
    """Return groups of two or more causes collinear with the same candidates, by a table, (causes, candidates)."""
    joined = alike.astype(int) @ alike.T.astype(int) > 0
    groups: list[list[int]] = []
    left = set(range(len(alike)))
    while left:
        group, more = set(), {min(left)}
        while more:
            group |= more
            more = {int(k) for one in more for k in np.flatnonzero(joined[one])} - group
        left -= group
        if len(group) > 1:
            groups.append(sorted(group))
    return groups


def _sets(columns: Sequence[Array], whole: Array, numbers: int, most: int) -> list[tuple[tuple[int, ...], list[Array]]]:
    """Return the best sets of columns, of fewer numbers, that explain nearly all of another, with their numbers."""
    ends = np.cumsum([0, *(one.shape[1] for one in columns)])
    table = np.column_stack(columns)
    normal, right, total = table.T @ table, table.T @ whole, float(whole @ whole)
    made = []
    for count in range(1, most + 1):
        good = []
        for own in combinations(range(len(columns)), count):
            at = np.concatenate([np.arange(ends[k], ends[k + 1]) for k in own])
            if len(at) >= numbers:
                continue
            units = np.linalg.lstsq(normal[np.ix_(at, at)], right[at], rcond=1e-9)[0]
            left = 1.0 - float(units @ right[at]) / total
            parts = np.split(units, np.cumsum([columns[k].shape[1] for k in own])[:-1])
            if left < NONLINEAR and all(SMALLEST < np.hypot.reduce(one) < LARGEST for one in parts):
                good.append((left, own, parts))
        made += [(own, parts) for _, own, parts in sorted(good, key=lambda one: one[0])[:SETS]]
    return made


def _by_record(columns: Array, left: Array, record: Array, count: int) -> tuple[Array, Array]:
    """Return the normal equations of columns, (p, n), in each record, (r, p, p) and (r, p)."""
    normal = [[np.bincount(record, one * other, count) for other in columns] for one in columns]
    right = [np.bincount(record, one * left, count) for one in columns]
    return np.array(normal).transpose(2, 0, 1), np.array(right).T


class _Datums:
    """Angular datums of records without index marks, as nuisance parameters of a candidate.

    Args:
        windows: of the records.
        causes: present ones, which may have aligned the datums.
    """

    def __init__(self, windows: Windows, causes: Sequence[Cause]) -> None:
        self.windows = windows
        self.orders = {
            gear: [order_of(one.candidate) for one in causes if one.candidate.phased and goes_by(one.candidate) == gear]
            for gear in GEARS
        }

    def _free(self, one: Candidate) -> int:
        """Return the number of unknown datums of a candidate beyond the first."""
        gear = goes_by(one)
        if not gear or self.orders[gear]:
            return 0
        lost = self.windows.lost[:, GEARS.index(gear)]
        return int(lost.sum()) - bool(np.all(lost))

    def testable(self, one: Candidate) -> bool:
        """Return whether a candidate can be tested: not a single tooth, where datums are unknown."""
        return one.phased or not self._free(one)

    def fixed(self, one: Candidate) -> bool:
        """Return whether the datums of a candidate are known, or those of the present causes, in all records."""
        gear = goes_by(one)
        if not gear or not np.any(self.windows.lost[:, GEARS.index(gear)]):
            return True
        return not self._free(one) and order_of(one) % max(gcd(*self.orders[gear]), 1) == 0

    def penalty(self, one: Candidate) -> float:
        """Return the chi-square that a candidate must gain in addition for its unknown datums."""
        return worth_of(self._free(one))

    def best(self, one: Candidate, normal: Array, right: Array) -> tuple[float, Array, Array]:
        """Return the gain of a candidate, its numbers in units, and the shifts of angular datums, (r, 2) [rad].

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
        """Return the shift of each record by whole periods of the aligned orders [rad], (r,)."""
        own = 2.0 * pi / order_of(seen.candidate)
        first = 0 if np.all(lost) else int(np.argmin(lost))
        away = (seen.phase - seen.phase[first]) / order_of(seen.candidate)
        tried = period * np.arange(round(2.0 * pi / period))
        off = np.abs((tried[None] - away[:, None] + 0.5 * own) % own - 0.5 * own)
        return np.where(lost & (seen.worth > 0.0), tried[np.argmin(off, axis=1)], 0.0)


# Windows of the fits of a second body; part of them whose first flight may be shorter than the first fit; ratio of
# neighbouring frequencies of the grid: in three rigs, fits from within 10 % converged to the hidden one.
BODY_WINDOWS, FLYING, DENSE = 12, 0.25, 1.1
# Neighbours of a frequency found in flights from which fits begin as well: the initial inertia may be wrong.
NEIGHBOURS = (-2, -1, 0, 1, 2)
# Lowest frequency of the grid, and highest that nodes resolve, in periods per fall across the backlash.
LONGEST, SHORTEST = 0.7, 14.0
# Length of windows in the first fits, relative to the first flight, and ratio of lengths of later fits; fits that are
# kept after the first, and smallest relative difference of distinct frequencies.
FARTHER, KEPT, SAME = (2.2, 1.4), 4, 3e-3
# Largest part of chi-square in beginnings of windows that the best body may leave, for fits in longer ones.
HELPS = 0.5
# Initial inertia relative to that of the gear, damping ratio, and rounds of the first fits.
FIRST, DAMPING, SHORT = 0.2, 0.05, 4
# Initial plays, in backlashes, and smallest initial damping of a body with play, relative to that tried without.
PLAYS, LEAST = (0.03, 0.1, 0.3), 0.2


def _flight(windows: Windows) -> float:
    """Return the part of windows, from their beginning, in which most are in their first flight."""
    ends = np.ones(len(windows))
    share, met = (windows.node + windows.beyond) / (windows.drive[0].shape[1] - 1), ~in_gap(windows)
    np.minimum.at(ends, windows.window[met], share[met])
    return float(np.quantile(ends, FLYING))


def carrying(windows: Windows, turns: Sequence[float], now: State, start: State) -> State:
    """Return a state of a sample of windows with a second body, of the frequency with least residuals.

    Args:
        windows: sample.
        turns: frequencies that are tried [rad/s]; without any, a grid up to those that nodes resolve.
        now: state of the sample, with its datums and starts.
        start: causes to start with.
    """
    restore(windows, now)
    few = windows.some(BODY_WINDOWS)[0]
    few.zeros, few.weight = windows.guessed.copy(), np.ones(len(few))
    own, cycle = windows.values.inertia, 2.0 * pi / windows.fall
    law = Candidate(BODY, {}, "inertia", own, False, ())
    flight = _flight(few)
    falls = _short_fit(few.until(flight), start.causes, _cause(law, SHORTEST / 2.0 * cycle, FIRST), anew=True)
    size = float(falls.causes[-1].numbers[0]) / own
    grid = cycle * LONGEST * DENSE ** np.arange(int(np.log(SHORTEST / LONGEST) / np.log(DENSE)) + 1)
    near = [turn * DENSE**k for turn in turns for k in NEIGHBOURS]
    reach = FARTHER[0] * flight
    part = few.until(reach) if reach < 1.0 else few
    found = [_short_fit(part, falls.causes[:-1], _cause(law, turn, size), SHORT) for turn in near or grid.tolist()]
    found = _distinct(part, found)
    less = _longer(part, falls._replace(causes=falls.causes[:-1]))
    if not part.usual(found[0].rest) < HELPS * part.usual(less.rest):
        restore(windows, now)
        return now
    while part is not few:
        reach *= FARTHER[1]
        part = few.until(reach) if reach < 1.0 else few
        found = [_longer(part, one) for one in found]
    best = min(found, key=lambda one: few.usual(one.rest))
    restore(windows, now)
    windows.zeros, windows.weight = best.zeros.copy(), np.ones(len(windows))
    return _longer(windows, best)


def _distinct(windows: Windows, tries: Sequence[State]) -> list[State]:
    """Return the best states of distinct frequencies."""
    made: list[State] = []
    for one in sorted(tries, key=lambda one: windows.usual(one.rest)):
        turn = swings(one.causes[-1])[0]
        if all(abs(turn / swings(other.causes[-1])[0] - 1.0) > SAME for other in made):
            made.append(one)
    return made[:KEPT]


def _cause(law: Candidate, turn: float, size: float) -> Cause:
    """Return a second body of a natural frequency [rad/s] and an inertia relative to that of the gear."""
    per = (1.0 + 1.0 / size) / law.unit
    shape = {"stiffness": turn**2 / per, "damping": 2.0 * DAMPING * turn / per}
    return begin(law._replace(shape=shape), np.array([size]))


def _short_fit(part: Windows, causes: Sequence[Cause], cause: Cause, rounds: int = 8, *, anew: bool = False) -> State:
    """Return a fit with one more cause in the beginnings of windows."""
    every = (*causes, cause)
    zeros, starts = part.zeros.copy(), part.starts
    part.restart(effects_of(every), anew=anew)
    made = fitted(part, state_of(part, every, part.residuals(effects_of(every))), rounds)
    part.zeros, part.starts = zeros, starts
    return made


def _longer(part: Windows, now: State) -> State:
    """Return a fit in windows of another length, or other windows, with starts fitted to their readings."""
    part.zeros, part.turned, part.weight = now.zeros.copy(), now.turned.copy(), np.ones(len(part))
    if len(part) == len(now.starts.place):
        part.starts = now.starts
    effects = effects_of(now.causes)
    part.restart(effects)
    rest = followed(part, effects, part.residuals(effects))
    return fitted(part, state_of(part, now.causes, rest))


def playing(windows: Windows, now: State, least: float) -> State:
    """Return a state whose last cause, a second body, has play, where that gains enough."""
    if not now.causes or now.causes[-1].candidate.kind != BODY:  # no second body
        return now
    best = now
    for part in PLAYS if windows.usual(now.rest) > NOISE else ():
        restore(windows, now)
        tried = polished(windows, _longer(windows, now._replace(causes=(*now.causes[:-1], _loose(windows, now, part)))))
        if gain_of(windows, best, tried)[0] > least:
            best = tried
    restore(windows, best)
    return best


def _loose(windows: Windows, now: State, part: float) -> Cause:
    """Return the last cause, a second body, with a play that is a part of the backlash."""
    cause = now.causes[-1]
    damping = max(float(cause.numbers[2]), LEAST * cause.candidate.shape["damping"])
    shape = {"stiffness": float(np.exp(cause.numbers[1])), "damping": damping}
    shape["play"] = part * windows.backlash / windows.radii[1]
    return begin(cause.candidate._replace(shape=shape), cause.numbers[:1] / cause.candidate.unit)


# Minimum number of rebounds.
FEWEST_REBOUNDS = 20
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
    if np.sum(every.seen) < FEWEST_REBOUNDS:
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
    if np.sum(every.seen) < FEWEST_REBOUNDS:
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
