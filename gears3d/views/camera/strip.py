"""The strip: pictures of the mesh over a period, and under them where the loose gear was between the flanks."""

from __future__ import annotations

from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gears3d import files
from gears3d.views.camera.shots import moment, told
from gears3d.views.plots.panel import WORDS, Shot, colour_of, name, paint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gears3d.views.camera.subject import Subject
    from gears3d.views.plots.panel import Look

POINTS = 2000
"""Of the curve of the displacement."""
MODELS = {
    "bullet": "rigid bodies in PyBullet",
    "rigid": "rigid model, one degree of freedom",
    "plastic": "plastic impacts in closed form",
    "lubricated": "lubricated model",
}
"""Models in words."""
MM = 1e3
UM = 1e6


def columns(count: int) -> int:
    """Return the number of pictures per row.

    >>> [columns(count) for count in (1, 5, 8, 9, 10, 16)]
    [1, 5, 4, 3, 5, 4]
    """
    if count <= 3:
        return count
    tried = range(3, min(count, 6) + 1)
    return min(tried, key=lambda wide: (-count % wide, abs(wide * 1.25 - 1.6 * ceil(count / wide))))


def strip(subject: Subject, look: Look, shots: tuple[Shot, ...], periods: float | None = 1.0) -> Figure:
    """Draw the strip."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    wide = columns(len(shots))
    high = ceil(len(shots) / wide)
    figure = Figure(figsize=(max(3.3 * wide, 7.0), 3.0 * high + 2.6), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(high + 1, wide, height_ratios=[1.0] * high + [0.55])
    for index, shot in enumerate(shots):
        axes = figure.add_subplot(grid[index // wide, index % wide])
        paint(axes, look, shot)
        if index == 0:
            name(axes, look)
        when = moment(shot, index, len(shots), periods)
        axes.set_title(f"{when}  ({told(shot.pairs)})", loc="left", fontsize=10, fontweight="bold")
        axes.set_title(WORDS[shot.flank], loc="right", fontsize=9, color=_ink(shot.flank))
    _course(figure.add_subplot(grid[high, :]), subject, shots)
    figure.suptitle(_head(subject, shots), fontsize=11, x=0.01, ha="left")
    figure.supxlabel(_foot(subject, look), fontsize=8, x=0.01, ha="left", color="#444444")
    return figure


def write_strip(
    path: str | Path, subject: Subject, look: Look, shots: tuple[Shot, ...], periods: float | None = 1.0
) -> Path:
    """Draw the strip into a file."""
    return files.write_picture(path, lambda: strip(subject, look, shots, periods))


def _ink(flank: int) -> str:
    return "#666666" if flank < 0 else colour_of(flank)


def _course(axes: Axes, subject: Subject, shots: tuple[Shot, ...]) -> None:
    """Draw the gap over time in the colours of the states, with a line for each picture."""
    time = np.linspace(shots[0].time, shots[-1].time, POINTS)
    active, reverse = subject.gaps(time)
    flank, after = subject.flank(time), MM * (time - time[0])
    for code in (0, 1, -1):
        mine = np.where(flank == code, UM * active, np.nan)
        axes.plot(after, mine, color=_ink(code), linewidth=2.4 if code >= 0 else 1.4, solid_capstyle="butt")
    axes.plot(after, np.zeros(len(time)), color=colour_of(0), linewidth=0.8, zorder=1)
    axes.plot(after, UM * (active + reverse), color=colour_of(1), linewidth=0.8, zorder=1)
    for shot in shots:
        axes.axvline(MM * shot.after, color="#bbbbbb", linewidth=0.7, zorder=0)
        axes.plot(MM * shot.after, UM * shot.gaps[0], "o", color="white", markeredgecolor=_ink(shot.flank), zorder=5)
    axes.set(xlabel="time after the first picture [ms]", ylabel="gap at the\nactive flanks [µm]")
    axes.margins(x=0.01)
    axes.spines[["top", "right"]].set_visible(False)


def source(subject: Subject) -> str:
    """Return where the motion comes from, for people."""
    model = str(subject.motion.recording.meta.get("model") or "")
    return MODELS.get(model, model or "recording")


def _head(subject: Subject, shots: tuple[Shot, ...]) -> str:
    return f"{subject.title or 'Gears in mesh'}\n{source(subject)}, from {shots[0].time:.6g} s on"


def _foot(subject: Subject, look: Look) -> str:
    scale = "at true scale"
    if look.factor != 1.0:
        scale = f"drawn {look.factor:g} times as wide as it is, by thinner teeth; all else at true scale"
    numbers = "the teeth of each gear" if look.teeth else "tooth pairs, counted from the first picture"
    lines = [
        f"Gap of {UM * subject.pair.backlash:.4g} µm {scale}.",
        f"Numbers: {numbers}; in brackets the pairs at the pitch point, two where it lies between both.",
    ]
    if look.zoom == "gears":
        lines[1] = "In brackets: the tooth pairs at the pitch point, counted from the first picture."
    if not look.backlit:
        lines.append("Blue: active flanks touch. Orange: reverse flanks touch. Grey: free flight, bars are the gaps.")
    if not subject.placed:
        lines.append("Tooth positions are not recorded: drawn with tooth 1 at the pitch point at the beginning.")
    if subject.pair.drive.helix_angle:
        lines.append("Helical teeth: section in the middle of the face.")
    return "\n".join(lines)
