"""Curves over time, impacts, the Poincaré section, which grows with time, and how the viewer arranges all parts."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d import signals
from gears3d.views.plots.section import PLOT_RATE, is_measured
from gears3d.views.replay.scene import (
    BACKGROUND,
    FLANKS,
    FLIGHT,
    IMPACT,
    LINE,
    TIMELINE,
    TWIN,
    clock,
    rounded,
    rr,
    rrb,
    scalars,
)

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario
    from gears3d.views.plots.section import Motion, Section

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
    style(rec, f"{DISPLACEMENT}/loose_gear", ["loose gear"], [LINE], 1.5)
    scalars(rec, f"{DISPLACEMENT}/loose_gear", time, signals["displacement_m"] * _UM)
    if "velocity_m_s" in signals:
        style(rec, f"{VELOCITY}/relative", ["relative velocity"], [LINE], 1.5)
        scalars(rec, f"{VELOCITY}/relative", time, signals["velocity_m_s"] * _MM)
    speeds = [name for name in ("omega_drive_rad_s", "omega_loose_rad_s") if name in signals]
    if speeds:
        names = [name.split("_")[1] for name in speeds]
        style(rec, SPEED, names, [FLIGHT, LINE][: len(names)], 1.5)
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
        ("drag", FLIGHT, time[[0, -1]], np.full(2, -drag)),
        ("loose_gear", LINE, time[rows] + 0.5 * step, inertia * (speed[rows + 1] - speed[rows]) / step),
    ):
        style(rec, f"{TORQUE}/{name}", [name.replace("_", " ")], [colour], 1.5)
        scalars(rec, f"{TORQUE}/{name}", at, values)


def _flank_lines(rec: rr.RecordingStream, motion: Motion, signals: dict[str, np.ndarray]) -> None:
    flanks = motion.flanks(signals["theta_drive_rad"], signals["theta_loose_rad"])
    for word, colour, flank in zip(_WORDS, FLANKS, flanks, strict=True):
        entity = f"{DISPLACEMENT}/{word}_flank"
        style(rec, entity, [f"{word} flank"], [colour], 2.0)
        keep = slice(None) if np.ptp(flank) > 0.0 else [0, -1]
        scalars(rec, entity, signals["time_s"][keep], flank[keep] * _UM)


def twin_curve(rec: rr.RecordingStream, twin: Recording, rows: np.ndarray) -> None:
    """Write the twin's displacement [um] as a broad line that the recording's own covers where they agree."""
    entity = f"{DISPLACEMENT}/by_twin"
    style(rec, entity, ["twin"], [TWIN], 4.0)
    scalars(rec, entity, twin.time[rows], twin.signals["displacement_m"][rows] * _UM)


def impact_marks(rec: rr.RecordingStream, motion: Motion) -> None:
    """Write every impact: one row each at ``/impacts`` on both timelines, and points on the curves."""
    table = motion.recording.impacts
    time, flank, velocity = table["time_s"], table["flank"], table["velocity_m_s"] * _MM
    if not len(time):
        return
    number = rr.TimeColumn(IMPACT, sequence=np.arange(1, len(time) + 1))
    packed = np.array([int.from_bytes(bytes([*c, 255]), "big") for c in FLANKS], dtype=np.uint32)[flank]
    words = ("impact on the active flank", "impact on the reverse flank")
    spot = motion.at(time, "displacement_m") * _UM
    for code in (0, 1):
        here = flank == code
        for root, value in ((DISPLACEMENT, spot), (VELOCITY, velocity)):
            entity = f"{root}/impacts_{_WORDS[code]}"
            style = rr.SeriesPoints(colors=[FLANKS[code]], names=[words[code]], markers=["circle"], marker_sizes=[4.0])
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
        rr.StateConfiguration(values=words.tolist(), labels=words.tolist(), colors=[*FLANKS, FLIGHT]),
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
# Of the plot: a cycle in degrees, and the range of velocities drawn as high.
WIDTH, HEIGHT = 360.0, 240.0
# For the scales, left and right, above and below.
_MARGIN = (52.0, 36.0)
_GRID = (0x44, 0x48, 0x50)
_TEXT = (0xB0, 0xB4, 0xBA)
_FLANK_WORDS = ("active", "reverse")
# Radius of a point, in points of the screen.
_POINT = -2.5


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
            _points(rec, f"{root}/{word}", time[here], np.column_stack([x[here], y[here]]), FLANKS[code])


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


ABOUT = "/about"
CAPTION = "/caption"
# Frames shown a second of the watcher's time.
FRAMES_A_SECOND = 25.0


def layout(section: Section, frame_rate: float, window: float, caption: bool = False) -> rrb.Blueprint:
    """Return the blueprint."""
    title = f"Mesh zone, backlash drawn {section.factor:g} times as wide"
    told = rrb.Tabs(
        rrb.TextDocumentView(origin=ABOUT, name="About this replay"), rrb.TextLogView(origin=IMPACTS, name="Impacts")
    )
    above = rrb.Horizontal(_scene(section), section_view(), column_shares=[0.58, 0.42])
    if caption:
        told = rrb.Horizontal(rrb.TextDocumentView(origin=CAPTION, name="What happens"), told)
    pictures = rrb.Vertical(above, zone_view(section, "/zone", title), told, row_shares=[0.34, 0.46, 0.2])
    curves = rrb.Vertical(
        curve(
            DISPLACEMENT,
            "Displacement between the flanks [um]: white the loose gear, pink the rigid model",
            axis(window),
        ),
        rrb.StateTimelineView(origin=STATE, name="Touching", time_view=axis(window)),
        curve(VELOCITY, "Relative velocity and impacts [mm/s]", axis(window)),
        curve(SPEED, "Speed [rpm]: grey drive, white loose gear", axis(window)),
        curve(TORQUE, "Torque on the loose gear between impacts [N m]: grey its nominal drag", axis(window)),
        row_shares=[0.28, 0.11, 0.23, 0.19, 0.19],
    )
    return panels(rrb.Horizontal(pictures, curves, column_shares=[0.55, 0.45]), frame_rate)


def panels(views: rrb.Container, frame_rate: float) -> rrb.Blueprint:
    """Return a blueprint that plays in slow motion, again and again, with nothing else on the screen."""
    return rrb.Blueprint(
        views,
        rrb.TimePanel(
            state="collapsed",
            timeline=TIMELINE,
            playback_speed=FRAMES_A_SECOND / frame_rate,
            loop_mode="all",
            play_state="playing",
        ),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _scene(section: Section) -> rrb.Spatial3DView:
    gears = section.pair.drive, section.pair.loose
    distance = section.pair.centre_distance * 1e3
    left, right = -gears[0].tip_radius * 1e3, distance + gears[1].tip_radius * 1e3
    middle, width, height = 0.5 * (left + right), right - left, 2e3 * max(gear.tip_radius for gear in gears)
    return rrb.Spatial3DView(
        origin="/scene",
        name="Gears at true scale",
        background=BACKGROUND,
        line_grid=False,
        eye_controls=_eye((middle, 0.0), max(0.6 * width, 1.1 * height), tilt=0.3),
    )


def zone_view(section: Section, origin: str, name: str) -> rrb.Spatial3DView:
    """Return a view of the mesh zone."""
    x, y = section.pitch_point
    height = 3.8 * section.base_pitch
    return rrb.Spatial3DView(
        origin=origin,
        name=name,
        background=BACKGROUND,
        line_grid=False,
        eye_controls=_eye((x, y), 0.95 * height, tilt=0.0),
    )


def _eye(target: tuple[float, float], distance: float, tilt: float) -> rrb.EyeControls3D:
    """An eye above the gears' plane; ``tilt`` lowers it towards -y [rad, small]."""
    x, y = target
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=[x, y - tilt * distance, distance],
        look_target=[x, y, 0.0],
        eye_up=[0.0, 1.0, 0.0],
    )


def axis(window: float) -> rrb.TimeAxis:
    """Return an axis of time about the cursor."""
    nanoseconds = round(0.5e9 * window)
    return rrb.TimeAxis(
        view_range=rr.TimeRange(
            start=rr.TimeRangeBoundary.cursor_relative(seconds=-nanoseconds * 1e-9),
            end=rr.TimeRangeBoundary.cursor_relative(seconds=nanoseconds * 1e-9),
        )
    )


def curve(origin: str, name: str, time: rrb.TimeAxis, legend: rrb.PlotLegend | None = None) -> rrb.TimeSeriesView:
    """Return a view of curves, dark in a light viewer, too: lines are white."""
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        axis_x=time,
        plot_legend=legend or rrb.PlotLegend(visible=False),
        background=rrb.archetypes.PlotBackground(color=BACKGROUND),
    )


def about_text(
    scenario: Scenario, motion: Motion, wide: Section, scales: tuple[float, ...], rate: float
) -> rr.TextDocument:
    """Return the text panel."""
    pair, recording = wide.pair, motion.recording
    flank = recording.impacts["flank"]
    active, reverse = int((flank == 0).sum()), int((flank == 1).sum())
    source = f" ({scenario.source})" if scenario.source else ""
    model = recording.meta.get("model", "")
    lines = [
        f"## {scenario.title or 'Gear rattle'}{source}",
        f"{pair.drive.teeth}/{pair.loose.teeth} teeth, module {pair.drive.module * 1e3:g} mm, backlash "
        f"{pair.backlash * 1e6:g} um, {motion_words(scenario)}, drag {scenario.drag.torque:g} N m, restitution "
        f"{scenario.impact.restitution:g}" + (f"; model: {model}" if model else "") + ".",
        f"**{active} impacts on the active flank (blue), {reverse} on the reverse flank (orange)**; grey is flight.",
        f"- Mesh zone: the pair is drawn as if its backlash were **{wide.factor:g} times** as wide "
        f"({wide.backlash:.3g} mm); flank deviations are part of the motion, but not of the drawing.",
        f"- Slow motion: 1 s takes {rate / FRAMES_A_SECOND:.0f} s. Pictures "
        f"{motion.frame_rate():.0f} per second and at every impact.",
        "- Dots: where teeth touch, thin lines through them: the common normal. Grey bars: the gaps of a flight.",
        "- Poincaré section: every impact up to now."
        + (
            ""
            if is_measured(recording)
            else " Torque: J dω/dt between impacts; contact is lost where it falls to the drag torque."
        ),
        f"- Curves: {PLOT_RATE:g} samples per second and all samples near impacts; the Parquet files hold all.",
    ]
    if all(scales):
        lines.append(
            "- Arrows: impulse on the loose gear where it acted, fading for two seconds; "
            f"1 N s = {scales[0]:g} mm in the scene, {scales[1]:g} mm in the zone."
        )
    if pair.drive.helix_angle:
        lines.append(
            "- Helical teeth: the mesh zone and all marks show the transverse section in the middle of the teeth."
        )
    if recording.meta.get("interrupted"):
        lines.insert(1, "**Interrupted: this is a part of the run.**")
    return rr.TextDocument("\n\n".join(lines[:4]) + "\n" + "\n".join(lines[4:]), media_type=rr.MediaType.MARKDOWN)


def motion_words(scenario: Scenario) -> str:
    """Return the drive's motion in words."""
    rpm = 30.0 / pi
    parts = [f"{scenario.motion.mean * rpm:g} rpm"]
    parts += [f"{h.amplitude * rpm:.3g} rpm at {h.frequency:g} Hz" for h in scenario.motion.harmonics]
    return "drive " + " + ".join(parts)
