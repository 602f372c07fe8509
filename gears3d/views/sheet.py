"""The data sheet of a pair: its lines with their units, and the mesh as one drawing.

The drawing has the transverse section, the backlash drawn wider, the plane of action and the sliding.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import cos, hypot, pi, sin, tan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gears3d import palette
from gears3d.gears import Pair
from gears3d.gears.outline import outline
from gears3d.gears.sheet import Quantity, data_sheet, path_points
from gears3d.palette import ACTIVE, EDGE, NEUTRAL, REVERSE
from gears3d.results import Result
from gears3d.scenario import Scenario
from gears3d.units import FAMILIES, show
from gears3d.views.plots.section import widened, widening

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class DataSheet(Result):
    """The data sheet of a pair.

    Args:
        pair: the pair.
        quantities: its lines.
        speed: mean speed of the drive gear [rad/s].
        title: of the scenario.
        source: of the scenario.
    """

    pair: Pair
    quantities: tuple[Quantity, ...]
    speed: float = 0.0
    title: str = ""
    source: str = ""


def data_sheet_of(scenario: Scenario) -> DataSheet:
    """Return the data sheet of a scenario's pair, in the terms of ISO 21771."""
    pair, gears = scenario.pair(), scenario.gears
    quantities = data_sheet(pair, scenario.motion.mean, (gears.drive.density, gears.loose.density))
    return DataSheet(pair, tuple(quantities), scenario.motion.mean, scenario.title, scenario.source)


def rows(sheet: Iterable[Quantity], digits: int = 6) -> list[tuple[str, str, str, tuple[str, ...]]]:
    """Return a data sheet as people read it.

    >>> rows([Quantity("backlash", "normal backlash", "j_bn", "length", (0.00025,))])
    [('backlash', 'normal backlash', 'j_bn', ('250 um',))]
    """
    return [
        (line.group, line.name, line.symbol, tuple(_text(value, line.family, digits) for value in line.values))
        for line in sheet
    ]


def tables(sheet: Iterable[Quantity]) -> list[dict[str, Any]]:
    """Return a data sheet as JSON can hold it.

    >>> tables([Quantity("gears", "number of teeth", "z", "count", (17, 43))])[0]["loose"]
    43
    """
    found = []
    for line in sheet:
        table: dict[str, Any] = {
            "group": line.group,
            "name": line.name,
            "symbol": line.symbol,
            "unit": FAMILIES[line.family].si,
            "source": _source(line.source),
        }
        names = ("value",) if len(line.values) == 1 else ("drive", "loose")
        found.append(table | dict(zip(names, line.values, strict=True)))
    return found


def _source(source: str) -> str:
    return f"ISO 21771:2007 {source}" if source.startswith("(") else source


def _text(value: float | None, family: str, digits: int) -> str:
    return "none" if value is None else show(value, family, digits)


Array = NDArray[np.float64]
FACES = {"drive": palette.DRIVE, "loose": palette.LOOSE}


def drawing(pair: Pair, title: str = "", speed: float = 0.0) -> Figure:
    """Draw the mesh of a pair with its active flanks in contact at the pitch point."""
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


def posed(pair: Pair, which: str, chord: float) -> list[Array]:
    """Return the outline of each tooth in the plane at θ = 0, active flanks in contact at the pitch point."""
    points = outline(pair, which, chord).points
    turn = pair.rotation(which, 0.0)
    c, s = cos(turn), sin(turn)
    return list(points @ np.array([[c, s], [-s, c]]) + np.array(pair.centre(which)[:2]))


def normal(pair: Pair) -> Array:
    """Return the direction in which contact moves along the line of action of the active flanks, (2,)."""
    angle = pair.working_pressure_angle
    return np.array([sin(angle), cos(angle)])


def pitch_point(pair: Pair) -> Array:
    """Return the pitch point [m], (2,)."""
    return np.array([pair.drive.base_radius / cos(pair.working_pressure_angle), 0.0])


def micro(length: float) -> str:
    """Return a length with its unit as a drawing shows it.

    >>> micro(0.00025)
    '250 µm'
    """
    return show(length, "length", 5).replace("um", "µm")


def draw_section(axes: Axes, pair: Pair) -> None:
    """Draw teeth, circles, line of action, path of contact and contact points at true scale."""
    points, centre, along = path_points(pair), pitch_point(pair), normal(pair)
    pitch = pi * pair.drive.transverse_module
    reach = max(2.0 * pitch, 1.35 * max(points["E"], -points["A"]))
    _teeth(axes, pair, centre, reach)
    _circles(axes, pair, centre, reach)
    ends = [1e3 * (centre + along * points[name]) for name in ("T1", "T2")]
    axes.axline(tuple(ends[0]), tuple(ends[1]), color=ACTIVE, linewidth=0.8, linestyle=(0, (6, 3)), zorder=5)
    path = 1e3 * np.array([centre + along * points[name] for name in ("A", "E")])
    axes.plot(*path.T, color=ACTIVE, linewidth=2.6, zorder=6, label="path of contact A–E", solid_capstyle="butt")
    contacts = _contacts(pair)
    places = 1e3 * np.array([centre + along * each for each in contacts])
    axes.plot(*places.T, "o", color="white", markeredgecolor="black", markersize=6, zorder=8, label="teeth touch here")
    label_at = np.array([along[1], -along[0]])
    for name in "ABCDE":
        spot = 1e3 * (centre + along * points[name])
        axes.plot(*spot, "|" if name != "C" else "+", color="black", markersize=8, zorder=7)
        aside = 11 * label_at * (1 if name in "ACE" else -1)
        axes.annotate(name, tuple(spot), tuple(aside), textcoords="offset points",
                      ha="center", va="center", fontsize=9, zorder=9, bbox=_BACK)  # fmt: skip
    tangent = [1e3 * (centre + along * points[name]) for name in ("T1", "T2")]
    tangent = [spot for spot in tangent if np.max(np.abs(spot - 1e3 * centre)) < 1e3 * reach]
    if tangent:
        words = {"markersize": 4, "zorder": 7, "label": "line of action leaves a base circle"}
        axes.plot(*np.transpose(tangent), "s", color=ACTIVE, **words)
    _arrows(axes, pair, centre, reach)
    _window(axes, centre, reach)
    axes.legend(fontsize=8, loc="lower right", framealpha=0.9)
    axes.set(xlabel="along the line of centres [mm]", ylabel="across [mm]")
    axes.set_title("Transverse section, true scale, active flanks in contact at C", fontsize=10, loc="left")


_BACK = {"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 0.6}


def _teeth(axes: Axes, pair: Pair, centre: Array, reach: float) -> None:
    chord = 2e-4 * reach
    for which in ("drive", "loose"):
        ring = 1e3 * np.vstack(posed(pair, which, chord))
        axes.fill(*ring.T, facecolor=FACES[which], edgecolor=EDGE, linewidth=0.8, zorder=2)


def _circles(axes: Axes, pair: Pair, centre: Array, reach: float) -> None:
    cosine = cos(pair.working_pressure_angle)
    for which in ("drive", "loose"):
        gear, axis = pair.gear(which), pair.centre(which)[:2]
        side = 1.0 if which == "drive" else -1.0
        kinds = (
            ("base", gear.base_radius, ":", 0.62),
            ("pitch", gear.base_radius / cosine, "-.", 0.76),
            ("tip", gear.tip_radius, "-", 0.90),
        )
        for name, radius, style, height in kinds:
            angle = np.linspace(-0.5 * pi, 0.5 * pi, 721)
            x, y = axis[0] + side * radius * np.cos(angle), radius * np.sin(angle)
            axes.plot(1e3 * x, 1e3 * y, color=NEUTRAL, linewidth=0.7, linestyle=style, zorder=4)
            up = height * reach * (1.0 if which == "drive" else -1.0)
            if abs(up) < radius:
                across = axis[0] + side * (radius * radius - up * up) ** 0.5
                if abs(across - centre[0]) < 0.93 * reach:
                    axes.text(1e3 * across, 1e3 * up, f"{name} {which}", fontsize=7, color=EDGE, ha="center",
                              va="center", rotation=-side * 12, zorder=9, bbox=_BACK)  # fmt: skip


def _contacts(pair: Pair) -> list[float]:
    """Places along the path of contact where teeth touch in the middle plane [m from the pitch point]."""
    points, pitch = path_points(pair), pair.drive.base_pitch
    return [k * pitch for k in range(-4, 5) if points["A"] - 1e-12 <= k * pitch <= points["E"] + 1e-12]


def _arrows(axes: Axes, pair: Pair, centre: Array, reach: float) -> None:
    """Arrows for the sense of rotation, drive and loose gear both moving up at the pitch point."""
    for which, side in (("drive", -1.0), ("loose", 1.0)):
        x = 1e3 * (centre[0] + side * 0.84 * reach)
        axes.annotate("", (x, 1e3 * 0.2 * reach), (x, -1e3 * 0.2 * reach), zorder=9,
                      arrowprops={"arrowstyle": "-|>", "color": EDGE, "linewidth": 1.4})  # fmt: skip
        axes.text(x, -1e3 * 0.27 * reach, which, ha="center", va="center", fontsize=9, zorder=9, bbox=_BACK)


def _window(axes: Axes, centre: Array, reach: float) -> None:
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(1e3 * (centre[0] - reach), 1e3 * (centre[0] + reach))
    axes.set_ylim(-1.25e3 * reach, 1.25e3 * reach)
    axes.tick_params(labelsize=8)


def draw_backlash(axes: Axes, pair: Pair) -> None:
    """Draw one tooth in its space with the backlash widened, and dimension it."""
    factor = widening(pair)
    wide = widened(pair, factor)
    centre, along = pitch_point(wide), normal(wide)
    pitch = pi * wide.drive.transverse_module
    reach = 0.7 * pitch
    gap, spot = wide.backlash, _reverse_contact(wide)
    axis = np.array([along[0], -along[1]])
    middle = np.array([centre[0], 0.35 * (spot[1] + 0.0)])
    for which in ("drive", "loose"):
        ring = 1e3 * np.vstack(posed(wide, which, 2e-4 * reach))
        axes.fill(*ring.T, facecolor=FACES[which], edgecolor=EDGE, linewidth=0.8, zorder=2)
    axes.plot(*(1e3 * centre), "o", color="white", markeredgecolor=ACTIVE, markeredgewidth=1.6, markersize=7, zorder=6)
    ends = [1e3 * (spot + sign * 0.5 * gap * axis) for sign in (-1.0, 1.0)]
    axes.axline(tuple(1e3 * spot), tuple(1e3 * (spot + 1e-3 * axis)), color=REVERSE, linewidth=0.8,
                linestyle=(0, (6, 3)), zorder=4)  # fmt: skip
    axes.annotate("", tuple(ends[0]), tuple(ends[1]), zorder=7,
                  arrowprops={"arrowstyle": "<|-|>", "color": REVERSE, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0,
                              "mutation_scale": 9})  # fmt: skip
    text = f"j_bt = {micro(pair.backlash)}\nj_bn = {micro(pair.normal_backlash)}"
    axes.annotate(text, tuple(1e3 * spot), (0.015, -40), textcoords=("axes fraction", "offset points"), fontsize=9,
                  color=REVERSE, zorder=9, ha="left", va="center", bbox=_BACK,
                  arrowprops={"arrowstyle": "-", "color": REVERSE, "linewidth": 0.8})  # fmt: skip
    axes.annotate("active flanks touch", tuple(1e3 * centre), (18, 30), textcoords="offset points", fontsize=9,
                  color=ACTIVE, zorder=9, bbox=_BACK,
                  arrowprops={"arrowstyle": "-", "color": ACTIVE, "linewidth": 0.8})  # fmt: skip
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(1e3 * (middle[0] - 1.3 * reach), 1e3 * (middle[0] + 1.3 * reach))
    axes.set_ylim(1e3 * (middle[1] - reach), 1e3 * (middle[1] + reach))
    axes.set(xticks=[], yticks=[])
    scale = f"drawn {factor:g} times as wide, by thinner teeth" if factor > 1 else "at true scale"
    axes.set_title(f"Backlash {scale}", fontsize=10, loc="left")


def _reverse_contact(pair: Pair) -> Array:
    """Return the middle of the reverse gap nearest the pitch point, between flanks that face each other [m], (2,)."""
    from gears3d.gears import candidates, compile_pair, flank_gap

    flanks = compile_pair(pair)
    found = [flank_gap(flanks, 0.0, 0.0, i, j, 1) for i, j in candidates(flanks, 0.0, 0.0, 1)]
    centre = pitch_point(pair)
    best = min(found, key=lambda gap: hypot(gap[3] - centre[0], gap[4] - centre[1]) if gap[7] else float("inf"))
    return np.array([best[3], best[4]])


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
