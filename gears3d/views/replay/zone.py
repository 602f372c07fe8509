"""The mesh zone with its backlash drawn wider, so that the eye sees the loose gear travel between the flanks."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.views.plots import colours
from gears3d.views.replay.outline import flank_lines, ring
from gears3d.views.replay.scene import lifted, place
from gears3d.views.replay.sdk import rr
from gears3d.views.replay.write import marks, turn

if TYPE_CHECKING:
    from gears3d.views.plots.motion import Frames
    from gears3d.views.plots.teeth import Section

ROOT = "/zone"
_NAMES = ("drive", "loose")


def gears(rec: rr.RecordingStream, section: Section, frames: Frames, root: str = ROOT) -> None:
    """Write both gears' transverse sections and their rotation."""
    place(rec, root, section)
    for which, name in enumerate(_NAMES):
        vertices, faces = ring(section, which)
        rec.log(
            f"{root}/{name}/body",
            rr.Mesh3D(
                vertex_positions=lifted(vertices, 0.0),
                triangle_indices=faces.astype(np.uint32),
                vertex_normals=np.tile(np.array([0, 0, 1], dtype=np.float32), (len(vertices), 1)),
                albedo_factor=[*(colours.DRIVE, colours.LOOSE)[which], 255],
            ),
            static=True,
        )
        for flank, word in enumerate(("active", "reverse")):
            strips = flank_lines(section, which, flank)
            rec.log(
                f"{root}/{name}/body/{word}",
                rr.LineStrips3D(strips, colors=[colours.FLANKS[flank]], radii=[-1.8]),
                static=True,
            )
    base = section.base_radii
    loose = (base[0] * frames.drive + frames.share * section.backlash) / base[1]
    turn(rec, f"{root}/drive/body", frames.time, frames.drive)
    turn(rec, f"{root}/loose/body", frames.time, pi - loose)


def lines_of_action(rec: rr.RecordingStream, section: Section, root: str = ROOT) -> None:
    """Write the paths of contact of both flanks as thin lines."""
    for flank, word in enumerate(("active", "reverse")):
        ends = np.array(section.path) if flank == 0 else -np.array(section.path)
        strip = lifted(section.point(ends, np.full(2, flank)), 0.2)
        rec.log(
            f"{root}/path_of_contact/{word}",
            rr.LineStrips3D([strip], colors=[colours.FLANKS[flank]], radii=[-0.7]),
            static=True,
        )


def gaps(rec: rr.RecordingStream, section: Section, frames: Frames, root: str = ROOT) -> None:
    """Write both gaps of a flight: from the drive's flank to the loose gear's, along the lines of action."""
    flight = np.flatnonzero(frames.flank < 0)
    if not len(flight):
        return
    strips = []
    for flank, share in ((0, frames.share[flight]), (1, 1.0 - frames.share[flight])):
        code = np.full(len(flight), flank)
        travel = section.meeting(frames.drive[flight], code, np.zeros(len(flight), dtype=int))
        foot = section.point(travel, code)
        head = foot + (share * section.backlash)[:, None] * section.normal(code)
        strips.append(np.stack([lifted(foot, 0.25), lifted(head, 0.25)], axis=1))
    rec.log(f"{root}/gaps", rr.LineStrips3D.from_fields(colors=[colours.FLIGHT], radii=[-2.5]), static=True)
    columns = rr.LineStrips3D.columns(strips=np.stack(strips, axis=1).reshape(-1, 2, 3))
    marks(rec, f"{root}/gaps", frames.time, np.where(frames.flank < 0, 2, 0), [columns])
