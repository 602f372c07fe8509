"""Models started from measured states: their deviation from the measured path, in windows over the complete records.

Over a period the motion has no time to diverge by chance; the effect of a wrong cause still shows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import table
from gears3d.diagnosis.prediction import deviation, reading_error
from gears3d.diagnosis.preprocessing import moved, turn
from gears3d.diagnosis.residual_patterns import Structure
from gears3d.effects import Code, SensorEffect
from gears3d.lumped.pickup import Start, pick_up
from gears3d.lumped.rigid import tooth
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence
    from gears3d.diagnosis.verdict import Named
    from gears3d.measured.checks import Admitted
    from gears3d.measured.segmentation import Track
    from gears3d.scenario import Scenario

Array = np.ndarray
# Maximum duration of a window, or a stretch, in seconds; half of that if the drive does not fluctuate.
LONGEST = 2.0
# Number of windows of a record in which models are compared with the measurement.
WINDOWS = 8
# Ratio of distances above which one counts as larger, and the probability by chance of as many larger ones.
FARTHER, CHANCE = 1.05, 0.01
# Largest squared distance of the extended rig, relative to the rig's, and its largest ratio to the noise.
HARDLY, NOISY = 0.5, 5.0
# Noise of a displacement [m] of a record without any.
ROUNDING = 1e-15
# Samples per second; readings are averaged to it, which reduces noise.
RATE = 8000.0
# Minimum and maximum number of points that define the drive's motion in the models.
KNOTS = (24, 4000)
# Time to either side for the estimate of place and speed without a segmented flight [s].
BESIDE = 2.5e-3
# Limits of the middle of the gap, relative to the backlash.
AMID = (0.3, 0.7)


class Begin(NamedTuple):
    """Initial state: time [s], displacement [m] and its rate [m/s], or the flank in contact."""

    time: float
    place: float
    rate: float
    riding: int | None = None


class PathErrors(NamedTuple):
    """Deviation of models from the measured path, from measured states on: windows of a period over all records.

    Args:
        record: name of each window's record, (w,).
        noise: of the measured displacement, (w,) [m].
        base: root mean square distance of the rig's displacement from the measured one, (w,) [m].
        extended: the same of the extended rig, (w,).
        without: the same of the extended rig without each of the causes, (c, w).
    """

    record: tuple[str, ...]
    noise: Array
    base: Array
    extended: Array
    without: Array

    def refuted(self) -> list[bool]:
        """Return for each cause whether the path is predicted better without it; true for all if the rig is better."""
        if _farther(self.extended, self.base):
            return [True] * len(self.without)
        return [_farther(self.extended, own) for own in self.without]

    def left(self) -> list[Structure]:
        """Return the residual of the path with the extended rig if it is hardly smaller than with the rig."""
        if not len(self.base):
            return []
        base, extended, noise = (float(np.mean(one**2)) for one in (self.base, self.extended, self.noise))
        noise = max(noise, ROUNDING**2)
        if extended < max(HARDLY * base, NOISY**2 * noise):
            return []
        worst, size = self.record[int(np.argmax(self.extended))], float(np.sqrt(extended))
        return [Structure("path.all", extended / noise, 0.0, size, "m", float("nan"), extended / noise, worst)]


def _farther(one: Array, other: Array) -> bool:
    """Return whether distances are larger as a whole, and in significantly more windows."""
    from scipy.stats import binomtest

    if not len(one) or float(np.sum(one**2)) <= float(np.sum(other**2)):
        return False
    more, less = int(np.sum(one > FARTHER * other)), int(np.sum(other > FARTHER * one))
    return bool(more > 0 and binomtest(more, more + less, 0.5, "greater").pvalue < CHANCE)


def path_errors(
    records: Sequence[Evidence],
    causes: Sequence[Named],
    admitted: Sequence[Admitted],
    track: Callable[[Admitted], Track],
) -> PathErrors:
    """Return the deviations of rig and extended rig from the measured paths."""
    named, noise, far = [], [], []
    for one in admitted:
        seen = next((each for each in records if each.name == one.file), None)
        if seen is None or one.rig is None:
            continue
        known = track(one)
        own, tables = as_read(seen, causes)
        rigs = [one.rig, with_effects(one.rig, tables)]
        rigs += [with_effects(one.rig, tables[:k] + tables[k + 1 :]) for k in range(len(tables))]
        zeros = [zero_of(known, own, rig) for rig in rigs]
        period = one.rig.period if one.rig.motion.harmonics else 0.25 * LONGEST
        span, first, last = min(period, LONGEST), float(known.time[0]), float(known.time[-1])
        free = first  # overlapping windows are not independent
        for at in np.linspace(first, max(last - 2.0 * period - span, first), WINDOWS):
            begin = begin_of(known, own, zeros[1], one.rig, float(at))
            if begin.time < free or begin.time + span > last:
                continue
            free = begin.time + span
            measured, few = readings(known, own, zeros[1], (begin.time, begin.time + span), one.rig)
            place = measured.signals["displacement_m"]
            row = []
            for rig, zero in zip(rigs, zeros, strict=True):
                start = begin._replace(place=begin.place + zeros[1] - zero)
                made = followed(rig, rigs[1], start, zero, span, known)[0]
                path = np.interp(measured.time, made.time, made.signals["displacement_m"])
                row.append(float(np.sqrt(np.mean((path + zero - place - zeros[1]) ** 2))))
            named.append(one.file)
            noise.append(known.noise / np.sqrt(few))
            far.append(row)
    table_of = np.array(far).T if far else np.zeros((2 + len(causes), 0))
    return PathErrors(tuple(named), np.array(noise), table_of[0], table_of[1], table_of[2:])


def with_effects(rig: Scenario, tables: Sequence[dict[str, Any]]) -> Scenario:
    """Return a rig with more effects."""
    return rig.with_([("effect[+]", each) for each in tables]) if tables else rig


def as_read(seen: Evidence, causes: Sequence[Named]) -> tuple[Evidence, list[dict[str, Any]]]:
    """Return a record's evidence, and causes, over the angles as read."""
    turned = seen.turned
    if turned == (0.0, 0.0):
        return seen, [cause.table for cause in causes]
    return turn(seen, -turned[0], -turned[1]), [table(moved(cause.effect, *turned)) for cause in causes]


def _place(known: Track, drive: Array, loose: Array) -> Array:
    """Return the displacement, with the datum of both angles [m]."""
    return known.radii[1] * loose - known.radii[0] * drive


def zero_of(known: Track, seen: Evidence | None, extended: Scenario) -> float:
    """Return the displacement of the record on the active flank, without deviations [m]."""
    own = seen.channels.contacts if seen is not None else None
    if seen is not None and own is not None and len(own.time):
        rows, b = extended.rows(), extended.rig().backlash
        flanks = deviation(rows, seen.pair, own.drive, own.loose, own.flank) + b * own.flank
        rest = _place(known, own.drive, own.loose) - flanks
        late = reading_error(seen.spared, "loose", own.loose, known.steady.curve(own.time, 1) * _ratio(known))
        return float(np.median(rest + known.radii[1] * late))
    some = slice(None, None, max(len(known.time) // 200_000, 1))
    low, high = np.quantile(known.place[some], [0.002, 0.998])
    b = extended.rig().backlash
    first = known.radii[1] * known.origin[1] - known.radii[0] * known.origin[0]
    return first + float(0.5 * (low + high - b) if high - low > 0.8 * b else low)


def _ratio(known: Track) -> float:
    return known.radii[0] / known.radii[1]


def begin_of(known: Track, seen: Evidence | None, zero: float, rig: Scenario, half: float) -> Begin:
    """Return the start of a stretch: in the middle of the longest flight of a period after a time."""
    period = rig.period if rig.motion.harmonics else 0.25 * LONGEST
    if seen is not None and len(seen.fine[0]):
        time, angle, speed = (column[:, column.shape[1] // 2] for column in seen.fine)
        lasts = seen.fine[0][:, -1] - seen.fine[0][:, 0]
        near = np.flatnonzero((time >= half) & (time < half + period))
        at = int(near[np.argmax(lasts[near])]) if len(near) else int(np.argmin(np.abs(time - half)))
        drive, rate = known.steady.curve(time[at]), known.steady.curve(time[at], 1)
        place = known.radii[1] * (angle[at] - _beside(seen, at)) - known.radii[0] * drive - zero
        return Begin(float(time[at]), float(place), float(known.radii[1] * speed[at] - known.radii[0] * rate))
    return _amid(known, zero, rig, half)


def _beside(seen: Evidence, at: int) -> float:
    """Return the deviation of bin means of a flight from its curved path [rad]."""
    time, _, speed = (column[at] for column in seen.fine)
    width = float(np.median(np.diff(seen.channels.flights.time[at])))
    return float((speed[-1] - speed[0]) / (time[-1] - time[0])) * width**2 / 24.0


def _amid(known: Track, zero: float, rig: Scenario, half: float) -> Begin:
    """Return the first crossing of the gap after a time, or the flank with permanent contact."""
    b, first = rig.rig().backlash, int(np.searchsorted(known.time, half))
    drive, loose, _ = known.part(slice(first, None))
    share = (_place(known, drive, loose) - zero) / b
    between = np.flatnonzero((share > AMID[0]) & (share < AMID[1]))
    if not len(between):
        return Begin(half, 0.0, 0.0, 0 if np.median(share) < 0.5 else 1)
    at = float(known.time[first + between[0]])
    rows = slice(*np.searchsorted(known.time, [at - BESIDE, at + BESIDE]))
    drive, loose, _ = known.part(rows)
    line = np.polyfit(known.time[rows] - at, _place(known, drive, loose) - zero, 2)
    return Begin(at, float(line[2]), float(line[1]))


def readings(
    known: Track, seen: Evidence | None, zero: float, span: tuple[float, float], rig: Scenario
) -> tuple[Recording, int]:
    """Return the averaged readings of a stretch, and the number of readings per sample."""
    first, last = np.searchsorted(known.time, span)
    few = max(int(1.0 / (RATE * known.spacing)), 1)
    count = max((last - first) // few, 1)
    rows = slice(first, first + count * few)
    time, loose = (values[rows].reshape(count, -1).mean(axis=1) for values in (known.time, known.loose))
    drive = known.steady.curve(time)
    signals = {
        "time_s": time,
        "theta_drive_rad": drive,
        "theta_loose_rad": loose,
        "omega_drive_rad_s": known.steady.curve(time, 1),
        "displacement_m": _place(known, drive, loose) - zero,
    }
    meta = {"model": "measured", "title": rig.title}
    return Recording(signals, _impacts(known, seen, span, rig), meta), few


def _impacts(known: Track, seen: Evidence | None, span: tuple[float, float], rig: Scenario) -> dict[str, Array]:
    if seen is None:
        return {}
    own, values = seen.channels.impacts, rig.rig()
    keep = (own.time >= span[0]) & (own.time <= span[1])
    velocity, rebound = own.velocity[keep], own.rebound[keep]
    return {
        "time_s": own.time[keep],
        "flank": own.flank[keep],
        "velocity_m_s": velocity,
        "rebound_m_s": rebound,
        "impulse_N_s": values.inertia / known.radii[1] ** 2 * (rebound - velocity),
        "tooth_drive": tooth(own.drive[keep], values.teeth_drive),
        "tooth_loose": tooth(own.loose[keep], values.teeth_loose),
    }


def followed(
    rig: Scenario, extended: Scenario, begin: Begin, zero: float, span: float, known: Track
) -> tuple[Recording, float]:
    """Return the prediction of a stretch by a rig as read by its encoders, and the shift of its flanks by these [m]."""
    time = np.linspace(begin.time, begin.time + span, _knots(known, span))
    read, speed = known.steady.curve(time), known.steady.curve(time, 1)
    sensors = [one for one in rig.effects if isinstance(one, SensorEffect)]
    wrong = _misread(known, sensors, read, speed, zero + begin.place)
    more = _swing(extended, time) - _swing(rig, time)  # a motion effect of the extended rig only
    drive = read - reading_error(sensors, "drive", read, speed) - (more - more[0])
    rate = begin.rate - known.radii[0] * float(np.gradient(drive - read, time, edge_order=2)[0])
    rate -= float(np.gradient(wrong, time, edge_order=2)[0])
    loose = (begin.place + zero + known.radii[0] * read[0]) / known.radii[1]
    start = Start(begin.time, float(drive[0]), float(loose), float(begin.place - wrong[0]), rate)
    made = pick_up(rig, start, time, drive, RATE, begin.riding)
    signals = dict(made.signals)
    signals["displacement_m"] = signals["displacement_m"] + np.interp(made.time, time, wrong)
    return Recording(signals, made.impacts, made.meta), 1.1 * float(np.abs(wrong).max())


def _knots(known: Track, span: float) -> int:
    """Return the number of points of the drive's motion: two per knot interval of its curve."""
    return int(np.clip(np.ceil(2.0 * span / known.steady.curve.bends) + 1, *KNOTS))


def _misread(known: Track, sensors: Sequence[Any], drive: Array, speed: Array, place: float) -> Array:
    """Return the contribution of sensors to the displacement, with its mean as the record's datum [m]."""
    loose = (place + known.radii[0] * drive) / known.radii[1]
    wrong = known.radii[1] * reading_error(sensors, "loose", loose, speed * _ratio(known))
    wrong = wrong - known.radii[0] * reading_error(sensors, "drive", drive, speed)
    return wrong - wrong.mean()


def _swing(rig: Scenario, time: Array) -> Array:
    """Return the contribution of motion effects to the drive's angle [rad]."""
    total = np.zeros_like(time)
    for row in rig.rows():
        if row.code == Code.MOTION_HARMONIC:
            turn = 2.0 * pi * row.p[1]
            total -= row.p[0] / turn * np.cos(turn * time + row.p[2])
    return total
