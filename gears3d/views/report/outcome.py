"""Results of a run, as numbers and sentences of the report."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.signals import times_of, window
from gears3d.views.plots.numbers import Figure, figure, kind_of
from gears3d.views.report.flanks import contacts, crossings
from gears3d.views.report.trust import Claim

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

REGIMES = {
    "contact": "The active flanks stay in contact: the drag exceeds the inertia torque of the fluctuation.",
    "single_sided": "The loose gear bounces on one flank only and never crosses the backlash.",
    "double_sided": "The loose gear rattles: it crosses the backlash and impacts both flanks alternately.",
}
"""Meaning of each regime."""


MODELS = {
    "bullet": "Simulated with rigid bodies in PyBullet (3D).",
    "rigid": "Simulated with the rigid model (one degree of freedom).",
    "lubricated": "Simulated with the lubricated model (oil film, one degree of freedom).",
    "plastic": "Solved in closed form for perfectly plastic impacts.",
}
"""Sentence for each model of a run."""


LINES = {
    "regime": ("regime", "contact, single-sided or double-sided impacts, after settling"),
    "motion": ("periodicity", "1T repeats every period of the drive's fluctuation, 2T every second one, and so on"),
    "impacts": ("impacts", "after settling; very low bounces are not counted"),
    "impacts_per_period": ("impacts per period", "per period of the fluctuation of the drive speed"),
    "active_impacts": ("impacts on the active flank", ""),
    "active_velocity_mean_m_s": (
        "mean impact velocity, active flank",
        "negative by convention: towards the active flank",
    ),
    "active_velocity_std_m_s": ("standard deviation", "of these, over all bounces"),
    "reverse_impacts": ("impacts on the reverse flank", ""),
    "reverse_velocity_mean_m_s": ("mean impact velocity, reverse flank", "positive by convention"),
    "reverse_velocity_std_m_s": ("standard deviation", "of these, over all bounces"),
    "active_restitution": (
        "effective restitution, active flank",
        "square root of the kinetic energy after over before the impact",
    ),
    "reverse_restitution": ("effective restitution, reverse flank", "same definition"),
    "active_energy_J_s": ("power lost in impacts, active flank", "kinetic energy of the relative motion, per second"),
    "reverse_energy_J_s": ("power lost in impacts, reverse flank", "same definition"),
    "excitation": (
        "excitation Λ",
        "inertia torque of the fluctuation over the drag torque; rigid teeth lose contact above 1",
    ),
}
"""Name and meaning of each result."""


SHARES = {
    "active_share": "in permanent contact with the active flank",
    "reverse_share": "in permanent contact with the reverse flank",
    "flight_share": "in flight, bounces included",
}
"""Shares of time."""


class Tile(NamedTuple):
    """A key figure.

    Args:
        key: name in ``summary.json``.
        name: in words.
        figure: the number.
        tone: ``active``, ``reverse`` or empty: the colour of its edge.
    """

    key: str
    name: str
    figure: Figure
    tone: str = ""


def tiles(summary: dict[str, Any]) -> list[Tile]:
    """Return the key figures that head the report."""
    comparison = summary.get("comparison") or {}
    found = [
        Tile("regime", "regime", figure(summary.get("regime"))),
        Tile("motion", "periodicity", figure(summary.get("motion"))),
        Tile("impacts_per_period", "impacts per period", figure(summary.get("impacts_per_period"), digits=3)),
        *(
            Tile(key, f"mean impact speed, {flank} flank", _speed(summary.get(key)), flank)
            for flank in ("active", "reverse")
            for key in (f"{flank}_velocity_mean_m_s",)
        ),
        Tile(
            "comparison.velocity_error_median",
            "impact speed error, median (compared with rigid model)",
            figure(comparison.get("velocity_error_median"), "ratio", 3),
        ),
    ]
    return [tile for tile in found if tile.figure.text != "–"]


def _speed(velocity: float | None) -> Figure:
    """Return a velocity as a speed; its bare value keeps the sign."""
    if velocity is None:
        return figure(None)
    return Figure(figure(abs(velocity), "velocity").text, velocity)


def answer(summary: dict[str, Any]) -> str:
    """Return the model and the result in a few sentences."""
    parts = [MODELS.get(str(summary.get("model")), ""), REGIMES.get(str(summary.get("regime")), "")]
    per_period = summary.get("impacts_per_period")
    speeds = {f: summary.get(f"{f}_velocity_mean_m_s") for f in ("active", "reverse")}
    speed = [f"{_speed(v).text} on the {f} flank" for f, v in speeds.items() if v is not None]
    if per_period and speed:
        count = figure(per_period, digits=3).text
        parts.append(f"There are {count} impacts per period of the drive's fluctuation, bounces included.")
        parts.append(f"The mean impact speed is {' and '.join(speed)}.")
    return " ".join(part for part in parts if part)


def lines(scenario: Scenario, recording: Recording, summary: dict[str, Any]) -> list[Claim]:
    """Return the table of results."""
    found = [
        Claim(key, name, figure(summary.get(key), kind_of(key)), meaning) for key, (name, meaning) in LINES.items()
    ]
    found = [line for line in found if line.figure.text != "–"]
    return found + _times(scenario, recording)


def _times(scenario: Scenario, recording: Recording) -> list[Claim]:
    """Return how long flights and contacts last and where the time is spent, after settling."""
    table = contacts(recording, scenario.rows(), scenario.rig().backlash)
    if table is None:
        return []
    start, end = window(recording.signals, recording.meta)
    told = times_of(recording.impacts, table, start, end)
    found = []
    for name, flights in crossings(recording, table, start).items():
        if len(flights):
            found += _crossing_lines(name, *flights.T)
    if not found and told["flights"]:
        meaning = f"the longest of {told['flights']} flights, from contact loss to the next impact"
        found.append(Claim("flight_longest_s", "longest flight", figure(told["flight_longest_s"], "time"), meaning))
        highest = figure(told["flight_height_max_m"], "length")
        if highest.value is not None:
            found.append(
                Claim(
                    "flight_height_max_m", "highest flight", highest, "largest distance from the flank where it began"
                )
            )
    for name in ("active", "reverse"):
        if told[f"{name}_contacts"]:
            key = f"{name}_contact_mean_s"
            meaning = f"mean of {told[f'{name}_contacts']}, from the last bounce to contact loss"
            found.append(Claim(key, f"contact on the {name} flank", figure(told[key], "time"), meaning))
    for key, name in SHARES.items():
        if told[key] is not None:
            found.append(Claim(key, f"time {name}", figure(told[key], "ratio", 3), ""))
    return found


def _crossing_lines(flank: str, times: np.ndarray, speeds: np.ndarray) -> list[Claim]:
    low, high = (figure(float(one), "time", 3).text for one in (times.min(), times.max()))
    slow, fast = (figure(float(one), "velocity", 3).text for one in (speeds.min(), speeds.max()))
    return [
        Claim(
            f"crossing_{flank}_m_s",
            f"first impact after a crossing, {flank} flank",
            figure(float(speeds.mean()), "velocity"),
            f"mean speed of {len(speeds)} impacts, without the bounces that follow; range {slow} to {fast}",
        ),
        Claim(
            f"crossing_{flank}_s",
            f"flight across, to the {flank} flank",
            figure(float(times.mean()), "time"),
            f"mean of {len(times)} flights across the backlash; range {low} to {high}",
        ),
    ]


def expectations(summary: dict[str, Any]) -> list[tuple[str, Figure, Figure, bool]]:
    """Return the expectations of the scenario: name, expected, found, whether it was met."""
    return [
        (key.replace("_", " "), figure(one["expected"]), figure(one["found"]), bool(one["met"]))
        for key, one in (summary.get("expect") or {}).items()
    ]


def wall_lines(summary: dict[str, Any]) -> list[tuple[str, Figure, Figure]]:
    """Return the wall times: name, time, speed as a multiple of real time."""
    reached = summary.get("reached_s") or 0.0
    return [
        (name, figure(float(t), "time", 3), figure(reached / t if t else None, digits=3))
        for name, t in (summary.get("wall_s") or {}).items()
    ]


def command(scenario: Scenario, summary: dict[str, Any]) -> str:
    """Return the command that repeats the run."""
    if summary.get("command"):
        return str(summary["command"])
    words = ["gears3d", "run", str(scenario.path or "scenario.toml")]
    if summary.get("model") not in (None, "bullet"):
        words += ["--model", str(summary["model"])]
    if summary.get("contact") == "native":
        words += ["--contact", "native"]
    return shlex.join(words)
