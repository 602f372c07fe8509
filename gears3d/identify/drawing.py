"""An identified drag law as a picture: the torque over the speed, and what the law leaves over."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.identify.law import Identified

LINE, BAND, POINTS = "#0072B2", "#9ecae1", "#777777"
PARTS = ("#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MOST = 4
"""Parameters that a title holds."""


def rundown_picture(found: Identified) -> Figure:
    """Draw torque over speed with its 95 % band, and the residual of the angle over time.

    Args:
        found: what ``identify_rundown`` gave.

    Returns:
        A figure that belongs to no window.
    """
    from math import pi

    from matplotlib.figure import Figure

    curves = found.curves
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    upper, lower = figure.subplots(2, 1)
    rpm = curves["speed_rad_s"] * 30.0 / pi
    upper.fill_between(rpm, curves["low_N_m"], curves["high_N_m"], color=BAND, label="95 %")
    upper.plot(rpm, curves["torque_N_m"], color=LINE, label=found.law)
    for colour, (name, part) in zip(cycle(PARTS), curves["parts"].items(), strict=False):
        upper.plot(rpm, part["torque_N_m"], color=colour, linestyle="--", linewidth=1, label=name)
        upper.fill_between(rpm, part["low_N_m"], part["high_N_m"], color=colour, alpha=0.2)
    upper.set(xlabel="speed [rpm]", ylabel="drag torque [N·m]", title=_title(found))
    upper.set_ylim(0.0, 1.1 * float(max(curves["high_N_m"].max(), curves["torque_N_m"].max())))
    upper.legend(frameon=False)
    for time, rest in curves["residuals"]:
        lower.plot(time, rest * 1e6, ".", color=POINTS, markersize=2)
    lower.axhline(0.0, color=LINE, linewidth=1)
    lower.set(xlabel="time since the release [s]", ylabel="measured − law [µrad]")
    return figure


def _title(found: Identified) -> str:
    if len(found.parameters) > MOST:
        return found.law
    parts = [
        f"{name} {p.value:.4g} ± {0.5 * (p.high - p.low):.1g} {p.unit}".rstrip() for name, p in found.parameters.items()
    ]
    return ", ".join(parts)
