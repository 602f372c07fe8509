"""Map of the regimes over excitation and dimensionless backlash, with an operating point."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gears3d import files
from gears3d.laws.cycle import border, regions

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.simulation.excitation import Assessment

COLOURS = ("#f0f0f0", "#9ecae1", "#fdae6b", "#bdbdbd")
"""Of contact, single-sided, double-sided, and no plastic orbit."""
NAMES = ("contact", "single-sided", "double-sided", "no plastic orbit")


def write_map(path: Path, found: Assessment, title: str = "") -> Path:
    """Draw the map of regimes for e = 0 into a file, under a temporary name that is renamed."""
    return files.write_picture(path, lambda: draw_map(found, title))


def draw_map(found: Assessment, title: str = "") -> Figure:
    """Return the map of regimes for e = 0: contact, single-sided and double-sided, with the operating point.

    Source: borders by Rigaud & Perret-Liaudet 2020, eqs (7), (17)-(19); axes by Kadmiri et al. 2012, eqs (23), (24).
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    point = operating_point(found)
    wide, tall = span(point)
    figure = Figure(figsize=(7.5, 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    codes = regions(wide, tall)
    norm = BoundaryNorm(np.arange(-0.5, 4.0), 4)
    axes.pcolormesh(wide, tall, codes.T, cmap=ListedColormap(COLOURS), norm=norm, shading="nearest", rasterized=True)
    above = wide[wide > 1.0]
    axes.plot(above, border(above), color="black", lw=1.2)
    axes.axvline(1.0, color="black", lw=1.2)
    handles = [Patch(color=colour, label=name) for colour, name in zip(COLOURS, NAMES, strict=True)]
    if point is not None:
        label = f"Λ = {point[0]:.3g}, j/H = {point[1]:.3g}"
        handles += axes.plot(*point, "o", color="#D55E00", mec="black", ms=9, label=label)
    axes.set(xscale="log", yscale="log", xlim=(wide[0], wide[-1]), ylim=(tall[0], tall[-1]))
    axes.set_xlabel("excitation Λ")
    axes.set_ylabel("dimensionless backlash j/H")
    axes.set_title(f"{title}\nregimes of perfectly plastic impacts (e = 0)".strip(), fontsize=10, loc="left")
    axes.legend(handles=handles, fontsize=8, loc="lower left", framealpha=0.9)
    return figure


def operating_point(found: Assessment) -> tuple[float, float] | None:
    """Return Λ and j/H of the strongest harmonic; ``None`` without a harmonic or without drag."""
    finite = [
        (wave.excitation, wave.backlash_dimensionless)
        for wave in found.harmonics
        if isfinite(wave.excitation) and isfinite(wave.backlash_dimensionless) and wave.excitation > 0.0
    ]
    return max(finite, default=None)


def span(point: tuple[float, float] | None, columns: int = 160, rows: int = 320) -> tuple[np.ndarray, np.ndarray]:
    """Return Λ and j/H of the map, equally spaced in logarithm, wide enough for the operating point.

    >>> wide, tall = span((0.05, 2.0))
    >>> bool(wide[0] < 0.05), bool(tall[-1] > 2.0)
    (True, True)
    """
    size, gap = point or (1.0, 0.1)
    wide = np.geomspace(min(0.3, size / 2), max(30.0, 2 * size), columns)
    tall = np.geomspace(min(1e-3, gap / 2), max(10.0, 2 * gap), rows)
    return wide, tall
