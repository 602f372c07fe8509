"""The excitation at which contact is lost, from records whose fluctuation grows and falls or differs in each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.identify.fluctuation import (
    BINS,
    PRESSED,
    Fluctuation,
    Periods,
    find_fluctuation,
    flattened,
    periods,
    phases,
    pressed,
)
from gears3d.identify.law import Identified, Parameter
from gears3d.measured.drive_motion import redrawn
from gears3d.measured.encoder import read_encoder
from gears3d.measured.segmentation.displacement import Track, track
from gears3d.recording import Recording
from gears3d.signals import count_of, robust_deviation

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

_ROUNDING = -1e-12
_TURNS = 8  # Rounds in which the phase of the loss is found


def lost_at(excitation: np.ndarray, ramp: np.ndarray) -> np.ndarray:
    """Return the phase at which contact is lost [rad], π where it is not, (k,)."""
    lost = np.full(len(excitation), np.pi)
    for _ in range(_TURNS):
        here = excitation * (1.0 + ramp * (lost - np.pi))
        lost = np.arccos(-1.0 / np.maximum(here, 1.0))
    return lost


def lifted(phase: np.ndarray, excitation: np.ndarray, ramp: np.ndarray | float = 0.0) -> np.ndarray:
    """Return the height of the first flight of each period, in units of the stroke: u = s·ω²/(Rb1·α).

    The drive's acceleration is α·(1 + ramp·(τ − π))·cos τ. From the loss at cos τ1 = −1/Λ on, the gap opens with
    u'' = −1/Λ − (1 + ramp·(τ − π))·cos τ until the gear is back on the flank; nothing is lifted up to Λ = 1.
    Source: Rigaud & Perret-Liaudet 2020, eqs (11)-(18).

    >>> found = lifted(np.linspace(0.0, 2 * np.pi, 2001), np.array([0.9, 1.039299]))
    >>> found.max(axis=1).round(5).tolist()  # 79.96 um at 5 rpm, 1 Hz of Rigaud & Perret-Liaudet 2020
    [0.0, 0.00648]
    """
    ramp = np.broadcast_to(np.asarray(ramp, dtype=float), excitation.shape)
    lost = lost_at(excitation, ramp)[:, None]
    slope = ramp[:, None]

    def twice(at: np.ndarray) -> np.ndarray:
        """Return the second antiderivative of (1 + ramp·(τ − π))·cos τ."""
        return slope * (2.0 * np.sin(at) - at * np.cos(at)) - (1.0 - slope * np.pi) * np.cos(at)

    def once(at: np.ndarray) -> np.ndarray:
        return slope * (np.cos(at) + at * np.sin(at)) + (1.0 - slope * np.pi) * np.sin(at)

    since = np.maximum(np.atleast_2d(phase) - lost, 0.0)
    fall = 0.5 * since**2 / np.maximum(excitation, 1e-300)[:, None]
    height = twice(lost) + once(lost) * since - twice(lost + since) - fall
    flying = np.minimum.accumulate(height > _ROUNDING, axis=1)
    return np.where(flying & (excitation[:, None] > 1.0), np.maximum(height, 0.0), 0.0)


def landed(phase: np.ndarray, excitation: np.ndarray, ramp: np.ndarray | float = 0.0) -> np.ndarray:
    """Return which bins lie after the first flight of their period, (k, n)."""
    lost = lost_at(excitation, np.broadcast_to(np.asarray(ramp, dtype=float), excitation.shape))[:, None]
    return (lifted(phase, excitation, ramp) == 0.0) & (np.atleast_2d(phase) > lost) & (excitation[:, None] > 1.0)


# Excitation, over the threshold, up to which flights count: they are back on the flank before the period ends
MOST = 1.6
LEAST = 0.6  # Excitation from which on periods count as quiet ones that are used
HIGHEST = 0.6  # Part of the backlash that a flight may rise to and count
_SMOOTH = 9  # Bins over which an opening is averaged
_READ = 5  # Bins in sure contact that a period must have been read in
_STEP = 1e-4  # Relative step of differences


class Flown(NamedTuple):
    """Periods of one direction in order of the fluctuation amplitude, all records together."""

    place: np.ndarray  # displacement in each bin without its mean in contact [m], NaN where nothing was read, (k, BINS)
    phase: np.ndarray  # mean phase of the readings in each bin [rad], (k, BINS)
    level: np.ndarray  # amplitude of the drive's acceleration [rad/s²], (k,)
    ramp: np.ndarray  # its relative change in a radian, (k,)
    unit: np.ndarray  # height of a flight per acceleration and unit of :func:`lifted` [m·s²/rad], (k,)
    opening: np.ndarray  # how far the gap opens [m], (k,)
    rough: float  # noise of the contact [m]
    record: np.ndarray  # place of the record, (k,)
    middle: np.ndarray  # time of each period [s], (k,)

    def heights(self, value: float) -> np.ndarray:
        """Return the flights that a threshold makes, means over the bins [m], (k, BINS)."""
        ratio = self.level / value
        height = lifted(self.phase, ratio, self.ramp)
        bend = -np.cos(self.phase) - 1.0 / np.maximum(ratio, 1e-300)[:, None]
        mean = height + np.where(height > 0.0, bend, 0.0) * (2.0 * np.pi / BINS) ** 2 / 24.0
        return (self.unit * self.level)[:, None] * np.maximum(mean, 0.0)

    def usable(self, value: float, backlash: float) -> np.ndarray:
        """Return which bins count: sure contact, and the first flight of periods in which it ends on the flank it left.

        The bin in which a flight ends holds some of the rebound.
        """
        ratio = self.level / value
        low = (self.heights(value).max(axis=1) < HIGHEST * backlash) & (ratio < MOST) & (ratio > LEAST)
        over = landed(self.phase, ratio, self.ramp)
        over[:, :-1] |= over[:, 1:]
        return low[:, None] & ~over & (self.phase > PRESSED[0]) & np.isfinite(self.place)

    def rest(self, value: float, use: np.ndarray) -> np.ndarray:
        """Return the residual of the law, each period about its own mean [m], NaN where nothing counts, (k, BINS)."""
        rest = np.where(use, self.place - self.heights(value), np.nan)
        count = np.maximum(use.sum(axis=1), 1)
        return rest - (np.nansum(rest, axis=1) / count)[:, None]

    def slope(self, value: float, use: np.ndarray) -> np.ndarray:
        """Return how the rest changes with the threshold [m·s²/rad], (k, BINS)."""
        step = _STEP * value
        return (self.rest(value + step, use) - self.rest(value - step, use)) / (2.0 * step)


def gathered(laid: list[Periods], chosen: list[np.ndarray], radius: float) -> Flown:
    """Return chosen periods of several records in order of their fluctuation amplitude."""
    from scipy.ndimage import uniform_filter1d

    def together(one_of: list[np.ndarray]) -> np.ndarray:
        return np.concatenate([values[pick] for values, pick in zip(one_of, chosen, strict=True)])

    place, level = together([one.place for one in laid]), together([one.level for one in laid])
    unit = together([radius / one.rate**2 for one in laid])
    record = together([np.full(len(one.level), at) for at, one in enumerate(laid)])
    ramp = together([one.rise for one in laid]) / (2.0 * np.pi * level)
    middle = together([one.middle for one in laid])
    phase = together([one.phase for one in laid])
    resting = pressed()
    read = (np.isfinite(place[:, resting]).sum(axis=1) >= _READ) & (np.isfinite(place).mean(axis=1) > 0.5)
    order = np.flatnonzero(read)[np.argsort(level[read], kind="stable")]
    place = place[order] - np.nanmean(np.where(resting, place[order], np.nan), axis=1, keepdims=True)
    known = np.isfinite(place)
    sums = uniform_filter1d(np.where(known, place, 0.0), _SMOOTH, axis=1, mode="nearest")
    smooth = sums / np.maximum(uniform_filter1d(known.astype(float), _SMOOTH, axis=1, mode="nearest"), 0.3)
    opening = smooth[:, (phases() > 1.6) & (phases() < 5.6)].max(axis=1)
    rough = robust_deviation(smooth[:, resting]) if len(smooth) else 0.0
    phase = np.where(known, phase[order], phases())
    columns = (place, phase, level[order], ramp[order], unit[order], opening, max(rough, 1e-12))
    return Flown(*columns, record[order], middle[order])


DIRECTIONS = ("up", "down")
LIVELY = 6.0  # Deviations of quiet periods above which one is lively
STEP = 3.0  # How far lively periods must open more than quiet ones
CERTAIN, WIDE = 30.0, 0.05  # An opening above these, in noise of the contact and in backlashes, is not noise
EARLY = 0.97  # Part of a threshold below which lively periods contradict it
ILL = 4.0  # Mean squared error of the flights from which on they are not those of rigid teeth
ROUGH = 0.01  # Error of the heights of rigid flights that nobody minds, over the heights
TELLS = 1e-3  # Part of the information of the best period from which on a period is used
_AT_LEAST = 4  # Quiet periods in a sweep
_AROUND = 0.3  # How far about a first guess the threshold is looked for
_TRIES = 61
_ROUNDS = 6


class Flights(NamedTuple):
    """A threshold by flights."""

    value: float  # amplitude of the drive's acceleration at which contact is lost [rad/s²]
    scatter: float  # half the 95 % interval by the scatter of periods [rad/s²]
    chi2: float  # how well flights fit, over noise and roughness
    rest: float  # mean squared misfit of the periods that tell [m²]


class Onset(NamedTuple):
    """Result of one direction of a sweep."""

    # amplitude of the drive's acceleration at which contact is lost [rad/s²]; ``None``: not in this sweep
    value: float | None
    ci95: tuple[float, float]  # its interval [rad/s²]
    # ``method`` (``"flights"``, ``"bracket"``, ``"none"``), ``chi2``, ``opening_seen_m``, ``quiet_below_rad_s2``,
    # ``lively_above_rad_s2``
    goodness: dict[str, Any]
    # ``level_rad_s2`` and ``opening_m`` of each period; ``law_level_rad_s2`` and ``law_opening_m``
    curve: dict[str, np.ndarray]
    lively: bool = False  # whether contact was lost in every period
    notes: tuple[str, ...] = ()  # what the reader should know
    flights: Flights | None = None  # what they tell, where they tell the threshold


def onset(laid: list[Periods], chosen: list[np.ndarray], radius: float, backlash: float, way: str) -> Onset:
    """Return where contact is lost."""
    data = gathered(laid, chosen, radius)
    curve = {"level_rad_s2": data.level, "opening_m": data.opening}
    step = _step(data.opening)
    if step is None:
        if not len(data.opening):
            return Onset(None, (np.nan, np.nan), {"method": "none"}, curve)
        open_ = float(np.median(data.opening))
        lively = open_ > max(CERTAIN * data.rough, WIDE * backlash)
        return Onset(None, (np.nan, np.nan), {"method": "none", "opening_seen_m": CERTAIN * data.rough}, curve, lively)
    quiet = data.opening[:step]
    middle = float(np.median(quiet))
    limit = middle + LIVELY * max(robust_deviation(quiet - middle), 0.1 * middle, data.rough)
    lively = data.opening > limit
    place = _first_run(lively, step)
    below, above = float(data.level[max(place - 1, 0)]), float(data.level[place])
    told: dict[str, Any] = {"opening_seen_m": limit, "quiet_below_rad_s2": below, "lively_above_rad_s2": above}
    found = _by_flights(data, 0.97 * above, backlash)
    if found is not None:
        early = int(np.sum(lively & (data.level < EARLY * found.value)))
        if found.chi2 < ILL and early <= max(2, len(lively) // 10):
            told |= {"method": "flights", "chi2": found.chi2}
            around = (found.value - found.scatter, found.value + found.scatter)
            return Onset(found.value, around, told, {**curve, **_law(data, found.value)}, flights=found)
    low = min(below, above / _seen_from(limit - middle, data.unit, above)) if way == "up" else below
    what = "flights are not those of rigid teeth that lay on the flank: the threshold is bracketed by two periods"
    return Onset(0.5 * (low + above), (low, above), {**told, "method": "bracket"}, curve, notes=(what,))


def _step(opening: np.ndarray) -> int | None:
    """Return where openings, in order of the amplitude, step up from noise to flights; ``None`` without a step."""
    if len(opening) < 2 * _AT_LEAST:
        return None  # too few to tell
    logs = np.log(np.maximum(opening, 1e-12))
    errors = [logs[:at].var() * at + logs[at:].var() * (len(logs) - at) for at in range(_AT_LEAST, len(logs) - 1)]
    at = int(np.argmin(errors)) + _AT_LEAST
    return at if np.median(opening[at:]) > STEP * np.median(opening[:at]) else None


def _first_run(lively: np.ndarray, otherwise: int) -> int:
    """Return the first period from which three of four contain flights."""
    runs = np.convolve(lively.astype(float), np.ones(4))[3:]
    where = np.flatnonzero(lively[: len(runs)] & (runs >= 3.0))
    return int(where[0]) if where.size else otherwise


def _seen_from(opening: float, unit: np.ndarray, value: float) -> float:
    """Return the excitation at which a flight is as high as what can be seen."""
    tried = np.linspace(1.0, 3.0, 400)
    height = float(np.median(unit)) * value * tried * lifted(phases(), tried).max(axis=1)
    return float(np.interp(opening, height, tried))


def _by_flights(data: Flown, guess: float, backlash: float) -> Flights | None:
    value = guess
    tried = np.linspace(1.0 - _AROUND, 1.0 + _AROUND, _TRIES)
    for round_ in range(_ROUNDS):
        use = data.usable(value, backlash)
        if not np.any(use & (data.heights(value) > 0.0)):
            return None
        around = value * (tried if round_ < 2 else 1.0 + (tried - 1.0) * 0.1)
        errors = np.array([np.nansum(data.rest(one, use) ** 2) for one in around])
        best = int(np.argmin(errors))
        if best in (0, _TRIES - 1):
            value = float(around[best])
            continue
        low, here, high = errors[best - 1 : best + 2]
        bend = low - 2.0 * here + high
        step = around[1] - around[0]
        value = float(around[best] + (0.5 * step * (low - high) / bend if bend > 0.0 else 0.0))
    for _ in range(2):
        use = data.usable(value, backlash)
        slope = data.slope(value, use)
        size = np.nansum(slope**2)
        value -= float(np.nansum(slope * data.rest(value, use)) / size) if size > 0.0 else 0.0
    return _judged(data, value, data.usable(value, backlash))


def _judged(data: Flown, value: float, use: np.ndarray) -> Flights | None:
    from scipy.stats import t

    rest, slope = data.rest(value, use), data.slope(value, use)
    info = np.nansum(slope**2, axis=1)
    if not info.sum() > 0.0:
        return None
    pull = np.nansum(slope * rest, axis=1)
    share = info / info.sum()
    error = float(np.sqrt(np.sum((pull / (1.0 - share.clip(max=0.9))) ** 2)) / info.sum())  # periods err as a whole
    periods_that_tell = 1.0 / np.sum(share**2)
    still = data.level < LEAST * value
    quiet = still if still.sum() >= 3 else data.level < value
    noise = np.nanvar(data.rest(value, np.broadcast_to(quiet[:, None], use.shape)))
    heights = data.heights(value)
    flying = use & (heights > 0.0)
    floor = (ROUGH * np.sqrt(np.mean(heights[flying] ** 2))) ** 2 if np.any(flying) else 0.0
    chi2 = float(np.nanmean(rest[flying] ** 2) / max(noise + floor, 1e-30))
    telling = (info > TELLS * info.max())[:, None] & use & (slope != 0.0)
    quantile = float(t.ppf(0.975, max(periods_that_tell - 1.0, 1.0)))
    return Flights(value, quantile * error, chi2, float(np.nanmean(rest[telling] ** 2)))


def _law(data: Flown, value: float) -> dict[str, np.ndarray]:
    level = np.linspace(data.level.min(), min(data.level.max(), MOST * value), 200)
    height = float(np.median(data.unit)) * level * lifted(phases(), level / value).max(axis=1)
    return {"law_level_rad_s2": level, "law_opening_m": height}


READINGS = 12  # How often a motion is read again
UNEXPLAINED = 1.3  # Mean squared misfit of the flights over that of counting from which on there is more than counting
SIGNS: dict[str, int] = dict(zip(DIRECTIONS, (1, -1), strict=True))  # Sign of the change of the fluctuation amplitude
_FINE = 768  # Points of a period at which a flight is drawn


class Laid(NamedTuple):
    """A record by periods."""

    periods: Periods  # waves of the flanks taken off
    raw: Periods  # as they were read
    fluctuation: Fluctuation  # of the drive
    known: Track  # both gears at the readings
    time: np.ndarray  # of the samples [s], (n,)
    # angle of a count of drive and loose gear [rad], ``None`` for smooth ones
    quanta: tuple[float | None, float | None]
    frequency: float  # of the fluctuation [Hz]
    quiet: np.ndarray  # periods that are contact from end to end, (k,)


def recounted(
    found: dict[str, Onset], laid: list[Laid], ways: list[np.ndarray], teeth: tuple[int, int], backlash: float
) -> dict[str, Onset]:
    """Return thresholds by flights with intervals that include counting errors, from simulated readings.

    Counting errors are commensurate with the fluctuation for many periods, so the scatter of the periods does not show
    them; but they follow from the motion and the initial position of each encoder within a count. Other errors (noise,
    waves that were not removed) differ from period to period and show in the scatter; as few periods estimate it
    poorly, it is added only where flights fit worse than counting errors explain.
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
    """Return the deviation of a threshold by period [rad/s²], and the mean square residual [m²]."""
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
        fluctuation = find_fluctuation(one.time, one.angle, self.laid.frequency)
        read = periods(fluctuation, time, radii[1] * loose - radii[0] * drive, drive, loose)
        near = self.nearest(read)
        return flattened(read, teeth, quiet=np.where(near < 0, False, self.laid.quiet[near]))

    def nearest(self, read: Periods) -> np.ndarray:
        """Return which period of the record each one is, -1 where none corresponds, (k,)."""
        apart = np.abs(read.middle[:, None] - self.laid.raw.middle[None, :])
        return np.where(apart.min(axis=1) < 0.3 / self.laid.frequency, apart.argmin(axis=1), -1)

    def ways(self, read: Periods) -> np.ndarray:
        """Return 1 for rising, -1 for falling periods, 0 for those that the record has not, (k,)."""
        near = self.nearest(read)
        return np.where(near < 0, 0, self.way[near])


def _motion(laid: Laid, way: np.ndarray, values: dict[int, float]) -> _Motion:
    turns = laid.fluctuation.phase(laid.time) / (2.0 * np.pi)
    first = int(np.floor(turns[0]))
    begun = first + np.arange(int(np.ceil(turns[-1])) - first)
    middle = np.interp(begun + 0.5, turns, laid.time)
    level = laid.fluctuation.amplitude(middle)
    ramp = np.gradient(level) / (2.0 * np.pi * level)
    rising = np.interp(middle, laid.raw.middle, way) > 0.0
    value = np.where(rising, values.get(1, np.inf), values.get(-1, np.inf))
    fine = (np.arange(_FINE) + 0.5) / _FINE
    radii = laid.known.radii
    height = (radii[0] / laid.fluctuation.omega**2 * level)[:, None] * lifted(2.0 * np.pi * fine, level / value, ramp)
    place = np.interp(turns, (begun[:, None] + fine).ravel(), height.ravel())
    drive = laid.known.steady.curve(laid.time)
    return _Motion(laid, drive, (place + radii[0] * drive) / radii[1], way)


class Sweep(NamedTuple):
    """A record of a sweep.

    Args:
        record: time and both angles.
        rig: base radii, teeth, inertia, backlash, and ``motion.harmonics[0]`` for the frequency.
        file: named in faults.
    """

    record: Recording
    rig: Scenario
    file: str = ""


def identify_threshold(sweeps: Sequence[Sweep]) -> Identified:
    """Identify the excitation at which contact is lost, rising and falling, and the drag that it stands for.

    Above the threshold the first flight of each period has a known shape; its height over the excitation determines the
    threshold far better than the moment at which a flight can be seen. Where flights are not those of rigid teeth that
    lie on the flank before (bounces that outlast a period, flanks that separate the gears), the last period without and
    the first with flights bracket it.

    Args:
        sweeps: records with a fluctuation amplitude that grows, falls, or both; or one amplitude each, in the order of
            recording.

    Returns:
        For ``up`` and ``down``, as far as recorded: ``acceleration_up`` (amplitude of the drive's acceleration
        [rad/s²]), ``amplitude_up`` (of its speed [rad/s], if all were at one frequency), ``excitation_up`` (Λ with the
        rig's drag) and ``drag_up`` [N·m] (that Λ = 1 stands for); with both, ``hysteresis`` (up less down, over up).

    Raises:
        InputError: a record cannot be used, or contact is never or always lost.

    Source: Rigaud & Perret-Liaudet 2020, section 4, eqs (5)-(10); Kadmiri et al. 2012, eq. (24) and table 1.
    """
    laid: list[Laid] = []
    ways = []
    for sweep in sweeps:
        laid.append(_laid(sweep))
        ways.append(_direction(laid[-1].raw, laid[-2].raw if len(laid) > 1 else None))
    found = _onsets(laid, ways, sweeps)
    laid = [_again(one, way, found, sweep) for one, way, sweep in zip(laid, ways, sweeps, strict=True)]
    rig = sweeps[0].rig.rig()
    found = recounted(_onsets(laid, ways, sweeps), laid, ways, (rig.teeth_drive, rig.teeth_loose), rig.backlash)
    if all(one.value is None for one in found.values()):
        raise _never(found, laid, sweeps)
    return _told(found, sweeps, laid)


def _onsets(laid: list[Laid], ways: list[np.ndarray], sweeps: Sequence[Sweep]) -> dict[str, Onset]:
    rig, flat = sweeps[0].rig.rig(), [one.periods for one in laid]
    return {
        name: onset(flat, [way == sign for way in ways], rig.base_radius_drive, rig.backlash, name)
        for name, sign in SIGNS.items()
        if any(np.any(way == sign) for way in ways)
    }


def _laid(sweep: Sweep) -> Laid:
    """Return a record by periods, without its flanks' waves."""
    rig, file = sweep.rig.rig(), sweep.file
    if not sweep.rig.motion.harmonics:
        remedy = "give the fluctuation's frequency in motion.harmonics of the rig or of the record's [condition]"
        raise InputError(Fault("motion.harmonics", "is empty: no frequency is known", remedy, file))
    radii = (rig.base_radius_drive, rig.base_radius_loose)
    angles = (sweep.record.signals["theta_drive_rad"], sweep.record.signals["theta_loose_rad"])
    known = track(sweep.record.time, *angles, radii, file)
    driven = known.readings[0]
    frequency = sweep.rig.motion.harmonics[0].frequency
    fluctuation = find_fluctuation(driven.time, driven.angle, frequency, file)
    raw = periods(fluctuation, known.time, known.place, known.drive, known.loose)
    flat = flattened(raw, (rig.teeth_drive, rig.teeth_loose), file)
    quanta = (count_of(angles[0]), count_of(angles[1]))
    return Laid(flat, raw, fluctuation, known, sweep.record.time, quanta, frequency, np.zeros(len(raw.level), bool))


CALM = 0.95  # Part of a threshold below which periods are contact from end to end


def _again(laid: Laid, way: np.ndarray, found: dict[str, Onset], sweep: Sweep) -> Laid:
    """Return the record with the delay between its encoders fitted to the periods in which contact lasts."""
    quiet = np.zeros(len(way), bool)
    for name, sign in SIGNS.items():
        if name in found and found[name].value is not None:
            quiet |= (way == sign) & (laid.raw.level < CALM * found[name].ci95[0])
    rig = sweep.rig.rig()
    flat = flattened(laid.raw, (rig.teeth_drive, rig.teeth_loose), sweep.file, quiet)
    return laid._replace(periods=flat, quiet=quiet)


STEADY = 2e-3  # Relative change of the amplitude in a period below which it is steady


def _direction(here: Periods, before: Periods | None) -> np.ndarray:
    """Return 1 where the amplitude grows, -1 where it falls; for a steady one compare with the record before."""
    moving = np.abs(here.rise) > STEADY * here.level
    if np.mean(moving) > 0.5:
        return np.sign(here.rise).astype(int)
    fell = before is not None and np.median(here.level) < np.median(before.level)
    return np.full(len(here.level), -1 if fell else 1)


def _never(found: dict[str, Onset], laid: list[Laid], sweeps: Sequence[Sweep]) -> InputError:
    level = np.concatenate([one.raw.level for one in laid])
    lost = all(one.lively for one in found.values())
    what = "is lost in every period" if lost else "is never lost"
    span = f"between amplitudes of {level.min():.4g} and {level.max():.4g} rad/s^2 of the drive's acceleration"
    remedy = "start the sweep at a smaller fluctuation amplitude" if lost else "sweep to a larger fluctuation amplitude"
    return InputError(Fault("theta_loose_rad", f"contact {what} {span}", remedy, sweeps[0].file))


def _told(found: dict[str, Onset], sweeps: Sequence[Sweep], laid: list[Laid]) -> Identified:
    rig, scenario = sweeps[0].rig.rig(), sweeps[0].rig
    lever = rig.inertia * rig.base_radius_drive / rig.base_radius_loose
    unsure = scenario.uncertainty.get("gears.loose.inertia", 0.0) / rig.inertia
    omegas = np.array([one.raw.omega for one in laid])
    parameters: dict[str, Parameter] = {}
    for name, one in found.items():
        if one.value is None:
            continue

        def scaled(factor: float, unit: str, one: Onset = one, more: float = 0.0) -> Parameter:
            value = factor * float(one.value or 0.0)
            low, high = (np.hypot(factor * (end - float(one.value or 0.0)), 1.96 * more * value) for end in one.ci95)
            return Parameter(value, unit, value - float(low), value + float(high))

        parameters[f"acceleration_{name}"] = scaled(1.0, "rad/s^2")
        if np.ptp(omegas) < 1e-9 * omegas[0]:
            parameters[f"amplitude_{name}"] = scaled(1.0 / omegas[0], "rad/s")
        if rig.drag_torque > 0.0:
            parameters[f"excitation_{name}"] = scaled(lever / rig.drag_torque, "")
        parameters[f"drag_{name}"] = scaled(lever, "N m", more=unsure)
    both = [found[name] for name in DIRECTIONS if name in found and found[name].value is not None]
    if len(both) == 2:
        parameters["hysteresis"] = _hysteresis(*both)
    name = next(name for name in DIRECTIONS if f"drag_{name}" in parameters)
    drag = parameters[f"drag_{name}"].value
    snippet = f'# all drag in contact at the mean speed: leave other drags out\n[drag]\ntorque = "{drag:.6g} N m"\n'
    goodness: dict[str, Any] = {name: one.goodness for name, one in found.items()}
    goodness["periods"] = int(sum(len(one.raw.level) for one in laid))
    curves = {name: one.curve for name, one in found.items()}
    curves |= {"scale": {"factor": lever / rig.drag_torque if rig.drag_torque > 0.0 else 1.0}}
    notes = tuple(f"{name}: {note}" for name, one in found.items() for note in one.notes)
    return Identified("threshold", parameters, goodness, snippet, curves, notes)


def _hysteresis(up: Onset, down: Onset) -> Parameter:
    assert up.value is not None
    assert down.value is not None
    value = 1.0 - down.value / up.value
    low = np.hypot((down.ci95[1] - down.value) / up.value, down.value * (up.value - up.ci95[0]) / up.value**2)
    high = np.hypot((down.value - down.ci95[0]) / up.value, down.value * (up.ci95[1] - up.value) / up.value**2)
    return Parameter(value, "", value - float(low), value + float(high))
