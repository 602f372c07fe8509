"""The plane of action of a mesh with its contact lines, and the sliding along the path of contact."""

from __future__ import annotations

from math import pi, tan
from typing import TYPE_CHECKING

import numpy as np

from gears3d.gears.sheet import path_points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from gears3d.gears import Pair

ACTIVE, NEUTRAL = "#0072B2", "#777777"


def draw_plane_of_action(axes: Axes, pair: Pair) -> None:
    """Draw the zone of contact seen along its normal, with the lines on which teeth touch at θ = 0."""
    points = path_points(pair)
    width = min(pair.drive.face_width, pair.loose.face_width)
    slope, pitch = tan(pair.drive.base_helix_angle), pair.drive.base_pitch
    low, high = points["A"], points["E"]
    axes.fill_between([1e3 * low, 1e3 * high], -500 * width, 500 * width, color=ACTIVE, alpha=0.12, linewidth=0)
    reach = 0.5 * width * abs(slope)
    first, last = int(np.floor((low - reach) / pitch)), int(np.ceil((high + reach) / pitch))
    label = "contact lines"
    for k in range(first, last + 1):
        heights = np.linspace(-0.5 * width, 0.5 * width, 201)
        places = k * pitch + heights * slope
        inside = (places >= low - 1e-12) & (places <= high + 1e-12)
        if inside.any():
            axes.plot(1e3 * places[inside], 1e3 * heights[inside], color=ACTIVE, linewidth=2.0, label=label)
            label = "_"
    _marks(axes, pair)
    axes.set_ylim(-620 * width, 620 * width)
    axes.set_ylabel("z along the axis [mm]", fontsize=9)
    axes.tick_params(labelsize=8)
    title = "Plane of action: zone of contact and the lines on which teeth touch"
    axes.set_title(title, fontsize=10, loc="left")


def draw_sliding(axes: Axes, pair: Pair, speed: float) -> None:
    """Draw the sliding speed along the path of contact and how many pairs of teeth share it."""
    points = path_points(pair)
    ends = np.array([points["A"], points["E"]])
    relative = 1.0 + pair.drive.teeth / pair.loose.teeth
    radius = pair.drive.base_radius / np.cos(pair.working_pressure_angle)
    scale, unit = (1e3 * abs(speed), "sliding speed [mm/s]") if speed else (1.0 / radius, "sliding factor K_g")
    places = np.linspace(points["A"], points["E"], 201)
    axes.plot(1e3 * places, scale * relative * np.abs(places), color="black", linewidth=1.4)
    _marks(axes, pair)
    axes.set_ylim(0.0, 1.25 * scale * relative * float(np.max(np.abs(ends))))
    axes.set_xlabel("distance from the pitch point along the line of action [mm]", fontsize=9)
    axes.set_ylabel(unit, fontsize=9)
    axes.tick_params(labelsize=8)
    rpm = f" at {abs(speed) * 30 / pi:.4g} rpm of the drive" if speed else ""
    axes.set_title(f"Sliding between the flanks{rpm}", fontsize=10, loc="left")


def _marks(axes: Axes, pair: Pair) -> None:
    points = path_points(pair)
    for name in "ABCDE":
        axes.axvline(1e3 * points[name], color=NEUTRAL, linewidth=0.8, linestyle=":", zorder=0)
        axes.annotate(name, (1e3 * points[name], 1.0), (6, -10), xycoords=("data", "axes fraction"),
                      textcoords="offset points", ha="center", fontsize=8, color=NEUTRAL)  # fmt: skip
