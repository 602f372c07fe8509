"""Sensors of a scenario: encoders that count, and what they make of a recording."""

from __future__ import annotations

from collections.abc import Iterable
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.effects import SensorEffect
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.scenario.models import Sensor, Sensors


GEARS = ("drive", "loose")


def encode(recording: Recording, sensors: Sensors, seed: int) -> Recording:
    """Return a record as a test bench writes it: time and two angles, noisy and quantised, and nothing else.

    Args:
        recording: sampled at the rate of the sensors.
        sensors: counts per revolution and noise of both encoders.
        seed: of the noise, and of where within a count each encoder begins.

    Returns:
        ``time_s``, ``theta_drive_rad`` and ``theta_loose_rad``; its ``meta`` has the encoders only.

    >>> from gears3d.scenario.models import Sensor, Sensors
    >>> turn = np.linspace(0.0, 2 * pi, 9)
    >>> bare = Recording({"time_s": turn, "theta_drive_rad": turn, "theta_loose_rad": turn})
    >>> read = encode(bare, Sensors(1.0, Sensor(4), Sensor()), seed=1).signals
    >>> np.unique(np.diff(read["theta_drive_rad"]).round(6)).tolist(), bool((read["theta_loose_rad"] == turn).all())
    ([0.0, 1.570796], True)
    """
    read = {"time_s": recording.time}
    streams = np.random.SeedSequence(seed).spawn(len(GEARS))
    for gear, stream in zip(GEARS, streams, strict=True):
        name = f"theta_{gear}_rad"
        read[name] = _counted(recording.signals[name], getattr(sensors, gear), np.random.default_rng(stream))
    meta: dict[str, dict[str, Any]] = {"encoders": {"sample_rate_Hz": sensors.sample_rate, "seed": seed}}
    for gear in GEARS:
        meta["encoders"][f"counts_per_revolution_{gear}"] = getattr(sensors, gear).counts_per_revolution
    return Recording(read, meta=meta)


def _counted(angle: np.ndarray, sensor: Sensor, random: np.random.Generator) -> np.ndarray:
    """Return the angle as one encoder reads it."""
    begin = random.uniform()
    if sensor.noise:
        angle = angle + random.normal(0.0, sensor.noise, len(angle))
    if sensor.counts_per_revolution is None:
        return angle
    count = 2.0 * pi / sensor.counts_per_revolution
    return (np.floor(angle / count + begin)) * count


def observe(recording: Recording, effects: Iterable[Any], rig: Rig) -> Recording:
    """Return the recording as the sensors see it."""
    sensors = [effect for effect in effects if isinstance(effect, SensorEffect)]
    if not sensors:
        return recording
    signals = dict(recording.signals)
    time = signals["time_s"]
    true = {gear: signals[f"theta_{gear}_rad"] for gear in ("drive", "loose")}
    read = true
    for sensor in sensors:
        read = sensor.observe(read, time)
    for gear in ("drive", "loose"):
        error = read[gear] - true[gear]
        signals[f"theta_{gear}_rad"] = read[gear]
        signals[f"omega_{gear}_rad_s"] = signals[f"omega_{gear}_rad_s"] + np.gradient(error, time)
    for name, drive, loose in (
        ("displacement_m", "theta_drive_rad", "theta_loose_rad"),
        ("velocity_m_s", "omega_drive_rad_s", "omega_loose_rad_s"),
    ):
        signals[name] = rig.base_radius_loose * signals[loose] - rig.base_radius_drive * signals[drive]
    return Recording(signals, recording.impacts, {**recording.meta, "sensors": [s.kind for s in sensors]})
