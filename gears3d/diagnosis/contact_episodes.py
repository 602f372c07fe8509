"""Contact episodes, and the fit of laws of contact and causes to them, without segmentation.

An episode is a short path of the loose gear from the middle of the gap to a flank and back. The motion on a flank, or
in the last micrometres before it, is lost once a record is segmented into flights and contacts by rigid flanks. Here
nothing is segmented: an episode begins in the middle of the gap, where only the drag acts, and continues for a few
falls across the gap; its start is free.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import SLOPE_STEP, Cause
from gears3d.diagnosis.prediction import deviation, torque
from gears3d.effects import Code, Row
from gears3d.errors import InputError
from gears3d.lumped import visits as paths

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.gears import Pair
    from gears3d.measured.segmentation.displacement import Track
    from gears3d.scenario import Scenario

Array = np.ndarray
# Step of the grid [s].
GRID_STEP = 1.25e-4
# Grid steps per point.
STEPS_PER_POINT = 4
# Maximum number of contact episodes of a record.
MOST_EPISODES = 24
# Length of a contact episode, in falls across the gap.
EPISODE_FALLS = 3.0
# Maximum length in seconds.
LONGEST_EPISODE = 0.2
# Minimum number of points of a contact episode.
FEWEST_POINTS = 24
# Fraction of a fall over which the start is estimated.
START_FALLS = 0.12
# Lower limit of the standard deviation of a place [m].
SMALLEST_SIGMA = 2e-8
# Maximum number of Gauss-Newton rounds.
ROUNDS = 12
# Chi-square per point above which a contact episode contributes by its logarithm only.
CLIPPED_EPISODE = 25.0
# Relative change of the cost that ends the fit.
CONVERGED = 1e-3
# Steps of place [m] and speed [m/s], for slopes.
START_STEPS = (1e-7, 1e-4)
# Largest step of a number in a round, in units or in its natural logarithm.
LARGEST_STEP = 0.7
# Rows that act at the flanks only, and the position of their numbers in a law.
_LAWS = {Code.IMPACT_OFFSET: (paths.RESTITUTION,), Code.IMPACT_SLOPE: (paths.SLOPE,),
         Code.IMPACT_FLANK: (paths.ASYMMETRY,), Code.TORQUE_FRICTION: (paths.FRICTION,),
         Code.GAP_SPRING: (paths.STIFFNESS, paths.DAMPING)}  # fmt: skip
# Channels of laws of contact.
LAW_CHANNELS = ("visit",)
# Smallest ratio of sizes of a cause after and before a round: laws of contact have no sign.
SMALLEST_RATIO = 0.3


# The motion on a flank, or in the last micrometres before it, is lost once a record is segmented into flights and
# contacts by rigid flanks. Here nothing is segmented: an episode begins in the middle of the gap, where only the drag
# acts, and continues for a few falls across the gap; its start is free.


@dataclass(frozen=True, eq=False)
class ContactEpisodes:
    """Contact episodes of one record.

    Args:
        name: of the record.
        scenario: of the test rig under the record's conditions.
        rig: its constants.
        pair: its nominal gears.
        time: of the grids [s], (w, n).
        drive: angle of the drive on the grids [rad], (w, n).
        rate: of the drive [rad/s], (w, n).
        loose: angle of the loose gear on the grids, smoothed [rad], (w, n).
        sizes: number of valid points of each grid, (w,).
        place: of the loose gear along its base circle, from the episode's own datum [m], (w, k).
        sigma: of the place [m]; infinite beyond the end of an episode, (w, k).
        flank: place of the active flank without deviations, from the same datum, without the record's datum [m], (w,
            n).
        zero: estimate of the record's datum [m].
        starts: estimates of the initial place [m] and speed [m/s], (w, 2).
    """

    name: str
    scenario: Scenario
    rig: Rig
    pair: Pair
    time: Array
    drive: Array
    rate: Array
    loose: Array
    sizes: Array
    place: Array
    sigma: Array
    flank: Array
    zero: float
    starts: Array


def subset(records: Sequence[ContactEpisodes], most: int) -> list[ContactEpisodes]:
    """Return about a number of contact episodes, spread evenly over the records; at least one of each."""
    every = max(sum(len(one.sizes) for one in records) // most, 1)
    columns = ("time", "drive", "rate", "loose", "sizes", "place", "sigma", "flank", "starts")
    return [replace(one, **{name: getattr(one, name)[::every] for name in columns}) for one in records]


def contact_episodes(known: Track, scenario: Scenario, name: str = "") -> ContactEpisodes | None:
    """Return the contact episodes of a record; ``None`` if the gear is never in the middle of the gap."""
    rig = scenario.rig()
    begins, zero, fall = _crossings(known, rig)
    if not len(begins):
        return None
    length = int(min(EPISODE_FALLS * fall, LONGEST_EPISODE) / (GRID_STEP * STEPS_PER_POINT))
    grid = np.arange(length * STEPS_PER_POINT + 1) * GRID_STEP
    begins = begins[begins + grid[-1] < known.time[-1]]
    if length < FEWEST_POINTS or not len(begins):
        return None
    begins = begins[np.unique(np.linspace(0, len(begins) - 1, MOST_EPISODES).astype(int))]
    time = begins[:, None] + grid
    edges = begins[:, None] + np.arange(length + 1) * GRID_STEP * STEPS_PER_POINT
    loose, sigma = _interval_means(known, edges)
    radii = known.radii
    base = np.nanmean(loose[:, :3], axis=1, keepdims=True)
    origin = float(known.loose[0]) - radii[0] / radii[1] * float(known.drive[0])
    drive, rate = known.steady.curve(time), known.steady.curve(time, 1)
    flank = radii[0] * drive - radii[1] * (base - origin)
    place = radii[1] * (loose - base)
    level = np.hypot(radii[1] * sigma, SMALLEST_SIGMA)
    level[~np.isfinite(place)] = np.inf
    place = np.where(np.isfinite(place), place, 0.0)
    middle = (np.arange(length) + 0.5) * GRID_STEP * STEPS_PER_POINT
    starts = _initial_states(middle, place, level, fall)
    smooth = np.array([np.interp(grid, middle, row) for row in place]) / radii[1] + base
    sizes = np.full(len(begins), len(grid))
    return ContactEpisodes(name, scenario, rig, scenario.pair(), time, drive, rate, smooth, sizes, place, level, flank,
                           zero, starts)  # fmt: skip


def _crossings(known: Track, rig: Rig) -> tuple[Array, float, float]:
    """Return times in the middle of the gap, an estimate of the active flank's place, and the duration of a fall."""
    b = rig.backlash
    slowed = max(rig.drag_torque * rig.base_radius_loose / rig.inertia, 1e-3)
    fall = float(np.sqrt(2.0 * b / slowed))
    size = max(int(2.0 * GRID_STEP * STEPS_PER_POINT / np.median(np.diff(known.time))), 1)
    count = len(known.time) // size
    time, place = (x[: count * size].reshape(count, size).mean(axis=1) for x in (known.time, known.place))
    low, high = np.quantile(place, [0.002, 0.998])
    zero = 0.5 * (low + high - b) if high - low > 0.8 * b else float(low)
    level = zero + 0.5 * min(b, high - low)
    if high - low < 0.25 * b:
        return np.zeros(0), float(zero), fall
    above = place > level
    crossed = np.flatnonzero(above[1:] != above[:-1])
    begins, last = [], -np.inf
    for at in time[crossed]:
        if at - last > 0.25 * fall:
            begins.append(at)
            last = at
    return np.array(begins), float(zero), fall


def _interval_means(known: Track, edges: Array) -> tuple[Array, Array]:
    """Return interval means of the loose gear's readings, and their standard deviations [rad], (w, k).

    Readings are shifted to the middle of their interval by the gear's mean speed.
    """
    at = np.searchsorted(known.time, edges)
    total = np.concatenate([[0.0], np.cumsum(known.loose - known.loose[0])])
    times = np.concatenate([[0.0], np.cumsum(known.time - known.time[0])])
    square = np.concatenate([[0.0], np.cumsum(known.sigma_loose**2)])
    number = np.diff(at, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.diff(total[at], axis=1) / number + known.loose[0]
        when = np.diff(times[at], axis=1) / number + known.time[0]
        sigma = np.sqrt(np.diff(square[at], axis=1)) / number
    middle = 0.5 * (edges[:, 1:] + edges[:, :-1])
    speed = np.gradient(mean, axis=1) / (GRID_STEP * STEPS_PER_POINT)
    return mean + (middle - when) * np.nan_to_num(speed), sigma


def _initial_states(middle: Array, place: Array, sigma: Array, fall: float) -> Array:
    """Return initial place and speed by a parabola through the first points."""
    few = max(int(START_FALLS * fall / (GRID_STEP * STEPS_PER_POINT)), 6)
    x = middle[:few]
    columns = np.stack([np.ones_like(x), x, x * x], axis=1)
    return np.linalg.lstsq(columns, place[:, :few].T, rcond=None)[0][:2].T


class EpisodeFit(NamedTuple):
    """Contact episodes fitted with effects.

    Args:
        causes: with their numbers, fitted.
        zeros: datum of each record [m].
        starts: of each record's contact episodes, (w, 2).
        points: chi-square per point of every contact episode, by record, (w,).
        cost: chi-square, outlying contact episodes by their logarithm.
        count: points.
        covariance: of the causes' numbers [SI], (p, p).
        rest: residuals of each record [m], (w, k).
    """

    causes: tuple[Cause, ...]
    zeros: Array
    starts: list[Array]
    points: list[Array]
    cost: float
    count: int
    covariance: Array
    rest: list[Array]

    @property
    def level(self) -> float:
        """Median chi-square per point of the contact episodes."""
        return float(np.median(np.concatenate(self.points)))


def law_numbers(rows: Iterable[Row], one: ContactEpisodes) -> Array:
    """Return the numbers of the law of contact; rows that act outside it are skipped."""
    law = np.zeros(paths.NUMBERS)
    law[paths.MASS] = one.rig.inertia / one.rig.base_radius_loose**2
    law[paths.RESTITUTION] = one.rig.restitution
    law[paths.STICK] = one.scenario.impact.stick_velocity
    for row in rows:
        for place, number in zip(_LAWS.get(row.code, ()), row.p, strict=False):
            law[place] += number
        if row.code == Code.GAP_FILM:
            law[paths.WEDGE] += row.p[0]
            law[paths.SQUEEZE] += row.p[1]
            law[paths.LAYER] = max(law[paths.LAYER], row.p[4])
    return law


class _Grids:
    """Inputs on the grids of each record's contact episodes, reused as long as only laws of contact change."""

    def __init__(self) -> None:
        self._made: dict[int, tuple[list[Row], Array]] = {}

    def of(self, rows: Sequence[Row], one: ContactEpisodes) -> Array:
        """Return the result of :func:`_grid_inputs`."""
        acting = [
            row._replace(p=row.p[2:4]) if row.code == Code.GAP_FILM else row for row in rows if row.code not in _LAWS
        ]
        kept = self._made.get(id(one))
        if kept is None or kept[0] != acting:
            kept = self._made[id(one)] = acting, _grid_inputs(rows, one)
        return kept[1]


def _grid_inputs(rows: Sequence[Row], one: ContactEpisodes) -> Array:
    """Return the inputs on the grids of contact episodes, without the record's datum, (w, n, COLUMNS)."""
    rig, shape = one.rig, one.time.shape
    speed = np.gradient(one.loose, GRID_STEP, axis=1)
    flat = [x.ravel() for x in (speed, one.loose, one.time)]
    resisting = rig.drag_torque * np.sign(flat[0]) + torque(rows, *flat)
    made = np.zeros((*shape, paths.COLUMNS))
    made[..., paths.FORCED] = (-resisting * rig.base_radius_loose / rig.inertia).reshape(shape)
    for side, place in ((0, paths.LOW), (1, paths.HIGH)):
        made[..., place] = one.flank + side * rig.backlash
        if any(200 < row.code < 300 for row in rows):
            sides = np.full(one.time.size, side)
            moved = deviation(rows, one.pair, one.drive.ravel(), flat[1], sides)
            made[..., place] += moved.reshape(shape)
        made[..., place + paths.LOW_RATE - paths.LOW] = np.gradient(made[..., place], GRID_STEP, axis=1, edge_order=2)
    for row in rows:
        if row.code == Code.GAP_FILM:
            made[..., paths.ROLLING] = row.p[2] * one.rate + row.p[3] * speed
    return made


def _episode_paths(law: Array, over: Array, starts: Array, zero: float, one: ContactEpisodes) -> Array:
    """Return the paths of contact episodes at their points [m], (w, k).

    starts: (w, 2); zero: datum of the record [m].
    """
    out = np.zeros(one.place.shape)
    paths.follow_all(law, starts, zero, over, one.sizes, GRID_STEP, STEPS_PER_POINT, out)
    return out


def fit_episodes(
    records: Sequence[ContactEpisodes],
    effects: Sequence[Any],
    causes: Sequence[Cause] = (),
    begin: EpisodeFit | None = None,
    rounds: int = ROUNDS,
) -> EpisodeFit:
    """Fit contact episodes with the rig and effects; starts, datums and the causes' numbers are free."""
    zeros = np.array([one.zero for one in records]) if begin is None else begin.zeros
    starts = [one.starts for one in records] if begin is None else begin.starts
    grids = _Grids()
    now = _evaluated(records, effects, tuple(causes), zeros, starts, grids)
    damping, covariance = 1e-3, np.zeros((0, 0))
    for _ in range(rounds):
        slopes = _slopes(records, effects, now, grids)
        done = True
        for _ in range(4):
            moves, covariance = _steps(records, now, slopes, damping)
            trial = _moved(records, effects, now, *moves, grids)
            if trial is not None and trial.cost < now.cost:
                done = now.cost - trial.cost < CONVERGED * trial.cost
                now, damping = trial, 0.2 * damping
                break
            damping = 10.0 * damping
        if done:
            break
    return now._replace(covariance=covariance)


def _evaluated(
    records: Sequence[ContactEpisodes],
    effects: Sequence[Any],
    causes: tuple[Cause, ...],
    zeros: Array,
    starts: list[Array],
    grids: _Grids,
) -> EpisodeFit:
    rest, points, cost, count = [], [], 0.0, 0
    for one, zero, start in zip(records, zeros, starts, strict=True):
        rows = _rows(one, effects, causes)
        own = one.place - _episode_paths(law_numbers(rows, one), grids.of(rows, one), start, zero, one)
        square = np.nanmean((own / one.sigma) ** 2, axis=1)
        square = np.where(np.isfinite(square), square, 1e12)
        rest.append(own)
        points.append(square)
        size = own.shape[1]
        far = np.maximum(square, CLIPPED_EPISODE) / CLIPPED_EPISODE
        cost += size * float(np.sum(np.minimum(square, CLIPPED_EPISODE) + CLIPPED_EPISODE * np.log(far)))
        count += own.size
    return EpisodeFit(causes, zeros, starts, points, cost, count, np.zeros((0, 0)), rest)


def _rows(one: ContactEpisodes, effects: Sequence[Any], causes: Sequence[Cause]) -> list[Row]:
    every = [*one.scenario.effects, *effects, *(cause.effect for cause in causes)]
    return [row for effect in every if effect is not None for row in effect.rows(one.rig)]


class _Slopes(NamedTuple):
    own: Array  # of the starts, (w, k, 2)
    shared: Array  # of the datum and the causes' numbers in units, (w, k, 1 + p)


def _slopes(
    records: Sequence[ContactEpisodes], effects: Sequence[Any], now: EpisodeFit, grids: _Grids
) -> list[_Slopes]:
    found = []
    for one, zero, start, rest in zip(records, now.zeros, now.starts, now.rest, strict=True):
        rows = _rows(one, effects, now.causes)
        law, over, here = law_numbers(rows, one), grids.of(rows, one), one.place - rest
        own = [(_episode_paths(law, over, start + row, zero, one) - here) / step
               for row, step in zip(np.diag(START_STEPS), START_STEPS, strict=True)]  # fmt: skip
        shared = [(_episode_paths(law, over, start, zero + START_STEPS[0], one) - here) / START_STEPS[0]]
        for causes in _stepped(now.causes):
            rows = _rows(one, effects, causes)
            shared.append(
                (_episode_paths(law_numbers(rows, one), grids.of(rows, one), start, zero, one) - here) / SLOPE_STEP
            )
        found.append(_Slopes(np.stack(own, axis=-1), np.stack(shared, axis=-1)))
    return found


def promised_gains(records: Sequence[ContactEpisodes], now: EpisodeFit, others: Sequence[Cause]) -> list[float]:
    """Return the first-order fall of chi-square by each of some small causes in addition to those in the fit."""
    slopes, found = _slopes(records, (), now, _Grids()), []
    normal, right, _ = _normal(records, now, slopes, 1e-3)
    without = float(right @ np.linalg.pinv(normal) @ right)
    for other in others:
        wider = [own._replace(shared=np.concatenate([own.shared, _columns(one, now, k, other)], axis=-1))
                 for k, (one, own) in enumerate(zip(records, slopes, strict=True))]  # fmt: skip
        normal, right, _ = _normal(records, now, wider, 1e-3)
        found.append(float(right @ np.linalg.pinv(normal) @ right) - without)
    return found


def _columns(one: ContactEpisodes, now: EpisodeFit, k: int, other: Cause) -> Array:
    """Return the derivatives of a record's contact episodes with respect to a further cause, per unit, (w, k, p)."""
    here, columns = one.place - now.rest[k], []
    for size in np.eye(1 + other.candidate.phased):
        rows = _rows(one, (other.candidate.effect(SLOPE_STEP * other.candidate.unit * size),), now.causes)
        moved = _episode_paths(law_numbers(rows, one), _grid_inputs(rows, one), now.starts[k], float(now.zeros[k]), one)
        columns.append((moved - here) / SLOPE_STEP)
    return np.stack(columns, axis=-1)


def _stepped(causes: tuple[Cause, ...]) -> list[tuple[Cause, ...]]:
    """Return the causes with each of their numbers increased slightly, in turn."""
    found = []
    for i, cause in enumerate(causes):
        for k, unit in enumerate(units_of(cause)):
            numbers = cause.numbers.copy()
            numbers[k] += SLOPE_STEP * unit
            found.append((*causes[:i], cause._replace(numbers=numbers), *causes[i + 1 :]))
    return found


def units_of(cause: Cause) -> Array:
    """Return the scales of a cause's numbers: their own sizes where these exceed the unit steps."""
    return np.maximum(np.minimum(cause.units, np.abs(cause.numbers) + 0.02 * cause.units), 1e-300) * np.where(
        cause.units == 1.0, 0.0, 1.0
    ) + np.where(cause.units == 1.0, 1.0, 0.0)


def _steps(
    records: Sequence[ContactEpisodes], now: EpisodeFit, slopes: list[_Slopes], damping: float
) -> tuple[tuple[list[Array], Array, Array], Array]:
    """Return the steps of starts, datums and numbers, and the covariance of the numbers."""
    normal, right, kept = _normal(records, now, slopes, damping)
    inverse = np.linalg.pinv(normal)
    numbers = np.clip(inverse @ right, -LARGEST_STEP, LARGEST_STEP)
    zeros = np.array([(t - s[1:] @ numbers) / max(s[0], 1e-300) for _, _, s, t in kept])
    starts = [r - b @ np.concatenate([[z], numbers]) for (b, r, _, _), z in zip(kept, zeros, strict=True)]
    units = np.concatenate([np.zeros(0), *(units_of(cause) for cause in now.causes)])
    return (starts, zeros, numbers * units), inverse * np.outer(units, units)


def _normal(
    records: Sequence[ContactEpisodes], now: EpisodeFit, slopes: list[_Slopes], damping: float
) -> tuple[Array, Array, list[tuple[Array, Array, Array, float]]]:
    """Return the normal equations of the shared numbers without starts and datums, and the back-substitution."""
    width = slopes[0].shared.shape[-1] - 1
    normal, right, kept = np.zeros((width, width)), np.zeros(width), []
    for one, rest, points, (own, shared) in zip(records, now.rest, now.points, slopes, strict=True):
        weight = (np.minimum(1.0, np.sqrt(CLIPPED_EPISODE / points))[:, None] / one.sigma)[..., None]
        a, b, r = np.nan_to_num(own * weight), np.nan_to_num(shared * weight), np.nan_to_num(rest[..., None] * weight)
        inverse = np.linalg.pinv(_damped(np.swapaxes(a, 1, 2) @ a, damping))
        to_b, to_r = inverse @ (np.swapaxes(a, 1, 2) @ b), inverse @ (np.swapaxes(a, 1, 2) @ r)
        b2, r2 = b - a @ to_b, r - a @ to_r
        square = _damped(np.einsum("wki,wkj->ij", b2, b2), damping)
        toward = np.einsum("wki,wk->i", b2, r2[..., 0])
        zero = max(square[0, 0], 1e-300)
        normal += square[1:, 1:] - np.outer(square[0, 1:], square[0, 1:]) / zero
        right += toward[1:] - square[0, 1:] * toward[0] / zero
        kept.append((to_b, to_r[..., 0], square[0], toward[0]))
    return normal, right, kept


def _damped(normal: Array, damping: float) -> Array:
    size = normal.shape[-1]
    return normal + damping * normal * np.eye(size)


def _moved(
    records: Sequence[ContactEpisodes],
    effects: Sequence[Any],
    now: EpisodeFit,
    starts: list[Array],
    zeros: Array,
    numbers: Array,
    grids: _Grids,
) -> EpisodeFit | None:
    causes, at = [], 0
    for cause in now.causes:
        size = len(cause.numbers)
        moved = cause.numbers + numbers[at : at + size]
        if cause.candidate.channels == LAW_CHANNELS:
            moved[0] = max(moved[0], SMALLEST_RATIO * cause.numbers[0])
        causes.append(cause._replace(numbers=moved))
        at += size
    begun = [old + move for old, move in zip(now.starts, starts, strict=True)]
    limit = [0.2 * one.rig.backlash for one in records]
    moved = now.zeros + np.clip(zeros, -np.array(limit), limit)
    try:
        return _evaluated(records, effects, tuple(causes), moved, begun, grids)
    except InputError:  # beyond the bounds of a parameter
        return None
