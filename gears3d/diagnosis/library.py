"""The columns of all candidates: how the predictions of all channels change with each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import Candidate
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import CHANNELS, added

Array = np.ndarray
TABLES = {"flight": "flights", "contact": "contacts", "impact": "impacts", "loss": "losses", "drive": "drive"}
"""Where the points of a channel stand in the evidence."""
ONE_SIDED = 4.0
"""Chi-square that it must be worth to say that a deviation is on one flank only."""
ALIKE = 1e-5
"""Part of a column's square that must be its own beside the causes that are in."""


class Scored(NamedTuple):
    """What one candidate would gain beside the causes that are in already.

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


class Library(NamedTuple):
    """Candidates and their columns.

    Args:
        candidates: all.
        columns: by candidate and channel, per unit of size, float32 (k, n of the channel).
        spans: where channels lie in the stacked residuals, by name.
        records: that the columns are of.
        parts: where each record lies in the columns of a channel, by name.
    """

    candidates: list[Candidate]
    columns: list[dict[str, Array]]
    spans: dict[str, slice]
    records: tuple[Evidence, ...]
    parts: dict[str, list[slice]]


def library(records: Sequence[Evidence], every: list[Candidate], before: Library | None = None) -> Library:
    """Return the columns of candidates for some records.

    Args:
        records: all.
        every: the candidates.
        before: of the same records, some of whose channels may have had other points; the others need no work again.
    """
    spans, parts, at = {}, {}, 0
    for name in CHANNELS:
        parts[name] = _behind([len(added(one, (), name)) for one in records])
        size = parts[name][-1].stop
        spans[name] = slice(at, at + size)
        at += size
    there = (
        {} if before is None else {repr(one): own for one, own in zip(before.candidates, before.columns, strict=True)}
    )
    columns = [_columns(records, one, before, there.get(repr(one), {})) for one in every]
    return Library(every, columns, spans, tuple(records), parts)


def _behind(sizes: Sequence[int]) -> list[slice]:
    ends = np.cumsum(sizes).tolist()
    return [slice(end - size, end) for end, size in zip(ends, sizes, strict=True)]


def _columns(
    records: Sequence[Evidence], one: Candidate, before: Library | None, there: dict[str, Array]
) -> dict[str, Array]:
    """Return the columns of a candidate by channel; where a record's points are as before they are taken over."""
    sizes = np.eye(2) if one.phased else np.eye(1)
    effects = [one.effect(one.tried * one.unit * row) for row in sizes]
    made = {}
    for name in one.channels:
        parts = []
        for k, record in enumerate(records):
            if before is not None and name in there and _same(before.records[k], record, name):
                parts.append(there[name][:, before.parts[name][k]])
            else:
                own = [added(record, [effect], name) / one.tried for effect in effects]
                parts.append(np.array(own).astype(np.float32))
        made[name] = np.concatenate(parts, axis=1)
    return made


def _same(old: Evidence, new: Evidence, name: str) -> bool:
    """Whether a channel has the very points that it had."""
    return getattr(old.channels, TABLES[name]) is getattr(new.channels, TABLES[name])


def price(candidate: Candidate) -> float:
    """Return the chi-square by which a candidate must be better than one on both flanks, to be preferred.

    Args:
        candidate: any.
    """
    return ONE_SIDED if candidate.shape.get("flank", "both") != "both" else 0.0


def score(known: Library, rest: Array, slopes: Array | None = None) -> list[Scored]:
    """Return what each candidate would gain, most first.

    Args:
        known: all candidates.
        rest: residuals with the causes that are in, (n,).
        slopes: of the numbers of these causes, orthonormal, (n, p).
    """
    found = []
    for one, columns in zip(known.candidates, known.columns, strict=True):
        size = 2 if one.phased else 1
        normal, right = np.zeros((size, size)), np.zeros(size)
        taken = np.zeros((size, 0 if slopes is None else slopes.shape[1]))
        for name, column in columns.items():
            own = column.astype(float)
            normal = normal + own @ own.T
            right = right + own @ rest[known.spans[name]]
            if slopes is not None:
                taken = taken + own @ slopes[known.spans[name]]
        scale = np.sqrt(np.maximum(np.diag(normal), 1e-30))
        if slopes is not None:
            normal = normal - taken @ taken.T
        value, vector = np.linalg.eigh(normal / np.outer(scale, scale))
        if not (value[-1] > ALIKE and scale.max() > 1e-9):
            continue
        vector = vector[:, value > ALIKE] / scale[:, None]
        inverse = vector / value[value > ALIKE] @ vector.T
        units = inverse @ right
        found.append(Scored(one, float(right @ units), units, np.sqrt(np.maximum(np.diag(inverse), 0.0))))
    return sorted(found, key=lambda each: price(each.candidate) - each.gain)
