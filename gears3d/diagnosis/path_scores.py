"""What each candidate promises: how residuals of readings change with its size, without what starts explain."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from math import gcd, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import ACCEPT_PATH, LARGEST, SMALLEST, begin, goes_by
from gears3d.diagnosis.datums import Phases, one_size, order_of, reference, worth_of
from gears3d.diagnosis.path_fit import (
    LAWS,
    RUB,
    SCATTER,
    SQUARED,
    State,
    columns_of,
    effects_of,
)
from gears3d.diagnosis.prediction import GEARS

if TYPE_CHECKING:
    from gears3d.diagnosis.causes import Candidate, Cause
    from gears3d.diagnosis.shooting import Linearised, Windows

Array = np.ndarray
TRIED = 0.2
"""Part of the size at which candidates have their columns."""
SCORED = 32
"""Windows in which candidates are scored."""
BATCH = 32
"""Candidates whose columns are made white together."""
ALIKE, MISSED, POOL, SETS = 0.2, 0.02, 16, 2
"""Part of a cause's effect that a candidate must have to look like it; part of the effect of several that fewer may
miss, for it is not quite linear in their sizes; candidates from which sets are taken, and sets that are fitted.
Chosen on one rig of equal teeth (seed 1 of the benchmark of three causes); 16 candidates have 2516 sets of four at
most."""


class Score(NamedTuple):
    """What a candidate promises: fall of chi-square, its numbers in units, how records are turned for it [rad].

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
    """Return what each candidate promises, most first, and the level of the residuals, without what promises less.

    Args:
        windows: of the records.
        known: candidates.
        now: causes so far.
        least: fall of chi-square over the level that a candidate must promise.
        place: of a cause in the place of which candidates are asked about: along the same path, without its part.
    """
    few, mine = windows.some(SCORED)
    rest, along = now.rest[mine[: len(now.rest)]], few.along(effects_of(now.causes))
    weight = few.weights(rest)
    away = few.without_starts([one * weight for one in along.starts()])
    others = np.column_stack([away(one * weight) for one in columns_of(along, now.causes)])
    left, causes = away(rest * weight), list(now.causes)
    if place is not None:
        cause = causes.pop(place)
        at = sum(len(one.numbers) for one in causes[:place])
        size = (cause.numbers / cause.units)[: 2 if cause.candidate.phased else 1]
        left = left + others[:, at : at + len(size)] @ size
        others = np.delete(others, slice(at, at + len(cause.numbers)), axis=1)
    others = np.linalg.qr(others[:, np.any(others != 0.0, axis=0)])[0]
    left = left - others @ (others.T @ left)
    level = float(left @ left) / max(len(left) - others.shape[1] - 2 * len(few), 1)
    scale, found, asked = len(windows) / len(few), [], []
    turning = _Turning(windows, causes)
    record = few.record[few.every[: len(rest)]]
    able = [one for one in known if one.kind not in (*LAWS, SCATTER) and turning.told(one)]
    for one, columns in _effects(along, now.causes, able, lambda rows: away(rows * weight)):
        columns = columns - (columns @ others) @ others.T
        normal, right = _by_record(columns, left, record, len(windows.zeros))
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
        found.append(Score(gain, one, units, by, scale * float(normal[:, 0, 0].sum())))
    return sorted(found, key=lambda each: -each.gain), level


def _effects(
    along: Linearised, causes: Sequence[Cause], able: Sequence[Candidate], away: Callable[[Array], Array]
) -> Iterator[tuple[Candidate, Array]]:
    """Yield candidates with how predictions change with each of their numbers, per unit, (p, n), starts taken out."""
    for at in range(0, len(able), BATCH):
        batch = able[at : at + BATCH]
        own = [_own(along, causes, one) for one in batch]
        rows = away(along.extended(np.concatenate(own)))
        yield from zip(batch, np.split(rows, np.cumsum([len(one) for one in own])[:-1]), strict=True)


def _own(along: Linearised, causes: Sequence[Cause], one: Candidate) -> Array:
    """Return how displacements at the readings change with each number of a candidate, per unit, (p, n)."""
    windows, columns = along.windows, []
    for k in range(2 if one.phased else 1):
        numbers = np.zeros(2 if one.phased else 1)
        part = one.tried * (1.0 if one.kind == SQUARED else TRIED)
        numbers[k] = part * one.unit
        if one.kind in (SQUARED, RUB):
            missed = windows.missed([*effects_of(causes), one.effect(numbers)])
            changed = (windows.read - along.run.made - missed) / windows.sigma
        else:
            changed = along.change(one.effect(numbers))
        columns.append(changed / part)
    return np.array(columns)


def fewer(windows: Windows, known: Sequence[Candidate], now: State) -> list[tuple[Cause, ...]]:
    """Return sets of causes of fewer numbers that have along the present path the effect of the present causes.

    Several causes may stand for fewer that were not found: a deviation of one gear and one of the other for an
    eccentricity. Along one path effects are nearly linear in their sizes, so that every small set can be tried.

    Args:
        windows: of the records.
        known: candidates.
        now: causes that are there.

    Returns:
        Of each group of causes that look like the same candidates, the best sets of one, two and more.
    """
    few, _ = windows.some(SCORED)
    along = few.along(effects_of(now.causes))
    weight = few.weights(along.rest)
    away = few.without_starts([one * weight for one in along.starts()])
    found = np.column_stack([away(one * weight) for one in columns_of(along, now.causes)])
    ends = np.cumsum([0, *(len(one.numbers) for one in now.causes)])
    zeros = np.linalg.qr(found[:, ends[-1] :][:, np.any(found[:, ends[-1] :] != 0.0, axis=0)])[0]
    done = []
    for one, at in zip(now.causes, ends, strict=False):
        size = (one.numbers / one.units)[: 2 if one.candidate.phased else 1]
        column = found[:, at : at + len(size)] @ size
        done.append(column - zeros @ (zeros.T @ column))
    turning, able, columns = _Turning(windows, now.causes), [], []
    asked = [one for one in known if one.kind not in (*LAWS, SCATTER, SQUARED) and turning.fixed(one)]
    for one, rows in _effects(along, now.causes, asked, lambda rows: away(rows * weight)):
        own = (rows - (rows @ zeros) @ zeros.T).T
        if np.all(np.isfinite(own)) and np.any(own):
            able.append(one)
            columns.append(own)
    alike = np.array([[_share(own, column) for own in columns] for column in done]).reshape(len(done), len(able))
    made = []
    for group in _groups(alike > ALIKE):
        numbers = sum(len(now.causes[k].numbers) for k in group)
        pool = np.argsort(-np.max(alike[group], axis=0))[:POOL]
        pool = [int(k) for k in pool if np.max(alike[group, k]) > ALIKE]
        whole = np.sum([done[k] for k in group], axis=0)
        rest = tuple(one for k, one in enumerate(now.causes) if k not in group)
        sets = _sets([columns[k] for k in pool], whole, numbers, len(group))
        for own, units in sets:
            causes = [begin(able[pool[k]], one) for k, one in zip(own, units, strict=True)]
            made.append((*rest, *causes))
    return made


def _share(own: Array, column: Array) -> float:
    """Return the part of a column that others explain."""
    return float(np.sum((np.linalg.qr(own)[0].T @ column) ** 2) / max(float(column @ column), 1e-300))


def _groups(alike: Array) -> list[list[int]]:
    """Return groups of two causes or more that look like the same candidates, from a table, (causes, candidates)."""
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
    """Return the best sets of columns of fewer numbers that explain nearly all of another, with their numbers."""
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
            if left < MISSED and all(SMALLEST < np.hypot.reduce(one) < LARGEST for one in parts):
                good.append((left, own, parts))
        made += [(own, parts) for _, own, parts in sorted(good, key=lambda one: one[0])[:SETS]]
    return made


def _by_record(columns: Array, left: Array, record: Array, count: int) -> tuple[Array, Array]:
    """Return the normal equations of columns, (p, n), in each record, (r, p, p) and (r, p)."""
    normal = [[np.bincount(record, one * other, count) for other in columns] for one in columns]
    right = [np.bincount(record, one * left, count) for one in columns]
    return np.array(normal).transpose(2, 0, 1), np.array(right).T


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

    def fixed(self, one: Candidate) -> bool:
        """Return whether the angles that a candidate goes by are those of the causes, in all records."""
        gear = goes_by(one)
        if not gear or not np.any(self.windows.lost[:, GEARS.index(gear)]):
            return True
        return not self._free(one) and order_of(one) % max(gcd(*self.orders[gear]), 1) == 0

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
