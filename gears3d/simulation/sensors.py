"""What the sensors make of a recording: effects of the measurement act here and nowhere else."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.effects import SensorEffect
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.effects import Rig


def observe(recording: Recording, effects: Iterable[Any], rig: Rig) -> Recording:
    """Return the recording as the sensors see it.

    Args:
        recording: what happened.
        effects: any effects; those whose place is not the sensor are passed over.
        rig: base radii for the displacement.

    Returns:
        A recording with the read angles and the speeds and displacement that follow from them; the impacts, which no
        sensor reports, stay as they happened. The same object when there is no sensor effect.
    """
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
