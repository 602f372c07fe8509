"""A comparison as one picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d import files
from gears3d.comparison.against import period_of
from gears3d.palette import FLANKS as COLOURS
from gears3d.palette import NEUTRAL
from gears3d.recording import FLANKS, Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gears3d.comparison.result import Comparison

PERIODS_SHOWN = 3.0  # Of the fluctuation, at the end: single impacts stay visible
MARKERS = ("o", "s")
# Units of an error, the first one is taken in which it reaches 1
UNITS = (("%", 1e2), ("ppm", 1e6), ("ppb", 1e9), ("1e-12", 1e12))


def picture(comparison: Comparison, a: Recording, b: Recording) -> Figure:
    """Draw a comparison: displacement of both over the last periods, and how the impacts agree.

    Args:
        comparison: what :func:`gears3d.comparison.compare` made of the two.
        a: the recording under test.
        b: the reference.

    Returns:
        A figure that belongs to no window; ``figure.savefig(path)`` writes it.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.5), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.1, 1.0])
    names = _names(a, b)
    _displacement(figure.add_subplot(grid[0, :]), comparison, a, b, names)
    left, right = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
    if comparison.mode == "trajectory":
        _speed_against_speed(left, comparison, a, b, names)
        _error_over_time(right, comparison, a, b)
    else:
        _speed_distributions(left, comparison, a, b, names)
        _sections(right, comparison, a, b, names)
    for axes in figure.axes:
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
    figure.suptitle(_headline(comparison, b), fontsize=11, x=0.01, ha="left")
    return figure


def write_picture(path: Path, comparison: Comparison, a: Recording, b: Recording) -> Path:
    """Draw a comparison into a file, under a temporary name that is renamed.

    Args:
        path: ends in ``.png``, ``.svg`` or ``.pdf``.
        comparison: of the two.
        a: the recording under test.
        b: the reference.

    Returns:
        The path.

    Raises:
        UsageError: the ending is another.
        InputError: the file cannot be written.
    """
    return files.write_picture(path, lambda: picture(comparison, a, b))


def _names(a: Recording, b: Recording) -> tuple[str, str]:
    one, other = (str(record.meta.get("model") or "") for record in (a, b))
    return (one, other) if one and other and one != other else ("tested", "reference")


def _headline(comparison: Comparison, b: Recording) -> str:
    title = str(b.meta.get("title") or "")
    if comparison.mode == "trajectory":
        said = (
            f"{comparison.impacts_matched} of {comparison.impacts_compared} impacts matched, "
            f"{comparison.impacts_missed} missed, {comparison.impacts_invented} invented"
        )
        if comparison.velocity_error_median is not None:
            said += f"; impact speed error {100 * comparison.velocity_error_median:.2g} % (median)"
    else:
        struck = [test.quantity for test in comparison.tests if test.different]
        tested = f"{len(comparison.tests)} distributions tested"
        said = f"{tested}, different: {', '.join(struck) or 'none'}"
    return f"{title}\n{said}" if title else said


def _displacement(axes: Axes, comparison: Comparison, a: Recording, b: Recording, names: tuple[str, str]) -> None:
    begin, end = comparison.window_s
    begin = max(begin, end - PERIODS_SHOWN * period_of(b, a))
    styles: tuple[dict[str, Any], ...] = (
        {"color": "black", "linewidth": 1.0},
        {"color": NEUTRAL, "linewidth": 2.4, "alpha": 0.55},
    )
    for record, name, style, filled in zip((a, b), names, styles, (True, False), strict=True):
        part = record.between(begin, max(begin, end))
        if "displacement_m" not in part.signals or not len(part.time):
            continue
        path = 1e6 * part.signals["displacement_m"]
        axes.plot(part.time, path, label=name, zorder=3 if filled else 2, **style)
        for code, colour in enumerate(COLOURS):
            times = part.impacts["time_s"][part.impacts["flank"] == code]
            face = colour if filled else "none"
            axes.plot(
                times,
                np.interp(times, part.time, path),
                MARKERS[code],
                markersize=4 if filled else 8,
                markeredgecolor=colour,
                markerfacecolor=face,
                linestyle="none",
                zorder=4,
                label=f"{FLANKS[code]} flank, impact" if filled else None,
            )
    backlash = b.meta.get("backlash_m")
    if backlash:
        for place, colour in zip((0.0, 1e6 * float(backlash)), COLOURS, strict=True):
            axes.axhline(place, color=colour, linewidth=0.8, linestyle=":")
    axes.set(xlabel="time [s]", ylabel="displacement between the flanks [µm]")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8, ncols=4, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0))


def _speed_against_speed(
    axes: Axes, comparison: Comparison, a: Recording, b: Recording, names: tuple[str, str]
) -> None:
    mine, theirs = comparison.pairs.T
    speed, truth = 1e3 * np.abs(a.impacts["velocity_m_s"]), 1e3 * np.abs(b.impacts["velocity_m_s"])
    for code, colour in enumerate(COLOURS):
        on = b.impacts["flank"][theirs] == code
        axes.plot(truth[theirs[on]], speed[mine[on]], MARKERS[code], color=colour, markersize=3, alpha=0.7)
    top = max([0.0, *truth[theirs], *speed[mine]]) or 1.0
    axes.plot([0, top], [0, top], color=NEUTRAL, linewidth=0.8, zorder=0)
    for place in ((truth[comparison.missed], 0.0), (0.0, speed[comparison.invented])):
        across, up = np.broadcast_arrays(*place)
        if across.size:
            axes.plot(across, up, "x", color="black", markersize=6, clip_on=False)
    axes.set(xlabel=f"impact speed, {names[1]} [mm/s]", ylabel=f"{names[0]} [mm/s]")
    axes.set_title("every impact; × has no counterpart", fontsize=9, loc="left")


def _error_over_time(axes: Axes, comparison: Comparison, a: Recording, b: Recording) -> None:
    mine, theirs = comparison.pairs.T
    truth = np.abs(b.impacts["velocity_m_s"][theirs])
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.abs(a.impacts["velocity_m_s"][mine]) / truth - 1.0
    largest = np.max(np.abs(error[np.isfinite(error)]), initial=0.0)
    unit, scale = next(((u, s) for u, s in UNITS if largest * s >= 1.0), UNITS[-1])
    for code, colour in enumerate(COLOURS):
        on = b.impacts["flank"][theirs] == code
        time = b.impacts["time_s"][theirs[on]]
        axes.plot(time, scale * error[on], MARKERS[code], color=colour, markersize=3, alpha=0.7)
    axes.axhline(0.0, color=NEUTRAL, linewidth=0.8, zorder=0)
    axes.set(xlabel="time [s]", ylabel=f"error of the impact speed [{unit}]")
    axes.set_title("does the error grow?", fontsize=9, loc="left")


def _speed_distributions(
    axes: Axes, comparison: Comparison, a: Recording, b: Recording, names: tuple[str, str]
) -> None:
    for record, name, style in zip((a, b), names, ("-", "--"), strict=True):
        for code, colour in enumerate(COLOURS):
            hits = _counting(record, comparison, code)
            speeds = np.sort(1e3 * np.abs(record.impacts["velocity_m_s"][hits]))
            if speeds.size:
                share = np.arange(1, len(speeds) + 1) / len(speeds)
                axes.step(
                    speeds, share, style, where="post", color=colour, linewidth=1.2, label=f"{name}, {FLANKS[code]}"
                )
    axes.set(xlabel="impact speed [mm/s]", ylabel="share of the impacts below", ylim=(0, 1.02))
    if axes.has_data():
        axes.legend(fontsize=8, frameon=False, loc="lower right")


def _sections(axes: Axes, comparison: Comparison, a: Recording, b: Recording, names: tuple[str, str]) -> None:
    period = period_of(b, a)
    for record, size, alpha in ((b, 14, 0.35), (a, 4, 0.9)):
        for code, colour in enumerate(COLOURS):
            hits = _counting(record, comparison, code)
            phase = np.mod(record.impacts["time_s"][hits] / period, 1.0)
            speed = 1e3 * record.impacts["velocity_m_s"][hits]
            axes.scatter(phase, speed, s=size, color=colour, alpha=alpha, linewidths=0)
    axes.set(xlabel="phase of the excitation [cycles]", ylabel="impact velocity [mm/s]", xlim=(0, 1))
    axes.set_title(f"Poincaré section: {names[0]} small, {names[1]} large", fontsize=9, loc="left")


def _counting(record: Recording, comparison: Comparison, code: int) -> np.ndarray:
    hits = record.impacts
    settled = hits["time_s"] >= float(record.meta.get("settle_s") or 0.0)
    return settled & (hits["flank"] == code) & ~(hits["flight_height_m"] <= comparison.flight_height_min_m)
