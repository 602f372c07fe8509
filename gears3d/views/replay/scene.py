"""The gears at true scale: solids that turn, the points where teeth touch, and the impulses."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.gears.solids import solid_arrays
from gears3d.views.plots import colours
from gears3d.views.replay.sdk import rr
from gears3d.views.replay.write import marks, trail, turn

if TYPE_CHECKING:
    from gears3d.views.plots.motion import Frames, Motion
    from gears3d.views.plots.teeth import Section

ROOT = "/scene"
TRAIL = 50
"""How long an impulse is seen while it fades, in pictures of a regular grid: two seconds of the watcher's time."""
LEVELS = (1.0, 0.65, 0.4, 0.2)
"""Brightness of the arrows of a trail, new ones first."""
MOST = 4
"""Arrows seen at once."""
CHORD = 20e-6
"""How far the facets shown may lie from the flanks [m]."""
_NAMES = ("drive", "loose")


def place(rec: rr.RecordingStream, root: str, section: Section) -> None:
    """Put the axes of both gears in their places."""
    rec.log(root, rr.ViewCoordinates.RIGHT_HAND_Y_UP, static=True)
    for name, x in zip(_NAMES, (0.0, section.pair.centre_distance * 1e3), strict=True):
        rec.log(f"{root}/{name}", rr.Transform3D(translation=[x, 0.0, 0.0]), static=True)


def solids(rec: rr.RecordingStream, section: Section, frames: Frames) -> None:
    """Write both solids and their rotation."""
    place(rec, ROOT, section)
    colour = (colours.DRIVE, colours.LOOSE)
    for which, name in enumerate(_NAMES):
        vertices, faces, normals = solid_arrays(section.pair, name, CHORD, 5.0 * CHORD)
        rec.log(
            f"{ROOT}/{name}/body",
            rr.Mesh3D(
                vertex_positions=(vertices * 1e3).astype(np.float32),
                triangle_indices=faces.astype(np.uint32),
                vertex_normals=normals.astype(np.float32),
                albedo_factor=[*colour[which], 255],
            ),
            static=True,
        )
        rec.log(f"{ROOT}/{name}/body/mark", _mark(section, which), static=True)
        angle = frames.drive if which == 0 else pi - frames.loose
        turn(rec, f"{ROOT}/{name}/body", frames.time, angle)


def _mark(section: Section, which: int) -> rr.LineStrips3D:
    """A hub and a line to tooth 1 on the end face, by which the eye sees the gear turn."""
    gear = (section.pair.drive, section.pair.loose)[which]
    height, root = 0.502e3 * gear.face_width, gear.root_radius * 1e3
    angle = np.linspace(0.0, 2.0 * pi, 73)
    inner = max(0.12 * root, 0.6e3 * (gear.bore or 0.0))
    hub = inner * np.column_stack([np.cos(angle), np.sin(angle)])
    line = np.array([[inner, 0.0], [0.96 * root, 0.0]])
    return rr.LineStrips3D([lifted(hub, height), lifted(line, height)], colors=[colours.MARK], radii=[-1.5])


def contacts(
    rec: rr.RecordingStream, root: str, section: Section, frames: Frames, height: float, reach: float, size: float
) -> None:
    """Write the points where teeth touch and their common normals; nothing is there in flight."""
    row, _, travel = section.touching(frames.drive, frames.flank)
    flank = frames.flank[row]
    counts = np.bincount(row, minlength=len(frames.time))
    spot = lifted(section.point(travel, flank), height)
    along = lifted(section.normal(flank), 0.0) * reach
    colour = np.array(colours.FLANKS, dtype=np.uint8)[flank]
    points = rr.Points3D.columns(positions=spot, colors=colour, radii=np.full(len(spot), -size))
    marks(rec, f"{root}/contacts", frames.time, counts, [points])
    ends = np.stack([spot - along, spot + along], axis=1).astype(np.float32)
    strips = rr.LineStrips3D.columns(strips=ends, colors=colour, radii=np.full(len(spot), -1.2))
    marks(rec, f"{root}/normals", frames.time, counts, [strips])


def impulses(
    rec: rr.RecordingStream, root: str, section: Section, motion: Motion, height: float, longest: float
) -> float:
    """Write an arrow for every impact, the impulse on the loose gear; it stays where it acted, and fades."""
    impacts = motion.recording.impacts
    time, flank = impacts["time_s"], impacts["flank"].astype(int)
    impulse = np.abs(np.nan_to_num(impacts["impulse_N_s"]))
    if not len(time) or not impulse.max() > 0.0:
        return 0.0
    scale = rounded(longest / impulse.max())
    angle = motion.at(time, "theta_drive_rad")
    spot = lifted(section.point(section.meeting(angle, flank, impacts["tooth_drive"]), flank), height)
    vector = lifted(section.normal(flank), 0.0) * (impulse * scale)[:, None]
    at, counts, which, level = trail(time, TRAIL / motion.frame_rate(), len(LEVELS), MOST)
    colour = np.array(colours.FLANKS)[flank[which]] * np.array(LEVELS)[level][:, None]
    arrows = rr.Arrows3D.columns(
        origins=(spot - vector)[which],
        vectors=vector[which],
        colors=colour.astype(np.uint8),
        radii=np.array([-2.5, -1.5])[np.minimum(level, 1)],
    )
    marks(rec, f"{root}/impulses", at, counts, [arrows])
    return scale


def lifted(points: np.ndarray, height: float) -> np.ndarray:
    """Return points of the plane in space."""
    return np.column_stack([points, np.full(len(points), height)]).astype(np.float32)


def rounded(value: float) -> float:
    """Return the next number below of the series 1, 2, 5.

    >>> rounded(37.0), rounded(0.019)
    (20.0, 0.01)
    """
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1, 2, 5) if step * power <= value * (1 + 1e-12)))
