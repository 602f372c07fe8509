"""Springs and dampers in place of rigid flanks: they tend to the rigid model as they get stiffer.

A linear spring and damper has the restitution e when it may pull until the gap opens and its damping ratio is that of
Rigaud & Perret-Liaudet 2020, eq. (20), with the square that the print lacks. A flank cannot pull; where the force is
cut off at zero, the gear leaves earlier and faster, and another ratio has the restitution e: both are tried.
"""

from __future__ import annotations

from math import exp, sqrt
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar

from gears3d.laws.contact import damping_ratio
from gears3d.verification.validation.oracles.case import Case

State = tuple[float, float, float]


def given_back(ratio: float) -> float:
    """Return the restitution of a spring and damper of ratio ζ that lets go where its force ends.

    >>> round(given_back(0.357857), 3)  # a flank that may pull has e = 0.3
    0.397
    """
    root = sqrt(1.0 - ratio**2)
    return exp(-ratio / root * np.arctan2(2.0 * ratio * root, 2.0 * ratio**2 - 1.0))


def ratio_for(restitution: float, pulls: bool) -> float:
    """Return the damping ratio whose restitution is e."""
    if pulls:
        return float(damping_ratio(restitution))
    return root_scalar(lambda ratio: given_back(ratio) - restitution, bracket=(1e-6, 0.999)).root


def impacts(case: Case, duration: float, stiffness: float, pulls: bool = False) -> np.ndarray:
    """Return passages from the first flight on: time [s], flank, velocity and rebound [m/s], flight height [m]; (n, 5).

    Units: ``duration`` [s]; ``stiffness`` [N/m].
    """
    damping = 2.0 * ratio_for(case.restitution, pulls) * sqrt(stiffness * case.mass)
    state = (0.0, -(case.force + case.mass * case.speed * case.omega) / stiffness, 0.0)
    found, where, height = [], 0, 0.0
    entry = (0.0, 0.0)
    while state[0] < duration:
        before = where
        state, where, reached = _follow(case, state, where, duration, stiffness, damping, pulls)
        if state[0] >= duration:
            break
        if before == 0.5:
            entry, height = (state[0], state[2]), reached
        elif entry != (0.0, 0.0):
            found.append((entry[0], before, entry[1], state[2], height))
    return np.array(found).reshape(-1, 5)


def _follow(
    case: Case,
    state: tuple[float, float, float],
    where: float,
    end: float,
    stiffness: float,
    damping: float,
    pulls: bool,
) -> tuple[tuple[float, float, float], float, float]:
    """Continue to the next crossing of a flank; ``where`` is 0 or 1 in a flank and 0.5 between them."""
    wall = case.backlash if where == 1 else 0.0
    side = -1.0 if where == 1 else 1.0

    def right(t: float, y: Any) -> list[float]:
        force = 0.0
        if where != 0.5:
            force = -stiffness * (y[0] - wall) - damping * y[1]
            force = force if pulls or force * side > 0.0 else 0.0
        return [y[1], case.push(t) + force / case.mass]

    def crossing(place: float, direction: float) -> Any:
        def event(t: float, y: Any) -> float:
            return y[0] - place

        event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
        return event

    free = where == 0.5
    events = [crossing(0.0, -1.0), crossing(case.backlash, 1.0)] if free else [crossing(wall, side)]
    swing = sqrt(case.mass / stiffness)
    until = end if free else min(end, state[0] + 12.0 * swing)
    done = solve_ivp(
        right, (state[0], until), state[1:], "DOP853", events=events, rtol=1e-9, atol=[1e-15, 1e-12],
        max_step=2e-4 if free else 0.3 * swing,
    )  # fmt: skip
    if done.status != 1 and until < end:  # at rest on the spring
        done = solve_ivp(
            right, (until, end), done.y[:, -1], "DOP853", events=events, rtol=1e-9, atol=[1e-15, 1e-12],
            max_step=6.0 * swing,
        )  # fmt: skip
    place, speed = (float(part) for part in done.y[:, -1])
    if done.status != 1:
        return (end, place, speed), where, 0.0
    struck = 0.5 if not free else (0 if len(done.t_events[0]) else 1)
    reached = float(np.abs(done.y[0] - state[1]).max())
    wall = (0.0 if len(done.t_events[0]) else case.backlash) if free else wall
    return (float(done.t[-1]), wall, speed), struck, reached
