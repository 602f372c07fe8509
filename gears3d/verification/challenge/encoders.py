"""What the encoders of a challenge read: their own errors first, then noise, then counts."""

from __future__ import annotations

from math import pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from gears3d.scenario.models import Sensor, Sensors


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


def zeros(sensors: Sensors, records: int, random: np.random.Generator) -> tuple[tuple[float, float], ...]:
    """Return what encoders that begin anywhere read of both gears at the marks of the bench, whole counts [rad].

    >>> from gears3d.scenario.models import Sensor, Sensors
    >>> drawn = zeros(Sensors(1e3, Sensor(4), Sensor(4)), 2, np.random.default_rng(1))
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


def read(angle: np.ndarray, sensor: Sensor, noise: float, random: np.random.Generator) -> np.ndarray:
    """Return what a counter at an encoder writes down.

    Shapes: ``angle`` (n,).

    >>> from gears3d.scenario.models import Sensor
    >>> counted = read(np.linspace(0.0, 2 * pi, 9), Sensor(4), 0.0, np.random.default_rng(1))
    >>> np.unique(np.diff(counted).round(6)).tolist()
    [0.0, 1.570796]
    """
    begin = random.uniform(0.0, 1.0)
    seen = angle + np.hypot(sensor.noise, noise) * random.standard_normal(len(angle))
    if not sensor.counts_per_revolution:
        return seen
    edge = 2.0 * pi / sensor.counts_per_revolution
    return np.floor(seen / edge + begin) * edge
