"""Choice among competing laws, and the result: parameters, torque over speed, TOML for a scenario, warnings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.identify.coastdown_errors import SURE, Errors, errors_of, spline, structure
from gears3d.identify.coastdown_fit import Binned, Fit, averaged, fit, guess, standardised, thin
from gears3d.identify.coastdown_record import Track, spans
from gears3d.identify.law import Identified, Parameter
from gears3d.identify.parts import ALONE, UNITS, Model, Share

# Blocks of a coast-down in time that are held out in turn.
BLOCKS = 20
# Readings below which each is held out alone, and a warning states their number.
FEW = 20
# Steps of the last search.
PATIENT = 300
# p-value of the better prediction below which a law with more terms is taken.
LEVEL = 0.01
# Of a curve.
POINTS = 200
# Quantile of 95 % intervals, and its place in a normal distribution.
REACH, NORMAL = 0.975, 1.96
# Relative standard deviation of an inertia from which on it may be of any size: its interval reaches to zero.
LOOSE = 0.5
# Correlation of two numbers from which on the speeds hardly separate them, where one is known no better than to a part
# of its value: a tenth hardly changes the share of a term in the drag.
ALIKE, WIDE = 0.99, 0.1


class Choice(NamedTuple):
    """The law that was taken.

    Args:
        best: its fit.
        data: the tracks as they were fitted.
        losses: mean squared standardised error on blocks held out, by law.
    """

    best: Fit
    data: list[Binned]
    losses: dict[str, float | None]


def choose(tracks: list[Track], models: Sequence[Model]) -> Choice:
    """Fit competing models and take the simplest that none with more terms outperforms on held-out blocks.

    Raises InputError when none fits.
    """
    points = [thin(track) for track in tracks]
    rough = [found for model in models if (found := fit(points, model, guess(tracks, model))) is not None]
    if not rough:
        raise _nothing()
    first = min(rough, key=lambda candidate: candidate.chi2)
    data = [averaged(track, first.law(run), first.starts[run]) for run, track in enumerate(tracks)]
    sound = [found for one in rough if (found := fit(data, one.model, one.numbers)) is not None]
    if not sound:
        raise _nothing()
    if len(models) == 1:
        return Choice(_settled(sound[0], data), data, {})
    folds = _folds(data)
    losses = [_held_out(data, found, folds) for found in sound]
    best = _unstructured(sound, losses, _best(sound, losses), data)
    shown = {label(found.model): _finite(loss.mean()) for found, loss in zip(sound, losses, strict=True)}
    return Choice(_settled(sound[best], data), data, shown)


def label(model: Model) -> str:
    """Return the name of a law."""
    if [part.name for part in model.parts] == [ALONE]:
        return "+".join(model.parts[0].terms)
    return ", ".join(f"{part.name}: {'+'.join(part.terms)}" for part in model.parts)


def _settled(best: Fit, data: list[Binned]) -> Fit:
    """Return a fit iterated to convergence: terms that are hardly separable need many steps."""
    return fit(data, best.model, best.numbers, patience=PATIENT) or best


def _nothing() -> InputError:
    return InputError("no drag law coasts down like these records: are they coast-downs of a free gear?")


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _folds(data: list[Binned]) -> list[list[np.ndarray]]:
    """Return for two folds the block that each bin belongs to where it is held out, -1 where it trains.

    Of few readings each is a block and a fold of its own, so that enough are left to train.
    """
    few = sum(len(track.time) for track in data) < FEW
    folds = []
    for fold in range(max(len(track.time) for track in data) if few else 2):
        marks = []
        for track in data:
            count = len(track.time)
            block = np.arange(count) * min(BLOCKS, count) // count
            marks.append(np.where(block == fold if few else block % 2 == fold, block, -1))
        folds.append(marks)
    return folds


def _held_out(data: list[Binned], whole: Fit, folds: list[list[np.ndarray]]) -> np.ndarray:
    """Return the mean squared standardised error of each held-out block, infinite where no fit was found."""
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
    """Return the index of the simplest law that none with more terms outperforms on held-out blocks."""
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


def _unstructured(sound: list[Fit], losses: list[np.ndarray], best: int, data: list[Binned]) -> int:
    """Return the index of the simplest richer law without a residual pattern, where the selected law has one.

    Ranks of blocks overlook what a law misses in few of them, such as at the end of a range of speeds.
    """
    if structure(sound[best], data) >= SURE:
        return best
    size = len(sound[best].numbers)
    for at in sorted(range(len(sound)), key=lambda one: len(sound[one].numbers)):
        better = losses[at].mean() < losses[best].mean()
        if len(sound[at].numbers) > size and better and structure(sound[at], data) >= SURE:
            return at
    return best


def report(choice: Choice, tracks: list[Track], torque_spread: float = 0.0) -> Identified:
    """Return the result for the selected law.

    Raises InputError when spin-ups and coast-downs do not determine the inertia.
    """
    errors = errors_of(choice.best, choice.data)
    best, data = errors.fit, choice.data
    parameters = _parameters(errors, torque_spread)
    tracks = [
        track._replace(speed=track.fastest, slowest=max(float(first), 0.0))
        if track.torque
        else track._replace(speed=max(float(first), float(last)), slowest=float(last))
        for track, (first, last) in zip(tracks, errors.true.ends, strict=True)
    ]
    rests = [_rest(track, choice.best, run) for run, track in enumerate(data)]
    is_speed = [track.is_speed for track in data]
    goodness: dict[str, Any] = {
        "chi2": best.chi2,
        "rms_angle_rad": _rms(rests, [not one for one in is_speed]),
        "rms_speed_rad_s": _rms(rests, is_speed),
        "residual_over_noise": float(best.chi2**0.5),
        "p_structure": errors.p_structure,
        "deviation_of_torque": max(errors.sizes[:2]),
        "held_out": choice.losses,
        "speed_rad_s": [min(track.slowest for track in tracks), max(track.speed for track in tracks)],
        "points": int(sum(len(track.time) for track in tracks)),
        "quantum_rad": [track.quantum for track in tracks],
        "coastdowns": spans(tracks),
        "findings": [one.to_dict() for track in tracks for one in track.findings],
    }
    curves = _curves(errors, tracks, torque_spread)
    curves["residuals"] = [(track.time, rest) for track, rest in zip(data, rests, strict=True)]
    warnings = _warnings(errors, data, parameters, goodness)
    return Identified(label(best.model), parameters, goodness, _snippet(best, parameters), curves, warnings)


def _parameters(errors: Errors, torque_spread: float) -> dict[str, Parameter]:
    """Return the free numbers with their intervals, those of parts as ``part.name``; with spin-ups the inertia, too."""
    from scipy.special import stdtrit

    best = errors.fit
    scale = np.array([name != "exponent" for _, name in best.model.names()]) * best.numbers * torque_spread
    error = np.sqrt(np.maximum(np.diag(best.covariance), 0.0) + scale**2)
    wide = stdtrit(np.minimum(errors.dof, 1e6), REACH) * error
    parameters = {}
    if any(run.torque for run in best.model.runs):
        dof = float(np.minimum(errors.dof, 1e6).min())
        for name, sigma in zip(best.model.unsure(), errors.shifts, strict=True):
            own = best.model.inertias[name]
            value = own.value + own.shift * own.sigma
            sd = float(np.hypot(sigma * own.sigma, torque_spread * value))
            if sd > LOOSE * abs(value):
                remedy = "record coast-downs and spin-ups over the same speeds, or give --inertia"
                raise InputError(Fault("inertia", "is not determined by these spin-ups and coast-downs", remedy))
            half = float(stdtrit(dof, REACH)) * sd
            parameters[name] = Parameter(value, "kg m^2", value - half, value + half)
    for (part, name), value, half in zip(best.model.names(), best.numbers, wide, strict=True):
        key = name if part == ALONE else f"{part}.{name}"
        parameters[key] = Parameter(float(value), UNITS[name], float(value - half), float(value + half))
    return parameters


def _rms(rests: list[np.ndarray], which: list[bool]) -> float | None:
    some = [rest for rest, one in zip(rests, which, strict=True) if one]
    return float(np.sqrt(np.mean(np.concatenate(some) ** 2))) if some else None


def _rest(track: Binned, best: Fit, run: int) -> np.ndarray:
    found = standardised(track, best.law(run), best.starts[run])
    assert found is not None
    return found * track.sigma


def _curves(errors: Errors, tracks: list[Track], spread: float) -> dict[str, Any]:
    """Return the torque over the speed with its 95 % band: of the whole drag, and of each part."""
    best = errors.fit
    speed = np.linspace(min(t.slowest for t in tracks), max(t.speed for t in tracks), POINTS)
    most = max(range(len(tracks)), key=lambda run: len(best.model.runs[run].shares))
    whole = _torque(errors, best.model.runs[most].shares, most, speed, True)
    # all torques are in proportion to the known one of spin-ups
    for key, side in (("low_N_m", -1.0), ("high_N_m", 1.0)) if spread else ():
        half = side * (whole[key] - whole["torque_N_m"])
        more = NORMAL * spread * np.abs(whole["torque_N_m"])
        whole[key] = whole["torque_N_m"] + side * np.hypot(half, more)
    if spread:
        whole["estimate_half_N_m"] = np.hypot(
            whole["estimate_half_N_m"], NORMAL * spread * np.abs(whole["estimate_N_m"])
        )
    parts = {
        part.name: {"speed_rad_s": speed, **_torque(errors, (Share(part.name),), most, speed, False)}
        for part in best.model.parts
    }
    return {"speed_rad_s": speed, **whole, "parts": parts if list(parts) != [ALONE] else {}}


def _torque(errors: Errors, shares: tuple[Share, ...], run: int, speed: np.ndarray, all_of: bool) -> dict[str, Any]:
    """Return torque and band of some parts, by the law's slopes in its numbers.

    The band of the whole drag is that of the best estimate of the torque, widened to the law, with the law's
    own interval unless the residual refutes it. The estimate is returned, too, with half the width of its interval.
    """
    from scipy.special import stdtrit

    best, true = errors.fit, errors.true

    def sloped(fit: Fit) -> tuple[np.ndarray, np.ndarray]:
        only = fit.model.runs[run]._replace(shares=shares)
        model = fit.model._replace(runs=(*fit.model.runs[:run], only, *fit.model.runs[run + 1 :]))
        inertia = model.inertia(run)

        def at(numbers: np.ndarray) -> np.ndarray:
            return inertia * model.law(numbers, run).deceleration(speed)

        torque, slopes = at(fit.numbers), []
        for place, number in enumerate(fit.numbers):
            moved = fit.numbers.copy()
            moved[place] += 1e-6 * max(abs(number), 1e-12)
            slopes.append((at(moved) - torque) / (moved[place] - number))
        return torque, np.array(slopes)

    def band(rows: np.ndarray, covariance: np.ndarray, quantile: float) -> np.ndarray:
        return quantile * np.sqrt(np.maximum(np.einsum("ik,ij,jk->k", rows, covariance, rows), 0.0))

    torque, slope = sloped(best)
    half = band(slope, best.covariance, float(stdtrit(min(float(errors.dof.min()), 1e6), REACH)))
    low, high = torque - half, torque + half
    if not all_of:
        return {"torque_N_m": torque, "low_N_m": low, "high_N_m": high}
    value = torque
    if np.any(true.deviation):
        value, slope = sloped(true.law)
        hats = spline(true.speeds, speed).T
        half = band(np.vstack([slope, hats]), true.joint, float(stdtrit(errors.dof_torque, REACH)))
        value = value + true.change @ slope + true.deviation @ hats
        if errors.p_structure < SURE:  # the law is refuted: its own interval says nothing
            low = high = torque
        low, high = np.minimum(low, value - half), np.maximum(high, value + half)
    estimate = {"estimate_N_m": value, "estimate_half_N_m": half}
    return {"torque_N_m": torque, "low_N_m": low, "high_N_m": high, **estimate}


def _snippet(best: Fit, parameters: dict[str, Parameter]) -> str:
    """Return the drag as TOML of a scenario: the loose gear out of mesh, the mesh, and an identified inertia."""
    values = dict(zip(best.model.names(), map(float, best.numbers), strict=True))
    against = {share.part: share.against for run in best.model.runs for share in run.shares}
    warm = sorted({part.name.partition("@")[2] for part in best.model.parts if "@" in part.name}, key=float)
    middle = warm[len(warm) // 2] if warm else ""
    shown = [part for part in best.model.parts if part.name != "drive" and part.name.partition("@")[2] in ("", middle)]
    base = sum(values.get((part.name, "coulomb"), 0.0) for part in shown)
    lines = []
    if "inertia" in parameters:
        lines = ["[gears.loose]", f'inertia = "{parameters["inertia"].value:.6g} kg m^2"']
    lines += [f"# at {middle} degC"] * bool(warm)
    if base < 0.0:
        lines += [
            f"# the constant torque of the fit is negative, {base:.6g} N m, which no scenario can have: with 0 N m"
        ]
        lines += ["# this drag is too large at every speed: fit another law (--law), or do not use it"]
    lines += ["[drag]", f'torque = "{max(base, 0.0):.6g} N m"']
    for part in shown:
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


# Meaning of a negative parameter, by its name.
NEGATIVE = {
    "coulomb": "the law holds between the recorded speeds only, and would drive the gear below them",
    "viscous": "the drag falls with the speed (mixed lubrication), or rose during the record",
    "coefficient": "the drag bends downwards over the speed, or changed during the record",
}


# Residual over noise up to which a law explains a record: 25 % of its variance is then noise.
EXPLAINED = 2.0


def _warnings(
    errors: Errors, data: list[Binned], parameters: dict[str, Parameter], goodness: dict[str, Any]
) -> tuple[str, ...]:
    found = []
    best = errors.fit
    if errors.p_structure < SURE:
        common, own, pink = errors.sizes
        causes = [f"the torque deviates from it by about {max(common, own):.1%}"] * bool(max(common, own) > 5e-4)
        causes += ["readings have correlated errors"] * bool(pink)
        size = f"{goodness['residual_over_noise']:.2g} times the noise, p = {errors.p_structure:.1g}"
        why = f": {' and '.join(causes)}" if causes else ""
        far = goodness["residual_over_noise"] > EXPLAINED
        what = f"the law does not explain the record{why}" if far or not causes else " and ".join(causes)
        found.append(f"the residual has structure ({size}): {what}; the intervals include that")
    if goodness["points"] < FEW:
        starts = sum(1 if track.is_speed else 2 for track in data)
        sure = goodness["points"] - len(best.numbers) - starts
        found.append(f"{goodness['points']} readings only: the intervals rest on {sure} degrees of freedom, and a "
                     "richer law would hardly show")  # fmt: skip
    for name, parameter in parameters.items():
        kind = name.rpartition(".")[2]
        if parameter.low <= 0.0 <= parameter.high:
            found.append(f"{name} cannot be distinguished from zero")
        elif parameter.high < 0.0 and kind in NEGATIVE:
            found.append(f"{name} is negative: {NEGATIVE[kind]}")
    error = np.sqrt(np.maximum(np.diag(best.covariance), 1e-300))
    alike = np.abs(best.covariance / np.outer(error, error)) > ALIKE
    wide = WIDE * np.abs(best.numbers) < NORMAL * error
    if np.any(alike & wide[:, None] & ~np.eye(len(error), dtype=bool)):
        found.append("terms of the law are hardly separated by these speeds: record a wider range")
    return tuple(found)
