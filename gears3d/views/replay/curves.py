"""Curves over time, impacts and the Poincaré section, which grows with time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d import signals
from gears3d.views.plots import colours
from gears3d.views.replay.scene import rounded
from gears3d.views.replay.write import BACKGROUND, IMPACT, TIMELINE, clock, rr, rrb, scalars

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.views.plots.motion import Motion

DISPLACEMENT = "/displacement"
VELOCITY = "/velocity"
SPEED = "/speed"
TORQUE = "/torque"
STATE = "/touching"
IMPACTS = "/impacts"
_UM, _MM, _RPM = 1e6, 1e3, 30.0 / np.pi
_WORDS = ("active", "reverse")


def curves(rec: rr.RecordingStream, motion: Motion) -> None:
    """Write displacement between the flanks [um], relative velocity [mm/s] and both speeds [rpm]."""
    rows = motion.plot_rows()
    signals = {name: values[rows] for name, values in motion.recording.signals.items()}
    time = signals["time_s"]
    _flank_lines(rec, motion, signals)
    style(rec, f"{DISPLACEMENT}/loose_gear", ["loose gear"], [colours.LINE], 1.5)
    scalars(rec, f"{DISPLACEMENT}/loose_gear", time, signals["displacement_m"] * _UM)
    if "velocity_m_s" in signals:
        style(rec, f"{VELOCITY}/relative", ["relative velocity"], [colours.LINE], 1.5)
        scalars(rec, f"{VELOCITY}/relative", time, signals["velocity_m_s"] * _MM)
    speeds = [name for name in ("omega_drive_rad_s", "omega_loose_rad_s") if name in signals]
    if speeds:
        names = [name.split("_")[1] for name in speeds]
        style(rec, SPEED, names, [colours.FLIGHT, colours.LINE][: len(names)], 1.5)
        scalars(rec, SPEED, time, np.stack([signals[name] for name in speeds], axis=1) * _RPM)


def torque(rec: rr.RecordingStream, motion: Motion, inertia: float, drag: float) -> None:
    """Write the torque that turns the loose gear between impacts, J dω/dt [N m], and its nominal drag.

    In flight only drag acts; in contact the flank adds its force, and contact is lost where that force vanishes.
    """
    recording = motion.recording
    time = recording.time
    if "omega_loose_rad_s" not in recording.signals or len(time) < 3:
        return
    rows = motion.plot_rows()
    rows = rows[rows < len(time) - 1]
    hits = recording.impacts["time_s"]
    step = time[rows + 1] - time[rows]
    free = (np.searchsorted(hits, time[rows]) == np.searchsorted(hits, time[rows + 1], side="right")) & (step > 0.0)
    rows, step = rows[free], step[free]
    speed = recording.signals["omega_loose_rad_s"]
    for name, colour, at, values in (
        ("drag", colours.FLIGHT, time[[0, -1]], np.full(2, -drag)),
        ("loose_gear", colours.LINE, time[rows] + 0.5 * step, inertia * (speed[rows + 1] - speed[rows]) / step),
    ):
        style(rec, f"{TORQUE}/{name}", [name.replace("_", " ")], [colour], 1.5)
        scalars(rec, f"{TORQUE}/{name}", at, values)


def _flank_lines(rec: rr.RecordingStream, motion: Motion, signals: dict[str, np.ndarray]) -> None:
    flanks = motion.flanks(signals["theta_drive_rad"], signals["theta_loose_rad"])
    for word, colour, flank in zip(_WORDS, colours.FLANKS, flanks, strict=True):
        entity = f"{DISPLACEMENT}/{word}_flank"
        style(rec, entity, [f"{word} flank"], [colour], 2.0)
        keep = slice(None) if np.ptp(flank) > 0.0 else [0, -1]
        scalars(rec, entity, signals["time_s"][keep], flank[keep] * _UM)


def twin_curve(rec: rr.RecordingStream, twin: Recording, rows: np.ndarray) -> None:
    """Write the twin's displacement [um] as a broad line that the recording's own covers where they agree."""
    entity = f"{DISPLACEMENT}/by_twin"
    style(rec, entity, ["twin"], [colours.TWIN], 4.0)
    scalars(rec, entity, twin.time[rows], twin.signals["displacement_m"][rows] * _UM)


def impact_marks(rec: rr.RecordingStream, motion: Motion) -> None:
    """Write every impact: one row each at ``/impacts`` on both timelines, and points on the curves."""
    table = motion.recording.impacts
    time, flank, velocity = table["time_s"], table["flank"], table["velocity_m_s"] * _MM
    if not len(time):
        return
    number = rr.TimeColumn(IMPACT, sequence=np.arange(1, len(time) + 1))
    packed = np.array([int.from_bytes(bytes([*c, 255]), "big") for c in colours.FLANKS], dtype=np.uint32)[flank]
    words = ("impact on the active flank", "impact on the reverse flank")
    spot = motion.at(time, "displacement_m") * _UM
    for code in (0, 1):
        here = flank == code
        for root, value in ((DISPLACEMENT, spot), (VELOCITY, velocity)):
            entity = f"{root}/impacts_{_WORDS[code]}"
            style = rr.SeriesPoints(
                colors=[colours.FLANKS[code]], names=[words[code]], markers=["circle"], marker_sizes=[4.0]
            )
            rec.log(entity, style, static=True)
            if here.any():
                scalars(rec, entity, time[here], value[here])
    rec.send_columns(
        IMPACTS,
        indexes=[clock(time), number],
        columns=rr.TextLog.columns(text=_sentences(table), level=["INFO"] * len(time), color=packed),
    )


def _sentences(table: dict[str, np.ndarray]) -> list[str]:
    columns = zip(
        table["flank"].tolist(),
        (table["velocity_m_s"] * _MM).tolist(),
        (table["rebound_m_s"] * _MM).tolist(),
        table["tooth_drive"].tolist(),
        table["tooth_loose"].tolist(),
        strict=True,
    )
    return [
        f"{_WORDS[flank]:7}  {before:+8.3f} -> {after:+8.3f} mm/s  teeth {drive}/{loose}"
        for flank, before, after, drive, loose in columns
    ]


def states(rec: rr.RecordingStream, time: np.ndarray, flank: np.ndarray, entity: str = STATE) -> None:
    """Write which flank touches as lanes of colour, one row a change."""
    words = np.array(["active flank", "reverse flank", "flight"])
    change = np.flatnonzero(np.r_[True, flank[1:] != flank[:-1]]) if len(flank) else np.zeros(0, dtype=int)
    rec.log(
        entity,
        rr.StateConfiguration(values=words.tolist(), labels=words.tolist(), colors=[*colours.FLANKS, colours.FLIGHT]),
        static=True,
    )
    rec.send_columns(entity, indexes=[clock(time[change])], columns=rr.StateChange.columns(state=words[flank[change]]))


def style(rec: rr.RecordingStream, entity: str, names: list[str], colors: list[tuple], width: float) -> None:
    """Say how curves look."""
    # the viewer's own choice averages what falls into a pixel, and cuts the peaks at impacts
    keep_peaks = rr.components.AggregationPolicy.MinMax
    lines = rr.SeriesLines(names=names, colors=colors, widths=[width] * len(names), aggregation_policy=keep_peaks)
    rec.log(entity, lines, static=True)


SECTION = "/poincare"
WIDTH, HEIGHT = 360.0, 240.0
"""Of the plot: a cycle in degrees, and the range of velocities drawn as high."""
_MARGIN = (52.0, 36.0)
"""For the scales, left and right, above and below."""
_GRID = (0x44, 0x48, 0x50)
_TEXT = (0xB0, 0xB4, 0xBA)
_FLANK_WORDS = ("active", "reverse")
_POINT = -2.5
"""Radius of a point, in points of the screen."""


def poincare(
    rec: rr.RecordingStream, recording: Recording, period: float, root: str = SECTION, reach: float | None = None
) -> None:
    """Write each impact as a point that comes when it happens and stays; nothing without impacts."""
    table = recording.impacts
    time, velocity = table["time_s"], table["velocity_m_s"] * 1e3
    kept = np.isfinite(velocity)
    if not kept.any():
        return
    phase = signals.section(time, velocity, period)[:, 0]
    told = np.mod(table.get("phase_rad", np.full(len(time), np.nan)) / (2.0 * np.pi), 1.0)
    x = WIDTH * np.where(np.isfinite(told), told, phase)
    reach = reach or float(np.abs(velocity[kept]).max()) or 1.0
    y = -0.5 * HEIGHT * velocity / reach
    _frame(rec, root, reach)
    for code, word in enumerate(_FLANK_WORDS):
        here = kept & (table["flank"] == code)
        if here.any():
            _points(rec, f"{root}/{word}", time[here], np.column_stack([x[here], y[here]]), colours.FLANKS[code])


def section_view(root: str = SECTION, name: str = "Poincaré: phase [°], velocity [mm/s]") -> rrb.Spatial2DView:
    """Return the view, which shows all impacts up to the time cursor."""
    left, above = _MARGIN
    until_now = rrb.VisibleTimeRange(
        TIMELINE, start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.cursor_relative()
    )
    return rrb.Spatial2DView(
        origin=root,
        name=name,
        background=BACKGROUND,
        visual_bounds=rrb.VisualBounds2D(
            x_range=[-left, WIDTH + 0.5 * left], y_range=[-0.5 * HEIGHT - above, 0.5 * HEIGHT + above]
        ),
        time_ranges=until_now,
    )


def _points(rec: rr.RecordingStream, entity: str, time: np.ndarray, spots: np.ndarray, colour: tuple) -> None:
    rec.log(entity, rr.Points2D.from_fields(colors=[colour], radii=[_POINT]), static=True)
    rec.send_columns(entity, indexes=[clock(time)], columns=rr.Points2D.columns(positions=spots.astype(np.float32)))


def _frame(rec: rr.RecordingStream, root: str, reach: float) -> None:
    """Write axes, grid and numbers [°], [mm/s]."""
    half = 0.5 * HEIGHT
    step = rounded(reach / 1.5)
    levels = step * np.arange(-int(reach / step), int(reach / step) + 1)
    lines = [[[x, -half], [x, half]] for x in np.linspace(0.0, WIDTH, 5)]
    lines += [[[0.0, -half * level / reach], [WIDTH, -half * level / reach]] for level in levels]
    rec.log(f"{root}/grid", rr.LineStrips2D(lines, colors=[_GRID], radii=[-0.6]), static=True)
    spots = [[x, half + 10.0] for x in (0.0, 90.0, 180.0, 270.0, 360.0)]
    texts = ["0°", "90°", "180°", "270°", "360°"]
    spots += [[-22.0, -half * level / reach] for level in levels]
    texts += [f"{level:.4g}" for level in levels]
    numbers = rr.Points2D(spots, labels=texts, show_labels=True, radii=[0.0], colors=[_TEXT])
    rec.log(f"{root}/scale", numbers, static=True)
