"""The regressors of all candidates: derivatives of the predictions of all channels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import Candidate
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import CHANNELS, added

Array = np.ndarray
# Tables of the evidence with the points of each channel.
TABLES = {"flight": "flights", "contact": "contacts", "impact": "impacts", "loss": "losses", "drive": "drive"}
# Chi-square that a deviation must gain to be assigned to one flank only.
ONE_SIDED = 4.0
# Fraction of a regressor's square that must be independent of the accepted causes.
ALIKE = 1e-5
# Number of regressors that are converted to double precision at a time.
AT_ONCE = 16
_UNITS: dict[bool, Array] = {False: np.eye(1), True: np.eye(2)}


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


class Library(NamedTuple):
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


def library(records: Sequence[Evidence], every: list[Candidate], before: Library | None = None) -> Library:
    """Return the regressors of candidates for some records.

    Those of channels with the same points as in an earlier library are reused.
    """
    spans, parts, at = {}, {}, 0
    for name in CHANNELS:
        parts[name] = _behind([len(added(one, (), name)) for one in records])
        size = parts[name][-1].stop
        spans[name] = slice(at, at + size)
        at += size
    before = before if before is not None and before.candidates == every else None
    stacks = {name: _stack(records, every, name, parts[name], before) for name in CHANNELS}
    return Library(every, stacks, spans, tuple(records), parts)


def _behind(sizes: Sequence[int]) -> list[slice]:
    ends = np.cumsum(sizes).tolist()
    return [slice(end - size, end) for end, size in zip(ends, sizes, strict=True)]


def _stack(
    records: Sequence[Evidence], every: list[Candidate], name: str, parts: list[slice], before: Library | None
) -> Stack:
    """Return the regressors of a channel; those of a record with unchanged points are reused."""
    mine = [k for k, one in enumerate(every) if name in one.channels]
    owner = np.array([k for k in mine for _ in range(1 + every[k].phased)], int)
    number = np.array([j for k in mine for j in range(1 + every[k].phased)], int)
    places = [None if before is None else _among(before.records[k], one, name) for k, one in enumerate(records)]
    if before is not None and all(isinstance(place, slice) for place in places):
        return before.stacks[name]
    effects = [
        one.effect(one.tried * one.unit * size) for one in map(every.__getitem__, mine) for size in _UNITS[one.phased]
    ]
    columns = np.zeros((len(owner), parts[-1].stop), np.float32)
    for k, (record, part, place) in enumerate(zip(records, parts, places, strict=True)):
        if before is not None and place is not None:
            whole = before.stacks[name].columns[:, before.parts[name][k]]
            columns[:, part] = whole if isinstance(place, slice) else _free(record, name, np.take(whole, place, axis=1))
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


def _among(old: Evidence, new: Evidence, name: str) -> slice | Array | None:
    """Return the indices of a channel's points among its former ones; ``None`` if some are new.

    Channels with nuisances other than the datum of contact are only tested for equality.
    """
    before, now = (getattr(one.channels, TABLES[name]) for one in (old, new))
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


def _free(one: Evidence, name: str, columns: Array) -> Array:
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


def score(known: Library, rest: Array, slopes: Array | None = None) -> list[Scored]:
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
    own = value > ALIKE
    vector = vector / scale[:, :, None]
    inverse = (vector * np.where(own, 1.0 / np.where(own, value, 1.0), 0.0)[:, None, :]) @ np.swapaxes(vector, 1, 2)
    good = own[:, -1] & (scale.max(axis=1, initial=0.0) > 1e-9)
    return np.einsum("kij,kj->ki", inverse, right), inverse, good
