"""What an observer who knows the hidden causes would see of each in the records: Fisher information along the path.

The causes stand at their true numbers; starts of windows, zeros of records, and angles without a mark are free. It has
the windows and the slopes of the search: it shows what that could find, not whether its model is right. Windows are a
part of the records, so that a cause which it hardly sees may show in the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gears3d.diagnosis.causes import FREE, Cause
from gears3d.diagnosis.diagnosis import Shown, shown
from gears3d.diagnosis.evidence import Paths
from gears3d.diagnosis.path_fit import (
    ACCOUNTS,
    SCATTER,
    SQUARED,
    State,
    WithoutNuisances,
    columns_of,
    effects_of,
    fitted,
    followed,
    kicked,
    restore,
    settled,
    state_of,
)
from gears3d.diagnosis.shooting import RUN, Windows
from gears3d.effects import catalogue
from gears3d.errors import InputError
from gears3d.measured.checks import Admitted

Array = np.ndarray
SEES = 5.0
"""Standard deviations from which on the observer sees a cause."""


def seen(admitted: Sequence[Admitted], effects: Sequence[dict[str, Any]], zeros: Any) -> dict[str, float | None]:
    """Return the size of each hidden cause over its standard deviation, by kind.

    None where windows do not show the kind, or do not come true with the true causes.

    Args:
        admitted: the records.
        effects: as the answer of a challenge has them, in SI units.
        zeros: what the encoders read where the bench has 0, record by record [rad]; None without.
    """
    kinds = [one["kind"] for one in effects]
    none: dict[str, float | None] = dict.fromkeys(kinds)
    records = shown(admitted, Paths(), max([40, *(one.get("order", 0) for one in effects)]))
    if records is None or len(records.windows) < 8:
        return none
    causes = [one for one in (_cause(records, effect) for effect in effects) if one is not None]
    now = _true(records.windows, causes, np.array(zeros or np.zeros((len(records.windows.zeros), 2)), float))
    if now is None or float(np.median(records.windows.level(now.rest))) > ACCOUNTS:
        return none
    return none | _sizes(records.windows, now)


def _cause(records: Shown, effect: dict[str, Any]) -> Cause | None:
    """Return a hidden effect as the search would have it; None where windows do not show its kind."""
    able = [one for one in records.candidates if one.kind == effect["kind"]]
    if not able:
        return None
    made: Any = catalogue()[effect["kind"]](**{k: v for k, v in effect.items() if k != "kind" and "_family" not in k})
    shape = {name: getattr(made, name) for name in able[0].shape}
    size, phase = float(getattr(made, able[0].size)), float(getattr(made, "phase", 0.0))
    numbers = [size * np.cos(phase), -size * np.sin(phase)] if able[0].phased else [size]
    bends = {name: bend for name, bend in FREE.get(effect["kind"], {}).items() if name in shape}
    free = [np.log(shape[name]) if bend.log else shape[name] for name, bend in bends.items()]
    return Cause(able[0]._replace(shape=shape), np.array([*numbers, *free]))


def _true(windows: Windows, causes: Sequence[Cause], zeros: Array) -> State | None:
    """Return the state of windows with the true causes and zeros; None where the rig cannot have these."""
    drive, loose = windows.radii
    windows.turned = -zeros * windows.lost
    windows.zeros = zeros @ [-drive, loose] - np.array(windows.origins)
    try:
        effects = effects_of(causes)
        for _ in range(2):  # counts round down, oil and compliant teeth hold the gear off its flank
            windows.restart(effects, anew=True)
            missed = windows.missed(effects)
            for k in range(len(zeros)):
                own = windows.record[windows.window] == k
                windows.zeros[k] += float(np.median(missed[own])) if np.any(own) else 0.0
        windows.restart(effects, anew=True)
        now = state_of(windows, causes, settled(windows, effects, windows.residuals(effects)))
        now = now._replace(rest=followed(windows, effects, now.rest), starts=windows.starts)
        return fitted(windows, now, held=len(causes))  # the drive's motion within its uncertainty
    except InputError:
        return None


def _sizes(windows: Windows, now: State) -> dict[str, float]:
    """Return the size of each cause over its standard deviation, all others and all nuisances free.

    Its own shape is held: a torque of any exponent is seen where one of none is not.
    """
    restore(windows, now)
    along = windows.along(effects_of(now.causes))
    away = WithoutNuisances(windows, now.rest, along.starts(), along.driven())
    level = np.maximum(windows.level(now.rest), 1.0) * _alike(windows, now.rest)  # noise is what true causes leave
    sure = 1.0 / np.sqrt(level)[windows.every[: len(now.rest)]]
    sure = np.append(sure, 1.0 / away.held[away.record[len(sure) :]])
    slopes, at = np.array(columns_of(along, now.causes)), 0
    for k, cause in enumerate(now.causes):
        if cause.candidate.kind == SQUARED:  # the path follows the square of its size: the difference, not the slope
            less = windows.residuals(effects_of([*now.causes[:k], *now.causes[k + 1 :]]))
            slopes[at] = (less - now.rest) / float((cause.numbers / cause.units)[0])
        at += len(cause.numbers)
    columns = (away(slopes) * sure).T
    normal, made, at = columns.T @ columns, {}, 0
    for cause in now.causes:
        sizes = 2 if cause.candidate.phased else 1
        own = np.arange(at, at + sizes)
        others = np.setdiff1d(np.arange(len(normal)), np.arange(at, at + len(cause.numbers)))
        cross = normal[np.ix_(own, others)]
        alone = normal[np.ix_(own, own)] - cross @ np.linalg.pinv(normal[np.ix_(others, others)], rcond=1e-12) @ cross.T
        size = (cause.numbers / cause.units)[:sizes]
        made[cause.candidate.kind] = float(np.sqrt(max(size @ alone @ size, 0.0)))
        if cause.candidate.kind == SCATTER and (kicks := kicked(windows, now.causes)) is not None:
            made[SCATTER] = float(np.sqrt(2.0 * np.sum(kicks[1] ** 2)))
        at += len(cause.numbers)
    return made


def _alike(windows: Windows, rest: Array) -> float:
    """Return how many readings in a row have about the same residual: 1 for white noise."""
    own = rest[: len(windows.window)] / np.sqrt(windows.level(rest))[windows.window]
    block = np.cumsum(np.r_[0, (np.diff(windows.window) > 0) | (np.arange(1, len(own)) % RUN == 0)])
    return max(float(np.sum(np.bincount(block, own) ** 2) / np.sum(own**2)), 1.0)
