"""A resonance in the readings: a frequency that exceeds the background of every record's spectrum, at any speed.

Effects that repeat with the drive or with an angle move with the speed. A resonance of an encoder's mounting, or of the
body that carries it, does not; it shows before segmentation, and corrupts it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.diagnosis.evidence import Paths
from gears3d.diagnosis.residual_patterns import Structure
from gears3d.errors import EngineError, InputError
from gears3d.measured.noise import estimate_noise
from gears3d.scenario.models import Sensor, Sensors
from gears3d.signals import quantum
from gears3d.simulation import simulate
from gears3d.simulation.sensors import encode

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted
    from gears3d.measured.segmentation import Track
    from gears3d.scenario import Scenario

Array = np.ndarray
# Tried frequencies [Hz], and ratio of neighbouring ones.
LOWEST, HIGHEST, FREQUENCY_RATIO = 20.0, 1000.0, 1.01
# Minimum number of readings per period of the highest frequency; means over as many as that allows are taken before.
READINGS_PER_PERIOD = 10.0
# Length of the stretches with averaged spectra.
SECONDS = 1.0
# Relative bandwidth of the power, at least the drive's fluctuation, of whose multiples it consists; and the frequency
# ratios, up and down, of the background.
BANDWIDTH, BACKGROUND_RATIO = 0.06, 1.6
# Minimum ratio of the power to the interpolated background, in the record that shows it least.
LEAST_RATIO = 10.0
# Minimum displacement (root mean square), relative to the backlash, that can affect a diagnosis.
SMALLEST_SHARE = 0.005
# Minimum number of records for a fixed frequency; minimum ratio of neighbouring speeds, and of the largest or fastest
# of their fluctuations to the others.
FEWEST_RECORDS, SPEED_RATIO = 3, 1.2


class Resonance(NamedTuple):
    """A frequency that exceeds the background in all records.

    Args:
        structure: as reported.
        frequency: tried [Hz], (t,).
        power: of the displacement about each of them, one row per record [m²], (r, t).
    """

    structure: Structure
    frequency: Array
    power: Array


def resonance(
    admitted: Sequence[Admitted], paths: Paths, expected: Callable[[Admitted], Track | None] | None = None
) -> Resonance | None:
    """Return the resonance of all records, if any; the expected path is by default from the rigid model."""
    expected = expected or _expected
    rigs = [one.rig for one in admitted if one.rig is not None]
    speeds = sorted(abs(rig.motion.mean) for rig in rigs)
    if len(rigs) < FEWEST_RECORDS or speeds[-1] < SPEED_RATIO ** (FEWEST_RECORDS - 1) * speeds[0]:
        return None
    first = [rig.motion.harmonics[0] for rig in rigs if rig.motion.harmonics]
    swings = [(one.frequency, one.amplitude) for one in first]
    if swings and all(max(each) < SPEED_RATIO * min(each) for each in zip(*swings, strict=True)):
        return None  # the same fluctuation at every speed makes the same motion, with the same lines
    tried = LOWEST * FREQUENCY_RATIO ** np.arange(int(np.log(HIGHEST / LOWEST) / np.log(FREQUENCY_RATIO)))
    seen = [_spectrum(one, paths.of(one), tried) for one in admitted]
    ratio, power, sure = (np.array(column) for column in zip(*seen, strict=True))
    best = int(np.argmax(ratio.min(axis=0)))
    if not np.min(ratio[:, best]) > LEAST_RATIO:
        return None
    paths_of_rig = [expected(one) for one in admitted]
    own = [np.ones(len(tried)) if known is None else _spectrum(one, known, tried)[0]
           for one, known in zip(admitted, paths_of_rig, strict=True)]  # fmt: skip
    ratio = ratio / np.maximum(own, 1.0)
    best = int(np.argmax(ratio.min(axis=0)))
    if not np.min(ratio[:, best]) > LEAST_RATIO:
        return None  # the rattle of the rig has the same lines
    size = float(np.sqrt(np.mean(power[:, best] * (1.0 - 1.0 / ratio[:, best]))))
    if size < SMALLEST_SHARE * rigs[0].rig().backlash:
        return None
    gain = float(np.sum(sure[:, best] * np.log(ratio[:, best]) ** 2))
    return Resonance(Structure("impact.duration", gain, 0.0, size, "m", float(tried[best]), gain), tried, power)


def _expected(one: Admitted) -> Track | None:
    """Return the path of a record by the rigid model; ``None`` where the model cannot run."""
    assert one.rig is not None
    try:
        return Paths().of(simulated(one, one.rig))
    except (InputError, EngineError):  # the model does not cover the rig, or its path has no information
        return None


def _means(values: Array, together: int) -> Array:
    """Return means of neighbouring values."""
    whole = len(values) // together * together
    return values[:whole].reshape(-1, together).mean(axis=1)


def _spectrum(one: Admitted, known: Track, tried: Array) -> tuple[Array, Array, Array]:
    """Return the ratio of power about each frequency to the background, that power [m²], and its precision, each (t,).

    The relative error of power over a bandwidth and a duration is the root of one over their product.
    """
    from scipy.signal import welch

    assert one.rig is not None
    together = max(int(1.0 / (known.step * READINGS_PER_PERIOD * HIGHEST)), 1)
    place = _means(known.radii[0] * known.drive - known.radii[1] * known.loose, together)
    rate = 1.0 / (known.step * together)
    turn, power = welch(place, rate, nperseg=min(int(SECONDS * rate), len(place)), detrend="linear")
    total = np.concatenate([[0.0], np.cumsum(power)]) * turn[1]
    # the strongest harmonic's frequency separates lines; weak ones are slower, but do not cause rattle
    strongest = max(one.rig.motion.harmonics, key=lambda each: each.amplitude, default=None)
    between = 0.0 if strongest is None else strongest.frequency

    def width(middle: Array) -> Array:
        return np.maximum(BANDWIDTH * middle, between)

    def about(middle: Array) -> Array:
        half = 0.5 * width(middle)
        ends = (np.interp(middle + sign * half, turn - 0.5 * turn[1], total[:-1]) for sign in (1.0, -1.0))
        return np.subtract(*ends)

    own, usual = about(tried), np.sqrt(about(tried / BACKGROUND_RATIO) * about(tried * BACKGROUND_RATIO))
    usual *= width(tried) / np.sqrt(width(tried / BACKGROUND_RATIO) * width(tried * BACKGROUND_RATIO))
    seen = tried * BACKGROUND_RATIO < 0.4 * rate
    ratio = np.where(seen, own / np.maximum(usual, 1e-300), 0.0)
    return ratio, np.where(seen, own, np.nan), width(tried) * len(place) / rate


# In records simulated of the rig alone, results of segmentation and search are errors of these methods: not a cause,
# and not a residual pattern that a cause should explain.


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
