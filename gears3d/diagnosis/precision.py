"""Precision of the numbers of causes.

Noise of readings is independent from point to point, but errors of segmentation are not: a slightly wrong flank, or a
late contact, moves all points about it. So the scatter of block estimates over stretches of records is used, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.diagnosis.causes import Cause, contribution, slopes_of
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import CHANNELS, residuals
from gears3d.diagnosis.preprocessing import has_original_datum, slopes_of_datums

Array = np.ndarray
# Number of stretches of a record for block estimates, each with as many points of every channel.
STRETCHES = (16, 4, 1)
# Minimum number of stretches for an estimate of their scatter.
FEWEST = 4
# Information relative to the best combination of numbers below which another one is not identifiable.
KNOWN = 1e-12


class Information(NamedTuple):
    """Information of the readings of one record on the numbers of causes, in units; additive over records.

    Args:
        normal: products of the slopes, (p, p).
        scores: sums of slope times residual over stretches of the record, (s, p).
        chi2: of the residuals.
        count: of the residuals.
    """

    normal: Array
    scores: Array
    chi2: float
    count: float


def information(one: Evidence, causes: Sequence[Cause], others: Sequence[Cause] = ()) -> Information:
    """Return the information of a record's events on causes, unknown datums being free.

    Of causes that do not act in it the numbers follow those of the acting ones.
    """
    effects = [cause.effect for cause in causes if cause.effect is not None]
    slopes = np.column_stack([column for cause in (*causes, *others) for column in slopes_of([one], cause)])
    own, told = contribution([one], effects), residuals(one)
    rest = np.concatenate([told[name] for name in CHANNELS]) - own
    if len(across := _zeros(one, effects, own)):
        slopes = slopes - across.T @ (across @ slopes)
    where = np.concatenate([np.arange(len(told[n])) * STRETCHES[0] // max(len(told[n]), 1) for n in CHANNELS])
    voted = np.zeros((STRETCHES[0], slopes.shape[1]))
    np.add.at(voted, where, slopes * rest[:, None])
    return Information(slopes.T @ slopes, voted, float(rest @ rest), len(rest))


def combined(parts: Sequence[Information]) -> Array:
    """Return the covariance of the numbers of causes, in units, from the events of several records, (p, p)."""
    normal = sum((one.normal for one in parts), np.zeros_like(parts[0].normal))
    level = sum(one.chi2 for one in parts) / max(sum(one.count for one in parts), 1)
    return _wider(normal, np.array([one.scores for one in parts]), max(level, 1.0))


def covariance(records: Sequence[Evidence], causes: Sequence[Cause]) -> Array:
    """Return the covariance of the numbers of causes, unknown datums of records being free [SI], (p, p).

    No combination of numbers is more precise than with independent errors of the observed scatter, nor than with errors
    correlated over sixteenths, quarters or the whole of records.

    Source: Liang and Zeger 1986, theorem 1, for correlated errors.
    Theory: docs/theory/uncertainty.md, equation (1).
    """
    units = np.concatenate([cause.units for cause in causes])
    return combined([information(one, causes) for one in records]) * np.outer(units, units)


def _zeros(one: Evidence, effects: Sequence[object], own: Array) -> Array:
    """Return the response of a record to its angular datums, orthonormal, (0 to 2, n)."""
    moves = slopes_of_datums(one, effects, own, [gear for gear in one.unmarked if not has_original_datum(one, gear)])
    if not np.any(moves):
        return np.zeros((0, len(own)))
    left, size, _ = np.linalg.svd(np.column_stack(moves), full_matrices=False)
    return left[:, size > 1e-9 * size[0]].T


def _wider(normal: Array, scores: Array, level: float) -> Array:
    """Return the inverse of the normal matrix times the level, or the scatter of the scores if that is larger.

    normal: of all points, (p, p); scores: of the shortest stretches of each record, (r, s, p); level: mean square
    residual of a point.

    >>> alike = np.array([[[1.0], [-1.0]] * 8])
    >>> float(_wider(np.array([[16.0]]), 0.1 * alike, 1.0)[0, 0])
    0.0625
    >>> round(float(_wider(np.array([[16.0]]), 3.0 * alike, 1.0)[0, 0]), 9)
    0.6
    >>> float(_wider(np.zeros((1, 1)), 0.0 * alike, 1.0)[0, 0])
    inf
    """
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    known, turned = np.linalg.eigh(normal / np.outer(scale, scale))
    good = known > KNOWN * known[-1]
    if not np.any(good):  # records with other datums would show the same: the numbers are not identifiable
        return np.diag(np.full(len(scale), np.inf))
    root = np.sqrt(level / known[good]) * turned[:, good] / scale[:, None]
    moves = scores @ root / level  # numbers from each stretch alone
    for parts in STRETCHES:
        together = moves.reshape(-1, moves.shape[1] // parts, moves.shape[2]).sum(axis=1)
        if len(together) >= FEWEST:
            spread, toward = np.linalg.eigh(together.T @ together * (len(together) / (len(together) - 1)))
            wider = np.sqrt(np.maximum(spread, 1.0))
            root, moves = root @ toward * wider, moves @ toward / wider
    return root @ root.T
