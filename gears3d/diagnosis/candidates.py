"""All candidate causes of a rig, an effect with a fixed shape and a free size each, and their regressors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import pi
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import CHANNELS, added, residuals
from gears3d.effects import Code, Gate, Param, Refined, Rig, built_in, catalogue
from gears3d.errors import InputError

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
# Sizes in units at which regressors are computed: of most effects, and of effects that delay contact loss, whose
# response is quadratic.
SMALL_SIZE, DELAYING_SIZE = 0.01, 0.2
# Drag that defines the units of torques for a rig without any, relative to the inertia of the loose gear [1/s²].
LEAST_DRAG = 1e-3
# Tables of the evidence with the points of each channel.
CHANNEL_TABLES = {"flight": "flights", "contact": "contacts", "impact": "impacts", "loss": "losses", "drive": "drive"}
# Chi-square that a deviation must gain to be assigned to one flank only.
ONE_SIDED = 4.0
# Fraction of a regressor's square that must be independent of the accepted causes.
INDEPENDENT = 1e-5
# Number of regressors that are converted to double precision at a time.
AT_ONCE = 16
_UNITS: dict[bool, Array] = {False: np.eye(1), True: np.eye(2)}
# Number of lines that are examined in each record.
PEAKS = 3
# Ratio of a line to the median line from which it is examined.
LINE_RATIO = 5.0
# Counts of the encoder: samples that beat with its counts make lines of up to 1/pi of a count.
COUNT_LINE = 0.35


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
    told: list[Scored | None] = [None] * len(known.candidates)
    phased = np.array([one.phased for one in known.candidates], bool)
    scale = sum((stack.normal for stack in known.stacks.values()), np.zeros_like(normal))
    for size in (1, 2):
        mine = np.flatnonzero(phased == (size == 2))
        wide = np.sqrt(np.maximum(np.diagonal(scale[mine, :size, :size], axis1=1, axis2=2), 1e-30))
        units, inverse, good = _solved(normal[mine, :size, :size], found[mine, :size, 0], wide)
        for k, own, square in zip(mine[good], units[good], inverse[good], strict=True):
            sigma = np.sqrt(np.maximum(np.diag(square), 0.0))
            told[k] = Scored(known.candidates[k], float(found[k, :size, 0] @ own), own, sigma)
    return sorted((one for one in told if one is not None), key=lambda each: price(each.candidate) - each.gain)


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
