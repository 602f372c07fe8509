"""Acceptance criterion of a cause: thresholds, candidates that may be accepted, and whether a fitted cause is.

A candidate may be accepted if chi-square falls by more than ``ACCEPT`` at a size between ``SMALLEST`` and ``LARGEST``;
fitted together with the others, it is accepted if that still holds and it gains in most of the records. Causes of a
predicted path need ``ACCEPT_PATH`` and a gain in most windows (:mod:`gears3d.diagnosis.path_search`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gears3d.diagnosis.candidates import FREE, Candidate, Scored
from gears3d.diagnosis.cause import Cause, Fit
from gears3d.diagnosis.datums import goes_by
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import CHANNELS, added
from gears3d.effects import built_in

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
# Part of what all causes explain that a model of them may err by: 0.3 % of the path, to which sizes come true in
# records without noise. A cause must gain more, and a hypothesis is excluded only if it is worse by more.
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
