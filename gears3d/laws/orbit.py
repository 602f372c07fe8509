"""Motion of the loose gear against one harmonic of the drive and a constant drag, piece by piece in closed form.

x is the loose and y the drive gear's way along the line of action, s = x − y, ẏ = ΔV·sin ωt and ẍ = −F/m in flight.
The relative speed is monotonic between the phases at which contact would be lost, so that every turning point of s, and
then its first crossing of a flank, is found between bounds: no impact is missed.

Source: Rigaud & Perret-Liaudet 2020, eqs (11)-(19).
"""

from __future__ import annotations

from math import acos, ceil, cos, inf, pi
from typing import Any, NamedTuple

import numpy as np

ACTIVE, REVERSE = 0, 1


class Swing(NamedTuple):
    """A drive with one harmonic against a constant drag, along the line of action.

    Args:
        speed: amplitude ΔV of the drive's speed [m/s], at least 0.
        omega: its circular frequency [rad/s].
        pull: deceleration F/m of the loose gear in flight [m/s²], at least 0.

    >>> round(Swing(0.148 * 20 * pi / 30, 6 * pi, 0.468489).excitation, 4)
    12.4716
    """

    speed: float
    omega: float
    pull: float

    @property
    def excitation(self) -> float:
        """Λ = m·ω·ΔV/F (Rigaud & Perret-Liaudet 2020, eq. 7); infinite without drag."""
        push = self.omega * self.speed
        if self.pull > 0.0:
            return push / self.pull
        return inf if push > 0.0 else 0.0

    @property
    def loss(self) -> tuple[float, float]:
        """Phases at which the active and the reverse flank are left [rad]; (π, π) when contact is never lost."""
        phase = acos(-min(1.0, self.pull / (self.omega * self.speed))) if self.excitation > 1.0 else pi
        return phase, 2.0 * pi - phase

    def presses(self, flank: int, phase: float) -> bool:
        """Whether a flank pushes the gear that rides on it; Kadmiri et al. 2012, eqs (21), (22).

        Args:
            flank: 0 active, 1 reverse.
            phase: ωt [rad].
        """
        reaction = self.pull + self.speed * self.omega * cos(phase)
        return reaction > 0.0 if flank == ACTIVE else reaction < 0.0


class Landing(NamedTuple):
    """The end of a flight.

    Args:
        time: since its begin [s].
        flank: 0 active, 1 reverse.
        velocity: relative to the flank just before [m/s].
        highest: largest relative displacement on the way, counted from the begin [m].
        lowest: smallest [m].
    """

    time: float
    flank: int
    velocity: float
    highest: float
    lowest: float


def drift(swing: Swing, phase: Any, time: Any, launch: Any = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return how far and how fast the loose gear has moved against the drive since a flight began.

    Args:
        swing: the drive.
        phase: ωt when it began [rad], scalar or (n,).
        time: since then [s], scalar or (n,).
        launch: relative speed when it began [m/s], scalar or (n,).

    Returns:
        Relative displacement [m] and speed [m/s].

    Source: Rigaud & Perret-Liaudet 2020, eqs (12)-(14).

    >>> swing = Swing(0.3, 20.0, 0.5)
    >>> [float(part.round(9)) for part in drift(swing, 1.7, 0.01)]
    [3.3318e-05, 0.008609417]
    """
    speed, omega, pull = swing
    turned = omega * np.asarray(time)
    versine = 2.0 * np.sin(0.5 * turned) ** 2
    lag = np.where(np.abs(turned) < 0.3, _lag(turned), turned - np.sin(turned))
    along, across = np.cos(phase), np.sin(phase)
    displacement = launch * time - 0.5 * pull * time**2 - speed / omega * (along * versine - across * lag)
    velocity = launch - pull * time - speed * (along * np.sin(turned) - across * versine)
    return displacement, velocity


def _lag(x: Any) -> Any:
    """Return x − sin x of a small x without cancellation."""
    z = np.minimum(x * x, 1.0)
    return x * z * (1 / 6 - z * (1 / 120 - z * (1 / 5040 - z * (1 / 362880 - z / 39916800))))


def landing(
    swing: Swing, phase: float, to_active: float, to_reverse: float, launch: float = 0.0, longest: float = inf
) -> Landing | None:
    """Return where and when a flight ends.

    Args:
        swing: the drive.
        phase: ωt when the flight begins [rad].
        to_active: distance of the active flank then, at least 0 [m].
        to_reverse: distance of the reverse flank then, at least 0 [m].
        launch: relative speed then [m/s].
        longest: where the search ends [s].

    Returns:
        The first touch; ``None`` when there is none until ``longest``.

    Source: Rigaud & Perret-Liaudet 2020, eqs (18), (19), and the condition that the flight does not fall back.

    >>> swing = Swing(0.148 * 20 * pi / 30, 6 * pi, 0.468489)
    >>> hit = landing(swing, swing.loss[0], 0.0, 250e-6)
    >>> hit.flank, round(1e3 * hit.velocity, 4)
    (1, 30.8581)
    """
    if swing.speed == 0.0 and swing.pull == 0.0 and launch == 0.0:
        return None
    highest = lowest = 0.0
    begin = 0.0
    for end in _turns(swing, phase, launch, longest):
        there = float(drift(swing, phase, end, launch)[0])
        if (there >= to_reverse and there > 0.0) or (there <= -to_active and there < 0.0):
            flank = REVERSE if there > 0.0 else ACTIVE
            goal = to_reverse if flank == REVERSE else -to_active
            time = _root(lambda t, goal=goal: float(drift(swing, phase, t, launch)[0]) - goal, begin, end)
            if time > 0.0:
                velocity = float(drift(swing, phase, time, launch)[1])
                return Landing(time, flank, velocity, max(highest, goal), min(lowest, goal))
        highest, lowest = max(highest, there), min(lowest, there)
        begin = end
    return None


def _turns(swing: Swing, phase: float, launch: float, longest: float):  # type: ignore[no-untyped-def]
    """Yield times between which the relative displacement is monotonic, the last one ``longest``."""

    def speed(time: float) -> float:
        return float(drift(swing, phase, time, launch)[1])

    begin, before = 0.0, launch
    for end in _bends(swing, phase):
        end = min(end, longest)
        after = speed(end)
        if before * after < 0.0:
            yield _root(speed, begin, end)
        yield end
        if end >= longest:
            return
        begin, before = end, after


def _bends(swing: Swing, phase: float):  # type: ignore[no-untyped-def]
    """Yield times at which the relative acceleration changes its sign, or whole periods where it never does."""
    period = 2.0 * pi / swing.omega
    if swing.excitation <= 1.0:
        number = 1
        while True:
            yield number * period
            number += 1
    turn = ceil((phase - swing.loss[1]) / (2.0 * pi)) - 1
    while True:
        for lost in swing.loss:
            ahead = lost + 2.0 * pi * turn - phase
            if ahead > 1e-9:
                yield ahead / swing.omega
        turn += 1


def _root(function: Any, begin: float, end: float) -> float:
    from scipy.optimize import root_scalar

    low, high = function(begin), function(end)
    if low == 0.0 or low * high > 0.0:  # a touch within rounding of an end
        return begin if abs(low) < abs(high) else end
    return root_scalar(function, bracket=(begin, end), method="brentq", xtol=1e-18, rtol=8.9e-16).root
