"""A fitted drag in words: parameters with intervals, torque over speed, TOML for a scenario, warnings."""

from __future__ import annotations

from typing import Any

import numpy as np

from gears3d.identify.choosing import Choice, label
from gears3d.identify.fitting import Binned, Fit, standardised
from gears3d.identify.law import Identified, Parameter
from gears3d.identify.parts import ALONE, UNITS, Share
from gears3d.identify.track import Track

POINTS = 200
"""Of a curve."""


def tell(choice: Choice, tracks: list[Track]) -> Identified:
    """Return the law that was taken as an answer.

    Args:
        choice: the law.
        tracks: the run-downs.
    """
    best, data = choice.best, choice.data
    parameters = parameters_of(best)
    rests = [_rest(track, best, run) for run, track in enumerate(data)]
    goodness: dict[str, Any] = {
        "chi2": best.chi2,
        "rms_angle_rad": float(np.sqrt(np.mean(np.concatenate(rests) ** 2))),
        "held_out": choice.losses,
        "speed_rad_s": [min(track.slowest for track in tracks), max(track.speed for track in tracks)],
        "points": int(sum(len(track.time) for track in tracks)),
        "quantum_rad": [track.quantum for track in tracks],
    }
    curves = curves_of(best, tracks)
    curves["residuals"] = [(track.time, rest) for track, rest in zip(data, rests, strict=True)]
    return Identified(label(best.model), parameters, goodness, snippet(best), curves, _warnings(best, parameters))


def parameters_of(best: Fit) -> dict[str, Parameter]:
    """Return the free numbers with their intervals, those of parts as ``part.name``.

    Args:
        best: the fit.
    """
    errors = np.sqrt(np.diag(best.covariance))
    parameters = {}
    for (part, name), value, error in zip(best.model.names(), best.numbers, errors, strict=True):
        key = name if part == ALONE else f"{part}.{name}"
        wide = 1.96 * float(error)
        parameters[key] = Parameter(float(value), UNITS[name], float(value) - wide, float(value) + wide)
    return parameters


def _rest(track: Binned, best: Fit, run: int) -> np.ndarray:
    found = standardised(track, best.law(run), best.starts[run])
    assert found is not None
    return found * track.sigma


def curves_of(best: Fit, tracks: list[Track]) -> dict[str, Any]:
    """Return the torque over the speed with its 95 % band: of the whole drag, and of each part.

    Args:
        best: the fit.
        tracks: the run-downs.
    """
    speed = np.linspace(min(t.slowest for t in tracks), max(t.speed for t in tracks), POINTS)
    covariance = best.covariance
    most = max(range(len(tracks)), key=lambda run: len(best.model.runs[run].shares))
    whole = _torque(best, best.model.runs[most].shares, most, speed, covariance)
    parts = {
        part.name: {"speed_rad_s": speed, **_torque(best, (Share(part.name),), most, speed, covariance)}
        for part in best.model.parts
    }
    return {"speed_rad_s": speed, **whole, "parts": parts if list(parts) != [ALONE] else {}}


def _torque(
    best: Fit, shares: tuple[Share, ...], run: int, speed: np.ndarray, covariance: np.ndarray
) -> dict[str, np.ndarray]:
    """Return torque and band of some parts, by the law's slopes in its numbers."""
    only = best.model.runs[run]._replace(shares=shares)
    model = best.model._replace(runs=(only,))
    inertia = model.inertia(0)

    def at(numbers: np.ndarray) -> np.ndarray:
        return inertia * model.law(numbers, 0).deceleration(speed)

    torque, slopes = at(best.numbers), []
    for place, number in enumerate(best.numbers):
        moved = best.numbers.copy()
        moved[place] += 1e-6 * max(abs(number), 1e-12)
        slopes.append((at(moved) - torque) / (moved[place] - number))
    slope = np.array(slopes)
    band = 1.96 * np.sqrt(np.maximum(np.einsum("ik,ij,jk->k", slope, covariance, slope), 0.0))
    return {"torque_N_m": torque, "low_N_m": torque - band, "high_N_m": torque + band}


def snippet(best: Fit) -> str:
    """Return the drag as TOML of a scenario: what the loose gear feels out of mesh, and the mesh.

    Args:
        best: the fit.
    """
    values = dict(zip(best.model.names(), map(float, best.numbers), strict=True))
    against = {share.part: share.against for run in best.model.runs for share in run.shares}
    warm = sorted({part.name.partition("@")[2] for part in best.model.parts if "@" in part.name}, key=float)
    middle = warm[len(warm) // 2] if warm else ""
    told = [part for part in best.model.parts if part.name != "drive" and part.name.partition("@")[2] in ("", middle)]
    base = sum(values.get((part.name, "coulomb"), 0.0) for part in told)
    lines = [f"# at {middle} degC"] * bool(warm) + ["[drag]", f'torque = "{max(base, 0.0):.6g} N m"']
    for part in told:
        if (slope := values.get((part.name, "viscous"))) is not None:
            kind = "mesh_drag" if part.name == "mesh" else "drag_viscous"
            kind = "drag_differential" if against[part.name] else kind
            lines += ["[[effect]]", f'kind = "{kind}"', f'coefficient = "{slope:.6g} N m s/rad"']
            if against[part.name]:
                lines += [f'shaft_speed = "{against[part.name]:.6g} rad/s"']
        if (exponent := values.get((part.name, "exponent"))) is not None:
            size = f'coefficient = "{values[part.name, "coefficient"]:.6g} N m"'
            lines += ["[[effect]]", 'kind = "drag_power"', size, f"exponent = {exponent:.6g}"]
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
