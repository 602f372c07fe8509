"""A cause with its numbers, and the joint fit of several causes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import FREE, Candidate
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import CHANNELS, added
from gears3d.errors import InputError

Array = np.ndarray
# Step of a number in units, for slopes.
STEP = 1e-3
# Dampings of a step, tried in turn until chi-square falls.
DAMPED = (0.0, 0.01, 1.0)
# The same with a drag of the mesh among the causes: its response is quadratic, so distant steps overshoot.
SQUARED = (*DAMPED, 10.0, 100.0)
# Largest step of a number in a round, in units.
FARTHEST = 3.0
# Fall of chi-square in a round below which the fit ends.
ENOUGH = 0.01


class Cause(NamedTuple):
    """A candidate with its numbers.

    Args:
        candidate: what it is.
        numbers: size, or cosine and minus sine [SI], then the shape's free parameters, most as logarithms, (p,).
    """

    candidate: Candidate
    numbers: Array

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the shape's free parameters."""
        return tuple(name for name in FREE.get(self.candidate.kind, ()) if name in self.candidate.shape)

    @property
    def effect(self) -> Any | None:
        """The effect; ``None`` if it is zero."""
        sizes = 2 if self.candidate.phased else 1
        shape = dict(self.candidate.shape)
        for name, number in zip(self.free, self.numbers[sizes:], strict=True):
            shape[name] = float(np.exp(number) if FREE[self.candidate.kind][name].log else number)
        return self.candidate._replace(shape=shape).effect(self.numbers[:sizes])

    @property
    def possible(self) -> bool:
        """Whether the catalogue admits all numbers: no drag drives a gear."""
        effect: Any = self.effect
        if effect is None:
            return False
        values = ((getattr(effect, name), one) for name, one in effect.params.items())
        return all(one.low <= value <= one.high for value, one in values if isinstance(value, int | float))

    @property
    def units(self) -> Array:
        """Size of a unit of each number, (p,)."""
        sizes = 2 if self.candidate.phased else 1
        bends = [FREE[self.candidate.kind][name] for name in self.free]
        own = [1.0 if bend.log else abs(self.candidate.shape[n]) for n, bend in zip(self.free, bends, strict=True)]
        return np.array([self.candidate.unit] * sizes + own)


def begin(candidate: Candidate, units: Array) -> Cause:
    """Return a candidate at a size.

    Args:
        candidate: what it is.
        units: its numbers in units.
    """
    bends = FREE.get(candidate.kind, {})
    values = [(candidate.shape[name], bend.log) for name, bend in bends.items() if name in candidate.shape]
    free = [np.log(value) if log else value for value, log in values]
    return Cause(candidate, np.concatenate([np.asarray(units) * candidate.unit, free]))


class Fit(NamedTuple):
    """Several causes fitted together.

    Args:
        causes: with their numbers.
        chi2: of all channels.
        covariance: of all numbers, in the order of the causes, by least squares [SI], (p, p).
        rest: residuals, (n,).
    """

    causes: tuple[Cause, ...]
    chi2: float
    covariance: Array
    rest: Array


def contribution(records: Sequence[Evidence], effects: Sequence[Any], names: Sequence[str] = CHANNELS) -> Array:
    """Return the contribution of effects to the predictions of all records, channel by channel, (n,).

    Args:
        records: in their order.
        effects: any.
        names: of the channels.
    """
    return np.concatenate([added(one, effects, name) for name in names for one in records])


def fit(records: Sequence[Evidence], base: Array, causes: Sequence[Cause], rounds: int = 8) -> Fit:
    """Return causes with the numbers of least chi-square.

    base: (n,).
    """
    causes = tuple(causes)
    parts = [_part(records, cause) for cause in causes]
    rest = base - sum(parts, np.zeros_like(base))
    units = np.concatenate([np.zeros(0), *(cause.units for cause in causes)])
    normal = np.zeros((len(units), len(units)))
    pivot = max(float(np.mean([one.radii[0] / one.radii[1] * abs(one.motion.mean) for one in records])), 1e-9)
    dampings = SQUARED if any(cause.candidate.kind == "mesh_drag" for cause in causes) else DAMPED
    for _ in range(rounds if len(units) else 0):
        slopes = np.column_stack([column for k, c in enumerate(causes) for column in slopes_of(records, c, parts[k])])
        normal, right = slopes.T @ slopes, slopes.T @ rest
        before, done = float(rest @ rest), True
        for damping in dampings:
            move = np.linalg.lstsq(normal + damping * np.diag(np.diag(normal)), right, rcond=1e-12)[0]
            try:
                trial = moved(causes, np.clip(move, -FARTHEST, FARTHEST) * units, pivot)
                tried = [_part(records, cause) for cause in trial]
            except InputError:  # beyond the bounds of a parameter
                continue
            left = base - sum(tried)
            if (after := float(left @ left)) < before:
                causes, parts, rest, done = trial, tried, left, before - after < ENOUGH
                break
        if done:
            break
    return Fit(causes, float(rest @ rest), np.linalg.pinv(normal) * np.outer(units, units), rest)


def _part(records: Sequence[Evidence], cause: Cause) -> Array:
    effect = cause.effect
    return contribution(records, [effect] if effect is not None else [])


def slopes_of(records: Sequence[Evidence], cause: Cause, part: Array | None = None) -> list[Array]:
    """Return the derivatives of the predictions with respect to each number of a cause, per unit, each (n,)."""
    part = _part(records, cause) if part is None else part
    found = []
    for k, unit in enumerate(cause.units):
        numbers = cause.numbers.copy()
        numbers[k] += STEP * unit
        found.append((_part(records, cause._replace(numbers=numbers)) - part) / STEP)
    return found


def moved(causes: Sequence[Cause], by: Array, pivot: float) -> tuple[Cause, ...]:
    """Return causes with their numbers moved, shape parameters within their bounds.

    A power keeps its torque at the pivot, a typical speed, while its exponent changes: its coefficient scales with a
    power of that speed, so a linear step fails. The step already contains the first-order part. A torque over a
    difference of speeds is linear in its coefficient and in the product of that and the other speed.

    by: (p,) [SI]; pivot: [rad/s].
    """
    at, made = 0, []
    for cause in causes:
        step = by[at : at + len(cause.numbers)]
        at += len(step)
        numbers = _within(cause, cause.numbers + step)
        if cause.candidate.kind == "drag_power" and cause.free:
            before, after = np.exp(cause.numbers[1]), np.exp(numbers[1])
            numbers[0] += cause.numbers[0] * np.log(pivot) * before * step[1]
            numbers[0] *= pivot ** (before - after)
        if cause.candidate.kind == "drag_differential" and cause.free and numbers[0] != 0.0:
            numbers = _within(cause, np.array([numbers[0], cause.numbers[1] + step[1] * cause.numbers[0] / numbers[0]]))
        made.append(cause._replace(numbers=numbers))
    return tuple(made)


def _within(cause: Cause, numbers: Array) -> Array:
    """Return numbers with those of the shape clipped to their bounds."""
    bends = [FREE[cause.candidate.kind][name] for name in cause.free]
    kept = numbers.copy()
    for k, bend in enumerate(bends, start=len(numbers) - len(bends)):
        ends = (np.log(bend.low), np.log(bend.high)) if bend.log else (bend.low, bend.high)
        kept[k] = np.clip(numbers[k], *ends)
    return kept
