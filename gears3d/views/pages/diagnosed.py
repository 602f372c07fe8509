"""The page of a diagnosis: deviations of records from the nominal model, causes, held-out error reduction."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis import CHANNELS, rms_of
from gears3d.diagnosis.causes import significant_digits
from gears3d.diagnosis.residual_tests import UNITS
from gears3d.diagnosis.verdict import POWER
from gears3d.files import write_text
from gears3d.units import show
from gears3d.version import __version__
from gears3d.views.pages import engine
from gears3d.views.pages.diagnosed_charts import Picture, of_cause, of_remains
from gears3d.views.pages.engine import Head, Key
from gears3d.views.pages.measured import findings
from gears3d.views.pages.run import rig_sentence
from gears3d.views.plots.numbers import Figure, figure, percent, plain, pretty, sized

if TYPE_CHECKING:
    from gears3d.diagnosis import Diagnosis
    from gears3d.diagnosis.search import Experiment
    from gears3d.diagnosis.verdict import Named

# Residual patterns that get a chart.
SHOWN = 2
QUESTION = "Where do the records deviate from the nominal model of the rig, and why?"
# Name of each channel, with the measured and the predicted quantity.
CHANNEL_WORDS = {
    "flight": ("flight", "angle of the loose gear in free flight, compared with its deceleration by drag"),
    "contact": ("contact", "displacement in contact, compared with the nominal flank"),
    "impact": ("impact", "rebound speed, compared with the coefficient of restitution times the approach speed"),
    "loss": ("loss of contact", "separation speed, extrapolated from the flight to the instant of contact loss"),
    "drive": ("drive", "angle of the drive gear, compared with the nominal motion"),
}
# Names of excluded points of each channel, singular and plural.
LEFT_OUT = {
    "flight": ("flight", "flights"),
    "contact": ("point in contact", "points in contact"),
    "impact": ("impact", "impacts"),
    "loss": ("loss of contact", "losses of contact"),
}
# Residual patterns in words, by their names in the contract.
STRUCTURES = {
    "sensor.ratio": "a drift of the displacement in contact",
    "sensor.delay": "a displacement in contact that is proportional to the speed of the drive gear",
    "sensor.order_drive": "an order in the angle of the drive gear",
    "flight.speed": "a deceleration in flight that depends on speed",
    "flight.time": "a deceleration in flight that changes with time",
    "flight.gap": "a deceleration in flight that depends on the position in the gap",
    "flight.angle_loose": "a deceleration in flight with an order of the loose gear",
    "flight.angle_drive": "a deceleration in flight with an order of the drive gear",
    "impact.speed": "a rebound that depends on the approach speed",
    "impact.flank": "a rebound that differs between the flanks",
    "impact.tooth": "a rebound that depends on the gear angle at impact",
    "impact.order_drive": "a rebound with an order of the drive gear",
    "impact.order_loose": "a rebound with an order of the loose gear",
    "impact.time": "correlated rebounds of successive impacts",
    "contact.tooth_drive": "contact loss at one tooth of the drive gear, as with a positive tooth deviation",
    "contact.tooth_loose": "contact loss at one tooth of the loose gear, as with a positive tooth deviation",
    "contact.time": "a backlash that changes with time",
    "impact.duration": "ringing of the displacement after impacts",
    "contact.order_drive": "a displacement in contact with an order of the drive gear",
    "contact.order_loose": "a displacement in contact with an order of the loose gear",
    "contact.loss_phase": "a time of contact loss that depends on speed",
    "flight.all": "deviations in free flight without a pattern over speed, angle or time",
    "drive.all": "deviations of the drive's angle from its stated motion without a pattern over the angle",
    "path.all": "a displacement that the extended model predicts hardly better than the rig, or not to the noise",
    "contact.all": "deviations of the displacement in contact without a pattern over angle, speed or time",
    "impact.all": "deviations of rebounds that one more cause would explain",
    "loss.all": "deviations at contact loss that one more cause would explain",
}
# Words for a resonance of the readings themselves, in metres.
RINGS = "an oscillation of the readings at one frequency, independent of speed, as of a compliant encoder mount"
# Quantities of the minimum detectable effects, by place.
PLACES = {"geometry": "flanks and backlash", "torque": "torques on the loose gear", "impact": "restitution"}


def called(structure: str, unit: str) -> str:
    """Return a residual pattern in words.

    >>> called("impact.flank", "m/s"), called("impact.duration", "m").split()[1]
    ('a rebound that differs between the flanks', 'oscillation')
    """
    return RINGS if (structure, unit) == ("impact.duration", "m") else STRUCTURES.get(structure, structure)


def joined(names: Sequence[str]) -> str:
    """Return names in a row, as they are written in a sentence.

    >>> joined(["a"]), joined(["a", "b", "c"])
    ('a', 'a, b and c')
    """
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


# Residual in standard deviations above which a channel is reported with every verdict.
OFF = 3.0


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
            return "Records and nominal model agree: no model change is needed."
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
        digits = significant_digits(number)
        value, low, high = (pretty(show(each, family, digits)) for each in (number.value, number.low, number.high))
        value = f"{value} or beyond" if name in one.at_least else value
        rows.append(NumberRow(name, value, low, high, float(number.value)))
    fixed = {name: value for name, value in one.table.items() if name != "kind" and name not in one.parameters}
    return rows + [NumberRow(name, pretty(str(value)), "", "", None) for name, value in fixed.items()]


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


# Parts of the names of residual patterns over an order.
ORDERED = ("order", "angle")


def left_out(counts: dict[str, int]) -> str:
    """Return how many points of each channel of a record are excluded, in words.

    >>> left_out({"impact": 46, "flight": 1, "loss": 0}), left_out({})
    ('46 impacts, 1 flight', 'none')
    """
    told = [f"{count} {LEFT_OUT[name][count != 1]}" for name, count in counts.items() if count]
    return ", ".join(told) or "none"


def remains(told: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the residual patterns: ``name``, ``size``, ``significance``, ``where``, ``raw`` and ``at``."""
    left = told["remaining"]
    if left["structure"] == "none":
        return []
    return [
        {"name": called(one["structure"], one["unit"]), "raw": one["structure"],
         "size": sized(one["size"], one["unit"]), "significance": sized(one["significance"], "sigma"),
         "where": _where(one), "at": one["where"]}
        for one in (left, *left["others"])
    ]  # fmt: skip


def _where(one: dict[str, Any]) -> str:
    if one["where"] is None:
        return (
            f"in the whole channel, largest in {Path(one['record']).name}" if one["record"] else "in the whole channel"
        )
    if any(word in one["structure"] for word in ORDERED):
        return f"order {one['where']:.4g}"
    if one["structure"].startswith("contact.tooth_"):
        return f"share of all contact losses that occur at tooth {one['where']:.0f}"
    if one["structure"] == "impact.duration":
        return f"at {plain(one['where'])} Hz"
    if one["structure"] == "flight.gap":
        return f"largest at {plain(100.0 * one['where'], 3)} % of the gap from the active flank"
    return f"largest at {plain(one['where'])} {_unit(one['structure'])}".strip()


def _unit(structure: str) -> str:
    over = structure.split(".")[1]
    if structure in ("impact.speed", "impact.time"):
        return "m/s" if over == "speed" else "impacts (distance of the correlated impacts)"
    return {"speed": "rad/s", "delay": "rad/s", "loss_phase": "rad/s", "time": "s", "ratio": "s", "tooth": "rad"}.get(
        over, "")  # fmt: skip


def power_rows(found: Diagnosis) -> list[tuple[str, Figure, str]]:
    """Return the minimum detectable effect of each place and what it means."""
    rows = []
    for place, limit in found.power.items():
        if not np.isfinite(limit):
            rows.append((PLACES[place], Figure("–"), "not observable in these records"))
        elif limit > POWER:
            rows.append((PLACES[place], percent(limit), "smaller effects may be present undetected: not decidable"))
        else:
            rows.append((PLACES[place], percent(limit), "effects of this size or larger would have been reported"))
    return rows


def render(found: Diagnosis, made: dict[str, Any] | None = None, files: tuple[str, ...] = ()) -> str:
    """Return the page of a diagnosis as HTML that opens without a network.

    Args:
        found: by the diagnosis.
        made: provenance: version, command, inputs.
        files: names of files in the same folder.
    """
    told, names = found.to_dict(), short([one["name"] for one in found.records])
    charts: dict[str, Any] = {}
    rows = remains(told)
    for place, row in enumerate(rows):
        picture = of_remains(found, row["raw"], row["at"]) if place < SHOWN else None
        row["picture"] = _placed(picture, f"residual{place}", charts)
    causes = [
        _cause(one, _placed(of_cause(found, one.effect), f"cause{k}", charts)) for k, one in enumerate(found.causes)
    ]
    return engine.render(
        "diagnosed.html.j2",
        head(found, told, names),
        made or {"version": __version__},
        files,
        charts=charts,
        rig=rig_sentence(found.extended.document),
        suspects=[one.kind for one in found.suspects],
        channels=channels(found, told),
        causes=causes,
        posterior=[(one.text, figure(one.probability, digits=3)) for one in found.posterior],
        splits=[_split(one, names) for one in found.held],
        experiments=[experiment(one) for one in found.runs],
        solid=solid(told["heldout_3d"]),
        gain=percent(told["heldout"]["gain"]),
        gain_range=[percent(one).text for one in told["heldout"].get("gain_range", ())],
        left=rows,
        astray=astray(found),
        worse=worse(told),
        power=power_rows(found),
        snippet=snippet(found.causes),
        records=[
            one | {"name": names[one["name"]], "motion": found.motions.get(one["name"], "–"),
                   "left_out": left_out(one["left_out"])}
            for one in found.records
        ],
        found=[
            (names.get(name, name), row)
            for name, rows in found.findings.items()
            for row in findings({"quality": {"findings": rows}})
        ],
    )  # fmt: skip


def write(path: str | Path, found: Diagnosis, made: dict[str, Any] | None = None, files: tuple[str, ...] = ()) -> Path:
    """Write the page of a diagnosis under a temporary name and rename it.

    Args:
        path: the file, e.g. ``report.html``.
        found: as for :func:`render`.
        made: as for :func:`render`.
        files: as for :func:`render`.

    Raises:
        InputError: it cannot be written.
    """
    return write_text(path, render(found, made, files))


def head(found: Diagnosis, told: dict[str, Any], names: dict[str, str]) -> Head:
    """Return question, answer and key numbers: leading parameters, error reduction, minimum detectable effects."""
    keys, rivals = [], []
    for one in found.causes:
        row = next(iter(numbers(one)))
        interval = f"95 %: {pretty(row.low)} to {pretty(row.high)}" if row.low else ""
        name = f"{one.kind.replace('_', ' ')}: {row.name.replace('_', ' ')}"
        keys.append(Key(name, Figure(pretty(row.value), row.si), interval))
        rivals += [other["kind"] for other in one.alternatives]
    held = told["heldout"]
    if held["gain"] is not None:
        low, high = (percent(each).text for each in held["gain_range"])
        splits = f"{low} to {high} over" if low != high else "in each of"
        keys.append(Key("held-out error reduction", percent(held["gain"]), f"{splits} {len(found.held)} splits"))
    limit = max((one for one in found.power.values() if np.isfinite(one)), default=None)
    if limit is not None:
        keys.append(Key("minimum detectable effect, largest", percent(limit), "90 % power"))
    answer = sentence(found, told)
    if rivals:
        others = joined([one.replace("_", " ") for one in dict.fromkeys(rivals)])
        answer += f" These records do not distinguish it from {others}."
    notes = [
        f"{names.get(note.record, note.record)}: {note.text}. Remedy: {note.remedy}." if note.record
        else f"{note.text[:1].upper()}{note.text[1:]}. Remedy: {note.remedy}."
        for note in found.notes
    ]  # fmt: skip
    tones = {"explained": "open" if rivals else "good", "nothing_to_add": "good", "partly_explained": "open"}
    return Head(
        "diagnosis", found.extended.title or "Untitled rig", QUESTION, answer, keys, tones.get(found.verdict, "bad"),
        found.verdict.replace("_", " "), found.extended.source, notes,
    )  # fmt: skip


def _placed(picture: Picture | None, name: str, charts: dict[str, Any]) -> dict[str, Any] | None:
    """Put the charts of a picture among those of the page; return what the template shows around them."""
    if picture is None:
        return None
    charts[name] = picture.before
    if picture.after is not None:
        charts[f"{name}-after"] = picture.after
    return {**picture._asdict(), "name": name, "words": picture.before["words"]}


def _cause(one: Any, picture: Any) -> dict[str, Any]:
    meaning = (type(one.effect).__doc__ or "").strip().split("\n\n")[0].translate({ord("`"): None, ord("*"): None})
    return {
        "kind": one.kind,
        "place": one.place,
        "meaning": " ".join(meaning.split()),
        "numbers": numbers(one),
        "evidence": one.evidence,
        "gain": figure(one.gain, digits=3),
        "probability": f"{one.probability:.2f}",
        "alternatives": one.alternatives,
        "excluded": one.excluded,
        "picture": picture,
    }


def _split(one: Any, names: dict[str, str]) -> dict[str, Any]:
    held = ", ".join(one.held)
    for name, brief in names.items():
        held = held.replace(name, brief)
    return {
        "held": held,
        "base": figure(one.base, digits=3),
        "extended": figure(one.extended, digits=3),
        "noise": figure(one.noise, digits=3),
        "gain": percent(one.gain),
        "likelihood": figure(one.likelihood if abs(one.likelihood) > 1e-3 else 0.0, digits=3),
    }
