"""Intervals of a fitted drag that include the scatter between blocks, by restricted maximum likelihood.

A least-squares covariance is right only where the law holds and errors are independent. Here the true torque may
deviate from the law by a random smooth function of the speed (common to all runs, and of each run), and readings may
have 1/f noise. The sizes of these three random effects, and how smooth the deviation is and whether it is largest at
slow speeds, are found from the record by restricted maximum likelihood: where blocks of the record agree within their
errors the sizes are zero and the intervals those of least squares; where they disagree, the disagreement is in every
interval. The best estimate of the torque, law and deviation, is re-linearised until it converges, as a deviation of
some per cent moves angles by far more than their noise. Random effects were preferred to a block jackknife, as blocks
of a coast-down cover different speeds, so that estimates from single blocks are not replicates, and to sandwich
covariances, which with a few effective blocks are too narrow.

Source: Patterson & Thompson 1971, Biometrika 58, 545 (restricted likelihood); Kennedy & O'Hagan 2001, J. R. Stat. Soc.
B 63, 425 (deviation of a law as a random function); Self & Liang 1987, JASA 82, 605 (test of variances).
"""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np

from gears3d.identify.coastdown_fit import Binned, Fit, Task, last_speed, standardised
from gears3d.identify.motion import Law

# Speeds at which the deviation of the torque from the law is described, splines in between: more than the shortest of
# ``SHAPES`` needs.
NODES = 24
# Correlation lengths of the deviation, in the range of speeds, and logarithms of its size at the slow end over that at
# the fast end, that compete; the first where the record shows none. Mixed friction deviates most where it is slowest.
SHAPES = ((0.15, 0.0), (0.05, 0.0), (0.5, 0.0), (0.15, 4.0), (0.5, 4.0))
# Fall of minus twice the log-likelihood from which on another shape than the first is taken: two more numbers, by the
# criterion of Akaike. A few readings would otherwise choose one by chance.
WORTH = 4.0
# Independent deviations that make up one of a middle length: their number is what a size is estimated from.
DIRECTIONS = 10
# Points between which a deviation is interpolated linearly.
FINE = 400
# Linearisations of the torque; each removes most of the error of the one before.
ROUNDS = 6
# Points of a run in the likelihood, means of its bins: dense covariances of more cost time and add nothing.
POINTS = 120
# p-value of the residuals, with independent errors, below which a law fails the goodness-of-fit test.
SURE = 0.01
# Rise of minus twice the log-likelihood up to which a deviation of the torque is allowed for: one standard deviation.
# The most likely size is too often 0, where noise hides the misfit of the law.
UPPER = 1.0
# Curvature of residuals, in their own size, up to which a step of generalised least squares is taken.
LINEAR = 0.1
# Deviation of the torque, in its typical size, by which responses are differenced.
_STEP = 1e-4
# Logarithm of a variance that counts as 0.
_NONE = -300.0


class Torque(NamedTuple):
    """Best estimate of the torque: a law's, its change with each number in proportion, and a smooth deviation.

    Args:
        law: the least-squares fit.
        change: of its numbers, (p,).
        deviation: of the torque at ``speeds`` [N·m], (NODES,).
        speeds: rising [rad/s], (NODES,).
        joint: covariance of numbers and deviations, (p + NODES, p + NODES).
        ends: speed at the start and the end of each run [rad/s], (runs, 2).
    """

    law: Fit
    change: np.ndarray
    deviation: np.ndarray
    speeds: np.ndarray
    joint: np.ndarray
    ends: np.ndarray


class Errors(NamedTuple):
    """Uncertainty of a fit with the scatter between blocks included.

    Args:
        fit: with numbers and covariance by generalised least squares.
        true: the best estimate of the torque itself.
        dof: degrees of freedom of each number's variance, (p,).
        dof_torque: of a torque's variance.
        sizes: deviation of the torque common to all runs and of each run, over the typical torque; 1/f noise over the
            independent noise of a point.
        p_structure: chance of such residuals if the law held and errors were independent.
        shifts: standard deviation of each unsure inertia's shift, in standard deviations of what was known before.
    """

    fit: Fit
    true: Torque
    dof: np.ndarray
    dof_torque: float
    sizes: tuple[float, float, float]
    p_structure: float
    shifts: np.ndarray


class _Run(NamedTuple):
    """One run in the likelihood: standardised residuals, slopes in all free numbers and in deviations, 1/f noise."""

    rest: np.ndarray
    slopes: np.ndarray
    bent: np.ndarray
    pink: np.ndarray


class _State(NamedTuple):
    """Where residuals are linearised: change of all free numbers, and deviations at the nodes over their scale."""

    x: np.ndarray
    deviation: np.ndarray


def errors_of(best: Fit, data: list[Binned]) -> Errors:
    """Return numbers, intervals and residual test of a fit."""
    task, x = Task.of(best, data)
    functions = _functions(best, task, x)
    free = len(best.numbers)
    prior = np.zeros(len(x))
    prior[free : free + task.unsure] = 1.0
    shift = x * prior
    none = _State(np.zeros(len(x)), np.zeros(NODES))
    plain = _linear(task, x, functions, none)
    assert plain is not None
    runs, smooth, at, upper, p_value = _chosen(plain)
    solved = _solved(runs, at, prior, shift)
    moved = _moved(task, best, x, solved.move, runs, solved.noise) if any(one > _NONE for one in at) else best
    covariance = solved.joint[:free, :free] * np.outer(task.scale, task.scale)
    calm = _solved(runs, (_NONE, _NONE, at[2]), prior, shift, solved.noise).joint
    share = 1.0 - np.clip(np.diag(calm)[:free] / np.maximum(np.diag(solved.joint)[:free], 1e-300), 0.0, 1.0)
    nodes = max(DIRECTIONS * (len(data) if at[1] > at[0] else 1) - free, 2)
    fixed = int(np.any([np.any(run.slopes, axis=0) for run in runs], axis=0).sum())
    points = max(sum(len(run.rest) for run in runs) - fixed, 1)
    known = np.flatnonzero(prior).tolist()
    if known:  # what an inertia's own error makes of a variance is known, not estimated
        sure = [run._replace(slopes=np.delete(run.slopes, known, axis=1)) for run in runs]
        alone = _solved(sure, (_NONE, _NONE, at[2]), np.delete(prior, known), np.delete(shift, known), solved.noise)
        own = np.diag(alone.joint)[:free] / np.maximum(np.diag(solved.joint)[:free], 1e-300)
    else:
        own = 1.0 - share
    dof = 1.0 / (share**2 / nodes + np.clip(own, 1e-6, 1.0) ** 2 / points)
    unit_of = (np.sqrt(solved.noise), np.sqrt(solved.noise), 1.0)
    sizes = tuple(
        float(np.exp(0.5 * one)) * float(by) if one > _NONE else 0.0 for one, by in zip(at, unit_of, strict=True)
    )
    moved = moved._replace(covariance=covariance)
    shifts = np.sqrt(np.maximum(np.diag(solved.joint)[free : free + task.unsure], 0.0))
    true = _true(task, x, functions, _Sought(runs, smooth, upper, prior, shift))
    for _ in range(2):
        if (low := float(true.ends.min())) >= true.speeds[0]:
            break
        functions = _functions(best, task, x, max(low, 0.5 * true.speeds[0]))  # the record reaches further than known
        if (lower := _linear(task, x, functions, none)) is None:
            break
        runs, smooth, _, upper, _ = _chosen(lower)
        true = _true(task, x, functions, _Sought(runs, smooth, upper, prior, shift))
    return Errors(moved, true, dof, float(min(nodes, points)), (sizes[0], sizes[1], sizes[2]), p_value, shifts)


def structure(best: Fit, data: list[Binned]) -> float:
    """Return the chance of such residuals if the law of a fit held and errors were independent."""
    task, x = Task.of(best, data)
    runs = _linear(task, x, _functions(best, task, x), _State(np.zeros(len(x)), np.zeros(NODES)))
    return 0.0 if runs is None else _chosen(runs)[-1]


class _Functions(NamedTuple):
    """Decelerations of one run over its speeds that free numbers and deviations add [rad/s²].

    Args:
        speed: rising [rad/s], (FINE,).
        numbers: of each number and unsure inertia, (FINE, p).
        bent: of a deviation at each node, over its scale, (FINE, NODES).
        nodes: their speeds [rad/s], (NODES,).
        unit: torque of such a deviation [N·m], (NODES,).
    """

    speed: np.ndarray
    numbers: np.ndarray
    bent: np.ndarray
    nodes: np.ndarray
    unit: np.ndarray


def spline(nodes: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Return the smooth functions that are one at one node and none at the others, constant beyond, (n, nodes).

    ``nodes``: rising [rad/s], (nodes,); ``speed``: [rad/s], (n,).
    """
    from scipy.interpolate import CubicSpline

    return CubicSpline(nodes, np.eye(len(nodes)))(np.clip(speed, nodes[0], nodes[-1]))


def _functions(best: Fit, task: Task, x: np.ndarray, low: float = np.inf) -> list[_Functions]:
    """Return for each run by which decelerations it may deviate."""
    data = task.tracks
    ends = [last_speed(run, best.law(at), best.starts[at]) for at, run in enumerate(data) if not best.law(at).push]
    low = min([low, *ends, *(run.slowest for run in data)])
    high = max(max(run.speed, run.fastest) for run in data)
    nodes = _nodes(best, data, low, high)
    speed = np.linspace(low, high, FINE)
    first = len(best.numbers) + task.unsure
    scales = _typical(best, nodes)
    unit = np.mean(scales, axis=0)

    def slowing(y: np.ndarray, at: int) -> np.ndarray:
        model, numbers, _ = task.parted(y)
        law = model.law(numbers, at)
        return law.deceleration(speed) - law.push

    found = []
    for at in range(len(data)):
        base, rows = slowing(x, at), []
        for place in range(first):
            step = np.zeros(len(x))
            step[place] = 1e-6 * max(abs(x[place]), 1e-3)
            rows.append((slowing(x + step, at) - base) / step[place])
        bent = spline(nodes, speed) * scales[at] / best.model.inertia(at)
        found.append(_Functions(speed, np.array(rows).T, bent, nodes, unit))
    return found


def _nodes(best: Fit, data: list[Binned], low: float, high: float) -> np.ndarray:
    """Return speeds, equally many of them spaced evenly, at even times, and in even ratios, as friction varies."""
    run = max(range(len(data)), key=lambda at: data[at].speed)
    low = max(low, 1e-4 * high)
    grid = np.geomspace(low, high, 1000)
    slowing = best.law(run).deceleration(grid)
    slowing = np.maximum(slowing, 1e-2 * float(np.abs(slowing).mean()) + 1e-300)
    time = np.concatenate([[0.0], np.cumsum(np.diff(grid) * 0.5 * (1.0 / slowing[1:] + 1.0 / slowing[:-1]))])
    place = (grid - low) / (high - low) + time / time[-1] + np.linspace(0.0, 1.0, len(grid))
    return np.interp(np.linspace(0.0, 3.0, NODES), place, grid)


def _typical(best: Fit, speeds: np.ndarray) -> list[np.ndarray]:
    """Return for each run the torques by which its law may deviate: half of its own there, half of the mean."""
    found = []
    for run in range(len(best.model.runs)):
        slowing = np.abs(best.law(run).deceleration(speeds))
        found.append(0.5 * slowing + 0.5 * float(slowing.mean()))
    return [one * best.model.inertia(run) for run, one in enumerate(found)]


def _bent(task: Task, x: np.ndarray, at: int, functions: _Functions, state: _State) -> tuple[Law, np.ndarray]:
    """Return the law of a run with its deviation, and its start."""
    model, numbers, starts = task.parted(x)
    count = functions.numbers.shape[1]
    table = functions.numbers @ state.x[:count] + functions.bent @ state.deviation
    start = starts[at] + state.x[count:].reshape(-1, 2)[at]
    return model.law(numbers, at)._replace(table=(functions.speed, table)), start


def _linear(task: Task, x: np.ndarray, functions: list[_Functions], state: _State) -> list[_Run] | None:
    """Return residuals of all runs at a state, linearised to zero deviation; ``None`` where one does not slow down."""
    runs = []
    for at, own in enumerate(functions):
        if (run := _run(task, x, at, own, state)) is None:
            return None
        runs.append(run)
    return runs


def _run(task: Task, x: np.ndarray, at: int, functions: _Functions, state: _State) -> _Run | None:
    """Return residuals of a run at a state, linearised to zero deviation, and their slopes; means of neighbours."""
    track = task.tracks[at]
    law, start = _bent(task, x, at, functions, state)
    rest = standardised(track, law, start)
    if rest is None:
        return None
    table = cast(tuple[np.ndarray, np.ndarray], law.table)[1]
    columns = np.column_stack([functions.numbers, functions.bent])
    typical = float(np.mean(np.abs(law.deceleration(functions.speed))))
    slopes = np.zeros((len(rest), len(x) + NODES))
    count = functions.numbers.shape[1]
    places = [*range(count), *range(len(x), len(x) + NODES)]
    for place, column in zip(places, columns.T, strict=True):
        if not (size := float(np.abs(column).max())):
            continue
        for step in (_STEP * typical / size, -_STEP * typical / size):
            there = standardised(track, law._replace(table=(functions.speed, table + step * column)), start)
            if there is not None:
                slopes[:, place] = (there - rest) / step
                break
    own = count + 2 * at
    step = np.array([0.0, _STEP * 1e-3 * max(abs(start[1]), 1e-3)])
    if (there := standardised(track, law, start + step)) is not None:
        slopes[:, own + 1] = (there - rest) / step[1]
    if not track.is_speed:
        slopes[:, own] = -1.0 / track.sigma
    rest = rest - slopes @ np.concatenate([state.x, state.deviation])
    group = -(-len(rest) // POINTS)
    edge = np.arange(0, len(rest), group)
    root = np.sqrt(np.diff(edge, append=len(rest)))[:, None]

    def mean(values: np.ndarray) -> np.ndarray:
        return np.add.reduceat(values, edge) / root

    time = mean(track.time[:, None])[:, 0] / root[:, 0]
    wide = root[:, 0] ** 2 / mean(track.sigma[:, None])[:, 0]  # of a noise that a whole point has in common
    spacing = (time[-1] - time[0]) / max(len(time) - 1, 1)
    lag = np.abs(time[:, None] - time[None, :])
    octaves = [spacing * 2.0**k for k in range(max(int(np.log2(len(time))) + 1, 1))]
    pink = np.mean([np.exp(-lag / one) for one in octaves], axis=0) * np.outer(wide, wide)
    pink /= max(float(np.median(np.diag(pink))), 1e-300)
    return _Run(mean(rest[:, None])[:, 0], mean(slopes[:, : len(x)]), mean(slopes[:, len(x) :]), pink)


def _correlated(length: float, tilt: float) -> np.ndarray:
    """Return independent deviations in terms of those at the nodes, for a smoothness once differentiable."""
    place = np.linspace(0.0, 1.0, NODES)
    away = np.sqrt(3.0) * np.abs(np.subtract.outer(place, place)) / length
    smooth = np.linalg.cholesky((1.0 + away) * np.exp(-away) + 1e-9 * np.eye(NODES))
    return np.exp(-tilt * place)[:, None] * smooth


def _chosen(
    plain: list[_Run],
) -> tuple[list[_Run], np.ndarray, tuple[float, ...], tuple[float, ...], float]:
    """Return the runs with deviations of the most likely length, these, and what :func:`_sizes` returns."""
    tries = []
    for length, tilt in SHAPES:
        smooth = _correlated(length, tilt)
        runs = [run._replace(bent=run.bent @ smooth) for run in plain]
        at, upper, p_value = _sizes(runs)
        tries.append((_loss(runs, at)[0], runs, smooth, at, upper, p_value))
        if all(one <= _NONE for one in at[:2]):  # no deviation of any length
            break
    best = min(tries, key=lambda one: one[0])
    spare = sum(len(run.rest) for run in plain) - plain[0].slopes.shape[1] - 5  # two sizes, two numbers and the noise
    worth = WORTH * (1.0 + 5.0 / spare) if spare > 0 else np.inf  # for few readings, as Hurvich and Tsai correct it
    return (best if best[0] < tries[0][0] - worth else tries[0])[1:]


class _Sought(NamedTuple):
    """What the best estimate of the torque begins with: runs with deviations of a shape, and their sizes."""

    runs: list[_Run]
    smooth: np.ndarray
    sizes: tuple[float, ...]
    prior: np.ndarray
    shift: np.ndarray


def _true(task: Task, x: np.ndarray, functions: list[_Functions], first: _Sought) -> Torque:
    """Return the best estimate of the torque, re-linearised until it converges."""
    runs, smooth, sizes, prior, shift = first

    def misfit(state: _State) -> float:
        rests = [standardised(track, *_bent(task, x, at, functions[at], state)) for at, track in enumerate(task.tracks)]
        some = [rest for rest in rests if rest is not None]
        return float(np.sqrt(np.mean(np.concatenate(some) ** 2))) if len(some) == len(rests) else np.inf

    state = _State(np.zeros(len(x)), np.zeros(NODES))
    before, solved, found = np.inf, None, []
    for _ in range(ROUNDS):
        if solved is not None:
            if (plain := _linear(task, x, functions, state)) is None:
                break
            runs, smooth, _, sizes, _ = _chosen(plain)
        solved = _solved(runs, sizes, prior, shift)
        goal = _State(solved.move, smooth @ solved.deviation)
        for part in (1.0, 0.5, 0.2, 0.05):  # as far as the torque slows the gear
            tried = _State(*(a + part * (b - a) for a, b in zip(state, goal, strict=True)))
            if np.isfinite(after := misfit(tried)):
                break
        else:
            break
        found.append((after, tried, solved, smooth))
        if abs(after - before) < 0.01 * before:
            break
        state, before = tried, after
    assert solved is not None
    if found:
        _, state, solved, smooth = min(found, key=lambda one: one[0])
    free = len(task.scale)
    unit = functions[0].unit
    turn = np.zeros((free + NODES, len(x) + NODES))
    turn[:free, :free] = np.diag(task.scale)
    turn[free:, len(x) :] = unit[:, None] * smooth
    ends = []
    for at, track in enumerate(task.tracks):
        law, start = _bent(task, x, at, functions[at], state)
        ends.append((float(start[1]), last_speed(track, law, start)))
    model, numbers, starts = task.parted(x)
    law = Fit(model, numbers, np.zeros((free, free)), starts, 0.0)
    return Torque(
        law, state.x[:free] * task.scale, state.deviation * unit, functions[0].nodes,
        turn @ solved.joint @ turn.T, np.array(ends),
    )  # fmt: skip


def _moved(task: Task, best: Fit, x: np.ndarray, step: np.ndarray, runs: list[_Run], noise: float) -> Fit:
    """Return the fit at its generalised numbers, as far as residuals are linear on the way there."""
    before = [task.noted(x, run) for run in range(len(runs))]
    slopes = [task.slopes_of(x, run) for run in range(len(runs))]
    for part in (1.0, 0.5, 0.25, 0.125):
        after = [task.one(x + part * step, run) for run in range(len(runs))]
        if any(one is None for one in (*before, *after)):
            continue
        bend = [a - b - part * j @ step for a, b, j in zip(after, before, slopes, strict=True)]  # type: ignore[operator]
        if np.mean(np.concatenate(bend) ** 2) < LINEAR**2 * max(noise, best.chi2):
            model, numbers, starts = task.parted(x + part * step)
            return best._replace(model=model, numbers=numbers, starts=starts)
    return best


class _Solved(NamedTuple):
    """Generalised least squares at some sizes of the random effects."""

    move: np.ndarray
    joint: np.ndarray
    deviation: np.ndarray
    noise: float


def _whitened(run: _Run, own: float, pink: float) -> tuple[np.ndarray, float]:
    """Return slopes, responses to deviations and residuals with independent errors, and the log-determinant."""
    from scipy.linalg import solve_triangular

    whole = np.column_stack([run.slopes, run.bent, run.rest])
    if not (own or pink):
        return whole, 0.0
    root = np.linalg.cholesky(np.eye(len(run.rest)) + pink * run.pink + own * run.bent @ run.bent.T)
    size = 2.0 * float(np.sum(np.log(np.diag(root))))
    return solve_triangular(root, whole, lower=True, check_finite=False), size


def _loss(runs: list[_Run], at: tuple[float, ...]) -> tuple[float, float]:
    """Return minus twice the restricted log-likelihood, and the variance of the noise; priors are not included.

    By an orthogonal decomposition: normal equations would lose residuals far above the noise in their rounding errors.
    """
    from scipy.linalg import qr

    common, own, pink = (np.exp(one) if one > _NONE else 0.0 for one in at)
    some = np.any([np.any(run.slopes, axis=0) for run in runs], axis=0)
    p = int(some.sum())
    bent = NODES if common else 0
    rows, loss, count = [], 0.0, 0
    for run in runs:
        whole, size = _whitened(run, own, pink)
        slopes, deviation = whole[:, : len(some)], whole[:, len(some) : -1]
        rows.append(np.column_stack([deviation[:, :bent], slopes[:, some], whole[:, -1]]))
        loss += size
        count += len(run.rest)
    if common:
        rows.append(np.eye(NODES, NODES + p + 1) / np.sqrt(common))
        loss += NODES * np.log(common)
    table = np.vstack(rows)
    size = np.maximum(np.linalg.norm(table, axis=0), 1e-300)
    size[:bent] = 1.0
    root = np.abs(np.diag(qr(table / size, mode="r", overwrite_a=True, check_finite=False)[0]))
    small = np.maximum(root[bent:], 1e-14)  # numbers that these speeds do not separate
    s2 = (float(small[-1]) * size[-1]) ** 2 / max(count - p, 1)
    loss += 2.0 * float(np.sum(np.log(root[:bent])) + np.sum(np.log(small[:-1] * size[bent:-1])))
    return loss + (count - p) * np.log(s2), s2


def _solved(
    runs: list[_Run], at: tuple[float, ...], prior: np.ndarray, shift: np.ndarray, noise: float | None = None
) -> _Solved:
    """Solve for numbers and deviations, with what is known of the inertias, by singular values."""
    common, own, pink = (np.exp(one) if one > _NONE else 0.0 for one in at)
    p = len(prior)
    s2 = _loss(runs, at)[1] if noise is None else noise
    known = np.flatnonzero(prior)
    held = np.zeros((len(known), p + NODES + 1))
    held[np.arange(len(known)), known] = np.sqrt(s2)
    held[:, -1] = np.sqrt(s2) * shift[known]
    bound = np.zeros((NODES, p + NODES + 1))
    bound[:, p : p + NODES] = np.eye(NODES) / np.sqrt(common or 1.0)
    rows = np.vstack([*(_whitened(run, own, pink)[0] for run in runs), held, bound])
    if not common:
        rows[:, p : p + NODES] = 0.0
    table, rest = rows[:, :-1], rows[:, -1]
    size = np.linalg.norm(table, axis=0)
    size[size == 0.0] = 1.0  # such as the first angle of a speed
    u, w, v = np.linalg.svd(table / size, full_matrices=False)
    live = w > 1e-14 * w[0]
    root = (v[live].T / w[live]) / size[:, None]
    found = -root @ (u[:, live].T @ rest)
    joint = s2 * root @ root.T
    return _Solved(found[:p], joint, found[p:], s2)


def _sizes(runs: list[_Run]) -> tuple[tuple[float, ...], tuple[float, ...], float]:
    """Return the random effects' likely sizes, with the largest possible deviation, and the chance without them.

    Sizes are logarithms of variances over that of the noise.
    """
    from scipy.optimize import minimize
    from scipy.stats import chi2

    many = len(runs) > 1
    grid = (_NONE, *np.arange(-4.0, 16.0, 4.0))
    unit = [np.log(max(float(np.median(np.sum(run.bent**2, axis=1))), 1e-300)) for run in runs]
    base = float(np.median(unit))  # a variance for which deviations move readings by their noise

    def at(theta: np.ndarray) -> tuple[float, ...]:
        full = [theta[0] - base, theta[1] - base if many else _NONE, theta[-1]]
        return tuple(
            one if raw > _NONE else _NONE for one, raw in zip(full, (theta[0], theta[1], theta[-1]), strict=True)
        )

    def loss(theta: np.ndarray) -> float:
        if np.any(theta > 60.0):
            return 1e12
        try:
            return _loss(runs, at(theta))[0]
        except np.linalg.LinAlgError:
            return 1e12

    axes = 3 if many else 2
    start = np.full(axes, _NONE)
    least = none = loss(start)
    for axis in (*range(axes), *range(axes)):  # by turns along each axis, then downhill from there
        tries = []
        for value in grid:
            theta = start.copy()
            theta[axis] = value
            tries.append((loss(theta), value))
        least, start[axis] = min(tries)
    if least < none - 0.1:
        live = np.flatnonzero(start > _NONE)

        def of_live(free: np.ndarray) -> float:
            theta = start.copy()
            theta[live] = free
            return loss(theta)

        found = minimize(
            of_live, start[live], method="Nelder-Mead", options={"xatol": 0.1, "fatol": 0.02, "maxiter": 80}
        )
        if found.fun < least:
            least, start[live] = found.fun, found.x
    p_value = float(chi2.sf(max(none - least, 0.0), axes))
    likely = at(start)
    low = start[0] if start[0] > _NONE else -8.0
    for value in np.arange(low, low + 16.0, 0.5):  # a deviation as large as the record leaves possible
        theta = np.concatenate([[value], start[1:]])
        if loss(theta) > least + UPPER:
            break
        start[0] = value
    return likely, at(start), p_value
