"""A cause with its numbers, the joint fit of several causes, and a cause in the words and units of a scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import FREE, Candidate
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import CHANNELS, added
from gears3d.errors import InputError
from gears3d.identify import Parameter
from gears3d.units import FAMILIES, show

Array = np.ndarray
# Step of a number in units, for slopes.
SLOPE_STEP = 1e-3
# Dampings of a step, tried in turn until chi-square falls.
DAMPINGS = (0.0, 0.01, 1.0)
# The same with a drag of the mesh among the causes: its response is quadratic, so distant steps overshoot.
QUADRATIC_DAMPINGS = (*DAMPINGS, 10.0, 100.0)
# Largest step of a number in a round, in units.
LARGEST_STEP = 3.0
# Part of a carried inertia that a round leaves at least.
FEWEST_PART = 0.3
# Fall of chi-square in a round below which the fit ends.
CONVERGED = 0.01
# Relative standard deviation of numbers, and of phases [rad], by errors of the model, of the drive's curve between
# readings and of segmentation: in 62 rigs of the blind benchmark (kinds, 124; space, 130 to 169) with little noise, 15
# of 17 numbers whose own intervals missed the truth were off by 0.11 % at most.
MODEL = 0.001
# Digits of numbers without an interval in a scenario.
DIGITS = 8
# Digits of those with an interval.
FEWEST_DIGITS, MOST_DIGITS = 3, 12


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
    parts = [_contribution(records, cause) for cause in causes]
    rest = base - sum(parts, np.zeros_like(base))
    units = np.concatenate([np.zeros(0), *(cause.units for cause in causes)])
    normal = np.zeros((len(units), len(units)))
    pivot = max(float(np.mean([one.radii[0] / one.radii[1] * abs(one.motion.mean) for one in records])), 1e-9)
    dampings = QUADRATIC_DAMPINGS if any(cause.candidate.kind == "mesh_drag" for cause in causes) else DAMPINGS
    for _ in range(rounds if len(units) else 0):
        slopes = np.column_stack([column for k, c in enumerate(causes) for column in slopes_of(records, c, parts[k])])
        normal, right = slopes.T @ slopes, slopes.T @ rest
        before, done = float(rest @ rest), True
        for damping in dampings:
            move = np.linalg.lstsq(normal + damping * np.diag(np.diag(normal)), right, rcond=1e-12)[0]
            try:
                trial = moved(causes, np.clip(move, -LARGEST_STEP, LARGEST_STEP) * units, pivot)
                tried = [_contribution(records, cause) for cause in trial]
            except InputError:  # beyond the bounds of a parameter
                continue
            left = base - sum(tried)
            if (after := float(left @ left)) < before:
                causes, parts, rest, done = trial, tried, left, before - after < CONVERGED
                break
        if done:
            break
    return Fit(causes, float(rest @ rest), np.linalg.pinv(normal) * np.outer(units, units), rest)


def _contribution(records: Sequence[Evidence], cause: Cause) -> Array:
    effect = cause.effect
    return contribution(records, [effect] if effect is not None else [])


def slopes_of(records: Sequence[Evidence], cause: Cause, part: Array | None = None) -> list[Array]:
    """Return the derivatives of the predictions with respect to each number of a cause, per unit, each (n,)."""
    part = _contribution(records, cause) if part is None else part
    found = []
    for k, unit in enumerate(cause.units):
        numbers = cause.numbers.copy()
        numbers[k] += SLOPE_STEP * unit
        found.append((_contribution(records, cause._replace(numbers=numbers)) - part) / SLOPE_STEP)
    return found


def moved(causes: Sequence[Cause], by: Array, pivot: float) -> tuple[Cause, ...]:
    """Return causes with their numbers moved, shape parameters within their bounds.

    A power keeps its torque at the pivot, a typical speed, while its exponent changes: its coefficient scales with a
    power of that speed, so a linear step fails. The step already contains the first-order part. A torque over a
    difference of speeds is linear in its coefficient and in the product of that and the other speed. A carried body is
    felt by its natural frequency, in which the step is straight.

    by: (p,) [SI]; pivot: [rad/s].
    """
    at, made = 0, []
    for cause in causes:
        step = by[at : at + len(cause.numbers)]
        at += len(step)
        numbers = _within_bounds(cause, cause.numbers + step)
        if cause.candidate.kind == "drag_power" and cause.free:
            before, after = np.exp(cause.numbers[1]), np.exp(numbers[1])
            numbers[0] += cause.numbers[0] * np.log(pivot) * before * step[1]
            numbers[0] *= pivot ** (before - after)
        if cause.candidate.kind == "drag_differential" and cause.free and numbers[0] != 0.0:
            numbers = _within_bounds(
                cause, np.array([numbers[0], cause.numbers[1] + step[1] * cause.numbers[0] / numbers[0]])
            )
        if cause.candidate.kind == "carried_inertia":
            numbers[:2] = _swinging(cause, step)
        made.append(cause._replace(numbers=numbers))
    return tuple(made)


def swings(cause: Cause) -> tuple[float, Array]:
    """Return the natural frequency of a carried body and its gear [rad/s], and the slopes of its logarithm, (2,).

    Of slopes to inertia and logarithm of stiffness.
    """
    own, body = cause.candidate.unit, float(cause.numbers[0])
    turn = float(np.sqrt(np.exp(cause.numbers[1]) * (1.0 / own + 1.0 / body)))
    return turn, np.array([-0.5 * own / (body * (own + body)), 0.5])


def _swinging(cause: Cause, step: Array) -> Array:
    """Return inertia and logarithm of stiffness of a carried body after a step: straight is the natural frequency."""
    turn, slopes = swings(cause)
    inertia = float(cause.numbers[0]) * max(1.0 + step[0] / float(cause.numbers[0]), FEWEST_PART)
    squared = 2.0 * (np.log(turn) + float(slopes @ step[:2]))
    return np.array([inertia, squared - np.log(1.0 / cause.candidate.unit + 1.0 / inertia)])


def _within_bounds(cause: Cause, numbers: Array) -> Array:
    """Return numbers with those of the shape clipped to their bounds."""
    bends = [FREE[cause.candidate.kind][name] for name in cause.free]
    kept = numbers.copy()
    for k, bend in enumerate(bends, start=len(numbers) - len(bends)):
        ends = (np.log(bend.low), np.log(bend.high)) if bend.log else (bend.low, bend.high)
        kept[k] = np.clip(numbers[k], *ends)
    return kept


def parameters(cause: Cause, covariance: Array, unsure: float = 0.0) -> dict[str, Parameter]:
    """Return the free parameters of a cause with 95 % intervals, at least as wide as the model errs.

    covariance: (p, p) [SI]; unsure: standard deviation of the size [SI] by what is not known of the rig.
    """
    effect: Any = cause.effect
    found, sizes = {}, 2 if cause.candidate.phased else 1
    numbers, units = cause.numbers, _units(effect)
    name = cause.candidate.size
    errs = MODEL
    if effect.kind == "tooth_compliance":  # MODEL is of the backlash, and stiff teeth yield little of it
        errs *= float(np.sqrt(2.0 * max(numbers[0] / cause.candidate.unit, 0.5)))
    if cause.candidate.phased:
        size = float(np.hypot(*numbers[:2]))
        toward = numbers[:2] / max(size, 1e-300)
        across = np.array([-toward[1], toward[0]])
        own = covariance[:2, :2]
        sigma = float(np.hypot(np.sqrt(toward @ own @ toward), np.hypot(MODEL * size, unsure)))
        found[name] = _parameter(size, sigma, units[name])
        turn = float(np.hypot(np.sqrt(across @ own @ across) / max(size, 1e-300), MODEL))
        found["phase"] = _parameter(float(effect.phase), turn, units["phase"])
    else:
        sigma = float(np.hypot(np.sqrt(covariance[0, 0]), np.hypot(errs * numbers[0], unsure)))
        found[name] = _parameter(float(numbers[0]), sigma, units[name])
    for k, free in enumerate(cause.free, start=sizes):
        value = float(getattr(effect, free))
        own = float(np.sqrt(covariance[k, k])) * (abs(value) if FREE[cause.candidate.kind][free].log else 1.0)
        found[free] = _parameter(value, float(np.hypot(own, errs * value)), units[free])
    return found


def _parameter(value: float, sigma: float, unit: str) -> Parameter:
    return Parameter(value, unit, value - 1.96 * sigma, value + 1.96 * sigma)


def _units(effect: Any) -> dict[str, str]:
    """Return the SI unit of each parameter of an effect."""
    return {name: FAMILIES[param.family].si if param.family in FAMILIES else ""
            for name, param in effect.params.items()}  # fmt: skip


def table(effect: Any, numbers: Mapping[str, Parameter] | None = None, digits: int = DIGITS) -> dict[str, Any]:
    """Return an effect as its table under ``[[effect]]`` of a scenario, numbers rounded by their intervals.

    >>> from gears3d.effects import catalogue
    >>> table(catalogue()["transmission_error"](amplitude=2e-5, order=3))
    {'kind': 'transmission_error', 'amplitude': '20 um', 'order': 3, 'phase': '0 deg', 'gear': 'drive', 'flank': 'both'}
    >>> table(catalogue()["restitution_offset"](offset=0.1 / 3.0), {"offset": Parameter(0.1 / 3.0, "", 0.03, 0.036)})
    {'kind': 'restitution_offset', 'offset': 0.0333}
    """
    written: dict[str, Any] = {"kind": effect.kind}
    defaults = {one.name: one.default for one in fields(effect) if one.default is not MISSING}
    for name, param in effect.params.items():
        value = getattr(effect, name)
        if name in defaults and value == defaults[name] and name in ("frequency", "order") and value == 0.0:
            continue
        worth = significant_digits(numbers[name]) if numbers is not None and name in numbers else digits
        if param.family in ("choice", "count", "ratio"):
            written[name] = float(f"{value:.{worth}g}") if isinstance(value, float) else value
        else:
            written[name] = show(value, getattr(effect, f"{name}_family", param.family), worth)
    return written


def significant_digits(number: Parameter) -> int:
    """Return the significant digits of a number: rounding changes it by at most 5 % of its 95 % interval.

    >>> significant_digits(Parameter(41.69612, "", 41.69533, 41.69691))
    7
    >>> significant_digits(Parameter(1.0, "", 0.2, 1.8))
    3
    """
    half = 0.5 * (number.high - number.low)
    if not (number.value and half > 0.0 and np.isfinite(half)):
        return FEWEST_DIGITS
    return int(
        np.clip(np.floor(np.log10(abs(number.value))) - np.floor(np.log10(0.1 * half)) + 1, FEWEST_DIGITS, MOST_DIGITS)
    )


def significance(gain: float) -> str:
    """Return a fall of chi-square as standard deviations, limited to 1000.

    >>> significance(144.0), significance(1e10)
    ('12 sigma', 'over 1000 sigma')
    """
    far = float(np.sqrt(max(gain, 0.0)))
    return f"{far:.3g} sigma" if far < 1000.0 else "over 1000 sigma"
