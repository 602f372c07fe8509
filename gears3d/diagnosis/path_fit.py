"""Gauss-Newton fits of causes, starts and datums to windows of all records, and likelihood ratios of two fits.

Input: windows of multiple shooting with their sensitivities, and causes. Starts are projected out in each
window; numbers of causes and datums of records are common to all. Result: a state with numbers, starts, datums and
residuals, its covariance, and the gain of one state over another with its significance over windows.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from math import gcd
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import (
    ACCEPT_PATH,
    EXCLUDED,
    LARGEST,
    SLOPE_STEP,
    SMALLEST,
    Candidate,
    Cause,
    begin,
    goes_by,
    moved,
    swings,
    within_bounds,
)
from gears3d.diagnosis.evidence import orthonormal
from gears3d.diagnosis.prediction import GEARS, restitution
from gears3d.diagnosis.preprocessing import ANGLE_STEP, order_of, reference
from gears3d.diagnosis.shooting import KICKS, Linearised, Starts, Windows
from gears3d.effects import Code
from gears3d.errors import InputError

Array = np.ndarray
# A cause whose effect is quadratic, two whose effect is large from their smallest size on, and one with a number for
# every impact.
SQUARED, OIL, SOFT, SCATTER = "mesh_drag", "oil_film", "tooth_compliance", "restitution_scatter"
# A second body on a spring, whose twist is part of the starts.
BODY = "carried_inertia"
# Causes that change the motion throughout, of which a rig has one; one that acts on compliant flanks; stick-slip.
LAWS, RUB, SLIP = (OIL, SOFT, BODY), "mesh_friction", "drag_stick_slip"
# Step of the numbers of a second body in units, for sensitivities: it changes phases in a window by 0.1 rad at most;
# ratio of the largest steps of other numbers and of its frequency in a round.
TWISTED, SWUNG = 1e-4, 10.0
# Relative standard deviation of inertia and stiffness of a second body by model errors: in ten blind tests whose own
# intervals were narrower, the first deviated by up to 0.5 %, the second by up to 1.1 %. The same of a viscosity, by
# steps of the integration: 0.27 % in one of two records without noise.
SWAYED, FILMED = 0.006, 0.002
# Part of the size, and least size in units, that is the step for sensitivities of laws of contact.
BENT, LEAST = 0.02, 0.1
# Largest number of causes, and of Gauss-Newton rounds; rounds in which starts are refitted before a step is judged.
ROUNDS, SETTLING = 8, 2
# Largest steps in a round: of numbers and of starts in units, and of angular datums in radians.
FARTHEST = (0.5, 0.2, 0.05)
# Smallest part of the square of a start's column that must be independent of the other columns.
DEPENDENT = 1e-9
# Parts of a step (line search), and factors on the size of a cause, that are tried.
DAMPED, SCAN = (1.0, 0.3, 0.1), (0.8, 1.25)
# Multiple of the level at which the mean square of a window is clipped: its motion diverges from the model's.
FAR = 9.0
# Median mean square of residuals, in variances of the noise, up to which the trajectory is explained: noise that is
# known badly has up to 3.
ACCOUNTS = 4.0
# Shifts of a record's displacement datum that are tried, in backlashes; number of tried angular datums in a period;
# windows of the trials.
SHIFTS, TURNS, LOOKED = tuple(0.1 * k for k in range(-6, 7)), 8, 32
# Correction of the drive's motion, in standard deviations, from which on fits begin from its readings, too: one in 20
# exceeds it by chance; largest number of these fits.
BENDS, REMADE = 2.0, 5
# Sizes in units from the best of which the fit of a scatter begins, and rounds of its re-estimation from the kicks.
SCATTERED, SPREADS = (0.3, 0.1, 0.03, 0.01), 3
# Parts of a window, increasing from its beginning, to whose readings starts, kicks and causes are fitted in turn.
REACHES = tuple(0.08 * 1.25**k for k in range(12))


class State(NamedTuple):
    """Causes, their residuals, and the starts, datums, weights and motion of the drive of windows.

    The price of a window is twice the logarithm by which kicks, or corrections of the drive, lower its evidence.
    """

    causes: tuple[Cause, ...]
    rest: Array
    starts: Starts
    zeros: Array
    turned: Array
    weight: Array
    price: Array
    motion: Array


class WithoutStarts:
    """Projector that removes the starts, as nuisance parameters, from columns, in each window.

    Args:
        windows: of the columns.
        columns: of :meth:`Linearised.starts`.

    Attributes:
        sizes: norms of the columns without those before them, (w, p).
    """

    def __init__(self, windows: Windows, columns: Sequence[Array]) -> None:
        self._windows, self._given = windows, windows.dense(columns)
        own = np.stack(orthonormal(tuple(self._given.transpose(1, 0, 2)), DEPENDENT), axis=1)
        self.sizes, self._own = np.einsum("wpn,wpn->wp", own, self._given), own

    def variances(self) -> Array:
        """Return the marginal variance of each number of a start, 0 without effect, (w, p)."""
        normal = self._given @ self._given.transpose(0, 2, 1)
        return np.diagonal(np.linalg.pinv(normal, rcond=1e-12, hermitian=True), axis1=1, axis2=2)

    def __call__(self, columns: Array) -> Array:
        """Return columns with starts projected out, (n,) or (k, n)."""
        if not columns.size:
            return columns
        dense = self._windows.dense(np.atleast_2d(columns))
        along = (dense @ self._own.transpose(0, 2, 1)) @ self._own
        return columns - self._windows.gathered(along, columns)


class WithoutNuisances:
    """Projector that removes starts, and the uncertain harmonics of the drive of each record, from weighted columns.

    Each harmonic has its uncertainty as a prior; the rows of the priors follow those of the readings.

    Args:
        windows: of the columns.
        rest: residuals, whose level and runs are the unit of the priors.
        starts: sensitivities to starts, of :meth:`Linearised.starts`.
        driven: those to harmonics of the drive, of :meth:`Linearised.driven`.

    Attributes:
        held: root of the weight of the priors of each record, (r,).
        record: of each row, (n + p,).
    """

    def __init__(self, windows: Windows, rest: Array, starts: Sequence[Array], driven: Array) -> None:
        self._windows, weight, count = windows, windows.weights(rest), len(windows.zeros)
        self._starts = WithoutStarts(windows, [one * weight for one in starts])
        self.held = np.sqrt(max(np.median(windows.level(rest)) * windows.runs(rest), 1e-12) * windows.sampled)
        driven = np.where(np.isfinite(driven), driven, 0.0)  # trajectories that diverge within a window
        own, record = self._starts(driven * weight), windows.record[windows.every[: len(rest)]]
        self.record = np.concatenate([record, np.repeat(np.arange(count), len(driven))])
        self._blocks = []
        for k in np.unique(record).tolist() if len(driven) else ():
            block = np.vstack([own[:, record == k].T, self.held[k] * np.eye(len(driven))])
            self._blocks.append((k, np.flatnonzero(self.record == k), *np.linalg.qr(block)))

    def __call__(self, columns: Array) -> Array:
        """Return weighted columns, (n,) or (k, n), with nuisances projected out and the rows of the priors."""
        return self._left(self._starts(columns), np.zeros_like(self._windows.motion))

    def residuals(self, rest: Array) -> Array:
        """Return weighted residuals, and those of the priors, with nuisances projected out, (n + p,)."""
        return self._left(self._starts(rest), self._windows.motion)

    def _left(self, columns: Array, motion: Array) -> Array:
        prior = np.broadcast_to(-(self.held[:, None] * motion).ravel(), (*columns.shape[:-1], motion.size))
        made = np.concatenate([columns, prior], axis=-1)
        for _, rows, own, _ in self._blocks:
            made[..., rows] -= (made[..., rows] @ own) @ own.T
        return made

    def sizes(self, rest: Array) -> Array:
        """Return the changes of the harmonics that reduce weighted residuals, in standard deviations, (r, m).

        Records without windows keep theirs.
        """
        motion = self._windows.motion
        made, wide = np.zeros_like(motion), np.concatenate([self._starts(rest), -(self.held[:, None] * motion).ravel()])
        for k, rows, own, upper in self._blocks:
            made[k] = np.linalg.solve(upper, own.T @ wide[rows])
        return made


def nuisances(along: Linearised) -> WithoutNuisances:
    """Return the projector of the starts and harmonics of linearised trajectories."""
    return WithoutNuisances(along.windows, along.rest, along.starts(), along.driven())


def state_of(windows: Windows, causes: Sequence[Cause], rest: Array) -> State:
    """Return the present state of windows, with causes and their residuals."""
    return State(
        tuple(causes), rest, windows.starts, windows.zeros.copy(), windows.turned.copy(), windows.weight.copy(),
        _price(windows, causes) + _price_of_motion(windows), windows.motion,
    )  # fmt: skip


def restore(windows: Windows, state: State) -> None:
    """Set the starts, datums, weights and motion of windows to those of a state."""
    windows.starts, windows.zeros, windows.turned = state.starts, state.zeros.copy(), state.turned.copy()
    windows.weight, windows.motion = state.weight.copy(), state.motion


def effects_of(causes: Sequence[Cause]) -> list[Any]:
    """Return the effects of causes, without those of size 0."""
    return [one for one in (cause.effect for cause in causes) if one is not None]


def gain_of(windows: Windows, less: State, more: State) -> tuple[float, float]:
    """Return the fall of chi-square, over the level of the better residuals, and its significance over windows.

    Consecutive residuals of the same sign count as one.
    """
    return fall_of(windows, less.rest, more.rest, more.price - less.price)


def fall_of(windows: Windows, less: Array, more: Array, price: Array | float = 0.0) -> tuple[float, float]:
    """Return the same of residuals, of which the better ones may have a price in each window."""
    a, b = windows.level(less), windows.level(more)
    level = max(float(np.median(b)), 1e-12)
    most = FAR * level + float(np.median(a))
    fall = (np.minimum(a, most) - np.minimum(b, most)) * np.bincount(windows.window, minlength=len(windows))
    fall = fall / (level * windows.runs(more)) - price
    bounded = np.clip(fall, -EXCLUDED, EXCLUDED)
    return float(fall.sum()), float(bounded.mean() / (bounded.std() / np.sqrt(len(fall)) + 1e-30))


def size_of(windows: Windows, cause: Cause) -> float:
    """Return the size of a cause in its units, of a power law at its own exponent.

    That of a stiffness is the deflection of teeth by an impact after a fall across the backlash, in backlashes.
    """
    size = float(np.hypot.reduce(cause.numbers[: 2 if cause.candidate.phased else 1])) / cause.candidate.unit
    if cause.candidate.kind == "drag_power":
        size *= windows.pivot ** (float(np.exp(cause.numbers[1])) - cause.candidate.shape["exponent"])
    return float(np.sqrt(2.0 / size)) if cause.candidate.kind == SOFT else size


def agreement_of_diverging(windows: Windows, less: State, more: State) -> float:
    """Return the significance of a gain over those windows alone that diverge from either state.

    A cause of the reverse flank acts in the windows that reach it. Of windows that still diverge only losses count,
    and one window without a gain is added to them: a few may diverge by chance.
    """
    a, b = windows.level(less.rest), windows.level(more.rest)
    most = FAR * max(float(np.median(b)), 1.0)
    far = (a > most) | (b > most)
    fall = np.append(np.where(b > most, -1.0, 1.0)[far], 0.0)
    fall[:-1] *= (a > most)[far] != (b > most)[far]
    return float(fall.mean() / (fall.std() / np.sqrt(len(fall)) + 1e-30))


def fitted(windows: Windows, now: State, rounds: int = ROUNDS, *, held: int = 0) -> State:
    """Return causes, datums and starts of least chi-square, by damped Gauss-Newton; the first causes may be held."""
    causes = tuple(now.causes)
    units = np.concatenate([np.zeros(0), *(cause.units for cause in causes)])
    rest = now.rest
    for _ in range(rounds):
        along = windows.along(effects_of(causes))
        rest, weight = along.rest, windows.weights(along.rest)
        starts, driven = along.starts(), along.driven()
        columns = np.array([one * weight for one in columns_of(along, causes)])
        columns[: sum(len(cause.numbers) for cause in causes[:held])] = 0.0
        away = WithoutNuisances(windows, rest, starts, driven)
        own = away(columns)
        if not np.all(np.isfinite(own)):  # trajectories that diverge within a window
            break
        step = np.linalg.lstsq(own.T, away.residuals(rest * weight), rcond=1e-9)[0]
        numbers = sum(len(cause.numbers) for cause in causes)
        step[:numbers] = _shortened(causes, step[:numbers], windows.pivot)
        motion, by_motion = windows.motion, away.sizes(rest * weight - step @ columns)
        changed = weight * along.corrected(by_motion, driven)
        most = FAR * float(np.median(windows.level(rest * weight)))
        before, old = _bounded(windows, rest * weight, most, away.held), windows.starts
        zeros, turned, angles = windows.zeros, windows.turned, unknown_datums(windows, causes)
        for damping in DAMPED:
            left = rest * weight - damping * (step @ columns + changed)
            try:
                trial = moved(causes, damping * step[:numbers] * units, windows.pivot)
                if any(one.candidate.kind in LAWS and one.numbers[0] <= 0.0 for one in trial):
                    continue
                effects = effects_of(trial)
                at = numbers + len(zeros)
                windows.zeros = zeros + damping * step[numbers:at] * windows.backlash
                windows.turned, windows.motion = turned.copy(), motion + damping * by_motion
                for side, records in angles:
                    by = damping * step[at : at + len(records)] * ANGLE_STEP / SLOPE_STEP
                    windows.turned[records, side] += np.clip(by, -FARTHEST[2], FARTHEST[2])
                    at += len(records)
                tried = windows.moved([one * weight for one in starts], left, along.spread, FARTHEST[1])
                new, kept = windows.residuals(effects, tried), windows.residuals(effects)
            except InputError:  # outside the bounds of a parameter
                windows.zeros, windows.turned, windows.motion = zeros, turned, motion
                continue
            better = windows.level(new) < windows.level(kept)
            windows.starts = tried.where(better, old)
            new = settled(windows, effects, np.where(better[windows.every[: len(new)]], new, kept))
            if (after := _bounded(windows, new * weight, most, away.held)) < before:
                causes, rest = trial, new
                break
            windows.starts, windows.zeros, windows.turned, windows.motion = old, zeros, turned, motion
        else:
            break
        if before - after < 1e-4 * before:
            break
    return state_of(windows, causes, rest)


def _bounded(windows: Windows, rest: Array, most: float, held: Array | None = None) -> float:
    """Return the sum of clipped mean squares of windows, a few may diverge from any model, and of priors of the drive.

    held: root of the weight of the priors of each record, (r,).
    """
    prior = 0.0 if held is None else float(np.sum((held[:, None] * windows.motion) ** 2))
    return float(np.sum(np.minimum(windows.level(rest), most))) + prior * len(windows) / max(len(windows.window), 1)


def _shortened(causes: Sequence[Cause], step: Array, pivot: float) -> Array:
    """Return a step in units, that of each cause shortened to the largest one in its direction.

    That of a power law is limited by the change of torque at the pivot.
    """
    made, at = step.copy(), 0
    for cause in causes:
        own = slice(at, at + len(cause.numbers))
        at, long = own.stop, np.abs(step[own])
        if cause.candidate.kind == "drag_power" and cause.free:
            power = float(np.exp(cause.numbers[1]))
            torque = step[own][0] + cause.numbers[0] / cause.units[0] * np.log(pivot) * power * step[own][1]
            long[0] = abs(torque) * pivot ** (power - cause.candidate.shape["exponent"])
        if cause.candidate.kind == SOFT:
            long[0] /= cause.numbers[0] / cause.units[0]
        if cause.candidate.kind == BODY:
            long[0] /= cause.numbers[0] / cause.units[0]
            long[1] = SWUNG * abs(float(swings(cause)[1] @ (step[own] * cause.units)[:2]))
        made[own] *= FARTHEST[0] / max(float(np.max(long)), FARTHEST[0])
    return made


def columns_of(along: Linearised, causes: Sequence[Cause]) -> list[Array]:
    """Return sensitivities of the predictions to each number of causes, and each datum, per unit, (n,) each."""
    windows, columns = along.windows, []
    for k, cause in enumerate(causes):
        # nonlinear: the film is thinnest where forces are largest
        bent = along.oiled or cause.candidate.kind in (*LAWS, RUB, SQUARED)
        for j, unit in enumerate(cause.units):
            step = BENT * max(abs(cause.numbers[j]) / unit, LEAST) if bent else SLOPE_STEP
            step = TWISTED if cause.candidate.kind == BODY else step
            numbers = cause.numbers.copy()
            numbers[j] += step * unit
            other = cause._replace(numbers=numbers)
            if bent:
                rest = windows.residuals(effects_of([*causes[:k], other, *causes[k + 1 :]]))
                columns.append((along.rest - rest) / step)
            else:
                columns.append(along.column(other.effect, cause.effect) / step)
    record = windows.record[windows.every[: len(along.rest)]]
    unit = along.extended(windows.backlash / windows.sigma)
    columns += [(record == k) * unit for k in range(len(windows.zeros))]
    for side, records in unknown_datums(windows, causes):
        turned = _datum_column(along, causes, side)
        columns += [np.where(record == k, ANGLE_STEP / SLOPE_STEP * turned, 0.0) for k in records]
    return columns


def _datum_column(along: Linearised, causes: Sequence[Cause], side: int) -> Array:
    """Return the sensitivity of the predictions to the angular datum of a gear's causes [1/rad], (n,)."""
    by = (ANGLE_STEP, 0.0) if side == 0 else (0.0, ANGLE_STEP)
    own = [one.effect for one in causes if goes_by(one.candidate) == GEARS[side]]
    return sum((along.column(one, one, by) for one in own if one is not None), np.zeros(len(along.rest))) / ANGLE_STEP


def referenced(windows: Windows, now: State) -> State:
    """Return a state whose phases, where no record has an index mark, refer to the first record with the causes."""
    restore(windows, now)
    along = windows.along(effects_of(now.causes))
    away = WithoutStarts(windows, along.starts())
    record, causes, turned = windows.record[windows.every[: len(along.rest)]], now.causes, now.turned
    for side, lost in unknown_datums(windows, causes):
        if len(lost) < len(windows.lost) and np.all(windows.lost[:, side]):
            worth = np.bincount(record, away(_datum_column(along, causes, side)) ** 2, len(windows.lost))
            causes, turned = _relative_to(causes, turned, side, reference(worth))
    return now._replace(causes=tuple(causes), turned=turned)


def unknown_datums(windows: Windows, causes: Sequence[Cause]) -> list[tuple[int, list[int]]]:
    """Return the records whose angular datum of each gear is unknown and determined by causes.

    Where no record has an index mark, the phases of causes refer to the datum of one.
    """
    unknown = []
    for side, gear in enumerate(GEARS):
        own = [one.candidate for one in causes if goes_by(one.candidate) == gear]
        lost = np.flatnonzero(windows.lost[:, side]).tolist()
        if len(lost) == len(windows.lost) and any(one.phased for one in own):
            lost.remove(int(np.argmin(np.abs(windows.turned[:, side]))))
        if own and lost:
            unknown.append((side, lost))
    return unknown


def settled(windows: Windows, effects: Sequence[object], rest: Array) -> Array:
    """Fit the starts alone by least squares, and return the residuals."""
    for _ in range(SETTLING):
        along = windows.along(effects)
        tried = windows.moved(along.starts(), rest, along.spread, FARTHEST[1])
        new = windows.residuals(effects, tried)
        better = windows.level(new) < windows.level(rest)
        windows.starts = tried.where(better, windows.starts)
        rest = np.where(better[windows.every[: len(rest)]], new, rest)
    return rest


def followed(windows: Windows, effects: Sequence[object], rest: Array) -> Array:
    """Fit starts and kicks of each window to increasing parts of its readings, and keep those that are better.

    Impacts are added one by one: in a fit to the complete window, late residuals distort the first impacts.

    Args:
        windows: whose starts are fitted.
        effects: of the causes.
        rest: residuals of the present starts.

    Returns:
        Residuals.
    """
    poor = windows.poor(effects, rest)
    if not len(poor):
        return rest
    part, mine = windows.only(poor)
    before, old = part.starts, rest[mine[: len(rest)]]
    part.restart(effects, anew=True, until=REACHES[0])
    new = part.residuals(effects)
    for reach in REACHES:
        early = part.early(reach, len(new))
        for _ in range(SETTLING):
            along = part.along(effects)
            tried = part.moved([one * early for one in along.starts()], new * early, along.spread, FARTHEST[1])
            moved = part.residuals(effects, tried)
            better = part.level(moved * early) < part.level(new * early)
            part.starts = tried.where(better, part.starts)
            new = np.where(better[part.every[: len(new)]], moved, new)
    better = part.level(new) < part.level(old)
    windows.starts = windows.starts.put(poor, part.starts.where(better, before))
    made = rest.copy()
    made[np.flatnonzero(mine[: len(rest)])] = np.where(better[part.every[: len(old)]], new, old)
    return made


def refined(windows: Windows, effects: Sequence[Any], rest: Array) -> Array:
    """Fit several starts of each window, keep the best of each, and return the residuals.

    With low bounces, neighbouring starts have local minima. Films and springs take too long.
    """
    rows = [row for one in (*windows.effects, *effects) for row in one.rows(windows.values)]
    if any(row.code in (Code.GAP_FILM, Code.GAP_SPRING, Code.TORQUE_CARRIED) for row in rows):
        return rest
    poor = windows.poor(effects, rest)
    if not len(poor):
        return rest
    part = windows.only(poor)[0]
    best, least = part.starts, windows.level(rest)[poor]
    for one in part.beginnings(effects):
        part.starts = one
        level = part.level(settled(part, effects, part.residuals(effects)))
        better = level < least
        best, least = part.starts.where(better, best), np.minimum(level, least)
    windows.starts = windows.starts.put(poor, best)
    return windows.residuals(effects)


def rezeroed(windows: Windows, now: State) -> State:
    """Return a state with other datums of displacement and angles of records, where these reduce large residuals.

    The displacement datum comes from extreme readings, which deviations of encoder or flanks move; with a wrong one,
    windows miss the impacts that determine it. Angular datums come from sensitivities, which are invalid for large
    residuals. Both may be wrong in a record that is not explained where others are.
    """
    restore(windows, now)
    few, mine = windows.some(LOOKED)
    least = _by_record(few, now.rest[mine[: len(now.rest)]])
    if np.all(least <= ACCOUNTS):
        return now
    effects, best, turns = effects_of(now.causes), (now.zeros, now.turned), [now.turned]
    zeros = [windows.guessed + shift * windows.backlash for shift in SHIFTS]
    for side, gear in enumerate(GEARS):
        orders = [
            order_of(one.candidate) for one in now.causes if one.candidate.phased and goes_by(one.candidate) == gear
        ]
        if orders and np.any(windows.lost[:, side]):
            turn = 2.0 * np.pi / gcd(*orders) * np.arange(1, TURNS) / TURNS
            turns += [now.turned + by * np.outer(windows.lost[:, side], np.eye(2)[side]) for by in turn]
    single = [*((zero, now.turned) for zero in zeros), *((now.zeros, turned) for turned in turns[1:])]
    for tried in (single, [(zero, turned) for zero in zeros for turned in turns[1:]]):
        off = least > ACCOUNTS
        if not np.any(off) or (tried is not single and np.all(off)):
            break
        part = few.only(np.flatnonzero(off[few.record]))[0]
        for part.zeros, part.turned in tried:
            part.restart(effects, anew=True)
            level = _by_record(part, settled(part, effects, part.residuals(effects)))
            better = off & (level < 0.5 * least)
            best = np.where(better, part.zeros, best[0]), np.where(better[:, None], part.turned, best[1])
            least = np.where(better, level, least)
    if np.all(best[0] == now.zeros) and np.all(best[1] == now.turned):
        return now
    windows.zeros, turned = best
    causes = now.causes
    for side in range(len(GEARS)):
        if np.all(windows.lost[:, side]):
            causes, turned = _relative_to(causes, turned, side, 0)
    windows.turned = turned
    effects = effects_of(causes)
    windows.restart(effects, anew=True)
    return fitted(windows, state_of(windows, causes, windows.residuals(effects)))


def _relative_to(causes: Sequence[Cause], turned: Array, side: int, first: int) -> tuple[list[Cause], Array]:
    """Return causes of a gear, and the shifts of angular datums, relative to those of one record."""
    made, turned, by = list(causes), turned.copy(), turned[first, side]
    for k, one in enumerate(made):
        if one.candidate.phased and goes_by(one.candidate) == GEARS[side]:
            seen = (one.numbers[0] - 1j * one.numbers[1]) * np.exp(1j * order_of(one.candidate) * by)
            made[k] = one._replace(numbers=np.concatenate([[seen.real, -seen.imag], one.numbers[2:]]))
    turned[:, side] -= by
    return made, turned


def added(now: State, one: State, record: int) -> State:
    """Return a state with its causes and angular datums, and the last cause of another as a record has it there."""
    last, shifts = list(one.causes[-1:]), one.turned - now.turned
    for side in range(len(GEARS)):
        last, shifts = _relative_to(last, shifts, side, record)
    return one._replace(causes=(*now.causes, *last), turned=now.turned)


def _by_record(windows: Windows, rest: Array) -> Array:
    """Return the median mean square of residuals in the windows of each record, (r,)."""
    level = windows.level(rest)
    own = [level[windows.record == k] for k in range(len(windows.zeros))]
    return np.array([np.median(one) if len(one) else 0.0 for one in own])


def polished(windows: Windows, now: State, *, thorough: bool = False) -> State:
    """Return a state fitted repeatedly from new starts, with less weight of diverging windows, until convergence.

    thorough: whether several starts of each window are fitted.
    """
    now = _polished(windows, now)
    effects, before = effects_of(now.causes), now.rest
    rest = followed(windows, effects, before)
    rest = refined(windows, effects, rest) if thorough else rest
    if np.any(rest != before):
        now = fitted(windows, now._replace(rest=rest))
    return _from_measured_motion(windows, now) if thorough else now


def unrounded(windows: Windows, now: State) -> State:
    """Return a state fitted to readings without the rounding to counts that it explains, where residuals fall."""
    restore(windows, now)
    return refitted(windows, now) if windows.unrounded(effects_of(now.causes)) else now


def carried(part: Windows, now: State) -> State:
    """Return the causes of a state in windows of another length."""
    part.zeros, part.turned, part.weight = now.zeros.copy(), now.turned.copy(), np.ones(len(part))
    part.motion, part.starts = now.motion, now.starts
    effects = effects_of(now.causes)
    part.restart(effects)
    rest = settled(part, effects, part.residuals(effects))
    return rezeroed(part, state_of(part, now.causes, rest))


def refitted(windows: Windows, now: State) -> State:
    """Return a state fitted to the present readings.

    Where a record is not explained that others are, causes, datums and motion are fitted to increasing parts of windows
    in turn: errors grow from impact to impact, and complete windows have local minima.
    """
    restore(windows, now)
    rest = windows.residuals(effects_of(now.causes))
    made = polished(windows, fitted(windows, state_of(windows, now.causes, rest)), thorough=True)
    missed = _by_record(windows, made.rest) > ACCOUNTS
    if not np.any(missed) or np.all(missed):
        return made
    for part in (*(windows.until(reach) for reach in REACHES), windows):
        now = polished(part, carried(part, now))
    restore(windows, best := now if gain_of(windows, made, now)[0] > 0.0 else made)
    return best


def _from_measured_motion(windows: Windows, now: State) -> State:
    """Return the best of a state and fits from the drive's motion as measured, which other causes may bend.

    The first fit chooses starts of poor windows again; others those of all, with the datums of the best, while better.
    """
    effects = effects_of(now.causes)
    for k in range(REMADE):
        if np.abs(now.motion).max(initial=0.0) <= BENDS:
            break
        windows.motion = np.zeros_like(now.motion)
        windows.restart(effects, anew=k > 0)
        other = _polished(windows, fitted(windows, state_of(windows, now.causes, windows.residuals(effects))))
        better = gain_of(windows, now, other)[0] > 0.0
        restore(windows, now := other if better else now)
        if k > 0 and not better:
            break
    return now


def _polished(windows: Windows, now: State) -> State:
    """Return a state fitted from starts that are flights through the first readings, or at rest on a flank."""
    for _ in range(8 if any(cause.free for cause in now.causes) else 4):  # a free shape needs more rounds
        now = with_spread(windows, now)
        level = windows.level(now.rest)
        windows.weight = 1.0 / np.sqrt(np.maximum(level / (4.0 * max(float(np.median(level)), 1e-12)), 1.0))
        windows.restart(effects_of(now.causes))
        new = fitted(windows, now)
        most = FAR * float(np.median(level))
        before, after = _bounded(windows, now.rest, most), _bounded(windows, new.rest, most)
        if after >= before:
            restore(windows, now._replace(weight=windows.weight))
            return now._replace(weight=windows.weight)
        now = new
        if after > 0.99 * before:
            break
    return now


def scanned(windows: Windows, now: State) -> State:
    """Return a state with another size of the last cause, where that is better with new starts.

    Starts fitted with too small a cause are a local minimum in its size; new starts leave it.
    """
    for _ in range(ROUNDS):
        better = None
        for factor in SCAN:
            restore(windows, now)
            last = now.causes[-1]
            sizes = np.where(np.arange(len(last.numbers)) < (2 if last.candidate.phased else 1), factor, 1.0)
            numbers = last.numbers * sizes
            if last.candidate.kind == SOFT and last.free:  # at constant restitution
                numbers[1] += 0.5 * np.log(factor)
            causes = (*now.causes[:-1], last._replace(numbers=within_bounds(last, numbers)))
            with suppress(InputError):
                effects = effects_of(causes)
                windows.restart(effects)
                rest = settled(windows, effects, windows.residuals(effects))
                tried = state_of(windows, causes, rest)
                # total residuals: the drive's part is known of polished states only
                if fall_of(windows, (better or now).rest, tried.rest)[0] > ACCEPT_PATH:
                    better = tried
        if better is None or not SMALLEST < size_of(windows, better.causes[-1]) < LARGEST:
            break
        now = better
    restore(windows, now)
    return now


def kicked(windows: Windows, causes: Sequence[Cause]) -> tuple[WithoutStarts, Array] | None:
    """Return the projector of starts and kicks, and the information on each kick, 0 to 1, (w, K).

    ``None`` where restitution does not scatter.
    """
    along = windows.along(effects_of(causes))
    if not along.spread:
        return None
    columns = along.starts()
    own = WithoutStarts(windows, [one * windows.weights(one) for one in columns])
    return own, np.clip(1.0 - own.variances()[:, -KICKS:], 0.0, 1.0)


def _price(windows: Windows, causes: Sequence[Cause]) -> Array:
    """Return twice the logarithm by which kicks, or twists, lower the evidence of each window, (w,)."""
    if any(one.candidate.kind == BODY for one in causes):
        own = WithoutStarts(windows, windows.along(effects_of(causes)).starts()[:4])
        return 2.0 * np.sum(np.log(np.maximum(own.sizes[:, 2:], 1.0)), axis=1)
    own = kicked(windows, causes) if any(one.candidate.kind == SCATTER for one in causes) else None
    if own is None:
        return np.zeros(len(windows))
    return 2.0 * np.sum(np.log(np.maximum(own[0].sizes[:, -KICKS:], 1.0)), axis=1)


def uncorrected(windows: Windows, now: State) -> Array:
    """Return the residuals of a state with the drive's motion as measured, (n,)."""
    restore(windows, now)
    return now.rest + windows.along(effects_of(now.causes)).corrected(now.motion)


def _price_of_motion(windows: Windows) -> Array:
    """Return the squares of the corrections of the drive's motion, in its standard deviations, by windows, (w,)."""
    count = np.bincount(windows.record, minlength=len(windows.zeros))
    return (windows.sampled * np.sum(windows.motion**2, axis=1) / np.maximum(count, 1))[windows.record]


def with_spread(windows: Windows, now: State) -> State:
    """Return a state with the scatter of restitution from its kicks. Source: MacKay 1992, Neural Computation 4(3)."""
    k = next((k for k, one in enumerate(now.causes) if one.candidate.kind == SCATTER), None)
    own = None if k is None else kicked(windows, now.causes)
    if k is None or own is None:
        return now
    level = windows.level(now.rest)
    known = level <= FAR * float(np.median(level))  # kicks of a diverging window are of any size
    rows = [*windows.base, *(row for effect in effects_of(now.causes) for row in effect.rows(windows.values))]
    mean = restitution(rows, windows.values.restitution, np.zeros(1), np.zeros(1))
    kicks, sure = windows.starts.kicks[known], own[1][known]
    sure = np.where((kicks > -mean) & (kicks < 1.0 - mean), sure, 0.0)  # beyond, the rebound is the same
    square = np.sum(sure * kicks**2) / max(float(np.sum(sure**2)), 1e-9) - windows.spread(()) ** 2
    last = now.causes[k]
    size = np.clip(np.sqrt(max(square, 0.0)), 0.1 * SMALLEST * last.candidate.unit, last.candidate.unit)
    causes = (*now.causes[:k], last._replace(numbers=np.array([size])), *now.causes[k + 1 :])
    return state_of(windows, causes, windows.residuals(effects_of(causes)))


def scattering(windows: Windows, known: Sequence[Candidate], now: State, least: float) -> list[State]:
    """Return states with scattering restitution, where flanks are dry and its predicted gain is enough."""
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
    return [polished(windows, best, thorough=True)]


def _promised(windows: Windows, now: State) -> float:
    """Return the first-order fall of chi-square, over its level, by kicks, less their price."""
    along, weight = windows.along(effects_of(now.causes)), windows.weights(now.rest)
    columns, driven = along.starts(), along.driven()
    left = [
        WithoutNuisances(windows, now.rest, own, driven).residuals(now.rest * weight) for own in (columns[:2], columns)
    ]
    kept = left[1][: len(now.rest)]
    level = max(float(np.median(windows.level(kept))), 1e-12)
    fall = float(left[0] @ left[0] - left[1] @ left[1]) / (level * windows.runs(kept))
    return fall - float(_price(windows, now.causes).sum())


def covariance_of(windows: Windows, now: State) -> Array:
    """Return the covariance of all numbers: least squares, at least the scatter over windows [SI], (p, p)."""
    units = np.concatenate([np.zeros(0), *(cause.units for cause in now.causes)])
    if not len(units):
        return np.zeros((0, 0))
    along = windows.along(effects_of(now.causes))
    weight, away = windows.weights(along.rest), nuisances(along)
    own = away(np.array([one * weight for one in columns_of(along, now.causes)])).T
    rest = away.residuals(now.rest * weight)
    size = np.linalg.norm(own, axis=0)  # units differ by orders of magnitude
    size[size == 0.0] = 1.0
    inverse = np.linalg.pinv((own / size).T @ (own / size)) / np.outer(size, size)
    level = max(float(rest @ rest) / max(len(rest) - own.shape[1] - 2 * len(windows), 1), 1.0)
    every, count = windows.every[: len(now.rest)], len(now.rest)
    pulls = np.column_stack([np.bincount(every, (column * rest)[:count], len(windows)) for column in own.T])
    scatter = inverse @ (pulls.T @ pulls) @ inverse
    wide = np.sqrt(np.maximum(np.diag(scatter) / np.maximum(level * np.diag(inverse), 1e-300), 1.0))
    made = (level * inverse * np.outer(wide, wide))[: len(units), : len(units)] * np.outer(units, units)
    kinds = [one.candidate.kind for one in now.causes for _ in one.numbers]
    numbers = np.concatenate([one.numbers for one in now.causes])
    if SCATTER in kinds and (known := kicked(windows, now.causes)) is not None:
        at = kinds.index(SCATTER)
        made[at, at] = numbers[at] ** 2 / (2.0 * max(float(np.sum(known[1] ** 2)), 1e-9))
    if OIL in kinds:
        made[(at := kinds.index(OIL)), at] += (FILMED * numbers[at]) ** 2
    if BODY in kinds:  # its inertia, and the logarithm of the stiffness
        at = kinds.index(BODY)
        made[[at, at + 1], [at, at + 1]] += (SWAYED * np.array([numbers[at], 1.0])) ** 2
    return made
