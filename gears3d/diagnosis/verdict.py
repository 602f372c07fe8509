"""The verdict on a rig and its records: its causes with their evidence, and the residual patterns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gears3d.diagnosis.candidates import ACCEPT, Regressors
from gears3d.diagnosis.cause import Cause, contribution, fit, parameters, significance, slopes_of, table
from gears3d.diagnosis.contact_law import ContactLawFit
from gears3d.diagnosis.datums import reference_record
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.heldout import refuted, splits
from gears3d.diagnosis.path_search import Path
from gears3d.diagnosis.pockets import Pocket
from gears3d.diagnosis.precision import covariance
from gears3d.diagnosis.remains import channel_of
from gears3d.diagnosis.restitution_scatter import Scatter
from gears3d.diagnosis.search import SMALLEST, Rival, Search
from gears3d.diagnosis.sentences import along, alternative, evidence_for, refused
from gears3d.diagnosis.structure import Structure
from gears3d.effects import catalogue
from gears3d.identify import Parameter
from gears3d.units import FAMILIES

Array = np.ndarray
# Largest false alarm probability of a residual pattern.
CHANCE = 1e-4
# Largest residual pattern in the channel of a cause, relative to its gain there.
SHARE = 0.25
# Size, in units of its channel, that must be detectable for the data to be sufficient.
POWER = 0.1
# Effect that represents each place in the minimum detectable effect.
PLACES = {"geometry": "backlash_offset", "torque": "drag_coulomb", "impact": "restitution_offset"}


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

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary."""
        numbers = {name: one.to_dict() for name, one in self.parameters.items()}
        for name in self.at_least:
            numbers[name]["at_least"] = True
        fixed = {name: chosen(self.effect, name, value) for name, value in self.table.items()
                 if name != "kind" and name not in numbers}  # fmt: skip
        if self.zero and "phase" in fixed:
            fixed["phase"] = {"value": None, "unit": "rad", "ci95": None}
        rivals: dict[str, Any] = {"phase_from": self.zero} if self.zero else {}
        rivals |= {"alternatives": list(self.alternatives), "excluded": list(self.excluded)}
        return {"kind": self.kind, "place": self.place, "parameters": {**numbers, **fixed}, "evidence": self.evidence,
                "gain": self.gain, **rivals}  # fmt: skip


def chosen(effect: Any, name: str, written: Any) -> Any:
    """Return a fixed parameter in JSON form: with its unit, or as in the scenario if it has none."""
    family = effect.params[name].family
    if family not in FAMILIES or isinstance(written, int | float):
        return written
    return {"value": float(getattr(effect, name)), "unit": FAMILIES[family].si, "ci95": None}


def name_causes(found: Search, others: list[list[Rival]], path: Path | None = None) -> list[Named]:
    """Return the reported causes of a search, largest gain first."""
    now, at, told = found.fit, 0, []
    known = covariance(found.records, now.causes) if now.causes and path is None else now.covariance
    for k, cause in enumerate(now.causes):
        own = slice(at, at + len(cause.numbers))
        at = own.stop
        effect: Any = cause.effect
        if path is not None and k < len(path.gains):
            gain = float(path.gains[k])
            text = along(path, gain)
        else:
            less = fit(found.records, found.base, now.causes[:k] + now.causes[k + 1 :])
            gain = less.chi2 - now.chi2
            text = evidence_for(found, cause, less.rest, gain)
        alternatives = tuple(alternative(one) for one in others[k] if not one.excluded)
        excluded = tuple(refused(one) for one in others[k] if one.excluded)
        numbers = parameters(cause, known[own, own])
        written, zero = table(effect, numbers), reference_record(found.records, effect)
        if zero and zero != found.records[0].name:
            numbers.pop("phase", None)
        told.append(
            Named(effect.kind, effect.place, numbers, text, gain, alternatives, effect, written, excluded, zero)
        )  # fmt: skip
    return sorted(told, key=lambda one: -one.gain)


def beside(spread: Scatter | None, deep: Pocket | None) -> list[Named]:
    """Return the reported causes in addition to those of a search: scatter of restitution and a short tooth."""
    found = [] if spread is None else [_scattered(spread)]
    return found if deep is None else [*found, _out_of_reach(deep)]


def _out_of_reach(deep: Pocket) -> Named:
    effect = deep.effect
    ends = sorted((effect.offset, float(np.copysign(effect.params["offset"].high, effect.offset))))
    numbers = {"offset": Parameter(effect.offset, "m", *ends)}
    others = tuple(map(alternative, deep.others))
    return Named(effect.kind, effect.place, numbers, deep.why, deep.gain, others, effect, table(effect, numbers),
                 at_least=("offset",))  # fmt: skip


def _scattered(spread: Scatter) -> Named:
    effect = catalogue()["restitution_scatter"](standard_deviation=spread.value)
    number = Parameter(spread.value, "", spread.value - 1.96 * spread.sigma, spread.value + 1.96 * spread.sigma)
    numbers = {"standard_deviation": number}
    text = (
        "rebounds scatter more than their measurement errors, in proportion to the approach speed; "
        f"total significance {significance(spread.gain)}"
    )
    return Named(effect.kind, effect.place, numbers, text, spread.gain, (), effect, table(effect, numbers))


def name_law(law: ContactLawFit) -> tuple[Named, ...]:
    """Return the reported causes of a law of contact and its additional causes."""
    told, at = [], 0
    visits = sum(len(points) for points in law.held.points)
    before, after = np.sqrt(law.base.level), np.sqrt(law.held.level)
    own = "it reduces" if len(law.causes) == 1 else "all causes together reduce"
    text = (f"in {visits} contact episodes, without segmentation, {own} the error of a point from"
            f" {before:.3g} to {after:.3g} sigma")  # fmt: skip
    for cause, gain in zip(law.causes, law.gains, strict=True):
        part = slice(at, at + len(cause.numbers))
        at = part.stop
        effect: Any = cause.effect
        others = law.alternatives if cause is law.causes[0] else ()
        numbers = parameters(cause, law.covariance[part, part])
        told.append(Named(effect.kind, effect.place, numbers, text, gain, others, effect, table(effect, numbers)))
    return tuple(sorted(told, key=lambda one: -one.gain))


def judged(causes: Sequence[Named], left: Sequence[Structure], power: dict[str, float]) -> str:
    """Return the verdict from the accepted causes, the residual patterns, and the minimum detectable effects."""
    if causes:
        return "partly_explained" if left else "explained"
    if left:
        return "unexplained"
    return "not_decidable" if any(limit > POWER for limit in power.values()) else "nothing_to_add"


def power(known: Regressors) -> dict[str, float]:
    """Return the minimum detectable effect, in units of its channel, by place."""
    found = dict.fromkeys(PLACES, float("inf"))
    kinds = {kind: place for place, kind in PLACES.items()}
    for k, one in enumerate(known.candidates):
        if one.kind in kinds:
            square = known.square(k)
            if square > 0.0:
                found[kinds[one.kind]] = max(float(np.sqrt(ACCEPT / square)), SMALLEST)
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


def upheld(found: Search, left: Sequence[Structure]) -> list[Cause]:
    """Return the causes that the records determine and that no residual pattern in their channels refutes."""
    worth: dict[str, float] = {}
    for one in left:
        worth[channel_of(one.name)] = max(worth.get(channel_of(one.name), 0.0), one.worth)
    spans = {name: found.known.spans[name] for name in worth}
    taken = {name: float(found.base[span] @ found.base[span] - found.fit.rest[span] @ found.fit.rest[span])
             for name, span in spans.items()}  # fmt: skip
    bad = {name for name in worth if worth[name] > SHARE * max(taken[name], 1e-9)}
    return [cause for cause in found.fit.causes
            if not bad.intersection(cause.candidate.channels) and _determined(found.records, cause)]  # fmt: skip


def _determined(records: Sequence[Evidence], cause: Cause) -> bool:
    """Return whether records depend on a cause; not if it moves the restitution out of its range from 0 to 1."""
    return any(bool(np.any(column)) for column in slopes_of(records, cause))


def predictive(found: Search) -> list[Cause]:
    """Return the causes without the weakest of those that predict their channel worse than the rig as it is.

    A law with as many numbers as there are speeds or revolutions fits anything; held-out data show that it is wrong.
    """
    causes = list(found.fit.causes)
    if not causes or not (bad := refuted(splits(found.records, causes))):
        return causes
    parts = [contribution(found.records, [one.effect] if one.effect is not None else []) for one in causes]
    touched = [any(np.any(part[found.known.spans[name]]) for name in bad) for part in parts]
    gains = [fit(found.records, found.base, causes[:k] + causes[k + 1 :]).chi2 for k in range(len(causes))]
    at = [k for k, own in enumerate(touched) if own]
    weakest = min(at, key=lambda k: gains[k], default=None)
    return [one for k, one in enumerate(causes) if k != weakest]


def evidence_of(records: Sequence[Evidence]) -> list[dict[str, Any]]:
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
