"""The rigid model on scipy's integrator, restarted at every event: slow and plain."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar

from gears3d.verification.validation.oracles.case import Case

STICK = 1e-4  # Rebound below which contact lasts [m/s]


def impacts(case: Case, duration: float) -> np.ndarray:
    """Return impacts from rest on the active flank: time [s], flank, velocity [m/s], rebound [m/s]; (n, 4).

    Units: ``duration`` [s].

    Source: Kadmiri et al. 2012, eqs (18)-(22).
    """
    found: list[tuple[float, int, float, float]] = []
    time, flank = _loss(case, 0, 0.0, duration), 0
    place = speed = 0.0
    while time < duration:
        time, place, speed, flank = _fly(case, time, place, speed, duration)
        if flank < 0:
            break
        rebound = -case.restitution * speed
        if abs(rebound) < STICK and _presses(case, flank, time):
            found.append((time, flank, speed, 0.0))
            time, speed = _loss(case, flank, time, duration), 0.0
        else:
            found.append((time, flank, speed, rebound))
            speed = rebound
    return np.array(found).reshape(-1, 4)


def _presses(case: Case, flank: int, time: float) -> bool:
    return (case.push(time) < 0.0) == (flank == 0)


def _loss(case: Case, flank: int, time: float, duration: float) -> float:
    step = 2 * np.pi / case.omega / 200
    while time < duration:
        if not _presses(case, flank, time + step):
            return root_scalar(case.push, bracket=(time, time + step), xtol=1e-16, rtol=1e-15).root
        time += step
    return duration


def _fly(case: Case, time: float, place: float, speed: float, duration: float) -> tuple[float, float, float, int]:
    """Fly to the next flank: time, place, speed, flank; -1 when the time is over."""

    def right(t: float, y: Any) -> list[float]:
        return [y[1], case.push(t)]

    def lower(t: float, y: Any) -> float:
        return y[0]

    def upper(t: float, y: Any) -> float:
        return y[0] - case.backlash

    lower.terminal = upper.terminal = True  # type: ignore[attr-defined]
    lower.direction, upper.direction = -1.0, 1.0  # type: ignore[attr-defined]
    done = solve_ivp(
        right, (time, duration), [place, speed], "DOP853", events=(lower, upper), rtol=1e-12, atol=[1e-18, 1e-15],
        max_step=_longest(case, time, speed),
    )  # fmt: skip
    place, speed = (float(part) for part in done.y[:, -1])
    if done.status != 1:
        return duration, place, speed, -1
    flank = 0 if len(done.t_events[0]) else 1
    return float(done.t[-1]), case.backlash * flank, speed, flank


def _longest(case: Case, time: float, speed: float) -> float:
    """Return a step that cannot jump over a short bounce [s]."""
    longest = 0.01 / case.omega
    return min(longest, max(0.3 * abs(speed / (case.push(time) or 1.0)), 1e-6)) if speed else longest
