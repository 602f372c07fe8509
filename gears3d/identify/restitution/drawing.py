"""An identified law of restitution as a picture: rebound over approach, and their ratio with the law's band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.identify.law import Identified

COLOURS = {"active": "#0072B2", "reverse": "#D55E00"}


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
    colour, milli = COLOURS[name], 1e3
    approach, rebound = one["approach_m_s"], one["rebound_m_s"]
    bars = {"fmt": ".", "color": colour, "markersize": 3, "elinewidth": 0.5, "alpha": 0.6}
    upper.errorbar(
        milli * approach,
        milli * rebound,
        milli * one["rebound_sigma_m_s"],
        milli * one["approach_sigma_m_s"],
        label=f"{name} flank",
        **bars,
    )
    ratio = rebound / approach
    noise = np.hypot(one["rebound_sigma_m_s"], ratio * one["approach_sigma_m_s"]) / approach
    lower.errorbar(milli * approach, ratio, noise, **bars)
    speed, mean = one["speed_m_s"], one["mean"]
    line = {"color": colour, "linewidth": 1, "linestyle": "-" if name == "active" else "--"}  # both may be one law
    upper.plot(milli * speed, milli * speed * np.clip(mean, 0.0, 1.0), **line)
    below = f"{name}: rebounds below are not used"
    upper.axhline(milli * one["lowest_m_s"], color=colour, linewidth=0.7, linestyle=":", label=below)
    lower.plot(milli * speed, mean, label=f"{name}: law and 95 %", **line)
    lower.fill_between(milli * speed, one["low"], one["high"], color=colour, alpha=0.3, linewidth=0)
    if deviation > 0.0:
        lower.fill_between(
            milli * speed, mean - 1.96 * deviation, mean + 1.96 * deviation, color=colour, alpha=0.1, linewidth=0
        )
    moving = speed > 0.0
    lower.plot(milli * speed[moving], one["lowest_m_s"] / speed[moving], color=colour, linewidth=0.7, linestyle=":")
