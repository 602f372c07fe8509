"""The report page of a diagnosis: fills the template."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from gears3d.files import write_text
from gears3d.version import __version__
from gears3d.views.plots.numbers import figure
from gears3d.views.report.diagnosed import left, pictures, story
from gears3d.views.report.measured import sensors
from gears3d.views.report.page import asset, environment
from gears3d.views.report.story import rig_sentence

if TYPE_CHECKING:
    from gears3d.diagnosis import Diagnosis

SHOWN = 2
"""Residual patterns that get a chart."""


def render(found: Diagnosis, command: str = "", files: tuple[str, ...] = ()) -> str:
    """Return the report of a diagnosis as one self-contained HTML page."""
    told = found.to_dict()
    rows = left.remains(told)
    for place, row in enumerate(rows):
        row["picture"] = pictures.of_remains(found, row["raw"], row["at"]) if place < SHOWN else None
    names = story.short([one["name"] for one in found.records])
    context: dict[str, Any] = {
        "title": found.extended.title or "Untitled rig",
        "source": found.extended.source,
        "version": __version__,
        "verdict": found.verdict,
        "tone": "reverse" if found.verdict in ("unexplained", "not_decidable") else "active",
        "sentence": story.sentence(found, told),
        "rig": rig_sentence(found.extended.document),
        "notes": [one._replace(record=names.get(one.record, one.record)) for one in found.notes],
        "suspects": [one.kind for one in found.suspects],
        "channels": story.channels(found, told),
        "causes": [_cause(found, one) for one in found.causes],
        "held": told["heldout"],
        "splits": [_split(one, names) for one in found.held],
        "experiments": [story.experiment(one) for one in found.runs],
        "solid": story.solid(told["heldout_3d"]),
        "gain": story.percent(told["heldout"]["gain"]),
        "gain_range": [story.percent(one).text for one in told["heldout"].get("gain_range", ())],
        "left": rows,
        "astray": story.astray(found),
        "worse": story.worse(told),
        "power": left.power(found),
        "snippet": story.snippet(found.causes),
        "records": [
            {
                **one,
                "name": names[one["name"]],
                "motion": found.motions.get(one["name"], "–"),
                "left_out": left.left_out(one["left_out"]),
            }
            for one in found.records
        ],
        "findings": {
            names.get(name, name): sensors.findings({"quality": {"findings": rows}})
            for name, rows in found.findings.items()
        },
        "command": command,
        "files": files,
        "blocks": {},
        "asset": asset,
    }
    return environment().get_template("diagnosed.html.j2").render(context)


def write(path: str | Path, found: Diagnosis, command: str = "", files: tuple[str, ...] = ()) -> Path:
    """Write the report under a temporary name and rename it."""
    return write_text(path, render(found, command, files))


def _cause(found: Diagnosis, one: Any) -> dict[str, Any]:
    meaning = (type(one.effect).__doc__ or "").strip().split("\n\n")[0].translate({ord("`"): None, ord("*"): None})
    return {
        "kind": one.kind,
        "place": one.place,
        "meaning": " ".join(meaning.split()),
        "numbers": story.numbers(one),
        "evidence": one.evidence,
        "gain": figure(one.gain, digits=3),
        "alternatives": one.alternatives,
        "excluded": one.excluded,
        "picture": pictures.of_cause(found, one.effect),
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
        "gain": story.percent(one.gain),
        "likelihood": figure(one.likelihood if abs(one.likelihood) > 1e-3 else 0.0, digits=3),
    }
