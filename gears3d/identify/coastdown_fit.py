"""Coast-downs under a drag law: the motion, least squares, and covariances that include the misfit of the law."""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple, cast

import numpy as np

from gears3d.identify.coastdown_record import Track
from gears3d.identify.motion import Law, coasting, spinning_up
from gears3d.identify.parts import Model

# Bins of a track; within one, errors are averaged.
BINS = 400
# Parts of a run-down between which speeds are differenced for a first guess.
_STRETCHES = 24
_EXPONENTS = np.linspace(0.4, 3.0, 14)
# Residual of laws that do not slow the gear down.
_IMPOSSIBLE = 1e9
# Steps of a search among competing laws; one that needs more moves among laws that these speeds do not distinguish.
PATIENCE = 25
# Part of a track's last speed down to which a law must hold that ends in a speed, not at rest.
_BELOW = 0.8
# Relative step of differences.
_STEP = 1e-7


class Binned(NamedTuple):
    """A track against a first model, averaged.

    Args:
        time: mean of each bin [s], (m,).
        rest: mean of value less first model [rad], (m,).
        first: the first model at ``time`` [rad], (m,).
        sigma: of ``rest`` [rad], (m,).
        speed: of the track at its start [rad/s].
        slowest: at its end [rad/s].
        is_speed: whether the value is a speed [rad/s], not an angle [rad].
        fastest: of the track [rad/s]; the speed at its end where a known torque spins it up.
    """

    time: np.ndarray
    rest: np.ndarray
    first: np.ndarray
    sigma: np.ndarray
    speed: float
    slowest: float
    is_speed: bool
    fastest: float = 0.0


class Fit(NamedTuple):
    """Fitted parts.

    Args:
        model: parts and runs, with the inertias that fit best.
        numbers: free numbers of the parts, torques in N·m, (p,).
        covariance: of these, scaled by the residuals, with what is unsure of the inertias, (p, p).
        starts: angle [rad] and speed [rad/s] of every track, (tracks, 2).
        chi2: mean squared standardised residual.
    """

    model: Model
    numbers: np.ndarray
    covariance: np.ndarray
    starts: np.ndarray
    chi2: float

    def law(self, run: int) -> Law:
        """Return the deceleration of a run."""
        return self.model.law(self.numbers, run)


def thin(track: Track) -> Binned:
    """Return some points of a track, not averaged, for a first fit."""
    is_speed = track.measured == "speed"
    chosen = np.unique(np.linspace(0, len(track.time) - 1, BINS).astype(int))
    time, sigma = track.time[chosen], track.sigma[chosen]
    zero = np.zeros(len(chosen))
    return Binned(time, track.value[chosen], zero, sigma, track.speed, track.slowest, is_speed, track.fastest)


def averaged(track: Track, law: Law, start: np.ndarray) -> Binned:
    """Return a track against a first model, averaged in bins: the residual is small and smooth.

    ``start``: its angle [rad] and speed [rad/s].
    """
    is_speed = track.measured == "speed"
    model = _run(law, start, track.time, track.slowest, is_speed)
    assert model is not None
    count = min(BINS, len(track.time))
    edge = np.linspace(0, len(track.time), count + 1).astype(int)[:-1]
    weight = 1.0 / track.sigma**2
    total = np.add.reduceat(weight, edge)
    time = np.add.reduceat(track.time * weight, edge) / total
    rest = np.add.reduceat((track.value - model) * weight, edge) / total
    first = _run(law, start, time, track.slowest, is_speed)
    assert first is not None
    return Binned(time, rest, first, 1.0 / np.sqrt(total), track.speed, track.slowest, is_speed, track.fastest)


def fit(
    tracks: list[Binned],
    model: Model,
    begin: np.ndarray,
    masks: list[np.ndarray] | None = None,
    patience: int = PATIENCE,
) -> Fit | None:
    """Fit parts to tracks by a trust region method.

    An inertia that is not known exactly is free, too, with what is known of it as a prior.

    ``begin``: free numbers to begin with, (p,). Returns the fit; ``None`` when nothing of these terms runs down like
    that.

    Source: Kadmiri et al. 2012, section 4 (trust region), here on angles.
    """
    from scipy.optimize import least_squares

    masks = masks or [np.ones(len(track.time), bool) for track in tracks]
    task = Task(tracks, model, masks, np.maximum(np.abs(begin), 1e-3 * np.abs(begin).max()), {})
    at = task.begin(begin)
    best = least_squares(task.residuals, at, jac=cast(Any, task.slopes), x_scale="jac", xtol=1e-10, max_nfev=patience)
    points = sum(int(mask.sum()) for mask in masks)
    dof = points - len(best.x) + task.unsure
    if dof <= 0 or not np.all(np.isfinite(best.fun)) or np.all(best.fun[:points] == _IMPOSSIBLE):
        return None
    if not np.all(np.any(best.jac[:, : len(begin)], axis=0)):  # a number that moves nothing: these are not its data
        return None
    chi2 = float(np.sum(best.fun[:points] ** 2)) / dof
    best.jac[:points] /= np.sqrt(max(chi2, 1e-300))  # what is known of the inertias keeps its weight
    _, sizes, ways = np.linalg.svd(best.jac, full_matrices=False)
    ways = ways.T / np.maximum(sizes, 1e-15 * sizes[0])  # a variance that is hardly known is large, never negative
    covariance = (ways @ ways.T)[: len(begin), : len(begin)] * np.outer(task.scale, task.scale)
    found, numbers, starts = task.parted(best.x)
    return Fit(found, numbers, covariance, starts, chi2)


class Task(NamedTuple):
    """Free parameters: numbers over their scale, shifts of unsure inertias, starts of the tracks, in this order.

    ``last`` has the last argument and residuals of every run, as slopes are needed at the same argument.
    """

    tracks: list[Binned]
    model: Model
    masks: list[np.ndarray]
    scale: np.ndarray
    last: dict[int, tuple[bytes, np.ndarray | None]]

    @staticmethod
    def of(best: Fit, tracks: list[Binned]) -> tuple[Task, np.ndarray]:
        """Return the task of a fit, and its free numbers there."""
        masks = [np.ones(len(track.time), bool) for track in tracks]
        scale = np.maximum(np.abs(best.numbers), 1e-3 * np.abs(best.numbers).max())
        task = Task(tracks, best.model, masks, scale, {})
        shifts = [best.model.inertias[name].shift for name in best.model.unsure()]
        return task, np.concatenate([best.numbers / scale, shifts, np.ravel(best.starts)])

    @property
    def unsure(self) -> int:
        """Number of inertias that are not known exactly."""
        return len(self.model.unsure())

    def begin(self, numbers: np.ndarray) -> np.ndarray:
        """Return the free numbers to begin with."""
        starts = [[track.first[0] + track.rest[0], track.speed] for track in self.tracks]
        shifts = [self.model.inertias[name].shift for name in self.model.unsure()]
        return np.concatenate([numbers / self.scale, shifts, np.ravel(starts)])

    def parted(self, x: np.ndarray) -> tuple[Model, np.ndarray, np.ndarray]:
        """Return the model with its inertias, the numbers of the parts, and the starts of the tracks."""
        free, after = len(self.scale), len(self.scale) + self.unsure
        return self.model.shifted(x[free:after]), x[:free] * self.scale, x[after:].reshape(-1, 2)

    def one(self, x: np.ndarray, run: int) -> np.ndarray | None:
        """Return the residuals of one run."""
        model, numbers, starts = self.parted(x)
        found = standardised(self.tracks[run], model.law(numbers, run), starts[run])
        return None if found is None else found[self.masks[run]]

    def noted(self, x: np.ndarray, run: int) -> np.ndarray | None:
        """Return the residuals of one run, cached for the last argument."""
        if self.last.get(run, (b"", None))[0] != x.tobytes():
            self.last[run] = x.tobytes(), self.one(x, run)
        return self.last[run][1]

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Return the residuals of all runs, then the shifts of the inertias."""
        shifts = x[len(self.scale) : len(self.scale) + self.unsure]
        whole = [self.noted(x, run) for run in range(len(self.tracks))]
        if any(part is None for part in whole):
            size = sum(int(mask.sum()) for mask in self.masks)
            return np.concatenate([np.full(size, _IMPOSSIBLE), shifts])
        return np.concatenate([*cast(list[np.ndarray], whole), shifts])

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """Return the slopes of the residuals, by differences; a run moves with its own start, parts and inertias.

        The inertias' follow from those of the torques: their own differences would obscure what no run can determine.
        """
        rows = np.cumsum([0, *(int(mask.sum()) for mask in self.masks)])
        slopes = np.zeros((rows[-1] + self.unsure, len(x)))
        for run in range(len(self.tracks)):
            slopes[rows[run] : rows[run + 1]] = self.slopes_of(x, run)
        free = len(self.scale)
        slopes[rows[-1] :, free : free + self.unsure] = np.eye(self.unsure)
        return slopes

    def slopes_of(self, x: np.ndarray, run: int) -> np.ndarray:
        """Return the slopes of one run's residuals."""
        names = [part for part, _ in self.model.names()]
        linear = np.array([name != "exponent" for _, name in self.model.names()])
        slopes = np.zeros((int(self.masks[run].sum()), len(x)))
        if (at := self.noted(x, run)) is None:
            return slopes
        first = len(names) + self.unsure
        own = {share.part for share in self.model.runs[run].shares}
        for place in (*(k for k, part in enumerate(names) if part in own), first + 2 * run + 1):
            moved = x.copy()
            moved[place] += _STEP * max(abs(x[place]), 1e-3)
            if (there := self.one(moved, run)) is not None:
                slopes[:, place] = (there - at) / (moved[place] - x[place])
        all_torques = slopes[:, : len(names)] @ (x[: len(names)] * linear)  # less inertia acts like more of each
        if self.model.runs[run].torque:
            all_torques = all_torques + self.slope_of_torque(x, run, at)
        for place, share in enumerate(self.model.weights(run), start=len(names)):
            slopes[:, place] = -share * all_torques
        if not self.tracks[run].is_speed:
            slopes[:, first + 2 * run] = -1.0 / self.tracks[run].sigma[self.masks[run]]
        return slopes

    def slope_of_torque(self, x: np.ndarray, run: int, at: np.ndarray) -> np.ndarray:
        """Return the slope of one run's residuals in its known torque, relative."""
        runs = list(self.model.runs)
        runs[run] = runs[run]._replace(torque=runs[run].torque * (1.0 + _STEP))
        there = self._replace(model=self.model._replace(runs=tuple(runs))).one(x, run)
        return np.zeros_like(at) if there is None else (there - at) / _STEP


def standardised(track: Binned, law: Law, start: np.ndarray) -> np.ndarray | None:
    """Return residuals in standard deviations, (m,); ``None`` where the law does not run down.

    ``start``: its angle [rad] and speed [rad/s].
    """
    model = _run(law, start, track.time, track.slowest, track.is_speed)
    return None if model is None else (track.rest - (model - track.first)) / track.sigma


def _run(law: Law, start: np.ndarray, since: np.ndarray, last: float, is_speed: bool) -> np.ndarray | None:
    """Return angle or speed; a law with a driving part need not hold down to rest."""
    if law.push:
        risen = spinning_up(law, start[1], since, "speed" if is_speed else "")
        return None if risen is None else risen[1] if is_speed else start[0] + risen[0]
    drives = law.coulomb < 0.0 or law.viscous < 0.0 or law.coefficient < 0.0 or law.table is not None
    slowest = _slowest(law, start[1], min(_BELOW * last, 0.9 * start[1])) if drives else 0.0
    found = coasting(law, start[1], since, slowest, "speed" if is_speed else "")
    if found is None:
        return None
    return found[1] if is_speed else start[0] + found[0]


def _slowest(law: Law, first: float, last: float) -> float:
    """Return a speed down to which a law with a driving part slows the gear, at most ``last``.

    The last speed of a track is known roughly, and a model that ends above the true one would stand still there.
    """
    if not last > 0.0:
        return last
    below = np.linspace(0.0, last, 41)
    driven = np.flatnonzero(~(law.deceleration(below[1:]) > 0.02 * abs(float(law.deceleration(np.array([last]))[0]))))
    return float(below[min(driven[-1] + 2, 40)]) if driven.size else float(below[1])


def last_speed(track: Binned, law: Law, start: np.ndarray) -> float:
    """Return the speed at the end of a fitted run [rad/s].

    ``start``: its angle [rad] and speed [rad/s].
    """
    speed = _run(law, start, track.time[-1:], track.slowest, True)
    return track.slowest if speed is None else max(float(speed[0]), 1e-3 * track.slowest)


def guess(tracks: list[Track], model: Model) -> np.ndarray:
    """Return start values of the free numbers from differenced speeds."""
    parted = [_differenced(track) for track in tracks]
    pushes = [each.torque / model.inertia(run) for run, each in enumerate(model.runs)]
    slowing = np.concatenate([slow + push for (_, slow), push in zip(parted, pushes, strict=True)])
    names = model.names()
    powers = [place for place, (_, name) in enumerate(names) if name == "exponent"]
    linear = [place for place in range(len(names)) if place not in powers]
    best, least = np.zeros(len(names)), np.inf
    grid = _EXPONENTS if len(powers) < 2 else _EXPONENTS[1::4]
    for exponents in product(grid, repeat=min(len(powers), 2)):
        numbers = np.zeros(len(names))
        numbers[powers] = np.resize(exponents, len(powers)) if powers else 0.0
        columns = np.zeros((len(slowing), len(linear)))
        for column, place in enumerate(linear):
            numbers[linear] = 0.0
            numbers[place] = 1.0
            columns[:, column] = np.concatenate(
                [model.law(numbers, run).deceleration(speed) for run, (speed, _) in enumerate(parted)]
            )
        size = np.maximum(np.abs(columns).max(axis=0), 1e-300)
        found, *_ = np.linalg.lstsq(columns / size, slowing, rcond=None)
        error = float(np.sum((columns / size @ found - slowing) ** 2))
        if error < least:
            least = error
            numbers[linear] = found / size
            best = numbers
    return best


def guess_inertia(tracks: list[Track]) -> float:
    """Return the inertia that coast-downs and spin-ups under known torques have in common [kg·m²], roughly.

    Differenced accelerations are one parabola over the speed, less the torque over the inertia where there is one; not
    positive where they do not fit together.
    """
    parted = [_differenced(track) for track in tracks]
    speed = np.concatenate([speed for speed, _ in parted])
    slowing = np.concatenate([slow for _, slow in parted])
    push = np.concatenate([np.full(len(one), track.torque) for (one, _), track in zip(parted, tracks, strict=True)])
    u = speed / speed.max()
    found, *_ = np.linalg.lstsq(np.column_stack([np.ones_like(u), u, u**2, -push]), slowing, rcond=None)
    return 1.0 / float(found[3]) if found[3] > 0.0 else 0.0


def _differenced(track: Track) -> tuple[np.ndarray, np.ndarray]:
    """Return speeds [rad/s] and decelerations [rad/s²] of a coast-down, by differences over long stretches."""
    count = len(track.time)
    at = np.linspace(0, count, min(_STRETCHES, max(count // 4, min(count - 1, 4))) + 1).astype(int)
    if track.measured == "speed":
        size = np.diff(at)
        speed, middle = (np.add.reduceat(x, at[:-1]) / size for x in (track.value, track.time))
    else:
        at[-1] -= 1
        time, angle = track.time[at], track.value[at]
        speed, middle = np.diff(angle) / np.diff(time), 0.5 * (time[1:] + time[:-1])
    return 0.5 * (speed[1:] + speed[:-1]), -np.diff(speed) / np.diff(middle)
