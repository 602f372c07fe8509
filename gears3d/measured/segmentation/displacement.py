"""The displacement of a record: what the encoders show, its noise, means over blocks, and its velocity jumps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.drive_motion import Steady, motion_of, steady
from gears3d.measured.encoder import FEWEST, Reading, model_noise, read_encoder, stuck, usual
from gears3d.measured.noise import NOT_KNOWN, NoiseModel, combined
from gears3d.signals import noise_of, robust_deviation, some_steps

# Longest block [s]: within it the drive's acceleration bends the path by less than 1 µm.
LONGEST = 1e-3
# Deviation, in noise, of means of the drive's readings from a smooth curve that replaces them.
FOLLOWS = 2.0
# Readings in means over which noise that both encoders share must fall as well when it is removed, and by how much it
# must fall in single readings: below that, the drive's own noise outweighs the gain.
SLOWER, SHARED = 32, 0.8
# Readings processed at a time.
AT_ONCE = 1 << 18
# Readings up to which the drive's angle is computed once and cached.
KEPT = 1 << 20
# Stretches of a long record that show its fluctuation, and the readings in each.
STRETCHES, STRETCH = 16, 1 << 16
# Part of the range of the displacement to which rigid flanks and flights describe it: 5 nm of 250 um.
DESCRIBED = 2e-5
# Cube of the blocks' width in units of noise, speed and spacing: 32 makes rounding and noise equal.
CORNER = 16.0
# Blocks to either side.
SCALES = (3, 6, 12, 24, 48)
# How many of these are used at first: longer ones detect weaker jumps and merge neighbours.
USUAL = 4
# Standard deviations of a jump from which on it is used to find flanks.
SURE = 7.0
# Standard deviations from which a longer reach is not used: it would merge neighbouring jumps.
PLAIN = 2.0 * SURE
# Part of its size that a jump keeps at half the reach, and again at half of that; a smooth curve keeps 1/8.
SHARP = 0.6
# Blocks from which on the scatter about the model is known to 25 %: eight degrees of freedom.
LEFT = 13
# Standard deviations by which noise may hide the jump at shorter reaches than half.
NOISY = 3.0


@dataclass(frozen=True, eq=False)
class Track:
    """Both gears at the readings of the loose gear: :meth:`part` computes a stretch of a long record.

    Args:
        time: [s], rising, (n,).
        shown: angle of the loose gear as its encoder shows it [rad], (n,).
        steady: the drive's motion as a curve.
        follows: whether that curve stands for the drive; else its readings do.
        sigma_loose: standard deviation of the loose gear's angle [rad], (n,).
        noise: standard deviation of one reading of ``place`` [m].
        slack: what counting may put ``place`` off by for many readings in a row [m]; 0 where noise dithers the counts.
        radii: base radii of drive and loose gear [m].
        readings: of the drive's and the loose gear's encoder.
        step: median distance of the record's samples [s].
        models: of the noise of the drive's and the loose gear's encoder [rad].
        shared: part of the drive's readings less its curve that is removed from the displacement, 0 or about 1.
    """

    time: np.ndarray
    shown: np.ndarray
    steady: Steady
    follows: bool
    sigma_loose: np.ndarray
    noise: float
    slack: float
    radii: tuple[float, float]
    readings: tuple[Reading, Reading]
    step: float
    models: tuple[NoiseModel, NoiseModel] = (NOT_KNOWN, NOT_KNOWN)
    shared: float = 0.0

    @cached_property
    def model(self) -> NoiseModel:
        """Noise of the displacement [m]."""
        return combined(*self.models, self.radii)

    @cached_property
    def drive(self) -> np.ndarray:
        """Angle of the drive gear [rad], (n,)."""
        return self._driven(slice(None))

    @cached_property
    def loose(self) -> np.ndarray:
        """Angle of the loose gear [rad], (n,)."""
        return self.shown + self.lift if self.lift else self.shown

    @cached_property
    def place(self) -> np.ndarray:
        """Displacement Rb2·θ_loose − Rb1·θ_drive [m] with an arbitrary offset, (n,)."""
        return self.part(slice(None))[2]

    @cached_property
    def blocks(self) -> Blocks:
        """Means over blocks, as :func:`blocks` has them."""
        return blocks(self)

    @cached_property
    def spacing(self) -> float:
        """Median distance of the readings [s]."""
        return float(np.median(some_steps(self.time)))

    @cached_property
    def origin(self) -> tuple[float, float]:
        """Angles of drive and loose gear at the first reading [rad]."""
        return float(self.driven(slice(0, 1))[0]), float(self.shown[0]) + self.lift

    @property
    def white(self) -> float:
        """Standard deviation of one reading of ``place`` [m] without the smooth error of the drive's curve."""
        return self.radii[1] * usual(self.sigma_loose) if self.follows else self.noise

    @property
    def smooth(self) -> tuple[float, float]:
        """Standard deviation [m] and correlation time [s] of the smooth error of ``place``, by the drive's curve."""
        sigma, lasts = self.steady.smooth
        return self.radii[0] * abs(1.0 - self.shared) * sigma if self.follows else 0.0, lasts

    @property
    def lift(self) -> float:
        """Offset of the loose gear's angle from the reading of its encoder [rad]."""
        return self.readings[1].lift

    def driven(self, rows: slice | np.ndarray) -> np.ndarray:
        """Return the angle of the drive gear at some readings [rad].

        Args:
            rows: which.
        """
        return self.drive[rows] if len(self.time) <= KEPT else self._driven(rows)

    def _driven(self, rows: slice | np.ndarray) -> np.ndarray:
        at, one = self.time[rows], self.readings[0]
        return self.steady.curve(at) if self.follows else np.interp(at, one.time, one.shown) + one.lift

    def part(self, rows: slice | np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the angles of drive and loose gear [rad] and the displacement [m] at some readings.

        Args:
            rows: which.
        """
        driven, loose = self.driven(rows), self.shown[rows] + self.lift
        place = self.radii[1] * (loose - self.origin[1])
        place -= self.radii[0] * (driven - self.origin[0])
        return driven, loose, place

    def angles(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the angles of drive and loose gear at times, interpolated linearly [rad], each (k,).

        Args:
            time: [s], (k,).
        """
        after = np.clip(np.searchsorted(self.time, time), 1, len(self.time) - 1)
        begin, length = self.time[after - 1], self.time[after] - self.time[after - 1]
        share = np.clip((time - begin) / length, 0.0, 1.0)
        (drive, loose, _), (driven, turned, _) = self.part(after - 1), self.part(after)
        return drive + share * (driven - drive), loose + share * (turned - loose)


class Shape(NamedTuple):
    """A form that a flank may have besides orders.

    Args:
        over: displacement of unit size over the angles of drive and loose gear [rad], each (n,).
        flank: 0 active, 1 reverse.
        size: that is expected [m].
        known: whether it is known to a few hundredths already.
    """

    over: Callable[[np.ndarray, np.ndarray], np.ndarray]
    flank: int
    size: float = 0.0
    known: bool = False


class Blocks(NamedTuple):
    """Means over a few readings each: short enough for a bounce, long enough to reduce the noise.

    Args:
        time: [s], (m,).
        drive: [rad], (m,).
        loose: [rad], (m,).
        place: [m], (m,).
        noise: standard deviation of ``place`` [m], measured on the blocks themselves.
        slack: of the track [m].
        size: readings in each.
        width: duration of a typical block [s].
        shapes: that flanks may have besides orders, of unit size, over the angles of drive and loose gear.
        wander: standard deviation of a block about the record's mean by its noise [m]; above ``noise`` under 1/f noise.
    """

    time: np.ndarray
    drive: np.ndarray
    loose: np.ndarray
    place: np.ndarray
    noise: float
    slack: float
    size: int
    width: float
    shapes: tuple[Shape, ...] = ()
    wander: float = 0.0

    @property
    def stray(self) -> float:
        """Standard deviation of a block in contact about its flank, by noise alone [m]."""
        return max(self.noise, self.wander)


def track(time: np.ndarray, drive: np.ndarray, loose: np.ndarray, radii: tuple[float, float], file: str = "") -> Track:
    """Return displacement and angles at the readings of the loose gear.

    Args:
        time: of the samples [s], rising, (n,).
        drive: angle of the drive gear, zero anywhere [rad], (n,).
        loose: angle of the loose gear, zero anywhere [rad], (n,).
        radii: base radii of drive and loose gear [m].
        file: named in faults.

    Raises:
        InputError: there are too few readings.

    >>> time = np.linspace(0.0, 1.0, 1001)
    >>> float(np.ptp(track(time, 3.0 * time, 3.0 * time + 1e-4, (0.1, 0.1)).place).round(9))
    0.0
    """
    one, other = read_encoder(time, drive), read_encoder(time, loose)
    for name, reading in (("theta_drive_rad", one), ("theta_loose_rad", other)):
        if len(reading.time) < FEWEST:
            what = f"is read {len(reading.time)} times only"
            raise InputError(Fault(name, what, f"a record needs at least {FEWEST} readings", file))
    one, first = model_noise(one)
    motion = motion_of(one)
    order = motion.harmonics[0].order if motion.harmonics else 0.0
    one, other = _floored(one, other, radii)
    curve = steady(one, motion)
    follows, gain = curve.rest < FOLLOWS, 0.0
    if follows:
        first, other, gain = _without_shared_noise(one, other, curve, first)
    shared = gain * radii[1] / radii[0]
    other, second = model_noise(other, order * radii[1] / radii[0])
    one, other = _floored(one, other, radii)
    inside: slice | np.ndarray = slice(None)  # a long record is not copied for nothing
    if other.time[0] < one.time[0] or other.time[-1] > one.time[-1]:
        inside = (other.time >= one.time[0]) & (other.time <= one.time[-1])
    at, shown, sigma = other.time[inside], other.shown[inside], other.sigma[inside]
    theirs = abs(1.0 - shared) * curve.sigma if follows else usual(one.sigma)
    noise = float(np.hypot(radii[1] * usual(sigma), radii[0] * theirs))
    slack = (0.0 if follows else radii[0] * stuck(one)) + radii[1] * stuck(other)
    return Track(
        at,
        shown,
        curve,
        follows,
        sigma,
        noise,
        slack,
        radii,
        (one, other),
        float(np.median(some_steps(time))),
        (first, second),
        shared,
    )


def _without_shared_noise(
    one: Reading, other: Reading, curve: Steady, model: NoiseModel
) -> tuple[NoiseModel, Reading, float]:
    """Return the noise of the drive's encoder, the loose gear's readings without the noise that both share, its gain.

    Jitter of a sampling clock common to both encoders turns both angles too far at the same time: the difference of
    their readings does not show it, that of the loose gear's readings and a smooth drive motion does. By how much the
    loose gear's readings follow the drive's is the regression of their third differences, which vanish for the motion.
    """
    if "edges" in (one.kind, other.kind):
        return model, other, 0.0
    rows: slice | np.ndarray = slice(None)
    own: slice | np.ndarray = slice(None)
    if len(one.time) != len(other.time) or not np.array_equal(one.time, other.time):
        _, rows, own = np.intersect1d(one.time, other.time, assume_unique=True, return_indices=True)
    time, ours, theirs = other.time[own], one.shown[rows], other.shown[own]  # of a long record, no copies
    if len(time) < SLOWER * FEWEST:
        return model, other, 0.0
    some = slice(max((len(time) - AT_ONCE) // 2, 0), (len(time) + AT_ONCE) // 2)
    off = ours[some] + one.lift - curve.curve(time[some])
    bent, bends = np.diff(off, 3), np.diff(theirs[some], 3)
    calm = np.abs(bends) <= 4.0 * robust_deviation(bends)  # impacts bend the motion
    gain = float(bent[calm] @ bends[calm]) / max(float(bent[calm] @ bent[calm]), 1e-300)
    falls = [
        _noise_in_means(time[some], theirs[some] - gain * off, size)
        / max(_noise_in_means(time[some], theirs[some], size), 1e-300)
        for size in (1, SLOWER)
    ]
    if falls[0] > SHARED or falls[1] > 1.0:
        return model, other, 0.0
    less = theirs - gain * (ours + one.lift - curve.curve(time))
    least = 0.0 if other.quantum is None else other.quantum / np.sqrt(12.0)
    sigma = np.broadcast_to(max(falls[0] * usual(other.sigma), least), len(time))
    return replace(model, white=falls[0] * model.white), other._replace(time=time, shown=less, sigma=sigma), gain


def _noise_in_means(time: np.ndarray, values: np.ndarray, size: int) -> float:
    """Return the noise of means over so many values each."""
    return noise_of(
        *(each[: len(each) // size * size].reshape(-1, size).mean(axis=1) for each in (time, values)), clip=4.0
    )


def _floored(one: Reading, other: Reading, radii: tuple[float, float]) -> tuple[Reading, Reading]:
    """Return readings with at least the uncertainty of the model of flanks, teeth and drag.

    Readings without noise would test rigid flanks with some orders, and nearly constant drag, to a picometre.
    """
    every = max(len(other.time) // STRETCH, 1)
    some = other.time[::every]
    after = np.clip(np.searchsorted(one.time, some), 1, len(one.time) - 1)  # np.interp copies what may not be written
    share = np.clip((some - one.time[after - 1]) / (one.time[after] - one.time[after - 1]), 0.0, 1.0)
    drive = one.shown[after - 1] + share * (one.shown[after] - one.shown[after - 1])
    place = radii[1] * other.shown[::every] - radii[0] * drive
    at = some - some.mean()
    place = place - place.mean() - at * float(at @ place) / max(float(at @ at), 1e-300)
    least = DESCRIBED * float(np.ptp(place))
    made = []
    for reading, radius in ((one, radii[0]), (other, radii[1])):
        low = least / radius
        made.append(reading if usual(reading.sigma) > low else reading._replace(sigma=np.maximum(reading.sigma, low)))
    return made[0], made[1]


def blocks(known: Track) -> Blocks:
    """Return means over blocks, as long as the velocity jumps of the path allow.

    A mean over a time W reduces the noise by the root of its readings and rounds a velocity jump v off by v·W/8; W
    keeps that slightly below the noise.
    """
    spacing = known.spacing
    longest = max(int(LONGEST / float(np.quantile(some_steps(known.time), 0.9))), 1)
    floor = max(known.noise, 1e-12)
    speed = _speed(known, floor)
    size = int(np.cbrt(CORNER * floor**2 / (spacing**2 * speed**2))) if speed > 0.0 else longest
    size = int(np.clip(size, 1, longest))
    time, drive, loose, place = _means(known, size)
    # rounding averages out as the number of readings at best; most third differences of few counts are zero
    quiet = max(noise_of(time, place, clip=4.0), floor * max(0.2 / np.sqrt(size), 1.0 / size), 1e-12)
    model = known.model
    slow = np.sqrt(max(float(model.sigma(size * spacing)) ** 2 - model.white**2 / size, 0.0))
    return Blocks(
        time, drive, loose, place, quiet, known.slack, size, size * spacing, wander=float(np.hypot(quiet, slow))
    )


def _speed(known: Track, noise: float) -> float:
    """Return the 90 % quantile of the displacement's speed [m/s], between the shortest means that resolve it."""
    means = np.concatenate([known.part(rows)[2] for rows in _stretches(len(known.time))])
    for size in 2 ** np.arange(0, 16):
        if len(means) < 16:
            break
        longer = 0.5 * (means[: len(means) // 2 * 2 : 2] + means[1::2])
        moved = np.subtract(means[1:], means[:-1], out=means[:-1])  # in place, to save memory
        high = float(np.quantile(np.abs(moved, out=moved), 0.9, overwrite_input=True))
        means = longer
        if high > 4.0 * noise * np.sqrt(2.0 / size):
            return high / (size * known.spacing)
    return 0.0


def _means(known: Track, size: int, wanted: tuple[int, ...] = (0, 1, 2, 3)) -> tuple[np.ndarray, ...]:
    """Return time [s], angles of drive and loose gear [rad] and displacement [m], means over so many readings each."""
    count = len(known.time) // size
    made = tuple(np.zeros(count) for _ in wanted)
    for first, last in _pieces(count, max(AT_ONCE // size, 1)):
        rows = slice(first * size, last * size)
        columns = (known.time[rows], *known.part(rows))
        for column, values in zip(made, (columns[one] for one in wanted), strict=True):
            column[first:last] = values.reshape(last - first, size).mean(axis=1) if size > 1 else values
    return made


def _stretches(count: int) -> list[slice]:
    """Return representative stretches of a record, evenly spread; the whole where it is short."""
    if count <= STRETCHES * STRETCH:
        return [slice(0, count)]
    first = np.linspace(0, count - STRETCH, STRETCHES).astype(int)
    return [slice(one, one + STRETCH) for one in first.tolist()]


def _pieces(count: int, most: int) -> Iterator[tuple[int, int]]:
    for first in range(0, count, most):
        yield first, min(first + most, count)


class Kinks(NamedTuple):
    """Significant velocity jumps of a path.

    Args:
        at: index of the block, (k,).
        jump: of the speed, above 0 when pushed off the active flank [m/s], (k,).
        place: of the path there [m], (k,).
    """

    at: np.ndarray
    jump: np.ndarray
    place: np.ndarray


def templates(reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the weights that estimate the jump of slope and the place at the middle of 2·reach + 1 points.

    The model is a cubic with a jump of slope in the middle, so that a smooth curve does not count.

    >>> jump, place = templates(4)
    >>> at = np.arange(-4.0, 5.0)
    >>> round(float(jump @ (3.0 * np.abs(at) + at**2)), 9), round(float(place @ (7.0 + np.abs(at))), 9)
    (6.0, 7.0)
    """
    at = np.arange(-reach, reach + 1) / reach
    even = np.column_stack([np.ones_like(at), at**2, np.abs(at)])
    inverse = np.linalg.pinv(even)
    return 2.0 * inverse[2] / reach, inverse[0]


def kinks(path: Blocks, scales: int = USUAL) -> Kinks:
    """Return the significant velocity jumps that are sharp, one within two reaches of it at most."""
    count = len(path.time)
    best, jumps, places = np.zeros(count), np.zeros(count), np.zeros(count)
    reaches = np.zeros(count, int)
    finer: list[tuple[np.ndarray, float]] = []
    width = np.gradient(path.time) if count > 1 else np.ones(count)
    for reach in SCALES[:scales]:
        if 4 * reach >= count:
            break
        slope, level = templates(reach)
        jump = np.convolve(path.place, slope[::-1], "same")
        standard = np.abs(jump) / (_left(path, reach) * np.linalg.norm(slope))
        standard[:reach] = standard[-reach:] = 0.0
        standard[np.abs(jump) < 2.0 * path.slack * np.abs(slope).max()] = 0.0  # the possible error of one block
        sharp = np.ones(count, bool)
        for levels, (shorter, sigma) in enumerate(reversed(finer), 1):
            least = SHARP**levels * np.abs(jump) - (NOISY * sigma if levels > 1 else 0.0)
            sharp &= shorter * np.sign(jump) > least
        better = (standard > best) & sharp & (best < PLAIN)
        best[better], jumps[better], reaches[better] = standard[better], jump[better], reach
        places[better] = np.convolve(path.place, level[::-1], "same")[better]
        finer.append((jump, path.noise * float(np.linalg.norm(slope))))
    found = _peaks(best, jumps / width, places, reaches)
    return Kinks(*(column[_turns_away(path, found, reaches[found.at])] for column in found))


def _left(path: Blocks, reach: int) -> np.ndarray:
    """Return the standard deviation of a block by noise and by the misfit of the model about each block, (m,).

    The misfit is smooth: of any number of blocks as many are independent as in the shortest window that shows it.
    """
    count = 2 * reach + 1
    if count < LEFT:
        return np.full(len(path.place), path.noise)
    at = np.arange(-reach, reach + 1) / reach
    base = np.linalg.qr(np.column_stack([np.ones_like(at), at, at**2, at**3, np.abs(at)]))[0]
    middle = path.place - np.median(path.place)
    rest = np.convolve(middle**2, np.ones(count), "same")
    for column in base.T:
        rest -= np.convolve(middle, column[::-1], "same") ** 2
    missed = np.maximum(rest / (count - base.shape[1]) - path.noise**2, 0.0)
    return np.sqrt(path.noise**2 + missed * count / LEFT)


def _turns_away(path: Blocks, found: Kinks, reach: np.ndarray) -> np.ndarray:
    """Return whether the path stays, before and after each jump, on the side to which its speed jumps, (k,)."""
    good = np.ones(len(found.at), bool)
    for part in (reach, reach // 2):
        sides = [path.place[np.clip(found.at + way, 0, len(path.place) - 1)] - found.place for way in (-part, part)]
        away = np.stack(sides) * np.sign(found.jump)
        good &= away.min(axis=0) > -5.0 * path.noise - 0.2 * np.maximum(away.max(axis=0), 0.0)
    return good


def _peaks(standard: np.ndarray, jump: np.ndarray, place: np.ndarray, reach: np.ndarray) -> Kinks:
    """Keep jumps without a stronger one nearby: of the same sign within two reaches, of the other within one.

    A jump makes weaker ones of the other sign within its reach; farther ones are impacts on the other flank.
    """
    sure = np.flatnonzero(standard > SURE)
    order = sure[np.argsort(-standard[sure])]
    taken = np.zeros((2, len(standard)), bool)
    kept = []
    for k in order:
        own = int(jump[k] < 0.0)
        if not taken[own, k]:
            kept.append(k)
            for sign, wide in ((own, 2 * reach[k]), (1 - own, reach[k])):
                taken[sign, max(k - wide, 0) : k + wide + 1] = True
    at = np.sort(np.array(kept, int))
    return Kinks(at, jump[at], place[at])
