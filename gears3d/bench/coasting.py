"""A coast-down in the 3D engine: the loose gear out of mesh, slowed by its drag until it stands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.effects import Code
from gears3d.engine import Bench
from gears3d.errors import Fault, InputError
from gears3d.identify import identify_rundown, make_track
from gears3d.recording import Recording
from gears3d.results import Result
from gears3d.scenario.models import Motion
from gears3d.simulation.sensors import encode, observe

if TYPE_CHECKING:
    from gears3d.identify import Identified
    from gears3d.scenario import Scenario

LONGEST = 600.0  # After this time a gear that still turns is taken not to stop [s]
STANDING = 1e-3  # Part of the starting speed that is as good as standing: viscous drag alone stops nothing
AFTER = 0.02  # How long the record continues when the gear stands, as a part of the coast-down
MOST = 400_000  # Samples of a record at most


@dataclass(frozen=True, eq=False)
class Rundown(Result):
    """Result of a coast-down.

    Args:
        time: s, (n,).
        theta: of the loose gear [rad], (n,).
        omega: its speed [rad/s], (n,).
        record: what encoders would have recorded.
        found: the drag that the record gives.
    """

    time: np.ndarray
    theta: np.ndarray
    omega: np.ndarray
    record: Recording
    found: Identified

    def to_dict(self) -> dict[str, Any]:
        """Return start, end, and the law as ``gears3d identify coastdown`` tells it."""
        stands = self.time[self.omega != 0.0]
        told = {"speed_rad_s": float(self.omega[0]), "stands_after_s": float(stands[-1]) if stands.size else 0.0}
        return {"test": "rundown", **told, "identified": self.found.to_dict()}


def rundown(
    scenario: Scenario,
    speed: float | None = None,
    seed: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Rundown:
    """Let the loose gear run down out of mesh in the 3D engine, and find its drag from the record.

    Args:
        scenario: its inertia, drag, torques of flight and sensors; the drive stands still.
        speed: of the loose gear at the start [rad/s]; the one that the drive's mean speed gives it unless given.
        seed: of the encoders' noise; that of the scenario unless given.
        progress: called with the simulated time done [s].

    Returns:
        The coast-down and its drag.

    Raises:
        InputError: no speed, or nothing that slows the gear down.

    Source: Kadmiri et al. 2012, eqs (4)-(7); Rigaud & Perret-Liaudet 2020, section 3.

    >>> from gears3d.scenario import load
    >>> run = rundown(load("scenarios/base/rigaud-2020.toml"))
    >>> run.found.law, round(run.found.parameters["coulomb"].value, 3)
    ('coulomb', 0.22)
    """
    rig = scenario.rig()
    if speed is None:
        speed = scenario.motion.mean * rig.base_radius_drive / rig.base_radius_loose
    if speed == 0.0:
        raise InputError(Fault("--speed", "is 0: nothing runs down", "give the speed that the gear starts with"))
    bare = replace(scenario, motion=Motion(0.0), effects=_torques(scenario))
    with Bench(bare) as bench:
        end = (1.0 + AFTER) * _standstill(bench, speed, progress)
        rate = min(scenario.sensors.sample_rate, MOST / end)
        time = np.arange(int(end * rate) + 1) / rate
        theta, omega = bench.coast(speed, time).T
    time = time[: len(theta)]
    still = np.zeros_like(time)
    signals = {"time_s": time, "theta_drive_rad": still, "theta_loose_rad": theta}
    signals |= {"omega_drive_rad_s": still, "omega_loose_rad_s": omega}
    sensors = replace(scenario.sensors, sample_rate=rate)
    seen = observe(Recording(signals), scenario.effects, rig)
    record = encode(seen, sensors, scenario.run.seed if seed is None else seed)
    track = make_track(record.time, record.signals["theta_loose_rad"])
    return Rundown(time, theta, omega, record, identify_rundown([track], rig.inertia))


def _torques(scenario: Scenario) -> tuple[Any, ...]:
    """Return the effects that act on a gear out of mesh."""
    rig = scenario.rig()
    return tuple(
        effect
        for effect in scenario.effects
        if any(row.code // 100 == 1 and row.code != Code.TORQUE_FRICTION for row in effect.rows(rig))
    )


def _standstill(bench: Bench, speed: float, progress: Callable[[float], None] | None) -> float:
    """Return when the gear has come to rest [s]."""
    end = 0.25
    while end <= LONGEST:
        times = np.linspace(0.0, end, 1001)
        speeds = np.abs(bench.coast(speed, times)[:, 1])
        resting = np.flatnonzero(speeds <= STANDING * abs(speed))
        if resting.size:
            return float(times[resting[0]])
        if speeds[-1] >= abs(speed):
            break
        if progress is not None:
            progress(end)
        end *= 2.0
    raise InputError(Fault("drag", f"does not stop the loose gear in {LONGEST:.0f} s", "give drag.torque"))
