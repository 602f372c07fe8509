"""Records of two encoders between which nothing rattles although the displacement moves: what a rig may really do.

Each is made of its own equation of motion; none has a free flight.
"""

import numpy as np

from gears3d.recording import Recording

STEP = 1e-4


def _recorded(drive, loose, noise, rng):
    shown = {name: angle + rng.normal(0.0, noise, len(angle)) for name, angle in (("drive", drive), ("loose", loose))}
    time = np.arange(len(drive)) * STEP
    return Recording({"time_s": time, "theta_drive_rad": shown["drive"], "theta_loose_rad": shown["loose"]})


def _coloured(rng, count, low, high, size):
    """Noise between two frequencies [Hz] with a root mean square."""
    frequency = np.fft.rfftfreq(count, STEP)
    waves = rng.normal(size=len(frequency)) + 1j * rng.normal(size=len(frequency))
    made = np.fft.irfft(waves * ((frequency > low) & (frequency < high)), count)
    return made * size / np.std(made)


def compliant_gearbox(seed=0, noise=2e-6, duration=10.0, lost=0.0):
    """Two encoders across a compliant gearbox, its load reversing by friction: torsion with hysteresis, no clearance.

    ``lost`` [rad] is a soft zone about zero torque, as a preloaded spline has it.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration / STEP)) * STEP
    speed = 2.0 + 3.0 * np.sin(2 * np.pi * (1.0 + 0.3 * rng.random()) * time)
    drive = np.cumsum(speed) * STEP
    load = 1.5 * np.tanh(speed / 0.3) + 0.4 * np.gradient(speed, STEP) / 20.0
    load += _coloured(rng, len(time), 0.1, 30.0, 0.1)
    twist = 1.2e-3 * load / (1.0 + 0.3 * np.abs(load)) + lost * np.tanh(3.0 * load)
    return _recorded(drive, drive - twist, noise, rng)


def soft_shaft(seed=0, noise=2e-6, duration=10.0, pulsation=4.0):
    """A motor with sinusoidal torque through a soft shaft near its resonance: a linear oscillator."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration / STEP)) * STEP
    frequency = pulsation * (0.9 + 0.2 * rng.random())
    speed = 2 * np.pi * 0.5 + 0.5 * np.sin(2 * np.pi * frequency * time)
    drive = np.cumsum(speed) * STEP
    own, damping = 2 * np.pi * 1.3 * frequency, 0.05
    forced = np.gradient(speed, STEP) + _coloured(rng, len(time), 0.5, 20.0, 2.0)
    twist, rate = np.zeros(len(time)), 0.0
    for k in range(1, len(time)):  # twist'' = −2ζω·twist' − ω²·twist − drive''
        rate += STEP * (-2.0 * damping * own * rate - own**2 * twist[k - 1] - forced[k])
        twist[k] = twist[k - 1] + STEP * rate
    return _recorded(drive, drive + twist, noise, rng)


def slipping_hub(seed=0, noise=2e-6, duration=10.0):
    """A hub that slips on its shaft from time to time, by some hundredths of a degree."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration / STEP)) * STEP
    drive = 6.0 * time + 0.1 * np.sin(2 * np.pi * 3.0 * time)
    slip = np.zeros(len(time))
    for at in np.cumsum(rng.exponential(0.15, 200)):
        size, lasts = rng.exponential(1e-3), 0.02 + 0.1 * rng.random()
        slip += size * np.clip((time - at) / lasts, 0.0, 1.0)
    twist = 3e-4 * np.sin(2 * np.pi * 3.0 * time + rng.random())
    return _recorded(drive, drive - slip + twist, noise, rng)


def random_walk(seed=0, noise=2e-6, duration=10.0, size=3e-3):
    """A displacement that walks at random: creep, temperature, a loose coupling."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration / STEP)) * STEP
    drive = 6.0 * time + 0.1 * np.sin(2 * np.pi * 3.0 * time)
    walk = np.cumsum(rng.normal(0.0, size * np.sqrt(STEP), len(time)))
    return _recorded(drive, drive + walk, noise, rng)


def coloured_displacement(seed=0, noise=2e-6, duration=10.0, high=8.0):
    """A displacement that fluctuates in a band of low frequencies."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration / STEP)) * STEP
    drive = 6.0 * time + 0.1 * np.sin(2 * np.pi * 3.0 * time)
    return _recorded(drive, drive + _coloured(rng, len(time), 0.2, high, 1.5e-3), noise, rng)


def planetary_stage(seed=0, noise=2e-6, duration=10.0):
    """A record of another stage: ratio 1 to 4.2, with its run-out and torsion."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration / STEP)) * STEP
    drive = 12.0 * time + 0.3 * np.sin(2 * np.pi * 2.0 * time)
    loose = drive / 4.2 + 1e-3 * np.sin(drive) + 5e-4 * np.sin(2 * np.pi * 2.0 * time + 1.0)
    return _recorded(drive, loose, noise, rng)


def two_tones(seed=0, noise=2e-6, duration=10.0):
    """A displacement of two tones that are no orders: a beat of two machines on one foundation."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration / STEP)) * STEP
    drive = 6.0 * time + 0.1 * np.sin(2 * np.pi * 3.0 * time)
    first, second = 2.3 + 0.2 * rng.random(), 3.7 + 0.2 * rng.random()
    twist = 1.2e-3 * np.sin(2 * np.pi * first * time) + 8e-4 * np.sin(2 * np.pi * second * time)
    return _recorded(drive, drive + twist, noise, rng)


def spring_stops(seed=0, noise=2e-6, duration=10.0, stiff=60.0):
    """A torsional damper with a soft first stage and stiffer stops: the twist bends, but there is no free flight."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration / STEP)) * STEP
    frequency = 3.0 * (0.9 + 0.2 * rng.random())
    speed = 6.0 + 1.2 * np.sin(2 * np.pi * frequency * time)
    drive = np.cumsum(speed) * STEP
    forced = np.gradient(speed, STEP)
    twist, rate, free = np.zeros(len(time)), 0.0, 1.5e-3
    for k in range(1, len(time)):
        beyond = twist[k - 1] - np.clip(twist[k - 1], -free, free)
        torque = (2 * np.pi * 3.0) ** 2 * twist[k - 1] + (2 * np.pi * stiff) ** 2 * beyond
        rate += STEP * (-torque - 30.0 * rate - forced[k])
        twist[k] = twist[k - 1] + STEP * rate
    return _recorded(drive, drive + twist, noise, rng)


ALL = (compliant_gearbox, soft_shaft, slipping_hub, random_walk, coloured_displacement, planetary_stage, two_tones,
       spring_stops)  # fmt: skip
