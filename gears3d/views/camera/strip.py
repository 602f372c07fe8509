"""The strip: pictures of the mesh over a period, and below them the gap over time; as a figure, or as SVG for pages.

Both are drawn by the same calls: SVG has axes of its own, since matplotlib takes a second to load and to draw what a
page shows at any size as lines.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from html import escape
from io import BytesIO
from itertools import pairwise
from math import ceil, hypot
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gears3d import files
from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.files import PICTURES
from gears3d.recording import Recording
from gears3d.results import Result
from gears3d.units import parse
from gears3d.views.camera.subject import Subject, measured, moment, picture_table, shots, subject, told
from gears3d.views.plots.section import EDGE, WORDS, Look, Shot, colour_of, name, paint, widening

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.gears import Pair
    from gears3d.measured.segmentation import Measurement
    from gears3d.scenario import Scenario

# Of the picture that a notebook shows [dots an inch].
RESOLUTION = 110


@dataclass(frozen=True, repr=False)
class Strip(Result):
    """Pictures of the mesh over a span; a notebook shows them.

    Args:
        subject: what was filmed.
        look: of the camera.
        shots: the pictures.
        span: begin and length [s].
        periods: of the drive's fluctuation from the first to the last; ``None`` for another kind of span.
    """

    subject: Subject
    look: Look
    shots: tuple[Shot, ...]
    span: tuple[float, float]
    periods: float | None

    def __repr__(self) -> str:
        begin, lasts = self.span
        drawn = f"gap drawn {self.look.factor:g} times as wide"
        return f"<{len(self.shots)} pictures of the mesh from {begin:.6g} s over {lasts:.6g} s, {drawn}>"

    def _repr_png_(self) -> bytes:
        return self.png()

    def png(self) -> bytes:
        """Return the pictures as a PNG for screens."""
        drawn = BytesIO()
        strip(self.subject, self.look, self.shots, self.periods).savefig(drawn, format="png", dpi=RESOLUTION)
        return drawn.getvalue()

    def svg(self) -> str:
        """Return the pictures as an SVG document for pages, without the notes below them."""
        return strip_svg(self.subject, self.look, self.shots, self.periods, columns(len(self.shots)))

    def save(self, path: str | Path, **about: Any) -> Path:
        """Write the strip: a picture, or a folder with the report, the numbers and the picture.

        Args:
            path: a picture, which ends in ``.png``, ``.svg`` or ``.pdf``, or a folder.
            about: for the folder, as :meth:`gears3d.results.Result.save` takes it.

        Returns:
            The path.

        Raises:
            InputError: it cannot be written.
        """
        if Path(path).suffix.lower() in PICTURES:
            return write_strip(path, self.subject, self.look, self.shots, self.periods)
        return super().save(path, **about)

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        return {
            "start_s": self.shots[0].time,
            "period_s": self.subject.period,
            "backlash_m": self.subject.pair.backlash,
            "exaggeration": self.look.factor,
            "teeth_placed": self.subject.placed,
            "frames": self.table(),
        }

    def words(self) -> str:
        """Return what the pictures show, for who does not see them."""
        each = ", ".join(WORDS[shot.flank] for shot in self.shots)
        return f"{len(self.shots)} pictures of the teeth in mesh over {1e3 * self.span[1]:.4g} ms: {each}"

    def table(self) -> list[dict[str, Any]]:
        """Return what each picture shows: time, tooth pairs, state and gaps."""
        return [picture_table(self.subject, shot) for shot in self.shots]


def camera(
    seen: Recording | Measurement,
    scenario: Scenario,
    *,
    frames: int = 9,
    over: str | float = "period",
    at: str | float | None = None,
    zoom: str = "mesh",
    exaggerate: float | None = None,
    backlit: bool = False,
    drive: Literal["left", "right"] = "left",
    numbers: Literal["pairs", "teeth"] = "pairs",
) -> Strip:
    """Take pictures of the teeth in mesh, as a high-speed camera would.

    Args:
        seen: a recording of a run, or a measured record (:func:`gears3d.measured.segmentation.measure`).
        scenario: what was simulated, or the bench.
        frames: pictures, first and last included.
        over: ``"period"``, ``"mesh"``, ``"revolution"``, a number of these, or a time ("20 ms", or a number in s).
        at: time of the first picture, in the same words; by default during a contact of the active flank.
        zoom: ``"mesh"``, ``"tooth"`` or ``"gears"``.
        exaggerate: drawn gap over gap, 1 at true scale; chosen unless given.
        backlit: dark gears before a light, no colours.
        drive: on which side the drive gear is.
        numbers: ``"pairs"`` from the first picture on, or the ``"teeth"`` of each gear.

    Raises:
        InputError: an invalid span, or one outside the recording.

    Source: Rigaud et al. 2020, fig. 8 (3200 pictures a second, nine of them over a period).

    >>> from gears3d import load, simulate
    >>> scenario = load("scenarios/rigaud-2020/fig5-20rpm.toml", {"run.duration": "1 s", "run.settle": "0 s"})
    >>> taken = camera(simulate(scenario, model="rigid"), scenario, frames=5, at="1 period")
    >>> taken
    <5 pictures of the mesh from 0.333333 s over 0.333333 s, gap drawn 8 times as wide>
    >>> [picture["state"] for picture in taken.table()]
    ['active', 'active', 'reverse', 'flight', 'active']
    """
    for option, word, known in (("drive", drive, ("left", "right")), ("numbers", numbers, ("pairs", "teeth"))):
        if word not in known:
            raise InputError(Fault(option, f"is {word!r}", did_you_mean(word, known)))
    filmed = subject(seen, scenario) if isinstance(seen, Recording) else measured(seen, scenario)
    look = Look(filmed.pair, exaggerate, zoom, backlit, drive == "right", numbers == "teeth")
    lasts, periods = span(over, filmed, "over")
    start = filmed.begin(lasts) if at is None else span(at, filmed, "at")[0]
    return Strip(filmed, look, shots(filmed, frames, start, lasts), (start, lasts), periods)


def span(text: str | float, filmed: Subject, key: str) -> tuple[float, float | None]:
    """Return a time [s] and, where it is one in periods, how many."""
    if not isinstance(text, str):
        return float(text), None
    turn = filmed.revolution
    known = {"period": filmed.period, "revolution": turn, "mesh": turn / filmed.pair.drive.teeth}
    number, _, word = text.strip().partition(" ") if " " in text.strip() else ("1", "", text.strip())
    singular = word.strip().removesuffix("es" if word.strip() == "meshes" else "s")
    if singular in known:
        try:
            count = float(number)
        except ValueError:
            raise InputError(Fault(key, f"is {text!r}", 'give e.g. "2 periods"')) from None
        return count * known[singular], count if singular == "period" else None
    try:
        return parse(text, "time"), None
    except InputError as error:
        remedy = 'give a time such as "20 ms", or "2 periods", "1 mesh", "1 revolution"'
        raise InputError([Fault(key, fault.message, remedy) for fault in error.faults]) from None


# Of the curve of the displacement.
POINTS = 2000
# Models in words.
MODELS = {
    "bullet": "rigid bodies in PyBullet",
    "rigid": "rigid model, one degree of freedom",
    "plastic": "plastic impacts in closed form",
    "lubricated": "lubricated model",
}
MM = 1e3
UM = 1e6


def columns(count: int) -> int:
    """Return the number of pictures per row.

    >>> [columns(count) for count in (1, 5, 8, 9, 10, 16)]
    [1, 5, 4, 3, 5, 4]
    """
    if count <= 3:
        return count
    tried = range(3, min(count, 6) + 1)
    return min(tried, key=lambda wide: (-count % wide, abs(wide * 1.25 - 1.6 * ceil(count / wide))))


def strip(subject: Subject, look: Look, shots: tuple[Shot, ...], periods: float | None = 1.0) -> Figure:
    """Draw the strip."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    wide = columns(len(shots))
    high = ceil(len(shots) / wide)
    figure = Figure(figsize=(max(3.3 * wide, 7.0), 3.0 * high + 2.6), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(high + 1, wide, height_ratios=[1.0] * high + [0.55])
    for index, shot in enumerate(shots):
        axes = figure.add_subplot(grid[index // wide, index % wide])
        paint(axes, look, shot)
        if index == 0:
            name(axes, look)
        when = moment(shot, index, len(shots), periods)
        axes.set_title(f"{when}  ({told(shot.pairs)})", loc="left", fontsize=10, fontweight="bold")
        axes.set_title(WORDS[shot.flank], loc="right", fontsize=9, color=_ink(shot.flank))
    course = figure.add_subplot(grid[high, :])
    _course(course, subject, shots, POINTS)
    course.set(xlabel="time after the first picture [ms]", ylabel="gap at the\nactive flanks [µm]")
    course.spines[["top", "right"]].set_visible(False)
    figure.suptitle(_head(subject, shots), fontsize=11, x=0.01, ha="left")
    figure.supxlabel(_foot(subject, look), fontsize=8, x=0.01, ha="left", color="#444444")
    return figure


def write_strip(
    path: str | Path, subject: Subject, look: Look, shots: tuple[Shot, ...], periods: float | None = 1.0
) -> Path:
    """Draw the strip into a file."""
    return files.write_picture(path, lambda: strip(subject, look, shots, periods))


def _ink(flank: int) -> str:
    return "#666666" if flank < 0 else colour_of(flank)


def _course(axes: Any, subject: Subject, shots: tuple[Shot, ...], samples: int) -> tuple[float, float]:
    """Draw the gap over time in the colours of the states, with a line for each picture; return its ends."""
    time = np.linspace(shots[0].time, shots[-1].time, samples)
    active, reverse = subject.gaps(time)
    flank, after, most = subject.flank(time), MM * (time - time[0]), UM * float((active + reverse).max())
    last = max(float(after[-1]), 1e-9)
    axes.set(xlim=(-0.01 * last, 1.01 * last), ylim=(-0.08 * most, 1.08 * most))
    axes.plot(after, np.zeros(samples), color=colour_of(0), linewidth=0.8, zorder=1)
    axes.plot(after, UM * (active + reverse), color=colour_of(1), linewidth=0.8, zorder=1)
    cuts = [0, *(np.flatnonzero(np.diff(flank)) + 1).tolist(), samples]
    for first, end in pairwise(cuts):
        part, code = slice(first, end + 1), int(flank[first])
        axes.plot(after[part], UM * active[part], color=_ink(code), linewidth=2.4 if code >= 0 else 1.4, zorder=2)
    mark = {"markersize": 6.0, "markeredgewidth": 1.0, "color": "white", "zorder": 5}
    for shot in shots:
        axes.plot([MM * shot.after] * 2, [-most, 2.0 * most], color="#bbbbbb", linewidth=0.7, zorder=0)
        axes.plot(MM * shot.after, UM * shot.gaps[0], "o", markeredgecolor=_ink(shot.flank), **mark)
    return last, most


def source(subject: Subject) -> str:
    """Return where the motion comes from, for people."""
    model = str(subject.motion.recording.meta.get("model") or "")
    return MODELS.get(model, model or "recording")


def _head(subject: Subject, shots: tuple[Shot, ...]) -> str:
    return f"{subject.title or 'Gears in mesh'}\n{source(subject)}, from {shots[0].time:.6g} s on"


def _foot(subject: Subject, look: Look) -> str:
    scale = "at true scale"
    if look.factor != 1.0:
        scale = f"drawn {look.factor:g} times as wide as it is, by thinner teeth; all else at true scale"
    numbers = "the teeth of each gear" if look.teeth else "tooth pairs, counted from the first picture"
    lines = [
        f"Gap of {UM * subject.pair.backlash:.4g} µm {scale}.",
        f"Numbers: {numbers}; in brackets the pairs at the pitch point, two where it lies between both.",
    ]
    if look.zoom == "gears":
        lines[1] = "In brackets: the tooth pairs at the pitch point, counted from the first picture."
    if not look.backlit:
        lines.append("Blue: active flanks touch. Orange: reverse flanks touch. Grey: free flight, bars are the gaps.")
    if not subject.placed:
        lines.append("Tooth positions are not recorded: drawn with tooth 1 at the pitch point at the beginning.")
    if subject.pair.drive.helix_angle:
        lines.append("Helical teeth: section in the middle of the face.")
    return "\n".join(lines)


# Units of the drawing in a point of print, at 100 units an inch.
POINT = 100.0 / 72.0
# Of one picture, of the line above it, and between two pictures [units].
WIDE, HIGH, TITLE, APART = 330.0, 264.0, 22.0, 8.0
# Height of the gap over time, and the margins for its axes [units].
COURSE, LEFT, BELOW = 110.0, 62.0, 40.0
# Of the gap over time.
SAMPLES = 1200


class Axes:
    """What the camera draws on: the calls of matplotlib's axes that it makes, as SVG.

    Args:
        place: left and top edge of the picture in the drawing [units].
        size: its width and height [units].
    """

    def __init__(self, place: tuple[float, float], size: tuple[float, float]) -> None:
        self.spines: dict[str, Any] = {}
        self._place, self._size = np.array(place), np.array(size)
        self._low, self._high = np.zeros(2), np.ones(2)
        self._drawn: list[tuple[float, str]] = []

    def set(self, *, xlim: tuple[float, float], ylim: tuple[float, float], **_: Any) -> None:
        """Take the limits of both axes."""
        self._low, self._high = np.array([xlim[0], ylim[0]]), np.array([xlim[1], ylim[1]])

    def _spots(self, x: Any, y: Any) -> np.ndarray:
        """Return points of the picture in units of the drawing (n, 2)."""
        share = (np.column_stack([np.atleast_1d(x), np.atleast_1d(y)]) - self._low) / (self._high - self._low)
        return self._place + self._size * np.column_stack([share[:, 0], 1.0 - share[:, 1]])

    def _path(self, x: Any, y: Any) -> str:
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in self._spots(x, y).tolist())

    def fill(self, x: Any, y: Any, *, facecolor: str, zorder: float = 1.0, **_: Any) -> None:
        """Fill a polygon."""
        self._drawn.append((zorder, f'<polygon points="{self._path(x, y)}" fill="{facecolor}"/>'))

    def plot(self, x: Any, y: Any, fmt: str = "-", *, color: str, zorder: float = 2.0, **style: Any) -> None:
        """Draw a line, or round marks."""
        if fmt == "o":
            radius, edge = 0.5 * POINT * style["markersize"], POINT * style["markeredgewidth"]
            look = f'fill="{color}" stroke="{style["markeredgecolor"]}" stroke-width="{edge:.2f}"'
            marks = (f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{radius:.1f}" {look}/>' for a, b in self._spots(x, y))
            self._drawn.append((zorder, "".join(marks)))
            return
        cap = style.get("solid_capstyle", "round")
        look = f'fill="none" stroke="{color}" stroke-width="{POINT * style["linewidth"]:.2f}" stroke-linecap="{cap}"'
        self._drawn.append((zorder, f'<polyline points="{self._path(x, y)}" {look} stroke-linejoin="round"/>'))

    def text(self, x: float, y: float, text: str, *, fontsize: float, zorder: float = 3.0, **style: Any) -> None:
        """Write a line of text."""
        ((a, b),) = self._spots(x, y).tolist()
        size = POINT * fontsize
        b += {"center": 0.35, "bottom": -0.15, "top": 0.85}.get(style.get("va", "baseline"), 0.0) * size
        halo = 'stroke="#ffffff" stroke-width="3" stroke-opacity="0.75" paint-order="stroke"' if "bbox" in style else ""
        self._drawn.append((zorder, _line(a, b, text, size, style.get("ha", "left"), halo, **style)))

    def annotate(self, _: str, end: tuple[float, float], begin: tuple[float, float], *, arrowprops: Any) -> None:
        """Draw an arrow."""
        (x1, y1), (x2, y2) = self._spots(*np.transpose([begin, end])).tolist()
        along = np.array([x2 - x1, y2 - y1]) / hypot(x2 - x1, y2 - y1)
        across, tip = np.array([-along[1], along[0]]), np.array([x2, y2])
        corners = [tip, tip - 9.0 * along + 4.0 * across, tip - 9.0 * along - 4.0 * across]
        colour, width = arrowprops["color"], POINT * arrowprops["linewidth"]
        head = " ".join(f"{a:.1f},{b:.1f}" for a, b in corners)
        ends = f'x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"'
        line = f'<line {ends} stroke="{colour}" stroke-width="{width:.2f}"/>'
        self._drawn.append((4.0, f'{line}<polygon points="{head}" fill="{colour}"/>'))

    def svg(self, number: int) -> str:
        """Return all that was drawn, cut off at the frame; ``number`` tells the pictures of a drawing apart."""
        (x, y), (wide, high) = self._place, self._size
        frame = f'x="{x:g}" y="{y:g}" width="{wide:g}" height="{high:g}"'
        drawn = "".join(piece for _, piece in sorted(self._drawn, key=lambda one: one[0]))
        return (
            f'<clipPath id="frame{number}"><rect {frame}/></clipPath><g clip-path="url(#frame{number})">{drawn}</g>'
            f'<rect {frame} fill="none" stroke="#888888"/>'
        )


def _line(
    x: float, y: float, text: str, size: float, side: str, look: str = "", color: str = EDGE, **style: Any
) -> str:
    anchor = {"left": "start", "center": "middle", "right": "end"}[side]
    weight = ' font-weight="bold"' if style.get("fontweight") == "bold" else ""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:.1f}" text-anchor="{anchor}" fill="{color}"{weight} {look}>'
        f"{escape(text)}</text>"
    )


def strip_svg(subject: Subject, look: Look, shots: tuple[Shot, ...], periods: float | None, columns: int) -> str:
    """Return the strip as an SVG document."""
    rows = ceil(len(shots) / columns)
    whole = columns * (WIDE + APART) - APART, rows * (TITLE + HIGH + APART) + COURSE + BELOW
    pieces = []
    for index, shot in enumerate(shots):
        left, top = index % columns * (WIDE + APART), index // columns * (TITLE + HIGH + APART)
        axes: Any = Axes((left, top + TITLE), (WIDE, HIGH))
        paint(axes, look, shot)
        if index == 0:
            name(axes, look)
        when = f"{moment(shot, index, len(shots), periods)}  ({told(shot.pairs)})"
        pieces += [
            axes.svg(index),
            _line(left, top + 16.0, when, 13.9, "left", fontweight="bold"),
            _line(left + WIDE, top + 16.0, WORDS[shot.flank], 12.5, "right", color=_ink(shot.flank)),
        ]
    pieces.append(_course_svg(subject, shots, (LEFT, rows * (TITLE + HIGH + APART)), whole[0] - LEFT, len(shots)))
    return _document(*whole, pieces)


def _course_svg(subject: Subject, shots: tuple[Shot, ...], place: tuple[float, float], wide: float, number: int) -> str:
    """Return the gap at the active flanks over time, with its axes."""
    axes: Any = Axes(place, (wide, COURSE))
    last, most = _course(axes, subject, shots, SAMPLES)
    left, top = place
    low = top + COURSE
    labels = [
        _line(left - 6.0, top + (1.08 - share) / 1.16 * COURSE + 4.0, f"{share * most:.3g}", 12.0, "right")
        for share in (0, 1)
    ]
    labels += [
        _line(left + (0.01 + share) / 1.02 * wide, low + 15.0, f"{share * last:.4g}", 12.0, side)
        for share, side in ((0.0, "center"), (0.5, "center"), (1.0, "right"))
    ]
    labels.append(_line(left + 0.5 * wide, low + 32.0, "time after the first picture [ms]", 12.0, "center"))
    turned = f'transform="rotate(-90 12 {top + 0.5 * COURSE:g})"'
    labels.append(_line(12.0, top + 0.5 * COURSE, "active gap [µm]", 12.0, "center", turned))
    return axes.svg(number) + "".join(labels)


def section_svg(pair: Pair) -> str:
    """Return the mesh at true scale with its active flanks in contact, and in the middle of the gap drawn wider."""
    pair = replace(pair, deviations=(), mounting=())
    pieces = []
    for number, (factor, share, flank) in enumerate(((1.0, 0.0, 0), (widening(pair), 0.5, -1))):
        look = Look(pair, factor, "tooth" if number else "mesh")
        turn = share * pair.backlash
        shot = Shot(0.0, 0.0, 0.0, share, flank, (turn, pair.backlash - turn), 1, 1.0, (1,))
        left = number * (WIDE + APART)
        axes: Any = Axes((left, TITLE), (WIDE, HIGH))
        paint(axes, look, shot)
        name(axes, look)
        scale = "true scale" if factor == 1.0 else f"gap drawn {factor:g} times as wide"
        words = f"{scale}, {'mid-gap' if number else 'active flanks in contact'}"
        pieces += [axes.svg(number), _line(left, 16.0, words, 13.9, "left", fontweight="bold")]
    return _document(2 * WIDE + APART, TITLE + HIGH, pieces)


def _document(wide: float, high: float, pieces: list[str]) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:g}" height="{high:g}" viewBox="0 0 {wide:g} {high:g}" '
        f'font-family="sans-serif"><rect width="100%" height="100%" fill="#ffffff"/>{"".join(pieces)}</svg>'
    )
