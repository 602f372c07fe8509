"""One cycle of rattle in closed form: from the loss of the active flank until contact on it lasts again.

While that contact lasts nothing is remembered, so the cycle repeats for ever. Flights are those of
:mod:`gears3d.laws.orbit`, rebounds follow Newton's law, contact lasts where the rebound is below the stick velocity.
Where a rebound dies on a flank that does not push, or rebounds never die, there is no closed form, and that is said.

Source: Rigaud & Perret-Liaudet 2020, eqs (17)-(19), with rebounds by Kadmiri et al. 2012, eqs (19), (20).
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf, pi, sin
from typing import NamedTuple

import numpy as np

from gears3d.laws.orbit import ACTIVE, Swing, drift, landing

Restitution = Callable[[int, float], float]
MOST = 400
"""So many flights, and no lasting contact on the active flank, are no cycle."""
LONGEST = 50
"""A flight of so many periods is no flight."""
SENSITIVE = 1e-7
"""A change of the backlash by this share must leave the order of the impacts as it is."""
LEAST = 1e-13
"""Rebound speed that is none [m/s]."""
REGIMES = ("contact", "single_sided", "double_sided", "unknown")


class Flight(NamedTuple):
    """One flight.

    Args:
        left: flank that it left.
        lost: phase when it began [rad].
        launch: relative speed then [m/s].
        struck: flank that it ended on.
        hit: phase then [rad].
        duration: [s].
        velocity: relative to the flank just before the impact [m/s].
        height: largest distance from the flank that it left [m].
    """

    left: int
    lost: float
    launch: float
    struck: int
    hit: float
    duration: float
    velocity: float
    height: float


class Cycle(NamedTuple):
    """What repeats.

    Args:
        regime: ``"contact"``, ``"single_sided"``, ``"double_sided"`` or ``"unknown"``.
        flights: from the first loss of the active flank on.
        periods: of the drive that the cycle takes.
        slowest: smallest speed of the loose gear, less the drive's mean, on the line of action [m/s].
        why: there is no closed form; empty when there is.
    """

    regime: str
    flights: tuple[Flight, ...] = ()
    periods: int = 1
    slowest: float = -inf
    why: str = ""


def plastic(flank: int, speed: float) -> float:
    """Return the restitution 0 whatever hits.

    Args:
        flank: 0 active, 1 reverse.
        speed: [m/s].

    Source: Rigaud & Perret-Liaudet 2020, eqs (16), (17), with e = 0.
    """
    return 0.0


def cycle(
    swing: Swing,
    backlash: float,
    restitution: Restitution = plastic,
    stick_velocity: float = 0.0,
    least_height: float = 0.0,
) -> Cycle:
    """Return the cycle that begins with contact on the active flank.

    Args:
        swing: the drive.
        backlash: [m].
        restitution: coefficient for a flank (0 active, 1 reverse) and an impact speed [m/s].
        stick_velocity: rebound below which contact lasts [m/s].
        least_height: impacts after flights no higher than this do not name the regime [m].

    Returns:
        The cycle; its regime is ``"unknown"`` where there is no closed form.

    Source: Rigaud & Perret-Liaudet 2020, eqs (17)-(19); Kadmiri et al. 2012, eqs (19)-(22).

    >>> drive = Swing(0.148 * 20 * pi / 30, 6 * pi, 0.468489)
    >>> found = cycle(drive, 250e-6)
    >>> found.regime, [round(1e3 * flight.velocity, 4) for flight in found.flights]
    ('double_sided', [30.8581, -31.2425])
    >>> cycle(drive._replace(speed=0.02), 250e-6).regime
    'contact'
    """
    if swing.excitation <= 1.0:
        return Cycle("contact", slowest=-swing.speed)
    found = _chain(swing, backlash, restitution, stick_velocity, least_height)
    if not found.why and len(found.flights) > 1:
        other = _chain(swing, backlash * (1.0 + SENSITIVE), restitution, stick_velocity, least_height)
        if [flight.struck for flight in found.flights] != [flight.struck for flight in other.flights]:
            why = "the flights hang on less than a ten-millionth of the backlash"
            return found._replace(regime="unknown", periods=0, why=why)
    return found


def _chain(
    swing: Swing, backlash: float, restitution: Restitution, stick_velocity: float, least_height: float
) -> Cycle:
    """Follow the flights from the loss of the active flank until contact on it lasts."""
    flights: list[Flight] = []
    flank, phase, launch, spent, slowest = ACTIVE, swing.loss[ACTIVE], 0.0, 0.0, inf
    why = f"no lasting contact on the active flank within {MOST} impacts"
    longest = LONGEST * 2.0 * pi / swing.omega
    while len(flights) < MOST:
        place = backlash * flank
        found = landing(swing, phase, place, backlash - place, launch, longest)
        if found is None:
            why = f"a flight does not end within {LONGEST} periods"
            break
        hit = (phase + swing.omega * found.time) % (2.0 * pi)
        height = found.highest if flank == ACTIVE else -found.lowest
        flights.append(Flight(flank, phase, launch, found.flank, hit, found.time, found.velocity, height))
        slowest = min(slowest, launch + swing.speed * sin(phase) - swing.pull * found.time)
        spent += found.time
        flank, phase = found.flank, hit
        rebound = restitution(flank, abs(found.velocity)) * abs(found.velocity)
        if rebound >= max(stick_velocity, LEAST):
            launch = rebound if flank == ACTIVE else -rebound
            continue
        if not swing.presses(flank, phase):
            why = f"contact does not last after the impact at {phase:.3f} rad: the flank does not push there"
            break
        until = swing.loss[flank]
        ridden = (until - phase) % (2.0 * pi)
        lowest = -1.0 if (1.5 * pi - phase) % (2.0 * pi) < ridden else min(sin(phase), sin(until))
        slowest = min(slowest, swing.speed * lowest)
        spent += ridden / swing.omega
        if flank == ACTIVE:
            struck = {flight.struck for flight in flights if flight.height > least_height}
            periods = round(spent * swing.omega / (2.0 * pi))
            return Cycle(REGIMES[len(struck)], tuple(flights), periods, slowest)
        phase, launch = until, 0.0
    return Cycle("unknown", tuple(flights), 0, slowest, why)


def regions(excitation: np.ndarray, backlash: np.ndarray, samples: int = 400) -> np.ndarray:
    """Return the regime of the plastic orbit over Λ and j̄, as indices into ``REGIMES``.

    Args:
        excitation: Λ, (n,).
        backlash: j̄, rising, (k,).
        samples: of the motion in a period.

    Returns:
        Codes, (n, k); ``"unknown"`` where contact does not last after an impact.

    Source: Rigaud & Perret-Liaudet 2020, eqs (17)-(19), in the units of Kadmiri et al. 2012, eqs (23), (24).

    >>> regions(np.array([0.5, 3.0]), np.array([0.1, 50.0])).tolist()
    [[0, 0], [2, 1]]
    """
    codes = np.zeros((len(excitation), len(backlash)), dtype=np.int8)
    for row, size in enumerate(excitation):
        if size > 1.0:
            codes[row] = _column(Swing(1.0, 1.0, 1.0 / size), np.asarray(backlash), samples)
    return codes


def _column(swing: Swing, backlash: np.ndarray, samples: int) -> np.ndarray:
    """Return the codes of one Λ: both flights are sampled once, and every backlash looks its crossing up."""
    lost, back = swing.loss
    whole = landing(swing, lost, 0.0, inf, longest=2.0 * pi * LONGEST)
    end = whole.time if whole is not None else 2.0 * pi * LONGEST
    time = np.linspace(0.0, end, max(int(samples * end / (2.0 * pi)), 50))
    crossed, there = _first(time, drift(swing, lost, time)[0], backlash)
    lasting = swing.pull + np.cos(lost + there) < 0.0
    time = np.linspace(0.0, 4.0 * pi, 4 * samples)
    _, again = _first(time, -drift(swing, back, time)[0], backlash)
    lasting &= swing.pull + np.cos(back + again) > 0.0
    falls = whole is not None and swing.presses(ACTIVE, lost + whole.time)
    single = REGIMES.index("single_sided" if falls else "unknown")
    return np.where(crossed, np.where(lasting, 2, 3), single)


def _first(time: np.ndarray, way: np.ndarray, goals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return whether a way comes to each goal, and when first."""
    far = np.maximum.accumulate(way)
    reached = far[-1] > goals
    return reached, np.interp(goals, far, time)


def border(excitation: np.ndarray) -> np.ndarray:
    """Return the dimensionless backlash j̄ that the flight from the active flank just crosses, over Λ.

    Below it the plastic orbit is double-sided, above it single-sided; 0 up to Λ = 1, where contact is never lost.

    Args:
        excitation: Λ, (n,).

    Source: Rigaud & Perret-Liaudet 2020, eqs (15)-(18): the largest height of the flight that falls back.

    >>> border(np.array([0.9, 1.039299])).round(4).tolist()  # 79.96 µm over H = 12.33 mm
    [0.0, 0.0065]
    """
    heights = np.zeros(len(excitation))
    for row, size in enumerate(excitation):
        if size > 1.0:
            swing = Swing(1.0, 1.0, 1.0 / size)
            found = landing(swing, swing.loss[0], 0.0, inf, longest=2.0 * pi * max(LONGEST, 10.0 * size))
            heights[row] = found.highest if found is not None else inf
    return heights
