"""Draws docs/pictures/backlash.png: which backlash is which, and the signs of s, phi and b.

python tools/docs_backlash.py
"""

from __future__ import annotations

from math import acos, cos, pi, radians, sin, tan
from pathlib import Path
from typing import Any

import numpy as np
from docs_drawing import BLUE, GREEN, GREY, ORANGE, PURPLE
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from gears3d.gears import Gear, Pair, inv

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "backlash.png"
PAIR = Pair.from_both(Gear(1.0, 18), Gear(1.0, 24), 21.05, 0.5)
"""Module 1 and a backlash that can be seen."""
LABEL = {"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.85}
THIN = 0.5 * PAIR.thinning
"""Taken off each flank along the base circle."""
ALPHA = acos((PAIR.drive.base_radius + PAIR.loose.base_radius) / PAIR.centre_distance)


def outline(gear: Gear, middle: float) -> tuple[Any, Any]:
    """Return the outline of five teeth about the one in the middle, angles clockwise from above."""
    radius = np.linspace(max(gear.base_radius, gear.root_radius), gear.tip_radius, 40)
    pressure = np.arccos(gear.base_radius / radius)
    half = gear.base_half_angle - THIN / gear.base_radius - (np.tan(pressure) - pressure)
    angle, far = [], []
    for tooth in range(-2, 3):
        centre = middle + 2.0 * pi * tooth / gear.teeth
        angle += [centre - half[0], *(centre - half), *(centre + half[::-1]), centre + half[0]]
        far += [gear.root_radius, *radius, *radius[::-1], gear.root_radius]
    return np.array(far) * np.sin(angle), np.array(far) * np.cos(angle)


def half_at_pitch(gear: Gear) -> float:
    """Return the half angle of a tooth at the working pitch circle."""
    return gear.base_half_angle - THIN / gear.base_radius - inv(ALPHA)


def arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], colour: str, both: bool = True) -> None:
    """Draw a dimension line."""
    style = {"arrowstyle": "<->" if both else "->", "color": colour, "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=style)


def section(axes: Axes) -> None:
    """Draw the transverse section: working flanks in contact, the gap between the non-working ones."""
    drive, loose, distance = PAIR.drive, PAIR.loose, PAIR.centre_distance
    turn = half_at_pitch(drive)
    x, y = outline(drive, turn)
    axes.fill(np.append(x, 0), np.append(y, 0), color=BLUE, alpha=0.22, lw=0)
    axes.plot(x, y, color=BLUE)
    x, y = outline(loose, half_at_pitch(loose))
    axes.fill(np.append(-x, 0), np.append(distance - y, distance), color=ORANGE, alpha=0.22, lw=0)
    axes.plot(-x, distance - y, color=ORANGE)
    across = np.linspace(-0.6, 0.6, 90)
    for gear, colour in ((drive, BLUE), (loose, ORANGE)):
        up = gear.base_radius * np.cos(across)
        pitch = gear.base_radius / cos(ALPHA)
        axes.plot(gear.base_radius * np.sin(across), up if gear is drive else distance - up, ":", color=colour, lw=1)
        up = pitch * np.cos(across)
        axes.plot(pitch * np.sin(across), up if gear is drive else distance - up, "-.", color=colour, lw=0.8)
    for side in (1.0, -1.0):
        below = (side * drive.base_radius * sin(ALPHA), drive.base_radius * cos(ALPHA))
        above = (-side * loose.base_radius * sin(ALPHA), distance - loose.base_radius * cos(ALPHA))
        axes.plot(*zip(below, above, strict=True), "-" if side > 0 else "--", color="k", lw=1)
    pitch = drive.base_radius / cos(ALPHA)
    axes.plot(0, pitch, "o", color="k", ms=5)
    axes.annotate(
        "working flanks\nin contact, s = 0", (0, pitch), (-3.6, pitch + 1.9), bbox=LABEL, arrowprops={"arrowstyle": "-"}
    )
    first = (-drive.base_radius * sin(ALPHA), drive.base_radius * cos(ALPHA))
    start = drive.base_radius * (2.0 * turn + tan(ALPHA))
    points = [
        (first[0] + along * cos(ALPHA), first[1] + along * sin(ALPHA)) for along in (start, start + PAIR.backlash)
    ]
    arrow(axes, points[0], points[1], PURPLE)
    axes.annotate(
        "j_bt = b\n(dead band)",
        points[1],
        (2.0, points[1][1] + 1.4),
        color=PURPLE,
        bbox=LABEL,
        arrowprops={"arrowstyle": "-", "color": PURPLE},
    )
    axes.annotate(
        "line of action of\nthe working flanks",
        (2.2, pitch - 2.2 * tan(ALPHA)),
        (2.3, pitch - 2.7),
        bbox=LABEL,
        fontsize=8,
        arrowprops={"arrowstyle": "-"},
    )
    for height, words, colour, way in (
        (pitch - 3.6, "driving gear", BLUE, -1),
        (pitch + 3.6, "idle gear", ORANGE, -1),
    ):
        arrow(axes, (-0.9, height), (-0.9 + way * 1.8, height), colour, both=False)
        axes.text(-0.7, height, f"{words}, θ > 0", color=colour, va="center", fontsize=9)
    axes.set(xlim=(-5, 5), ylim=(pitch - 4, pitch + 4.2), aspect="equal", title="Transverse section")
    axes.axis("off")


def directions(axes: Axes) -> None:
    """Draw the plane of action of a helical pair: transverse and normal backlash."""
    lean = tan(radians(25.0))
    for start, colour, words in ((0.0, BLUE, "driving"), (2.0, ORANGE, "idle")):
        axes.plot([start, start + 4 * lean], [0, 4], color=colour, lw=2.5)
        axes.text(start - 0.1, -0.35, words, color=colour, ha="center", fontsize=9)
    arrow(axes, (3.2 * lean, 3.2), (3.2 * lean + 2.0, 3.2), PURPLE)
    axes.text(3.2 * lean + 1.0, 3.35, "j_bt", color=PURPLE, ha="center")
    slant = radians(25.0)
    foot = (1.2 * lean, 1.2)
    gap = 2.0 * cos(slant)
    arrow(axes, foot, (foot[0] + gap * cos(slant), foot[1] - gap * sin(slant)), GREEN)
    axes.text(1.5, 1.0, "j_bn", color=GREEN)
    axes.plot([0, 0], [0, 3.2], ":", color=GREY)
    axes.text(0.12, 2.2, "β_b", color="0.3")
    axes.text(2.0, -1.25, "j_bn = j_bt · cos β_b", ha="center", color=GREEN)
    axes.text(2.0, -1.75, "j_wt = j_bt / cos α_wt    (working pitch circle)", ha="center", fontsize=9)
    axes.text(2.0, -2.2, "j_t = j_bt / cos α_t    (reference circle)", ha="center", fontsize=9)
    axes.text(2.0, -2.65, "j_φ = j_bt / r_b    (angle of a gear, the mate held)", ha="center", fontsize=9)
    axes.set(xlim=(-1.6, 5.6), ylim=(-3, 4.3), aspect="equal", title="Plane of action, helical pair")
    axes.axis("off")


def signs(axes: Axes) -> None:
    """Draw the axis of the displacement with both flanks and a transmission error."""
    for place, words, colour, side in ((0.0, "working\nflank", BLUE, -1), (4.0, "non-working\nflank", ORANGE, 1)):
        axes.fill_betweenx([0, 2], place, place + side * 0.9, color=colour, alpha=0.3)
        axes.plot([place, place], [0, 2], color=colour, lw=2)
        axes.text(place + side * 0.45, 2.15, words, color=colour, ha="center", fontsize=9)
        axes.plot([place + 0.5, place + 0.5], [0, 2], "--", color=colour, lw=1)
    axes.fill_between([1.7, 2.3], 0.7, 1.3, color="0.4")
    axes.text(2.0, 1.45, "idle gear at s", ha="center", fontsize=9)
    arrow(axes, (0.0, 0.4), (0.5, 0.4), GREEN, both=False)
    axes.text(0.6, 0.3, "φ > 0", color=GREEN, fontsize=9)
    arrow(axes, (0.0, -0.35), (4.0, -0.35), PURPLE)
    axes.text(2.0, -0.75, "b = j_bt", color=PURPLE, ha="center")
    arrow(axes, (-1.2, -1.1), (5.4, -1.1), "k", both=False)
    axes.text(5.4, -1.5, "s", ha="center")
    for place, words in ((0.0, "s = 0"), (4.0, "s = b")):
        axes.text(place, -1.5, words, ha="center", fontsize=9)
    axes.text(2.1, -2.2, "s = r_b2·θ_idle − r_b1·θ_drive", ha="center")
    axes.text(2.1, -2.65, "contact: s = φ (working), s = φ + b (non-working)", ha="center", fontsize=9)
    axes.set(xlim=(-1.4, 5.8), ylim=(-3, 3), aspect="equal", title="Displacement and its signs")
    axes.axis("off")


def main() -> None:
    """Draw the three parts and write the picture."""
    figure = Figure(figsize=(9.2, 8.2), layout="constrained")
    FigureCanvasAgg(figure)
    places = figure.subplot_mosaic([["left", "right"], ["below", "below"]], height_ratios=[1.25, 1.0])
    for axes, part in zip(places.values(), (section, directions, signs), strict=True):
        part(axes)
    figure.savefig(PICTURE, dpi=110)
    print(PICTURE)


if __name__ == "__main__":
    main()
