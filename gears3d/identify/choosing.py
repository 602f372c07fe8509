"""The law among those that compete: a richer one only where it predicts better what it was not fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from gears3d.errors import InputError
from gears3d.identify.fitting import Binned, Fit, averaged, fit, guess, standardised, thin
from gears3d.identify.parts import ALONE, Model
from gears3d.identify.track import Track

BLOCKS = 20
"""Stretches of a run-down that are held out in turn."""
PATIENT = 300
"""Steps of the last search."""
LEVEL = 0.01
"""A richer law is taken when its better prediction would come by chance this rarely."""


class Choice(NamedTuple):
    """The law that was taken.

    Args:
        best: its fit.
        data: the tracks as they were fitted.
        losses: mean squared standardised error on stretches held out, by law.
    """

    best: Fit
    data: list[Binned]
    losses: dict[str, float | None]


def label(model: Model) -> str:
    """Return the name of a law.

    Args:
        model: its parts.
    """
    if [part.name for part in model.parts] == [ALONE]:
        return "+".join(model.parts[0].terms)
    return ", ".join(f"{part.name}: {'+'.join(part.terms)}" for part in model.parts)


def choose(tracks: list[Track], models: Sequence[Model]) -> Choice:
    """Fit models that compete, and take the simplest that no richer one beats on held-out stretches.

    Args:
        tracks: the run-downs.
        models: with the same runs; not asked how well it predicts when it stands alone.

    Raises:
        InputError: none fits.
    """
    points = [thin(track) for track in tracks]
    rough = [found for model in models if (found := fit(points, model, guess(tracks, model))) is not None]
    if not rough:
        raise _nothing()
    first = min(rough, key=lambda candidate: candidate.chi2)
    data = [averaged(track, first.law(run), first.starts[run]) for run, track in enumerate(tracks)]
    fits = [fit(data, one.model, one.numbers) for one in rough]
    sound = [found for found in fits if found is not None and (_signs_hold(found) or len(models) == 1)]
    if not sound:
        raise _nothing()
    if len(models) == 1:
        return Choice(_settled(sound[0], data), data, {})
    folds = _folds(data)
    losses = [_held_out(data, found, folds) for found in sound]
    best = _best(sound, losses)
    shown = {label(found.model): _finite(loss.mean()) for found, loss in zip(sound, losses, strict=True)}
    return Choice(_settled(sound[best], data), data, shown)


def _settled(best: Fit, data: list[Binned]) -> Fit:
    """Return a fit carried on until it rests: terms that are hardly told apart need many steps."""
    return fit(data, best.model, best.numbers, patience=PATIENT) or best


def _nothing() -> InputError:
    return InputError("no drag law runs down like these records: are they run-downs of a free gear?")


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _signs_hold(found: Fit) -> bool:
    """Whether every term resists, within its error."""
    error = np.sqrt(np.diag(found.covariance))
    return bool(np.all(found.numbers > -2.0 * error))


def _folds(data: list[Binned]) -> list[list[np.ndarray]]:
    """Return for two folds the block that each bin belongs to where it is held out, -1 where it trains."""
    folds = []
    for fold in range(2):
        marks = []
        for track in data:
            block = np.arange(len(track.time)) * BLOCKS // len(track.time)
            marks.append(np.where(block % 2 == fold, block, -1))
        folds.append(marks)
    return folds


def _held_out(data: list[Binned], whole: Fit, folds: list[list[np.ndarray]]) -> np.ndarray:
    """Return the mean squared standardised error of each held-out stretch, infinite where no fit was found."""
    losses = []
    for marks in folds:
        found = fit(data, whole.model, whole.numbers, [mark < 0 for mark in marks])
        for run, (track, mark) in enumerate(zip(data, marks, strict=True)):
            rest = None if found is None else standardised(track, found.law(run), found.starts[run])
            losses += [
                float(np.mean(rest[mark == block] ** 2)) if rest is not None else np.inf
                for block in np.unique(mark[mark >= 0])
            ]
    return np.array(losses)


def _best(sound: list[Fit], losses: list[np.ndarray]) -> int:
    """Return the place of the simplest law that no richer one beats on held-out stretches."""
    sizes = [len(found.numbers) for found in sound]
    best = min((at for at, size in enumerate(sizes) if size == min(sizes)), key=lambda at: losses[at].mean())
    for richer in sorted(range(len(sound)), key=lambda at: sizes[at]):
        if sizes[richer] <= sizes[best]:
            continue
        gain = losses[best] - losses[richer]
        if not np.all(np.isfinite(gain)) or gain.mean() <= 0.0:
            continue
        from scipy.stats import wilcoxon  # takes longer to load than most coast-downs to fit

        verdict: Any = wilcoxon(gain, alternative="greater")
        if verdict.pvalue < LEVEL:
            best = richer
    return best
