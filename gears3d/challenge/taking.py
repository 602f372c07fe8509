"""Records of the rigs of :mod:`gears3d.challenge.space`, with what truly happened in them."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.challenge.history import happen
from gears3d.challenge.sensing import UNSTATED, sense
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.challenge.space import Rig
    from gears3d.scenario import Scenario

SAMPLES = 2_000_000
"""Samples of a record at most; its duration is shortened, to no less than"""
PERIODS = 30
"""periods of the fluctuation."""
BEFORE = 5
"""Periods before the record begins: a rig has run for a while."""
PER_FALL, PER_PERIOD = 150.0, 150.0
"""Steps of integration in a fall across the backlash and in a period: Runge and Kutta's parabolas are exact."""
ALONG = 33
"""Moments of a flight at which its height is looked for."""
SHARE = 0.1
"""A flank counts as struck when it is struck in more than this part of the periods, as the contract has it."""
ACTIVE, REVERSE = 0, 1


@dataclass(frozen=True, eq=False)
class Truth:
    """What truly happened in a record, from the displacement s of ideal flanks at 0 and at the backlash.

    Args:
        backlash: m.
        restitution: coefficient.
        impacts: ``time_s``, ``flank`` (0 active, 1 reverse), ``velocity_m_s`` and ``rebound_m_s`` (ds/dt before and
            after), ``flight_height_m`` and ``flight_s`` (of the flight that it ends), (k,) each.
        flights: ``start_s``, ``end_s``, ``left``, ``struck``, ``height_m``, (f,) each; whole ones.
        contacts: flank, begin, end [s], (c, 3).
        period: of the fluctuation, s.
        duration: of the record, s.
        step: between samples, s.
        dirt: its sizes by kind.
    """

    backlash: float
    restitution: float
    impacts: dict[str, np.ndarray]
    flights: dict[str, np.ndarray]
    contacts: np.ndarray
    period: float
    duration: float
    step: float
    dirt: dict[str, float]

    def regime(self, height: float = 0.0) -> str:
        """Return the regime: ``contact``, ``single_sided`` or ``double_sided``.

        Args:
            height: impacts after flights up to this one do not count, m.
        """
        hits = self.impacts
        high = hits["flight_height_m"] > height
        periods = max(self.duration / self.period, 1.0)
        struck = 0
        for flank in (ACTIVE, REVERSE):
            own = hits["time_s"][high & (hits["flank"] == flank)]
            struck += len(np.unique(np.floor(own / self.period))) > SHARE * periods
        return ("contact", "single_sided", "double_sided")[struck]


@dataclass(frozen=True, eq=False)
class Taken:
    """A record, the rig as its owner describes it, and the truth.

    Args:
        record: ``time_s``, ``theta_drive_rad``, ``theta_loose_rad``.
        scenario: rig and condition.
        truth: about the record.
    """

    record: Recording
    scenario: Scenario
    truth: Truth


def take(rig: Rig, number: int = 0, *, dirt: bool = True, samples: int = SAMPLES) -> Taken:
    """Return a record of a rig with its truth.

    The record has ``samples`` at most: its duration is shortened, to no less than 30 periods. It begins amid the
    motion; zeros of the encoders are arbitrary.

    Args:
        rig: of :func:`gears3d.challenge.space.draw`.
        number: of the record, from 0.
        dirt: whether the rig's kinds of dirt act; noise and counts always do.
        samples: at most.

    >>> from gears3d.challenge.space import draw
    >>> taken = take(draw(1, 1)[0], samples=1000)
    >>> sorted(taken.record.signals) == ["theta_drive_rad", "theta_loose_rad", "time_s"]
    True
    """
    now, scenario = rig.conditions[number], rig.scenario(number)
    random = np.random.default_rng([rig.seed, rig.index, number, 17])
    duration = min(now.duration, max(samples / rig.rate, PERIODS / now.frequency))
    skipped = ceil((BEFORE + random.uniform()) / now.frequency * rig.rate)
    sines = [(now.amplitude, now.frequency, 0.0)]
    if dirt and "drive_harmonics" in rig.dirt:
        sines += [(UNSTATED * now.amplitude, n * now.frequency, float(random.uniform(0.0, 2.0 * pi))) for n in (2, 3)]
    lasts = duration + skipped / rig.rate
    harmonics = [{"amplitude": f"{a!r} rad/s", "frequency": f"{f!r} Hz", "phase": f"{p!r} rad"} for a, f, p in sines]
    true = scenario.with_({"run.duration": f"{lasts!r} s", "motion.harmonics": harmonics})
    step = min(rig.fall / PER_FALL, 1.0 / (PER_PERIOD * now.frequency * len(sines)))
    motion = happen(true, step=step)
    begin = float(motion.time[skipped])
    time = motion.time[skipped:] - begin
    angles = (motion.signals["theta_drive_rad"][skipped:], motion.signals["theta_loose_rad"][skipped:])
    columns, sizes = sense(rig, time, angles, random, dirt)
    impacts, flights, contacts = _events(rig, now.mean, sines, motion)
    scale = 1.0 + sizes.get("clock", 0.0)  # the truth is told in the record's own time
    end = float(time[-1])
    inside = (impacts["time_s"] >= begin) & (impacts["time_s"] <= begin + end)
    impacts = {name: values[inside] for name, values in impacts.items()}
    impacts["time_s"] = scale * (impacts["time_s"] - begin)
    whole = (flights["start_s"] >= begin) & (flights["end_s"] <= begin + end)
    flights = {name: values[whole] for name, values in flights.items()}
    for name in ("start_s", "end_s"):
        flights[name] = scale * (flights[name] - begin)
    contacts[:, 1:] = np.clip(scale * (contacts[:, 1:] - begin), 0.0, scale * end)
    contacts = contacts[contacts[:, 2] > contacts[:, 1]]
    period, lasts = scale / now.frequency, scale * end
    truth = Truth(rig.backlash, rig.restitution, impacts, flights, contacts, period, lasts, scale / rig.rate, sizes)
    about = {"sample_rate_Hz": rig.rate}
    return Taken(Recording(columns, meta=about), scenario, truth)


def _events(
    rig: Rig, mean: float, sines: list[tuple[float, float, float]], motion: Recording
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray], np.ndarray]:
    """Return impacts, flights and contacts of a motion that begins on the active flank.

    The generator notes impacts; where contact is left follows from the drive: as soon as its flank is slowed more than
    the loose gear (active flank), or less (reverse flank).
    """
    hits = motion.impacts
    stays = hits["rebound_m_s"] == 0.0
    times = np.concatenate([[0.0], hits["time_s"][stays]])
    sides = np.concatenate([[ACTIVE], hits["flank"][stays].astype(int)])
    left = np.minimum(_leaves(rig, sines, times, sides, float(motion.time[-1])), np.inf)
    following = np.append(hits["time_s"], np.inf)[np.searchsorted(hits["time_s"], times, "right")]
    ends = np.minimum(np.minimum(left, following), motion.time[-1])
    contacts = np.column_stack([sides, times, ends]).astype(float)
    # a flight ends with each impact; it begins where contact was left, or with the impact before
    k = np.arange(len(stays))
    before = np.maximum(k - 1, 0)
    held = (k == 0) | stays[before]
    place = np.cumsum(np.insert(stays, 0, True))[: len(stays)] - 1  # number of the last contact before each impact
    start = np.where(held, ends[place], hits["time_s"][before])
    side = np.where(held, sides[place], hits["flank"][before]).astype(int)
    departs = np.where(held, 0.0, hits["rebound_m_s"][before])
    struck = hits["flank"].astype(int)
    height = _heights(rig, mean, sines, (start, hits["time_s"]), side, departs)
    height = np.where(struck == side, height, rig.backlash)
    names = ("time_s", "velocity_m_s", "rebound_m_s")
    impacts = {name: hits[name] for name in names}
    impacts |= {"flank": struck, "flight_height_m": height, "flight_s": hits["time_s"] - start}
    flights = {"start_s": start, "end_s": hits["time_s"], "left": side, "struck": struck, "height_m": height}
    return impacts, flights, contacts


def _acceleration(rig: Rig, sines: list[tuple[float, float, float]], time: np.ndarray) -> np.ndarray:
    """Return the acceleration of the drive's flank along the line of action [m/s²]."""
    total = np.zeros_like(time)
    for amplitude, frequency, phase in sines:
        w = 2.0 * pi * frequency
        total += rig.base_radius[0] * amplitude * w * np.cos(w * time + phase)
    return total


def _leaves(
    rig: Rig, sines: list[tuple[float, float, float]], times: np.ndarray, sides: np.ndarray, end: float
) -> np.ndarray:
    """Return when contacts that begin at some times on some sides are left [s]."""
    from scipy.optimize import brentq

    period = 1.0 / sines[0][1]
    grid = np.linspace(0.0, period, 721)
    press = _acceleration(rig, sines, grid) + rig.deceleration  # > 0 presses on the active flank

    def pressing(t: float) -> float:
        return float(_acceleration(rig, sines, np.array([t]))[0] + rig.deceleration)

    changes = np.flatnonzero(np.diff(np.sign(press)) != 0)
    roots = np.array([brentq(pressing, grid[i], grid[i + 1], xtol=1e-15) for i in changes])
    falling = press[changes] > 0.0
    found = np.full(len(times), np.inf)
    for flank, own in ((ACTIVE, roots[falling]), (REVERSE, roots[~falling])):
        chosen = sides == flank
        phase = np.mod(times[chosen], period)
        now = _acceleration(rig, sines, times[chosen]) + rig.deceleration
        holds = now > 0.0 if flank == ACTIVE else now < 0.0
        if len(own):
            later = np.append(own, own[0] + period)[np.searchsorted(own, phase, "right")]
            found[chosen] = np.where(holds, times[chosen] + later - phase, times[chosen])
        else:
            found[chosen] = np.where(holds, np.inf, times[chosen])
    return np.where(found > end, np.inf, found)


def _heights(
    rig: Rig,
    mean: float,
    sines: list[tuple[float, float, float]],
    span: tuple[np.ndarray, np.ndarray],
    side: np.ndarray,
    departs: np.ndarray,
) -> np.ndarray:
    """Return how far flights go from the flank that they leave [m].

    The loose gear is slowed evenly until it stands; the drive's sines are integrated.
    """
    start, end = span
    lasts = (end - start)[:, None]
    later = lasts * np.linspace(0.0, 1.0, ALONG)
    radius = rig.base_radius[0]
    first = np.full(len(start), radius * mean)
    way = radius * mean * later
    for amplitude, frequency, phase in sines:
        w = 2.0 * pi * frequency
        first += radius * amplitude * np.sin(w * start + phase)
        turned = np.cos(w * start + phase)[:, None] - np.cos(w * (start[:, None] + later) + phase)
        way += radius * amplitude / w * turned
    speed = (first + departs)[:, None]  # of the loose gear
    moving = np.minimum(later, np.abs(speed) / rig.deceleration)
    own = speed * moving - 0.5 * np.sign(speed) * rig.deceleration * moving**2
    apart = np.where(side == ACTIVE, 1.0, -1.0)[:, None] * (own - way)
    return apart.max(axis=1, initial=0.0)
