"""The report page of a run: fills the templates."""

from __future__ import annotations

import json
from base64 import b64encode
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
from markupsafe import Markup

from gears3d.files import write_text
from gears3d.views.plots.numbers import figure
from gears3d.views.report import outcome, story, trust
from gears3d.views.report.data import blocks
from gears3d.views.report.drawing import mesh_drawing

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

ROOM = files("gears3d.views.report")


@dataclass(frozen=True)
class Picture:
    """A picture to be put into the page.

    Args:
        svg: its document.
        words: description for screen readers.
        caption: below it.
    """

    svg: str
    words: str
    caption: str

    @property
    def source(self) -> str:
        """The file as an address that needs no network."""
        return "data:image/svg+xml;base64," + b64encode(self.svg.encode()).decode("ascii")


def render(
    *,
    scenario: Scenario,
    recording: Recording,
    twin: Recording | None = None,
    summary: dict[str, Any],
    gears_svg: str | None = None,
    strip: Picture | None = None,
) -> str:
    """Return the report of a run as one self-contained HTML page."""
    context = {
        "title": scenario.title or "Untitled scenario",
        "source": scenario.source,
        **{key: summary.get(key) for key in ("version", "seed", "model", "contact")},
        "partial": summary.get("status") != "complete",
        "reached": figure(summary.get("reached_s"), "time"),
        "duration": figure(recording.meta.get("duration_s"), "time"),
        "sentence": story.sentence(scenario.document),
        "answer": outcome.answer(summary),
        "verdict": trust.verdict(summary.get("comparison")),
        "tiles": outcome.tiles(summary),
        "question": [
            (group, list(lines)) for group, lines in groupby(story.table(scenario.document), lambda line: line.group)
        ],
        "outcome": outcome.lines(scenario, recording, summary),
        "expect": outcome.expectations(summary),
        "comparison": trust.comparison_lines(summary.get("comparison")),
        "shared": trust.source(summary),
        "budget": trust.budget_lines(summary.get("error_budget"), summary.get("contact") == "native"),
        "wall": outcome.wall_lines(summary),
        "document": scenario.document,
        "command": outcome.command(scenario, summary),
        "drawing": mesh_drawing(scenario.pair()) if gears_svg is None else Markup(gears_svg),
        "blocks": {name: as_json(block) for name, block in blocks(scenario, recording, twin, summary).items()},
        "has_twin": twin is not None,
        "has_impacts": bool(len(recording.impacts["time_s"])),
        "strip": strip,
        "asset": asset,
    }
    return environment().get_template("page.html.j2").render(context)


def write(
    path: str | Path,
    *,
    scenario: Scenario,
    recording: Recording,
    twin: Recording | None = None,
    summary: dict[str, Any],
    gears_svg: str | None = None,
    strip: Picture | None = None,
) -> Path:
    """Write the report under a temporary name and rename it."""
    html = render(scenario=scenario, recording=recording, twin=twin, summary=summary, gears_svg=gears_svg, strip=strip)
    return write_text(path, html)


def as_json(block: Any) -> Markup:
    r"""Return JSON that is safe inside a script element.

    >>> as_json(["</script>"])
    Markup('["\\u003c/script>"]')
    """
    text = json.dumps(block, separators=(",", ":"), allow_nan=False, ensure_ascii=True)
    return Markup(text.replace("<", "\\u003c"))


@lru_cache
def environment() -> jinja2.Environment:
    """Return the templates, with escaping on and undefined names refused."""
    loader = jinja2.PackageLoader("gears3d.views.report")
    return jinja2.Environment(
        loader=loader, autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )


@lru_cache
def asset(name: str) -> Markup:
    """Return a vendored or own script or style sheet, to be put into the page as it is."""
    return Markup((ROOM / "assets" / name).read_text(encoding="utf-8"))
