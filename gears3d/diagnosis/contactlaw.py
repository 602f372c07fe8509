"""Laws of contact compared with contact episodes: predictions of the rig with effects, and their fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.cause import Cause
from gears3d.diagnosis.prediction import deviation, torque
from gears3d.diagnosis.visits import PER, STEP, Visits
from gears3d.effects import Code, Row
from gears3d.errors import InputError
from gears3d.lumped import visits as paths

Array = np.ndarray
# Maximum number of Gauss-Newton rounds.
ROUNDS = 12
# Chi-square per point above which a contact episode contributes by its logarithm only.
HELD = 25.0
# Relative change of the cost that ends the fit.
ENOUGH = 1e-3
# Step of a number in units, for slopes.
SMALL = 1e-3
# Steps of place [m] and speed [m/s], for slopes.
ASIDE = (1e-7, 1e-4)
# Largest step of a number in a round, in units or in its natural logarithm.
FARTHEST = 0.7

# Rows that act at the flanks only, and the position of their numbers in a law.
_LAWS = {Code.IMPACT_OFFSET: (paths.RESTITUTION,), Code.IMPACT_SLOPE: (paths.SLOPE,),
         Code.IMPACT_FLANK: (paths.ASYMMETRY,), Code.TORQUE_FRICTION: (paths.FRICTION,),
         Code.GAP_SPRING: (paths.STIFFNESS, paths.DAMPING)}  # fmt: skip
# Channels of laws of contact.
OWN = ("visit",)
# Smallest ratio of sizes of a cause after and before a round: laws of contact have no sign.
SHRINKS = 0.3


class Held(NamedTuple):
    """Contact episodes fitted with effects.

    Args:
        causes: with their numbers, fitted.
        zeros: datum of each record [m].
        starts: of each record's contact episodes, (w, 2).
        points: chi-square per point of every contact episode, by record, (w,).
        cost: chi-square, outlying contact episodes by their logarithm.
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
        """Median chi-square per point of the contact episodes."""
        return float(np.median(np.concatenate(self.points)))


def law_of(rows: Iterable[Row], one: Visits) -> Array:
    """Return the numbers of the law of contact; rows that act outside it are skipped."""
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
    """Inputs on the grids of each record's contact episodes, reused as long as only laws of contact change."""

    def __init__(self) -> None:
        self._made: dict[int, tuple[list[Row], Array]] = {}

    def of(self, rows: Sequence[Row], one: Visits) -> Array:
        """Return the result of :func:`_given`."""
        acting = [
            row._replace(p=row.p[2:4]) if row.code == Code.GAP_FILM else row for row in rows if row.code not in _LAWS
        ]
        kept = self._made.get(id(one))
        if kept is None or kept[0] != acting:
            kept = self._made[id(one)] = acting, _given(rows, one)
        return kept[1]


def _given(rows: Sequence[Row], one: Visits) -> Array:
    """Return the inputs on the grids of contact episodes, without the record's datum, (w, n, COLUMNS)."""
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
    """Return the paths of contact episodes at their points [m], (w, k).

    starts: (w, 2); zero: datum of the record [m].
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
    """Fit contact episodes with the rig and effects; starts, datums and the causes' numbers are free."""
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
    own: Array  # of the starts, (w, k, 2)
    shared: Array  # of the datum and the causes' numbers in units, (w, k, 1 + p)


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
    """Return the first-order fall of chi-square by each of some small causes in addition to those in the fit."""
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
    """Return the derivatives of a record's contact episodes with respect to a further cause, per unit, (w, k, p)."""
    here, columns = one.place - now.rest[k], []
    for size in np.eye(1 + other.candidate.phased):
        rows = _rows(one, (other.candidate.effect(SMALL * other.candidate.unit * size),), now.causes)
        moved = followed(law_of(rows, one), _given(rows, one), now.starts[k], float(now.zeros[k]), one)
        columns.append((moved - here) / SMALL)
    return np.stack(columns, axis=-1)


def _stepped(causes: tuple[Cause, ...]) -> list[tuple[Cause, ...]]:
    """Return the causes with each of their numbers increased slightly, in turn."""
    found = []
    for i, cause in enumerate(causes):
        for k, unit in enumerate(units_of(cause)):
            numbers = cause.numbers.copy()
            numbers[k] += SMALL * unit
            found.append((*causes[:i], cause._replace(numbers=numbers), *causes[i + 1 :]))
    return found


def units_of(cause: Cause) -> Array:
    """Return the scales of a cause's numbers: their own sizes where these exceed the unit steps."""
    return np.maximum(np.minimum(cause.units, np.abs(cause.numbers) + 0.02 * cause.units), 1e-300) * np.where(
        cause.units == 1.0, 0.0, 1.0
    ) + np.where(cause.units == 1.0, 1.0, 0.0)


def _move(
    records: Sequence[Visits], now: Held, slopes: list[_Slopes], damping: float
) -> tuple[tuple[list[Array], Array, Array], Array]:
    """Return the steps of starts, datums and numbers, and the covariance of the numbers."""
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
    """Return the normal equations of the shared numbers without starts and datums, and the back-substitution."""
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
