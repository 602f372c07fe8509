"""Results of a measured record, as numbers and sentences of its report."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.recording import FLANKS
from gears3d.views.plots.numbers import Figure, figure, plain
from gears3d.views.report.outcome import REGIMES, Tile
from gears3d.views.report.trust import Claim

if TYPE_CHECKING:
    from gears3d.measured.segmentation import Measurement


def tiles(summary: dict[str, Any]) -> list[Tile]:
    """Return the key figures that head the page."""
    backlash = summary["flanks"]["backlash_m"]
    speeds = {flank: summary[f"{flank}_velocity_mean_m_s"] for flank in FLANKS}
    return [
        Tile("regime", "regime", figure(summary["regime"])),
        Tile("backlash_m", "backlash", figure(backlash and backlash["value"], "length")),
        Tile("impacts", "impacts", figure(summary["impacts"])),
        *(
            Tile(
                f"{flank}_velocity_mean_m_s",
                f"mean impact speed, {flank} flank",
                Figure(figure(None if speed is None else abs(speed), "velocity").text, speed),
                flank,
            )
            for flank, speed in speeds.items()
        ),
        Tile("noise_m", "noise of a reading", figure(summary["quality"]["noise_m"], "length")),
    ]


def sentence(summary: dict[str, Any]) -> str:
    """Return in a few sentences what was recorded and the result."""
    quality, cut = summary["quality"], summary["cut"]
    if summary["status"] == "unexplained":
        said = summary["warnings"][0]
        return f"{said[:1].upper()}{said[1:]}."
    text = f"Measured angles of both gears: {quality['samples']} samples over "
    text += f"{figure(quality['duration_s'], 'time').text}. "
    text += REGIMES.get(str(summary["regime"]), "")
    if cut["whole_flights"]:
        text += f" {cut['whole_flights']} complete free flights were found, {cut['testifying']} of which pass the "
        text += "goodness-of-fit test and are used for identification."
    return text


def impact_lines(found: Measurement) -> list[Claim]:
    """Return the impacts of both flanks as lines of a table."""
    summary, hits = found.summary, found.recording.impacts
    lines = []
    for code, flank in enumerate(FLANKS):
        mine = hits["flank"] == code
        if not mine.any():
            continue
        speed, spread = summary[f"{flank}_velocity_mean_m_s"], summary[f"{flank}_velocity_std_m_s"]
        text = figure(None if speed is None else abs(speed), "velocity").text
        scatter = "" if spread is None else f"standard deviation {figure(spread, 'velocity', 3).text}; "
        lines.append(
            Claim(
                f"{flank}_impacts",
                f"impacts, {flank} flank",
                figure(int(mine.sum())),
                "all that could be distinguished",
            )
        )
        name = f"mean impact speed, {flank} flank"
        meaning = f"{scatter}excludes impacts after very low bounces"
        lines.append(Claim(f"{flank}_mean", name, Figure(text, speed), meaning))
        both = mine & np.isfinite(hits["rebound_m_s"]) & (hits["testifies"] == 1) & (hits["velocity_m_s"] != 0)
        if both.any():
            ratio = np.abs(hits["rebound_m_s"][both] / hits["velocity_m_s"][both])
            low, high = np.quantile(ratio, (0.25, 0.75))
            what = (
                f"median of {both.sum()} impacts with observed rebound; quartiles {plain(low, 3)} and {plain(high, 3)}"
            )
            name = f"rebound speed over approach speed, {flank} flank"
            lines.append(Claim(f"{flank}_ratio", name, figure(float(np.median(ratio)), digits=3), what))
    return lines


def duration_lines(summary: dict[str, Any]) -> list[Claim]:
    """Return how long impacts last, as lines of a table."""
    lines = []
    for flank, one in summary["durations"].items():
        if one["resolved"]:
            what = f"median of {one['resolved']} resolved impacts out of {one['impacts']}"
            shown = figure(one["median_s"], "time", 3)
        elif one["max_median_s"] is not None:
            shown = figure(one["max_median_s"], "time", 3)
            shown = Figure(f"< {shown.text}", shown.value)
            what = f"none of {one['impacts']} impacts is resolved; median of their upper bounds (95 %)"
        else:
            continue
        lines.append(Claim(f"durations.{flank}", f"duration, {flank} flank", shown, what))
    return lines


def durations(found: Measurement) -> dict[str, dict[str, Any]]:
    """Return how long impacts last by flank, as ``durations`` of ``summary.json`` has it."""
    hits, told = found.segments.impacts, {}
    for code, flank in enumerate(FLANKS):
        mine = hits["flank"] == code
        lasted, most = hits["duration_s"][mine], hits["duration_max_s"][mine]
        seen = np.isfinite(lasted)
        told[flank] = {
            "impacts": int(mine.sum()),
            "resolved": int(seen.sum()),
            "median_s": float(np.median(lasted[seen])) if seen.any() else None,
            "quartiles_s": [float(q) for q in np.quantile(lasted[seen], (0.25, 0.75))] if seen.any() else None,
            "max_median_s": float(np.median(most[np.isfinite(most)])) if np.isfinite(most).any() else None,
        }
    return told


def flight_lines(found: Measurement) -> list[Claim]:
    """Return the flights as lines of a table."""
    cut, table = found.summary["cut"], found.segments.flights
    lines = [Claim("whole_flights", "complete flights", figure(cut["whole_flights"]), "from contact loss to impact")]
    if cut["whole_flights"]:
        share = cut["testifying"] / cut["whole_flights"]
        what = f"{plain(100 * share, 3)} %; they pass the goodness-of-fit test (p > 0.1 %), the others are excluded"
        lines += [
            Claim("testifying", "used for identification", figure(cut["testifying"]), what),
            Claim(
                "chi2_median",
                "χ² per degree of freedom, median",
                figure(cut["chi2_median"], digits=3),
                "1 is expected",
            ),
            Claim(
                "height",
                "largest height",
                figure(float(table["height_m"].max()), "length"),
                "from the flank where the flight began",
            ),
            Claim(
                "lasting",
                "duration, median",
                figure(float(np.median(table["end_s"] - table["start_s"])), "time"),
                f"longest: {figure(float((table['end_s'] - table['start_s']).max()), 'time').text}",
            ),
        ]
    slowing = cut["deceleration_median_rad_s2"]
    if slowing is not None:
        shown = Figure(f"{plain(slowing)}\N{NO-BREAK SPACE}rad/s²", slowing)
        lines.append(Claim("deceleration", "deceleration in flight, median", shown, _torque(found, slowing)))
    if cut["slope_1_s"]:
        one = cut["slope_1_s"]
        shown = Figure(f"{plain(one['value'], 3)} ± {plain(one['sigma'], 2)}\N{NO-BREAK SPACE}1/s", one["value"])
        lines.append(
            Claim("slope_1_s", "change of deceleration with speed", shown, "within flights; positive for viscous drag")
        )
    return lines


def _torque(found: Measurement, slowing: float) -> str:
    inertia = found.recording.meta.get("inertia_kg_m2")
    if inertia is None:
        return "of the loose gear: drag torque over inertia"
    torque = plain(slowing * inertia, 3)
    return f"of the loose gear: a drag torque of {torque} N·m with the rig's inertia of {plain(inertia, 3)} kg·m²"


WHY_NOT = {
    "too_short": ("too short", "fewer readings than a parabola needs"),
    "no_blow": ("no approach", "not a flight: the interval without contact ends without an approach speed"),
    "cut_off": ("truncated", "reaches the begin or end of the record"),
    "no_testimony": ("poor fit", "kept, but it fails the goodness-of-fit test and is not used for identification"),
}
"""Name and meaning of the reasons why an interval without contact is not used."""


def discarded(summary: dict[str, Any]) -> list[Claim]:
    """Return excluded intervals and their counts as lines of a table; empty where the gears stay in contact."""
    cut = summary["cut"]
    every = cut["whole_flights"] + sum(cut["dropped"].values())
    lines: list[Claim] = []
    if not every:
        return lines
    for why, count in {**cut["dropped"], "no_testimony": cut["whole_flights"] - cut["testifying"]}.items():
        name, meaning = WHY_NOT[why]
        share = f" ({plain(100 * count / every, 2)} %)"
        lines.append(Claim(f"dropped.{why}", name, Figure(f"{count}{share}", float(count)), meaning))
    return lines


def _no_backlash(summary: dict[str, Any]) -> str:
    if summary["status"] == "unexplained":
        return "withheld: free flights and contact do not explain the motion"
    return "no impact on the reverse flank"


def flank_lines(summary: dict[str, Any]) -> list[Claim]:
    """Return backlash and strongest orders as lines of a table."""
    backlash = summary["flanks"]["backlash_m"]
    lines = []
    if backlash is None:
        lines.append(Claim("backlash_m", "backlash", Figure("unknown"), _no_backlash(summary)))
    else:
        low, high = (figure(end, "length", 6).text for end in backlash["ci95"])
        shown = figure(backlash["value"], "length", 5)
        lines.append(Claim("backlash_m", "backlash", shown, f"mean over gear angles; 95 % interval {low} to {high}"))
    for flank, orders in summary["contact_orders"].items():
        for k, one in enumerate(orders[:6]):
            meaning = f"± {figure(one['sigma_m'], 'length', 2).text} (standard deviation), phase "
            meaning += f"{plain(np.degrees(one['phase_rad']), 3)}°"
            name = f"order {one['order']} of the {one['gear']} gear, {flank} flank"
            lines.append(Claim(f"contact_orders.{flank}.{k}", name, figure(one["amplitude_m"], "length"), meaning))
    return lines
