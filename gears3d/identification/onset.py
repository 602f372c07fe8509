"""Where contact is lost in one direction of a sweep: from the heights of flights, else between two periods."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gears3d.identification.liftoff import landed, lifted
from gears3d.identification.swing import BINS, Periods
from gears3d.identification.unwaved import PRESSED, phases, pressed

DIRECTIONS = ("up", "down")
LIVELY = 6.0
"""Deviations of quiet periods above which one is lively."""
STEP = 3.0
"""How far lively periods must open more than quiet ones."""
CERTAIN, WIDE = 30.0, 0.05
"""What opens more than these, in noise of the contact and in backlashes, is no noise."""
EARLY = 0.97
"""Part of a threshold below which lively periods contradict it."""
MOST = 1.6
"""Excitation, over the threshold, up to which flights count: they are back on the flank before the period ends."""
LEAST = 0.6
"""Excitation from which on periods count as quiet ones that testify."""
HIGHEST = 0.6
"""Part of the backlash that a flight may rise to and count."""
ILL = 4.0
"""Mean squared error of the flights from which on they are not those of rigid teeth."""
ROUGH = 0.01
"""Error of the heights of rigid flights that nobody minds, over the heights."""
FLOOR = 1e-3
"""Relative error of a threshold that always remains: counts that keep step with the swing shift its amplitude."""
_SMOOTH = 9
"""Bins over which an opening is averaged."""
_READ = 5
"""Bins in sure contact that a period must have been read in."""
_AT_LEAST = 4
"""Quiet periods in a sweep."""
_AROUND = 0.3
"""How far about a first guess the threshold is looked for."""
_TRIES = 121
_ROUNDS = 6


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
    """

    value: float | None
    ci95: tuple[float, float]
    goodness: dict[str, Any]
    curve: dict[str, np.ndarray]
    lively: bool = False
    notes: tuple[str, ...] = ()


class _Data(NamedTuple):
    """Periods of one direction in order of the swing, all records together: place without its mean in contact."""

    place: np.ndarray
    level: np.ndarray
    ramp: np.ndarray
    unit: np.ndarray
    opening: np.ndarray
    rough: float

    def heights(self, value: float) -> np.ndarray:
        """Return the flights that a threshold makes, means over the bins [m], (k, BINS)."""
        ratio, phase = self.level / value, phases()
        height = lifted(phase, ratio, self.ramp)
        bend = -np.cos(phase)[None, :] - 1.0 / np.maximum(ratio, 1e-300)[:, None]
        mean = height + np.where(height > 0.0, bend, 0.0) * (2.0 * np.pi / BINS) ** 2 / 24.0
        return (self.unit * self.level)[:, None] * np.maximum(mean, 0.0)


def onset(laid: list[Periods], chosen: list[np.ndarray], radius: float, backlash: float, way: str) -> Onset:
    """Return where contact is lost.

    Args:
        laid: records by periods, waves taken off.
        chosen: which periods of each are swept in this direction.
        radius: base radius of the drive gear [m].
        backlash: [m].
        way: ``"up"`` or ``"down"``.
    """
    data = _gathered(laid, chosen, radius)
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
        value, error, chi2, quantile = found
        early = int(np.sum(lively & (data.level < EARLY * value)))
        if chi2 < ILL and early <= max(2, len(lively) // 10):
            wide = quantile * error
            told |= {"method": "flights", "chi2": chi2}
            return Onset(value, (value - wide, value + wide), told, {**curve, **_law(data, value)})
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


def _gathered(laid: list[Periods], chosen: list[np.ndarray], radius: float) -> _Data:
    from scipy.ndimage import uniform_filter1d

    place = np.concatenate([one.place[pick] for one, pick in zip(laid, chosen, strict=True)])
    level = np.concatenate([one.level[pick] for one, pick in zip(laid, chosen, strict=True)])
    unit = np.concatenate(
        [np.full(int(pick.sum()), radius / one.omega**2) for one, pick in zip(laid, chosen, strict=True)]
    )
    ramp = np.concatenate([one.rise[pick] for one, pick in zip(laid, chosen, strict=True)]) / (2.0 * np.pi * level)
    resting = pressed()
    read = (np.isfinite(place[:, resting]).sum(axis=1) >= _READ) & (np.isfinite(place).mean(axis=1) > 0.5)
    place, level, unit, ramp = place[read], level[read], unit[read], ramp[read]
    place = place - np.nanmean(np.where(resting, place, np.nan), axis=1, keepdims=True)
    known = np.isfinite(place)
    sums = uniform_filter1d(np.where(known, place, 0.0), _SMOOTH, axis=1, mode="nearest")
    smooth = sums / np.maximum(uniform_filter1d(known.astype(float), _SMOOTH, axis=1, mode="nearest"), 0.3)
    opening = smooth[:, (phases() > 1.6) & (phases() < 5.6)].max(axis=1)
    rough = 1.4826 * float(np.median(np.abs(smooth[:, resting]))) if len(smooth) else 0.0
    order = np.argsort(level, kind="stable")
    return _Data(place[order], level[order], ramp[order], unit[order], opening[order], max(rough, 1e-12))


def _seen_from(opening: float, unit: np.ndarray, value: float) -> float:
    """Return the excitation at which a flight is as high as what can be seen."""
    tried = np.linspace(1.0, 3.0, 400)
    height = float(np.median(unit)) * value * tried * lifted(phases(), tried).max(axis=1)
    return float(np.interp(opening, height, tried))


def _by_flights(data: _Data, guess: float, backlash: float) -> tuple[float, float, float, float] | None:
    """Return threshold, its error, the misfit of the flights and the quantile for 95 %."""
    value = guess
    tried = np.linspace(1.0 - _AROUND, 1.0 + _AROUND, _TRIES)
    for round_ in range(_ROUNDS):
        use = _usable(data, value, backlash)
        if not np.any(use & (data.heights(value) > 0.0)):
            return None
        around = value * (tried if round_ < 2 else 1.0 + (tried - 1.0) * 0.1)
        errors = np.array([np.nansum(_rest(data, one, use) ** 2) for one in around])
        best = int(np.argmin(errors))
        if best in (0, _TRIES - 1):
            value = float(around[best])
            continue
        low, here, high = errors[best - 1 : best + 2]
        bend = low - 2.0 * here + high
        step = around[1] - around[0]
        value = float(around[best] + (0.5 * step * (low - high) / bend if bend > 0.0 else 0.0))
    use = _usable(data, value, backlash)
    return _judged(data, value, use)


def _judged(data: _Data, value: float, use: np.ndarray) -> tuple[float, float, float, float] | None:
    from scipy.stats import t

    step = 1e-4 * value
    rest = _rest(data, value, use)
    slope = (_rest(data, value + step, use) - _rest(data, value - step, use)) / (2.0 * step)
    info = np.nansum(slope**2, axis=1)
    if not info.sum() > 0.0:
        return None
    pull = np.nansum(slope * rest, axis=1)
    share = info / info.sum()
    error = float(np.sqrt(np.sum((pull / (1.0 - share.clip(max=0.9))) ** 2)) / info.sum())  # periods err as a whole
    periods_that_tell = 1.0 / np.sum(share**2)
    still = data.level < LEAST * value
    quiet = still if still.sum() >= 3 else data.level < value
    noise = np.nanvar(_rest(data, value, np.broadcast_to(quiet[:, None], use.shape)))
    heights = data.heights(value)
    flying = use & (heights > 0.0)
    floor = (ROUGH * np.sqrt(np.mean(heights[flying] ** 2))) ** 2 if np.any(flying) else 0.0
    chi2 = float(np.nanmean(rest[flying] ** 2) / max(noise + floor, 1e-30))
    error = float(np.hypot(error, FLOOR * value))
    return value, error, chi2, float(t.ppf(0.975, max(periods_that_tell - 1.0, 1.0)))


def _usable(data: _Data, value: float, backlash: float) -> np.ndarray:
    """Return which bins count: sure contact, and the first flight of periods in which it ends on the flank it left."""
    phase, ratio = phases(), data.level / value
    low = (data.heights(value).max(axis=1) < HIGHEST * backlash) & (ratio < MOST) & (ratio > LEAST)
    return low[:, None] & ~landed(phase, ratio, data.ramp) & (phase > PRESSED[0])[None, :] & np.isfinite(data.place)


def _rest(data: _Data, value: float, use: np.ndarray) -> np.ndarray:
    """Return what the law leaves over, each period about its own mean [m], NaN where nothing counts."""
    rest = np.where(use, data.place - data.heights(value), np.nan)
    count = np.maximum(use.sum(axis=1), 1)
    return rest - (np.nansum(rest, axis=1) / count)[:, None]


def _law(data: _Data, value: float) -> dict[str, np.ndarray]:
    level = np.linspace(data.level.min(), min(data.level.max(), MOST * value), 200)
    height = float(np.median(data.unit)) * level * lifted(phases(), level / value).max(axis=1)
    return {"law_level_rad_s2": level, "law_opening_m": height}
