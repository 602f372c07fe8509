"""Plots of pages as data: signals, flanks and impacts of a run, and charts read off a matplotlib figure or built."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d import palette
from gears3d.comparison.matching import match
from gears3d.effects import Code, Flank, Gear
from gears3d.recording import FLANKS
from gears3d.signals import contacts as from_samples
from gears3d.signals import contacts_of, flights

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gears3d.effects import Row
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

# Time step of the embedded data, s.
TICK = 1e-7

# Quantum and tolerance (fraction of the range) of each signal that is drawn.
CHANNELS = {
    "displacement_m": (1e-9, 1e-4),
    "velocity_m_s": (1e-6, 3e-4),
    "omega_drive_rad_s": (1e-6, 1e-3),
    "omega_loose_rad_s": (1e-6, 1e-3),
}

MOST_POINTS = 30_000  # Of a page: its file stays small


def traces(recording: Recording, twin: Recording | None = None, most: int = MOST_POINTS) -> dict[str, Any]:
    """Return the signals of a run and its twin on one thinned time axis, as integers of stated quanta."""
    if not len(recording.time):
        return {"tick": TICK, "time": [], "run": {}, "twin": None}
    with_corners = [cornered(one) for one in (recording, twin) if one is not None]
    ticks = np.unique(np.concatenate([thinned(columns, most) for columns in with_corners]))
    tables = [_signal_table(columns, ticks) for columns in with_corners]
    return {
        "tick": TICK,
        "time": np.diff(ticks, prepend=0).tolist(),
        "run": tables[0],
        "twin": tables[1] if twin is not None else None,
    }


def _signal_table(columns: dict[str, np.ndarray], ticks: np.ndarray) -> dict[str, Any]:
    out = {}
    for name, (quantum, _) in CHANNELS.items():
        if name in columns:
            values = np.interp(ticks, columns["tick"], columns[name])
            values = np.rint(values / quantum).astype(np.int64)
            out[name] = {"quantum": quantum, "steps": np.diff(values, prepend=0).tolist()}
    return out


def cornered(recording: Recording) -> dict[str, np.ndarray]:
    """Return the signals with two points put in at every impact: just before and just after.

    The sampled signals cut these corners off. Displacement before is carried on from the last sample; the speeds
    jump by what the impact table says.
    """
    time = recording.time
    columns = {name: recording.signals[name] for name in CHANNELS if name in recording.signals}
    hits = recording.impacts["time_s"]
    inside = (hits > time[0]) & (hits < time[-1])
    hits = hits[inside]
    jumps = (recording.impacts["rebound_m_s"] - recording.impacts["velocity_m_s"])[inside]
    corners = _corners(columns, time, hits, jumps)
    ticks = np.concatenate([np.rint(time / TICK), np.rint(hits / TICK) - 1, np.rint(hits / TICK) + 1])
    ticks, first = np.unique(ticks.astype(np.int64), return_index=True)
    merged = {name: np.concatenate([columns[name], *corners[name]])[first] for name in columns}
    return {"tick": ticks, **merged, "keep": first >= len(time)}


def _corners(
    columns: dict[str, np.ndarray], time: np.ndarray, hits: np.ndarray, jumps: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return each channel just before and just after every impact.

    A speed is what the samples on both sides say, less its jump, shared out over the sampling interval. Where two
    impacts fall into one interval the line between the samples has to do.
    """
    before = np.searchsorted(time, hits) - 1
    single = (np.bincount(before, minlength=len(time))[before] == 1) & np.isfinite(jumps)
    share = (hits - time[before]) / np.diff(time)[before]
    jump_of = {"velocity_m_s": jumps, "omega_loose_rad_s": jumps / _lever(columns)}
    out = {}
    for name, values in columns.items():
        between = np.interp(hits, time, values)
        left = right = between
        if name == "displacement_m" and "velocity_m_s" in columns:
            ahead = values[before] + columns["velocity_m_s"][before] * (hits - time[before])
            left = right = np.where(single, ahead, between)
        elif name in jump_of:
            left = values[before] + (np.diff(values)[before] - jump_of[name]) * share
            left, right = np.where(single, left, between), np.where(single, left + jump_of[name], between)
        out[name] = (left, right)
    return out


def _lever(columns: dict[str, np.ndarray]) -> float:
    """Return the loose gear's base radius [m], from velocity = Rb2·ω_loose − Rb1·ω_drive; infinity if unknown."""
    if not {"omega_loose_rad_s", "omega_drive_rad_s", "velocity_m_s"} <= columns.keys():
        return float("inf")
    speeds = np.stack([columns["omega_loose_rad_s"], -columns["omega_drive_rad_s"]], axis=1)
    return float(np.linalg.lstsq(speeds, columns["velocity_m_s"], rcond=None)[0][0]) or float("inf")


def thinned(columns: dict[str, np.ndarray], most: int = MOST_POINTS) -> np.ndarray:
    """Return the ticks between which straight lines stay within the channels' tolerances."""
    if len(columns["tick"]) < 3:
        return columns["tick"]
    tick = columns["tick"].astype(float)
    scaled = [
        columns[name] / max(float(np.ptp(columns[name])) * tolerance, quantum)
        for name, (quantum, tolerance) in CHANNELS.items()
        if name in columns
    ]
    start = np.linspace(0, len(tick) - 1, min(len(tick), 1500)).astype(int)
    start = np.union1d(start, np.flatnonzero(columns["keep"]))
    slack = 1.0
    while True:
        limit = max(most, len(start))
        at = knots(tick, np.array(scaled), start, slack, limit)
        if len(at) <= limit or slack > 1e6:
            return columns["tick"][at]
        slack *= 2.0


def knots(x: np.ndarray, y: np.ndarray, start: np.ndarray, tolerance: float = 1.0, most: float = np.inf) -> np.ndarray:
    """Return indices between which straight lines are nowhere further than a tolerance from the points.

    Every interval with a larger error is split at its worst point, all intervals at once, until all errors are small
    (Ramer 1972; Douglas & Peucker 1973, measured along y).

    >>> knots(np.arange(5.0), np.array([[0.0, 1.0, 2.0, 1.0, 0.0]]), np.array([0, 4]), 0.1).tolist()
    [0, 2, 4]
    """
    at = start
    alive = np.arange(len(x))
    while alive.size and len(at) <= most:
        segment = np.searchsorted(at, alive, side="right") - 1
        segment = np.minimum(segment, len(at) - 2)
        left, right = at[segment], at[segment + 1]
        share = (x[alive] - x[left]) / (x[right] - x[left])
        error = np.zeros(len(alive))
        for channel in y:
            line = channel[left] + share * (channel[right] - channel[left])
            np.maximum(error, np.abs(channel[alive] - line), out=error)
        begins = np.flatnonzero(np.diff(segment, prepend=-1))
        worst = np.repeat(np.maximum.reduceat(error, begins), np.diff(begins, append=len(alive)))
        bad = worst > tolerance
        peak = np.flatnonzero(bad & (error == worst))
        first = np.flatnonzero(np.diff(segment[peak], prepend=-1))
        at = np.sort(np.concatenate([at, alive[peak[first]]]))
        alive = alive[bad]
    return at


class Walls(NamedTuple):
    """The two ends of the dead band.

    Args:
        active: displacement at which the active flanks touch [m], (n,).
        reverse: displacement at which the reverse flanks touch [m], (n,).
        moving: whether any flank deviates from the involute.
        complete: false when single teeth deviate, which the two lines leave out.
    """

    active: np.ndarray
    reverse: np.ndarray
    moving: bool
    complete: bool


def walls(recording: Recording, rows: tuple[Row, ...], backlash: float, time: np.ndarray) -> Walls:
    """Return the displacement of both flanks over time, from the flank deviations of the scenario."""
    shift = {Flank.ACTIVE: np.zeros(len(time)), Flank.REVERSE: np.zeros(len(time))}
    harmonics = [row.p for row in rows if row.code == Code.FLANK_HARMONIC and len(recording.time)]
    for gear, flank, order, amplitude, phase in harmonics:
        name = "theta_drive_rad" if Gear(int(gear)) is Gear.DRIVE else "theta_loose_rad"
        angle = np.interp(time, recording.time, recording.signals[name])
        shift[Flank(int(flank))] += amplitude * np.cos(order * angle + phase)
    complete = not any(row.code == Code.FLANK_TOOTH for row in rows)
    return Walls(shift[Flank.ACTIVE], backlash - shift[Flank.REVERSE], bool(harmonics), complete)


def contacts(recording: Recording, rows: tuple[Row, ...], backlash: float) -> np.ndarray | None:
    """Return the permanent contacts, [flank, start s, end s]: as written down, or as the samples show them."""
    if "contacts" not in recording.meta:
        if "displacement_m" not in recording.signals or not len(recording.time):
            return None
        ends = walls(recording, rows, backlash, recording.time)
        place = recording.signals["displacement_m"]
        return from_samples(recording.time, place, ends.active, ends.reverse, recording.impacts)
    return contacts_of(recording.signals, recording.impacts, recording.meta)[0]


def crossings(recording: Recording, table: np.ndarray, start: float) -> dict[str, np.ndarray]:
    """Return how long each flight across the backlash lasted and how fast it ended."""
    found = flights(recording.impacts["time_s"], recording.impacts["flank"], table)
    across = (found.left != found.struck) & (found.impact >= 0) & (found.start >= start)
    speeds = np.abs(np.append(recording.impacts["velocity_m_s"], np.nan))[found.impact]
    both = np.stack([found.end - found.start, speeds], axis=1)
    return {name: both[across & (found.struck == code)] for code, name in enumerate(FLANKS)}


# Quantum of each column that is embedded.
QUANTA = {
    "velocity_m_s": 1e-7,
    "rebound_m_s": 1e-7,
    "phase_rad": 1e-6,
    "impulse_N_s": 1e-7,
    "flight_height_m": 1e-10,
    "tooth_drive": 1.0,
    "tooth_loose": 1.0,
}


def impact_table(recording: Recording, quanta: dict[str, float] = QUANTA) -> dict[str, Any]:
    """Return the impacts as integers of stated quanta."""
    impacts = recording.impacts
    return {
        "tick": TICK,
        "time": np.rint(impacts["time_s"] / TICK).astype(np.int64).tolist(),
        "flank": impacts["flank"].tolist(),
        "columns": {name: whole(impacts[name], quantum) for name, quantum in quanta.items()},
    }


def whole(values: Any, quantum: float) -> dict[str, Any]:
    """Return a column as whole multiples of a quantum; what is not finite is ``None``.

    >>> whole([0.25, float("nan")], 0.1)
    {'quantum': 0.1, 'values': [2, None]}
    """
    scaled = np.asarray(values, float) / quantum
    rounded = [int(value) if ok else None for value, ok in zip(np.rint(scaled), np.isfinite(scaled), strict=True)]
    return {"quantum": quantum, "values": rounded}


def speed_errors(
    recording: Recording, twin: Recording, period: float, least_height: float
) -> dict[str, list[int] | list[float]]:
    """Return how far each impact's speed is from the twin's, impact by impact as the comparison pairs them."""
    mine, theirs = match(recording.impacts, twin.impacts, period)
    counts = ~(twin.impacts["flight_height_m"][theirs] <= least_height)
    mine, theirs = mine[counts], theirs[counts]
    speed = np.abs(recording.impacts["velocity_m_s"][mine])
    truth = np.abs(twin.impacts["velocity_m_s"][theirs])
    known = truth > 0
    error = (speed[known] - truth[known]) / truth[known]
    return {"impact": mine[known].tolist(), "error": [float(f"{value:.4g}") for value in error]}


def speed_histogram(recording: Recording, twin: Recording | None, bins: int = 40) -> dict[str, Any]:
    """Return how often impacts are how fast, by flank."""
    both = [one for one in (recording, twin) if one is not None]
    speeds = [np.abs(one.impacts["velocity_m_s"]) for one in both]
    fastest = max((float(s.max()) for s in speeds if s.size), default=0.0)
    if not fastest > 0:
        return {"edges": [], "run": [[], []], "twin": None}
    edges = np.linspace(0.0, fastest * 1.0001, bins + 1)
    counts = [
        [np.histogram(speed[one.impacts["flank"] == f], edges)[0].tolist() for f in (0, 1)]
        for one, speed in zip(both, speeds, strict=True)
    ]
    return {
        "edges": [float(f"{edge:.5g}") for edge in edges],
        "run": counts[0],
        "twin": counts[1] if twin is not None else None,
    }


NANOMETRE = 1e-9  # Quantum of stored places [m]


def blocks(scenario: Scenario, recording: Recording, twin: Recording | None, summary: dict[str, Any]) -> dict[str, Any]:
    """Return the blocks by name: traces, walls, impacts, twin_impacts, errors, histogram, about."""
    lines = traces(recording, twin)
    period = summary.get("period_s") or recording.meta.get("period_s")
    comparison = summary.get("comparison") or {}
    height = comparison.get("flight_height_min_m") or 0.0
    pairable = twin if comparison.get("mode") != "distribution" else None
    return {
        "traces": lines,
        "walls": _wall_block(scenario, recording, np.cumsum(lines["time"]) * TICK),
        "impacts": impact_table(recording),
        "twin_impacts": impact_table(twin) if twin is not None else None,
        "errors": speed_errors(recording, pairable, period, height) if pairable is not None and period else None,
        "histogram": speed_histogram(recording, twin),
        "about": {
            "period": period,
            "settle": recording.meta.get("settle_s"),
            "mode": comparison.get("mode"),
            "height": height,
            "model": summary.get("model"),
        },
    }


def _wall_block(scenario: Scenario, recording: Recording, time: np.ndarray) -> dict[str, Any]:
    """Return the flanks as nanometres: one number each when they stand still."""
    ends = walls(recording, scenario.rows(), scenario.rig().backlash, time)
    out: dict[str, Any] = {"quantum": NANOMETRE, "moving": ends.moving, "complete": ends.complete}
    for name, values in (("active", ends.active), ("reverse", ends.reverse)):
        whole = np.rint(values / NANOMETRE).astype(np.int64)
        out[name] = np.diff(whole, prepend=0).tolist() if ends.moving else [int(v) for v in whole[:1]]
    return out


# Names of colours in the style sheet, which has them for light and dark.
LOOKS = {colour.lower(): name for colour, name in {
    palette.ACTIVE: "active", palette.REVERSE: "reverse", palette.EXTENDED: "extended", palette.TWIN: "twin",
    palette.NEUTRAL: "flight", palette.FLIGHT: "flight", palette.BAND: "active", palette.SOFT: "soft",
    palette.INK: "run", "#000000": "run", "#bbbbbb": "rule",
}.items()}  # fmt: skip
# Points of a series.
MOST = 3000
# Distributions of an axis, as the plotting library numbers them.
SCALES = {"linear": 1, "log": 3, "symlog": 4}


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
