"""Information of one encoder about its gear: the moments at which its counter changed, or its samples."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gears3d.measured.noise import NoiseModel, estimate_noise, without_repeats
from gears3d.signals import changes, count_of, local_slope, noise_of, quantum, some_steps

# Readings below which rattle is not identifiable.
FEWEST = 200
# Part of the samples at most that may show a new count, for edges to be more precise than samples.
CHANGES = 0.7
# Noise in counts from which on samples are read with white noise and edges run together.
WHITE = 0.3
# Counts by which steps from sample to sample vary where the count rate is not commensurate with the sampling rate.
SWEPT = 2.0
# Edges to either side from which a speed is taken.
_REACH = 4
# Edges of which noise is measured.
_TRIES = 200_000


class Reading(NamedTuple):
    """Reading of one encoder.

    Args:
        time: of each reading [s], (n,).
        shown: angle as the encoder shows it [rad], (n,).
        sigma: standard deviation of the angle [rad], (n,).
        quantum: angle of a count [rad], ``None`` for a smooth record.
        kind: ``"edges"`` (moments at which the counter changed), ``"counts"`` or ``"smooth"`` (samples).
        lift: what the angle is above what is shown: half a count where a counter rounds down [rad].
    """

    time: np.ndarray
    shown: np.ndarray
    sigma: np.ndarray
    quantum: float | None
    kind: str
    lift: float = 0.0

    @property
    def angle(self) -> np.ndarray:
        """The angle [rad], (n,); a copy where it is lifted."""
        return self.shown + self.lift if self.lift else self.shown


def read_encoder(time: np.ndarray, angle: np.ndarray) -> Reading:
    """Return the reading of an encoder: edges where a count lasts longer than a sample, else samples.

    A counter rounds down: samples are moved up by half a count. Where edges leave no order, the samples are taken.

    Args:
        time: of the samples [s], rising, (n,).
        angle: as recorded [rad], (n,).

    Returns:
        The reading, its sigma measured.

    >>> time = np.linspace(0.0, 1.0, 1001)
    >>> read_encoder(time, np.floor(time**1.1 / 4e-3) * 4e-3).kind, read_encoder(time, time).kind
    ('edges', 'smooth')
    """
    count = quantum(angle) or count_of(angle)  # the second where many counts pass in every sample
    time, angle = without_repeats(time, angle, count)
    if count is None or _even(angle, count):  # even steps: counts and samples keep step throughout
        floor = max(noise_of(time, angle, clip=4.0), 1e-14 * max(float(angle.max()), -float(angle.min()), 1.0))
        return Reading(time, angle, np.broadcast_to(floor, len(time)), None, "smooth")
    changed = sum(int(np.count_nonzero(np.abs(change) > 0.5 * count)) for _, change in changes(angle))
    if changed < CHANGES * (len(angle) - 1):
        found = passages(time, angle, count)
        if found is not None and len(found.time) >= FEWEST:
            return found
    floor = max(noise_of(time, angle, clip=4.0), count / np.sqrt(12.0))  # of rounding
    return Reading(time, angle, np.broadcast_to(floor, len(time)), count, "counts", 0.5 * count)


def model_noise(reading: Reading, fluctuation: float | None = None) -> tuple[Reading, NoiseModel]:
    """Return an encoder's readings without its interpolation errors, and the model of the remaining noise."""
    edges = reading.kind == "edges"
    lines = ()
    if reading.quantum is not None:
        turn = 2.0 * np.pi / reading.quantum
        lines = (round(turn / 4.0),) if abs(turn / 4.0 - round(turn / 4.0)) < 1e-3 * turn / 4.0 else ()
    white = None if reading.quantum is None else usual(reading.sigma)
    found = estimate_noise(reading.time, reading.shown, white, lines, edges, fluctuation, reading.quantum)
    found = replace(found, walk=0.0)  # a random walk of a rattling gear is its motion
    if found.periodic:
        shown = found.corrected(reading.shown)
        sigma = reading.sigma
        if reading.kind == "smooth":
            sigma = np.broadcast_to(noise_of(reading.time, shown, clip=4.0), len(shown))
        reading = reading._replace(shown=shown, sigma=np.maximum(sigma, 1e-300))
    return reading, found


def _even(angle: np.ndarray, count: float) -> bool:
    """Return whether all steps are equal to within half a count."""
    low, high = np.inf, -np.inf
    for _, change in changes(angle):
        low, high = min(low, float(change.min())), max(high, float(change.max()))
        if high - low >= 0.5 * count:
            return False
    return True


def passages(time: np.ndarray, angle: np.ndarray, count: float) -> Reading | None:
    """Return the moment at which each count was passed; ``None`` where the gear turns back or counts run together.

    A counter with noise about an edge passes it several times. The total time that it shows less than the edge
    is the moment: that is unbiased for any noise, and as well known as noise and samples allow. Its variance in samples
    is that of as many trials, τ/√π with the noise τ in samples, and the remaining variance of the rounding to samples,
    Σ exp(−4π²k²τ²)/(2π²k²).

    ``time``: of the samples [s], rising, (n,); ``angle``: whole numbers of counts [rad], (n,); ``count``: angle of one
    [rad].

    >>> time = np.arange(20_000) * 1e-4
    >>> shaky = 5.0 * time + np.random.default_rng(1).normal(0.0, 1e-3, len(time))
    >>> found = passages(time, np.floor(shaky / 5e-3) * 5e-3, 5e-3)
    >>> off = (found.angle - 5.0 * found.time) / found.sigma
    >>> bool(abs(np.mean(off)) < 0.1), round(float(np.std(off)), 1)
    (True, 1.0)
    """
    level = np.rint(angle / count).astype(np.int64)
    way = 1 if level[-1] >= level[0] else -1
    level = way * level - (0 if way > 0 else 1)  # falling, a count's lower end is passed last
    low = int(level.min())
    level -= low
    cell = np.gradient(time)
    cell[0], cell[-1] = 0.5 * (time[1] - time[0]), 0.5 * (time[-1] - time[-2])
    samples = np.bincount(level)
    before = np.cumsum(np.bincount(level, cell))[:-1]
    astray = _astray(level, samples)
    number = np.cumsum(samples)[:-1]
    at, place, times = np.unique(number, return_index=True, return_counts=True)
    if len(at) < FEWEST:
        return None
    passed = way * (low + 1 + place + 0.5 * (times - 1)) * count  # several counts in a sample: their middle
    moment = time[0] + before[place]
    speed = np.abs(local_slope(moment, passed, _REACH))
    spacing = float(np.median(some_steps(time)))
    tremble = float(np.mean(astray[place] * speed)) * spacing / 0.3989  # mean of the half of a normal distribution
    if tremble > WHITE * count:
        return None
    swept = np.maximum(speed * spacing, 1e-3 * count)
    far = astray[place] > 6.0 * (tremble / swept + 1.0) + 3.0 * np.sqrt(tremble / swept + 1.0)
    if np.mean(far) > 0.01:
        return None
    sure = slice(1, -1)  # the counts in which the record begins and ends are cut
    moment, passed, swept = moment[sure], passed[sure], swept[sure]
    noise = max(tremble, _measured_noise(moment, passed, swept, count))
    if noise > WHITE * count:
        return None
    return Reading(moment, passed, _sigma_of(swept, noise), count, "edges")


def _measured_noise(moment: np.ndarray, passed: np.ndarray, swept: np.ndarray, count: float) -> float:
    """Return the noise of the angle before it was counted [rad], which makes edges scatter as they do.

    Where noise is less than the motion per sample, too few samples cross an edge back to estimate it.
    Measured are third differences of the moments of four edges in a row.
    """
    row = np.flatnonzero(np.abs(passed[3:] - passed[:-3]) < 3.5 * count)[:_TRIES]
    if len(row) < FEWEST // 4:
        return 0.0
    bent = moment[row + 3] - moment[row] - 3.0 * (moment[row + 2] - moment[row + 1])
    bent *= 3.0 * count / (moment[row + 3] - moment[row])
    middle = float(np.median(bent))
    low, high = 0.0, count
    for _ in range(12):
        noise = 0.5 * (low + high)
        standard = (bent - middle) / (np.sqrt(20.0) * _sigma_of(swept[row + 1], noise))
        low, high = (noise, high) if np.mean(np.minimum(standard**2, 16.0)) > 1.0 else (low, noise)
    return low


def _sigma_of(swept: np.ndarray, noise: float) -> np.ndarray:
    """Return the standard deviations of edges [rad] that are swept by samples so far apart, at that noise [rad]."""
    shaken = noise / swept
    rounding = sum(np.exp(-((2.0 * np.pi * k * shaken) ** 2)) / (2.0 * np.pi**2 * k**2) for k in (1, 2, 3))
    rounding = np.minimum(rounding + 0.0139 * np.exp(-((25.0 * shaken) ** 2)), 1.0 / 12.0)
    return swept * np.sqrt(shaken / np.sqrt(np.pi) + rounding)


def _astray(level: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Return how many samples come after each edge's moment and show less."""
    ordered = np.repeat(np.arange(len(samples)), samples)
    late = np.flatnonzero(ordered > level)
    change = np.bincount(level[late] + 1, minlength=len(samples) + 1) - np.bincount(
        ordered[late] + 1, minlength=len(samples) + 1
    )
    return np.cumsum(change)[1 : len(samples)]


def stuck(reading: Reading) -> float:
    """Return the error of an encoder while its count rate is commensurate with the sampling rate, at most [rad].

    Rounding is not white noise: a gear that turns by a whole number of counts per sample is read with a constant error.
    Noise of half a count removes that error.

    >>> time = np.linspace(0.0, 1.0, 1001)
    >>> round(stuck(read_encoder(time, np.floor(time**1.1 / 8e-4) * 8e-4)), 9)
    0.0004
    """
    if reading.quantum is None:
        return 0.0
    sigma = usual(reading.sigma)
    if reading.kind == "edges":
        return np.sqrt(3.0) * sigma
    steps = some_steps(reading.shown) / reading.quantum
    swept = float(np.subtract(*np.quantile(steps, (0.95, 0.05)))) > SWEPT  # no step is a whole number for long
    return 0.5 * reading.quantum if sigma < 0.5 * reading.quantum and not swept else 0.0


def usual(sigma: np.ndarray) -> float:
    """Return the median of standard deviations, which may all be one.

    ``sigma``: (n,).

    >>> usual(np.broadcast_to(2.0, 10)), usual(np.array([1.0, 2.0, 4.0]))
    (2.0, 2.0)
    """
    return float(sigma[0] if sigma.strides == (0,) and len(sigma) else np.median(sigma))
