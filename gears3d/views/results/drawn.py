"""Pictures of results whose packages draw none."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gears3d.diagnosis import Diagnosis

COLOURS = ("#777777", "#0072B2")
"""Of the rig as it is, and of the extended rig."""


def diagnosis_picture(found: Diagnosis) -> Figure:
    """Draw the held-out error of rig and extended rig, and the minimum detectable effects.

    Args:
        found: by the diagnosis.
    """
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
