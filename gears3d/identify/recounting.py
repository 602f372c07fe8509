"""What counting does to a threshold: the same motion, read again by encoders that begin elsewhere within a count."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.identify.flown import Flown, gathered
from gears3d.identify.liftoff import lifted
from gears3d.identify.onset import DIRECTIONS, TELLS, Flights, Onset
from gears3d.identify.swing import Periods, Swing, find_swing, periods
from gears3d.identify.unwaved import flattened
from gears3d.measured.segmentation.drive import redrawn
from gears3d.measured.segmentation.readings import read_encoder
from gears3d.measured.segmentation.smoothing import Track

READINGS = 12
"""How often a motion is read again."""
UNEXPLAINED = 1.3
"""Mean squared misfit of the flights over that of counting from which on there is more than counting."""
SIGNS: dict[str, int] = dict(zip(DIRECTIONS, (1, -1), strict=True))
"""Of the change of the swing."""
_FINE = 768
"""Points of a period at which a flight is drawn."""


class Laid(NamedTuple):
    """A record by periods.

    Args:
        periods: waves of the flanks taken off.
        raw: as they were read.
        swing: of the drive.
        known: both gears at the readings.
        time: of the samples [s], (n,).
        quanta: angle of a count of drive and loose gear [rad], ``None`` for smooth ones.
        frequency: of the swing [Hz].
        quiet: periods that are contact from end to end, (k,).
    """

    periods: Periods
    raw: Periods
    swing: Swing
    known: Track
    time: np.ndarray
    quanta: tuple[float | None, float | None]
    frequency: float
    quiet: np.ndarray


def recounted(
    found: dict[str, Onset], laid: list[Laid], ways: list[np.ndarray], teeth: tuple[int, int], backlash: float
) -> dict[str, Onset]:
    """Return thresholds by flights with intervals that know what counting does, by reading the same motion again.

    Counting errors keep step with the swing for many periods, so that no scatter of the periods shows them; but they
    follow from the motion and from where within a count each encoder began. What else there is (noise, waves that were
    not taken off) differs from period to period and shows there; few periods tell that badly, so it is added only
    where flights fit worse than counting explains.

    Args:
        found: by direction.
        laid: the records.
        ways: for each record 1 for rising, -1 for falling periods, (k,).
        teeth: of drive and loose gear.
        backlash: [m].
    """
    flights = {name: one.flights for name, one in found.items() if one.flights is not None}
    if not flights or all(count is None for one in laid for count in one.quanta):
        return found
    values = {SIGNS[name]: one.value for name, one in flights.items()}
    motions = [_motion(one, way, values) for one, way in zip(laid, ways, strict=True)]
    random = np.random.default_rng(sum(len(way) for way in ways))
    shifts: dict[str, list[float]] = {name: [] for name in flights}
    rests: dict[str, list[float]] = {name: [] for name in flights}
    for _ in range(READINGS):
        read = [motion.read(random, teeth) for motion in motions]
        again = [motion.ways(one) for motion, one in zip(motions, read, strict=True)]
        for name, one in flights.items():
            flown = gathered(read, [way == SIGNS[name] for way in again], laid[0].known.radii[0])
            shift, rest = _shifted(flown, one.value, backlash)
            shifts[name].append(shift)
            rests[name].append(rest)
    widened = {name: _widened(found[name], one, shifts[name], rests[name]) for name, one in flights.items()}
    return {**found, **widened}


def _shifted(flown: Flown, value: float, backlash: float) -> tuple[float, float]:
    """Return how far periods say that a threshold is off [rad/s²], and what they leave over, mean squared [m²]."""
    use = flown.usable(value, backlash)
    slope, rest = flown.slope(value, use), flown.rest(value, use)
    info = np.nansum(slope**2, axis=1)
    if not info.sum() > 0.0:
        return np.nan, np.nan
    telling = (info > TELLS * info.max())[:, None] & use & (slope != 0.0)
    return -float(np.nansum(slope * rest) / info.sum()), float(np.nanmean(rest[telling] ** 2))


def _widened(found: Onset, flights: Flights, shifts: list[float], rests: list[float]) -> Onset:
    from scipy.stats import t

    known = np.isfinite(shifts)
    if known.sum() < 3:
        return found
    sigma = float(np.std(np.array(shifts)[known], ddof=1))
    ratio = flights.rest / max(float(np.mean(np.array(rests)[known])), 1e-300)
    more = np.sqrt(max(0.0, 1.0 - UNEXPLAINED / ratio)) * flights.scatter
    reach = float(np.hypot(t.ppf(0.975, int(known.sum()) - 1) * sigma, more))
    told = {"counting_over_threshold": sigma / flights.value, "rest_over_counting": float(np.sqrt(ratio))}
    around = (flights.value - reach, flights.value + reach)
    return found._replace(ci95=around, goodness={**found.goodness, **told})


class _Motion(NamedTuple):
    """Both gears as their thresholds have them."""

    laid: Laid
    drive: np.ndarray
    loose: np.ndarray
    way: np.ndarray

    def read(self, random: np.random.Generator, teeth: tuple[int, int]) -> Periods:
        """Return the motion by periods, as counters with another zero read it."""
        angles = [
            angle if count is None else np.floor(angle / count + random.uniform()) * count
            for angle, count in zip((self.drive, self.loose), self.laid.quanta, strict=True)
        ]
        one, other = (read_encoder(self.laid.time, angle) for angle in angles)
        known, radii = self.laid.known, self.laid.known.radii
        inside = (other.time >= one.time[0]) & (other.time <= one.time[-1])
        time, loose = other.time[inside], other.angle[inside]
        drive = redrawn(one, known.steady)(time) if known.follows else np.interp(time, one.time, one.angle)
        swing = find_swing(one.time, one.angle, self.laid.frequency)
        read = periods(swing, time, radii[1] * loose - radii[0] * drive, drive, loose)
        near = self.nearest(read)
        return flattened(read, teeth, quiet=np.where(near < 0, False, self.laid.quiet[near]))

    def nearest(self, read: Periods) -> np.ndarray:
        """Return which period of the record each one is, -1 where it is none, (k,)."""
        apart = np.abs(read.middle[:, None] - self.laid.raw.middle[None, :])
        return np.where(apart.min(axis=1) < 0.3 / self.laid.frequency, apart.argmin(axis=1), -1)

    def ways(self, read: Periods) -> np.ndarray:
        """Return 1 for rising, -1 for falling periods, 0 for those that the record has not, (k,)."""
        near = self.nearest(read)
        return np.where(near < 0, 0, self.way[near])


def _motion(laid: Laid, way: np.ndarray, values: dict[int, float]) -> _Motion:
    turns = laid.swing.phase(laid.time) / (2.0 * np.pi)
    first = int(np.floor(turns[0]))
    begun = first + np.arange(int(np.ceil(turns[-1])) - first)
    middle = np.interp(begun + 0.5, turns, laid.time)
    level = laid.swing.amplitude(middle)
    ramp = np.gradient(level) / (2.0 * np.pi * level)
    rising = np.interp(middle, laid.raw.middle, way) > 0.0
    value = np.where(rising, values.get(1, np.inf), values.get(-1, np.inf))
    fine = (np.arange(_FINE) + 0.5) / _FINE
    radii = laid.known.radii
    height = (radii[0] / laid.swing.omega**2 * level)[:, None] * lifted(2.0 * np.pi * fine, level / value, ramp)
    place = np.interp(turns, (begun[:, None] + fine).ravel(), height.ravel())
    drive = laid.known.steady.curve(laid.time)
    return _Motion(laid, drive, (place + radii[0] * drive) / radii[1], way)
