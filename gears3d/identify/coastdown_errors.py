"""Intervals of a fitted drag that count what blocks of the record disagree about, by restricted maximum likelihood.

A least-squares covariance is right only where the law holds and errors are independent. Here the true torque may
deviate from the law by random amounts at several speeds (common to all runs, and of each run), and readings may have
1/f noise. The sizes of these three random effects are found from the record by restricted maximum likelihood: where
blocks of the record agree within their errors the sizes are zero and the intervals those of least squares; where they
disagree, the disagreement is in every interval. Random effects were preferred to a block jackknife, as blocks of a
coast-down see different speeds, so that estimates from single blocks are no repeats of each other, and to sandwich
covariances, which with a few effective blocks are too narrow.

Source: Patterson & Thompson 1971, Biometrika 58, 545 (restricted likelihood); Kennedy & O'Hagan 2001, J. R. Stat. Soc.
B 63, 425 (deviation of a law as a random function); Self & Liang 1987, JASA 82, 605 (test of variances).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.identify.coastdown_fit import Binned, Fit, Task, standardised

NODES = 10
"""Speeds at which the torque may deviate from the law: more than a law has numbers, fewer than blocks tell apart."""
POINTS = 120
"""Points of a run in the likelihood, means of its bins: dense covariances of more cost time and tell no more."""
SURE = 0.01
"""Chance of such residuals under the law with independent errors, below which a law is said not to fit."""
UPPER = 1.0
"""Rise of minus twice the log-likelihood up to which a deviation of the torque is allowed for: one standard deviation.
The most likely size is too often none, where noise hides what the law misses."""
LINEAR = 0.1
"""Curvature of residuals, in their own size, up to which a step of generalised least squares is taken."""
_STEP = 1e-4
"""Deviation of the torque, in its typical size, by which responses are differenced."""
_NONE = -300.0
"""Logarithm of a variance that is none."""


class Errors(NamedTuple):
    """What is known of a fit once disagreement counts.

    Args:
        fit: with numbers and covariance by generalised least squares.
        deviation: of the torque from the law at ``speeds`` (best estimate) [N·m], (NODES,).
        untaken: further change of the numbers that goes with it, where the fit is not linear so far, (p,).
        speeds: rising [rad/s], (NODES,).
        joint: covariance of numbers and deviations, (p + NODES, p + NODES).
        dof: degrees of freedom of each number's variance, (p,).
        dof_torque: of a torque's variance.
        sizes: deviation of the torque common to all runs and of each run, over the typical torque; 1/f noise over the
            independent noise of a point.
        p_structure: chance of such residuals if the law held and errors were independent.
        shifts: standard deviation of each unsure inertia's shift, in standard deviations of what was known before.
    """

    fit: Fit
    deviation: np.ndarray
    untaken: np.ndarray
    speeds: np.ndarray
    joint: np.ndarray
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


def errors_of(best: Fit, data: list[Binned]) -> Errors:
    """Return numbers, intervals and residual test of a fit.

    Args:
        best: by least squares.
        data: the runs as they were fitted.
    """
    low, high = min(run.slowest for run in data), max(max(run.speed, run.fastest) for run in data)
    speeds = _nodes(best, data, low, high)
    task, x = Task.of(best, data)
    scales = _typical(best, speeds)
    runs = [_run(task, x, at, speeds, scales[at]) for at in range(len(data))]
    prior = np.zeros(len(x))
    prior[len(best.numbers) : len(best.numbers) + task.unsure] = 1.0
    some = [one for one in range(len(x)) if any(np.any(run.slopes[:, one]) for run in runs) or prior[one]]
    runs = [run._replace(slopes=run.slopes[:, some]) for run in runs]
    prior, shift = prior[some], x[some] * prior[some]
    many = len(data) > 1
    at, upper, p_value = _sizes(runs, many)
    solved = _solved(runs, at, prior, shift)
    free = len(best.numbers)
    full = np.zeros(len(x))
    full[some] = solved.move
    moved = _moved(task, best, x, full, runs, solved.noise) if any(one > _NONE for one in at) else best
    scale = np.concatenate([task.scale, np.ones(NODES)])
    places = [*range(free), *range(len(some), len(some) + NODES)]
    unit = np.mean(scales, axis=0)
    scale[free:] = unit
    covariance = (solved.joint[np.ix_(places, places)] * np.outer(scale, scale))[:free, :free]
    wide = _solved(runs, upper, prior, shift)  # the law's numbers by the likely sizes, the true torque by possible ones
    joint = wide.joint[np.ix_(places, places)] * np.outer(scale, scale)
    calm = _solved(runs, (_NONE, _NONE, at[2]), prior, shift, solved.noise).joint
    share = 1.0 - np.clip(np.diag(calm)[:free] / np.maximum(np.diag(solved.joint)[:free], 1e-300), 0.0, 1.0)
    nodes = max(NODES * (len(data) if at[1] > at[0] else 1) - free, 2)
    points = max(sum(len(run.rest) for run in runs) - len(some), 1)
    known = np.flatnonzero(prior).tolist()
    if known:  # what an inertia's own error makes of a variance is known, not estimated
        sure = [run._replace(slopes=np.delete(run.slopes, known, axis=1)) for run in runs]
        plain = _solved(sure, (_NONE, _NONE, at[2]), np.delete(prior, known), np.delete(shift, known), solved.noise)
        own = np.diag(plain.joint)[:free] / np.maximum(np.diag(solved.joint)[:free], 1e-300)
    else:
        own = 1.0 - share
    dof = 1.0 / (share**2 / nodes + np.clip(own, 1e-6, 1.0) ** 2 / points)
    unit_of = (np.sqrt(solved.noise), np.sqrt(solved.noise), 1.0)
    sizes = tuple(
        float(np.exp(0.5 * one)) * float(by) if one > _NONE else 0.0 for one, by in zip(at, unit_of, strict=True)
    )
    untaken = best.numbers + wide.move[:free] * task.scale - moved.numbers
    moved = moved._replace(covariance=covariance)
    unsure = [some.index(one) for one in range(free, free + task.unsure)]
    shifts = np.sqrt(np.maximum(np.diag(solved.joint)[unsure], 0.0))
    deviation, dof_torque = wide.deviation * unit, float(min(nodes, points))
    return Errors(
        moved, deviation, untaken, speeds, joint, dof, dof_torque, (sizes[0], sizes[1], sizes[2]), p_value, shifts
    )


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


def _nodes(best: Fit, data: list[Binned], low: float, high: float) -> np.ndarray:
    """Return speeds, half way between evenly spaced ones and those at even times."""
    even = np.linspace(low, high, NODES)
    run = max(range(len(data)), key=lambda at: data[at].speed)
    grid = np.linspace(low, high, 400)
    slowing = np.maximum(best.law(run).deceleration(grid), 1e-300)
    time = np.concatenate([[0.0], np.cumsum(np.diff(grid) * 0.5 * (1.0 / slowing[1:] + 1.0 / slowing[:-1]))])
    return 0.5 * (even + np.interp(np.linspace(0.0, time[-1], NODES), time, grid))


def _typical(best: Fit, speeds: np.ndarray) -> list[np.ndarray]:
    """Return for each run the decelerations by which its law may deviate: half of its own there, half of the mean."""
    found = []
    for run in range(len(best.model.runs)):
        slowing = np.abs(best.law(run).deceleration(speeds))
        found.append(0.5 * slowing + 0.5 * float(slowing.mean()))
    return [one * best.model.inertia(run) for run, one in enumerate(found)]


def _run(task: Task, x: np.ndarray, at: int, speeds: np.ndarray, scale: np.ndarray) -> _Run:
    """Return residuals and their slopes, means of neighbours."""
    track = task.tracks[at]
    model, numbers, starts = task.parted(x)
    law, per = model.law(numbers, at), 1.0 / model.inertia(at)
    rest = standardised(track, law, starts[at])
    assert rest is not None
    slopes = task.slopes_of(x, at)
    bent = np.zeros((len(rest), NODES))
    for node in range(NODES):
        for step in (_STEP, -_STEP):
            table = np.zeros(NODES)
            table[node] = step * scale[node] * per
            there = standardised(track, law._replace(table=(speeds, table)), starts[at])
            if there is not None:
                zero = standardised(track, law._replace(table=(speeds, 0.0 * table)), starts[at])
                bent[:, node] = (there - zero) / step if zero is not None else 0.0
                break
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
    return _Run(mean(rest[:, None])[:, 0], mean(slopes), mean(bent), pink)


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
    """Return minus twice the restricted log-likelihood, and the variance of the noise; priors are left aside.

    By an orthogonal decomposition: normal equations would lose residuals far above the noise in their rounding errors.
    """
    from scipy.linalg import qr

    common, own, pink = (np.exp(one) if one > _NONE else 0.0 for one in at)
    p = runs[0].slopes.shape[1]
    bent = NODES if common else 0
    rows, loss, count = [], 0.0, 0
    for run in runs:
        whole, size = _whitened(run, own, pink)
        rows.append(np.column_stack([whole[:, p : p + bent], whole[:, :p], whole[:, -1]]))
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
    size = np.maximum(np.linalg.norm(table, axis=0), 1e-300)
    u, w, v = np.linalg.svd(table / size, full_matrices=False)
    live = w > 1e-14 * w[0]
    root = (v[live].T / w[live]) / size[:, None]
    found = -root @ (u[:, live].T @ rest)
    joint = s2 * root @ root.T
    return _Solved(found[:p], joint, found[p:], s2)


def _sizes(runs: list[_Run], many: bool) -> tuple[tuple[float, ...], tuple[float, ...], float]:
    """Return the random effects' likely sizes, with the largest possible deviation, and the chance without them.

    Sizes are logarithms of variances over that of the noise.
    """
    from scipy.optimize import minimize
    from scipy.stats import chi2

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
