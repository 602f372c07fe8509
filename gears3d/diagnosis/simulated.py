"""Simulated records of a rig: under the measured motion, read by the same encoders.

In such records, which contain nothing but the rig, results of segmentation and search are errors of these methods: not
a cause, and not a residual pattern that a cause should explain.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.measured.noise import estimate_noise
from gears3d.scenario.models import Sensor, Sensors
from gears3d.signals import quantum
from gears3d.simulation import simulate
from gears3d.simulation.sensors import encode

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted
    from gears3d.scenario import Scenario


def simulated(one: Admitted, rig: Scenario, seed: int = 0) -> Admitted:
    """Return a simulated record of the rig, with the motion, sampling, counts and noise of the measured one."""
    columns = one.channels.columns
    time, span = columns["time_s"], float(columns["time_s"][-1] - columns["time_s"][0])
    rate = (len(time) - 1) / span
    shifted = [
        {"amplitude": f"{h.amplitude!r} rad/s", "frequency": f"{h.frequency!r} Hz",
         "phase": f"{h.phase + 2.0 * pi * h.frequency * float(time[0])!r} rad"}
        for h in rig.motion.harmonics
    ]  # fmt: skip
    run = {"run.duration": f"{span!r} s", "run.settle": "0 s", "run.output_rate": f"{rate!r} Hz", "run.seed": seed}
    made = simulate(rig.with_({**run, "motion.harmonics": shifted}), "rigid")
    drive, loose = (sensor_of(time, columns[f"theta_{gear}_rad"]) for gear in ("drive", "loose"))
    sensors = Sensors(sample_rate=rate, drive=drive, loose=loose)
    read = encode(made, sensors, seed)
    kept = {name: read.signals[name] for name in ("time_s", "theta_drive_rad", "theta_loose_rad")}
    return replace(one, channels=replace(one.channels, columns=kept), rig=rig, findings=())


def sensor_of(time: np.ndarray, angle: np.ndarray) -> Sensor:
    """Return an encoder with the counts and the noise of a record."""
    count = quantum(angle)
    white = estimate_noise(time, angle).white
    if not count:
        return Sensor(None, white)
    return Sensor(round(2.0 * pi / count), float(np.sqrt(max(white**2 - count**2 / 12.0, 0.0))))
