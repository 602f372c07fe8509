"""Joint fit of angular datums and numbers of causes, so that no cause compensates a wrong datum."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gears3d.diagnosis.cause import Cause, contribution, slopes_of
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import CHANNELS, GEARS, residuals
from gears3d.diagnosis.zeros import kept, slopes_of_zeros, turn

Array = np.ndarray
# Number of Gauss-Newton rounds.
ROUNDS = 4
# Largest step in a round, in radians of a datum and in units of a number.
FARTHEST = 0.3


def settled(records: Sequence[Evidence], causes: Sequence[Cause]) -> tuple[Array, float]:
    """Return datum shifts of records, (r, 2) [rad], from the joint fit with causes, and the change of chi-square."""
    turned, changed, now, begun = np.zeros((len(records), 2)), 0.0, list(records), tuple(causes)
    for _ in range(ROUNDS if causes else 0):
        width, count = sum(len(cause.numbers) for cause in causes), 0
        units = np.concatenate([cause.units for cause in causes])
        effects = [cause.effect for cause in causes if cause.effect is not None]
        tables, rests, places = [], [], []
        for k, one in enumerate(now):
            own = contribution([one], effects)
            told = residuals(one)
            rests.append(np.concatenate([told[name] for name in CHANNELS]) - own)
            lost = [side for side, gear in enumerate(GEARS) if gear in one.unmarked and not kept(records[k], gear)]
            zeros = slopes_of_zeros(one, effects, own, [GEARS[side] for side in lost])
            tables.append((np.column_stack([c for cause in causes for c in slopes_of([one], cause)]), zeros))
            places += [(k, side) for side in lost]
        normal, right = np.zeros((width + len(places),) * 2), np.zeros(width + len(places))
        for (slopes, zeros), rest in zip(tables, rests, strict=True):
            at = [*range(width), *range(width + count, width + count + len(zeros))]
            table = np.column_stack([slopes, *zeros])
            normal[np.ix_(at, at)] += table.T @ table
            right[at] += table.T @ rest
            count += len(zeros)
        scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        move = np.linalg.pinv(normal / np.outer(scale, scale), rcond=1e-9, hermitian=True) @ (right / scale) / scale
        move = np.clip(move, -FARTHEST, FARTHEST)
        ends = np.cumsum([len(cause.numbers) for cause in causes])[:-1]
        steps = np.split(move[:width] * units, ends)
        causes = tuple(c._replace(numbers=c.numbers + step) for c, step in zip(causes, steps, strict=True))
        for (k, side), by in zip(places, move[width:], strict=True):
            turned[k, side] += by
        now = [turn(one, *by) for one, by in zip(records, turned, strict=True)]
    effects = [cause.effect for cause in begun if cause.effect is not None]
    for one, other in zip(records, now, strict=True):
        changed += float(np.sum((contribution([other], effects) - contribution([one], effects)) ** 2))
    return turned, changed
