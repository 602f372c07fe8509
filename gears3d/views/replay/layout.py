"""How the viewer arranges the replay: pictures and the section left, curves right, slow motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gears3d.views.replay import poincare
from gears3d.views.replay.plots import DISPLACEMENT, IMPACTS, SPEED, STATE, TORQUE, VELOCITY
from gears3d.views.replay.sdk import rr, rrb
from gears3d.views.replay.write import BACKGROUND, TIMELINE

if TYPE_CHECKING:
    from gears3d.views.plots.teeth import Section

ABOUT = "/about"
CAPTION = "/caption"
FRAMES_A_SECOND = 25.0
"""Frames shown a second of the watcher's time."""


def layout(section: Section, frame_rate: float, window: float, caption: bool = False) -> rrb.Blueprint:
    """Return the blueprint."""
    title = f"Mesh zone, backlash drawn {section.factor:g} times as wide"
    told = rrb.Tabs(
        rrb.TextDocumentView(origin=ABOUT, name="About this replay"),
        rrb.TextLogView(origin=IMPACTS, name="Impacts"),
    )
    above = rrb.Horizontal(_scene(section), poincare.view(), column_shares=[0.58, 0.42])
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
