"""The verdict on a rig and its records: hypotheses that channels decide, reported causes with evidence, and notes."""

from __future__ import annotations

import pathlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gears3d.diagnosis.causes import (
    ACCEPT,
    ACCEPT_PATH,
    EXCLUDED,
    LARGEST,
    SMALLEST,
    Candidate,
    Cause,
    Fit,
    Regressors,
    begin,
    contribution,
    excluding,
    fit,
    parameters,
    significance,
    significant_digits,
    swings,
    table,
)
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.path_candidates import Scatter, scores_of
from gears3d.diagnosis.path_fit import (
    BODY,
    SLIP,
    State,
    effects_of,
    fitted,
    gain_of,
    polished,
    restore,
    state_of,
)
from gears3d.diagnosis.pitch_error import ShortTooth
from gears3d.diagnosis.prediction import parts_of, rms_of
from gears3d.diagnosis.preprocessing import Note, reference_record
from gears3d.diagnosis.residual_patterns import Structure, channel_of
from gears3d.diagnosis.residual_tests import UNITS
from gears3d.diagnosis.run_information import Path, averaged, covariance
from gears3d.diagnosis.search import LEAST, STATED, Option, Rival, Search, options
from gears3d.diagnosis.shooting import NOISE, Windows
from gears3d.effects import catalogue
from gears3d.identify import Parameter
from gears3d.scenario import Scenario
from gears3d.units import FAMILIES, show

Array = np.ndarray
# Size, in units of its channel, that must be detectable for the data to be sufficient.
POWER = 0.1
# Effect that represents each place in the minimum detectable effect.
PLACES = {"geometry": "backlash_offset", "torque": "drag_coulomb", "impact": "restitution_offset"}
# Key of the inertia of the loose gear.
INERTIA = "gears.loose.inertia"
# Predicted quantity of each channel.
PREDICTED_QUANTITY = {
    "flight": "angle in free flight",
    "contact": "displacement in contact",
    "impact": "rebound speed",
    "loss": "separation speed",
    "drive": "angle of the drive gear",
}
DELAY = "encoder_skew"
# Chi-square per point of channels up to which these distinguish hypotheses: above it, segmentation is wrong.
AGREE = 1.5
# Ratio of mean speeds below which they count as one.
SAME_SPEED = 1.25
# Relative deviation of two of the rig's numbers that indicates another test rig.
OTHER_RIG = 0.5
# Ratio of a deviation to the backlash above which a note on the gears' size is given.
GEAR_SIZE = 0.1
# Residuals of flights over the angle of a gear.
OVER_LOOSE, OVER_ANGLES = "flight.angle_loose", ("flight.angle_loose", "flight.angle_drive")
# Orders of a sine that may stand for a second body, relative to that of its natural frequency at mean speed: flights
# are faster or slower than that.
NEAR_ORDERS = np.geomspace(0.6, 1.6, 400)
# Torques that depend on speed alone, with the number of parameters of each.
SPEED_LAWS = {"drag_coulomb": 1, "drag_viscous": 1, "drag_power": 2, "drag_differential": 2}


@dataclass(frozen=True)
class Named:
    """One reported cause.

    Args:
        kind: of the effect.
        place: of its action.
        parameters: with 95 % intervals.
        evidence: one sentence.
        gain: fall of chi-square by it in addition to the others.
        alternatives: ``kind`` and ``why`` of causes that the data do not exclude.
        effect: of the scenario.
        table: for the scenario's ``[[effect]]``.
        excluded: ``kind`` and ``why`` of causes that were tried in its place and that the data exclude.
        zero: record whose angular datum its phase, or tooth, refers to; empty with index marks.
        at_least: parameters that are lower bounds.
        options: all hypotheses in its place, itself first, with their posterior probabilities.
    """

    kind: str
    place: str
    parameters: dict[str, Parameter]
    evidence: str
    gain: float
    alternatives: tuple[dict[str, str], ...]
    effect: Any = field(repr=False)
    table: dict[str, Any] = field(repr=False)
    excluded: tuple[dict[str, str], ...] = ()
    zero: str = ""
    at_least: tuple[str, ...] = ()
    options: tuple[Option, ...] = field(default=(), repr=False)

    @property
    def probability(self) -> float:
        """Return the posterior probability of the cause among all hypotheses in its place."""
        return self.options[0].probability

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary."""
        numbers = {name: one.to_dict() for name, one in self.parameters.items()}
        for name in self.at_least:
            numbers[name]["at_least"] = True
        fixed = {name: fixed_parameter(self.effect, name, value) for name, value in self.table.items()
                 if name != "kind" and name not in numbers}  # fmt: skip
        if self.zero and "phase" in fixed:
            fixed["phase"] = {"value": None, "unit": "rad", "ci95": None}
        rivals: dict[str, Any] = {"phase_from": self.zero} if self.zero else {}
        rivals |= {"alternatives": list(self.alternatives), "excluded": list(self.excluded)}
        return {"kind": self.kind, "place": self.place, "parameters": {**numbers, **fixed}, "evidence": self.evidence,
                "gain": self.gain, "probability": self.probability, **rivals}  # fmt: skip


def fixed_parameter(effect: Any, name: str, written: Any) -> Any:
    """Return a fixed parameter in JSON form: with its unit, or as in the scenario if it has none."""
    family = effect.params[name].family
    if family not in FAMILIES or isinstance(written, int | float):
        return written
    return {"value": float(getattr(effect, name)), "unit": FAMILIES[family].si, "ci95": None}


def distinguished_by_channels(
    found: Search, causes: Sequence[Cause], rivals_of: list[list[Rival]], known: bool,
    off: Callable[[Sequence[Cause], int], bool],
) -> list[Cause]:  # fmt: skip
    """Return causes, with those hypotheses decided by channels that windows do not distinguish.

    Channels hold complete records, windows a sample. A channel without a significant effect of a cause does not decide
    on it: records were segmented with flanks without it. Nor do channels decide on a delay of an encoder: they were
    segmented without it, and moved flanks compensate it. Nor do they prefer a hypothesis whose size by the trajectory
    is another: one of the two has systematic errors.

    Args:
        found: without causes, or with them.
        causes: of the path.
        rivals_of: competing hypotheses of each cause; those that channels exclude are marked.
        known: whether the drive's motion is; else only its stated motion decides.
        off: whether the trajectory gives one of some causes, by its place, another size.
    """
    causes = list(causes)
    for k, own in enumerate(rivals_of):
        if DELAY in {causes[k].candidate.kind, *(kind for one in own if not one.excluded for kind in one.kinds)}:
            continue
        others = causes[:k], causes[k + 1 :]
        now, none, *tried = (
            _tested(found, [*others[0], *one, *others[1]], known)
            for one in ([causes[k]], [], *(one.causes[:1] for one in own))
        )
        open_ = [j for j, one in enumerate(own) if not one.excluded]
        best = min(open_, key=lambda j: tried[j].chi2, default=None)
        least = min([now.chi2, *(tried[j].chi2 for j in open_)])
        level = least / max(len(now.rest), 1)
        if level > AGREE or none.chi2 - (now.chi2 if known else least) < EXCLUDED * level:
            continue
        level = max(level, 1.0)
        chi2, instead = now.chi2, causes[k]
        least = excluding((none.chi2 - least) / level)
        if best is not None and tried[best].chi2 < min(chi2, none.chi2) - least * level:
            if known and off(tried[best].causes, k):
                continue
            chi2, causes[k] = tried[best].chi2, tried[best].causes[k]
        worse = [(each.chi2 - chi2) / level for each in tried]
        marked = [
            one._replace(worse=max(one.worse, by), excluded=one.excluded or by > least,
                         deviance=max(one.deviance, EXCLUDED * by / least))
            for one, by in zip(own, worse, strict=True)
        ]  # fmt: skip
        if best is not None and causes[k] is not instead:
            by = (now.chi2 - chi2) / level
            marked[best] = Rival((instead,), by, True, EXCLUDED * by / least)
        rivals_of[k] = sorted(marked, key=lambda one: one.worse)
    return causes


def _tested(found: Search, causes: Sequence[Cause], known: bool) -> Fit:
    """Return causes fitted to all channels, or, with the numbers of the path, their residuals of the stated motion."""
    if known:
        return fit(found.records, found.base, causes)
    rest = parts_of(found.records, found.base - contribution(found.records, effects_of(causes)))["drive"]
    drive = np.concatenate([np.zeros(0), *rest])
    return Fit(tuple(causes), float(drive @ drive), np.zeros((0, 0)), drive)


def slip_angles(left: Sequence[Structure], rig: Scenario) -> list[float]:
    """Return the angle of the loose gear over which the residual of flights repeats [rad]; none if it does not.

    Args:
        left: residual patterns.
        rig: scenario of the test rig.
    """
    teeth = rig.gears.loose.teeth / rig.gears.drive.teeth  # the same residual may be reported over the drive's angle
    orders = [one.where * (1.0 if one.name == OVER_LOOSE else teeth) for one in left if one.name in OVER_ANGLES]
    return [2.0 * np.pi / one for one in orders[:1]]


def is_sawtooth(windows: Windows, causes: Sequence[Cause]) -> bool:
    """Return whether stick-slip is among the causes, and a sine over the same angle explains clearly less.

    Args:
        windows: of the records, with the starts and datums of the causes; they keep these.
        causes: of the path.
    """
    k = next((k for k, one in enumerate(causes) if one.candidate.kind == SLIP), None)
    if k is None:
        return False
    now, slip = state_of(windows, causes, windows.residuals(effects_of(causes))), effects_of(causes[k : k + 1])
    order, size, phase = slip[0].rows(windows.values)[0].p
    sine = begin(_wave(order, 1.0), size * np.array([np.cos(phase), -np.sin(phase)]))
    less = _with_instead(windows, causes, k, sine)
    restore(windows, now)
    return gain_of(windows, less, now)[0] > ACCEPT_PATH


def is_sine(windows: Windows, causes: Sequence[Cause]) -> bool:
    """Return whether a second body is among the causes, and a sine over the angle of the loose gear leaves noise, too.

    Each window begins with any twist, so that a body of hardly any inertia oscillates like a torque over the angle.

    Args:
        windows: of the records, with the starts and datums of the causes; they keep these.
        causes: of the path.
    """
    k = next((k for k, one in enumerate(causes) if one.candidate.kind == BODY), None)
    if k is None:
        return False
    now = state_of(windows, causes, windows.residuals(effects_of(causes)))
    order, unit = swings(causes[k])[0] / windows.pivot, max(windows.values.drag_torque, 1e-9)
    others = (*causes[:k], *causes[k + 1 :])
    windows.restart(effects_of(others), anew=True)
    less = fitted(windows, state_of(windows, others, windows.residuals(effects_of(others))))
    scores, _ = scores_of(windows, [_wave(float(one), unit) for one in order * NEAR_ORDERS], less)
    if scores:
        restore(windows, less)
        sine = begin(scores[0].candidate, scores[0].units)
        less = polished(windows, _with_instead(windows, causes, k, sine), thorough=True)
    restore(windows, now)
    return bool(scores) and windows.usual(less.rest) < NOISE


def _wave(order: float, unit: float) -> Candidate:
    """Return a torque over the angle of the loose gear of any order, a whole one or not."""
    return Candidate("drag_position", {"order": order}, "amplitude", unit, True, ("flight",))


def _with_instead(windows: Windows, causes: Sequence[Cause], k: int, one: Cause) -> State:
    """Return the fit with a cause in the place of another."""
    others = [*causes[:k], one, *causes[k + 1 :]]
    return fitted(windows, state_of(windows, others, windows.residuals(effects_of(others))))


def numbers_of(
    found: Search, path: Path, first: Sequence[Cause], kept: Sequence[Cause], pivot: float
) -> tuple[list[Cause], Array]:
    """Return causes with the numbers of the trajectory, or their average with those of channels that are more precise.

    Args:
        found: with the records.
        path: with its own causes.
        first: the same, or the hypothesis that channels prefer to one.
        kept: found in channels only.
        pivot: mean speed of the loose gear [rad/s].
    """
    own = fit(found.records, found.base, [*first, *kept])
    theirs = covariance(found.records, own.causes) if own.causes else own.covariance
    spread, causes, at, there = np.array(theirs, float), [], 0, 0
    for cause, before, other in zip(first, path.causes, own.causes, strict=False):
        part, here = slice(at, at + len(cause.numbers)), slice(there, there + len(before.numbers))
        at, there = part.stop, here.stop
        mine, its = path.covariance[here, here] * np.max(path.widths[here]) ** 2, theirs[part, part]
        shows = np.any(mine)  # windows may hold a gear in contact that any size of a cause keeps there
        if cause.candidate.kind != before.candidate.kind or (not shows and np.any(its)):
            causes.append(other)
            continue
        near = np.all(np.abs(cause.numbers - other.numbers) < 3.0 * np.sqrt(np.diag(mine + its)))
        if near and np.all(np.diag(its) < np.diag(mine)) and np.all(np.diag(its) > 0.0):
            cause, factor = averaged(cause, mine, other, its, pivot)
            spread[part, part] *= factor
        else:
            spread[part], spread[:, part] = 0.0, 0.0
            spread[part, part] = path.covariance[here, here]
        causes.append(cause)
    return [*causes, *own.causes[len(first) :]], spread


def name_causes(
    found: Search, others: list[list[Rival]], path: Path | None = None, records: Sequence[Evidence] = ()
) -> list[Named]:
    """Return the reported causes of a search, largest gain first.

    Args:
        found: the search.
        others: competing hypotheses of each cause.
        path: with the covariance and the gains, if the causes come from it.
        records: in sequence, also those that were not segmented, of which one is the reference of phases.
    """
    records = records or found.records
    now, at, named = found.fit, 0, []
    known = covariance(found.records, now.causes) if now.causes and path is None else now.covariance
    for k, cause in enumerate(now.causes):
        own = slice(at, at + len(cause.numbers))
        at = own.stop
        effect: Any = cause.effect
        if path is not None and k < len(path.gains):
            gain = float(path.gains[k])
            text = path_sentence(path, gain)
            text += _swinging(cause, known[own, own]) if effect.kind == BODY else ""
        else:
            less = fit(found.records, found.base, now.causes[:k] + now.causes[k + 1 :])
            gain = less.chi2 - now.chi2
            text = evidence_sentence(found, cause, less.rest, gain)
        own_others = [one._replace(excluded=True, deviance=LEAST) if one.causes[-1].ended else one for one in others[k]]
        places = options(effect.kind, gain, [(one.kinds, one.deviance) for one in own_others])
        able = [not one.excluded and by.probability >= STATED for one, by in zip(own_others, places[1:-2], strict=True)]
        alternatives = tuple(open_hypothesis(one) for one, is_able in zip(own_others, able, strict=True) if is_able)
        excluded = tuple(excluded_hypothesis(one) for one, is_able in zip(own_others, able, strict=True) if not is_able)
        wide = None if path is None else path.widths_of(cause)
        numbers = parameters(cause, known[own, own], _unsure(found.records, cause), wide)
        written, zero = table(effect, numbers), reference_record(records, effect)
        if zero and zero != records[0].name:
            numbers.pop("phase", None)
        named.append(
            Named(effect.kind, effect.place, numbers, text, gain, alternatives, effect, written, excluded, zero,
                  options=places)
        )  # fmt: skip
    return sorted(named, key=lambda one: -one.gain)


def _unsure(records: Sequence[Evidence], cause: Cause) -> float:
    """Return the standard deviation of a torque by that of the inertia, as the rig states it [SI]: they act as a ratio.

    Of constant drag it is in proportion to all of it, the rig's own included.
    """
    effect: Any = cause.effect
    if effect.place != "torque" or not records:
        return 0.0
    bench, size = records[0].scenario, float(np.hypot.reduce(cause.numbers[: 2 if cause.candidate.phased else 1]))
    size += bench.rig().drag_torque if effect.kind == PLACES["torque"] else 0.0
    return bench.uncertainty.get(INERTIA, 0.0) / bench.rig().inertia * abs(size)


def reported_in_addition(spread: Scatter | None, short: ShortTooth | None) -> list[Named]:
    """Return the reported causes in addition to those of a search: scatter of restitution and a short tooth."""
    found = [] if spread is None else [_reported_scatter(spread)]
    return found if short is None else [*found, _reported_short_tooth(short)]


def _reported_short_tooth(short: ShortTooth) -> Named:
    effect = short.effect
    ends = sorted((effect.offset, float(np.copysign(effect.params["offset"].high, effect.offset))))
    numbers = {"offset": Parameter(effect.offset, "m", *ends)}
    others = tuple(map(open_hypothesis, short.others))
    places = options(effect.kind, short.gain, [(one.kinds, one.deviance) for one in short.others])
    return Named(effect.kind, effect.place, numbers, short.why, short.gain, others, effect, table(effect, numbers),
                 at_least=("offset",), options=places)  # fmt: skip


def _reported_scatter(spread: Scatter) -> Named:
    effect = catalogue()["restitution_scatter"](standard_deviation=spread.value)
    number = Parameter(spread.value, "", spread.value - 1.96 * spread.sigma, spread.value + 1.96 * spread.sigma)
    numbers = {"standard_deviation": number}
    text = (
        "rebounds scatter more than their measurement errors, in proportion to the approach speed; "
        f"total significance {significance(spread.gain)}"
    )
    return Named(effect.kind, effect.place, numbers, text, spread.gain, (), effect, table(effect, numbers),
                 options=options(effect.kind, spread.gain, ()))  # fmt: skip


def classify(causes: Sequence[Named], left: Sequence[Structure], power: dict[str, float]) -> str:
    """Return the verdict from the accepted causes, the residual patterns, and the minimum detectable effects."""
    if causes:
        return "partly_explained" if left else "explained"
    if left:
        return "unexplained"
    return "not_decidable" if any(limit > POWER for limit in power.values()) else "nothing_to_add"


def minimum_detectable(known: Regressors) -> dict[str, float]:
    """Return the minimum detectable effect, in units of its channel, by place; infinity where none would be a cause."""
    found = dict.fromkeys(PLACES, float("inf"))
    kinds = {kind: place for place, kind in PLACES.items()}
    for k, one in enumerate(known.candidates):
        if one.kind in kinds:
            square = known.square(k)
            if square > 0.0:
                size = max(float(np.sqrt(ACCEPT / square)), SMALLEST)
                found[kinds[one.kind]] = size if size < LARGEST else float("inf")
    return found


def remaining(left: Sequence[Structure]) -> dict[str, Any]:
    """Return the strongest residual pattern in the form of the contract."""
    if not left:
        return {"structure": "none", "size": 0.0}
    first, *others = (
        {"structure": one.name, "channel": channel_of(one.name), "size": one.size, "unit": one.unit,
         "where": one.where if np.isfinite(one.where) else None, "record": one.record or None,
         "significance": float(np.sqrt(max(one.gain, 0.0)))}
        for one in left
    )  # fmt: skip
    return {**first, "others": others}


def record_contributions(records: Sequence[Evidence]) -> list[dict[str, Any]]:
    """Return the contribution of each record, for the report."""
    return [
        {
            "name": one.name,
            "flights": len(one.channels.flights.time),
            "contact_points": len(one.channels.contacts.time),
            "impacts": len(one.channels.impacts.time),
            "losses": len(one.channels.losses.time),
            "left_out": one.channels.left_out,
        }
        for one in records
    ]


def open_hypothesis(rival: Rival) -> dict[str, str]:
    """Return a hypothesis that the data do not exclude, as ``kind`` and ``why``."""
    if rival.worse > 0.5:
        why = f"fits worse by Δχ² = {rival.worse:.4g}, which "
        why += (
            "errors of the model or few windows may make"
            if rival.worse > EXCLUDED
            else "is not sufficient to exclude it"
        )
    elif rival.worse < -ACCEPT:
        why = f"fits better by Δχ² = {-rival.worse:.4g}, but was not selected by the search"
    elif rival.worse < -0.5:
        why = f"fits better by Δχ² = {-rival.worse:.4g}, which is not sufficient to prefer it"
    else:
        why = "predicts the same values for all records"
    return {"kind": " + ".join(rival.kinds), "why": f"{why} ({_shapes(rival)})"}


def excluded_hypothesis(rival: Rival) -> dict[str, str]:
    """Return a hypothesis that is excluded, by the data or by its small probability, as ``kind`` and ``why``."""
    why = f"fits worse by {significance(rival.worse)}"
    if rival.causes[-1].ended:
        why = "ends before the records show it: the torque that is left is constant"
    elif not rival.excluded:
        why = f"probability below {STATED:.1%}, by its fit and the number of its parameters"
    return {"kind": " + ".join(rival.kinds), "why": f"{why} ({_shapes(rival)})"}


def _shapes(rival: Rival) -> str:
    return ", ".join(f"{name} = {value}" for one in rival.causes
                     for name, value in table(one.effect, digits=4).items() if name != "kind")  # fmt: skip


def evidence_sentence(found: Search, cause: Cause, without: Array, gain: float) -> str:
    """Return one sentence: where a cause shows, and by how much it reduces the residual there.

    without: residuals from the other causes alone, (n,); gain: fall of chi-square in addition to the others.
    """
    best, text = 0.0, ""
    for name in cause.candidate.channels:
        span = found.known.spans[name]
        before, after = without[span], found.fit.rest[span]
        fall = float(before @ before - after @ after)
        if fall > best and len(before):
            best = fall
            rms = [float(np.sqrt(np.mean(part**2))) for part in (before, after)]
            sizes = [sized(rms_of(part, found.records, name), UNITS[name]) for part in (before, after)]
            text = f"{PREDICTED_QUANTITY[name]}: error {sizes[0]} without this cause, {sizes[1]} with it"
            text += f" ({rms[0]:.3g} and {rms[1]:.3g} times the noise); "
    return f"{text}total significance {significance(gain)}"


def path_sentence(path: Path, gain: float) -> str:
    """Return one sentence: by how much the causes reduce the path error, and the gain of one of them."""
    before, after = np.sqrt(path.before), np.sqrt(path.after)
    text = f"displacement predicted in {path.windows} windows: error {before:.3g} times the noise without causes"
    return f"{text}, {after:.3g} times with all of them; significance of this one {significance(gain)}"


def _swinging(cause: Cause, covariance: Array) -> str:
    """Return a sentence: natural frequency of gear and carried body in flight, and the ratio of their inertias."""
    turn, slopes = swings(cause)
    sigma = float(np.sqrt(slopes @ covariance[:2, :2] @ slopes))
    low, value, high = (turn / (2.0 * np.pi) * (1.0 + 1.96 * by * sigma) for by in (-1.0, 0.0, 1.0))
    ratio = float(cause.numbers[0]) / cause.candidate.unit
    frequency = f"natural frequency of gear and body in flight {value:.5g} Hz (95 %: {low:.5g} to {high:.5g} Hz)"
    return f"; {frequency}, inertia {ratio:.4g} times that of the gear"


def sized(size: float, unit: str) -> str:
    """Return a size of a channel [SI] with a readable unit.

    >>> sized(2.957e-5, "m"), sized(4.67e-8, "m"), sized(8.8e-7, "rad"), sized(1.2e-4, "m/s")
    ('29.6 um', '46.7 nm', '0.88 urad', '0.12 mm/s')
    """
    if unit == "rad":
        return f"{1e6 * size:.3g} urad"
    if unit == "m":
        return show(size, "length", 3) if size >= 1e-7 else f"{1e9 * size:.3g} nm"
    return f"{1e3 * size:.3g} mm/s"


def facts_of(cause: Named) -> list[str]:
    """Return the known facts on a cause, line by line."""
    lines = [f"found by gears3d diagnose: {cause.kind}", *(f"95 %: {each}" for each in _intervals(cause))]
    if cause.zero:
        lines.append(
            f"phase and tooth number count from the first angle of {pathlib.Path(cause.zero).name}, "
            "not from an index mark"
        )
    return lines


def _intervals(cause: Named) -> list[str]:
    """Return the 95 % intervals of a cause's numbers in the form of a scenario."""
    lines = []
    for name, one in cause.parameters.items():
        family, digits = cause.effect.params[name].family, significant_digits(one)
        lines.append(f"{name} {show(one.low, family, digits)} to {show(one.high, family, digits)}")
    return lines


def cause_notes(rig: Scenario, effects: Iterable[Any]) -> list[Note]:
    """Return doubts raised by the causes themselves."""
    claims = {
        "backlash": (rig.rig().backlash, "backlash_offset", "offset", "length", "mount.backlash"),
        "drag torque": (rig.rig().drag_torque, "drag_coulomb", "torque", "torque", "drag.torque"),
        "restitution": (rig.rig().restitution, "restitution_offset", "offset", "ratio", "impact.restitution"),
    }
    notes, off = [], []
    for name, (claim, kind, parameter, family, key) in claims.items():
        change = sum(getattr(one, parameter) for one in effects if one.kind == kind)
        if claim > 0.0 and abs(change) > OTHER_RIG * claim:
            now, was = (
                (f"{each:.3g}" if family == "ratio" else show(each, family, 3)) for each in (claim + change, claim)
            )
            off.append(f"{name} {now} instead of {was}")
        if 0.0 < abs(change) < 1.96 * rig.uncertainty.get(key, 0.0):
            text = f"{name}: the change is within the uncertainty that the rig states for it"
            notes.append(Note("within-uncertainty", text, f"state {key} as found"))
        if kind == "drag_coulomb" and change and claim + change > 0.0:
            text = "the motion shows torque divided by inertia only: an inertia of the loose gear of "
            text += (
                f"{show(rig.rig().inertia * claim / (claim + change), 'inertia', 4)} with the stated drag torque is "
            )
            text += "indistinguishable from this drag torque"
            notes.append(Note("inertia-or-drag", text, "measure the inertia, or weigh it from a drawing"))
        if kind == "backlash_offset" and abs(change) > GEAR_SIZE * claim:
            text = "backlash is an angle times a base radius: gears whose size differs by "
            text += f"{100.0 * -change / (claim + change):+.3g} % (module or numbers of teeth) are indistinguishable"
            notes.append(Note("gear-size", text, "check module and teeth of the rig"))
    if len(off) > 1:
        text = f"the records probably belong to a different rig: {', '.join(off)}"
        notes.append(Note("other-rig", text, "check which scenario belongs to these records", "", True))
    return notes


def speed_notes(records: Sequence[Evidence], effects: Iterable[Any]) -> list[Note]:
    """Return a note if a law of speed has as many numbers as records have mean speeds, so that no record tests it."""
    speeds = np.sort([abs(one.motion.mean) for one in records if len(one.channels.flights.time)])
    if len(speeds) < 2:
        return []
    count = 1 + int(np.count_nonzero(speeds[1:] > SAME_SPEED * speeds[:-1]))
    laws = [one.kind for one in effects if one.kind in SPEED_LAWS]
    numbers = sum(SPEED_LAWS[kind] for kind in laws)
    if not 2 <= count <= numbers:
        return []
    text = (
        f"{' and '.join(laws)} have {numbers} numbers together, the records {count} mean speeds: no record tests how "
    )
    text += "the torque depends on speed"
    return [Note("few-speeds", text, f"add records at {numbers + 1 - count} or more other mean speeds")]


def phase_notes(causes: Iterable[Any]) -> list[Note]:
    """Return the reference of phases without an index mark."""
    kinds_of: dict[str, list[str]] = {}
    for one in causes:
        if one.zero:
            kinds_of.setdefault(one.zero, []).append(one.kind)
    remedy = "record with a common index mark to obtain phases and tooth numbers on the gears"
    return [
        Note("zeros-arbitrary", f"{', '.join(kinds)}: phase or tooth number counts from the first angle of this "
             "record; the angular datum of the other records is estimated from this effect", remedy, record)
        for record, kinds in kinds_of.items()
    ]  # fmt: skip


def tooth_notes(records: Sequence[Evidence]) -> list[Note]:
    """Return a note that single teeth are not excluded in several records without marks."""
    gears = sorted({gear for one in records for gear in one.unmarked})
    if len(records) < 2 or not gears:
        return []
    text = f"angular datum of the {' and the '.join(gears)} gear is unknown: single tooth deviations may be undetected"
    return [Note("teeth-unseen", text, "record with a common index mark")]
