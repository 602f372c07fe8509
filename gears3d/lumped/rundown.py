"""The loose gear alone, out of mesh, slowed by its drag until it stands: the run-down test of a rig."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gears3d.effects import Code
from gears3d.errors import Fault, InputError
from gears3d.lumped.model import model
from gears3d.lumped.run import run
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

LONGEST = 3600.0
"""After this time a gear that still turns is taken not to stop [s]."""
AFTER = 0.02
"""How long the record goes on when the gear stands, as a part of the run-down."""


def rundown(
    scenario: Scenario,
    speed: float | None = None,
    duration: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Let the loose gear run down under its drag, effects included.

    Args:
        scenario: its inertia, drag, torque effects and sample rate; gates of flight hold, flanks play no part.
        speed: of the loose gear at the start [rad/s]; the one that the drive's mean speed gives it unless given.
        duration: [s]; until it stands unless given.
        progress: called now and then with the simulated time done [s].

    Returns:
        The recording, sampled at the rate of the sensors; the drive stands still.

    Raises:
        InputError: no speed, or nothing that slows the gear down.

    Source: Kadmiri et al. 2012, eqs (4)-(7); Ottewill et al. 2010, eqs (14)-(16).

    >>> from gears3d.scenario import load
    >>> record = rundown(load("scenarios/rigaud-2020/fig5-20rpm.toml"), speed=3.0)
    >>> round(float(record.time[np.flatnonzero(record.signals["omega_loose_rad_s"] == 0.0)[0]]), 3)  # J·ω/T
    0.948
    """
    rig = scenario.rig()
    if speed is None:
        speed = scenario.motion.mean * rig.base_radius_drive / rig.base_radius_loose
    if speed == 0.0:
        raise InputError(Fault("motion.mean", "is 0: nothing runs down", "give the speed that the gear starts with"))
    torques = [row for row in scenario.rows() if row.code // 100 == 1 and row.code != Code.TORQUE_FRICTION]
    no_mate = 4.0 * rig.base_radius_loose * abs(speed) * LONGEST  # a backlash wider than any way it can go
    alone = replace(rig, backlash=no_mate, mean_speed=speed * rig.base_radius_loose / rig.base_radius_drive)
    packed = model(alone, [], torques)
    spacing = 1.0 / scenario.sensors.sample_rate
    end = duration or _standstill(packed, rig.drag_torque and rig.inertia * abs(speed) / rig.drag_torque)
    outcome = run(packed, end, spacing, "free", progress)
    time, _, theta, _, omega, _, _ = outcome.samples.T.copy()
    still = np.zeros_like(time)
    signals = {
        "time_s": time,
        "theta_drive_rad": still,
        "theta_loose_rad": theta - theta[0],
        "omega_drive_rad_s": still,
        "omega_loose_rad_s": omega,
    }
    return Recording(signals, meta={"model": "rundown", "interrupted": outcome.interrupted})


def _standstill(packed, guess: float) -> float:
    """Return when the gear has come to rest and a little later [s]."""
    end = max(guess, 0.1)
    while end <= LONGEST:
        samples = run(packed, end, end / 1000.0, "free").samples
        resting = np.flatnonzero(samples[:, 4] == 0.0)
        if resting.size:
            return float(samples[resting[0], 0]) * (1.0 + AFTER)
        end *= 2.0
    remedy = "give drag.torque"
    raise InputError(Fault("drag", f"does not stop the loose gear within {LONGEST:.0f} s", remedy))
