"""The lubricated model as a recording."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sqrt
from typing import TYPE_CHECKING

import numpy as np

from gears3d.lumped.lubricated import layout as at
from gears3d.lumped.lubricated.model import Model, pack
from gears3d.lumped.lubricated.run import Outcome, run
from gears3d.lumped.rigid import SIGNALS, tooth
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.scenario import Scenario

WORKS = ("mesh", "drag", "friction", "spring", "damping", "squeeze", "wedge", "drive")


def simulate(scenario: Scenario, progress: Callable[[float], None] | None = None) -> Recording:
    """Run a scenario in the lubricated model.

    Args:
        scenario: with an effect ``oil_film``; its restitution plays no part, the teeth give way. Effects of sensors do
            nothing here.
        progress: called now and then with the simulated time done [s].

    Returns:
        The recording, with ``mesh_force_N`` (along the normal, on the loose gear, active flank positive) beside the
        signals of the contract. An impact is a passage through the height from which on the film is felt, as in the
        rigid twin with oil. ``meta`` has ``rattle_index``, ``works_J`` (:data:`WORKS`), ``felt_height_m``,
        ``counters``, ``contacts`` and ``lyapunov_1_s``.

    Raises:
        InputError: the scenario holds what the model cannot do, or no oil.
        EngineError: the motion cannot go on.

    Source: the lubricated dual-clutch transmission, eqs (1) to (14) and (27) to (33).

    >>> from gears3d.scenario import load
    >>> short = load("scenarios/dct-helical-lubricated/fig13.toml", {"run.duration": "0.1 s", "run.settle": "0 s"})
    >>> recording = simulate(short)
    >>> sorted(set(recording.impacts["flank"].tolist()))
    [0, 1]
    """
    m = pack(scenario)
    rig, duration = scenario.rig(), scenario.run.duration
    outcome = run(
        m,
        duration,
        scenario.start.state,
        1.0 / scenario.run.output_rate,
        min(scenario.run.settle, duration),
        scenario.lubricated.tolerance,
        lyapunov=True,
        progress=progress,
    )
    tilt = cos(rig.base_helix_angle)
    meta = {
        "model": "lubricated",
        "lyapunov_1_s": outcome.exponent,
        "counters": outcome.counters,
        "impacts": outcome.counters["impacts"],
        "contacts": outcome.contacts.tolist(),
        "reached_s": outcome.reached,
        "interrupted": outcome.interrupted,
        "base_radius_drive_m": rig.base_radius_drive,
        "base_radius_loose_m": rig.base_radius_loose,
        "rattle_index": sqrt(outcome.jerk) / tilt / rig.inertia if outcome.jerk >= 0.0 else None,
        "works_J": dict(zip(WORKS, outcome.books.tolist(), strict=True)),
        "felt_height_m": float(m.numbers[at.FELT]),
    }
    return Recording(_signals(m, rig, outcome), _impacts(m, rig, scenario, outcome), meta)


def motion_of(m: Model, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return angle [rad] and speed [rad/s] of the drive, (n,) each.

    Args:
        m: the packed model.
        time: [s], (n,).
    """
    angle, speed = m.numbers[at.MEAN] * time, np.full_like(time, m.numbers[at.MEAN])
    for amplitude, omega, phase, cosine in m.sines:
        angle = angle - amplitude / omega * (np.cos(omega * time + phase) - cosine)
        speed = speed + amplitude * np.sin(omega * time + phase)
    return angle, speed


def _signals(m: Model, rig: Rig, outcome: Outcome) -> dict[str, np.ndarray]:
    time, place, rate, active, reverse = outcome.samples.T.copy()
    drive, omega = motion_of(m, time)
    loose = (place + rig.base_radius_drive * drive) / rig.base_radius_loose
    omega_loose = (rate + rig.base_radius_drive * omega) / rig.base_radius_loose
    columns = dict(zip(SIGNALS, (time, drive, loose, omega, omega_loose, place, rate), strict=True))
    return columns | {"mesh_force_N": (active - reverse) / cos(rig.base_helix_angle)}


def _impacts(m: Model, rig: Rig, scenario: Scenario, outcome: Outcome) -> dict[str, np.ndarray]:
    order = np.argsort(outcome.impacts[:, 0], kind="stable")
    time, flank, velocity, rebound, impulse, place, height = outcome.impacts[order].T.copy()
    drive, _ = motion_of(m, time)
    loose = (place + rig.base_radius_drive * drive) / rig.base_radius_loose
    first = scenario.motion.harmonics[0] if scenario.motion.harmonics else None
    phase = 2.0 * np.pi * first.frequency * time + first.phase if first else np.zeros_like(time)
    return {
        "time_s": time,
        "flank": flank.astype(np.int8),
        "velocity_m_s": velocity,
        "rebound_m_s": rebound,
        "impulse_N_s": impulse,
        "phase_rad": np.mod(phase, 2.0 * np.pi),
        "tooth_drive": tooth(drive, rig.teeth_drive),
        "tooth_loose": tooth(loose, rig.teeth_loose),
        "flight_height_m": height,
    }
