"""The mesh of a pair as one sheet: transverse section, backlash, plane of action and sliding."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gears3d import files
from gears3d.units import show
from gears3d.views.sheet.action import draw_plane_of_action, draw_sliding
from gears3d.views.sheet.section import draw_backlash, draw_section, micro

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.gears import Pair


def drawing(pair: Pair, title: str = "", speed: float = 0.0) -> Figure:
    """Draw the mesh of a pair with its active flanks in contact at the pitch point."""
    from dataclasses import replace

    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    pair = replace(pair, deviations=())
    figure = Figure(figsize=(14.0, 9.0), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(3, 2, width_ratios=[1.25, 1.0], height_ratios=[1.5, 0.8, 0.8])
    draw_section(figure.add_subplot(grid[:, 0]), pair)
    draw_backlash(figure.add_subplot(grid[0, 1]), pair)
    plane = figure.add_subplot(grid[1, 1])
    draw_plane_of_action(plane, pair)
    draw_sliding(figure.add_subplot(grid[2, 1], sharex=plane), pair, speed)
    figure.suptitle(f"{title}\n{_summary(pair)}" if title else _summary(pair), fontsize=11, x=0.01, ha="left")
    return figure


def _summary(pair: Pair) -> str:
    drive, loose = pair.drive, pair.loose
    helix = f", helix {show(drive.helix_angle, 'angle', 5)}" if drive.helix_angle else ", spur"
    return (
        f"{drive.teeth} / {loose.teeth} teeth, normal module {show(drive.module, 'length')}{helix}, "
        f"centre distance {show(pair.centre_distance, 'length')}, "
        f"α_wt {show(pair.working_pressure_angle, 'angle', 5)}, ε_α {pair.contact_ratio:.3f}"
        + (f", ε_β {pair.overlap_ratio:.3f}" if drive.helix_angle else "")
        + f", backlash {micro(pair.backlash)}"
    )


def write_drawing(path: Path, pair: Pair, title: str = "", speed: float = 0.0) -> Path:
    """Draw the mesh of a pair into a file, under a temporary name that is renamed."""
    return files.write_picture(path, lambda: drawing(pair, title, speed))
