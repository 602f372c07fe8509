"""Identified laws as pictures."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.palette import BAND, FLANKS, NEUTRAL, PARTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.identify.law import Identified

LINE, POINTS = FLANKS[0], NEUTRAL
MOST = 4  # Parameters that a title holds


def picture_of(found: Identified) -> Figure:
    """Draw an identified law of any kind.

    Args:
        found: the law.
    """
    if found.law in ("transmission_error", "backlash"):
        return orders_picture(found)
    if found.law == "threshold":
        return threshold_picture(found)
    return rundown_picture(found) if "torque_N_m" in found.curves else restitution_picture(found)


def rundown_picture(found: Identified) -> Figure:
    """Draw torque over speed with its 95 % band, and the residual of the angle over time."""
    from math import pi

    from matplotlib.figure import Figure

    curves = found.curves
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    upper, lower = figure.subplots(2, 1)
    rpm = curves["speed_rad_s"] * 30.0 / pi
    upper.fill_between(rpm, curves["low_N_m"], curves["high_N_m"], color=BAND, label="95 %")
    upper.plot(rpm, curves["torque_N_m"], color=LINE, label=found.law)
    if np.any(np.abs(curves["estimate_N_m"] - curves["torque_N_m"]) > curves["estimate_half_N_m"]):  # no law holds
        upper.plot(rpm, curves["estimate_N_m"], "--", color=LINE, label="best estimate")
    for colour, (name, part) in zip(cycle(PARTS), curves["parts"].items(), strict=False):
        upper.plot(rpm, part["torque_N_m"], color=colour, linestyle="--", linewidth=1, label=name)
        upper.fill_between(rpm, part["low_N_m"], part["high_N_m"], color=colour, alpha=0.2)
    upper.set(xlabel="speed [rpm]", ylabel="drag torque [N·m]", title=_title(found))
    upper.set_ylim(
        min(0.0, 1.1 * float(curves["low_N_m"].min())),
        1.1 * float(max(curves["high_N_m"].max(), curves["torque_N_m"].max())),
    )
    upper.legend(frameon=False)
    measured = {one["measured"] for one in found.goodness.get("coastdowns", [])}
    factor, unit = (1.0, "rad/s") if measured == {"speed"} else (1e6, "µrad")
    for time, rest in curves["residuals"]:
        lower.plot(time, rest * factor, ".", color=POINTS, markersize=2)
    lower.axhline(0.0, color=LINE, linewidth=1)
    lower.set(xlabel="time since the release [s]", ylabel=f"measured − law [{unit}]")
    return figure


def _title(found: Identified) -> str:
    if len(found.parameters) > MOST:
        return found.law
    parts = [
        f"{name} {p.value:.4g} ± {0.5 * (p.high - p.low):.1g} {p.unit}".rstrip() for name, p in found.parameters.items()
    ]
    return ", ".join(parts)


COLOURS: dict[str, str] = dict(zip(("active", "reverse"), FLANKS, strict=True))


def orders_picture(found: Identified) -> Figure:
    """Draw both flanks over the drive's angle, each about its mean, and their order spectra with noise floor."""
    from matplotlib.figure import Figure

    seen = [name for name in COLOURS if name in found.curves]
    figure = Figure(figsize=(8.5, 2.8 * (1 + len(seen))), layout="constrained")
    axes = np.atleast_1d(figure.subplots(1 + len(seen), 1))
    zero = found.curves[seen[0]]["curve"][1].mean()
    for name in seen:
        theta, place = found.curves[name]["curve"]
        mean = place.mean()
        label = name if name == seen[0] else f"{name}, mean {1e6 * (mean - zero):.6g} µm from the {seen[0]} one"
        style = {"color": COLOURS[name], "linewidth": 1, "linestyle": "-" if name == seen[0] else "--"}
        axes[0].plot(np.degrees(theta), 1e6 * (place - mean), label=label, **style)
    axes[0].set(xlabel="drive's angle [deg], from the record's zero", ylabel="flank about its mean [µm]")
    axes[0].set_title(found.law.replace("_", " "))
    axes[0].legend(frameon=False, fontsize=8)
    for axis, name in zip(axes[1:], seen, strict=True):
        own = found.curves[name]
        at = np.argsort(own["frequency"])
        axis.plot(own["frequency"], 1e6 * own["seen"], ".", color=POINTS, markersize=3, label="all orders looked at")
        axis.plot(own["frequency"][at], 1e6 * own["floor"][at], color="black", linewidth=1, label="noise floor")
        for loose, mark in ((False, "o"), (True, "s")):
            some = own["loose"] == loose
            if some.any():
                reach = 1.96e6 * own["found_deviation"][some]
                label = f"{name}, {'loose' if loose else 'drive'} gear, 95 %"
                size = 1e6 * own["found_size"][some]
                axis.errorbar(own["found"][some], size, reach, fmt=mark, color=COLOURS[name], label=label, markersize=4)
        axis.set(yscale="log", xlabel="cycles a turn of the drive", ylabel="amplitude [µm]")
        axis.legend(frameon=False, fontsize=8)
    return figure


DIRECTION_COLOURS = dict(zip(("up", "down"), FLANKS, strict=True))


def threshold_picture(found: Identified) -> Figure:
    """Draw the opening of the gap over the excitation, the law of rigid flights and the thresholds."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    axes = figure.subplots()
    known = any(name.startswith("excitation") for name in found.parameters)
    scale = found.curves["scale"]["factor"] if known else 1.0
    for way, colour in DIRECTION_COLOURS.items():
        if (curve := found.curves.get(way)) is None:
            continue
        marker = "^" if way == "up" else "v"
        level, opening = scale * curve["level_rad_s2"], 1e6 * curve["opening_m"]
        axes.plot(level, opening, marker, color=colour, markersize=4, label=f"amplitude {way}")
        if "law_level_rad_s2" in curve:
            label = f"law of the first flight, {way}, as if there were no other flank"
            law = scale * curve["law_level_rad_s2"], 1e6 * curve["law_opening_m"]
            axes.plot(*law, color=colour, linewidth=1, linestyle="-" if way == "up" else "--", label=label)
        if (one := found.parameters.get(f"acceleration_{way}")) is not None:
            mark = "-." if way == "up" else ":"
            axes.axvline(scale * one.value, color=colour, linestyle=mark, linewidth=1, label=f"threshold, {way}")
            axes.axvspan(scale * one.low, scale * one.high, color=colour, alpha=0.15)
    seen = [
        one["opening_seen_m"] for way in DIRECTION_COLOURS if "opening_seen_m" in (one := found.goodness.get(way, {}))
    ]
    axes.axhline(1e6 * max(seen), color=POINTS, linewidth=1, linestyle=":", label="seen from here on")
    linear = max(1e6 * max(seen), 0.1)
    lowest = min(
        (1e6 * found.curves[way]["opening_m"].min() for way in DIRECTION_COLOURS if way in found.curves), default=0.0
    )
    axes.set_yscale("symlog", linthresh=linear)
    axes.set_ylim(bottom=min(2.0 * lowest, -0.5 * linear))
    axes.set(xlabel="excitation Λ with the rig's drag" if known else "drive's acceleration [rad/s²]")
    axes.set(ylabel="gap that opens in a period [µm]")
    axes.legend(frameon=False, fontsize="small")
    return figure


def restitution_picture(found: Identified) -> Figure:
    """Draw rebound over approach, and restitution over approach with the law and its 95 % band, by flank.

    Args:
        found: what ``identify_restitution`` gave.

    Returns:
        A figure that belongs to no window.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 8.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    for name, one in found.curves.get("flanks", {}).items():
        _flank(upper, lower, name, one, float(found.curves["deviation"]))
    upper.set(ylabel="rebound [mm/s]", title=f"law: {found.law}")
    lower.set(xlabel="approach [mm/s]", ylabel="restitution (rebound / approach)", ylim=(0.0, 1.05))
    for axes in (upper, lower):
        axes.set_xlim(left=0.0)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(frameon=False, fontsize="small")
    return figure


def _flank(upper: Any, lower: Any, name: str, one: dict[str, Any], deviation: float) -> None:
    of_gear = name in COLOURS
    colour, milli = COLOURS[name if of_gear else "active"], 1e3
    approach, rebound = one["approach_m_s"], one["rebound_m_s"]
    bars = {"fmt": ".", "color": colour, "markersize": 3, "elinewidth": 0.5, "alpha": 0.6}
    upper.errorbar(
        milli * approach,
        milli * rebound,
        milli * one["rebound_sigma_m_s"],
        milli * one["approach_sigma_m_s"],
        label=f"{name} flank" if of_gear else name,
        **bars,
    )
    ratio = rebound / approach
    noise = np.hypot(one["rebound_sigma_m_s"], ratio * one["approach_sigma_m_s"]) / approach
    lower.errorbar(milli * approach, ratio, noise, **bars)
    speed, mean = one["speed_m_s"], one["mean"]
    line = {"color": colour, "linewidth": 1, "linestyle": "--" if name == "reverse" else "-"}  # both may be one law
    upper.plot(milli * speed, milli * speed * np.clip(mean, 0.0, 1.0), **line)
    if of_gear:  # a list leaves no rebound out
        below = f"{name}: rebounds below are not used"
        upper.axhline(milli * one["lowest_m_s"], color=colour, linewidth=0.7, linestyle=":", label=below)
    lower.plot(milli * speed, mean, label=f"{name}: law and 95 %", **line)
    lower.fill_between(milli * speed, one["low"], one["high"], color=colour, alpha=0.3, linewidth=0)
    if deviation > 0.0:
        lower.fill_between(
            milli * speed, mean - 1.96 * deviation, mean + 1.96 * deviation, color=colour, alpha=0.1, linewidth=0
        )
    moving = speed > 0.0
    if of_gear:
        lower.plot(milli * speed[moving], one["lowest_m_s"] / speed[moving], color=colour, linewidth=0.7, linestyle=":")
