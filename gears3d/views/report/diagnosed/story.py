"""Sentences and tables of a diagnosis, from the verdict to the minimum detectable effects."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis import CHANNELS, rms_of
from gears3d.diagnosis.heldout import UNITS
from gears3d.diagnosis.named import worth_of
from gears3d.diagnosis.verdict import POWER
from gears3d.units import show
from gears3d.views.plots.numbers import Figure, figure, plain
from gears3d.views.report.diagnosed.words import CHANNEL_WORDS, PLACES, called, joined

if TYPE_CHECKING:
    from gears3d.diagnosis import Diagnosis
    from gears3d.diagnosis.experiments import Experiment
    from gears3d.diagnosis.verdict import Named

OFF = 3.0
"""Residual in standard deviations above which a channel is reported with every verdict."""


class ChannelRow(NamedTuple):
    """Errors of the nominal and of the extended model in one channel.

    Args:
        name: in words.
        what: measured and predicted quantity.
        points: of all records.
        base: root mean square error of the nominal model.
        extended: the same of the extended model; a dash without causes.
        sigma: root mean square of the noise.
        times: base in standard deviations.
        times_extended: extended in standard deviations.
    """

    name: str
    what: str
    points: int
    base: Figure
    extended: Figure
    sigma: Figure
    times: Figure
    times_extended: Figure


class NumberRow(NamedTuple):
    """One parameter of a cause.

    Args:
        name: of the parameter.
        value: as in a scenario; "or beyond" where only a bound is known.
        low: end of the 95 % interval; empty for a value that is chosen, not fitted.
        high: other end.
        si: bare SI value, or ``None``.
    """

    name: str
    value: str
    low: str
    high: str
    si: float | None


def sized(value: float | None, unit: str) -> Figure:
    r"""Return a size with its SI unit as it is read.

    >>> sized(2.5e-6, "rad").text, sized(3e-6, "m").text, sized(0.5, "sigma").text, sized(0.62, "1").text
    ('2.5\xa0µrad', '3\xa0µm', '0.5\xa0σ', '62\xa0%')
    """
    if value is None or not np.isfinite(value):
        return Figure("–")
    kind = {"s": "time", "m": "length", "m/s": "velocity"}.get(unit)
    if kind:
        return figure(float(value), kind, 3)
    others = {"rad": (1e6, "µrad"), "rad/s^2": (1.0, "rad/s²"), "sigma": (1.0, "σ"), "1": (100.0, "%")}
    scale, name = others.get(unit, (1.0, unit))
    return Figure(f"{plain(float(value) * scale, 3)}\N{NO-BREAK SPACE}{name}".strip(), float(value))


def percent(value: float | None) -> Figure:
    r"""Return a part of a whole as it is read.

    >>> percent(0.12345).text, percent(0.99987).text, percent(None).text
    ('12.3\xa0%', '> 99.9\xa0%', '–')
    """
    if value is None:
        return Figure("–")
    value = 0.0 if abs(value) < 1e-6 else value
    text = "> 99.9" if 0.999 < value < 1.0 else plain(100.0 * value, 3)
    return Figure(f"{text}\N{NO-BREAK SPACE}%", float(value))


def sentence(found: Diagnosis, told: dict[str, Any]) -> str:
    """Return the verdict in one sentence."""
    many, explains = len(found.records), "explains" if len(found.causes) == 1 else "explain"
    off = [name for name, _ in astray(found)]
    though = f" The residual of {joined(off)} still exceeds the noise." if off else ""
    records = "The record deviates" if many == 1 else f"The {many} records deviate"
    named = joined([f"{one.kind} ({_leading(one)})" for one in found.causes])
    left = told["remaining"]
    over = called(left["structure"], left.get("unit", ""))
    if found.verdict == "nothing_to_add":
        if not found.power:
            return "Records and nominal model agree in every contact episode: no model change is needed."
        shown = percent(max(found.power.values())).text
        words = {"geometry": "backlash", "torque": "drag torque", "impact": "restitution"}
        *first, last = [words[place] for place in words if place in found.power]
        return (
            "Records and nominal model agree: no model change is needed. "
            f"Minimum detectable effect: {shown} of {', '.join(first)} or {last}.{though}"
        )
    if found.verdict == "not_decidable" and (found.suspects or any(note.blocks for note in found.notes)):
        why = [note.text for note in found.notes if note.blocks] or [found.notes[-1].text]
        return f"The data are insufficient for a verdict: {joined(why)}."
    if found.verdict == "not_decidable":
        blind = joined([PLACES[place] for place, limit in found.power.items() if limit > POWER])
        return f"No cause was found, but the data are insufficient for a verdict on {blind}."
    if found.verdict == "unexplained":
        size = sized(left["size"], left["unit"]).text
        return f"{records} from the nominal model by {over} ({size}); no effect of the catalogue explains it."
    gain = told["heldout"]["gain"]
    reduction = percent(gain).text.replace("> ", "more than ")
    worth = "" if gain is None else f" On held-out data this reduces the error beyond noise by {reduction}."
    if found.verdict == "partly_explained":
        return (
            f"{records} from the nominal model; {named} {explains} part of the deviation. "
            f"The residual still shows {over}.{worth}"
        )
    return f"{records} from the nominal model; {named} {explains} the deviation.{worth}{though}"


def astray(found: Diagnosis) -> list[tuple[str, Figure]]:
    """Return the channels whose residual exceeds :data:`OFF`, with their root mean square."""
    told = []
    for name in CHANNELS:
        rest = found.found.fit.rest[found.found.known.spans[name]]
        if len(rest) and (rms := float(np.sqrt(np.mean(rest**2)))) > OFF:
            told.append((CHANNEL_WORDS[name][0], sized(rms, "sigma")))
    return told


def solid(told: dict[str, Any]) -> str:
    """Return the held-out error reduction in the 3D engine as a sentence; empty where it was not requested.

    >>> solid({"gain": None, "why": "not asked for"})
    ''
    """
    if told["gain"] is None:
        if told["why"] in ("not asked for", "there is no cause to try"):
            return ""
        return f"The 3D engine was not used for validation: {told['why']}."
    count = sum(told["events"].values())
    return (
        f"Predictions by the 3D engine from {count} held-out measured states: reduction by "
        f"{percent(told['gain']).text}; by the rigid model over the same states: {percent(told['gain_rigid']).text}."
    )


def experiment(one: Experiment) -> dict[str, Any]:
    """Return the experiments that distinguish a cause from a competing hypothesis, for the table of the report."""
    rows = [(run.change, ", ".join(f"{key} = {_brief(value)}" for key, value in run.keys.items()),
             f"{run.duration:.3g} s", figure(run.sigma, digits=3) if run.sigma is not None else Figure("–"))
            for run in one.runs]  # fmt: skip
    return {"cause": one.cause, "rival": one.rival, "now": figure(one.now, digits=3), "rows": rows}


def _brief(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(" at ".join(str(each[name]) for name in ("amplitude", "frequency")) for each in value)
    return str(value)


def worse(told: dict[str, Any]) -> list[str]:
    """Return the channels in which the extended model has a larger held-out error than the nominal model."""
    base, extended = (told["heldout"][key] or {} for key in ("base", "extended"))
    return [CHANNEL_WORDS[name][0] for name in CHANNELS
            if name in base and extended[name]["value"] > 1.02 * base[name]["value"]]  # fmt: skip


def _leading(one: Named) -> str:
    row, gear = next(iter(numbers(one))), one.table.get("gear")
    interval = f" [95 %: {row.low} to {row.high}]" if row.low and row.name not in one.at_least else ""
    text = f"{row.name} {row.value}{interval}"
    return f"{gear} gear, {text}" if gear else text


def channels(found: Diagnosis, told: dict[str, Any]) -> list[ChannelRow]:
    """Return the errors of the nominal and of the extended model in each channel.

    Held-out data are used where there are any, else all points.
    """
    rows, known, held = [], found.found.known, told["heldout"]
    for name in CHANNELS:
        span = known.spans[name]
        base, rest = found.found.base[span], found.found.fit.rest[span]
        if not len(base):
            continue
        records = found.found.records
        sigma = rms_of(np.ones_like(base), records, name)
        times = [float(np.sqrt(np.mean(part**2))) for part in (base, rest)]
        sizes = [rms_of(part, records, name) for part in (base, rest)]
        if held["base"] and name in held["base"]:
            sizes = [held[key][name]["value"] for key in ("base", "extended")]
        unit, some = UNITS[name], bool(found.causes)
        rows.append(
            ChannelRow(*CHANNEL_WORDS[name], len(base), sized(sizes[0], unit), sized(sizes[1] if some else None, unit),
                       sized(sigma, unit), sized(times[0], "sigma"), sized(times[1] if some else None, "sigma"))
        )  # fmt: skip
    return rows


def numbers(one: Named) -> list[NumberRow]:
    """Return the parameters of a cause, those with intervals first."""
    rows = []
    for name, number in one.parameters.items():
        family = one.effect.params[name].family
        digits = worth_of(number)
        value, low, high = (show(each, family, digits) for each in (number.value, number.low, number.high))
        value = f"{value} or beyond" if name in one.at_least else value
        rows.append(NumberRow(name, value, low, high, float(number.value)))
    fixed = {name: value for name, value in one.table.items() if name != "kind" and name not in one.parameters}
    return rows + [NumberRow(name, str(value), "", "", None) for name, value in fixed.items()]


def short(names: Sequence[str]) -> dict[str, str]:
    """Return names of records without the folder that all have in common.

    >>> short(["a/b/x.csv", "a/b/y.csv"])
    {'a/b/x.csv': 'x.csv', 'a/b/y.csv': 'y.csv'}
    """
    folders = {str(Path(name).parent) for name in names}
    return {name: Path(name).name if len(folders) == 1 else name for name in names}


def snippet(causes: Sequence[Named]) -> str:
    """Return the causes as the tables that a scenario has under ``[[effect]]``."""
    tables = []
    for one in causes:
        lines = [f"{name} = {json.dumps(value, ensure_ascii=False)}" for name, value in one.table.items()]
        tables.append("\n".join(["[[effect]]", *lines]))
    return "\n\n".join(tables)
