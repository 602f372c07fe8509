"""The gears at true scale and the mesh zone with its backlash drawn wider: solids, contacts, gaps, impulses.

rerun is imported on first use; its columns are times, turning transforms, and marks that come and go.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d import palette
from gears3d.extras import Late, require
from gears3d.files import replacing
from gears3d.gears.gear import inv
from gears3d.gears.solids import solid_arrays

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

    from gears3d.views.plots.section import Frames, Motion, Section
else:
    rr = Late("rerun", "a replay", "replay")
    rrb = Late("rerun.blueprint", "a replay", "replay")


def require_rerun() -> None:
    """Refuse early where rerun is not installed."""
    require("rerun", "a replay", "replay")


APPLICATION = "gears3d"
# Of the pictures.
BACKGROUND = [0x16, 0x18, 0x1D]

TIMELINE = "sim_time"
IMPACT = "impact"


@contextmanager
def film(target: Path, arranged: rrb.Blueprint) -> Iterator[rr.RecordingStream]:
    """Open a recording under a temporary name, which is renamed when all is written."""
    with replacing(target) as unfinished:
        try:
            with rr.RecordingStream(APPLICATION) as rec:
                rec.save(unfinished, default_blueprint=arranged)
                yield rec
                rec.flush()
        except RuntimeError as error:  # what the recorder raises when a disk is full
            raise OSError(str(error)) from error


def clock(time: np.ndarray) -> rr.TimeColumn:
    """Return the column of simulated time, whole nanoseconds."""
    return rr.TimeColumn(TIMELINE, duration=np.round(np.asarray(time) * 1e9).astype("timedelta64[ns]"))


def scalars(rec: rr.RecordingStream, entity: str, time: np.ndarray, values: np.ndarray) -> None:
    """Write a curve, or several that share their times."""
    columns = rr.Scalars.columns(scalars=np.ascontiguousarray(values, dtype=np.float64).ravel())
    if values.ndim == 2:
        columns = columns.partition(np.full(len(values), values.shape[1]))
    rec.send_columns(entity, indexes=[clock(time)], columns=columns)


def turn(rec: rr.RecordingStream, entity: str, time: np.ndarray, angle: np.ndarray) -> None:
    """Write a rotation about +z."""
    half = 0.5 * np.mod(angle, 4.0 * np.pi)
    quaternion = np.zeros((len(time), 4), dtype=np.float32)
    quaternion[:, 2], quaternion[:, 3] = np.sin(half), np.cos(half)
    rec.send_columns(entity, indexes=[clock(time)], columns=rr.Transform3D.columns(quaternion=quaternion))


def marks(rec: rr.RecordingStream, entity: str, time: np.ndarray, counts: np.ndarray, columns: Iterable[Any]) -> None:
    """Write marks of which ``counts[i]`` are there from ``time[i]`` on; rows that change nothing are left out."""
    keep = (counts > 0) | (np.r_[1, counts[:-1]] > 0)
    parts = [column.partition(counts[keep]) for column in columns]
    rec.send_columns(entity, indexes=[clock(time[keep])], columns=[c for part in parts for c in part])


def trail(
    time: np.ndarray, life: float, levels: int, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return what is seen of events that fade: a row whenever one comes, fades by a level or goes.

    >>> rows = trail(np.array([0.0, 0.3]), life=0.4, levels=2, most=5)
    >>> [part.tolist() for part in (rows[0].round(3), *rows[1:])]
    [[0.0, 0.2, 0.3, 0.4, 0.5, 0.7], [1, 1, 2, 1, 1, 0], [0, 0, 0, 1, 1, 1], [0, 1, 1, 0, 0, 1]]
    """
    tick = max(round(life / levels * 1e9), 1)
    born = np.round(np.asarray(time) * 1e9).astype(np.int64)
    at = np.unique(born[:, None] + tick * np.arange(levels + 1))
    end = np.searchsorted(born, at, side="right")
    begin = np.maximum(np.searchsorted(born, at - tick * levels, side="right"), end - most)
    counts = end - begin
    which = np.repeat(begin, counts) + np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    level = (np.repeat(at, counts) - born[which]) // tick
    return at * 1e-9, counts, which, level


# The palette as red, green, blue
# By the code of the flank in a recording.
FLANKS = tuple(palette.rgb(colour) for colour in palette.FLANKS)
FLIGHT, TWIN, EXTENDED, FOURTH = map(palette.rgb, (palette.FLIGHT, palette.TWIN, palette.EXTENDED, palette.FOURTH))
# Solids in the light of a scene, and the mark on them.
DRIVE, LOOSE, MARK = (0x8A, 0x94, 0xA0), (0xCF, 0xC6, 0xB2), (0x30, 0x34, 0x3A)
# Measured quantities on the dark plots.
LINE = (0xF0, 0xF0, 0xF0)


# Points on each involute.
POINTS = 9


def tooth(section: Section, which: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return tooth 1 in polar form, from root to tip."""
    gear = (section.pair.drive, section.pair.loose)[which]
    base, alpha, root = section.base_radii[which], section.pair.working_pressure_angle, gear.root_radius * 1e3
    foot = max(base, root)
    roll = np.linspace(np.sqrt((foot / base) ** 2 - 1.0), gear.tip_roll, POINTS)
    lean = inv(alpha) - (roll - np.arctan(roll))
    radius, lean = np.r_[root, base * np.sqrt(1.0 + roll**2)], np.r_[lean[0], lean]
    return radius, lean, -(section.thickness[which] + lean)


def tooth_angles(section: Section, which: int) -> np.ndarray:
    """Return the angles about +z at which the teeth stand, in order of meshing [rad], (teeth,)."""
    teeth = (section.pair.drive, section.pair.loose)[which].teeth
    return (-1.0 if which == 0 else 1.0) * 2.0 * pi / teeth * np.arange(teeth)


def flank_lines(section: Section, which: int, flank: int) -> np.ndarray:
    """Return one kind of flank of all teeth as lines a little above the plane."""
    radius, active, reverse = tooth(section, which)
    angle = (active, reverse)[flank][1:] + tooth_angles(section, which)[:, None]
    x, y = radius[1:] * np.cos(angle), radius[1:] * np.sin(angle)
    return np.stack([x, y, np.full_like(x, 0.15)], axis=-1).astype(np.float32)


def ring(section: Section, which: int, depth: float = 7.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the toothed ring as a flat mesh."""
    gear = (section.pair.drive, section.pair.loose)[which]
    radius, active, reverse = tooth(section, which)
    angle = (np.r_[reverse, active[::-1]] + np.sort(tooth_angles(section, which) % (2.0 * pi))[:, None]).ravel()
    outline = np.tile(np.r_[radius, radius[::-1]], gear.teeth)
    inner = max(radius[0] - depth * gear.module * 1e3, 0.3 * radius[0])
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    i = np.arange(len(outline))
    j, k = np.roll(i, -1), len(outline)
    return np.r_[outline[:, None] * circle, inner * circle], np.r_[np.c_[i, j, i + k], np.c_[j, j + k, i + k]]


SCENE = "/scene"
# How long an impulse is seen while it fades, in pictures of a regular grid: two seconds of the watcher's time.
TRAIL = 50
# Brightness of the arrows of a trail, new ones first.
LEVELS = (1.0, 0.65, 0.4, 0.2)
# Arrows seen at once.
MOST = 4
# How far the facets shown may lie from the flanks [m].
CHORD = 20e-6
_NAMES = ("drive", "loose")


def place_gears(rec: rr.RecordingStream, root: str, section: Section) -> None:
    """Put the axes of both gears in their places."""
    rec.log(root, rr.ViewCoordinates.RIGHT_HAND_Y_UP, static=True)
    for name, x in zip(_NAMES, (0.0, section.pair.centre_distance * 1e3), strict=True):
        rec.log(f"{root}/{name}", rr.Transform3D(translation=[x, 0.0, 0.0]), static=True)


def solids(rec: rr.RecordingStream, section: Section, frames: Frames) -> None:
    """Write both solids and their rotation."""
    place_gears(rec, SCENE, section)
    colour = (DRIVE, LOOSE)
    for which, name in enumerate(_NAMES):
        vertices, faces, normals = solid_arrays(section.pair, name, CHORD, 5.0 * CHORD)
        rec.log(
            f"{SCENE}/{name}/body",
            rr.Mesh3D(
                vertex_positions=(vertices * 1e3).astype(np.float32),
                triangle_indices=faces.astype(np.uint32),
                vertex_normals=normals.astype(np.float32),
                albedo_factor=[*colour[which], 255],
            ),
            static=True,
        )
        rec.log(f"{SCENE}/{name}/body/mark", _mark(section, which), static=True)
        angle = frames.drive if which == 0 else pi - frames.loose
        turn(rec, f"{SCENE}/{name}/body", frames.time, angle)


def _mark(section: Section, which: int) -> rr.LineStrips3D:
    """A hub and a line to tooth 1 on the end face, by which the eye sees the gear turn."""
    gear = (section.pair.drive, section.pair.loose)[which]
    height, root = 0.502e3 * gear.face_width, gear.root_radius * 1e3
    angle = np.linspace(0.0, 2.0 * pi, 73)
    inner = max(0.12 * root, 0.6e3 * (gear.bore or 0.0))
    hub = inner * np.column_stack([np.cos(angle), np.sin(angle)])
    line = np.array([[inner, 0.0], [0.96 * root, 0.0]])
    return rr.LineStrips3D([lifted(hub, height), lifted(line, height)], colors=[MARK], radii=[-1.5])


def contacts(
    rec: rr.RecordingStream, root: str, section: Section, frames: Frames, height: float, reach: float, size: float
) -> None:
    """Write the points where teeth touch and their common normals; nothing is there in flight."""
    row, _, travel = section.touching(frames.drive, frames.flank)
    flank = frames.flank[row]
    counts = np.bincount(row, minlength=len(frames.time))
    spot = lifted(section.point(travel, flank), height)
    along = lifted(section.normal(flank), 0.0) * reach
    colour = np.array(FLANKS, dtype=np.uint8)[flank]
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
    colour = np.array(FLANKS)[flank[which]] * np.array(LEVELS)[level][:, None]
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


ZONE = "/zone"
_GEARS = ("drive", "loose")


def zone_gears(rec: rr.RecordingStream, section: Section, frames: Frames, root: str = ZONE) -> None:
    """Write both gears' transverse sections and their rotation."""
    place_gears(rec, root, section)
    for which, name in enumerate(_GEARS):
        vertices, faces = ring(section, which)
        rec.log(
            f"{root}/{name}/body",
            rr.Mesh3D(
                vertex_positions=lifted(vertices, 0.0),
                triangle_indices=faces.astype(np.uint32),
                vertex_normals=np.tile(np.array([0, 0, 1], dtype=np.float32), (len(vertices), 1)),
                albedo_factor=[*(DRIVE, LOOSE)[which], 255],
            ),
            static=True,
        )
        for flank, word in enumerate(("active", "reverse")):
            strips = flank_lines(section, which, flank)
            rec.log(
                f"{root}/{name}/body/{word}",
                rr.LineStrips3D(strips, colors=[FLANKS[flank]], radii=[-1.8]),
                static=True,
            )
    base = section.base_radii
    loose = (base[0] * frames.drive + frames.share * section.backlash) / base[1]
    turn(rec, f"{root}/drive/body", frames.time, frames.drive)
    turn(rec, f"{root}/loose/body", frames.time, pi - loose)


def lines_of_action(rec: rr.RecordingStream, section: Section, root: str = ZONE) -> None:
    """Write the paths of contact of both flanks as thin lines."""
    for flank, word in enumerate(("active", "reverse")):
        ends = np.array(section.path) if flank == 0 else -np.array(section.path)
        strip = lifted(section.point(ends, np.full(2, flank)), 0.2)
        rec.log(
            f"{root}/path_of_contact/{word}",
            rr.LineStrips3D([strip], colors=[FLANKS[flank]], radii=[-0.7]),
            static=True,
        )


def zone_gaps(rec: rr.RecordingStream, section: Section, frames: Frames, root: str = ZONE) -> None:
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
    rec.log(f"{root}/gaps", rr.LineStrips3D.from_fields(colors=[FLIGHT], radii=[-2.5]), static=True)
    columns = rr.LineStrips3D.columns(strips=np.stack(strips, axis=1).reshape(-1, 2, 3))
    marks(rec, f"{root}/gaps", frames.time, np.where(frames.flank < 0, 2, 0), [columns])
