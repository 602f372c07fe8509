"""A threshold as a picture: how far the gap opens in each period, over the excitation, rising and falling."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.identification.law import Identified

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
            axes.plot(scale * curve["law_level_rad_s2"], 1e6 * curve["law_opening_m"], color=colour, linewidth=1)
        if (one := found.parameters.get(f"acceleration_{way}")) is not None:
            axes.axvline(scale * one.value, color=colour, linestyle="--", linewidth=1)
            axes.axvspan(scale * one.low, scale * one.high, color=colour, alpha=0.15)
    seen = [one["opening_seen_m"] for way in COLOURS if "opening_seen_m" in (one := found.goodness.get(way, {}))]
    axes.axhline(1e6 * max(seen), color="#777777", linewidth=1, linestyle=":", label="seen from here on")
    axes.set_yscale("symlog", linthresh=max(1e6 * max(seen), 0.1))
    axes.set(xlabel="excitation Λ with the rig's drag" if known else "drive's acceleration [rad/s²]")
    axes.set(ylabel="gap that opens in a period [µm]")
    axes.legend(frameon=False)
    return figure
