"""The mesh in pictures: the teeth in transverse section, where they are at which instant, and how they are painted.

Lengths of the section are in mm, the drive gear's axis is at the origin, the loose gear's at (centre_distance, 0) and
teeth meet at the pitch point moving along +y. The backlash is drawn wider where it would not be seen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import atan, cos, hypot, pi, sin, tan
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d import palette
from gears3d.effects import Code
from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.gears.deviation import GEARS
from gears3d.gears.gear import inv
from gears3d.gears.outline import Outline, outline
from gears3d.palette import EDGE
from gears3d.recording import FLANKS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from gears3d.effects import Row
    from gears3d.gears import Pair
    from gears3d.recording import Recording

MM = 1e3
_FACTORS = np.array([1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 25, 30, 40, 50, 80, 100, 150, 200, 300, 500, 1000])


@dataclass(frozen=True)
class Section:
    """Transverse section of a pair, its backlash drawn ``factor`` times as wide.

    The reverse flanks are moved into the teeth, each gear's by half, so the pair drawn is an exact pair of the wider
    backlash; its active flanks stay where they are.

    Args:
        pair: the gears.
        factor: drawn backlash / backlash.
    """

    pair: Pair
    factor: float = 1.0

    @cached_property
    def base_radii(self) -> tuple[float, float]:
        """Base radii of drive and loose gear [mm]."""
        return self.pair.drive.base_radius * MM, self.pair.loose.base_radius * MM

    @cached_property
    def base_pitch(self) -> float:
        """Distance of neighbouring flanks along the line of action [mm]."""
        return self.pair.drive.base_pitch * MM

    @cached_property
    def backlash(self) -> float:
        """Width of the dead band as drawn [mm]."""
        return self.pair.backlash * MM * self.factor

    @cached_property
    def pitch_point(self) -> tuple[float, float]:
        """Pitch point (x, y) [mm]."""
        return self.base_radii[0] / cos(self.pair.working_pressure_angle), 0.0

    @cached_property
    def thickness(self) -> tuple[float, float]:
        """Tooth thickness angle of drive and loose gear at the working pitch circle, as drawn [rad].

        Source: ISO 21771:2007, the thicknesses and the backlash fill the working pitch.
        """
        alpha = self.pair.working_pressure_angle
        full = [2.0 * (gear.base_half_angle - inv(alpha)) for gear in (self.pair.drive, self.pair.loose)]
        surplus = sum(a * rb for a, rb in zip(full, self.base_radii, strict=True)) + self.backlash - self.base_pitch
        drive, loose = (a - 0.5 * surplus / rb for a, rb in zip(full, self.base_radii, strict=True))
        return drive, loose

    @cached_property
    def path(self) -> tuple[float, float]:
        """Ends of the path of contact along the line of action, from the pitch point [mm], in order of travel."""
        alpha = self.pair.working_pressure_angle
        ends = [gear.base_radius * MM * (gear.tip_roll - tan(alpha)) for gear in (self.pair.drive, self.pair.loose)]
        return -ends[1], ends[0]

    def normal(self, flank: np.ndarray | int) -> np.ndarray:
        """Return the unit normal of the drive's flank where it touches, (n, 2)."""
        alpha = self.pair.working_pressure_angle
        return np.array([[sin(alpha), cos(alpha)], [sin(alpha), -cos(alpha)]])[flank]

    def travel(self, angle: np.ndarray, flank: np.ndarray | int) -> np.ndarray:
        """Return how far tooth 1 of the drive has come along the line of action, 0 at the pitch point [mm]."""
        return self.base_radii[0] * (angle - np.asarray(flank) * self.thickness[0])

    def point(self, travel: np.ndarray, flank: np.ndarray | int) -> np.ndarray:
        """Return the point of the line of action where a flank has come to, (n, 2) [mm]."""
        sign = np.where(np.asarray(flank) == 0, 1.0, -1.0)
        return np.asarray(self.pitch_point) + (sign * travel)[..., None] * self.normal(flank)

    def touching(self, angle: np.ndarray, flank: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the teeth that meet on the path of contact."""
        safe = np.maximum(flank, 0)
        start, end = self._ends(safe)
        come = self.travel(angle, safe)
        first = np.ceil((come - end) / self.base_pitch).astype(int)
        most = int(np.ceil((self.path[1] - self.path[0]) / self.base_pitch))
        tooth = first[:, None] + np.arange(most)
        travel = come[:, None] - tooth * self.base_pitch
        row, column = np.nonzero((travel >= start[:, None]) & (flank >= 0)[:, None])
        return row, tooth[row, column], travel[row, column]

    def meeting(self, angle: np.ndarray, flank: np.ndarray, tooth: np.ndarray) -> np.ndarray:
        """Return the travel of a given tooth of the drive, in the turn in which it is nearest to the pitch point."""
        teeth = self.pair.drive.teeth
        come = self.travel(angle, flank) / self.base_pitch
        nearest = np.round(come)
        off = np.mod(tooth - 1 - nearest + teeth // 2, teeth) - teeth // 2
        return (come - nearest - np.where((tooth > 0) & (np.abs(off) <= 2), off, 0.0)) * self.base_pitch

    def _ends(self, flank: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ends of the path in order of travel: the reverse flanks run it from tip to root."""
        start, end = self.path
        return np.where(flank == 0, start, -end), np.where(flank == 0, end, -start)


def widened(pair: Pair, factor: float) -> Pair:
    """Return a pair with ``factor`` times the backlash, by thinner teeth whose active flanks stay where they are."""
    return replace(pair, thinning=pair.thinning + 0.5 * (factor - 1.0) * pair.backlash)


def widening(pair: Pair) -> float:
    """Return by which factor to draw the backlash so that the eye sees it: about 20 % of the base pitch."""
    tips = []
    for gear in (pair.drive, pair.loose):
        roll = gear.tip_roll
        tips.append(2.0 * (gear.base_half_angle - (roll - np.arctan(roll))) * gear.base_radius)
    room = pair.backlash + 2.0 * 0.6 * min(tips)
    wanted = min(0.2 * pair.drive.base_pitch, room) / max(pair.backlash, 1e-12)
    return float(_FACTORS[max(int(np.searchsorted(_FACTORS, wanted, "right")) - 1, 0)])


# Frames per second of simulated time: at least, at most.
FRAME_RATE = (500.0, 4000.0)
FRAMES_PER_PITCH = 24  # A tooth then moves by less than its thickness between two pictures
# Samples per second that plots keep away from impacts.
PLOT_RATE = 4000.0


@dataclass(frozen=True)
class Motion:
    """A recording together with the flanks it moves between.

    Args:
        recording: what moves.
        section: the teeth, for the contacts of the true pair.
        rows: the effects' normal forms; flank deviations among them move the flanks.
        near: gap below which noise lets flanks be shown as touching at least [m].
    """

    recording: Recording
    section: Section
    rows: tuple[Row, ...] = ()
    near: float = 0.0

    @cached_property
    def displacement(self) -> np.ndarray:
        """Displacement along the line of action at the samples [m], (n,)."""
        return self.recording.signals["displacement_m"]

    @cached_property
    def tolerance(self) -> float:
        """Gap below which flanks are shown as touching [m]."""
        return max(1e-3 * self.section.pair.backlash, 1e-7, self.near)

    def at(self, time: np.ndarray, name: str) -> np.ndarray:
        """Return a signal between its samples, (m,)."""
        return np.interp(time, self.recording.time, self.recording.signals[name])

    def frame_times(self) -> np.ndarray:
        """Return the instants of the pictures: a regular grid and every impact [s], ascending."""
        time = self.recording.time
        if len(time) < 2:
            return time.copy()
        grid = np.arange(time[0], time[-1], 1.0 / self.frame_rate())
        hits = self.recording.impacts["time_s"]
        return np.union1d(np.append(grid, time[-1]), hits[(hits >= time[0]) & (hits <= time[-1])])

    def frame_rate(self) -> float:
        """Return regular frames per second of simulated time, enough to see each tooth pass."""
        time, angle = self.recording.time, self.recording.signals["theta_drive_rad"]
        pitches = abs(angle[-1] - angle[0]) * self.section.pair.drive.teeth / (2.0 * np.pi)
        return float(np.clip(FRAMES_PER_PITCH * pitches / max(time[-1] - time[0], 1e-9), *FRAME_RATE))

    def plot_rows(self) -> np.ndarray:
        """Return the samples that plots keep: all near an impact, elsewhere about PLOT_RATE per second."""
        time = self.recording.time
        if len(time) < 3:
            return np.arange(len(time))
        step = max(round((len(time) - 1) / max(time[-1] - time[0], 1e-12) / PLOT_RATE), 1)
        keep = np.zeros(len(time), dtype=bool)
        keep[::step] = keep[-1] = True
        after = np.searchsorted(time, self.recording.impacts["time_s"])
        for offset in (-2, -1, 0, 1):
            keep[np.clip(after + offset, 0, len(time) - 1)] = True
        return np.flatnonzero(keep)

    def flanks(self, drive: np.ndarray, loose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the displacement at which the loose gear lies on its active and on its reverse flank [m]."""
        material = [np.zeros(len(drive)), np.zeros(len(drive))]
        angles = (drive, loose)
        teeth = [row.p for row in self.rows if row.code == Code.FLANK_TOOTH]
        for row in self.rows:
            if row.code == Code.FLANK_HARMONIC:
                gear, flank, order, amplitude, phase = row.p[:5]
                material[int(flank)] += amplitude * np.cos(order * angles[int(gear)] + phase)
        for flank in (0, 1):
            material[flank] += self._of_teeth(drive, flank, [p for p in teeth if int(p[1]) == flank])
        return material[0], self.section.pair.backlash - material[1]

    def _of_teeth(self, drive: np.ndarray, flank: int, rows: list[tuple[float, ...]]) -> np.ndarray:
        """Largest deviation among the tooth pairs on the path of contact."""
        if not rows:
            return np.zeros(len(drive))
        pair = self.section.pair
        row, tooth, _ = self.section.touching(drive, np.full(len(drive), flank))
        excess = np.zeros(len(tooth))
        for gear, _flank, number, offset in (p[:4] for p in rows):
            teeth = (pair.drive, pair.loose)[int(gear)].teeth
            excess += np.where(np.mod(tooth, teeth) == int(number) - 1, offset, 0.0)
        most = np.full(len(drive), -np.inf)
        np.maximum.at(most, row, excess)
        return np.where(np.isfinite(most), most, 0.0)


@dataclass(frozen=True)
class Frames:
    """The pair at the instants of the pictures.

    Args:
        time: [s], (n,).
        drive: angle of the drive gear [rad], (n,).
        loose: angle of the loose gear [rad], (n,).
        share: displacement from the active flank as a share of the backlash, 0 active to 1 reverse, (n,).
        flank: 0 active or 1 reverse flank touches, -1 flight, (n,).
    """

    time: np.ndarray
    drive: np.ndarray
    loose: np.ndarray
    share: np.ndarray
    flank: np.ndarray


def frames(motion: Motion, time: np.ndarray | None = None) -> Frames:
    """Return the pair at every instant that is shown."""
    time = motion.frame_times() if time is None else time
    drive, loose = (motion.at(time, f"theta_{gear}_rad") for gear in ("drive", "loose"))
    displacement = motion.at(time, "displacement_m")
    active, reverse = motion.flanks(drive, loose)
    flank = states(displacement, active, reverse, motion.tolerance)
    if "state" in motion.recording.signals:
        flank = _recorded(motion.recording, time)
    impacts = motion.recording.impacts
    here = np.searchsorted(time, impacts["time_s"])
    inside = (here < len(time)) & (time[np.minimum(here, len(time) - 1)] == impacts["time_s"])
    flank[here[inside]] = impacts["flank"][inside]
    share = np.clip((displacement - active) / np.maximum(reverse - active, 1e-12), 0.0, 1.0)
    share = np.where(flank == 0, 0.0, np.where(flank == 1, 1.0, share))
    return Frames(time, drive, loose, share, flank)


def _recorded(recording: Recording, time: np.ndarray) -> np.ndarray:
    """Return the state that a measurement wrote down at the nearest sample: 0 active, 1 reverse, -1 flight, (n,)."""
    own = recording.time
    after = np.clip(np.searchsorted(own, time), 1, len(own) - 1)
    nearest = after - (time - own[after - 1] < own[after] - time)
    state = recording.signals["state"][nearest]
    return np.where(state == 0, 0, np.where(state == 1, 1, -1))


def is_measured(recording: Recording) -> bool:
    """Return whether a recording was measured: effects of a rig's scenario have no known phase in it."""
    return recording.meta.get("model") == "measured"


def as_measured(pair: Pair, recording: Recording) -> Pair:
    """Return a pair with the backlash that a measurement found, by thinner or thicker teeth; others as they are."""
    found = recording.meta.get("backlash_m")
    if not is_measured(recording) or not found or found <= 0.0:
        return pair
    return replace(pair, thinning=pair.thinning + 0.5 * (found - pair.backlash))


def states(displacement: np.ndarray, active: np.ndarray, reverse: np.ndarray, tolerance: float) -> np.ndarray:
    """Return which flank touches: 0 active, 1 reverse, -1 none, (n,).

    >>> import numpy as np
    >>> states(np.array([0.0, 5e-5, 1e-4]), np.zeros(3), np.full(3, 1e-4), 1e-6).tolist()
    [0, -1, 1]
    """
    return np.where(displacement - active <= tolerance, 0, np.where(reverse - displacement <= tolerance, 1, -1))


# Height of the picture in pitches; 0 for both gears whole.
ZOOMS = {"mesh": 3.0, "tooth": 1.5, "gears": 0.0}
# Width over height of a picture, as of 800 by 640 pixels.
SHAPE = 1.25


@dataclass(frozen=True)
class Look:
    """What the camera is set to.

    Args:
        pair: the gears.
        exaggerate: drawn gap over gap; ``None`` for a round number with which it is seen.
        zoom: ``"mesh"``, ``"tooth"`` or ``"gears"``.
        backlit: dark gears before a light, as the camera of Rigaud & Perret-Liaudet 2020 has them, without colours.
        drive_right: the drive gear on the right, as there.
        teeth: numbers of the gears' own teeth in place of those of the pairs.

    Raises:
        InputError: no zoom of that name, or teeth too thin for that gap.
    """

    pair: Pair
    exaggerate: float | None = None
    zoom: str = "mesh"
    backlit: bool = False
    drive_right: bool = False
    teeth: bool = False

    def __post_init__(self) -> None:
        if self.zoom not in ZOOMS:
            raise InputError(Fault("zoom", f"is {self.zoom!r}", did_you_mean(self.zoom, list(ZOOMS))))
        if self.exaggerate is not None and not self.exaggerate >= 1.0:
            raise InputError(Fault("exaggerate", f"is {self.exaggerate:g}", "give 1 (true scale) or more, or auto"))
        if self.factor > 1.0 and any(_tip(self.wide, which) < _SHARPEST * _tip(self.pair, which) for which in GEARS):
            what = f"is {self.factor:g}: nothing would be left of the teeth"
            raise InputError(Fault("exaggerate", what, f"give less; auto takes {widening(self.pair):g}"))

    @property
    def factor(self) -> float:
        """Drawn gap over gap."""
        return widening(self.pair) if self.exaggerate is None else self.exaggerate

    @cached_property
    def wide(self) -> Pair:
        """The pair with its backlash as wide as drawn, by thinner teeth whose active flanks stay where they are."""
        return widened(self.pair, self.factor)

    @cached_property
    def section(self) -> Section:
        """The same for contacts and gaps."""
        return Section(self.pair, self.factor)

    @property
    def half(self) -> tuple[float, float]:
        """Half width and half height of a picture [m]."""
        if not ZOOMS[self.zoom]:
            tips = self.pair.drive.tip_radius, self.pair.loose.tip_radius
            return 0.515 * (self.pair.centre_distance + sum(tips)), 1.03 * max(tips)
        pitch = self.pair.drive.base_pitch / cos(self.pair.working_pressure_angle)
        high = 0.5 * ZOOMS[self.zoom] * pitch
        return SHAPE * high, high

    @property
    def centre(self) -> tuple[float, float]:
        """Middle of the picture [m], in the frame of the section: the pitch point, or the middle of both gears."""
        if ZOOMS[self.zoom]:
            return self.section.pitch_point[0] * 1e-3, 0.0
        drive, loose = self.pair.drive.tip_radius, self.pair.loose.tip_radius
        return 0.5 * (self.pair.centre_distance + loose - drive), 0.0

    @property
    def turn(self) -> float:
        """Angle by which all is turned, so that the drive gear stands where it is wanted [rad]."""
        return pi if self.drive_right else 0.0

    @cached_property
    def outlines(self) -> tuple[Outline, Outline]:
        """Sections of both gears as drawn, each in its own frame."""
        fine = CHORD * 2.0 * self.half[1]
        return outline(self.wide, "drive", fine), outline(self.wide, "loose", fine)


# Largest distance of a drawn flank from the flank, in heights of the picture.
CHORD = 1e-4
# Part of its width that a tip keeps.
_SHARPEST = 0.05


def _tip(pair: Pair, which: str) -> float:
    """Angle that a tooth spans at its tip [rad]."""
    roll = pair.gear(which).tip_roll
    return 2.0 * (pair.half_angle(which) - (roll - atan(roll)))


# What a picture shows, by the code of the flank.
WORDS = {0: "active flanks touch", 1: "reverse flanks touch", -1: "free flight"}


class Shot(NamedTuple):
    """One picture.

    Args:
        time: [s].
        after: since the first picture [s].
        drive: angle of the drive gear [rad].
        share: way from the active to the reverse flank, 0 to 1.
        flank: 0 active or 1 reverse flanks touch, -1 free flight.
        gaps: at the active and at the reverse flanks along the line of action [m].
        first: number that the gear's own tooth 1 has among the pairs, which count from the first picture.
        place: number of the pair at the pitch point, a fraction between two.
        pairs: numbers of the pairs in the picture's middle, one or two.
    """

    time: float
    after: float
    drive: float
    share: float
    flank: int
    gaps: tuple[float, float]
    first: int
    place: float
    pairs: tuple[int, ...]

    @property
    def state(self) -> str:
        """``"active"``, ``"reverse"`` or ``"flight"``."""
        return FLANKS[self.flank] if self.flank >= 0 else "flight"


BLACK = "#0b0b0c"
FACES = (palette.DRIVE, palette.LOOSE)
_BACK: dict[str, Any] = {"boxstyle": "square,pad=0.25", "linewidth": 0, "alpha": 0.75, "facecolor": "white"}
_NAMES = ("drive", "loose")


def colour_of(flank: int) -> str:
    """Return the colour of a state."""
    return palette.FLIGHT if flank < 0 else palette.FLANKS[flank]


class _Gear(NamedTuple):
    """A gear as it stands in a picture.

    Args:
        teeth: outlines of the teeth in or near the picture [mm], (k, n, 2), side by side.
        numbers: their places in the order of meshing, tooth 1 is 0, (k,).
        whole: whether these are all.
        axis: of the gear [mm].
    """

    teeth: np.ndarray
    numbers: np.ndarray
    whole: bool
    axis: np.ndarray


def paint(axes: Axes, look: Look, shot: Shot, small: float = 1.0) -> None:
    """Draw one picture."""
    half = 1e3 * np.array(look.half)
    axes.set(xlim=(-half[0], half[0]), ylim=(-half[1], half[1]), xticks=[], yticks=[], aspect="equal")
    for spine in axes.spines.values():
        spine.set(visible=True, color="#888888", linewidth=0.8)
    if look.backlit:
        axes.imshow(_light(), extent=(-half[0], half[0], -half[1], half[1]), cmap="gray", vmin=0, vmax=1, zorder=0)
    gears = _gear(look, shot, 0), _gear(look, shot, 1)
    for which, gear in enumerate(gears):
        _body(axes, gear, BLACK if look.backlit else FACES[which], None if look.backlit else EDGE, small)
    if not look.backlit:
        _touching(axes, look, shot, gears, small)
        _gaps(axes, look, shot, small)
    for which, gear in enumerate(gears):
        if look.zoom == "gears":
            _mark(axes, look, gear, which)
        else:
            _numbers(axes, look, shot, gear, which, small)
    _bar(axes, look, small)
    _told(axes, look, shot, small)


def _gear(look: Look, shot: Shot, which: int) -> _Gear:
    """Return a gear in the picture's frame: its middle at the origin, in mm."""
    name, pair = _NAMES[which], look.wide
    angle = shot.drive
    if which == 1:
        angle = (pair.drive.base_radius * shot.drive + shot.share * pair.backlash) / pair.loose.base_radius
    turn, gear = pair.rotation(name, angle), pair.gear(name)
    sense = 1 if which == 0 else -1
    points = look.outlines[which].points
    middle = 0.0 if which == 0 else pi  # where the mate stands
    order = -sense * np.arange(gear.teeth)  # place of each outline in the order of meshing
    stands = np.arctan2(*np.flip(points.mean(axis=1), axis=1).T) + turn
    off = np.mod(stands - middle + pi, 2.0 * pi) - pi
    seen = np.flatnonzero(np.abs(off) * gear.root_radius < 1.3 * hypot(*look.half) + pi * gear.module)
    whole = look.zoom == "gears" or len(seen) >= gear.teeth - 1
    seen = np.arange(gear.teeth) if whole else seen[np.argsort(off[seen])]
    axis = np.array(pair.centre(name)[:2])
    turns = np.round((angle * gear.teeth / (2.0 * pi) - order[seen]) / gear.teeth).astype(int)
    return _Gear(_framed(look, _rotated(points[seen], turn) + axis), order[seen] + turns * gear.teeth, whole,
                 _framed(look, axis[None])[0])  # fmt: skip


def _rotated(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = cos(angle), sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def _framed(look: Look, points: np.ndarray) -> np.ndarray:
    """Return points of the section [m] in the picture's frame [mm]."""
    return 1e3 * _rotated(points - np.array(look.centre), look.turn)


def _spot(look: Look, points: np.ndarray) -> np.ndarray:
    """Return points of the section [mm] in the picture's frame [mm]."""
    return _framed(look, 1e-3 * points)


def _body(axes: Axes, gear: _Gear, face: str, edge: str | None, small: float) -> None:
    line = gear.teeth.reshape(-1, 2)
    shape = line if gear.whole else np.vstack([line, gear.axis])
    axes.fill(*shape.T, facecolor=face, edgecolor="none", zorder=2)
    if edge is not None:
        shown = np.vstack([line, line[:1]]) if gear.whole else line
        axes.plot(*shown.T, color=edge, linewidth=0.9 * small, zorder=3, solid_joinstyle="round")


def _touching(axes: Axes, look: Look, shot: Shot, gears: tuple[_Gear, _Gear], small: float) -> None:
    """Mark the flanks that touch and the points where they do."""
    if shot.flank < 0:
        return
    section, flank = look.section, np.array([shot.flank])
    _, teeth, travel = section.touching(np.array([shot.drive]), flank)
    colour = colour_of(shot.flank)
    for which, gear in enumerate(gears):
        mates = teeth + (1 if which == 1 and shot.flank == 1 else 0)
        for points in gear.teeth[np.isin(gear.numbers, mates)]:
            axes.plot(*points[_side(look, which, shot.flank)].T, color=colour, linewidth=2.6 * small, zorder=4)
    spots = _spot(look, section.point(travel, np.full(len(travel), shot.flank)))
    dot = {"markersize": 7 * small, "markeredgewidth": 2 * small, "markeredgecolor": colour, "color": "white"}
    axes.plot(*spots.T, "o", zorder=6, **dot)


def _side(look: Look, which: int, flank: int) -> slice:
    """Return where a flank stands in the outline of a tooth."""
    shape = look.outlines[which]
    begin = shape.root + shape.fillet
    if flank == 0:
        begin += shape.flank + shape.tip
    return slice(begin, begin + shape.flank + 1)


def _gaps(axes: Axes, look: Look, shot: Shot, small: float) -> None:
    """Mark both gaps of a flight along the lines of action."""
    if shot.flank >= 0:
        return
    section, none = look.section, np.zeros(1, dtype=int)
    for flank, share in ((0, shot.share), (1, 1.0 - shot.share)):
        code = np.array([flank])
        foot = section.point(section.meeting(np.array([shot.drive]), code, none), code)
        head = foot + share * section.backlash * section.normal(code)
        ends = _spot(look, np.vstack([foot, head]))
        axes.plot(*ends.T, color=colour_of(-1), linewidth=4.0 * small, solid_capstyle="butt", zorder=5)


def _numbers(axes: Axes, look: Look, shot: Shot, gear: _Gear, which: int, small: float) -> None:
    """Write the numbers of the teeth on them, those in the picture's middle bold."""
    half = 0.94e3 * np.array(look.half)
    teeth = (look.pair.drive, look.pair.loose)[which].teeth
    for points, number in zip(gear.teeth, gear.numbers, strict=True):
        away = np.hypot(*(points - gear.axis).T)
        upper = points[away > 0.5 * (away.min() + away.max())].mean(axis=0) - gear.axis
        spot = gear.axis + upper * (0.42 * away.min() + 0.58 * away.max()) / hypot(*upper)
        if np.any(np.abs(spot) > half - 0.25):
            continue
        pair = int(number) + shot.first
        shown = int(number) % teeth + 1 if look.teeth else pair
        named = pair in shot.pairs
        colour = ("#f4f4f4" if named else "#8a8a8a") if look.backlit else ("#000000" if named else "#666a70")
        axes.text(spot[0], spot[1], str(shown), ha="center", va="center", fontsize=(10 if named else 7.5) * small,
                  fontweight="bold" if named else "normal", color=colour, zorder=7)  # fmt: skip


def _bar(axes: Axes, look: Look, small: float) -> None:
    """Draw a scale of true length for all but the gap."""
    half = 1e3 * np.array(look.half)
    power = 10.0 ** np.floor(np.log10(0.5 * half[0]))
    length = float(power * max(step for step in (1, 2, 5) if step * power <= 0.5 * half[0]))
    x, y = 0.94 * half[0], -0.90 * half[1]
    axes.plot([x - length, x], [y, y], color="black", linewidth=5 * small, solid_capstyle="butt", zorder=8)
    axes.plot([x - length, x], [y, y], color="white", linewidth=2 * small, solid_capstyle="butt", zorder=9)
    axes.text(x - 0.5 * length, y + 0.045 * half[1], f"{length:g} mm", ha="center", va="bottom", fontsize=7 * small,
              zorder=9, bbox=_BACK)  # fmt: skip


def _told(axes: Axes, look: Look, shot: Shot, small: float) -> None:
    """Write the gaps of a flight."""
    if shot.flank >= 0:
        return
    half = 1e3 * np.array(look.half)
    active, reverse = (f"{1e6 * gap:.3g}" for gap in shot.gaps)
    axes.text(-0.95 * half[0], -0.93 * half[1], f"gaps {active} + {reverse} µm", fontsize=7.5 * small, color=EDGE,
              va="bottom", zorder=9, bbox=_BACK)  # fmt: skip


def name(axes: Axes, look: Look) -> None:
    """Say which gear is which, and how they turn."""
    half = 1e3 * np.array(look.half)
    side = 1.0 if look.drive_right else -1.0
    for word, x in (("drive", side), ("loose", -side)):
        if look.zoom == "gears":
            axis = _framed(look, np.array(look.pair.centre(word)[:2])[None])[0]
            axes.text(axis[0], axis[1], word, fontsize=10, color=EDGE, ha="center", va="center", zorder=9, bbox=_BACK)
            continue
        where = 0.80 * x * half[0]
        axes.text(where, 0.86 * half[1], word, fontsize=9, color=EDGE, ha="center", va="center", zorder=9, bbox=_BACK)
        low, high = 0.40 * half[1], 0.70 * half[1]
        begin, end = (high, low) if look.drive_right else (low, high)
        arrow = {"arrowstyle": "-|>", "color": "#f4f4f4" if look.backlit else EDGE, "linewidth": 1.4}
        axes.annotate("", (where, end), (where, begin), arrowprops=arrow)


def _mark(axes: Axes, look: Look, gear: _Gear, which: int) -> None:
    """Draw a line to tooth 1, by which the eye sees a whole gear turn."""
    teeth = (look.pair.drive, look.pair.loose)[which].teeth
    root = gear.teeth[int(np.flatnonzero(gear.numbers % teeth == 0)[0])].mean(axis=0)
    ends = gear.axis + np.array([[0.35], [0.93]]) * (root - gear.axis)
    axes.plot(*ends.T, color="#f4f4f4" if look.backlit else EDGE, linewidth=1.4, zorder=4)


def _light() -> np.ndarray:
    """Return the light behind the gears: bright in the middle, with the grain of a sensor, the same every time."""
    y, x = np.mgrid[-1:1:128j, -1:1:160j]
    grain = np.random.default_rng(8).normal(0.0, 0.012, x.shape)
    return np.clip(0.93 - 0.22 * (x**2 + y**2) + grain, 0.0, 1.0)
