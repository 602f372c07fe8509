"""The drive's motion as a smooth curve: it is imposed, so it changes slowly, and its counts must not imitate speeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.measured.drive_motion import motion_of
from gears3d.measured.encoder import usual
from gears3d.signals import some_steps

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

    from gears3d.measured.drive_motion import DriveMotion
    from gears3d.measured.encoder import Reading

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
# Spans between knots of the coarsest curve.
AT_LEAST = 8


class _Waves(NamedTuple):
    """Harmonics of an angle: size·cos(turn·t + phase).

    Args:
        turns: circular frequencies [rad/s], (h,).
        sizes: [rad], (h,).
        phases: at t = 0 [rad], (h,).
        sigma: standard deviation of their sum [rad].
        speed_sigma: of its rate [rad/s].
        hidden: circular frequencies [rad/s] and largest sizes [rad] of those that noise may hide.
    """

    turns: np.ndarray
    sizes: np.ndarray
    phases: np.ndarray
    sigma: float
    speed_sigma: float
    hidden: tuple[tuple[float, float], ...] = ()

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
    def bends(self) -> float:
        """Time within which it hardly bends [s]: from knot to knot, or a part of the period of a harmonic."""
        knots = np.unique(np.asarray(self.spline.t, float))
        between = float(np.median(np.diff(knots)))
        return (
            min(between, 2.0 * np.pi / (PER_PERIOD * float(self.waves.turns.max())))
            if len(self.waves.turns)
            else between
        )


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


def _waves(motion: DriveMotion) -> _Waves:
    """Return the harmonics of the drive's angle; none where it has none."""
    found = motion.harmonics
    turns = np.array([2.0 * np.pi * one.frequency for one in found])
    sizes = np.array([one.amplitude for one in found]) / turns
    phases = np.array([one.phase for one in found])  # of the speed: amplitude·sin(turn·t + phase)
    slack = float(np.sqrt(sum((one.amplitude_sigma / turn) ** 2 for one, turn in zip(found, turns, strict=True))))
    speed = float(np.sqrt(sum(one.amplitude_sigma**2 for one in found)))
    hidden = [(2.0 * np.pi * one.frequency, one.amplitude) for one in motion.hidden]
    return _Waves(turns, -sizes, phases, slack, speed, tuple((turn, speed / turn) for turn, speed in hidden))


def _through(reading: Reading, size: int, waves: _Waves) -> Steady:
    """Return the motion through means over so many readings."""
    time, angle, within = _means(reading, size, waves)
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
    time, angle, within = _means(reading, before.size, waves)
    step = len(time) / max(len(spline.t) - 7, 1)
    step = KNOT * 2 ** max(int(np.round(np.log2(step / KNOT))), 0)
    return Curve(_spline(time, angle - 0.5 * within * spline(time, 2), step), waves)


def _means(reading: Reading, size: int, waves: _Waves) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return means over so many readings without their harmonics, and the variance of time in each [s²]."""
    count = len(reading.time) // size
    time, angle, within = np.zeros(count), np.zeros(count), np.zeros(count)
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
