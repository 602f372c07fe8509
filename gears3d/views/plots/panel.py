"""The mesh as the camera sees it: gears in section, what touches, the gaps, the numbers of the teeth, a scale."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import atan, cos, hypot, pi, sin
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d import palette
from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.gears.deviation import GEARS
from gears3d.gears.outline import Outline, outline
from gears3d.palette import EDGE
from gears3d.recording import FLANKS
from gears3d.views.plots.teeth import Section, widened, widening

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from gears3d.gears import Pair

ZOOMS = {"mesh": 3.0, "tooth": 1.5, "gears": 0.0}
"""Height of the picture in pitches; 0 for both gears whole."""
SHAPE = 1.25
"""Width over height of a picture, as of 800 by 640 pixels."""


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


CHORD = 1e-4
"""Largest distance of a drawn flank from the flank, in heights of the picture."""
_SHARPEST = 0.05
"""Part of its width that a tip keeps."""


def _tip(pair: Pair, which: str) -> float:
    """Angle that a tooth spans at its tip [rad]."""
    roll = pair.gear(which).tip_roll
    return 2.0 * (pair.half_angle(which) - (roll - atan(roll)))


WORDS = {0: "active flanks touch", 1: "reverse flanks touch", -1: "free flight"}
"""What a picture shows, by the code of the flank."""


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
