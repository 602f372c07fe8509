"""Lumped models as people write them with scipy, right ones and ones with a hidden error, on random rigs."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp

import gears3d as g3
from gears3d.scenario import Scenario

BASE = "rigaud-2020/fig5-20rpm"
PI = np.pi


@dataclass(frozen=True)
class Own:
    """Numbers of a model that are a user's own.

    Args:
        e: coefficient of restitution.
        drag: torque [N m].
        backlash: [m].
        drive: sign of the drive's acceleration.
        sticks: rebounds below this speed become contact [m/s].
        step: fixed step that no impact ends [s]; 0: scipy with events.
        scheme: of fixed steps: 0 semi-implicit Euler that puts the gear back onto the flank, 1 the same without that,
            2 explicit Euler, 3 exact flights between the steps.
    """

    e: float
    drag: float
    backlash: float
    drive: float = 1.0
    sticks: float = 1e-6
    step: float = 0.0
    scheme: int = 0


def rig(seed: int) -> Scenario:
    """Return a random rig that rattles."""
    draw = np.random.default_rng(seed)
    frequency, drag = draw.uniform(2.0, 6.0), draw.uniform(0.1, 0.4)
    level = draw.uniform(3.0, 12.0)  # excitation
    inertia = 0.0695
    amplitude = level * drag / inertia / (2 * PI * frequency)
    changes = {
        "motion.mean": f"{1.3 * amplitude + draw.uniform(1.0, 3.0)} rad/s",
        "motion.harmonics": [{"amplitude": f"{amplitude} rad/s", "frequency": f"{frequency} Hz"}],
        "drag.torque": f"{drag} N m",
        "impact.restitution": float(draw.uniform(0.2, 0.8)),
        "mount.backlash": f"{draw.uniform(100.0, 400.0)} um",
        "run.duration": f"{12.0 / frequency} s",
        "run.settle": "0 s",
        "run.output_rate": "20 kHz",
    }
    return g3.load(BASE, changes)


def own(scenario: Scenario) -> Own:
    """Return the right numbers."""
    known = scenario.rig()
    return Own(known.restitution, known.drag_torque, known.backlash)


def drive(scenario: Scenario, time):
    """Return angle and acceleration of the drive gear."""
    (wave,) = scenario.motion.harmonics
    omega = 2 * PI * wave.frequency
    angle = scenario.motion.mean * time + wave.amplitude / omega * (1.0 - np.cos(omega * time))
    return angle, wave.amplitude * omega * np.cos(omega * time)


def simulate(scenario: Scenario, mine: Own, rate: float = 20_000.0):
    """Return times and displacement of a model with events, or with fixed steps."""
    known, end = scenario.rig(), scenario.run.duration
    r1, r2, b = known.base_radius_drive, known.base_radius_loose, mine.backlash

    def pull(t):
        return -mine.drag * r2 / known.inertia - mine.drive * r1 * drive(scenario, t)[1]

    if mine.step:
        return fixed(pull, mine, end)
    time = np.arange(int(end * rate) + 1) / rate
    place, t, s, v, flank = np.zeros(len(time)), 0.0, 0.0, 0.0, 0
    reach = [lambda t, y: y[0], lambda t, y: y[0] - b]
    for each, way in zip(reach, (-1, 1), strict=True):
        each.terminal, each.direction = True, way
    fine = np.arange(int(end * 1e5) + 2) / 1e5
    push = pull(fine)
    while t < end:
        if flank >= 0:  # in contact until the drive leaves the flank
            away = np.flatnonzero((fine > t) & ((push > 0) if flank == 0 else (push < 0)))
            till = fine[away[0]] if len(away) else end
            place[(time >= t) & (time <= till)] = b * flank
            t, s, v = till, b * flank + (1e-13 if flank == 0 else -1e-13), 0.0
        if t >= end:
            break
        kept = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-14, "max_step": 2e-3, "dense_output": True}
        found = solve_ivp(lambda t, y: (y[1], pull(t)), (t, end), (s, v), events=reach, **kept)
        mine_ = (time >= t) & (time <= found.t[-1])
        if mine_.any():
            place[mine_] = found.sol(time[mine_])[0]
        t, v = float(found.t[-1]), float(found.y[1, -1])
        if found.status != 1:
            break
        hit = 0 if len(found.t_events[0]) else 1
        s, v = b * hit, -mine.e * v
        flank = hit if abs(v) < mine.sticks else -1
    return time, place


def fixed(pull, mine: Own, end: float):
    """Return a model that looks for flanks at the ends of its steps."""
    time = np.arange(int(end / mine.step) + 1) * mine.step
    push = pull(time)
    place, s, v = np.zeros(len(time)), 0.0, 0.0
    for k, a in enumerate(push):
        place[k] = s
        before = v
        v += a * mine.step
        s += {2: before, 3: 0.5 * (before + v)}.get(mine.scheme, v) * mine.step
        if (s < 0.0 and v < 0.0) or (s > mine.backlash and v > 0.0):
            v = -mine.e * v
            if mine.scheme == 0:
                s = 0.0 if s < 0.0 else mine.backlash
            if abs(v) < abs(a) * mine.step:
                v = 0.0
    return time, place


def wrong(kind: str, scenario: Scenario, seed: int) -> Own:
    """Return the numbers of a model with a hidden error of a kind, ``""`` for none."""
    right, draw = own(scenario), np.random.default_rng([seed, 7])
    way = 1.0 if draw.random() < 0.5 else -1.0
    if kind == "restitution":
        return replace(right, e=right.e * (1.0 + 0.05 * way))
    if kind == "drag":
        return replace(right, drag=right.drag * (1.0 + 0.05 * way))
    if kind == "backlash":
        return replace(right, backlash=right.backlash * (1.0 + 0.02 * way))
    if kind == "sign":
        return replace(right, drive=-1.0) if way > 0.0 else replace(right, drag=-right.drag)
    if kind == "bounces":
        (wave,) = scenario.motion.harmonics
        fast = np.sqrt(2.0 * right.backlash * 2 * PI * wave.frequency * wave.amplitude * 0.15)  # of a crossing, about
        return replace(right, sticks=right.e * fast * draw.uniform(0.5, 1.0))
    if kind == "step":
        return replace(right, step=float(draw.uniform(2e-4, 1e-3)), scheme=seed % 4)
    return right


KINDS = ("", "restitution", "drag", "backlash", "sign", "bounces", "step")
