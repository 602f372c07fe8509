"""Competing hypotheses: other causes that the data do not exclude."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import FREE, Candidate
from gears3d.diagnosis.cause import Cause, Fit, begin, fit
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.library import score
from gears3d.diagnosis.search import Search, directions

Array = np.ndarray
# Chi-square difference that excludes a hypothesis, scaled by the level of the best fit if that is above one.
EXCLUDED = 16.0
# Number of hypotheses of other kinds that are fitted for each cause.
LOOKED = 6


class Rival(NamedTuple):
    """One or two causes that replace another.

    Args:
        causes: of the hypothesis.
        worse: rise of chi-square against the cause.
        excluded: whether the data exclude it.
    """

    causes: tuple[Cause, ...]
    worse: float
    excluded: bool


def rivals(records: Sequence[Evidence], found: Search) -> list[list[Rival]]:
    """Return for each cause the hypotheses that could replace it, best first."""
    now, told = found.fit, []
    level = max(now.chi2 / max(len(now.rest), 1), 1.0)
    for k, cause in enumerate(now.causes):
        others = now.causes[:k] + now.causes[k + 1 :]
        less = fit(records, found.base, others)
        tried = _others(records, found, less, cause)
        told.append(sorted((Rival(c, f.chi2 - now.chi2, f.chi2 - now.chi2 > EXCLUDED * level) for c, f in tried),
                           key=lambda one: one.worse))  # fmt: skip
    return told


def _others(records: Sequence[Evidence], found: Search, less: Fit, cause: Cause) -> list[tuple[tuple[Cause, ...], Fit]]:
    tried, seen = [], set()
    count = len(less.causes)
    for one in score(found.known, less.rest, directions(records, less)):
        key = (one.candidate.kind, one.candidate.shape.get("gear"))
        if key in seen or (_same(one.candidate, cause)):
            continue
        if len(tried) >= LOOKED or one.gain < 0.2 * (less.chi2 - found.fit.chi2):
            break
        seen.add(key)
        rounds = 8 if one.candidate.kind in FREE else 3
        made = fit(records, found.base, [*less.causes, begin(one.candidate, one.units)], rounds)
        tried.append((made.causes[count:], made))
    if cause.candidate.kind == "drag_differential":
        plain = {one.kind: one for one in found.known.candidates if one.kind in ("drag_coulomb", "drag_viscous")}
        both = [begin(one, np.array([1e-3])) for one in plain.values()]
        made = fit(records, found.base, [*less.causes, *both], 3)
        tried.append((made.causes[count:], made))
    return tried


def _same(candidate: Candidate, cause: Cause) -> bool:
    """Whether a candidate is the cause itself, except for refined parameters."""
    own = cause.candidate
    bends = FREE.get(own.kind, {})
    shapes = [{name: value for name, value in one.shape.items() if name not in bends} for one in (candidate, own)]
    return candidate.kind == own.kind and shapes[0] == shapes[1]
