"""The report page of a measured record: fills the template."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from gears3d.files import write_text
from gears3d.views.report.measured import sensors, story
from gears3d.views.report.measured.data import blocks
from gears3d.views.report.measured.limits import limits
from gears3d.views.report.page import as_json, asset, environment

if TYPE_CHECKING:
    from gears3d.measured.segmentation import Measurement
    from gears3d.views.report.page import Picture


def render(found: Measurement, files: tuple[str, ...] = (), strip: Picture | None = None) -> str:
    """Return the report of a measured record as one self-contained HTML page."""
    summary, meta = found.summary, found.recording.meta
    rows = sensors.findings(summary)
    data = blocks(found)
    context: dict[str, Any] = {
        "title": meta.get("title") or Path(str(summary.get("file") or "Measured record")).name,
        "source": meta.get("source"),
        "file": summary.get("file"),
        "version": summary.get("version"),
        "command": summary.get("command"),
        "tiles": story.tiles(summary),
        "sentence": story.sentence(summary),
        "verdict": sensors.verdict(rows),
        "findings": rows,
        "sensors": sensors.sensor_lines(summary),
        "impacts": story.impact_lines(found),
        "durations": story.duration_lines(summary),
        "flights": story.flight_lines(found),
        "discarded": story.discarded(summary),
        "flanks": story.flank_lines(summary),
        "limits": limits(found),
        "period": bool(meta.get("period_s")),
        "resolved": any(one["resolved"] for one in summary["durations"].values()),
        "spectra": {gear: list(flanks) for gear, flanks in data["spectra"].items()},
        "withheld": summary["status"] == "unexplained",
        "has_impacts": bool(len(found.recording.impacts["time_s"])),
        "has_flights": bool(len(found.segments.flights["start_s"])),
        "files": files,
        "strip": strip,
        "blocks": {name: as_json(block) for name, block in data.items()},
        "asset": asset,
    }
    return environment().get_template("measured.html.j2").render(context)


def write(path: str | Path, found: Measurement, files: tuple[str, ...] = (), strip: Picture | None = None) -> Path:
    """Write the report under a temporary name and rename it."""
    return write_text(path, render(found, files, strip))
