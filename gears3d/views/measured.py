"""A measured record with its flanks and labels, and one flight close up."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gears3d import files
from gears3d.views.signals.drawing import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gears3d.measured.segmentation import Measurement, Segments

SHOWN = 20
"""Flights in the left picture."""
POINTS = 8000
"""Readings drawn at most."""
STATES = ((0, COLOURS[0], "active contact"), (1, COLOURS[1], "reverse contact"), (2, "#555555", "flight"))


def picture(found: Measurement) -> Figure:
    """Draw displacement, flanks and labels over some flights, and the highest of them close up."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    wide, close = figure.subplots(1, 2, width_ratios=(2, 1))
    cut = found.segments
    start, end = cut.flights["start_s"], cut.flights["end_s"]
    count = len(start)
    if not count:
        _path(wide, cut, float(cut.path.time[0]), float(cut.path.time[-1]))
        close.set_axis_off()
    else:
        first = max(count // 2 - SHOWN // 2, 0)
        last = min(first + SHOWN, count) - 1
        _path(wide, cut, float(start[first]), float(end[last]))
        one = first + int(np.argmax(cut.flights["height_m"][first : last + 1]))
        margin = 0.25 * float(end[one] - start[one])
        _path(close, cut, float(start[one]) - margin, float(end[one]) + margin)
        close.set_title(f"one flight, chi-square {cut.flights['chi2'][one]:.2g} per degree of freedom", fontsize=9)
    wide.legend(fontsize=8, frameon=False, ncols=5, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


def write_picture(path: Path, found: Measurement) -> Path:
    """Draw a measurement into a file."""
    return files.write_picture(path, lambda: picture(found))


def _path(axes: Axes, cut: Segments, begin: float, end: float) -> None:
    known, shift = cut.track, cut.flanks.active[0]
    some = np.flatnonzero((known.time >= begin) & (known.time <= end))
    some = some[:: max(len(some) // POINTS, 1)]
    time, state = known.time[some], cut.states(known.time[some])
    drive, loose, place = known.part(some)
    for code, colour, name in STATES:
        mine = state == code
        axes.plot(time[mine], 1e6 * (place[mine] - shift), ".", color=colour, markersize=2, label=name)
    low, high = cut.flanks.places(time, drive, loose)
    axes.plot(time, 1e6 * (low - shift), color=COLOURS[0], linewidth=0.8)
    if np.isfinite(high).all():
        axes.plot(time, 1e6 * (high - shift), color=COLOURS[1], linewidth=0.8)
    hits = cut.impacts["time_s"]
    for hit in hits[(hits >= begin) & (hits <= end)]:
        axes.axvline(hit, color="#bbbbbb", linewidth=0.6, zorder=0)
    axes.set(xlabel="time [s]", ylabel="displacement [µm]")
    axes.spines[["top", "right"]].set_visible(False)
