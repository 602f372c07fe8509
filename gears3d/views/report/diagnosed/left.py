"""Residual patterns of a diagnosis, excluded points and minimum detectable effects."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.diagnosis.verdict import POWER
from gears3d.views.plots.numbers import Figure, plain
from gears3d.views.report.diagnosed.story import percent, sized
from gears3d.views.report.diagnosed.words import LEFT_OUT, PLACES, called

if TYPE_CHECKING:
    from gears3d.diagnosis import Diagnosis

ORDERED = ("order", "angle")
"""Parts of the names of residual patterns over an order."""


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


def power(found: Diagnosis) -> list[tuple[str, Figure, str]]:
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
