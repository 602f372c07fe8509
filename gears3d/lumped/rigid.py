"""The rigid twin: one degree of freedom, s = Rb2·θ_loose − Rb1·θ_drive between two rigid flanks.

Between impacts the motion is a power series carried to rounding; events are roots of these polynomials, found from
lower bounds, so that no bounce is missed or spurious. Source: Kadmiri et al. 2012, eqs (13)-(29);
Rigaud & Perret-Liaudet 2020, eqs (11)-(19).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gears3d.effects import Code
from gears3d.lumped.flanks import flank_tables, perfect
from gears3d.lumped.model import TOLERANCE, Model, Teeth, model
from gears3d.lumped.run import Outcome, run
from gears3d.lumped.tables import Table, quintic
from gears3d.recording import Recording
from gears3d.scenario.drive_record import drive_record
from gears3d.scenario.models import eccentricities, flank_deviations

if TYPE_CHECKING:
    from gears3d.effects import Rig, Row
    from gears3d.scenario import Scenario

KNOTS = 8.0  # knots of a smoothed drive motion in one period of its bandwidth
SIGNALS = (
    "time_s",
    "theta_drive_rad",
    "theta_loose_rad",
    "omega_drive_rad_s",
    "omega_loose_rad_s",
    "displacement_m",
    "velocity_m_s",
)


def simulate(scenario: Scenario, progress: Callable[[float], None] | None = None) -> Recording:
    """Run a scenario in the rigid model and return the recording; effects of sensors do not act here.

    ``progress`` is called now and then with the simulated time [s]. ``meta["contacts"]`` lists permanent contacts as
    [flank, start, end] in s, ``counters`` counts bounces, contacts, grazing touches and accumulations of bounces that
    were truncated, ``lyapunov_1_s`` is the largest exponent, minus infinity where permanent contact erases the memory.
    A scenario that the model cannot simulate is an InputError, a motion that cannot continue an EngineError.

    Source: Kadmiri et al. 2012, eqs (13)-(29).
    Theory: docs/theory/contact.md, equations (1), (2).

    >>> from gears3d.scenario import load
    >>> simulate(load("scenarios/rigaud-2020/fig5-20rpm.toml", {"run.duration": "1 s"})).impacts["flank"][0]
    np.int8(1)
    """
    m = packed(scenario, progress=progress)
    outcome = run(
        m, scenario.run.duration, 1.0 / scenario.run.output_rate, scenario.start.state, progress, lyapunov=True
    )
    return recorded(outcome, m, scenario, "rigid")


def packed(
    scenario: Scenario,
    teeth: Teeth | None = None,
    tolerance: float = TOLERANCE,
    progress: Callable[[float], None] | None = None,
) -> Model:
    """Return the packed model of a scenario; what the model cannot do is an InputError.

    ``progress`` is called with 0 s now and then, while the flanks roll on each other.
    """
    rows = scenario.rows()
    drive = None if scenario.motion.record is None else measured_drive(scenario)
    sines = [(h.amplitude, h.frequency, h.phase) for h in scenario.motion.harmonics] if drive is None else []
    flanks = flanks_of(scenario, rows, _reach(scenario, rows, drive), progress)
    about = (scenario.impact.stick_velocity, scenario.run.seed, flanks, drive, teeth, tolerance)
    return model(scenario.rig(), sines, rows, *about)


def recorded(outcome: Outcome, m: Model, scenario: Scenario, name: str) -> Recording:
    """Return a run of a packed model as a recording, under the name of its model."""
    rig = scenario.rig()
    meta = {
        "model": name,
        "lyapunov_1_s": outcome.lyapunov,
        "counters": outcome.counters,
        "impacts": outcome.counters["impacts"],
        "contacts": outcome.contacts.tolist(),
        "reached_s": outcome.reached,
        "interrupted": outcome.interrupted,
        "base_radius_drive_m": rig.base_radius_drive,
        "base_radius_loose_m": rig.base_radius_loose,
    }
    harmonics = [(h.amplitude, h.frequency, h.phase) for h in scenario.motion.harmonics]
    signals: dict[str, np.ndarray] = dict(zip(SIGNALS, outcome.samples.T.copy(), strict=True))
    return Recording(signals, impact_columns(outcome, m, rig, harmonics), meta)


def measured_drive(scenario: Scenario) -> Table:
    """Return the measured drive motion as a quintic spline, with knots as dense as the bandwidth requires.

    A record that cannot be used is an InputError.
    """
    time, theta, bandwidth = drive_record(scenario)
    every = 1 if bandwidth is None else max(1, int(1.0 / (KNOTS * bandwidth * time[1])))
    rest = (len(time) - 1) % every  # the last knot is the last sample, or shortly before
    return quintic(time[: len(time) - rest : every], theta[: len(time) - rest : every])


def flanks_of(
    scenario: Scenario,
    rows: Sequence[Row],
    reach: tuple[float, float],
    progress: Callable[[float], None] | None = None,
) -> tuple[Table, Table] | None:
    """Return tables of flanks, over drive angles [rad], where they deviate by more than waves and eccentricity."""
    pair = scenario.pair()
    if perfect(pair) and not any(row.code == Code.FLANK_TOOTH for row in rows):
        return None
    pair = pair.with_deviations(*flank_deviations(rows)).with_mounting(*eccentricities(rows))
    return flank_tables(pair, *reach, None if progress is None else partial(progress, 0.0))


def _reach(scenario: Scenario, rows: tuple[Row, ...], drive: Table | None) -> tuple[float, float]:
    """Bounds of the drive's angle over the run [rad]."""
    sines = [] if drive else [(h.amplitude, h.frequency) for h in scenario.motion.harmonics]
    sines += [(row.p[0], row.p[1]) for row in rows if row.code == Code.MOTION_HARMONIC]
    swing = sum(abs(a) / (np.pi * f) if f else abs(a) * scenario.run.duration for a, f in sines)
    turned = np.array([0.0, scenario.motion.mean * scenario.run.duration])
    if drive is not None:
        turned = drive.pieces[:, 1]
    return float(turned.min() - swing), float(turned.max() + swing)


def impact_columns(
    outcome: Outcome, m: Model, rig: Rig, harmonics: list[tuple[float, float, float]]
) -> dict[str, np.ndarray]:
    """Return the impact table of a recording, columns (n,) by name; the first of the harmonics gives ``phase_rad``."""
    time, flank, velocity, rebound, impulse, displacement, height = outcome.impacts.T.copy()
    drive = drive_angle(m, time)
    loose = (displacement + rig.base_radius_drive * drive) / rig.base_radius_loose
    _, frequency, phase = harmonics[0] if harmonics else (0.0, 0.0, 0.0)
    return {
        "time_s": time,
        "flank": flank.astype(np.int8),
        "velocity_m_s": velocity,
        "rebound_m_s": rebound,
        "impulse_N_s": impulse,
        "phase_rad": np.mod(2 * np.pi * frequency * time + phase, 2 * np.pi),
        "tooth_drive": tooth(drive, rig.teeth_drive),
        "tooth_loose": tooth(loose, rig.teeth_loose),
        "flight_height_m": height,
    }


def drive_angle(m: Model, time: np.ndarray) -> np.ndarray:
    """Return the imposed angle [rad], (n,), at times [s], (n,); 0 at time 0.

    Source: Rigaud & Perret-Liaudet 2020, eq. (1), integrated.
    """
    angle = m.mean * time + (m.tables[m.drive_table](time) if m.drive_table >= 0 else 0.0)
    for amplitude, omega, phase, cosine in m.harmonics:
        angle = angle - amplitude / omega * (np.cos(omega * time + phase) - cosine)
    return angle


def tooth(angle: np.ndarray, teeth: int) -> np.ndarray:
    """Return the numbers (n,) of the teeth next to the pitch point at angles [rad], (n,), in order of meshing from 1.

    >>> tooth(np.array([0.0, 0.6, 6.3]), 10).tolist()
    [1, 2, 1]
    """
    return (1 + np.mod(np.round(angle * teeth / (2 * np.pi)), teeth)).astype(np.int32)
