"""What the pictures of laws and effects on the documentation site have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "0.6"
"""Told apart by colour-blind eyes too; the first two are everywhere those of the active and the reverse flank."""
MARKS = ("-", "--", "-.", ":")
"""So that lines are told apart without their colours."""
POINTS = 400


class Plot(NamedTuple):
    """Lines of a law over one of its arguments.

    Args:
        x: label of the abscissa, with unit.
        y: label of the ordinate, with unit.
        lines: abscissae and ordinates, (n,) each, by their place in the legend.
        log: axes that are logarithmic: "", "x", "y" or "xy".
        dots: whether points stand alone.
    """

    x: str
    y: str
    lines: Mapping[str, tuple[Any, Any]]
    log: str = ""
    dots: bool = False


def over(
    x: str,
    span: tuple[float, float],
    y: str,
    laws: Mapping[str, Callable[[float], Any]],
    log: str = "",
    units: tuple[float, float] = (1.0, 1.0),
) -> Plot:
    """Return a law over one argument, called once a point.

    Args:
        x: label of the abscissa, with unit.
        span: the argument's smallest and largest value, SI.
        y: label of the ordinate, with unit.
        laws: of one argument, by their place in the legend.
        log: as in :class:`Plot`; points are even on that axis.
        units: of abscissa and ordinate as they are shown, in SI.
    """
    at = np.geomspace(*span, POINTS) if "x" in log else np.linspace(*span, POINTS)
    lines = {name: (at / units[0], np.array([float(law(one)) for one in at]) / units[1]) for name, law in laws.items()}
    return Plot(x, y, lines, log)


def draw(plot: Plot) -> Figure:
    """Return the picture of a law."""
    figure = canvas(5.6, 3.0)
    axes = figure.subplots()
    axes.set(xlabel=plot.x, ylabel=plot.y)
    for k, (name, (x, y)) in enumerate(plot.lines.items()):
        colour = (BLUE, ORANGE, GREEN, PURPLE)[k % 4]
        style = (
            {"linestyle": "", "marker": "os^v"[k % 4], "markersize": 3} if plot.dots else {"linestyle": MARKS[k % 4]}
        )
        axes.plot(x, y, color=colour, label=name, **style)
    if "x" in plot.log:
        axes.set_xscale("log")
    if "y" in plot.log:
        axes.set_yscale("log")
    legend(axes)
    return figure


def canvas(width: float, height: float) -> Figure:
    """Return an empty figure that belongs to no window; inches."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def legend(axes: Axes) -> None:
    """Name the lines above the field, where there are names, and take away what no one needs."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)
    names = [name for name in axes.get_legend_handles_labels()[1] if name]
    if names:
        axes.legend(fontsize=8, frameon=False, ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0))


def save(figure: Figure, path: Path) -> None:
    """Write a picture."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
