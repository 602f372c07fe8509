"""Where contact is lost in one direction of a sweep: from the heights of flights, else between two periods."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gears3d.identify.flown import LEAST, MOST, Flown, gathered
from gears3d.identify.liftoff import lifted
from gears3d.identify.swing import Periods
from gears3d.identify.unwaved import phases

DIRECTIONS = ("up", "down")
LIVELY = 6.0
"""Deviations of quiet periods above which one is lively."""
STEP = 3.0
"""How far lively periods must open more than quiet ones."""
CERTAIN, WIDE = 30.0, 0.05
"""What opens more than these, in noise of the contact and in backlashes, is no noise."""
EARLY = 0.97
"""Part of a threshold below which lively periods contradict it."""
ILL = 4.0
"""Mean squared error of the flights from which on they are not those of rigid teeth."""
ROUGH = 0.01
"""Error of the heights of rigid flights that nobody minds, over the heights."""
TELLS = 1e-3
"""Part of the information of the best period from which on a period tells of the threshold."""
_AT_LEAST = 4
"""Quiet periods in a sweep."""
_AROUND = 0.3
"""How far about a first guess the threshold is looked for."""
_TRIES = 61
_ROUNDS = 6


class Flights(NamedTuple):
    """A threshold by flights.

    Args:
        value: amplitude of the drive's acceleration at which contact is lost [rad/s²].
        scatter: half the 95 % interval by the scatter of periods [rad/s²].
        chi2: how well flights fit, over noise and roughness.
        rest: mean squared misfit of the periods that tell [m²].
    """

    value: float
    scatter: float
    chi2: float
    rest: float


class Onset(NamedTuple):
    """What one direction of a sweep tells.

    Args:
        value: amplitude of the drive's acceleration at which contact is lost [rad/s²]; ``None``: not in this sweep.
        ci95: its interval [rad/s²].
        goodness: ``method`` (``"flights"``, ``"bracket"``, ``"none"``), ``chi2``, ``opening_seen_m``,
            ``quiet_below_rad_s2``, ``lively_above_rad_s2``.
        curve: ``level_rad_s2`` and ``opening_m`` of each period; ``law_level_rad_s2`` and ``law_opening_m``.
        lively: whether contact was lost in every period.
        notes: what the reader should know.
        flights: what they tell, where they tell the threshold.
    """

    value: float | None
    ci95: tuple[float, float]
    goodness: dict[str, Any]
    curve: dict[str, np.ndarray]
    lively: bool = False
    notes: tuple[str, ...] = ()
    flights: Flights | None = None


def onset(laid: list[Periods], chosen: list[np.ndarray], radius: float, backlash: float, way: str) -> Onset:
    """Return where contact is lost.

    Args:
        laid: records by periods, waves taken off.
        chosen: which periods of each are swept in this direction.
        radius: base radius of the drive gear [m].
        backlash: [m].
        way: ``"up"`` or ``"down"``.
    """
    data = gathered(laid, chosen, radius)
    curve = {"level_rad_s2": data.level, "opening_m": data.opening}
    step = _step(data.opening)
    if step is None:
        if not len(data.opening):
            return Onset(None, (np.nan, np.nan), {"method": "none"}, curve)
        open_ = float(np.median(data.opening))
        lively = open_ > max(CERTAIN * data.rough, WIDE * backlash)
        return Onset(None, (np.nan, np.nan), {"method": "none", "opening_seen_m": CERTAIN * data.rough}, curve, lively)
    quiet = data.opening[:step]
    middle = float(np.median(quiet))
    limit = middle + LIVELY * max(1.4826 * float(np.median(np.abs(quiet - middle))), 0.1 * middle, data.rough)
    lively = data.opening > limit
    place = _first_run(lively, step)
    below, above = float(data.level[max(place - 1, 0)]), float(data.level[place])
    told: dict[str, Any] = {"opening_seen_m": limit, "quiet_below_rad_s2": below, "lively_above_rad_s2": above}
    found = _by_flights(data, 0.97 * above, backlash)
    if found is not None:
        early = int(np.sum(lively & (data.level < EARLY * found.value)))
        if found.chi2 < ILL and early <= max(2, len(lively) // 10):
            told |= {"method": "flights", "chi2": found.chi2}
            around = (found.value - found.scatter, found.value + found.scatter)
            return Onset(found.value, around, told, {**curve, **_law(data, found.value)}, flights=found)
    low = min(below, above / _seen_from(limit - middle, data.unit, above)) if way == "up" else below
    what = "flights are not those of rigid teeth that lay on the flank: the threshold is bracketed by two periods"
    return Onset(0.5 * (low + above), (low, above), {**told, "method": "bracket"}, curve, notes=(what,))


def _step(opening: np.ndarray) -> int | None:
    """Return where openings, in order of the swing, step up from noise to flights; ``None`` where they do not."""
    if len(opening) < 2 * _AT_LEAST:
        return None  # too few to tell
    logs = np.log(np.maximum(opening, 1e-12))
    errors = [logs[:at].var() * at + logs[at:].var() * (len(logs) - at) for at in range(_AT_LEAST, len(logs) - 1)]
    at = int(np.argmin(errors)) + _AT_LEAST
    return at if np.median(opening[at:]) > STEP * np.median(opening[:at]) else None


def _first_run(lively: np.ndarray, otherwise: int) -> int:
    """Return the first place from which on three of four periods are lively."""
    runs = np.convolve(lively.astype(float), np.ones(4))[3:]
    where = np.flatnonzero(lively[: len(runs)] & (runs >= 3.0))
    return int(where[0]) if where.size else otherwise


def _seen_from(opening: float, unit: np.ndarray, value: float) -> float:
    """Return the excitation at which a flight is as high as what can be seen."""
    tried = np.linspace(1.0, 3.0, 400)
    height = float(np.median(unit)) * value * tried * lifted(phases(), tried).max(axis=1)
    return float(np.interp(opening, height, tried))


def _by_flights(data: Flown, guess: float, backlash: float) -> Flights | None:
    value = guess
    tried = np.linspace(1.0 - _AROUND, 1.0 + _AROUND, _TRIES)
    for round_ in range(_ROUNDS):
        use = data.usable(value, backlash)
        if not np.any(use & (data.heights(value) > 0.0)):
            return None
        around = value * (tried if round_ < 2 else 1.0 + (tried - 1.0) * 0.1)
        errors = np.array([np.nansum(data.rest(one, use) ** 2) for one in around])
        best = int(np.argmin(errors))
        if best in (0, _TRIES - 1):
            value = float(around[best])
            continue
        low, here, high = errors[best - 1 : best + 2]
        bend = low - 2.0 * here + high
        step = around[1] - around[0]
        value = float(around[best] + (0.5 * step * (low - high) / bend if bend > 0.0 else 0.0))
    for _ in range(2):
        use = data.usable(value, backlash)
        slope = data.slope(value, use)
        size = np.nansum(slope**2)
        value -= float(np.nansum(slope * data.rest(value, use)) / size) if size > 0.0 else 0.0
    return _judged(data, value, data.usable(value, backlash))


def _judged(data: Flown, value: float, use: np.ndarray) -> Flights | None:
    from scipy.stats import t

    rest, slope = data.rest(value, use), data.slope(value, use)
    info = np.nansum(slope**2, axis=1)
    if not info.sum() > 0.0:
        return None
    pull = np.nansum(slope * rest, axis=1)
    share = info / info.sum()
    error = float(np.sqrt(np.sum((pull / (1.0 - share.clip(max=0.9))) ** 2)) / info.sum())  # periods err as a whole
    periods_that_tell = 1.0 / np.sum(share**2)
    still = data.level < LEAST * value
    quiet = still if still.sum() >= 3 else data.level < value
    noise = np.nanvar(data.rest(value, np.broadcast_to(quiet[:, None], use.shape)))
    heights = data.heights(value)
    flying = use & (heights > 0.0)
    floor = (ROUGH * np.sqrt(np.mean(heights[flying] ** 2))) ** 2 if np.any(flying) else 0.0
    chi2 = float(np.nanmean(rest[flying] ** 2) / max(noise + floor, 1e-30))
    telling = (info > TELLS * info.max())[:, None] & use & (slope != 0.0)
    quantile = float(t.ppf(0.975, max(periods_that_tell - 1.0, 1.0)))
    return Flights(value, quantile * error, chi2, float(np.nanmean(rest[telling] ** 2)))


def _law(data: Flown, value: float) -> dict[str, np.ndarray]:
    level = np.linspace(data.level.min(), min(data.level.max(), MOST * value), 200)
    height = float(np.median(data.unit)) * level * lifted(phases(), level / value).max(axis=1)
    return {"law_level_rad_s2": level, "law_opening_m": height}
