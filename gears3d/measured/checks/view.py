"""A record under examination, its findings, and quantities that several checks need; the rig as declared."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.signals import changes, count_of, noise_of, quantum, robust_deviation, some_steps
from gears3d.signals.orders import harmonics, phasors_of

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

# The columns of a record of two gears in mesh.
MESH = ("theta_drive_rad", "theta_loose_rad")


# Part of a revolution by which the angle between index marks may deviate: a wrong count, not another shaft.
NEAR = 0.2
# Revolutions between index marks that show a count.
FEW = 3


@dataclass(frozen=True)
class Declared:
    """What is declared of the bench; ``None`` where nothing is.

    Args:
        needs: columns that must be there besides time; alternatives as a tuple.
        radii: base radii of drive and loose gear [m].
        teeth: of drive and loose gear.
        backlash: along the line of action [m].
        mean_speed: of the drive gear where it is stated of this record [rad/s].
        fluctuation: sum of the amplitudes of the drive's harmonics where they are stated of this record [rad/s].
        harmonics: whether the harmonics are stated.
        usual_speed: mean speed of the drive gear in the rig's scenario, which this record may have or not [rad/s].
        sample_rate: [Hz].
        counts: per revolution, by column.
        stated_rate: that the file itself states and that its time was made of [Hz].
        marks: angle between index marks over a revolution, by column, where the record has marks.
        noise: standard deviation of a reading that an earlier check found, at least, by column [rad].
    """

    needs: tuple[str | tuple[str, ...], ...] = MESH
    radii: tuple[float, float] | None = None
    teeth: tuple[int, int] | None = None
    backlash: float | None = None
    mean_speed: float | None = None
    fluctuation: float = 0.0
    harmonics: bool = False
    usual_speed: float | None = None
    sample_rate: float | None = None
    counts: Mapping[str, float] = field(default_factory=dict)
    stated_rate: float | None = None
    marks: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)

    @property
    def meshed(self) -> bool:
        """Whether both gears were in mesh, so that one angle shows the other."""
        return set(MESH) <= set(self.needs)


def stated_of(condition: Mapping[str, Any], rig: Scenario | None, stated_motion: bool = False) -> frozenset[str]:
    """Return which parts of the drive's motion are stated of a record: ``mean``, ``harmonics``, ``record``.

    Any key of ``motion.harmonics`` states all harmonics of the rig with that change; the mean speed alone states no
    harmonics, and the reverse. A recorded motion states everything.

    >>> sorted(stated_of({"motion.mean": "90 rpm", "drag.torque": "1 N m"}, None))
    ['mean']
    """
    parts = {key.split(".")[1].split("[")[0] for key in condition if key.startswith("motion.")}
    if stated_motion or "motion" in condition:
        parts |= {"mean", "harmonics"}
    if rig is not None and rig.motion.record is not None and (stated_motion or "record" in parts):
        parts |= {"mean", "harmonics", "record"}
    return frozenset(parts & {"mean", "harmonics", "record"})


def declared(
    rig: Scenario | None,
    meta: Mapping[str, Any],
    needs: Sequence[str | Sequence[str]] = MESH,
    stated: Collection[str] = (),
) -> Declared:
    """Return what rig and metadata declare.

    >>> declared(None, {"base_radius_drive_m": 0.1, "base_radius_loose_m": 0.2}).radii
    (0.1, 0.2)
    """
    asked = tuple(need if isinstance(need, str) else tuple(need) for need in needs)
    one, other = meta.get("base_radius_drive_m"), meta.get("base_radius_loose_m")
    radii = (one, other) if isinstance(one, float) and isinstance(other, float) else None
    marks = _marks(meta)
    if rig is None:
        return Declared(asked, radii, marks=marks)
    values = rig.rig()
    counts = {
        name: float(sensor.counts_per_revolution)
        for name, sensor in zip(MESH, (rig.sensors.drive, rig.sensors.loose), strict=True)
        if sensor.counts_per_revolution
    }
    return Declared(
        asked,
        (values.base_radius_drive, values.base_radius_loose),
        (values.teeth_drive, values.teeth_loose),
        values.backlash,
        rig.motion.mean if rig.motion.record is None and "mean" in stated else None,
        sum(abs(harmonic.amplitude) for harmonic in rig.motion.harmonics) if "harmonics" in stated else 0.0,
        "harmonics" in stated,
        rig.motion.mean if rig.motion.record is None else None,
        rig.sensors.sample_rate if rig.sensors.stated else None,
        counts,
        rate if isinstance(rate := meta.get("stated_rate_Hz"), float) else None,
        marks,
    )


def _marks(meta: Mapping[str, Any]) -> dict[str, float]:
    """Return the usual angle between neighbouring index marks over a revolution, where it can be one."""
    found, seen = {}, meta.get("index_rad", {})
    for name in MESH:
        passed = np.abs(np.diff(np.array(seen.get(name.split("_")[1], []), float))) / (2 * np.pi)
        passed = passed[np.abs(passed - 1.0) < NEAR]  # neither lost marks nor one seen twice, nor a geared encoder
        if len(passed) >= FEW:
            found[name] = float(np.mean(passed))
    return found


@dataclass(frozen=True)
class Finding:
    """A finding of the gate in a record.

    Args:
        kind: one word with hyphens, the one to name where it is to be corrected: ``"skew"``, ``"time-not-rising"``.
        channel: the column it is in, or empty.
        size: how large, in ``unit``.
        unit: of the size, SI.
        evidence: one sentence with what was seen and where.
        remedy: what to do about it.
        fatal: whether the record cannot be used as it is.
        correctable: whether it can be corrected on demand.
        corrected: whether it was.
        rows: rows (from 0) it was seen in, the first few of many.
        parameters: further numbers that a correction needs, SI, by name.
    """

    kind: str
    channel: str
    size: float
    unit: str
    evidence: str
    remedy: str = ""
    fatal: bool = False
    correctable: bool = False
    corrected: bool = False
    rows: tuple[int, ...] = ()
    parameters: dict[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold.

        >>> Finding("skew", "theta_loose_rad", 2e-5, "s", "the loose gear reads 20 us later").to_dict()["kind"]
        'skew'
        """
        return {**vars(self), "rows": list(self.rows)}


# Rows from which typical values are estimated.
SOME = 200_000
# Noise of an encoder that rounds, in counts.
FLOOR = 0.3


class View:
    """Columns and what is declared of them.

    Args:
        columns: by name of the contract, each (n,).
        declared: of the bench.
    """

    def __init__(self, columns: Mapping[str, np.ndarray], declared: Declared) -> None:
        self.columns = dict(columns)
        self.declared = declared

    @property
    def time(self) -> np.ndarray:
        """Time of the rows [s], (n,)."""
        return self.columns["time_s"]

    @property
    def angles(self) -> dict[str, np.ndarray]:
        """Angles that are needed, by column [rad], each (n,)."""
        asked = {name for need in self.declared.needs for name in ((need,) if isinstance(need, str) else need)}
        return {name: self.columns[name] for name in MESH if name in asked and name in self.columns}

    @property
    def used(self) -> list[str]:
        """Names of the columns that are looked at."""
        asked = {name for need in self.declared.needs for name in ((need,) if isinstance(need, str) else need)}
        return ["time_s", *(name for name in self.columns if name in asked and name != "time_s")]

    @cached_property
    def spacing(self) -> float:
        """Median distance of the rows [s]."""
        return float(np.median(some_steps(self.time))) if len(self.time) > 1 else 0.0

    def changes(self, name: str) -> Iterator[tuple[int, np.ndarray]]:
        """Generate the changes of an angle from row to row [rad] in pieces, each with the number of its first one."""
        return changes(self.angles[name])

    def some_changes(self, name: str, run: int = 1) -> np.ndarray:
        """Return some changes of an angle from row to row, spread evenly [rad]."""
        angle = self.angles[name]
        if len(angle) - 1 <= SOME:
            return np.diff(angle)
        row = typical(np.arange(len(angle) - 1), run)
        return angle[row + 1] - angle[row]

    @cached_property
    def quanta(self) -> dict[str, float | None]:
        """Angle of one count [rad], by column; ``None`` for what shows no counts."""
        return {name: self._quantum(name, angle) for name, angle in self.angles.items()}

    def _quantum(self, name: str, angle: np.ndarray) -> float | None:
        """Return the declared count where the angles keep to it, else the one that shows by itself, if any does."""
        counts = self.declared.counts.get(name)
        some = self.some_changes(name)
        rounding = 1e-13 * float(np.abs(angle[:: max(len(angle) // 1000, 1)]).max(initial=0.0))
        if counts is not None:
            step = 2 * np.pi / counts
            whole = np.round(some / step)
            if rounding < 0.01 * step and np.mean(np.abs(some - whole * step) < 1e-3 * step + 10.0 * rounding) > 0.99:
                sizes = np.unique(np.abs(whole)).astype(np.int64)
                return step * max(int(np.gcd.reduce(sizes)), 1) if len(sizes) > 2 else step
        found = quantum(angle) or count_of(angle)  # fast turning, no change may be a single count
        return found if found is not None and np.ptp(some) > 0.5 * found else None

    @cached_property
    def band(self) -> Band | None:
        """Short blocks and stretches in contact; ``None`` without a rig."""
        return band_of(self)

    @cached_property
    def places(self) -> Places | None:
        """Where the active flank lies; ``None`` where the record does not show it."""
        return None if self.band is None else places_of(self, self.band)

    @cached_property
    def noise(self) -> dict[str, float]:
        """Standard deviation of one reading of each angle [rad], rounding to counts among it."""
        return {name: self._noise(name) for name in self.angles}

    def _noise(self, name: str) -> float:
        bend = np.abs(np.diff(self.some_changes(name, run=64)))
        usual = 1.4826 * max(float(np.median(bend)) if len(bend) else 0.0, 0.5 * (self.quanta[name] or 0.0))
        bend = bend[bend <= 4.0 * usual]  # not the median itself: of counts it takes few values
        seen = float(np.sqrt(np.mean(bend**2) / 6.0)) if len(bend) else 0.0
        scale = float(np.abs(self.angles[name][:: max(len(self.time) // 1000, 1)]).max(initial=0.0))
        return max(seen, self.declared.noise.get(name, 0.0), FLOOR * (self.quanta[name] or 0.0), 4e-16 * scale)


def typical(values: np.ndarray, run: int = 1) -> np.ndarray:
    """Return some of many values, spread evenly.

    ``values``: (n,).

    >>> typical(np.arange(3)).tolist(), len(typical(np.arange(1_000_000)))
    ([0, 1, 2], 200000)
    """
    if len(values) <= SOME:
        return values
    if run == 1:
        return values[:: len(values) // SOME][:SOME]
    count = SOME // run
    first = np.linspace(0, len(values) - run, count).astype(np.intp)
    return values[(first[:, None] + np.arange(run)).ravel()]


def when(time: np.ndarray, rows: np.ndarray) -> str:
    """Return the first few times of some rows as text.

    ``time``: [s], (n,); ``rows``: indices, (k,).

    >>> when(np.arange(10.0), np.arange(5))
    't = 0, 1, 2 s ...'
    """
    shown = ", ".join(f"{time[row]:.6g}" for row in rows[:3])
    return f"t = {shown} s" + (" ..." if len(rows) > 3 else "")


# In contact the displacement is constant but for transmission error and, where one channel is read later than the
# other, the delay times the speed. Stretches in contact are those in which the displacement, without a delay that is
# estimated with them, changes by no more than its noise. Flanks need not be known.

# First length of a block [s].
SHORTEST = 2.5e-4
# Noise of a block's speed over the highest speeds, at most.
QUIET = 0.03
# Blocks in a stretch.
STRETCH = 4
# Blocks among which the delay is sought.
SEARCHED = 8000
# Delays that are tried [s].
DELAYS = np.concatenate([-np.geomspace(1e-2, 1e-6, 80), [0.0], np.geomspace(1e-6, 1e-2, 80)])
# Ratio of blocks at rest with and without a delay from which the delay is used.
STILLER = 1.5
# Blocks in a period of the drive's motion, at least.
PERIOD = 60
# Ratio of the intervals for acceleration and speed: its noise is that of the displacement, too, and where both share
# a block it imitates a delay.
SMOOTHER = 4
# Ratio of a spectral line to the noise around it.
LINE = 12.0
# Part of its mean speed by which a drive that turns evenly may fluctuate.
EVEN = 1e-4
# Part of the backlash that the noise of a block may be: with more, flight and contact are not distinguishable.
BLURRED = 0.01


class Band(NamedTuple):
    """Blocks of a record, each (m,).

    Args:
        time: [s].
        drive: [rad].
        loose: [rad].
        place: displacement Rb2·θ_loose − Rb1·θ_drive, zero anywhere [m].
        speed: of the loose gear as the drive gives it [rad/s].
        acceleration: of the same [rad/s²].
        stretch: number of the stretch in contact, -1 outside.
        noise: of ``place`` [m].
        width: of a block [s].
        frequency: at which the drive's speed changes most [Hz], 0 when it does not.
    """

    time: np.ndarray
    drive: np.ndarray
    loose: np.ndarray
    place: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    stretch: np.ndarray
    noise: float
    width: float
    frequency: float


def band_of(view: View) -> Band | None:
    """Return the blocks of a record, ``None`` when it is too short or the rig is not known."""
    declared = view.declared
    if not declared.meshed or declared.radii is None or declared.backlash is None or len(view.angles) < 2:
        return None
    if view.spacing <= 0.0 or len(view.time) < 1000:
        return None
    frequency = _frequency(view)
    longest = min(1.0 / (PERIOD * frequency) if frequency else 1e-2, 1e-2, 1e-3 * len(view.time) * view.spacing)
    size = max(int(SHORTEST / view.spacing), 1)
    while True:
        time, drive, loose = (_means(values, size) for values in (view.time, *view.angles.values()))
        place = declared.radii[1] * (loose - loose[0]) - declared.radii[0] * (drive - drive[0])
        noise = max(noise_of(time, place), 1e-6 * declared.backlash)
        width = size * view.spacing
        moved = np.abs(np.diff(place))
        lively = max(float(np.quantile(moved, 0.9)), 0.1 * declared.backlash * width / 0.02)
        if noise * np.sqrt(2.0) < QUIET * lively or 2.0 * width > longest:
            break
        size *= 2
    reach = max(round(1.0 / (PERIOD * frequency) / width), 1) if frequency else 8
    ratio = declared.radii[0] / declared.radii[1]
    speed = ratio * _slope(time, drive, reach)
    smooth = SMOOTHER * reach
    acceleration = ratio * _slope(time, _slope(time, drive, smooth), smooth)
    if noise > BLURRED * declared.backlash:
        return None
    stretch = _stretches(time, place, declared.radii[1] * acceleration, noise)
    return Band(time, drive, loose, place, speed, acceleration, stretch, noise, width, frequency)


def _means(values: np.ndarray, size: int) -> np.ndarray:
    count = len(values) // size
    return values[: count * size].reshape(count, size).mean(axis=1)


def _slope(time: np.ndarray, values: np.ndarray, reach: int) -> np.ndarray:
    at = np.arange(len(time))
    low, high = np.maximum(at - reach, 0), np.minimum(at + reach, len(time) - 1)
    return (values[high] - values[low]) / (time[high] - time[low])


def _frequency(view: View) -> float:
    """Return the strongest frequency of the drive's speed about its mean [Hz], 0 when it turns evenly."""
    angle = view.angles[MESH[0]]
    size = max(len(angle) // 16_384, 1)
    time, angle = _means(view.time, size), _means(angle, size)
    way = float(angle[-1] - angle[0])
    window = np.hanning(len(time))
    rest = (angle - np.linspace(angle[0], angle[-1], len(angle))) * window
    lines = np.abs(np.fft.rfft(rest - rest.mean())) * 2.0 / window.sum()
    lasting = float(time[-1] - time[0])
    speeds = lines * 2 * np.pi * np.arange(len(lines)) / lasting
    speeds[:2] = 0.0
    speeds[lines < LINE * np.median(lines[len(lines) // 2 :])] = 0.0
    at = int(np.argmax(speeds))
    return at / lasting if speeds[at] > EVEN * abs(way) / lasting else 0.0


def _stretches(time: np.ndarray, place: np.ndarray, pull: np.ndarray, noise: float) -> np.ndarray:
    """Return the number of each block's stretch in contact, -1 outside, (m,).

    ``time``: [s], (m,); ``place``: [m], (m,); ``pull``: acceleration along the line of action [m/s²], (m,); ``noise``:
    of ``place`` [m].
    """
    step = np.diff(time)
    speed = np.diff(place) / step
    pull = 0.5 * (pull[1:] + pull[:-1])
    sigma = np.sqrt(2.0) * noise / float(np.median(step))
    scale = 2.0 * sigma + 0.01 * float(np.quantile(np.abs(speed), 0.9))
    some = slice(None, None, max(len(speed) // SEARCHED, 1))
    score = np.array([np.mean(np.exp(-0.5 * ((speed[some] + pull[some] * one) / scale) ** 2)) for one in DELAYS])
    best = int(np.argmax(score))
    delay = DELAYS[best] if score[best] > STILLER * score[len(DELAYS) // 2] else 0.0
    still = np.abs(speed + pull * delay) < 2.0 * scale
    edge = np.diff(np.concatenate([[False], still, [False]]).astype(np.int8))
    first, last = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1)
    number = np.full(len(time), -1)
    for k, (begin, end) in enumerate(zip(first, last, strict=True)):
        if end - begin + 1 >= STRETCH:
            number[begin : end + 1] = k
    return number


# Revolutions of the slower gear below which a wave is not distinguishable from a drift.
TURNS = 3.0
WINDOWS = 400
# Windows in a revolution of the faster gear, at most.
PARTS = 16
ORDERS = (1, 2)
MOST = 12_000
# Part of the blocks out of contact from which a gear is in flight.
FLIES = 0.02
# Blocks in contact that a window needs.
FEWEST = 5
# Part of the backlash within which contact near the lowest of a window is that of the same flank.
BESIDE = 0.1
# Part of a wave that other columns leave at least: a variance inflation factor of 50.
DISTINCT = 0.02
# Windows at both ends, in which no step is sought.
SPARE = 4


class Places(NamedTuple):
    """The active flank over the record.

    Args:
        level: the place without its waves, in the middle of the record [m].
        waves: complex amplitude of the place, A·exp(iφ) for A·cos(kθ + φ), by (column, order) [m].
        sigma: of each amplitude [m].
        drift: how far the place moves over the record [m].
        drift_sigma: [m].
        step: how far it moves at once where that explains it better than a steady drift [m], else 0.
        step_sigma: [m].
        step_time: when [s].
        turns: of the slower gear.
    """

    level: float
    waves: dict[tuple[str, int], complex]
    sigma: float
    drift: float
    drift_sigma: float
    step: float
    step_sigma: float
    step_time: float
    turns: float


def places_of(view: View, band: Band) -> Places | None:
    """Return where the active flank lies, ``None`` where the record is too short or contact is not seen.

    In each window of time the place of contact that lies lowest is taken, as the drag brings the loose gear back to its
    active flank in every period; then the mean of all contact near it.
    """
    inside = np.flatnonzero(band.stretch >= 0)
    inside = inside[:: max(len(inside) // MOST, 1)]
    window = np.floor((band.time[inside] - band.time[0]) / _length(band)).astype(np.intp)
    lowest = _lowest(band.place[inside], window)
    table, names = _table(view, band, inside)
    turns = min(abs(float(np.ptp(angle))) / (2 * np.pi) for angle in (band.drive, band.loose))
    if turns < TURNS or len(lowest) < 2 * table.shape[1]:
        return None
    table, names = _distinct(table, names, lowest)
    waving = table[:, 1:-1] @ _robust(table[lowest], band.place[inside][lowest], 0.1 * band.noise)[0][1:-1]
    near = _near(band.place[inside] - waving, window, lowest, BESIDE * (view.declared.backlash or 0.0))
    rows, at = np.unique(window[near], return_inverse=True)
    count = np.bincount(at)
    mean = [np.bincount(at, column[near]) / count for column in (*table.T, band.place[inside], band.time[inside])]
    table, place, time = np.column_stack(mean[:-2]), mean[-2], mean[-1]
    if len(rows) < 2 * table.shape[1]:
        return None
    numbers, off, spread = _robust(table, place, 0.1 * band.noise)
    sigma = np.sqrt(np.diag(spread))
    step = _step(table[:, :-1], place, time, float(off @ off))
    if step[0] != 0.0:
        stepping = np.column_stack([table[:, :-1], time > step[2]])
        refit, _, spread = _robust(stepping, place, 0.1 * band.noise)
        numbers[:-1], sigma[:-1] = refit[:-1], np.sqrt(np.diag(spread))[:-1]
    waves = dict(zip(names, phasors_of(numbers[1:-1]).tolist(), strict=True))
    return Places(
        float(numbers[0]),
        waves,
        float(sigma[1:-1].max(initial=0.0)),
        float(numbers[-1]),
        float(sigma[-1]),
        *step,
        turns,
    )


def _length(band: Band) -> float:
    """Return the length of a window [s]: a part of a turn, and a period of the drive's motion where the gear flies."""
    lasting = float(band.time[-1] - band.time[0])
    fastest = max(float(np.ptp(band.drive)), float(np.ptp(band.loose))) / (2 * np.pi * lasting)
    length = max(lasting / WINDOWS, 1.0 / (PARTS * max(fastest, 1e-12)))
    flies = np.mean(band.stretch < 0) > FLIES
    return max(length, 1.0 / band.frequency) if band.frequency and flies else length


def _lowest(place: np.ndarray, window: np.ndarray) -> np.ndarray:
    """Return the row in each window that lies lowest, but for the lowest tenth, (w,)."""
    order = np.lexsort((place, window))
    first = np.flatnonzero(np.diff(window[order], prepend=-1))
    count = np.diff(np.append(first, len(order)))
    return order[first + count // 10][count >= FEWEST]


def _near(place: np.ndarray, window: np.ndarray, lowest: np.ndarray, reach: float) -> np.ndarray:
    """Return the rows that lie no further from the lowest one of their window than ``reach`` [m], indices."""
    low = np.full(int(window.max()) + 1, np.inf)
    low[window[lowest]] = place[lowest]
    return np.flatnonzero(np.abs(place - low[window]) < reach)


def _table(view: View, band: Band, rows: np.ndarray) -> tuple[np.ndarray, list[tuple[str, int]]]:
    """Return constant, waves and drift at some blocks, and the names of the waves."""
    radii = view.declared.radii or (1.0, 1.0)
    angles = {MESH[0]: band.drive[rows]}
    if abs(radii[0] / radii[1] - 1.0) > 1e-6:
        angles[MESH[1]] = band.loose[rows]
    names = [(name, order) for name in angles for order in ORDERS]
    columns = [np.ones(len(rows))]
    columns += [harmonics(angles[name], [order]) for name, order in names]
    lasting = float(band.time[-1] - band.time[0])
    return np.column_stack([*columns, (band.time[rows] - band.time[0]) / lasting - 0.5]), names


def _distinct(
    table: np.ndarray, names: list[tuple[str, int]], rows: np.ndarray
) -> tuple[np.ndarray, list[tuple[str, int]]]:
    """Return the table and the names without waves that other columns nearly imitate in some rows.

    Where the fluctuation is locked to a revolution, rattle comes back to the flank at some angles only.
    """
    kept = list(range(len(names)))
    for k in reversed(range(len(names))):
        others = [0, *(1 + 2 * one + j for one in kept if one != k for j in (0, 1)), table.shape[1] - 1]
        frame, own = np.linalg.qr(table[np.ix_(rows, others)])[0], table[rows, 1 + 2 * k : 3 + 2 * k]
        left = own - frame @ (frame.T @ own)
        if np.linalg.eigvalsh(left.T @ left)[0] < DISTINCT * 0.5 * len(rows):
            kept.remove(k)
    columns = [0, *(1 + 2 * one + j for one in kept for j in (0, 1)), table.shape[1] - 1]
    return table[:, columns], [names[one] for one in kept]


def _robust(table: np.ndarray, values: np.ndarray, floor: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return coefficients, residuals and covariance of a least-squares fit with Tukey's weights."""
    weight = np.ones(len(values))
    numbers = off = np.zeros(0)
    rough = floor
    for _ in range(5):
        numbers = np.linalg.lstsq(table * weight[:, None], values * weight, rcond=None)[0]
        off = values - table @ numbers
        rough = max(robust_deviation(off), floor)
        weight = np.sqrt(np.clip(1.0 - (off / (6.0 * rough)) ** 2, 0.0, None))
    return numbers, off, rough**2 * np.linalg.pinv((table * weight[:, None] ** 2).T @ table)


def _step(table: np.ndarray, place: np.ndarray, time: np.ndarray, drifting: float) -> tuple[float, float, float]:
    """Return the step that explains the places at least twice as well as a drift, its sigma and time; 0 for none."""
    base = np.linalg.qr(table)[0]
    rest = place - base @ (base.T @ place)
    best, found, sigma, when = 0.5 * drifting, 0.0, 0.0, 0.0
    for k in range(SPARE, len(place) - SPARE):
        step = (np.arange(len(place)) >= k).astype(float)
        step -= base @ (base.T @ step)
        size = float(step @ rest) / float(step @ step)
        left = float(np.square(rest - size * step).sum())
        if left < best:
            best, found, when = left, size, float(0.5 * (time[k] + time[k - 1]))
            sigma = float(np.sqrt(left / len(place) / (step @ step)))
    return found, sigma, when
