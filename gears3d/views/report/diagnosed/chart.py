"""A small chart as SVG in the page's own colours: points, their means with errors, and a curve."""

from __future__ import annotations

from math import floor, log10
from typing import NamedTuple

import numpy as np
from markupsafe import Markup, escape

from gears3d.views.plots.numbers import plain

Array = np.ndarray
WIDTH, HEIGHT = 520, 300
LEFT, RIGHT, TOP, BOTTOM = 74, 10, 12, 42
POINTS = 600
"""Points of a series that are drawn."""
FEW = 250
"""Points of a series below which they are drawn darker."""
BINS = 14
"""Means of a series."""
GAP = 0.15
"""Share of the frame without points across which no curve is drawn."""
MAGNIFIED = 2.5
"""Times the range of means and curves that the frame shows of the points at most."""
VAGUE = 4.0
"""Times the usual error of a mean beyond which it does not widen the frame."""


class Series(NamedTuple):
    """Points of one kind.

    Args:
        name: in the legend.
        look: ``active``, ``reverse`` or ``flight``, as the style sheet has it.
        x: coordinate, (n,).
        y: value, (n,).
        sure: one over the standard deviation of ``y``, (n,).
        curve: what is expected at each point, (n,); ``None`` draws none.
        edge: half width of a band about zero, (n,); ``None`` draws none.
        line: whether the points are one line, and nothing but that is drawn.
    """

    name: str
    look: str
    x: Array
    y: Array
    sure: Array
    curve: Array | None = None
    edge: Array | None = None
    line: bool = False


class Frame(NamedTuple):
    """What a chart is drawn in.

    Args:
        x: name of the coordinate, with its unit.
        y: name of the value, with its unit.
        across: range of the coordinate.
        up: range of the value.
        turn: whether the coordinate is an angle from 0 to 360 degrees.
    """

    x: str
    y: str
    across: tuple[float, float]
    up: tuple[float, float]
    turn: bool = False


def means(x: Array, y: Array, sure: Array, pieces: int = BINS) -> tuple[Array, Array, Array]:
    """Return means over as many points each, with the standard deviations of the means.

    >>> at, mean, sigma = means(np.arange(8.0), np.tile([1.0, 3.0], 4), np.ones(8), 2)
    >>> at.tolist(), mean.tolist(), sigma.tolist()
    ([1.5, 5.5], [2.0, 2.0], [0.5, 0.5])
    """
    pieces = max(min(pieces, len(x) // 4), 1)
    found = []
    for part in np.array_split(np.argsort(x, kind="stable"), pieces):
        if len(part):
            weight = sure[part] ** 2 / np.sum(sure[part] ** 2)
            middle = float(weight @ y[part])
            spread = float(np.sqrt(np.sum(weight**2 * (y[part] - middle) ** 2)))
            found.append((float(np.mean(x[part])), middle, spread))
    at = np.array(found).reshape(-1, 3)
    return at[:, 0], at[:, 1], at[:, 2]


def limits(groups: list[list[Series]]) -> tuple[float, float]:
    """Return a common range of values for several charts."""
    own, points = [0.0], []
    for one in (one for group in groups for one in group):
        _, mean, sigma = means(one.x, one.y, one.sure)
        sure = sigma <= VAGUE * np.median(sigma) if len(sigma) else sigma > 0.0
        own += [*(mean - 2.0 * sigma)[sure], *(mean + 2.0 * sigma)[sure]]
        own += [] if one.edge is None or not len(one.edge) else [float(one.edge.max()), -float(one.edge.max())]
        own += [] if one.curve is None or not len(one.curve) else [float(one.curve.min()), float(one.curve.max())]
        points.append(one.y)
    low, high = min(own), max(own)
    space = (MAGNIFIED - 1.0) / 2.0 * max(high - low, 1e-30)
    every = np.concatenate(points) if points else np.zeros(1)
    ends = np.quantile(every, [0.005, 0.995]) if len(every) else (0.0, 0.0)
    low, high = min(low, max(float(ends[0]), low - space)), max(high, min(float(ends[1]), high + space))
    pad = 0.07 * max(high - low, 1e-30)
    return low - pad, high + pad


def chart(series: list[Series], frame: Frame, says: str) -> Markup:
    """Return a chart as SVG."""
    dots = [one for one in series if not one.line]
    parts = [_axes(frame), *(_points(one, frame) for one in dots), *(_means(one, frame) for one in dots)]
    parts += [_line(one, frame) for one in series if one.line]
    for one in dots:
        lines = [] if one.curve is None else [one.curve]
        lines += [] if one.edge is None else [one.edge, -one.edge]
        parts += [_curve(one, line, frame) for line in lines]
    box = f'viewBox="0 0 {WIDTH} {HEIGHT}"'
    return Markup(f'<svg class="chart" {box} role="img" aria-label="{escape(says)}">{"".join(parts)}</svg>')


def ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Return round numbers within a range.

    >>> ticks(-0.3, 2.1)
    [0.0, 0.5, 1.0, 1.5, 2.0]
    """
    raw = (high - low) / most
    power = 10.0 ** floor(log10(raw))
    step = next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= raw * 0.999)
    first, last = int(np.ceil(low / step)), int(np.floor(high / step))
    return [k * step for k in range(first, last + 1)]


def _place(x: Array, y: Array, frame: Frame) -> tuple[Array, Array]:
    (left, right), (low, high) = frame.across, frame.up
    across = LEFT + (x - left) / (right - left) * (WIDTH - LEFT - RIGHT)
    return across, HEIGHT - BOTTOM - (y - low) / (high - low) * (HEIGHT - TOP - BOTTOM)


def _axes(frame: Frame) -> str:
    right, foot = WIDTH - RIGHT, HEIGHT - BOTTOM
    parts = []
    for value in [0.0, 90.0, 180.0, 270.0, 360.0] if frame.turn else ticks(*frame.across):
        at = float(_place(np.array([value]), np.zeros(1), frame)[0][0])
        parts.append(f'<path class="grid" d="M{at:.1f} {TOP}V{foot}"/>')
        parts.append(f'<text x="{at:.1f}" y="{foot + 16}" text-anchor="middle">{_number(value)}</text>')
    for value in ticks(*frame.up):
        at = float(_place(np.zeros(1), np.array([value]), frame)[1][0])
        look = "zero" if value == 0.0 else "grid"
        parts.append(f'<path class="{look}" d="M{LEFT} {at:.1f}H{right}"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{_number(value)}</text>')
    middle = f'x="{(LEFT + right) / 2}" y="{HEIGHT - 6}"'
    up = f'transform="translate(14 {(TOP + foot) / 2}) rotate(-90)"'
    parts.append(f'<text {middle} text-anchor="middle">{escape(frame.x)}</text>')
    parts.append(f'<text {up} text-anchor="middle">{escape(frame.y)}</text>')
    return "".join(parts)


def _number(value: float) -> str:
    return plain(round(value, 12), 4) if value else "0"


def _points(one: Series, frame: Frame) -> str:
    some = np.unique(np.linspace(0, len(one.x) - 1, min(len(one.x), POINTS)).astype(int)) if len(one.x) else []
    x, y = one.x[some], one.y[some]
    seen = (y >= frame.up[0]) & (y <= frame.up[1])
    across, down = _place(x[seen], y[seen], frame)
    drawn = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(across, down, strict=True))
    few = " few" if len(one.x) < FEW else ""
    return f'<path class="points {one.look}{few}" d="{drawn}"/>' if drawn else ""


def _means(one: Series, frame: Frame) -> str:
    if not len(one.x):
        return ""
    at, mean, sigma = means(one.x, one.y, one.sure)
    inside = (mean >= frame.up[0]) & (mean <= frame.up[1])
    at, mean, sigma = at[inside], mean[inside], sigma[inside]
    across, down = _place(at, mean, frame)
    ends = [_place(at, np.clip(mean + k * sigma, *frame.up), frame)[1] for k in (1.96, -1.96)]
    bars = "".join(f"M{a:.1f} {t:.1f}V{e:.1f}" for a, t, e in zip(across, *ends, strict=True))
    square = one.look == "reverse"
    marks = "".join(
        f'<rect x="{a - 4:.1f}" y="{b - 4:.1f}" width="8" height="8"/>' if square
        else f'<circle cx="{a:.1f}" cy="{b:.1f}" r="4.2"/>' for a, b in zip(across, down, strict=True)
    )  # fmt: skip
    return f'<g class="means {one.look}"><path d="{bars}"/>{marks}</g>'


def _line(one: Series, frame: Frame) -> str:
    across, down = _place(one.x, np.clip(one.y, *frame.up), frame)
    drawn = " ".join(f"{a:.1f} {b:.1f}" for a, b in zip(across, down, strict=True))
    return f'<polyline class="line {one.look}" points="{drawn}"/>'


def _curve(one: Series, values: Array, frame: Frame) -> str:
    if len(one.x) < 2:
        return ""
    at, mean, _ = means(one.x, values, np.ones_like(one.x), 60)
    across, down = _place(at, mean, frame)
    far = np.diff(at, prepend=at[0]) > GAP * (frame.across[1] - frame.across[0])
    drawn = "".join(f"{'M' if k == 0 or far[k] else 'L'}{across[k]:.1f} {down[k]:.1f}" for k in range(len(at)))
    return f'<path class="curve {one.look}" d="{drawn}"/>'
