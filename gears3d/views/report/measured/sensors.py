"""Quality of the sensors of a measured record, as rows and sentences of its report."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gears3d.measured.drive_motion import told
from gears3d.views.plots.numbers import Figure, figure, kind_of, plain
from gears3d.views.report.trust import Claim

READ_AS = {
    "edges": "counts last longer than samples: the times at which the counter changes are used",
    "samples": "counts are shorter than samples: every sample is used, shifted by 0.5 counts",
    "smooth": "no quantisation is visible: every sample is used as it is",
}
"""Meaning of the methods of evaluating an encoder."""
GEARS = {"theta_drive_rad": "drive gear", "theta_loose_rad": "loose gear", "time_s": "clock"}


class Found(NamedTuple):
    """A finding of the gate, as a row of a table.

    Args:
        kind: word that ``--correct`` takes.
        where: channel in words.
        size: how large.
        evidence: observation.
        remedy: what to do, or correction that was made.
        tone: ``corrected``, ``open`` or ``fatal``.
    """

    kind: str
    where: str
    size: Figure
    evidence: str
    remedy: str
    tone: str


def findings(summary: dict[str, Any]) -> list[Found]:
    """Return what the gate found, open findings first."""
    rows = []
    for one in summary["quality"].get("findings", []):
        remedy = one["remedy"]
        if one["corrected"]:
            tone, remedy = "corrected", "corrected on request, before the analysis"
        else:
            tone = "fatal" if one["fatal"] else "open"
            if one["correctable"]:
                remedy = f"--correct {one['kind']}" + (f", {remedy}" if remedy else "")
        channel = GEARS.get(one["channel"]) or str(one["channel"])
        rows.append(Found(one["kind"], channel, sized(one["size"], one["unit"]), one["evidence"], remedy, tone))
    return sorted(rows, key=lambda row: row.tone == "corrected")


def sized(value: float, unit: str) -> Figure:
    r"""Return a size with its SI unit as it is read.

    >>> sized(2.0049e-4, "s").text, sized(3.0, "rows").text
    ('200.5\xa0µs', '3\xa0rows')
    """
    kind = {"s": "time", "m": "length", "m/s": "velocity"}.get(unit, "")
    if kind:
        return figure(value, kind)
    return Figure(f"{plain(float(value))}\N{NO-BREAK SPACE}{unit}".strip(), float(value))


def verdict(rows: list[Found]) -> str:
    """Return the result of the sensor gate in one sentence."""
    still = [row for row in rows if row.tone != "corrected"]
    done = len(rows) - len(still)
    fixed = f"{done} {'fault was' if done == 1 else 'faults were'} corrected on request" if done else ""
    if not rows:
        return "Sensors and clock: no fault was found."
    if not still:
        return f"Sensors and clock: {fixed}, no other fault was found."
    kinds = ", ".join(dict.fromkeys(row.kind for row in still))
    text = f"Caution: sensor faults that were not corrected affect all results: {kinds}"
    return text + (f"; {fixed}." if fixed else ".")


def sensor_lines(summary: dict[str, Any]) -> list[Claim]:
    """Return sampling, encoders and noise as lines of a table."""
    quality = summary["quality"]
    rate = Figure(f"{plain(quality['sample_rate_Hz'])}\N{NO-BREAK SPACE}Hz", quality["sample_rate_Hz"])
    lines = [
        Claim("sample_rate_Hz", "sampling", rate, f"{quality['samples']} samples"),
        Claim(
            "jitter",
            "jitter of the clock",
            figure(quality["jitter"], "ratio", 2),
            "largest, relative to the sampling interval",
        ),
    ]
    if motion := summary.get("drive_motion"):
        rpm = 30.0 / np.pi * motion["mean_rad_s"]["value"]
        mean = Figure(f"{plain(rpm, 4)}\N{NO-BREAK SPACE}rpm", motion["mean_rad_s"]["value"])
        lines.append(Claim("drive_motion", "measured motion of the drive", mean, told(motion)))
    for gear, one in quality["encoders"].items():
        counts = one["counts_per_revolution"]
        shown = Figure("not visible") if counts is None else Figure(f"{counts:.0f}", float(counts))
        how = READ_AS.get(one["read_as"], f"evaluated as {one['read_as']}")
        spread = f"standard deviation of a reading {plain(1e6 * one['sigma_rad'], 3)} µrad; {how}"
        lines.append(Claim(f"encoders.{gear}", f"encoder counts per revolution, {gear} gear", shown, spread))
    meanings = {
        "noise_m": ("noise of a reading", "displacement along the line of action"),
        "noise_in_contact_m": (
            "noise in contact",
            "of averaged readings, about the flank; only larger separations count as flights",
        ),
        "averaged_over_s": ("averaging time", "limited by the velocity jumps of the path"),
    }
    for key, (name, meaning) in meanings.items():
        lines.append(Claim(key, name, figure(quality[key], kind_of(key), 3), meaning))
    return lines
