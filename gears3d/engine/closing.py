"""When a flight ends: the first instant at which a flank gap, measured on the surfaces, closes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from gears3d.engine.mesh import side_gap
from gears3d.engine.motion import drive_at
from gears3d.engine.torques import FREE, acceleration
from gears3d.gears.flank import Flanks

NOTHING, CLOSES_ACTIVE, CLOSES_REVERSE, STOPS = 0, 1, 2, 3
"""How a step ends: no event, a gap closes on the active or reverse flank, the loose gear comes to rest."""

TOUCH = 1e-11
"""A gap smaller than this counts as none [m]."""
PARTS = 4
"""Looks within a step at which both gaps are measured."""
HALVINGS = 60


class Plant(NamedTuple):
    """What does not change during a run.

    Args:
        surfaces: the flanks.
        motion: table of the drive gear's motion.
        torques: table of the loose gear's torques.
        inertia: of the loose gear [kg m²].
    """

    surfaces: Flanks
    motion: np.ndarray
    torques: np.ndarray
    inertia: float


class Arc(NamedTuple):
    """A parabola of flight.

    Args:
        time: at which it starts [s].
        theta: angle of the loose gear there [rad].
        omega: speed there [rad/s].
        accel: acceleration throughout [rad/s²].
    """

    time: float
    theta: float
    omega: float
    accel: float


@njit(cache=True)
def middle_acceleration(plant: Plant, place: int, start: Arc, duration: float) -> float:
    """Return the acceleration [rad/s²] that, held over a step, gives its speed to third order in the duration."""
    torques, inertia = plant.torques, plant.inertia
    direction = np.sign(start.omega)
    first = acceleration(torques, inertia, place, start.time, start.theta, start.omega, direction)
    if direction == 0.0:
        direction = np.sign(first)
    half = 0.5 * duration
    theta = start.theta + (start.omega + 0.5 * first * half) * half
    return acceleration(torques, inertia, place, start.time + half, theta, start.omega + first * half, direction)


@njit(cache=True)
def gap_along(plant: Plant, teeth: np.ndarray, side: int, arc: Arc, after: float) -> tuple[float, float]:
    """Return gap [m] and gap rate [m/s] of one side, ``after`` seconds into a flight."""
    angle, speed, _ = drive_at(plant.motion, arc.time + after)
    loose = arc.theta + (arc.omega + 0.5 * arc.accel * after) * after
    gap, by_drive, by_loose, _ = side_gap(plant.surfaces, teeth, side, angle, loose)
    return gap, by_drive * speed + by_loose * (arc.omega + arc.accel * after)


@njit(cache=True)
def closing_within(plant: Plant, teeth: np.ndarray, side: int, arc: Arc, longest: float) -> float:
    """Return when the gap of one side first closes, or -1 if it stays open for ``longest`` seconds.

    A gap that starts closed and is opening must first open; a dip between two looks is found by its lowest point.
    """
    low = 0.0
    gap_low, rate_low = gap_along(plant, teeth, side, arc, 0.0)
    if gap_low < -TOUCH and rate_low <= 0.0:
        return 0.0
    for part in range(1, PARTS + 1):
        high = longest * part / PARTS
        gap_high, rate_high = gap_along(plant, teeth, side, arc, high)
        if gap_high <= 0.0:
            start = low
            if gap_low <= TOUCH:
                start = _turn(plant, teeth, side, arc, low, high, 1.0)
            return _root(plant, teeth, side, arc, start, high)
        if rate_low < 0.0 < rate_high and gap_low > TOUCH:
            dip = _turn(plant, teeth, side, arc, low, high, -1.0)
            gap_dip, _ = gap_along(plant, teeth, side, arc, dip)
            if gap_dip < -TOUCH:
                return _root(plant, teeth, side, arc, low, dip)
        low, gap_low, rate_low = high, gap_high, rate_high
    return -1.0


@njit(cache=True)
def _turn(plant: Plant, teeth: np.ndarray, side: int, arc: Arc, low: float, high: float, sign: float) -> float:
    """Return where the gap rate, of this sign at ``low``, changes it: the top (+1) or bottom (-1) of the gap."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        _, rate = gap_along(plant, teeth, side, arc, middle)
        if rate * sign > 0.0:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True)
def _root(plant: Plant, teeth: np.ndarray, side: int, arc: Arc, low: float, high: float) -> float:
    """Return where the gap, open at ``low``, is closed: Newton's method kept inside a shrinking bracket."""
    at = high
    for _ in range(2 * HALVINGS):
        gap, rate = gap_along(plant, teeth, side, arc, at)
        if gap > 0.0:
            low = at
        else:
            high = at
        new = at - gap / rate if rate < 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - at) <= 1e-16 + 1e-16 * abs(arc.time):
            return new
        at = new
    return high


@njit(cache=True)
def plan_flight(plant: Plant, teeth: np.ndarray, start: Arc, longest: float) -> tuple[float, float, int]:
    """Return how long the next step of a flight is, under which acceleration, and how it ends.

    Args:
        plant: surfaces, motion, torques, inertia.
        teeth: candidate tooth pairs (n, 3): drive, loose, side.
        start: where the flight is now; its acceleration is not used.
        longest: longest step wanted [s].

    Returns:
        Duration [s], acceleration [rad/s²], and NOTHING, CLOSES_ACTIVE, CLOSES_REVERSE or STOPS.
    """
    duration, event = longest, NOTHING
    accel = middle_acceleration(plant, FREE, start, duration)
    for _ in range(6):
        arc = Arc(start.time, start.theta, start.omega, accel)
        reach, found = longest, NOTHING
        if start.omega * (start.omega + accel * longest) < 0.0:
            reach, found = -start.omega / accel, STOPS
        for side in range(2):
            root = closing_within(plant, teeth, side, arc, reach)
            if root >= 0.0:
                reach, found = root, CLOSES_ACTIVE + side
        settled = abs(reach - duration) <= 1e-15
        duration, event = reach, found
        new = middle_acceleration(plant, FREE, start, duration)
        if settled or new == accel:
            break
        accel = new
    return duration, accel, event


@njit(cache=True)
def highest(plant: Plant, teeth: np.ndarray, side: int, arc: Arc, duration: float) -> float:
    """Return the largest gap of one side during a step of flight [m]."""
    _, rate_low = gap_along(plant, teeth, side, arc, 0.0)
    gap_high, rate_high = gap_along(plant, teeth, side, arc, duration)
    if rate_low > 0.0 > rate_high:
        top, _ = gap_along(plant, teeth, side, arc, _turn(plant, teeth, side, arc, 0.0, duration, 1.0))
        return max(top, gap_high)
    return gap_high
