"""What happens in a machine with hidden effects: the motion from its start, sample by sample, and every impact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import EngineError
from gears3d.recording import Recording
from gears3d.verification.challenge.motion import COUNT, OMEGA, THETA, THETA2, TIME, run
from gears3d.verification.challenge.physics import ACTIVE, FREE, REVERSE, accelerate, drive, flank
from gears3d.verification.challenge.plan import machine

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

STEP = 2e-5  # Largest step of integration [s]
BLOCK = 25_000  # Samples between two reports of progress


def happen(
    scenario: Scenario,
    foreign: Sequence[Sequence[float]] = (),
    second: Sequence[float] = (),
    *,
    rate: float | None = None,
    step: float = STEP,
    seed: int | None = None,
    late: float = 0.0,
    late_drive: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Return the true motion of a scenario with its effects, sensors left aside.

    Args:
        scenario: the rig and its effects.
        foreign: causes outside the catalogue, rows of ``foreign`` in ``MACHINE``.
        second: a body behind a coupling with play.
        rate: of the samples, Hz; ``run.output_rate`` unless given.
        step: of integration at most, s.
        seed: of restitution that scatters; ``run.seed`` unless given.
        late: the loose gear's angle is that of so many seconds before, s.
        late_drive: so is the drive's.
        progress: called now and then with the time done [s].

    Returns:
        Angles, speeds and displacement; the impacts with time, flank, velocity, rebound and impulse.

    Raises:
        InputError: the rig has what no equation here covers.
        EngineError: the motion ran away.
    """
    m = machine(scenario, foreign, second)
    rate = rate or scenario.run.output_rate
    count, back = round(scenario.run.duration * rate) + 1, ceil(late * rate)
    offset = back / rate - late
    total = count - back
    y = _start(m, scenario.start.state, offset)
    random = np.random.default_rng(np.random.SeedSequence([7, scenario.run.seed if seed is None else seed]))
    normals, hits = random.standard_normal(4096), np.zeros((1000 + 2 * total, 5))
    angle, speed = np.zeros(total), np.zeros(total)
    substeps = max(1, ceil(1.0 / rate / _finest(m, step) - 1e-9))
    for begin in range(0, total, BLOCK):
        part = slice(begin, min(begin + BLOCK, total))
        run(m, y, begin, 1.0 / rate, offset, substeps, normals, angle[part], speed[part], hits)
        if progress:
            progress(min(part.stop / rate, scenario.run.duration))
    if not np.isfinite(angle).all():
        raise EngineError("the hidden motion ran away; choose a smaller effect")
    if back < 0:
        angle, speed = angle[-back:], speed[-back:]
    elif back > 0:
        before = np.arange(-back, 0) / rate
        angle, speed = np.r_[angle[0] + before * speed[0], angle], np.r_[np.full(back, speed[0]), speed]
    return _recording(m, scenario, rate, late_drive, angle[:count], speed[:count], hits[: int(y[COUNT])])


def _finest(m: Any, step: float) -> float:
    """The step that resolves the stiffest spring [s]."""
    mass = m["inertia"] / m["rb2"] ** 2
    stiffest = max(m["spring"][0] / mass, (m["spring"][1] / mass) ** 2)
    if m["second"][0] > 0.0:
        stiffest = max(stiffest, m["second"][1] / m["second"][0], (m["second"][2] / m["second"][0]) ** 2)
    return min(step, 0.05 / sqrt(stiffest)) if stiffest > 0.0 else step


def _start(m: Any, state: str, time: float) -> np.ndarray:
    """The state at the beginning: on a flank, or in the middle of the gap as fast as the drive."""
    y = np.zeros(7)
    y[TIME], y[3] = time, FREE
    th1, w1, a1 = drive(m, time)
    share = {"active": 0.0, "reverse": 1.0, "free": 0.5}[state]
    th2 = th1 * m["rb1"] / m["rb2"]
    for _ in range(50):
        low, high = flank(m, ACTIVE, time, th1, th2), flank(m, REVERSE, time, th1, th2)
        s = (1.0 - share) * (low[0] + m["film"][5]) + share * (high[0] - m["film"][5])
        th2 = (m["rb1"] * th1 + s) / m["rb2"]
    on = low if state == "active" else high
    rigid = m["spring"][0] == 0.0
    y[THETA], y[OMEGA] = th2, w1 * m["rb1"] / m["rb2"]
    if state != "free":
        lever = m["rb2"] - on[2]
        y[OMEGA] = (m["rb1"] + on[1]) * w1 / lever
        side = ACTIVE if state == "active" else REVERSE
        y[3] = side if rigid else FREE
        if not rigid:  # compliant teeth are pressed in already
            a2 = ((m["rb1"] + on[1]) * a1 + on[3] * w1**2 + on[4] * y[OMEGA] ** 2) / lever
            for _ in range(60):
                a, _ = accelerate(m, time, y[THETA], y[OMEGA], y[THETA], y[OMEGA], np.sign(y[OMEGA]), side)
                y[THETA] += (a - a2) * m["inertia"] / (m["spring"][0] * lever**2)
                y[THETA] = min(y[THETA], th2) if side == ACTIVE else max(y[THETA], th2)
        elif m["film"][0] > 0.0:  # oil carries: the gear floats where its wedge does
            y[THETA], y[3] = _float(m, time, side, th2, y[OMEGA]), FREE
    y[THETA2], y[5] = y[THETA], y[OMEGA]
    return y


def _float(m: Any, time: float, side: int, low: float, w2: float) -> float:
    """The loose gear's angle at which the oil on a flank carries what presses, if the layer does not [rad]."""
    sign = 1.0 if side == ACTIVE else -1.0
    th1, w1, a1 = drive(m, time)
    high = low + sign * 0.45 * (m["backlash"] - 2.0 * m["film"][5]) / m["rb2"]
    for i in range(60):
        middle = low if i == 0 else 0.5 * (low + high)
        _, d1, d2, d11, d22, _ = flank(m, side, time, th1, middle)
        a2 = ((m["rb1"] + d1) * a1 + d11 * w1**2 + d22 * w2**2) / (m["rb2"] - d2)
        away = sign * (accelerate(m, time, middle, w2, middle, w2, np.sign(w2), FREE)[0] - a2)
        if i == 0 and away <= 0.0:
            return low
        low, high = (middle, high) if away > 0.0 else (low, middle)
    return low


def _recording(
    m: Any, scenario: Scenario, rate: float, late: float, angle: Any, speed: Any, hits: np.ndarray
) -> Recording:
    time = np.arange(len(angle)) / rate
    then = time - late
    th1 = np.array(m["speed"] * then)
    w1 = np.full(len(time), m["speed"])
    for size, w, phase in m["sines"][: m["n_sines"]]:
        th1 += size / w * (np.cos(phase) - np.cos(w * then + phase))
        w1 += size * np.sin(w * then + phase)
    signals = {"time_s": time, "theta_drive_rad": th1, "theta_loose_rad": angle}
    signals |= {"omega_drive_rad_s": w1, "omega_loose_rad_s": speed}
    signals |= {"displacement_m": m["rb2"] * angle - m["rb1"] * th1, "velocity_m_s": m["rb2"] * speed - m["rb1"] * w1}
    names = ("time_s", "flank", "velocity_m_s", "rebound_m_s", "impulse_N_s")
    impacts = {name: hits[:, i] for i, name in enumerate(names)}
    period = scenario.period
    meta = {"model": "challenge", "title": scenario.title, "period_s": period, "settle_s": scenario.run.settle}
    return Recording(signals, impacts, meta)
