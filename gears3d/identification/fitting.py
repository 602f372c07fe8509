"""Least squares of run-down laws: all tracks share the law, each has its own start."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.identification.slowing import Law, angles
from gears3d.identification.track import Track

BINS = 1500
"""Bins of a track; within one, errors are averaged."""
_STRETCHES = 24
"""Parts of a run-down between which speeds are differenced for a first guess."""
_EXPONENTS = np.linspace(0.4, 3.0, 14)
_IMPOSSIBLE = 1e9
"""Residual of laws that do not slow the gear down."""
_PATIENCE = 25
"""Steps of a search; one that needs more wanders among laws that these speeds do not tell apart."""


class Binned(NamedTuple):
    """A track against a first model, averaged.

    Args:
        time: mean of each bin [s], (m,).
        rest: mean of angle less first model [rad], (m,).
        first: the first model at ``time`` [rad], (m,).
        sigma: of ``rest`` [rad], (m,).
        speed: of the track at its start [rad/s].
        slowest: at its end [rad/s].
    """

    time: np.ndarray
    rest: np.ndarray
    first: np.ndarray
    sigma: np.ndarray
    speed: float
    slowest: float


class Fit(NamedTuple):
    """A fitted law.

    Args:
        terms: of the law.
        law: in decelerations.
        numbers: free numbers of the law, in the order of the terms, (p,).
        covariance: of these, scaled by the residuals, (p, p).
        starts: angle [rad] and speed [rad/s] of every track, (tracks, 2).
        chi2: mean squared standardised residual.
    """

    terms: tuple[str, ...]
    law: Law
    numbers: np.ndarray
    covariance: np.ndarray
    starts: np.ndarray
    chi2: float


def unpack(terms: tuple[str, ...], numbers: np.ndarray) -> Law:
    """Return the law of free numbers.

    Args:
        terms: of the law.
        numbers: in the order of the terms, (p,).

    >>> unpack(("coulomb", "power"), np.array([1.0, 2.0, 1.5]))
    Law(coulomb=1.0, viscous=0.0, coefficient=2.0, exponent=1.5)
    """
    left, found = list(map(float, numbers)), {}
    for term in terms:
        if term == "power":
            found["coefficient"], found["exponent"] = left.pop(0), left.pop(0)
        else:
            found[term] = left.pop(0)
    return Law(**found)


def thin(track: Track) -> Binned:
    """Return some points of a track, not averaged, for a first fit.

    Args:
        track: the run-down.
    """
    chosen = np.unique(np.linspace(0, len(track.time) - 1, BINS).astype(int))
    time, sigma = track.time[chosen], track.sigma[chosen]
    return Binned(time, track.angle[chosen], np.zeros(len(chosen)), sigma, track.speed, track.slowest)


def averaged(track: Track, law: Law, start: np.ndarray) -> Binned:
    """Return a track against a first model, averaged in bins: what is left is small and smooth.

    Args:
        track: the run-down.
        law: of the first model.
        start: its angle [rad] and speed [rad/s].
    """
    model = angles(law, start[0], start[1], track.time)
    assert model is not None
    count = min(BINS, len(track.time))
    edge = np.linspace(0, len(track.time), count + 1).astype(int)[:-1]
    weight = 1.0 / track.sigma**2
    total = np.add.reduceat(weight, edge)
    time = np.add.reduceat(track.time * weight, edge) / total
    rest = np.add.reduceat((track.angle - model) * weight, edge) / total
    first = angles(law, start[0], start[1], time)
    assert first is not None
    return Binned(time, rest, first, 1.0 / np.sqrt(total), track.speed, track.slowest)


def fit(
    tracks: list[Binned], terms: tuple[str, ...], begin: np.ndarray, masks: list[np.ndarray] | None = None
) -> Fit | None:
    """Fit a law to tracks.

    Args:
        tracks: the data.
        terms: of the law.
        begin: free numbers to begin with, (p,).
        masks: points of each track that are used; all unless given.

    Returns:
        The fit; ``None`` when no law of these terms runs down like that.
    """
    from scipy.optimize import least_squares

    masks = masks or [np.ones(len(track.time), bool) for track in tracks]
    scale = np.maximum(np.abs(begin), 1e-3 * np.abs(begin).max())

    def residuals(x: np.ndarray) -> np.ndarray:
        law, starts = unpack(terms, x[: len(scale)] * scale), x[len(scale) :].reshape(-1, 2)
        parts = [standardised(track, law, start) for track, start in zip(tracks, starts, strict=True)]
        whole = [part[mask] if part is not None else None for part, mask in zip(parts, masks, strict=True)]
        size = sum(int(mask.sum()) for mask in masks)
        if any(part is None for part in whole):
            return np.full(size, _IMPOSSIBLE)
        return np.concatenate(whole)  # type: ignore[arg-type]

    starts = np.array([[track.first[0] + track.rest[0], track.speed] for track in tracks]).ravel()
    best = least_squares(
        residuals, np.concatenate([begin / scale, starts]), x_scale="jac", xtol=1e-10, max_nfev=_PATIENCE
    )
    dof = len(best.fun) - len(best.x)
    if dof <= 0 or not np.all(np.isfinite(best.fun)) or np.all(best.fun == _IMPOSSIBLE):
        return None
    chi2 = 2.0 * best.cost / dof
    _, sizes, ways = np.linalg.svd(best.jac, full_matrices=False)
    ways = ways.T / np.maximum(sizes, 1e-15 * sizes[0])  # a variance that is hardly known is large, never negative
    inverse = (ways @ ways.T)[: len(scale), : len(scale)]
    numbers = best.x[: len(scale)] * scale
    covariance = chi2 * inverse * np.outer(scale, scale)
    return Fit(terms, unpack(terms, numbers), numbers, covariance, best.x[len(scale) :].reshape(-1, 2), chi2)


def standardised(track: Binned, law: Law, start: np.ndarray) -> np.ndarray | None:
    """Return residuals in standard deviations, (m,); ``None`` where the law does not run down.

    Args:
        track: the data.
        law: of the model.
        start: its angle [rad] and speed [rad/s].
    """
    model = angles(law, start[0], start[1], track.time)
    return None if model is None else (track.rest - (model - track.first)) / track.sigma


def guess(tracks: list[Track], terms: tuple[str, ...]) -> np.ndarray:
    """Return free numbers from speeds made by differencing: good enough to begin a search with.

    Args:
        tracks: the run-downs.
        terms: of the law.
    """
    speed, slowing = map(np.concatenate, zip(*(_differenced(track) for track in tracks), strict=True))
    best, least = np.zeros(0), np.inf
    for exponent in _EXPONENTS if "power" in terms else (0.0,):
        shapes = {"coulomb": np.ones_like(speed), "viscous": speed, "power": speed**exponent}
        columns = np.column_stack([shapes[term] for term in terms])
        size = np.abs(columns).max(axis=0)
        numbers, *_ = np.linalg.lstsq(columns / size, slowing, rcond=None)
        error = float(np.sum((columns / size @ numbers - slowing) ** 2))
        if error < least:
            least, best = error, numbers / size
            if "power" in terms:
                best = np.append(best, exponent)
    return best


def _differenced(track: Track) -> tuple[np.ndarray, np.ndarray]:
    """Return speeds [rad/s] and decelerations [rad/s²] of a run-down, by two rounds of differences over long ways."""
    at = np.linspace(0, len(track.time) - 1, _STRETCHES + 1).astype(int)
    time, angle = track.time[at], track.angle[at]
    speed, middle = np.diff(angle) / np.diff(time), 0.5 * (time[1:] + time[:-1])
    return 0.5 * (speed[1:] + speed[:-1]), -np.diff(speed) / np.diff(middle)
