"""Several motions side by side on one time line: a mesh zone each, their curves in one plot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.views.plots import colours
from gears3d.views.plots.motion import Frames, Motion
from gears3d.views.plots.teeth import Section
from gears3d.views.replay import plots, scene, zone
from gears3d.views.replay.layout import ABOUT, axis, curve, panels, zone_view
from gears3d.views.replay.plots import DISPLACEMENT, STATE
from gears3d.views.replay.sdk import rr, rrb
from gears3d.views.replay.write import scalars

_UM = 1e6


class Lane(NamedTuple):
    """One of the motions as it is drawn.

    Args:
        name: of its entities.
        title: above its mesh zone.
        colour: of its curves.
        width: of its curves, in points of the screen.
        motion: what moves.
        wide: the pair as drawn.
        frames: where it is when.
    """

    name: str
    title: str
    colour: tuple[int, int, int]
    width: float
    motion: Motion
    wide: Section
    frames: Frames


def draw(rec: rr.RecordingStream, lane: Lane, rows: np.ndarray | None = None) -> None:
    """Write a motion's mesh zone, its displacement [um] and which flank touches."""
    root, module = f"/{lane.name}", lane.wide.pair.drive.module * 1e3
    zone.gears(rec, lane.wide, lane.frames, root)
    zone.lines_of_action(rec, lane.wide, root)
    zone.gaps(rec, lane.wide, lane.frames, root)
    scene.contacts(rec, root, lane.wide, lane.frames, 0.3, 0.6 * module, 6.0)
    scene.impulses(rec, root, lane.wide, lane.motion, 0.4, 2.5 * module)
    entity, signals = f"{DISPLACEMENT}/{lane.name}", lane.motion.recording.signals
    kept = slice(None) if rows is None else rows
    plots.style(rec, entity, [lane.title], [lane.colour], lane.width)
    scalars(rec, entity, signals["time_s"][kept], signals["displacement_m"][kept] * _UM)
    plots.states(rec, lane.frames.time, lane.frames.flank, f"{STATE}/{lane.name}")


def flanks(rec: rr.RecordingStream, lane: Lane, prefix: str = "", rows: np.ndarray | None = None) -> None:
    """Write where the flanks of a motion are [um]."""
    kept = slice(None) if rows is None else rows
    signals = lane.motion.recording.signals
    time, drive, loose = (signals[name][kept] for name in ("time_s", "theta_drive_rad", "theta_loose_rad"))
    for word, colour, place in zip(
        ("active", "reverse"), colours.FLANKS, lane.motion.flanks(drive, loose), strict=True
    ):
        entity = f"{DISPLACEMENT}/{prefix}{word}_flank"
        plots.style(rec, entity, [f"{word} flank"], [colour], 2.0)
        scalars(rec, entity, time, np.asarray(place) * _UM)


def arranged(
    lanes: Sequence[Lane], curves: str, window: float, rate: float, more: Sequence[rrb.View] = ()
) -> rrb.Blueprint:
    """Return the blueprint: zones above, displacements below them, which flank touches and the text at the bottom."""
    shown = axis(window)
    zones = [zone_view(lane.wide, f"/{lane.name}", lane.title) for lane in lanes]
    legend = rrb.PlotLegend(visible=True)
    touching = rrb.StateTimelineView(origin=STATE, name="Touching", time_view=shown)
    about = rrb.TextDocumentView(origin=ABOUT, name="About this replay")
    bottom = [0.6, 0.4] if not more else [0.35, *[0.4 / len(more)] * len(more), 0.25]
    return panels(
        rrb.Vertical(
            rrb.Horizontal(*zones),
            curve(DISPLACEMENT, curves, shown, legend),
            rrb.Horizontal(touching, *more, about, column_shares=bottom),
            row_shares=[0.45, 0.3, 0.25],
        ),
        rate,
    )
