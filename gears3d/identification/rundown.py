"""Drag from run-downs: which law slows the gear, with which numbers, and how sure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import InputError
from gears3d.identification.fitting import Binned, Fit, averaged, fit, guess, standardised, thin, unpack
from gears3d.identification.law import Identified, Parameter
from gears3d.identification.track import Track, read_track

CANDIDATES = (("coulomb",), ("viscous",), ("coulomb", "viscous"), ("coulomb", "power"), ("coulomb", "viscous", "power"))
"""Laws that compete, the simpler before the richer; Kadmiri et al. 2012, eqs (4)-(7), Rigaud 2020, Ottewill 2010."""
BLOCKS = 20
"""Stretches of a run-down that are held out in turn."""
LEVEL = 0.01
"""A richer law is taken when its better prediction would come by chance this rarely."""


def identify_rundown(
    files: Sequence[str | Path | Track], inertia: float, inertia_uncertainty: float = 0.0
) -> Identified:
    """Identify the drag on a gear from records of its run-down.

    The angle is fitted, not a speed made by differencing: an encoder knows it exactly at the moments its count changes.
    Among the laws, a richer one is taken only where it predicts held-out stretches of the record better.

    Args:
        files: records of the same drag, each with its own start; columns ``time_s`` and ``theta_loose_rad`` or
            ``omega_rad_s``; or tracks.
        inertia: of what runs down [kg·m²].
        inertia_uncertainty: its standard deviation [kg·m²]; a run-down knows the ratio of drag and inertia only.

    Returns:
        ``coulomb`` [N·m], ``viscous`` [N·m·s/rad], ``coefficient`` [N·m at 1 rad/s] and ``exponent`` of the law found.

    Raises:
        InputError: a record cannot be used, or no law fits.

    Source: Kadmiri et al. 2012, eqs (4)-(7); Rigaud & Perret-Liaudet 2020, section 3; Ottewill et al. 2010, (14)-(16).

    >>> from gears3d.identification.track import make_track
    >>> t = np.linspace(0.0, 0.9, 9001)
    >>> found = identify_rundown([make_track(t, 3.0 * t - 1.5 * t**2)], inertia=0.0695)
    >>> found.law, round(found.parameters["coulomb"].value, 6)
    ('coulomb', 0.2085)
    """
    tracks = [file if isinstance(file, Track) else read_track(file) for file in files]
    data, rough = _prepared(tracks)
    fits = [fit(data, first.terms, first.numbers) for first in rough]
    sound = [found for found in fits if found is not None and _signs_hold(found)]
    if not sound:
        raise InputError("no drag law runs down like these records: are they run-downs of a free gear?")
    folds = _folds(data)
    losses = {found.terms: _held_out(data, found, folds) for found in sound}
    best = _choose(sound, losses)
    return _identified(best, data, tracks, inertia, inertia_uncertainty, losses)


def _prepared(tracks: list[Track]) -> tuple[list[Binned], list[Fit]]:
    """Average the tracks against the best of the first fits; return these fits, too."""
    points = [thin(track) for track in tracks]
    fits = [fit(points, terms, guess(tracks, terms)) for terms in CANDIDATES]
    found = [candidate for candidate in fits if candidate is not None]
    if not found:
        raise InputError("no drag law runs down like these records: are they run-downs of a free gear?")
    first = min(found, key=lambda candidate: candidate.chi2)
    pairs = zip(tracks, first.starts, strict=True)
    return [averaged(track, first.law, start) for track, start in pairs], found


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
        found = fit(data, whole.terms, whole.numbers, [mark < 0 for mark in marks])
        for index, (track, mark) in enumerate(zip(data, marks, strict=True)):
            rest = None if found is None else standardised(track, found.law, found.starts[index])
            losses += [
                float(np.mean(rest[mark == block] ** 2)) if rest is not None else np.inf
                for block in np.unique(mark[mark >= 0])
            ]
    return np.array(losses)


def _choose(sound: list[Fit], losses: dict[tuple[str, ...], np.ndarray]) -> Fit:
    """Return the simplest law that no richer one beats on held-out stretches."""
    from scipy.stats import wilcoxon

    def size(found: Fit) -> int:
        return len(found.numbers)

    best = min((f for f in sound if size(f) == size(min(sound, key=size))), key=lambda f: losses[f.terms].mean())
    for richer in sorted(sound, key=size):
        if size(richer) <= size(best):
            continue
        gain = losses[best.terms] - losses[richer.terms]
        if not np.all(np.isfinite(gain)):
            continue
        verdict: Any = wilcoxon(gain, alternative="greater")
        if gain.mean() > 0.0 and verdict.pvalue < LEVEL:
            best = richer
    return best


def _identified(
    best: Fit,
    data: list[Binned],
    tracks: list[Track],
    inertia: float,
    inertia_uncertainty: float,
    losses: dict[tuple[str, ...], np.ndarray],
) -> Identified:
    names = {"coulomb": ("coulomb",), "viscous": ("viscous",), "power": ("coefficient", "exponent")}
    units = {"coulomb": "N m", "viscous": "N m s/rad", "coefficient": "N m", "exponent": ""}
    parameters = {}
    for place, name in enumerate(name for term in best.terms for name in names[term]):
        value, error = float(best.numbers[place]), float(np.sqrt(best.covariance[place, place]))
        if name != "exponent":
            error = float(np.hypot(error * inertia, value * inertia_uncertainty))
            value *= inertia
        parameters[name] = Parameter(value, units[name], value - 1.96 * error, value + 1.96 * error)
    goodness: dict[str, Any] = {
        "chi2": best.chi2,
        "rms_angle_rad": float(np.sqrt(np.mean(np.concatenate([_rest(t, best, i) for i, t in enumerate(data)]) ** 2))),
        "held_out": {"+".join(terms): _finite(loss.mean()) for terms, loss in losses.items()},
        "speed_rad_s": [min(track.slowest for track in tracks), max(track.speed for track in tracks)],
        "points": int(sum(len(track.time) for track in tracks)),
        "quantum_rad": [track.quantum for track in tracks],
    }
    curves = _curves(best, tracks, inertia)
    curves["residuals"] = [(track.time, _rest(track, best, index)) for index, track in enumerate(data)]
    law = "+".join(best.terms)
    return Identified(law, parameters, goodness, _snippet(parameters), curves, _warnings(best, parameters))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _rest(track: Binned, best: Fit, index: int) -> np.ndarray:
    found = standardised(track, best.law, best.starts[index])
    assert found is not None
    return found * track.sigma


def _curves(best: Fit, tracks: list[Track], inertia: float) -> dict[str, Any]:
    """Return the torque over the speed with its 95 % band, by the law's slopes in its numbers."""
    speed = np.linspace(min(t.slowest for t in tracks), max(t.speed for t in tracks), 200)
    torque = inertia * best.law.deceleration(speed)
    slopes = []
    for place, number in enumerate(best.numbers):
        step = 1e-6 * max(abs(number), 1e-12)
        moved = best.numbers.copy()
        moved[place] += step
        slopes.append((inertia * unpack(best.terms, moved).deceleration(speed) - torque) / step)
    slope = np.array(slopes)
    band = 1.96 * np.sqrt(np.maximum(np.einsum("ik,ij,jk->k", slope, best.covariance, slope), 0.0))
    return {"speed_rad_s": speed, "torque_N_m": torque, "low_N_m": torque - band, "high_N_m": torque + band}


def _snippet(parameters: dict[str, Parameter]) -> str:
    """Return the law as TOML of a scenario."""
    coulomb = parameters["coulomb"].value if "coulomb" in parameters else 0.0
    lines = ["[drag]", f'torque = "{coulomb:.6g} N m"']
    if "viscous" in parameters:
        value = parameters["viscous"].value
        lines += ["[[effect]]", 'kind = "drag_viscous"', f'coefficient = "{value:.6g} N m s/rad"']
    if "exponent" in parameters:
        value, exponent = parameters["coefficient"].value, parameters["exponent"].value
        lines += ["[[effect]]", 'kind = "drag_power"', f'coefficient = "{value:.6g} N m"', f"exponent = {exponent:.6g}"]
    return "\n".join(lines) + "\n"


def _warnings(best: Fit, parameters: dict[str, Parameter]) -> tuple[str, ...]:
    found = []
    for name, parameter in parameters.items():
        if parameter.low <= 0.0 <= parameter.high:
            found.append(f"{name} cannot be told from zero")
    error = np.sqrt(np.diag(best.covariance))
    alike = np.abs(best.covariance / np.outer(error, error)) - np.eye(len(error))
    if alike.size > 1 and alike.max() > 0.99:
        found.append("terms of the law are hardly told apart by these speeds: record a wider range")
    if best.chi2 > 2.0:
        found.append(f"residuals are {best.chi2**0.5:.1f} times the encoder's error: the law leaves something out")
    return tuple(found)
