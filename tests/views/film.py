"""A rattle in closed form, for tests of the replay."""

import numpy as np

from gears3d.recording import Recording

FREQUENCY = 3.0


def film(scenario, duration=1.0, rate=20_000):
    """A rattle in closed form: a sine of 1.6 backlashes cut off at both flanks, 6 impacts a second, no rebound."""
    pair = scenario.pair()
    time = np.arange(round(duration * rate) + 1) / rate
    drive = scenario.motion.mean * time + 0.05 * np.sin(2 * np.pi * FREQUENCY * time)
    swing = pair.backlash * (0.5 + 0.8 * np.sin(2 * np.pi * FREQUENCY * time))
    displacement = np.clip(swing, 0.0, pair.backlash)
    loose = (displacement + pair.drive.base_radius * drive) / pair.loose.base_radius
    wave = 2 * np.pi * FREQUENCY
    first = np.array([np.arcsin(0.625), np.pi + np.arcsin(0.625)]) / wave
    hits = np.concatenate([first + k / FREQUENCY for k in range(int(duration * FREQUENCY) + 1)])
    flank = np.tile([1, 0], len(hits) // 2)[hits < time[-1]]
    hits = hits[hits < time[-1]]
    velocity = 0.8 * pair.backlash * wave * np.cos(wave * hits)
    impacts = {
        "time_s": hits,
        "flank": flank,
        "velocity_m_s": velocity,
        "rebound_m_s": np.zeros(len(hits)),
        "impulse_N_s": 3.17 * np.abs(velocity),
        "tooth_drive": np.full(len(hits), 0),
    }
    signals = {
        "time_s": time,
        "theta_drive_rad": drive,
        "theta_loose_rad": loose,
        "omega_drive_rad_s": np.gradient(drive, time),
        "omega_loose_rad_s": np.gradient(loose, time),
        "displacement_m": displacement,
        "velocity_m_s": np.gradient(displacement, time),
    }
    return Recording(signals, impacts, {"model": "closed form"})
