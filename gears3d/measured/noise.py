"""Noise of an encoder, estimated from its record: white and 1/f noise, quantisation, interpolation error, jitter."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from gears3d.signals import quantum as quantum_of
from gears3d.signals import robust_deviation
from gears3d.signals.orders import deviations, harmonics, phasors_of, sums

# Stretches of a long record that are examined, and the readings in each: a minute at 20 kHz.
STRETCHES, STRETCH = 16, 1 << 16
# Parts of the record, the scatter of which gives the standard deviations of the estimates (jackknife).
PARTS = 8
# Third differences below which a time scale gives no variance: its relative error would be 25 %.
FEWEST = 40
# Part of the third differences that are smaller than the quantile by which their variance is measured: impacts bend the
# path in less than 75 % of the windows, up to a window of a flight's length.
SHARE = 0.25
# Growth of the Hadamard deviation by doubling the time from which on it is motion: random walk has 1.4, motion 8.
STEEP = 3.0
# p-value of the strongest of all orders below which an interpolation error is corrected.
CHANCE = 1e-6
# Lowest order of a line [1/rev]: lower ones may be teeth, run-out or motion.
LOWEST = 100
# Highest order that is looked for, as 36 000 lines are the most that rotary encoders have; bins in a wave of it.
HIGHEST, BINS = 1 << 17, 8
# Readings of the moving cubic that removes the motion: impacts bend it over a millisecond at 30 kHz.
SMOOTHED = 31
# Readings in a period of a wave that the moving cubic passes with more than 75 % of its amplitude.
PASSED = (2.2, 11.0)
# Neighbours that are averaged, so that waves of up to 700 readings are passed.
RATES = (1, 4, 16, 64)
# Deviations beyond which a residual is an impact, not noise.
OUTLIER = 8.0
# Quantiles of the speed between which an aliased order must not look like motion.
SWEEP = (0.05, 0.95)
# Power over that of the strongest order from which a lower order may be the one of which it is an alias.
SAME = 0.8
# Power of another order over the strongest above which both are motion: 0.63 to 26 where no encoder had an error, up to
# 0.39 where it had (space, ten of 1382 to 1448).
OTHERS = 0.5
# Orders of an interpolation error in lines: offset and gain make once and twice, distortion and large errors more.
HARMONICS = (1, 2, 3, 4)
# Part of a wave by which it may be weaker in calm windows, an effect of their selection.
ALIKE = 0.3
# p-value of the difference of a wave between both halves of a record below which it is not permanent.
AGREE = 1e-3
# Lines of the spectrum (one over the revolutions) within which two orders are one, and multiples of the fluctuation to
# either side of an order that show how strong the motion is there.
LINE, BESIDE = 2.0, 5
# Periods of the fluctuation after which rattling motion may repeat; one that repeats after four made a line of 107 per
# revolution (space, 1138).
SUBHARMONICS = (1, 2, 3, 4)
# Amplitude over white noise below which an interpolation error is not corrected: it adds 0.5 % to chi-square.
SLIGHT = 0.1
# Searches of each band: removal of a strong wave reveals weaker ones.
PASSES = 2
# Part of the strongest order's amplitude below which another one may be a side band of it.
FAINT = 0.005
# Largest slope of an interpolation error over the angle, that of 5 % of its period (2·pi·0.05); typical errors are
# 0.1 to 1 % of a line. Larger waves are motion or rounding.
STEEPEST = 0.3
# Part of the changes that must come after the same number of repeated readings, for an update rate to be stated.
HELD_SHARE = 0.6
# Counts per sample from which a repeated reading is not an update.
SWEPT = 2.0
# Readings before and after one whose mean step is the speed there.
AROUND = 4
# Times that a reading must come twice for each one that comes next to it, to be repeated by the acquisition: chance
# makes it half as often.
REPEATS = 3.0
# Readings of which the last repeats the one before, at most, and the part of these that must, for a regular update.
RAREST, REGULAR = 64, 0.98
# Least ratio of the change after a repeated reading and the others where these are of about one count: it is 2 of a
# missed update, 1 of a gear whose counts keep step with the samples.
CAUGHT_UP = 1.5
# Standard deviations that flicker, random walk and jitter must differ from zero by to be applied.
SURE = 3.0


class Periodic(NamedTuple):
    """An error of the angle, periodic in the angle itself: amplitude·cos(order·θ + phase).

    Args:
        order: periods in a revolution.
        amplitude: [rad].
        sigma: standard deviation of the amplitude [rad].
        phase: [rad].
        chance: that noise alone makes an order as strong.
    """

    order: int
    amplitude: float
    sigma: float
    phase: float
    chance: float

    def at(self, angle: np.ndarray) -> np.ndarray:
        """Return the error at angles [rad], (n,)."""
        return self.amplitude * np.cos(self.order * angle + self.phase)


class Held(NamedTuple):
    """Readings that repeat the one before although the gear turns.

    Args:
        samples: samples from update to update; 1 where every sample is new.
        share: part of the samples that repeat the one before.
        rate: of updates [Hz].
    """

    samples: int = 1
    share: float = 0.0
    rate: float = np.inf


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """Noise of the angle that one encoder shows, as its own record shows it.

    The power spectral density is 2·white²·spacing + flicker²/f + walk²/(2π²f²), one-sided, f from 1/span on.
    Theory: docs/theory/measuring.md, equations (2), (3).

    Args:
        white: standard deviation of one reading, rounding to counts and jitter included [rad].
        quantum: angle of a count [rad]; 0 for a smooth record.
        flicker: root of the power of 1/f noise per unit of ln f [rad].
        walk: standard deviation that a random walk gains in a second [rad/√s].
        periodic: interpolation errors that are significant.
        jitter: standard deviation of the sampling instants [s].
        held: repeated readings.
        spacing: usual time between two readings [s].
        span: duration of the record [s].
        sigmas: standard deviations of ``white``, ``flicker``, ``walk`` and ``jitter``.
    """

    white: float
    quantum: float
    flicker: float
    walk: float
    periodic: tuple[Periodic, ...]
    jitter: float
    held: Held
    spacing: float
    span: float
    sigmas: dict[str, float]

    def sigma(self, duration: float | np.ndarray) -> float | np.ndarray:
        """Return the standard deviation of a mean over a duration about the mean of the record [rad].

        ``duration``: [s], at least one reading.
        """
        lasts = np.maximum(duration, self.spacing)
        wide = np.log(np.maximum(self.span / lasts, 1.0))
        # 1/f noise: ∫ sin²x/x³ dx from πT/span on is ln(span/T) − 0.915, and never less than its share within one T
        slow = self.flicker**2 * np.maximum(wide - 0.915, 0.1) + self.walk**2 * self.span / 6.0
        return np.sqrt(self.white**2 * self.spacing / lasts + slow)

    def deviation(self, lag: float | np.ndarray) -> float | np.ndarray:
        """Return the standard deviation of the difference of two readings [rad].

        ``lag``: time between them [s].
        """
        apart = np.maximum(lag, self.spacing)
        slow = 2.0 * self.flicker**2 * (np.log(np.pi * apart / self.spacing) + np.euler_gamma) + self.walk**2 * apart
        return np.sqrt(2.0 * self.white**2 + slow)

    def colour(self, duration: np.ndarray, mode: np.ndarray | float) -> np.ndarray:
        """Return the power of noise at half-waves in a duration, in units of the white noise's.

        A fit to a flight of that duration has residuals in the half-waves from 3 on, and uncertainties of its place,
        speed and deceleration by those from 0 to 2.

        ``duration``: [s], (k,).
        """
        frequency = 0.5 * np.asarray(mode) / np.maximum(duration, self.spacing)
        coloured = self.flicker**2 / frequency + self.walk**2 / (2.0 * np.pi**2 * frequency**2)
        return 1.0 + coloured / max(2.0 * self.white**2 * self.spacing, 1e-300)

    def corrected(self, angle: np.ndarray) -> np.ndarray:
        """Return angles without the interpolation errors [rad], (n,).

        ``angle``: as the encoder shows it [rad], (n,).
        """
        if not self.periodic:
            return angle
        return angle - sum(one.at(angle) for one in self.periodic)

    def describe(self) -> dict[str, Any]:
        """Return the model as JSON can hold it."""
        sizes = {name: self._stated(name) for name in ("white", "flicker", "walk", "jitter")}
        units = {"white": "rad", "flicker": "rad", "walk": "rad_per_root_s", "jitter": "s"}
        return {
            **{f"{name}_{units[name]}": stated for name, stated in sizes.items()},
            "quantum_rad": self.quantum or None,
            "interpolation": [
                {"order": one.order, "amplitude_rad": one.amplitude,
                 "ci95": [max(one.amplitude - 1.96 * one.sigma, 0.0), one.amplitude + 1.96 * one.sigma]}
                for one in self.periodic
            ],
            "held_samples": self.held.samples,
            "repeated_share": self.held.share,
        }  # fmt: skip

    def _stated(self, name: str) -> dict[str, Any]:
        value, sigma = getattr(self, name), self.sigmas.get(name, np.nan)
        if not np.isfinite(sigma):
            return {"value": value, "ci95": None}
        return {"value": value, "ci95": [max(value - 1.96 * sigma, 0.0), value + 1.96 * sigma]}


_UNSTATED = {"white": np.nan, "flicker": np.nan, "walk": np.nan, "jitter": np.nan}
# White noise of unknown size, for readings that state their own standard deviation.
NOT_KNOWN = NoiseModel(0.0, 0.0, 0.0, 0.0, (), 0.0, Held(), 0.0, 0.0, _UNSTATED)


def estimate_noise(
    time: np.ndarray,
    angle: np.ndarray,
    white: float | None = None,
    lines: tuple[int, ...] = (),
    edges: bool = False,
    fluctuation: float | None = None,
    count: float | None = None,
) -> NoiseModel:
    """Return the noise of an encoder's angle, estimated from a record of the moving gear.

    White noise, 1/f noise and random walk follow from the modified Hadamard deviation (third differences of means over
    times from one reading on): in free flight and in smooth motion third differences vanish but for the noise. What
    grows faster than a random walk is motion. Interpolation errors are harmonics of integer order in the angle itself.

    ``time``: of the readings [s], rising, (n,); ``angle``: [rad], (n,); ``white``: standard deviation of a reading
    where it is known [rad]; else it is measured; ``count``: of the encoder, where it is known [rad]: on whole counts, N
    in a revolution, the orders N - 2 and N + 2 have the values of order 2. Returns the model.

    Source: Riley 2008 (NIST SP 1065), 5.2.9 Hadamard variance; Heydemann 1981 (Appl. Opt. 20, 3382).
    Theory: docs/theory/measuring.md.

    >>> time, rng = np.arange(200_000) * 1e-4, np.random.default_rng(1)
    >>> found = estimate_noise(time, 3.0 * time + rng.normal(0.0, 1e-5, len(time)))
    >>> round(found.white, 6), found.flicker < 1e-6, found.periodic
    (1e-05, True, ())
    """
    spacing = float(np.median(np.diff(time[: 4 * STRETCH])))
    span = float(time[-1] - time[0])
    held = held_readings(time, angle)
    count = 0.0 if edges else count or quantum_of(angle) or 0.0
    pieces = _pieces(time, angle, edges)
    turns = abs(float(angle[-1] - angle[0])) / (2.0 * np.pi)
    motion = _Motion(fluctuation, turns) if fluctuation and turns > 0.0 else None
    periodic = _periodic(pieces, lines, count, edges, motion)
    if periodic:
        pieces = [(at, shown - sum(one.at(shown) for one in periodic)) for at, shown in pieces]
    residuals = [_residual(*piece, edges) for piece in pieces]
    floor = 2e-16 * max(float(np.abs(angle[:: max(len(angle) // 1000, 1)]).max()), 1.0)  # rounding of the numbers
    (known, flicker, walk), slack = _slow(pieces, _white(residuals), white, spacing)
    known = max(float(known), floor)
    jitter, spread = _jitter(pieces, residuals, spacing) if not count else (0.0, np.nan)
    sigmas = {"white": float(slack[0]), "flicker": float(slack[1]), "walk": float(slack[2]), "jitter": spread}
    return NoiseModel(known, count, float(flicker), float(walk), periodic, jitter, held, spacing, span, sigmas)


def combined(one: NoiseModel, other: NoiseModel, radii: tuple[float, float]) -> NoiseModel:
    """Return the noise of the displacement along the line of action, lengths in m in place of angles.

    ``radii``: base radii of drive and loose gear [m].
    """

    def sum_of(name: str) -> float:
        return float(np.hypot(radii[0] * getattr(one, name), radii[1] * getattr(other, name)))

    sigmas = {
        name: float(np.hypot(radii[0] * one.sigmas[name], radii[1] * other.sigmas[name]))
        for name in ("white", "flicker", "walk")
    }
    return replace(other, white=sum_of("white"), quantum=sum_of("quantum"), flicker=sum_of("flicker"),
                   walk=sum_of("walk"), periodic=(), sigmas=sigmas | {"jitter": np.nan})  # fmt: skip


def without_repeats(time: np.ndarray, angle: np.ndarray, count: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Return readings without those that only repeat the one before: held readings and occasional repeats.

    Those of a regular update are removed alone: others are equal by chance, and their absence would be an error.

    ``time``: of the samples [s], (n,); ``angle``: [rad], (n,); ``count``: of the encoder [rad]; ``None`` for a smooth
    record.
    """
    if (kept := _updated(angle, count or 0.0)) is not None:
        return time[kept], angle[kept]
    held = held_readings(time, angle).samples > 1
    if held or _twice(angle, count or 0.0):
        fresh = np.append(True, angle[1:] != angle[:-1])
        if not held:  # a gear that stands between two counts repeats its reading
            again = np.flatnonzero(~fresh)
            fresh[again] = _pace(angle, again) < (count or 0.0)
        return time[fresh], angle[fresh]
    return time, angle


def _updated(angle: np.ndarray, count: float) -> np.ndarray | None:
    """Return which readings are new where every so many-th one repeats the one before, (n,); ``None`` elsewhere.

    Those of a slow gear on a counter repeat as well; there changes are of one count, also the one after a repeat.
    """
    change = np.abs(np.diff(angle[:STRETCH], prepend=angle[0]))
    if not np.any(change):
        return None
    slow = np.median(change[change > 0.0]) < 1.5 * count
    same = np.append(False, angle[1:] == angle[:-1])
    for every in range(3 if slow else 2, min(RAREST, len(angle) // FEWEST) + 1):
        whole = len(change) // every * every
        share = same[:whole].reshape(-1, every).mean(axis=0)
        at = int(np.argmax(share))
        if share[at] > REGULAR and np.mean(same[at::every]) > REGULAR and np.max(np.delete(share, at)) < HELD_SHARE:
            mean, after = change[:whole].reshape(-1, every).mean(axis=0), (at + 1) % every
            if slow and mean[after] < CAUGHT_UP * np.mean(np.delete(mean, [at, after])):
                continue
            same[np.arange(len(same)) % every != at] = False
            return ~same
    return None


def _twice(angle: np.ndarray, count: float) -> bool:
    """Return whether readings repeat by more than chance where a gear passes several counts in a sample."""
    some = angle[: STRETCHES * STRETCH]
    step = np.abs(np.diff(some))[_pace(some, np.arange(1, len(some))) > SWEPT * count]
    none, next_ = float(np.sum(step == 0.0)), float(np.sum((step > 0.0) & (step < 1.5 * count)))
    return none > REPEATS * (next_ + 1.0)


def _pace(angle: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the mean step of the readings around some, by their numbers [rad]."""
    low, high = np.maximum(at - AROUND, 0), np.minimum(at + AROUND, len(angle) - 1)
    return np.abs(angle[high] - angle[low]) / (high - low)


def held_readings(time: np.ndarray, angle: np.ndarray) -> Held:
    """Return how many samples repeat the one before, and after how many samples the reading changes.

    A slow gear on a counter repeats its readings, too; there changes are of one count, those of a held reading of more.

    ``time``: of the samples [s], (n,); ``angle``: [rad], (n,).

    >>> time = np.arange(4000) * 1e-3
    >>> found = held_readings(time, np.repeat(time[::4] ** 1.1, 4))
    >>> found.samples, round(found.share, 2), round(found.rate)
    (4, 0.75, 250)
    """
    some = slice(0, STRETCHES * STRETCH)
    change = np.diff(angle[some])
    moved = np.flatnonzero(change != 0.0)
    if len(moved) < FEWEST or len(moved) > 0.9999 * len(change):
        return Held()
    share = 1.0 - len(moved) / len(change)
    count = quantum_of(angle[some])
    if count is not None and np.median(np.abs(change[moved])) < 1.5 * count:
        return Held()
    lasts = np.diff(moved)
    usual = int(np.median(lasts))
    regular = usual > 1 and float(np.mean(np.abs(lasts - usual) <= 1)) > HELD_SHARE
    if not regular:
        return Held(1, share, float(len(moved) / (time[some][-1] - time[0])))
    spacing = float(np.median(np.diff(time[some])))
    return Held(usual, share, 1.0 / (float(np.mean(lasts)) * spacing))


def _pieces(time: np.ndarray, angle: np.ndarray, edges: bool) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return representative stretches of the record, the whole of a short one in ``PARTS``."""
    count = len(time)
    if count <= STRETCHES * STRETCH:
        cuts = np.linspace(0, count, PARTS + 1).astype(int)
        spans = list(pairwise(cuts.tolist()))
    else:
        spans = [(first, first + STRETCH) for first in np.linspace(0, count - STRETCH, STRETCHES).astype(int)]
    return [_even(time[a:b], np.asarray(angle[a:b], float), edges) for a, b in spans if b - a > SMOOTHED]


def _even(time: np.ndarray, angle: np.ndarray, edges: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return readings with those that are missing filled in by straight lines, which edges have none of."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    if edges or steps.max() < 1.5 * usual:
        return time, angle
    at = time[0] + usual * np.arange(int((time[-1] - time[0]) / usual) + 1)
    return at, np.interp(at, time, angle)


class _Smoother(NamedTuple):
    """Value minus moving cubic: weights, standard deviation that they give white noise, and that of other noise."""

    weights: np.ndarray
    norm: float
    flicker: float
    walk: float


@lru_cache(maxsize=1)
def _smoother() -> _Smoother:
    """Return the high-pass filter; its variances of 1/f noise and random walk are over that of white noise."""
    at = np.arange(SMOOTHED) - SMOOTHED // 2
    weights = -np.linalg.pinv(np.vander(at / SMOOTHED, 4))[3]
    weights[SMOOTHED // 2] += 1.0
    norm = float(np.linalg.norm(weights))
    f = (np.arange(5000) + 0.5) * 1e-4  # cycles in a reading
    gain = np.square((weights * np.cos(2 * np.pi * f[:, None] * at)).sum(axis=1)) / norm**2
    return _Smoother(weights, norm, float(np.sum(gain / f) * 1e-4), float(np.sum(gain / (2 * np.pi**2 * f**2)) * 1e-4))


def _highpassed(values: np.ndarray) -> np.ndarray:
    from scipy.signal import fftconvolve

    middle = values - np.linspace(values[0], values[-1], len(values))  # rounding of the transform stays small
    return fftconvolve(middle, _smoother().weights[::-1], "valid")


def _residual(time: np.ndarray, angle: np.ndarray, edges: bool) -> np.ndarray:
    """Return the residual of the angle about a moving cubic [rad]; of edges, exact in angle, from their moments."""
    if not edges:
        return _highpassed(angle)
    reach = SMOOTHED // 2
    speed = np.gradient(angle, time)[reach : len(time) - reach]
    return -_highpassed(time) * np.median(np.abs(speed)) * np.sign(speed)


def _clipped(rest: np.ndarray) -> np.ndarray:
    """Return the residuals, impacts cut down to what noise may be."""
    limit = OUTLIER * robust_deviation(rest)
    return np.clip(rest, -limit, limit) if limit > 0.0 else rest


def _white(residuals: list[np.ndarray]) -> tuple[float, float]:
    """Return the standard deviation of a reading, and of that, by the scatter of the stretches."""
    norm = _smoother().norm
    each = np.array([robust_deviation(rest) / norm for rest in residuals])
    if not len(each):
        return 0.0, np.nan
    mean = float(np.sqrt(np.median(each**2)))
    return mean, 1.2533 * float(np.std(each)) / np.sqrt(max(len(each) - 1, 1)) + 1.2 * mean / np.sqrt(
        sum(map(len, residuals))
    )


@lru_cache(maxsize=1)
def _shares() -> tuple[float, float]:
    """Return the variance of third differences of means for 1/f noise of unit flicker, and for a walk of unit Wτ."""
    from scipy.integrate import quad

    flicker = quad(lambda x: 64.0 * np.sin(x) ** 8 / x**3, 0.0, 200.0, limit=2000)[0]
    walk = 32.0 / np.pi * quad(lambda x: np.sin(x) ** 8 / x**4, 0.0, 200.0, limit=2000)[0]
    return float(flicker), float(walk)


def _slow(
    pieces: list[tuple[np.ndarray, np.ndarray]], near: tuple[float, float], white: float | None, spacing: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return white noise [rad], flicker [rad] and random walk [rad/√s], 0 where not significant, and their deviations.

    All three contribute to the residual of a moving cubic (``near``: its standard deviation and that of it) and to the
    variances of longer means.
    """
    from scipy.optimize import nnls

    ladder, table = _ladder(pieces, spacing)
    one, other = _shares()
    short = _smoother()
    columns = np.column_stack([20.0 / ladder, np.full(len(ladder), one), other * ladder * spacing,
                               (ladder / max(ladder.max(initial=1.0), 1.0)) ** 6])  # fmt: skip
    columns = np.vstack([[1.0, short.flicker, short.walk * spacing, 0.0], columns])
    size = columns.max(axis=0)
    free = np.ones(4, bool)
    free[0] = white is None
    least = (0.0 if white is None else white) ** 2

    def fitted(rows: np.ndarray, skip: int) -> np.ndarray:
        seen = np.append(near[0] ** 2, np.nanmedian(rows, axis=0))
        seen = seen - least * columns[:, 0]
        scale = max(float(np.abs(seen).max()), 1e-300)
        weight = scale / np.maximum(np.abs(seen), 0.3 * (least or near[0] ** 2) * columns[:, 0] + 1e-300)
        part = slice(skip, None)
        made = np.zeros(4)
        made[free] = nnls((columns / size)[part, free] * weight[part, None], seen[part] / scale * weight[part])[0]
        return made * scale / size

    # the largest flicker that the variances permit: motion is in them as well, and white noise
    most = float(np.sqrt(np.nanmedian(table, axis=0).min() / one)) if len(ladder) else np.nan
    if len(ladder) < 3:
        known = near[0] if white is None else white
        return np.array([known, 0.0, 0.0]), np.array([near[1], 0.5 * most, np.nan])
    skip = 0 if white is None else 1
    whole = fitted(table, skip)
    each = np.array([fitted(np.delete(table, k, axis=0), skip) for k in range(len(table))])
    number = len(each)
    variances = whole[:3]
    sigma = np.sqrt((number - 1) / number * np.sum((each - each.mean(axis=0)) ** 2, axis=0))[:3]
    sigma[1:] = np.hypot(sigma[1:], np.sqrt(2.0 / (PARTS * FEWEST)) * variances[1:])  # the longest means alone
    sure = variances > SURE * sigma
    values = np.where(sure, np.sqrt(variances), 0.0)
    spreads = np.where(sure, sigma / np.maximum(2.0 * values, 1e-300), 0.5 * np.sqrt(variances + 2.0 * sigma))
    if not sure[1]:  # motion may take its place
        spreads[1] = max(spreads[1], 0.5 * most)
    values[0], spreads[0] = np.sqrt(variances[0] + least), np.hypot(spreads[0], near[1])
    return values, spreads


def _ladder(pieces: list[tuple[np.ndarray, np.ndarray]], spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Return how many readings are averaged, and the Hadamard variances of the stretches [rad²], (PARTS, m).

    Readings that are not evenly spaced are interpolated first.
    """
    from scipy.stats import norm

    quantile = float(norm.ppf(0.5 + 0.5 * SHARE))
    even = []
    for time, angle in pieces:
        steps = np.diff(time)
        if np.ptp(steps) > 0.02 * spacing:
            at = np.arange(time[0], time[-1], spacing)
            angle = np.interp(at, time, angle)
        even.append(np.cumsum(np.insert(angle - angle[0], 0, 0.0)))
    sizes, rows, before = [], [], np.inf
    size = 4  # below, white noise is all, and what interpolation does to it
    while size * (FEWEST + 4) < min(map(len, even), default=0) * 4:
        row = []
        for total in even:
            step = max(size // 4, 1)
            at = np.arange(0, len(total) - 4 * size, step)
            if len(at) < FEWEST:
                row.append(np.nan)
                continue
            means = [(total[at + (k + 1) * size] - total[at + k * size]) / size for k in range(4)]
            third = means[3] - 3.0 * means[2] + 3.0 * means[1] - means[0]
            row.append((float(np.quantile(np.abs(third), SHARE)) / quantile) ** 2)
        usual = float(np.nanmedian(row)) if np.isfinite(row).any() else np.nan
        if not np.isfinite(usual) or usual > STEEP**2 * before:
            break
        sizes.append(size)
        rows.append(row)
        before = usual
        size *= 2
    return np.array(sizes, float), np.array(rows).T


def _jitter(
    pieces: list[tuple[np.ndarray, np.ndarray]], residuals: list[np.ndarray], spacing: float
) -> tuple[float, float]:
    """Return the standard deviation of sampling instants [s], 0 unless noise grows with speed, and its deviation."""
    norm = _smoother().norm
    reach, squares, powers = SMOOTHED // 2, [], []
    for (time, angle), rest in zip(pieces, residuals, strict=True):
        speed = np.gradient(angle, time)[reach : len(time) - reach]
        rest = _clipped(rest)
        count = len(rest) // SMOOTHED
        means = [row[: count * SMOOTHED].reshape(count, SMOOTHED).mean(axis=1) for row in (speed, rest**2)]
        squares.append(means[0] ** 2)
        powers.append(means[1] / norm**2)
    square, power = np.concatenate([*squares, []]), np.concatenate([*powers, []])
    if len(square) < FEWEST or np.std(square) <= 0.05 * np.mean(square):
        return 0.0, np.nan  # one speed: jitter is white noise
    off = square - square.mean()
    slope = float(off @ power / (off @ off))
    rest = power - power.mean() - slope * off
    sigma = float(np.sqrt(rest @ rest / len(rest) / (off @ off)))
    if slope < SURE * sigma:
        return 0.0, float(np.sqrt(max(slope, 0.0) + 2.0 * sigma)) / 2.0
    return float(np.sqrt(slope)), float(sigma / (2.0 * np.sqrt(slope)))


class _Motion(NamedTuple):
    """The lines that a periodic motion has over the angle.

    Args:
        order: of the fluctuation, periods in a revolution.
        turns: revolutions in the record.
    """

    order: float
    turns: float

    def makes(self, order: int, angle: np.ndarray, rest: np.ndarray) -> bool:
        """Return whether a line of the residual may belong to the motion, whose impacts have lines at all multiples.

        A motion that repeats after several periods has lines between these as well.

        ``angle``: at the residuals [rad], (n,); ``rest``: residuals [rad], (n,).
        """
        return any(self._makes(order, self.order / periods, angle, rest) for periods in SUBHARMONICS)

    def _makes(self, order: int, first: float, angle: np.ndarray, rest: np.ndarray) -> bool:
        """Return the same of multiples of a first order: whether its power is that of its neighbours."""
        number = round(order / first)
        if number < 1 or abs(order - number * first) * self.turns > LINE:
            return False
        beside = (number + np.array([*range(-BESIDE, 0), *range(1, BESIDE + 1)])) * first
        powers = [float(np.abs(rest @ np.exp(-1j * one * angle))) ** 2 for one in (order, *beside[beside > 0.0])]
        level = float(np.median(powers[1:])) / np.log(2.0)  # their phases are as good as random
        return powers[0] < level * np.log(1.0 / CHANCE)


def _periodic(
    pieces: list[tuple[np.ndarray, np.ndarray]],
    lines: tuple[int, ...],
    count: float,
    edges: bool,
    motion: _Motion | None,
) -> tuple[Periodic, ...]:
    """Return the interpolation errors that exceed the noise of their neighbouring orders, and their harmonics.

    The moving cubic passes waves of few readings only; slower ones are looked for in means over neighbours.
    """
    found: dict[int, Periodic] = {}
    white = np.inf  # of the fastest readings: means over neighbours deviate by motion as well
    for factor in RATES:
        for _ in range(PASSES):
            if not (long := [piece for piece in pieces if len(piece[0]) > 2 * SMOOTHED * factor]):
                break
            rest = np.concatenate([_clipped(_residual(*_thinned(piece, factor), edges)) for piece in long])
            white = min(white, robust_deviation(rest) / _smoother().norm * np.sqrt(factor))
            more = _in_band(long, factor, rest, SLIGHT * white, lines, count, edges, motion)
            more = [one for one in more if one.order not in found]
            if not more:
                break
            found |= {one.order: one for one in more}
            pieces = [(time, shown - sum(one.at(shown) for one in more)) for time, shown in pieces]
    return tuple(found[order] for order in sorted(found))


def _means(values: np.ndarray, size: int) -> np.ndarray:
    count = len(values) // size
    return values[: count * size].reshape(count, size).mean(axis=1) if size > 1 else values


def _thinned(piece: tuple[np.ndarray, np.ndarray], factor: int) -> tuple[np.ndarray, np.ndarray]:
    return _means(piece[0], factor), _means(piece[1], factor)


def _in_band(
    fine: list[tuple[np.ndarray, np.ndarray]],
    factor: int,
    rest: np.ndarray,
    least: float,
    lines: tuple[int, ...],
    count: float,
    edges: bool,
    motion: _Motion | None,
) -> tuple[Periodic, ...]:
    """Return the interpolation errors with periods of ``PASSED`` readings, of a least amplitude [rad]."""
    reach = SMOOTHED // 2
    angle = np.concatenate([_means(shown, factor)[reach : len(shown) // factor - reach] for _, shown in fine])
    step = float(np.median(np.abs(np.diff(angle))))
    lowest, highest = LOWEST, 0
    if step > 0.0 and np.any(rest):
        highest = HIGHEST  # those that pass faster than samples look like others, but not over the angle
        if factor > 1 or edges:
            highest = int(min(2 * np.pi / (PASSED[0] * step), HIGHEST))
        lowest = int(max(2 * np.pi / (PASSED[1] * step), LOWEST))
    per_turn = 2 * np.pi / count if count else np.inf
    highest = int(min(highest, 0.9 * per_turn))  # beyond, rounding to counts
    if highest < lowest + 2 or float(np.ptp(angle)) < 2 * np.pi / lowest:
        return ()
    power = np.abs(sums(angle, rest, highest, BINS)) ** 2 / max(len(rest), 1)
    floor = np.maximum(_floor(power), 1e-6 * float(np.mean(power)) + 1e-300)
    ratio = power / floor
    ratio[:lowest] = 0.0
    every, slow, fast = np.arange(len(ratio)), *np.quantile(np.abs(np.diff(angle[::SMOOTHED])) / SMOOTHED, SWEEP)
    folded = np.abs((every * step + np.pi) % (2 * np.pi) - np.pi)  # what samples make of each order, at the usual speed
    able = folded > 2 * np.pi / PASSED[1] + 0.5 * (fast - slow) * every
    able |= every * step * PASSED[0] < 2 * np.pi
    able &= every <= min(0.25 * per_turn, max(lines, default=np.inf))
    tried = highest - lowest
    chance = np.log(tried / CHANCE)
    best = int(np.argmax(np.where(able, ratio, 0.0)))
    if able[best] and ratio[best] > 0.0:  # else no order can be distinguished from those that look like it
        best = int(np.flatnonzero(able & (ratio > 0.0) & (power >= SAME * power[best]))[0])
    found, search = set(), not edges  # edges are known lines, and impacts between two of them have any order
    if ratio[best] > chance and search:
        family = {m * base for base in {best, best // 2, best // 4} for m in HARMONICS}
        mean = sum(abs(shown[-1] - shown[0]) for _, shown in fine) / sum(len(shown) - 1 for _, shown in fine) * factor
        if _stands_out(power, best, family, (mean or step, count), float(np.ptp(angle))):
            found = family
    found |= {m * line for line in lines for m in HARMONICS}
    known = np.log(max(len(lines) * len(HARMONICS), 1) / CHANCE) if lines else chance
    orders = sorted(order for order in found if lowest <= order <= highest and ratio[order] > min(known, chance))
    orders = [order for order in orders if motion is None or not motion.makes(order, angle, rest)]
    return _fitted(fine, factor, rest, orders, [float(np.exp(-ratio[order])) * tried for order in orders], floor, least)


def _stands_out(power: np.ndarray, best: int, family: set[int], steps: tuple[float, float], span: float) -> bool:
    """Return whether an order is stronger than all but its family.

    Samples and counts show an order as others too, and of the many lines of a motion some meet a whole order.

    ``power``: of each order, (n,); ``steps``: mean of the samples and count, 0 without [rad]; ``span``: of the record
    [rad].
    """

    def seen(orders: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rounded = _folded(orders, steps[1]) if steps[1] else orders
        return _folded(orders, steps[0]), _folded(rounded, steps[0])

    ways, own = seen(np.arange(len(power))), np.sort(np.concatenate(seen(np.array(sorted(family)))))
    others = ways[0] * steps[0] > 2.0 * np.pi / PASSED[1]  # slower waves are motion that the moving cubic left
    for one in ways:
        at = np.clip(np.searchsorted(own, one), 1, len(own) - 1)
        others &= np.minimum(np.abs(one - own[at - 1]), np.abs(one - own[at])) * span > LINE * 2.0 * np.pi
    return float(np.max(power, where=others, initial=0.0)) < OTHERS * power[best]


def _folded(orders: np.ndarray, step: float) -> np.ndarray:
    """Return the lowest orders with the same values at angles that are ``step`` apart [rad], (n,)."""
    return np.abs((orders * step + np.pi) % (2.0 * np.pi) - np.pi) / step


def _repeats(waves: np.ndarray, rest: np.ndarray) -> bool:
    """Return whether a wave is an error of the encoder: such errors are permanent, and as strong between impacts.

    Both halves of the residuals must agree in it, and the half of short windows with the least power with all of them.
    """
    size = 4 * SMOOTHED
    count = len(rest) // size
    if count < 4:
        return False
    power = np.square(rest[: count * size]).reshape(count, size).mean(axis=1)
    calm = np.repeat(power <= np.median(power), size)
    first = np.arange(count * size) < count * size // 2
    whole = np.ones(count * size, bool)
    for one, other in ((first, ~first), (calm, whole)):
        (mine, slack), (theirs, more) = (_wave(waves[:, : len(rows)][:, rows], rest[: len(rows)][rows])
                                         for rows in (one, other))  # fmt: skip
        apart = mine - theirs
        allowed = max(2.0 * np.log(1.0 / AGREE) * (slack + more), (ALIKE**2) * float(theirs @ theirs))
        if apart @ apart > allowed or mine @ mine < SURE**2 * slack:
            return False
    return True


def _wave(waves: np.ndarray, rest: np.ndarray) -> tuple[np.ndarray, float]:
    """Return cosine and sine of a wave in residuals, and their variance."""
    inverse = np.linalg.pinv(waves @ waves.T, hermitian=True)
    numbers = inverse @ (waves @ rest)
    left = rest - numbers @ waves
    return numbers, float(left @ left) / max(len(left), 1) * float(np.trace(inverse)) / 2.0


def _floor(power: np.ndarray) -> np.ndarray:
    """Return the mean power of neighbouring orders, peaks left out, (n,)."""
    from scipy.ndimage import median_filter

    return median_filter(power, size=201, mode="reflect") / np.log(2.0)  # the median of an exponential distribution


def _waves(pieces: list[tuple[np.ndarray, np.ndarray]], factor: int, orders: list[int]) -> Iterator[np.ndarray]:
    """Yield cosine and sine of each order in each piece, as means and filter leave them, (2p, n)."""
    for _, shown in pieces:
        yield np.stack([_highpassed(_means(wave, factor)) for wave in harmonics(shown, orders).T])


def _fitted(
    pieces: list[tuple[np.ndarray, np.ndarray]],
    factor: int,
    rest: np.ndarray,
    orders: list[int],
    chances: list[float],
    floor: np.ndarray,
    least: float,
) -> tuple[Periodic, ...]:
    """Return orders with amplitude and phase by least squares; waves pass the means and filter of the residuals."""
    if not orders:
        return ()
    normal, moment, first = np.zeros((2 * len(orders),) * 2), np.zeros(2 * len(orders)), 0
    for waves in _waves(pieces, factor, orders):  # all orders in all pieces at once are larger than the record's part
        normal += waves @ waves.T
        moment += waves @ rest[first : first + waves.shape[1]]
        first += waves.shape[1]
    inverse = np.linalg.pinv(normal, hermitian=True)
    phasors, spread, made = phasors_of(inverse @ moment), deviations(inverse), []
    strongest = float(np.max(np.abs(phasors)))
    for k, (order, chance) in enumerate(zip(orders, chances, strict=True)):
        sigma, size = float(spread[k] * np.sqrt(floor[order])), float(abs(phasors[k]))
        kept = size * order < STEEPEST and size > max(SURE * sigma, FAINT * strongest, least)
        if kept and _repeats(np.concatenate([*_waves(pieces, factor, [order])], axis=1), rest):
            made.append(Periodic(order, size, sigma, float(np.angle(phasors[k])), min(chance, 1.0)))
    return tuple(made)
