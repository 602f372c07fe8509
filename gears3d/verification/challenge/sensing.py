"""What sensors make of a motion: errors of encoders, noise, counts, and dirt that no data sheet states."""

from __future__ import annotations

from math import pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from gears3d.scenario.models import Sensor, Sensors
    from gears3d.verification.challenge.space import Rig

COLOURED = (1e-3, 2e-2)  # Rms of 1/f noise over the backlash, over the record, both encoders together
SUBDIVISION = (1e-3, 1e-2)  # Amplitude of the interpolation error over a line; the second order has half of it
LINES = (1000, 20_000)  # Lines per revolution of incremental encoders on the market
JITTER = (2e-4, 2e-2)  # Rms of the sampling moments over a sample; both encoders are latched by one clock
CLOCK = 30e-6  # Error of the clock's rate: a quartz without temperature control
REPEATED = (2, 20)  # Every so many-th reading is that of before
UNSTATED = 0.05  # Second and third harmonic of the drive over its fluctuation


def sense(
    rig: Rig,
    time: np.ndarray,
    angles: tuple[np.ndarray, np.ndarray],
    random: np.random.Generator,
    dirt: bool,
    zeros: tuple[float, float] | None = None,
) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    """Return what is recorded of both shafts, and the sizes of the dirt.

    Units: ``time`` (n,); ``angles`` (n,); ``zeros`` [rad].
    """
    kinds = rig.dirt if dirt else ()
    edge, rate = 2.0 * pi / rig.counts, 1.0 / (time[1] - time[0])
    sizes: dict[str, float] = {}
    late = np.zeros(len(time))
    if "jitter" in kinds:
        sizes["jitter"] = _decades(random, *JITTER)
        late = sizes["jitter"] / rate * random.standard_normal(len(time))
    if "one_over_f" in kinds:
        sizes["one_over_f"] = _decades(random, *COLOURED)
    if "interpolation" in kinds:
        sizes["interpolation"] = _decades(random, *SUBDIVISION)
        sizes["lines"] = float(int(min(_decades(random, *LINES), rig.counts / 4)))
    columns = {"time_s": time}
    given = (None, None) if zeros is None else zeros
    for name, angle, radius, zero in zip(("drive", "loose"), angles, rig.base_radius, given, strict=True):
        seen = angle + (random.uniform(-pi, pi) if zero is None else zero)
        if "jitter" in kinds:
            seen = seen + late * np.gradient(angle, time)
        if "one_over_f" in kinds:
            seen = seen + sizes["one_over_f"] / sqrt(2.0) * rig.backlash / radius * coloured(len(time), random)
        if "interpolation" in kinds:
            line, phases = 2.0 * pi / sizes["lines"], random.uniform(0.0, 2.0 * pi, 2)
            turn = 2.0 * pi * seen / line
            error = np.cos(turn + phases[0]) + 0.5 * np.cos(2.0 * turn + phases[1])
            seen = seen + sizes["interpolation"] * line * error
        seen = seen + rig.noise * random.standard_normal(len(time))
        columns[f"theta_{name}_rad"] = np.floor(seen / edge + random.uniform()) * edge
    if "held" in kinds:
        every = int(random.integers(REPEATED[0], REPEATED[1] + 1))
        sizes["held"] = float(every)
        held = np.arange(every, len(time), every)
        for name in ("theta_drive_rad", "theta_loose_rad"):
            columns[name][held] = columns[name][held - 1]
    if "clock" in kinds:
        sizes["clock"] = CLOCK * float(random.choice([-1.0, 1.0]))
        columns["time_s"] = time * (1.0 + sizes["clock"])
    return columns, sizes


def coloured(n: int, random: np.random.Generator) -> np.ndarray:
    """Return noise whose power falls with 1/f, of rms 1 over its length.

    >>> noise = coloured(4096, np.random.default_rng(1))
    >>> round(float(noise.std()), 6), round(float(noise.mean()), 6) == 0.0
    (1.0, True)
    """
    size = 1 << (n - 1).bit_length()
    bins = np.arange(size // 2 + 1)
    power = np.zeros(len(bins))
    power[1:] = 1.0 / np.sqrt(bins[1:])
    parts = power * (random.standard_normal(len(bins)) + 1j * random.standard_normal(len(bins)))
    noise = np.fft.irfft(parts, size)[:n]
    noise = noise - noise.mean()
    return noise / noise.std()


def _decades(random: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def delay(effects: list[dict[str, Any]], gear: str) -> float:
    """Return by how much one encoder reads late [s].

    >>> delay([{"kind": "encoder_skew", "gear": "loose", "delay": 2e-5}], "loose")
    2e-05
    """
    return sum(e["delay"] for e in effects if e["kind"] == "encoder_skew" and e["gear"] == gear)


def wander(effects: list[dict[str, Any]], gear: str, angle: np.ndarray) -> np.ndarray:
    """Return what an encoder off its shaft's centre reads in place of the angle.

    Shapes: ``angle`` (n,).

    >>> error = {"kind": "encoder_eccentricity", "gear": "loose", "amplitude": 1e-3, "order": 1, "phase": 0.0}
    >>> wander([error], "loose", np.array([0.0, pi])).round(6).tolist()
    [0.001, 3.140593]
    """
    read = angle.copy()
    for e in effects:
        if e["kind"] == "encoder_eccentricity" and e["gear"] == gear:
            read += e["amplitude"] * np.cos(e["order"] * angle + e["phase"])
    return read


def arbitrary_zeros(sensors: Sensors, records: int, random: np.random.Generator) -> tuple[tuple[float, float], ...]:
    """Return what encoders that begin anywhere read of both gears at the marks of the bench, whole counts [rad].

    >>> from gears3d.scenario.models import Sensor, Sensors
    >>> drawn = arbitrary_zeros(Sensors(1e3, Sensor(4), Sensor(4)), 2, np.random.default_rng(1))
    >>> [[round(2.0 * angle / pi, 6) for angle in pair] for pair in drawn]
    [[0.0, 2.0], [-1.0, 2.0]]
    """
    drawn = random.uniform(-pi, pi, (records, 2))
    for column, gear in enumerate((sensors.drive, sensors.loose)):
        if gear.counts_per_revolution:
            edge = 2.0 * pi / gear.counts_per_revolution
            drawn[:, column] = np.round(drawn[:, column] / edge) * edge
    return tuple((float(drive), float(loose)) for drive, loose in drawn)


def sway(angle: np.ndarray, step: float, frequency: float, damping: float) -> np.ndarray:
    """Return the angle of an encoder's disc that sits on its shaft as on a spring; in no catalogue.

    Shapes: ``angle`` (n,).

    The disc follows x'' + 2·ζ·ω·(x' - θ') + ω²·(x - θ) = 0; between samples the shaft turns evenly, which makes a
    recurrence that is exact.

    >>> sway(np.zeros(3), 1e-4, 200.0, 0.02).tolist()
    [0.0, 0.0, 0.0]
    """
    from scipy.signal import lfilter, lfiltic

    w = 2.0 * pi * frequency
    decay, turn = np.exp(-damping * w * step), w * sqrt(1.0 - damping**2) * step
    speed = np.diff(angle, prepend=2.0 * angle[0] - angle[1]) / step
    kick = np.diff(speed, prepend=speed[0])
    # the disc lags by the sum of ringings that every change of the shaft's speed has begun
    ring = decay * np.sin(turn) / (w * sqrt(1.0 - damping**2))
    back = [1.0, -2.0 * decay * np.cos(turn), decay**2]
    lag, _ = lfilter([0.0, ring], back, kick, zi=lfiltic([0.0, ring], back, [0.0, 0.0], [0.0]))
    return angle - lag


def reading(angle: np.ndarray, sensor: Sensor, noise: float, random: np.random.Generator) -> np.ndarray:
    """Return what a counter at an encoder writes down.

    Shapes: ``angle`` (n,).

    >>> from gears3d.scenario.models import Sensor
    >>> seen = reading(np.linspace(0.0, 2 * pi, 9), Sensor(4), 0.0, np.random.default_rng(1))
    >>> np.unique(np.diff(seen).round(6)).tolist()
    [0.0, 1.570796]
    """
    begin = random.uniform(0.0, 1.0)
    seen = angle + np.hypot(sensor.noise, noise) * random.standard_normal(len(angle))
    if not sensor.counts_per_revolution:
        return seen
    edge = 2.0 * pi / sensor.counts_per_revolution
    return np.floor(seen / edge + begin) * edge
