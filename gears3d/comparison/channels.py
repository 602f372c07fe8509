"""Numbers of a recording by channel, as the diagnosis has them: drive, flights, flanks, impacts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.recording import FLANKS, Recording
from gears3d.scenario import Scenario

AMID = 0.2
"""Part of the backlash, at either flank, whose samples are not taken for flight."""
FEWEST = 20
"""Samples of flight at least."""
TRIMMED = 6.0
"""Usual deviations beyond which a sample does not count."""
HARD = 0.25
"""Part of the largest speed from which on an impact counts as hard."""
SEEN, LOW, FLAT = 5.0, 1e-4, 0.25
"""Samples of a rebound, its height over the backlash, and the part of that height below which it is missing."""

Array = np.ndarray


class Flights(NamedTuple):
    """The acceleration of the loose gear in the gap, by least squares over all samples there.

    Args:
        deceleration: at the mean speed [rad/s²], value and standard deviation.
        carried: acceleration of the drive that the loose gear takes over in flight, 1 in contact and 0 in free flight.
    """

    deceleration: tuple[float, float]
    carried: tuple[float, float]


class Impacts(NamedTuple):
    """The impacts.

    Args:
        time: [s], (n,).
        flank: (n,).
        speed: of approach [m/s], (n,).
        rebound: NaN where none is seen [m/s], (n,).
        lasts: duration that is certain [s], (n,).
    """

    time: Array
    flank: Array
    speed: Array
    rebound: Array
    lasts: Array

    @property
    def ratio(self) -> Array:
        """Rebound speed over approach speed, NaN where none is seen, (n,)."""
        return np.abs(self.rebound) / self.speed


def stated_displacement(recording: Recording, scenario: Scenario) -> Array:
    """Return the displacement as the model has it, with the datum of its own angles [m], (n,).

    Args:
        recording: of :func:`gears3d.comparison.own_model.from_angles`.
        scenario: with the base radii.
    """
    rig, zero = scenario.rig(), recording.meta.get("zero_rad", {})
    drive, loose = (recording.signals[f"theta_{gear}_rad"] + zero.get(gear, 0.0) for gear in ("drive", "loose"))
    return rig.base_radius_loose * loose - rig.base_radius_drive * drive


def flights_of(recording: Recording, scenario: Scenario) -> Flights | None:
    """Return the law of motion in the gap; ``None`` where the recording has too little of it.

    Args:
        recording: evenly sampled, with both angles.
        scenario: with base radii and backlash.
    """
    known = scenario.rig()
    time, drive, loose = (recording.signals[name] for name in ("time_s", "theta_drive_rad", "theta_loose_rad"))
    place, step = stated_displacement(recording, scenario), float(np.median(np.diff(time)))
    free = _amid(place, 0.0, known.backlash)
    if len(free) < FEWEST:  # the datum of the angles is another
        free = _amid(place, float(place.min()), float(place.max()))
    if len(free) < FEWEST:
        return None

    def second(values: Array) -> Array:
        return (values[free + 1] - 2.0 * values[free] + values[free - 1]) / step**2

    gained = second(loose)
    pushed = known.base_radius_drive / known.base_radius_loose * second(drive)
    speed = (loose[free + 1] - loose[free - 1]) / (2.0 * step)
    base = np.stack([-np.ones(len(free)), pushed, speed - speed.mean()], axis=1)
    scale = np.maximum(np.abs(base).max(axis=0), 1e-300)
    kept = np.ones(len(free), dtype=bool)
    numbers = np.zeros(3)
    for _ in range(3):
        numbers = np.linalg.lstsq(base[kept] / scale, gained[kept], rcond=None)[0]
        rest = gained - base / scale @ numbers
        usual = 1.4826 * float(np.median(np.abs(rest[kept])))
        kept = np.abs(rest) <= TRIMMED * usual + 1e-12 * float(np.abs(gained).max())
    spread = float(np.std(rest[kept])) * np.sqrt(np.diag(np.linalg.pinv((base[kept] / scale).T @ (base[kept] / scale))))
    values, sigmas = numbers / scale, spread / scale
    return Flights((float(values[0]), float(sigmas[0])), (float(values[1]), float(sigmas[1])))


def _amid(place: Array, low: float, high: float) -> Array:
    """Return samples well within a gap together with both neighbours."""
    amid = (place > low + AMID * (high - low)) & (place < high - AMID * (high - low))
    return np.flatnonzero(amid[:-2] & amid[1:-1] & amid[2:]) + 1


def beyond(recording: Recording, scenario: Scenario) -> float:
    """Return how far the loose gear goes beyond its flanks [m], in one sample of a thousand.

    Args:
        recording: of :func:`gears3d.comparison.own_model.from_angles`.
        scenario: with base radii and backlash.
    """
    if "backlash_m" in recording.meta:
        place, width = recording.signals["displacement_m"], float(recording.meta["backlash_m"])
    else:
        place, width = stated_displacement(recording, scenario), scenario.rig().backlash
    return max(float(np.quantile(np.maximum(-place, place - width), 0.999)), 0.0)


def impacts_of(recording: Recording) -> Impacts:
    """Return the impacts of a segmented recording.

    Args:
        recording: of :func:`gears3d.comparison.own_model.from_angles`.
    """
    table = recording.impacts
    none = np.zeros(len(table["time_s"]))
    lasts = table.get("duration_max_s", none) - 2.0 * 1.645 * np.nan_to_num(table.get("duration_sigma_s", none))
    lasts = np.maximum(np.where(np.isfinite(lasts), lasts, 0.0), 0.0)
    return Impacts(
        table["time_s"], table["flank"], np.abs(table["velocity_m_s"]), table["rebound_m_s"], np.nan_to_num(lasts)
    )


def restitution(tested: Impacts, known: Impacts) -> dict[str, tuple[float, float, float]]:
    """Return by flank the coefficient of restitution, that of the reference at the same speeds, and its deviation.

    Args:
        tested: impacts of the user's model.
        known: impacts of the reference.
    """
    found = {}
    for code, name in enumerate(FLANKS):
        own, other = (np.flatnonzero((one.flank == code) & np.isfinite(one.ratio)) for one in (tested, known))
        if len(own) < 3 or len(other) < 3:
            continue
        expected = _over_speed(known.speed[other], known.ratio[other], tested.speed[own])
        apart = tested.ratio[own] / expected - 1.0
        shift = float(np.median(apart))
        spread = 1.4826 * float(np.median(np.abs(apart - shift)))
        level = float(np.median(expected))
        found[name] = (level * (1.0 + shift), level, 1.2533 * spread * level / np.sqrt(len(own)))
    return found


def missing(tested: Recording, own: Impacts, known: Impacts, scenario: Scenario) -> int:
    """Return how many impacts are followed by contact where a rebound would be seen.

    Args:
        tested: the user's model.
        own: its impacts.
        known: impacts of the reference, whose restitution is expected.
        scenario: with base radii, inertia and drag.
    """
    rig, time, place = scenario.rig(), tested.time, tested.signals["displacement_m"]
    backlash = float(tested.meta.get("backlash_m") or rig.backlash)
    pushed = np.gradient(np.gradient(tested.signals["theta_drive_rad"], time), time)
    pull = -rig.base_radius_loose * rig.drag_torque / rig.inertia - rig.base_radius_drive * pushed
    step, count = float(np.median(np.diff(time))), 0
    for k in np.flatnonzero(~np.isfinite(own.ratio)):
        code = int(own.flank[k])
        others = np.flatnonzero((known.flank == code) & np.isfinite(known.ratio))
        if not len(others):
            continue
        speed = float(own.speed[k] * _over_speed(known.speed[others], known.ratio[others], own.speed[k : k + 1])[0])
        back = -float(np.interp(own.time[k], time, pull)) * (1.0 if code == 0 else -1.0)
        if back <= 0.0 or (lasts := 2.0 * speed / back) < SEEN * step:
            continue
        rows = slice(*np.searchsorted(time, [own.time[k] + step, own.time[k] + lasts]).tolist())
        gap = place[rows] if code == 0 else backlash - place[rows]
        height = 0.5 * speed**2 / back
        count += bool(len(gap) and height > LOW * backlash and float(gap.max()) < FLAT * height)
    return count


def passed(found: Impacts) -> float:
    """Return the way that gears go beyond a flank at an impact that lasts [m], that of the upper quartile.

    Args:
        found: impacts of the user's model.
    """
    hard = np.isfinite(found.ratio) & (found.speed > HARD * found.speed.max(initial=0.0))
    return float(np.quantile((found.lasts * found.speed)[hard], 0.75)) if hard.any() else 0.0


def _over_speed(speed: Array, ratio: Array, at: Array) -> Array:
    """Return a straight line through ratios over speed, robust against single ones, at other speeds."""
    middle = float(np.median(speed))
    base = np.stack([np.ones(len(speed)), speed - middle], axis=1)
    weight = np.ones(len(speed))
    line = np.array([float(np.median(ratio)), 0.0])
    for _ in range(5):
        rest = np.abs(ratio - base @ line)
        weight = 1.0 / np.maximum(rest, 1e-6 + float(np.median(rest)))
        line = np.linalg.lstsq(base * weight[:, None] ** 0.5, ratio * weight**0.5, rcond=None)[0]
    return np.maximum(line[0] + line[1] * (np.clip(at, speed.min(), speed.max()) - middle), 1e-3)
