"""A threshold as a picture: how far the gap opens in each period, over the excitation, rising and falling."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.identify.law import Identified

COLOURS = {"up": "#0072B2", "down": "#D55E00"}


def threshold_picture(found: Identified) -> Figure:
    """Draw the opening of the gap over the excitation, up and down, with the law of rigid flights and the thresholds.

    Args:
        found: what ``identify_threshold`` gave.

    Returns:
        A figure that belongs to no window.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    axes = figure.subplots()
    known = any(name.startswith("excitation") for name in found.parameters)
    scale = found.curves["scale"]["factor"] if known else 1.0
    for way, colour in COLOURS.items():
        if (curve := found.curves.get(way)) is None:
            continue
        marker = "^" if way == "up" else "v"
        level, opening = scale * curve["level_rad_s2"], 1e6 * curve["opening_m"]
        axes.plot(level, opening, marker, color=colour, markersize=4, label=f"swing {way}")
        if "law_level_rad_s2" in curve:
            label = f"law of the first flight, {way}, as if there were no other flank"
            law = scale * curve["law_level_rad_s2"], 1e6 * curve["law_opening_m"]
            axes.plot(*law, color=colour, linewidth=1, linestyle="-" if way == "up" else "--", label=label)
        if (one := found.parameters.get(f"acceleration_{way}")) is not None:
            mark = "-." if way == "up" else ":"
            axes.axvline(scale * one.value, color=colour, linestyle=mark, linewidth=1, label=f"threshold, {way}")
            axes.axvspan(scale * one.low, scale * one.high, color=colour, alpha=0.15)
    seen = [one["opening_seen_m"] for way in COLOURS if "opening_seen_m" in (one := found.goodness.get(way, {}))]
    axes.axhline(1e6 * max(seen), color="#777777", linewidth=1, linestyle=":", label="seen from here on")
    linear = max(1e6 * max(seen), 0.1)
    lowest = min((1e6 * found.curves[way]["opening_m"].min() for way in COLOURS if way in found.curves), default=0.0)
    axes.set_yscale("symlog", linthresh=linear)
    axes.set_ylim(bottom=min(2.0 * lowest, -0.5 * linear))
    axes.set(xlabel="excitation Λ with the rig's drag" if known else "drive's acceleration [rad/s²]")
    axes.set(ylabel="gap that opens in a period [µm]")
    axes.legend(frameon=False, fontsize="small")
    return figure
