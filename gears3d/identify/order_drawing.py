"""Flanks from contact as a picture: their place over a turn, and the spectrum of their orders."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.identify.law import Identified

COLOURS = {"active": "#0072B2", "reverse": "#D55E00"}
GREY = "#999999"


def orders_picture(found: Identified) -> Figure:
    """Draw both flanks over the drive's angle, each about its mean, and their spectra with intervals and noise floor.

    Args:
        found: what ``identify_transmission_error`` or ``identify_backlash`` gave.

    Returns:
        A figure that belongs to no window.
    """
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
        axis.plot(own["frequency"], 1e6 * own["seen"], ".", color=GREY, markersize=3, label="all orders looked at")
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
