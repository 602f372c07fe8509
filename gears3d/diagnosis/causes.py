"""Causes: candidate effects, candidates fitted with numbers, and the criterion by which a fitted cause is accepted.

A candidate is an effect of the catalogue with a shape; its columns are linear in its numbers (score test). A cause is a
candidate with fitted numbers (Gauss-Newton with other causes as nuisance). It is accepted if chi-square falls by more
than ``ACCEPT`` at a size between ``SMALLEST`` and ``LARGEST``, also when fitted with all others, and in most records.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, replace
from math import pi
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import CHANNELS, added, residuals
from gears3d.effects import Code, Gate, Param, Refined, Rig, built_in, catalogue
from gears3d.errors import InputError
from gears3d.identify import Parameter
from gears3d.units import FAMILIES, show

Array = np.ndarray
# Channels in which effects show, by their place; torques in contact delay its loss, errors of sensors have their own.
SHOWS = {
    "geometry": ("contact",),
    "torque": ("flight",),
    "impact": ("impact",),
    "motion": ("drive",),
    "sensor": (),
}
# Rows without a regressor: the force on a flank and the scatter of impacts are not in the evidence.
WITHOUT_REGRESSOR = {Code.TORQUE_FRICTION, Code.IMPACT_SCATTER}
# Sizes in units at which regressors are computed: usual, and of effects that delay contact loss, whose response bends.
SMALL_SIZE, DELAYING_SIZE = 0.01, 0.2
# Drag that defines units of torques for a rig without any, relative to the inertia of the loose gear [1/s²]; largest
# part of a rig's dry drag that a cause may remove: 99.5 % stood for compliant teeth in a blind test (space3, 346).
LEAST_DRAG, MOST_DRAG = 1e-3, 0.95
# Tables of the evidence with the points of each channel.
CHANNEL_TABLES = {"flight": "flights", "contact": "contacts", "impact": "impacts", "loss": "losses", "drive": "drive"}
# Chi-square that a deviation must gain to be assigned to one flank only; speed of a shaft, in those of the loose gear,
# about which a drag is nearly constant.
ONE_SIDED, FASTEST = 4.0, 10.0
# Fraction of a regressor's square that must be independent of the accepted causes.
INDEPENDENT = 1e-5
# Number of regressors that are converted to double precision at a time.
AT_ONCE = 16
_UNITS: dict[bool, Array] = {False: np.eye(1), True: np.eye(2)}
# Number of lines that are examined in each record, and ratio to the median line from which one is examined; counts of
# the encoder: samples that beat with its counts make lines of up to 1/pi of a count.
PEAKS, LINE_RATIO, COUNT_LINE = 3, 5.0, 0.35


def _refined(effect: Any) -> dict[str, Refined]:
    return {name: one.refined for name, one in effect.params.items() if one.refined is not None}


def _is_linear(effect: Any) -> bool:
    return next(iter(effect.params.values())).linear


# Shape parameters that are refined once the cause is accepted, by kind. A kind whose response is not linear has no such
# parameter, but needs as many rounds.
FREE: dict[str, dict[str, Refined]] = {
    kind: _refined(one) for kind, one in built_in().items() if _refined(one) or not _is_linear(one)
}


class Candidate(NamedTuple):
    """One cause with a fixed shape and a free size.

    Args:
        kind: of the effect.
        shape: fixed parameters.
        size: name of the free parameter.
        unit: size that changes its channel by 100 %.
        phased: whether its phase is free, too; it then has two numbers, a cosine's and minus a sine's.
        channels: in which it shows.
        tried: size in units at which its regressor is computed.
    """

    kind: str
    shape: dict[str, Any]
    size: str
    unit: float
    phased: bool
    channels: tuple[str, ...]
    tried: float = SMALL_SIZE

    def effect(self, numbers: Array) -> Any | None:
        """Return the effect of given numbers; ``None`` for numbers of no effect.

        Args:
            numbers: size, or cosine and minus sine, [SI].
        """
        size = float(np.hypot(*numbers)) if self.phased else float(numbers[0])
        if size == 0.0:
            return None
        phase = {"phase": float(np.arctan2(-numbers[1], numbers[0]))} if self.phased else {}
        return catalogue()[self.kind](**self.shape, **phase, **{self.size: size})


def candidates(
    rig: Rig, duration: float, highest: int, frequencies: tuple[float, ...] = (), orders: tuple[float, ...] = ()
) -> list[Candidate]:
    """Return all candidate causes of a rig: each effect that has a regressor, with each tried shape.

    duration: of a record [s]; frequencies: tried, of the drive's motion [Hz]; orders: the same, of its mean speed.
    """
    found = []
    for place in SHOWS:
        for effect in (one for one in built_in().values() if one.place == place):
            if place == "motion":
                shapes = [{"frequency": x} for x in frequencies] + [{"order": x} for x in orders]
            else:
                shapes = _shapes(effect, rig, duration, highest)
            found += [_candidate(effect, shape, rig) for shape in shapes]
    return [one for one in found if one is not None]


def _shapes(effect: Any, rig: Rig, duration: float, highest: int) -> list[dict[str, Any]]:
    """Return the tried shapes of an effect, gear by gear; none if a parameter has no values to try."""
    shapes: list[dict[str, Any]] = [{}]
    _, *names = (name for name in effect.params if name != "phase")
    for name in sorted(names, key="gear".__ne__):
        shapes = [
            {**shape, name: value}
            for shape in shapes
            for value in _tried(name, effect.params[name], shape, rig, duration, highest)
        ]
    return shapes


def _tried(
    name: str, one: Param, shape: dict[str, Any], rig: Rig, duration: float, highest: int
) -> Sequence[float | str]:
    if name == "order":
        return range(1, highest + 1)
    if name == "tooth":
        return range(1, (rig.teeth_drive if shape["gear"] == "drive" else rig.teeth_loose) + 1)
    scale = {"speed": max(rig.mean_speed_loose, 1e-9), "time": duration}.get(one.family)
    return one.tried or one.choices if scale is None else [scale * value for value in one.tried]


def _candidate(effect: Any, shape: dict[str, Any], rig: Rig) -> Candidate | None:
    """Return an effect of a shape as a candidate; ``None`` if it has no regressor, or does not fit the rig."""
    size = next(iter(effect.params))
    plain = {name: 0.0 for name, one in _refined(effect).items() if name in shape and not one.log}
    try:
        usual = effect(**{**shape, **plain, size: 0.0})  # a tried speed near that of the gear has no large unit
        unit = usual.unit_size(rig) or usual.unit_size(replace(rig, drag_torque=LEAST_DRAG * rig.inertia))
        rows = effect(**{**shape, size: unit}).rows(rig)
    except InputError:
        return None
    if WITHOUT_REGRESSOR & {row.code for row in rows}:
        return None
    shows = SHOWS[effect.place]
    if effect.place == "sensor":
        by_angle = {"drive": ("drive",), "loose": ("flight",)}[shape["gear"]] if "order" in shape else ()
        shows = ("contact", *by_angle)
    elif any(row.gate == Gate.CONTACT for row in rows):
        shows = ("loss",)
    tried = SMALL_SIZE if _is_linear(effect) else DELAYING_SIZE
    return Candidate(effect.kind, shape, size, unit, "phase" in effect.params, shows, tried)


class Scored(NamedTuple):
    """Gain of one candidate in addition to the accepted causes.

    Args:
        candidate: which.
        gain: fall of chi-square.
        units: its numbers in units of its size, (k,).
        sigma: their standard deviations, (k,).
    """

    candidate: Candidate
    gain: float
    units: Array
    sigma: Array


class Stack(NamedTuple):
    """Regressors of one channel.

    Args:
        columns: per unit of size, float32 (r, n of the channel).
        owner: candidate of each, (r,).
        number: of the candidate's numbers, 0 or 1, (r,).
        normal: products of the regressors of each candidate, (candidates, 2, 2).
    """

    columns: Array
    owner: Array
    number: Array
    normal: Array


class Regressors(NamedTuple):
    """Candidates and their regressors.

    Args:
        candidates: all.
        stacks: their regressors, by channel.
        spans: position of channels in the stacked residuals, by name.
        records: of the regressors.
        parts: position of each record in the regressors of a channel, by name.
    """

    candidates: list[Candidate]
    stacks: dict[str, Stack]
    spans: dict[str, slice]
    records: tuple[Evidence, ...]
    parts: dict[str, list[slice]]

    def square(self, which: int) -> float:
        """Return the chi-square of a unit of a candidate's first number."""
        return sum(float(one.normal[which, 0, 0]) for one in self.stacks.values())


def regressors_of(records: Sequence[Evidence], every: list[Candidate], before: Regressors | None = None) -> Regressors:
    """Return the regressors of candidates for some records.

    Those of channels with the same points as in an earlier library are reused.
    """
    spans, parts, at = {}, {}, 0
    for name in CHANNELS:
        parts[name] = _consecutive([len(added(one, (), name)) for one in records])
        size = parts[name][-1].stop
        spans[name] = slice(at, at + size)
        at += size
    before = before if before is not None and before.candidates == every else None
    stacks = {name: _stack(records, every, name, parts[name], before) for name in CHANNELS}
    return Regressors(every, stacks, spans, tuple(records), parts)


def _consecutive(sizes: Sequence[int]) -> list[slice]:
    ends = np.cumsum(sizes).tolist()
    return [slice(end - size, end) for end, size in zip(ends, sizes, strict=True)]


def _stack(
    records: Sequence[Evidence], every: list[Candidate], name: str, parts: list[slice], before: Regressors | None
) -> Stack:
    """Return the regressors of a channel; those of a record with unchanged points are reused."""
    mine = [k for k, one in enumerate(every) if name in one.channels]
    owner = np.array([k for k in mine for _ in range(1 + every[k].phased)], int)
    number = np.array([j for k in mine for j in range(1 + every[k].phased)], int)
    places = [
        None if before is None else _former_indices(before.records[k], one, name) for k, one in enumerate(records)
    ]
    if before is not None and all(isinstance(place, slice) for place in places):
        return before.stacks[name]
    effects = [
        one.effect(one.tried * one.unit * size) for one in map(every.__getitem__, mine) for size in _UNITS[one.phased]
    ]
    columns = np.zeros((len(owner), parts[-1].stop), np.float32)
    for k, (record, part, place) in enumerate(zip(records, parts, places, strict=True)):
        if before is not None and place is not None:
            whole = before.stacks[name].columns[:, before.parts[name][k]]
            columns[:, part] = (
                whole if isinstance(place, slice) else _without_datum(record, name, np.take(whole, place, axis=1))
            )
            continue
        for row, (which, effect) in enumerate(zip(owner, effects, strict=True)):
            columns[row, part] = added(record, [effect], name) / every[which].tried
    return Stack(columns, owner, number, _normal(columns, owner, number, len(every)))


def _normal(columns: Array, owner: Array, number: Array, count: int) -> Array:
    """Return the products of the regressors of each candidate, (count, 2, 2)."""
    made = np.zeros((count, 2, 2))
    begins = np.flatnonzero(number == 0)
    for begin, end in zip(begins, np.append(begins[1:], len(owner))[: len(begins)], strict=True):
        own = columns[begin:end].astype(float)
        made[owner[begin], : end - begin, : end - begin] = own @ own.T
    return made


def _former_indices(old: Evidence, new: Evidence, name: str) -> slice | Array | None:
    """Return the indices of a channel's points among its former ones; ``None`` if some are new.

    Channels with nuisances other than the datum of contact are only tested for equality.
    """
    before, now = (getattr(one.channels, CHANNEL_TABLES[name]) for one in (old, new))
    if before is now:
        return slice(None)
    if name not in ("contact", "impact") or len(now.time) > len(before.time):
        return None
    if name == "contact" and new.channels.flicker.place > 0.0:  # points are whitened by the preceding ones
        return None
    order = np.argsort(before.time, kind="stable")
    place = order[np.minimum(np.searchsorted(before.time, now.time, sorter=order), len(order) - 1)]
    same = all(np.array_equal(one[place], other) for one, other in zip(before, now, strict=True))
    return place if same else None


def _without_datum(one: Evidence, name: str, columns: Array) -> Array:
    """Return regressors at some of their points without the nuisances of these."""
    if name != "contact" or not columns.size:
        return columns
    sure = 1.0 / one.channels.contacts.sigma
    zero = (sure / np.linalg.norm(sure)).astype(columns.dtype)
    for first in range(0, len(columns), AT_ONCE):
        rows = slice(first, first + AT_ONCE)
        columns[rows] -= (columns[rows] @ zero)[:, None] * zero
    return columns


def price(candidate: Candidate) -> float:
    """Return the chi-square by which a candidate must be better than one on both flanks to be preferred."""
    return ONE_SIDED if candidate.shape.get("flank", "both") != "both" else 0.0


def score(known: Regressors, rest: Array, slopes: Array | None = None) -> list[Scored]:
    """Return the gain of each candidate, largest first.

    rest: residuals with the accepted causes, (n,); slopes: of their numbers, orthonormal, (n, p).
    """
    wanted = rest[:, None] if slopes is None else np.column_stack([rest, slopes])
    normal, found = np.zeros((len(known.candidates), 2, 2)), np.zeros((len(known.candidates), 2, wanted.shape[1]))
    for name, stack in known.stacks.items():
        normal += stack.normal
        found[stack.owner, stack.number] += _products(stack.columns, wanted[known.spans[name]])
    normal -= found[..., 1:] @ np.swapaxes(found[..., 1:], 1, 2)
    scored: list[Scored | None] = [None] * len(known.candidates)
    phased = np.array([one.phased for one in known.candidates], bool)
    scale = sum((stack.normal for stack in known.stacks.values()), np.zeros_like(normal))
    for size in (1, 2):
        mine = np.flatnonzero(phased == (size == 2))
        wide = np.sqrt(np.maximum(np.diagonal(scale[mine, :size, :size], axis1=1, axis2=2), 1e-30))
        units, inverse, good = _solved(normal[mine, :size, :size], found[mine, :size, 0], wide)
        for k, own, square in zip(mine[good], units[good], inverse[good], strict=True):
            sigma = np.sqrt(np.maximum(np.diag(square), 0.0))
            scored[k] = Scored(known.candidates[k], float(found[k, :size, 0] @ own), own, sigma)
    return sorted((one for one in scored if one is not None), key=lambda each: price(each.candidate) - each.gain)


def _products(columns: Array, wanted: Array) -> Array:
    """Return the products of regressors with others, (r, q), a few at a time in double precision."""
    made = np.zeros((len(columns), wanted.shape[1]))
    wanted = np.ascontiguousarray(wanted)
    for first in range(0, len(columns), AT_ONCE):
        rows = slice(first, first + AT_ONCE)
        made[rows] = columns[rows].astype(float) @ wanted
    return made


def _solved(normal: Array, right: Array, scale: Array) -> tuple[Array, Array, Array]:
    """Return the least-squares numbers, their covariance, and whether the regressors are independent of the causes.

    The products of the regressors are without the projections on accepted causes.

    normal: (k, size, size); right: (k, size); scale: (k, size).
    """
    value, vector = np.linalg.eigh(normal / (scale[:, :, None] * scale[:, None, :]))
    own = value > INDEPENDENT
    vector = vector / scale[:, :, None]
    inverse = (vector * np.where(own, 1.0 / np.where(own, value, 1.0), 0.0)[:, None, :]) @ np.swapaxes(vector, 1, 2)
    good = own[:, -1] & (scale.max(axis=1, initial=0.0) > 1e-9)
    return np.einsum("kij,kj->ki", inverse, right), inverse, good


def drive_lines(records: Sequence[Evidence]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the strongest lines of the drive's deviation from its nominal motion.

    As frequencies [Hz], and the same lines as orders of the mean speed.
    """
    frequencies, orders = [], []
    for one in records:
        drive = one.drive
        if len(drive.time) < 64:
            continue
        spectrum = np.abs(np.fft.rfft(residuals(one)["drive"] * np.hanning(len(drive.time))))
        at = np.fft.rfftfreq(len(drive.time), drive.width)
        peak = np.flatnonzero((spectrum[1:-1] >= spectrum[:-2]) & (spectrum[1:-1] > spectrum[2:])) + 1
        strong = peak[spectrum[peak] > max(LINE_RATIO * np.median(spectrum), _line_of_counts(one))]
        for k in strong[np.argsort(-spectrum[strong])][:PEAKS]:
            left, here, right = np.log(spectrum[k - 1 : k + 2] + 1e-300)
            shift = 0.5 * (left - right) / (left - 2.0 * here + right)
            frequency = float((k + shift) * (at[1] - at[0]))
            frequencies.append(frequency)
            if one.motion.mean:
                orders.append(2.0 * pi * frequency / abs(one.motion.mean))
    return tuple(frequencies), tuple(orders)


def _line_of_counts(one: Evidence) -> float:
    """Return the height of a line that the counts of the drive's encoder may cause."""
    drive, counts = one.channels.drive, one.scenario.sensors.drive.counts_per_revolution
    if not counts:
        return 0.0
    return COUNT_LINE * 2.0 * pi / counts * 0.25 * len(drive.time) / drive.sigma  # half of the mean of a Hann window


# Step of a number in units, for slopes; fall of chi-square in a round below which the fit ends.
SLOPE_STEP, CONVERGED = 1e-3, 0.01
# Dampings of a step, tried in turn until chi-square falls.
DAMPINGS = (0.0, 0.01, 1.0)
# The same with a drag of the mesh among the causes: its response is quadratic, so distant steps overshoot.
QUADRATIC_DAMPINGS = (*DAMPINGS, 10.0, 100.0)
# Largest step of a number in a round, in units; part of a carried inertia that it leaves at least.
LARGEST_STEP, FEWEST_PART = 3.0, 0.3
# Relative standard deviation of numbers, and of phases [rad], by errors of the model, of the drive's curve between
# readings and of segmentation: in 62 rigs of the blind benchmark (kinds, 124; space, 130 to 169) with little noise, 15
# of 17 numbers whose own intervals missed the truth were off by 0.11 % at most.
MODEL = 0.001
# Digits of numbers in a scenario: without an interval; fewest and most with one.
DIGITS, FEWEST_DIGITS, MOST_DIGITS = 8, 3, 12


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
    def ended(self) -> bool:
        """Whether a change in time ends as early as it may: the records show a constant torque, not its change."""
        times = [one for one in self.free if one == "time_constant"]
        return any(self.numbers[-1] <= np.log(FREE[self.candidate.kind][one].low) for one in times)

    @property
    def possible(self) -> bool:
        """Whether the catalogue admits all numbers: no drag drives a gear, some dry drag is left, no drift ended."""
        effect, least = self.effect, -MOST_DRAG * self.candidate.unit
        if effect is None or self.ended or (self.candidate.kind == "drag_coulomb" and self.numbers[0] <= least):
            return False
        values = ((getattr(effect, name), one) for name, one in effect.params.items())
        return all(one.low <= value <= one.high for value, one in values if isinstance(value, int | float))

    @property
    def units(self) -> Array:
        """Size of a unit of each number, (p,)."""
        sizes = 2 if self.candidate.phased else 1
        bends, shape = [FREE[self.candidate.kind][name] for name in self.free], self.candidate.shape
        own = [x.unit or (1.0 if x.log else abs(shape[n])) for n, x in zip(self.free, bends, strict=True)]
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
        numbers = within_bounds(cause, cause.numbers + step)
        if cause.candidate.kind == "drag_power" and cause.free:
            before, after = np.exp(cause.numbers[1]), np.exp(numbers[1])
            numbers[0] += cause.numbers[0] * np.log(pivot) * before * step[1]
            numbers[0] *= pivot ** (before - after)
        if cause.candidate.kind == "drag_differential" and cause.free and numbers[0] != 0.0:
            speed = cause.numbers[1] + step[1] * cause.numbers[0] / numbers[0]
            if numbers[0] < 0.0:  # nearest possible: the same torque, nearly constant
                torque, speed = numbers[0] * (pivot - speed), -FASTEST * pivot * np.sign(speed - pivot)
                numbers[0] = torque / (pivot - speed)
            numbers = within_bounds(cause, np.array([numbers[0], speed]))
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


def within_bounds(cause: Cause, numbers: Array) -> Array:
    """Return numbers clipped to their bounds: of the shape, and of a drag that must not drive the gear."""
    kept, first = numbers.copy(), len(numbers) - len(cause.free)
    if cause.candidate.kind == "drag_coulomb":
        kept[0] = max(kept[0], -MOST_DRAG * cause.candidate.unit)
    for k, bend in enumerate((FREE[cause.candidate.kind][name] for name in cause.free), start=first):
        ends = (np.log(bend.low), np.log(bend.high)) if bend.log else (bend.low, bend.high)
        kept[k] = np.clip(numbers[k], *ends)
    return kept


def parameters(cause: Cause, covariance: Array, unsure: float = 0.0, widths: Any = None) -> dict[str, Parameter]:
    """Return the free parameters of a cause with 95 % intervals, at least as wide as the model errs.

    covariance: (p, p) [SI]; unsure: standard deviation of the size [SI] by what is not known of the rig; widths:
    factors on standard deviations below and above, of an order those of amplitude and phase, (p, 2); by default 1.
    """
    effect: Any = cause.effect
    found, sizes = {}, 2 if cause.candidate.phased else 1
    wide = np.ones((len(cause.numbers), 2)) if widths is None else widths
    numbers, units, name, errs = cause.numbers, _units(effect), cause.candidate.size, MODEL
    if effect.kind == "tooth_compliance":  # MODEL is of the backlash, and stiff teeth yield little of it
        errs *= float(np.sqrt(2.0 * max(numbers[0] / cause.candidate.unit, 0.5)))
    if cause.candidate.phased:
        size = float(np.hypot(*numbers[:2]))
        toward = numbers[:2] / max(size, 1e-300)
        across = np.array([-toward[1], toward[0]])
        own = covariance[:2, :2]
        sigma = np.hypot(wide[0] * np.sqrt(toward @ own @ toward), np.hypot(MODEL * size, unsure))
        found[name] = _parameter(size, sigma, units[name])
        turn = np.hypot(np.max(wide[1]) * np.sqrt(across @ own @ across) / max(size, 1e-300), MODEL)
        found["phase"] = _parameter(float(effect.phase), turn, units["phase"])
    else:
        sigma = np.hypot(wide[0] * np.sqrt(covariance[0, 0]), np.hypot(errs * numbers[0], unsure))
        found[name] = _parameter(float(numbers[0]), sigma, units[name])
    for k, free in enumerate(cause.free, start=sizes):
        value, bend = float(getattr(effect, free)), FREE[cause.candidate.kind][free]
        own = float(np.sqrt(covariance[k, k])) * (abs(value) if bend.log else 1.0)
        error = errs * value if bend.unit is None else errs * bend.unit * (value if bend.log else 1.0)
        found[free] = _parameter(value, np.hypot(wide[k] * own, error), units[free])
    return found


def _parameter(value: float, sigma: Any, unit: str) -> Parameter:
    """Return a number with its 95 % interval, by its standard deviation, or by those below and above it."""
    below, above = np.broadcast_to(sigma, 2).tolist()
    return Parameter(value, unit, value - 1.96 * below, value + 1.96 * above)


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


def gear_of(kind: str, gear: str | None) -> str:
    """Return the gear whose angle a cause depends on; empty without one.

    >>> gear_of("backlash_variation", None), gear_of("eccentricity", "loose"), gear_of("encoder_skew", "loose")
    ('drive', 'loose', '')
    """
    params = catalogue()[kind].params.values()  # type: ignore[attr-defined]
    return next((gear or "" if one.of == "gear" else one.of for one in params if one.of), "")


def goes_by(one: Candidate) -> str:
    """Return the gear whose angle a candidate depends on; empty without one."""
    return gear_of(one.kind, one.shape.get("gear"))


# Threshold Δχ² of a cause: false alarm probability 0.03 % over a thousand candidates of two numbers.
ACCEPT = 30.0
# The same of a cause of a predicted path, over the level of chi-square: by chance, among three thousand numbers, 1e-6.
ACCEPT_PATH = 40.0
# Size in units of its channel below which a cause is ignored: errors of segmentation, and of smoothing the drive's
# motion, have this size.
SMALLEST = 0.01
# Size in units above which a cause is rejected: it compensates another. The drive's motion is measured as such, and may
# be of any size.
LARGEST = 3.0
# Chi-square over its level by which a competing hypothesis must be worse to be excluded: four standard deviations.
EXCLUDED = 16.0
# Model error, as part of the chi-square that all causes explain: the square of 0.3 %, the error of sizes in records
# without noise. A cause must gain more, and a hypothesis is excluded only if it is worse by more.
MODEL_ERROR = 1e-5
# Torques with a fitted shape: another of the kind would only compensate the residual of the first.
ONCE = tuple(
    kind for kind, one in built_in().items() if any(each.tried and each.refined for each in one.params.values())
)
# Expected chi-square gain of a cause in a record above which its absence there counts.
EXPECTED_GAIN = 10.0


def acceptable(left: Sequence[Scored], more: Mapping[str, float], causes: Sequence[Cause] = ()) -> list[Scored]:
    """Return the candidates that gain enough at a relevant size, largest gain first.

    If a candidate that is too small gains more in the same channel, it is the cause, and others only resemble it. An
    accepted cause is not added again: its residual does not have its form.

    left: largest gain first; more: threshold for the free phases of each gear, beyond ``ACCEPT``.
    """
    able, small = [], set()
    there = [(one.candidate.kind, one.candidate.shape) for one in causes if not FREE.get(one.candidate.kind)]
    once = {one.candidate.kind for one in causes if one.candidate.kind in ONCE}
    for one in left:
        if one.gain <= ACCEPT:
            break
        if (one.candidate.kind, one.candidate.shape) in there or one.candidate.kind in once:
            continue
        if one.gain <= ACCEPT + more[goes_by(one.candidate)]:
            continue
        size = float(np.hypot.reduce(one.units))
        if size <= SMALLEST:
            small |= set(one.candidate.channels)
        elif size < _largest(one.candidate) and not small & set(one.candidate.channels):
            able.append(one)
    return able


def is_accepted(records: Sequence[Evidence], cause: Cause, less: Fit, now: Fit, more: Mapping[str, float]) -> bool:
    """Return whether a fitted cause is accepted: its size is possible, and it gains enough in most of the records.

    Most are of those in which it should show, so that one poorly segmented record does not decide.

    less, now: fits without and with it; more: threshold for the free phases of each gear, beyond ``ACCEPT``.
    """
    if less.chi2 - now.chi2 < ACCEPT + more[goes_by(cause.candidate)] or not has_possible_size(cause):
        return False
    owner = [np.full(len(added(one, (), name)), k) for name in CHANNELS for k, one in enumerate(records)]
    expected = np.bincount(np.concatenate(owner), (less.rest - now.rest) ** 2, len(records))
    gained = np.bincount(np.concatenate(owner), less.rest**2 - now.rest**2, len(records))
    asked = expected > EXPECTED_GAIN
    return bool(np.sum(gained[asked] > 0.25 * expected[asked]) > 0.5 * np.sum(asked)) or not np.any(asked)


def excluding(gain: float) -> float:
    """Return the chi-square over its level by which a hypothesis must be worse to be excluded.

    gain: what the better one explains, over its level.
    """
    return max(EXCLUDED, MODEL_ERROR * gain)


def has_possible_size(cause: Cause) -> bool:
    """Return whether the size of a cause is possible for a rig."""
    sizes = 2 if cause.candidate.phased else 1
    size = float(np.hypot.reduce(cause.numbers[:sizes])) / cause.candidate.unit
    return SMALLEST / 2.0 < size < _largest(cause.candidate) and cause.possible


def _largest(one: Candidate) -> float:
    return np.inf if one.kind == "drive_motion" else LARGEST
