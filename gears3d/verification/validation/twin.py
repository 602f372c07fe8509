"""The rigid twin against closed forms and independent integrations: events, time stepping, springs and dampers."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, exp, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar

from gears3d.laws import crossing, loss_phases
from gears3d.laws.contact import damping_ratio
from gears3d.laws.orbit import cycle
from gears3d.scenario import Scenario
from gears3d.simulation import simulate
from gears3d.verification.validation.check import Check, fig5, swing

CASES = {"20 rpm, 3 Hz, 250 um": (20, 3, 250), "5 rpm, 3 Hz, 250 um": (5, 3, 250), "4 rpm, 10 Hz, 200 um": (4, 10, 200)}


def plastic(amplitude: int, frequency: int, backlash: int) -> Scenario:
    """Return figure 5 with perfectly plastic impacts.

    Units: ``amplitude`` [rpm].
    """
    harmonics = [{"amplitude": f"{amplitude} rpm", "frequency": f"{frequency} Hz"}]
    overrides = {"impact.restitution": 0.0, "mount.backlash": f"{backlash} um", "motion.harmonics": harmonics}
    return fig5().with_({**overrides, "run.duration": f"{2.2 / frequency} s"})


def orbit(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and approach speeds [m/s] of reverse and active impact in the plastic orbit's first period."""
    drive = swing(scenario)
    phases = loss_phases(drive.excitation)
    gaps = (scenario.rig().backlash, -scenario.rig().backlash)
    hits = [crossing(drive.speed, drive.omega, drive.pull, phase, gap) for phase, gap in zip(phases, gaps, strict=True)]
    return np.array([hit[0] for hit in hits]), np.array([hit[1] for hit in hits])


def check_twin(quick: bool = False) -> Iterator[Check]:
    """The rigid twin against closed forms.

    Plastic orbit (e = 0) of Rigaud & Perret-Liaudet 2020, eqs (17)-(19): times at which contact is lost and impact
    speeds follow from four transcendental equations, solved here by bracketing; approach speeds after rebounds from the
    same equations with e > 0, and the threshold from Λ = 1 (eq. 7).
    """
    for name, case in CASES.items():
        scenario = plastic(*case)
        times, speeds = orbit(scenario)
        impacts = simulate(scenario, "rigid").impacts
        off = float(np.abs(impacts["time_s"][:2] - times).max() / scenario.period)
        yield Check(f"plastic orbit, {name}: impact times off", off, 1e-8, "period")
        yield Check(
            f"plastic orbit, {name}: impact speeds off",
            float(np.abs(impacts["velocity_m_s"][:2] / speeds - 1).max()),
            1e-8,
        )
    for excitation, expected in ((0.999, 0), (1.001, 1)):
        scenario = threshold(excitation)
        count = len(simulate(scenario, "rigid").impacts["time_s"])
        yield Check(
            f"excitation {excitation}: impacts in a period {'none' if not expected else 'some'}: wrong",
            float((count > 0) != bool(expected)),
            0,
        )


def threshold(excitation: float) -> Scenario:
    """Return figure 5 at a given excitation Λ = J·ω·ΔΩ/Td (Rigaud & Perret-Liaudet 2020, eq. 7)."""
    rig = fig5().rig()
    amplitude = excitation * rig.drag_torque / rig.inertia / (2 * np.pi * 3.0)
    return fig5().with_({"motion.harmonics": [{"amplitude": f"{amplitude!r} rad/s", "frequency": "3 Hz"}]})


# each orbit by its amplitude [rpm], frequency [Hz], backlash [µm], and number of periods
ORBITS = {
    "20 rpm, 3 Hz, 250 um": (20, 3, 250, 20),
    "4 rpm, 10 Hz, 200 um": (4, 10, 200, 20),
    "5 rpm, 1 Hz, 250 um, single-sided": (5, 1, 250, 5),
}
STEPS = (500, 1000, 2000, 4000, 8000, 16000)  # Of a period: a factor of 32, which shows the order of convergence
STIFFNESSES = (1e7, 1e8, 1e9)  # Of the flanks [N/m]: two decades, which show the order of convergence


def bench(rpm: float, hertz: float, backlash: float, restitution: float, periods: float) -> Scenario:
    """Return a case of the bench.

    Units: ``backlash`` [µm].
    """
    return fig5().with_(
        {
            "motion.harmonics": [{"amplitude": f"{rpm} rpm", "frequency": f"{hertz} Hz"}],
            "mount.backlash": f"{backlash} um", "impact.restitution": restitution,
            "run.duration": f"{periods / hertz!r} s", "run.output_rate": f"{max(STEPS) * hertz} Hz",
        }
    )  # fmt: skip


def stepping_errors(scenario: Scenario) -> np.ndarray:
    """Return the mean distance of Moreau's stepping from the twin over one period [m], for each of ``STEPS``."""
    twin = simulate(scenario, "rigid").signals["displacement_m"]
    found = []
    for steps in STEPS:
        places = step_through(case(scenario), scenario.run.duration, steps)
        found.append(float(np.abs(places - twin[:: max(STEPS) // steps]).mean()))
    return np.array(found)


def order(sizes: np.ndarray, errors: np.ndarray) -> float:
    """Return the exponent with which errors fall with a size, by least squares of the logarithms.

    Shapes: ``sizes`` (n,); ``errors`` (n,).

    >>> round(order(np.array([1.0, 2.0, 4.0]), np.array([1.0, 0.5, 0.25])), 9)
    1.0
    """
    return float(-np.polyfit(np.log(sizes), np.log(errors), 1)[0])


def yielding_errors(scenario: Scenario, stiffnesses: tuple[float, ...], pulls: bool) -> np.ndarray:
    """Return the largest relative error of approach and rebound of springs against the twin's impacts across the gap.

    Units: ``stiffnesses`` [N/m], (n,).
    """
    twin = simulate(scenario, "rigid").impacts
    hard = twin["flight_height_m"] > 0.9 * scenario.rig().backlash
    true = np.stack([twin["velocity_m_s"][hard], twin["rebound_m_s"][hard]])
    found = []
    for stiffness in stiffnesses:
        soft = yielding_impacts(case(scenario), scenario.run.duration, stiffness, pulls)
        soft = soft[soft[:, 4] > 0.9 * scenario.rig().backlash]
        same = np.array_equal(soft[:, 1], twin["flank"][hard])
        found.append(float(np.abs(soft[:, 2:4].T / true - 1).max()) if same else np.inf)
    return np.array(found)


def check_oracles(quick: bool = False) -> Iterator[Check]:
    """Independent ways to the rigid twin's motion: events, time stepping, springs and dampers, closed forms.

    None of them shares code with the twin. Moreau's stepping and scipy's events solve the same equations; springs tend
    to them; the plastic model and the cycle in closed form integrate nothing. Cases: Rigaud & Perret-Liaudet 2020, figs
    5, 10.
    """
    yield from _closed_forms()
    for restitution in (0.3,) if quick else (0.3, 0.6):
        yield from _restarted(restitution)
    for restitution in (0.0, 0.5) if quick else (0.0, 0.3, 0.5, 0.7):
        errors = stepping_errors(bench(20, 3, 250, restitution, 1))
        name = f"Moreau's time stepping, e = {restitution}"
        yield Check(f"{name}: order of convergence in the step", order(np.array(STEPS), errors), 0.9, at_least=True)
        yield Check(f"{name}: mean distance at {max(STEPS)} steps a period", errors[-1] / 250e-6, 1e-3, "backlash")
    for pulls in (False, True):
        yield from _yielding(0.3, pulls)
    off = given_back(ratio_for(0.3, pulls=True)) - 0.3
    yield Check("eq. (20) on a force that may not pull, e = 0.3: restitution too large by", off, 0.05, at_least=True)


def _closed_forms() -> Iterator[Check]:
    for name, (rpm, hertz, backlash, periods) in ORBITS.items():
        scenario = bench(rpm, hertz, backlash, 0.0, periods).with_({"run.output_rate": "2 kHz"})
        ours, twin = simulate(scenario, "plastic"), simulate(scenario, "rigid")
        columns = [(ours.signals[key], twin.signals[key]) for key in ours.signals]
        columns += [(ours.impacts[key], twin.impacts[key]) for key in ours.impacts]
        off = max(float(np.abs(a - b).max()) if a.shape == b.shape else np.inf for a, b in columns)
        yield Check(f"plastic model, {name}, {periods} periods: any number off", off, 1e-9)
    for restitution in (0.3, 0.7):
        scenario = bench(20, 3, 250, restitution, 1)
        closed = cycle(swing(scenario), 250e-6, lambda flank, speed, e=restitution: e, 1e-4)
        twin = simulate(scenario, "rigid").impacts["velocity_m_s"]
        ours = np.array([flight.velocity for flight in closed.flights])
        off = float(np.abs(ours / twin - 1).max()) if ours.shape == twin.shape else np.inf
        yield Check(f"cycle in closed form, e = {restitution}: speed of any impact off", off, 1e-8)


def _restarted(restitution: float) -> Iterator[Check]:
    scenario = bench(20, 3, 250, restitution, 1)
    theirs = restarted_impacts(case(scenario), scenario.run.duration)
    twin = simulate(scenario, "rigid").impacts
    ours = np.stack([twin[name] for name in ("time_s", "flank", "velocity_m_s", "rebound_m_s")], axis=1)
    same = ours.shape == theirs.shape
    name = f"scipy restarted at events, e = {restitution}"
    yield Check(f"{name}: impacts missed or invented", abs(len(ours) - len(theirs)), 0)
    off = np.abs(ours - theirs).max(axis=0) if same else np.full(4, np.inf)
    yield Check(f"{name}: impact times off", float(off[0] / scenario.period), 1e-8, "period")
    yield Check(f"{name}: impact speeds off", float(off[2]), 1e-9, "m/s")


def _yielding(restitution: float, pulls: bool) -> Iterator[Check]:
    scenario = bench(20, 3, 250, restitution, 1)
    errors = yielding_errors(scenario, STIFFNESSES, pulls)
    name = f"spring and damper{' by eq. (20), may pull' if pulls else ', may not pull'}, e = {restitution}"
    yield Check(f"{name}: order in the stiffness", order(np.array(STIFFNESSES), errors), 0.45, at_least=True)
    drive = swing(scenario)
    passage = np.pi * np.sqrt(case(scenario).mass / max(STIFFNESSES))
    rebound = simulate(scenario, "rigid").impacts["rebound_m_s"][0]
    bound = float((drive.speed * drive.omega + drive.pull) * passage / abs(rebound))
    yield Check(f"{name}: speeds off at 1 N/nm; bound: what a passage adds to a rebound", errors[-1], bound)


class Case(NamedTuple):
    """One degree of freedom on the line of action, driven by one sine: what every independent integration takes."""

    mass: float  # of the loose gear [kg]
    force: float  # drag [N]
    speed: float  # amplitude of the drive's speed [m/s]
    omega: float  # its circular frequency [rad/s]
    backlash: float  # [m]
    restitution: float  # coefficient

    def push(self, time: float) -> float:
        """Return the relative acceleration of the free gear, s̈ = −F/m − ÿ [m/s²]; Rigaud & Perret-Liaudet 2020, (12).

        Units: ``time`` [s].
        """
        return -self.force / self.mass - self.speed * self.omega * cos(self.omega * time)

    def speed_of_drive(self, time: float) -> float:
        """Return the drive's speed less its mean, ẏ [m/s].

        Units: ``time`` [s].
        """
        return self.speed * sin(self.omega * time)


def case(scenario: Scenario) -> Case:
    """Return the numbers of a scenario with one harmonic and constant drag.

    >>> from gears3d.verification.validation.check import fig5
    >>> round(case(fig5()).mass, 2)
    3.17
    """
    rig, harmonic = scenario.rig(), scenario.motion.harmonics[0]
    return Case(
        rig.inertia / rig.base_radius_loose**2,
        rig.drag_torque / rig.base_radius_loose,
        rig.base_radius_drive * harmonic.amplitude,
        2 * pi * harmonic.frequency,
        rig.backlash,
        rig.restitution,
    )


STICK = 1e-4  # Rebound below which contact lasts [m/s]


def restarted_impacts(case: Case, duration: float) -> np.ndarray:
    """Return impacts from rest on the active flank: time [s], flank, velocity [m/s], rebound [m/s]; (n, 4).

    Units: ``duration`` [s].

    The rigid model on scipy's integrator, restarted at every event: slow and plain.

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


def step_through(case: Case, duration: float, steps: int) -> np.ndarray:
    """Return the relative displacement at the ends of the steps [m], (steps + 1,), from rest on the active flank.

    Units: ``duration`` [s].

    Moreau's time stepping with Newton's restitution: no event is looked for, steps of one length go over everything.
    Where the gap predicted for the middle of a step is closed, the step's end velocity must satisfy v⁺ ≥ −e·v⁻ there;
    else it is free. Source: Moreau 1988 and Jean 1999, as in Acary & Brogliato 2008, section 10.1; θ = 1/2.
    """
    length = duration / steps
    place, speed = 0.0, 0.0
    places = np.zeros(steps + 1)
    for index in range(steps):
        free = speed + length * case.push((index + 0.5) * length)
        middle = place + 0.5 * length * speed
        after = free
        if middle <= 0.0:
            after = max(free, -case.restitution * speed)
        elif middle >= case.backlash:
            after = min(free, -case.restitution * speed)
        place += 0.5 * length * (speed + after)
        speed = after
        places[index + 1] = place
    return places


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


def yielding_impacts(case: Case, duration: float, stiffness: float, pulls: bool = False) -> np.ndarray:
    """Return passages from the first flight on: time [s], flank, velocity and rebound [m/s], flight height [m]; (n, 5).

    Units: ``duration`` [s]; ``stiffness`` [N/m].

    Springs and dampers in place of rigid flanks tend to the rigid model as they get stiffer. A linear one has the
    restitution e when it may pull until the gap opens and its damping ratio is that of Rigaud & Perret-Liaudet 2020,
    eq. (20), with the square that the print lacks. A flank cannot pull; where the force is cut off at zero, the gear
    leaves earlier and faster, and another ratio has the restitution e: both are tried.
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
