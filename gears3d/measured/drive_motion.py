"""The motion of the drive: harmonics of its speed, and a smooth curve of its angle."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import atan2, hypot, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.measured.encoder import FEWEST as READINGS
from gears3d.measured.encoder import Reading, model_noise, read_encoder, usual
from gears3d.signals import noise_of, some_steps
from gears3d.units import show

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

    from gears3d.measured.encoder import Reading

Array = np.ndarray
# Means of the angle that are kept: 40 a period in a record of 400 periods.
POINTS = 1 << 14
# Readings below which nothing but a mean speed is estimated.
FEWEST = 64
# Degree of the polynomial in time that a run-up's angle follows: its speed is a parabola.
DEGREE = 3
# Periods that a record must hold of a harmonic; with fewer it cannot be separated from a run-up.
LEAST = 2.0
# Harmonics that are looked for.
MOST = 12
# p-value below which a line is significant; its periodogram is exponentially distributed.
CHANCE = 1e-4
# Lines of the periodogram on each side whose median is the level of the noise.
BESIDE = 48
# Lines of the periodogram between two harmonics; nearer ones are one whose amplitude changes.
APART = 4.0
# Amplitude over that of the strongest harmonic, as speed or as acceleration, below which a line is not kept.
SMALL = 0.01
# Multiple of the frequency of the strongest harmonic up to which lines are kept for their acceleration alone.
FINEST = 20.0
# Counts of the encoder: samples that beat with its counts make lines of an amplitude up to 1/pi of one.
COUNTED = 0.35
# Part of the angle below which a line comes from the rounding of numbers.
ROUNDED = 1e-14
# Multiples of the strongest harmonic that joints, cranks and motors make, which are looked for below the counts, too,
# and standard deviations that each must have to be one: by chance, one in 3000.
NEXT, SURE = 4, 4.0
# Multiple of the amplitude of the fifth-strongest line between two multiples that they must have: where the noise is
# that of counts, it consists of lines. Chosen on two rigs of the benchmark, space 80 (true ones at 1.43 and more) and
# space 90 (none true, the strongest at 1.33).
OTHERS, OVER = 5, 1.4
# Standard deviations that a harmonic may have that was not found: half of what it must have to be.
UNSEEN = 2.0
# Change of speed over mean speed from which on a record is called a run-up; controlled drives hold 1 % or better.
RUN_UP = 0.02
# Amplitude over that of the strongest harmonic from which on a harmonic of lower order may set the period.
FUNDAMENTAL = 0.1
# Harmonics that a line of text names.
SHOWN = 3
# Gauss-Newton steps of the final fit, which begins within 0.1 of a spectral line.
ROUNDS = 3
# Standard deviations of a 95 % interval.
NORMAL = 1.96
# Time over which the angle is averaged before it is smoothed [s]; shorter where the motion requires it.
SHORTEST = 0.4e-3
# Times by which that time is shortened as long as the finest curve is further from the means than their noise.
FINER = 4
# Deviation of means from the curve, in noise, from which finer ones are tried, as motion was averaged out.
MISSED = 1.2
# Means processed at a time.
AT_ONCE = 1 << 14
# Means between the knots of the finest curve.
KNOT = 4
# Curves that are tried at most, each with half the knots of the one before.
RUNGS = 14
# Factor by which both must grow: beyond it, two curves that both miss the motion agree by chance.
GROWN = 1.5
# Pieces of a harmonic's period that a cubic follows to a thousandth of its amplitude.
PER_PERIOD = 12.0
# Variation of the variance of times in a mean that is rounding.
EVEN = 1e-3
# Readings in a mean that are enough for a known motion.
MEANT = 8
# Spans between knots of the coarsest curve.
AT_LEAST = 8
# Correlation time of the error of a cubic spline through white noise, in spans: in 30 splines of 10 to 100 spans the
# ratio of its rate of change to itself was 1.83 to 1.99 per span.
CORRELATED = 0.54


class Harmonic(NamedTuple):
    """One harmonic of the drive's speed: amplitude·sin(2·pi·frequency·t + phase).

    Args:
        frequency: [Hz].
        amplitude: [rad/s].
        phase: at t = 0 [rad].
        order: per revolution of the drive at its mean speed, 0 where it does not turn.
        frequency_sigma: standard deviation [Hz]; 0 where the frequency was given.
        amplitude_sigma: standard deviation [rad/s].
    """

    frequency: float
    amplitude: float
    phase: float
    order: float
    frequency_sigma: float
    amplitude_sigma: float


class DriveMotion(NamedTuple):
    """The drive's motion in one record.

    Args:
        mean: mean speed [rad/s].
        mean_sigma: standard deviation [rad/s].
        speeds: at the beginning and at the end, fluctuation apart [rad/s].
        harmonics: that with the period of the motion first, then by decreasing amplitude.
        hidden: multiples of the strongest that lines of the noise may hide, with the largest amplitude that fits.
    """

    mean: float
    mean_sigma: float
    speeds: tuple[float, float]
    harmonics: tuple[Harmonic, ...] = ()
    hidden: tuple[Harmonic, ...] = ()

    @property
    def period(self) -> float | None:
        """Period of the fluctuation, else of one revolution [s]; ``None`` where the drive stands still."""
        if self.harmonics:
            return 1.0 / self.harmonics[0].frequency
        return 2.0 * pi / abs(self.mean) if self.mean else None

    @property
    def runs_up(self) -> bool:
        """Whether the mean speed changes over the record."""
        return abs(self.speeds[1] - self.speeds[0]) > RUN_UP * abs(self.mean)

    def scenario(self) -> dict[str, Any]:
        """Return the motion as the table ``[motion]`` of a scenario."""
        return {
            "mean": f"{self.mean:.17g} rad/s",
            "harmonics": [
                {"amplitude": f"{one.amplitude:.17g} rad/s", "frequency": f"{one.frequency:.17g} Hz",
                 "phase": f"{one.phase:.17g} rad"}
                for one in self.harmonics
            ],
        }  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold, as the contract has it."""
        return {
            "mean_rad_s": _interval(self.mean, self.mean_sigma),
            "speed_begin_rad_s": self.speeds[0],
            "speed_end_rad_s": self.speeds[1],
            "run_up": self.runs_up,
            "period_s": self.period,
            "harmonics": [
                {
                    "frequency_Hz": _interval(one.frequency, one.frequency_sigma),
                    "order": one.order or None,
                    "amplitude_rad_s": _interval(one.amplitude, one.amplitude_sigma),
                    "phase_rad": one.phase,
                }
                for one in self.harmonics
            ],
        }

    def __str__(self) -> str:
        return told(self.to_dict())


def told(motion: Mapping[str, Any]) -> str:
    """Return the description of a drive's motion in one line."""
    text = f"mean {show(motion['mean_rad_s']['value'], 'speed', 4)}"
    if motion["run_up"]:
        begin, end = (show(motion[f"speed_{name}_rad_s"], "speed", 4) for name in ("begin", "end"))
        text = f"from {begin} to {end}, {text}"
    for one in motion["harmonics"][:SHOWN]:
        order = f" (order {one['order']:.4g})" if one["order"] else ""
        amplitude, frequency = one["amplitude_rad_s"]["value"], one["frequency_Hz"]["value"]
        text += f", {show(amplitude, 'speed', 4)} at {show(frequency, 'frequency', 5)}{order}"
    more = len(motion["harmonics"]) - SHOWN
    return f"{text}, {more} smaller" if more > 0 else text


def drive_motion(time: Array, angle: Array, frequencies: Sequence[float] = ()) -> DriveMotion:
    """Return the motion of the drive: mean speed and strongest harmonics, with their uncertainties.

    Interpolation errors of the encoder are removed first.

    ``time``: of the readings [s], rising, (n,); ``angle``: of the drive gear [rad], (n,); ``frequencies``: of its
    harmonics where they are known [Hz]; they are looked for otherwise.

    Source: Rife and Boorstyn 1974, IEEE Trans. Inf. Theory 20: least squares, uncertainty of a frequency.

    >>> time = np.arange(0.0, 10.0, 1e-3)
    >>> found = drive_motion(time, 20.0 * time - 0.1 * np.cos(2 * pi * 3.0 * time + 0.5))
    >>> [round(number, 4) for number in (found.mean, *found.harmonics[0][:4])]
    [20.0, 3.0, 1.885, 0.5, 0.9425]
    """
    time, angle = np.asarray(time, float), np.asarray(angle, float)
    if len(time) >= READINGS and not len(frequencies) and np.isfinite(angle.sum()):
        return motion_of(model_noise(read_encoder(time, angle))[0])
    return _of(time, angle, frequencies)


def motion_of(reading: Reading) -> DriveMotion:
    """Return the motion of the drive from the readings of its encoder."""
    return _of(reading.time, reading.shown, (), _beats(reading))


def _of(time: Array, angle: Array, frequencies: Sequence[float], count: float = 0.0) -> DriveMotion:
    time, angle, width = _means(time, angle)
    span = float(time[-1] - time[0]) if len(time) else 0.0
    if len(time) < FEWEST or not span > 0.0 or not np.isfinite(angle.sum()):
        mean = float((angle[-1] - angle[0]) / span) if span > 0.0 else 0.0
        return DriveMotion(mean, 0.0, (mean, mean))
    fit = _Fit(time, angle, width)
    turns = np.array([2.0 * pi * one for one in frequencies if one * span >= 1.0])
    numbers, hidden = fit.solve(turns), turns[:0]
    if not len(frequencies):
        turns, numbers, hidden = _search(fit, count)
    found = _motion(fit, turns, numbers, bool(len(frequencies)))
    if not len(hidden):
        return found
    both = np.append(turns, hidden)
    every = _motion(fit, both, fit.solve(both), True).harmonics
    return found._replace(hidden=every[len(turns) :])


def _beats(reading: Reading) -> float:
    """Return the count of an encoder as far as its lines are left by noise, which dithers them [rad].

    A count rate commensurate with the sampling rate may imitate noise, but not in every 2nd, 3rd and 5th reading, too.
    Source: Widrow and Kollar 2008, Quantization Noise: noise of variance v lets the line of counts q fall by
    exp(-2·pi²·v/q²).
    """
    count = reading.quantum
    if not count:
        return 0.0
    noise = min(noise_of(reading.time[::step], reading.shown[::step], clip=4.0) for step in (1, 2, 3, 5))
    return count * float(np.exp(-2.0 * pi**2 * max(noise**2 / count**2 - 1.0 / 12.0, 0.0)))


def of_period(time: Array, angle: Array, period: float, at: Array) -> Array:
    """Return the phase of the drive's fluctuation of a known period at some times [rad], NaN in a shorter record.

    ``time``: of the readings [s], (n,); ``angle``: of the drive gear [rad], (n,); ``period``: [s]; ``at``: the times
    [s], (k,).
    """
    found = drive_motion(time, angle, (1.0 / period,)).harmonics
    if not found:
        return np.full(len(at), np.nan)
    return np.mod(2.0 * pi / period * at + found[0].phase, 2.0 * pi)


class _Fit:
    """Means of an angle, and the least squares of a polynomial and harmonics through them."""

    def __init__(self, time: Array, angle: Array, width: float) -> None:
        self.middle = 0.5 * float(time[0] + time[-1])
        self.half = 0.5 * float(time[-1] - time[0])
        self.x = time - self.middle
        self.angle, self.width, self.first = angle - angle[0], width, float(angle[0])
        self.trend = np.polynomial.legendre.legvander(self.x / self.half, DEGREE)

    def shrunk(self, turn: Array) -> Array:
        """Return by how much a mean over the width flattens sines."""
        return np.sinc(turn * self.width / (2.0 * pi))

    def waves(self, turns: Array) -> tuple[Array, Array]:
        """Return cosines and sines of unit size, each (n, h)."""
        along = np.multiply.outer(self.x, turns)
        return self.shrunk(turns) * np.cos(along), self.shrunk(turns) * np.sin(along)

    def solve(self, turns: Array) -> Array:
        """Return coefficients of the trend, then of cosines, then of sines."""
        return _least(np.hstack([self.trend, *self.waves(turns)]), self.angle)

    def refined(self, turns: Array, numbers: Array) -> tuple[Array, Array]:
        """Return frequencies after one step of Gauss and Newton, and the coefficients there."""
        cosines, sines = self.waves(turns)
        a, b = np.split(numbers[DEGREE + 1 :], 2)
        slope = self.x[:, None] * (b * cosines - a * sines)
        found = _least(np.hstack([self.trend, cosines, sines, slope]), self.angle)
        step = found[DEGREE + 1 + 2 * len(turns) :]
        limit = 0.5 * pi / self.half  # half a spectral line: farther is another line
        turns = turns + np.clip(step, -limit, limit)
        return turns, self.solve(turns)

    def rest(self, turns: Array, numbers: Array) -> Array:
        """Return what is not explained, (n,)."""
        return self.angle - np.hstack([self.trend, *self.waves(turns)]) @ numbers


def _least(table: Array, values: Array) -> Array:
    """Return least squares by normal equations, columns scaled to unit length."""
    size = np.sqrt(np.einsum("ij,ij->j", table, table))
    size[size == 0.0] = 1.0
    scaled = table / size
    return np.linalg.lstsq(scaled.T @ scaled, scaled.T @ values, rcond=1e-12)[0] / size


def _means(time: Array, angle: Array) -> tuple[Array, Array, float]:
    """Return means over equally many readings, and the time that each covers.

    The mean of a curved path deviates from the path by its second derivative and the variance of the times. Where that
    varies, as readings are missing, its variation would be taken for a harmonic.
    """
    few = max(len(time) // POINTS, 1)
    count = len(time) // few
    if count < 2:
        return time, angle, 0.0
    rows, angle = time[: count * few].reshape(count, few), angle[: count * few].reshape(count, few).mean(axis=1)
    within, time = rows.var(axis=1), rows.mean(axis=1)
    uneven = within - np.median(within)
    if few > 1 and np.all(np.diff(time) > 0.0) and np.any(np.abs(uneven) > EVEN * np.median(within)):
        angle = angle - 0.5 * uneven * np.gradient(np.gradient(angle, time), time)
    return time, angle, (float(time[-1] - time[0]) / (count - 1) if few > 1 else 0.0)


def _spectrum(fit: _Fit, rest: Array) -> tuple[Array, Array, Array]:
    """Return angular frequencies, the periodogram under a Hann window as squared amplitudes, and the noise in it."""
    from scipy.ndimage import median_filter

    count = len(rest)
    even = np.linspace(-fit.half, fit.half, count)
    power = np.abs(np.fft.rfft(np.interp(even, fit.x, rest) * np.hanning(count))) ** 2 * (4.0 / count) ** 2
    turns = 2.0 * pi * np.fft.rfftfreq(count, 2.0 * fit.half / (count - 1))
    level = median_filter(power, 2 * BESIDE + 1, mode="reflect") / np.log(2.0)
    return turns, power, np.maximum(level, 1e-300)


def _steep(grid: Array, power: Array) -> Array:
    """Return the level of noise whose power falls with the square of the frequency, as integrated noise has it."""
    from scipy.ndimage import median_filter

    square = np.maximum(grid, grid[1]) ** 2
    return median_filter(power * square, 2 * BESIDE + 1, mode="reflect") / np.log(2.0) / square


def _search(fit: _Fit, count: float) -> tuple[Array, Array, Array]:
    """Return angular frequencies of all harmonics, the strongest first, coefficients of the fit, and hidden ones."""
    turns = np.zeros(0)
    numbers = fit.solve(turns)
    least = max(COUNTED * count, ROUNDED * (abs(fit.first) + float(np.abs(fit.angle).max())))
    for _ in range(MOST):
        grid, power, level = _spectrum(fit, fit.rest(turns, numbers))
        line = grid[1] if len(grid) > 1 else 1.0
        level = np.maximum(level, _steep(grid, power))
        usable = (grid >= LEAST * line) & (power > level * np.log(len(grid) / CHANCE))
        usable &= power > least**2
        usable[-1] = False
        for turn in turns:
            usable &= np.abs(grid - turn) > APART * line
        speed = np.sqrt(power) * grid / np.maximum(fit.shrunk(grid), 0.1)
        if len(turns):
            a, b = np.split(numbers[DEGREE + 1 :], 2)
            strongest = turns[0] * hypot(a[0], b[0])
            fast = (grid < FINEST * turns[0]) & (speed * grid > SMALL * strongest * turns[0])
            usable &= (speed > SMALL * strongest) | fast
        if not usable.any():
            break
        best = int(np.argmax(np.where(usable, speed, 0.0)))
        left, here, right = np.log(np.maximum(power[best - 1 : best + 2], 1e-300))
        bend = left - 2.0 * here + right
        shift = float(np.clip(0.5 * (left - right) / bend, -0.5, 0.5)) if bend < 0.0 else 0.0
        turns = np.append(turns, grid[best] + shift * line)
        turns, numbers = fit.refined(turns, fit.solve(turns))
    turns, hidden = _with_multiples(fit, turns)
    numbers = fit.solve(turns)
    for _ in range(ROUNDS if len(turns) else 0):
        turns, numbers = fit.refined(turns, numbers)
    if len(turns):  # those of the multiples are known better than by themselves
        times = np.round(turns / turns[0])
        near = np.abs(turns - times * turns[0]) < 0.5 * pi / fit.half
        turns = np.where(near & (times > 1.0), times * turns[0], turns)
        numbers = fit.solve(turns)
    return turns, numbers, hidden


def _with_multiples(fit: _Fit, turns: Array) -> tuple[Array, Array]:
    """Return the frequencies of harmonics with those multiples of the strongest that exceed the noise as well.

    Their frequencies are known, so that less noise can pass for one than where a line is looked for. Those that exceed
    the level of the noise, but not its own lines, are returned apart.
    """
    hidden = turns[:0]
    if not len(turns):
        return turns, hidden
    times = np.arange(2, NEXT + 1) * turns[0]
    line = pi / fit.half
    apart = np.min(np.abs(times[:, None] - turns), axis=1) > APART * line
    tried = np.append(turns, times[(fit.shrunk(times) > 0.5) & apart])
    for _ in range(2):  # the noise near them is the residual without the strong ones
        numbers = fit.solve(tried)
        rest = fit.rest(tried, numbers)
        grid, _, level = _spectrum(fit, rest)
        lines = np.abs(np.fft.rfft(rest)) * (2.0 / len(rest))
        sizes = np.hypot(*np.split(numbers[DEGREE + 1 :], 2)) * fit.shrunk(tried)
        kept = sizes * tried**2 > SMALL * sizes[0] * tried[0] ** 2
        kept &= sizes > SURE * np.sqrt(np.interp(tried, grid, level) / 3.0)
        exceeds = kept.copy()
        for k, turn in enumerate(tried):
            near = np.abs(grid - turn)
            own = np.sort(lines[(near < 0.9 * turns[0]) & (near > 2.0 * line)])[-OTHERS:]
            kept[k] &= len(own) < OTHERS or sizes[k] > OVER * own[0]
        kept[: len(turns)] = True
        hidden = np.append(hidden, tried[exceeds & ~kept])
        tried = tried[kept]
    return tried, hidden


def _motion(fit: _Fit, turns: Array, numbers: Array, given: bool) -> DriveMotion:
    """Return the motion of a fit, with its uncertainty."""
    span = 2.0 * fit.half
    grid, _, level = _spectrum(fit, fit.rest(turns, numbers))
    trend = np.polynomial.legendre.Legendre(numbers[: DEGREE + 1], (-fit.half, fit.half))
    begin, end = (float(trend.deriv()(x)) for x in (-fit.half, fit.half))
    mean = float(trend(fit.half) - trend(-fit.half)) / span
    # white noise of variance v is 6·v/n in this periodogram, and 2·v/n in the square of a fitted amplitude
    own = np.sqrt(level / 3.0)  # standard deviation of an amplitude [rad]
    # ends of a cubic by least squares: (3 + 7)/3 times the variance of a straight line's slope, 12·v/(n·span²)
    mean_sigma = float(np.sqrt(20.0) * own[min(2, len(own) - 1)] / span)
    found = []
    for turn, a, b in np.column_stack([turns, *np.split(numbers[DEGREE + 1 :], 2)]).tolist():
        size = hypot(a, b)
        sigma = float(np.interp(turn, grid, own) / max(float(fit.shrunk(turn)), 0.1))
        frequency_sigma = 0.0 if given else float(np.sqrt(12.0) * sigma / max(size, 1e-300) / span / (2.0 * pi))
        phase = (atan2(b, -a) - turn * fit.middle) % (2.0 * pi)
        order = abs(turn / mean) if mean else 0.0
        found.append(Harmonic(turn / (2.0 * pi), turn * size, phase, order, frequency_sigma, turn * sigma))
    if not given:
        found.sort(key=lambda one: -one.amplitude)
        first = _fundamental(found, 1.0 / span)
        found = [*found[first : first + 1], *found[:first], *found[first + 1 :]]
    return DriveMotion(mean, mean_sigma, (begin, end), tuple(found))


def _fundamental(found: Sequence[Harmonic], line: float) -> int:
    """Return which harmonic sets the period: the slowest of which the strongest is a multiple, else the strongest."""
    if not found:
        return 0
    top = found[0]
    able = [0]
    for k, one in enumerate(found[1:], 1):
        times = round(top.frequency / one.frequency)
        near = abs(top.frequency - times * one.frequency) < max(5.0 * times * one.frequency_sigma, 0.05 * line)
        if times > 1 and near and one.amplitude > FUNDAMENTAL * top.amplitude:
            able.append(k)
    return min(able, key=lambda k: found[k].frequency)


def _interval(value: float, sigma: float) -> dict[str, Any]:
    return {"value": value, "ci95": [value - NORMAL * sigma, value + NORMAL * sigma]}


class _Waves(NamedTuple):
    """Harmonics of an angle: size·cos(turn·t + phase).

    Args:
        turns: circular frequencies [rad/s], (h,).
        sizes: [rad], (h,).
        phases: at t = 0 [rad], (h,).
        sigma: standard deviation of their sum [rad].
        speed_sigma: of its rate [rad/s].
        turn_sigma: of the circular frequency of the strongest; the others are multiples [rad/s].
        hidden: circular frequencies [rad/s] and largest sizes [rad] of those that noise may hide.
    """

    turns: np.ndarray
    sizes: np.ndarray
    phases: np.ndarray
    sigma: float
    speed_sigma: float
    turn_sigma: float = 0.0
    hidden: tuple[tuple[float, float], ...] = ()

    @property
    def first(self) -> float:
        """Circular frequency of the strongest, by speed [rad/s]."""
        return float(self.turns[np.argmax(np.abs(self.sizes) * self.turns)])

    def at(self, time: np.ndarray | float, order: int = 0) -> np.ndarray:
        """Return their sum at some times, or its derivative of that order."""
        made = np.zeros(np.shape(time))
        for turn, size, phase in zip(self.turns.tolist(), self.sizes.tolist(), self.phases.tolist(), strict=True):
            made += turn**order * size * np.cos(turn * np.asarray(time) + (phase + 0.5 * np.pi * order))
        return made


@dataclass(frozen=True, eq=False)
class Curve:
    """An angle over time: the harmonics of a fluctuation, and a spline for the rest.

    Args:
        spline: angle [rad] over time [s].
        waves: that are added to it.
    """

    spline: BSpline
    waves: _Waves

    def __call__(self, time: np.ndarray | float, order: int = 0) -> np.ndarray:
        """Return the angle at some times [rad], or its derivative of that order.

        ``time``: [s], any shape.
        """
        made = self.spline(time, order)
        return made + self.waves.at(time, order) if len(self.waves.turns) else made

    def derivative(self) -> Callable[[np.ndarray], np.ndarray]:
        """Return the speed over time."""
        return lambda time: self(time, 1)

    @property
    def unsure(self) -> list[tuple[float, float]]:
        """Circular frequencies [rad/s] of harmonics, and by how much each may be wrong [rad].

        Those of the next multiples of the strongest may have been missed, too, or be hidden by the encoder's counts.
        """
        waves = self.waves
        if not len(waves.turns):
            return []
        first, sigma = waves.first, waves.sigma / np.sqrt(len(waves.turns))
        made = [(turn, sigma) for turn in waves.turns.tolist()]
        for turn in first * np.arange(2.0, NEXT + 1.0):
            if np.min(np.abs(waves.turns - turn)) > 0.01 * first:
                sizes = [size for other, size in waves.hidden if abs(other - turn) < 0.01 * first]
                made.append((float(turn), max(UNSEEN * sigma, *sizes, 0.0)))
        return made

    def errors(self, time: np.ndarray, order: int = 0) -> np.ndarray:
        """Return errors of the angle by one standard deviation of each parameter of its harmonics, or their derivative.

        Args:
            time: [s], any shape.
            order: of the derivative.

        Returns:
            By cosine and sine of each harmonic of :attr:`unsure`, and by the frequency of all, (m, ...).
        """
        made, waves = [], self.waves
        for turn, sigma in self.unsure:
            made += [turn**order * sigma * np.cos(turn * time + 0.5 * np.pi * (order + k)) for k in (0, 1)]
        if waves.turn_sigma > 0.0:
            ends = self.spline.t[0], self.spline.t[-1]
            phases = waves._replace(sizes=waves.sizes * waves.turns / waves.first, phases=waves.phases + 0.5 * np.pi)
            made.append(waves.turn_sigma * (time - 0.5 * (ends[0] + ends[1])) * phases.at(time, order))
        return np.array(made).reshape(-1, *np.shape(time))

    @property
    def bends(self) -> float:
        """Time within which it hardly bends [s]: from knot to knot, or a part of the period of a harmonic."""
        turns = self.waves.turns
        return min(self.span, 2.0 * np.pi / (PER_PERIOD * float(turns.max()))) if len(turns) else self.span

    @property
    def span(self) -> float:
        """Median time from knot to knot of the spline [s]."""
        return float(np.median(np.diff(np.unique(np.asarray(self.spline.t, float)))))


class Steady(NamedTuple):
    """The drive's angle over time.

    Args:
        curve: angle [rad] over time [s].
        sigma: standard deviation of the angle [rad].
        speed_sigma: of its rate [rad/s].
        rest: standard deviation of the means about the curve over what their noise accounts for; 1 when the curve
            tells everything.
        size: readings in a mean.
        finest: whether finer curves might be closer.
    """

    curve: Curve
    sigma: float
    speed_sigma: float
    rest: float
    size: int = 1
    finest: bool = False

    @property
    def smooth(self) -> tuple[float, float]:
        """Standard deviation [rad] and correlation time [s] of the curve's error without that of its harmonics."""
        return float(np.sqrt(max(self.sigma**2 - self.curve.waves.sigma**2, 0.0))), CORRELATED * self.curve.span


def steady(reading: Reading, motion: DriveMotion | None = None) -> Steady:
    """Return the smooth motion through an encoder's readings, with the stiffness that the readings determine.

    The harmonics of its fluctuation are fitted to the whole record first: a spline stiff enough to average noise out
    would miss a fast one. Splines with ever fewer knots are drawn through the rest. Counting errors are commensurate
    with the motion for a while and not white, so chi-square does not determine the stiffness of the curve; but from one
    spline to the next the speed differs by noise, less the fewer knots, until the motion itself is missed. The pair
    that differs least gives the curve, and its difference the uncertainty.

    Args:
        reading: of the drive's encoder.
        motion: its harmonics where they are known; they are looked for otherwise.

    >>> from gears3d.measured.encoder import read_encoder
    >>> time = np.arange(0.0, 2.0, 2e-5)
    >>> motion = steady(read_encoder(time, np.floor((3.0 * time + 0.01 * np.sin(20.0 * time)) / 1e-4) * 1e-4))
    >>> off = motion.curve.derivative()(time) - 3.0 - 0.2 * np.cos(20.0 * time)
    >>> bool(np.std(off) < 1e-3), bool(0.3 < motion.speed_sigma / np.std(off) < 3.0)
    (True, True)
    """
    spacing = float(np.median(some_steps(reading.time)))
    size = max(int(SHORTEST / spacing), 1)
    waves = _waves(motion or motion_of(reading))
    found = _through(reading, size, waves)
    while size > 1 and (found.rest > MISSED or found.finest):
        size = max(size // FINER, 1)
        finer = _through(reading, size, waves)
        if finer.rest > 0.9 * found.rest and finer.speed_sigma > found.speed_sigma:
            break  # counting errors that keep step are no motion
        found = finer
    return found


def _waves(motion: DriveMotion | None) -> _Waves:
    """Return the harmonics of the drive's angle; none where it has none."""
    found = () if motion is None else motion.harmonics
    turns = np.array([2.0 * np.pi * one.frequency for one in found])
    sizes = np.array([one.amplitude for one in found]) / turns
    phases = np.array([one.phase for one in found])  # of the speed: amplitude·sin(turn·t + phase)
    slack = float(np.sqrt(sum((one.amplitude_sigma / turn) ** 2 for one, turn in zip(found, turns, strict=True))))
    speed = float(np.sqrt(sum(one.amplitude_sigma**2 for one in found)))
    first = max(found, key=lambda one: one.amplitude, default=None)
    turn_sigma = 2.0 * np.pi * first.frequency_sigma if first else 0.0
    hidden = [(2.0 * np.pi * one.frequency, one.amplitude) for one in (motion.hidden if motion else ())]
    unseen = tuple((turn, speed / turn) for turn, speed in hidden)
    return _Waves(turns, -sizes, phases, slack, speed, turn_sigma, unseen)


def _through(reading: Reading, size: int, waves: _Waves) -> Steady:
    """Return the motion through means over so many readings."""
    time, angle, within = _spline_means(reading, size, waves)
    tried, between = KNOT, []
    curves, left = [], []
    while len(time) // tried >= AT_LEAST and len(curves) < RUNGS:
        curves.append(_spline(time, angle, tried))
        left.append(float(np.std(angle - curves[-1](time))))
        if len(curves) > 1:
            between.append(_apart(curves[-2], curves[-1], time))
            # noise decreases from step to step; where difference and residual grow, the curve misses the motion
            if between[-1][1] > GROWN * min(speed for _, speed in between) and left[-1] > GROWN * left[0]:
                between.pop()
                break
        tried *= 2
    if not between:
        curve = curves[0] if curves else _spline(time, angle, max(len(time) // 4, 1))
        return Steady(Curve(curve, waves), usual(reading.sigma), usual(reading.sigma) / SHORTEST, 1.0, size)
    best = int(np.argmin([speed for _, speed in between]))
    speed = between[best][1]
    sigma = min(one for one, _ in between[max(best - 1, 0) : best + 1])  # the coarser curve may miss a part
    angle = angle - 0.5 * within * curves[best](time, 2)  # the mean of a curved path deviates from the path
    curve = _spline(time, angle, KNOT * 2**best)
    off = float(np.std(angle - curve(time)))
    expected = usual(reading.sigma) / np.sqrt(size)
    rest = max(off / max(expected, 1e-300), 0.0)
    sigma, speed = float(np.hypot(sigma, waves.sigma)), float(np.hypot(speed, waves.speed_sigma))
    return Steady(Curve(curve, waves), sigma, speed, rest, size, best == 0)


def redrawn(reading: Reading, before: Steady) -> Curve:
    """Return the curve through other readings of the same motion, with the same stiffness.

    >>> from gears3d.measured.encoder import read_encoder
    >>> time = np.arange(0.0, 2.0, 1e-4)
    >>> one, other = (read_encoder(time, np.floor(3.0 * time / 1e-4 + more) * 1e-4) for more in (0.0, 0.4))
    >>> bool(abs(redrawn(other, steady(one))(1.0) - steady(other).curve(1.0)) < 1e-5)
    True
    """
    waves, spline = before.curve.waves, before.curve.spline
    time, angle, within = _spline_means(reading, before.size, waves)
    step = len(time) / max(len(spline.t) - 7, 1)
    step = KNOT * 2 ** max(int(np.round(np.log2(step / KNOT))), 0)
    return Curve(_spline(time, angle - 0.5 * within * spline(time, 2), step), waves)


class Smoothing:
    """The linear map from an encoder's readings to a curve of known stiffness: harmonics and a spline by least squares.

    Args:
        reading: of the encoder.
        before: curve whose harmonics and knots are used.

    Attributes:
        time: at which values are given: of readings, a few in each mean [s], (n,).
    """

    def __init__(self, reading: Reading, before: Steady) -> None:
        from scipy.interpolate import BSpline
        from scipy.linalg import cholesky_banded

        step = max(before.size // MEANT, 1)
        self.time, self._knots, self._turns = reading.time[::step], before.curve.spline.t, before.curve.waves.turns
        self._reading = reading._replace(time=self.time, shown=self.time, lift=0.0)
        self._size = before.size // step
        self._time, _, self._within = _spline_means(self._reading, self._size, _waves(None))
        x = 2.0 * (self._time - self._time[0]) / np.ptp(self._time) - 1.0
        waves = [self._means(one(turn * self.time)) for one in (np.cos, np.sin) for turn in self._turns.tolist()]
        self._waves = np.array(waves).reshape(-1, len(x))
        table = np.vstack([self._waves, np.polynomial.legendre.legvander(x, DEGREE).T])
        self._inverse = np.linalg.pinv(table.T)[: len(self._waves)]
        self._basis = BSpline.design_matrix(self._time, self._knots, 3, extrapolate=True)  # half a mean at the ends
        normal = self._basis.T @ self._basis
        bands = np.array([np.append(normal.diagonal(-k), np.zeros(k)) for k in range(4)])
        bands[0] += 1e-12 * bands[0].max()  # spans without a reading
        self._root = cholesky_banded(bands, lower=True)

    def _means(self, values: Array) -> Array:
        return _spline_means(self._reading._replace(shown=values), self._size, _waves(None))[1]

    def _through(self, means: Array) -> BSpline:
        from scipy.interpolate import BSpline
        from scipy.linalg import cho_solve_banded

        return BSpline(self._knots, cho_solve_banded((self._root, True), self._basis.T @ means), 3)

    def __call__(self, values: Array) -> Callable[[Array, int], Array]:
        """Return the curve through values, (n,), as a function of time and of its derivative's order.

        >>> from gears3d.measured.encoder import read_encoder
        >>> time = np.arange(0.0, 2.0, 1e-3)
        >>> reading = read_encoder(time, 3.0 * time + 0.01 * np.sin(20.0 * time))
        >>> smoothing = Smoothing(reading, steady(reading))
        >>> through = smoothing(np.exp(20j * smoothing.time))
        >>> bool(abs(through(np.array([1.0]), 1)[0] - 20j * np.exp(20j)) < 1e-3)
        True
        """
        means = self._means(values)
        sizes = self._inverse @ means
        rest = means - sizes @ self._waves
        spline = self._through(rest - 0.5 * self._within * self._through(rest)(self._time, 2))
        cosines, sines = np.split(sizes, 2)

        def at(time: Array, order: int) -> Array:
            made = spline(time, order)
            for turn, a, b in zip(self._turns.tolist(), cosines.tolist(), sines.tolist(), strict=True):
                phase = turn * time + 0.5 * pi * order
                made = made + turn**order * (a * np.cos(phase) + b * np.sin(phase))
            return made

        return at


def _spline_means(reading: Reading, size: int, waves: _Waves) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return means over so many readings without their harmonics, and the variance of time in each [s²]."""
    count = len(reading.time) // size
    time, angle, within = np.zeros(count), np.zeros(count, reading.shown.dtype), np.zeros(count)
    for first in range(0, count, AT_ONCE):
        last = min(first + AT_ONCE, count)
        rows = reading.time[first * size : last * size].reshape(last - first, size)
        time[first:last], within[first:last] = rows.mean(axis=1), rows.var(axis=1)
        shown = reading.shown[first * size : last * size].reshape(last - first, size)
        angle[first:last] = (shown - waves.at(rows) if len(waves.turns) else shown).mean(axis=1)
    if count * size < len(reading.time):
        time = np.append(time, reading.time[-1])
        angle = np.append(angle, reading.shown[-1] - waves.at(reading.time[-1]))
        within = np.append(within, 0.0)
    time = np.insert(time, 0, reading.time[0])
    angle = np.insert(angle, 0, reading.shown[0] - waves.at(reading.time[0]))
    within = np.insert(within, 0, 0.0)
    rises = np.append(True, np.diff(time) > 0.0)
    return time[rises], angle[rises] + reading.lift, within[rises]


def _spline(time: np.ndarray, angle: np.ndarray, step: int) -> BSpline:
    """Return the cubic spline by least squares with a knot at every so manieth mean."""
    from scipy.interpolate import BSpline, LSQUnivariateSpline

    # make_lsq_spline looks through all knots for every mean, which is quadratic
    inner = time[step : len(time) - max(step // 2, 1) : step]
    knots = np.concatenate([np.repeat(time[0], 4), inner, np.repeat(time[-1], 4)])
    base = np.polynomial.Polynomial.fit(time, angle, 1)
    fitted = LSQUnivariateSpline(time, angle - base(time), inner, check_finite=False).get_coeffs()
    line = base((knots[1:-3] + knots[2:-2] + knots[3:-1]) / 3.0)  # a straight line's own coefficients
    return BSpline(knots, fitted + line, 3)


def _apart(fine: BSpline, coarse: BSpline, time: np.ndarray) -> tuple[float, float]:
    """Return by how much two curves differ: root mean squares of the angle [rad] and of the speed [rad/s]."""
    some = time[:: max(len(time) // 20_000, 1)]
    inner = some[len(some) // 50 : len(some) - len(some) // 50]
    place = fine(inner) - coarse(inner)
    speed = fine(inner, 1) - coarse(inner, 1)
    return float(np.sqrt(np.mean(place**2))), float(np.sqrt(np.mean(speed**2)))
