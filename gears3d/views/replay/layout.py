"""How the viewer arranges the replay, and its text panel: what it shows, to which scale, in which colours."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

from gears3d.views.plots.motion import PLOT_RATE, is_measured
from gears3d.views.replay.curves import DISPLACEMENT, IMPACTS, SPEED, STATE, TORQUE, VELOCITY, section_view
from gears3d.views.replay.write import BACKGROUND, TIMELINE, rr, rrb

if TYPE_CHECKING:
    from gears3d.scenario import Scenario
    from gears3d.views.plots.motion import Motion
    from gears3d.views.plots.teeth import Section

ABOUT = "/about"
CAPTION = "/caption"
FRAMES_A_SECOND = 25.0
"""Frames shown a second of the watcher's time."""


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
