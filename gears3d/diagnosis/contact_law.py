"""Laws of contact, which segmentation cannot resolve: oil between the flanks, compliant teeth, friction.

Segmentation by rigid flanks loses the motion on a flank, and in the last micrometres before it. An episode is a short
path of the loose gear from the middle of the gap, where only the drag acts, to a flank and back, for a few falls across
the gap. A law, alone or with other causes, is fitted by Gauss-Newton to the readings of episodes, each with a free
start (multiple shooting).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import ACCEPT, EXCLUDED, SLOPE_STEP, Candidate, Cause, begin, candidates
from gears3d.diagnosis.evidence import Paths
from gears3d.diagnosis.prediction import deviation, torque
from gears3d.diagnosis.residual_tests import Split
from gears3d.diagnosis.search import PRICE
from gears3d.effects import Code, Rig, Row, catalogue
from gears3d.errors import InputError
from gears3d.lumped import visits as paths

if TYPE_CHECKING:
    from gears3d.diagnosis.preprocessing import Note
    from gears3d.gears import Pair
    from gears3d.measured.checks import Admitted
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


# Chi-square per point at which the rig, or causes, explain the contact episodes.
EXPLAINED = 1.5
# The same of the median episode, up to which a rig with its own law of contact agrees; twice that of all.
AGREEMENT = 2.0
# Median chi-square per point up to which a law may be the cause: a wrong one leaves far more.
LAW_FITS = 4.0
# Largest ratio of the cost with a law to the cost without one.
COST_RATIO = 0.7
# Median chi-square per point of the first fits up to which a law is fitted to all contact episodes.
PROMISING = 30.0
# Median chi-square per point above which a law that fits worse than the rig is not fitted further.
HOPELESS = 1e4
# Contact episodes and rounds of the fits that select initial sizes.
START_EPISODES, START_ROUNDS = 20, 4
# Minimum number of contact episodes.
FEWEST_EPISODES = 12
# Minimum relative standard deviation of a number: the resolution of the grids.
GRID_RESOLUTION = 1.5e-3
# Initial viscosities of the fits, in units.
VISCOSITIES = (0.2, 0.05, 0.6)
STIFFNESSES = (3.0, 10.0, 40.0)
# Initial ratio to the critical damping.
DAMPING_RATIO = 0.08
FRICTIONS = (0.1,)
# Kinds that are tried in addition to a law of contact.
FURTHER_KINDS = ("backlash_offset", "backlash_variation", "eccentricity", "transmission_error", "drag_coulomb",
         "drag_viscous", "drag_position")  # fmt: skip
# Highest order that is tried.
HIGHEST_ORDER = 4
# Number of contact episodes that are used in the search for causes.
SEARCHED_EPISODES = 40
JOINT_ROUNDS, JOINT_TRIAL = 10, 3
# Maximum number of causes in addition to a law.
MOST_FURTHER = 2
# Number of candidates that are fitted in each round.
TRIED = 3
# Largest ratio of the cost with a further cause to the cost without it.
FURTHER_RATIO = 0.9
# Size in units below which a cause is ignored.
SMALLEST = 0.02
# Sizes in units: initial value of a fit, and the value that stands for zero.
START_SIZE, ZERO_SIZE = 1e-3, 1e-6


class ContactLawFit(NamedTuple):
    """A law of contact, inferred from contact episodes.

    Args:
        causes: the law, then its additional causes, with their numbers.
        covariance: of all numbers [SI], (p, p).
        base: contact episodes compared with the rig as it is.
        held: compared with the rig with the law.
        records: the contact episodes.
        splits: held-out error reduction by record.
        alternatives: ``kind`` and ``why`` of causes that the contact episodes do not exclude.
        worse: chi-square over its level by which these fit worse.
        gains: rise of chi-square without each of the causes.
    """

    causes: tuple[Cause, ...]
    covariance: Array
    base: EpisodeFit
    held: EpisodeFit
    records: list[ContactEpisodes]
    splits: tuple[Split, ...]
    alternatives: tuple[dict[str, str], ...]
    worse: float
    gains: tuple[float, ...]


class EpisodeAnalysis(NamedTuple):
    """Result of the analysis of contact episodes.

    Args:
        law: of contact, if they indicate one.
        plain: contact episodes compared with the rig as it is; ``None`` if there are too few of them.
        records: the contact episodes.
    """

    law: ContactLawFit | None
    plain: EpisodeFit | None
    records: tuple[ContactEpisodes, ...] = ()

    @property
    def agrees(self) -> bool:
        """Whether the rig as it is explains the contact episodes."""
        return (
            self.plain is not None
            and self.plain.level < AGREEMENT
            and self.plain.cost < 2.0 * AGREEMENT * self.plain.count
        )


def has_compliance(rig: Scenario) -> bool:
    """Whether a rig has a law of contact already, so that segmentation by rigid flanks is invalid."""
    return any(row.code in (Code.GAP_SPRING, Code.GAP_FILM) for row in rig.rows())


def contact_law_of(
    admitted: Sequence[Admitted], notes: Sequence[Note], tell: Callable[[str, float], None], paths: Paths
) -> EpisodeAnalysis:
    """Return the law of contact that records indicate, before any segmentation by rigid flanks.

    Notes of their motion that block prevent a law.
    """
    seen: list[ContactEpisodes | None] = []
    if any(note.blocks for note in notes):
        return EpisodeAnalysis(None, None)
    tell("visiting the flanks", 0.0)
    for one in admitted:
        assert one.rig is not None
        with suppress(InputError):
            seen.append(contact_episodes(paths.of(one), one.rig, one.file))
    return contact_law([one for one in seen if one is not None])


def contact_law(records: Sequence[ContactEpisodes]) -> EpisodeAnalysis:
    """Return the law of contact that explains contact episodes better than all other causes, if any."""
    if sum(len(one.sizes) for one in records) < FEWEST_EPISODES:
        return EpisodeAnalysis(None, None)
    plain = fit_episodes(records, [])
    if plain.level < EXPLAINED and plain.cost < EXPLAINED * plain.count:
        return EpisodeAnalysis(None, plain, tuple(records))
    tried = [found for started in _laws(records[0]) if (found := _best_law(records, started, plain)) is not None]
    best = min(tried, key=lambda one: one.cost, default=plain)
    if best is plain or not accepted(best, plain):
        return EpisodeAnalysis(None, plain, tuple(records))
    return EpisodeAnalysis(_law_fit(records, best, plain), plain, tuple(records))


def contact_law_with_others(seen: EpisodeAnalysis) -> ContactLawFit | None:
    """Return the law of contact that explains contact episodes with other causes, where no law does alone."""
    plain = seen.plain
    if (
        plain is None or plain.level < EXPLAINED
    ):  # a few divergent paths do not indicate a law, which acts in all of them
        return None
    best = joint_fit(seen.records, _laws(seen.records[0]))
    if best is None or len(best.causes) < 2 or not accepted(best, plain):
        return None
    return _law_fit(seen.records, best, plain)


def _law_fit(records: Sequence[ContactEpisodes], best: EpisodeFit, plain: EpisodeFit) -> ContactLawFit | None:
    """Return a law and its additional causes; ``None`` if other rebounds fit equally, or a cause is needless."""
    rival = fit_episodes(records, [], [*best.causes[1:], *_rebounds(records[0].rig)], best if best.causes[1:] else None)
    if rival.cost <= best.cost:
        return None
    noise = max(best.level, 1.0)
    gains = gains_of_causes(records, best) if best.causes[1:] else [plain.cost - best.cost]
    if min(gains) < ACCEPT * noise or min(map(size_of, best.causes)) < SMALLEST:
        return None
    worse = (rival.cost - best.cost) / noise
    others = () if worse > EXCLUDED else (_alternative(rival, worse),)
    splits, covariance = _held_out(records, best)
    return ContactLawFit(best.causes, covariance, plain, best, list(records), splits, others, worse, tuple(gains))


def _rebounds(rig: Rig) -> list[Cause]:
    """Return other rebounds of rigid flanks as the alternative to a law of contact, in proportion to speed."""
    made = {one.kind: one for one in candidates(rig, 1.0, 0)}
    return [begin(made[kind], np.array([0.01])) for kind in ("restitution_offset", "restitution_speed")]


def _alternative(rival: EpisodeFit, worse: float) -> dict[str, str]:
    numbers = ", ".join(f"{one.candidate.size} = {one.numbers[0]:.3g}" for one in rival.causes)
    why = f"fits worse by Δχ² = {worse:.4g}, which is not sufficient to exclude it ({numbers})"
    return {"kind": "restitution_speed", "why": why}


def accepted(law: EpisodeFit, plain: EpisodeFit) -> bool:
    """Whether a law is the cause: it reduces the cost considerably, of median contact episodes, too."""
    size = size_of(law.causes[0])
    gains = plain.cost - law.cost > ACCEPT * max(law.level, 1.0) and law.cost < COST_RATIO * plain.cost
    return bool(law.level < min(LAW_FITS, plain.level) and gains and size > SMALLEST)


def _laws(one: ContactEpisodes) -> Iterator[list[Cause]]:
    """Return each law at its initial sizes."""
    rig, rows = one.rig, one.scenario.rows()
    yields = any(row.code == Code.GAP_SPRING for row in rows)
    if yields and not any(row.code == Code.TORQUE_FRICTION for row in rows):
        friction = Candidate("mesh_friction", {}, "coefficient", 1.0, False, LAW_CHANNELS)
        yield [begin(friction, np.array([size])) for size in FRICTIONS]
    force = rig.drag_torque / rig.base_radius_loose
    if not yields and force > 0.0:
        unit, mass = force / rig.backlash, rig.inertia / rig.base_radius_loose**2
        made = []
        for size in STIFFNESSES:
            damping = 2.0 * DAMPING_RATIO * float(np.sqrt(size * unit * mass))
            teeth = Candidate("tooth_compliance", {"damping": damping}, "stiffness", unit, False, LAW_CHANNELS)
            made.append(begin(teeth, np.array([size])))
        yield made
    if rig.face_width > 0.0 and not any(row.code == Code.GAP_FILM for row in rows):
        unit = catalogue()["oil_film"](viscosity=1e-3).unit_size(rig)
        oil = Candidate("oil_film", {}, "viscosity", unit, False, LAW_CHANNELS)
        yield [begin(oil, np.array([size])) for size in VISCOSITIES]


def _best_law(records: Sequence[ContactEpisodes], started: list[Cause], plain: EpisodeFit) -> EpisodeFit | None:
    """Return the fit of a law to all contact episodes; ``None`` if a few of them exclude it."""
    few, found = subset(records, START_EPISODES), None
    for cause in started:
        try:
            held = fit_episodes(few, [], [cause], rounds=START_ROUNDS)
        except InputError:  # a size that the rig cannot have
            continue
        if found is None or held.cost < found.cost:
            found = held
        if found.level < LAW_FITS:
            break
    if found is None or (found.level > HOPELESS and found.level > plain.level):
        return None
    found = fit_episodes(few, [], found.causes, found)
    return fit_episodes(records, [], found.causes) if found.level < PROMISING else None


def _held_out(records: Sequence[ContactEpisodes], best: EpisodeFit) -> tuple[tuple[Split, ...], Array]:
    """Return the held-out error reduction of the law by record, and the covariance over these fits."""
    covariance = best.covariance * max(best.cost / best.count, 1.0)
    exact = GRID_RESOLUTION * np.concatenate([_error_scales(one) for one in best.causes])
    covariance = covariance + np.diag(exact**2)
    if len(records) < 2:
        return (), covariance
    splits, numbers = [], []
    for k, one in enumerate(records):
        others = [i for i in range(len(records)) if i != k]
        begun = best._replace(zeros=best.zeros[others], starts=[best.starts[i] for i in others])
        causes = fit_episodes([records[i] for i in others], [], best.causes, begun).causes
        numbers.append(np.concatenate([cause.numbers for cause in causes]))
        splits.append(_split(one, [cause.effect for cause in causes], best, k))
    apart = np.array(numbers) - np.mean(numbers, axis=0)
    jackknife = (len(records) - 1) / len(records) * apart.T @ apart
    wider = np.sqrt(np.maximum(np.diag(jackknife) / np.maximum(np.diag(covariance), 1e-300), 1.0))
    return tuple(splits), covariance * np.outer(wider, wider)


def _error_scales(cause: Cause) -> Array:
    """Return the scales of errors of a cause's numbers: its size, and 1 for logarithms of a shape."""
    sizes = 1 + cause.candidate.phased
    return np.concatenate([np.full(sizes, np.linalg.norm(cause.numbers[:sizes])), np.ones(len(cause.free))])


def _split(one: ContactEpisodes, effects: list[Any], best: EpisodeFit, k: int) -> Split:
    begun = best._replace(zeros=best.zeros[k : k + 1], starts=[best.starts[k]])
    base, extended = fit_episodes([one], []), fit_episodes([one], effects, (), begun)
    sizes = {"visit": tuple(float(np.sqrt(np.mean(np.square(each.rest[0])))) for each in (base, extended))}
    noise = min(extended.level, extended.cost / extended.count)
    gain = 0.5 * (base.cost - extended.cost) / max(noise, 1.0)
    return Split((one.name,), base.cost / base.count, extended.cost / extended.count, noise, gain, sizes)  # type: ignore[arg-type]


def shortlist(rig: Rig) -> list[Candidate]:
    """Return the candidates that are tried in addition to a law of contact."""
    every = candidates(rig, 1.0, HIGHEST_ORDER)
    return [one for one in every if one.kind in FURTHER_KINDS and one.shape.get("flank", "both") == "both"]


def joint_fit(records: Sequence[ContactEpisodes], laws: Iterable[list[Cause]]) -> EpisodeFit | None:
    """Return the law of contact with further causes that has the smallest cost over the contact episodes."""
    few, known = subset(records, SEARCHED_EPISODES), shortlist(records[0].rig)
    found = None
    for started in laws:
        begun = _best_start(few, started)
        if begun is None:
            continue
        held = with_further_causes(few, begun, known)
        if found is None or held.cost < found.cost:
            found = held
    return None if found is None else fit_episodes(records, [], found.causes)


def with_further_causes(records: Sequence[ContactEpisodes], now: EpisodeFit, known: Sequence[Candidate]) -> EpisodeFit:
    """Return the fit with further causes, added as long as each reduces the cost considerably."""
    for _ in range(MOST_FURTHER):
        if now.level < EXPLAINED and now.cost < EXPLAINED * now.count:
            break
        promised = promised_gains(records, now, [begin(one, np.full(1 + one.phased, ZERO_SIZE)) for one in known])
        best = now
        for k in np.argsort(promised)[::-1][:TRIED]:
            cause = begin(known[k], np.full(1 + known[k].phased, START_SIZE))
            held = fit_episodes(records, [], [*now.causes, cause], now, JOINT_ROUNDS)
            best = held if _worth(held) < _worth(best) and size_of(held.causes[-1]) > SMALLEST else best
        if best is now or best.cost > FURTHER_RATIO * now.cost:
            break
        now = best
    return now


def size_of(cause: Cause) -> float:
    """Return the size of a cause in units."""
    return float(np.linalg.norm(cause.numbers[: 1 + cause.candidate.phased])) / cause.candidate.unit


def gains_of_causes(records: Sequence[ContactEpisodes], held: EpisodeFit) -> list[float]:
    """Return the rise of chi-square without each of the causes, the others refitted."""
    found = []
    for k in range(len(held.causes)):
        others = held.causes[:k] + held.causes[k + 1 :]
        found.append(fit_episodes(records, [], others, held, JOINT_ROUNDS).cost - held.cost)
    return found


def _best_start(records: Sequence[ContactEpisodes], started: list[Cause]) -> EpisodeFit | None:
    """Return the best of the initial sizes of a law."""
    found = None
    for cause in started:
        try:
            held = fit_episodes(records, [], [cause], rounds=JOINT_TRIAL)
        except InputError:  # a size that the rig cannot have
            continue
        if found is None or held.cost < found.cost:
            found = held
    return found


def _worth(held: EpisodeFit) -> float:
    return held.cost + PRICE * sum(len(one.numbers) for one in held.causes)
