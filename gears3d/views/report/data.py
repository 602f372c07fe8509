"""The data blocks that the page carries for its plots."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.views.report.events import impact_table, speed_errors, speed_histogram
from gears3d.views.report.flanks import walls
from gears3d.views.report.traces import TICK, traces

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

NANOMETRE = 1e-9


def blocks(scenario: Scenario, recording: Recording, twin: Recording | None, summary: dict[str, Any]) -> dict[str, Any]:
    """Return the blocks by name: traces, walls, impacts, twin_impacts, errors, histogram, about."""
    lines = traces(recording, twin)
    period = summary.get("period_s") or recording.meta.get("period_s")
    comparison = summary.get("comparison") or {}
    height = comparison.get("flight_height_min_m") or 0.0
    pairable = twin if comparison.get("mode") != "distribution" else None
    return {
        "traces": lines,
        "walls": _walls(scenario, recording, np.cumsum(lines["time"]) * TICK),
        "impacts": impact_table(recording),
        "twin_impacts": impact_table(twin) if twin is not None else None,
        "errors": speed_errors(recording, pairable, period, height) if pairable is not None and period else None,
        "histogram": speed_histogram(recording, twin),
        "about": {
            "period": period,
            "settle": recording.meta.get("settle_s"),
            "mode": comparison.get("mode"),
            "height": height,
            "model": summary.get("model"),
        },
    }


def _walls(scenario: Scenario, recording: Recording, time: np.ndarray) -> dict[str, Any]:
    """Return the flanks as nanometres: one number each when they stand still."""
    ends = walls(recording, scenario.rows(), scenario.rig().backlash, time)
    out: dict[str, Any] = {"quantum": NANOMETRE, "moving": ends.moving, "complete": ends.complete}
    for name, values in (("active", ends.active), ("reverse", ends.reverse)):
        whole = np.rint(values / NANOMETRE).astype(np.int64)
        out[name] = np.diff(whole, prepend=0).tolist() if ends.moving else [int(v) for v in whole[:1]]
    return out
