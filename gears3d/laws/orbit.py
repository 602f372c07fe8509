"""Motion of the loose gear under one harmonic: flights of plastic impacts, periodic cycles, borders of regimes."""

from __future__ import annotations

import math
from collections.abc import Callable
from math import acos, ceil, cos, inf, pi, sin
from typing import Any, NamedTuple

import numpy as np

ACTIVE, REVERSE = 0, 1
Restitution = Callable[[int, float], float]
MOST = 400  # So many flights, and no lasting contact on the active flank, are no cycle
LONGEST = 50  # A flight of so many periods is a separation for good
SENSITIVE = 1e-7  # A change of the backlash by this share must leave the order of the impacts as it is
LEAST = 1e-13  # Rebound speed that counts as 0 [m/s]
REGIMES = ("contact", "single_sided", "double_sided", "unknown")


class SineDrive(NamedTuple):
    """A drive with one harmonic against a constant drag, along the line of action.

    Args:
        speed: amplitude ΔV of the drive's speed [m/s], at least 0.
        omega: its circular frequency [rad/s].
        pull: deceleration F/m of the loose gear in flight [m/s²], at least 0.

    >>> round(SineDrive(0.148 * 20 * pi / 30, 6 * pi, 0.468489).excitation, 4)
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


def drift(drive: SineDrive, phase: Any, time: Any, launch: Any = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return how far and how fast the loose gear has moved against the drive since a flight began.

    Args:
        drive: the drive.
        phase: ωt when it began [rad], scalar or (n,).
        time: since then [s], scalar or (n,).
        launch: relative speed when it began [m/s], scalar or (n,).

    Returns:
        Relative displacement [m] and speed [m/s].

    Source: Rigaud & Perret-Liaudet 2020, eqs (12)-(14).

    >>> drive = SineDrive(0.3, 20.0, 0.5)
    >>> [float(part.round(9)) for part in drift(drive, 1.7, 0.01)]
    [3.3318e-05, 0.008609417]
    """
    speed, omega, pull = drive
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
    drive: SineDrive, phase: float, to_active: float, to_reverse: float, launch: float = 0.0, longest: float = inf
) -> Landing | None:
    """Return where and when a flight ends.

    Args:
        drive: the drive.
        phase: ωt when the flight begins [rad].
        to_active: distance of the active flank then, at least 0 [m].
        to_reverse: distance of the reverse flank then, at least 0 [m].
        launch: relative speed then [m/s].
        longest: where the search ends [s].

    Returns:
        The first touch; ``None`` without one until ``longest``.

    Source: Rigaud & Perret-Liaudet 2020, eqs (18), (19), and the condition that the flight does not fall back.

    >>> drive = SineDrive(0.148 * 20 * pi / 30, 6 * pi, 0.468489)
    >>> first = landing(drive, drive.loss[0], 0.0, 250e-6)
    >>> first.flank, round(1e3 * first.velocity, 4)
    (1, 30.8581)
    """
    if drive.speed == 0.0 and drive.pull == 0.0 and launch == 0.0:
        return None
    highest = lowest = 0.0
    begin = 0.0
    for end in _turns(drive, phase, launch, longest):
        there = float(drift(drive, phase, end, launch)[0])
        if (there >= to_reverse and there > 0.0) or (there <= -to_active and there < 0.0):
            flank = REVERSE if there > 0.0 else ACTIVE
            goal = to_reverse if flank == REVERSE else -to_active
            time = _root(lambda t, goal=goal: float(drift(drive, phase, t, launch)[0]) - goal, begin, end)
            if time > 0.0:
                velocity = float(drift(drive, phase, time, launch)[1])
                return Landing(time, flank, velocity, max(highest, goal), min(lowest, goal))
        highest, lowest = max(highest, there), min(lowest, there)
        begin = end
    return None


def _turns(drive: SineDrive, phase: float, launch: float, longest: float):  # type: ignore[no-untyped-def]
    """Yield times between which the relative displacement is monotonic, the last one ``longest``."""

    def speed(time: float) -> float:
        return float(drift(drive, phase, time, launch)[1])

    begin, before = 0.0, launch
    for end in _bends(drive, phase):
        end = min(end, longest)
        after = speed(end)
        if before * after < 0.0:
            yield _root(speed, begin, end)
        yield end
        if end >= longest:
            return
        begin, before = end, after


def _bends(drive: SineDrive, phase: float):  # type: ignore[no-untyped-def]
    """Yield times at which the relative acceleration changes its sign, or whole periods where it never does."""
    period = 2.0 * pi / drive.omega
    if drive.excitation <= 1.0:
        number = 1
        while True:
            yield number * period
            number += 1
    turn = ceil((phase - drive.loss[1]) / (2.0 * pi)) - 1
    while True:
        for lost in drive.loss:
            ahead = lost + 2.0 * pi * turn - phase
            if ahead > 1e-9:
                yield ahead / drive.omega
        turn += 1


def _root(function: Any, begin: float, end: float) -> float:
    from scipy.optimize import root_scalar

    low, high = function(begin), function(end)
    if low == 0.0 or low * high > 0.0:  # a touch within rounding of an end
        return begin if abs(low) < abs(high) else end
    return root_scalar(function, bracket=(begin, end), method="brentq", xtol=1e-18, rtol=8.9e-16).root


def loss_phases(excitation: float) -> tuple[float, float]:
    """Return the phases ωt at which the active and the reverse flank are left [rad].

    Source: Rigaud & Perret-Liaudet 2020, eq. (17), with ẏ = ΔV·sin ωt.
    Theory: docs/theory/rattle.md, equation (3).

    Args:
        excitation: Λ = m·ω·ΔV/F, at least 1.

    Raises:
        ValueError: Λ < 1, so that contact is never lost.

    >>> [round(phase, 6) for phase in loss_phases(12.47159)]
    [1.651065, 4.632121]
    """
    if excitation < 1.0:
        raise ValueError(f"contact is never lost at an excitation of {excitation} < 1")
    active = math.acos(-1.0 / excitation)
    return active, 2.0 * math.pi - active


def crossing(speed: float, omega: float, pull: float, phase: float, gap: float) -> tuple[float, float]:
    """Return when a flight crosses a gap, and how fast it arrives.

    Source: Rigaud & Perret-Liaudet 2020, eqs (18) and (19).

    Args:
        speed: amplitude ΔV of the drive's speed along the line of action [m/s].
        omega: its circular frequency [rad/s].
        pull: deceleration F/m of the loose gear [m/s²].
        phase: ωt at which contact is lost [rad].
        gap: how far to go, positive from the active to the reverse flank, negative back [m].

    Returns:
        Time of arrival [s] and relative speed just before [m/s].

    Raises:
        ValueError: the gap is not crossed within half a period.

    >>> time, approach = crossing(0.148 * 20 * math.pi / 30, 6 * math.pi, 0.468489, 1.651065, 250e-6)
    >>> round(time, 6), round(approach, 5)
    (0.111654, 0.03086)
    """
    from scipy.optimize import root_scalar

    lost = phase / omega
    launch = speed * math.sin(phase)

    def left(time: float) -> float:
        flown = time - lost
        driven = speed / omega * (math.cos(phase) - math.cos(omega * time))
        return launch * flown - 0.5 * pull * flown**2 - driven - gap

    hit = root_scalar(left, bracket=(lost, lost + math.pi / omega), xtol=1e-16, rtol=1e-15).root
    return hit, launch - pull * (hit - lost) - speed * math.sin(omega * hit)


class Flight(NamedTuple):
    """One flight.

    Args:
        left: flank that it left.
        lost: phase when it began [rad].
        launch: relative speed then [m/s].
        struck: flank of the impact that ended it.
        hit: phase of that impact [rad].
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
        why: a closed form does not exist; empty where one does.
    """

    regime: str
    flights: tuple[Flight, ...] = ()
    periods: int = 1
    slowest: float = -inf
    why: str = ""


def plastic(flank: int, speed: float) -> float:
    """Return the restitution 0 for every impact.

    Args:
        flank: 0 active, 1 reverse.
        speed: [m/s].

    Source: Rigaud & Perret-Liaudet 2020, eqs (16), (17), with e = 0.
    """
    return 0.0


def cycle(
    drive: SineDrive,
    backlash: float,
    restitution: Restitution = plastic,
    stick_velocity: float = 0.0,
    least_height: float = 0.0,
) -> Cycle:
    """Return the cycle that begins with contact on the active flank.

    Args:
        drive: the drive.
        backlash: [m].
        restitution: coefficient for a flank (0 active, 1 reverse) and an impact speed [m/s].
        stick_velocity: rebound below which contact lasts [m/s].
        least_height: impacts after flights no higher than this do not name the regime [m].

    Returns:
        The cycle; its regime is ``"unknown"`` without a closed form.

    Source: Rigaud & Perret-Liaudet 2020, eqs (17)-(19); Kadmiri et al. 2012, eqs (19)-(22).

    >>> drive = SineDrive(0.148 * 20 * pi / 30, 6 * pi, 0.468489)
    >>> found = cycle(drive, 250e-6)
    >>> found.regime, [round(1e3 * flight.velocity, 4) for flight in found.flights]
    ('double_sided', [30.8581, -31.2425])
    >>> cycle(drive._replace(speed=0.02), 250e-6).regime
    'contact'
    """
    if drive.excitation <= 1.0:
        return Cycle("contact", slowest=-drive.speed)
    found = _chain(drive, backlash, restitution, stick_velocity, least_height)
    if not found.why and len(found.flights) > 1:
        other = _chain(drive, backlash * (1.0 + SENSITIVE), restitution, stick_velocity, least_height)
        if [flight.struck for flight in found.flights] != [flight.struck for flight in other.flights]:
            why = "the flights hang on less than a ten-millionth of the backlash"
            return found._replace(regime="unknown", periods=0, why=why)
    return found


def _chain(
    drive: SineDrive, backlash: float, restitution: Restitution, stick_velocity: float, least_height: float
) -> Cycle:
    """Follow the flights from the loss of the active flank until contact on it lasts."""
    flights: list[Flight] = []
    flank, phase, launch, spent, slowest = ACTIVE, drive.loss[ACTIVE], 0.0, 0.0, inf
    why = f"no lasting contact on the active flank within {MOST} impacts"
    longest = LONGEST * 2.0 * pi / drive.omega
    while len(flights) < MOST:
        place = backlash * flank
        found = landing(drive, phase, place, backlash - place, launch, longest)
        if found is None:
            why = f"a flight does not end within {LONGEST} periods"
            break
        hit = (phase + drive.omega * found.time) % (2.0 * pi)
        height = found.highest if flank == ACTIVE else -found.lowest
        flights.append(Flight(flank, phase, launch, found.flank, hit, found.time, found.velocity, height))
        slowest = min(slowest, launch + drive.speed * sin(phase) - drive.pull * found.time)
        spent += found.time
        flank, phase = found.flank, hit
        rebound = restitution(flank, abs(found.velocity)) * abs(found.velocity)
        if rebound >= max(stick_velocity, LEAST):
            launch = rebound if flank == ACTIVE else -rebound
            continue
        if not drive.presses(flank, phase):
            why = f"contact does not last after the impact at {phase:.3f} rad: the flank does not push there"
            break
        until = drive.loss[flank]
        ridden = (until - phase) % (2.0 * pi)
        lowest = -1.0 if (1.5 * pi - phase) % (2.0 * pi) < ridden else min(sin(phase), sin(until))
        slowest = min(slowest, drive.speed * lowest)
        spent += ridden / drive.omega
        if flank == ACTIVE:
            struck = {flight.struck for flight in flights if flight.height > least_height}
            periods = round(spent * drive.omega / (2.0 * pi))
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
            codes[row] = _column(SineDrive(1.0, 1.0, 1.0 / size), np.asarray(backlash), samples)
    return codes


def _column(drive: SineDrive, backlash: np.ndarray, samples: int) -> np.ndarray:
    """Return the codes of one Λ: both flights are sampled once, and every backlash looks its crossing up."""
    lost, back = drive.loss
    whole = landing(drive, lost, 0.0, inf, longest=2.0 * pi * LONGEST)
    end = whole.time if whole is not None else 2.0 * pi * LONGEST
    time = np.linspace(0.0, end, max(int(samples * end / (2.0 * pi)), 50))
    crossed, there = _first(time, drift(drive, lost, time)[0], backlash)
    lasting = drive.pull + np.cos(lost + there) < 0.0
    time = np.linspace(0.0, 4.0 * pi, 4 * samples)
    _, again = _first(time, -drift(drive, back, time)[0], backlash)
    lasting &= drive.pull + np.cos(back + again) > 0.0
    falls = whole is not None and drive.presses(ACTIVE, lost + whole.time)
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
    Theory: docs/theory/rattle.md, equation (4).

    >>> border(np.array([0.9, 1.039299])).round(4).tolist()  # 79.96 µm over H = 12.33 mm
    [0.0, 0.0065]
    """
    heights = np.zeros(len(excitation))
    for row, size in enumerate(excitation):
        if size > 1.0:
            drive = SineDrive(1.0, 1.0, 1.0 / size)
            found = landing(drive, drive.loss[0], 0.0, inf, longest=2.0 * pi * max(LONGEST, 10.0 * size))
            heights[row] = found.highest if found is not None else inf
    return heights
