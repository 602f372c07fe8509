"""What sensors make of a motion, dirt included: noise, counts, and what no data sheet states."""

from __future__ import annotations

from math import pi, sqrt
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
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
