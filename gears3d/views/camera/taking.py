"""Pictures of a recording in one call: what ``gears3d camera`` does, from Python."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.files import PICTURES
from gears3d.recording import Recording
from gears3d.results import Result
from gears3d.units import parse
from gears3d.views.camera.strip import columns, strip, strip_svg, write_strip
from gears3d.views.camera.subject import Subject, measured, picture_table, shots, subject
from gears3d.views.plots.panel import WORDS, Look, Shot

if TYPE_CHECKING:
    from gears3d.measured.segmentation import Measurement
    from gears3d.scenario import Scenario

RESOLUTION = 110
"""Of the picture that a notebook shows [dots an inch]."""


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
    for name, word, known in (("drive", drive, ("left", "right")), ("numbers", numbers, ("pairs", "teeth"))):
        if word not in known:
            raise InputError(Fault(name, f"is {word!r}", did_you_mean(word, known)))
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
