"""Charts as data for the page's one plotting library, built directly or read off a matplotlib figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d import palette
from gears3d.views.pages.traces import knots

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOOKS = {colour.lower(): name for colour, name in {
    palette.ACTIVE: "active", palette.REVERSE: "reverse", palette.EXTENDED: "extended", palette.TWIN: "twin",
    palette.NEUTRAL: "flight", palette.FLIGHT: "flight", palette.BAND: "active", palette.SOFT: "soft",
    palette.INK: "run", "#000000": "run", "#bbbbbb": "rule",
}.items()}  # fmt: skip
"""Names of colours in the style sheet, which has them for light and dark."""
MOST = 3000
"""Points of a series."""
SCALES = {"linear": 1, "log": 3, "symlog": 4}
"""Distributions of an axis, as the plotting library numbers them."""


def series(kind: str, label: str, look: str, x: Any, y: Any, **more: Any) -> dict[str, Any]:
    """Return points of one kind: ``dots``, ``marks``, ``line``, or ``band`` with ``low`` for its lower edge."""
    columns = {"x": x, "y": y, **{key: more.pop(key) for key in ("low", "tall", "wide") if more.get(key) is not None}}
    known = np.isfinite(np.stack([np.asarray(one, float) for one in columns.values()])).all(axis=0)
    columns = {key: np.asarray(one, float)[known] for key, one in columns.items()}
    count = len(columns["x"])
    if count > MOST:
        kept = _kept(columns, kind)
        columns = {key: one[kept] for key, one in columns.items()}
    told = {key: [float(f"{value:.7g}") for value in one] for key, one in columns.items()}
    return {"kind": kind, "label": label, "look": look, **told, **more}


def _kept(columns: dict[str, np.ndarray], kind: str) -> np.ndarray:
    x, y = columns["x"], columns["y"]
    if kind == "line" and np.all(np.diff(x) > 0.0):
        at, tolerance = np.array([0, len(x) - 1]), 5e-4 * max(float(np.ptp(y)), 1e-30)
        while len(found := knots(x, y[None] / tolerance, at, 1.0, MOST)) > MOST:
            tolerance *= 2.0
        return found
    return np.unique(np.linspace(0, len(x) - 1, MOST).astype(int))


def charts_of(figure: Figure) -> dict[str, dict[str, Any]] | None:
    """Return the axes of a figure as charts by name; ``None`` if one has more than lines, points and bands."""
    found = {}
    for number, axes in enumerate(figure.axes):
        if not axes.axison:
            continue
        if (made := _chart(axes)) is None:
            return None
        found[f"chart{number}"] = made
    return found or None


def _chart(axes: Axes) -> dict[str, Any] | None:
    from matplotlib.collections import PathCollection, PolyCollection
    from matplotlib.container import ErrorbarContainer
    from matplotlib.patches import Rectangle

    bars = [one for one in axes.containers if isinstance(one, ErrorbarContainer)]
    parts = {id(part) for one in bars for part in (one[0], *one[1], *one[2])}
    others = [one for one in (*axes.collections, *axes.patches) if id(one) not in parts]
    allowed = (PathCollection, PolyCollection, Rectangle)
    if axes.images or any(not isinstance(one, allowed) or type(one).__name__ == "QuadMesh" for one in others):
        return None
    if axes.texts or len(bars) < len(axes.containers) or axes.xaxis.have_units() or axes.yaxis.have_units():
        return None
    if {axes.get_xscale(), axes.get_yscale()} - SCALES.keys():
        return None
    limits = axes.get_xlim(), axes.get_ylim()
    sets = [made for one in others if (made := _area(one, limits)) is not None]
    sets += [_errors(one) for one in bars]
    sets += [_line(one, axes, limits) for one in axes.lines if id(one) not in parts]
    across = axes.get_subplotspec()
    title = axes.get_title() or axes.get_title(loc="left") or ("" if across is None else _heading(axes))
    x, y = axes.get_xlabel() or _shared_label(axes), axes.get_ylabel()
    return {
        "x": x, "y": y, "title": title, "words": f"{title or y}: {y} over {x}",
        "half": across is not None and across.colspan.stop - across.colspan.start < across.get_gridspec().ncols,
        "distr": [SCALES[axes.get_xscale()], SCALES[axes.get_yscale()]],
        "xrange": list(limits[0]), "yrange": list(limits[1]), "sets": [one for one in sets if one["x"]],
    }  # fmt: skip


def _heading(axes: Axes) -> str:
    return str(axes.figure.get_suptitle()).split("\n")[-1] if axes is axes.figure.axes[0] else ""


def _shared_label(axes: Axes) -> str:
    return next((one.get_xlabel() for one in axes.get_shared_x_axes().get_siblings(axes) if one.get_xlabel()), "")


def _look(colour: Any) -> str:
    from matplotlib.colors import to_hex

    return LOOKS.get(to_hex(colour), to_hex(colour))


def _label(artist: Any) -> str:
    text = str(artist.get_label())
    return "" if text.startswith("_") else text


def _line(one: Any, axes: Axes, limits: Any) -> dict[str, Any]:
    x, y = (np.asarray(part, float) for part in one.get_data(orig=False))
    free = {"fixed": True}
    if one.get_transform() == axes.get_yaxis_transform(which="grid"):
        x = np.array(limits[0])
    elif one.get_transform() == axes.get_xaxis_transform(which="grid"):
        y = np.array(limits[1])
    else:
        free = {}
    if one.get_linestyle() in ("None", "none", ""):
        hollow = one.get_markerfacecolor() in ("none", "white")
        look = _look(one.get_markeredgecolor() if hollow else one.get_markerfacecolor())
        mark = {"size": 1.5 * one.get_markersize(), "square": one.get_marker() == "s", "open": hollow}
        return series("dots" if one.get_marker() in (".", ",") else "marks", _label(one), look, x, y, **mark)
    style = {"dash": one.get_linestyle() != "-", "width": one.get_linewidth()}
    return series("line", _label(one), _look(one.get_color()), x, y, **style, **free)


def _errors(one: Any) -> dict[str, Any]:
    line, _, bars = one
    x, y = (np.asarray(part, float) for part in line.get_data(orig=False))
    reach: dict[str, Any] = {}
    for collection in bars:
        ends = np.array(collection.get_segments())
        if len(ends) == len(x):
            size = 0.5 * np.abs(ends[:, 1] - ends[:, 0])
            reach["tall" if size[:, 1].any() else "wide"] = size[:, 1] if size[:, 1].any() else size[:, 0]
    square = line.get_marker() == "s"
    return series("marks", _label(one), _look(line.get_color()), x, y, size=7, square=square, **reach)


def _area(one: Any, limits: Any) -> dict[str, Any] | None:
    from matplotlib.collections import PathCollection
    from matplotlib.patches import Rectangle

    if isinstance(one, Rectangle):  # a span of one axis
        x, width = one.get_x(), one.get_width()
        look, (low, high) = _look(one.get_facecolor()), limits[1]
        return series("band", _label(one), look, [x, x + width], [high, high], low=[low, low])
    look = _look(one.get_facecolor()[0]) if len(one.get_facecolor()) else "run"
    if isinstance(one, PathCollection):
        return series("dots", _label(one), look, *np.asarray(one.get_offsets(), float).T, size=6)
    points = one.get_paths()[0].vertices if one.get_paths() else np.zeros((0, 2))
    count = (len(points) - 3) // 2
    if count < 2:
        return None
    low, high = points[1 : count + 1], points[count + 2 : 2 * count + 2][::-1]
    return series("band", _label(one), look, low[:, 0], np.maximum(low[:, 1], high[:, 1]),
                  low=np.minimum(low[:, 1], high[:, 1]))  # fmt: skip
