"""The Poincaré section through the impacts, which grows with time: phase of the fluctuation against velocity."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d import signals
from gears3d.views.plots import colours
from gears3d.views.replay.scene import rounded
from gears3d.views.replay.sdk import rr, rrb
from gears3d.views.replay.write import BACKGROUND, TIMELINE, clock

if TYPE_CHECKING:
    from gears3d.recording import Recording

ROOT = "/poincare"
WIDTH, HEIGHT = 360.0, 240.0
"""Of the plot: a cycle in degrees, and the range of velocities drawn as high."""
_MARGIN = (52.0, 36.0)
"""For the scales, left and right, above and below."""
_GRID = (0x44, 0x48, 0x50)
_TEXT = (0xB0, 0xB4, 0xBA)
_WORDS = ("active", "reverse")
_POINT = -2.5
"""Radius of a point, in points of the screen."""


def poincare(
    rec: rr.RecordingStream, recording: Recording, period: float, root: str = ROOT, reach: float | None = None
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
    for code, word in enumerate(_WORDS):
        here = kept & (table["flank"] == code)
        if here.any():
            _points(rec, f"{root}/{word}", time[here], np.column_stack([x[here], y[here]]), colours.FLANKS[code])


def view(root: str = ROOT, name: str = "Poincaré: phase [°], velocity [mm/s]") -> rrb.Spatial2DView:
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
