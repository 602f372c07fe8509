"""Laws of contact held against visits to the flanks: what the rig and some effects make of each, and their fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.cause import Cause
from gears3d.diagnosis.deviation import deviation
from gears3d.diagnosis.torque import torque
from gears3d.diagnosis.visits import PER, STEP, Visits
from gears3d.effects import Code, Row
from gears3d.errors import InputError
from gears3d.lumped import visits as paths

Array = np.ndarray
ROUNDS = 12
"""Of Gauss and Newton at most."""
HELD = 25.0
"""Chi-square a point from which on a visit counts with its logarithm only."""
ENOUGH = 1e-3
"""Part of the cost below which a round was the last."""
SMALL = 1e-3
"""Of a number in units, for slopes."""
ASIDE = (1e-7, 1e-4)
"""Steps of place [m] and speed [m/s], for slopes."""
FARTHEST = 0.7
"""Units, or parts of e, that a number moves in one round at most."""

_LAWS = {Code.IMPACT_OFFSET: (paths.RESTITUTION,), Code.IMPACT_SLOPE: (paths.SLOPE,),
         Code.IMPACT_FLANK: (paths.ASYMMETRY,), Code.TORQUE_FRICTION: (paths.FRICTION,),
         Code.GAP_SPRING: (paths.STIFFNESS, paths.DAMPING)}  # fmt: skip
"""Normal forms that do nothing away from the flanks, and where their numbers stand in a law."""
OWN = ("visit",)
"""Channels of laws of contact."""
SHRINKS = 0.3
"""Part of its size that a cause keeps in a round at least: laws of contact have no sign."""


class Held(NamedTuple):
    """Visits held against effects.

    Args:
        causes: with their numbers, fitted.
        zeros: of each record [m].
        starts: of each record's visits, (w, 2).
        points: chi-square a point of every visit, by record, (w,).
        cost: chi-square, visits far off by their logarithm.
        count: points.
        covariance: of the causes' numbers [SI], (p, p).
        rest: residuals of each record [m], (w, k).
    """

    causes: tuple[Cause, ...]
    zeros: Array
    starts: list[Array]
    points: list[Array]
    cost: float
    count: int
    covariance: Array
    rest: list[Array]

    @property
    def level(self) -> float:
        """Chi-square a point of the visit in the middle."""
        return float(np.median(np.concatenate(self.points)))


def law_of(rows: Iterable[Row], one: Visits) -> Array:
    """Return the numbers of the law of contact.

    Args:
        rows: normal forms; those that do not act between the flanks are passed over.
        one: record with its rig.
    """
    law = np.zeros(paths.NUMBERS)
    law[paths.MASS] = one.rig.inertia / one.rig.base_radius_loose**2
    law[paths.RESTITUTION] = one.rig.restitution
    law[paths.STICK] = one.scenario.impact.stick_velocity
    for row in rows:
        for place, number in zip(_LAWS.get(row.code, ()), row.p, strict=False):
            law[place] += number
        if row.code == Code.GAP_FILM:
            law[paths.WEDGE] += row.p[0]
            law[paths.SQUEEZE] += row.p[1]
            law[paths.LAYER] = max(law[paths.LAYER], row.p[4])
    return law


class _Grids:
    """What is given over the visits' grids of each record, made once as long as only laws of contact change."""

    def __init__(self) -> None:
        self._made: dict[int, tuple[list[Row], Array]] = {}

    def of(self, rows: Sequence[Row], one: Visits) -> Array:
        """Return what :func:`_given` does."""
        acting = [
            row._replace(p=row.p[2:4]) if row.code == Code.GAP_FILM else row for row in rows if row.code not in _LAWS
        ]
        kept = self._made.get(id(one))
        if kept is None or kept[0] != acting:
            kept = self._made[id(one)] = acting, _given(rows, one)
        return kept[1]


def _given(rows: Sequence[Row], one: Visits) -> Array:
    """Return what is given over the visits' grids, the record's zero apart, (w, n, COLUMNS).

    Args:
        rows: normal forms of all effects.
        one: record with its rig.
    """
    rig, shape = one.rig, one.time.shape
    speed = np.gradient(one.loose, STEP, axis=1)
    flat = [x.ravel() for x in (speed, one.loose, one.time)]
    resisting = rig.drag_torque * np.sign(flat[0]) + torque(rows, *flat)
    made = np.zeros((*shape, paths.COLUMNS))
    made[..., paths.FORCED] = (-resisting * rig.base_radius_loose / rig.inertia).reshape(shape)
    for side, place in ((0, paths.LOW), (1, paths.HIGH)):
        made[..., place] = one.flank + side * rig.backlash
        if any(200 < row.code < 300 for row in rows):
            sides = np.full(one.time.size, side)
            moved = deviation(rows, one.pair, one.drive.ravel(), flat[1], sides)
            made[..., place] += moved.reshape(shape)
        made[..., place + paths.LOW_RATE - paths.LOW] = np.gradient(made[..., place], STEP, axis=1, edge_order=2)
    for row in rows:
        if row.code == Code.GAP_FILM:
            made[..., paths.ROLLING] = row.p[2] * one.rate + row.p[3] * speed
    return made


def followed(law: Array, over: Array, starts: Array, zero: float, one: Visits) -> Array:
    """Return the paths of visits at their points [m], (w, k).

    Args:
        law: numbers of the law.
        over: what is given on the grids, the zero apart.
        starts: (w, 2).
        zero: of the record [m].
        one: the record.
    """
    out = np.zeros(one.place.shape)
    paths.follow_all(law, starts, zero, over, one.sizes, STEP, PER, out)
    return out


def hold(
    records: Sequence[Visits],
    effects: Sequence[Any],
    causes: Sequence[Cause] = (),
    begin: Held | None = None,
    rounds: int = ROUNDS,
) -> Held:
    """Hold visits against the rig with effects; starts, zeros and the causes' numbers are fitted.

    Args:
        records: all.
        effects: that are held as they are.
        causes: whose numbers are fitted, from where they stand.
        begin: zeros and starts to begin from.
        rounds: of Gauss and Newton at most.
    """
    zeros = np.array([one.zero for one in records]) if begin is None else begin.zeros
    starts = [one.starts for one in records] if begin is None else begin.starts
    grids = _Grids()
    now = _told(records, effects, tuple(causes), zeros, starts, grids)
    damping, covariance = 1e-3, np.zeros((0, 0))
    for _ in range(rounds):
        slopes = _slopes(records, effects, now, grids)
        done = True
        for _ in range(4):
            moves, covariance = _move(records, now, slopes, damping)
            trial = _moved(records, effects, now, *moves, grids)
            if trial is not None and trial.cost < now.cost:
                done = now.cost - trial.cost < ENOUGH * trial.cost
                now, damping = trial, 0.2 * damping
                break
            damping = 10.0 * damping
        if done:
            break
    return now._replace(covariance=covariance)


def _told(
    records: Sequence[Visits],
    effects: Sequence[Any],
    causes: tuple[Cause, ...],
    zeros: Array,
    starts: list[Array],
    grids: _Grids,
) -> Held:
    rest, points, cost, count = [], [], 0.0, 0
    for one, zero, start in zip(records, zeros, starts, strict=True):
        rows = _rows(one, effects, causes)
        own = one.place - followed(law_of(rows, one), grids.of(rows, one), start, zero, one)
        square = np.nanmean((own / one.sigma) ** 2, axis=1)
        square = np.where(np.isfinite(square), square, 1e12)
        rest.append(own)
        points.append(square)
        size = own.shape[1]
        far = np.maximum(square, HELD) / HELD
        cost += size * float(np.sum(np.minimum(square, HELD) + HELD * np.log(far)))
        count += own.size
    return Held(causes, zeros, starts, points, cost, count, np.zeros((0, 0)), rest)


def _rows(one: Visits, effects: Sequence[Any], causes: Sequence[Cause]) -> list[Row]:
    every = [*one.scenario.effects, *effects, *(cause.effect for cause in causes)]
    return [row for effect in every if effect is not None for row in effect.rows(one.rig)]


class _Slopes(NamedTuple):
    own: Array  # of the visits' starts, (w, k, 2)
    shared: Array  # of the zero and the causes' numbers in units, (w, k, 1 + p)


def _slopes(records: Sequence[Visits], effects: Sequence[Any], now: Held, grids: _Grids) -> list[_Slopes]:
    found = []
    for one, zero, start, rest in zip(records, now.zeros, now.starts, now.rest, strict=True):
        rows = _rows(one, effects, now.causes)
        law, over, here = law_of(rows, one), grids.of(rows, one), one.place - rest
        own = [(followed(law, over, start + row, zero, one) - here) / step
               for row, step in zip(np.diag(ASIDE), ASIDE, strict=True)]  # fmt: skip
        shared = [(followed(law, over, start, zero + ASIDE[0], one) - here) / ASIDE[0]]
        for causes in _stepped(now.causes):
            rows = _rows(one, effects, causes)
            shared.append((followed(law_of(rows, one), grids.of(rows, one), start, zero, one) - here) / SMALL)
        found.append(_Slopes(np.stack(own, axis=-1), np.stack(shared, axis=-1)))
    return found


def gains(records: Sequence[Visits], now: Held, others: Sequence[Cause]) -> list[float]:
    """Return the fall of chi-square that each of some causes promises beside those that are held, to first order.

    Args:
        records: all.
        now: visits held against the causes so far.
        others: small.
    """
    slopes, found = _slopes(records, (), now, _Grids()), []
    normal, right, _ = _normal(records, now, slopes, 1e-3)
    without = float(right @ np.linalg.pinv(normal) @ right)
    for other in others:
        wider = [own._replace(shared=np.concatenate([own.shared, _columns(one, now, k, other)], axis=-1))
                 for k, (one, own) in enumerate(zip(records, slopes, strict=True))]  # fmt: skip
        normal, right, _ = _normal(records, now, wider, 1e-3)
        found.append(float(right @ np.linalg.pinv(normal) @ right) - without)
    return found


def _columns(one: Visits, now: Held, k: int, other: Cause) -> Array:
    """Return what each size of a further cause does to the visits of a record, per unit, (w, k, p)."""
    here, columns = one.place - now.rest[k], []
    for size in np.eye(1 + other.candidate.phased):
        rows = _rows(one, (other.candidate.effect(SMALL * other.candidate.unit * size),), now.causes)
        moved = followed(law_of(rows, one), _given(rows, one), now.starts[k], float(now.zeros[k]), one)
        columns.append((moved - here) / SMALL)
    return np.stack(columns, axis=-1)


def _stepped(causes: tuple[Cause, ...]) -> list[tuple[Cause, ...]]:
    """Return the causes with each of their numbers a little larger, one after the other."""
    found = []
    for i, cause in enumerate(causes):
        for k, unit in enumerate(units_of(cause)):
            numbers = cause.numbers.copy()
            numbers[k] += SMALL * unit
            found.append((*causes[:i], cause._replace(numbers=numbers), *causes[i + 1 :]))
    return found


def units_of(cause: Cause) -> Array:
    """Return the sizes by which a cause's numbers are counted: their own where these are larger than small ones.

    Args:
        cause: with its numbers.
    """
    return np.maximum(np.minimum(cause.units, np.abs(cause.numbers) + 0.02 * cause.units), 1e-300) * np.where(
        cause.units == 1.0, 0.0, 1.0
    ) + np.where(cause.units == 1.0, 1.0, 0.0)


def _move(
    records: Sequence[Visits], now: Held, slopes: list[_Slopes], damping: float
) -> tuple[tuple[list[Array], Array, Array], Array]:
    """Return the moves of starts, zeros and numbers, and the covariance of the numbers."""
    normal, right, kept = _normal(records, now, slopes, damping)
    inverse = np.linalg.pinv(normal)
    numbers = np.clip(inverse @ right, -FARTHEST, FARTHEST)
    zeros = np.array([(t - s[1:] @ numbers) / max(s[0], 1e-300) for _, _, s, t in kept])
    starts = [r - b @ np.concatenate([[z], numbers]) for (b, r, _, _), z in zip(kept, zeros, strict=True)]
    units = np.concatenate([np.zeros(0), *(units_of(cause) for cause in now.causes)])
    return (starts, zeros, numbers * units), inverse * np.outer(units, units)


def _normal(
    records: Sequence[Visits], now: Held, slopes: list[_Slopes], damping: float
) -> tuple[Array, Array, list[tuple[Array, Array, Array, float]]]:
    """Return the normal equations of the shared numbers, starts and zeros eliminated, and what gives these back."""
    width = slopes[0].shared.shape[-1] - 1
    normal, right, kept = np.zeros((width, width)), np.zeros(width), []
    for one, rest, points, (own, shared) in zip(records, now.rest, now.points, slopes, strict=True):
        weight = (np.minimum(1.0, np.sqrt(HELD / points))[:, None] / one.sigma)[..., None]
        a, b, r = np.nan_to_num(own * weight), np.nan_to_num(shared * weight), np.nan_to_num(rest[..., None] * weight)
        inverse = np.linalg.pinv(_damped(np.swapaxes(a, 1, 2) @ a, damping))
        to_b, to_r = inverse @ (np.swapaxes(a, 1, 2) @ b), inverse @ (np.swapaxes(a, 1, 2) @ r)
        b2, r2 = b - a @ to_b, r - a @ to_r
        square = _damped(np.einsum("wki,wkj->ij", b2, b2), damping)
        toward = np.einsum("wki,wk->i", b2, r2[..., 0])
        zero = max(square[0, 0], 1e-300)
        normal += square[1:, 1:] - np.outer(square[0, 1:], square[0, 1:]) / zero
        right += toward[1:] - square[0, 1:] * toward[0] / zero
        kept.append((to_b, to_r[..., 0], square[0], toward[0]))
    return normal, right, kept


def _damped(normal: Array, damping: float) -> Array:
    size = normal.shape[-1]
    return normal + damping * normal * np.eye(size)


def _moved(
    records: Sequence[Visits],
    effects: Sequence[Any],
    now: Held,
    starts: list[Array],
    zeros: Array,
    numbers: Array,
    grids: _Grids,
) -> Held | None:
    causes, at = [], 0
    for cause in now.causes:
        size = len(cause.numbers)
        moved = cause.numbers + numbers[at : at + size]
        if cause.candidate.channels == OWN:
            moved[0] = max(moved[0], SHRINKS * cause.numbers[0])
        causes.append(cause._replace(numbers=moved))
        at += size
    begun = [old + move for old, move in zip(now.starts, starts, strict=True)]
    limit = [0.2 * one.rig.backlash for one in records]
    moved = now.zeros + np.clip(zeros, -np.array(limit), limit)
    try:
        return _told(records, effects, tuple(causes), moved, begun, grids)
    except InputError:  # beyond the bounds of a parameter
        return None
