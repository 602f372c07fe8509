"""Pictures of results whose packages draw none."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gears3d.comparison import ModelVerdict
    from gears3d.diagnosis import Diagnosis

COLOURS = ("#777777", "#0072B2")
"""Of the rig as it is, and of the extended rig."""

PERIODS_SHOWN = 3.0
LEAST_SHOWN, MOST_SHOWN = 1e-3, 100.0
"""Times its tolerance from which and up to which a difference is drawn where it is."""


def verdict_picture(found: ModelVerdict) -> Figure:
    """Draw the displacement of a user's model and of the rigid model, and the differences over their tolerances."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    path, bars = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    lasts = PERIODS_SHOWN * float(found.tested.meta.get("period_s") or found.tested.time[-1] / 4.0)
    for one, name, colour, wide in (
        (found.reference, "rigid model", "#bbbbbb", 3.5),
        (found.tested, "model", "#0072B2", 1.0),
    ):
        shown = one.between(0.0, float(one.time[0]) + lasts)
        path.plot(shown.time, 1e6 * shown.signals["displacement_m"], color=colour, linewidth=wide, label=name)
    path.set(xlabel="time [s]", ylabel="displacement [µm]")
    path.legend(frameon=False, fontsize=8, ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    known = [one for one in found.findings if one.difference is not None]
    sizes = [min(abs(one.difference or 0.0) / one.tolerance, MOST_SHOWN) for one in known]
    colours = ["#D55E00" if one.deviates else COLOURS[1] for one in known]
    bars.scatter([max(size, LEAST_SHOWN) for size in sizes], [one.quantity for one in known], color=colours)
    bars.axvline(1.0, color="k", linewidth=0.8, linestyle="--")
    bars.set(xscale="log", xlim=(0.5 * LEAST_SHOWN, 2.0 * MOST_SHOWN), xlabel="difference / tolerance")
    bars.tick_params(axis="y", labelsize=8)
    bars.invert_yaxis()
    figure.suptitle(found.sentence, fontsize=10, wrap=True)
    return figure


def diagnosis_picture(found: Diagnosis) -> Figure:
    """Draw the held-out error of rig and extended rig, and the minimum detectable effects."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    held, limits = figure.subplots(1, 2)
    _held(held, found)
    places = [(place, limit) for place, limit in found.power.items() if isfinite(limit)]
    limits.barh([place for place, _ in places], [100.0 * limit for _, limit in places], color=COLOURS[1])
    limits.set(xlabel="minimum detectable effect [% of what it acts on]")
    if not places:
        _nothing(limits, "no minimum detectable effect")
    kinds = " + ".join(cause.kind for cause in found.causes)
    figure.suptitle(": ".join(part for part in (found.verdict.replace("_", " "), kinds) if part))
    return figure


def _held(axes: Axes, found: Diagnosis) -> None:
    if not found.held:
        return _nothing(axes, "no cause, hence no held-out error")
    at = np.arange(len(found.held))
    for shift, name, key, colour in ((-0.2, "rig", "base", COLOURS[0]), (0.2, "extended rig", "extended", COLOURS[1])):
        excess: list[Any] = [max(getattr(one, key) / one.noise, 1e-3) for one in found.held]
        axes.barh(at + shift, excess, height=0.36, color=colour, label=name)
    axes.axvline(1.0, color="k", linewidth=0.8, linestyle="--", label="noise")
    axes.set(xscale="log", xlabel="held-out mean squared error / noise", yticks=at)
    axes.set_yticklabels([", ".join(one.held)[-28:] for one in found.held], fontsize=8)
    axes.legend(frameon=False, fontsize=8)
    return None


def _nothing(axes: Axes, text: str) -> None:
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color="#777777")
    axes.set_axis_off()
